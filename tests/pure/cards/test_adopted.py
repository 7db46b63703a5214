"""Adopted cards, tested with our own cards, whose direction is known, and MakeHuman's hair."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from guide_cards import build_cards

from hairloom.addon.cards.adopted import AdoptedCards, adopt_cards
from hairloom.addon.cards.card_mesh import CardMesh
from hairloom.addon.cards.settings import CardSettings
from hairloom.addon.errors import HairloomError
from hairloom.addon.strands import Surface

RADIUS = 0.1


def ball() -> Surface:
    polar, around = np.meshgrid(np.linspace(0, np.pi, 16), np.linspace(0, 2 * np.pi, 32))
    points = np.stack(
        [np.sin(polar) * np.cos(around), np.sin(polar) * np.sin(around), np.cos(polar)], axis=-1
    )
    index = np.arange(512).reshape(32, 16)
    a, b, c, d = index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:]
    quads = np.stack([np.stack([a, d, c], -1), np.stack([a, c, b], -1)], axis=2)
    return Surface(points.reshape(-1, 3) * RADIUS, quads.reshape(-1, 3))


def hanging(count: int = 24, stands: bool = False) -> CardMesh:
    """Our own cards: they hang down the sides of a ball, or stand on it like spines."""
    random = np.random.default_rng(2)
    out = random.normal(size=(count, 3)) * [1.0, 1.0, 0.5]
    out /= np.linalg.norm(out, axis=1, keepdims=True)
    along = np.linspace(0.0, 1.0, 9)[:, None]
    down = out[:, None] * (RADIUS + 0.01 * np.sin(np.pi / 2 * along)) - along * [0.0, 0.0, 0.15]
    guides = out[:, None] * (RADIUS + 0.12 * along) if stands else down
    settings = CardSettings(segment_count=6, width_factor=0.8, roundness=0.0, bend=0.0)
    aside = np.cross(out, [0.0, 0.0, 1.0]) if stands else out
    return build_cards(guides.astype(np.float32), aside.astype(np.float32), settings)


def as_source(mesh: CardMesh, uv: np.ndarray | None = None) -> Surface:
    return Surface(mesh.positions, mesh.triangles, (mesh.uv if uv is None else uv)[mesh.triangles])


def source_corners(adopted: AdoptedCards) -> tuple[np.ndarray, np.ndarray]:
    """Positions and UVs that adoption gave to the corners of the source's triangles."""
    mesh = adopted.mesh
    return mesh.positions[adopted.corner_vertex], mesh.uv[adopted.corner_vertex]


#: direction of hair on the texture -> conversion of our UVs into it; "up": roots are below
LAID = {
    "up": lambda uv: uv,
    "down": lambda uv: np.stack([uv[:, 0], 1.0 - uv[:, 1]], 1),
    "right": lambda uv: np.stack([uv[:, 1], uv[:, 0]], 1),
    "left": lambda uv: np.stack([1.0 - uv[:, 1], uv[:, 0]], 1),
}


@pytest.mark.parametrize("stands", [False, True])
@pytest.mark.parametrize("laid", LAID)
def test_our_own_cards_are_read_in_any_uv_direction(laid: str, stands: bool) -> None:
    mesh = hanging(stands=stands)
    source = as_source(mesh, LAID[laid](mesh.uv))
    adopted = adopt_cards(source, ball(), place="test")
    found = adopted.mesh
    assert adopted.notes == ()
    np.testing.assert_allclose(found.along, mesh.along[adopted.source_vertex], atol=1e-5)
    ahead = np.einsum("ij,ij->i", found.tangent, mesh.tangent[adopted.source_vertex])
    assert ahead.min() > 0.9 and np.median(ahead) > 0.99
    assert found.card_count == 24
    if not stands:
        facing = np.einsum("ij,ij->i", found.normal, mesh.normal[adopted.source_vertex])
        assert facing.min() > 0.9
    known = adopt_cards(source, None, direction=laid, place="test")  # type: ignore[arg-type]
    np.testing.assert_allclose(known.mesh.along, found.along, atol=1e-6)
    assert known.notes == ()


def test_cards_that_run_in_another_direction_are_counted() -> None:
    mesh = hanging()
    turned = np.unique(mesh.triangles[mesh.card < 4])
    uv = mesh.uv.copy()
    uv[turned] = LAID["down"](uv[turned])
    adopted = adopt_cards(as_source(mesh, uv), ball(), place="test")
    note = "The UVs of 4 of 24 cards run in another direction than those of the others"
    assert adopted.notes == (note,)


def test_cards_with_an_undecided_root_end_are_reported() -> None:
    """The cards lie flat, and there is no head."""
    mesh = hanging()
    flat = Surface(mesh.positions * [1.0, 1.0, 0.0], mesh.triangles, mesh.uv[mesh.triangles])
    notes = adopt_cards(flat, None, place="test").notes
    assert any("The UVs of 24 of 24 cards do not tell which end is the root" in n for n in notes)
    assert not any("another way" in note for note in notes)


