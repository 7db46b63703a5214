"""Cards that an artist has edited with Blender's own tools survive Make Cards."""

import json
import zlib

import bmesh
import bpy
import numpy as np
import pytest
from glb_files import Glb
from selecting import select
from tiers import few_in_commits

from hairloom.addon.blender.cards.build import BuiltCards, build_steps, read_inputs
from hairloom.addon.blender.cards.edits import MADE_ATTRIBUTE, RECORD_PROPERTY, read_edits
from hairloom.addon.blender.cards.files import CardExport, CardOutput
from hairloom.addon.blender.cards.made_objects import card_objects
from hairloom.addon.blender.command_line import command_line
from hairloom.addon.blender.preview import previews, scene_events
from hairloom.addon.blender.viewport import overlay
from hairloom.addon.card_flow import cards_at
from hairloom.addon.cards.export_settings import CardExportSettings
from hairloom.addon.cards.steps import result_of


@pytest.fixture
def hair(new_hair, sphere):
    """A hedgehog of 60 strands on a sphere, set up for twelve cards in two levels."""
    made = new_hair(sphere)
    cards, texture = made.data.hairloom.cards, made.data.hairloom.card_texture
    cards.source, cards.card_count, cards.levels, cards.fly_aways = "clusters", 12, 2, 0.0
    cards.segment_count, cards.error = 8, 0.0
    made.data.hairloom.atlas.source = "made"
    made.data.hairloom.card_occlusion.rays = 32
    made.data.hairloom.cards.order_by = "distance"
    texture.height = texture.variant_width = 32
    bpy.context.view_layer.update()
    return made


def make(hair):
    select(hair)
    assert bpy.ops.hairloom.make_cards() == {"FINISHED"}
    bpy.context.view_layer.update()
    return card_objects(hair)[0]


def numbers(obj):
    """The index of the made card of each face, -1 for the artist's own cards."""
    found = np.empty(len(obj.data.polygons), np.int32)
    obj.data.attributes[MADE_ATTRIBUTE].data.foreach_get("value", found)
    return found - 1


def corners(obj, card, layer=None):
    """Sorted positions or UVs of a card's corners, the same in any face order."""
    mesh = obj.data
    rows = [
        tuple(mesh.vertices[mesh.loops[loop].vertex_index].co)
        if layer is None
        else tuple(mesh.uv_layers[layer].uv[loop].vector)
        for face, number in zip(mesh.polygons, numbers(obj), strict=True)
        if number == card
        for loop in face.loop_indices
    ]
    return np.array(sorted(rows))


def edit(obj, chosen, act):
    """Run `act` in Edit Mode with the faces of these cards selected."""
    select(obj)
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.select_mode(type="FACE")
    shape = bmesh.from_edit_mesh(obj.data)
    layer = shape.faces.layers.int[MADE_ATTRIBUTE]
    for face in shape.faces:
        face.select_set(face[layer] - 1 in chosen)
    shape.select_flush(False)
    bmesh.update_edit_mesh(obj.data)
    act()
    bpy.ops.object.mode_set(mode="OBJECT")


def move(obj, *chosen, by=(0.02, 0.0, 0.0)):
    edit(obj, chosen, lambda: bpy.ops.transform.translate(value=by))


def delete(obj, *chosen):
    edit(obj, chosen, lambda: bpy.ops.mesh.delete(type="FACE"))


def edits(hair):
    return read_edits(hair, bpy.context.evaluated_depsgraph_get())[0]


def test_unedited_cards_are_rebuilt(hair):
    obj = make(hair)
    assert edits(hair) is None
    edit(obj, (), lambda: None)  # enters and leaves Edit Mode
    assert edits(hair) is None
    hair.data.hairloom.cards.card_count = 20
    assert set(numbers(make(hair))) == set(range(20)) and edits(hair) is None


def test_a_moved_card_stays_where_it_was_put(hair):
    obj = make(hair)
    before = {card: corners(obj, card) for card in range(12)}
    move(obj, 3)
    assert (
        edits(hair).edited_count == 1
        and edits(hair).deleted_count == 0
        and edits(hair).added_count == 0
    )
    for _ in range(3):  # made again several times
        obj = make(hair)
        assert set(numbers(obj)) == set(range(12))
        np.testing.assert_allclose(corners(obj, 3), before[3] + [0.02, 0.0, 0.0], atol=1e-6)
        for card in set(range(12)) - {3}:
            np.testing.assert_allclose(corners(obj, card), before[card], atol=1e-6)
        assert edits(hair).edited_count == 1


