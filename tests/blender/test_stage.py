"""Pictures on a stage: the same at any scale, with Blender's view transforms, chosen by name."""

from __future__ import annotations

import argparse
import itertools
from dataclasses import replace
from pathlib import Path
from unittest.mock import MagicMock

import bpy
import numpy as np
import pytest

from hairloom.addon import rig_flow
from hairloom.addon.blender.base.images import read_texture
from hairloom.addon.blender.command_line import command_line, demo_job
from hairloom.addon.blender.pictures.film import write_picture
from hairloom.addon.blender.pictures.studio import Studio
from hairloom.addon.blender.properties.groom_settings import GroomSettings
from hairloom.addon.blender.properties.presets import named_preset, shipped_presets
from hairloom.addon.blender.scene.built_in_head import built_in_head
from hairloom.addon.blender.scene.surfaces import read_surface
from hairloom.addon.blender.sessions.prepared_groom import prepare_groom
from hairloom.addon.errors import HairloomError
from hairloom.addon.groom.children_settings import ChildrenSettings
from hairloom.addon.groom.face_hair import grow_with_face
from hairloom.addon.groom.settings import GrowSettings, GuideSettings
from hairloom.addon.params import SettingsMap
from hairloom.addon.render.snapshot import Snapshot
from hairloom.addon.shading.ambient_settings import AmbientSettings
from hairloom.addon.shading.settings import StrandSettings
from hairloom.addon.shading.stage_settings import StageSettings
from hairloom.addon.shading.volume.settings import VolumeSettings
from hairloom.addon.strands import StrandSet, Surface

SIZE = 72
STAGES = {"daylight", "dramatic", "plain", "studio"}


def half_a_head(surface: Surface) -> StrandSet:
    """Drooping strands on the upper half of a ball of radius 0.1 m, except the face."""
    outward = np.random.default_rng(7).normal(size=(1400, 3))
    outward /= np.linalg.norm(outward, axis=1, keepdims=True)
    outward = outward[(outward[:, 2] > 0.0) & (outward[:, 1] > -0.5)]
    along = np.linspace(0.0, 1.0, 10)[None, :, None]
    droop = np.array([0.0, 0.0, -0.05]) * along**2
    points = outward[:, None] * (0.1 + 0.05 * along) + droop
    count = len(outward)
    return StrandSet(
        points=points.reshape(-1, 3),
        offsets=np.arange(count + 1) * 10,
        radius=np.full(count * 10, 4.0e-4),
        group=np.zeros(count, int),
    )


def scaled(strands: StrandSet, head: Surface, scale: float) -> tuple[StrandSet, Surface]:
    return (
        replace(strands, points=strands.points * scale, radius=strands.radius * scale),
        replace(head, positions=head.positions * np.float32(scale)),
    )


def studio_of(
    strands: StrandSet, head: Surface, children: ChildrenSettings | None = None
) -> Studio:
    rig = rig_flow.prepare(
        strands, head, GuideSettings(), place="the test's hair", children=children
    )
    settings = SettingsMap(VolumeSettings(shadows="deep"), StrandSettings())
    return Studio(prepare_groom(rig, AmbientSettings()), GroomSettings(settings))


def still(studio: Studio, **options: bool) -> np.ndarray:
    rig = studio._rig
    return studio.picture(rig.rest_pose, rig.strands.points, SIZE, SIZE, 2, **options)


@pytest.fixture
def head(extension: None, sphere: bpy.types.Object) -> Surface:
    depsgraph = bpy.context.evaluated_depsgraph_get()
    return read_surface(sphere, depsgraph, need_uv=True, place="the test's head")


@pytest.mark.slow
@pytest.mark.draws
@pytest.mark.usefixtures("gpu_context")
def test_a_picture_is_the_same_at_any_size(head: Surface) -> None:
    """A picture is the same if hair and head are a thousand times smaller or larger."""
    strands = half_a_head(head)
    pictures = {
        scale: still(studio_of(*scaled(strands, head, scale)), is_transparent=True)
        for scale in (1.0, 1e-3, 1e3)
    }
    is_seen = pictures[1.0][..., 3] > 0.0
    assert 0.2 < is_seen.mean() < 0.8 and pictures[1.0][is_seen].std() > 0.05
    for scale in (1e-3, 1e3):
        away = np.abs(pictures[scale] - pictures[1.0])[is_seen]
        assert away.mean() < 0.005, f"at {scale:g}: {away.mean():.4f}"


