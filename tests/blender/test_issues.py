"""Warnings in the panel, each with a button that fixes it."""

import bpy
import numpy as np
import pytest
from node_modifiers import hair_dynamics_mode

from hairloom.addon.blender.preview import diagnostics, previews
from hairloom.addon.blender.scene.curves import read_curves


def issue_operators(hair):
    return [each.operator for each in diagnostics.issues_of(hair, previews.session_of(hair))]


def fix(hair):
    """Press the button of the only issue."""
    (issue,) = diagnostics.issues_of(hair, previews.session_of(hair))
    group, name = issue.operator.split(".")
    assert getattr(getattr(bpy.ops, group), name)() == {"FINISHED"}


def read(hair):
    return read_curves(hair, bpy.context.evaluated_depsgraph_get()).strands


def preview(hair):
    previews.stop_all()
    return previews.start(hair, bpy.context.evaluated_depsgraph_get())


def test_good_hair_has_no_issues(new_hair, sphere):
    hair = new_hair(sphere)
    assert issue_operators(hair) == []
    preview(hair)
    assert issue_operators(hair) == []


def test_a_surface_is_set_and_the_hair_stays_where_it_is(new_hair, sphere):
    bpy.ops.mesh.primitive_cube_add(size=0.1, location=(3.0, 0.0, 0.0))
    hair = new_hair()
    hair.location = (0.0, 0.0, 0.01)
    bpy.context.view_layer.update()
    before = read(hair).points
    (issue,) = diagnostics.issues_of(hair, preview(hair))
    assert issue.instead_of.startswith("Hair: it has no surface")
    fix(hair)
    bpy.context.view_layer.update()
    assert hair.data.surface == sphere and hair.parent == sphere, "the cube is far away"
    assert hair.data.surface_uv_map == "UVMap"
    assert read(hair).points == pytest.approx(before, abs=1e-6)
    assert issue_operators(hair) == []


def test_of_many_curves_a_sample_is_checked(new_hair, sphere):
    from hairloom.addon.blender.scene import curves

    hair = new_hair()
    hair.data.add_curves([3] * 500)
    depsgraph = bpy.context.evaluated_depsgraph_get()
    assert diagnostics.nearest_surface(hair, [sphere], depsgraph) == sphere
    assert curves.read_curves(hair, depsgraph).strands.strand_count == 60, "the rest has no length"


def test_a_selected_mesh_is_taken_before_a_closer_one(new_hair, sphere):
    bpy.ops.mesh.primitive_cube_add(size=0.1, location=(3.0, 0.0, 0.0))
    cube = bpy.context.object
    hair = new_hair()
    cube.select_set(True)
    fix(hair)
    assert hair.data.surface == cube


def test_cards_of_the_hair_are_no_surface(new_hair, sphere):
    hair = new_hair(sphere)
    hair.data.hairloom.cards.source, hair.data.hairloom.atlas.source = "guides", "made"
    hair.data.hairloom.cards.order_by = "distance"
    bpy.ops.hairloom.make_cards()
    bpy.context.view_layer.objects.active = hair
    hair.parent = hair.data.surface = None
    fix(hair)
    assert hair.data.surface == sphere


def test_without_any_mesh_the_button_says_what_to_do(new_hair):
    new_hair()
    with pytest.raises(RuntimeError, match="no mesh that it could grow from"):
        bpy.ops.hairloom.set_surface()


def test_roots_in_the_air_are_counted_and_snapped(new_hair, sphere):
    hair = new_hair(sphere)
    points = np.empty((len(hair.data.position_data), 3), np.float32)
    hair.data.position_data.foreach_get("vector", points.ravel())
    points[: 20 * 8] *= 1.4  # twenty strands start 4 cm above the sphere
    hair.data.position_data.foreach_set("vector", points.ravel())
    preview(hair)
    (issue,) = diagnostics.issues_of(hair, previews.session_of(hair))
    assert issue.text.startswith("20 roots are not on Head")
    fix(hair)
    roots = np.linalg.norm(read(hair).roots, axis=1)
    assert roots == pytest.approx(np.full(60, 0.1), rel=0.02)
    preview(hair)
    assert issue_operators(hair) == []


def test_a_surface_without_faces_is_not_unwrapped(new_hair):
    bare = bpy.data.objects.new("Bare", bpy.data.meshes.new("Bare"))
    bpy.context.collection.objects.link(bare)
    bpy.context.view_layer.objects.active = new_hair(bare)
    with pytest.raises(RuntimeError, match="The surface has no faces"):
        bpy.ops.hairloom.unwrap_surface()


def test_a_surface_without_uvs_is_unwrapped_without_overlap(new_hair, sphere):
    sphere.data.uv_layers.remove(sphere.data.uv_layers[0])
    hair = new_hair(sphere)
    assert issue_operators(hair) == ["hairloom.unwrap_surface"]
    with pytest.raises(RuntimeError, match="no UVs: press Unwrap"):
        bpy.ops.hairloom.snap_roots()
    fix(hair)
    assert (
        issue_operators(hair) == [] and bpy.context.mode == "OBJECT" and bpy.context.object == hair
    )
    corners = np.empty((len(sphere.data.loops), 2), np.float32)
    sphere.data.uv_layers.active.uv.foreach_get("vector", corners.ravel())
    assert np.ptp(corners, axis=0).min() > 0.5 and (corners >= 0.0).all() and (corners <= 1.0).all()


