"""Painted settings, read from Blender: every kind of map, and faulty maps."""

from __future__ import annotations

from typing import Any

import bpy
import numpy as np
import pytest
from swinging import key_x

from hairloom.addon.blender.bakes.groom_hashes import groom_rig_hash
from hairloom.addon.blender.bakes.simulation import differences
from hairloom.addon.blender.base.vertex_weights import VertexGroupWeights, read_weights
from hairloom.addon.blender.preview import previews, scene_events
from hairloom.addon.blender.preview.bake import Bake
from hairloom.addon.blender.preview.preview import baked_rig_for
from hairloom.addon.blender.properties import presets
from hairloom.addon.blender.properties.groom_settings import GroomSettings
from hairloom.addon.blender.properties.properties import masks_of_groom
from hairloom.addon.blender.scene.curves import read_curves
from hairloom.addon.blender.scene.masks import read_map
from hairloom.addon.blender.scene.painted_colors import painted_colors
from hairloom.addon.blender.scene.surfaces import read_surface
from hairloom.addon.blender.sessions.groom_source import GroomSource
from hairloom.addon.blender.sessions.session import Session
from hairloom.addon.blender.viewport import motion_lines, overlay
from hairloom.addon.errors import HairloomError

#: distance [m] from the border between the halves beyond which values count: the sphere's faces are
#: coarse
FAR = 0.05


@pytest.fixture
def hair(new_hair: Any, sphere: Any) -> Any:
    hair = new_hair(sphere)
    hair.hairloom.dynamics.device = "numpy"
    hair.data.hairloom.children.method = "none"
    return hair


def is_top(sphere: Any) -> list[float]:
    return [float(vertex.co.z > 0.0) for vertex in sphere.data.vertices]


def paint(kind: str, hair: Any, sphere: Any) -> None:
    """Paint the upper half 1 and the lower half 0, named "Top"."""
    mesh, top = sphere.data, is_top(sphere)
    if kind == "group":
        group = sphere.vertex_groups.new(name="Top")
        group.add(np.flatnonzero(top).tolist(), 1.0, "REPLACE")
    elif kind == "face":
        attribute = mesh.attributes.new("Top", "FLOAT", "FACE")
        attribute.data.foreach_set("value", [float(each.center.z > 0.0) for each in mesh.polygons])
    elif kind == "corner colour":
        attribute = mesh.attributes.new("Top", "BYTE_COLOR", "CORNER")
        for loop, element in zip(mesh.loops, attribute.data, strict=True):
            element.color = (*[top[loop.vertex_index]] * 3, 1.0)
    elif kind == "image":
        layer = mesh.uv_layers.active or mesh.uv_layers.new(name="Across")
        for loop in mesh.loops:
            layer.uv[loop.index].vector = (0.3, 0.5 + 2.0 * mesh.vertices[loop.vertex_index].co.z)
        image = bpy.data.images.new("Top", 4, 64)
        pixels = np.ones((64, 4, 4), np.float32)
        pixels[:32, :, :3] = 0.0
        image.pixels.foreach_set(pixels.ravel())
    else:
        strands = read_curves(hair, bpy.context.evaluated_depsgraph_get()).strands
        values = (strands.roots[:, 2] > 0.0).astype(np.float32)
        if kind == "curve":
            hair.data.attributes.new("Top", "FLOAT", "CURVE").data.foreach_set("value", values)
        else:
            of_points = np.repeat(values, strands.point_counts)
            hair.data.attributes.new("Top", "FLOAT", "POINT").data.foreach_set("value", of_points)


def started(hair: Any, get_depsgraph: Any) -> Any:
    bpy.context.view_layer.update()
    return previews.start(hair, get_depsgraph())


def factors(session: Any) -> Any:
    return session._source.painted_guides(session.rig).factors


def assert_halves(session: Any, found: Any) -> None:
    """Assert factors of 1 above and 0 below."""
    height = session.rig.strands.roots[session.rig.guides, 2]
    assert (height > FAR).sum() > 3 and (height < -FAR).sum() > 3
    np.testing.assert_allclose(found[:, height > FAR], 1.0, atol=1e-5)
    np.testing.assert_allclose(found[:, height < -FAR], 0.0, atol=1e-5)


def catch_up(get_depsgraph: Any) -> None:
    bpy.context.view_layer.update()
    scene_events.catch_up(get_depsgraph())


KINDS = ("group", "face", "corner colour", "image", "curve", "point")


