"""Writing strands to files of all formats with one call, and the messages before it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from tfxbone_reader import read_tfxbone
from tiers import few_in_commits

from hairloom.addon.errors import HairloomError
from hairloom.addon.exchange.alembic.groom_alembic_read import read_groom_alembic
from hairloom.addon.exchange.groom import Groom, GroomMotion, with_guide_copies
from hairloom.addon.exchange.hair_file import read_hair_file
from hairloom.addon.exchange.join_grooms import join_bones, join_grooms
from hairloom.addon.exchange.strand_check import check_lines, check_strands
from hairloom.addon.exchange.strand_export_settings import StrandExportSettings
from hairloom.addon.exchange.strand_formats import ALEMBIC, HAIR, TRESSFX, USD
from hairloom.addon.exchange.strand_reading import read_strands
from hairloom.addon.exchange.strand_writing import write_strands
from hairloom.addon.exchange.tfxbone import strongest_bones
from hairloom.addon.exchange.tressfx import read_tfx
from hairloom.addon.exchange.usd.groom_usd_read import read_usd
from hairloom.addon.strands import StrandSet

COUNT, POINTS = 10, 5
GUIDES = np.array([2, 7])


def groom(name: str = "hair", seed: int = 1, *, has_uv: bool = True) -> Groom:
    """Ten strands of five points in two groups, 1 and 4; no guides."""
    random = np.random.default_rng(seed)
    strands = StrandSet(
        random.uniform(-0.1, 0.1, (COUNT * POINTS, 3)),
        np.arange(COUNT + 1) * POINTS,
        np.full(COUNT * POINTS, 4e-5),
        np.where(np.arange(COUNT) < 6, 1, 4),
        random.random((COUNT, 2)) if has_uv else None,
    )
    return Groom(strands, name, group_names={1: "crown"})


def guided(**options: object) -> Groom:
    """The same with copies of two guides at the end, and all strands' guides and weights."""
    random = np.random.default_rng(5)
    weight = random.dirichlet((1.0, 1.0, 1.0), COUNT)
    guide = random.integers(0, 2, (COUNT, 3))
    return with_guide_copies(replace(groom(), **options), GUIDES, guide, weight)


def test_copies_of_guides_lie_behind_and_ride_on_themselves() -> None:
    hair, plain = guided(), groom().strands
    np.testing.assert_array_equal(hair.strands.points[: COUNT * POINTS], plain.points)
    np.testing.assert_array_equal(hair.strands.grid[COUNT:], plain.grid[GUIDES])
    assert hair.is_guide is not None and hair.strand_id is not None
    assert np.flatnonzero(hair.is_guide).tolist() == [COUNT, COUNT + 1]
    assert hair.closest_guides is not None and hair.guide_weights is not None
    assert hair.closest_guides[COUNT:, 0].tolist() == hair.strand_id[COUNT:].tolist()
    assert hair.guide_weights[COUNT:].tolist() == [[1.0, 0.0, 0.0]] * 2
    assert set(hair.closest_guides.ravel()) <= set(hair.strand_id[COUNT:])


def test_ids_too_large_for_guides_are_numbered_again() -> None:
    ids = np.arange(COUNT) + np.iinfo(np.int32).max - COUNT + 1
    assert guided(strand_id=ids).strand_id.tolist() == list(range(COUNT + 2))
    kept = guided(strand_id=np.arange(COUNT) * 7).strand_id
    assert kept.tolist() == [*range(0, 70, 7), 64, 65]


@pytest.mark.parametrize(
    "suffix", few_in_commits([".abc", ".tfx", ".hair", ".usdc", ".usda", ".usd"], 4)
)
def test_the_suffix_says_the_format(suffix: str, tmp_path: Path) -> None:
    pytest.importorskip("alembic3d")
    pytest.importorskip("pxr")
    path = tmp_path / f"hair{suffix}"
    written = write_strands(path, guided(), StrandExportSettings(parts="strands"))
    assert written.files == (path,) and list(tmp_path.iterdir()) == [path]
    readers = {".abc": read_groom_alembic, ".tfx": read_tfx, ".hair": read_hair_file}
    read = readers.get(suffix, read_usd)(path)
    strands = read.strands
    assert strands.strand_count == COUNT
    if suffix != ".tfx":  # which has eight points
        np.testing.assert_allclose(strands.points, groom().strands.points, atol=1e-6)


