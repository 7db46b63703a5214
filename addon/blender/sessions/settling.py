"""Settle: hair falls onto its colliders, and the fallen shape becomes that of the curves.

The curves fall as brushes comb them, before their modifiers: a modifier that curls them acts on the
fallen curves. The combed shape is kept as an attribute of their points.
"""

from __future__ import annotations

from collections.abc import Callable, Generator

import bpy
import numpy as np

from ... import rig_flow, settle_flow
from ...arrays import Bools
from ...dynamics.colliders import PosedCollider
from ...dynamics.settings import DynamicsSettings
from ...dynamics.settle_settings import SettleSettings
from ...errors import HairloomError
from ...groom.rest_hair import carry_with_surface
from ...groom.settings import GuideSettings
from ...paint_flow import painted_guides
from ...rig_flow import Rig
from ...shading.ambient_settings import AmbientSettings
from ...strands import StrandSet
from ...strands.clean import Cleaned
from ..base.objects import check_curves_editable, head_of
from ..base.outcome import Outcome
from ..colliders.fields import head_field_of
from ..colliders.scene_colliders import SceneColliders
from ..scene.curves import read_original_curves, write_original_curves
from ..scene.forces import gravity_of
from ..scene.masks import MaskReader
from ..scene.sag_correction import set_full_sag_correction
from ..scene.shape_backup import BEFORE_SETTLE
from .groom_source import GroomSource
from .prepared_groom import PreparedGroom


def settle_hair(
    hair: bpy.types.Object, depsgraph: bpy.types.Depsgraph, settings: SettleSettings
) -> Generator[float, None, Callable[[], Outcome]]:
    """Let hair fall in the present pose of its body; yields the progress, 0 to 1.

    Returns a function that writes the settled shape; until it is called, the curves do not change.

    Hair that has settled, and has not been combed since, falls from its combed shape again, so that
    other settings can be tried.

    Raises:
        HairloomError: no usable hair, it is linked from another file, its roots are away from its
            surface, or the surface is gone.
    """
    check_curves_editable(hair, depsgraph)
    source = GroomSource(hair, depsgraph)
    own = read_original_curves(hair, depsgraph, BEFORE_SETTLE.read_if_unchanged(hair))
    read = source.source
    strands = own.strands
    if read.rest is not None and read.head is not None:
        strands = carry_with_surface(strands, read.rest.surface, read.head)
    guides = settle_flow.settle_guide_settings(strands, source.settings[GuideSettings])
    rig = rig_flow.prepare(
        strands,
        read.head,
        guides,
        place=hair.name,
        holders=read.holders,
        placement=rig_flow.ChildPlacement(partings=read.partings),
    )
    _check_roots(hair, rig)
    dynamics, pose = source.settings[DynamicsSettings], source.pose(rig, depsgraph)
    posed, warnings = _colliders(hair, source, rig, dynamics, depsgraph)
    mask_reader = MaskReader(
        hair, head_of(hair), read.head, strands, own.curve_indices, is_before_modifiers=True
    )
    masks, notes = mask_reader.masks(dynamics, depsgraph)
    warnings += tuple(note for note in notes if note not in warnings)
    gravity = gravity_of(depsgraph.scene)
    painted = painted_guides(rig, masks) if masks else None
    fallen = yield from settle_flow.settle(rig, pose, posed, dynamics, settings, gravity, painted)
    head = head_field_of(rig.head)
    settled, is_out = settle_flow.settled_curves(strands, rig, fallen, head)
    if read.rest is not None and read.head is not None:
        settled = carry_with_surface(settled, read.head, read.rest.surface)
    return lambda: _stored(hair, own, settled, is_out, warnings, depsgraph)


def _stored(
    hair: bpy.types.Object,
    own: Cleaned,
    settled: StrandSet,
    is_out: Bools,
    warnings: tuple[str, ...],
    depsgraph: bpy.types.Depsgraph,
) -> Outcome:
    """Write the settled shape, and keep the combed one. If hair settles again without having been
    combed, the combed shape from before the first time stays.

    Args:
        is_out: (strand_count,) whether each strand is outside the surface.
    """
    BEFORE_SETTLE.save(hair)
    write_original_curves(hair, own, settled.points, depsgraph)
    BEFORE_SETTLE.mark_result(hair)
    warnings += set_full_sag_correction(hair.data)
    lost = int((~is_out).sum())
    if lost:
        are = "1 curve is" if lost == 1 else f"{lost:,} curves are"
        warnings += (f"{hair.name}: {are} still in the surface. Comb the curves there outwards.",)
    tips = own.strands.offsets[1:] - 1
    moved_by = np.linalg.norm(settled.points[tips] - own.strands.points[tips], axis=1)
    result = (
        f"{hair.name}: {own.strands.strand_count:,} curves have settled, their tips moved by "
        f"{100.0 * float(np.median(moved_by)):.1f} cm"
    )
    return Outcome(result, own.dropped, warnings)


def _check_roots(hair: bpy.types.Object, rig: Rig) -> None:
    """Check that the roots are on the surface.

    Raises:
        HairloomError: most roots are away from the surface in its present pose.
    """
    loose = PreparedGroom(rig, AmbientSettings()).loose_roots
    if 2 * loose > rig.strands.strand_count:
        raise HairloomError(
            f"{loose:,} of {rig.strands.strand_count:,} roots are away from the surface in its "
            "present pose",
            place=hair.name,
            remedy="Go to the frame in which the hair was combed, or press Snap to Surface",
        )


def _colliders(
    hair: bpy.types.Object,
    source: GroomSource,
    rig: Rig,
    dynamics: DynamicsSettings,
    depsgraph: bpy.types.Depsgraph,
) -> tuple[tuple[PosedCollider, ...], tuple[str, ...]]:
    """The colliders that the hair falls onto, and warnings."""
    roots, head = rig.root_vertices, source.head
    colliders = SceneColliders.of(hair, head, rig.head, dynamics, depsgraph, None, roots)
    return colliders.rest(depsgraph), (*source.warnings, *colliders.warnings)
