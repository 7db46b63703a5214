"""Turntables and contact sheets: full turns, complete files, and error messages otherwise."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from full_disk import full_disk
from tiers import few_in_commits

pytest.importorskip("bpy", reason="turntables are drawn inside Blender")

import bpy
import gpu

from hairloom.addon.blender.base.images import read_texture, write_png
from hairloom.addon.blender.command_line import command_line
from hairloom.addon.blender.pictures import turntable as turntable_module
from hairloom.addon.blender.pictures import video
from hairloom.addon.blender.pictures.sheet import COLUMNS, VIEWS, Sheet, labelled
from hairloom.addon.blender.pictures.showing import file_name, shown_groom
from hairloom.addon.blender.pictures.studio import FIELD_OF_VIEW, MARGIN
from hairloom.addon.blender.pictures.turntable import Turntable, TurntableSettings
from hairloom.addon.blender.properties.presets import shipped_presets
from hairloom.addon.errors import HairloomError
from hairloom.addon.exchange.files import file_moves, stale_temp_files
from hairloom.addon.render.camera import frame_points

pytestmark = [pytest.mark.draws(light=False), pytest.mark.usefixtures("gpu_context")]

SMALL = TurntableSettings(frames=4, width=64, height=48, samples=1, video=False)


@pytest.fixture
def hair(new_hair: Callable[..., bpy.types.Object], sphere: bpy.types.Object) -> bpy.types.Object:
    return new_hair(sphere)


@pytest.fixture
def table(hair: bpy.types.Object, tmp_path: Path) -> Turntable:
    shown = shown_groom(hair, bpy.context.evaluated_depsgraph_get())
    folder = tmp_path / "made" / "turn"
    return Turntable(shown.studio, shown.pose, shown.points, SMALL, folder)


def data_blocks() -> list[str]:
    """Names of all data-blocks, except the image of the last render."""
    images = [image for image in bpy.data.images if image.type != "RENDER_RESULT"]
    return [block.name for block in (*bpy.data.scenes, *bpy.data.objects, *images)]


def pixels_of(path: Path) -> np.ndarray:
    return read_texture(path, is_color=False)


def test_one_press_gives_pictures_and_a_video(hair: bpy.types.Object, tmp_path: Path) -> None:
    blocks = data_blocks()
    options = {"frames": 3, "size": 64, "samples": 1}
    assert bpy.ops.hairloom.turntable(directory=str(tmp_path), **options) == {"FINISHED"}
    names = [f"Hair_000{number}.png" for number in range(1, 4)]
    assert sorted(path.name for path in tmp_path.iterdir()) == ["Hair.mp4", *names]
    pictures = [pixels_of(tmp_path / name) for name in names]
    assert all(picture.shape[:2] == (64, 64) for picture in pictures)
    for index, picture in enumerate(pictures):
        for other in pictures[:index]:
            assert np.abs(picture - other).max() > 0.1
    assert data_blocks() == blocks
    clip = bpy.data.movieclips.load(str(tmp_path / "Hair.mp4"))
    assert (clip.frame_duration, tuple(clip.size)) == (3, (64, 64))
    assert clip.fps == pytest.approx(bpy.context.scene.render.fps)


def test_a_video_shows_the_pictures_as_they_are(tmp_path: Path) -> None:
    """Frames of one colour each, so that only the codec rounds; they are in order."""
    frames, colors = [], [(0.8, 0.1, 0.1), (0.1, 0.7, 0.2), (0.2, 0.3, 0.9)]
    for index, color in enumerate(colors):
        path = tmp_path / f"{index}.png"
        image = bpy.data.images.new("frame", 33, 20)
        image.pixels.foreach_set(np.tile([*color, 1.0], 33 * 20).astype(np.float32))
        image.file_format = "PNG"
        image.save(filepath=str(path))
        bpy.data.images.remove(image)
        frames.append(path)
    video.write_video(tmp_path / "v.mp4", frames, (33, 20), 23.976)
    clip = bpy.data.movieclips.load(str(tmp_path / "v.mp4"))
    assert clip.fps == pytest.approx(23.976, abs=0.01)
    movie = bpy.data.images.load(str(tmp_path / "v.mp4"))
    assert (movie.frame_duration, tuple(movie.size)) == (3, (32, 20))
    found = np.array(movie.pixels[:]).reshape(20, 32, 4)[10, 16, :3]
    assert found == pytest.approx(colors[0], abs=0.03)


@pytest.mark.slow(instead="test_one_press_gives_pictures_and_a_video")
def test_after_a_whole_turn_it_is_the_same_picture(table: Turntable) -> None:
    first, last = table.picture(0), table.picture(SMALL.frames)
    assert np.array_equal(first, last)
    assert np.abs(first - table.picture(1)).max() > 0.05


@pytest.mark.parametrize("size", [(64, 48), (48, 90)])
def test_the_groom_stays_whole_in_view_and_does_not_drift(
    table: Turntable, size: tuple[int, int]
) -> None:
    """Also if the groom is high up and long to one side of its head."""
    points = table.points.copy() + [0.5, -0.2, 3.0]
    along = np.tile(np.linspace(0.0, 0.4, 16), len(points) // 16)
    points[::7] += along[::7, None] * np.array([1.0, 0.2, 0.0])
    table.points = points
    table.pose = replace(table.pose, head_positions=None)
    table.settings = replace(SMALL, frames=36, width=size[0], height=size[1])
    homogeneous = np.append(points.reshape(-1, 3), np.ones((points.size // 3, 1)), axis=1)
    middle = np.append((points.min(axis=0) + points.max(axis=0)) / 2.0, 1.0)
    largest, places = 0.0, []
    for frame in range(36):
        camera = table.camera(frame)
        to_clip = camera.projection @ camera.view
        clip = homogeneous @ to_clip.T
        assert (np.abs(clip[:, :3]) < clip[:, 3:]).all()
        largest = max(largest, float((np.abs(clip[:, :2]) / clip[:, 3:]).max()))
        places.append((to_clip @ middle) / (to_clip @ middle)[3])
    assert largest > 0.5
    assert np.ptp(places, axis=0).max() < 1e-6


@pytest.mark.slow
@pytest.mark.parametrize(("top", "foot"), [(0.3, 0.3), (0.1, 0.5)])
def test_feet_are_not_cut_off_however_wide_they_stand(top: float, foot: float) -> None:
    """A pillar or a cone fills the picture at all turns, except for the studio's margin."""
    random = np.random.default_rng(1)
    height, angle = np.array([0.0, 1.8])[random.integers(0, 2, 4000)], random.uniform(0, 6.3, 4000)
    reach = np.where(height > 0.0, top, foot)
    places = np.stack([reach * np.cos(angle), reach * np.sin(angle), height], axis=1)
    outline = turntable_module.enclosing_rings(places, np.array([0.0, 0.0, 0.9]))
    camera = frame_points(outline, (0.0, -1.0, 0.14), FIELD_OF_VIEW, 1.0, margin=MARGIN)
    seen = np.column_stack([places, np.ones(4000)]) @ (camera.projection @ camera.view).T
    farthest = np.abs(seen[:, :2] / seen[:, 3:]).max()
    assert 0.98 / MARGIN < farthest < 1.001 / MARGIN


