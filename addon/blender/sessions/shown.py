"""What is drawn of a groom: the snapshot that hangs on its rig, and on what the artist has set."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from ...arrays import Floats
from ...pipeline import Rig
from ...render.snapshot import SECTIONS, Snapshot
from ...shading.marschner.look import fibre_of
from ...shading.marschner.tables import shape_of
from ...shading.settings import ShadingSettings
from ..properties.groom_settings import GroomSettings


def snapshot_of(rig: Rig, occlusion: Floats | None, rank: Floats | None) -> Snapshot:
    """The groom at rest, with all that does not change while it moves.

    Args:
        occlusion: (strand_count, cv_count) in [0, 1], at rest.
        rank: (strand_count,), see `pipeline.strand_ranks`.
    """
    strands = rig.strands
    return Snapshot(
        strands=strands.grid,
        radius=strands.radius.reshape(strands.strand_count, -1),
        occlusion=occlusion,
        guide=np.ascontiguousarray(rig.weights.guide[:, 0]),
        group=strands.group,
        rank=rank,
    )


def with_settings(snapshot: Snapshot, settings: GroomSettings) -> Snapshot:
    """The same groom by these settings."""
    sections: dict[str, Any] = {name: settings[kind] for name, kind in SECTIONS.items()}
    return replace(snapshot, debug_view=settings.debug_view, **sections)


def with_tables(snapshot: Snapshot, size: int) -> Snapshot:
    """The same by look-up tables of this size, for hair that needs any."""
    return snapshot if snapshot.table_size == size else replace(snapshot, table_size=size)


def shapes_alike(one: ShadingSettings, other: ShadingSettings) -> bool:
    """Whether the same look-up tables serve both; a change of colour needs no others."""
    if other.model != "marschner":
        return True
    return one.model == other.model and shape_of(fibre_of(one)) == shape_of(fibre_of(other))


def with_all_strands(snapshot: Snapshot) -> Snapshot:
    """The same where nothing hides hair, so that none is left out."""
    return replace(snapshot, hiders=None, detail=replace(snapshot.detail, culling="none"))
