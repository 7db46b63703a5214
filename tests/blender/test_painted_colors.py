"""Hair in colours painted on its surface, compared with Blender's sampling, and in all outputs."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import bpy
import numpy as np
import pytest

from hairloom.addon.blender.command_line import command_line
from hairloom.addon.blender.engine.engine_hair import read_groom
from hairloom.addon.blender.preview import previews, scene_events
from hairloom.addon.blender.properties.properties import colors_of_groom
from hairloom.addon.blender.scene.curves import curve_points, set_points
from hairloom.addon.blender.strands.growing import lost_by_regrowing
from hairloom.addon.blender.strands.read_hair import ExportRequest, read_still_hair
from hairloom.addon.blender.viewport import overlay
from hairloom.addon.exchange.hair_file import read_hair_file

RED, BLUE = (0.8, 0.02, 0.03, 1.0), (0.01, 0.05, 0.6, 1.0)
#: name of the painted map
MAP = "Ombre"


@pytest.fixture
def hair(new_hair: Any, sphere: Any) -> Any:
    hair = new_hair(sphere)
    hair.data.hairloom.children.method = "none"
    hair.data.hairloom.shading.color_map = MAP
    return hair


def unwrapped(sphere: Any) -> Any:
    return sphere.data.uv_layers.active or sphere.data.uv_layers.new(name="Across")


def paint(kind: str, sphere: Any, tmp_path: Path | None = None) -> None:
    """Paint a random colour at every element or pixel."""
    mesh, random = sphere.data, np.random.default_rng(3)
    if kind.endswith("image"):
        unwrapped(sphere)
        is_float = kind == "float image"
        image = bpy.data.images.new(MAP, 24, 16, float_buffer=is_float)
        pixels = random.uniform(size=(16, 24, 4)).astype(np.float32)
        pixels[..., 3] = 1.0
        image.pixels.foreach_set(pixels.ravel())
        if kind == "plain image":
            image.colorspace_settings.name = "Non-Color"
        if kind == "file image":
            assert tmp_path is not None
            image.filepath_raw, image.file_format = str(tmp_path / "map.png"), "PNG"
            image.save()
            bpy.data.images.remove(image)
            bpy.data.images.load(str(tmp_path / "map.png")).name = MAP
        elif kind == "packed image":
            image.pack()
        else:
            image.update()
        return
    data_type, domain = kind.split(" ")
    attribute = mesh.attributes.new(MAP, data_type, domain)
    colors = random.uniform(size=(len(attribute.data), 4)).astype(np.float32)
    colors[:, 3] = 1.0
    attribute.data.foreach_set("color", colors.ravel())


def sampled_by_blender(kind: str, sphere: Any, places: Any, get_depsgraph: Any) -> Any:
    """The values that geometry nodes sample on the surface nearest to these places, (n, 4)."""
    mesh = bpy.data.meshes.new("Places")
    mesh.from_pydata(places.tolist(), [], [])
    obj = bpy.data.objects.new("Places", mesh)
    bpy.context.scene.collection.objects.link(obj)
    tree = bpy.data.node_groups.new("Sample", "GeometryNodeTree")
    tree.interface.new_socket("Geometry", in_out="INPUT", socket_type="NodeSocketGeometry")
    tree.interface.new_socket("Geometry", in_out="OUTPUT", socket_type="NodeSocketGeometry")
    new, link = tree.nodes.new, tree.links.new
    given, out = new("NodeGroupInput"), new("NodeGroupOutput")
    info, named = new("GeometryNodeObjectInfo"), new("GeometryNodeInputNamedAttribute")
    sample, store = new("GeometryNodeSampleNearestSurface"), new("GeometryNodeStoreNamedAttribute")
    info.transform_space, info.inputs["Object"].default_value = "RELATIVE", sphere
    is_image = kind.endswith("image")
    sample.data_type = named.data_type = "FLOAT_VECTOR" if is_image else "FLOAT_COLOR"
    named.inputs["Name"].default_value = sphere.data.uv_layers[0].name if is_image else MAP
    store.data_type, store.domain = "FLOAT_COLOR", "POINT"
    store.inputs["Name"].default_value = "found"
    link(info.outputs["Geometry"], sample.inputs["Mesh"])
    link(next(s for s in named.outputs if s.enabled), sample.inputs["Value"])
    value = sample.outputs["Value"]
    if is_image:
        texture = new("GeometryNodeImageTexture")
        texture.interpolation, texture.extension = "Linear", "REPEAT"
        texture.inputs["Image"].default_value = bpy.data.images[MAP]
        link(value, texture.inputs["Vector"])
        value = texture.outputs["Color"]
    link(given.outputs[0], store.inputs["Geometry"])
    link(value, store.inputs["Value"])
    link(store.outputs["Geometry"], out.inputs[0])
    obj.modifiers.new("Sample", "NODES").node_group = tree
    bpy.context.view_layer.update()
    attribute = obj.evaluated_get(get_depsgraph()).data.attributes["found"]
    found = np.empty(4 * len(places), np.float32)
    attribute.data.foreach_get("color", found)
    return found.reshape(-1, 4)


def shown(session: Any) -> Any:
    return overlay.drawing_of(session.uid).snapshot


def started(hair: Any, get_depsgraph: Any) -> Any:
    bpy.context.view_layer.update()
    return previews.start(hair, get_depsgraph())


def catch_up(get_depsgraph: Any) -> None:
    bpy.context.view_layer.update()
    scene_events.catch_up(get_depsgraph())


KINDS = (
    "BYTE_COLOR POINT",
    "FLOAT_COLOR CORNER",
    "BYTE_COLOR CORNER",
    "FLOAT_COLOR POINT",
    "image",
    "float image",
    "plain image",
    "packed image",
    "file image",
)


@pytest.mark.alike
@pytest.mark.parametrize("children", ["none", "multi"])
@pytest.mark.parametrize("kind", KINDS)
def test_each_strand_has_the_colour_that_blender_samples_at_its_root(
    hair: Any, sphere: Any, get_depsgraph: Any, tmp_path: Path, kind: str, children: str
) -> None:
    sphere.location, sphere.scale = (0.3, -0.1, 0.2), (1.0, 0.8, 1.2)
    paint(kind, sphere, tmp_path)
    groom = hair.data.hairloom
    groom.children.method, groom.children.strand_count = children, 200
    assert MAP in colors_of_groom(groom.shading, bpy.context, "omb")
    session = started(hair, get_depsgraph)
    assert session.warnings == ()
    rig, snapshot = session.rig, shown(session)
    assert rig.child_count == (200 if children == "multi" else 0)
    roots = rig.rest_frames.origin
    expected = sampled_by_blender(kind, sphere, roots, get_depsgraph)[:, :3]
    color = snapshot.color.reshape(-1, 3)
    offsets = rig.strands.offsets
    np.testing.assert_allclose(color[offsets[:-1]], expected, atol=2e-3)
    np.testing.assert_array_equal(color[offsets[:-1]], color[offsets[1:] - 1])


def paint_halves(sphere: Any, bottom: Any = BLUE) -> Any:
    """Red above and another colour below, at face corners."""
    attribute = sphere.data.attributes.new(MAP, "FLOAT_COLOR", "CORNER")
    centers = np.array([each.center.z for each in sphere.data.polygons])
    counts = [each.loop_total for each in sphere.data.polygons]
    colors = np.where(np.repeat(centers > 0.0, counts)[:, None], RED, bottom)
    attribute.data.foreach_set("color", colors.astype(np.float32).ravel())
    return attribute


def assert_halves(color: Any, roots: Any, bottom: Any = BLUE) -> None:
    """Assert colours (n, 3) of strands at these roots."""
    expected = np.where(roots[:, 2:] > 0.0, RED, bottom)[:, :3]
    clear = np.abs(roots[:, 2]) > 0.005
    assert clear.sum() > 20
    np.testing.assert_allclose(color[clear], expected[clear], atol=1e-5)


def test_a_dab_is_seen_at_once_and_children_keep_their_own_roots(
    hair: Any, sphere: Any, get_depsgraph: Any
) -> None:
    attribute = paint_halves(sphere)
    children = hair.data.hairloom.children
    children.method, children.strand_count = "multi", 300
    session = started(hair, get_depsgraph)
    rig, starts = session.rig, session.rig.strands.offsets[:-1]
    assert_halves(shown(session).color[starts], rig.strands.roots)
    points = shown(session).points
    green = np.tile(np.float32([0.1, 0.5, 0.2, 1.0]), len(attribute.data))
    attribute.data.foreach_set("color", green)
    sphere.data.update_tag()
    bpy.context.view_layer.update()
    now = shown(session)
    assert np.unique(now.color, axis=0) == pytest.approx(np.array([[0.1, 0.5, 0.2]]))
    np.testing.assert_array_equal(now.points, points)
    catch_up(get_depsgraph)
    assert session.rig is rig, "nothing was made again"
    hair.data.hairloom.shading.color_map = ""
    catch_up(get_depsgraph)
    assert shown(session).color is None


def test_an_image_is_seen_once_it_is_painted(hair: Any, sphere: Any, get_depsgraph: Any) -> None:
    paint("image", sphere)
    image, material = bpy.data.images[MAP], bpy.data.materials.new("Skin")
    material.node_tree.nodes.new("ShaderNodeTexImage").image = image
    sphere.data.materials.append(material)
    session = started(hair, get_depsgraph)
    image.pixels.foreach_set(np.ones(24 * 16 * 4, np.float32))
    image.update_tag()
    bpy.context.view_layer.update()
    np.testing.assert_allclose(shown(session).color, 1.0, atol=1e-6)


def test_transparent_texels_leave_the_colour_of_curves_or_look(
    hair: Any, sphere: Any, get_depsgraph: Any
) -> None:
    look = hair.data.hairloom.shading
    look.base_color, look.color_source = (0.25, 0.5, 0.125), "look"
    paint_halves(sphere, (0.0, 0.0, 0.0, 0.0))
    session = started(hair, get_depsgraph)
    roots, starts = session.rig.strands.roots, session.rig.strands.offsets[:-1]
    below = roots[:, 2] < -0.005
    assert np.isnan(shown(session).color[starts][below]).all()
    own = hair.data.attributes.new("color", "FLOAT_COLOR", "CURVE")
    own.data.foreach_set("color", np.tile(np.float32([0.5, 0.25, 0.75, 1.0]), len(own.data)))
    look.color_source = "own"
    hair.data.update_tag()
    catch_up(get_depsgraph)
    assert_halves(shown(session).color[starts], roots, (0.5, 0.25, 0.75, 1.0))
    look.color_source = "look"
    half = np.tile(np.float32([0.75, 0.0, 0.5, 0.5]), len(sphere.data.loops))
    sphere.data.attributes[MAP].data.foreach_set("color", half)
    sphere.data.update_tag()
    catch_up(get_depsgraph)
    mixed = 0.5 * (np.array([0.75, 0.0, 0.5]) + (0.25, 0.5, 0.125))
    np.testing.assert_allclose(shown(session).color[starts], np.tile(mixed, (60, 1)), atol=1e-6)
    look.base_color = (0.0, 0.0, 0.0)
    np.testing.assert_allclose(shown(session).color[0], (0.375, 0.0, 0.25), atol=1e-6)


def test_brows_that_keep_their_colour_are_not_painted(
    new_hair: Any, sphere: Any, get_depsgraph: Any
) -> None:
    from hedgehogs import hedgehog

    strands = hedgehog()
    hair = new_hair(sphere, replace(strands, group=np.where(np.arange(60) < 30, 9001, 0)))
    look = hair.data.hairloom.shading
    look.color_map, look.brow_source = MAP, "natural"
    paint_halves(sphere, RED)
    session = started(hair, get_depsgraph)
    color = shown(session).color.reshape(60, -1, 3)
    assert np.isnan(color[:30]).all()
    np.testing.assert_allclose(color[30:], np.broadcast_to(RED[:3], color[30:].shape), atol=1e-6)


def test_a_head_that_is_mirrored_is_painted_as_it_is(
    hair: Any, sphere: Any, get_depsgraph: Any
) -> None:
    sphere.scale = (-1.0, 1.0, 1.0)
    # per vertex: roots lie on edges, and which face's corners would count is arbitrary
    paint("FLOAT_COLOR POINT", sphere)
    session = started(hair, get_depsgraph)
    roots, offsets = session.rig.rest_frames.origin, session.rig.strands.offsets
    expected = sampled_by_blender("FLOAT_COLOR POINT", sphere, roots, get_depsgraph)[:, :3]
    np.testing.assert_allclose(shown(session).color[offsets[:-1]], expected, atol=2e-3)


@pytest.mark.parametrize("children", ["none", "multi"])
def test_exports_have_painted_colours(
    hair: Any, sphere: Any, get_depsgraph: Any, children: str
) -> None:
    paint_halves(sphere)
    groom = hair.data.hairloom
    groom.children.method, groom.children.strand_count = children, 100
    for guides in (False, True):
        found = read_still_hair(
            hair, get_depsgraph(), ExportRequest(guides=guides, color=False)
        ).groom
        starts = found.strands.offsets[:-1]
        assert_halves(found.color[starts], found.strands.points[starts])


def test_a_render_has_painted_colours_and_keeps_its_hair(
    hair: Any, sphere: Any, get_depsgraph: Any
) -> None:
    attribute = paint_halves(sphere)
    bpy.context.view_layer.update()
    first = read_groom(hair, get_depsgraph())
    starts = first.layout.offsets[:-1]
    assert_halves(first.color[starts], first.points[starts])
    attribute.data.foreach_set("color", np.tile(np.float32(RED), len(attribute.data)))
    sphere.data.update_tag()
    bpy.context.view_layer.update()
    second = read_groom(hair, get_depsgraph())
    assert np.unique(second.color, axis=0) == pytest.approx(np.array([RED[:3]]))
    assert second.occlusion is first.occlusion, "the hair was not made again"
    assert read_groom(hair, get_depsgraph()).color is second.color, "nor its colours"


def test_real_hair_and_materials_have_painted_colours(
    hair: Any, sphere: Any, get_depsgraph: Any
) -> None:
    paint_halves(sphere)
    look = hair.data.hairloom.shading
    look.color_variation = look.grey_fraction = 0.0
    assert bpy.ops.hairloom.look_to_material() == {"FINISHED"}

    def colors(name: str, data: Any) -> Any:
        attribute = data.attributes[name]
        values = np.empty(4 * len(attribute.data), np.float32)
        attribute.data.foreach_get("color", values)
        return values.reshape(-1, 4)[:, :3]

    offsets = [each.first_point_index for each in hair.data.curves]
    roots = np.array([hair.data.points[each].position for each in offsets])
    assert_halves(colors("hair_color", hair.data), roots)
    node = next(
        each
        for each in hair.data.materials[0].node_tree.nodes
        if each.type == "BSDF_HAIR_PRINCIPLED"
    )
    assert node.parametrization == "COLOR" and node.inputs["Color"].is_linked
    bpy.ops.hairloom.make_real()
    real = bpy.data.objects["Hair Real"]
    assert real.data.hairloom.shading.color_map == ""
    starts = [each.first_point_index for each in real.data.curves]
    roots = np.array([real.data.points[each].position for each in starts])
    assert_halves(colors("color", real.data)[starts], roots)


@pytest.mark.parametrize("is_changed", [False, True])
def test_replaced_curves_get_the_colours_painted_under_their_roots(
    sphere: Any, extension: None, is_changed: bool
) -> None:
    """Also if an artist has changed the material's nodes, which are kept."""
    paint_halves(sphere)
    bpy.ops.hairloom.add_groom(strand_count=150, plays=False)
    hair = bpy.context.object
    look = hair.data.hairloom.shading
    look.color_map = MAP
    nodes = hair.data.materials[0].node_tree.nodes
    node = next(each for each in nodes if each.type == "BSDF_HAIR_PRINCIPLED")
    if is_changed:
        node.inputs["Random Roughness"].default_value = 0.7
    assert lost_by_regrowing(hair.data) == ()

    def assert_painted(count: int) -> None:
        values = np.empty((count, 4), np.float32)
        hair.data.attributes["hair_color"].data.foreach_get("color", values.ravel())
        starts = [each.first_point_index for each in hair.data.curves]
        roots = np.array([hair.data.points[each].position for each in starts])
        assert_halves(values[:, :3], roots)

    hair.data.hairloom.grow.strand_count = 200
    assert_painted(200)
    set_points(hair.data, curve_points(hair.data) * np.float32(1.05))
    assert bpy.ops.hairloom.grow_again() == {"FINISHED"}
    assert_painted(200)
    if is_changed:
        assert node.inputs["Random Roughness"].default_value == pytest.approx(0.7)


