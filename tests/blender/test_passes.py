"""The passes of a render, compared with Cycles and with Blender's own readers."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tiers import few_in_commits

bpy = pytest.importorskip("bpy", reason="these tests need Blender or the bpy module")

import OpenImageIO  # noqa: E402
from engine_stage import SIZE, read_passes, render_passes, set_world  # noqa: E402

from hairloom.addon.blender.engine import hair_scene  # noqa: E402
from hairloom.addon.render.cryptomatte import matte_id  # noqa: E402
from hairloom.addon.render.scene_pass import ScenePass  # noqa: E402
from hairloom.addon.strands import StrandSet  # noqa: E402

pytestmark = [pytest.mark.draws(light=False), pytest.mark.usefixtures("gpu_context", "extension")]

COUNT, POINTS, RADIUS = 40, 6, 0.008
OWN = ("use_alpha", "use_tangent", "use_shadow", "use_strand_index")
BLENDERS = tuple(
    f"use_pass_{name}" for name in ("z", "normal", "vector", "object_index", "cryptomatte_object")
)


@pytest.fixture
def thick(engine_scene: Any, sphere: Any, new_hair: Callable[..., Any]) -> Any:
    """Thick opaque curves on a ball, with the same radius at tips and roots."""
    outward = np.random.default_rng(1).normal(size=(COUNT, 1, 3))
    outward /= np.linalg.norm(outward, axis=2, keepdims=True)
    along = np.linspace(0.0, 1.0, POINTS)[None, :, None]
    points = outward * (0.1 + 0.15 * along) - (0.0, 0.0, 0.06) * along**2
    offsets, radius = np.arange(COUNT + 1) * POINTS, np.full(COUNT * POINTS, RADIUS)
    hair = new_hair(sphere, StrandSet(points.reshape(-1, 3), offsets, radius, np.zeros(COUNT)))
    strands = hair.data.hairloom.strands
    strands.tip_width = strands.opacity = hair.data.hairloom.detail.min_density = 1.0
    return hair


def asks_for(layer: Any, *names: str) -> None:
    for name in names:
        setattr(layer.hairloom if name in OWN else layer, name, True)


def of_cycles(engine_scene: Any, folder: Path) -> dict[str, np.ndarray]:
    """Cycles' passes of the same scene, sampled at pixel centres."""
    engine_scene.render.engine = "CYCLES"
    (
        engine_scene.cycles.samples,
        engine_scene.cycles.use_denoising,
        engine_scene.cycles.max_bounces,
    ) = 1, False, 0
    engine_scene.cycles.use_adaptive_sampling, engine_scene.cycles.pixel_filter_type = False, "BOX"
    engine_scene.cycles.filter_width = 0.01
    found = render_passes(folder)
    engine_scene.render.engine = "HAIRLOOM"
    return found


def matte_of(engine_scene: Any, scene: Any, name: str, folder: Path) -> np.ndarray:
    """The matte of a name by Blender's own Cryptomatte node, in a render of the stage."""
    tree = engine_scene.compositing_node_group or bpy.data.node_groups.new(
        "Matte", "CompositorNodeTree"
    )
    if not len(tree.interface.items_tree):
        tree.interface.new_socket("Image", in_out="OUTPUT", socket_type="NodeSocketColor")
        tree.nodes.new("NodeGroupOutput")
    engine_scene.compositing_node_group = tree
    output = next(node for node in tree.nodes if node.bl_idname == "NodeGroupOutput")
    picker = tree.nodes.new("CompositorNodeCryptomatteV2")
    picker.scene, picker.matte_id = scene, name
    tree.links.new(picker.outputs["Matte"], output.inputs[0])
    settings = engine_scene.render.image_settings
    if hasattr(settings, "media_type"):
        settings.media_type = "IMAGE"
    settings.file_format, settings.color_depth, settings.color_mode = "OPEN_EXR", "32", "RGB"
    engine_scene.render.filepath = str(folder / "matte.exr")
    bpy.ops.render.render(write_still=True)
    file = OpenImageIO.ImageInput.open(engine_scene.render.filepath)
    pixels = file.read_image("float")[::-1, :, 0].copy()
    file.close()
    return pixels


