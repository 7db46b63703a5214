"""Settings of strand files, and the file's layout that follows from them."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar

from ..errors import HairloomError
from ..params import Owner, Settings, choice, integer, number, toggle
from .files.file_space import FileSpace
from .groom_presets import GroomPreset
from .strand_formats import STRAND_FORMATS, StrandFormat
from .tressfx_layout import VERTEX_COUNTS

#: the default of the format or the engine
FORMAT_DEFAULT = "default"


def _engines() -> tuple[tuple[str, str, str], ...]:
    """The engines of all formats, with each format's description of them."""
    titles: dict[str, str] = {}
    about: dict[str, list[str]] = {}
    for each in STRAND_FORMATS:
        for layout in each.layouts if "engine" in each.options else ():
            titles[layout.name] = layout.title
            about.setdefault(layout.name, []).append(f"{each.title}: {layout.about}")
    return tuple((name, title, ". ".join(about[name])) for name, title in titles.items())


@dataclass(frozen=True, kw_only=True)
class StrandExportSettings(Settings):
    """Options of a strand file beside its path and format; each format has some of them."""

    section: ClassVar[str] = "strands_export"
    title: ClassVar[str] = "Strand Files"
    help_page = "strands_export"
    owner: ClassVar[Owner] = "job"
    panels: ClassVar[tuple[str, ...]] = ("Engine", "Include", "TressFX", "Animation")

    engine: str = choice(
        FORMAT_DEFAULT,
        (
            (
                FORMAT_DEFAULT,
                "Default",
                "The format's usual program: Unreal for Alembic, Blender for USD",
            ),
            *_engines(),
        ),
        label="Target",
        description="Program that the file is for; sets unit, axes and contents",
        panel="Engine",
    )
    basis: str = choice(
        FORMAT_DEFAULT,
        (
            (FORMAT_DEFAULT, "Default", "Straight for Alembic, curved for USD"),
            ("linear", "Straight", "Straight lines between points"),
            ("cubic", "Curved", "Catmull-Rom curves through the points"),
        ),
        label="Curves",
        description="Shape of the hair between its points, in Alembic and USD",
        panel="Engine",
    )
    up: str = choice(
        FORMAT_DEFAULT,
        (
            (FORMAT_DEFAULT, "Default", "The program's up axis; Y for TressFX, Z for .hair"),
            ("Y", "Y Up", "The file's Y axis points up, as in most engines"),
            ("Z", "Z Up", "The file's Z axis points up, as in Blender"),
        ),
        label="Up",
        description="Axis that points up in the file; not for Alembic",
        panel="Engine",
    )
    scale: float = number(
        0.0,
        label="Scale",
        description="Metres per unit of the file: 0.01 writes centimetres, 0 uses the program's "
        "unit; not for Alembic",
        soft=(0.0, 100.0),
        hard=(0.0, 1.0e6),
        panel="Engine",
    )
    parts: str = choice(
        FORMAT_DEFAULT,
        (
            (
                FORMAT_DEFAULT,
                "Default",
                "Strands and guides for Unreal, strands for other programs",
            ),
            ("strands", "Strands", "The visible strands"),
            ("guides", "Guides", "Only the guides"),
            (
                "both",
                "Strands and Guides",
                "The strands, and copies of the guides that are marked as guides",
            ),
        ),
        label="Contents",
        description="What to write; TressFX calls all of it guides",
        panel="Include",
    )
    by_group: bool = toggle(
        False,
        label="Split by Group",
        description="Write an object or prim for each group, as is always done for Unity, or a "
        "file for each group in formats without groups: TressFX and .hair",
        panel="Include",
    )
    bones: bool = toggle(
        True,
        label="Bones",
        description="If an armature moves the head by vertex groups, write a .tfxbone file beside "
        "the .tfx file, with the bones that carry each strand",
        panel="Include",
    )
    point_uv: bool = toggle(
        False,
        label="Point UVs",
        description="Also write UVs of points. TressFX: u across the strands, v along them. "
        ".hair: root UVs as LuxCore does; other programs may reject such a file",
        panel="Include",
    )
    vertex_count: str = choice(
        "fit",
        (
            ("fit", "Automatic", "Use the smallest count that fits all strands"),
            *((str(n), str(n), f"{n} vertices on each strand") for n in VERTEX_COUNTS),
        ),
        label="Vertices",
        description="Number of vertices per strand; strands with other counts are resampled",
        panel="TressFX",
    )
    held_count: int = integer(
        1,
        label="Held Vertices",
        description="Number of vertices at the root that TressFX does not move; AMD's exporter "
        "uses two",
        soft=(0, 8),
        hard=(0, 8),
        panel="TressFX",
    )
    pad_to_64: bool = toggle(
        False,
        label="Pad to 64",
        description="Repeat the last strand up to a multiple of 64, as TressFX simulates 64 at a "
        "time; its own loader does this by itself, others may not",
        panel="TressFX",
    )
    use_bake: bool = toggle(
        True,
        label="Use Bake",
        description="Write the motion baked by Hairloom if hair has a bake. If off, write the "
        "motion of Blender's own animation and modifiers",
        panel="Animation",
    )


def layout_of(kind: StrandFormat, settings: StrandExportSettings) -> GroomPreset:
    """The engine's layout of the file, with the artist's choices applied to it.

    Raises:
        HairloomError: an engine or option that the format does not have.
    """
    _check_options(kind, settings)
    layout = _engine_layout(kind, settings.engine)
    space = layout.space
    if settings.scale or settings.up != FORMAT_DEFAULT:
        up = space.up if settings.up == FORMAT_DEFAULT else settings.up
        space = FileSpace(up, 1.0 / settings.scale if settings.scale else space.units_per_metre)
    return replace(
        layout,
        space=space,
        parts=layout.parts if settings.parts == FORMAT_DEFAULT else settings.parts,
        splits_groups=layout.splits_groups or settings.by_group,
        basis=layout.basis if settings.basis == FORMAT_DEFAULT else settings.basis,
    )


def metres_per_unit(kind: StrandFormat, settings: StrandExportSettings) -> float:
    """Metres in one unit of the file.

    Raises:
        HairloomError: as `layout_of`.
    """
    return settings.scale or 1.0 / layout_of(kind, settings).space.units_per_metre


def _engine_layout(kind: StrandFormat, engine: str) -> GroomPreset:
    """The layout for this engine, or the format's usual one."""
    if engine == FORMAT_DEFAULT:
        return kind.layouts[0]
    for layout in kind.layouts:
        if layout.name == engine:
            return layout
    known = ", ".join(layout.name for layout in kind.layouts)
    raise HairloomError(
        f"{kind.title} has no layout for '{engine}'",
        place="engine",
        remedy=f"Choose one of {known}",
    )


def _check_options(kind: StrandFormat, settings: StrandExportSettings) -> None:
    for parameter in settings.parameters():
        is_chosen = getattr(settings, parameter.name) != parameter.default
        if is_chosen and parameter.name not in kind.options:
            raise HairloomError(
                f"{kind.title} does not have the option '{parameter.label}'",
                place=parameter.name,
                remedy="Omit the option, or choose another format",
            )