def test_a_verb_writes_painted_colours(
    hair: Any, sphere: Any, get_depsgraph: Any, tmp_path: Path
) -> None:
    paint_halves(sphere)
    made = tmp_path / "hair.hair"
    asked = ["export", "--groom", "Hair", "--set", f"shading.color_map={MAP}"]
    assert command_line.run([*asked, "--output", str(made)]) == 0
    strands = read_hair_file(made).strands
    assert_halves(strands.color[strands.offsets[:-1]], strands.roots)
    asked[-1] = "shading.color_map=Gone"
    assert command_line.run([*asked, "--output", str(tmp_path / "no.hair")]) != 0


@pytest.mark.draws
def test_cards_have_painted_colours(hair: Any, sphere: Any, get_depsgraph: Any) -> None:
    attribute = paint_halves(sphere)
    groom = hair.data.hairloom
    groom.atlas.size, groom.cards.order_by, groom.card_occlusion.rays = "512", "distance", 1
    groom.shading.color_variation, groom.card_drawing.shown_as = 0.0, "cards"
    session = started(hair, get_depsgraph)
    cards = shown(session).cards
    assert cards.base_color == pytest.approx(np.maximum(RED, BLUE)[:3], abs=1e-6)
    shares = cards.textures.base * np.array(cards.base_color)
    is_hair = cards.textures.alpha > 0.0
    for color in (RED, BLUE):
        is_alike = np.isclose(shares, color[:3], atol=1e-3).all(axis=-1) & is_hair
        assert is_alike.sum() > 0.2 * is_hair.sum()
    attribute.data.foreach_set("color", np.tile(np.float32(BLUE), len(attribute.data)))
    sphere.data.update_tag()
    catch_up(get_depsgraph)
    assert shown(session).cards.base_color == pytest.approx(BLUE[:3], abs=1e-6)


