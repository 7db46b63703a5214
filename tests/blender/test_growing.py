"""Hair stores its growth settings, and follows them until somebody combs it."""

import bpy
import numpy as np
import pytest

from hairloom.addon.blender.base.attributes import read_attribute, set_attribute
from hairloom.addon.blender.preview import previews, scene_events
from hairloom.addon.blender.properties.properties import settings_of, weights_of_surface
from hairloom.addon.blender.scene.curves import curve_points, read_curves, set_points
from hairloom.addon.blender.strands.growing import has_grown, is_outdated, lost_by_regrowing
from hairloom.addon.groom.grow import grow
from hairloom.addon.groom.scalp import scalp_density
from hairloom.addon.groom.settings import GrowSettings
from hairloom.addon.strands import Surface

pytestmark = pytest.mark.usefixtures("extension")
FEW = {"strand_count": 60, "length": 0.1, "cv_count": 8}


@pytest.fixture
def grown(sphere):
    bpy.ops.hairloom.grow(**FEW)
    return bpy.context.object


def lengths(hair):
    bpy.context.view_layer.update()
    return read_curves(hair, bpy.context.evaluated_depsgraph_get()).strands.lengths()


def comb(hair):
    set_points(hair.data, curve_points(hair.data) * np.float32(1.05))


def test_a_groom_keeps_what_it_has_grown_by(grown):
    grow_settings = grown.data.hairloom.grow
    assert settings_of(grow_settings, GrowSettings) == GrowSettings(**FEW)
    assert (
        has_grown(grown.data)
        and lost_by_regrowing(grown.data) == ()
        and not is_outdated(grown.data)
    )


def test_an_edit_makes_the_hair_that_its_settings_say(grown, sphere):
    """The result equals the pure function `grow` with these settings."""
    before = lengths(grown)
    grow_settings = grown.data.hairloom.grow
    grow_settings.length, grow_settings.droop = 0.05, 0.2
    assert lengths(grown).max() == pytest.approx(0.5 * before.max(), rel=0.03)
    mesh = sphere.data
    mesh.calc_loop_triangles()
    surface = Surface(
        np.array([vertex.co for vertex in mesh.vertices]),
        np.array([triangle.vertices for triangle in mesh.loop_triangles]),
    )
    settings = GrowSettings(**{**FEW, "length": 0.05, "droop": 0.2})
    expected = grow(surface, settings, scalp_density(surface)).points
    assert curve_points(grown.data) == pytest.approx(expected, abs=1e-5)


def test_more_strands_and_more_points_are_made_too(grown):
    grow_settings = grown.data.hairloom.grow
    grow_settings.strand_count = 90
    grow_settings.cv_count = 10
    assert len(grown.data.curves) == 90 and len(grown.data.points) == 900
    grow_settings.strand_count, grow_settings.cv_count = FEW["strand_count"], FEW["cv_count"]
    again = curve_points(grown.data)
    bpy.ops.hairloom.grow_again()
    assert np.array_equal(curve_points(grown.data), again), "it depends on what was there before"


def test_hair_of_a_head_that_was_moved_grows_on_it(grown, sphere):
    at_first = curve_points(grown.data)
    sphere.location = (0.5, 0.0, -0.25)
    bpy.ops.hairloom.grow_again()
    away = np.abs(curve_points(grown.data) - at_first)
    assert np.quantile(away, 0.95) < 1e-4, "it grows where the head has been"


@pytest.mark.parametrize("change", ["combed", "cut", "painted"])
def test_hair_that_was_changed_is_not_lost_to_a_slider(grown, change):
    if change == "combed":
        comb(grown)
        lost = ("combed shape",)
    elif change == "cut":
        grown.data.remove_curves(indices=[3, 4])
        lost = ("combed shape",)
    else:
        grown.data.attributes.new("Mask", "FLOAT", "POINT")
        lost = ("Mask",)
    points = curve_points(grown.data)
    grown.data.hairloom.grow.length = 0.05
    assert np.array_equal(curve_points(grown.data), points), "what was done to it is gone"
    assert lost_by_regrowing(grown.data) == lost and is_outdated(grown.data)
    assert bpy.ops.hairloom.grow_again() == {"FINISHED"}
    assert lost_by_regrowing(grown.data) == () and len(grown.data.curves) == FEW["strand_count"]
    assert lengths(grown).max() < 0.052
    grown.data.hairloom.grow.length = 0.1
    assert lengths(grown).max() > 0.09, "it does not follow again"


