"""Hair cards as objects in a scene."""

from itertools import pairwise
from types import SimpleNamespace

import bpy
import numpy as np
import pytest
from mathutils import Matrix

from hairloom.addon.blender.cards.made_objects import card_objects
from hairloom.addon.blender.cards.object import CardObjectJob
from hairloom.addon.cards.steps import result_of
from hairloom.addon.ui.long_work import threaded


@pytest.fixture
def hair(new_hair, sphere):
    """A hedgehog of 60 strands in two groups on a sphere, for few cards with a small texture."""
    made = new_hair(sphere)
    cards, texture = made.data.hairloom.cards, made.data.hairloom.card_texture
    cards.source, cards.card_count, cards.levels, cards.fly_aways = "clusters", 12, 3, 0.0
    cards.segment_count, cards.error = 8, 0.0
    made.data.hairloom.atlas.source = "made"
    made.data.hairloom.card_occlusion.rays = 32
    made.data.hairloom.cards.order_by = "distance"
    texture.height = texture.variant_width = 32
    bpy.context.view_layer.update()
    return made


def press():
    assert bpy.ops.hairloom.make_cards() == {"FINISHED"}
    bpy.context.view_layer.update()


def test_cards_that_are_cancelled_leave_the_scene_as_it_was(hair):
    """Esc closes the steps: once before the first cards exist, and once when they are remade."""
    before = sorted(obj.name for obj in bpy.data.objects)
    for _ in range(2):
        points = {obj.name: world_points(obj) for obj in card_objects(hair)}
        steps = bpy.types.HAIRLOOM_OT_make_cards.steps(SimpleNamespace(), bpy.context)
        hair.data.hairloom.cards.card_count += 3
        assert next(steps).text == "Reading the hair"
        next(steps)
        steps.close()
        assert sorted(obj.name for obj in bpy.data.objects) == before
        for obj in card_objects(hair):
            np.testing.assert_array_equal(world_points(obj), points[obj.name])
        press()
        before = sorted(obj.name for obj in bpy.data.objects)


def values(obj, name, width=1):
    attribute = obj.data.attributes[name]
    part = "vector" if width == 3 else "value"
    dtype = np.int32 if attribute.data_type == "INT" else np.float32
    read = np.empty(len(attribute.data) * width, dtype)
    attribute.data.foreach_get(part, read)
    return read if width == 1 else read.reshape(-1, width)


def world_points(obj):
    points = np.empty((len(obj.data.vertices), 3), np.float32)
    obj.data.vertices.foreach_get("co", points.ravel())
    matrix = np.array(obj.matrix_world)
    return points @ matrix[:3, :3].T + matrix[:3, 3]


def test_one_press_makes_an_object_a_level_beside_the_hair(hair, sphere):
    press()
    objects = card_objects(hair)
    assert [obj.name for obj in objects] == ["Hair Cards", "Hair Cards LOD1", "Hair Cards LOD2"]
    assert all(obj.hairloom.card_object.groom == hair for obj in objects)
    assert all(obj.parent == sphere for obj in objects)
    assert all(obj.users_collection == hair.users_collection for obj in objects)
    assert [obj.hide_viewport for obj in objects] == [False, True, True]
    assert [obj.hide_render for obj in objects] == [False, True, True]
    counts = [len(obj.data.polygons) for obj in objects]
    assert counts[0] == 12 * 2 * 2 * 8
    for finer, coarser in pairwise(counts):
        assert 0.4 <= coarser / finer <= 0.6
    assert objects[0].hairloom.card_object.card_count == 12
    # the strands stand on a sphere of 0.1 m and are 0.08 m long; a card is the mean of five
    reach, along = np.linalg.norm(world_points(objects[0]), axis=1), values(objects[0], "along")
    assert 0.09 < np.median(reach[along == 0.0]) < 0.12
    assert 0.15 < np.median(reach[along == 1.0]) < 0.22


