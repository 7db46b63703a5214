"""Rigs that were built for a preview or a dialog are reused for files, but never after a change."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import bpy
import numpy as np
import pytest
from selecting import select
from swinging import key_x
from waiting import run_steps_until

from hairloom.addon.blender.base import latest_job
from hairloom.addon.blender.colliders import rigs
from hairloom.addon.blender.preview import previews
from hairloom.addon.blender.scene.partings import partings_of
from hairloom.addon.blender.strands.export_check import ExportCheck
from hairloom.addon.blender.strands.strand_export import StrandExport
from hairloom.addon.exchange.strand_export_settings import StrandExportSettings
from hairloom.addon.exchange.strand_formats import ALEMBIC, TRESSFX
from hairloom.addon.ui import operators_export_check


@pytest.fixture
def prepared(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """The names of hair, one for each time that a rig is prepared."""
    names: list[str] = []
    prepare = rigs.rig_flow.prepare

    def counted(*arguments: Any, **named: Any) -> Any:
        names.append(named["place"])
        return prepare(*arguments, **named)

    monkeypatch.setattr(rigs.rig_flow, "prepare", counted)
    return names


@pytest.fixture
def hair(new_hair: Callable[..., Any], sphere: Any) -> Iterator[Any]:
    """Hair with children of a painted density, a parting, and a keyframed head."""
    group = sphere.vertex_groups.new(name="Thick")
    count = len(sphere.data.vertices)
    group.add(list(range(count)), 1.0, "REPLACE")
    group.add(list(range(count // 2)), 0.2, "REPLACE")
    key_x(sphere, {1: 0.0, 5: 0.2})
    bpy.context.scene.frame_set(1)
    groom = new_hair(sphere)
    groom.data.hairloom.children.method, groom.data.hairloom.children.strand_count = "multi", 200
    groom.hairloom.children_density = "Thick"
    assert bpy.ops.hairloom.add_parting() == {"FINISHED"}
    select(groom)
    bpy.context.view_layer.update()
    yield groom
    operators_export_check.close_check()


def written(path: Path) -> bytes:
    assert bpy.ops.hairloom.export_tressfx(filepath=str(path)) == {"FINISHED"}
    return path.read_bytes()


def comb(hair: Any) -> None:
    hair.data.position_data[7].vector.z += 0.01
    hair.data.update_tag()


def sculpt(hair: Any) -> None:
    for vertex in hair.data.surface.data.vertices:
        vertex.co *= 1.05
    hair.data.surface.data.update_tag()


def move_head(hair: Any) -> None:
    hair.data.surface.animation_data_clear()
    hair.data.surface.location.z = 0.3


def unwrap(hair: Any) -> None:
    for loop in hair.data.surface.data.uv_layers[0].uv:
        loop.vector.x *= 0.5
    hair.data.surface.data.update_tag()


def paint(hair: Any) -> None:
    head = hair.data.surface
    head.vertex_groups["Thick"].add(list(range(0, 150)), 0.0, "REPLACE")
    head.data.update_tag()


def grow_more(hair: Any) -> None:
    hair.data.hairloom.children.strand_count = 250


def give_guides_more_points(hair: Any) -> None:
    hair.data.hairloom.guides.cv_count = 24


def widen(hair: Any) -> None:
    hair.data.hairloom.widths.method = "auto"


def forget_density(hair: Any) -> None:
    hair.hairloom.children_density = ""


def part_elsewhere(hair: Any) -> None:
    (line,) = partings_of(hair)
    line.location.x += 0.03


def go_to_another_frame(_hair: Any) -> None:
    bpy.context.scene.frame_set(4)


def undo_a_stroke(hair: Any) -> None:
    """Undo replaces the curves of the object."""
    points = np.empty(len(hair.data.points) * 3, np.float32)
    hair.data.position_data.foreach_get("vector", points)
    hair.data.position_data.foreach_set("vector", points * np.float32(1.01))
    hair.data.update_tag()


CHANGES = (
    comb,
    sculpt,
    move_head,
    unwrap,
    paint,
    grow_more,
    give_guides_more_points,
    widen,
    forget_density,
    part_elsewhere,
    go_to_another_frame,
    undo_a_stroke,
)


def test_a_file_of_previewed_hair_has_its_strands(
    hair: Any, get_depsgraph: Any, tmp_path: Path, prepared: list[str]
) -> None:
    expected = written(tmp_path / "own.tfx")
    assert prepared == ["Hair"]
    previews.start(hair, get_depsgraph())
    prepared.clear()
    assert written(tmp_path / "again.tfx") == expected and not prepared, "the preview has them"
    previews.stop(previews.sessions()[0])
    assert written(tmp_path / "last.tfx") == expected and prepared == ["Hair"], "nothing is kept"


@pytest.mark.parametrize("change", CHANGES, ids=lambda change: change.__name__)
def test_strands_of_a_preview_are_not_taken_for_other_hair(
    hair: Any, get_depsgraph: Any, tmp_path: Path, prepared: list[str], change: Any
) -> None:
    """Even if the preview has not read the change yet."""
    before = written(tmp_path / "before.tfx")
    previews.start(hair, get_depsgraph())
    change(hair)
    bpy.context.view_layer.update()
    prepared.clear()
    exported = written(tmp_path / "found.tfx")
    assert prepared == ["Hair"], "it is other hair"
    previews.stop_all()
    assert exported == written(tmp_path / "own.tfx") and exported != before


def test_strands_of_a_preview_are_taken_again_once_it_has_read_an_edit(
    hair: Any, get_depsgraph: Any, tmp_path: Path, prepared: list[str]
) -> None:
    session = previews.start(hair, get_depsgraph())
    comb(hair)
    session.read_again(get_depsgraph())
    prepared.clear()
    exported = written(tmp_path / "found.tfx")
    assert not prepared
    previews.stop_all()
    assert exported == written(tmp_path / "own.tfx")


def test_strands_of_a_bake_are_those_that_were_baked(
    hair: Any, get_depsgraph: Any, tmp_path: Path, prepared: list[str]
) -> None:
    """A bake previews the baked rig; a file gets the rig of the present curves."""
    bpy.context.scene.frame_start, bpy.context.scene.frame_end = 1, 2
    hair.hairloom.dynamics.collider_resolution = 16
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "file.blend"))
    assert bpy.ops.hairloom.bake() == {"FINISHED"}
    previews.stop_all()
    session = previews.start(hair, get_depsgraph())
    assert session.rig.child_count and session.rig.grown_children is None, (
        "it has those of the bake"
    )
    assert not previews.previewed_rigs()
    prepared.clear()
    written(tmp_path / "own.tfx")
    assert prepared == ["Hair"]


def test_hair_that_is_not_made_yet_is_made_for_the_file(
    hair: Any, get_depsgraph: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    expected = written(tmp_path / "own.tfx")
    monkeypatch.setattr(latest_job, "is_blocking", lambda: False)
    session = previews.start(hair, get_depsgraph())
    assert not session.is_made and written(tmp_path / "found.tfx") == expected


def test_the_dialog_makes_strands_once_and_the_file_has_them(
    hair: Any, tmp_path: Path, prepared: list[str]
) -> None:
    check = ExportCheck.of([hair])
    check.refresh(TRESSFX, StrandExportSettings())
    assert prepared == ["Hair"]
    check.refresh(ALEMBIC, StrandExportSettings())
    assert prepared == ["Hair"], "another format has the same strands"
    operators_export_check.open_check(check)
    exported = written(tmp_path / "found.tfx")
    assert prepared == ["Hair"]
    assert not operators_export_check.cached_rigs(), "they are kept no longer than the dialog"
    assert exported == written(tmp_path / "own.tfx") and prepared == ["Hair", "Hair"]
    operators_export_check.open_check(check)
    comb(hair)
    bpy.context.view_layer.update()
    edited = written(tmp_path / "edited.tfx")
    assert edited == written(tmp_path / "as_it_is.tfx") != own_bytes(tmp_path)
    assert len(prepared) == 4, "it was edited while the dialog was open"


def test_the_dialog_reads_hair_in_the_background_and_the_file_waits_for_it(
    hair: Any, tmp_path: Path, prepared: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    prepare, threads = rigs.rig_flow.prepare, list[threading.Thread]()

    def noted(*arguments: Any, **named: Any) -> Any:
        threads.append(threading.current_thread())
        return prepare(*arguments, **named)

    monkeypatch.setattr(rigs.rig_flow, "prepare", noted)
    check, settings = ExportCheck.of([hair]), StrandExportSettings()
    operators_export_check.open_check(check)
    operators_export_check.refresh_in_background(TRESSFX, settings)
    assert check.options is None and not prepared, "the file browser opens first"
    run_steps_until(lambda: prepared == ["Hair"])
    operators_export_check.refresh_in_background(ALEMBIC, settings)
    assert check.options is None, "the strands are not made yet"
    run_steps_until(lambda: check.options == (ALEMBIC, settings))
    assert check.lines and prepared == ["Hair"]
    assert threads and threading.main_thread() not in threads
    operators_export_check.open_check(ExportCheck.of([hair]))
    operators_export_check.refresh_in_background(TRESSFX, settings)
    run_steps_until(lambda: len(prepared) == 2)
    exported = written(tmp_path / "early.tfx")
    assert len(prepared) == 2, "they are made once, for the dialog and the file"
    assert exported == written(tmp_path / "own.tfx")


def own_bytes(folder: Path) -> bytes:
    return (folder / "own.tfx").read_bytes()


def test_the_dialog_takes_strands_of_the_preview(
    hair: Any, get_depsgraph: Any, prepared: list[str]
) -> None:
    previews.start(hair, get_depsgraph())
    prepared.clear()
    check = ExportCheck.of([hair], previews.previewed_rigs())
    check.refresh(TRESSFX, StrandExportSettings())
    assert check.lines and not prepared


def test_frames_of_children_are_of_strands_that_were_made_once(
    hair: Any, get_depsgraph: Any, prepared: list[str]
) -> None:
    plan = StrandExport.of(
        [hair], get_depsgraph(), ALEMBIC, StrandExportSettings(use_bake=False), frames=range(1, 3)
    )
    assert prepared == ["Hair"]
    one, two = plan.positions()
    assert not np.array_equal(one, two)