def test_hair_that_was_not_grown_stays_until_grow_again_is_pressed(new_hair, sphere):
    hair = new_hair(sphere)
    points = curve_points(hair.data)
    hair.data.hairloom.grow.strand_count = 40
    assert np.array_equal(curve_points(hair.data), points)
    assert lost_by_regrowing(hair.data) == (f"{len(hair.data.curves):,} curves",)
    hair.data.hairloom.grow.length = 0.1
    bpy.ops.hairloom.grow_again()
    assert len(hair.data.curves) == 40 and has_grown(hair.data)


def test_hair_without_a_surface_says_that_it_cannot_grow(new_hair):
    new_hair()
    with pytest.raises(RuntimeError, match="no surface to grow on"):
        bpy.ops.hairloom.grow_again()


def test_weights_come_from_a_group_and_a_problem_is_reported_until_fixed(grown, sphere):
    group = sphere.vertex_groups.new(name="Top")
    positions = np.array([vertex.co for vertex in sphere.data.vertices])
    group.add(np.flatnonzero(positions[:, 2] > 0.05).tolist(), 1.0, "REPLACE")
    sphere.vertex_groups.new(name="Empty")
    grow_settings = grown.data.hairloom.grow
    grow_settings.density_group = "Top"
    roots = curve_points(grown.data)[:: FEW["cv_count"]]
    assert roots[:, 2].min() > 0.03
    grow_settings.density_group = "Empty"
    assert "0 on every vertex" in grow_settings.problem
    assert np.array_equal(curve_points(grown.data)[:: FEW["cv_count"]], roots), "it is half done"
    grow_settings.density_group = ""
    assert grow_settings.problem == "" and curve_points(grown.data)[:, 2].min() < 0.03


def test_images_control_where_and_how_long_hair_grows(grown, sphere):
    """The image is black below and 0.5 above. A vertex group of the same name takes precedence."""
    layer, vertices = sphere.data.uv_layers.active, sphere.data.vertices
    for loop in sphere.data.loops:
        layer.uv[loop.index].vector = (0.5, 0.5 + 2.0 * vertices[loop.vertex_index].co.z)
    image = bpy.data.images.new("Top", 4, 64)
    pixels = np.zeros((64, 4, 4), np.float32)
    pixels[32:, :, :3] = 0.5
    image.pixels.foreach_set(pixels.ravel())
    grow_settings = grown.data.hairloom.grow
    assert "Top" in weights_of_surface(grow_settings, bpy.context, "to")
    whole = lengths(grown)
    grow_settings.density_group = "Top"
    assert (
        grow_settings.problem == ""
        and curve_points(grown.data)[:: FEW["cv_count"], 2].min() > -0.03
    )
    grow_settings.density_group, grow_settings.length_group = "", "Top"
    above = curve_points(grown.data)[:: FEW["cv_count"], 2] > 0.03
    assert lengths(grown)[above] == pytest.approx(0.5 * whole[above], rel=0.1)
    sphere.vertex_groups.new(name="Top").add(range(len(vertices)), 1.0, "REPLACE")
    grow_settings.length_group = ""
    grow_settings.length_group = "Top"
    assert lengths(grown) == pytest.approx(whole, rel=0.02)
    grow_settings.length_group = "Gone"
    assert "neither a vertex group nor an attribute" in grow_settings.problem


def test_undo_takes_setting_and_hair_back_together(grown):
    bpy.ops.hairloom.preview()
    (session,) = previews.sessions()
    points = curve_points(grown.data)
    bpy.ops.ed.undo_push(message="grown")
    grown.data.hairloom.grow.length = 0.05
    bpy.ops.ed.undo_push(message="length")
    shorter = curve_points(grown.data)
    bpy.ops.ed.undo()
    hair = bpy.context.object
    assert hair.data.hairloom.grow.length == pytest.approx(0.1)
    assert np.array_equal(curve_points(hair.data), points)
    assert lost_by_regrowing(hair.data) == () and not is_outdated(hair.data)
    bpy.ops.ed.redo()
    hair = bpy.context.object
    assert np.array_equal(curve_points(hair.data), shorter)
    scene_events.catch_up(bpy.context.evaluated_depsgraph_get())
    assert previews.sessions() == (session,)
    assert session.rig.strands.lengths()[: FEW["strand_count"]].max() < 0.052


