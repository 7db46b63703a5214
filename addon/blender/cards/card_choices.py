"""What an artist may choose where cards are written: identifier, label, description."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from ...cards.joints import JointChoices
from ...exchange.cards.card_formats import FBX, FORMATS, GLB, OBJ, USD
from ...exchange.files.names import plain_name
from .files import CardOutput
from .motion import MotionChoices
from .textures import TextureFiles

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
