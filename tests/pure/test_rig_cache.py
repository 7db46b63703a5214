"""A rig that is updated while its groom is combed and painted equals one that is built from
scratch, bit for bit."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import pytest
from small_wig import sheet, turn_strands, wig_strands
from tiers import few_in_commits

from hairloom.addon import rig_flow
from hairloom.addon.dynamics.colliders import DistanceField
from hairloom.addon.groom.children_settings import ChildrenSettings
from hairloom.addon.groom.masks import Masks, SurfaceMask
from hairloom.addon.groom.settings import GuideSettings
from hairloom.addon.strands import StrandSet, Surface
from hairloom.addon.strands.result_cache import ResultCache

STROKES = 3
HEAD = sheet()


def block() -> DistanceField:
    """A box below the sheet with a bump that some children pass through."""
    low, cell = np.array([-0.15, -0.15, -0.1]), 0.01
    axes = [start + cell * np.arange(count) for start, count in zip(low, (31, 31, 31), strict=True)]
    x, y, z = np.meshgrid(*axes, indexing="ij")
    bump = np.sqrt(x * x + y * y + (z + 0.02) ** 2) - 0.05
    return DistanceField(np.minimum(z + 0.005, bump).astype(np.float32), low, cell)


def same(one: Any, other: Any, where: str = "rig") -> None:
    """Assert that all arrays and numbers are equal, bit for bit."""
    if isinstance(one, np.ndarray):
        assert one.dtype == other.dtype, where
        np.testing.assert_array_equal(one, other, where)
    elif isinstance(one, Surface):
        assert one is other, where
    elif isinstance(one, Mapping):
        assert one.keys() == other.keys(), where
        for name in one:
            same(one[name], other[name], f"{where}.{name}")
    elif hasattr(one, "__dataclass_fields__"):
        for name in one.__dataclass_fields__:
            same(getattr(one, name), getattr(other, name), f"{where}.{name}")
    else:
        assert one == other, where


def combed(strands: StrandSet, stroke: int) -> StrandSet:
    number = np.random.default_rng(stroke).choice(strands.strand_count, 5, replace=False)
    return turn_strands(strands, number, 0.4 * (stroke + 1))


def painted(stroke: int) -> np.ndarray:
    """A density with less hair around the place of this stroke."""
    x, y, _ = HEAD.positions.T
    away = np.hypot(x - 0.03 * stroke, y - 0.02)
    return np.where(away < 0.04, 0.3, 1.0).astype(np.float32)


PAINTED = ("frizz", "length", "clump", "width", "scatter", "fly_aways")


@pytest.mark.alike
@pytest.mark.parametrize("does", [combed, painted])
@pytest.mark.parametrize("guides", few_in_commits([30, 100]))
@pytest.mark.parametrize(
    "settings",
    [
        ChildrenSettings(method="multi", strand_count=1500),
        ChildrenSettings(method="single", strand_count=1500, length_variation=0.4),
        ChildrenSettings(
            method="multi", strand_count=4500, clump=0.7, frizz=0.05, scatter=0.3, fly_aways=0.2
        ),
    ],
    ids=["multi", "single", "clumped"],
)
def test_it_is_what_is_made_from_nothing(
    settings: ChildrenSettings, guides: int, does: Callable[..., Any]
) -> None:
    cache, field = ResultCache(), block()
    strands, density = wig_strands(), np.ones(len(HEAD.positions), np.float32)

    def rig_with(**options: ResultCache) -> rig_flow.Rig:
        return rig_flow.prepare(
            strands,
            HEAD,
            GuideSettings(guide_count=guides, cv_count=8),
            place="a wig",
            children=settings,
            placement=rig_flow.ChildPlacement(
                density,
                Masks({name: SurfaceMask.of_vertices(HEAD, density) for name in PAINTED}),
                head_field=lambda: field,
            ),
            widths="found",
            **options,
        )

    points = []
    for stroke in range(STROKES):
        again, fresh = rig_with(cache=cache), rig_with()
        same(again, fresh)
        assert again.child_count > 100
        points.append(again.strands.points)
        if does is combed:
            strands = combed(strands, stroke)
        else:
            density = painted(stroke)
    assert all(not np.array_equal(one, points[-1]) for one in points[:-1])
