"""A view at rest collects samples of soft shadows; any change shows hard shadows at once."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest

bpy = pytest.importorskip("bpy", reason="these tests need Blender or the bpy module")

from small_view import ADDRESS, SIZE, SmallView  # noqa: E402

from hairloom.addon.blender.viewport import overlay, softening, views  # noqa: E402
from hairloom.addon.render import gpu_objects  # noqa: E402
from hairloom.addon.render.camera import Camera, look_at, orthographic, perspective  # noqa: E402
from hairloom.addon.render.light_samples import lights_at  # noqa: E402
from hairloom.addon.render.snapshot import Snapshot  # noqa: E402
from hairloom.addon.shading.lights import Light  # noqa: E402
from hairloom.addon.shading.settings import ShadingSettings, StrandSettings  # noqa: E402
from hairloom.addon.shading.volume.settings import VolumeSettings  # noqa: E402
from hairloom.addon.strands import Surface  # noqa: E402

pytestmark = [pytest.mark.draws, pytest.mark.usefixtures("gpu_context", "extension")]

SAMPLES = 9
LOOK_AT = look_at((0.0, -0.5, 0.8), (0.0, 0.0, 0.05))
SUN = Light.sun((0.4, 0.2, -1.0), (1.0, 1.0, 1.0), 2.0, np.radians(20.0))
FLOOR = Surface(
    np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], np.float32),
    np.array([[0, 1, 2], [0, 2, 3]], np.int32),
)


def sheet(height: float, y: float) -> Snapshot:
    """Horizontal parallel strands above a floor that their shadow falls on."""
    random = np.random.default_rng(1)
    strands = np.zeros((150, 4, 3), np.float32)
    strands[..., 0] = np.linspace(-0.12, 0.12, 4)
    strands[..., 1] = y + 0.1 * ((np.arange(150) + 0.5) / 150 - 0.5)[:, None]
    strands[..., 2] = height + random.uniform(0.0, 0.005, (150, 1))
    return Snapshot(
        strands,
        np.full(strands.shape[:2], 4.0e-4, np.float32),
        shading=ShadingSettings(model="kajiya_kay", base_color=(0.3, 0.3, 0.3)),
        strand_settings=StrandSettings(tip_width=1.0),
        volume=VolumeSettings(resolution=64, strand_fraction=1.0),
        lights=(SUN,),
        ambient=(0.05, 0.05, 0.05),
        casters=(FLOOR,),
    )


GROOMS = {"low": sheet(0.06, 0.0), "high": sheet(0.2, -0.05)}


@pytest.fixture(params=["perspective", "orthographic"])
def view(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> Iterator[SmallView]:
    """A camera's view on a machine that claims to have a GPU, and whose window allows redraws."""
    is_flat = request.param == "orthographic"
    projection = orthographic(0.5, 1.0, 0.1, 3.0) if is_flat else perspective(0.5, 1.0, 0.1, 3.0)
    monkeypatch.setattr(views, "_addresses", lambda: iter((ADDRESS,)))
    monkeypatch.setattr(softening, "is_software", lambda: False)
    monkeypatch.setattr(softening, "redraw_view", lambda address: address == ADDRESS)
    picture = bpy.context.scene.hairloom.picture
    before, picture.viewport_samples = picture.viewport_samples, SAMPLES
    overlay._overlay.drawn.clear()
    yield SmallView(Camera(LOOK_AT, projection))
    overlay._overlay.drawn.clear()
    softening.stop()
    views.forget_views()
    picture.viewport_samples = before


def hardened(view: SmallView, grooms: dict[str, Snapshot]) -> np.ndarray:
    """The picture of these grooms at rest, with hard shadows."""
    view.shows(**grooms)
    for each in views.known_views():
        assert not each.is_soft
        each.picture.forget()
    return view.drawn()


def softened(view: SmallView) -> tuple[np.ndarray, int]:
    """The view once it requests no more samples, and the number of redraws until then."""
    for redraws in range(3 * SAMPLES):
        softening._request_sample()
        if not softening._softening.is_due:
            return view.drawn(), redraws
        view.drawn()
    raise AssertionError("a view is drawn for ever")


def mean_of_hard(view: SmallView, grooms: dict[str, Snapshot]) -> np.ndarray:
    center = np.mean([each.center for each in grooms.values()], axis=0)
    picture, total = bpy.context.scene.hairloom.picture, np.zeros((SIZE, SIZE, 4))
    picture.viewport_samples = 1
    for sample in range(SAMPLES):
        lights = lights_at((SUN,), sample, center)
        total += hardened(view, {n: replace(each, lights=lights) for n, each in grooms.items()})
    picture.viewport_samples = SAMPLES
    return total / SAMPLES


@pytest.mark.alike
@pytest.mark.parametrize("names", [("low",), ("low", "high")])
def test_a_view_at_rest_becomes_soft(view: SmallView, names: tuple[str, ...]) -> None:
    """Hair and its shadow on the floor approximate the mean of pictures with hard shadows."""
    grooms = {name: GROOMS[name] for name in names}
    expected, hard = mean_of_hard(view, grooms), hardened(view, grooms)
    soft, redraws = softened(view)
    assert redraws == SAMPLES
    off, was_off = (np.sqrt(np.mean((each - expected) ** 2)) for each in (soft, hard))
    assert off < 0.001 < 0.008 < was_off, (off, was_off)
    assert (softened(view)[0] == soft).all()


def test_changed_shadows_are_hard_at_once(view: SmallView) -> None:
    """A changed picture equals one with hard shadows bit for bit, and no earlier samples count."""
    hard = hardened(view, GROOMS)
    turned = {
        name: replace(each, lights=(replace(SUN, power=(1.0, 2.0, 2.0)),))
        for name, each in GROOMS.items()
    }
    other_hard = hardened(view, turned)
    assert (hard != other_hard).any()
    hardened(view, GROOMS)
    for _ in range(4):
        softening._request_sample()
        view.drawn()
    assert (hardened(view, turned) == other_hard).all()
    assert not softening.sample_picture().count
    soft, redraws = softened(view)
    assert redraws == SAMPLES and (soft != other_hard).any()
    assert (hardened(view, GROOMS) == hard).all()


def test_the_last_sample_frees_all_textures(view: SmallView) -> None:
    def held() -> int:
        gpu_objects.free_unused()
        return gpu_objects.bytes_in_use()

    hardened(view, GROOMS)
    before = held()
    softening._request_sample()
    view.drawn()
    assert held() > before + 50 * SIZE * SIZE
    softened(view)
    assert held() <= before