def test_a_bake_shows_colours_painted_later(
    hair: Any, sphere: Any, get_depsgraph: Any, tmp_path: Path
) -> None:
    attribute = paint_halves(sphere)
    scene = bpy.context.scene
    scene.frame_start, scene.frame_end = 1, 2
    hair.hairloom.dynamics.device = "numpy"
    hair.hairloom.bake.folder = str(tmp_path)
    bpy.context.view_layer.update()
    assert bpy.ops.hairloom.bake() == {"FINISHED"}
    copy = hair.hairloom.bake.copy
    first = read_groom(copy, get_depsgraph())
    starts = first.layout.offsets[:-1]
    assert_halves(first.color[starts], first.points[starts])
    assert copy.data.attributes["color"].data[0].color[:] != (0.0, 0.0, 0.0, 0.0)
    attribute.data.foreach_set("color", np.tile(np.float32(BLUE), len(attribute.data)))
    sphere.data.update_tag()
    bpy.context.view_layer.update()
    second = read_groom(copy, get_depsgraph())
    assert np.unique(second.color, axis=0) == pytest.approx(np.array([BLUE[:3]]))


def no_pixels(sphere: Any) -> None:
    unwrapped(sphere)
    image = bpy.data.images.new(MAP, 4, 4)
    image.source, image.filepath = "FILE", "//is_not_there.png"


