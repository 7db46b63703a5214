"""The verb `export` writes what the operators write, without a window."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import bpy
import numpy as np
import pytest
from grids import baked_grid
from strand_files import needs_usd, read_usd_curves
from swinging import key_x

from hairloom.addon.blender.bakes import playback
from hairloom.addon.blender.command_line import command_line
from hairloom.addon.blender.preview.bake import Bake
from hairloom.addon.exchange.groom import Groom, GroomMotion
from hairloom.addon.exchange.hair_file import read_hair_file, write_hair_file
from hairloom.addon.exchange.strand_reading import read_strands
from hairloom.addon.exchange.tressfx import read_tfx
from hairloom.addon.exchange.usd.groom_usd import write_usd
from hairloom.addon.strands import StrandSet

SMALL = ["--set", "guides.guide_count=12", "--set", "guides.cv_count=8"]


@pytest.fixture
def run(tmp_path: Path) -> Callable[..., dict[str, Any]]:
    """A function that runs the verb and returns its report."""

    def done(*arguments: str, output: str, code: int = 0) -> dict[str, Any]:
        report = tmp_path / "report.json"
        made = str(tmp_path / output)
        asked = ["export", *arguments, "--output", made, "--report", str(report)]
        assert command_line.run(asked) == code
        return json.loads(report.read_text(encoding="utf-8"))

    return done


def on_sphere(*, coloured: bool = True) -> Groom:
    """40 strands of 5 or 9 points on the sphere of radius 0.1 m, with all that USD stores."""
    random = np.random.default_rng(4)
    counts = np.where(np.arange(40) % 2, 5, 9)
    outward = random.normal(size=(40, 3))
    outward /= np.linalg.norm(outward, axis=1, keepdims=True)
    along = np.concatenate([np.linspace(0.1, 0.2, count) for count in counts])
    points = np.repeat(outward, counts, axis=0) * along[:, None]
    strands = StrandSet(
        points,
        np.concatenate([[0], np.cumsum(counts)]),
        np.full(len(points), 5e-5),
        np.arange(40) % 2 + 3,
        color=random.random((len(points), 3)) if coloured else None,
    )
    return Groom(strands, strand_id=np.arange(40) + 100, group_names={3: "top"})


def test_all_attributes_of_a_groom_file_are_kept(
    extension: None, sphere: Any, tmp_path: Path, run: Callable[..., Any]
) -> None:
    pytest.importorskip("pxr")
    groom = on_sphere()
    write_usd(tmp_path / "in.usdc", groom)
    source = ["--groom", str(tmp_path / "in.usdc"), "--head", "Head", *SMALL]
    report = run(*source, "--engine", "unreal", output="out.usdc")
    _, curves = read_usd_curves(tmp_path / "out.usdc")
    from pxr import UsdGeom

    primvars = UsdGeom.PrimvarsAPI(curves)
    points = np.array(curves.GetPointsAttr().Get())
    own = groom.strands.point_count
    np.testing.assert_allclose(points[:own], groom.strands.points * 100.0, rtol=1e-5)
    ids = np.array(primvars.GetPrimvar("groom_id").Get())
    assert groom.strand_id is not None
    np.testing.assert_array_equal(ids[:40], groom.strand_id)
    assert np.array(primvars.GetPrimvar("groom_guide").Get()).sum() == 12
    color = np.array(primvars.GetPrimvar("groom_color").Get())
    np.testing.assert_allclose(color[:own], groom.color, atol=1e-6)
    assert list(primvars.GetPrimvar("groom_group_name").Get())[:2] == ["top", ""]
    assert report["preflight"]["guides"] == 12 and report["preflight"]["unit"] == "cm"
    assert report["outputs"] == ["out.usdc"]


@pytest.mark.parametrize("suffix", ["usdc", "tfx", "hair", "abc"])
def test_a_groom_of_guides_alone_is_written_as_strands(
    extension: None, sphere: Any, tmp_path: Path, run: Callable[..., Any], suffix: str
) -> None:
    pytest.importorskip("pxr")
    write_usd(tmp_path / "in.usdc", replace(on_sphere(), is_guide=np.ones(40, bool)))
    source = ["--groom", str(tmp_path / "in.usdc"), "--head", "Head", *SMALL]
    report = run(*source, "--parts", "strands", output=f"out.{suffix}")
    read = read_strands(tmp_path / f"out.{suffix}")
    assert report["preflight"]["strands"] == read.strands.strand_count == 40


def test_motion_of_a_grooms_file_is_left_out_with_a_note(
    extension: None,
    sphere: Any,
    tmp_path: Path,
    run: Callable[..., Any],
    capsys: pytest.CaptureFixture[str],
) -> None:
    pytest.importorskip("pxr")
    groom = on_sphere()
    frames = [groom.strands.points + np.float32(0.1 * frame) for frame in range(3)]
    write_usd(tmp_path / "in.usdc", groom, motion=GroomMotion(frames, 24.0))
    source = ["--groom", str(tmp_path / "in.usdc"), "--head", "Head", *SMALL]
    notes = run(*source, output="out.usdc")["notes"]
    assert any(note.startswith("in.usdc: it moves, and only its first frame") for note in notes)
    run(*source, "--frames", "1", "3", output="out.usdc", code=1)
    assert "use the verb import" in capsys.readouterr().err


def test_a_check_writes_nothing(
    extension: None,
    sphere: Any,
    tmp_path: Path,
    run: Callable[..., Any],
    capfd: pytest.CaptureFixture[str],
) -> None:
    source = [
        "--head",
        "Head",
        "--set",
        "grow.method=normals",
        "--set",
        "children.method=none",
        "--set",
        "grow.strand_count=30",
    ]
    run(*source, "--preflight", output="hair.abc")
    text = capfd.readouterr().out
    assert "left-handed" in text and "Warning: All strands are in one group" in text
    report = run(*source, "--preflight", "json", output="hair.hair")
    shown = capfd.readouterr().out
    facts = json.loads(shown[shown.index("{") : shown.rindex("}") + 1])
    assert facts["strands"] == 30 and facts == report["preflight"]
    assert [path.name for path in tmp_path.iterdir()] == ["report.json"]


@pytest.mark.parametrize("scale", [1.0, 460.0])
def test_a_check_warns_about_hair_in_another_unit(
    extension: None,
    sphere: Any,
    new_hair: Callable[..., Any],
    tmp_path: Path,
    run: Callable[..., Any],
    scale: float,
) -> None:
    """Hair of the scene and hair of a file, 40 cm and 180 m large."""
    hair = new_hair(sphere)
    sphere.scale = [scale] * 3
    warnings = run("--object", hair.name, "--preflight", output="o.abc")["preflight"]["warnings"]
    found = [each for each in warnings if "centimetres" in each]
    assert len(found) == (scale > 1.0)
    assert all(hair.name in each and "Scale the hair and its head" in each for each in found)
    groom = on_sphere()
    points = groom.strands.points * np.float32(scale)
    path = tmp_path / "in.hair"
    write_hair_file(path, replace(groom, strands=groom.strands.with_points(points)))
    warnings = run("--groom", str(path), "--preflight", output="o.abc")["preflight"]["warnings"]
    assert any("in.hair" in each and "--groom-scale 0.01" in each for each in warnings) == (
        scale > 1.0
    )


@needs_usd
@pytest.mark.slow
def test_a_simulation_moves_in_usd(
    extension: None, sphere: Any, tmp_path: Path, run: Callable[..., Any]
) -> None:
    write_usd(tmp_path / "in.usdc", on_sphere(coloured=False))
    source = ["--groom", str(tmp_path / "in.usdc"), "--head", "Head", *SMALL]
    bake = tmp_path / "bake"
    shake = ["--seconds", "0.2", "--frame-rate", "30", "--output", str(bake)]
    assert command_line.run(["simulate", *source, *shake]) == 0
    run(*source, "--bake", str(bake), "--frames", "2", "5", output="out.usdc")
    stage, curves = read_usd_curves(tmp_path / "out.usdc")
    assert (stage.GetStartTimeCode(), stage.GetEndTimeCode()) == (2.0, 5.0)
    assert stage.GetTimeCodesPerSecond() == 30.0
    for frame in (2, 5):
        run(*source, "--bake", str(bake), "--frame", str(frame), output="still.hair")
        still = read_hair_file(tmp_path / "still.hair").strands
        moving = np.array(curves.GetPointsAttr().Get(frame))
        np.testing.assert_allclose(moving, still.points, atol=1e-6)
    first, last = (np.array(curves.GetPointsAttr().Get(frame)) for frame in (2, 5))
    assert np.abs(last - first).max() > 1e-3
    for frames in ("0 9", "5 3"):
        report = run(
            *source, "--bake", str(bake), "--frames", *frames.split(), output="no.usdc", code=1
        )
        assert report["status"] != "done"
    run(*source, "--frames", "0", "3", output="no.usdc", code=1)
    run(*source, "--bake", str(bake), "--frames", "0", "3", output="no.tfx", code=1)
    assert not list(tmp_path.glob("no.*"))


@needs_usd
def test_hair_of_the_scene_leaves_with_its_bake(
    new_hair: Any, sphere: Any, tmp_path: Path, run: Callable[..., Any]
) -> None:
    hair = new_hair(sphere)
    hair.hairloom.dynamics.collider_resolution = 8
    hair.hairloom.dynamics.device = "numpy"
    hair.hairloom.bake.folder = str(tmp_path / "bake")
    key_x(sphere, {1: 0.0, 4: 0.1})
    list(Bake.of([hair], bpy.context.scene, frames=range(1, 5)).steps())
    report = run("--object", "Hair", "--frames", "1", "4", output="out.usdc")
    _, curves = read_usd_curves(tmp_path / "out.usdc")
    cache = playback.cache_of(hair)
    assert cache is not None
    for frame in range(1, 5):
        baked = baked_grid(cache, frame).reshape(-1, 3)
        np.testing.assert_array_equal(np.array(curves.GetPointsAttr().Get(frame)), baked)
    assert report["preflight"]["frames"] == [1, 4, 24.0]
    run("--object", "Hair", "--frames", "3", "6", output="none.usdc", code=1)
    run("--object", "Hair", "--groom", "Hair", output="none.usdc", code=1)
    run("--object", "Head", output="none.usdc", code=1)
    assert not list(tmp_path.glob("none*"))


def test_options_of_the_formats_reach_them(
    new_hair: Any, sphere: Any, tmp_path: Path, run: Callable[..., Any]
) -> None:
    new_hair(sphere)
    options = ["--by-group", "--vertex-count", "16", "--pad-to-64"]
    options += ["--up", "Z", "--scale", "0.01"]
    report = run("--object", "Hair", *options, output="hair.tfx")
    assert report["outputs"] == ["hair_group0.tfx", "hair_group1.tfx"]
    read = read_tfx(tmp_path / "hair_group0.tfx", up="Z", scale=0.01).strands
    assert read.strand_count == 64 and set(read.point_counts) == {16}
    np.testing.assert_allclose(np.linalg.norm(read.roots, axis=1), 0.1, rtol=1e-4)
    report = run("--object", "Hair", "--format", "hair", "--parts", "guides", output="v1.guides")
    assert report["outputs"] == ["v1.guides.hair"]
    run("--object", "Hair", "--format", "hair", output="v1.abc", code=1)
    run("--object", "Hair", "--engine", "houdini", output="v1.abc", code=1)
    assert not list(tmp_path.glob("v1.abc*"))
