"""Grooms as USD: our files, read with OpenUSD's own API, and our reader on files as other programs
write them."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from hairloom.addon.errors import HairloomError
from hairloom.addon.exchange.groom import Groom, GroomMotion
from hairloom.addon.exchange.strand_formats import USD
from hairloom.addon.exchange.usd.groom_usd import write_usd
from hairloom.addon.exchange.usd.groom_usd_read import read_usd
from hairloom.addon.strands import StrandSet

pytest.importorskip("pxr", reason="usd-core is missing: `make setup` installs it")
from pxr import Gf, Sdf, Usd, UsdGeom, UsdValidation, Vt

COUNTS = [3, 5, 4, 2, 6]
SUFFIXES = [".usdc", ".usda", ".usd"]


def full_groom() -> Groom:
    """Strands of different point counts with every attribute that a groom can have."""
    random = np.random.default_rng(3)
    offsets = np.concatenate([[0], np.cumsum(COUNTS)])
    points, strands = int(offsets[-1]), len(COUNTS)
    weights = random.random((strands, 3)).astype(np.float32)
    return Groom(
        StrandSet(
            points=random.uniform(-0.3, 0.3, (points, 3)),
            offsets=offsets,
            radius=random.uniform(1.0e-5, 9.0e-5, points),
            group=[7, 0, 7, 0, 2],
            root_uv=random.random((strands, 2)),
            color=random.random((points, 3)),
        ),
        name="Haar 1",
        strand_id=[14, 3, 15, 9, 2],
        is_guide=[True, False, False, True, False],
        closest_guides=[[14, 9, 9]] * strands,
        guide_weights=weights / weights.sum(axis=1, keepdims=True),
        group_names={0: "scalp", 7: "fringe"},
    )


def stage_of(path: Path) -> Any:
    return Usd.Stage.Open(str(path))


def only_curves(stage: Any) -> Any:
    (prim,) = [each for each in stage.Traverse() if each.IsA(UsdGeom.BasisCurves)]
    return UsdGeom.BasisCurves(prim)


def test_a_file_has_the_names_types_and_interpolations_that_engines_read(tmp_path: Path) -> None:
    groom = full_groom()
    write_usd(tmp_path / "hair.usdc", groom)
    stage = stage_of(tmp_path / "hair.usdc")
    curves = only_curves(stage)
    assert (curves.GetTypeAttr().Get(), curves.GetBasisAttr().Get()) == ("cubic", "catmullRom")
    assert curves.GetWrapAttr().Get() == "pinned"
    assert list(curves.GetCurveVertexCountsAttr().Get()) == COUNTS
    assert np.array_equal(np.array(curves.GetPointsAttr().Get()), groom.strands.points)
    assert np.array_equal(np.array(curves.GetWidthsAttr().Get()), 2 * groom.strands.radius)
    assert curves.GetWidthsInterpolation() == "vertex"

    prim = curves.GetPrim()
    assert stage.GetDefaultPrim().GetPath() == "/Haar_1" == prim.GetParent().GetPath()
    assert stage.GetDefaultPrim().GetDisplayName() == "Haar 1"
    assert "GroomAPI" in stage.GetDefaultPrim().GetMetadata("apiSchemas").GetAppliedItems()
    properties = stage.GetDefaultPrim().GetPropertiesInNamespace("userProperties")
    assert {each.GetBaseName(): each.Get() for each in properties} == {
        "groom_version_major": 1,
        "groom_version_minor": 5,
        "groom_tool": "Hairloom",
    }
    expected: dict[str, tuple[str, str, Any]] = {
        "groom_group_id": ("int[]", "uniform", groom.strands.group),
        "groom_guide": ("int[]", "uniform", groom.is_guide),
        "groom_id": ("int[]", "uniform", groom.strand_id),
        "groom_root_uv": ("float2[]", "uniform", groom.strands.root_uv),
        "st": ("texCoord2f[]", "uniform", groom.strands.root_uv),
        "groom_color": ("float3[]", "vertex", groom.color),
        "displayColor": ("color3f[]", "vertex", groom.color),
        "groom_closest_guides": ("int3[]", "uniform", groom.closest_guides),
        "groom_guide_weights": ("float3[]", "uniform", groom.guide_weights),
        "groom_group_name": ("string[]", "uniform", ["fringe", "scalp", "fringe", "scalp", ""]),
    }
    primvars = {each.GetPrimvarName(): each for each in _primvars(prim)}
    assert set(primvars) == set(expected)
    for name, (kind, interpolation, values) in expected.items():
        primvar = primvars[name]
        assert (primvar.GetTypeName(), primvar.GetInterpolation()) == (kind, interpolation), name
        assert np.array_equal(np.array(primvar.Get()), values), name


def _primvars(prim: Any) -> list[Any]:
    found = UsdGeom.PrimvarsAPI(prim).GetPrimvarsWithValues()
    return [each for each in found if each.GetPrimvarName() != "widths"]


@pytest.mark.parametrize("layout", USD.layouts, ids=lambda layout: layout.name)
def test_a_strand_of_a_metre_is_where_it_belongs(tmp_path: Path, layout: Any) -> None:
    """In the stage's own unit and axis: from (1, 2, 3) a metre up."""
    strand = StrandSet([[1, 2, 3], [1, 2, 3.5], [1, 2, 4]], [0, 3], [0.0005] * 3, [0])
    space, scale = layout.space, 1.0 / layout.space.units_per_metre
    write_usd(tmp_path / "a.usda", Groom(strand), up=space.up, scale=scale)
    stage = stage_of(tmp_path / "a.usda")
    curves = only_curves(stage)
    unit = UsdGeom.GetStageMetersPerUnit(stage)
    assert (UsdGeom.GetStageUpAxis(stage), unit) == (space.up, scale)
    points = np.array(curves.GetPointsAttr().Get(), np.float64) * unit
    right, up, back = points[:, 0], points[:, 1], points[:, 2]  # of a file with Y up
    if space.up == "Z":
        right, up, back = points[:, 0], points[:, 2], -points[:, 1]
    assert np.allclose([right[0], up[0], back[0]], [1.0, 3.0, -2.0])
    assert np.allclose([right[-1], up[-1], back[-1]], [1.0, 4.0, -2.0])
    assert np.allclose(np.array(curves.GetWidthsAttr().Get()) * unit, 0.001)
    extent = np.array(curves.GetExtentAttr().Get())
    computed = UsdGeom.Boundable.ComputeExtentFromPlugins(curves, 0)
    assert np.allclose(extent, np.array(computed), rtol=1e-6)