@pytest.mark.slow(instead="test_one_press_gives_pictures_and_a_video")
def test_lights_turn_with_the_camera_or_stay_on_the_groom(table: Turntable) -> None:
    follows = [table.picture(frame) for frame in (0, 1)]
    table.settings = replace(SMALL, lights="groom")
    stays = [table.picture(frame) for frame in (0, 1)]
    assert np.array_equal(follows[0], stays[0])
    assert np.abs(follows[1] - stays[1]).mean() > 1e-3


def test_transparent_pictures_have_no_backdrop(table: Turntable) -> None:
    table.settings = replace(SMALL, transparent=True)
    picture = table.picture(0)
    assert picture[0, 0].tolist() == [0.0] * 4 and picture[..., 3].max() > 0.9


def test_pictures_and_a_video_of_a_longer_turn_go(table: Turntable) -> None:
    list(table.steps())
    others = [table.folder / name for name in ("turntable_0007.png", "other_0003.png")]
    for path in (*others, table.folder / "turntable.mp4"):
        path.write_bytes(b"mine")
    table.settings = replace(SMALL, frames=2)
    list(table.steps())
    assert set(table.folder.iterdir()) == {*table.files, *others}
    assert len(table.files) == 2


@pytest.mark.parametrize("is_there", few_in_commits([True, False]))
def test_a_cancelled_turntable_leaves_no_files(table: Turntable, is_there: bool) -> None:
    kept = table.folder / "turntable_0001.png"
    if is_there:
        table.folder.mkdir(parents=True)
        kept.write_text("of an earlier turn")
    steps = table.steps()
    assert [next(steps), next(steps)] == [1, 2]
    steps.close()
    if is_there:
        assert [path.name for path in table.folder.iterdir()] == [kept.name]
        assert kept.read_text() == "of an earlier turn"
    else:
        assert not table.folder.exists()


