"""How hair cards are written to files: for the window, the command line and the docs."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from ..params import Owner, Settings, choice, integer, number, toggle

#: motion -> the parameters that belong to it
OF_MOTION: dict[str, tuple[str, ...]] = {
    "none": (),
    "joints": ("motion_space", "chains", "joints", "joint_error"),
    "springs": ("spring_joints",),
    "texture": ("motion_space", "motion_depth"),
}


@dataclass(frozen=True, kw_only=True)
class CardExportSettings(Settings):
    """What an artist chooses beyond the file and its format."""

    section: ClassVar[str] = "cards_export"
    title: ClassVar[str] = "Card Files"
    help_page = "cards_export"
    owner: ClassVar[Owner] = "job"

    packing: str = choice(
        "hairloom",
        (
            ("hairloom", "One Each", "One file for each map, as Hairloom's own shaders read them"),
            ("gltf", "glTF", "Base colour with alpha, occlusion, normal, anisotropy"),
            ("unreal", "Unreal", "The default layout of Unreal's card textures"),
            ("unreal_compact", "Unreal Compact", "The compact layout of Unreal's card textures"),
            ("unity_hdrp", "Unity HDRP", "As Unity's hair material in HDRP reads them"),
            ("godot", "Godot", "As Godot's standard material reads them"),
        ),
        label="Packing",
        description="Contents of the textures' channels",
    )
    textures: str = choice(
        "png",
        (
            ("png", "PNG", "8 bits, or 16 where steps would show"),
            ("exr", "OpenEXR", "Half floats"),
            ("dds", "DDS", "Compressed for GPUs (BC4, BC5, BC7), with all mip maps"),
            ("dds_plain", "DDS, Plain", "Not compressed, with all mip maps"),
        ),
        label="Textures",
        description="Format of the textures",
    )
    attributes: bool = toggle(
        False,
        label="Custom Attributes",
        description="Also write ambient occlusion as the attribute _AO, beside the second UV map; "
        "some engines reject such attributes",
    )
    index_buffer: bool = toggle(
        False,
        label="Index Buffer",
        description="Also write the sorted indices as a separate file, NAME.indices.bin, for "
        "engines that keep their own vertices",
    )
    page: bool = toggle(
        False,
        label="Web Page",
        description="Also write NAME.html, a single file that shows the hair in any browser, "
        "without a network; GLB only",
    )
    page_texture: str = choice(
        "1024",
        tuple((size, size, f"Up to {size} texels a side") for size in ("512", "1024", "2048")),
        label="Page Textures",
        description="Size to which the textures in the web page are scaled down",
    )
    page_head: bool = toggle(
        True,
        label="Page Head",
        description="Also show the mesh that hair grows on in the web page, with its materials",
    )
    motion: str = choice(
        "none",
        (
            ("none", "None", "Write the cards at rest"),
            (
                "joints",
                "Joints",
                "GLB: skin cards to chains of joints with keyframes, which every engine plays",
            ),
            (
                "springs",
                "Springs",
                "GLB: skin cards to chains of joints moved by the engine's own physics "
                "(VRMC_springBone), fitted to the bake",
            ),
            (
                "texture",
                "Vertex Textures",
                (
                    "GLB, FBX, USD: store the position of each vertex in each frame, for a vertex "
                    "shader; exact"
                ),
            ),
        ),
        label="Motion",
        description="How the hair's baked motion is written",
    )
    motion_space: str = choice(
        "head",
        (
            (
                "head",
                "With the Head",
                "Leave out the head's own motion; attach the hair to the head in the engine",
            ),
            ("world", "World", "Include the head's own motion"),
        ),
        label="Space",
        description="Space in which the motion is written",
    )
    motion_depth: str = choice(
        "half",
        (
            ("half", "Half", "16 bits: exact to a two-thousandth of a vertex's movement"),
            ("float", "Float", "32 bits"),
        ),
        label="Depth",
        description="Precision of the motion textures",
    )
    # 127 chains of two joints each and the root are as many joints as a byte can number
    chains: int = integer(
        127,
        label="Chains",
        description="Maximum number of chains of joints; cards that move alike share one",
        soft=(1, 256),
        hard=(1, 2048),
    )
    joints: int = integer(
        16,
        label="Joints",
        description="Maximum number of joints per chain; as few as the error allows are used",
        soft=(2, 16),
        hard=(2, 16),
    )
    joint_error: float = number(
        1.0,
        label="Error",
        description="Maximum root mean square distance of cards from the simulation, as a "
        "fraction of the median length of the guides",
        soft=(0.01, 10.0),
        hard=(0.01, 100.0),
        unit="percent",
    )
    spring_joints: int = integer(
        120,
        label="Spring Joints",
        description="Maximum number of joints moved by springs; fewer are used if they do nearly "
        "as well",
        soft=(10, 250),
        hard=(5, 1024),
    )
