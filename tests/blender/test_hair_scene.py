"""Hair drawn over pictures of Blender's own engines: the picture, and the state of the scene.

Cycles represents both engines: it works without a GPU, and its pictures are reproducible.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from swinging import key_x
from tiers import few_in_commits

bpy = pytest.importorskip("bpy", reason="these tests need Blender or the bpy module")

from engine_stage import set_panorama, set_world  # noqa: E402

from hairloom.addon.blender.engine import engine_picture, hair_scene  # noqa: E402
from hairloom.addon.blender.properties.properties import settings_of  # noqa: E402
from hairloom.addon.shading.bright_shafts import bright_shafts  # noqa: E402
from hairloom.addon.shading.environment import panorama_directions  # noqa: E402
from hairloom.addon.shading.shafts import shaft_length  # noqa: E402
from hairloom.addon.shading.shafts_settings import ShaftSettings  # noqa: E402
from hairloom.addon.strands import StrandSet  # noqa: E402

pytestmark = [pytest.mark.draws, pytest.mark.usefixtures("gpu_context", "extension")]

#: samples per pixel, samples where pictures of both engines are compared, and pixels per side
SAMPLES, FINE, SIZE = 4, 8, 120
#: strand count, points per strand and radius [m] of the hair
COUNT, POINTS, RADIUS = 8000, 4, 0.00015


@pytest.fixture
def cycles(engine_scene: Any) -> Any:
    """The stage, rendered by Cycles with the same noise in each picture."""
    engine_scene.render.engine = "CYCLES"
    engine_scene.cycles.use_denoising = False
    engine_scene.cycles.use_adaptive_sampling, engine_scene.cycles.max_bounces = False, 0
    sample(engine_scene, SAMPLES)
    # hair in a small picture would be thinned out
    engine_scene.render.resolution_x = engine_scene.render.resolution_y = SIZE
    return engine_scene


def sample(scene: Any, times: int) -> None:
    scene.cycles.samples = scene.hairloom.picture.samples = times


@pytest.fixture
def hairy(cycles: Any, sphere: Any, new_hair: Callable[..., Any]) -> Any:
    """A ball with hair on the stage, lit only by the world."""
    cycles.camera.location.y = -0.6
    return dense(new_hair, sphere)


def dense(new_hair: Callable[..., Any], head: Any = None) -> Any:
    """Many thin strands, whose tips are as thick as in Cycles."""
    outward = np.random.default_rng(1).normal(size=(COUNT, 1, 3))
    outward /= np.linalg.norm(outward, axis=2, keepdims=True)
    points = outward * np.linspace(0.1, 0.18, POINTS)[None, :, None]
    offsets, radius = np.arange(COUNT + 1) * POINTS, np.full(COUNT * POINTS, RADIUS)
    strands = StrandSet(points.reshape(-1, 3), offsets, radius, np.zeros(COUNT))
    hair = new_hair(head, strands)
    hair.data.hairloom.strands.tip_width = 1.0
    return hair


def rendered(folder: Path) -> np.ndarray:
    """The picture after compositing, (height, width, 4), scene-linear, premultiplied."""
    scene = bpy.context.scene
    settings = scene.render.image_settings
    settings.file_format, settings.color_depth, settings.color_mode = "OPEN_EXR", "32", "RGBA"
    scene.render.filepath = str(folder / "picture.exr")
    bpy.ops.render.render(write_still=True)
    return pixels_of(folder / "picture.exr")


def pixels_of(path: Path) -> np.ndarray:
    image = bpy.data.images.load(str(path))
    found = np.empty(len(image.pixels), np.float32)
    image.pixels.foreach_get(found)
    size = image.size[1], image.size[0], 4
    bpy.data.images.remove(image)
    return found.reshape(size)


def differs(one: np.ndarray, other: np.ndarray, by: float = 0.01) -> np.ndarray:
    return np.abs(one - other)[..., :3].max(axis=2) > by


def grown(mask: np.ndarray) -> np.ndarray:
    """A mask, dilated by one pixel."""
    padded = np.pad(mask, 1)
    return np.any([padded[y : y + SIZE, x : x + SIZE] for y in range(3) for x in range(3)], axis=0)


def blocks(image: np.ndarray) -> np.ndarray:
    """Means of 10 x 10 pixels, which do not depend on the places of strands within a pixel."""
    return image.reshape(SIZE // 10, 10, SIZE // 10, 10).mean(axis=(1, 3))


def bald(hair: Any, folder: Path) -> np.ndarray:
    hair.hide_render = True
    found = rendered(folder)
    hair.hide_render = False
    return found


def links_of(tree: Any) -> set[tuple[str, str, str, str]]:
    return {
        (each.from_node.name, each.from_socket.name, each.to_node.name, each.to_socket.name)
        for each in tree.links
    }


def test_hair_covers_the_same_pixels_as_in_cycles_and_nothing_else_changes(
    cycles: Any, hairy: Any, tmp_path: Path
) -> None:
    """Blocks agree with Cycles' alpha to 0.05; without shadows, other pixels are Cycles' own."""
    sample(cycles, FINE)
    hairy.data.hairloom.volume.shadows = "none"
    cycles.render.film_transparent = True
    without, native = bald(hairy, tmp_path), rendered(tmp_path)
    cycles.hairloom.use_hair_scene = True
    ours = rendered(tmp_path)
    theirs, own = native[..., 3], ours[..., 3]
    assert 0.1 < (theirs > 0.5).mean() < 0.6
    assert np.abs(blocks(theirs) - blocks(own)).max() < 0.05
    assert abs(theirs.mean() - own.mean()) < 0.005
    free = ~grown(grown((own > 0.0) | (theirs > 0.0)))
    assert free.mean() > 0.3
    np.testing.assert_array_equal(ours[free], without[free])


@pytest.mark.slow(instead="test_hair_covers_the_same_pixels_as_in_cycles_and_nothing_else_changes")
def test_hair_behind_a_mesh_is_hidden_at_its_very_edge(
    cycles: Any, hairy: Any, tmp_path: Path
) -> None:
    """A plate in front of the right half hides the hair; alpha at its edge does not exceed 1."""
    set_world((0.0, 0.0, 0.0))
    bpy.ops.mesh.primitive_plane_add(
        size=1.0, location=(0.503, -0.3, 0.0), rotation=(np.pi / 2.0, 0.0, 0.0)
    )
    hairy.data.hairloom.volume.shadows = "none"
    bpy.ops.object.light_add(type="SUN", rotation=(np.pi / 2.0, 0.0, 0.0))
    cycles.render.film_transparent = True
    cycles.hairloom.use_hair_scene = True
    alpha = rendered(tmp_path)[..., 3]
    # the plate is where alpha is 1 without hair; at its edge alpha is between 0 and 1
    cycles.hairloom.use_hair_scene = False
    plate = bald(hairy, tmp_path)[..., 3]
    hair_alone = alpha - plate
    middle = slice(SIZE // 2 - 4, SIZE // 2 + 4)
    assert (plate[middle] == 1.0).mean() > 0.4
    assert np.abs(hair_alone[middle][plate[middle] == 1.0]).max() == 0.0
    assert alpha.max() <= 1.0 + 1e-6


def test_shadow_on_a_mesh_is_as_dark_as_in_cycles(
    cycles: Any, new_hair: Callable[..., Any], tmp_path: Path
) -> None:
    """A ball of hair between a sun and the floor, compared where no hair covers the floor."""
    sample(cycles, FINE)
    hair = dense(new_hair)
    # no scattering: the hair acts as if it were black
    hair.data.hairloom.volume.scattering = False
    hair.location.z = 0.2
    set_world((0.0, 0.0, 0.0))
    bpy.ops.mesh.primitive_plane_add(size=1.2, location=(0.0, 0.0, -0.1))
    bpy.ops.object.light_add(type="SUN")
    bpy.context.object.data.angle = 0.0
    cycles.camera.location, cycles.camera.rotation_euler = (0.0, -0.45, 0.35), (0.9, 0.0, 0.0)
    without, native = bald(hair, tmp_path), rendered(tmp_path)
    cycles.hairloom.use_hair_scene = True
    ours = rendered(tmp_path)
    # leave out hair in front of the floor
    floor = (without[..., 0] > 0.1) & (np.arange(SIZE) < SIZE // 2)[:, None]
    taken = [1.0 - (found / np.maximum(without, 1e-6))[..., 0][floor] for found in (native, ours)]
    assert taken[0].mean() > 0.01
    assert taken[1].mean() == pytest.approx(taken[0].mean(), rel=0.15)
    assert np.corrcoef(*taken)[0, 1] > 0.9
    # where no shadow falls, the floor is Cycles' bit for bit
    assert (ours == without).all(axis=2)[floor].mean() > 0.2


def test_the_scene_is_as_it_was_after_the_render_and_after_turning_off(
    cycles: Any, hairy: Any, tmp_path: Path
) -> None:
    hairy.visible_glossy = False
    kept = [getattr(hairy, f"visible_{ray}") for ray in hair_scene.RAYS]
    names = [set(each.keys()) for each in (bpy.data.scenes, bpy.data.node_groups)]
    cycles.hairloom.use_hair_scene = True
    seen = []

    def look(*_: Any) -> None:
        seen.append((hairy.visible_camera, hairy.visible_shadow))

    bpy.app.handlers.render_pre.append(look)
    try:
        rendered(tmp_path)
    finally:
        bpy.app.handlers.render_pre.remove(look)
    assert seen == [(False, False)]
    assert [getattr(hairy, f"visible_{ray}") for ray in hair_scene.RAYS] == kept
    cycles.hairloom.use_hair_scene = False
    assert [set(each.keys()) for each in (bpy.data.scenes, bpy.data.node_groups)] == names
    assert cycles.compositing_node_group is None


def test_an_artists_compositor_is_extended_and_given_back(
    cycles: Any, hairy: Any, tmp_path: Path
) -> None:
    tree = bpy.data.node_groups.new("Mine", "CompositorNodeTree")
    tree.interface.new_socket("Image", in_out="OUTPUT", socket_type="NodeSocketColor")
    layers, invert = (
        tree.nodes.new(kind) for kind in ("CompositorNodeRLayers", "CompositorNodeInvert")
    )
    output = tree.nodes.new("NodeGroupOutput")
    layers.scene = cycles
    tree.links.new(layers.outputs["Image"], invert.inputs["Color"])
    tree.links.new(invert.outputs["Color"], output.inputs[0])
    cycles.compositing_node_group = tree
    before = links_of(tree)
    plain = bald(hairy, tmp_path)
    cycles.hairloom.use_hair_scene = True
    assert hair_scene.problem_of(cycles) == ""
    inverted = rendered(tmp_path)
    cycles.hairloom.use_hair_scene = False
    assert links_of(tree) == before and cycles.compositing_node_group == tree
    # the world's 0.5 is unchanged by inversion, far from all hair; hair is inverted too
    np.testing.assert_array_equal(inverted[0, 0], plain[0, 0])
    assert differs(inverted, plain).mean() > 0.02


def test_scenes_that_have_a_compositor_in_common_keep_their_own_hair(
    cycles: Any, hairy: Any
) -> None:
    cycles.hairloom.use_hair_scene = True
    tree = cycles.compositing_node_group
    alone = links_of(tree)
    other = bpy.data.scenes.new("Other")
    other.compositing_node_group = tree
    tree.nodes.new("CompositorNodeRLayers").scene = other
    other.hairloom.use_hair_scene = True
    assert hair_scene.problem_of(other) == hair_scene.problem_of(cycles) == ""
    other.hairloom.use_hair_scene = False
    assert hair_scene.problem_of(cycles) == "" and links_of(tree) == alone


def test_hairlooms_own_engine_draws_hair_once(
    engine_scene: Any, sphere: Any, new_hair: Any, tmp_path: Path
) -> None:
    new_hair(sphere)
    alone = rendered(tmp_path)
    engine_scene.hairloom.use_hair_scene = True
    np.testing.assert_array_equal(rendered(tmp_path), alone)


@pytest.mark.slow(instead="test_an_artists_compositor_is_extended_and_given_back")
@pytest.mark.parametrize("wrong", few_in_commits(["compositing", "muted", "unlinked", "gone"], 2))
def test_blender_draws_hair_that_cannot_be_composited(
    cycles: Any, hairy: Any, tmp_path: Path, wrong: str, capsys: Any
) -> None:
    native = rendered(tmp_path)
    cycles.hairloom.use_hair_scene = True
    tree, hair = cycles.compositing_node_group, hair_scene.hair_scene_of(cycles)
    if wrong == "compositing":
        cycles.render.use_compositing = False
    if wrong == "muted":
        next(node for node in tree.nodes if node.bl_idname == "CompositorNodeGroup").mute = True
    if wrong == "unlinked":
        for node in [node for node in tree.nodes if getattr(node, "scene", None) == hair]:
            tree.nodes.remove(node)
    if wrong == "gone":
        bpy.data.scenes.remove(hair)
    problem = hair_scene.problem_of(cycles)
    assert problem and problem.endswith(".")
    np.testing.assert_array_equal(rendered(tmp_path), native)
    assert wrong == "gone" or problem in capsys.readouterr().out


def test_time_of_the_hair_is_stretched_as_that_of_its_scene(cycles: Any, tmp_path: Path) -> None:
    """With time remapping, the hair scene is at the same frame as Blender's own engine."""
    cycles.hairloom.use_hair_scene = True
    cycles.render.frame_map_old, cycles.render.frame_map_new = 100, 200
    cycles.frame_set(50)
    rendered(tmp_path)
    hair = hair_scene.hair_scene_of(cycles)
    assert hair.frame_current_final == cycles.frame_current_final == 25.0


