"""Drawing on GPUs without image atomics: pictures against those with atomics, and programs that
must not be compiled.

Layers and deep opacity maps with atomics are the reference; other tests compare them with sorting
and with counted strands.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from flat_cards import camera, card, mesh_of, snapshot_of

from hairloom.addon.render.camera import Camera, look_at, perspective
from hairloom.addon.render.hashed_alpha import scrambled
from hairloom.addon.render.snapshot import MeshSnapshot, Snapshot
from hairloom.addon.shading.lights import Light
from hairloom.addon.shading.settings import ShadingSettings, StrandSettings
from hairloom.addon.shading.textures import HairTextures
from hairloom.addon.shading.volume.settings import VolumeSettings
from hairloom.addon.strands import Surface

pytestmark = pytest.mark.usefixtures("gpu_context")

SIZE, SAMPLES = 64, 16
SUNS = (
    Light.sun((0.3, -1.0, -0.5), (1.0, 1.0, 1.0), 3.0),
    Light.sun((-0.8, -0.2, -0.4), (1.0, 0.8, 0.6), 1.0),
)
CHOICES = ("automatic", "never")


@pytest.fixture
def choose() -> Iterator[Any]:
    """A function that chooses image atomics; the choice is reset afterwards."""
    from hairloom.addon.render import capabilities

    yield capabilities.choose_image_atomics
    capabilities.choose_image_atomics("automatic")


@pytest.fixture
def made(monkeypatch: pytest.MonkeyPatch) -> Iterator[list[Any]]:
    """The recipes of all programs that are compiled from here on, without cached ones."""
    from hairloom.addon.render import shader_program

    recipes: list[Any] = []
    compiled, before = shader_program._compiled, shader_program._PROGRAMS
    programs: dict[Any, Any] = {}

    def recorded(recipe: Any) -> Any:
        recipes.append(recipe)
        return compiled(recipe)

    monkeypatch.setattr(shader_program, "_PROGRAMS", programs)
    monkeypatch.setattr(shader_program, "_compiled", recorded)
    yield recipes
    # shaders must stay referenced until all are released
    before |= {
        replace(each, name=f"{each.name}, {len(before)}"): programs[each] for each in programs
    }


def dome(count: int = 1500, cv_count: int = 12) -> tuple[np.ndarray, np.ndarray]:
    """Hair that leaves the upper half of a ball of 10 cm, and falls."""
    random = np.random.default_rng(3)
    away = random.normal(size=(count, 3))
    away[:, 2] = np.abs(away[:, 2])
    away /= np.linalg.norm(away, axis=1, keepdims=True)
    along = np.linspace(0.0, 1.0, cv_count)[:, None]
    strands = away[:, None] * (0.1 + 0.06 * along) - np.array([0, 0, 0.08]) * along**2
    return strands.astype(np.float32), np.full((count, cv_count), 4e-4, np.float32)


def wall() -> Any:
    """A wall amid the hair that hides some of it."""
    corners = np.array([[0.02, y, z] for y in (-0.3, 0.3) for z in (-0.1, 0.12)], np.float32)
    return MeshSnapshot.of(Surface(corners, np.array([[0, 1, 2], [1, 3, 2]], np.int32)))


def shown(transparency: str = "layers", shadows: str = "deep") -> Any:
    return Snapshot(
        *dome(),
        lights=SUNS,
        ambient=(0.1, 0.1, 0.1),
        meshes=(wall(),),
        shading=ShadingSettings(model="marschner"),
        strand_settings=StrandSettings(transparency=transparency),
        volume=VolumeSettings(shadows=shadows, resolution=128),
    )


def camera_of() -> Any:
    view = look_at((0.5, -0.6, 0.3), (0.0, 0.0, 0.05))
    return Camera(view, perspective(0.4, 1.0, 0.1, 3.0))


def accumulated(frame: Any, snapshot: Any) -> np.ndarray:
    """The mean of samples as in the render engine."""
    from hairloom.addon.render.camera_window import jittered
    from hairloom.addon.render.mesh_pass import MeshPass
    from hairloom.addon.render.pixel_filter import jitters
    from hairloom.addon.render.strand_pass import StrandPass

    passes, camera = (MeshPass(), StrandPass()), camera_of()
    samples = [
        frame.render_image(
            snapshot, jittered(camera, place, SIZE, SIZE, number), SIZE, SIZE, 1, passes=passes
        )
        for number, place in enumerate(jitters(SAMPLES, 1.5))
    ]
    return np.mean(samples, axis=0)


def test_capabilities_are_probed_once(monkeypatch: pytest.MonkeyPatch) -> None:
    import gpu

    from hairloom.addon.render import capabilities as module

    probe_anew(monkeypatch)
    found = module.capabilities()
    assert found.backend == gpu.platform.backend_type_get() and found.image_atomics
    assert not found.atomics_problem and not found.missing_formats
    assert found.texture_size == gpu.capabilities.max_texture_size_get() >= 4096
    assert min(found.group_size) >= 64 and found.texture_layers >= 256
    assert found.dispatch_ms is not None and 0.0 < found.dispatch_ms < found.probe_ms
    assert module.capabilities() is found


def probe_anew(monkeypatch: pytest.MonkeyPatch) -> None:
    """Forget the result of the probe, as if Blender had just started."""
    from hairloom.addon.render import capabilities

    monkeypatch.setattr(capabilities, "_probe", cache(capabilities._probe.__wrapped__))


@pytest.mark.parametrize("change", ["nothing", "no add", "no program"])
def test_atomics_that_do_nothing_are_noticed(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, change: str
) -> None:
    """Drivers that compile the program but write nothing or too little, and one that does not
    compile it."""
    from hairloom.addon.render import capabilities as module
    from hairloom.addon.render.shader_source import SHADER_FOLDER

    text = (SHADER_FOLDER / "probe_atomics.frag.glsl").read_text()
    source = {
        "nothing": "void main() { color = vec4(0.0); }",
        "no add": text.replace("imageAtomicAdd(probed, ivec2(4", "imageAtomicOr(probed, ivec2(4"),
        "no program": text.replace("uint number =", "uint number = nonsense +"),
    }[change]
    assert source != text
    (tmp_path / "probe_atomics.frag.glsl").write_text(source)
    recipe = replace(
        module._ATOMICS_RECIPE, name=f"probe {change}", folders=(tmp_path, SHADER_FOLDER)
    )
    monkeypatch.setattr(module, "_ATOMICS_RECIPE", recipe)
    probe_anew(monkeypatch)
    found = module.capabilities()
    assert not found.image_atomics
    assert ("nonsense" if change == "no program" else "they give [") in found.atomics_problem


def test_atomics_are_not_probed_on_metal(monkeypatch: pytest.MonkeyPatch, made: list[Any]) -> None:
    from hairloom.addon.render import capabilities as module

    class Platform:
        backend_type_get = staticmethod(lambda: "METAL")

    class Gpu:
        platform, capabilities = Platform, module.gpu.capabilities
        compute, shader, types = module.gpu.compute, module.gpu.shader, module.gpu.types

    monkeypatch.setattr(module, "gpu", Gpu)
    probe_anew(monkeypatch)
    found = module.capabilities()
    assert not found.image_atomics and "Metal" in found.atomics_problem
    assert not any(uses_atomics(recipe) for recipe in made)


def test_both_preferences_and_environment_forbid_them(
    choose: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    from hairloom.addon.render.capabilities import ATOMICS_VARIABLE, capabilities

    assert capabilities().image_atomics
    choose("never")
    assert not capabilities().image_atomics and "preferences" in capabilities().atomics_problem
    choose("automatic")
    monkeypatch.setenv(ATOMICS_VARIABLE, "never")
    assert not capabilities().image_atomics
    assert ATOMICS_VARIABLE in capabilities().atomics_problem


def test_a_choice_takes_effect_from_the_next_draw_on(
    choose: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    from hairloom.addon.render.capabilities import capabilities

    probe_anew(monkeypatch)
    choose("never")
    assert not capabilities().image_atomics
    choose("automatic")
    assert capabilities().image_atomics and not capabilities().atomics_problem


def uses_atomics(recipe: Any) -> bool:
    return any("imageAtomic" in text.source for text in recipe.texts.values())


@pytest.mark.parametrize("choice", CHOICES)
def test_no_program_with_atomics_is_made_where_they_are_forbidden(
    frame: Any, choose: Any, made: list[Any], monkeypatch: pytest.MonkeyPatch, choice: str
) -> None:
    """For layers of strands, and for deep maps of strands and cards."""

    probe_anew(monkeypatch)
    choose(choice)
    frame.render_image(shown(), camera_of(), SIZE, SIZE, 1)
    draw_cards(frame)
    assert len(made) > 8
    assert any(map(uses_atomics, made)) is (choice == "automatic")


def draw_cards(frame: Any) -> np.ndarray:
    """Two cards that let light through before a third one, seen from its dark side."""
    half = np.full((2, 2), 0.5, np.float32)
    alpha = np.float32([[0.3, 1.0], [0.3, 1.0]])
    textures = HairTextures(
        np.ones((2, 2, 3), np.float32), alpha, half, half, np.dstack([half] * 3)
    )
    fronts = [card((0.0, 0.0), (0.5, 1.0), y, u=(0.0, 0.0)) for y in (0.0, 0.2)]
    back = card((1.0, 0.0), (0.0, 1.0), 0.6, u=(1.0, 1.0))
    sun = Light.sun((0.0, 1.0, 0.0), (1.0, 1.0, 1.0), 3.0)
    volume = VolumeSettings(shadows="deep", resolution=64)
    cards = snapshot_of(mesh_of(*fronts, back), textures, volume=volume, lights=(sun,))
    picture: np.ndarray = frame.render_image(cards, camera(3.0), SIZE, SIZE, 1)
    return picture


def test_shadows_of_cards_need_no_atomics(frame: Any, choose: Any) -> None:
    """The same pictures with and without; test_card_shadows.py compares them with formulas."""
    pictures = []
    for choice in CHOICES:
        choose(choice)
        pictures.append(draw_cards(frame))
    assert np.ptp(pictures[0][SIZE // 2, :, 0]) > 0.01, "there is a shadow"
    np.testing.assert_array_equal(*pictures)


def both_ways(frame: Any, choose: Any) -> tuple[np.ndarray, ...]:
    """Accumulated strands with atomics and without; 1 is bright."""
    pictures = []
    for choice in CHOICES:
        choose(choice)
        pictures.append(accumulated(frame, shown(shadows="none")))
    hair = pictures[0][..., 3] > 0.0
    assert 0.2 < hair.mean() < 0.9
    bright = np.quantile(pictures[0][hair][:, :3], 0.95)
    return tuple(each / (bright, bright, bright, 1.0) for each in pictures)


def test_accumulated_strands_are_layers(frame: Any, choose: Any) -> None:
    """Also in pixels where hair lies before and behind a wall."""
    with_, without = both_ways(frame, choose)
    off, hair = without - with_, with_[..., 3] > 0.0
    assert np.abs(off[..., :3]).mean() < 0.02 and np.abs(off[hair]).mean() < 0.03
    assert off[hair].mean(axis=0) == pytest.approx(np.zeros(4), abs=3e-3)
    assert np.abs(off[..., 3]).mean() < 0.01


def test_they_look_like_layers(frame: Any, choose: Any) -> None:
    """By mean FLIP (Andersson et al. 2020), with hair that fills the picture."""
    flip = pytest.importorskip("flip_evaluator")
    codes = [
        np.clip(0.8 * each[..., :3], 0.0, 1.0).astype(np.float32) ** (1 / 2.2)
        for each in both_ways(frame, choose)
    ]
    assert flip.evaluate(*codes, "LDR")[1] < 0.03


def test_deep_maps_are_the_same(frame: Any, choose: Any) -> None:
    """The starts of layers, and the picture of opaque strands in their light."""
    from hairloom.addon.render.strand_pass import StrandPass

    starts, pictures = {}, {}
    snapshot = shown("none")
    for choice in CHOICES:
        choose(choice)
        own = StrandPass()
        maps = own.opacity(snapshot)
        assert maps is not None
        starts[choice] = np.asarray(maps.starts.read()).astype(np.float64) / (1 << 24)
        pictures[choice] = frame.render_image(snapshot, camera_of(), SIZE, SIZE, 1)
    with_, without = starts.values()
    assert 0.2 < (with_ <= 1.0).mean() < 0.95
    # rounding decides at borders of texels
    assert (np.abs(with_ - without) > 1e-6).mean() < 1e-3
    lit = pictures["automatic"][..., :3]
    off = np.abs(pictures["never"] - pictures["automatic"])[..., :3]
    assert lit.max() > 0.2 and off.max() < lit.max() / 255.0


def test_existing_maps_follow_the_choice(gpu_context: Any, choose: Any) -> None:
    """Existing maps are drawn again with the other program."""
    from hairloom.addon.render.strand_pass import StrandPass

    own, snapshot = StrandPass(), shown("none")
    first = own.opacity(snapshot)
    assert own.opacity(snapshot) is first
    choose("never")
    assert own.opacity(snapshot) is not first


@pytest.mark.parametrize("lengths", ["long", "short"])
def test_strands_of_few_and_of_many_points_leave_no_gaps(
    gpu_context: Any, choose: Any, lengths: str
) -> None:
    """One strand across the whole map, in one segment and in a hundred."""
    from hairloom.addon.render.opacity_pass import OpacityPass
    from hairloom.addon.render.strand_layout import StrandLayout, strand_rows
    from hairloom.addon.render.textures import texture_from
    from hairloom.addon.shading.volume.light_frame import ball_around

    count = 2 if lengths == "long" else 101
    strand = np.linspace((-0.1, 0.0, 0.0), (0.1, 0.001, 0.02), count)[None].astype(np.float32)
    rows = strand_rows(np.pad(strand, ((0, 0), (0, 0), (0, 1)), constant_values=1e-3))
    points, layout = texture_from(rows, "RGBA32F"), StrandLayout.uniform(1, count)
    settings = VolumeSettings(shadows="deep", resolution=256, strand_fraction=1.0)
    found = {}
    for choice in CHOICES:
        choose(choice)
        ball, look = ball_around(strand), StrandSettings()
        maps = OpacityPass().maps(points, 1, layout, ball, SUNS[:1], settings, look)
        found[choice] = np.asarray(maps.starts.read()) <= 1 << 24
    assert found["automatic"].sum() > 60
    assert (found["automatic"] ^ found["never"]).sum() <= 2


def test_sequences_are_even_and_independent() -> None:
    """Each sequence is stratified, and joint frequencies of two are products of their own."""
    random = np.random.default_rng(5)
    seeds = random.integers(0, 1 << 32, (2, 2, 4000, 1), dtype=np.uint32)
    one, other = (scrambled(np.arange(SAMPLES), *each) for each in seeds)
    strata = np.sort((one * SAMPLES).astype(int), axis=1)
    assert (strata == np.arange(SAMPLES)).all()
    for low, high in ((0.5, 0.5), (0.25, 0.7)):
        both = ((one < low) & (other < high)).mean(axis=1)
        assert both.mean() == pytest.approx(low * high, abs=0.004)
        many = [scrambled(np.arange(4096), *each[:, :40]) for each in seeds]
        joint = ((many[0] < low) & (many[1] < high)).mean(axis=1)
        assert np.abs(joint - low * high).max() < 0.03, "no pair stays together"