def test_the_mesh_holds_what_an_engine_or_a_node_tree_needs(hair):
    press()
    mesh = card_objects(hair)[0].data
    assert [layer.name for layer in mesh.uv_layers] == ["UVMap", "Occlusion"]
    obj = card_objects(hair)[0]
    along, occlusion = values(obj, "along"), values(obj, "occlusion")
    assert along.min() == 0.0 and along.max() == 1.0
    assert 0.0 <= occlusion.min() < occlusion.max() <= 1.0
    assert set(values(obj, "group").tolist()) == {0, 1}
    assert set(values(obj, "layer").tolist()) <= {0, 1, 2}
    np.testing.assert_array_equal(np.bincount(values(obj, "card")), np.full(12, 32))
    corners = np.empty(len(mesh.loops), np.int32)
    mesh.loops.foreach_get("vertex_index", corners)
    second = np.empty((len(mesh.loops), 2), np.float32)
    mesh.uv_layers[1].uv.foreach_get("vector", second.ravel())
    np.testing.assert_allclose(second, np.stack([occlusion, along], axis=1)[corners], atol=1e-6)
    # Blender shades with our normals, which lean outwards relative to the flat triangles
    shown = np.empty((len(mesh.loops), 3), np.float32)
    mesh.corner_normals.foreach_get("vector", shown.ravel())
    np.testing.assert_allclose(shown, values(obj, "custom_normal", 3)[corners], atol=1e-3)


def test_pressing_again_keeps_the_object_and_what_the_artist_added(hair):
    press()
    obj = card_objects(hair)[0]
    before = world_points(obj)
    own = bpy.data.materials.new("Own")
    obj.data.materials[0] = own
    obj.modifiers.new("Thick", "SOLIDIFY")
    obj.name = "Wig"
    obj.location.x += 1.0
    image = obj.hairloom.card_object.image
    hair.data.hairloom.cards.card_count = 20
    hair.data.hairloom.cards.levels = 2
    press()
    objects = card_objects(hair)
    assert [each.name for each in objects] == ["Wig", "Hair Cards LOD1"]
    assert objects[0] == obj
    assert [m.name for m in obj.data.materials] == ["Own"] and obj.modifiers[0].name == "Thick"
    assert obj.hairloom.card_object.image == image and len(bpy.data.images) == 1
    assert obj.hairloom.card_object.card_count == 20
    moved = world_points(obj).mean(axis=0) - before.mean(axis=0)
    np.testing.assert_allclose(moved, [1.0, 0.0, 0.0], atol=0.02)
    assert "Hair Cards LOD2" not in bpy.data.objects and len(bpy.data.meshes) == 3


def test_another_texture_may_have_another_size(hair):
    press()
    hair.data.hairloom.cards.atlas_columns = 8
    press()
    assert tuple(card_objects(hair)[0].hairloom.card_object.image.size) == (256, 32)


@pytest.mark.alike
@pytest.mark.parametrize("name", ["Backup", "Hair Cards", "Zoë's"])
@pytest.mark.parametrize("reopened", [False, True])
def test_a_copy_of_the_cards_is_left_alone(hair, name, reopened, tmp_path):
    """The copy's name does not matter, not even the cards' former name."""
    press()
    obj = card_objects(hair)[0]
    obj.name = "Fringe"
    copy = obj.copy()
    copy.data = obj.data.copy()
    copy.name = name
    bpy.context.collection.objects.link(copy)
    count = len(copy.data.polygons)
    if reopened:
        bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "cards.blend"))
        bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "cards.blend"))
        hair = bpy.data.objects["Hair"]
        bpy.context.view_layer.objects.active = hair
        hair.select_set(True)
    hair.data.hairloom.cards.card_count = 4
    press()
    assert len(bpy.data.objects[name].data.polygons) == count
    assert len(bpy.data.objects["Fringe"].data.polygons) != count
    assert card_objects(hair)[0].name == "Fringe"


def test_a_copy_is_left_alone_after_the_cards_are_deleted(hair):
    press()
    obj = card_objects(hair)[0]
    copy = obj.copy()
    copy.data = obj.data.copy()
    bpy.context.collection.objects.link(copy)
    bpy.data.objects.remove(obj)
    count = len(copy.data.polygons)
    hair.data.hairloom.cards.card_count = 4
    press()
    assert len(copy.data.polygons) == count
    assert len(card_objects(hair)[0].data.polygons) != count


@pytest.mark.parametrize("scale", [(1.0, 1.0, 1.0), (-2.0, 0.5, 1.0)])
def test_cards_lie_on_hair_that_was_moved_scaled_and_mirrored(hair, sphere, scale):
    moved = Matrix.LocRotScale((0.3, -0.2, 0.1), None, scale)
    sphere.matrix_world = moved @ sphere.matrix_world
    hair.data.hairloom.cards.card_count = 60  # a card for each strand
    bpy.context.view_layer.update()
    press()
    obj = card_objects(hair)[0]
    points = world_points(obj)
    strands = np.empty((len(hair.data.position_data), 3), np.float32)
    hair.data.position_data.foreach_get("vector", strands.ravel())
    matrix = np.array(hair.matrix_world)
    strands = strands @ matrix[:3, :3].T + matrix[:3, 3]
    np.testing.assert_allclose(points.min(axis=0), strands.min(axis=0), atol=0.01)
    np.testing.assert_allclose(points.max(axis=0), strands.max(axis=0), atol=0.01)
    # in object space, faces and normals point the same way
    own = np.empty((len(obj.data.polygons), 3), np.float32)
    obj.data.polygons.foreach_get("normal", own.ravel())
    corners = np.empty(len(obj.data.loops), np.int32)
    obj.data.loops.foreach_get("vertex_index", corners)
    normals = values(obj, "custom_normal", 3)[corners.reshape(-1, 3)].mean(axis=1)
    # except facets that turn away from the normals of their upright hair; if mirrored, all would
    # fail
    assert ((own * normals).sum(axis=1) > 0.0).mean() > 0.9