@pytest.mark.slow
def test_cameras_that_change_in_an_animation_are_followed(
    cycles: Any, hairy: Any, tmp_path: Path
) -> None:
    other = bpy.data.objects.new("Other", cycles.camera.data)
    other.location = (1000.0, 0.0, 0.0)
    cycles.collection.objects.link(other)
    for frame, camera in ((1, cycles.camera), (2, other)):
        cycles.timeline_markers.new(camera.name, frame=frame).camera = camera
    cycles.hairloom.use_hair_scene = True
    cycles.frame_start, cycles.frame_end = 1, 2
    settings = cycles.render.image_settings
    settings.file_format, settings.color_depth = "OPEN_EXR", "32"
    cycles.render.filepath = str(tmp_path / "frame")
    bpy.ops.render.render(animation=True)
    shown = []
    for path in sorted(tmp_path.glob("frame*.exr")):
        pixels = pixels_of(path)
        shown.append(differs(pixels, np.full_like(pixels, 0.5), 0.001).any())
    assert shown == [True, False]


def test_files_that_were_saved_amid_a_render_are_healed(
    cycles: Any, hairy: Any, tmp_path: Path
) -> None:
    cycles.hairloom.use_hair_scene = True
    hair_scene.hide_hair(cycles)
    path = str(tmp_path / "amid.blend")
    handler = hair_scene.repair
    bpy.app.handlers.save_pre.remove(handler)  # autosaves do not call this handler
    try:
        bpy.ops.wm.save_as_mainfile(filepath=path, copy=True)
    finally:
        bpy.app.handlers.save_pre.append(handler)
    bpy.ops.wm.open_mainfile(filepath=path)
    hair = bpy.data.objects["Hair"]
    assert hair.visible_camera and hair.visible_shadow and not hair.hairloom.hidden_rays
    assert hair_scene.problem_of(bpy.context.scene) == ""