def test_a_suffix_or_engine_that_is_not_known_is_named(tmp_path: Path) -> None:
    for name, output, message in (
        ("hair.obj", StrandExportSettings(), r"'\.obj' is not the suffix.*\.abc"),
        (
            "hair.abc",
            StrandExportSettings(engine="maya"),
            "no layout for 'maya'.*unreal, unity, blender",
        ),
        ("hair.tfx", StrandExportSettings(engine="unreal"), "TressFX does not have.*'Target'"),
        ("hair.abc", StrandExportSettings(up="Y"), "Groom Alembic does not have.*'Up'"),
        ("hair.hair", StrandExportSettings(vertex_count="8"), ".hair does not have.*'Vertices'"),
    ):
        with pytest.raises(HairloomError, match=message):
            write_strands(tmp_path / name, groom(), output)
    for scale in (-1.0, float("nan")):
        with pytest.raises(HairloomError, match="'scale'"):
            StrandExportSettings(scale=scale)
    motion = GroomMotion([groom().strands.points], 24.0)
    with pytest.raises(HairloomError, match=r"\.hair cannot store motion"):
        write_strands(tmp_path / "hair.hair", groom(), motion=motion)
    assert list(tmp_path.iterdir()) == []


def test_usd_has_the_parts_that_the_engine_wants_in_motion_too(tmp_path: Path) -> None:
    usd = pytest.importorskip("pxr.Usd")
    hair = guided()
    frames = [hair.strands.points + np.float32(step) for step in (0.0, 0.5)]
    for engine, parts, count in (
        ("unreal", "default", 12),
        ("houdini", "default", 10),
        ("houdini", "guides", 2),
        ("houdini", "both", 12),
    ):
        path = tmp_path / f"{engine}{parts}.usdc"  # the library remembers files by name
        output = StrandExportSettings(engine=engine, parts=parts)
        write_strands(path, hair, output, GroomMotion(iter(frames), 24.0, 5))
        stage = usd.Stage.Open(str(path))
        (prim,) = (each for each in stage.Traverse() if each.GetTypeName() == "BasisCurves")
        points = [np.array(prim.GetAttribute("points").Get(time)) for time in (5, 6)]
        assert len(points[0]) == count * POINTS
        step = [50.0, 50.0, 50.0] if engine == "unreal" else [0.5, 0.5, -0.5]
        np.testing.assert_allclose(points[1] - points[0], [step] * len(points[0]), rtol=1e-5)
        has_closest = prim.HasAttribute("primvars:groom_closest_guides")
        assert has_closest == (count == 12)


def test_groups_go_into_files_with_the_bones_of_their_strands(tmp_path: Path) -> None:
    bones = strongest_bones(("a", "b", "c"), np.random.default_rng(2).random((COUNT + 2, 3)))
    output = StrandExportSettings(by_group=True)
    written = write_strands(tmp_path / "hair.tfx", replace(guided(), bones=bones), output)
    names = ["hair_crown.tfx", "hair_group4.tfx", "hair_crown.tfxbone", "hair_group4.tfxbone"]
    assert [path.name for path in written.files] == names
    for name, own in (("crown", slice(0, 6)), ("group4", slice(6, 10))):
        read = read_tfx(tmp_path / f"hair_{name}.tfx").strands
        np.testing.assert_allclose(read.roots, groom().strands.roots[own], atol=1e-6)
        held = read_tfxbone(tmp_path / f"hair_{name}.tfxbone")
        np.testing.assert_array_equal(held.bone, bones.bone[own])
        np.testing.assert_allclose(held.weight, bones.weight[own], atol=1e-6)


