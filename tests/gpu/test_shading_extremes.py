"""Every parameter of the look at both ends of its hard range: no infinite and no black pixels."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from gpu_rounding import is_same
from tiers import few_in_commits

from hairloom.addon.params import Settings
from hairloom.addon.params.field import NAME_KINDS
from hairloom.addon.render.camera import Camera, look_at, perspective
from hairloom.addon.render.snapshot import Snapshot
from hairloom.addon.shading.kajiya_kay_settings import KajiyaKaySettings
from hairloom.addon.shading.lights import Light
from hairloom.addon.shading.marschner.settings import MarschnerSettings
from hairloom.addon.shading.marschner.tables import PREVIEW_SIZE
from hairloom.addon.shading.settings import (
    MODELS,
    ShadingSettings,
    SharedSettings,
    StrandSettings,
)

pytestmark = pytest.mark.usefixtures("gpu_context")

SIZE = 40


def names_of(settings: type[Settings]) -> list[str]:
    return [parameter.name for parameter in settings.parameters() if parameter.name != "model"]


IDENTIFIERS = [identifier for identifier, _, _ in MODELS]
#: values that are black by definition
DARK = {("kajiya_kay", "base_color", (0.0, 0.0, 0.0))}
#: values that make strands invisible
INVISIBLE = {("fullness", 0.0), ("opacity", 0.0)}
#: other values that a parameter needs for a visible effect
TINTED = {"tip_tint": 1.0}
NEEDS: dict[str, dict[str, Any]] = {
    "tip_color": TINTED,
    "tint_start": TINTED,
    "tint_end": TINTED,
    "melanin": {"pigment": "melanin"},
    "redness": {"pigment": "melanin"},
    "absorption": {"pigment": "absorption"},
}
#: the parameters of a model; the other's reach no pixel
OWN = {
    "kajiya_kay": {*names_of(SharedSettings), *names_of(KajiyaKaySettings)},
    "marschner": {*names_of(SharedSettings), *names_of(MarschnerSettings)},
}


def ends(settings: Settings) -> Iterator[tuple[str, Any]]:
    """Each parameter's name with each of its extreme values, except names of attributes."""
    for parameter in settings.parameters():
        if parameter.kind in NAME_KINDS:
            continue
        if parameter.kind == "choice":
            values: list[Any] = [identifier for identifier, _, _ in parameter.choices]
        else:
            assert parameter.hard_range is not None, parameter.name
            values = list(parameter.hard_range)
            if parameter.kind == "color":
                values = [(value,) * 3 for value in values]
        yield from ((parameter.name, value) for value in values)


def drawn(frame: Any, shading: ShadingSettings, strands: StrandSettings) -> np.ndarray:
    """A tuft of bent hair, some of it end-on to the eye, lit from the front, from behind and along
    it."""
    around = np.linspace(0.0, 2.0 * np.pi, 60, endpoint=False)
    outward = np.stack([np.cos(around), np.sin(around), 0.3 + 0.0 * around], axis=-1)
    along = np.linspace(0.0, 1.0, 8)[:, None]
    points = 0.1 * outward[:, None] * along - np.array([0.0, 0.0, 0.05]) * along**2
    points[0] = np.array([0.0, -0.2, 0.0]) * along
    points[1] = np.array([0.0, 0.0, 0.15]) * along
    snapshot = Snapshot(
        points.astype(np.float32),
        np.full(points.shape[:2], 0.003, np.float32),
        lights=(
            Light.sun((0.1, 0.9, -0.5), (1.0, 1.0, 1.0), 4.0),
            Light.sun((0.0, -1.0, 0.0), (1.0, 1.0, 1.0), 4.0),
            Light.sun((0.0, 0.0, -1.0), (1.0, 1.0, 1.0), 4.0),
            Light.point((0.0, -0.3, 0.1), (1.0, 1.0, 1.0), 1.0),
        ),
        ambient=(0.0, 0.0, 0.0),
        shading=shading,
        strand_settings=strands,
        table_size=PREVIEW_SIZE,
    )
    camera = Camera(look_at((0, -0.5, 0), (0, 0, 0)), perspective(0.6, 1.0, 0.01, 5.0))
    picture: np.ndarray = frame.render_image(snapshot, camera, SIZE, SIZE, 1)
    return picture


@pytest.mark.parametrize("model", few_in_commits(IDENTIFIERS))
def test_every_end_of_shading(frame: Any, model: str) -> None:
    usual = ShadingSettings(model=model)
    bright = drawn(frame, usual, StrandSettings())
    typical = bright[..., :3].sum() / bright[..., 3].sum()
    for name, value in ends(usual):
        if name not in OWN[model]:
            continue
        shading = replace(usual, **NEEDS.get(name, {}), **{name: value})
        picture = drawn(frame, shading, StrandSettings())
        assert np.isfinite(picture).all(), (name, value)
        assert picture.min() >= 0.0, (name, value)
        assert is_same(picture[..., 3], bright[..., 3]), (name, value)
        mean = picture[..., :3].sum() / picture[..., 3].sum()
        is_dark = mean < 0.01 * typical
        assert is_dark == ((model, name, value) in DARK), (name, value, mean / typical)


@pytest.mark.slow(instead="test_every_end_of_shading")
@pytest.mark.parametrize("model", IDENTIFIERS)
def test_every_end_of_strands(frame: Any, model: str) -> None:
    for name, value in ends(StrandSettings()):
        settings = replace(StrandSettings(), **{name: value})
        picture = drawn(frame, ShadingSettings(model=model), settings)
        assert np.isfinite(picture).all(), (name, value)
        if (name, value) in INVISIBLE:
            assert not picture.any(), (name, value)
        else:
            assert picture[..., 3].any() and picture[..., :3].max() > 0.1, (name, value)


@pytest.mark.parametrize("model", IDENTIFIERS)
@pytest.mark.parametrize("pigment", ["color", "melanin", "absorption"])
@pytest.mark.parametrize("end", [0, 1], ids=["all lowest", "all highest"])
def test_all_ends_at_once(frame: Any, model: str, pigment: str, end: int) -> None:
    values: dict[str, Any] = {}
    for parameter in ShadingSettings.parameters():
        if parameter.hard_range is not None:
            value = parameter.hard_range[end]
            values[parameter.name] = (value,) * 3 if parameter.kind == "color" else value
    shading = ShadingSettings(model=model, pigment=pigment, **values)
    assert np.isfinite(drawn(frame, shading, StrandSettings())).all()