def test_a_deleted_card_stays_deleted(hair):
    delete(make(hair), 5, 7)
    for _ in range(2):
        assert set(numbers(make(hair))) == set(range(12)) - {5, 7}
        assert edits(hair).deleted_count == 2 and edits(hair).edited_count == 0


def test_a_card_of_the_artists_own_stays(hair):
    obj = make(hair)

    def copy():
        bpy.ops.mesh.duplicate()
        bpy.ops.transform.translate(value=(0.0, 0.0, 0.05))

    original = corners(obj, 2)
    edit(obj, (2,), copy)
    for _ in range(2):
        obj = make(hair)
        np.testing.assert_allclose(corners(obj, 2), original, atol=1e-6)
        np.testing.assert_allclose(corners(obj, -1), original + [0.0, 0.0, 0.05], atol=1e-6)
        assert edits(hair).added_count == 1 and edits(hair).edited_count == 0


def test_another_tile_is_kept(hair):
    obj = make(hair)
    width = 1.0 / 4.0

    def next_tile():
        shape = bmesh.from_edit_mesh(obj.data)
        layer = shape.loops.layers.uv["UVMap"]
        for face in shape.faces:
            if face.select:
                for loop in face.loops:
                    loop[layer].uv.x = (loop[layer].uv.x + width) % 1.0
        bmesh.update_edit_mesh(obj.data)

    edit(obj, (4,), next_tile)
    chosen = corners(obj, 4, "UVMap")
    assert edits(hair).edited_count == 1
    obj = make(hair)
    np.testing.assert_allclose(corners(obj, 4, "UVMap"), chosen, atol=1e-6)
    tile = np.empty(len(obj.data.polygons), np.int32)
    obj.data.attributes["tile"].data.foreach_get("value", tile)
    assert set(tile[numbers(obj) == 4]) == {int(chosen[:, 0].mean() * 4)}


@pytest.mark.alike
@pytest.mark.parametrize("count", [6, 12, 24])
def test_edited_cards_survive_another_card_count(hair, count):
    """Make Cards with fewer cards, as many from another seed, and more, keeps the moved card."""
    obj = make(hair)
    move(obj, 3)
    delete(obj, 5)
    kept = corners(obj, 3)
    hair.data.hairloom.cards.card_count = count
    hair.data.hairloom.cards.seed = 7
    obj = make(hair)
    found = [corners(obj, card) for card in set(numbers(obj))]
    assert any(len(each) == len(kept) and np.allclose(each, kept, atol=1e-6) for each in found)
    assert obj.hairloom.card_object.card_count == len(found) <= count + 1


@pytest.mark.parametrize("seed", few_in_commits([1, 3]))
def test_cards_that_were_joined_to_save_triangles_are_not_deleted(hair, seed):
    cards = hair.data.hairloom.cards
    cards.segment_count, cards.max_triangles, cards.seed = 1, 12, seed
    obj = make(hair)
    first = areas(obj)
    assert len(first) == 6 and edits(hair) is None
    np.testing.assert_allclose(sorted(areas(make(hair))), sorted(first), rtol=1e-5)
    # an edited card also represents those that it was joined with, and stays where it was put
    card = max(numbers(obj))
    shape = corners(obj, card)
    move(obj, card)
    assert edits(hair).edited_count == 1 and edits(hair).deleted_count == 0
    for _ in range(2):
        np.testing.assert_allclose(sorted(areas(make(hair))), sorted(first), rtol=1e-5)
        np.testing.assert_allclose(corners(obj, card), shape + [0.02, 0.0, 0.0], atol=1e-6)
    # the other cards come back once there is room for them
    cards.max_triangles = 0
    assert len(areas(make(hair))) == 11
    bpy.ops.hairloom.discard_card_edits()
    assert len(areas(obj)) == 12 and edits(hair) is None


def areas(obj):
    """The area of each card [m^2]."""
    total = np.zeros(max(numbers(obj)) + 1)
    np.add.at(total, numbers(obj), [face.area for face in obj.data.polygons])
    return total[total > 0.0]