def noted(path: Path) -> dict[str, str]:
    """The Cryptomatte metadata of a file."""
    file = OpenImageIO.ImageInput.open(str(path))
    found = {each.name: each.value for each in file.spec().extra_attribs if "crypto" in each.name}
    file.close()
    return found


def pass_of(found: dict[str, np.ndarray], name: str) -> np.ndarray:
    return np.squeeze(found[f"ViewLayer.{name}"])


@pytest.mark.parametrize("lens", few_in_commits(["PERSP", "ORTHO"]))
def test_depth_motion_and_normals_are_those_of_cycles(
    engine_scene: Any, sphere: Any, thick: Any, tmp_path: Path, lens: str
) -> None:
    """Hair moves with its head while the camera turns."""
    engine_scene.camera.data.type, engine_scene.camera.data.ortho_scale = lens, 0.6
    asks_for(engine_scene.view_layers[0], *BLENDERS[:4])
    thick.pass_index, sphere.pass_index = 7, 3
    bpy.ops.object.shade_smooth()
    for frame, place in ((1, (0.0, 0.0, 0.0)), (2, (0.03, 0.0, 0.02)), (3, (0.1, -0.05, 0.02))):
        sphere.location, engine_scene.camera.rotation_euler.z = place, 0.05 * frame**2
        sphere.keyframe_insert("location", frame=frame)
        engine_scene.camera.keyframe_insert("rotation_euler", frame=frame)
    engine_scene.frame_set(2)
    ours, theirs = render_passes(tmp_path), of_cycles(engine_scene, tmp_path)
    numbers = [pass_of(found, "Object Index") for found in (ours, theirs)]
    assert {0.0, 3.0, 7.0} == set(np.unique(numbers[0])) == set(np.unique(numbers[1]))
    assert (numbers[0] == numbers[1]).mean() > 0.98
    depths = [pass_of(found, "Depth") for found in (ours, theirs)]
    # at other pixels, along edges, another strand is nearest
    same = (numbers[0] == numbers[1]) & (numbers[0] > 0.0) & (np.abs(depths[0] - depths[1]) < 0.02)
    assert same.sum() > 0.97 * (numbers[1] > 0.0).sum()
    # Cycles hits the surface of a round strand; ours are flat ribbons
    differs = np.abs(depths[0] - depths[1])
    assert differs[same].max() < 2.0 * RADIUS and np.median(differs[same]) < 1.0e-3
    vectors = [pass_of(found, "Vector") for found in (ours, theirs)]
    assert np.abs(vectors[1][same]).max() > 5.0
    differs = np.abs(vectors[0] - vectors[1])[same]
    assert np.median(differs) < 0.01 and differs.max() < 0.6
    normals = [pass_of(found, "Normal") for found in (ours, theirs)]
    on_head = same & (numbers[0] == 3.0)
    assert np.abs(normals[0] - normals[1])[on_head].max() < 0.02
    on_hair = same & (numbers[0] == 7.0)
    # a flat ribbon has the normal that a round strand has on average over its width
    assert (normals[0] * normals[1]).sum(axis=2)[on_hair].mean() > 0.75
    # the background, which only the camera moves
    if lens == "PERSP":
        sky = vectors[0][0, 0]
        focal = SIZE * engine_scene.camera.data.lens / engine_scene.camera.data.sensor_width
        place = np.arctan(0.5 * (1.0 - SIZE) / focal)
        for pair, turn in ((slice(0, 1), 0.15), (slice(2, 3), 0.25)):
            assert sky[pair] == pytest.approx(-focal * turn, rel=0.35), place


