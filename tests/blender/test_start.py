"""Starting: grooms on a mesh, on empty hair, from particles; and the sample scene."""

import bpy
import numpy as np
import pytest
from grids import strand_grid

from hairloom.addon.blender.base.outcome import collected_reports, past_reports
from hairloom.addon.blender.base.parts import batched, run_parts
from hairloom.addon.blender.preview import previews, scene_events
from hairloom.addon.blender.properties.presets import named_preset
from hairloom.addon.blender.scene import particle_hair
from hairloom.addon.blender.scene.curves import read_curves
from hairloom.addon.blender.scene.source import hair_dynamics_modifiers
from hairloom.addon.blender.scene.surfaces import read_surface
from hairloom.addon.blender.setup import starting
from hairloom.addon.blender.viewport import overlay
from hairloom.addon.groom.grow import grow
from hairloom.addon.groom.settings import GrowSettings
from hairloom.addon.shading.settings import ShadingSettings
from hairloom.addon.ui import operators_start
from hairloom.addon.ui.preferences import chosen_presets, preferences

pytestmark = [pytest.mark.portable, pytest.mark.usefixtures("extension")]
FEW = {"strand_count": 150, "length": 0.1}


def make_active(obj):
    for other in bpy.context.selected_objects:
        other.select_set(False)
    obj.select_set(True)
    bpy.context.view_layer.objects.active = obj
    return obj


def test_a_groom_is_grown_dressed_previewed_and_active(sphere):
    assert bpy.ops.hairloom.add_groom(**FEW) == {"FINISHED"}
    hair = bpy.context.object
    assert hair.type == "CURVES" and hair.data.surface == sphere and len(hair.data.curves) == 150
    look, motion = (
        named_preset(name).settings for name in chosen_presets(preferences(bpy.context))
    )
    assert hair.data.hairloom.shading.base_color[:] == pytest.approx(look.base_color)
    assert hair.hairloom.dynamics.wind_speed == pytest.approx(motion.wind_speed)
    assert motion.wind_speed > 0.0, "nothing moves in still air"
    (session,) = previews.sessions()
    assert session.rig.strands.strand_count == 150 and session.warnings == ()


@pytest.mark.parametrize("name", ["add_groom", "grow"])
def test_a_new_groom_can_be_adjusted(sphere, name):
    """Blender shows Adjust Last Operation only if the operator could run again in the new state,
    with the new hair active. It then grows on the same mesh."""
    operator = getattr(bpy.ops.hairloom, name)
    operator(**FEW)
    first = bpy.context.object
    assert first.type == "CURVES" and operator.poll()
    operator(**FEW)
    assert bpy.context.object != first and bpy.context.object.data.surface == sphere
    first.data.surface, first.parent = None, None
    make_active(first)
    assert not operator.poll()


@pytest.mark.parametrize("look", ["looks/blond", "Blond"], ids=["by name", "by title"])
def test_the_presets_of_a_new_groom_can_be_others_or_none(sphere, look):
    bpy.ops.hairloom.add_groom(look=look, motion="", **FEW)
    hair = bpy.context.object
    blond = named_preset("looks/blond").settings
    assert hair.data.hairloom.shading.base_color[:] == pytest.approx(blond.base_color)
    assert hair.hairloom.dynamics.wind_speed == 0.0
    make_active(sphere)
    with pytest.raises(RuntimeError, match="no such preset"):
        bpy.ops.hairloom.add_groom(look="looks/plaid", **FEW)


@pytest.mark.parametrize(
    ("size", "factor"),
    [((2.0, 2.0, 2.0), 2.0 / 0.19), ((1.7, 0.3, 1.8), 1.0), ((0.16, 0.2, 0.24), 1.0)],
    ids=["cube", "body", "head"],
)
def test_only_meshes_that_are_no_head_or_body_change_the_lengths(size, factor):
    bpy.ops.mesh.primitive_cube_add(size=1.0)
    bpy.context.object.scale = size
    depsgraph = bpy.context.evaluated_depsgraph_get()
    found = starting.fitting_factor(bpy.context.object, depsgraph)
    assert found == pytest.approx(factor)
    fitted = starting.scaled_settings(GrowSettings(), found)
    assert fitted.length == pytest.approx(GrowSettings().length * factor)
    assert fitted.volume == pytest.approx(GrowSettings().volume * factor)
    assert fitted.strand_count == GrowSettings().strand_count


@pytest.mark.parametrize("length", [0.03, 0.25], ids=["short and stiff", "long"])
def test_hair_fitted_to_a_doll_and_to_a_giant_falls_as_on_a_head(length):
    bpy.ops.mesh.primitive_uv_sphere_add(radius=0.095)
    head = bpy.context.object
    mine = GrowSettings(strand_count=80, length=length)
    found = []
    for factor in (1.0, 0.1, 20.0):
        head.scale = (factor,) * 3
        surface = read_surface(
            head, bpy.context.evaluated_depsgraph_get(), need_uv=False, place="Head"
        )
        found.append(grow(surface, starting.scaled_settings(mine, factor)).points / factor)
    for other in found[1:]:
        away = np.linalg.norm(other - found[0], axis=1)
        assert np.quantile(away, 0.95) < 0.01 * length


