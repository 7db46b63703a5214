"""Card tools: width, twist and tile in Edit Mode, and a card along a curve."""

import bpy
import numpy as np
import pytest
from test_card_edits import corners, edit, edits, hair, make, numbers, select

from hairloom.addon.blender.cards.made_objects import card_objects

__all__ = ["hair"]


def rows(places):
    """The corners of a card as rows of vertices, root first: (row, column, 3)."""
    return np.unique(places, axis=0)


def apply(obj, chosen, operator, **how):
    found = []
    edit(obj, chosen, lambda: found.append(operator(**how)))
    return found[0]


def grid(obj, card):
    """The vertices of a card by row and column, (9, 3, 3)."""
    mesh, faces = obj.data, np.flatnonzero(numbers(obj) == card)
    found = {}
    for face in faces:
        for loop in mesh.polygons[face].loop_indices:
            place = mesh.vertices[mesh.loops[loop].vertex_index].co[:]
            u, v = mesh.uv_layers["UVMap"].uv[loop].vector
            found[round(v, 5), round(u, 5)] = place
    return np.array([found[key] for key in sorted(found)]).reshape(9, 3, 3)


def row_places(obj, card):
    """Place of each row along a card, from 0 at the root to 1, (9,)."""
    places = np.unique(corners(obj, card, "UVMap")[:, 1].round(5))
    return (places - places[0]) / (places[-1] - places[0])


def widths(rows):
    return np.linalg.norm(rows[:, 2] - rows[:, 0], axis=1)


def test_width_grows_evenly_to_the_tip_about_the_middle(hair):
    obj = make(hair)
    before, other = grid(obj, 3), corners(obj, 4)
    assert apply(obj, (3,), bpy.ops.hairloom.card_width, root=1.0, tip=2.0) == {"FINISHED"}
    now = grid(obj, 3)
    factor = 1.0 + row_places(obj, 3)
    np.testing.assert_allclose(widths(now), widths(before) * factor, rtol=1e-4)
    np.testing.assert_allclose(now[:, 0] + now[:, 2], before[:, 0] + before[:, 2], atol=1e-6)
    np.testing.assert_array_equal(corners(obj, 4), other)
    np.testing.assert_allclose(grid(make(hair), 3), now, atol=1e-6)


def test_twist_turns_the_tip_by_the_angle_and_keeps_widths(hair):
    obj = make(hair)
    before = grid(obj, 3)
    apply(obj, (3, 4), bpy.ops.hairloom.card_twist, angle=np.pi / 2.0)
    now = grid(obj, 3)
    np.testing.assert_allclose(widths(now), widths(before), rtol=1e-4)
    np.testing.assert_allclose(now[0], before[0], atol=1e-6)
    across = [each[:, 2] - each[:, 0] for each in (before, now)]
    cosine = np.einsum("ri,ri->r", *across) / widths(before) ** 2
    # the component of a row along the card's axis is not turned
    middle = (before[:, 0] + before[:, 2]) / 2.0
    axis = np.gradient(middle, axis=0)
    axis /= np.linalg.norm(axis, axis=1)[:, None]
    ahead = (np.einsum("ri,ri->r", across[0], axis) / widths(before)) ** 2
    turn = row_places(obj, 3) * np.pi / 2.0
    np.testing.assert_allclose(cosine, np.cos(turn) * (1.0 - ahead) + ahead, atol=1e-3)


@pytest.mark.parametrize(("name", "value"), [("card_width", "root"), ("card_twist", "angle")])
def test_what_is_not_finite_moves_no_card(hair, name, value):
    obj = make(hair)
    before = corners(obj, 3)
    with pytest.raises(RuntimeError, match="Use finite numbers"):
        apply(obj, (3,), getattr(bpy.ops.hairloom, name), **{value: float("nan")})
    bpy.ops.object.mode_set(mode="OBJECT")
    np.testing.assert_array_equal(corners(obj, 3), before)


def test_tiles_go_round_and_to_a_number(hair):
    obj = make(hair)
    uv = corners(obj, 3, "UVMap")
    tile = int(uv[:, 0].mean() * 4)
    for step in (1, 2, 3, 4):
        apply(obj, (3,), bpy.ops.hairloom.card_tile, to="next")
        now = corners(obj, 3, "UVMap")
        assert int(now[:, 0].mean() * 4) == (tile + step) % 4
    np.testing.assert_allclose(now, uv, atol=1e-6)
    apply(obj, (3,), bpy.ops.hairloom.card_tile, to="previous")
    assert int(corners(obj, 3, "UVMap")[:, 0].mean() * 4) == (tile - 1) % 4
    apply(obj, (3, 4), bpy.ops.hairloom.card_tile, to="number", number=2)
    for card in (3, 4):
        assert int(corners(obj, card, "UVMap")[:, 0].mean() * 4) == 1


def test_one_undo_takes_a_tool_back(hair):
    obj = make(hair)
    before = corners(obj, 3)
    select(obj)
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.select_all(action="SELECT")
    bpy.ops.ed.undo_push(message="selected")
    bpy.ops.hairloom.card_twist(angle=1.0)
    bpy.ops.ed.undo_push(message="twisted")
    bpy.ops.ed.undo()
    bpy.ops.object.mode_set(mode="OBJECT")
    obj = bpy.data.objects["Hair Cards"]
    np.testing.assert_array_equal(corners(obj, 3), before)