@pytest.mark.parametrize("kind", KINDS)
def test_guides_read_each_kind_of_map(
    hair: Any, sphere: Any, get_depsgraph: Any, kind: str
) -> None:
    paint(kind, hair, sphere)
    dynamics, children = hair.hairloom.dynamics, hair.data.hairloom.children
    assert "Top" in masks_of_groom(dynamics, bpy.context, "to")
    dynamics.style_root_mask = "Top"
    children.method, children.strand_count, children.width_mask = "multi", 100, "Top"
    hair.hairloom.children_density = "Top"
    session = started(hair, get_depsgraph)
    assert session.warnings == ()
    found = factors(session)
    assert found.keys() == {"style_root"}
    assert found["style_root"].shape[0] == (
        session.rig.guide_grid.shape[1] if kind == "point" else 1
    )
    assert_halves(session, found["style_root"])
    growth = session.rig.grown_children.growth
    assert growth.root[:, 2].min() > -FAR, "children grow above alone"
    widths = growth.factors["width"]
    assert (np.median(widths), widths.max()) == pytest.approx((1.0, 1.0), abs=1e-6)


def test_points_of_nurbs_are_painted_where_they_are_drawn(
    hair: Any, sphere: Any, get_depsgraph: Any
) -> None:
    paint("point", hair, sphere)
    hair.data.set_types(type="NURBS")
    ends = hair.data.attributes.new("knots_mode", "INT8", "CURVE")
    # the curve ends at its first and last point
    ends.data.foreach_set("value", [1] * len(ends.data))
    hair.hairloom.dynamics.style_root_mask = "Top"
    session = started(hair, get_depsgraph)
    assert session.warnings == ()
    found = factors(session)["style_root"]
    height = session.rig.strands.roots[session.rig.guides, 2]
    assert 0.0 < found.mean() < 1.0
    assert found[:, height > FAR].mean() > 0.99 and found[:, height < -FAR].mean() < 0.01


def test_painted_hair_moves_differently(hair: Any, sphere: Any, get_depsgraph: Any) -> None:
    """Stiff above and limp below, on a head that moves sideways."""
    scene, dynamics = bpy.context.scene, hair.hairloom.dynamics
    scene.frame_start, scene.frame_end = 1, 8
    key_x(sphere, {1: 0.0, 5: 0.2})
    paint("group", hair, sphere)
    scene.frame_set(1)
    ends = []
    for name in ("", "Top"):
        dynamics.style_root_mask = dynamics.style_tip_mask = name
        session = started(hair, get_depsgraph)
        hair.hairloom.bake.follows = True
        scene.frame_set(1)
        for frame in range(2, 7):
            scene.frame_set(frame)
        ends.append(session.solver.guides())
        height = session.rig.strands.roots[session.rig.guides, 2]
        previews.stop(session)
    apart = np.abs(ends[0] - ends[1]).max(axis=(1, 2))
    assert apart[height > FAR].max() < 1e-5, "as everywhere where it is painted 1"
    assert np.median(apart[height < -FAR]) > 1e-3


def test_a_map_that_becomes_unusable_keeps_its_last_values(
    hair: Any, sphere: Any, get_depsgraph: Any
) -> None:
    paint("face", hair, sphere)
    dynamics = hair.hairloom.dynamics
    session = started(hair, get_depsgraph)
    dynamics.gravity_mask = "Top"
    assert session.is_stale, "it is to be read"
    catch_up(get_depsgraph)
    before = factors(session)["gravity"].copy()
    assert_halves(session, before)
    sphere.data.attributes["Top"].data[0].value = float("nan")
    sphere.data.update_tag()
    catch_up(get_depsgraph)
    (warning,) = session.warnings
    assert warning.startswith("Head: ") and "'Top'" in warning and "last state is used" in warning
    assert ".." not in warning
    np.testing.assert_array_equal(factors(session)["gravity"], before)
    dynamics.gravity_mask = "Gone"
    catch_up(get_depsgraph)
    (warning,) = session.warnings
    assert "neither a vertex group nor an attribute named 'Gone'" in warning
    assert "Top" in warning, "those that there are"
    assert session._source.painted_guides(session.rig) is None
    dynamics.gravity_mask = ""
    catch_up(get_depsgraph)
    assert session.warnings == () and session._source.painted_guides(session.rig) is None


def test_a_map_of_zeros_is_reported_with_a_remedy(
    hair: Any, sphere: Any, get_depsgraph: Any
) -> None:
    sphere.vertex_groups.new(name="Nothing")
    hair.hairloom.dynamics.bend_mask = "Nothing"
    (warning,) = started(hair, get_depsgraph).warnings
    assert "'Nothing' is 0 everywhere, and so is Bend Stiffness" in warning
    assert "Paint it" in warning