def test_cards_can_be_undone_and_their_groom_is_saved(hair, tmp_path):
    press()
    path = str(tmp_path / "cards.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path, check_existing=False)
    bpy.ops.wm.open_mainfile(filepath=path)
    again = bpy.data.objects["Hair"]
    objects = card_objects(again)
    assert len(objects) == 3
    assert objects[0].hairloom.card_object.image.packed_file is not None
    picture = np.empty(4 * int(np.prod(objects[0].hairloom.card_object.image.size)), np.float32)
    objects[0].hairloom.card_object.image.pixels.foreach_get(picture)
    assert picture[3::4].max() > 0.9


def test_hair_that_was_removed_meanwhile_changes_nothing(hair):
    job = CardObjectJob(hair, bpy.context.evaluated_depsgraph_get())
    work = job.building()
    bpy.data.objects.remove(hair)
    with pytest.raises(Exception, match="gone"):
        job.write(result_of(threaded(work)))
    assert not any(obj.hairloom.card_object.groom for obj in bpy.data.objects)


def test_cards_that_are_being_edited_are_refused(hair, capfd):
    press()
    obj = card_objects(hair)[0]
    count = len(obj.data.polygons)
    bpy.context.view_layer.objects.active = obj
    bpy.ops.object.mode_set(mode="EDIT")
    with pytest.raises(Exception, match="Object Mode"):
        CardObjectJob(hair, bpy.context.evaluated_depsgraph_get())
    bpy.ops.object.mode_set(mode="OBJECT")
    assert len(obj.data.polygons) == count


def test_the_panel_shows_the_counts_of_existing_cards(hair):
    from hairloom.addon.ui.operators_cards import draw_made_cards

    labels: list[str] = []

    class Layout(SimpleNamespace):
        def column(self, **_):
            return self

        row = column

        def label(self, text="", icon="NONE", translate=True):
            labels.append(text)

        def operator(self, _name, text="", icon="NONE"):
            labels.append(text)

        def prop(self, *_arguments, text="", **_named):
            labels.append(text)

    draw_made_cards(Layout(), hair)
    assert labels == ["Make Cards", "No cards yet", *5 * ["-"], "", "Texture -"]
    before = len(labels)
    press()
    labels.clear()
    draw_made_cards(Layout(), hair)
    assert len(labels) == before, "what is below moves"
    assert labels[0] == "Make Cards Again"
    assert labels[1:3] == ["12 cards, 384 triangles", "384"] and labels[5:7] == ["-", "-"]
    assert labels[-2].endswith(" % of pixels blend in the wrong order")
    assert labels[-1] == "Texture 128 x 32"


def test_the_panel_shows_only_what_acts_on_these_cards(hair):
    from hairloom.addon.ui.card_sections import draw_card_texture, draw_strips

    drawn: list[str] = []

    class Layout:
        def column(self, **_):
            return self

        def prop(self, _group, name, **_):
            drawn.append(name)

        def label(self, **_):
            pass

        def template_ID(self, _group, name, **_):
            drawn.append(name)

    def shown(draw):
        drawn.clear()
        draw(Layout(), hair)
        return set(drawn)

    groom = hair.data.hairloom
    assert "card_count" in shown(draw_strips) and "width_factor" not in shown(draw_strips)
    assert "atlas_columns" in shown(draw_strips) and "padding" not in shown(draw_card_texture)
    groom.atlas.source = "baked"
    assert "atlas_columns" not in shown(draw_strips) and "padding" in shown(draw_card_texture)
    assert "shift_cells" in drawn and "tip_length" not in drawn
    groom.cards.source = "guides"
    assert "width_factor" in shown(draw_strips) and "card_count" not in shown(draw_strips)
    assert {"source", "padding"} <= shown(draw_card_texture)