def test_an_uneven_scale_goes_into_the_curves(new_hair, sphere):
    hair = new_hair(sphere)
    hair.scale = (1.0, 1.0, 1.5)
    bpy.context.view_layer.update()
    before = read(hair).points
    assert issue_operators(hair) == ["hairloom.apply_scale"]
    fix(hair)
    bpy.context.view_layer.update()
    assert hair.scale[:] == (1.0, 1.0, 1.0)
    assert read(hair).points == pytest.approx(before, abs=1e-6)


def test_a_scale_of_shared_curves_or_of_a_parent_is_refused_with_a_reason(new_hair, sphere):
    hair = new_hair(sphere)
    hair.scale = (1.0, 1.0, 1.5)
    other = bpy.data.objects.new("Other", hair.data)
    bpy.context.view_layer.update()
    with pytest.raises(RuntimeError, match="share these curves"):
        bpy.ops.hairloom.apply_scale()
    bpy.data.objects.remove(other)
    hair.scale, sphere.scale = (1.0, 1.0, 1.0), (1.0, 1.0, 2.0)
    bpy.context.view_layer.update()
    assert issue_operators(hair) == ["hairloom.apply_scale"]
    with pytest.raises(RuntimeError, match="its parent, Head, is scaled unevenly"):
        bpy.ops.hairloom.apply_scale()


@pytest.mark.parametrize("name", ["snap_roots", "apply_scale"])
def test_fixes_of_selected_hair_wait_until_hidden_hair_is_shown(name, new_hair, sphere):
    hair = new_hair(sphere)
    hair.scale = (1.0, 1.0, 1.5)
    bpy.context.view_layer.objects.active = sphere
    sphere.select_set(True)
    hair.select_set(False)
    bpy.context.view_layer.update()
    button = getattr(bpy.ops.hairloom, name)
    assert button.poll()
    hair.hide_set(True)
    with pytest.raises(RuntimeError, match="The hair is hidden: show it first"):
        button()


def test_blenders_dynamics_are_muted(sphere, extension):
    bpy.ops.object.curves_empty_hair_add()
    hair = bpy.context.object
    assert issue_operators(hair) == [], "as it is added it only puts hair onto its surface"
    hair_dynamics_mode(hair.modifiers[0]).value = "Physics (Experimental)"
    hair.update_tag()
    assert issue_operators(hair) == ["hairloom.mute_hair_dynamics"]
    fix(hair)
    assert issue_operators(hair) == []


def test_instances_that_the_preview_leaves_out_are_reported(new_hair, sphere):
    hair = new_hair(sphere)
    assert diagnostics.instances_note(hair) == ""
    outer, inner = bpy.data.collections.new("Outer"), bpy.data.collections.new("Inner")
    outer.children.link(inner)
    inner.objects.link(sphere)  # instances of the head alone do not matter
    twin = bpy.data.objects.new("Twin", None)
    bpy.context.collection.objects.link(twin)
    twin.instance_type, twin.instance_collection = "COLLECTION", outer
    bpy.context.view_layer.update()
    assert diagnostics.instances_note(hair) == ""
    inner.objects.link(hair)
    bpy.context.view_layer.update()
    assert "not in the preview" in diagnostics.instances_note(hair)
    twin.instance_type = "NONE"
    bpy.context.view_layer.update()
    assert diagnostics.instances_note(hair) == ""


@pytest.mark.parametrize("what", ["object", "collection"])
def test_instances_by_geometry_nodes_are_reported_too(what, new_hair, sphere):
    hair = new_hair(sphere)
    collection = bpy.data.collections.new("Groom")
    points = bpy.data.meshes.new("Points")
    points.from_pydata([(0.0, 0.0, 0.0), (1.0, 0.0, 0.0)], [], [])
    many = bpy.data.objects.new("Many", points)
    bpy.context.collection.objects.link(many)
    info = instancing(many, what)
    bpy.context.view_layer.update()
    assert diagnostics.instances_note(hair) == "", "they are of nothing"
    if what == "object":
        info.inputs["Object"].default_value = hair
    else:
        collection.objects.link(hair)
        info.inputs["Collection"].default_value = collection
    bpy.context.view_layer.update()
    assert "not in the preview" in diagnostics.instances_note(hair)
    many.hide_viewport = True
    bpy.context.view_layer.update()
    assert diagnostics.instances_note(hair) == ""


def instancing(obj, what):
    """Put an instance on each point by a modifier; returns the node that chooses the instance."""
    tree = bpy.data.node_groups.new("Instances", "GeometryNodeTree")
    for way in ("INPUT", "OUTPUT"):
        tree.interface.new_socket("Geometry", in_out=way, socket_type="NodeSocketGeometry")
    begin, end, on_points, info = (
        tree.nodes.new(name)
        for name in (
            "NodeGroupInput",
            "NodeGroupOutput",
            "GeometryNodeInstanceOnPoints",
            f"GeometryNode{what.capitalize()}Info",
        )
    )
    if what == "object":
        info.inputs["As Instance"].default_value = True
    tree.links.new(begin.outputs[0], on_points.inputs["Points"])
    given = info.outputs["Geometry" if what == "object" else "Instances"]
    tree.links.new(given, on_points.inputs["Instance"])
    tree.links.new(on_points.outputs[0], end.inputs[0])
    obj.modifiers.new("Instances", "NODES").node_group = tree
    return info