def test_the_next_turn_removes_what_a_killed_one_left(
    table: Turntable, monkeypatch: pytest.MonkeyPatch
) -> None:
    ended = subprocess.Popen([sys.executable, "-c", ""])
    ended.wait()
    with monkeypatch.context() as patched:
        patched.setattr(stale_temp_files.os, "getpid", lambda: ended.pid)
        left = stale_temp_files.temporary_path(table.folder / "turntable")
    left.mkdir(parents=True)
    (left / "turntable_0001.png").write_text("half")
    steps = table.steps()
    next(steps)
    assert not left.exists()
    steps.close()


def test_a_failed_turntable_leaves_no_files(
    table: Turntable, monkeypatch: pytest.MonkeyPatch
) -> None:
    drawn = table.picture

    def picture(frame: int) -> Any:
        if frame == 2:
            raise HairloomError("it broke", place="here", remedy="Mend it")
        return drawn(frame)

    monkeypatch.setattr(table, "picture", picture)
    with pytest.raises(HairloomError, match="it broke"):
        list(table.steps())
    assert not table.folder.exists()


@pytest.mark.parametrize("part", [0.1, 0.5, 0.9])
def test_a_video_on_a_full_disk_is_none(tmp_path: Path, part: float) -> None:
    """Blender itself takes half a video as finished."""
    pictures = np.random.default_rng(0).random((6, 64, 64, 4)).astype(np.float32)
    frames = [tmp_path / f"f_{number:04}.png" for number in range(len(pictures))]
    for frame, picture in zip(frames, pictures, strict=True):
        write_png(frame, picture)
    whole, cut = tmp_path / "whole.mp4", tmp_path / "cut.mp4"
    video.write_video(whole, frames, (64, 64), 24.0)
    assert video.is_complete(whole)
    limit = int(part * whole.stat().st_size)
    with full_disk(limit), pytest.raises(HairloomError, match="no video was written"):
        video.write_video(cut, frames, (64, 64), 24.0)
    assert not cut.exists()
    for length in (0, 7, 100, limit, whole.stat().st_size - 1):
        cut.write_bytes(whole.read_bytes()[:length])
        assert not video.is_complete(cut)


