"""What an artist may choose where cards are written: identifier, label, description."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from ...cards.joints import JointChoices
from ...exchange.cards.card_formats import FBX, FORMATS, GLB, OBJ, USD
from ...exchange.files.names import plain_name
from ..command_line.job_options import add_frames_option
from .card_files import CardOutput
from .card_motion import MotionChoices
from .card_textures import TextureFiles

FORMAT_ITEMS = (
    (GLB.name, "glTF (.glb)", "Metres, Y up; for three.js, Godot and most others"),
    (FBX.name, "FBX (.fbx)", "Centimetres, Y up, with a LOD group; for Unreal and Unity"),
    (USD.name, "USD (.usd)", "Metres, Z up"),
    (OBJ.name, "Wavefront (.obj)", "Metres, Y up; without tangents"),
)
PACKING_ITEMS = (
    ("hairloom", "One Each", "A file for each map, as Hairloom's own shaders read them"),
    ("gltf", "glTF", "Base colour with alpha, occlusion, normal, anisotropy"),
    ("unreal", "Unreal", "The default layout of Unreal's card textures"),
    ("unreal_compact", "Unreal Compact", "The compact layout of Unreal's card textures"),
    ("unity_hdrp", "Unity HDRP", "As Unity's hair material in HDRP reads them"),
    ("godot", "Godot", "As Godot's standard material reads them"),
)
TEXTURE_ITEMS = (
    ("png", "PNG", "8 bits, and 16 where steps would be seen"),
    ("exr", "OpenEXR", "Half floats"),
    ("dds", "DDS", "Compressed for GPUs (BC4, BC5, BC7), with all mip maps"),
    ("dds_plain", "DDS, Plain", "Not compressed, with all mip maps"),
)
MOTION_ITEMS = (
    ("none", "None", "The cards at rest"),
    (
        "joints",
        "Joints",
        "GLB: chains of joints that cards are skinned to, with keys; every engine plays them",
    ),
    (
        "texture",
        "Vertex Textures",
        "GLB, FBX, USD: where each vertex is in each frame, for a vertex shader; exact",
    ),
)
SPACE_ITEMS = (
    ("head", "With the Head", "Without the head's own motion: attach the hair to the head"),
    ("world", "World", "With the head's own motion"),
)
DEPTH_ITEMS = (
    ("half", "Half", "16 bits: within a two thousandth of how far a vertex moves"),
    ("float", "Float", "32 bits"),
)
SUFFIXES = tuple(suffix for each in FORMATS for suffix in each.suffixes)


def suffix_of(format_name: str, path: str) -> str:
    """The usual suffix of a format, or the one that the path has where it is of the format."""
    (chosen,) = (each for each in FORMATS if each.name == format_name)
    suffix = Path(path).suffix.lower()
    return suffix if suffix in chosen.suffixes else chosen.suffixes[0]


def card_output(values: Any, path: Path, hair_name: str) -> CardOutput:
    """How an operator with these properties writes to a path; a suffix that is known counts."""
    is_known = path.suffix.lower() in SUFFIXES
    return CardOutput(
        None if is_known else values.format,
        plain_name(hair_name),
        portable=not values.attributes,
        index_buffer=values.index_buffer,
        textures=TextureFiles(values.packing, values.textures),
        motion=motion_choices(values),
    )


def motion_choices(values: Any) -> MotionChoices:
    """Of an operator with these properties, or of options."""
    joints = JointChoices(values.chains, values.joints, values.joint_error / 100.0)
    return MotionChoices(values.motion, values.motion_space, values.motion_depth, joints)


def file_stem(hair_name: str) -> str:
    """What a file is called after the hair in it."""
    return plain_name(hair_name)


def add_card_options(job: Any) -> None:
    """The same on the command line: for the group of options of the verb."""
    job.add_argument(
        "--format",
        choices=[each.name for each in FORMATS],
        help="of the file (default: by its suffix)",
    )
    job.add_argument(
        "--levels", type=int, metavar="N", help="levels of detail (default: those of cards.levels)"
    )
    job.add_argument(
        "--index-buffer",
        action="store_true",
        help="write the sorted indices as NAME.indices.bin too",
    )
    job.add_argument(
        "--packing",
        choices=[name for name, *_ in PACKING_ITEMS],
        default="hairloom",
        help="what the channels of the textures hold (default: a file for each map)",
    )
    job.add_argument(
        "--textures",
        choices=[name for name, *_ in TEXTURE_ITEMS],
        default="png",
        help="format of the textures",
    )
    attributes = job.add_mutually_exclusive_group()
    attributes.add_argument(
        "--portable",
        action="store_true",
        default=True,
        help="ambient occlusion in a UV map alone, which every engine reads (default)",
    )
    attributes.add_argument(
        "--attributes",
        action="store_false",
        dest="portable",
        help="ambient occlusion as the attribute _AO too, which some engines refuse",
    )
    _add_motion_options(job)


def _add_motion_options(job: Any) -> None:
    job.add_argument(
        "--motion",
        choices=[name for name, *_ in MOTION_ITEMS],
        default="none",
        help="of --take, or of the bake of the object --groom, as joints with keys (GLB) or as "
        "vertex animation textures",
    )
    job.add_argument("--take", help="a take written by 'simulate'")
    add_frames_option(job, "of the motion; a take's count from 0 (default: all)")
    job.add_argument(
        "--motion-space",
        choices=[name for name, *_ in SPACE_ITEMS],
        default="head",
        help="head: without the head's own motion, to be attached to it (default)",
    )
    job.add_argument(
        "--motion-depth",
        choices=[name for name, *_ in DEPTH_ITEMS],
        default="half",
        help="of vertex animation textures",
    )
    defaults = JointChoices()
    job.add_argument(
        "--chains", type=int, default=defaults.chains, metavar="N", help="of joints, at most"
    )
    job.add_argument(
        "--joints",
        type=int,
        default=defaults.joints,
        metavar="N",
        help="in a chain, at most, 2 to 16; as few as stay under the error",
    )
    job.add_argument(
        "--joint-error",
        type=float,
        default=100.0 * defaults.error,
        metavar="PERCENT",
        help="root mean square distance from the simulation, of the mean length of the hair",
    )
