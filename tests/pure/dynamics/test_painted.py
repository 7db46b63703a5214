"""Painted settings: the fast step against the slow one, and against guides whose setting has the
painted value."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from hairloom.addon.dynamics.painted import PaintedGuides, painted_frame, simulated_fraction
from hairloom.addon.dynamics.reference.step import advance_reference
from hairloom.addon.dynamics.settings import DynamicsSettings
from hairloom.addon.dynamics.step import MAX_BLOCK_GUIDES, advance
from hairloom.addon.errors import HairloomError

#: tolerance [m] of float32 against float64 after 0.2 s, see test_reference
CLOSE = 2e-4
NAMES = ("gravity", "damping", "style_root", "style_tip", "style_damping", "bend", "volume")
VALUES = {
    "length_tolerance": 0.0001,
    "volume": 0.5,
    "wind_speed": 3.0,
    "style_damping": 3.0,
    "curl_stretch": 0.5,
    "sag_compensation": 0.6,
}


def scene_of(kit, shake, painted, count=8, **values):
    room = np.random.default_rng(4).uniform(-0.5, 1.5, (count, 9)).clip(0.0, None)
    room[::3] = 0.0
    settings = DynamicsSettings(**VALUES | values)
    return kit.Scene(kit.curly(count, 10), settings, shake, room=room, painted=painted, bowed=True)


def test_as_the_slow_form_where_all_is_painted(kit, shake):
    """Stiffness also varies along the guides."""
    random = np.random.default_rng(6)
    painted = PaintedGuides(
        {
            name: random.uniform(0.0, 2.0, (10 if name in ("style_root", "bend") else 1, 8))
            for name in NAMES
        }
    )
    scene = scene_of(kit, shake, painted)
    fast = scene.play(0.08, 50.0)
    slow = kit.Scene(**scene.__dict__ | {"advance": advance_reference}).play(0.08, 50.0)
    plain = kit.Scene(**scene.__dict__ | {"painted": None}).play(0.08, 50.0)
    assert np.abs(fast[-1].position - plain[-1].position).max() > 1e-3, "paint acts"
    for one, other in zip(fast, slow, strict=True):
        np.testing.assert_allclose(one.position, other.position, atol=CLOSE)


@pytest.mark.parametrize("name", [name for name in NAMES if name != "volume"])
def test_each_guide_goes_as_if_its_number_were_the_setting(kit, shake, name):
    """Guides without volume, so that they do not feel each other, half of them painted."""
    factor = np.where(np.arange(8) < 4, 0.25, 1.0)[None]
    scene = scene_of(kit, shake, PaintedGuides({name: factor}), volume=0.0)
    plain = kit.Scene(**scene.__dict__ | {"painted": None})
    quarter = replace(scene.settings, **{name: 0.25 * getattr(scene.settings, name)})
    less = kit.Scene(**plain.__dict__ | {"settings": quarter})
    found, whole, part = (each.play(0.2, 50.0)[-1].position for each in (scene, plain, less))
    np.testing.assert_allclose(found[:, :, 4:], whole[:, :, 4:], atol=1e-6)
    np.testing.assert_allclose(found[:, :, :4], part[:, :, :4], atol=1e-6)
    assert np.abs(whole[:, :, :4] - part[:, :, :4]).max() > 1e-4, "it acts"


def test_hair_painted_without_volume_feels_no_other(kit, shake):
    """With volume painted 0 everywhere, hair moves as with the setting 0."""
    nothing = PaintedGuides({"volume": np.zeros((1, 8))})
    found = scene_of(kit, shake, nothing).play(0.2, 50.0)[-1].position
    alone = scene_of(kit, shake, None, volume=0.0).play(0.2, 50.0)[-1].position
    whole = scene_of(kit, shake, None).play(0.2, 50.0)[-1].position
    np.testing.assert_allclose(found, alone, atol=1e-6)
    assert np.abs(found - whole).max() > 1e-5


def test_blocks_have_their_own_columns(kit):
    """More guides than one block holds, each with another value, move as each does alone."""
    count = MAX_BLOCK_GUIDES + 30
    grid = np.repeat(kit.curly(1, 6), count, axis=0)
    factor = np.linspace(0.0, 2.0, count)[None]
    chosen = np.array([0, MAX_BLOCK_GUIDES // 2, MAX_BLOCK_GUIDES - 1, count - 1])
    ends = []
    for some in (np.arange(count), chosen):
        painted = PaintedGuides({"style_root": factor[:, some], "gravity": factor[:, some]})
        settings = DynamicsSettings(sag_compensation=0.0)
        ends.append(kit.Scene(grid[some], settings, painted=painted).play(0.1)[-1].grid)
    np.testing.assert_allclose(ends[0][chosen], ends[1], atol=1e-6)
    assert np.ptp(ends[1][:, -1], axis=0).max() > 1e-3


def test_what_is_painted_stays_in_the_range_of_its_setting():
    painted = PaintedGuides({"volume": np.full((1, 3), 100.0), "influence": np.full((1, 3), 5.0)})
    settings = DynamicsSettings(volume=0.5, influence=0.5)
    frame = painted_frame(painted, settings, 8, 3, 1.0 / 180.0)
    np.testing.assert_array_equal(frame.volume, np.full(3, 2.0), "half of it times 2 is all")
    np.testing.assert_array_equal(simulated_fraction(painted, settings, 3), np.ones(3))
    assert simulated_fraction(None, DynamicsSettings(), 3) is None


@pytest.mark.parametrize("factors", [np.ones((1, 7)), np.full((1, 8), np.nan), np.ones((4, 8))])
def test_what_does_not_fit_is_refused(kit, factors):
    scene = kit.Scene(kit.curly(8, 10), DynamicsSettings())
    scene.painted = PaintedGuides({"gravity": factors})
    with pytest.raises(HairloomError, match="not 8 finite numbers"):
        advance(scene.start(), scene.drive(0.0, 0.1), scene.settings, 0.1)