def test_without_a_head_the_higher_end_is_the_root() -> None:
    mesh = hanging()
    adopted = adopt_cards(as_source(mesh), None, place="test")
    np.testing.assert_allclose(adopted.mesh.along, mesh.along[adopted.source_vertex], atol=1e-5)
    assert len(adopted.notes) == 1 and "no head" in adopted.notes[0]


def test_a_card_that_returns_to_the_head_follows_the_direction_of_the_others() -> None:
    """A loop whose tip is as near to the head and as high as its root: the other cards decide."""
    mesh = hanging(10)
    turn = np.linspace(0.0, np.pi, 9)
    loop = np.stack([0.12 + 0.05 * np.sin(turn), 0.05 * np.cos(turn), 0.0 * turn], axis=1)[None]
    settings = CardSettings(segment_count=6, width_factor=1.0, bend=0.0)
    other = build_cards(loop.astype(np.float32), np.array([[0, 0, 1]], np.float32), settings)
    count = len(mesh.positions)
    source = Surface(
        np.concatenate([mesh.positions, other.positions]),
        np.concatenate([mesh.triangles, other.triangles + count]),
        np.concatenate([mesh.uv[mesh.triangles], other.uv[other.triangles]]),
    )
    adopted = adopt_cards(source, ball(), place="test")
    expected = np.concatenate([mesh.along, other.along])[adopted.source_vertex]
    np.testing.assert_allclose(adopted.mesh.along, expected, atol=1e-5)


def test_cards_that_face_the_head_are_flipped_and_mixed_ones_are_noted() -> None:
    mesh = hanging()
    turned = np.where((mesh.card % 2 == 0)[:, None], mesh.triangles[:, ::-1], mesh.triangles)
    adopted = adopt_cards(replaced(mesh, turned), ball(), place="test")
    assert adopted.notes == ()
    a, b, c = np.moveaxis(adopted.mesh.positions[adopted.mesh.triangles], 1, 0)
    out = np.cross(b - a, c - a)
    middle = (a + b + c) / 3.0 * [1.0, 1.0, 0.0]
    assert (np.einsum("ij,ij->i", out, middle) > 0.0).all()
    away = adopted.mesh.positions * [1.0, 1.0, 0.0]
    assert (np.einsum("ij,ij->i", adopted.mesh.normal, away) > 0.0).all()
    at_odds = mesh.triangles.copy()
    at_odds[3] = at_odds[3, ::-1]
    adopted = adopt_cards(replaced(mesh, at_odds), ball(), place="test")
    assert adopted.notes == ("The faces of 1 card do not all point to the same side",)
    np.testing.assert_array_equal(
        np.sort(adopted.mesh.triangles, axis=1), np.sort(adopted.corner_vertex, axis=1)
    )


def replaced(mesh: CardMesh, triangles: np.ndarray) -> Surface:
    return Surface(mesh.positions, triangles, mesh.uv[triangles])


def test_a_seam_of_the_uvs_does_not_divide_a_card() -> None:
    mesh = hanging(1)
    corner_uv = mesh.uv[mesh.triangles].copy()
    right = mesh.uv[mesh.triangles][:, :, 0].mean(axis=1) > mesh.uv[:, 0].mean()
    corner_uv[right, :, 0] += 0.3
    adopted = adopt_cards(replace(as_source(mesh), corner_uv=corner_uv), ball(), place="test")
    assert adopted.mesh.card_count == 1
    assert len(adopted.source_vertex) > len(mesh.positions)
    np.testing.assert_allclose(adopted.mesh.along, mesh.along[adopted.source_vertex], atol=1e-5)
    places, uv = source_corners(adopted)
    np.testing.assert_array_equal(places, mesh.positions[mesh.triangles])
    np.testing.assert_array_equal(uv, corner_uv)