@pytest.mark.parametrize("suffix", SUFFIXES)
@pytest.mark.parametrize("by_group", [False, True])
def test_usd_validators_find_no_faults(tmp_path: Path, suffix: str, by_group: bool) -> None:
    path = tmp_path / f"hair{suffix}"
    groom = full_groom()
    write_usd(path, groom, by_group=by_group, motion=motion_of(groom, 3))
    registry = UsdValidation.ValidationRegistry()
    context = UsdValidation.ValidationContext(registry.GetOrLoadAllValidators())
    stage = stage_of(path)
    errors = context.Validate(stage)
    assert [error.GetMessage() for error in errors] == []


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_a_groom_comes_back_bit_for_bit(tmp_path: Path, suffix: str) -> None:
    path, groom = tmp_path / f"hair{suffix}", full_groom()
    write_usd(path, groom, up="Y")
    read = read_usd(path)
    assert (read.version, read.notes, read.dropped) == ("1.5", (), {})
    assert read.groom.name == groom.name and read.source == path
    assert_equal(read.groom, groom)
    assert dict(read.groom.group_names) == groom.group_names


def test_a_prim_for_each_group_comes_back_as_the_same_strands(tmp_path: Path) -> None:
    groom = full_groom()
    write_usd(tmp_path / "hair.usdc", groom, by_group=True)
    stage = stage_of(tmp_path / "hair.usdc")
    paths = [str(prim.GetPath()) for prim in stage.Traverse()]
    assert paths == ["/Haar_1", "/Haar_1/scalp", "/Haar_1/group_2", "/Haar_1/fringe"]
    read = read_usd(tmp_path / "hair.usdc").groom
    order = np.argsort(groom.strands.group, kind="stable")
    assert_equal(read, groom.take(order))
    assert dict(read.group_names) == groom.group_names


def assert_equal(one: Groom, other: Groom) -> None:
    for name in ("points", "offsets", "radius", "group", "root_uv"):
        assert np.array_equal(getattr(one.strands, name), getattr(other.strands, name)), name
    for name in ("color", "strand_id", "is_guide", "closest_guides", "guide_weights"):
        assert np.array_equal(getattr(one, name), getattr(other, name)), name