@pytest.mark.slow(instead="test_a_failed_turntable_leaves_no_files")
def test_without_a_writer_of_videos_the_pictures_stay(
    table: Turntable, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(video, "can_write_video", lambda: False)
    table.settings = replace(SMALL, video=True)
    assert list(table.steps()) == [1, 2, 3, 4]
    assert sorted(table.folder.iterdir()) == sorted(table.files)
    assert len(table.files) == 4 and not table.has_video
    (note,) = table.notes
    assert "FFmpeg" in note and "pictures are complete" in note


@pytest.mark.parametrize(
    "wrong",
    [{"frames": 0}, {"frames": -3}, {"width": 0}, {"height": 100_000}, {"samples": 9}],
    ids=str,
)
def test_impossible_sizes_are_refused(wrong: dict[str, int]) -> None:
    with pytest.raises(HairloomError, match=f"{next(iter(wrong))} cannot be"):
        TurntableSettings(**wrong)


@pytest.mark.parametrize("frame_rate", [0.0, -24.0, float("nan")])
def test_a_frame_rate_that_is_none_is_refused(frame_rate: float) -> None:
    with pytest.raises(HairloomError, match="frame rate"):
        TurntableSettings(frame_rate=frame_rate)


def test_a_folder_that_is_a_file_is_named(table: Turntable, tmp_path: Path) -> None:
    table.folder = tmp_path / "file"
    table.folder.write_text("mine")
    with pytest.raises(HairloomError) as caught:
        list(table.steps())
    assert caught.value.place == str(table.folder)
    assert table.folder.read_text() == "mine"


@pytest.mark.slow
def test_a_picture_that_another_program_holds_keeps_all_and_the_new_ones(
    table: Turntable, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Under Windows' rule, open files cannot be replaced: a turn then never mixes two grooms."""
    list(table.steps())
    before = {path.name: path.read_bytes() for path in table.folder.iterdir()}
    held, real = table.files[2], file_moves.os.replace

    def replace(source: Any, target: Any) -> None:
        if Path(target) == held:
            raise PermissionError(13, "Access is denied", str(source), None, str(target))
        real(source, target)

    monkeypatch.setattr(file_moves.os, "replace", replace)
    table.points = table.points * np.float32(1.5)
    with pytest.raises(HairloomError, match="all are as they were") as raised:
        list(table.steps())
    assert raised.value.place == str(held)
    kept = table.folder / "turntable_0001 new"
    assert kept.name in raised.value.remedy
    assert sorted(each.name for each in kept.iterdir()) == sorted(before)
    assert all((kept / name).read_bytes() != content for name, content in before.items())
    files = {each.name: each.read_bytes() for each in table.folder.iterdir() if each.is_file()}
    assert files == before


@pytest.mark.parametrize("how", few_in_commits(["button", "verb"]))
def test_a_gpu_without_memory_is_a_message(
    hair: bpy.types.Object, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, how: str, capfd: Any
) -> None:
    def refuse(*_: Any, **__: Any) -> None:
        raise RuntimeError("gpu.offscreen.new(...) failed with 'Texture allocation failed.'")

    for kind in ("GPUOffScreen", "GPUTexture"):
        monkeypatch.setattr(gpu.types, kind, refuse)
    if how == "button":
        with pytest.raises(RuntimeError) as raised:
            bpy.ops.hairloom.turntable(directory=str(tmp_path), frames=2, size=32, samples=1)
        text = str(raised.value)
    else:
        sizes = ["--frames", "2", "--width", "32", "--height", "32", "--samples", "1"]
        assert command_line.run(["turntable", *GROWN, *sizes, "--output", str(tmp_path)]) == 1
        text = capfd.readouterr().err
    assert "the GPU cannot provide what drawing needs" in text and "smaller pictures" in text
    assert "Traceback" not in text and list(tmp_path.iterdir()) == []


def test_without_hair_the_buttons_say_so(extension: None, tmp_path: Path) -> None:
    for operator in (bpy.ops.hairloom.turntable, bpy.ops.hairloom.contact_sheet):
        assert not operator.poll()


@pytest.mark.slow
def test_a_contact_sheet_shows_all_sides(hair: bpy.types.Object, tmp_path: Path) -> None:
    path = tmp_path / "sheet.png"
    result = bpy.ops.hairloom.contact_sheet(filepath=str(path), size=64, samples=1)
    assert result == {"FINISHED"}
    assert len(VIEWS) + 1 == 2 * COLUMNS
    sheet = pixels_of(path)
    assert sheet.shape[:2] == (128, 64 * COLUMNS)
    tiles = [sheet[64 * (i // 3) :][:64, 64 * (i % 3) :][:, :64] for i in range(6)]
    for index, tile in enumerate(tiles):
        assert tile.std() > 0.02
        for other in tiles[:index]:
            assert np.abs(tile - other).max() > 0.1


@pytest.mark.parametrize(("name", "why"), [("folder", "a folder has this name"), ("sheet", "")])
def test_a_contact_sheet_is_drawn_only_if_it_can_be_written(
    hair: bpy.types.Object, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str, why: str
) -> None:
    """The suffix is added to a name without it."""
    drawn: list[bool] = []

    def refuse(_: Sheet) -> None:
        drawn.append(True)
        raise HairloomError("no drawing here", place="test", remedy="None")

    monkeypatch.setattr(Sheet, "steps", refuse)
    (tmp_path / "folder.png").mkdir()
    (tmp_path / "sheet").mkdir()
    with pytest.raises(RuntimeError, match=why or "no drawing here"):
        bpy.ops.hairloom.contact_sheet(filepath=str(tmp_path / name), size=64)
    assert drawn == ([] if why else [True])


@pytest.mark.slow
def test_a_contact_sheet_of_all_looks_leaves_the_groom_its_own(table: Turntable) -> None:
    studio, worn = table.studio, table.studio.settings
    sheet = Sheet(studio, table.pose, table.points, (48, 48), 1, by_looks=True)
    assert list(sheet.steps()) == list(range(1, len(shipped_presets("shading")) + 1))
    assert studio.settings is worn
    rows = -(-len(shipped_presets("shading")) // COLUMNS)
    assert sheet.picture.shape == (48 * rows, 48 * COLUMNS, 4)
    top = sheet.picture[-48:]
    assert np.abs(top[:, :48] - top[:, 48:96]).max() > 0.1


def test_a_label_stands_in_the_lower_left_corner_and_nowhere_else() -> None:
    grey = np.full((100, 300, 4), 0.1, np.float32)
    named = labelled(grey, "Side")
    changed = np.argwhere(np.abs(named - grey).max(axis=-1) > 0.01)
    assert len(changed) > 20
    assert changed.max(axis=0)[0] < 20 and changed.max(axis=0)[1] < 60
    assert np.array_equal(labelled(grey, ""), grey)
    assert not np.array_equal(labelled(grey, "Back"), named)


@pytest.mark.parametrize("brightness", [0.02, 0.8])
def test_a_label_is_legible_on_dark_and_on_bright_pictures(brightness: float) -> None:
    """Each letter has bright pixels next to dark ones."""
    named = labelled(np.full((480, 480, 4), brightness, np.float32), "Side")[..., 0]
    contrast = np.abs(np.diff(named, axis=1))
    assert (contrast > 0.4).sum() > 60


def test_names_of_data_blocks_become_names_of_files() -> None:
    assert file_name("Hair.001") == "Hair.001"
    assert file_name("../a/b:c") == "_a_b_c"
    assert file_name("..") == "groom"


GROWN = [
    "--set",
    "children.method=none",
    "--set",
    "grow.strand_count=60",
    "--set",
    "guides.guide_count=10",
]


@pytest.mark.slow
def test_the_command_line_turns_a_groom(tmp_path: Path) -> None:
    folder, report = tmp_path / "turn", tmp_path / "report.json"
    sizes = ["--frames", "3", "--width", "64", "--height", "48", "--samples", "1"]
    arguments = ["turntable", *GROWN, *sizes, "--output", str(folder), "--report", str(report)]
    assert command_line.run(arguments) == 0
    assert sorted(path.name for path in folder.iterdir()) == [
        "turntable.mp4",
        *(f"turntable_000{number}.png" for number in (1, 2, 3)),
    ]
    assert "turntable_0003.png" in report.read_text()


@pytest.mark.slow
def test_the_command_line_draws_a_contact_sheet(tmp_path: Path) -> None:
    sizes = ["--width", "64", "--height", "48", "--samples", "1"]
    path = tmp_path / "sheet.png"
    assert command_line.run(["sheet", *GROWN, *sizes, "--output", str(path)]) == 0
    assert pixels_of(path).shape[:2] == (96, 64 * COLUMNS)


@pytest.mark.parametrize(
    ("wrong", "place"),
    [(["--frames", "0"], "turntable"), (["--width", "0"], "--width")],
    ids=["no frames", "no width"],
)
def test_the_command_line_refuses_what_nobody_can_draw(
    wrong: list[str], place: str, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    folder = tmp_path / "turn"
    assert command_line.run(["turntable", *GROWN, *wrong, "--output", str(folder)]) == 1
    assert f"hairloom: {place}: " in capfd.readouterr().err
    assert not folder.exists()


def test_a_folder_that_cannot_be_written_gets_a_message(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "file"
    file.write_text("mine")
    sizes = ["--frames", "2", "--width", "32", "--height", "32", "--samples", "1"]
    assert command_line.run(["turntable", *GROWN, *sizes, "--output", str(file / "turn")]) == 1
    message = capfd.readouterr().err
    assert message.startswith(f"hairloom: {file / 'turn'}: ") and "Choose a folder" in message


def test_limits_of_the_button_are_those_of_the_settings(extension: None) -> None:
    properties = bpy.ops.hairloom.turntable.get_rna_type().properties
    for name, (low, high) in {
        "frames": turntable_module.FRAME_LIMITS,
        "size": turntable_module.SIDE_LIMITS,
        "samples": turntable_module.SAMPLE_LIMITS,
    }.items():
        assert properties[name].soft_min == low and properties[name].soft_max <= high
        for number in (low - 1, high + 1):
            with pytest.raises(HairloomError, match=f"cannot be {number}"):
                TurntableSettings(**{"width" if name == "size" else name: number})
    defaults = TurntableSettings()
    assert properties["frames"].default == defaults.frames
    assert properties["size"].default == defaults.width == defaults.height
