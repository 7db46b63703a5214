"""The fraction of a light that meshes let through to a place of a mesh, by the map of their depths.

It is the fraction of a disk around the place that sees the light (percentage closer filtering;
Reeves, Salesin and Cook 1987). The taps lie on Vogel's spiral, so that an edge in any direction
meets them one after the other, and each is the mean of four texels: edges have no steps. The disk
is a fraction of the map, equally wide at any resolution. Each texel is compared with the depth,
there, of the plane of the place's own triangle: slopes do not shade themselves, and edges stay
where they are. Each sample of a picture shifts the texels by up to one.

Reference of gpu_shaders/lib_mesh_shadows.glsl.
"""

from __future__ import annotations

import numpy as np

from ...arrays import Floats
from ...strands.vectors import GOLDEN_ANGLE
from .light_frame import LightFrame

#: taps of the disk, and its radius as a fraction of the map's side; at least a texel
MESH_TAPS, MESH_BLUR = 16, 0.003
#: how far in front of a place a mesh must be, as a fraction of the disk's radius and a texel
MESH_BIAS = 0.5
#: the steepest slope that is followed, as a tangent
MAX_SLOPE = 20.0
#: minimum cosine of a slope that is seen from its edge
MIN_COSINE = 1.0e-3


def mesh_light(
    frame: LightFrame,
    depths: Floats,
    points: Floats,
    normals: Floats,
    shift: tuple[float, float] = (0.0, 0.0),
) -> Floats:
    """The fraction of the light that reaches points, (n,); 1 outside of the map.

    Args:
        depths: (size, size) of the first mesh, row 0 at the bottom; 1 where there is none.
        points: (n, 3) [m]. normals: (n, 3) unit, of their triangles; their sign counts for nothing.
        shift: of the texels that are read, in texels.
    """
    size = len(depths)
    places, depth = frame.places(points)
    slope, unit = _slope(frame, points, normals, size)
    own, radius = places * size - 0.5, disk_radius(size)
    bias, lit = MESH_BIAS * (radius + 1.0) * unit, np.zeros(len(points))
    for tap in disk_taps():
        scaled = own + shift + radius * tap
        low = np.floor(scaled)
        fraction = scaled - low
        for corner in range(4):
            step = np.array([corner & 1, corner >> 1])
            texel = low + step
            weights = np.where(step == 1, fraction, 1.0 - fraction).prod(axis=1)
            column, row = np.clip(texel, 0, size - 1).astype(int).T
            there = np.minimum(depth + (slope * (texel - own)).sum(axis=1), 1.0) - bias
            lit += weights * (there <= depths[row, column])
    is_inside = ((places >= 0.0) & (places <= 1.0)).all(axis=1)
    return np.where(is_inside, lit / MESH_TAPS, 1.0)


def disk_radius(size: int) -> float:
    """Radius of the disk, in texels of a map of this side."""
    return max(MESH_BLUR * size, 1.0)


def disk_taps() -> Floats:
    """Places in the unit disk, (MESH_TAPS, 2), each of which represents an equal part of it."""
    number = np.arange(MESH_TAPS)
    away, angle = np.sqrt((number + 0.5) / MESH_TAPS), GOLDEN_ANGLE * number
    return np.stack([away * np.cos(angle), away * np.sin(angle)], axis=1)


def _slope(frame: LightFrame, points: Floats, normals: Floats, size: int) -> tuple[Floats, Floats]:
    """How depth changes from texel to texel on the planes through points, (n, 2), and the depth of
    one texel's width, (n,).
    """
    homogeneous = np.concatenate([points, np.ones_like(points[:, :1])], axis=1)
    x, y, _, w = (homogeneous @ frame.to_map.T).T[..., None]
    w = np.maximum(np.abs(w), 1e-6)
    across = (frame.to_map[0, :3] - x / w * frame.to_map[3, :3]) / w
    upward = (frame.to_map[1, :3] - y / w * frame.to_map[3, :3]) / w
    ray = np.cross(across, upward)
    length = np.linalg.norm(ray, axis=1)
    cosine = (normals * ray).sum(axis=1) / length
    cosine = np.where(cosine < 0.0, -1.0, 1.0) * np.maximum(np.abs(cosine), MIN_COSINE)
    deeper = frame.to_depth[:3]
    slope = np.stack(
        [np.cross(upward, normals) @ deeper, np.cross(normals, across) @ deeper], axis=1
    )
    slope *= 2.0 / size / (length * cosine)[:, None]
    unit = 2.0 / size * np.linalg.norm(deeper) / np.sqrt(length)
    excess = np.linalg.norm(slope, axis=1) / (MAX_SLOPE * unit)
    return slope / np.maximum(excess, 1.0)[:, None], unit
