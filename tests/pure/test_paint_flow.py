"""The quick update of children while their density is painted equals a full rebuild."""

from __future__ import annotations

import numpy as np
import pytest
from small_wig import GUIDES, sheet, turn_strands, wig_strands

from hairloom.addon import rig_flow
from hairloom.addon.arrays import Floats
from hairloom.addon.comb_flow import combed_rig
from hairloom.addon.groom.children_settings import ChildrenSettings
from hairloom.addon.paint_flow import painted_rig

HEAD = sheet()
EVEN = np.ones(len(HEAD.positions))
COMBED = np.array([3, 17, 40])


def dab(weight: float, x: float = 0.0) -> Floats:
    away = np.linalg.norm(HEAD.positions[:, :2] - [x, 0.0], axis=1)
    return np.where(away < 0.05, weight, EVEN)


def rig_of(density: Floats | None, settings: ChildrenSettings, **others: object) -> rig_flow.Rig:
    return rig_flow.prepare(
        others.get("strands", wig_strands()),
        HEAD,
        GUIDES,
        place="a wig",
        children=settings,
        placement=rig_flow.ChildPlacement(density),
    )


def shapes(rig: rig_flow.Rig) -> dict[bytes, Floats]:
    """The points of each child by the bytes of its root."""
    own = rig.own_count
    assert own is not None
    grid = rig.strands.grid[own:]
    return {strand[0].tobytes(): strand for strand in grid}


@pytest.mark.alike
@pytest.mark.parametrize("method", ["multi", "single"])
@pytest.mark.parametrize("density", [dab(0.2), dab(3.0), None], ids=["less", "more", "anywhere"])
def test_it_is_what_a_rebuild_makes(method: str, density: Floats | None) -> None:
    settings = ChildrenSettings(method=method, strand_count=5000, clump=0.0, frizz=0.02)
    rig = rig_of(EVEN, settings)
    now, whole, before = (
        shapes(painted_rig(rig, density)),
        shapes(rig_of(density, settings)),
        shapes(rig),
    )
    assert now.keys() == whole.keys() and len(now) == 5000
    new = now.keys() - before.keys()
    assert 20 < len(new) < 2000
    for root, strand in now.items():
        np.testing.assert_allclose(strand, whole[root], atol=2e-6)
        if root not in new:
            np.testing.assert_array_equal(strand, before[root])


def test_those_that_come_hold_to_where_they_grow() -> None:
    settings = ChildrenSettings(method="multi", strand_count=2000)
    now, whole = painted_rig(rig_of(EVEN, settings), dab(0.2)), rig_of(dab(0.2), settings)
    for rig in (now, whole):
        order = np.lexsort(rig.strands.roots[60:].T) + 60
        rig_rows = [
            rig.strands.root_triangle[order],
            rig.strands.root_barycentric[order],
            rig.strands.radius[rig.strands.offsets[order]],
            rig.rest_frames.origin[order],
            rig.rest_frames.rotation[order],
        ]
        if rig is now:
            own = rig_rows
    for one, other in zip(own, rig_rows, strict=True):
        np.testing.assert_allclose(one, other, rtol=1e-6)


def test_those_that_come_are_drawn_into_the_clumps_around_them() -> None:
    def gap(clump: float) -> float:
        """Median distance of new tips from the nearest tip of a strand that stays [m]."""
        rig = rig_of(EVEN, ChildrenSettings(method="multi", strand_count=5000, clump=clump))
        before, now = shapes(rig), shapes(painted_rig(rig, dab(3.0)))
        new = np.array([strand[-1] for root, strand in now.items() if root not in before])
        old = np.array([strand[-1] for root, strand in now.items() if root in before])
        return float(np.median(np.linalg.norm(new[:, None] - old[None], axis=2).min(axis=1)))

    assert gap(0.9) < 0.5 * gap(0.0)


def test_a_brush_that_goes_back_brings_back_the_very_children() -> None:
    settings = ChildrenSettings(method="multi", strand_count=5000, clump=0.6)
    rig = rig_of(EVEN, settings)
    there = painted_rig(painted_rig(rig, dab(3.0)), dab(0.1, 0.03))
    back = shapes(painted_rig(there, EVEN))
    before = shapes(rig)
    assert back.keys() == before.keys() != shapes(there).keys()
    for root, strand in back.items():
        np.testing.assert_allclose(strand, before[root], atol=1e-7)
    assert painted_rig(rig, EVEN) is rig


def test_what_was_painted_is_combed_as_all_hair_is() -> None:
    settings = ChildrenSettings(method="multi", strand_count=5000, clump=0.0)
    after = turn_strands(wig_strands(), COMBED, 0.05)
    now = combed_rig(painted_rig(rig_of(EVEN, settings), dab(3.0)), after.take(COMBED), COMBED)
    whole = shapes(rig_of(dab(3.0), settings, strands=after))
    for root, strand in shapes(now).items():
        np.testing.assert_allclose(strand, whole[root], atol=2e-6)


def test_where_fewer_are_wanted_nothing_grows_beside_them() -> None:
    """A painted corner that is too far from guides for all children has fewer, but none outside."""
    settings = ChildrenSettings(method="multi", strand_count=3000, clump=0.0)
    corner = np.where(HEAD.positions[:, :2].sum(axis=1) > 0.17, 1.0, 0.0)
    now = shapes(painted_rig(rig_of(EVEN, settings), corner))
    assert now and all(np.frombuffer(root, np.float32)[:2].sum() > 0.135 for root in now)
