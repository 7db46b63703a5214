"""`read_strands`, for files of all formats: suffixes, axes, scales, and guides."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tiers import few_in_commits

from hairloom.addon.errors import HairloomError
from hairloom.addon.exchange.alembic.groom_alembic import write_groom_alembic
from hairloom.addon.exchange.groom import Groom, GroomMotion, ReadMotion
from hairloom.addon.exchange.groom_presets import BLENDER, UNITY, UNREAL
from hairloom.addon.exchange.hair_file import write_hair_file
from hairloom.addon.exchange.read_motion import valid_motion
from hairloom.addon.exchange.strand_formats import SUFFIXES
from hairloom.addon.exchange.strand_reading import read_strands
from hairloom.addon.exchange.tressfx import write_tfx
from hairloom.addon.exchange.usd.groom_usd import write_usd
from hairloom.addon.strands import StrandSet

pytest.importorskip("alembic3d", reason="it is missing: `make setup` installs it")
pytest.importorskip("pxr", reason="usd-core is missing: `make setup` installs it")
from pxr import Usd, UsdGeom


def groom(guides: tuple[int, ...] = (1, 3)) -> Groom:
    """Five strands of four points, all of one thickness, some of them guides."""
    random = np.random.default_rng(4)
    is_guide = np.isin(np.arange(5), guides)
    strands = StrandSet(
        random.uniform(-0.3, 0.3, (20, 3)), np.arange(6) * 4, np.full(20, 4e-5), np.zeros(5)
    )
    return Groom(
        strands,
        strand_id=np.arange(5) + 10,
        is_guide=is_guide,
        closest_guides=np.tile([11, 13, 11], (5, 1)),
        guide_weights=np.tile([0.5, 0.25, 0.25], (5, 1)),
    )


def write(path: Path, hair: Groom) -> None:
    if path.suffix == ".abc":
        write_groom_alembic(path, hair, BLENDER)
    elif path.suffix == ".tfx":
        write_tfx(path, hair, parts="both")
    elif path.suffix == ".hair":
        write_hair_file(path, hair, parts="both")
    else:
        write_usd(path, hair)


@pytest.mark.parametrize("suffix", [*SUFFIXES, ".ABC"])
def test_what_was_written_in_any_format_is_read_by_its_suffix(tmp_path: Path, suffix: str) -> None:
    write(tmp_path / f"hair{suffix.lower()}", groom())
    path = (tmp_path / f"hair{suffix.lower()}").rename(tmp_path / f"hair{suffix}")
    read = read_strands(path, parts="both")
    np.testing.assert_array_equal(read.strands.points, groom().strands.points)
    np.testing.assert_allclose(read.strands.radius, 4e-5, rtol=1e-6)
    assert read.source == path and read.dropped == {}
    if suffix in (".abc", ".usdc"):
        for name in ("strand_id", "is_guide", "closest_guides", "guide_weights"):
            np.testing.assert_array_equal(getattr(read.groom, name), getattr(groom(), name))


@pytest.mark.parametrize("suffix", [".abc", ".usdc", ".tfx", ".hair"])
@pytest.mark.parametrize("scale", few_in_commits([2.54, 0.01, 1.0]))
@pytest.mark.parametrize("up", ["Y", "Z"])
def test_axes_and_scale_of_every_format_can_be_given(
    tmp_path: Path, suffix: str, scale: float, up: str
) -> None:
    """All but .usdc and .hair are written with Y up; read with Z up, their coordinates stay
    unconverted."""
    path, hair = tmp_path / f"hair{suffix}", groom().strands.points
    write(path, groom())
    read = read_strands(path, up=up, scale=scale, parts="both").strands
    x, y, z = hair.T
    expected = hair
    if suffix in (".abc", ".tfx") and up == "Z":
        expected = np.stack([x, z, -y], axis=1)
    if suffix in (".usdc", ".hair") and up == "Y":
        expected = np.stack([x, -z, y], axis=1)
    np.testing.assert_allclose(read.points, expected * scale, rtol=1e-6, atol=1e-9)
    np.testing.assert_allclose(read.radius, 4e-5 * scale, rtol=1e-5)


@pytest.mark.parametrize("preset", [UNREAL, UNITY, BLENDER], ids=lambda preset: preset.name)
def test_our_alembic_files_say_their_own_space(tmp_path: Path, preset: Any) -> None:
    write_groom_alembic(
        tmp_path / "a.abc", groom(), replace(preset, parts="both", splits_groups=False)
    )
    read = read_strands(tmp_path / "a.abc", parts="both")
    np.testing.assert_allclose(read.strands.points, groom().strands.points, atol=1e-7)
    assert read.notes == ()


@pytest.mark.parametrize("suffix", [".abc", ".usda"])
def test_strands_come_without_their_guides_and_guides_without_strands(
    tmp_path: Path, suffix: str
) -> None:
    path, hair = tmp_path / f"hair{suffix}", groom()
    write(path, hair)
    read = read_strands(path)
    np.testing.assert_array_equal(read.groom.strand_id, [10, 12, 14])
    assert read.groom.is_guide is None and read.groom.closest_guides is None
    assert any("2 guides were left out" in note for note in read.notes)
    read = read_strands(path, parts="guides")
    np.testing.assert_array_equal(read.groom.strand_id, [11, 13])
    np.testing.assert_array_equal(read.strands.points, hair.guides().strands.points)
    assert any("3 strands were left out" in note for note in read.notes)


def test_a_file_of_guides_alone_gives_those(tmp_path: Path) -> None:
    write(tmp_path / "hair.abc", groom(guides=(0, 1, 2, 3, 4)))
    read = read_strands(tmp_path / "hair.abc")
    assert read.strands.strand_count == 5 and read.groom.is_guide.all()
    assert any("only guides" in note for note in read.notes)


def test_several_grooms_in_a_file_are_joined_with_a_note(tmp_path: Path) -> None:
    stage = Usd.Stage.CreateNew(str(tmp_path / "two.usda"))
    UsdGeom.SetStageMetersPerUnit(stage, 1.0)
    for name in ("front", "back"):
        curves = UsdGeom.BasisCurves.Define(stage, f"/{name}")
        curves.CreateTypeAttr("linear")
        curves.CreatePointsAttr([(0, 0, 0), (0, 0.1, 0)])
        curves.CreateCurveVertexCountsAttr([2])
    stage.Save()
    read = read_strands(tmp_path / "two.usda")
    assert dict(read.groom.group_names) == {0: "front", 1: "back"}
    assert "two.usda: its 2 prims of curves were joined into one groom." in read.notes
    write_groom_alembic(
        tmp_path / "two.abc", groom_of_groups(), replace(BLENDER, splits_groups=True, parts="both")
    )
    read = read_strands(tmp_path / "two.abc")
    assert read.strands.group.tolist() == [0, 0, 1, 1, 1]
    assert "two.abc: its 2 curves objects were joined into one groom." in read.notes


@pytest.mark.parametrize("parts", ["both", "guides"])
@pytest.mark.parametrize("suffix", [".abc", ".usdc"])
def test_motion_is_read_with_all_its_frames(tmp_path: Path, suffix: str, parts: str) -> None:
    hair = groom()
    rest = hair.strands.points
    motion = GroomMotion([rest, rest + 1.0, rest + [0.0, 3.0, 0.0]], rate=24.0, first_frame=5)
    path = tmp_path / f"hair{suffix}"
    if suffix == ".abc":
        write_groom_alembic(path, hair, BLENDER, motion=motion)
    else:
        write_usd(path, hair, motion=motion)
    read = read_strands(path, parts=parts)
    expected = rest if parts == "both" else hair.guides().strands.points
    np.testing.assert_array_equal(read.strands.points, expected)
    assert read.groom.motion is not None
    first, positions = read.groom.motion.at_frames(24.0)
    assert (first, len(positions)) == (5, 3)
    np.testing.assert_allclose(
        positions[2] - positions[0], expected * 0 + [0.0, 3.0, 0.0], atol=1e-6
    )
    assert read.groom.motion.cut_note(24.0) == ""
    half, doubled = read.groom.motion.at_frames(48.0)
    assert (half, len(doubled)) == (10, 5)
    np.testing.assert_allclose(doubled[1], (positions[0] + positions[1]) / 2.0, atol=1e-6)


def test_a_motion_that_loses_points_ends_before_and_that_is_reported(tmp_path: Path) -> None:
    stage = Usd.Stage.CreateNew(str(tmp_path / "hair.usda"))
    UsdGeom.SetStageMetersPerUnit(stage, 1.0)
    stage.SetTimeCodesPerSecond(24.0)
    curves = UsdGeom.BasisCurves.Define(stage, "/hair")
    curves.CreateTypeAttr("linear")
    points = curves.CreatePointsAttr()
    for time in (1.0, 2.0):
        points.Set([(0, 0, 0), (0, 0.1 * time, 0)], time)
    points.Set([(0, 0, 0)], 3.0)
    curves.CreateCurveVertexCountsAttr([2])
    stage.Save()
    read = read_strands(tmp_path / "hair.usda")
    assert read.groom.motion is not None and len(read.groom.motion.times) == 2
    (note,) = (each for each in read.notes if "motion" in each)
    assert "at 0.125 s it has another number of points" in note


@pytest.mark.parametrize("suffix", [".abc", ".usdc"])
def test_still_hair_that_is_written_at_each_frame_has_no_motion(
    tmp_path: Path, suffix: str
) -> None:
    hair = groom()
    motion = GroomMotion([hair.strands.points] * 3, rate=24.0)
    if suffix == ".abc":
        write_groom_alembic(tmp_path / "hair.abc", hair, BLENDER, motion=motion)
    else:
        write_usd(tmp_path / "hair.usdc", hair, motion=motion)
    read = read_strands(tmp_path / f"hair{suffix}", parts="both")
    assert not any("motion" in note for note in read.notes)


def stage_of_curves(path: Path, counts: list[int], basis: str = "") -> Usd.Stage:
    """Straight curves side by side, each a metre long, with these point counts."""
    stage = Usd.Stage.CreateNew(str(path))
    UsdGeom.SetStageMetersPerUnit(stage, 1.0)
    UsdGeom.SetStageUpAxis(stage, "Z")
    curves = UsdGeom.BasisCurves.Define(stage, "/top/hair")
    UsdGeom.Xform.Define(stage, "/top")
    curves.CreateTypeAttr("cubic" if basis else "linear")
    if basis:
        curves.CreateBasisAttr(basis)
    points = [(x, 0.0, z) for x, n in enumerate(counts) for z in np.linspace(0.0, 1.0, n).tolist()]
    curves.CreatePointsAttr(points)
    curves.CreateCurveVertexCountsAttr(counts)
    return stage


@pytest.mark.parametrize("moves", [True, False])
def test_hair_that_its_parent_moves_has_motion(tmp_path: Path, moves: bool) -> None:
    stage = stage_of_curves(tmp_path / "hair.usda", [3])
    place = UsdGeom.Xform.Get(stage, "/top").AddTranslateOp()
    for time in (1.0, 2.0, 3.0):
        place.Set((time if moves else 1.0, 0.0, 0.0), time)
    stage.SetStartTimeCode(1.0)
    stage.SetEndTimeCode(3.0)
    stage.Save()
    read = read_strands(tmp_path / "hair.usda")
    assert read.strands.points[0].tolist() == [1.0, 0.0, 0.0]
    motion = read.groom.motion
    assert (motion is not None) == moves
    if motion is not None:
        assert motion.positions[:, 0].tolist() == [[1, 0, 0], [2, 0, 0], [3, 0, 0]]


def test_bezier_curves_of_a_wrong_number_of_points_are_dropped_for_that(tmp_path: Path) -> None:
    stage_of_curves(tmp_path / "hair.usda", [4, 7, 5, 7], "bezier").Save()
    read = read_strands(tmp_path / "hair.usda")
    assert read.strands.point_counts.tolist() == [4, 7, 7]
    assert read.dropped == {"a number of points that bezier curves cannot have": 1}


def test_bezier_curves_that_are_points_are_read_as_such(tmp_path: Path) -> None:
    stage_of_curves(tmp_path / "hair.usda", [4, 5, 6], "bezier").Save()
    read = read_strands(tmp_path / "hair.usda")
    assert read.strands.point_counts.tolist() == [4, 5, 6] and not read.dropped
    assert any("its basis is bezier, but" in note for note in read.notes)


def groom_of_groups() -> Groom:
    strands = replace(groom().strands, group=np.array([0, 0, 1, 1, 1], np.int32))
    return Groom(strands, group_names={0: "front", 1: "back"})


@pytest.mark.parametrize(
    ("name", "content", "problem"),
    [
        ("hair", b"x", "it has no suffix"),
        ("hair.obj", b"x", "'.obj' is not the suffix of a strand file"),
        ("hair.abc", b"HAIR" + bytes(200), "this is not an Alembic file"),
        ("hair.tfx", b"#usda 1.0\n" + bytes(200), "not a TressFX 3 or 4 file"),
        ("hair.usdc", b"Ogawa\xff" + bytes(200), "USD"),
        ("hair.hair", b"PXR-USDC" + bytes(200), "not a .hair file"),
        ("hair.usd", b"", "empty"),
        ("hair.abc", b"", "empty"),
    ],
)
def test_files_of_other_formats_are_refused_by_name(
    tmp_path: Path, name: str, content: bytes, problem: str
) -> None:
    path = tmp_path / name
    path.write_bytes(content)
    with pytest.raises(HairloomError) as raised:
        read_strands(path)
    assert problem in raised.value.problem
    assert raised.value.place == str(path) and raised.value.remedy


@pytest.mark.parametrize(
    ("options", "place"),
    [({"parts": "cards"}, "parts"), ({"scale": 0.0}, "scale"), ({"scale": np.nan}, "scale")],
)
def test_invalid_reading_options_are_refused(
    tmp_path: Path, options: dict[str, Any], place: str
) -> None:
    write(tmp_path / "hair.tfx", groom())
    with pytest.raises(HairloomError) as raised:
        read_strands(tmp_path / "hair.tfx", **options)
    assert raised.value.place == place


def test_guides_of_a_file_without_any_are_refused(tmp_path: Path) -> None:
    write(tmp_path / "hair.tfx", groom())
    with pytest.raises(HairloomError, match="none of its strands is marked as a guide"):
        read_strands(tmp_path / "hair.tfx", parts="guides")


def test_frames_beyond_the_maximum_are_counted() -> None:
    motion = ReadMotion(np.array([0.0, 1000.0]), np.zeros((2, 3, 3), np.float32))
    first, positions = motion.at_frames(24.0)
    assert (first, len(positions)) == (0, 10_000)
    assert "24,001 frames, and only the first 10,000" in motion.cut_note(24.0)


def test_times_that_no_scene_has_end_the_motion() -> None:
    positions = np.zeros((3, 2, 3), np.float32)
    motion, note = valid_motion(np.array([0.0, 1.0, 1e300]), positions)
    assert motion is not None and motion.times.tolist() == [0.0, 1.0]
    assert "at 1e+300 s it has a time outside the range of a scene" in note
    assert valid_motion(np.array([1e300, 1.5e300, 2e300]), positions)[0] is None