@pytest.mark.parametrize("suffix", [".usda", ".abc", ".tfx"])
def test_groups_whose_names_become_equal_get_different_files(tmp_path: Path, suffix: str) -> None:
    pytest.importorskip({".usda": "pxr", ".abc": "alembic3d", ".tfx": "numpy"}[suffix])
    names = {0: "front hair", 1: "front_hair_2", 2: "front-hair", 3: "Front Hair"}
    counts = [5, 7, 3, 2]
    points = np.random.default_rng(3).random((sum(counts) * 4, 3))
    strands = StrandSet(
        points,
        np.arange(sum(counts) + 1) * 4,
        np.full(len(points), 1e-4),
        np.repeat(range(4), counts),
    )
    hair = Groom(strands, "hair", group_names=names)
    written = write_strands(tmp_path / f"hair{suffix}", hair, StrandExportSettings(by_group=True))
    read = [read_strands(file).strands for file in written.files]
    assert sum(each.strand_count for each in read) == sum(counts)
    found = [count for each in read for count in np.unique(each.group, return_counts=True)[1]]
    assert sorted(found) == sorted(counts)


def test_bones_of_the_last_strand_fill_up_to_64(tmp_path: Path) -> None:
    bones = strongest_bones(("a", "b"), np.eye(2)[np.arange(COUNT) % 2])
    hair = replace(groom(), bones=bones)
    write_strands(tmp_path / "hair.tfx", hair, StrandExportSettings(pad_to_64=True))
    assert read_tfx(tmp_path / "hair.tfx").strands.strand_count == 64
    held = read_tfxbone(tmp_path / "hair.tfxbone")
    assert held.strand_count == 64 and (held.bone[COUNT:, 0] == 1).all()


def test_bones_of_an_earlier_export_do_not_stay_with_other_strands(tmp_path: Path) -> None:
    bones = strongest_bones(("a", "b"), np.eye(2)[np.arange(COUNT) % 2])
    write_strands(tmp_path / "hair.tfx", replace(groom(), bones=bones))
    before = (tmp_path / "hair.tfxbone").read_bytes()
    written = write_strands(tmp_path / "hair.tfx", groom())
    assert {file.name for file in tmp_path.iterdir()} == {"hair.tfx", "hair old.tfxbone"}
    assert (tmp_path / "hair old.tfxbone").read_bytes() == before
    assert written.notes[-1].endswith("to other strands, and is kept as hair old.tfxbone.")


def test_an_export_again_replaces_its_own_files_and_keeps_those_of_others(tmp_path: Path) -> None:
    bones = strongest_bones(("a", "b"), np.eye(2)[np.arange(COUNT) % 2])
    split = StrandExportSettings(by_group=True)
    (tmp_path / "hair_crown.tfx").write_bytes(b"somebody else's")
    for turn in range(3):
        hair = replace(
            groom(seed=turn), bones=bones if turn % 2 else bones.take(np.arange(COUNT)[::-1])
        )
        notes = write_strands(tmp_path / "hair.tfx", hair, split).notes
        notes += write_strands(tmp_path / "one.tfx", hair).notes
        kept = [note for note in notes if "is kept as" in note]
        assert kept == ["hair_crown.tfx already existed, and is kept as hair_crown old.tfx."][turn:]
    assert [file.name for file in tmp_path.iterdir() if "old" in file.name] == [
        "hair_crown old.tfx"
    ]
    assert (tmp_path / "hair_crown old.tfx").read_bytes() == b"somebody else's"


def test_if_one_file_fails_none_is_written(tmp_path: Path) -> None:
    (tmp_path / "hair_crown.tfx").write_bytes(b"old")
    (tmp_path / "hair_group4.tfx").mkdir()
    with pytest.raises(HairloomError, match="a folder has this name"):
        write_strands(tmp_path / "hair.tfx", groom(), StrandExportSettings(by_group=True))
    assert (tmp_path / "hair_crown.tfx").read_bytes() == b"old"


def test_resampled_strands_are_reported(tmp_path: Path) -> None:
    pytest.importorskip("alembic3d")
    points = np.linspace([0, 0, 0], [0, 0, 0.1], 300)
    long = Groom(StrandSet(points, [0, 300], np.full(300, 4e-5), [0]))
    written = write_strands(tmp_path / "a.abc", long)
    assert "resampled to 255 points" in written.notes[0]
    assert "resampled to 64" in write_strands(tmp_path / "a.tfx", long).notes[0]


