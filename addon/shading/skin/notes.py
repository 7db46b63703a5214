"""Notes for the artist on a head's UVs, where its shadow should be soft."""

from __future__ import annotations

from ...strands import Surface
from ..volume.settings import VolumeSettings
from .chart import chart_of, covering
from .settings import SkinSettings

#: texels along the longer side of a map that is only checked for overlaps, and its margin
_RESOLUTION, _MARGIN = 256, 2
#: fraction of overlapping texels that is not reported
_FEW = 0.002


def skin_notes(
    head: Surface | None, settings: SkinSettings, volume: VolumeSettings
) -> tuple[str, ...]:
    """Where the shadow on a head keeps hard edges though it should be soft, and why."""
    is_wanted = settings.soft_shadow and settings.softness and volume.shadows != "none"
    return () if head is None or not is_wanted else uv_notes(head)


def uv_notes(head: Surface) -> tuple[str, ...]:
    """What is wrong with a head's UVs."""
    if head.corner_uv is None:
        return ("the head has no UVs: the hair's shadow on it keeps its hard edges",)
    chart = chart_of(head.corner_uv, _RESOLUTION, _MARGIN)
    if not chart.is_mapped.any():
        return ("the head's UVs have no area: the hair's shadow on it keeps its hard edges",)
    triangle, overlaps = covering(chart)
    fraction = float(overlaps.sum() / max(int((triangle >= 0).sum()), 1))
    if fraction < _FEW:
        return ()
    return (
        f"the head's UVs overlap in {fraction:.0%} of their area: there the hair's shadow keeps "
        "its hard edges",
    )