def swing_of_new_hair(size):
    """How far tips of new hair on a ball move in half a second, relative to the hair's length."""
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    bpy.ops.mesh.primitive_uv_sphere_add(radius=0.5 * size)
    bpy.ops.hairloom.add_groom("EXEC_DEFAULT", strand_count=60)
    (session,) = previews.sessions()
    previews.play(bpy.context.evaluated_depsgraph_get())
    at_first = strand_grid(session).copy()
    for _ in range(12):
        previews.advance(bpy.context.evaluated_depsgraph_get(), 1.0 / 24.0)
    length = bpy.context.object.dimensions.z
    return np.linalg.norm(strand_grid(session) - at_first, axis=-1).max() / length


@pytest.mark.slow
def test_hair_swings_in_a_breeze_whatever_the_size_of_its_mesh():
    on_a_head = swing_of_new_hair(0.2)
    assert on_a_head > 0.02
    for size in (0.02, 2.0):
        assert 0.5 * on_a_head < swing_of_new_hair(size) < 2.0 * on_a_head, size


def test_undo_takes_the_groom_and_its_preview_away(sphere):
    bpy.ops.ed.undo_push(message="before")
    bpy.ops.hairloom.add_groom("EXEC_DEFAULT", True, **FEW)
    assert len(previews.sessions()) == 1
    bpy.ops.ed.undo()
    assert [obj.type for obj in bpy.data.objects] == ["MESH"]
    assert previews.sessions() == () and previews.notice() == ""


@pytest.mark.slow
def test_the_sample_scene_is_a_scene_of_its_own_that_moves():
    bpy.ops.mesh.primitive_cube_add()
    before = bpy.context.scene
    assert bpy.ops.hairloom.sample_scene() == {"FINISHED"}
    scene = bpy.context.scene
    assert scene != before and [obj.name for obj in before.objects] == ["Cube"]
    assert scene.render.engine == "HAIRLOOM" and scene.camera is not None
    assert sum(obj.type == "LIGHT" for obj in scene.objects) == 3
    # lengths then read "6 mm", where a new Blender scene shows "0.006 m"
    assert scene.unit_settings.length_unit == "ADAPTIVE"
    (session,) = previews.sessions()
    assert session.warnings == () and session.head is not None
    first = strand_grid(session)
    for frame in range(1, 10):
        scene.frame_set(frame)
    assert np.abs(strand_grid(session) - first).max() > 0.01
    head = scene.objects["Head"]
    scene.frame_set(1)
    at_start = head.rotation_euler.copy()
    scene.frame_set(scene.frame_end + 1)
    assert head.rotation_euler[:] == pytest.approx(at_start[:], abs=1e-4), "it jumps as it repeats"


@pytest.mark.slow
def test_the_camera_of_the_sample_sees_all_of_its_hair():
    from bpy_extras.object_utils import world_to_camera_view
    from mathutils import Vector

    bpy.ops.hairloom.sample_scene()
    scene, (session,) = bpy.context.scene, previews.sessions()
    places = strand_grid(session).reshape(-1, 3)[::97]
    seen = np.array([world_to_camera_view(scene, scene.camera, Vector(p)) for p in places])
    assert (seen[:, :2] > 0.0).all() and (seen[:, :2] < 1.0).all() and (seen[:, 2] > 0.0).all()
    assert np.ptp(seen[:, 1]) > 0.4, "hair is small in the picture"


@pytest.mark.slow
def test_empty_hair_of_blenders_gets_hair_a_look_and_a_preview(sphere):
    bpy.ops.object.curves_empty_hair_add()
    empty = bpy.context.object
    name = empty.name
    assert len(empty.data.curves) == 0 and empty.modifiers
    assert bpy.ops.hairloom.use_groom() == {"FINISHED"}
    hair = bpy.data.objects[name]
    assert len(hair.data.curves) > 1000 and hair.data.surface == sphere
    assert not hair_dynamics_modifiers(hair) and len(previews.sessions()) == 1, (
        "it would move twice"
    )
    blond = named_preset(chosen_presets(preferences(bpy.context))[0]).settings
    assert hair.data.hairloom.shading.base_color[:] == pytest.approx(blond.base_color)
    assert len(bpy.data.hair_curves) == 1, "the empty curves are left"