def test_unknown_attributes_are_not_written(tmp_path: Path) -> None:
    strands = StrandSet(np.eye(3), [0, 3], [1e-4] * 3, [0])
    write_usd(tmp_path / "hair.usda", Groom(strands), is_linear=True)
    stage = stage_of(tmp_path / "hair.usda")
    curves = only_curves(stage)
    assert curves.GetTypeAttr().Get() == "linear"
    assert [each.GetPrimvarName() for each in _primvars(curves.GetPrim())] == ["groom_group_id"]
    read = read_usd(tmp_path / "hair.usda").groom
    assert read.color is read.strand_id is read.is_guide is read.closest_guides is None
    assert read.strands.root_uv is None


def motion_of(groom: Groom, count: int) -> GroomMotion:
    frames = (groom.strands.points + np.float32(frame) for frame in range(count))
    return GroomMotion(frames, rate=30.0, first_frame=10)


@pytest.mark.parametrize("by_group", [False, True])
def test_motion_becomes_time_samples(tmp_path: Path, by_group: bool) -> None:
    groom = full_groom()
    write_usd(tmp_path / "a.usdc", groom, scale=0.01, by_group=by_group, motion=motion_of(groom, 3))
    stage = stage_of(tmp_path / "a.usdc")
    assert (stage.GetStartTimeCode(), stage.GetEndTimeCode()) == (10, 12)
    assert stage.GetTimeCodesPerSecond() == stage.GetFramesPerSecond() == 30
    for prim in stage.Traverse():
        if not prim.IsA(UsdGeom.BasisCurves):
            continue
        curves = UsdGeom.BasisCurves(prim)
        assert curves.GetPointsAttr().GetTimeSamples() == [10, 11, 12]
        rest, moved = (np.array(curves.GetPointsAttr().Get(*time)) for time in ((), (12,)))
        assert np.allclose(moved, rest + 200, atol=1e-4)  # two metres in centimetres
        box = np.array(curves.GetExtentAttr().Get(12))
        assert np.allclose(box, np.array(curves.GetExtentAttr().Get()) + 200, atol=1e-4)
    order = np.argsort(groom.strands.group, kind="stable") if by_group else np.arange(5)
    read = read_usd(tmp_path / "a.usdc").strands
    assert np.allclose(read.points, groom.strands.take(order).points)


