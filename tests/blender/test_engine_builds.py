"""Rendered mode builds hair in a thread without blocking the window; renders wait for it."""

from __future__ import annotations

import threading
import traceback
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pytest
from waiting import run_steps_until, wait_until

bpy = pytest.importorskip("bpy", reason="these tests need Blender or the bpy module")

from hairloom.addon import rig_flow  # noqa: E402
from hairloom.addon.blender.base import latest_job  # noqa: E402
from hairloom.addon.blender.engine import engine_hair  # noqa: E402
from hairloom.addon.blender.engine.engine_scene import SceneReader  # noqa: E402
from hairloom.addon.blender.preview import previews, scene_events  # noqa: E402
from hairloom.addon.blender.viewport import overlay  # noqa: E402
from hairloom.addon.errors import HairloomError  # noqa: E402

COUNT = 60


class Gate:
    """Holds back hair that is built outside the main thread, and records the threads."""

    def __init__(self) -> None:
        self.opened, self.makers = threading.Event(), list[str]()
        self._prepare = rig_flow.prepare

    def prepare(self, *arguments: Any, **named: Any) -> Any:
        self.makers.append(threading.current_thread().name)
        if threading.current_thread() is not threading.main_thread():
            assert self.opened.wait(60.0)
        return self._prepare(*arguments, **named)


@pytest.fixture
def gate(monkeypatch: pytest.MonkeyPatch) -> Iterator[Gate]:
    gate = Gate()
    monkeypatch.setattr(rig_flow, "prepare", gate.prepare)
    yield gate
    gate.opened.set()
    engine_hair.forget()


@pytest.fixture
def hair(new_hair: Callable[..., Any], sphere: Any) -> Any:
    return new_hair(sphere)


class View:
    """Reads the scene as a 3D view in Rendered mode does: repeatedly, while hair is pending."""

    def __init__(self) -> None:
        self.reader = SceneReader()
        self._is_first = True

    def read(self, changed: set[int] | None = None, **named: Any) -> tuple[Any, ...]:
        known = None if self._is_first else changed or set()
        depsgraph = bpy.context.evaluated_depsgraph_get()
        scene = self.reader.read(depsgraph, changed=known, blocking=False, **named)
        self._is_first = False
        return tuple(groom.snapshot for groom in scene.grooms)

    def arrive(self) -> tuple[Any, ...]:
        found: tuple[Any, ...] = ()

        def is_there() -> bool:
            nonlocal found
            if not self.reader.pending:
                return True
            latest_job.run_steps()
            if not all(engine_hair.is_pending(uid) for uid in self.reader.pending):
                found = self.read()
            return False

        wait_until(is_there)
        return found


def test_the_first_picture_is_without_hair_until_it_is_made(hair: Any, gate: Gate) -> None:
    view = View()
    assert view.read() == () and view.reader.pending == {hair.session_uid}
    assert view.read() == (), "nor does the next picture wait"
    assert bpy.app.timers.is_registered(latest_job.run_steps)
    gate.opened.set()
    (shown,) = view.arrive()
    assert shown.strand_count == COUNT and gate.makers == ["hair in Rendered mode"]
    waited = engine_hair.read_groom(hair, bpy.context.evaluated_depsgraph_get())
    np.testing.assert_array_equal(shown.points, waited.points)
    np.testing.assert_array_equal(shown.occlusion, waited.occlusion)
    assert len(gate.makers) == 1, "it is made once"


def test_old_hair_stays_until_the_new_is_made(hair: Any, gate: Gate) -> None:
    gate.opened.set()
    view = View()
    view.read()
    view.arrive()
    gate.opened.clear()
    hair.data.hairloom.children.method = "multi"
    for count in (300, 310, 320):
        hair.data.hairloom.children.strand_count = count
        (old,) = view.read({hair.data.session_uid})
        assert old.strand_count == COUNT
    hair.data.hairloom.strands.fullness = 3.0
    (old,) = view.read({hair.data.session_uid})
    assert old.strand_settings.fullness == 3.0, "what acts at once does"
    gate.opened.set()
    (new,) = view.arrive()
    assert new.strand_count >= 320 and len(gate.makers) == 3, "what is in between is left out"


def test_renders_wait(hair: Any, gate: Gate) -> None:
    view = View()
    view.read()
    scene = SceneReader().read(bpy.context.evaluated_depsgraph_get())
    assert scene.grooms[0].snapshot.strand_count == COUNT
    assert gate.makers[-1] == "MainThread"
    gate.opened.set()
    (shown,) = view.arrive() or view.read()
    assert shown.strand_count == COUNT


