"""A budget of GPU memory: what is reduced, in which order, and the effect on pictures."""

from __future__ import annotations

import contextvars
import threading
from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Any

import bpy  # noqa: F401  it must come before gpu, which lives inside it
import numpy as np
import pytest

from hairloom.addon.render import gpu_memory, gpu_objects
from hairloom.addon.render.camera import Camera, look_at, orthographic
from hairloom.addon.render.snapshot import Snapshot
from hairloom.addon.shading.lights import Light
from hairloom.addon.shading.settings import ShadingSettings, StrandSettings
from hairloom.addon.shading.volume.settings import VolumeSettings

pytestmark = pytest.mark.usefixtures("gpu_context")

MEGABYTE, SIZE = 1 << 20, 64
SUN = Light.sun((0.3, 1.0, -0.5), (1.0, 1.0, 1.0), 3.0)


@pytest.fixture(autouse=True)
def no_choice(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    monkeypatch.delenv(gpu_memory.MEMORY_VARIABLE, raising=False)
    yield
    gpu_memory.choose_budget(gpu_memory.DEFAULT_MEGABYTES)


@pytest.fixture
def hair() -> Any:
    """Strands across the picture, at all depths, with shadows."""
    random = np.random.default_rng(1)
    ends = random.uniform(-1.0, 1.0, (3000, 2, 3)).astype(np.float32)
    return Snapshot(
        ends,
        np.full(ends.shape[:2], 0.02, np.float32),
        ambient=(0.5, 0.5, 0.5),
        lights=(SUN,),
        shading=ShadingSettings(model="kajiya_kay"),
        strand_settings=StrandSettings(opacity=0.5),
        volume=VolumeSettings(resolution=256),
    )


def view_of() -> Any:
    return Camera(look_at((0.0, -10.0, 0.0), (0.0, 0.0, 0.0)), orthographic(2.0, 1.0, 0.0, 20.0))


@pytest.fixture
def drawn(frame: Any, monkeypatch: pytest.MonkeyPatch) -> Callable[[Any], tuple[np.ndarray, Any]]:
    """A function that draws with its own lists: the picture, and its statistics."""
    from hairloom.addon.render import strand_pass
    from hairloom.addon.render.mesh_pass import MeshPass
    from hairloom.addon.render.strand_layers import StrandLayers

    def picture(snapshot: Any) -> tuple[np.ndarray, Any]:
        monkeypatch.setattr(strand_pass, "LAYERS_OF_PIXELS", StrandLayers())
        passes = MeshPass(), strand_pass.StrandPass()
        image = frame.render_image(snapshot, view_of(), SIZE, SIZE, 1, passes=passes)
        return image, passes[1].statistics.layers

    return picture


def test_the_environment_is_stronger_than_the_preferences(monkeypatch: pytest.MonkeyPatch) -> None:
    assert gpu_memory.budget() == 1024 * MEGABYTE
    gpu_memory.choose_budget(300)
    assert gpu_memory.budget() == 300 * MEGABYTE
    monkeypatch.setenv(gpu_memory.MEMORY_VARIABLE, "2048")
    assert gpu_memory.budget() == 2048 * MEGABYTE
    for nonsense in ("", "much", "-5", "0"):
        monkeypatch.setenv(gpu_memory.MEMORY_VARIABLE, nonsense)
        assert gpu_memory.budget() == 300 * MEGABYTE


def test_lists_get_the_remaining_budget_and_never_nothing() -> None:
    gpu_objects.free_unused()
    taken = gpu_objects.bytes_in_use()
    before = gpu_memory.fragment_list_budget(0)
    budget = -(-taken // MEGABYTE) + 32
    gpu_memory.choose_budget(budget)
    assert not gpu_memory.exceeds_budget()
    large = gpu_objects.texture((2048, 2048), format="RGBA32F")  # 64 MB
    assert gpu_memory.exceeds_budget()
    assert gpu_memory.fragment_list_budget(0) == budget * MEGABYTE // 32
    assert gpu_memory.fragment_list_budget(64 * MEGABYTE) > gpu_memory.fragment_list_budget(0), (
        "these are the lists"
    )
    del large
    assert not gpu_memory.exceeds_budget()
    assert before == 256 * MEGABYTE, "a quarter where nothing is in the way"


def test_with_little_memory_strands_are_the_same_in_more_parts(hair: Any, drawn: Any) -> None:
    plain = replace(hair, volume=VolumeSettings(shadows="none"))
    much, in_much = drawn(plain)
    gpu_memory.choose_budget(1)
    little, in_little = drawn(plain)
    assert in_much.parts == 1 < in_little.parts
    assert in_little.missing == 0
    assert np.array_equal(much, little)


def test_lists_shrink_when_the_budget_does() -> None:
    from hairloom.addon.render.accumulation import Target
    from hairloom.addon.render.strand_layers import StrandLayers

    lists, rooms = StrandLayers(), []
    with Target().sized(SIZE, SIZE).drawing():
        for budget in (1024, 1, 1024):
            gpu_memory.choose_budget(budget)
            rooms.append(lists.reserve(10))
    assert rooms[1] < rooms[0]
    assert rooms[1] * 20 <= MEGABYTE // 4
    assert rooms[2] >= rooms[1]


def test_shadow_maps_of_many_grooms_share_half_of_it(hair: Any) -> None:
    from hairloom.addon.render.strand_pass import StrandPass

    gpu_memory.choose_budget(8)
    sizes = []
    for count in (1, 2, 8):
        with gpu_memory.shared_by(count):
            own = StrandPass()
            maps = own.opacity(hair)
            assert maps is not None
            assert maps.size.bytes <= 4 * MEGABYTE // count
            sizes.append(maps.size.side)
    assert 256 > sizes[0] > sizes[1] > sizes[2] > 16
    assert gpu_memory.shadow_map_budget() == 4 * MEGABYTE, "alone again"


def test_a_draw_says_once_that_its_maps_have_fewer_texels(frame: Any, hair: Any) -> None:
    """The number of texels depends on the budget and on the number of grooms."""
    from hairloom.addon.render.strand_pass import StrandPass

    passes = frame.MeshPass(), StrandPass()

    def notes(count: int) -> tuple[str, ...]:
        with gpu_memory.shared_by(count):
            frame.render_image(hair, view_of(), SIZE, SIZE, 1, passes=passes)
        return tuple(passes[1].statistics.notes)

    assert notes(1) == ()
    gpu_memory.choose_budget(8)
    (one,), (many,) = notes(1), notes(8)
    assert one != many and "may take 4," in one and "1 light " in one
    gpu_memory.choose_budget(gpu_memory.DEFAULT_MEGABYTES)
    assert notes(1) == ()


def test_maps_do_not_depend_on_what_else_is_there(hair: Any) -> None:
    """Otherwise a render farm's picture would differ from the window's."""
    from hairloom.addon.render.strand_pass import StrandPass

    gpu_memory.choose_budget(8)
    alone = StrandPass().opacity(hair)
    large = gpu_objects.texture((2048, 2048), format="RGBA32F")
    beside = StrandPass().opacity(hair)
    assert large is not None and alone is not None and beside is not None
    assert alone.size == beside.size


def test_each_thread_has_its_own_number_of_grooms() -> None:
    """A render can draw while the viewport does."""
    found = []
    with gpu_memory.shared_by(4):
        thread = threading.Thread(
            target=contextvars.Context().run,
            args=(lambda: found.append(gpu_memory.shadow_map_budget()),),
        )
        thread.start()
        thread.join()
        assert gpu_memory.shadow_map_budget() * 4 == found[0]
