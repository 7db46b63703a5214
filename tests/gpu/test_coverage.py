"""Coverage of opaque strands against brute force in numpy, from the definition of a ribbon.

Every pixel centre is tested against every quad whose bounding box contains it. Nothing comes from
the shader: the curve is from the Catmull-Rom matrix, its direction in the picture from two
projected points, a quad's inside from the signs of its triangles' edges.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from hairloom.addon.refine.settings import DetailSettings
from hairloom.addon.render.camera import frame_camera
from hairloom.addon.render.snapshot import Snapshot
from hairloom.addon.shading.settings import StrandSettings

pytestmark = pytest.mark.usefixtures("gpu_context")

CATMULL_ROM = 0.5 * np.array([[0, 2, 0, 0], [-1, 0, 1, 0], [2, -5, 4, -1], [-1, 3, -3, 1.0]])


def stations(values: np.ndarray, pieces: int, ahead: float = 0.0) -> np.ndarray:
    """Curve points (S, (C - 1) * pieces + 1, k) of CV values (S, C, k), at parameters plus
    `ahead`."""
    first = 2.0 * values[:, :1] - values[:, 1:2]
    last = 2.0 * values[:, -1:] - values[:, -2:-1]
    padded = np.concatenate([first, values, last], axis=1)
    segments = np.stack([padded[:, k : k + values.shape[1] - 1] for k in range(4)], axis=2)
    steps = np.arange(pieces) / pieces + ahead
    powers = np.stack([steps**k for k in range(4)], axis=1)
    inner = np.einsum("uk,kj,scjx->scux", powers, CATMULL_ROM, segments)
    end = np.array([(1.0 + ahead) ** k for k in range(4)]) @ CATMULL_ROM
    tip = np.einsum("j,sjx->sx", end, segments[:, -1])[:, None]
    return np.concatenate([inner.reshape(len(values), -1, values.shape[2]), tip], axis=1)


def covered(snapshot, camera, width: int, height: int, samples: int = 1) -> np.ndarray:
    """Whether each pixel's centre lies in any ribbon, (height, width) bool; no meshes."""
    settings = snapshot.strand_settings
    points = np.asarray(snapshot.points, np.float64).reshape(snapshot.strand_count, -1, 3)
    pieces = snapshot.detail.subdivisions
    pixels, depth = _to_pixels(stations(points, pieces), camera, width, height)
    onward, _ = _to_pixels(stations(points, pieces, 1e-4), camera, width, height)
    along = onward - pixels
    along /= np.linalg.norm(along, axis=-1, keepdims=True)
    across = np.stack([-along[..., 1], along[..., 0]], axis=-1)

    fraction = np.linspace(0.0, 1.0, pixels.shape[1])
    cv_fraction = np.linspace(0.0, 1.0, points.shape[1])
    radii = snapshot.radius.reshape(snapshot.strand_count, -1)
    radius = np.stack([np.interp(fraction, cv_fraction, own) for own in radii])
    taper = 1.0 + fraction * (settings.tip_width - 1.0)
    focal = camera.projection[1, 1] * height / 2.0
    minimum = settings.minimum_width * samples
    half = np.maximum(radius * settings.fullness * focal / depth, minimum / 2.0) * taper
    half = np.maximum(half, min(minimum, 1.0) / 2.0)
    one, other = pixels - across * half[..., None], pixels + across * half[..., None]
    quads = np.stack([one[:, :-1], other[:, :-1], one[:, 1:], other[:, 1:]], axis=2)
    return _fill(quads.reshape(-1, 4, 2), width, height)


def _to_pixels(points, camera, width, height) -> tuple[np.ndarray, np.ndarray]:
    seen = points @ camera.view[:3, :3].T + camera.view[:3, 3]
    depth = -seen[..., 2] if camera.projection[3, 3] == 0.0 else np.ones(seen.shape[:-1])
    scale = np.array([camera.projection[0, 0], camera.projection[1, 1]])
    unit = seen[..., :2] * scale / depth[..., None]
    return (unit + 1.0) / 2.0 * [width, height], depth