@pytest.mark.parametrize("setting", few_in_commits(["holdout", "indirect_only", "camera"]))
def test_holes_and_shadows_of_unseen_hair_are_those_of_cycles(
    setting: str, cycles: Any, hairy: Any, tmp_path: Path
) -> None:
    cycles.render.film_transparent = True
    if setting == "camera":
        hairy.visible_camera = False
    else:
        collection = bpy.data.collections.new("Hair")
        cycles.collection.children.link(collection)
        collection.objects.link(hairy)
        cycles.collection.objects.unlink(hairy)
        setattr(cycles.view_layers[0].layer_collection.children["Hair"], setting, True)
    expected = rendered(tmp_path)
    cycles.hairloom.use_hair_scene = True
    np.testing.assert_allclose(rendered(tmp_path), expected, atol=1e-4)
    assert differs(bald(hairy, tmp_path), expected).mean() > 0.02, "nothing was to be seen"


def test_undo_to_a_step_amid_a_render_hides_no_hair(cycles: Any, hairy: Any) -> None:
    cycles.hairloom.use_hair_scene = True
    hair_scene.hide_hair(cycles)
    bpy.ops.ed.undo_push(message="amid")
    hair_scene.show_hair()
    bpy.ops.ed.undo_push(message="after")
    bpy.ops.ed.undo()
    hair = bpy.data.objects["Hair"]
    assert hair.visible_camera and hair.visible_shadow and not hair.hairloom.hidden_rays


