"""The light that a card blocks, and the part of it that counts at the card itself."""

from __future__ import annotations

import numpy as np
import pytest

from hairloom.addon.shading.settings import StrandSettings
from hairloom.addon.shading.volume.card_opacity import (
    MAX_ALPHA,
    MIN_FACING,
    StrandArea,
    card_optical_depth,
    card_shadow_area,
    layer_facing,
    lit_level,
    tau_within_card,
    tau_within_card_at_depth,
    tau_within_short_hair,
    view_compensated_depth,
    visible_depth,
)
from hairloom.addon.shading.volume.opacity import (
    layer_ends,
    layer_weights,
    layers_including,
    self_fraction,
)
from hairloom.addon.shading.volume.settings import VolumeSettings
from hairloom.addon.strands import StrandSet


def test_depth_of_a_card_is_that_of_strands_at_random() -> None:
    """Against random strands that leave the same fraction uncovered."""
    random, strands = np.random.default_rng(1), 400
    covered = np.zeros(200_000, bool)
    for start in random.random(strands):
        first = int(start * len(covered))
        covered[np.arange(first, first + 700) % len(covered)] = True
    alpha, tau = covered.mean(), strands * 700 / len(covered)
    assert card_optical_depth(alpha) == pytest.approx(tau, rel=0.1)
    assert card_optical_depth(np.ones(1)) == -np.log(1.0 - MAX_ALPHA)


@pytest.mark.parametrize("shadows", ["slices", "deep"])
@pytest.mark.parametrize("bias", [0.0, 0.01, 0.3])
def test_own_share_is_what_a_look_up_finds_of_a_single_card(shadows: str, bias: float) -> None:
    ends = layer_ends(VolumeSettings(shadows=shadows))
    for depth in np.random.default_rng(2).uniform(0.0, 1.0, 200):
        sums = 0.7 * layers_including(np.array(depth), ends)
        found = sums @ layer_weights(np.array(depth - bias), ends)
        assert 0.7 * self_fraction(np.array(depth), bias, ends) == pytest.approx(found, abs=1e-9)


def directions(count: int = 4000) -> np.ndarray:
    ways = np.random.default_rng(5).normal(size=(count, 3))
    return ways / np.linalg.norm(ways, axis=1, keepdims=True)


def test_shade_of_strands_is_their_mean_shadow() -> None:
    """Against tapered cylinders from many directions: projected length times width."""
    random = np.random.default_rng(7)
    grid = np.cumsum(random.normal(0.0, 0.01, (20, 40, 3)), axis=1)
    radius = np.full((20, 40), 5.0e-5)
    strands = StrandSet(grid.reshape(-1, 3), np.arange(21) * 40, radius.ravel(), np.zeros(20))
    settings = StrandSettings(fullness=2.0, tip_width=0.25, transparency="layers", opacity=0.5)
    steps = np.diff(grid, axis=1)
    across = np.linalg.norm(np.cross(steps[None], directions()[:, None, None]), axis=3).mean(axis=0)
    width = 2.0 * 5.0e-5 * 2.0 * np.linspace(1.0, 0.25, 40)
    expected = 0.5 * (across * 0.5 * (width[1:] + width[:-1])).sum()
    shadow_area = StrandArea.of(strands).shadow_area(settings)
    assert shadow_area == pytest.approx(expected, rel=0.01)


def test_shade_of_cards_is_their_mean_shadow() -> None:
    """Against a bent strip with a partly transparent texture from many directions: |area . view|
    tau."""
    t = np.linspace(0.0, 2.0, 30)
    line = np.stack([np.cos(t), np.sin(t), np.zeros(30)], axis=1)
    positions = np.stack([line, line + [0.0, 0.0, 0.3]], axis=1).reshape(-1, 3)
    first = 2 * np.arange(29)[:, None]
    triangles = np.concatenate([first + [0, 2, 3], first + [0, 3, 1]])
    uv = np.stack([np.tile([0.0, 1.0], 30), np.repeat(t / 2.0, 2)], axis=1)
    alpha = np.full((64, 64), 0.4)
    alpha[32:] = 0.8  # its half towards the tip
    a, b, c = (positions[triangles[:, corner]] for corner in range(3))
    area = 0.5 * np.cross(b - a, c - a)
    tau = np.where(uv[triangles].mean(axis=1)[:, 1] < 0.5, -np.log(0.6), -np.log(0.2))
    expected = (np.abs(directions() @ area.T) * tau).sum(axis=1).mean()
    assert card_shadow_area(positions, triangles, uv, alpha) == pytest.approx(expected, rel=0.02)


def test_strands_thinner_than_what_lights_resolve_count_by_their_mean() -> None:
    """With every fourth texel opaque, as in a texture of thin strands, a quarter is covered, also
    at the edges."""
    alpha = np.zeros((18, 22), np.float32)
    alpha[:, ::4] = 1.0
    alpha[:, 20:] = 0.25
    positions = np.array([[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [0.0, 3.0, 0.0]])
    uv = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]])
    shadow_area = card_shadow_area(positions, np.array([[0, 1, 2]]), uv, alpha, level=2)
    assert shadow_area == pytest.approx(0.5 * 3.0 * card_optical_depth(np.float32(0.25)), rel=1e-5)


def test_light_tells_no_level_apart_in_which_tiles_are_too_small() -> None:
    assert lit_level((2048, 2048), columns=8, rows=4) == 3
    assert lit_level((512, 2048), columns=2, rows=32) == 1
    assert lit_level((2, 2), columns=1, rows=1) == lit_level((64, 64), columns=0, rows=40) == 0