def test_cards_with_shape_keys_are_not_made_again(hair):
    """Shape keys store positions by vertex index, which new vertices would reuse."""
    obj = make(hair)
    obj.shape_key_add(name="Basis")
    obj.shape_key_add(name="Wind").data[0].co.z += 0.1
    hair.data.hairloom.cards.card_count = 20
    select(hair)
    with pytest.raises(RuntimeError, match="shape keys"):
        bpy.ops.hairloom.make_cards()
    assert set(numbers(obj)) == set(range(12))
    obj.shape_key_clear()
    assert set(numbers(make(hair))) == set(range(20))


def test_all_deleted_is_an_empty_mesh_and_a_note(hair, capfd):
    delete(make(hair), *range(12))
    obj = make(hair)
    assert not len(obj.data.polygons) and len(card_objects(hair)) == 1
    assert "Discard Edits makes them again" in capfd.readouterr().out
    assert not len(make(hair).data.polygons)


def test_discarding_edits_rebuilds_all_cards_and_can_be_undone(hair):
    obj = make(hair)
    before = {card: corners(obj, card) for card in range(12)}
    move(obj, 3)
    delete(obj, 5)
    obj = make(hair)
    bpy.ops.ed.undo_push(message="before")
    select(hair)
    assert bpy.ops.hairloom.discard_card_edits() == {"FINISHED"}
    bpy.ops.ed.undo_push(message="discarded")
    assert edits(hair) is None
    for card, places in before.items():
        np.testing.assert_allclose(corners(card_objects(hair)[0], card), places, atol=1e-6)
    bpy.ops.ed.undo()
    again = bpy.data.objects["Hair"]
    assert (edits(again).edited_count, edits(again).deleted_count) == (1, 1)


def test_an_undone_edit_does_not_count_as_edited(hair):
    obj = make(hair)
    bpy.ops.ed.undo_push(message="made")
    move(obj, 3)
    bpy.ops.ed.undo_push(message="moved")
    assert edits(hair).edited_count == 1
    bpy.ops.ed.undo()
    assert edits(bpy.data.objects["Hair"]) is None


def test_a_foreign_mesh_that_is_joined_stays_as_the_artists_own(hair):
    obj = make(hair)
    bpy.ops.mesh.primitive_plane_add(size=0.05, location=(0.0, 0.0, 0.3))
    plane = bpy.context.object
    select(obj)
    plane.select_set(True)
    bpy.ops.object.join()
    assert (edits(hair).added_count, edits(hair).edited_count, edits(hair).deleted_count) == (
        1,
        0,
        0,
    )
    obj = make(hair)
    assert obj.hairloom.card_object.card_count == 13
    own = corners(obj, -1)
    np.testing.assert_allclose(own[:, 2], 0.3, atol=1e-6)
    np.testing.assert_allclose(np.ptp(own, axis=0)[:2], 0.05, atol=1e-6)


def test_cards_without_numbers_are_identified_by_their_place(hair, capfd):
    obj = make(hair)
    before = corners(obj, 3)
    move(obj, 3, by=(0.005, 0.0, 0.0))
    delete(obj, 5)
    obj.data.attributes.remove(obj.data.attributes[MADE_ATTRIBUTE])
    assert (edits(hair).edited_count, edits(hair).deleted_count, edits(hair).added_count) == (
        1,
        1,
        0,
    )
    obj = make(hair)
    assert "recognised by their places" in capfd.readouterr().out
    np.testing.assert_allclose(corners(obj, 3), before + [0.005, 0.0, 0.0], atol=1e-6)
    assert set(numbers(obj)) == set(range(12)) - {5}


@pytest.mark.parametrize("record", [None, 1, {"places": [1.0]}])
def test_cards_without_a_record_are_rebuilt_with_a_message(hair, capfd, record):
    obj = make(hair)
    move(obj, 3)
    if record is None:
        del obj.data[RECORD_PROPERTY]
    else:
        obj.data[RECORD_PROPERTY] = record
    make(hair)
    assert "it has no record of its cards" in capfd.readouterr().out
    assert edits(hair) is None