def test_a_hair_scene_goes_with_the_scene_whose_hair_it_draws(cycles: Any, tmp_path: Path) -> None:
    cycles.hairloom.use_hair_scene = True
    hair = cycles.hairloom.hair_scene.name
    bpy.data.scenes.new("Another")
    bpy.data.scenes.remove(cycles)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "saved.blend"))
    assert hair not in bpy.data.scenes


@pytest.mark.slow(instead="test_hair_covers_the_same_pixels_as_in_cycles_and_nothing_else_changes")
@pytest.mark.parametrize("is_baked", few_in_commits([True, False]))
def test_moving_hair_is_blurred_and_baked_as_by_our_own_engine(
    cycles: Any, hairy: Any, sphere: Any, tmp_path: Path, is_baked: bool
) -> None:
    """Without its head, hair has the same alpha as in our own engine, in every sample."""
    cycles.frame_start, cycles.frame_end = 1, 3
    key_x(sphere, {1: -0.1, 3: 0.1})
    cycles.frame_set(1)
    if is_baked:
        hairy.hairloom.dynamics.collider_resolution = 8
        hairy.hairloom.bake.folder = str(tmp_path / "bake")
        assert bpy.ops.hairloom.bake() == {"FINISHED"}
    sphere.hide_render = True
    cycles.render.film_transparent = cycles.render.use_motion_blur = True
    cycles.hairloom.picture.motion_steps = 4
    cycles.hairloom.use_hair_scene = True
    cycles.frame_set(2)
    over = rendered(tmp_path)
    cycles.render.engine = "HAIRLOOM"
    own = rendered(tmp_path)
    assert (own[..., 3] > 0.5).mean() > 0.05
    np.testing.assert_allclose(over[..., 3], own[..., 3], atol=1e-5)


