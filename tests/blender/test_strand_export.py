"""Strands out of the open scene, read back by Alembic's own lower level and by usd-core."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import bpy
import numpy as np
import pytest

from hairloom.addon.errors import HairloomError
from hairloom.addon.exchange.groom import Groom
from hairloom.addon.exchange.hair_file import read_hair_file
from hairloom.addon.exchange.strand_formats import ALEMBIC, TRESSFX, USD
from hairloom.addon.exchange.strand_output import StrandOutput
from hairloom.addon.exchange.tfxbone import read_tfxbone
from hairloom.addon.exchange.tressfx import read_tfx
from hairloom.addon.host.bakes import playback
from hairloom.addon.host.bakes.bake import Bake
from hairloom.addon.host.scene.curves import write_curves
from hairloom.addon.host.strands.export_check import ExportCheck
from hairloom.addon.host.strands.groom_attributes import store_groom
from hairloom.addon.host.strands.groom_out import Wishes, still_hair
from hairloom.addon.host.strands.strand_export import StrandExport
from hairloom.addon.strands import StrandSet

pytest.importorskip("alembic3d", reason="it is missing: `make setup` installs it")
from alembic3d import Abc, AbcGeom

LAST = 6


def hedgehog(count: int = 60, points: int = 8, seed: int = 1) -> StrandSet:
    """Straight strands that stand on the sphere of radius 0.1 m, in two groups."""
    outward = np.random.default_rng(seed).normal(size=(count, 3))
    outward /= np.linalg.norm(outward, axis=1, keepdims=True)
    along = 0.1 + np.linspace(0.0, 0.08, points)
    return StrandSet(
        points=(outward[:, None] * along[:, None]).reshape(-1, 3),
        offsets=np.arange(count + 1) * points,
        radius=np.full(count * points, 5.0e-5),
        group=np.arange(count) % 2,
    )


def curves_of(path: Path) -> dict[str, dict[str, Any]]:
    """Curves objects of an Alembic file by name: points of all samples, times, attributes."""
    archive = Abc.IArchive(str(path))
    (above,) = list(archive.getTop().children)
    found = {}
    for each in above.children:
        schema = AbcGeom.ICurves(above, each.getName()).getSchema()
        sampling = schema.getTimeSampling()
        times = [sampling.getSampleTime(i) for i in range(schema.getNumSamples())]
        samples = [schema.getValue(Abc.ISampleSelector(time)) for time in times]
        geometry = Abc.ICompoundProperty(each.getProperties(), ".geom")
        extra = Abc.ICompoundProperty(geometry, ".arbGeomParams")
        values = {
            name: np.array(Abc.IArrayProperty(extra, name).getValue())
            for name in (
                extra.getPropertyHeader(i).getName() for i in range(extra.getNumProperties())
            )
            if name != "groom_group_name"
        }
        found[each.getName()] = {
            "points": [np.array(sample.getPositions()) for sample in samples],
            "times": times,
            "counts": np.array(samples[0].getCurvesNumVertices()),
            **values,
        }
    return found


def stage_of(path: Path) -> tuple[Any, Any]:
    """The stage and its one prim of curves."""
    usd = pytest.importorskip("pxr.Usd", reason="usd-core is missing: `make setup` installs it")
    from pxr import UsdGeom

    stage = usd.Stage.Open(str(path))
    (prim,) = (prim for prim in stage.Traverse() if prim.IsA(UsdGeom.BasisCurves))
    return stage, UsdGeom.BasisCurves(prim)


def straight(place: tuple[float, float, float] = (1.0, 2.0, 3.0)) -> StrandSet:
    """Two strands, a metre long, the first of which stands at a place."""
    points = np.array(place) + np.linspace([0, 0, 0], [0, 0, 1], 5)
    both = np.concatenate([points, points + (0.1, 0.0, 0.0)])
    return StrandSet(both, [0, 5, 10], np.full(10, 4e-5), [0, 0])


def to_unreal(points: np.ndarray) -> np.ndarray:
    """After Epic: centimetres, and y the other way."""
    return np.asarray(points) * [100.0, -100.0, 100.0]


def push_up(hair: Any, amount: float, *, frame_driven: bool = False) -> Any:
    """A geometry nodes modifier that moves all points up, in metres, or metres a frame."""
    tree = bpy.data.node_groups.new("Push", "GeometryNodeTree")
    tree.interface.new_socket("Geometry", in_out="INPUT", socket_type="NodeSocketGeometry")
    tree.interface.new_socket("Geometry", in_out="OUTPUT", socket_type="NodeSocketGeometry")
    begin, end = tree.nodes.new("NodeGroupInput"), tree.nodes.new("NodeGroupOutput")
    move = tree.nodes.new("GeometryNodeSetPosition")
    scale = tree.nodes.new("ShaderNodeVectorMath")
    scale.operation = "SCALE"
    scale.inputs[0].default_value = (0.0, 0.0, 1.0)
    scale.inputs["Scale"].default_value = amount
    if frame_driven:
        clock = tree.nodes.new("GeometryNodeInputSceneTime")
        times = tree.nodes.new("ShaderNodeMath")
        times.operation = "MULTIPLY"
        times.inputs[1].default_value = amount
        tree.links.new(clock.outputs["Frame"], times.inputs[0])
        tree.links.new(times.outputs[0], scale.inputs["Scale"])
    tree.links.new(scale.outputs[0], move.inputs["Offset"])
    tree.links.new(begin.outputs[0], move.inputs["Geometry"])
    tree.links.new(move.outputs[0], end.inputs[0])
    modifier = hair.modifiers.new("Push", "NODES")
    modifier.node_group = tree
    return modifier


@pytest.fixture
def told(capfd: pytest.CaptureFixture[str]) -> Callable[[], str]:
    return lambda: "".join(capfd.readouterr())


@pytest.fixture
def swinging(new_hair: Any, sphere: Any, tmp_path: Path) -> tuple[Any, Any]:
    """Hair on a head that is thrown about for some frames: (hair, head)."""
    hair = new_hair(sphere)
    scene = bpy.context.scene
    scene.frame_start, scene.frame_end = 1, LAST
    for frame, x in ((1, 0.0), (3, 0.1), (LAST, -0.05)):
        sphere.location.x = x
        sphere.keyframe_insert("location", frame=frame)
    hair.hairloom.dynamics.collider_resolution = 8
    hair.hairloom.dynamics.form = "numpy"
    hair.hairloom.bake.folder = str(tmp_path / "bake")
    scene.frame_set(1)
    return hair, sphere


def bake(*objects: Any, **options: Any) -> None:
    list(Bake.of(list(objects), bpy.context.scene, **options).steps())


def test_a_strand_of_a_metre_stands_where_unreal_looks_for_it(
    new_hair: Any, tmp_path: Path
) -> None:
    new_hair(strands=straight())
    path = tmp_path / "hair.abc"
    assert bpy.ops.hairloom.export_alembic(filepath=str(path), parts="strands") == {"FINISHED"}
    (curves,) = curves_of(path).values()
    np.testing.assert_allclose(curves["points"][0][0], [100.0, -200.0, 300.0], rtol=1e-6)
    np.testing.assert_allclose(curves["points"][0][4], [100.0, -200.0, 400.0], rtol=1e-6)
    np.testing.assert_allclose(curves["groom_width"], 8e-3, rtol=1e-6)


@pytest.mark.parametrize(
    ("engine", "up", "unit", "root"),
    [
        ("unreal", "Z", 0.01, (100.0, 200.0, 300.0)),
        ("maya", "Y", 0.01, (100.0, 300.0, -200.0)),
        ("blender", "Z", 1.0, (1.0, 2.0, 3.0)),
    ],
)
def test_usd_says_its_unit_and_axes(
    new_hair: Any, tmp_path: Path, engine: str, up: str, unit: float, root: Any
) -> None:
    new_hair(strands=straight())
    path = tmp_path / "hair.usdc"
    bpy.ops.hairloom.export_usd(filepath=str(path), engine=engine, parts="strands")
    stage, curves = stage_of(path)
    from pxr import UsdGeom

    assert (UsdGeom.GetStageUpAxis(stage), UsdGeom.GetStageMetersPerUnit(stage)) == (up, unit)
    np.testing.assert_allclose(curves.GetPointsAttr().Get()[0], root, rtol=1e-6)
    np.testing.assert_allclose(curves.GetWidthsAttr().Get()[0], 8e-5 / unit, rtol=1e-5)


def test_own_axes_and_unit_go_over_those_of_the_program(new_hair: Any, tmp_path: Path) -> None:
    new_hair(strands=straight())
    path = tmp_path / "hair.usda"
    bpy.ops.hairloom.export_usd(
        filepath=str(path), engine="unreal", own_space=True, up="Y", scale=0.1, parts="strands"
    )
    _, curves = stage_of(path)
    np.testing.assert_allclose(curves.GetPointsAttr().Get()[0], (10.0, 30.0, -20.0), rtol=1e-6)
    bpy.ops.hairloom.export_hair(filepath=str(tmp_path / "h.hair"), up="Y", scale=0.01)
    read = read_hair_file(tmp_path / "h.hair", up="Z", scale=1.0).strands
    np.testing.assert_allclose(read.points[0], (100.0, 300.0, -200.0), rtol=1e-6)


def test_guides_lie_beside_the_strands_and_name_what_rides_on_them(
    new_hair: Any, sphere: Any, tmp_path: Path
) -> None:
    hair = new_hair(sphere)
    hair.data.hairloom.guides.guide_count = 7
    path = tmp_path / "hair.abc"
    bpy.ops.hairloom.export_alembic(filepath=str(path))
    (curves,) = curves_of(path).values()
    guide, ids = curves["groom_guide"] == 1, curves["groom_id"]
    assert (len(guide), guide.sum()) == (67, 7) and len(np.unique(ids)) == 67
    assert np.isin(curves["groom_closest_guides"], ids[guide]).all()
    np.testing.assert_allclose(curves["groom_guide_weights"].sum(axis=1), 1.0, rtol=1e-5)
    roots = curves["points"][0].reshape(67, 8, 3)[:, 0]
    of_id = dict(zip(ids.tolist(), roots, strict=True))
    for strand in range(60):
        own = [
            np.linalg.norm(of_id[closest] - roots[strand])
            for closest in curves["groom_closest_guides"][strand].tolist()
        ]
        others = curves["groom_group_id"][guide] == curves["groom_group_id"][strand]
        nearest = np.linalg.norm(roots[guide][others] - roots[strand], axis=1).min()
        assert min(own) == pytest.approx(nearest), "the nearest guide of its group is one of three"
    assert curves["groom_root_uv"].shape == (67, 2) and np.ptp(curves["groom_root_uv"]) > 0.5


def test_modifiers_are_in_the_file_and_the_scene_is_untouched(
    new_hair: Any, tmp_path: Path
) -> None:
    hair = new_hair(strands=straight())
    push_up(hair, 0.25)
    before = np.empty(30, np.float32)
    hair.data.position_data.foreach_get("vector", before)
    blocks = {data.name_full for data in bpy.data.user_map()}
    path = tmp_path / "hair.abc"
    bpy.ops.hairloom.export_alembic(filepath=str(path), parts="strands")
    (curves,) = curves_of(path).values()
    expected = to_unreal(straight().points + np.array([0.0, 0.0, 0.25]))
    np.testing.assert_allclose(curves["points"][0], expected, rtol=1e-5)
    after = np.empty(30, np.float32)
    hair.data.position_data.foreach_get("vector", after)
    np.testing.assert_array_equal(before, after)
    assert {data.name_full for data in bpy.data.user_map()} == blocks
    assert [modifier.name for modifier in hair.modifiers] == ["Push"]


def test_point_counts_of_their_own_stay(new_hair: Any, tmp_path: Path) -> None:
    counts = np.array([4, 9, 2, 30])
    points = np.concatenate([np.linspace([i, 0, 0], [i, 0, 0.1], n) for i, n in enumerate(counts)])
    offsets = np.concatenate([[0], np.cumsum(counts)])
    new_hair(strands=StrandSet(points * 0.1, offsets, np.full(counts.sum(), 5e-5), [0] * 4))
    bpy.ops.hairloom.export_alembic(filepath=str(tmp_path / "a.abc"), parts="strands")
    (curves,) = curves_of(tmp_path / "a.abc").values()
    np.testing.assert_array_equal(curves["counts"], counts)


def test_what_the_hair_says_of_itself_is_in_the_file(new_hair: Any, tmp_path: Path) -> None:
    hair, strands = new_hair(), hedgehog()
    random = np.random.default_rng(3)
    is_guide = np.arange(60) % 20 < 2  # of both groups
    said = Groom(
        strands,
        color=random.random((480, 3)),
        strand_id=np.arange(60) * 3 + 7,
        is_guide=is_guide,
        group_names={0: "crown", 1: "nape"},
    )
    store_groom(hair.data, said)
    path = tmp_path / "hair.abc"
    bpy.ops.hairloom.export_alembic(filepath=str(path), by_group=True)
    found = curves_of(path)
    assert set(found) == {"crown", "nape"}
    for group, name in ((0, "crown"), (1, "nape")):
        own = strands.group == group
        np.testing.assert_array_equal(found[name]["groom_id"], said.strand_id[own])
        np.testing.assert_array_equal(found[name]["groom_guide"], is_guide[own])
        color = said.color.reshape(60, 8, 3)[own].reshape(-1, 3)
        np.testing.assert_allclose(found[name]["groom_color"], color, atol=1e-6)
        guides = said.strand_id[is_guide & own]
        assert np.isin(found[name]["groom_closest_guides"], guides).all()


def test_hair_without_a_colour_has_that_of_its_look(new_hair: Any, tmp_path: Path) -> None:
    hair = new_hair(strands=straight())
    hair.data.hairloom.shading.base_color = (0.25, 0.5, 0.75)
    bpy.ops.hairloom.export_alembic(filepath=str(tmp_path / "a.abc"))
    (curves,) = curves_of(tmp_path / "a.abc").values()
    np.testing.assert_allclose(curves["groom_color"], np.tile([0.25, 0.5, 0.75], (20, 1)))


def test_several_hairs_are_groups_of_one_groom(new_hair: Any, sphere: Any, tmp_path: Path) -> None:
    brows = write_curves("Brows", hedgehog(20, 5, seed=2), sphere, bpy.context.collection)
    scalp = new_hair(sphere)
    brows.select_set(True)
    path = tmp_path / "both.abc"
    bpy.ops.hairloom.export_alembic(filepath=str(path), by_group=True)
    found = curves_of(path)
    assert set(found) == {"Hair_0", "Hair_1", "Brows_0", "Brows_1"}
    ids = np.concatenate([each["groom_id"] for each in found.values()])
    assert len(np.unique(ids)) == len(ids)
    for each in found.values():
        own = each["groom_id"][each["groom_guide"] == 1]
        assert np.isin(each["groom_closest_guides"], own).all()
    bpy.ops.hairloom.export_alembic(
        filepath=str(tmp_path / "x.abc"), several="each", parts="strands"
    )
    assert {p.name for p in tmp_path.glob("x*.abc")} == {"x_Hair.abc", "x_Brows.abc"}
    (one,) = curves_of(tmp_path / "x_Brows.abc").values()
    assert len(one["counts"]) == 20
    assert scalp.name == "Hair"


def test_children_are_strands_and_their_guides_are_marked(
    new_hair: Any, sphere: Any, tmp_path: Path
) -> None:
    hair = new_hair(sphere)
    hair.data.hairloom.guides.guide_count = 60
    hair.data.hairloom.children.way = "multi"
    hair.data.hairloom.children.strand_count = 200
    bpy.ops.hairloom.export_alembic(filepath=str(tmp_path / "a.abc"))
    (curves,) = curves_of(tmp_path / "a.abc").values()
    assert curves["groom_guide"].sum() == 60 and len(curves["groom_guide"]) == 320


def test_each_frame_is_that_of_the_bake(swinging: Any, tmp_path: Path) -> None:
    hair, _ = swinging
    bake(hair)
    bpy.context.scene.frame_set(3)
    abc, usd = tmp_path / "hair.abc", tmp_path / "hair.usdc"
    for operator, path in (("export_alembic", abc), ("export_usd", usd)):
        getattr(bpy.ops.hairloom, operator)(filepath=str(path), frames="scene", parts="strands")
    assert bpy.context.scene.frame_current == 3
    cache = playback.cache_of(hair)
    assert cache is not None
    (curves,) = curves_of(abc).values()
    stage, prim = stage_of(usd)
    rate = bpy.context.scene.render.fps
    assert len(curves["points"]) == LAST and stage.GetTimeCodesPerSecond() == rate
    np.testing.assert_allclose(curves["times"], np.arange(1, LAST + 1) / rate)
    moved = 0.0
    for frame in range(1, LAST + 1):
        baked = playback.strands_in(cache, frame).reshape(-1, 3)
        np.testing.assert_allclose(curves["points"][frame - 1], to_unreal(baked), rtol=1e-6)
        np.testing.assert_array_equal(prim.GetPointsAttr().Get(frame), baked)
        moved = max(moved, np.abs(baked - playback.strands_in(cache, 1).reshape(-1, 3)).max())
    assert moved > 0.05
    assert curves["groom_root_uv"].shape == (60, 2)


def test_guides_of_a_bake_move_as_their_strands_do(swinging: Any, tmp_path: Path) -> None:
    hair, _ = swinging
    hair.data.hairloom.guides.guide_count = 9
    bake(hair)
    bpy.ops.hairloom.export_alembic(filepath=str(tmp_path / "a.abc"), frames="own", first=2, last=4)
    (curves,) = curves_of(tmp_path / "a.abc").values()
    (line,) = ExportCheck.of([hair]).motion_lines(use_bake=True)
    assert line == "Hair: bake of frames 1 to 6 at 24 fps"
    cache = playback.cache_of(hair)
    assert cache is not None and curves["groom_guide"].sum() == 9
    rig = playback.rig_in(cache).rig
    for place, frame in enumerate((2, 3, 4)):
        strands = playback.strands_in(cache, frame)
        expected = np.concatenate([strands, strands[rig.guides]]).reshape(-1, 3)
        np.testing.assert_allclose(curves["points"][place], to_unreal(expected), rtol=1e-6)


def test_a_bake_keeps_what_its_curves_say(swinging: Any, tmp_path: Path) -> None:
    hair, _ = swinging
    hair.data.hairloom.guides.cv_count = 15
    color = np.random.default_rng(6).random((480, 3)).astype(np.float32)
    said = Groom(hedgehog(), color=color, strand_id=np.arange(60) + 9, group_names={1: "nape"})
    store_groom(hair.data, said)
    bake(hair, frames=range(1, 3))
    path = tmp_path / "a.abc"
    bpy.ops.hairloom.export_alembic(
        filepath=str(path), frames="own", first=1, last=2, parts="strands", by_group=True
    )
    found = curves_of(path)
    assert set(found) == {"Hair_0", "nape"}
    own = found["nape"]
    np.testing.assert_array_equal(own["groom_id"], np.arange(60)[1::2] + 9)
    written, expected = own["groom_color"].reshape(30, 15, 3), color.reshape(60, 8, 3)[1::2]
    np.testing.assert_allclose(written[:, [0, -1]], expected[:, [0, -1]], atol=1e-6)
    np.testing.assert_allclose(written[:, ::2], expected, atol=1e-5)  # straight: evenly spaced


def test_frames_that_were_not_baked_are_named_and_nothing_is_written(
    swinging: Any, tmp_path: Path, told: Callable[[], str]
) -> None:
    hair, _ = swinging
    bake(hair, frames=range(2, 5))
    path = tmp_path / "hair.abc"
    with pytest.raises(RuntimeError, match=r"bake holds frames 2 to 4, not all of 1 to 6.*Bake"):
        bpy.ops.hairloom.export_alembic(filepath=str(path), frames="scene")
    (tmp_path / "bake" / "frame_000003.npz").unlink()
    path.write_bytes(b"old")
    playback.forget()
    with pytest.raises(RuntimeError, match=r"frame_000003\.npz.*Bake again"):
        bpy.ops.hairloom.export_alembic(filepath=str(path), frames="own", first=2, last=4)
    told()
    assert path.read_bytes() == b"old"
    assert {p.name for p in tmp_path.iterdir()} == {"bake", "hair.abc"}


def test_hair_without_a_bake_moves_as_its_modifiers_move_it(
    new_hair: Any, tmp_path: Path, told: Callable[[], str]
) -> None:
    hair = new_hair(strands=straight())
    push_up(hair, 0.1, frame_driven=True)
    bpy.context.scene.frame_set(2)
    path = tmp_path / "hair.usdc"
    bpy.ops.hairloom.export_usd(filepath=str(path), frames="own", first=1, last=4)
    assert "no bake" in told()
    assert bpy.context.scene.frame_current == 2
    _, curves = stage_of(path)
    for frame in range(1, 5):
        expected = straight().points + np.array([0.0, 0.0, 0.1 * frame])
        np.testing.assert_allclose(curves.GetPointsAttr().Get(frame), expected, rtol=1e-5)
    bake_too = {"use_bake": False, "frames": "own", "first": 1, "last": 4}
    bpy.ops.hairloom.export_usd(filepath=str(path), **bake_too)
    assert "no bake" not in told()


def test_children_follow_guides_that_modifiers_move(
    new_hair: Any, sphere: Any, tmp_path: Path
) -> None:
    """All points go up by as much, so the children between them do."""
    hair = new_hair(sphere)
    hair.data.hairloom.guides.guide_count = 60
    hair.data.hairloom.children.way = "multi"
    hair.data.hairloom.children.strand_count = 100
    push_up(hair, 0.02, frame_driven=True)
    bpy.context.scene.frame_set(0)
    bpy.ops.hairloom.export_usd(filepath=str(tmp_path / "a.usdc"), frames="own", first=0, last=3)
    _, curves = stage_of(tmp_path / "a.usdc")
    first, last = (np.array(curves.GetPointsAttr().Get(frame)) for frame in (0, 3))
    rise = (last - first).reshape(160, -1, 3)
    np.testing.assert_allclose(rise[:60], np.broadcast_to([0, 0, 0.06], rise[:60].shape), atol=1e-6)
    assert rise[60:, 1:, 2].min() > 0.02, "the children stay"


def test_curves_that_come_and_go_are_told_and_leave_nothing(new_hair: Any, tmp_path: Path) -> None:
    hair = new_hair(strands=straight())
    plan = StrandExport.of(
        [hair],
        bpy.context.evaluated_depsgraph_get(),
        USD,
        StrandOutput(),
        frames=range(1, 4),
    )
    hair.data.remove_curves(indices=[0])
    with pytest.raises(HairloomError, match=r"in frame 1 it has other curves"):
        plan.write(tmp_path / "a.usdc")
    assert list(tmp_path.iterdir()) == []


def test_a_cancelled_export_leaves_the_old_file(swinging: Any, tmp_path: Path) -> None:
    """As Esc does in the window: what was begun is given up in the middle."""
    hair, _ = swinging
    bake(hair)
    for suffix, kind in ((".abc", ALEMBIC), (".usdc", USD)):
        path = tmp_path / f"hair{suffix}"
        path.write_bytes(b"old")
        depsgraph = bpy.context.evaluated_depsgraph_get()
        plan = StrandExport.of([hair], depsgraph, kind, StrandOutput(), frames=range(1, LAST + 1))
        positions = plan.positions()
        work = plan.writing(path, positions)
        limit = time.monotonic() + 20.0
        while plan.done < 3 and time.monotonic() < limit:
            assert not work.serve()
        work.give_up()
        positions.close()
        while time.monotonic() < limit and not work.serve():
            time.sleep(0.01)
        assert plan.done >= 3
        assert path.read_bytes() == b"old"
    assert {p.name for p in tmp_path.iterdir()} == {"bake", "hair.abc", "hair.usdc"}


def test_in_steps_the_same_file_is_written_as_at_once(swinging: Any, tmp_path: Path) -> None:
    hair, _ = swinging
    bake(hair)
    for path in (tmp_path / "once.abc", tmp_path / "steps.abc"):
        depsgraph = bpy.context.evaluated_depsgraph_get()
        plan = StrandExport.of(
            [hair], depsgraph, ALEMBIC, StrandOutput(), frames=range(1, LAST + 1)
        )
        if path.stem == "once":
            plan.write(path)
        else:
            work = plan.writing(path, plan.positions())
            while not work.serve():
                time.sleep(0.001)
            assert "frames 1 to 6" in work.result().result
    once, steps = (curves_of(tmp_path / name) for name in ("once.abc", "steps.abc"))
    for name, curves in once.items():
        for one, other in zip(curves["points"], steps[name]["points"], strict=True):
            np.testing.assert_array_equal(one, other)


def skinned(head: Any) -> Any:
    """An armature whose bones hold the upper and the lower half of a head; one does not deform."""
    armature = bpy.data.objects.new("Rig", bpy.data.armatures.new("Rig"))
    bpy.context.collection.objects.link(armature)
    bpy.context.view_layer.objects.active = armature
    bpy.ops.object.mode_set(mode="EDIT")
    for name in ("skull", "jaw", "ik"):
        bone = armature.data.edit_bones.new(name)
        bone.tail = (0.0, 0.0, 0.1)
    bpy.ops.object.mode_set(mode="OBJECT")
    armature.data.bones["ik"].use_deform = False
    for name, is_upper in (("skull", True), ("jaw", False), ("ik", True)):
        chosen = [v.index for v in head.data.vertices if (v.co.z > 0.0) == is_upper]
        head.vertex_groups.new(name=name).add(chosen, 1.0, "REPLACE")
    modifier = head.modifiers.new("Armature", "ARMATURE")
    modifier.object = armature
    return armature


def test_bones_of_a_skinned_head_lie_beside_tressfx(
    new_hair: Any, sphere: Any, tmp_path: Path
) -> None:
    skinned(sphere)
    new_hair(sphere)
    bpy.ops.hairloom.export_tfx(filepath=str(tmp_path / "hair.tfx"), up="Z", fills_groups=True)
    read = read_tfx(tmp_path / "hair.tfx", up="Z").strands
    assert read.strand_count == 64 and set(read.point_counts) == {8}
    bones = read_tfxbone(tmp_path / "hair.tfxbone").weights
    assert bones.names == ("skull", "jaw") and bones.strand_count == 64
    carrier = bones.bone[np.arange(64), bones.weight.argmax(axis=1)]
    clear = np.abs(read.roots[:, 2]) > 0.03
    np.testing.assert_array_equal(carrier[clear], (read.roots[:, 2] < 0.0)[clear])

    bpy.ops.hairloom.export_tfx(filepath=str(tmp_path / "split.tfx"), by_group=True, up="Z")
    names = {f"split_group{g}{suffix}" for g in (0, 1) for suffix in (".tfx", ".tfxbone")}
    assert {p.name for p in tmp_path.glob("split*")} == names
    part = read_tfxbone(tmp_path / "split_group1.tfxbone").weights
    np.testing.assert_array_equal(part.bone[:30], bones.bone[1:60:2])


def test_bones_are_left_out_where_they_are_not_wanted_or_not_there(
    new_hair: Any, sphere: Any, tmp_path: Path
) -> None:
    new_hair(sphere)
    bpy.ops.hairloom.export_tfx(filepath=str(tmp_path / "a.tfx"))
    skinned(sphere)
    bpy.ops.object.select_all(action="DESELECT")
    bpy.data.objects["Hair"].select_set(True)
    bpy.context.view_layer.objects.active = bpy.data.objects["Hair"]
    bpy.ops.hairloom.export_tfx(filepath=str(tmp_path / "b.tfx"), bones=False)
    assert {p.name for p in tmp_path.iterdir()} == {"a.tfx", "b.tfx"}


def test_the_check_says_what_the_engine_will_see(
    new_hair: Any, sphere: Any, told: Callable[[], str]
) -> None:
    hair = new_hair(sphere)
    hair.data.hairloom.guides.guide_count = 10
    assert bpy.ops.hairloom.check_export(engine="alembic unreal") == {"FINISHED"}
    text = told()
    assert "60 strands, 10 guides, 560 points" in text
    assert "Width: 0.01 cm" in text and "Z up, left-handed" in text
    hair.data.remove_curves()
    bpy.ops.hairloom.check_export(engine="usd maya")
    assert "no curves" in told()


def test_a_collection_writes_its_own_hair(new_hair: Any, sphere: Any, tmp_path: Path) -> None:
    other = bpy.data.collections.new("Other")
    bpy.context.scene.collection.children.link(other)
    write_curves("Brows", hedgehog(20, 5), sphere, other)
    new_hair(sphere)
    for operator, suffix in (("alembic", "abc"), ("usd", "usda"), ("tfx", "tfx"), ("hair", "hair")):
        path = tmp_path / f"a.{suffix}"
        run = getattr(bpy.ops.hairloom, f"export_{operator}")
        assert run(filepath=str(path), collection="Other") == {"FINISHED"}
    assert read_hair_file(tmp_path / "a.hair").strands.strand_count == 20
    with pytest.raises(RuntimeError, match="no hair to write"):
        bpy.ops.hairloom.export_tfx(filepath=str(tmp_path / "b.tfx"), collection="Nothing")
    for name, suffixes in (("alembic", ".abc"), ("usd", ".usdc;.usd;.usda"), ("tfx", ".tfx")):
        handler = getattr(bpy.types, f"HAIRLOOM_FH_export_{name}")
        assert handler.bl_export_operator == f"hairloom.export_{name}"
        assert handler.bl_file_extensions == suffixes


def test_a_collections_exporter_is_run_by_blender(
    new_hair: Any, sphere: Any, tmp_path: Path
) -> None:
    """As Properties > Collection > Exporters does."""
    new_hair(sphere)
    collection = bpy.context.scene.collection
    if not hasattr(bpy.ops.collection, "exporter_add"):
        pytest.skip("this Blender has no exporters of collections")
    with bpy.context.temp_override(collection=collection):
        assert bpy.ops.collection.exporter_add(name="HAIRLOOM_FH_export_hair") == {"FINISHED"}
        (exporter,) = collection.exporters
        exporter.export_properties.filepath = str(tmp_path / "own.hair")
        assert bpy.ops.collection.exporter_export(index=0) == {"FINISHED"}
    assert read_hair_file(tmp_path / "own.hair").strands.strand_count == 60


def test_motion_into_a_format_without_is_refused(new_hair: Any, tmp_path: Path) -> None:
    plan = StrandExport.of(
        [new_hair(strands=straight())],
        bpy.context.evaluated_depsgraph_get(),
        TRESSFX,
        StrandOutput(),
        frames=range(1, 3),
    )
    with pytest.raises(HairloomError, match=r"TressFX holds no motion.*Alembic"):
        plan.write(tmp_path / "a.tfx")


def test_without_alembics_library_usd_is_offered(
    new_hair: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    import sys

    new_hair(strands=straight())
    monkeypatch.setitem(sys.modules, "alembic3d", None)
    with pytest.raises(RuntimeError, match=r"alembic3d.*Use USD instead"):
        bpy.ops.hairloom.export_alembic(filepath=str(tmp_path / "a.abc"))
    assert bpy.ops.hairloom.export_usd(filepath=str(tmp_path / "a.usdc")) == {"FINISHED"}


def test_hair_of_guides_alone_is_written_as_strands(new_hair: Any, tmp_path: Path) -> None:
    """As an import leaves it that puts guides apart."""
    hair = new_hair()
    store_groom(hair.data, Groom(hedgehog(), is_guide=np.ones(60, bool)))
    bpy.ops.hairloom.export_hair(filepath=str(tmp_path / "a.hair"))
    assert read_hair_file(tmp_path / "a.hair").strands.strand_count == 60
    bpy.ops.hairloom.export_alembic(filepath=str(tmp_path / "a.abc"))
    (curves,) = curves_of(tmp_path / "a.abc").values()
    assert "groom_guide" not in curves
    bpy.ops.hairloom.export_alembic(filepath=str(tmp_path / "g.abc"), parts="guides")
    (curves,) = curves_of(tmp_path / "g.abc").values()
    assert curves["groom_guide"].all()


@pytest.mark.parametrize(
    ("operator", "suffix", "options"),
    [
        ("export_alembic", ".abc", {"engine": "blender"}),
        ("export_alembic", ".abc", {"engine": "unreal"}),
        ("export_usd", ".usdc", {"engine": "blender", "parts": "both"}),
        ("export_usd", ".usda", {"engine": "maya", "parts": "both"}),
        ("export_tfx", ".tfx", {}),
        ("export_hair", ".hair", {}),
    ],
)
def test_what_is_written_comes_in_again(
    new_hair: Any, sphere: Any, tmp_path: Path, operator: str, suffix: str, options: Any
) -> None:
    hair, random = new_hair(sphere), np.random.default_rng(8)
    said = Groom(
        hedgehog(),
        color=random.random((480, 3)),
        strand_id=np.arange(60) + 5,
        group_names={0: "crown", 1: "nape"},
    )
    store_groom(hair.data, said)
    before = still_hair(hair, bpy.context.evaluated_depsgraph_get(), Wishes(guides=False)).groom
    path = tmp_path / f"hair{suffix}"
    getattr(bpy.ops.hairloom, operator)(filepath=str(path), **options)
    bpy.ops.object.select_all(action="DESELECT")
    sphere.select_set(True)
    bpy.context.view_layer.objects.active = sphere
    assert bpy.ops.hairloom.import_strands(filepath=str(path)) == {"FINISHED"}
    again = next(o for o in bpy.data.objects if o.type == "CURVES" and o != hair)
    after = still_hair(again, bpy.context.evaluated_depsgraph_get(), Wishes(guides=False)).groom
    bits = options.get("engine") == "blender"
    tolerance = 0.0 if bits else 1e-6
    np.testing.assert_allclose(after.strands.points, before.strands.points, atol=tolerance, rtol=0)
    np.testing.assert_allclose(after.strands.radius, before.strands.radius, rtol=1e-5)
    np.testing.assert_allclose(after.color, before.color, atol=1e-6)
    if suffix != ".hair":
        np.testing.assert_allclose(after.strands.root_uv, before.strands.root_uv, atol=1e-4)
    if suffix not in (".hair", ".tfx"):
        np.testing.assert_array_equal(after.strands.group, before.strands.group)
        np.testing.assert_array_equal(after.strand_id, before.strand_id)
        assert dict(after.group_names) == dict(before.group_names)
