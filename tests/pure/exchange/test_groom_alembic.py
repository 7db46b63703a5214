"""Groom Alembic, read with the low level of Alembic's library, and files of other programs."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import tracemalloc
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from full_disk import full_disk

from hairloom.addon.errors import HairloomError
from hairloom.addon.exchange.alembic import groom_alembic
from hairloom.addon.exchange.alembic.groom_alembic import write_groom_alembic
from hairloom.addon.exchange.alembic.groom_alembic_read import read_groom_alembic
from hairloom.addon.exchange.files.child_process import same_packages
from hairloom.addon.exchange.files.file_space import FileSpace
from hairloom.addon.exchange.files.subprocess_reader import this_python
from hairloom.addon.exchange.groom import Groom, GroomMotion
from hairloom.addon.exchange.groom_presets import BLENDER, MIN_WIDTH, UNITY, UNREAL, preflight
from hairloom.addon.strands import StrandSet
from hairloom.addon.strands.strand_set import DEFAULT_RADIUS

pytest.importorskip("alembic3d", reason="it is missing: `make setup` installs it")
import imath
from alembic3d import Abc, AbcCoreAbstract, AbcGeom

COUNTS = np.array([4, 2, 7, 5, 3, 6])
GROUP = np.array([3, 3, 8, 8, 3, 8])
IS_GUIDE = np.array([True, False, False, True, True, False])
NAMES = {3: "fringe", 8: "back of head"}


def groom() -> Groom:
    """Six strands of different lengths in two groups; the first, fourth and fifth are guides."""
    random = np.random.default_rng(7)
    points, strands = int(COUNTS.sum()), len(COUNTS)
    offsets = np.concatenate([[0], np.cumsum(COUNTS)])
    return Groom(
        StrandSet(
            random.uniform(-0.3, 0.3, (points, 3)),
            offsets,
            random.uniform(1e-5, 8e-5, points),
            GROUP,
            random.random((strands, 2)),
            color=random.random((points, 3)),
        ),
        "Mira's hair",
        strand_id=[40, 41, 42, 43, 44, 45],
        is_guide=IS_GUIDE,
        closest_guides=np.tile([43, 40, 44], (strands, 1)),
        guide_weights=np.tile([0.5, 0.3, 0.2], (strands, 1)),
        group_names=NAMES,
    )


def straight(count: int = 2) -> Groom:
    """One upright strand, a metre long, with its root at (1, 2, 3)."""
    points = np.array([1.0, 2.0, 3.0]) + np.linspace([0, 0, 0], [0, 0, 1], count)
    return Groom(StrandSet(points, [0, count], np.full(count, 4e-5), [0]))


def first_below(path: Path) -> Iterator[tuple[Any, Any]]:
    """The single object below the top, with each of its children."""
    top = Abc.IArchive(str(path)).getTop()
    (above,) = list(top.children)
    for each in above.children:
        yield above, each


def geometry(thing: Any) -> Any:
    return Abc.ICompoundProperty(thing.getProperties(), ".geom")


def attribute(schema: Any, name: str) -> tuple[str, int, str, str, Any]:
    """Type, width, scope, interpretation and values of an attribute."""
    parent = Abc.ICompoundProperty(schema, ".arbGeomParams")
    header = parent.getPropertyHeader(name)
    kind, meta = header.getDataType(), header.getMetaData()
    values = np.array(Abc.IArrayProperty(parent, name).getValue())
    scope, meaning = meta.get("geoScope"), meta.get("interpretation")
    return kind.getPod().name, kind.getExtent(), scope, meaning, values


def own_values(schema: Any, name: str) -> np.ndarray:
    return np.array(Abc.IArrayProperty(schema, name).getValue())


def test_unreal_finds_every_attribute_with_its_type_and_scope(tmp_path: Path) -> None:
    path, hair = tmp_path / "a.abc", groom()
    write_groom_alembic(path, hair, UNREAL)
    ((_, curves),) = first_below(path)
    assert AbcGeom.ICurves.matches(curves.getMetaData())
    strands = hair.strands
    in_cm = strands.radius * np.float32(2.0) * np.float32(100.0)
    expected = {
        "groom_guide": ("kInt32POD", 1, "uni", "", IS_GUIDE),
        "groom_group_id": ("kInt32POD", 1, "uni", "", GROUP),
        "groom_id": ("kInt32POD", 1, "uni", "", hair.strand_id),
        "groom_root_uv": ("kFloat32POD", 2, "uni", "vector", strands.root_uv),
        "groom_width": ("kFloat32POD", 1, "vtx", "", in_cm),
        "groom_color": ("kFloat32POD", 3, "vtx", "vector", hair.color),
        "groom_closest_guides": ("kInt32POD", 3, "uni", "vector", hair.closest_guides),
        "groom_guide_weights": ("kFloat32POD", 3, "uni", "vector", hair.guide_weights),
    }
    for name, (*kind, values) in expected.items():
        *found_kind, found = attribute(geometry(curves), name)
        assert found_kind == kind, name
        np.testing.assert_array_equal(found, values, err_msg=name)


def test_unreal_finds_the_version_on_the_top_object(tmp_path: Path) -> None:
    write_groom_alembic(tmp_path / "a.abc", groom())
    ((top, _),) = first_below(tmp_path / "a.abc")
    assert AbcGeom.IXform.matches(top.getMetaData())
    transform = Abc.ICompoundProperty(top.getProperties(), ".xform")
    properties = Abc.ICompoundProperty(transform, ".userProperties")
    found = {}
    for header in properties.propertyheaders:
        value = Abc.IScalarProperty(properties, header.getName()).getValue()
        found[header.getName()] = (header.getDataType().getPod().name, value)
    assert found["groom_version_major"] == ("kInt16POD", 1)
    assert found["groom_version_minor"] == ("kInt16POD", 5)
    assert found["groom_tool"] == ("kStringPOD", "Hairloom")
    assert found["groom_properties"][0] == "kStringPOD"


@pytest.mark.parametrize(
    ("preset", "root", "tip", "width"),
    [
        (UNREAL, (100, -200, 300), (100, -200, 400), 0.008),
        (UNITY, (100, 300, -200), (100, 400, -200), 0.008),
        (BLENDER, (1, 3, -2), (1, 4, -2), 8e-5),
    ],
)
def test_a_metre_is_where_the_engine_expects_it(
    tmp_path: Path, preset: Any, root: Any, tip: Any, width: float
) -> None:
    write_groom_alembic(tmp_path / "a.abc", straight(), preset)
    ((_, curves),) = first_below(tmp_path / "a.abc")
    np.testing.assert_array_equal(own_values(geometry(curves), "P"), [root, tip])
    np.testing.assert_allclose(own_values(geometry(curves), "width"), width, rtol=1e-6)


def test_unity_gets_all_strands_in_an_object_for_each_group(tmp_path: Path) -> None:
    path, hair = tmp_path / "a.abc", groom()
    thin = replace(hair, strands=replace(hair.strands, radius=np.zeros(int(COUNTS.sum()))))
    write_groom_alembic(path, thin, UNITY)
    objects = {curves.getName(): geometry(curves) for _, curves in first_below(path)}
    assert list(objects) == ["fringe", "back_of_head"]
    for schema, group in zip(objects.values(), (3, 8), strict=True):
        chosen = np.flatnonzero((group == GROUP) & ~IS_GUIDE)
        np.testing.assert_array_equal(own_values(schema, "nVertices"), COUNTS[chosen])
        points = UNITY.space.to_file(hair.strands.take(chosen).points)
        np.testing.assert_array_equal(own_values(schema, "P"), points)
        np.testing.assert_allclose(own_values(schema, "width"), MIN_WIDTH * 100.0)
        uv = np.repeat(hair.strands.root_uv[chosen], COUNTS[chosen], axis=0)
        np.testing.assert_array_equal(own_values(schema, "uv"), uv)
        assert attribute(schema, "groom_group_id")[-1].tolist() == [group] * len(chosen)


def test_groups_are_in_memory_one_at_a_time(tmp_path: Path) -> None:
    """Unity's file has an object for each group. Memory of Alembic's own library is not counted
    here."""
    count, groups = 10_000, 40
    points = np.random.default_rng(3).random((count * 16, 3), np.float32)
    strands = StrandSet(
        points,
        np.arange(count + 1) * 16,
        np.full(count * 16, 5.0e-5),
        np.arange(count) % groups,
        np.zeros((count, 2)),
        color=points,
    )
    groom = Groom(strands, is_guide=np.arange(count) % 50 == 0)
    write_groom_alembic(tmp_path / "first.abc", groom, UNITY)  # loads the library
    tracemalloc.start()
    write_groom_alembic(tmp_path / "second.abc", groom, UNITY)
    peak_bytes = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak_bytes < 0.5 * points.nbytes


def test_all_comes_back_to_the_bit(tmp_path: Path) -> None:
    path, hair = tmp_path / "a.abc", groom()
    write_groom_alembic(path, hair, BLENDER)
    read = read_groom_alembic(path)
    assert read.version == "1.5"
    assert not read.notes
    assert not read.dropped
    assert read.groom.group_names == NAMES
    for name in ("points", "offsets", "radius", "group", "root_uv"):
        np.testing.assert_array_equal(getattr(read.strands, name), getattr(hair.strands, name))
    for name in ("color", "strand_id", "is_guide", "closest_guides", "guide_weights"):
        np.testing.assert_array_equal(getattr(read.groom, name), getattr(hair, name), name)
    assert read_groom_alembic(path, with_guides=False).strands.group.tolist() == [3, 8, 8]


@pytest.mark.parametrize("preset", [UNREAL, UNITY])
def test_our_files_say_their_own_units_and_axes(tmp_path: Path, preset: Any) -> None:
    write_groom_alembic(tmp_path / "a.abc", straight(), preset)
    strands = read_groom_alembic(tmp_path / "a.abc").strands
    np.testing.assert_allclose(strands.points, straight().strands.points, rtol=1e-6)
    np.testing.assert_allclose(strands.radius, 4e-5, rtol=1e-6)


def test_motion_has_times_and_each_frame(tmp_path: Path) -> None:
    path, hair = tmp_path / "a.abc", straight(5)
    frames = [hair.strands.points + np.float32(0.125 * i) for i in range(4)]
    cubic = replace(UNREAL, basis="cubic")
    motion = GroomMotion(iter(frames), rate=24.0, first_frame=10)
    write_groom_alembic(path, hair, cubic, motion=motion)
    ((_, curves),) = first_below(path)
    schema = AbcGeom.ICurves(curves, Abc.WrapExistingFlag.kWrapExisting).getSchema()
    assert schema.getNumSamples() == 4
    assert str(schema.getTopologyVariance()) == "kHomogenousTopology"
    times = [schema.getTimeSampling().getSampleTime(i) for i in range(4)]
    np.testing.assert_allclose(times, np.arange(10, 14) / 24.0)
    positions = Abc.IArrayProperty(geometry(curves), "P")
    for time, frame in zip(times, frames, strict=True):
        found = np.array(positions.getValue(Abc.ISampleSelector(time)))
        np.testing.assert_array_equal(found, UNREAL.space.to_file(frame))
    value = schema.getValue()
    assert str(value.getType()) == "kCubic"
    assert str(value.getBasis()) == "kCatmullromBasis"
    assert value.getKnots() is None


def test_attributes_without_a_plain_type_leave_the_rest_of_a_file_sound(tmp_path: Path) -> None:
    scope = AbcGeom.GeometryScope.kConstantScope
    archive = Abc.CreateArchiveWithInfo(str(tmp_path / "a.abc"), "Blender", "")
    schema = new_curves(archive.getTop(), "hair")
    parent = schema.getArbGeomParams()
    for kind, name, values in (
        ("Quatf", "groom_frame", imath.QuatfArray(1)),
        ("Box3f", "groom_id", imath.Box3fArray(1)),
    ):
        attribute = getattr(AbcGeom, f"O{kind}GeomParam")(parent, name, False, scope, 1)
        attribute.set(getattr(AbcGeom, f"O{kind}GeomParamSample")(values, scope))
    del attribute, parent, schema, archive
    read = read_groom_alembic(tmp_path / "a.abc")
    assert read.strands.points.tolist() == [[0, 0, 0], [0, 0, 1]]
    assert read.notes == ("a.abc: hair: groom_id is of another type.",)


def test_ids_that_strands_of_several_objects_share_are_left_out(tmp_path: Path) -> None:
    archive = Abc.CreateArchiveWithInfo(str(tmp_path / "a.abc"), "Blender", "")
    scope = AbcGeom.GeometryScope.kUniformScope
    for name in ("left", "right"):
        parent = new_curves(archive.getTop(), name).getArbGeomParams()
        ids = AbcGeom.OInt32GeomParam(parent, "groom_id", False, scope, 1)
        values = imath.IntArrayFromBuffer(np.array([7], np.int32))
        ids.set(AbcGeom.OInt32GeomParamSample(values, scope))
    del ids, parent, archive
    read = read_groom_alembic(tmp_path / "a.abc")
    assert read.groom.strand_id is None and read.strands.strand_count == 2
    assert "a.abc: IDs were left out, because strands share them (2 of 2 do)." in read.notes


def test_closed_curves_are_left_out_with_a_note(tmp_path: Path) -> None:
    for file, names in (("some.abc", ("hair", "loop")), ("none.abc", ("loop",))):
        archive = Abc.CreateArchiveWithInfo(str(tmp_path / file), "Blender", "")
        for name in names:
            new_curves(archive.getTop(), name, is_closed=name == "loop")
        del archive
    read = read_groom_alembic(tmp_path / "some.abc")
    assert read.strands.strand_count == 1
    assert read.notes == ("some.abc: loop was left out: its curves are closed.",)
    with pytest.raises(HairloomError, match="loop was left out: its curves are closed"):
        read_groom_alembic(tmp_path / "none.abc")


def new_curves(parent: Any, name: str, *, is_closed: bool = False) -> Any:
    """The schema of an object with a curve from (0, 0, 0) to (0, 1, 0)."""
    schema = AbcGeom.OCurves(parent, name).getSchema()
    sample = AbcGeom.OCurvesSchemaSample()
    control = np.array([[0, 0, 0], [0, 1, 0]], np.float32)
    sample.setPositions(imath.V3fArrayFromBuffer(control))
    sample.setCurvesNumVertices(imath.IntArrayFromBuffer(np.array([2], np.int32)))
    sample.setType(AbcGeom.CurveType.kLinear)
    if is_closed:
        sample.setWrap(AbcGeom.CurvePeriodicity.kPeriodic)
    schema.set(sample)
    return schema


def moving(path: Path, points: Any, places: Any, *, inherits: bool = True) -> None:
    """A curve from (0, 0, 0) to (0, 1, 0) below two transforms, the outer one 5 to the right.

    Args:
        points, places: time [s] -> offset of the curve upwards, and of the inner transform to the
            right, at equal time steps.
    """

    def sampling(times: Any) -> int:
        first, second, *_ = *times, 1.0
        return int(archive.addTimeSampling(AbcCoreAbstract.TimeSampling(second - first, first)))

    archive = Abc.CreateArchiveWithInfo(str(path), "Blender", "")
    outer = AbcGeom.OXform(archive.getTop(), "outer")
    sample = AbcGeom.XformSample()
    sample.setTranslation(imath.V3d(5, 0, 0))
    outer.getSchema().set(sample)
    inner = AbcGeom.OXform(outer, "inner", sampling(places))
    for right in places.values():
        sample = AbcGeom.XformSample()
        sample.setTranslation(imath.V3d(right, 0, 0))
        sample.setInheritsXforms(inherits)
        inner.getSchema().set(sample)
    schema = AbcGeom.OCurves(inner, "hair", sampling(points)).getSchema()
    for up in points.values():
        sample = AbcGeom.OCurvesSchemaSample()
        control = np.array([[0, up, 0], [0, up + 1, 0]], np.float32)
        sample.setPositions(imath.V3fArrayFromBuffer(control))
        sample.setCurvesNumVertices(imath.IntArrayFromBuffer(np.array([2], np.int32)))
        schema.set(sample)


def test_points_and_places_go_straight_between_their_own_samples(tmp_path: Path) -> None:
    points, places = {0.0: 0.0, 1.0: 4.0}, {0.25: 0.0, 0.75: 1.0, 1.25: 3.0}
    moving(tmp_path / "a.abc", points, places)
    motion = read_groom_alembic(tmp_path / "a.abc").groom.motion
    assert motion is not None and motion.times.tolist() == [0.0, 0.25, 0.75, 1.0, 1.25]
    ups = np.interp(motion.times, list(points), list(points.values()))
    rights = np.interp(motion.times, list(places), list(places.values()))
    np.testing.assert_allclose(motion.positions[:, 0, 2], ups, atol=1e-6)
    np.testing.assert_allclose(motion.positions[:, 0, 0], 5.0 + rights, atol=1e-6)


def test_a_transform_that_does_not_inherit_leaves_those_above_out(tmp_path: Path) -> None:
    moving(tmp_path / "a.abc", {0.0: 0.0}, {0.0: 2.0, 1.0: 3.0}, inherits=False)
    read = read_groom_alembic(tmp_path / "a.abc")
    assert read.strands.points[:, 0].tolist() == [2.0, 2.0]
    assert read.groom.motion is not None
    assert read.groom.motion.positions[:, 0, 0].tolist() == [2.0, 3.0]


def test_long_curves_alone_are_resampled(tmp_path: Path) -> None:
    path = tmp_path / "a.abc"
    points = np.concatenate([np.linspace([0, 0, 0], [0, 0, 3], 301), [[5, 0, 0], [5, 0, 1.5]]])
    radius = np.concatenate([np.linspace(3e-5, 0.0, 301), [2e-5, 1e-5]])
    hair = Groom(StrandSet(points, [0, 301, 303], radius, [1, 2], color=points))
    motion = GroomMotion([hair.strands.points, hair.strands.points * 2], rate=25.0)
    write_groom_alembic(path, hair, replace(BLENDER, max_points=4), motion=motion)
    ((_, curves),) = first_below(path)
    assert own_values(geometry(curves), "nVertices").tolist() == [4, 2]
    expected = np.array([(0, 0, 0), (0, 0, 1), (0, 0, 2), (0, 0, 3), (5, 0, 0), (5, 0, 1.5)])
    read = read_groom_alembic(path)
    np.testing.assert_allclose(read.strands.points, expected, atol=1e-6)
    np.testing.assert_allclose(read.groom.color, expected, atol=1e-6)
    np.testing.assert_allclose(
        read.strands.radius[:4], [3e-5, 2e-5, 1e-5, 0.5 * MIN_WIDTH], rtol=1e-3
    )
    assert read.strands.group.tolist() == [1, 2]
    later = Abc.IArrayProperty(geometry(curves), "P").getValue(Abc.ISampleSelector(2 / 25.0))
    np.testing.assert_allclose(later, BLENDER.space.to_file(expected * 2), atol=1e-6)


def foreign(path: Path, application: str = "Maya") -> None:
    """Two curves objects under a moved one, as other exporters write them: centimetres, Y up,
    constant scopes, short integers, colours, widths for the whole object."""
    scope = AbcGeom.GeometryScope
    archive = Abc.CreateArchiveWithInfo(str(path), application, "")
    top = AbcGeom.OXform(archive.getTop(), "hair")
    place = AbcGeom.XformSample()
    place.setTranslation(imath.V3d(0, 10, 0))
    top.getSchema().set(place)
    for number, name in enumerate(("strands", "guides")):
        schema = AbcGeom.OCurves(top, name).getSchema()
        sample = AbcGeom.OCurvesSchemaSample()
        points = np.array([[0, 0, 5], [0, 20, 5], [1, 0, 0], [1, 30, 0]], np.float32) + number
        sample.setPositions(imath.V3fArrayFromBuffer(points))
        sample.setCurvesNumVertices(imath.IntArrayFromBuffer(np.array([2, 2], np.int32)))
        width = imath.FloatArrayFromBuffer(np.array([0.01], np.float32))
        sample.setWidths(AbcGeom.OFloatGeomParamSample(width, scope.kConstantScope))
        schema.set(sample)
        parent = schema.getArbGeomParams()
        guide = AbcGeom.OInt16GeomParam(parent, "groom_guide", False, scope.kConstantScope, 1)
        values = imath.ShortArray(1)
        values[0] = number
        guide.set(AbcGeom.OInt16GeomParamSample(values, scope.kConstantScope))
        if not number:
            color = AbcGeom.OC3fGeomParam(parent, "groom_color", False, scope.kUniformScope, 1)
            values = imath.C3fArray(2)
            values[1] = imath.Color3f(0.25, 0.5, 0.75)
            color.set(AbcGeom.OC3fGeomParamSample(values, scope.kUniformScope))
            wrong = AbcGeom.OInt32GeomParam(parent, "groom_id", False, scope.kUniformScope, 1)
            values = imath.IntArrayFromBuffer(np.arange(3, dtype=np.int32))
            wrong.set(AbcGeom.OInt32GeomParamSample(values, scope.kUniformScope))


def test_bezier_curves_become_points_on_them(tmp_path: Path) -> None:
    """Points at thirds, against De Casteljau's construction; widths are those of ends, as Blender
    writes them."""
    archive = Abc.CreateArchiveWithInfo(str(tmp_path / "a.abc"), "Blender", "")
    schema = AbcGeom.OCurves(archive.getTop(), "hair").getSchema()
    sample = AbcGeom.OCurvesSchemaSample()
    control = np.array([[0, 0, 0], [0, 3, 0], [3, 3, 0], [3, 0, 0]], np.float32)
    sample.setPositions(imath.V3fArrayFromBuffer(control))
    sample.setCurvesNumVertices(imath.IntArrayFromBuffer(np.array([4], np.int32)))
    sample.setType(AbcGeom.CurveType.kCubic)
    sample.setBasis(AbcGeom.BasisType.kBezierBasis)
    widths = imath.FloatArrayFromBuffer(np.array([0.06, 0.03], np.float32))
    sample.setWidths(AbcGeom.OFloatGeomParamSample(widths, AbcGeom.GeometryScope.kVaryingScope))
    schema.set(sample)
    del schema, archive
    read = read_groom_alembic(tmp_path / "a.abc")
    thirds = [(0, 0), (7 / 9, 2), (20 / 9, 2), (3, 0)]
    np.testing.assert_allclose(read.strands.points, [(x, 0, y) for x, y in thirds], atol=1e-5)
    np.testing.assert_allclose(read.strands.radius, [0.03, 0.025, 0.02, 0.015], rtol=1e-5)
    assert "a.abc: hair: its bezier curves were converted to points on the curves." in read.notes


def test_files_of_other_programs_are_read(tmp_path: Path) -> None:
    foreign(tmp_path / "a.abc")
    read = read_groom_alembic(tmp_path / "a.abc")
    expected = [(0, -0.05, 0.1), (0, -0.05, 0.3), (0.01, 0, 0.1), (0.01, 0, 0.4)]
    np.testing.assert_allclose(read.strands.points[:4], expected, atol=1e-6)
    np.testing.assert_allclose(read.strands.radius, 5e-5, rtol=1e-6)
    assert read.strands.group.tolist() == [0, 0, 1, 1]
    assert read.groom.group_names == {0: "strands", 1: "guides"}
    assert read.groom.is_guide.tolist() == [False, False, True, True]
    assert read.groom.color[2].tolist() == read.groom.color[3].tolist() == [0.25, 0.5, 0.75]
    assert read.groom.strand_id is None
    assert "a.abc: strands: groom_id has 3 values." in read.notes
    assert read_groom_alembic(tmp_path / "a.abc", with_guides=False).strands.strand_count == 2


def test_the_space_of_a_foreign_file_can_be_given(tmp_path: Path) -> None:
    foreign(tmp_path / "a.abc")
    read = read_groom_alembic(tmp_path / "a.abc", space=FileSpace("Z", 1000.0))
    np.testing.assert_allclose(read.strands.points[0], (0, 0.010, 0.005), atol=1e-7)
    foreign(tmp_path / "b.abc", "Blender 5.2")
    strands = read_groom_alembic(tmp_path / "b.abc").strands
    np.testing.assert_allclose(strands.points[0], (0, -5, 10))


def test_unusable_strands_are_dropped_and_counted(tmp_path: Path) -> None:
    path, hair = tmp_path / "a.abc", groom()
    write_groom_alembic(path, hair, replace(BLENDER, max_points=10))
    content = path.read_bytes()
    second = BLENDER.space.to_file(hair.strands.points[4:6])
    broken = second.copy()
    broken[0, 1] = np.nan
    assert content.count(second.tobytes()) == 1
    path.write_bytes(content.replace(second.tobytes(), broken.tobytes()))
    read = read_groom_alembic(path)
    assert read.dropped == {"a point that is not finite": 1}
    kept = hair.take(np.array([0, 2, 3, 4, 5]))
    np.testing.assert_array_equal(read.groom.color, kept.color)
    np.testing.assert_array_equal(read.groom.strand_id, kept.strand_id)


def test_counts_that_do_not_fit_are_reported(tmp_path: Path) -> None:
    path = tmp_path / "a.abc"
    write_groom_alembic(path, groom(), BLENDER)
    counts = COUNTS.astype("<i4")
    content = path.read_bytes()
    assert content.count(counts.tobytes()) == 1
    for lie in ([4, 2, 7, 5, 3, 7], [4, 2, 7, 5, 3, 1 << 30], [4, 2, 7, 5, -3, 6]):
        path.write_bytes(content.replace(counts.tobytes(), np.array(lie, "<i4").tobytes()))
        with pytest.raises(HairloomError, match=r"its curves need .* points, but it has 27"):
            read_groom_alembic(path)


def test_zero_widths_are_replaced_and_thin_tips_stay(tmp_path: Path) -> None:
    path, hair = tmp_path / "a.abc", straight(3)
    for width, expected in (
        ([0.0, 0.0, 0.0], [DEFAULT_RADIUS] * 3),
        ([6e-5, 3e-5, 0.0], [3e-5, 1.5e-5, 3e-8]),
    ):
        archive = Abc.OArchive(str(path))
        schema = AbcGeom.OCurves(archive.getTop(), "hair").getSchema()
        sample = AbcGeom.OCurvesSchemaSample()
        sample.setPositions(imath.V3fArrayFromBuffer(BLENDER.space.to_file(hair.strands.points)))
        sample.setCurvesNumVertices(imath.IntArrayFromBuffer(np.array([3], np.int32)))
        values = imath.FloatArrayFromBuffer(np.array(width, np.float32))
        vertex = AbcGeom.GeometryScope.kVertexScope
        sample.setWidths(AbcGeom.OFloatGeomParamSample(values, vertex))
        schema.set(sample)
        del archive, schema, sample
        np.testing.assert_allclose(read_groom_alembic(path).strands.radius, expected, rtol=1e-5)


def test_an_archive_without_curves_is_refused(tmp_path: Path) -> None:
    archive = Abc.OArchive(str(tmp_path / "a.abc"))
    AbcGeom.OXform(archive.getTop(), "empty")
    del archive
    with pytest.raises(HairloomError, match=r"there are no curves in it\. Export hair curves"):
        read_groom_alembic(tmp_path / "a.abc")


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"", "the file is empty"),
        (b"solid cube", "this is not an Alembic file"),
        (b"\x89HDF\r\n\x1a\n" + bytes(100), "HDF5"),
        (b"Ogawa\0" + bytes(100), "not written to its end"),
    ],
)
def test_files_of_other_formats_are_refused(tmp_path: Path, content: bytes, message: str) -> None:
    (tmp_path / "a.abc").write_bytes(content)
    with pytest.raises(HairloomError, match=message):
        read_groom_alembic(tmp_path / "a.abc")


def test_missing_files_and_folders_are_refused(tmp_path: Path) -> None:
    with pytest.raises(HairloomError, match="a folder"):
        read_groom_alembic(tmp_path)
    with pytest.raises(HairloomError, match="cannot be read"):
        read_groom_alembic(tmp_path / "none.abc")


@pytest.mark.slow(
    instead="tests/pure/exchange/test_fuzz.py::test_damage_to_files_that_libraries_parse_is_reported"
)
def test_damaged_files_are_read_or_refused(tmp_path: Path) -> None:
    """A sample of thousands of trials: cut files, and random bytes near the end."""
    path = tmp_path / "a.abc"
    write_groom_alembic(path, groom())
    content, random = path.read_bytes(), np.random.default_rng(3)
    for number in range(9):
        damaged = bytearray(content)
        if number % 3 == 0:
            damaged = damaged[: random.integers(6, len(damaged))]
        else:
            for place in random.integers(8, len(damaged), 4):
                damaged[place] = random.integers(256)
        path.write_bytes(damaged)
        try:
            assert read_groom_alembic(path).strands.strand_count
        except HairloomError as error:
            assert error.place == str(path)


@pytest.mark.parametrize(
    ("code", "message"),
    [
        (f"import os; os.kill(os.getpid(), {int(signal.SIGSEGV)})", "library failed on it"),
        ("import sys; print('some', 'reason.', file=sys.stderr); sys.exit(3)", "says: some reason"),
    ],
)
def test_a_crash_stays_in_the_other_process(tmp_path: Path, code: str, message: str) -> None:
    write_groom_alembic(tmp_path / "a.abc", groom())
    with pytest.raises(HairloomError, match=message):
        read_groom_alembic(tmp_path / "a.abc", python=[sys.executable, "-c", code])


def test_without_the_library_usd_is_offered(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    write_groom_alembic(tmp_path / "a.abc", groom())
    monkeypatch.setitem(sys.modules, "alembic3d", None)
    for act in (
        lambda: write_groom_alembic(tmp_path / "b.abc", groom()),
        lambda: read_groom_alembic(tmp_path / "a.abc"),
    ):
        with pytest.raises(HairloomError, match=r"cannot be loaded .*Use USD instead"):
            act()
    assert not (tmp_path / "b.abc").exists()


def test_a_failed_write_leaves_the_old_file(tmp_path: Path) -> None:
    path, hair = tmp_path / "a.abc", straight()
    path.write_bytes(b"old")
    bad = [hair.strands.points, np.full((2, 3), np.nan)]
    for groom_, motion, message in (
        (hair, GroomMotion(bad, 24.0), "a frame does not have finite points"),
        (hair, GroomMotion([hair.strands.points[:1]], 24.0), "a frame does not have"),
        (hair, GroomMotion([], 24.0), r"found none"),
        (hair, GroomMotion(bad, 0.0), "0.0 frames a second"),
        (hair.take(np.array([], int)), None, "there are no strands to write"),
    ):
        with pytest.raises(HairloomError, match=message):
            write_groom_alembic(path, groom_, motion=motion)
    assert path.read_bytes() == b"old"
    assert list(tmp_path.iterdir()) == [path]


def test_a_full_disk_is_reported(tmp_path: Path) -> None:
    """Simulated with a limit on the size of files."""
    path = tmp_path / "a.abc"
    path.write_bytes(b"old")
    with full_disk(2000), pytest.raises(HairloomError, match="this file cannot be written"):
        write_groom_alembic(path, groom())
    assert path.read_bytes() == b"old"
    assert list(tmp_path.iterdir()) == [path]


def test_the_reader_of_curves_is_a_program_of_its_own(tmp_path: Path) -> None:
    """It must run without the package, and so without Blender."""
    from hairloom.addon.exchange.alembic import alembic_curves

    write_groom_alembic(tmp_path / "a.abc", groom())
    command = [*this_python(tmp_path), alembic_curves.__file__, tmp_path / "a.abc", tmp_path / "r"]
    subprocess.run(command, check=True, env=os.environ | same_packages())
    with np.load(tmp_path / "r") as arrays:
        assert arrays["0/points"].shape == (27, 3)


def test_preflight_says_what_the_engine_will_see() -> None:
    found = preflight(groom(), UNREAL)
    assert (found["strands"], found["guides"], found["points"]) == (3, 3, 27)
    assert found["groups"] == {3: 1, 8: 2}, "guides are counted apart"
    assert found["points_per_curve"] == (2, 7)
    radius = groom().strands.radius
    np.testing.assert_allclose(found["width"], (200 * radius.min(), 200 * radius.max()))
    assert found["warnings"] == []
    found = preflight(straight(3), UNREAL)
    assert (found["lowest"], found["highest"]) == ([100, -200, 300], [100, -200, 400])
    np.testing.assert_allclose(found["length"], (100, 100))


@pytest.mark.parametrize(
    ("change", "preset", "warning"),
    [
        ({"radius": np.zeros(27)}, UNREAL, "27 points have no width"),
        ({"radius": np.full(27, 0.1)}, UNREAL, "Widths reach"),
        ({"group": np.zeros(6)}, UNREAL, "in one group"),
        ({"root_uv": None}, UNREAL, "no root UVs"),
        ({}, replace(UNREAL, max_points=5), "2 strands are resampled to 5 points"),
        ({}, UNITY, "1 strands have fewer than 3 points"),
        ({}, replace(UNREAL, max_strands=2), "A group has 3 strands; the engine takes 2"),
        ({}, UNITY, "Closest guides are left out"),
    ],
)
def test_preflight_warns(change: Any, preset: Any, warning: str) -> None:
    hair = groom()
    found = preflight(replace(hair, strands=replace(hair.strands, **change)), preset)
    assert any(warning in each for each in found["warnings"]), found["warnings"]


def test_preflight_without_strands_warns() -> None:
    none = groom().take(np.array([], int))
    assert preflight(none, UNREAL)["warnings"] == ["The engine will see no strands"]
    no_guides = replace(groom(), is_guide=np.zeros(6, bool))
    guides = replace(UNREAL, parts="guides")
    assert preflight(no_guides, guides)["warnings"] == ["The engine will see no guides"]


@pytest.mark.parametrize(
    ("version", "expected"), [((1, 10), "1.10"), ((1, -5), ""), ((0, 3), "0.3")]
)
def test_versions_are_read_as_they_are(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, version: tuple[int, int], expected: str
) -> None:
    monkeypatch.setattr(groom_alembic, "VERSION", version)
    write_groom_alembic(tmp_path / "a.abc", groom(), BLENDER)
    assert read_groom_alembic(tmp_path / "a.abc").version == expected
