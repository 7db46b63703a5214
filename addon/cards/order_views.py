"""Fragments of cards by depth in each pixel of a view, and their alpha by the texture.

Cards are triangles, sampled at pixel centres.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..arrays import Bools, Floats, Ints, number_in_piece
from ..strands import Surface
from .card_mesh import CardMesh

#: Range of elevations of views around a head [degrees]; few look at hair from below.
MIN_ELEVATION, MAX_ELEVATION = -20.0, 65.0
#: Points beyond this fraction of the way from the middle to the eye count as behind it.
_MAX_NEARNESS = 0.99
#: Alpha from which on a pixel is opaque, and below which it is transparent, as in the passes.
OPAQUE_ALPHA, MIN_ALPHA = 0.99, 0.004
_GOLDEN = (np.sqrt(5.0) - 1.0) / 2.0


@dataclass(frozen=True)
class SphereView:
    """A square picture that contains a sphere.

    middle: (3,) and radius: of the sphere [m].
    direction: (3,) unit vector from its middle towards the eye.
    size: pixels across.
    distance: of the eye from the middle [m], more than the radius; infinite: a parallel view.
    """

    middle: Floats
    radius: float
    direction: Floats
    size: int
    distance: float = np.inf

    def project(self, points: Floats) -> Floats:
        """(4, n) float32 of points (n, 3) [m]: x and y in pixels, nearness, scale.

        Nearness grows towards the eye and is linear in the picture. So is the scale, the size of a
        point relative to one in the middle of the sphere; 0 behind the eye.
        """
        right = np.cross([0.0, 1.0e-3, 1.0], self.direction)
        right /= np.linalg.norm(right)
        axes = np.stack([right, np.cross(self.direction, right), self.direction], axis=1)
        x, y, near = ((points - self.middle) @ axes / self.radius).T
        reach = self.distance / self.radius
        half = self.size / 2.0
        if np.isinf(reach):
            rows = [x * half + half, y * half + half, near, np.ones_like(near)]
        else:
            is_ahead = near < _MAX_NEARNESS * reach
            scale = np.where(is_ahead, reach / (reach - near * is_ahead), 0.0)
            stretch = scale * half * np.sqrt(1.0 - reach**-2)
            rows = [x * stretch + half, y * stretch + half, scale, scale]
        return np.stack(rows).astype(np.float32)


@dataclass(frozen=True)
class Fragments:
    """Samples of triangles, one array each, (fragment_count,).

    pixel: row * size + column. nearness: see SphereView.project. is_front: counter-clockwise.
    second, third: barycentric coordinates on the triangle.
    """

    pixel: Ints
    triangle: Ints
    nearness: Floats
    is_front: Bools
    second: Floats
    third: Floats

    def __getitem__(self, chosen: Ints | Bools) -> Fragments:
        names = ("pixel", "triangle", "nearness", "is_front", "second", "third")
        return Fragments(*(getattr(self, name)[chosen] for name in names))


def view_directions(count: int, turn: float = 0.0) -> Floats:
    """Unit vectors all around, evenly spread over the range of elevations, (count, 3)."""
    number = np.arange(count) + 0.5
    low, high = np.sin(np.radians([MIN_ELEVATION, MAX_ELEVATION]))
    up = low + (high - low) * ((number * _GOLDEN + turn) % 1.0)
    around, out = 2.0 * np.pi * (number / max(count, 1) + turn), np.sqrt(1.0 - up * up)
    return np.stack([out * np.cos(around), out * np.sin(around), up], axis=1)


def bounding_sphere(mesh: CardMesh) -> tuple[Floats, float]:
    """Middle (3,) and radius [m] of a sphere that contains the cards."""
    low, high = (corner.astype(np.float64) for corner in mesh.bounds())
    return (low + high) / 2.0, max(float(np.linalg.norm(high - low)) / 2.0, 1e-9)


def rasterized(view: SphereView, positions: Floats, triangles: Ints) -> Fragments:
    """Samples of all triangles (triangle_count, 3) of positions (n, 3) [m] in this view, in the
    order of the triangles."""
    corners = view.project(positions)[:, triangles.T]
    column, row, triangle = _candidates(corners, view.size)
    x, y, near, scale = corners
    xs, ys = (each[1:] - each[0] for each in (x, y))
    area = xs[0] * ys[1] - ys[0] * xs[1]
    inverse = np.divide(1.0, area, out=np.zeros_like(area), where=area != 0.0)
    right = column + np.float32(0.5) - x[0, triangle]
    up = row + np.float32(0.5) - y[0, triangle]
    second = (right * ys[1, triangle] - up * xs[1, triangle]) * inverse[triangle]
    third = (up * xs[0, triangle] - right * ys[0, triangle]) * inverse[triangle]
    is_in = (second >= 0.0) & (third >= 0.0) & (second + third <= 1.0) & (area[triangle] != 0.0)
    inside = np.flatnonzero(is_in)
    triangle, second, third = triangle[inside], second[inside], third[inside]
    first = 1.0 - second - third
    near, scale = (
        first * each[0, triangle] + second * each[1, triangle] + third * each[2, triangle]
        for each in (near, scale)
    )
    return Fragments(
        row[inside] * view.size + column[inside],
        triangle,
        near,
        area[triangle] > 0.0,
        second * corners[3, 1, triangle] / scale,
        third * corners[3, 2, triangle] / scale,
    )


def _candidates(corners: Floats, size: int) -> tuple[Ints, Ints, Ints]:
    """Columns and rows of the pixels in the triangles' boxes, and the triangle of each, (n,)."""
    low = np.clip(np.ceil(corners[:2].min(axis=1) - 0.5), 0, size).astype(np.int32)
    high = np.clip(np.floor(corners[:2].max(axis=1) - 0.5), -1, size - 1).astype(np.int32)
    width, height = np.maximum(high - low + 1, 0)
    count = width * height * (corners[3] > 0.0).all(axis=0)
    triangle = np.repeat(np.arange(len(count)), count)
    inside = number_in_piece(count)
    row, column = np.divmod(inside, width[triangle])
    return low[0, triangle] + column, low[1, triangle] + row, triangle