def test_a_card_belongs_to_the_group_of_most_of_its_corners() -> None:
    mesh = hanging(4)
    group = np.where(mesh.along > 0.3, 7, 2)
    group[: len(group) // 4] = 2
    adopted = adopt_cards(as_source(mesh), ball(), group=group, place="test")
    assert sorted(adopted.mesh.group.tolist()) == [2, 7, 7, 7]


def test_unusable_meshes_are_refused_with_a_remedy() -> None:
    mesh = hanging(2)
    with pytest.raises(HairloomError, match="no UVs"):
        adopt_cards(Surface(mesh.positions, mesh.triangles), None, place="test")
    with pytest.raises(HairloomError, match="no faces"):
        adopt_cards(Surface(mesh.positions, mesh.triangles[:0]), None, place="test")


def notes_of(positions: np.ndarray, triangles: np.ndarray, uv: np.ndarray) -> str:
    adopted = adopt_cards(Surface(positions, triangles, uv[triangles]), ball(), place="test")
    for name in ("normal", "tangent"):
        length = np.linalg.norm(getattr(adopted.mesh, name), axis=1)
        np.testing.assert_allclose(length, 1.0, atol=1e-5)
    assert adopted.mesh.along.min() >= 0.0 and adopted.mesh.along.max() <= 1.0
    return " ".join(adopted.notes)


def test_doubtful_shapes_are_noted() -> None:
    mesh = hanging(3)
    positions, triangles, uv = mesh.positions, mesh.triangles, mesh.uv
    assert notes_of(positions, triangles, uv) == ""
    one = hanging(1)
    assert "are connected" in notes_of(one.positions, one.triangles, one.uv)
    flat = positions.copy()
    flat[np.unique(triangles[mesh.card == 1])] = (0.0, 0.0, 0.2)
    assert "No face of 1 card has any area" in notes_of(flat, triangles, uv)
    nowhere = uv.copy()
    nowhere[:] = 0.5
    notes_of(positions, triangles, nowhere)
    assert "beyond the edge" in notes_of(positions, triangles, uv + 1.0)
    doubled = np.concatenate([triangles, triangles[mesh.card == 2] + len(positions)])
    twice = np.concatenate([positions, positions])
    assert "1 card lies exactly on" in notes_of(twice, doubled, np.concatenate([uv, uv]))
    fin = np.concatenate([triangles, [[triangles[0, 0], triangles[0, 1], triangles[-1, 0]]]])
    fin = np.concatenate([fin, [[triangles[0, 1], triangles[0, 0], triangles[5, 2]]]])
    assert "more than two faces share an edge" in notes_of(positions, fin, uv)


def read_obj(path: Path, group: str = "") -> Surface:
    """An OBJ file of MakeHuman in metres, Z up; all its faces, or those of one group."""
    places, coordinates, corners, uvs, here = [], [], [], [], ""
    for line in path.read_text().splitlines():
        kind, *words = line.split() or [""]
        if kind == "v":
            x, y, z = map(float, words)
            places.append((0.1 * x, -0.1 * z, 0.1 * y))
        elif kind == "vt":
            coordinates.append((float(words[0]), float(words[1])))
        elif kind == "g":
            here = words[0]
        elif kind == "f" and group in ("", here):
            face = [[int(part) - 1 for part in word.split("/")[:2]] for word in words]
            for fan in range(1, len(face) - 1):
                corners.append([face[each][0] for each in (0, fan, fan + 1)])
                uvs.append([face[each][1] for each in (0, fan, fan + 1)])
    return Surface(np.array(places), np.array(corners), np.array(coordinates)[np.array(uvs)])


@pytest.fixture(scope="module")
def body(shared_data: Path) -> Surface:
    return read_obj(shared_data / "makehuman" / "mh_base.obj", "body")


def test_long_hair_made_by_an_artist_is_read_as_cards(shared_data: Path, body: Surface) -> None:
    source = read_obj(shared_data / "makehuman" / "long01.obj")
    adopted = adopt_cards(source, body, place="long01")
    mesh = adopted.mesh
    assert (mesh.card_count, adopted.notes) == (18, ())
    places, uv = source_corners(adopted)
    np.testing.assert_array_equal(places, source.corners)
    np.testing.assert_array_equal(uv, source.corner_uv)
    for card in range(18):
        own = np.unique(mesh.triangles[mesh.card == card])
        height = mesh.positions[own, 2]
        assert np.corrcoef(height, mesh.along[own])[0, 1] < -0.98  # it hangs down
        assert (mesh.along[own].min(), mesh.along[own].max()) == (0.0, 1.0)
    assert np.median(mesh.tangent[:, 2]) < -0.95
    behind = mesh.positions[:, 1] > np.quantile(mesh.positions[:, 1], 0.95)
    assert (mesh.normal[behind, 1] > 0.0).mean() > 0.7  # the back of the hair looks backwards


def test_a_ponytail_made_by_an_artist_is_read_as_cards(shared_data: Path, body: Surface) -> None:
    source = read_obj(shared_data / "makehuman" / "ponytail01.obj")
    adopted = adopt_cards(source, body, place="ponytail01")
    mesh = adopted.mesh
    assert mesh.card_count == 48
    assert len(adopted.notes) == 1 and "UVs of 6 of 48 cards run in another" in adopted.notes[0]
    sizes = np.bincount(mesh.card)
    tail, locks = int(sizes.argmax()), np.flatnonzero(sizes <= 36)
    for card in (tail, *locks):
        own = np.unique(mesh.triangles[mesh.card == card])
        assert np.corrcoef(mesh.positions[own, 2], mesh.along[own])[0, 1] < -0.9
    # the tail is a closed lock, whose normals point outwards all around
    a, b, c = np.moveaxis(mesh.positions[mesh.triangles[mesh.card == tail]].astype(float), 1, 0)
    middle = a.mean(axis=0)
    assert np.einsum("ij,ij->", np.cross(b - a, c - a), a - middle) > 0.0
