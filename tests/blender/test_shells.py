"""Shells, compared with the strands that they represent, and as files in other readers."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from card_exports import export_cards, read_sidecar
from glb_files import validator_report
from tiers import few_in_commits

bpy = pytest.importorskip("bpy", reason="exporters need Blender or the bpy module")

from hairloom.addon import rig_flow  # noqa: E402
from hairloom.addon.blender.cards.build import BuiltCards, CardInputs  # noqa: E402
from hairloom.addon.blender.cards.made_objects import card_objects  # noqa: E402
from hairloom.addon.blender.cards.show import without_strands  # noqa: E402
from hairloom.addon.blender.sessions.prepared_groom import PreparedGroom  # noqa: E402
from hairloom.addon.blender.sessions.snapshots import snapshot_of  # noqa: E402
from hairloom.addon.cards.settings import CardSettings  # noqa: E402
from hairloom.addon.groom.settings import GuideSettings  # noqa: E402
from hairloom.addon.params import SettingsMap  # noqa: E402
from hairloom.addon.render.camera import frame_camera  # noqa: E402
from hairloom.addon.render.frame import render_image  # noqa: E402
from hairloom.addon.render.snapshot import MeshSnapshot, Snapshot  # noqa: E402
from hairloom.addon.shading.ambient_settings import AmbientSettings  # noqa: E402
from hairloom.addon.shading.lights import Light  # noqa: E402
from hairloom.addon.shading.volume.settings import VolumeSettings  # noqa: E402
from hairloom.addon.strands import StrandSet, Surface  # noqa: E402

pytestmark = pytest.mark.usefixtures("extension")
SHORT = (
    *("--set", "grow.method=normals", "--set", "grow.strand_count=2000"),
    *("--set", "grow.length=0.012", "--set", "children.method=none"),
    *("--set", "cards.kind=shells", "--set", "cards.max_triangles=600"),
    *("--set", "cards.shell_layers=4", "--set", "atlas.size=256", "--set", "atlas.source=baked"),
)


#: bounds of the ball and its fur
BOUNDS = np.full(3, -0.112), np.full(3, 0.112)


def fur_on_ball(count: int = 8000, length: float = 0.012) -> tuple[StrandSet, Surface]:
    """Fur that is combed down, on a ball of radius 0.1 m."""
    bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=4, radius=0.1)
    mesh = bpy.context.object.data
    positions = np.array([vertex.co for vertex in mesh.vertices], np.float32)
    head = Surface(positions, np.array([polygon.vertices for polygon in mesh.polygons]))
    random = np.random.default_rng(5)
    out = random.normal(size=(count, 3))
    out /= np.linalg.norm(out, axis=1, keepdims=True)
    down = np.cross(out, np.cross([0.0, 0.3, -1.0], out))
    heading = 0.5 * out + down
    heading /= np.linalg.norm(heading, axis=1, keepdims=True)
    length_of = length * random.uniform(0.6, 1.0, count)
    along = np.linspace(0.0, 1.0, 8)[:, None]
    grid = 0.1 * out[:, None] + length_of[:, None, None] * heading[:, None] * along
    radius = np.full(count * 8, 1.5e-4)
    offsets, group = np.arange(count + 1) * 8, np.zeros(count, np.int32)
    return StrandSet(grid.reshape(-1, 3), offsets, radius, group), head


@pytest.fixture(scope="module")
def fur_and_shells() -> tuple[Snapshot, Snapshot]:
    """Fur and shells on the same ball, without occlusion and shadows."""
    strands, head = fur_on_ball()
    rig = rig_flow.prepare(strands, head, GuideSettings(guide_count=40), place="fur")
    settings = SettingsMap(CardSettings(kind="shells", levels=1, max_triangles=6000))
    made = BuiltCards.build(CardInputs(rig, settings))
    hole = replace(MeshSnapshot.of(head), is_holdout=True)
    hair = replace(
        snapshot_of(PreparedGroom(rig, AmbientSettings())),
        lights=(Light.sun((0.4, 0.6, -0.8), (1.0, 1.0, 1.0), 4.0),),
        volume=VolumeSettings(shadows="none"),
        meshes=(hole,),
    )
    hair = replace(hair, occlusion=np.ones(len(hair.points), np.float32))
    mesh = made.rest.mesh.with_occlusion(np.ones_like(made.rest.mesh.occlusion))
    shells = replace(made.rest, mesh=mesh)
    return hair, replace(without_strands(hair), cards=made.with_drawing_settings(shells, settings))


@pytest.mark.slow(
    instead="tests/pure/cards/test_shells.py::test_sparse_hair_covers_as_much_however_few_strands_a_pattern_has"
)
@pytest.mark.draws(light=False)
@pytest.mark.parametrize("eighth", range(8))
def test_shells_cover_as_much_as_strands_from_eight_sides_in_their_colour(
    gpu_context: Any, fur_and_shells: tuple[Snapshot, Snapshot], eighth: int
) -> None:
    """Coverage and mean colour are within 10 % of the strands', the limit for cards."""
    turn = 2.0 * np.pi * eighth / 8
    side = (np.sin(turn), -np.cos(turn), 0.3)
    camera = frame_camera(BOUNDS, side, 0.5, 1.0)
    one, other = (render_image(each, camera, 160, 160, 2) for each in fur_and_shells)
    covered = one[..., 3].sum(), other[..., 3].sum()
    assert covered[1] == pytest.approx(covered[0], rel=0.1)
    means = [p[..., :3].sum(axis=(0, 1)) / c for p, c in zip((one, other), covered, strict=True)]
    assert means[1] == pytest.approx(means[0], rel=0.1)