def test_hair_that_cannot_be_built_is_reported(
    hair: Any, gate: Gate, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(*_: Any, **__: Any) -> None:
        raise HairloomError("it cannot be", place="Hair", remedy="Undo")

    monkeypatch.setattr(rig_flow, "prepare", fail)
    view = View()
    view.read()
    assert view.arrive() == () and "it cannot be" in view.reader.warnings[0]
    assert not view.reader.pending


def test_hair_that_became_invisible_is_not_waited_for(hair: Any, gate: Gate) -> None:
    view = View()
    view.read()
    uid = hair.session_uid
    assert engine_hair.is_pending(uid)
    bpy.data.objects.remove(hair)
    bpy.context.view_layer.update()
    assert view.read() == () and not view.reader.pending
    assert not engine_hair.is_pending(uid)
    assert latest_job.run_steps() is None
    latest_job.unschedule_all()
    assert not bpy.app.timers.is_registered(latest_job.run_steps)


def test_two_views_of_other_hair_leave_each_other_theirs(
    hair: Any, new_hair: Callable[..., Any], sphere: Any, gate: Gate
) -> None:
    other = new_hair(sphere)
    gate.opened.set()
    views = {each.name: View() for each in (hair, other)}
    for _ in range(2):
        for name, view in views.items():
            view.read(is_shown=lambda obj, name=name: obj.name in (name, "Head"))
    wait_until(lambda: latest_job.run_steps() is None)
    for name, view in views.items():
        shown = view.read(is_shown=lambda obj, name=name: obj.name in (name, "Head"))
        assert len(shown) == 1 and not view.reader.pending
    assert len(gate.makers) == 2, "each is made once"


def test_view_layers_of_other_hair_have_it_made_for_the_first_frame_alone(
    hair: Any, new_hair: Callable[..., Any], sphere: Any, gate: Gate
) -> None:
    scene, other = bpy.context.scene, new_hair(sphere)
    layers = [scene.view_layers[0], scene.view_layers.new("Too")]
    for layer, each in zip(layers, (hair, other), strict=True):
        collection = bpy.data.collections.new(each.name)
        scene.collection.children.link(collection)
        scene.collection.objects.unlink(each)
        collection.objects.link(each)
        layer.layer_collection.children[collection.name].exclude = True
    layers[0].layer_collection.children[other.name].exclude = False
    layers[1].layer_collection.children[hair.name].exclude = False
    for frame in (1, 2, 3):
        scene.frame_set(frame)
        for layer in layers:
            layer.update()
            (groom,) = SceneReader().read(layer.depsgraph).grooms
            assert groom.name == (other if layer == layers[0] else hair).name
    assert len(gate.makers) == 2


def test_hair_is_made_again_after_a_file_that_could_not_be_opened(
    hair: Any, gate: Gate, tmp_path: Any
) -> None:
    view = View()
    view.read()
    (tmp_path / "bad.blend").write_bytes(b"no file of Blender's")
    with pytest.raises(RuntimeError):
        bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "bad.blend"))
    gate.opened.set()
    view.read()
    (shown,) = view.arrive()
    assert shown.strand_count == COUNT


def test_an_error_reported_repeatedly_does_not_grow(
    hair: Any, gate: Gate, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(*_: Any, **__: Any) -> None:
        raise HairloomError("it cannot be", place="Hair", remedy="Undo")

    monkeypatch.setattr(rig_flow, "prepare", fail)
    lengths = []

    def read() -> None:
        try:
            engine_hair.read_groom(hair, bpy.context.evaluated_depsgraph_get(), blocking=False)
        except (HairloomError, engine_hair.HairNotReadyError) as error:
            causes = error, error.__cause__
            lengths.append(sum(len(list(traceback.walk_tb(e.__traceback__))) for e in causes if e))

    read()
    wait_until(lambda: latest_job.run_steps() is None)
    for _ in range(4):
        read()
    assert len(set(lengths[1:])) == 1


def test_the_picture_keeps_its_hair_until_the_preview_has_its_own(
    hair: Any, gate: Gate, monkeypatch: pytest.MonkeyPatch
) -> None:
    gate.opened.set()
    view = View()
    view.read()
    (before,) = view.arrive()
    monkeypatch.setattr(latest_job, "is_blocking", lambda: False)
    gate.opened.clear()
    session = previews.start(hair, bpy.context.evaluated_depsgraph_get())
    assert overlay.pending_uids() == {hair.session_uid} and not overlay.drawn_uids()

    def read() -> tuple[Any, ...]:
        drawn, expected = overlay.drawn_uids(), overlay.pending_uids()
        return view.read(
            {hair.session_uid},
            is_previewed=drawn.__contains__,
            has_pending_preview=expected.__contains__,
        )

    assert read() == (before,)
    gate.opened.set()
    run_steps_until(lambda: not session.is_pending)
    assert overlay.drawn_uids() == {hair.session_uid} and not overlay.pending_uids()
    assert read() == (), "the preview draws it from now on"
    scene_events.clear()


def test_hair_is_rebuilt_after_any_change(hair: Any, sphere: Any) -> None:
    """Hair is built again for other seeds, root UVs, triangles of the head, or UVs of the head."""

    def made() -> Any:
        return engine_hair.read_groom(hair, bpy.context.evaluated_depsgraph_get())

    def curves_have(name: str, kind: str, field: str, values: np.ndarray) -> None:
        attribute = hair.data.attributes.new(name, kind, "CURVE")
        attribute.data.foreach_set(field, values.ravel())
        hair.data.update_tag()

    before = made()
    assert made().seed is before.seed, "the same hair is kept"
    curves_have("strand_seed", "INT", "value", np.arange(COUNT, dtype=np.int32) + 1000)
    seeded = made()
    np.testing.assert_array_equal(seeded.seed, np.arange(COUNT) + 1000)
    others = np.full((COUNT, 2), 0.25, np.float32)
    curves_have("surface_uv_coordinate", "FLOAT2", "vector", others)
    with_uv = made()
    assert with_uv.seed is not seeded.seed
    sphere.data.uv_layers.active.data.foreach_set("uv", np.zeros(2 * len(sphere.data.loops)))
    sphere.data.update_tag()
    with_other_uv = made()
    assert with_other_uv.seed is not with_uv.seed
    sphere.data.flip_normals()
    assert made().seed is not with_other_uv.seed
    engine_hair.forget()
