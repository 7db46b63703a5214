"""Shells of fur on a ball and on a square of skin, whose density, length and lean are known."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from tiers import few_in_commits

from hairloom.addon.cards.atlas_settings import AtlasSettings
from hairloom.addon.cards.bake import sample_maps
from hairloom.addon.cards.card_mesh import CardMesh
from hairloom.addon.cards.settings import CardSettings
from hairloom.addon.cards.shell_plan import Patches, shell_strands
from hairloom.addon.cards.shells import Shells, build_shells, wants_shells
from hairloom.addon.errors import HairloomError
from hairloom.addon.strands import StrandSet, Surface
from hairloom.addon.strands.face import BROWS

LENGTH, SIDE, RADIUS, WIDTH = 0.01, 0.1, 0.1, 2e-4
SHELLS = CardSettings(kind="shells", levels=1)
ATLAS = AtlasSettings(size="512", strand_width=1.0)


def square(count: int = 12) -> Surface:
    line = np.linspace(0.0, SIDE, count + 1)
    place = np.stack([*np.meshgrid(line, line), np.zeros((count + 1,) * 2)], axis=-1)
    row, column = (each.ravel() for each in np.mgrid[:count, :count])
    corner = row * (count + 1) + column
    one = np.stack([corner, corner + 1, corner + count + 2], axis=1)
    two = np.stack([corner, corner + count + 2, corner + count + 1], axis=1)
    return Surface(place.reshape(-1, 3), np.concatenate([one, two]))


def ball(count: int = 24) -> Surface:
    turn, rise = np.meshgrid(
        np.linspace(0.0, 2.0 * np.pi, 2 * count, endpoint=False), np.linspace(0.05, 3.09, count)
    )
    points = np.stack(
        [np.sin(rise) * np.cos(turn), np.sin(rise) * np.sin(turn), np.cos(rise)], axis=-1
    )
    row, column = (each.ravel() for each in np.mgrid[: count - 1, : 2 * count])
    beside = (column + 1) % (2 * count)
    a, b = row * 2 * count + column, row * 2 * count + beside
    triangles = np.concatenate(
        [np.stack([a, a + 2 * count, b], axis=1), np.stack([b, a + 2 * count, b + 2 * count], 1)]
    )
    return Surface(RADIUS * points.reshape(-1, 3), triangles)


def strands_of(root: np.ndarray, direction: np.ndarray, length: np.ndarray) -> StrandSet:
    along = np.linspace(0.0, 1.0, 8)[:, None]
    grid = root[:, None] + length[:, None, None] * direction[:, None] * along
    return StrandSet(
        points=grid.reshape(-1, 3),
        offsets=np.arange(len(root) + 1) * 8,
        radius=np.full(len(root) * 8, WIDTH / 2.0),
        group=np.zeros(len(root), np.int32),
    )


def fur_on_square(
    count: int = 4000, lean: float = 0.6, spread: float = 0.0, seed: int = 3
) -> StrandSet:
    """Fur combed along x, by `lean` of its length."""
    random = np.random.default_rng(seed)
    root = np.concatenate([random.uniform(0.0, SIDE, (count, 2)), np.zeros((count, 1))], axis=1)
    direction = np.tile([lean, 0.0, np.sqrt(1.0 - lean**2)], (count, 1))
    return strands_of(root, direction, LENGTH * random.uniform(1.0 - spread, 1.0, count))


def fur_on_ball(count: int = 6000) -> tuple[StrandSet, np.ndarray]:
    random = np.random.default_rng(5)
    out = random.normal(size=(count, 3))
    out /= np.linalg.norm(out, axis=1, keepdims=True)
    down = np.cross(out, np.cross([0.0, 0.0, -1.0], out))
    direction = out + down
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    return strands_of(RADIUS * out, direction, np.full(count, LENGTH)), out


def built(
    strands: StrandSet, head: Surface, settings: CardSettings = SHELLS, normal=None
) -> Shells:
    up = np.tile([0.0, 0.0, 1.0], (strands.strand_count, 1)) if normal is None else normal
    radius = strands.radius.reshape(strands.strand_count, -1)
    return build_shells(strands, radius, up, head, None, settings, ATLAS)


@pytest.mark.alike
@pytest.mark.parametrize(
    ("budget", "layers"),
    few_in_commits(map(pytest.param, (3_000, 30_000, 12_000, 600), (8, 16, 12, 4))),
)
def test_a_budget_is_met_in_triangles(budget: int, layers: int) -> None:
    strands, out = fur_on_ball()
    settings = replace(SHELLS, max_triangles=budget, shell_layers=layers, levels=2)
    made = built(strands, ball(), settings, out)
    finest, coarser = (level.mesh for level in made.levels)
    assert 0.8 * budget <= len(finest.triangles) <= budget
    assert len(coarser.triangles) <= budget / 2
    assert made.levels[0].error < made.levels[1].error


@cache
def fur_on_the_square() -> Shells:
    return built(fur_on_square(), square())


def areas(mesh: CardMesh) -> np.ndarray:
    a, b, c = np.moveaxis(mesh.positions[mesh.triangles], 1, 0)
    return np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2.0


def test_layers_follow_the_combed_hair_from_the_inside_to_the_outside() -> None:
    """Each layer is as large as the skin, and lies where the strands cross its height."""
    made = fur_on_the_square()
    mesh, layers = made.levels[0].mesh, SHELLS.shell_layers
    along = mesh.along[mesh.triangles].mean(axis=1)
    assert (np.diff(along) >= 0.0).all()
    np.testing.assert_allclose(mesh.positions[:, 2], mesh.along * LENGTH * 0.8, atol=1e-4)
    by_layer = mesh.positions.reshape(layers, -1, 3)
    moved = by_layer[-1] - by_layer[0]
    np.testing.assert_allclose(moved[:, 0], LENGTH * 0.6 * (1.0 - 1.0 / layers), rtol=0.02)
    np.testing.assert_allclose(areas(mesh).reshape(layers, -1).sum(axis=1), SIDE**2, rtol=0.06)
    np.testing.assert_allclose(
        mesh.tangent, np.tile([0.6, 0.0, 0.8], (len(mesh.along), 1)), atol=0.03
    )
    back = made.back_triangles[0]
    assert (np.diff(mesh.along[back].mean(axis=1)) <= 0.0).all()


@pytest.mark.slow(instead="test_sparse_hair_covers_as_much_however_few_strands_a_pattern_has")
@pytest.mark.parametrize("spread", [0.5, 0.0])
def test_from_above_layers_cover_what_strands_cover(spread: float) -> None:
    """Against the Poisson distribution: random strands leave exp(-tau) uncovered, on the mean of
    all patterns."""
    strands = fur_on_square(10_000, spread=spread)
    plan = built(strands, square()).plan
    radius = strands.radius.reshape(strands.strand_count, -1)
    flat = shell_strands(
        replace(plan, thickness=np.ones_like(plan.thickness)), strands.grid, radius, 0.0
    )
    alpha = sample_maps(flat, plan.size).alpha
    low, high = (plan.grid.uv(np.arange(plan.layers * 4), each, each) for each in (0.0, 1.0))
    corners = np.round(np.concatenate([low, high], axis=1) * plan.size).astype(int)
    shown = np.array([alpha[b:d, a:c].mean() for a, b, c, d in corners]).reshape(4, -1).mean(axis=0)
    left = np.prod(1.0 - shown)
    flat_length = 0.6 * strands.lengths().mean()
    tau = strands.strand_count / SIDE**2 * WIDTH * flat_length
    assert 1.0 - left == pytest.approx(1.0 - np.exp(-tau), rel=0.1)


@pytest.mark.parametrize("seed", few_in_commits([0, 1, 2]))
@pytest.mark.parametrize("count", few_in_commits([700, 2000]))
def test_sparse_hair_covers_as_much_however_few_strands_a_pattern_has(
    count: int, seed: int
) -> None:
    """The coverage that the textures have at random points of the skin, not the planned coverage,
    against the Poisson distribution."""
    strands = replace(fur_on_square(count, spread=0.5, seed=seed), radius=np.full(count * 8, 4e-4))
    made = built(strands, square())
    plan, mesh = made.plan, made.levels[0].mesh
    radius = strands.radius.reshape(count, -1)
    alpha = sample_maps(shell_strands(plan, strands.grid, radius, 0.0), plan.size).alpha
    shares = np.random.default_rng(8).dirichlet((1.0, 1.0, 1.0), 12)
    where = np.einsum("pc,tca->tpa", shares, mesh.uv[mesh.triangles]) * plan.size
    column, row = np.moveaxis(np.clip(where.astype(int), 0, plan.size - 1), -1, 0)
    shown = alpha[row, column].mean(axis=1).reshape(plan.layers, -1)
    size = areas(mesh).reshape(plan.layers, -1)
    left = np.prod(1.0 - (shown * size).sum(axis=1) / size.sum(axis=1))
    tau = count / SIDE**2 * 0.9 * 8e-4 * 0.6 * strands.lengths().mean()
    assert 1.0 - left == pytest.approx(1.0 - np.exp(-tau), rel=0.1)


def test_shells_show_the_colours_and_places_of_the_strands() -> None:
    strands = fur_on_square()
    plan = fur_on_the_square().plan
    shade = np.broadcast_to(np.linspace(0.2, 0.8, 8)[None, :, None], (*strands.grid.shape[:2], 3))
    radius = strands.radius.reshape(strands.strand_count, -1)
    flat = shell_strands(plan, strands.grid, radius, 0.5, shade)
    np.testing.assert_allclose(flat.base[..., 0], 0.2 + 0.6 * flat.along, atol=1e-5)
    assert flat.along.min() == 0.0 and flat.along.max() == pytest.approx(1.0)
    assert (flat.place >= 0.0).all() and (flat.place <= 1.0).all()
    # straight hair runs up the picture
    np.testing.assert_allclose(
        flat.tangent, np.tile([0.0, 1.0, 0.0], (*flat.along.shape, 1)), atol=0.05
    )


def test_fewer_strands_show_where_hair_is_thin() -> None:
    strands = fur_on_square()
    is_kept = (strands.roots[:, 0] < 0.6 * SIDE) | (np.arange(strands.strand_count) % 4 == 0)
    made = built(strands.take(np.flatnonzero(is_kept)), square())
    plan, mesh = made.plan, made.levels[0].mesh
    assert plan.thinned_pattern is not None
    count = np.bincount(plan.pattern)
    shown = count[mesh.tile[mesh.card] // plan.layers] / count[: len(plan.features)].mean()
    middle = mesh.positions[mesh.triangles].mean(axis=1)[:, 0]
    assert np.average(shown[middle < 0.5 * SIDE], weights=None) > 0.85
    assert np.average(shown[middle > 0.75 * SIDE], weights=None) < 0.55


def test_without_thinner_patterns_thin_skin_of_a_coarser_level_shows_whole_ones() -> None:
    plan = replace(fur_on_the_square().plan, features=np.zeros((4, 2)), thinned_pattern=None)
    one = np.tile(np.eye(3), (2, 1, 1))
    patches = Patches(
        np.zeros((2, 3)), one, np.ones(2), np.ones(2), np.zeros((2, 2)), square(1), np.arange(2)
    )
    np.testing.assert_array_equal(plan.pattern_of(patches), [0, 0])
    np.testing.assert_array_equal(replace(plan, thinned_pattern=0).pattern_of(patches), [5, 5])


def test_automatic_makes_shells_of_short_hair_only() -> None:
    head, automatic = square(), CardSettings(kind="auto")
    assert wants_shells(automatic, fur_on_square(), head, False)
    assert not wants_shells(automatic, fur_on_square(), head, True)
    assert not wants_shells(automatic, fur_on_square(), None, False)
    assert not wants_shells(replace(automatic, kind="cards"), fur_on_square(), head, False)
    long_hair = replace(fur_on_square(), points=fur_on_square().points * [1.0, 1.0, 20.0])
    assert not wants_shells(automatic, long_hair, head, False)


def test_hair_that_cannot_be_shells_is_refused_with_a_remedy() -> None:
    head, fur = square(), fur_on_square()
    long_hair = replace(fur, points=fur.points * [1.0, 1.0, 20.0])
    brow = replace(fur, group=np.full(fur.strand_count, BROWS, np.int32))
    cases = [
        (fur, None, False, "this hair has no surface"),
        (fur.take(np.arange(1)), head, False, "1 strand cannot fill shells"),
        (long_hair, head, False, "shells show hair up to"),
        (brow, head, False, "brows and lashes"),
        (fur, head, True, "its cards were edited"),
    ]
    for strands, skin, has_edits, problem in cases:
        with pytest.raises(HairloomError, match=problem):
            wants_shells(SHELLS, strands, skin, has_edits)


def test_too_few_triangles_are_refused() -> None:
    with pytest.raises(HairloomError, match="too few for 12 layers"):
        built(fur_on_square(), square(), replace(SHELLS, max_triangles=1))