@pytest.mark.parametrize("suffix", few_in_commits([".glb", ".fbx"]))
def test_files_of_shells_are_read_by_blenders_importers(tmp_path: Path, suffix: str) -> None:
    file = tmp_path / f"fur{suffix}"
    assert export_cards(file, *SHORT, "--levels", "2") == 0
    levels = read_sidecar(file)["levels"]
    assert 450 <= levels[0]["triangles"] <= 600
    assert levels[1]["triangles"] <= 300
    if suffix == ".glb":
        issues = validator_report(file)["issues"]
        assert issues["numErrors"] == issues["numWarnings"] == 0, issues["messages"]
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    read = bpy.ops.import_scene.gltf if suffix == ".glb" else bpy.ops.wm.fbx_import
    assert read(filepath=str(file)) == {"FINISHED"}
    found = {obj.name: obj.data for obj in bpy.data.objects if obj.type == "MESH"}
    for level in levels:
        mesh = found[level["node"]]
        assert len(mesh.polygons) == level["triangles"]
        assert all(len(polygon.vertices) == 3 for polygon in mesh.polygons)
    # layers from the inside to the outside, with equal numbers of triangles
    layer = found[levels[0]["node"]].uv_layers[1]
    along = np.empty(len(layer.uv) * 2, np.float32)
    layer.uv.foreach_get("vector", along)
    by_layer = along.reshape(4, -1, 2)[..., 1]
    by_layer = 1.0 - by_layer if suffix == ".glb" else by_layer  # glTF counts v from the top
    assert by_layer == pytest.approx(np.repeat([[1], [3], [5], [7]], len(by_layer[0]), 1) / 8.0)


def test_long_hair_as_shells_is_refused(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    assert export_cards(tmp_path / "hair.glb", *SHORT, "--set", "grow.length=0.4") == 1
    assert "shells show hair up to" in capfd.readouterr().err
    assert not list(tmp_path.iterdir())


def test_shells_replace_cards_and_cards_replace_shells(
    new_hair: Callable[..., Any], sphere: Any
) -> None:
    hair = new_hair(sphere, fur_on_ball(300, 0.03)[0])
    settings = hair.data.hairloom
    settings.cards.card_count, settings.cards.levels, settings.cards.order_by = 12, 1, "distance"
    settings.atlas.size, settings.cards.max_triangles, settings.cards.shell_layers = "256", 600, 4
    for kind, layers in (("cards", 0), ("shells", 4), ("cards", 0)):
        settings.cards.kind = kind
        assert bpy.ops.hairloom.make_cards() == {"FINISHED"}
        (obj,) = card_objects(hair)
        assert obj.hairloom.card_object.shell_layers == layers
        assert 0 < len(obj.data.polygons) <= 600
    obj.data.vertices[0].co.x += 0.1
    settings.cards.kind = "shells"
    with pytest.raises(RuntimeError, match="its cards were edited"):
        bpy.ops.hairloom.make_cards()