def test_closest_guides_that_not_all_grooms_have_are_lost_with_a_note() -> None:
    both, notes = join_grooms([guided(), replace(groom(), name="brows")], "all")
    assert both.closest_guides is None and both.guide_weights is None
    assert len(notes) == 1 and "brows: no closest guides" in notes[0]


def test_joined_grooms_keep_distinct_groups_guides_and_ids() -> None:
    one, other = guided(), replace(guided(), name="brows", group_names={})
    both, notes = join_grooms([one, other], "all")
    assert notes == () and both.strands.strand_count == 24
    assert dict(both.group_names) == {0: "hair crown", 1: "hair 4", 2: "brows 1", 3: "brows 4"}
    assert np.unique(both.strands.group).tolist() == [0, 1, 2, 3]
    assert both.strand_id is not None and len(set(both.strand_id.tolist())) == 24
    assert both.closest_guides is not None and both.is_guide is not None
    for part, own in ((one, slice(0, 12)), (other, slice(12, 24))):
        assert part.closest_guides is not None and part.strand_id is not None
        place = {number: index for index, number in enumerate(part.strand_id.tolist())}
        expected = [[place[g] for g in row] for row in part.closest_guides.tolist()]
        ids = both.strand_id[own]
        np.testing.assert_array_equal(both.closest_guides[own], ids[expected])
        np.testing.assert_array_equal(both.strands.grid[own], part.strands.grid)


def test_joined_grooms_lose_attributes_that_one_lacks_with_a_note() -> None:
    bald, painted = groom("bald", has_uv=False), guided()
    painted = replace(painted, strands=replace(painted.strands, color=np.ones((60, 3))))
    both, notes = join_grooms([painted, bald], "all")
    assert both.strands.root_uv is None and both.color is None and both.closest_guides is None
    assert both.is_guide is not None and both.is_guide.sum() == 2
    assert "bald: no root UVs" in notes[0] and "bald: no colours" in notes[1]
    assert join_grooms([bald], "all") == (bald, ())


def test_joined_bones_are_one_by_name() -> None:
    one = strongest_bones(("spine", "head"), np.array([[0.0, 1.0], [0.5, 0.5]]))
    other = strongest_bones(("head", "jaw"), np.array([[1.0, 0.0], [0.0, 1.0]]))
    both = join_bones([one, other])
    assert both.names == ("spine", "head", "jaw")
    assert [both.names[i] for i in both.bone[:, 0]] == ["head", "spine", "head", "jaw"]
    np.testing.assert_allclose(both.weight.sum(axis=1), 1.0)


def test_the_check_counts_in_the_files_own_unit() -> None:
    place = np.array([[1.0, 2.0, 3.0], [1.0, 2.0, 4.0]])
    hair = Groom(StrandSet(place, [0, 2], np.full(2, 4e-5), [3]), group_names={3: "fringe"})
    facts = check_strands(hair, USD, StrandExportSettings(engine="maya"))
    assert (facts["unit"], facts["up"], facts["is_mirrored"]) == ("cm", "Y", False)
    np.testing.assert_allclose(facts["lowest"], (100.0, 300.0, -200.0))
    np.testing.assert_allclose(facts["highest"], (100.0, 400.0, -200.0))
    np.testing.assert_allclose(facts["width"], (8e-3, 8e-3), rtol=1e-6)
    lines = check_lines(facts)
    assert lines[0] == "1 strands, 0 guides, 2 points" and "Groups: fringe (1)" in lines
    assert "Width: 0.008 cm" in lines and "Length: 100 cm" in lines
    unreal = check_strands(hair, ALEMBIC, StrandExportSettings())
    assert unreal["is_mirrored"] and any("left-handed" in line for line in check_lines(unreal))
    assert check_strands(hair, HAIR, StrandExportSettings(scale=0.001))["unit"] == "mm"
    inch = check_strands(hair, TRESSFX, StrandExportSettings(scale=0.0254))
    assert inch["unit"] == "1/39.3701 m" and inch["points_per_curve"] == (2, 2)
