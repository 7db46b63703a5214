"""Marschner's tables on Blender's GPU: filtered correctly, cached, shared, and built again."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from gpu_rounding import tolerance

from hairloom.addon.render.camera import Camera, look_at, orthographic
from hairloom.addon.render.snapshot import Snapshot
from hairloom.addon.shading.kajiya_kay import strand_normal
from hairloom.addon.shading.lights import Light
from hairloom.addon.shading.marschner.look import fibre_of, marschner_light, strand_absorption
from hairloom.addon.shading.marschner.tables import PREVIEW_SIZE, marschner_tables
from hairloom.addon.shading.settings import ShadingSettings, StrandSettings
from hairloom.addon.shading.strand_noise import strand_noise
from hairloom.addon.shading.volume.settings import VolumeSettings

pytestmark = [pytest.mark.draws, pytest.mark.usefixtures("gpu_context")]

PLAIN = ShadingSettings(model="marschner", shift_noise=0.0, sparkle=0.0, grey_fraction=0.0)
SIZE = 99


@pytest.fixture
def frame() -> Any:
    from hairloom.addon.render import frame

    return frame


def snapshot_of(shading: ShadingSettings, **more: Any) -> Any:
    """A fan of wide straight strands in the plane y = 0, lit by one sun."""
    angle = np.radians(np.linspace(-40.0, 40.0, 9))
    tips = 0.4 * np.stack([np.sin(angle), 0.0 * angle, np.cos(angle)], axis=-1)
    strands = np.stack([0.25 * tips, tips], axis=1).astype(np.float32)
    return Snapshot(
        strands,
        np.full((9, 2), 0.012, np.float32),
        lights=(Light.sun((0.1, 1.0, -0.4), (1.0, 0.9, 0.8), 3.0),),
        ambient=(0.0, 0.0, 0.0),
        shading=shading,
        strand_settings=StrandSettings(tip_width=1.0, minimum_width=0.0),
        volume=VolumeSettings(shadows="none"),
        volume_center=np.array([0.0, 5.0, 0.2], np.float32),
        table_size=PREVIEW_SIZE,
        **more,
    )


def drawn(frame: Any, snapshot: Any, passes: Any = None) -> np.ndarray:
    """The picture seen from -y, with x from -0.25 to 0.25 and z from 0 to 0.5."""
    camera = Camera(look_at((0.0, -1.0, 0.25), (0.0, 0.0, 0.25)), orthographic(0.5, 1.0, 0.0, 3.0))
    picture: np.ndarray = frame.render_image(snapshot, camera, SIZE, SIZE, 1, passes=passes)
    return picture


@pytest.mark.parametrize("melanin", [0.2, 0.9])
def test_strands_have_the_light_of_the_reference(frame: Any, melanin: float) -> None:
    """A straight strand reads between texels, on every backend."""
    shading = replace(PLAIN, pigment="melanin", melanin=melanin)
    snapshot = snapshot_of(shading)
    picture = drawn(frame, snapshot)
    root, tip = snapshot.points[::2].astype(np.float64), snapshot.points[1::2].astype(np.float64)
    point = 0.5 * (root + tip)
    tangent = (tip - root) / np.linalg.norm(tip - root, axis=-1, keepdims=True)
    normal = strand_normal(point, tangent, snapshot.center.astype(np.float64))
    own = [strand_noise(np.arange(9), channel, np.zeros(9)) for channel in (2, 3)]
    sun = snapshot.lights[0]
    expected = np.array(sun.power) * marschner_light(
        marschner_tables(fibre_of(shading), PREVIEW_SIZE),
        tangent,
        normal,
        np.array(sun.vector),
        np.array([0.0, -1.0, 0.0]),
        np.full(9, 0.5),
        np.ones(9),
        strand_absorption(shading, np.full(9, 0.5), *own),
        shading,
    )
    column, row = ((point[:, [0, 2]] / 0.5 + [0.5, 0.0]) * SIZE).astype(int).T
    assert picture[row, column, :3] == pytest.approx(expected, rel=tolerance(1e-3, 4e-3))


def test_tables_are_computed_once_per_fibre_shape_and_shared(
    frame: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Colours and strengths need no new table; new shapes do, old ones after CAPACITY others."""
    from hairloom.addon.render import marschner_textures

    made: list[Any] = []

    def counted(*shape: Any) -> Any:
        made.append(shape)
        return marschner_tables(*shape)

    monkeypatch.setattr(marschner_textures, "marschner_tables", counted)
    marschner_textures.MARSCHNER.release()
    first = drawn(frame, snapshot_of(PLAIN))
    changes: tuple[dict[str, Any], ...] = (
        {"base_color": (0.5, 0.1, 0.1)},
        {"strength_r": 0.2, "strength_trt": 3.0},
        {"tip_tint": 1.0, "grey_fraction": 0.5, "fake_scattering": 0.0},
    )
    for change in changes:
        assert (drawn(frame, snapshot_of(replace(PLAIN, **change))) != first).any()
    assert len(made) == 1
    for step in range(marschner_textures.CAPACITY):
        drawn(frame, snapshot_of(replace(PLAIN, width_r=0.05 + 0.01 * step)))
    assert len(made) == 1 + marschner_textures.CAPACITY
    assert (drawn(frame, snapshot_of(PLAIN)) == first).all()
    assert len(made) == 2 + marschner_textures.CAPACITY


def test_models_take_turns_in_one_pass(frame: Any) -> None:
    """Also after everything on the GPU was released."""
    from hairloom.addon.render import shader_program
    from hairloom.addon.render.mesh_pass import MeshPass
    from hairloom.addon.render.strand_pass import StrandPass

    passes = MeshPass(), StrandPass()
    marschner = snapshot_of(PLAIN)
    kajiya_kay = snapshot_of(replace(PLAIN, model="kajiya_kay"))
    debug = snapshot_of(PLAIN, debug_view="detail")
    pictures = [drawn(frame, shown, passes) for shown in (marschner, kajiya_kay, debug)]
    for one, other in ((0, 1), (0, 2), (1, 2)):
        assert (pictures[one] != pictures[other]).any()
    shader_program.release()
    for shown, before in zip((marschner, kajiya_kay, debug), pictures, strict=True):
        assert (drawn(frame, shown, passes) == before).all()