@pytest.mark.slow
def test_a_border_that_is_rendered_alone_has_its_hair(
    cycles: Any, hairy: Any, tmp_path: Path
) -> None:
    cycles.hairloom.use_hair_scene = True
    whole = rendered(tmp_path)
    render = cycles.render
    render.use_border = render.use_crop_to_border = True
    render.border_min_x, render.border_max_x = 0.25, 0.75
    render.border_min_y, render.border_max_y = 0.5, 1.0
    part = rendered(tmp_path)
    quarter = SIZE // 4
    np.testing.assert_allclose(part, whole[2 * quarter :, quarter : 3 * quarter], atol=0.02)


@pytest.fixture
def window(cycles: Any) -> Any:
    """A bright pane behind the hair, off-centre, in a dim world."""
    set_world((0.05, 0.05, 0.05))
    bpy.ops.mesh.primitive_plane_add(
        size=0.5, location=(0.1, 0.4, 0.1), rotation=(np.pi / 2.0, 0.0, 0.0)
    )
    pane = bpy.context.object
    material = bpy.data.materials.new("Pane")
    material.node_tree.nodes.clear()
    shining = material.node_tree.nodes.new("ShaderNodeEmission")
    shining.inputs["Strength"].default_value = 4.0
    output = material.node_tree.nodes.new("ShaderNodeOutputMaterial")
    material.node_tree.links.new(shining.outputs[0], output.inputs["Surface"])
    pane.data.materials.append(material)
    return pane


def with_bright_shafts(hair: Any) -> ShaftSettings:
    shafts = hair.data.hairloom.shafts
    shafts.use_shafts, shafts.source = True, "bright"
    return settings_of(shafts, ShaftSettings)


@pytest.mark.parametrize("engine", few_in_commits(["HAIRLOOM", "CYCLES"]))
def test_a_window_throws_the_shafts_of_the_reference_cut_by_the_hair(
    cycles: Any, hairy: Any, window: Any, tmp_path: Path, engine: str
) -> None:
    """Shafts are computed per jittered sample; the reference uses the mean of the samples as the
    picture without shafts."""
    cycles.hairloom.use_hair_scene = True
    cycles.render.engine = engine
    without = rendered(tmp_path)
    settings = with_bright_shafts(hairy)
    found = rendered(tmp_path)
    projection = np.array(
        cycles.camera.calc_matrix_camera(
            bpy.context.evaluated_depsgraph_get(), x=SIZE, y=SIZE, scale_x=1.0, scale_y=1.0
        )
    )
    length = shaft_length(projection, SIZE, settings.length)
    expected = bright_shafts(without, without, length, settings)[0]
    added = (expected - without)[..., :3]
    assert 0.1 < added.max() < 1.0
    assert np.abs(found - expected)[..., :3].mean() < 0.02 * added.mean()
    assert np.abs(found - expected)[..., :3].max() < 0.05