def test_blenders_cryptomatte_node_selects_what_hair_covers(
    engine_scene: Any, sphere: Any, new_hair: Any, tmp_path: Path
) -> None:
    """The matte of thin strands, in front of the head and beside it, equals their alpha."""
    hair = new_hair(sphere)
    hair.data.hairloom.strands.fullness = 8.0
    asks_for(engine_scene.view_layers[0], "use_pass_cryptomatte_object", *OWN)
    found = render_passes(tmp_path)
    alpha = pass_of(found, "Hair Alpha")
    assert 0.02 < (alpha > 0.0).mean() < 0.6 and alpha.max() < 0.999
    metadata = noted(tmp_path / "picture.exr")
    (manifest,) = (value for key, value in metadata.items() if key.endswith("manifest"))
    assert set(json.loads(manifest)) == {"Hair", "Head"}
    matte = matte_of(engine_scene, engine_scene, "Hair", tmp_path)
    np.testing.assert_allclose(matte, alpha, atol=1e-6)
    head = matte_of(engine_scene, engine_scene, "Head", tmp_path)
    inside = head + matte > 0.999
    assert inside.mean() > 0.03 and (head[inside] < 0.999).any()
    engine_scene.render.film_transparent, engine_scene.compositing_node_group = True, None
    whole = pass_of(render_passes(tmp_path), "Combined")[..., 3]
    np.testing.assert_allclose(head + matte, whole, atol=1e-5)
    engine_scene.view_layers[0].use_pass_cryptomatte_object = False
    np.testing.assert_array_equal(pass_of(render_passes(tmp_path), "Hair Alpha"), alpha)
    assert not noted(tmp_path / "picture.exr")


@pytest.mark.slow(instead="test_blenders_cryptomatte_node_selects_what_hair_covers")
def test_names_and_coverages_are_those_of_cycles(
    engine_scene: Any, sphere: Any, thick: Any, tmp_path: Path
) -> None:
    asks_for(engine_scene.view_layers[0], "use_pass_cryptomatte_object")
    engine_scene.hairloom.picture.samples = 8
    mattes = {"HAIRLOOM": {}, "CYCLES": {}}
    manifests = {}
    (
        engine_scene.cycles.samples,
        engine_scene.cycles.use_denoising,
        engine_scene.cycles.max_bounces,
    ) = 32, False, 0
    for engine, found in mattes.items():
        engine_scene.render.engine, engine_scene.compositing_node_group = engine, None
        render_passes(tmp_path)
        metadata = noted(tmp_path / "picture.exr")
        (place,) = {key.split("/")[1] for key in metadata}
        manifests[engine] = (place, json.loads(metadata[f"cryptomatte/{place}/manifest"]))
        for name in ("Hair", "Head"):
            found[name] = matte_of(engine_scene, engine_scene, name, tmp_path)
    assert manifests["HAIRLOOM"][0] == manifests["CYCLES"][0]
    assert manifests["HAIRLOOM"][1].items() <= manifests["CYCLES"][1].items()
    for name in ("Hair", "Head"):
        ours, theirs = (found[name] for found in mattes.values())
        assert abs(ours.mean() - theirs.mean()) < 0.005 and theirs.mean() > 0.02
        assert np.abs(ours - theirs).mean() < 0.02


@pytest.mark.slow(instead="test_a_region_two_grooms_and_two_layers")
def test_over_cycles_passes_are_of_hair_alone_and_follow_the_view_layer(
    engine_scene: Any, sphere: Any, thick: Any, tmp_path: Path
) -> None:
    asks_for(engine_scene.view_layers[0], *BLENDERS, *OWN)
    thick.pass_index, sphere.pass_index = 7, 3
    own = render_passes(tmp_path)
    engine_scene.render.engine, engine_scene.cycles.samples = "CYCLES", 1
    engine_scene.hairloom.use_hair_scene = True
    hair = hair_scene.hair_scene_of(engine_scene)
    alpha = matte_of(engine_scene, hair, "Hair", tmp_path)
    np.testing.assert_allclose(alpha, pass_of(own, "Hair Alpha"), atol=1e-6)
    over = layers_of(engine_scene, hair, tmp_path)
    numbers = pass_of(own, "Object Index")
    is_hair = numbers == 7.0
    np.testing.assert_array_equal(over["Object Index"], np.where(is_hair, 7.0, 0.0))
    for name in ("Depth", "Strand Index", "Vector", "Normal", "Hair Tangent"):
        mine, theirs = pass_of(own, name), over[name]
        if name == "Vector":  # a File Output node writes only three of its channels
            mine = mine[..., :3]
        np.testing.assert_allclose(theirs[is_hair], mine[is_hair], atol=1e-6, err_msg=name)
    assert (over["Depth"][~is_hair] == np.float32(1.0e10)).all()
    layer = engine_scene.view_layers[0]
    layer.use_pass_vector = layer.hairloom.use_tangent = False
    bpy.context.view_layer.update()
    theirs = hair.view_layers[0]
    assert not theirs.use_pass_vector and not theirs.hairloom.use_tangent
    assert theirs.use_pass_z and theirs.hairloom.use_alpha