def test_the_close_up_of_the_demo_is_lit_as_its_still(
    head: Surface, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """Its camera looks down from another side, and the lights stay."""
    studio = studio_of(half_a_head(head), head)
    lit_from: list[list[tuple[float, ...]]] = []

    def draw(_: Studio, snapshot: Snapshot, *arguments: object) -> np.ndarray:
        lit_from.append([tuple(light.vector) for light in snapshot.lights])
        return np.zeros((SIZE, SIZE, 4), np.float32)

    monkeypatch.setattr(Studio, "_draw", draw)
    job = MagicMock(options=argparse.Namespace(width=SIZE, height=SIZE, samples=1))
    still(studio)
    demo_job._write_close_up(job, tmp_path / "close_up.png", studio, studio._rig)
    assert len(lit_from[0]) == 3 and lit_from[1] == lit_from[0]


@pytest.mark.slow
def test_children_do_not_turn_the_camera(head: Surface) -> None:
    strands = half_a_head(head)
    own = studio_of(strands, head).side
    for seed in (1, 2):
        more = ChildrenSettings(method="multi", strand_count=3000, seed=seed)
        side = studio_of(strands, head, more).side
        assert np.array_equal(side.front, own.front)
        assert np.array_equal(side.three_quarter, own.three_quarter)


def test_the_stages_that_ship_are_four_and_the_studio_is_the_default() -> None:
    found = {
        entry.path.stem: named_preset(entry.name).settings for entry in shipped_presets("stage")
    }
    assert set(found) == STAGES
    assert found["studio"] == StageSettings()
    assert len(set(found.values())) == len(STAGES)


@pytest.mark.slow
@pytest.mark.draws
@pytest.mark.usefixtures("gpu_context", "extension")
def test_a_stage_is_chosen_by_its_name_and_changed_by_set(tmp_path: Path) -> None:
    """The picture's corner shows the backdrop's edge, as the view transform displays it."""

    def corner(*options: str) -> np.ndarray:
        path = tmp_path / "still.png"
        size = ["--width", "24", "--height", "24", "--samples", "1"]
        few = ["--set", "children.method=none", "--set", "grow.strand_count=200"]
        assert command_line.run(["render", "--output", str(path), *size, *few, *options]) == 0
        return read_texture(path, is_color=True)[0, 0, :3]

    plain = named_preset("stage/plain").settings
    np.testing.assert_allclose(corner("--stage", "plain"), plain.backdrop_edge, atol=0.006)
    red = [f"stage.backdrop_{place}=0.5,0.1,0.1" for place in ("edge", "center")]
    changed = corner("--stage", "plain", "--set", red[0], "--set", red[1])
    np.testing.assert_allclose(changed, [0.5, 0.1, 0.1], atol=0.01)


@pytest.mark.usefixtures("extension")
def test_an_unknown_stage_is_reported(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    arguments = ["render", "--stage", "moon", "--output", str(tmp_path / "still.png")]
    assert command_line.run(arguments) == 1
    output = capsys.readouterr().err
    assert "moon" in output and "stage/studio" in output


def shown(linear: np.ndarray, path: Path, **stage: object) -> np.ndarray:
    write_picture(path, linear.astype(np.float32), StageSettings(**stage))
    return read_texture(path, is_color=False)


@pytest.mark.usefixtures("extension")
def test_highlights_roll_off_on_film(tmp_path: Path) -> None:
    """Radiances of one, four and eight times white stay distinct; Standard clips them."""
    greys = np.repeat([0.18, 1.0, 4.0, 8.0], 16).reshape(1, 64, 1) * np.ones((8, 1, 3))
    linear = np.concatenate([greys, np.ones((8, 64, 1))], axis=2)
    codes = {
        view: shown(linear, tmp_path / "a.png", view=view)[..., 0].reshape(8, 4, 16).mean((0, 2))
        for view in ("agx", "agx_contrast", "filmic", "standard")
    }
    assert codes["standard"][1:] == pytest.approx([1.0, 1.0, 1.0])
    for view in ("agx", "agx_contrast", "filmic"):
        assert (np.diff(codes[view]) > 0.01).all() and codes[view][1] < 0.9
    brighter = shown(linear, tmp_path / "b.png", view="standard", exposure=1.0)
    doubled = linear * (2.0, 2.0, 2.0, 1.0)
    expected = shown(doubled, tmp_path / "c.png", view="standard")
    np.testing.assert_allclose(brighter, expected, atol=1.01 / 255.0)


@pytest.mark.usefixtures("extension")
def test_a_soft_gradient_has_no_bands(tmp_path: Path) -> None:
    """Dithering: a column's mean is the exact value, between the steps of 8 bits."""
    ramp = np.linspace(0.02, 0.024, 64)
    colors = np.ones((256, 1, 1)) * ramp[None, :, None] * np.ones(3)
    linear = np.concatenate([colors, np.ones((256, 64, 1))], axis=2)
    found = shown(linear, tmp_path / "a.png", view="standard")[..., 0]
    exact = 1.055 * ramp ** (1.0 / 2.4) - 0.055
    assert len(np.unique(found)) < 8
    assert np.abs(found.mean(axis=0) - exact).max() < 0.15 / 255.0
    again = shown(linear, tmp_path / "b.png", view="standard")[..., 0]
    np.testing.assert_array_equal(found, again)


@pytest.mark.usefixtures("extension")
def test_transparent_pixels_stay_transparent(tmp_path: Path) -> None:
    linear = np.zeros((4, 4, 4))
    linear[:2] = (0.2, 0.2, 0.2, 0.5)
    found = shown(linear, tmp_path / "a.png")
    assert (found[2:, :, 3] == 0.0).all()
    np.testing.assert_allclose(found[:2, :, 3], 0.5, atol=0.003)
    opaque = shown(np.full((4, 4, 4), (0.4, 0.4, 0.4, 1.0)), tmp_path / "b.png")
    np.testing.assert_allclose(found[:2, :, :3], opaque[:2, :, :3], atol=1.01 / 255.0)


@pytest.mark.usefixtures("extension")
def test_a_view_transform_that_blender_lacks_is_reported(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from hairloom.addon.blender.pictures import film

    monkeypatch.setitem(film._TRANSFORMS, "agx", ("Kodak", "None"))
    with pytest.raises(HairloomError, match=r"no view transform .Kodak"):
        shown(np.ones((4, 4, 4)), tmp_path / "a.png", view="agx")


@pytest.mark.usefixtures("gpu_context")
def test_skin_that_hair_sees_lights_it(head: Surface) -> None:
    """Compared with the same hair whose light treats the skin below as a plane."""
    rig = rig_flow.prepare(half_a_head(head), head, GuideSettings(), place="hair")
    groom = prepare_groom(rig, AmbientSettings())
    settings = GroomSettings().with_settings(named_preset("looks/blond").settings)
    both = [
        still(Studio(each, settings))
        for each in (groom, replace(groom, light=replace(groom.light, skin_seen=None)))
    ]
    assert (np.abs(both[0] - both[1]).max(axis=-1) > 1e-2).mean() > 0.05


@pytest.mark.slow
@pytest.mark.usefixtures("gpu_context", "extension")
def test_hardly_any_hair_is_burnt(tmp_path: Path) -> None:
    """On every stage at most 0.5 % of the hair's pixels have a channel above 0.98."""
    head, file = built_in_head(), tmp_path / "still.png"
    grown = grow_with_face(head.surface, GrowSettings(strand_count=1500), head.weights)
    rig = rig_flow.prepare(grown, head.surface, GuideSettings(), place="hair", widths="found")
    studio = Studio(prepare_groom(rig, AmbientSettings()), GroomSettings())
    for stage, look in itertools.product(sorted(STAGES), ("brown", "blond")):
        chosen = (named_preset(name).settings for name in (f"stage/{stage}", f"looks/{look}"))
        studio.settings = GroomSettings().with_settings(*chosen)
        drawn = [
            studio.picture(rig.rest_pose, points, 128, 128, 2)
            for points in (rig.strands.grid, rig.strands.grid + np.float32(1e4))
        ]
        is_hair = np.abs(drawn[0] - drawn[1]).max(axis=-1) > 1e-3
        studio.write(file, drawn[0])
        shown = read_texture(file, is_color=False)[..., :3][is_hair]
        assert is_hair.mean() > 0.05
        burnt = (shown.max(axis=-1) > 0.98).mean()
        assert burnt < 0.005, f"{look} on {stage}: {100.0 * burnt:.2f} %"