@pytest.mark.slow(instead="test_a_lamp_throws_shafts_over_cycles_and_a_mesh_cuts_them")
def test_a_bright_place_of_the_world_throws_shafts_once(
    cycles: Any, hairy: Any, tmp_path: Path
) -> None:
    """A bright place is also a light, which only counts if a transparent film hides the world."""
    cycles.hairloom.use_hair_scene = True
    _set_spot(cycles)
    shafts = hairy.data.hairloom.shafts

    def added(*sources: str) -> list[np.ndarray]:
        shafts.use_shafts, found = False, []
        without = rendered(tmp_path)
        for source in sources:
            shafts.use_shafts, shafts.source = True, source
            found.append((rendered(tmp_path) - without)[..., :3])
        return found

    of_bright, of_both, of_lights = added("bright", "both", "lights")
    assert of_bright.max() > 0.1 < of_lights.max()
    np.testing.assert_allclose(of_both, of_bright, atol=1e-4)
    cycles.render.film_transparent = True
    (hidden,) = added("both")
    assert np.abs(hidden - of_lights).mean() < 0.1 * of_lights.mean()


def _set_spot(scene: Any) -> None:
    """A grey world with a small bright spot beside the ball, as seen from the camera."""
    directions, _ = panorama_directions(64, 128)
    is_spot = directions @ np.array([0.34, 0.94, 0.0]) > np.cos(np.radians(2.5))
    set_panorama(scene, np.where(is_spot, 400.0, 0.05)[..., None] * np.ones(3))


@pytest.mark.slow(instead="test_the_scene_is_as_it_was_after_the_render_and_after_turning_off")
def test_shafts_over_cycles_leave_its_file_format_and_all_else_as_it_was(
    cycles: Any, hairy: Any, window: Any, tmp_path: Path
) -> None:
    cycles.hairloom.use_hair_scene = True
    with_bright_shafts(hairy)
    settings = cycles.render.image_settings
    settings.file_format, settings.color_mode, settings.quality = "JPEG", "BW", 71
    names = sorted(each.name for each in bpy.data.images)
    cycles.render.filepath = str(tmp_path / "picture.jpg")
    bpy.ops.render.render(write_still=True)
    kept = settings.file_format, settings.color_mode, settings.quality, settings.media_type
    assert kept == ("JPEG", "BW", 71, "IMAGE")
    assert sorted({*(each.name for each in bpy.data.images)} - {"Render Result"}) == [
        name for name in names if name != "Render Result"
    ]
    assert (tmp_path / "picture.jpg").read_bytes()[:2] == b"\xff\xd8"


def test_a_lamp_throws_shafts_over_cycles_and_a_mesh_cuts_them(
    cycles: Any, hairy: Any, tmp_path: Path
) -> None:
    """A lamp beside the ball of hair, and a small cube above it, nearer to the camera."""
    set_world((0.0, 0.0, 0.0))
    cycles.camera.location.y = -1.0
    bpy.ops.object.light_add(type="POINT", location=(0.4, 0.5, 0.0))
    bpy.context.object.data.energy = 200.0
    bpy.ops.mesh.primitive_cube_add(size=0.04, location=(0.3467, 0.3, 0.07))
    hairy.data.hairloom.volume.shadows = "none"
    cycles.hairloom.use_hair_scene = True
    without = rendered(tmp_path)
    hairy.data.hairloom.shafts.use_shafts = True
    haze = (rendered(tmp_path) - without)[..., 0]
    middle, lamp = SIZE // 2, int(haze[SIZE // 2].argmax())
    assert haze.min() > -1e-4 and haze[middle, lamp] > 0.2
    assert haze[middle + 22, lamp] < 0.85 * haze[middle - 22, lamp]
    # behind the hair's edge, light falls off faster than in the open
    assert haze[middle, lamp - 40] < 0.5 * haze[middle - 40, lamp]