def test_the_preview_follows_at_once(grown):
    bpy.ops.hairloom.preview()
    (session,) = previews.sessions()
    before = session.rig.strands.points
    grown.data.hairloom.grow.droop = 0.1
    bpy.context.view_layer.update()
    assert session.rig.strands.points is not before


def test_settings_and_what_was_made_of_them_are_saved(grown, tmp_path):
    grown.data.hairloom.grow.length = 0.08
    file = str(tmp_path / "hair.blend")
    bpy.ops.wm.save_as_mainfile(filepath=file)
    bpy.ops.wm.open_mainfile(filepath=file)
    hair = next(obj for obj in bpy.data.objects if obj.type == "CURVES")
    assert hair.data.hairloom.grow.length == pytest.approx(0.08)
    assert lost_by_regrowing(hair.data) == ()
    hair.data.hairloom.grow.length = 0.04
    assert lengths(hair).max() < 0.042


def test_a_copy_follows_its_own_settings(grown):
    copy = grown.copy()
    copy.data = grown.data.copy()
    bpy.context.collection.objects.link(copy)
    points = curve_points(grown.data)
    copy.data.hairloom.grow.length = 0.05
    assert np.array_equal(curve_points(grown.data), points)
    assert lengths(copy).max() < 0.052


@pytest.mark.parametrize("scale", [0.1, 3.0])
def test_hair_of_a_scaled_head_keeps_its_widths(grown, sphere, scale):
    sphere.scale = (scale,) * 3
    bpy.context.view_layer.update()
    before = read_attribute(grown.data, "radius", "POINT")
    for length in (0.11, 0.12, 0.13):
        grown.data.hairloom.grow.length = length
    bpy.ops.hairloom.grow_again()
    assert read_attribute(grown.data, "radius", "POINT") == pytest.approx(before, rel=1e-5)


def test_curves_that_grow_again_are_all_selected(grown):
    """Blender treats curves without the attribute as selected; with it, new curves would not be."""
    set_attribute(grown.data, ".selection", "POINT", np.ones(len(grown.data.points), bool))
    grown.data.hairloom.grow.length = 0.05
    assert lengths(grown).max() < 0.052
    assert ".selection" not in grown.data.attributes


def test_hair_that_blender_does_not_evaluate_says_so(grown, sphere):
    """It would grow on a head without its modifiers, at an old position."""
    collection = bpy.data.collections.new("Kept")
    bpy.context.scene.collection.children.link(collection)
    for obj in (sphere, grown):
        bpy.context.scene.collection.objects.unlink(obj)
        collection.objects.link(obj)
    layer = bpy.context.view_layer.layer_collection.children["Kept"]
    layer.exclude = True
    points = curve_points(grown.data)
    grow_settings = grown.data.hairloom.grow
    grow_settings.length = 0.05
    assert (
        "Head: it is disabled in viewports or excluded from the view layer" in grow_settings.problem
    )
    assert np.array_equal(curve_points(grown.data), points)
    layer.exclude = False
    grow_settings.length = 0.06
    assert grow_settings.problem == "" and not np.array_equal(curve_points(grown.data), points)


@pytest.mark.parametrize("operator", ["settle", "mirror_hair", "grow_again"])
def test_hair_without_an_extent_along_an_axis_stays_as_it_is(grown, sphere, operator):
    sphere.scale = (1.0, 1.0, 0.0)
    bpy.context.view_layer.update()
    names, points = grown.data.attributes.keys(), curve_points(grown.data)
    with pytest.raises(RuntimeError, match="scaled to 0 along an axis"):
        getattr(bpy.ops.hairloom, operator)()
    assert np.array_equal(curve_points(grown.data), points)
    assert grown.data.attributes.keys() == names