def surface_nearness(view: SphereView, surface: Surface | None) -> Floats:
    """Nearness of the surface in each pixel, (size * size,); -inf where there is none."""
    near = np.full(view.size * view.size, -np.inf, np.float32)
    if surface is not None:
        fragments = rasterized(view, surface.positions, surface.triangles)
        np.maximum.at(near, fragments.pixel, fragments.nearness)
    return near


def sorted_far_to_near(fragments: Fragments) -> Fragments:
    """Fragments sorted by pixel, and in a pixel the farthest first; equally near ones keep their
    order."""
    return fragments[np.lexsort((fragments.nearness, fragments.pixel))]


def fragment_alpha(mesh: CardMesh, fragments: Fragments, alpha: Floats) -> Floats:
    """Alpha of the nearest texel of each fragment, (fragment_count,); alpha: (height, width)."""
    first = 1.0 - fragments.second - fragments.third
    fractions = np.stack([first, fragments.second, fragments.third], axis=1)
    uv = np.einsum("nc,nci->ni", fractions, mesh.uv[mesh.triangles[fragments.triangle]])
    height, width = alpha.shape
    row = np.clip((uv[:, 1] * height).astype(int), 0, height - 1)
    column = np.clip((uv[:, 0] * width).astype(int), 0, width - 1)
    return alpha[row, column]


def downsampled_alpha(alpha: Floats, mesh: CardMesh, pixel: float) -> Floats:
    """The alpha with texels about as large on the cards as a pixel of this many metres.

    It is halved like mip maps, to the last level whose texels are not larger than the pixel,
    because samples would hit or miss thin strands of one texel at random.
    """
    texels = texels_per_metre(alpha, mesh) * pixel
    while texels >= 2.0 and min(alpha.shape) > 1:
        height, width = (2 * (side // 2) for side in alpha.shape)
        alpha = alpha[:height, :width].reshape(height // 2, 2, width // 2, 2).mean(axis=(1, 3))
        texels /= 2.0
    return alpha


def texels_per_metre(alpha: Floats, mesh: CardMesh) -> float:
    """Texels of the texture per metre, on average over all cards."""
    on_cards = _twice_area(mesh.positions[mesh.triangles])
    on_texture = _twice_area(mesh.uv[mesh.triangles]) * alpha.size
    return float(np.sqrt(on_texture / max(on_cards, 1e-30)))


def _twice_area(corners: Floats) -> float:
    """Doubled area of all triangles, (triangle_count, 3, 2 or 3)."""
    one, other = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    dot = np.einsum("ti,ti->t", one, other)
    squares = np.einsum("ti,ti->t", one, one) * np.einsum("ti,ti->t", other, other)
    return float(np.sqrt(np.maximum(squares - dot * dot, 0.0)).sum())