def test_hair_that_has_a_look_keeps_it(new_hair, sphere):
    hair = new_hair(sphere)
    hair.data.hairloom.shading.base_color = (0.1, 0.2, 0.3)
    bpy.ops.hairloom.use_groom()
    assert hair.data.hairloom.shading.base_color[:] == pytest.approx((0.1, 0.2, 0.3))
    with pytest.raises(RuntimeError, match="does not preview yet"):
        bpy.ops.hairloom.use_groom()


def test_all_selected_hair_is_taken_and_counted(new_hair, sphere):
    """Although one of the objects cannot be used."""
    hair = [new_hair(sphere) for _ in range(2)]
    curves = bpy.data.hair_curves.new("Empty")
    empty = bpy.data.objects.new("Empty", curves)
    bpy.context.collection.objects.link(empty)
    for obj in (*hair, empty):
        obj.select_set(True)
    bpy.context.view_layer.objects.active = empty
    with pytest.raises(RuntimeError, match="Empty"):
        bpy.ops.hairloom.use_groom()
    assert {each.name for each in previews.sessions()} == {each.name for each in hair}
    assert "Hairloom now previews 2 of 3 grooms" in [each.text for each in past_reports]


def test_cancelling_takes_none_of_several_hairs(new_hair, sphere, get_depsgraph):
    grooms = [new_hair(sphere) for _ in range(2)]
    work = batched(
        starting.prepare_existing_hair(hair, get_depsgraph(), ("looks/blond",)) for hair in grooms
    )
    next(work)
    work.send(None)  # the part of the second groom is running
    work.close()
    assert all(map(starting.has_untouched_look, grooms))


def test_hair_without_curves_and_surface_says_what_to_do():
    curves = bpy.data.hair_curves.new("Empty")
    bpy.context.collection.objects.link(bpy.data.objects.new("Empty", curves))
    make_active(bpy.data.objects["Empty"])
    with pytest.raises(RuntimeError, match="Sculpt Mode"):
        bpy.ops.hairloom.use_groom()


def test_particle_hair_becomes_curves_on_its_mesh(sphere):
    sphere.location = (0.5, 0.0, 0.0)
    modifier = sphere.modifiers.new("Fur", "PARTICLE_SYSTEM")
    settings = modifier.particle_system.settings
    settings.type, settings.count, settings.hair_length = "HAIR", 80, 0.05
    assert bpy.ops.hairloom.convert_particles() == {"FINISHED"}
    hair = bpy.context.object
    assert hair.type == "CURVES" and hair.data.surface == sphere and hair.parent == sphere
    assert not modifier.show_viewport and not modifier.show_render
    strands = read_curves(hair, bpy.context.evaluated_depsgraph_get()).strands
    assert strands.strand_count == 80 and strands.root_uv is not None
    away = np.linalg.norm(strands.roots - np.array(sphere.location), axis=1)
    assert away == pytest.approx(np.full(80, 0.1), rel=0.05)
    assert [obj.type for obj in bpy.data.objects].count("CURVES") == 1
    assert len(sphere.particle_systems) == 1 and not particle_hair.hair_systems(sphere)
    make_active(sphere)
    with pytest.raises(RuntimeError, match="that has particle hair"):
        bpy.ops.hairloom.convert_particles()


def fur(mesh, name, count):
    modifier = mesh.modifiers.new(name, "PARTICLE_SYSTEM")
    settings = modifier.particle_system.settings
    settings.type, settings.count, settings.hair_length = "HAIR", count, 0.05
    return modifier


@pytest.mark.parametrize("name", ["add_groom", "sample_scene", "use_groom", "convert_particles"])
def test_a_preset_that_is_gone_is_said_before_anything_is_made(sphere, monkeypatch, name):
    modifier = fur(sphere, "Fur", 10)
    bald = bpy.data.objects.new("Bald", bpy.data.hair_curves.new("Bald"))
    bpy.context.collection.objects.link(bald)
    bald.data.surface = sphere
    make_active(bald if name == "use_groom" else sphere)
    monkeypatch.setattr(operators_start, "chosen_presets", lambda _: ("looks/gone",))
    with pytest.raises(RuntimeError, match="looks/gone: there is no such preset"):
        getattr(bpy.ops.hairloom, name)()
    assert set(bpy.data.objects) == {sphere, bald} and not len(bald.data.curves)
    assert modifier.show_viewport and len(bpy.data.scenes) == 1


def test_particles_without_hair_or_not_shown_add_none(sphere):
    fur(sphere, "None", 0)
    hidden = fur(sphere, "Hidden", 40)
    hidden.show_viewport = False
    with pytest.raises(RuntimeError, match="no particle hair that can be converted"):
        bpy.ops.hairloom.convert_particles()
    assert [obj.name for obj in bpy.data.objects] == ["Head"] and hidden.show_render
    fur(sphere, "Fur", 50)
    assert bpy.ops.hairloom.convert_particles() == {"FINISHED"}
    (hair,) = (obj for obj in bpy.data.objects if obj.type == "CURVES")
    assert len(hair.data.curves) == 50 and len(previews.sessions()) == 1
    assert hidden.show_render, "it is still there to be converted"