def test_an_image_of_several_tiles_is_refused(hair: Any, sphere: Any, get_depsgraph: Any) -> None:
    """Blender returns only the first tile's pixels, which would apply to the whole surface."""
    image = bpy.data.images.new("Film", 8, 8, tiled=True)
    assert read_map(sphere, get_depsgraph(), "Film").shape == (len(sphere.data.vertices),)
    image.tiles.new(1002)
    triangles = len(read_surface(sphere, get_depsgraph(), need_uv=True, place="Head").triangles)
    for read in (
        lambda: read_map(sphere, get_depsgraph(), "Film"),
        lambda: painted_colors(sphere, "Film", get_depsgraph(), triangles, place="Hair"),
    ):
        with pytest.raises(HairloomError, match="has several tiles") as error:
            read()
        assert "Use an image of one tile" in str(error.value)
    hair.hairloom.dynamics.gravity_mask = "Film"
    assert any("several tiles" in each for each in GroomSource(hair, get_depsgraph()).warnings)


def test_an_image_is_read_again_once_it_is_painted(
    hair: Any, sphere: Any, get_depsgraph: Any
) -> None:
    paint("image", hair, sphere)
    hair.hairloom.dynamics.volume_mask = "Top"
    image, material = bpy.data.images["Top"], bpy.data.materials.new("Skin")
    material.node_tree.nodes.new("ShaderNodeTexImage").image = image
    sphere.data.materials.append(material)
    session = started(hair, get_depsgraph)
    image.pixels.foreach_set(np.full(64 * 4 * 4, 0.25, np.float32))
    image.update_tag()
    bpy.context.view_layer.update()
    assert session.is_stale
    catch_up(get_depsgraph)
    np.testing.assert_allclose(factors(session)["volume"], 0.25, atol=2e-3)


def test_an_image_is_read_again_by_a_preview_that_has_the_hair_of_its_bake(
    hair: Any, sphere: Any, get_depsgraph: Any, tmp_path: Any
) -> None:
    paint("image", hair, sphere)
    hair.hairloom.dynamics.volume_mask = "Top"
    hair.hairloom.bake.folder, bpy.context.scene.frame_end = str(tmp_path / "bake"), 1
    list(Bake.of([hair], bpy.context.scene).steps())
    baked = baked_rig_for(hair, bpy.context.scene)
    session = Session(hair, get_depsgraph(), baked=baked)
    assert baked is not None and session.warnings == ()
    bpy.data.images["Top"].pixels.foreach_set(np.full(64 * 4 * 4, 0.25, np.float32))
    session.read_again(get_depsgraph())
    assert session.warnings == ()
    np.testing.assert_allclose(factors(session)["volume"], 0.25, atol=2e-3)


def test_the_overlay_shows_a_map_while_it_is_painted(
    hair: Any, sphere: Any, get_depsgraph: Any
) -> None:
    paint("group", hair, sphere)
    session = started(hair, get_depsgraph)
    hair.hairloom.shown_overlays = {"paint"}
    assert overlay.drawing_of(session.uid).lines == (), "nothing is chosen"
    hair.hairloom.shown_map = "Top"

    def shown() -> dict[Any, Any]:
        return {one.color: one.points for one in overlay.drawing_of(session.uid).lines}

    blue, red = motion_lines.MASK_COLORS[0][1], motion_lines.MASK_COLORS[-1][1]
    root = session.solver.guides()[:, 0]
    above, below = root[root[:, 2] > FAR], root[root[:, 2] < -FAR]
    for roots, color in ((above, red), (below, blue)):
        for each in roots:
            assert (np.abs(shown()[color] - each).max(axis=1) < 1e-6).any()
    group = sphere.vertex_groups["Top"]
    group.add([vertex.index for vertex in sphere.data.vertices], 0.3, "REPLACE")
    sphere.data.update_tag()
    bpy.context.view_layer.update()
    assert shown().keys() == {motion_lines.MASK_COLORS[2][1]}, "with the stroke itself"
    segments = session.solver.guides().shape
    assert sum(map(len, shown().values())) == 2 * segments[0] * (segments[1] - 1)