def test_cards_without_uvs_are_refused(hair, capfd):
    obj = make(hair)
    move(obj, 3)
    places = corners(obj, 3)
    obj.data.uv_layers.remove(obj.data.uv_layers["UVMap"])
    select(hair)
    with pytest.raises(RuntimeError, match="its UV map is missing"):
        bpy.ops.hairloom.make_cards()
    np.testing.assert_array_equal(corners(obj, 3), places)
    assert bpy.ops.hairloom.discard_card_edits() == {"FINISHED"}
    assert edits(hair) is None


def test_a_card_away_from_the_head_is_kept_and_reported(hair, capfd):
    obj = make(hair)
    before = corners(obj, 3)
    move(obj, 3, by=(0.0, 0.0, 1.0))
    obj = make(hair)
    assert "1 of the kept cards begin away from the head" in capfd.readouterr().out
    np.testing.assert_allclose(corners(obj, 3), before + [0.0, 0.0, 1.0], atol=1e-6)


def test_edited_cards_go_with_their_skin(hair, sphere):
    """Moved vertices of the head's mesh, as a pose moves them, carry edited cards along."""
    obj = make(hair)
    move(obj, 3)
    before = corners(obj, 3)
    for vertex in sphere.data.vertices:
        vertex.co.z += 0.5
    for curve in hair.data.curves:
        for point in curve.points:
            point.position.z += 0.5
    hair.data.update_tag()
    sphere.data.update_tag()
    np.testing.assert_allclose(corners(make(hair), 3), before + [0.0, 0.0, 0.5], atol=1e-4)


@pytest.mark.parametrize("scale", few_in_commits([(-1.0, 1.0, 1.0), (2.0, 2.0, 2.0)]))
def test_edited_cards_go_with_the_object(hair, sphere, scale):
    """Meshes of cards are in the hair's space: edits survive a moved, scaled or mirrored head."""
    sphere.location, sphere.scale = (1.0, 2.0, 3.0), scale
    bpy.context.view_layer.update()
    obj = make(hair)
    facing = faces(obj, 3)
    move(obj, 3, by=(0.0, 0.0, 0.02))
    before = corners(obj, 3)
    sphere.location.x += 1.0
    bpy.context.view_layer.update()
    obj = make(hair)
    np.testing.assert_allclose(corners(obj, 3), before, atol=2e-6)
    np.testing.assert_allclose(faces(obj, 3), facing, atol=1e-3)


def faces(obj, card):
    """The mean normal of a card's faces."""
    pairs = zip(obj.data.polygons, numbers(obj), strict=True)
    return np.mean([face.normal[:] for face, number in pairs if number == card], axis=0)


def test_coarser_levels_follow_the_edited_shape(hair):
    """The coarser level follows a card that was moved and enlarged, and lacks a deleted card."""
    cards = hair.data.hairloom.cards
    cards.column_count, cards.error, cards.bend = 2, 0.02, 0.0
    obj = make(hair)
    coarse = of_card(card_objects(hair)[1], 3)
    assert len(coarse), "it is not joined with another"

    def enlarge():
        bpy.ops.transform.translate(value=(0.0, 0.0, 0.1))
        bpy.ops.transform.resize(value=(1.5, 1.5, 1.5))

    edit(obj, (3,), enlarge)
    delete(obj, 5)
    obj = make(hair)
    own, coarse = corners(obj, 3), of_card(card_objects(hair)[1], 3)
    assert not len(of_card(card_objects(hair)[1], 5))
    assert len(coarse) < len(own)
    # 0.013 m, because the coarser card is raised where it would sink into the head
    for reach in (np.min, np.max):
        np.testing.assert_allclose(reach(coarse, axis=0), reach(own, axis=0), atol=0.013)


def of_card(obj, card):
    """The positions of a card's corners, in a mesh of any level."""
    number = np.empty(len(obj.data.polygons), np.int32)
    obj.data.attributes["card"].data.foreach_get("value", number)
    pairs = zip(obj.data.polygons, number, strict=True)
    rows = [obj.data.vertices[v].co[:] for face, n in pairs if n == card for v in face.vertices]
    return np.array(rows)