def layers_of(engine_scene: Any, scene: Any, folder: Path) -> dict[str, np.ndarray]:
    """All outputs of a Render Layers node in a render of the stage, read from a file."""
    tree = engine_scene.compositing_node_group
    layers = next(node for node in tree.nodes if getattr(node, "scene", None) == scene)
    out = tree.nodes.new("CompositorNodeOutputFile")
    out.directory, out.file_name = str(folder), "layers"
    out.format.media_type, out.format.file_format = "MULTI_LAYER_IMAGE", "OPEN_EXR_MULTILAYER"
    out.format.color_depth = "32"
    for socket in layers.outputs:
        if socket.enabled:
            kind = "FLOAT" if socket.type == "VALUE" else socket.type
            out.file_output_items.new(kind, socket.name)
            tree.links.new(socket, out.inputs[socket.name])
    bpy.ops.render.render()
    (path,) = folder.glob("layers*.exr")
    return {name.rpartition(".")[2]: np.squeeze(each) for name, each in read_passes(path).items()}


def test_without_passes_nothing_is_drawn_for_them(
    engine_scene: Any, sphere: Any, new_hair: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    new_hair(sphere)
    engine_scene.view_layers[0].use_pass_z = False
    plain = render_passes(tmp_path)
    assert set(plain) == {"ViewLayer.Combined"}
    asks_for(engine_scene.view_layers[0], *BLENDERS, *OWN)
    found = render_passes(tmp_path)
    assert len(found) == 1 + 4 + 3 + 4
    np.testing.assert_array_equal(found["ViewLayer.Combined"], plain["ViewLayer.Combined"])
    for name in ("nearest", "tangents", "coverages", "on_meshes"):
        monkeypatch.setattr(ScenePass, name, None)
    for name in BLENDERS:
        setattr(engine_scene.view_layers[0], name, False)
    for name in OWN:
        setattr(engine_scene.view_layers[0].hairloom, name, False)
    assert set(render_passes(tmp_path)) == {"ViewLayer.Combined"}


def test_a_region_two_grooms_and_two_layers(
    engine_scene: Any, thick: Any, new_hair: Any, tmp_path: Path
) -> None:
    """Each layer has its own passes; those of a region equal a part of the whole."""
    other = new_hair()
    other.name, other.location.x = "Other", 0.1
    other.data.hairloom.strands.fullness = 20.0
    asks_for(engine_scene.view_layers[0], *BLENDERS, *OWN)
    second = engine_scene.view_layers.new("Second")
    second.use_pass_z = False
    asks_for(second, "use_strand_index")
    whole = render_passes(tmp_path)
    names = {name for name in whole if name.startswith("Second")}
    assert names == {"Second.Combined", "Second.Strand Index"}
    np.testing.assert_array_equal(whole["Second.Strand Index"], whole["ViewLayer.Strand Index"])
    ids = np.concatenate([whole[f"ViewLayer.CryptoObject0{rank}"][..., ::2] for rank in range(3)])
    assert {matte_id(name) for name in ("Hair", "Other", "Head")} <= set(np.unique(ids))
    render = engine_scene.render
    render.use_border = render.use_crop_to_border = True
    render.border_min_x, render.border_max_x = 0.25, 0.75
    render.border_min_y, render.border_max_y = 0.5, 1.0
    part = render_passes(tmp_path)
    for name in ("Object Index", "Strand Index", "CryptoObject00", "Depth"):
        cut = whole[f"ViewLayer.{name}"][SIZE // 2 :, SIZE // 4 : 3 * SIZE // 4]
        assert np.isclose(part[f"ViewLayer.{name}"], cut, atol=0.01).mean() > 0.99, name


@pytest.mark.slow(instead="test_a_region_two_grooms_and_two_layers")
def test_one_pixel_and_both_eyes(
    engine_scene: Any, sphere: Any, thick: Any, tmp_path: Path
) -> None:
    asks_for(engine_scene.view_layers[0], *BLENDERS, *OWN)
    engine_scene.render.resolution_x = engine_scene.render.resolution_y = 4
    engine_scene.render.resolution_percentage = 25
    assert all(np.isfinite(each).all() for each in render_passes(tmp_path).values())
    engine_scene.render.resolution_x = engine_scene.render.resolution_y = SIZE
    engine_scene.render.resolution_percentage = 100
    engine_scene.render.use_multiview = True
    engine_scene.camera.data.stereo.interocular_distance = 0.1
    render_passes(tmp_path)
    eyes = [read_passes(tmp_path / f"picture_{side}.exr") for side in "LR"]
    for name in ("Strand Index", "Hair Alpha", "Depth"):
        one, other = (pass_of(found, name) for found in eyes)
        assert (one != other).any() and one.any()


def test_the_shadow_pass_is_the_light_that_hair_removes(
    engine_scene: Any, thick: Any, tmp_path: Path
) -> None:
    """With a single sun, the pass times the picture without hair shadow gives the picture."""
    set_world((0.0, 0.0, 0.0))
    bpy.ops.object.light_add(type="SUN", rotation=(0.5, 0.0, 0.0))
    asks_for(engine_scene.view_layers[0], "use_pass_object_index", "use_shadow")
    thick.pass_index = 7
    shaded = render_passes(tmp_path)
    thick.data.hairloom.volume.shadows = "none"
    bare = render_passes(tmp_path)
    factor = shaded["ViewLayer.Hair Shadow"]
    is_head = (pass_of(shaded, "Object Index") == 0.0) & (pass_of(bare, "Combined")[..., 0] > 0.05)
    taken = (factor < 0.97).any(axis=2) & is_head
    assert taken.sum() > 8 and (bare["ViewLayer.Hair Shadow"] == 1.0).all()
    light = np.maximum(bare["ViewLayer.Combined"][..., :3], 1e-6)
    ratio = shaded["ViewLayer.Combined"][..., :3] / light
    assert np.abs(ratio - factor)[taken].mean() < 0.05


def test_baked_hair_moves_as_its_copy_does(
    engine_scene: Any, sphere: Any, thick: Any, tmp_path: Path
) -> None:
    """Simulated hair lags behind its head. Vectors at a strand's pixels are within the range of its
    points' motion, projected by Blender."""
    from bpy_extras.object_utils import world_to_camera_view
    from mathutils import Vector

    engine_scene.frame_start, engine_scene.frame_end = 1, 3
    asks_for(engine_scene.view_layers[0], "use_pass_vector", "use_strand_index")
    for frame in (1, 2, 3):
        sphere.location = (0.03 * frame, 0.0, 0.0)
        sphere.keyframe_insert("location", frame=frame)
    thick.hairloom.dynamics.collider_resolution = 8
    thick.hairloom.bake.folder = str(tmp_path / "bake")
    assert bpy.ops.hairloom.bake() == {"FINISHED"}
    copy, seen = thick.hairloom.bake.copy, []
    for frame in (1, 2, 3):
        engine_scene.frame_set(frame)
        evaluated = copy.evaluated_get(bpy.context.evaluated_depsgraph_get())
        points = np.empty(len(evaluated.data.points) * 3, np.float32)
        evaluated.data.position_data.foreach_get("vector", points)
        places = [
            world_to_camera_view(
                engine_scene, engine_scene.camera, evaluated.matrix_world @ Vector(point)
            )[:2]
            for point in points.reshape(-1, 3)
        ]
        seen.append(SIZE * np.array(places).reshape(COUNT, -1, 2))
    moves = np.concatenate([seen[0] - seen[1], seen[1] - seen[2]], axis=2)
    assert np.abs(moves).max() > 1.0 and moves.std(axis=(0, 1)).max() > 0.2
    engine_scene.frame_set(2)
    found = render_passes(tmp_path)
    strand = pass_of(found, "Strand Index").astype(int) - 1
    vectors, own = pass_of(found, "Vector")[strand >= 0], moves[strand[strand >= 0]]
    assert len(vectors) > 200
    assert (vectors > own.min(axis=1) - 0.1).all() and (vectors < own.max(axis=1) + 0.1).all()