def _fill(quads: np.ndarray, width: int, height: int) -> np.ndarray:
    image = np.zeros((height, width), bool)
    low = np.floor(quads.min(axis=1) - 0.5).astype(int)
    reach = np.ceil(quads.max(axis=1) + 0.5).astype(int) - low
    for dy in range(reach[:, 1].max() + 1):
        for dx in range(reach[:, 0].max() + 1):
            near = quads[(reach[:, 0] >= dx) & (reach[:, 1] >= dy)]
            at = low[(reach[:, 0] >= dx) & (reach[:, 1] >= dy)] + [dx, dy]
            inside = _in_triangle(near[:, [0, 1, 2]], at + 0.5)
            inside |= _in_triangle(near[:, [1, 3, 2]], at + 0.5)
            inside &= (at >= 0).all(axis=1) & (at < [width, height]).all(axis=1)
            image[at[inside, 1], at[inside, 0]] = True
    return image


def _in_triangle(triangles: np.ndarray, point: np.ndarray) -> np.ndarray:
    signs = []
    for corner in range(3):
        start, end = triangles[:, corner], triangles[:, (corner + 1) % 3]
        edge, to_point = end - start, point - start
        signs.append(edge[:, 0] * to_point[:, 1] - edge[:, 1] * to_point[:, 0])
    return (np.min(signs, axis=0) >= 0.0) | (np.max(signs, axis=0) <= 0.0)


def curly_groom(strand_count: int) -> np.ndarray:
    """Strands that leave a ball and curl, at all angles to the camera."""
    random = np.random.default_rng(2)
    direction = random.normal(size=(strand_count, 3))
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    steps = np.cumsum(random.normal(size=(strand_count, 12, 3)) * 0.008, axis=1)
    along = np.linspace(0.1, 0.3, 12)[None, :, None]
    return (direction[:, None] * along + steps).astype(np.float32)


@pytest.mark.parametrize(
    ("subdivisions", "minimum_width", "samples"), [(1, 1.0, 1), (3, 0.0, 1), (2, 0.5, 2)]
)
def test_coverage_is_that_of_the_definition(
    frame: Any, subdivisions: int, minimum_width: float, samples: int
) -> None:
    strands = curly_groom(400)
    settings = StrandSettings(
        fullness=2.0, tip_width=0.4, minimum_width=minimum_width, transparency="none"
    )
    detail = DetailSettings(mode="fixed", subdivisions=subdivisions)
    radius = np.full(strands.shape[:2], 1e-3, np.float32)
    snapshot = Snapshot(strands, radius, strand_settings=settings, detail=detail)
    camera = frame_camera(
        (strands.min((0, 1)), strands.max((0, 1))), (-0.5, -1.0, 0.4), np.radians(35.0), 1.2
    )
    drawn = frame.render_image(snapshot, camera, 360, 300, samples)[..., 3]
    size = 360 * samples, 300 * samples
    expected = covered(snapshot, camera, *size, samples).reshape(300, samples, 360, samples)
    expected = expected.mean(axis=(1, 3))
    assert 0.05 < expected.mean() < 0.9
    assert np.abs(drawn - expected).mean() < 0.001
    assert (np.abs(drawn - expected) > 0.01).mean() < 0.002


def test_coverage_of_the_real_groom(frame: Any, shared_data: Path) -> None:
    """Every fifth strand of Sintel's hair, five times as wide."""
    from hairloom.addon.exchange.tressfx import read_tfx

    groom = read_tfx(shared_data / "sintel" / "SintelHairOriginal-sintel_hair.16points.tfx")
    strands = groom.strands.grid[::5]
    radius = np.full(strands.shape[:2], 2e-4, np.float32)
    snapshot = Snapshot(
        strands,
        radius,
        detail=DetailSettings(mode="fixed"),
        strand_settings=StrandSettings(transparency="none"),
    )
    camera = frame_camera(groom.strands.bounds(), (-0.55, -1, 0.18), np.radians(30), 4 / 3)
    drawn = frame.render_image(snapshot, camera, 480, 360, 1)[..., 3]
    expected = covered(snapshot, camera, 480, 360)
    assert expected.mean() > 0.15
    assert np.abs(drawn - expected).mean() < 0.005