def test_linked_cards_are_refused(hair, tmp_path):
    obj = make(hair)
    move(obj, 3)
    path = tmp_path / "cards.blend"
    bpy.data.libraries.write(str(path), {obj, hair})
    bpy.ops.wm.read_homefile(use_empty=True)
    with bpy.data.libraries.load(str(path), link=True) as (there, here):
        here.objects = there.objects
    for each in here.objects:
        bpy.context.collection.objects.link(each)
    bpy.context.view_layer.update()
    linked = bpy.data.objects["Hair"]
    assert edits(linked).edited_count == 1, "exports and drawings read them"
    select(linked)
    with pytest.raises(RuntimeError, match="linked from another file"):
        bpy.ops.hairloom.make_cards()


def test_edits_are_in_the_file(hair, tmp_path):
    move(make(hair), 3)
    path = str(tmp_path / "saved.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path)
    bpy.ops.wm.open_mainfile(filepath=path)
    assert edits(bpy.data.objects["Hair"]).edited_count == 1


def test_what_is_drawn_has_the_edits(hair, get_depsgraph):
    """The preview updates when Edit Mode ends, without Make Cards."""
    obj = make(hair)
    hair.data.hairloom.card_drawing.shown_as = "cards"
    session = previews.start(hair, get_depsgraph())
    try:
        before = drawn(session)
        assert before.card_count == 12
        move(obj, 3, by=(0.0, 0.0, 1.0))
        delete(obj, 5, 6)
        scene_events.updated(get_depsgraph())
        scene_events.catch_up(get_depsgraph())
        now = drawn(session)
        assert now.card_count == 10
        np.testing.assert_allclose(lowest(now, 3), lowest(before, 3) + 1.0, atol=1e-5)
    finally:
        previews.stop_all()


def test_cards_that_cannot_be_read_are_drawn_as_made(hair, get_depsgraph):
    obj = make(hair)
    move(obj, 3, by=(0.0, 0.0, 1.0))
    hair.data.hairloom.card_drawing.shown_as = "cards"
    session = previews.start(hair, get_depsgraph())
    try:
        edited = lowest(drawn(session), 3)
        obj.data.uv_layers.remove(obj.data.uv_layers["UVMap"])
        obj.data.update_tag()
        bpy.context.view_layer.update()
        scene_events.updated(get_depsgraph())
        scene_events.catch_up(get_depsgraph())
        assert lowest(drawn(session), 3) < edited - 0.9
        assert any("its UV map is missing" in each for each in session.cards.warnings)
    finally:
        previews.stop_all()


def drawn(session):
    return overlay.drawing_of(session.uid).snapshot.cards.mesh


def lowest(mesh, card):
    return mesh.positions[mesh.triangles[mesh.card == card]][..., 2].min()


def test_edited_cards_ride_on_the_guides(hair, get_depsgraph):
    """A card that was moved follows its guides as the other cards do."""
    obj = make(hair)
    move(obj, 3, by=(0.0, 0.0, 0.02))
    built = BuiltCards.build(read_inputs(hair, get_depsgraph())[0])
    rig = built.rig
    away = np.array([0.1, 0.2, 0.3], np.float32)
    still, moved = (
        cards_at(rig, built.binding, rig.rest_pose, rig.guide_grid + by)
        for by in (0.0 * away, away)
    )
    np.testing.assert_allclose(lowest(still, 3), corners(obj, 3)[:, 2].min(), atol=1e-5)
    part = still.triangles[still.card == 3]
    np.testing.assert_allclose(
        moved.positions[part].mean(axis=(0, 1)) - still.positions[part].mean(axis=(0, 1)),
        away,
        atol=0.03,
    )


def test_exported_cards_have_the_edits(hair, get_depsgraph, tmp_path):
    """Blender's glTF importer finds the moved card, and not the deleted one."""
    obj = make(hair)
    move(obj, 3, by=(0.0, 0.0, 1.0))
    delete(obj, 5)
    export = CardExport.of(hair, get_depsgraph(), tmp_path / "cards.glb", CardOutput(), levels=1)
    written = result_of(export.writing(result_of(build_steps(export.inputs))))
    assert "1 edited and 1 deleted cards kept" in written.result
    sidecar = json.loads((tmp_path / "cards.hairloom.json").read_text())
    before = set(bpy.data.objects)
    bpy.ops.import_scene.gltf(filepath=str(tmp_path / "cards.glb"))
    (read,) = [each for each in set(bpy.data.objects) - before if each.type == "MESH"]
    assert len(read.data.polygons) == 11 * 32
    heights = np.array([read.matrix_world @ v.co for v in read.data.vertices])[:, 2]
    assert np.count_nonzero(heights > 0.6) == 9 * 3
    assert sidecar["levels"][0]["cards"] == 11


def test_a_card_whose_uvs_are_folded_has_the_indices_of_its_file(hair, get_depsgraph, tmp_path):
    """Indices also match for a card whose folded UVs leave triangles that share only a vertex."""
    hair.data.hairloom.cards.column_count = 2
    obj = make(hair)
    uv = obj.data.uv_layers["UVMap"].uv
    for card in (3, 7):
        loops = [
            loop
            for face, number in zip(obj.data.polygons, numbers(obj), strict=True)
            if number == card
            for loop in face.loop_indices
        ]
        u = np.array([uv[loop].vector[0] for loop in loops])
        low, middle = u.min(), (u.min() + u.max()) / 2.0
        for loop, across in zip(loops, u, strict=True):
            is_folded = across > middle if card == 3 else loop in loops[:3]
            uv[loop].vector[0] = low + middle - across if is_folded else across
    settings = CardExportSettings(index_buffer=True)
    path, output = tmp_path / "cards.glb", CardOutput(settings=settings)
    export = CardExport.of(hair, get_depsgraph(), path, output, levels=1)
    result_of(export.writing(result_of(build_steps(export.inputs))))
    (level,) = json.loads((tmp_path / "cards.hairloom.json").read_text())["levels"]
    glb = Glb(path)
    (primitive,) = glb.json["meshes"][0]["primitives"]
    indices = glb.accessor(primitive["indices"]).ravel()
    vertex_count = glb.json["accessors"][primitive["attributes"]["POSITION"]]["count"]
    assert level["vertices"] == vertex_count > 12 * 9 * 3
    assert level["indices_adler32"] == zlib.adler32(indices.astype("<u4").tobytes())
    beside = np.frombuffer((tmp_path / "cards.indices.bin").read_bytes(), "<u2")
    assert (beside[: len(indices)] == indices).all()
    first, back = (np.sort(each.reshape(-1, 3), axis=1) for each in np.split(beside, 2))
    assert sorted(first.tolist()) == sorted(back.tolist())


@pytest.mark.parametrize("is_chosen", few_in_commits([False, True]))
def test_in_another_atlas_a_card_lies_within_one_tile(hair, is_chosen):
    """The atlas changes from four columns to eight. A card that was only moved takes the tile of
    the card that it replaces."""
    obj = make(hair)
    move(obj, *range(12))
    if is_chosen:
        edit(obj, range(12), lambda: bpy.ops.hairloom.card_tile(to="next"))
    hair.data.hairloom.cards.atlas_columns = 8
    tiles = tiles_of(make(hair))
    for card, tile in tiles.items():
        u = corners(obj, card, "UVMap")[:, 0] * 8
        np.testing.assert_allclose([u.min(), u.max()], [tile, tile + 1], atol=1e-4)
    select(hair)
    bpy.ops.hairloom.discard_card_edits()
    assert (tiles_of(card_objects(hair)[0]) == tiles) != is_chosen


def tiles_of(obj):
    """The tile of each of the twelve cards."""
    tile = np.empty(len(obj.data.polygons), np.int32)
    obj.data.attributes["tile"].data.foreach_get("value", tile)
    return {card: int(tile[numbers(obj) == card][0]) for card in range(12)}


@pytest.mark.parametrize("discarding", [False, True])
def test_the_verb_cards_keeps_edits_unless_they_are_discarded(hair, tmp_path, discarding):
    obj = make(hair)
    move(obj, 3, by=(0.0, 0.0, 1.0))
    delete(obj, 5)
    scene, file, report = (str(tmp_path / name) for name in ("a.blend", "cards.glb", "r.json"))
    bpy.ops.wm.save_as_mainfile(filepath=scene)
    how = ["--discard-edits"] if discarding else []
    given = ["--scene", scene, "--groom", "Hair", "--head", "Head", "--levels", "1"]
    assert command_line.run(["cards", *given, "--output", file, "--report", report, *how]) == 0
    facts = json.loads((tmp_path / "r.json").read_text())
    assert facts["cards"] == (12 if discarding else 11)
    kept = {"edited": 1, "deleted": 1, "own": 0}
    assert facts.get("card_edits") == (None if discarding else kept)
