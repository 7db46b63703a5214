"""The parts of a scene that the render engine draws, and unusual or bad input."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from grids import baked_grid
from swinging import key_x

bpy = pytest.importorskip("bpy", reason="these tests need Blender or the bpy module")

from engine_stage import SIZE, add_ball, render_passes, render_picture  # noqa: E402

from hairloom.addon.blender.engine import engine_hair  # noqa: E402
from hairloom.addon.blender.engine.engine_meshes import read_meshes  # noqa: E402
from hairloom.addon.light_flow import strand_axes  # noqa: E402
from hairloom.addon.strands import StrandSet  # noqa: E402

pytestmark = [pytest.mark.draws, pytest.mark.usefixtures("gpu_context", "extension")]


def test_view_layers_and_holdouts(engine_scene: Any, tmp_path: Path) -> None:
    """Each view layer draws its own collections. A holdout has alpha 0."""
    engine_scene.render.film_transparent = True
    collections = [bpy.data.collections.new(name) for name in ("One", "Two")]
    for collection, x in zip(collections, (-0.15, 0.15), strict=True):
        engine_scene.collection.children.link(collection)
        ball = add_ball(0.1)
        ball.location.x = x
        engine_scene.collection.objects.unlink(ball)
        collection.objects.link(ball)
    second = engine_scene.view_layers.new("Second")
    second.layer_collection.children["One"].exclude = True
    third = engine_scene.view_layers.new("Third")
    third.layer_collection.children["One"].holdout = True
    found = render_passes(tmp_path)
    covered = {
        name: (
            found[f"{name}.Combined"][:, : SIZE // 2, 3].max(),
            found[f"{name}.Combined"][:, SIZE // 2 :, 3].max(),
        )
        for name in ("ViewLayer", "Second", "Third")
    }
    assert covered == {"ViewLayer": (1.0, 1.0), "Second": (0.0, 1.0), "Third": (0.0, 1.0)}


@pytest.mark.alike
@pytest.mark.parametrize("transparency", ["none", "hashed", "layers"])
def test_hair_can_be_a_holdout(
    engine_scene: Any, new_hair: Callable[..., Any], sphere: Any, tmp_path: Path, transparency: str
) -> None:
    """In front of a wall, a holdout removes the hair's alpha. Meshes in front of it stay."""
    engine_scene.render.film_transparent = True
    engine_scene.hairloom.picture.samples = 16
    hair = new_hair(sphere)
    hair.data.hairloom.strands.fullness = 60.0
    hair.data.hairloom.strands.transparency = transparency
    hair.data.hairloom.strands.opacity = 0.7
    bpy.data.objects.remove(sphere)
    alone = render_picture(tmp_path)[..., 3]
    assert alone.max() > 0.1 and 0.005 < alone.mean() < 0.9
    wall = add_ball(1.5)
    wall.location.y = 2.0
    assert render_picture(tmp_path)[..., 3].min() > 0.99
    hair.is_holdout = True
    np.testing.assert_allclose(render_picture(tmp_path)[..., 3], 1.0 - alone, atol=2e-3)
    wall.location.y, wall.scale = -0.6, (0.1,) * 3
    assert render_picture(tmp_path)[SIZE // 2, SIZE // 2, 3] == 1.0
    hair.is_holdout = False
    bpy.data.objects.remove(wall)
    apart = bpy.data.collections.new("Apart")
    engine_scene.collection.children.link(apart)
    engine_scene.collection.objects.unlink(hair)
    apart.objects.link(hair)
    assert render_picture(tmp_path)[..., 3].max() > 0.1
    engine_scene.view_layers[0].layer_collection.children["Apart"].indirect_only = True
    assert render_picture(tmp_path)[..., 3].max() == 0.0


def test_previewed_hair_is_seen_as_its_object_is(
    engine_scene: Any, new_hair: Callable[..., Any], sphere: Any
) -> None:
    """The reader omits previewed hair, and takes holdout and visibility from the original, not from
    the copy that the preview has changed."""
    from hairloom.addon.blender.engine.engine_scene import SceneReader

    hair, reader = new_hair(sphere), SceneReader()
    hair.is_holdout = True
    depsgraph = bpy.context.evaluated_depsgraph_get()
    hair.evaluated_get(depsgraph).visible_camera = False
    assert not reader.read(depsgraph, is_previewed=lambda _: True).grooms
    found = reader.previewed[hair.session_uid]
    assert (found.is_seen, found.is_holdout) == (True, True)
    hair.visible_camera, hair.is_holdout = False, False
    reader.read(bpy.context.evaluated_depsgraph_get(), is_previewed=lambda _: True)
    found = reader.previewed[hair.session_uid]
    assert (found.is_seen, found.is_holdout) == (False, False)


def test_instances_of_previewed_hair_are_drawn_and_leave_it_as_it_is(
    engine_scene: Any, new_hair: Callable[..., Any]
) -> None:
    from hairloom.addon.blender.engine.engine_scene import SceneReader

    hair, inside = new_hair(), bpy.data.collections.new("Inside")
    inside.objects.link(hair)
    empty = bpy.data.objects.new("Empty", None)
    empty.instance_type, empty.instance_collection = "COLLECTION", inside
    empty.location.x, empty.is_holdout = 1.0, True
    engine_scene.collection.objects.link(empty)
    reader, depsgraph = SceneReader(), bpy.context.evaluated_depsgraph_get()
    both = [groom.key for groom in reader.read(depsgraph).grooms]
    assert len(both) == 2
    (found,) = reader.read(depsgraph, is_previewed=lambda _: True).grooms
    assert found.key in both and len(found.key) > 1 and found.is_holdout
    seen = reader.previewed[hair.session_uid]
    assert (seen.is_seen, seen.is_holdout) == (True, False)


def test_texts_metaballs_and_instances_are_drawn(engine_scene: Any, tmp_path: Path) -> None:
    engine_scene.render.film_transparent = True
    add: list[Callable[[], Any]] = [
        lambda: bpy.ops.object.text_add(rotation=(np.pi / 2.0, 0.0, 0.0), scale=(0.3,) * 3),
        lambda: bpy.ops.object.metaball_add(radius=0.1),
        lambda: bpy.ops.surface.primitive_nurbs_surface_sphere_add(radius=0.1),
    ]
    for each in add:
        each()
        assert render_picture(tmp_path)[..., 3].mean() > 0.01
        bpy.data.objects.remove(bpy.context.object)
    inside = bpy.data.collections.new("Inside")
    ball = add_ball(0.05)
    engine_scene.collection.objects.unlink(ball)
    inside.objects.link(ball)
    assert render_picture(tmp_path)[..., 3].max() == 0.0
    for x in (-0.1, 0.1):
        empty = bpy.data.objects.new("Empty", None)
        empty.instance_type, empty.instance_collection = "COLLECTION", inside
        empty.location.x = x
        engine_scene.collection.objects.link(empty)
    alpha = render_picture(tmp_path)[SIZE // 2, :, 3]
    assert np.count_nonzero(np.diff((alpha > 0.5).astype(int))) == 4


@pytest.mark.parametrize("shown_as", ["strands", "cards"])
def test_hair_of_instances_is_as_thick_and_lit_as_it_looks(
    sphere: Any, new_hair: Callable[..., Any], shown_as: str
) -> None:
    """Twice the scale gives twice the radius or depth; light's vectors are mirrored with hair."""
    hair = new_hair(sphere)
    settings = hair.data.hairloom
    settings.card_drawing.shown_as, settings.card_occlusion.rays = shown_as, 4
    settings.cards.order_by, settings.atlas.source = "distance", "made"
    own = engine_hair.read_groom(hair, bpy.context.evaluated_depsgraph_get())
    large = engine_hair.transformed(own, np.diag((2.0, 2.0, 2.0, 1.0)))
    mirrored = engine_hair.transformed(own, np.diag((-1.0, 1.0, 1.0, 1.0)))
    if own.cards is None:
        np.testing.assert_allclose(large.radius, 2.0 * own.radius)
    else:
        np.testing.assert_allclose(large.cards.depth, 2.0 * own.cards.depth)
    for before, after in zip(vectors_of(own), vectors_of(mirrored), strict=True):
        np.testing.assert_allclose(after, before * (-1.0, 1.0, 1.0), atol=1e-5)


def vectors_of(snapshot: Any) -> list[np.ndarray]:
    """Per point, the vectors towards light, and those towards skin, in world space, (n, 3) each."""
    drawn, layout = snapshot.cards or snapshot, snapshot.layout
    if snapshot.cards is None:
        group = np.zeros(layout.strand_count, np.int32)
        strands = StrandSet(snapshot.points, layout.offsets, snapshot.radius, group)
        axes = strand_axes(strands)
    else:
        axes = drawn.mesh.axes
    lanes = drawn.openness[:, 1:4], drawn.skin_seen[:, 1:4], drawn.skin_seen[:, 4:7]
    return [np.einsum("na,anx->nx", parts, np.array(axes)) for parts in lanes]


def test_a_mesh_that_is_edited_is_seen_as_it_is(sphere: Any) -> None:
    """Rendered mode in Edit Mode, where Blender keeps the mesh's data elsewhere."""
    before, edited = (seen_in(mode, sphere) for mode in ("OBJECT", "EDIT"))
    assert len(before) == len(edited) == 1
    for one, other in zip(before, edited, strict=True):
        assert np.array_equal(one.surface.triangles, other.surface.triangles)
        assert np.array_equal(one.surface.positions, other.surface.positions)
        assert np.allclose(one.vertex_normals, other.vertex_normals, atol=1e-6)
        assert one.skin is not None and other.skin is not None
        assert np.array_equal(one.skin.surface.corner_uv, other.skin.surface.corner_uv)


def seen_in(mode: str, obj: Any) -> tuple[Any, ...]:
    bpy.ops.object.mode_set(mode=mode)
    evaluated = obj.evaluated_get(bpy.context.evaluated_depsgraph_get())
    return read_meshes(evaluated, np.eye(4), is_head=True)


def test_hidden_in_renders_is_not_drawn(
    engine_scene: Any, new_hair: Callable[..., Any], sphere: Any, tmp_path: Path
) -> None:
    engine_scene.render.film_transparent = True
    hair = new_hair(sphere)
    sphere.hide_render = True
    hair.data.hairloom.strands.fullness = 20.0
    assert render_picture(tmp_path)[..., 3].max() > 0.5
    hair.visible_camera = False
    assert render_picture(tmp_path)[..., 3].max() == 0.0
    hair.visible_camera, hair.hide_render = True, True
    assert render_picture(tmp_path)[..., 3].max() == 0.0


def test_the_camera_may_be_inside_of_hair_and_head(
    engine_scene: Any, new_hair: Callable[..., Any], sphere: Any, tmp_path: Path
) -> None:
    new_hair(sphere)
    for y in (-0.12, 0.0):
        engine_scene.camera.location.y = y
        found = render_picture(tmp_path)
        assert np.isfinite(found).all() and found[..., 3].min() > 0.99


def test_hair_is_rendered_as_it_was_baked(
    engine_scene: Any, new_hair: Callable[..., Any], sphere: Any, tmp_path: Path
) -> None:
    """At frames and subframes, although the curves themselves are hidden in renders then."""
    from hairloom.addon.blender.bakes import playback
    from hairloom.addon.blender.engine import engine_hair

    hair = new_hair(sphere)
    engine_scene.frame_start, engine_scene.frame_end = 1, 4
    key_x(sphere, {1: -0.2, 4: 0.2})
    hair.hairloom.dynamics.device = "numpy"
    hair.hairloom.dynamics.collider_resolution = 8
    hair.hairloom.bake.folder = str(tmp_path / "bake")
    hair.pass_index = 5
    engine_scene.frame_set(1)
    assert bpy.ops.hairloom.bake() == {"FINISHED"}
    assert hair.hide_render and hair.hairloom.bake.copy is not None
    copy = hair.hairloom.bake.copy
    for frame, subframe in ((2, 0.0), (2, 0.25)):
        engine_scene.frame_set(frame, subframe=subframe)
        depsgraph = bpy.context.evaluated_depsgraph_get()
        expected = baked_grid(playback.cache_of(hair), frame, subframe)
        for obj in (copy, hair):
            found = engine_hair.read_groom(obj, depsgraph)
            np.testing.assert_array_equal(found.points, expected.reshape(-1, 3))
    engine_scene.view_layers[0].use_pass_object_index = True
    hair.data.hairloom.strands.fullness = 20.0
    numbers = render_passes(tmp_path)["ViewLayer.Object Index"]
    assert (numbers == 5.0).any()


def test_a_bake_has_the_animated_settings_of_the_frame(
    engine_scene: Any,
    new_hair: Callable[..., Any],
    sphere: Any,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The settings are those of the original hair, which is hidden in renders."""
    from hairloom.addon.blender.engine import engine_hair

    hair = new_hair(sphere)
    strands = hair.data.hairloom.strands
    for frame, width in ((1, 1.0), (3, 5.0)):
        strands.fullness = width
        hair.data.keyframe_insert("hairloom.strands.fullness", frame=frame)
    hair.hairloom.dynamics.device = "numpy"
    hair.hairloom.dynamics.collider_resolution = 8
    hair.hairloom.bake.folder = str(tmp_path / "bake")
    engine_scene.frame_start, engine_scene.frame_end = 1, 3
    assert bpy.ops.hairloom.bake() == {"FINISHED"}
    widths = []
    read_groom = engine_hair.read_groom

    def seen(obj: Any, depsgraph: Any, *, blocking: bool) -> Any:
        assert blocking, "a render does not show what was made before"
        widths.append(read_groom(obj, depsgraph).strand_settings.fullness)
        return read_groom(obj, depsgraph)

    monkeypatch.setattr(engine_hair, "read_groom", seen)
    engine_scene.render.filepath = str(tmp_path / "frame_")
    bpy.ops.render.render(animation=True)
    assert sorted(set(widths)) == pytest.approx([1.0, 3.0, 5.0])


def test_bad_input_is_reported(
    engine_scene: Any, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    engine_scene.world = None
    assert render_picture(tmp_path)[..., :3].max() == 0.0
    assert "Lights: there is no light" in capfd.readouterr().out
    engine_scene.camera.data.type = "PANO"
    render_picture(tmp_path)
    assert "panoramic cameras are not drawn" in capfd.readouterr().out
    render = engine_scene.render
    render.use_border, render.border_min_x, render.border_max_x = True, 0.5, 0.501
    with pytest.raises(RuntimeError, match=r"too small|pixels"):
        bpy.ops.render.render()
    render.use_border = False
    engine_scene.camera = None
    with pytest.raises(RuntimeError, match=r"(?i)camera"):
        bpy.ops.render.render()