def test_long_motion_is_saved_in_parts(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A file that is saved after each frame equals one that is saved once."""
    monkeypatch.setattr("hairloom.addon.exchange.usd.groom_usd._MAX_UNSAVED_BYTES", 0)
    groom, path, sizes = full_groom(), tmp_path / "a.usdc", []

    def frames() -> Iterator[np.ndarray]:
        for frame in range(4):
            sizes.append(sum(each.stat().st_size for each in tmp_path.iterdir()))
            yield groom.strands.points * np.float32(frame)

    write_usd(path, groom, motion=GroomMotion(frames(), 24.0))
    assert sizes[1] < sizes[2] < sizes[3] and list(tmp_path.iterdir()) == [path]
    stage = stage_of(path)
    attribute = only_curves(stage).GetPointsAttr()
    for frame in range(4):
        expected = groom.strands.points * np.float32(frame)
        assert np.array_equal(np.array(attribute.Get(frame + 1)), expected)


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_an_interrupted_write_leaves_the_old_file(tmp_path: Path, suffix: str) -> None:
    groom, path = full_groom(), tmp_path / f"hair{suffix}"
    write_usd(path, groom)
    before = path.read_bytes()

    def frames() -> Iterator[np.ndarray]:
        yield groom.strands.points
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        write_usd(path, groom, motion=GroomMotion(frames(), 24.0))
    assert path.read_bytes() == before and list(tmp_path.iterdir()) == [path]


def new_stage(path: Path, *, unit: float = 1.0, up: str = "Z") -> Any:
    stage = Usd.Stage.CreateNew(str(path))
    UsdGeom.SetStageMetersPerUnit(stage, unit)
    UsdGeom.SetStageUpAxis(stage, up)
    return stage


def add_curves(
    stage: Any,
    place: str,
    points: Any,
    counts: list[int],
    *,
    basis: str = "catmullRom",
    wrap: str = "pinned",
) -> Any:
    curves = UsdGeom.BasisCurves.Define(stage, place)
    curves.CreateTypeAttr("linear" if basis == "linear" else "cubic")
    if basis != "linear":
        curves.CreateBasisAttr(basis)
    curves.CreateWrapAttr(wrap)
    curves.CreatePointsAttr(Vt.Vec3fArray.FromNumpy(np.asarray(points, np.float32)))
    curves.CreateCurveVertexCountsAttr(counts)
    return curves


#: Matrices of curves from USD's documentation, for (t^3, t^2, t, 1).
MATRICES = {
    "bezier": np.array([[-1, 3, -3, 1], [3, -6, 3, 0], [-3, 3, 0, 0], [1, 0, 0, 0]]),
    "bspline": np.array([[-1, 3, -3, 1], [3, -6, 3, 0], [-3, 0, 3, 0], [1, 4, 1, 0]]) / 6,
    "catmullRom": np.array([[-1, 3, -3, 1], [2, -5, 4, -1], [-1, 0, 1, 0], [0, 2, 0, 0]]) / 2,
}


def on_curve(basis: str, points: np.ndarray, pinned: bool, per_segment: int) -> np.ndarray:
    """Points on a curve, segment by segment from the definition."""
    if pinned and basis != "bezier":
        ends = 2 * points[0] - points[1], 2 * points[-1] - points[-2]
        points = np.vstack([ends[0], points, ends[1]])
    step, found = 3 if basis == "bezier" else 1, []
    starts = range(0, len(points) - 3, step)
    for start in starts:
        for part in range(per_segment + (start == starts[-1])):
            t = part / per_segment
            found.append(np.array([t**3, t**2, t, 1]) @ MATRICES[basis] @ points[start : start + 4])
    return np.array(found)


@pytest.mark.parametrize(
    ("basis", "wrap"),
    [
        ("bezier", "nonperiodic"),
        ("bspline", "nonperiodic"),
        ("bspline", "pinned"),
        ("catmullRom", "nonperiodic"),
        ("catmullRom", "pinned"),
    ],
)
def test_curves_of_every_basis_become_points_on_them(tmp_path: Path, basis: str, wrap: str) -> None:
    points = np.random.default_rng(1).uniform(-0.2, 0.2, (11, 3)).astype(np.float32)
    counts, stage = [7, 4], new_stage(tmp_path / "a.usda")
    curves = add_curves(stage, "/hair", points, counts, basis=basis, wrap=wrap)
    per_segment = 3 if basis == "bezier" else 1
    expected = [
        on_curve(basis, each, wrap == "pinned", per_segment) for each in (points[:7], points[7:])
    ]
    # widths for each end of a segment, growing evenly from root to tip
    ends = [(len(each) - 1) // per_segment + 1 for each in expected]
    curves.CreateWidthsAttr(np.concatenate([np.linspace(1e-4, 3e-4, n) for n in ends]).tolist())
    curves.SetWidthsInterpolation("varying")
    stage.Save()
    read = read_usd(tmp_path / "a.usda")
    assert read.strands.point_counts.tolist() == [len(each) for each in expected]
    assert np.allclose(read.strands.points, np.vstack(expected), atol=1e-6)
    widths = np.concatenate([np.linspace(1e-4, 3e-4, len(each)) for each in expected])
    assert np.allclose(2 * read.strands.radius, widths, rtol=1e-5)
    became = [note for note in read.notes if "were converted to points" in note]
    assert bool(became) == ((basis, wrap) != ("catmullRom", "pinned"))


def test_values_of_every_interpolation_find_their_points_and_strands(tmp_path: Path) -> None:
    stage = new_stage(tmp_path / "a.usda")
    curves = add_curves(stage, "/hair", np.random.default_rng(1).random((5, 3)), [3, 2])
    api, types = UsdGeom.PrimvarsAPI(curves), Sdf.ValueTypeNames
    api.CreatePrimvar("displayColor", types.Color3fArray, "uniform").Set([(1, 0, 0), (0, 1, 0)])
    api.CreatePrimvar("groom_group_id", types.IntArray, "constant").Set([4])
    api.CreatePrimvar("groom_guide", types.Int, "constant").Set(1)
    api.CreatePrimvar("groom_id", types.Int64Array, "vertex").Set([5, 0, 0, 6, 0])
    uv = api.CreatePrimvar("st", types.TexCoord2fArray, "uniform")
    uv.Set([(0.5, 0.25), (0.75, 1.0)])
    uv.SetIndices([1, 0])
    curves.CreateWidthsAttr([2e-4])
    curves.SetWidthsInterpolation("constant")
    stage.Save()
    groom = read_usd(tmp_path / "a.usda").groom
    assert groom.color is not None and groom.color[:, 0].tolist() == [1, 1, 1, 0, 0]
    assert groom.strands.group.tolist() == [4, 4]
    assert groom.is_guide is not None and groom.is_guide.tolist() == [True, True]
    assert groom.strand_id is not None and groom.strand_id.tolist() == [5, 6]
    assert groom.strands.root_uv is not None
    assert groom.strands.root_uv.tolist() == [[0.75, 1.0], [0.5, 0.25]]
    assert np.allclose(groom.strands.radius, 1e-4)


def test_parents_instances_units_and_axes_place_the_strands(tmp_path: Path) -> None:
    stage = new_stage(tmp_path / "a.usdc", unit=0.01, up="Y")
    head = UsdGeom.Xform.Define(stage, "/head")
    head.AddTranslateOp().Set(Gf.Vec3d(100, 0, 0))
    head.AddScaleOp().Set(Gf.Vec3f(2, 2, 2))
    hair = add_curves(stage, "/head/hair", [[0, 0, 0], [0, 50, 0]], [2], basis="linear")
    hair.AddRotateXOp().Set(90.0)  # up becomes forward, towards +Z
    hair.CreateWidthsAttr([0.02])
    hair.SetWidthsInterpolation("constant")
    copy = stage.DefinePrim("/copy", "Xform")
    copy.GetReferences().AddInternalReference("/head")
    copy.SetInstanceable(True)
    UsdGeom.Xformable(copy).ClearXformOpOrder()
    UsdGeom.Xformable(copy).AddTranslateOp(opSuffix="own").Set(Gf.Vec3d(0, 0, 7))
    stage.Save()
    read = read_usd(tmp_path / "a.usdc").strands
    # two times 50 cm along +Z of a Y-up file, which is Blender's -Y, at one metre along X
    assert np.allclose(read.points[:2], [[1, 0, 0], [1, -1, 0]], atol=1e-6)
    assert np.allclose(read.points[2:], [[0, -0.07, 0], [0, -0.57, 0]], atol=1e-6)
    assert np.allclose(read.radius, [2e-4, 2e-4, 1e-4, 1e-4])
    assert read.group.tolist() == [0, 1]


@pytest.mark.parametrize("between", ["Scope", "", "Xform"])
def test_hair_moves_with_an_animated_prim_whatever_lies_between(
    tmp_path: Path, between: str
) -> None:
    stage = new_stage(tmp_path / "a.usdc", unit=1.0, up="Z")
    place = UsdGeom.Xform.Define(stage, "/head").AddTranslateOp()
    for time in (24, 48):
        place.Set(Gf.Vec3d(time / 24, 0, 0), time)
    stage.DefinePrim("/head/grooms", between)
    add_curves(stage, "/head/grooms/hair", [[0, 0, 0], [0, 1, 0]], [2], basis="linear")
    stage.Save()
    motion = read_usd(tmp_path / "a.usdc").groom.motion
    assert motion is not None and motion.times.tolist() == [1.0, 2.0]
    assert motion.positions[:, :, 0].tolist() == [[1.0, 1.0], [2.0, 2.0]]


def test_an_unnamed_unit_is_a_centimetre_and_can_be_overruled(tmp_path: Path) -> None:
    stage = Usd.Stage.CreateNew(str(tmp_path / "a.usda"))
    add_curves(stage, "/hair", [[0, 0, 0], [0, 100, 0]], [2])
    stage.Save()
    read = read_usd(tmp_path / "a.usda")
    assert read.strands.points[1].tolist() == [0, 0, 1]  # Y up, as USD has it without a word
    assert "centimetres" in " ".join(read.notes)
    message = read_usd(tmp_path / "a.usda", up="Z", scale=0.001)
    assert np.allclose(message.strands.points[1], [0, 0.1, 0])
    assert "centimetres" not in " ".join(message.notes)


def test_other_prims_are_left_out_with_a_note(tmp_path: Path) -> None:
    stage = new_stage(tmp_path / "a.usda")
    straight = [[0, 0, 0], [0, 0, 0.1]]
    add_curves(stage, "/good", straight, [2])
    add_curves(stage, "/short", straight, [3])
    add_curves(stage, "/closed", np.eye(3).tolist(), [3], wrap="periodic")
    add_curves(stage, "/empty", np.zeros((0, 3)), [])
    broken = [*straight, [np.nan, 0, 0], [0, 0, 1]]
    add_curves(stage, "/broken", broken, [2, 2])
    UsdGeom.Mesh.Define(stage, "/head")
    UsdGeom.NurbsCurves.Define(stage, "/nurbs")
    UsdGeom.HermiteCurves.Define(stage, "/hermite")
    instancer = UsdGeom.PointInstancer.Define(stage, "/many")
    add_curves(stage, "/many/prototype", straight, [2])
    assert instancer
    stage.Save()
    read = read_usd(tmp_path / "a.usda")
    assert read.strands.strand_count == 2
    assert read.dropped == {"a point that is not finite": 1}
    assert dict(read.groom.group_names) == {0: "good", 1: "broken"}
    notes = "\n".join(read.notes)
    for message in (
        "/short was left out: its 1 counts of points add up to 3, but it has 2 points",
        "/closed was left out: its curves are closed",
        "/empty was left out: it has no curves",
        "1 HermiteCurves, 1 Mesh, 1 NurbsCurves, 1 PointInstancer",
    ):
        assert message in notes


def test_primvars_that_do_not_fit_are_left_out(tmp_path: Path) -> None:
    stage = new_stage(tmp_path / "a.usda")
    curves = add_curves(stage, "/hair", np.random.default_rng(1).random((5, 3)), [3, 2])
    api, types = UsdGeom.PrimvarsAPI(curves), Sdf.ValueTypeNames
    api.CreatePrimvar("groom_color", types.Float3Array, "vertex").Set([(1, 0, 0)] * 3)
    api.CreatePrimvar("groom_id", types.IntArray, "uniform").Set([8, 8])
    api.CreatePrimvar("groom_group_id", types.StringArray, "uniform").Set(["a", "b"])
    api.CreatePrimvar("groom_root_uv", types.Float3Array, "uniform").Set([(1, 0, 0)] * 2)
    curves.CreateWidthsAttr([1e-4, 5.0, -1.0, np.nan, 1e-4])
    stage.Save()
    read = read_usd(tmp_path / "a.usda")
    groom, notes = read.groom, "\n".join(read.notes)
    assert groom.color is groom.strand_id is groom.strands.root_uv is None
    assert groom.strands.group.tolist() == [0, 0]
    assert np.allclose(groom.strands.radius, [5e-5] * 5)
    assert "its groom_color were left out: 3 values where 'vertex' needs 5" in notes
    assert (
        "3 widths" in notes and "IDs were left out, because strands share them (2 of 2 do)" in notes
    )


def test_what_only_some_prims_have_is_left_out_and_counted(tmp_path: Path) -> None:
    stage = new_stage(tmp_path / "a.usda")
    for number in range(3):
        curves = add_curves(stage, f"/hair_{number}", np.random.default_rng(1).random((5, 3)), [5])
        if number:
            uv = UsdGeom.PrimvarsAPI(curves).CreatePrimvar(
                "groom_root_uv", Sdf.ValueTypeNames.Float2Array, "uniform"
            )
            uv.Set([(1, 0)])
    stage.Save()
    read = read_usd(tmp_path / "a.usda")
    assert read.strands.root_uv is None
    assert "root UVs were left out, which only 2 of its 3 prims have" in "\n".join(read.notes)


def test_a_file_without_usable_curves_is_an_error(tmp_path: Path) -> None:
    def complaint(name: str) -> str:
        with pytest.raises(HairloomError) as caught:
            read_usd(tmp_path / name)
        return str(caught.value)

    stage = new_stage(tmp_path / "mesh.usda")
    UsdGeom.Mesh.Define(stage, "/head")
    stage.Save()
    assert "it has no curves" in complaint("mesh.usda") and "1 Mesh" in complaint("mesh.usda")
    stage = new_stage(tmp_path / "lie.usdc")
    add_curves(stage, "/hair", np.eye(3), [2**31 - 1, 2**31 - 1])
    stage.Save()
    assert "add up to 4,294,967,294" in complaint("lie.usdc")
    stage = new_stage(tmp_path / "points.usdc")
    add_curves(stage, "/hair", np.zeros((4, 3)), [2, 2])
    stage.Save()
    assert "2 with no length" in complaint("points.usdc")
    (tmp_path / "empty.usd").touch()
    (tmp_path / "other.usd").write_bytes(b"Ogawa and so on")
    (tmp_path / "hair.abc").write_bytes(b"#usda 1.0")
    (tmp_path / "text.usda").write_text("#usda 1.0\ndef BasisCurves {{{")
    (tmp_path / "folder.usd").mkdir()
    assert "is empty" in complaint("empty.usd")
    assert "not a USD file" in complaint("other.usd")
    assert "not a suffix" in complaint("hair.abc")
    assert "cannot read it" in complaint("text.usda")
    assert "cannot be read" in complaint("folder.usd") and "cannot be read" in complaint("no.usd")


def test_what_cannot_be_written_is_an_error(tmp_path: Path) -> None:
    groom = full_groom()
    none = Groom(StrandSet(np.zeros((0, 3)), [0], [], []))
    (tmp_path / "taken.usdc").mkdir()
    short = GroomMotion([groom.strands.points[1:]], 24.0)
    for name, content, options, message in (
        ("a.abc", groom, {}, "not a suffix"),
        ("a.usdz", groom, {}, "not a suffix"),
        ("a.usdc", none, {}, "no strands"),
        ("a.usdc", groom, {"up": "X"}, "not an up axis"),
        ("a.usdc", groom, {"scale": 0.0}, "is not valid"),
        ("a.usdc", groom, {"motion": short}, "frame 1 has points that do not fit"),
        ("taken.usdc", groom, {}, "cannot be written"),
    ):
        with pytest.raises(HairloomError, match=message):
            write_usd(tmp_path / name, content, **options)
    assert [each.name for each in tmp_path.iterdir()] == ["taken.usdc"]


def test_without_the_library_a_message_says_so(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "pxr", None)
    for work in (
        lambda: write_usd(tmp_path / "a.usd", full_groom()),
        lambda: read_usd(tmp_path / "a.usd"),
    ):
        with pytest.raises(HairloomError, match="no library for USD"):
            work()


READ_ALL = """
import sys
from pathlib import Path
sys.path.insert(0, sys.argv[1])
from extension_loader import load_package
load_package()
from hairloom.addon.errors import HairloomError
from hairloom.addon.exchange.usd.groom_usd_read import read_usd
for path in sorted(Path(sys.argv[2]).iterdir()):
    try:
        print(path.name, read_usd(path).strands.strand_count, flush=True)
    except HairloomError:
        print(path.name, "refused", flush=True)
"""


@pytest.mark.parametrize(
    ("suffix", "count"),
    [
        (".usdc", 12),
        pytest.param(".usdc", 48, marks=pytest.mark.slow),
        pytest.param(".usda", 48, marks=pytest.mark.slow),
    ],
)
def test_damaged_files_are_refused_or_read(tmp_path: Path, suffix: str, count: int) -> None:
    """Cut, overwritten and shortened files; the process that reads them must not crash."""
    groom = full_groom()
    write_usd(tmp_path / f"whole{suffix}", groom, motion=motion_of(groom, 2))
    folder = tmp_path / "damaged"
    folder.mkdir()
    for number, content in enumerate(damaged((tmp_path / f"whole{suffix}").read_bytes(), count)):
        (folder / f"{number:03d}{suffix}").write_bytes(content)
    tools = Path(__file__).parents[3] / "tools"
    ended = subprocess.run(
        [sys.executable, "-c", READ_ALL, tools, folder],
        capture_output=True,
        text=True,
        timeout=600,
        check=False,
    )
    message = ended.stdout.split("\n")[:-1]
    assert ended.returncode == 0 and len(message) == count, (ended.stderr[-2000:], message[-1:])
    refused = sum(line.endswith("refused") for line in message)
    assert count / 4 < refused < count


def damaged(content: bytes, count: int) -> Iterator[bytes]:
    random = np.random.default_rng(5)
    for number in range(count):
        place = int(random.integers(len(content) - 8))
        changed = bytearray(content)
        if number % 4 == 0:
            yield content[:place]
        elif number % 4 == 1:
            del changed[place : place + int(random.integers(1, 64))]
            yield bytes(changed)
        elif number % 4 == 2:
            changed[place] = int(random.integers(256))
            yield bytes(changed)
        else:
            changed[place : place + 8] = int(1 << random.integers(63)).to_bytes(8, "little")
            yield bytes(changed)