def test_tools_say_what_they_need(hair, capfd):
    obj = make(hair)
    assert apply(obj, (), bpy.ops.hairloom.card_twist) == {"CANCELLED"}
    assert "No card is selected" in capfd.readouterr().out
    for name in ("card_width", "card_twist", "card_tile", "add_card_along_curve"):
        assert not getattr(bpy.ops.hairloom, name).poll()
    bpy.ops.mesh.primitive_plane_add()
    bpy.ops.object.mode_set(mode="EDIT")
    assert not bpy.ops.hairloom.card_width.poll(), "a mesh that is no cards of ours"
    bpy.ops.object.mode_set(mode="OBJECT")
    for level, obj in enumerate(card_objects(hair)):
        obj.hide_viewport = False
        select(obj)
        bpy.ops.object.mode_set(mode="EDIT")
        assert bpy.ops.hairloom.card_width.poll() == (level == 0), "a level that is made again"
        bpy.ops.object.mode_set(mode="OBJECT")


def curve(points, kind="POLY"):
    data = bpy.data.curves.new("Line", "CURVE")
    data.dimensions = "3D"
    spline = data.splines.new(kind)
    if kind == "BEZIER":
        spline.bezier_points.add(len(points) - 1)
        for point, place in zip(spline.bezier_points, points, strict=True):
            point.co, point.handle_left, point.handle_right = place, place, place
    else:
        spline.points.add(len(points) - 1)
        for point, place in zip(spline.points, points, strict=True):
            point.co = (*place, 1.0)
    line = bpy.data.objects.new("Line", data)
    bpy.context.collection.objects.link(line)
    bpy.context.view_layer.update()
    return line


@pytest.mark.alike
@pytest.mark.parametrize("kind", ["POLY", "BEZIER"])
@pytest.mark.parametrize("turned", [False, True])
def test_a_card_along_a_curve_stands_on_the_skin_and_stays(hair, kind, turned):
    obj = make(hair)
    before = {card: corners(obj, card) for card in range(12)}
    points = [(0.0, 0.0, 0.11 + 0.02 * step) for step in range(6)]
    line = curve(points[::-1] if turned else points, kind)
    select(obj)
    line.select_set(True)
    assert bpy.ops.hairloom.add_card_along_curve(width=0.02, tile=2) == {"FINISHED"}
    card = grid(obj, -1)
    middle = (card[:, 0] + card[:, 2]) / 2.0
    np.testing.assert_allclose(middle[0], (0.0, 0.0, 0.1), atol=2e-3)
    np.testing.assert_allclose(middle[-1], points[-1], atol=2e-3)
    np.testing.assert_allclose(widths(card)[0], 0.02, rtol=1e-3)
    assert int(corners(obj, -1, "UVMap")[:, 0].mean() * 4) == 1
    obj = make(hair)
    assert edits(hair).added_count == 1 and obj.hairloom.card_object.card_count == 13
    np.testing.assert_allclose(grid(obj, -1), card, atol=1e-6)
    for number, places in before.items():
        np.testing.assert_allclose(corners(obj, number), places, atol=1e-6)


@pytest.mark.parametrize("turned", [False, True])
def test_without_numbers_a_curve_gets_the_width_and_tile_of_its_neighbours(hair, turned):
    obj = make(hair)
    near = grid(obj, 3)
    middle = (near[:, 0] + near[:, 2]) / 2.0
    # the line ends above the root of a card with another tile
    tile = [int(corners(obj, card, "UVMap")[:, 0].mean() * 4) for card in range(12)]
    other = next(card for card in range(12) if tile[card] != tile[3])
    tip = grid(obj, other)[0, 1]
    middle[-3:] = middle[-4] + (1.3 * tip - middle[-4]) * np.linspace(0.3, 1.0, 3)[:, None]
    line = curve([tuple(place) for place in (middle[::-1] if turned else middle)])
    select(obj)
    line.select_set(True)
    assert bpy.ops.hairloom.add_card_along_curve() == {"FINISHED"}
    card = grid(obj, -1)
    halfway = [np.interp(0.5, row_places(obj, n), widths(grid(obj, n))) for n in range(12)]
    usual = np.median(halfway)
    np.testing.assert_allclose(widths(card)[0], usual, rtol=0.1)
    assert int(corners(obj, -1, "UVMap")[:, 0].mean() * 4) == tile[3]


@pytest.mark.parametrize("case", ["tile", "point", "faces"])
def test_curves_that_cannot_be_cards_are_refused(hair, case):
    obj = make(hair)
    line = curve([(0.0, 0.0, 0.1), (0.0, 0.0, 0.1 if case == "point" else 0.2)])
    line.data.bevel_depth = 0.01 if case == "faces" else 0.0
    bpy.context.view_layer.update()
    select(obj)
    line.select_set(True)
    count = len(obj.data.polygons)
    message = {"tile": "its atlas has 4 tiles", "point": "no length", "faces": "has faces"}[case]
    with pytest.raises(RuntimeError, match=message):
        bpy.ops.hairloom.add_card_along_curve(tile=9 if case == "tile" else 0)
    assert len(obj.data.polygons) == count