def test_particle_hair_that_is_dropped_is_reported(sphere):
    group = sphere.vertex_groups.new(name="long")
    group.add([v.index for v in sphere.data.vertices if v.co.x > 0.0], 1.0, "REPLACE")
    fur(sphere, "Fur", 100).particle_system.vertex_group_length = "long"
    with collected_reports() as reports:
        bpy.ops.hairloom.convert_particles()
    count = len(bpy.context.object.data.curves)
    assert 20 < count < 80
    assert f"replaced by curves; dropped {100 - count} (" in reports.warnings[-1]


@pytest.mark.slow
def test_hair_of_a_scene_that_is_not_shown_waits_for_it():
    """Its head is not evaluated meanwhile; the differing vertex count must not end the preview."""
    own = bpy.context.scene
    bpy.ops.hairloom.sample_scene()
    sample, (session,) = bpy.context.scene, previews.sessions()
    assert overlay.drawing_of(session.uid).is_visible
    bpy.context.window.scene = own
    bpy.ops.mesh.primitive_cube_add()
    own.frame_set(3)
    bpy.context.view_layer.update()
    assert previews.sessions() == (session,) and previews.notice() == ""
    assert not overlay.drawing_of(session.uid).is_visible
    bpy.context.window.scene = sample
    sample.frame_set(2)
    scene_events.catch_up(bpy.context.evaluated_depsgraph_get())
    assert previews.sessions() == (session,) and not session.is_stale
    assert overlay.drawing_of(session.uid).is_visible


class Editor:
    """A Properties editor with some tabs, like `SpaceProperties`."""

    def __init__(self, *tabs):
        self.tabs, self.shown = tabs, tabs[0]

    @property
    def context(self):
        return self.shown

    @context.setter
    def context(self, tab):
        if tab not in self.tabs:
            raise TypeError(f'enum "{tab}" not found in {self.tabs}')
        self.shown = tab


@pytest.mark.parametrize(
    ("tabs", "shown"),
    [
        (("SCENE", "OBJECT", "DATA"), "DATA"),
        (("SCENE", "OBJECT"), "OBJECT"),
        (("SCENE", "WORLD"), "SCENE"),
    ],
)
def test_all_settings_leaves_an_editor_alone_that_cannot_show_them(tabs, shown):
    editor = Editor(*tabs)
    operators_start._show_data(editor)
    assert editor.context == shown


def with_principled_hair(hair):
    material = bpy.data.materials.new("Auburn")
    material.use_nodes = True
    nodes = material.node_tree
    nodes.nodes.clear()
    shader = nodes.nodes.new("ShaderNodeBsdfHairPrincipled")
    shader.parametrization = "COLOR"
    shader.inputs["Color"].default_value = (0.3, 0.06, 0.02, 1.0)
    output = nodes.nodes.new("ShaderNodeOutputMaterial")
    nodes.links.new(shader.outputs[0], output.inputs["Surface"])
    hair.data.materials.append(material)


def test_hair_that_nobody_dressed_has_the_look_of_its_material(new_hair, sphere, get_depsgraph):
    hair = new_hair(sphere)
    with_principled_hair(hair)
    _, done = run_parts(
        starting.prepare_existing_hair(
            hair, get_depsgraph(), chosen_presets(preferences(bpy.context))
        )
    )
    assert done == ("took its look from the material 'Auburn'",)
    shading = hair.data.hairloom.shading
    assert (shading.model, shading.color_source) == ("marschner", "own")
    assert shading.base_color[:] == pytest.approx((0.3, 0.06, 0.02), rel=1e-3)


def test_a_look_that_was_set_stays_whatever_the_material(new_hair, sphere, get_depsgraph):
    hair = new_hair(sphere)
    with_principled_hair(hair)
    hair.data.hairloom.shading.tip_tint = 0.5
    _, done = run_parts(
        starting.prepare_existing_hair(
            hair, get_depsgraph(), chosen_presets(preferences(bpy.context))
        )
    )
    shading = hair.data.hairloom.shading
    assert done == () and shading.base_color[:] == pytest.approx(ShadingSettings().base_color)


def test_hair_with_colours_of_its_own_keeps_them_as_it_is_dressed(new_hair, sphere, get_depsgraph):
    hair = new_hair(sphere)
    run_parts(
        starting.prepare_existing_hair(
            hair, get_depsgraph(), chosen_presets(preferences(bpy.context))
        )
    )
    assert hair.data.hairloom.shading.color_source == "own"
    bpy.ops.hairloom.apply_preset(name="looks/blond")
    assert hair.data.hairloom.shading.color_source == "look", "a look that was chosen is seen"