def no_uvs(sphere: Any) -> None:
    paint("image", sphere)
    while sphere.data.uv_layers:
        sphere.data.uv_layers.remove(sphere.data.uv_layers[0])


def not_finite(sphere: Any) -> None:
    paint_halves(sphere).data[5].color = (np.nan, 0.0, 0.0, 1.0)


def unknown_space(sphere: Any) -> None:
    paint("image", sphere)
    bpy.data.images[MAP].colorspace_settings.name = "ACEScg"


def a_number(sphere: Any) -> None:
    sphere.data.attributes.new(MAP, "FLOAT", "POINT")
    paint_halves(sphere).name = "There"


@pytest.mark.parametrize(
    ("spoil", "says", "remedy"),
    [
        (lambda sphere: None, "no colour attribute named 'Ombre'", "Vertex Paint"),
        (a_number, "no colour attribute named 'Ombre'", "Use one of: There"),
        (no_uvs, "needs a surface with UVs", "Unwrap it"),
        (no_pixels, "has no pixels", "Find its file"),
        (not_finite, "not finite numbers (1 of ", "clear its field"),
        (unknown_space, "colour space 'ACEScg'", "sRGB"),
    ],
)
def test_unusable_maps_are_reported_and_hair_keeps_its_colour(
    hair: Any, sphere: Any, get_depsgraph: Any, spoil: Any, says: str, remedy: str
) -> None:
    spoil(sphere)
    session = started(hair, get_depsgraph)
    (warning,) = (each for each in session.warnings if "UVs, so exported" not in each)
    assert warning.startswith("Head: ") and says in warning and remedy in warning
    assert warning.endswith("Until then the look's colour is used")
    assert shown(session).color is None
    request = ExportRequest(guides=False, color=False)
    assert read_still_hair(hair, get_depsgraph(), request).groom.color is None


def test_hair_without_a_surface_says_so(new_hair: Any, get_depsgraph: Any) -> None:
    hair = new_hair()
    hair.data.hairloom.shading.color_map = MAP
    session = started(hair, get_depsgraph)
    assert any("needs a surface, and it has none" in each for each in session.warnings)
    assert shown(session).color is None