@pytest.mark.slow(instead="test_a_window_throws_the_shafts_of_the_reference_cut_by_the_hair")
@pytest.mark.parametrize("is_cropped", few_in_commits([True, False]))
def test_a_render_region_has_the_shafts_of_what_it_shows(
    cycles: Any, hairy: Any, window: Any, tmp_path: Path, is_cropped: bool
) -> None:
    render = cycles.render
    render.use_border, render.use_crop_to_border = True, is_cropped
    render.border_min_x, render.border_max_x = 0.25, 0.9
    render.border_min_y, render.border_max_y = 0.3, 1.0
    cycles.hairloom.use_hair_scene = True
    without = rendered(tmp_path)
    with_bright_shafts(hairy)
    added = (rendered(tmp_path) - without)[..., :3]
    part = added if is_cropped else added[36:120, 30:108]
    assert part.max() > 0.1 and np.isfinite(part).all()
    assert is_cropped or not added[:34].any()


@pytest.mark.slow(instead="test_a_lamp_throws_shafts_over_cycles_and_a_mesh_cuts_them")
@pytest.mark.parametrize("engine", few_in_commits(["CYCLES", "HAIRLOOM"]))
def test_an_orthographic_camera_sees_shafts_of_bright_things(
    cycles: Any, hairy: Any, window: Any, tmp_path: Path, engine: str
) -> None:
    cycles.camera.data.type, cycles.camera.data.ortho_scale = "ORTHO", 1.0
    cycles.hairloom.use_hair_scene, cycles.render.engine = True, engine
    without = rendered(tmp_path)
    with_bright_shafts(hairy)
    added = (rendered(tmp_path) - without)[..., 0]
    assert added.min() > -1e-3 and added.max() > 0.1


@pytest.mark.parametrize("light", few_in_commits([1e6, 1.0]))
def test_a_white_world_over_cycles_stays_as_it_is(
    cycles: Any, hairy: Any, tmp_path: Path, light: float
) -> None:
    """The hair is small, so nearly all of the picture is bright."""
    set_world((light, light, light))
    cycles.camera.location.y = -4.0
    cycles.hairloom.use_hair_scene = True
    without = rendered(tmp_path)
    with_bright_shafts(hairy)
    found = rendered(tmp_path)
    hair = without[..., 0] < 0.5 * light
    assert hair.any() and np.isfinite(found).all()
    assert np.abs(found - without)[hair].max() < 0.3


@pytest.mark.slow(instead="test_a_window_throws_the_shafts_of_the_reference_cut_by_the_hair")
def test_shafts_lie_over_a_transparent_film_as_light_without_alpha(
    cycles: Any, hairy: Any, window: Any, tmp_path: Path
) -> None:
    cycles.render.film_transparent = True
    cycles.hairloom.use_hair_scene = True
    without = rendered(tmp_path)
    with_bright_shafts(hairy)
    found = rendered(tmp_path)
    np.testing.assert_array_equal(found[..., 3], without[..., 3])
    is_free = without[..., 3] == 0.0
    assert found[..., :3][is_free].max() > 0.1


@pytest.mark.parametrize(
    "kind",
    [("IMAGE", "PNG"), ("IMAGE", "TIFF"), ("MULTI_LAYER_IMAGE", "OPEN_EXR_MULTILAYER")]
    + [("VIDEO", "FFMPEG")],
)
def test_a_file_format_comes_back_after_the_picture_was_read(
    cycles: Any, kind: tuple[str, str]
) -> None:
    settings, video = cycles.render.image_settings, cycles.render.ffmpeg
    settings.media_type, settings.file_format = kind
    if kind[0] == "IMAGE":
        settings.color_mode, settings.color_depth, settings.compression = "RGB", "16", 33

    def state() -> list[Any]:
        return [
            getattr(of, each.identifier)
            for of in (settings, video)
            for each in of.bl_rna.properties
            if each.type in ("ENUM", "INT", "BOOLEAN")
        ]

    before = state()
    with engine_picture._float_format(settings):
        assert settings.file_format == "OPEN_EXR" and settings.color_depth == "32"
    assert state() == before
