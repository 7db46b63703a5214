"""How strands are to be written, whatever the format: what an artist chooses, and what follows."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType

from ..errors import HairloomError
from .files.file_space import FileSpace
from .groom_presets import PRESETS, GroomPreset
from .hair_file import MAX_SEGMENTS
from .strand_formats import ALEMBIC, HAIR, TRESSFX, USD, StrandFormat
from .tfxbone import BoneWeights
from .tressfx_layout import VERTEX_COUNTS
from .usd.groom_usd import USD_SPACES

#: format -> the engines that it knows, the usual one first; others know none
ENGINES: Mapping[str, tuple[str, ...]] = MappingProxyType(
    {ALEMBIC.name: tuple(PRESETS), USD.name: tuple(USD_SPACES)}
)
#: format -> up axis and metres in one unit where nothing else is asked for
_SPACES = {TRESSFX.name: ("Y", 1.0), HAIR.name: ("Z", 1.0)}
_MAX_POINTS = {TRESSFX.name: VERTEX_COUNTS[-1], HAIR.name: MAX_SEGMENTS + 1}
_ENDLESS = (1 << 31) - 1


@dataclass(frozen=True)
class StrandOutput:
    """What is asked for; `write_strands` reports what a format cannot do.

    engine: one of ENGINES; "" is the format's usual one. It decides unit, axes and parts.
    parts: "strands", "guides" or "both"; "" is what the engine wants.
    by_group: an object of its own for each group, or a file where the format has no groups.
    up: "Y" or "Z" in place of the engine's axis; not for Alembic.
    scale: metres in one unit of the file, in place of the engine's; not for Alembic.
    basis: "linear" between points or "cubic" through them; "" is the format's usual one. For
        Alembic and USD.
    vertex_count: of each strand in .tfx; None: the smallest that holds the longest strand.
    held_count: vertices at the root that TressFX does not move.
    fills_groups: repeat the last strand until .tfx holds a multiple of 64, as TressFX simulates;
        its own loader does so by itself.
    point_uv: UVs of points too, in .tfx and as LuxCore's in .hair.
    bones: of the groom's strands; they go beside .tfx as .tfxbone.
    """

    engine: str = ""
    parts: str = ""
    by_group: bool = False
    up: str = ""
    scale: float | None = None
    basis: str = ""
    vertex_count: int | None = None
    held_count: int = 1
    fills_groups: bool = False
    point_uv: bool = False
    bones: BoneWeights | None = None


def metres_per_unit(kind: StrandFormat, output: StrandOutput) -> float:
    """Metres in one unit of the file.

    Raises:
        HairloomError: an engine that the format does not know.
    """
    if kind is ALEMBIC:
        return 1.0 / PRESETS[_engine(kind, output)].space.per_metre
    return _up_and_scale(kind, output)[1]


def layout_of(kind: StrandFormat, output: StrandOutput) -> GroomPreset:
    """The file's layout, for formats other than Alembic in its terms too, so that one check does.

    Raises:
        HairloomError: an engine that the format does not know, or a unit that makes no sense.
    """
    engine = _engine(kind, output)
    if kind is ALEMBIC:
        preset = PRESETS[engine]
        return replace(
            preset,
            parts=output.parts or preset.parts,
            is_split=preset.is_split or output.by_group,
            basis=output.basis or preset.basis,
        )
    up, scale = _up_and_scale(kind, output)
    return GroomPreset(
        engine or kind.name,
        FileSpace(up, 1.0 / scale),
        max_points=_MAX_POINTS.get(kind.name, _ENDLESS),
        parts=output.parts or ("both" if engine == "unreal" else "strands"),
        is_split=output.by_group,
        basis=output.basis or "cubic",
    )


def _engine(kind: StrandFormat, output: StrandOutput) -> str:
    """The engine that is asked for, or the format's usual one; "" where it knows none."""
    known = ENGINES.get(kind.name, ())
    if not output.engine:
        return known[0] if known else ""
    if output.engine not in known:
        raise HairloomError(
            f"{kind.title} has no layout for '{output.engine}'",
            place="engine",
            remedy=f"Choose one of {', '.join(known)}" if known else "Choose an up axis and a unit",
        )
    return output.engine


def _up_and_scale(kind: StrandFormat, output: StrandOutput) -> tuple[str, float]:
    engine = _engine(kind, output)
    up, scale = _SPACES.get(kind.name, ("Z", 1.0))
    if engine:
        up, scale = USD_SPACES[engine].up, USD_SPACES[engine].scale
    up, scale = output.up or up, scale if output.scale is None else output.scale
    if not 0.0 < scale < float("inf"):
        raise HairloomError(
            f"a unit of {scale} m makes no sense",
            place="scale",
            remedy="Use a number above 0, such as 0.01 for centimetres",
        )
    return up, scale