def test_even_cards_count_the_same_from_all_sides_of_their_strands() -> None:
    """A card's projected width is |cos|; compensated, it counts the same at any turn, and on
    average as much as an uncompensated one."""
    turns = np.linspace(0.0, 2.0 * np.pi, 3000, endpoint=False)
    across = 3.0 * np.stack([np.cos(turns), np.sin(turns), 0.0 * turns], axis=-1)
    tangent, direction = np.array([0.0, 0.0, 1.0]), np.array([0.8, 0.0, 0.6])
    width = np.abs(np.cos(turns))
    counted = view_compensated_depth(across, tangent, direction) * width
    assert counted[width > MIN_FACING] == pytest.approx(2.0 / np.pi)
    assert counted.mean() == pytest.approx(width.mean(), rel=0.04)
    assert view_compensated_depth(across[:1], tangent, tangent) == pytest.approx(2.0 / np.pi)


def test_a_slab_of_hair_covers_what_its_strands_do_from_any_side() -> None:
    """n strands of unit length and width w per unit of skin cover n w sin(t, e) / |n . e|. Only for
    lying strands seen from straight above is this the baked coverage."""
    up = np.array([0.0, 0.0, 2.0])
    angle = np.linspace(0.0, 1.2, 7)
    eye = np.stack([np.sin(angle), 0.0 * angle, np.cos(angle)], axis=-1)
    lying = layer_facing(up, np.array([0.0, 1.0, 0.0]), eye)
    assert lying == pytest.approx(np.cos(angle))
    along_the_way = layer_facing(up, np.array([1.0, 0.0, 0.0]), eye)
    assert along_the_way == pytest.approx(np.ones(7))
    upright = layer_facing(up, np.array([0.0, 0.0, 1.0]), eye[1:])
    assert upright == pytest.approx(np.sqrt(0.5) / np.tan(angle[1:]))


@pytest.mark.parametrize("seen", [0.05, 0.7, 3.0])
@pytest.mark.parametrize("lit", [0.3, 3.0])
@pytest.mark.parametrize("near", [0.0, 0.4, 1.0])
def test_light_that_comes_to_the_strand_of_a_card_that_is_seen(
    seen: float, lit: float, near: float
) -> None:
    """Against random strands in columns: the eye meets the first strand of one column, light passes
    those of another, from the front, from behind and from both sides."""
    random = np.random.default_rng(0)
    count = random.poisson(seen, 2_000_000)
    first = 1.0 - random.random(len(count)) ** (1.0 / np.maximum(count, 1))
    first = first[count > 0]
    assert visible_depth(seen) == pytest.approx(first.mean(), abs=2e-3)
    front, behind = (
        np.exp(-lit * np.maximum(each - near, 0.0)).mean() for each in (first, 1.0 - first)
    )
    for side, light in ((1.0, front), (0.0, behind), (0.5, 0.5 * (front + behind))):
        assert np.exp(-tau_within_card(seen, lit, near, side)[0]) == pytest.approx(light, abs=2e-3)


@pytest.mark.parametrize("lit", [0.3, 1.5])
def test_light_that_comes_to_a_strand_of_a_known_depth(lit: float) -> None:
    """Against exp(-lit s), the light of a strand at s of the depth: with visible strands at random,
    and within the first order of what each lies deeper than they do on average."""
    random, seen = np.random.default_rng(0), 2.0
    count = random.poisson(seen, 200_000)
    place = 1.0 - random.random(len(count)) ** (1.0 / np.maximum(count, 1))
    place = place[count > 0]
    deeper = place - place.mean()
    mean = tau_within_card(seen, lit, 0.0, 1.0)
    before, beyond = tau_within_card_at_depth(mean, deeper, 1.0)
    assert before + beyond == pytest.approx(lit) and before.min() >= 0.0 <= beyond.min()
    assert np.abs(np.exp(-before) - np.exp(-lit * place)).max() < 0.1 * lit
    assert np.exp(-before).mean() == pytest.approx(np.exp(-mean[0]), rel=0.1)
    behind, _ = tau_within_card_at_depth(tau_within_card(seen, lit, 0.0, 0.0), deeper, 0.0)
    assert np.abs(np.exp(-behind) - np.exp(-lit * (1.0 - place))).max() < 0.1 * lit


def test_counts_that_are_out_of_the_ordinary() -> None:
    """No strands, equal counts for eye and light, and counts beyond float resolution."""
    counts = np.array([0.0, 2.0, 1e9])
    before, beyond = tau_within_card(counts, counts, 0.0, 1.0)
    expected = np.array([0.0, -np.log(0.5 * (1.0 + np.exp(-2.0))), np.log(2.0)])
    assert before == pytest.approx(expected, abs=2e-3)
    assert before + beyond == pytest.approx(counts)


@pytest.mark.parametrize("tau", [0.05, 0.7, 3.0])
def test_the_tips_beside_one_that_is_seen(tau: float) -> None:
    """Against random strands that each count 0.8, with light from the front, from behind and from
    the side."""
    count = np.random.default_rng(0).poisson(tau, 400_000)
    others = 0.8 * (count[count > 0] - 1.0).mean()
    for front in (1.0, 0.0, 0.5):
        found = tau_within_short_hair(0.8 * tau, tau, front)
        assert found == pytest.approx((others * (1.0 - front), others * front), abs=0.01)
    assert tau_within_short_hair(0.0, 0.0, 0.5) == (0.0, 0.0)
