"""Quick light approximates the final light, and equals it at the points where it is sampled."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from spheres import ball

from hairloom.addon import light_flow, rig_flow
from hairloom.addon.arrays import Floats, same_content
from hairloom.addon.groom.settings import GuideSettings
from hairloom.addon.light_flow import quick_light, rest_light, updated_light
from hairloom.addon.rig_flow import Rig
from hairloom.addon.shading import skin_seen
from hairloom.addon.shading.ambient import occlusion_from_sky
from hairloom.addon.shading.ambient_settings import AmbientSettings
from hairloom.addon.strands import StrandSet

RADIUS, POINTS, COUNT = 0.09, 14, 1500
SETTINGS = AmbientSettings(cell_count=64)
COARSE = AmbientSettings(cell_count=16)


@pytest.fixture(scope="module")
def rig() -> Rig:
    """Hair on the upper half of a ball, wavy so that strands keep their points."""
    random = np.random.default_rng(2)
    out = random.normal(size=(COUNT, 3))
    out[:, 2] = np.abs(out[:, 2])
    out /= np.linalg.norm(out, axis=1, keepdims=True)
    along = np.linspace(0.0, 1.0, POINTS)
    points = out[:, None] * (RADIUS + 0.06 * along[:, None])
    points[..., 0] += 0.004 * np.sin(12.0 * along)
    points[..., 2] -= 0.05 * along**2
    strands = StrandSet(
        points.reshape(-1, 3),
        np.arange(COUNT + 1) * POINTS,
        np.full(COUNT * POINTS, 1e-3),
        np.zeros(COUNT),
    )
    return rig_flow.prepare(strands, ball(RADIUS), GuideSettings(), place="ball")


def with_strands(rig: Rig, points: Floats) -> Rig:
    return replace(rig, strands=rig.strands.with_points(points))


def test_quick_light_is_the_fields_at_some_points_and_straight_between(rig: Rig) -> None:
    """At the sampled points against the fields. All roots are moved a little, so that no strand is
    found in the light of before."""
    light = rest_light(rig, SETTINGS)
    fields = light.fields
    assert fields is not None
    other = with_strands(rig, rig.strands.points + np.float32(1e-4))
    quick = quick_light(other, SETTINGS, (rig, light))
    assert quick.is_quick and not light.is_quick and quick.fields is fields
    factors = light_flow.ambient_of(rig, SETTINGS)
    own = occlusion_from_sky(fields.sky.at(other.strands.points)[0], factors)
    first, last = rig.strands.offsets[:-1], rig.strands.offsets[1:] - 1
    for at in (first, last):
        np.testing.assert_array_equal(quick.occlusion[at], own[at])
    assert rig.strands.point_counts.min() > 4
    mean = 0.5 * (own[first] + own[first + 4])
    is_shaded = (own[first] < 1.0) & (own[first + 4] < 1.0)
    assert is_shaded.mean() > 0.5
    np.testing.assert_allclose(quick.occlusion[first + 2][is_shaded], mean[is_shaded], atol=1e-5)
    assert np.abs(quick.openness - light.openness).mean() < 0.05
    assert light.skin_seen is not None and quick.skin_seen is not None
    assert np.abs(quick.skin_seen - light.skin_seen)[:, :7].mean() < 0.025


def test_strands_that_were_there_keep_their_light_wherever_they_are_in_the_order(rig: Rig) -> None:
    light = rest_light(rig, SETTINGS)
    order = np.random.default_rng(3).permutation(COUNT)[: COUNT // 2]
    fewer = replace(rig, strands=rig.strands.take(order))
    quick = quick_light(fewer, SETTINGS, (rig, light))
    for strand, old in enumerate(order[::50]):
        here = slice(*fewer.strands.offsets[50 * strand : 50 * strand + 2])
        there = slice(*rig.strands.offsets[old : old + 2])
        np.testing.assert_array_equal(quick.occlusion[here], light.occlusion[there])
        np.testing.assert_array_equal(quick.openness[here], light.openness[there])
    assert light.occlusion.flags.owndata and not np.shares_memory(quick.occlusion, light.occlusion)


def test_the_first_hair_has_light_like_its_own(rig: Rig) -> None:
    """Its mean is close to that of the final light, with which it correlates, so that hair does not
    flash black or white at first."""
    light, quick = rest_light(rig, SETTINGS), quick_light(rig, SETTINGS, None)
    assert quick.occlusion.mean() == pytest.approx(light.occlusion.mean(), abs=0.05)
    assert np.corrcoef(quick.occlusion, light.occlusion)[0, 1] > 0.9
    mean, vector = light.openness[:, 0], light.openness[:, 1:]
    assert quick.openness[:, 0].mean() == pytest.approx(mean.mean(), abs=0.05)
    assert np.abs(quick.openness[:, 1:] - vector).mean() < 0.1
    assert light.skin_seen is not None and quick.skin_seen is not None
    received, other = light.skin_seen[:, 0].mean(), quick.skin_seen[:, 0].mean()
    assert other == pytest.approx(received, abs=0.03)


def test_strands_of_two_points_and_none_have_quick_light(rig: Rig) -> None:
    ends = (rig.strands.offsets[:-1, None] + [0, 1]).ravel()
    offsets, radius = np.arange(COUNT + 1) * 2, np.full(2 * COUNT, 2e-4)
    short = StrandSet(rig.strands.points[ends], offsets, radius, np.zeros(COUNT))
    bound = rig_flow.prepare(short, ball(RADIUS), GuideSettings(), place="ball")
    light = rest_light(bound, SETTINGS)
    away = with_strands(bound, bound.strands.points + np.float32(1e-6))
    found = quick_light(away, SETTINGS, (bound, light))
    np.testing.assert_allclose(found.occlusion, light.occlusion, atol=1e-3)
    none = replace(rig, strands=rig.strands.take(np.zeros(0, np.int32)))
    for found in (quick_light(none, SETTINGS, None), rest_light(none, SETTINGS)):
        assert found.occlusion.shape == (0,) and found.fields is None


def test_finding_light_asks_whether_it_is_still_wanted(rig: Rig) -> None:
    class GivenUp(Exception):
        pass

    def given_up() -> None:
        raise GivenUp

    with pytest.raises(GivenUp):
        rest_light(rig, SETTINGS, given_up)


@pytest.mark.parametrize(
    ("change", "found"),
    [
        ({"strength": 0.3}, []),
        ({"ao_bias": 0.9}, []),
        ({"scalp_extinction": 5.0}, []),
        ({"extinction": 1.2}, ["sky_field"]),
        ({"upper_fraction": 0.9}, ["sky_field"]),
        ({"upper_fraction": 0.9, "strength": 0.3}, ["sky_field"]),
    ],
)
def test_other_settings_find_again_what_depends_on_them_and_no_more(
    rig: Rig, monkeypatch: pytest.MonkeyPatch, change: dict[str, float], found: list[str]
) -> None:
    monkeypatch.setattr(skin_seen, "_CELLS", 12)
    light, settings = rest_light(rig, COARSE), replace(COARSE, **change)
    own, again = rest_light(rig, settings), []
    for name in ("sky_field", "openness_field", "skin_field"):
        make = getattr(light_flow, name)

        def counted(*arguments: Any, name: str = name, make: Any = make) -> Any:
            again.append(name)
            return make(*arguments)

        monkeypatch.setattr(light_flow, name, counted)
    other = updated_light(rig, light, COARSE, settings)
    assert other is not None and again == found
    assert same_content(other, own)


def test_light_that_has_other_cells_or_is_quick_is_found_as_a_whole(
    rig: Rig, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(skin_seen, "_CELLS", 12)
    light = rest_light(rig, COARSE)
    assert updated_light(rig, light, COARSE, replace(COARSE, cell_count=20)) is None
    quick = quick_light(rig, COARSE, None)
    assert updated_light(rig, quick, COARSE, replace(COARSE, strength=0.3)) is None
    none = replace(rig, strands=rig.strands.take(np.arange(0)))
    nothing = rest_light(none, COARSE)
    assert updated_light(none, nothing, COARSE, replace(COARSE, strength=0.3)) is None