@pytest.mark.parametrize("kind", KINDS)
def test_a_bake_is_stale_once_a_map_of_its_motion_is_painted(
    hair: Any, sphere: Any, kind: str
) -> None:
    paint(kind, hair, sphere)
    hair.hairloom.dynamics.style_damping_mask = "Top"
    settings = GroomSettings.of(hair)

    def now() -> str:
        return groom_rig_hash(hair, sphere, settings, bpy.context.scene)

    before = now()
    assert now() == before
    if kind == "group":
        sphere.vertex_groups["Top"].add([0], 0.3, "REPLACE")
    elif kind == "image":
        bpy.data.images["Top"].pixels[5] = 0.3
    else:
        data = sphere.data if kind in ("face", "corner colour") else hair.data
        element = data.attributes["Top"].data[0]
        if kind == "corner colour":
            element.color = (0.3, 0.3, 0.3, 1.0)
        else:
            element.value = 0.3
    assert differences(before, now()) == ("paint",)


def test_a_preset_keeps_painted_maps_unless_it_names_its_own(hair: Any) -> None:
    dynamics = hair.hairloom.dynamics
    dynamics.gravity_mask = "Top"
    shipped = presets.named_preset("dynamics/big")
    presets.apply(shipped.settings, hair)
    assert (dynamics.style_root, dynamics.gravity_mask) == (5.0, "Top")
    entries = presets.shipped_presets("dynamics")
    found = presets.matching_preset(hair, entries)
    assert found is not None and found.name == "dynamics/big", "painted hair has it, too"
    (kept,) = presets.settings_to_store(hair, "dynamics")
    dynamics.gravity_mask, dynamics.bend_mask = "Other", "Bent"
    presets.apply(kept, hair)
    assert (dynamics.gravity_mask, dynamics.bend_mask) == ("Top", "Bent")


def test_a_dab_reads_the_vertex_groups_once_for_children_and_overlay(
    hair: Any, sphere: Any, get_depsgraph: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    every = [vertex.index for vertex in sphere.data.vertices]
    for name in ("Top", "Long", "Clumped"):
        sphere.vertex_groups.new(name=name).add(every, 0.9, "REPLACE")
    children = hair.data.hairloom.children
    children.method, children.strand_count, hair.hairloom.children_density = "multi", 100, "Top"
    children.length_mask, children.clump_mask, children.clump = "Long", "Clumped", 0.5
    session = started(hair, get_depsgraph)
    hair.hairloom.shown_overlays, hair.hairloom.shown_map = {"paint"}, "Long"
    catch_up(get_depsgraph)
    read, of = [], VertexGroupWeights.of
    monkeypatch.setattr(VertexGroupWeights, "of", lambda mesh: read.append(mesh) or of(mesh))
    for name, weight in (("Long", 0.5), ("Top", 0.2), ("Long", 0.3)):
        length = session.rig.strands.lengths()
        sphere.vertex_groups[name].add(every[: len(every) // 2], weight, "REPLACE")
        sphere.data.update_tag()
        read.clear()
        bpy.context.view_layer.update()
        shown = session.shown_map(get_depsgraph())
        assert len(read) == 1
        assert name != "Long" or np.isclose(shown, weight).any(), "the overlay is of this dab"
        assert name != "Long" or (session.rig.strands.lengths() != length).any()


def test_weights_are_read_at_each_vertex(sphere: Any, get_depsgraph: Any) -> None:
    random, count = np.random.default_rng(2), len(sphere.data.vertices)
    expected = {}
    for name in ("One", "Two", "Three"):
        group, weights = sphere.vertex_groups.new(name=name), np.zeros(count)
        for vertex in random.permutation(count)[: count // 2].tolist():
            weights[vertex] = random.uniform()
            group.add([vertex], float(weights[vertex]), "REPLACE")
        expected[name] = weights
    for name, weights in expected.items():
        np.testing.assert_allclose(read_weights(sphere, get_depsgraph(), name), weights, atol=1e-7)


def test_the_overlay_of_a_map_on_the_curves_follows_another_number_of_curves(
    hair: Any, sphere: Any, get_depsgraph: Any
) -> None:
    soft = hair.data.attributes.new("Soft", "FLOAT", "CURVE")
    soft.data.foreach_set("value", np.full(len(hair.data.curves), 0.25, np.float32))
    session = started(hair, get_depsgraph)
    hair.hairloom.shown_overlays, hair.hairloom.shown_map = {"paint"}, "Soft"
    assert np.allclose(session.shown_map(get_depsgraph()), 0.25)
    hair.data.remove_curves(indices=[0, 1, 2])
    catch_up(get_depsgraph)
    shown = session.shown_map(get_depsgraph())
    assert shown is not None and np.allclose(shown, 0.25)
