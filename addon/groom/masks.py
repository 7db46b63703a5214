"""Painted masks: factors of settings that vary over the hair.

A parameter that may be painted is declared with `is_painted`; the parameter after it names its
mask. A mask is painted on the surface, in an image on its UVs, or on the artist's own strands. Each
kind has values at `Places`: at the roots of guides and children alike.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from types import SimpleNamespace
from typing import Self

import numpy as np

from ..arrays import Floats, Ints, means_by
from ..params import Settings
from ..strands import StrandSet, Surface
from ..strands.arc_length import arc_lengths
from ..strands.catmull_rom import even_parameters
from ..strands.nearest import nearest_points
from ..strands.resample import arc_length_positions

#: Blender's attribute of the selection of curves, used as a mask of the curves themselves; 1
#: everywhere where there is none.
SELECTION = ".selection"
#: Number of places along a strand at which a mask keeps what was painted on its points.
_ALONG = 17


def mask_parameters(settings: type[Settings]) -> dict[str, str]:
    """Parameter that may be painted -> parameter that names its mask."""
    return {
        each.masked_parameter: each.name for each in settings.parameters() if each.kind == "mask"
    }


def mask_names(settings: Settings) -> dict[str, str]:
    """The name of the mask of each parameter that has one and takes effect."""
    sections = SimpleNamespace(**{settings.section: settings})
    named = {
        of: str(getattr(settings, name)) for of, name in mask_parameters(type(settings)).items()
    }
    acts = {p.name for p in settings.parameters() if not p.shown_when or p.shown_when(sections)}
    found = {of: name for of, name in named.items() if name and of in acts}
    if getattr(settings, "only_selected", False):
        found["only_selected"] = SELECTION
    return found


@dataclass(frozen=True, eq=False)
class Places:
    """Where something grows, and between which of the artist's own strands.

    triangle: (n,), barycentric: (n, 3), of the surface; None: there is none.
    strand, weight: (n, k) which strands it is mixed from, with which weights.
    """

    triangle: Ints | None
    barycentric: Floats | None
    strand: Ints
    weight: Floats

    @classmethod
    def of_strands(cls, strands: StrandSet, chosen: Ints) -> Places:
        """Where these of the artist's own strands grow, indices (n,)."""
        triangle, barycentric = strands.root_triangle, strands.root_barycentric
        return cls(
            None if triangle is None else triangle[chosen],
            None if barycentric is None else barycentric[chosen],
            chosen[:, None],
            np.ones((len(chosen), 1), np.float32),
        )


@dataclass(frozen=True, eq=False)
class Mask:
    """A painted mask; values are finite and not negative."""

    def __eq__(self, other: object) -> bool:
        return type(self) is type(other) and all(
            np.array_equal(one, vars(other)[name]) for name, one in vars(self).items()
        )

    def at(self, places: Places) -> Floats:
        """The values at places, (n,)."""
        raise NotImplementedError

    def along(self, places: Places, cv_count: int) -> Floats:
        """The values at CVs evenly spaced from root to tip, (cv_count, n), or (1, n) where these
        are all the same."""
        return self.at(places)[None]

    def at_vertices(self, surface: Surface, strands: StrandSet) -> Floats:
        """The values at the surface's vertices, (vertex_count,).

        Args:
            strands: the artist's own, bound or not.
        """
        raise NotImplementedError

    def fits(self, strand_count: int, triangle_count: int | None) -> bool:
        """Whether it can have been painted with this many of the artist's own strands, on a surface
        of this many triangles; None: without a surface."""
        raise NotImplementedError

    def for_strands(self, strands: Ints) -> Mask:
        """The mask of some of the artist's strands, (n,), renumbered among these."""
        return self

    @property
    def is_zero(self) -> bool:
        return not any((values > 0.0).any() for values in vars(self).values())


@dataclass(frozen=True, eq=False)
class SurfaceMask(Mask):
    """corners: (triangle_count, 3) float32, at the corners of the surface's triangles."""

    corners: Floats

    @classmethod
    def of_vertices(cls, surface: Surface, weights: Floats) -> Self:
        """Args:
        weights: (vertex_count,).
        """
        return cls(np.asarray(weights, np.float32)[surface.triangles])

    def at(self, places: Places) -> Floats:
        triangle, barycentric = places.triangle, places.barycentric
        assert triangle is not None and barycentric is not None, "what is painted has a surface"
        a, b, c = self.corners[triangle].astype(np.float64).T
        # by differences, so that it is exactly even where it is painted evenly
        found: Floats = a + barycentric[:, 1] * (b - a) + barycentric[:, 2] * (c - a)
        return found

    def fits(self, strand_count: int, triangle_count: int | None) -> bool:
        return len(self.corners) == triangle_count

    def at_vertices(self, surface: Surface, strands: StrandSet) -> Floats:
        return _mean_at_vertices(surface, self.corners)


@dataclass(frozen=True, eq=False)
class ImageMask(Mask):
    """pixels: (height, width) float32, the lowest row first. corner_uv: (triangle_count, 3, 2)."""

    pixels: Floats
    corner_uv: Floats

    def at(self, places: Places) -> Floats:
        triangle, barycentric = places.triangle, places.barycentric
        assert triangle is not None and barycentric is not None, "what is painted has a surface"
        return self._at(np.einsum("nk,nkj->nj", barycentric, self.corner_uv[triangle]))

    def _at(self, uv: Floats) -> Floats:
        return sample_bilinear(self.pixels, uv)

    def fits(self, strand_count: int, triangle_count: int | None) -> bool:
        return len(self.corner_uv) == triangle_count

    def at_vertices(self, surface: Surface, strands: StrandSet) -> Floats:
        return self.on(surface)

    def on(self, surface: Surface) -> Floats:
        """The values at the surface's vertices, (vertex_count,)."""
        corners = self._at(self.corner_uv.reshape(-1, 2)).reshape(-1, 3)
        return _mean_at_vertices(surface, corners)

    @property
    def is_zero(self) -> bool:
        return not (self.pixels > 0.0).any()


@dataclass(frozen=True, eq=False)
class StrandMask(Mask):
    """grid: (strand_count, _ALONG), or (strand_count, 1) if it does not vary along strands."""

    grid: Floats

    @classmethod
    def of_points(cls, strands: StrandSet, values: Floats) -> Self:
        """Args:
        strands: the artist's own. values: (point_count,).
        """
        left, weight = arc_length_positions(strands, _ALONG)
        return cls(values[left] + weight * (values[left + 1] - values[left]))

    def at(self, places: Places) -> Floats:
        return self._mixed(places, self.grid.mean(axis=1, dtype=np.float64)[:, None])[0]

    def along(self, places: Places, cv_count: int) -> Floats:
        grid = self.grid.astype(np.float64)
        if grid.shape[1] > 1:
            left, part = even_parameters(_ALONG, cv_count)
            grid = grid[:, left] + part * (grid[:, left + 1] - grid[:, left])
        return self._mixed(places, grid)

    def _mixed(self, places: Places, grid: Floats) -> Floats:
        """Values of strands (strand_count, k) at places, (k, n)."""
        found = np.zeros((len(places.strand), grid.shape[1]))
        for strand, weight in zip(places.strand.T, places.weight.T, strict=True):
            found += grid[strand] * weight[:, None]
        return found.T

    def at_vertices(self, surface: Surface, strands: StrandSet) -> Floats:
        nearest, _ = nearest_points(surface.positions, strands.roots, 1)
        found: Floats = self.grid.mean(axis=1)[nearest[:, 0]]
        return found

    def fits(self, strand_count: int, triangle_count: int | None) -> bool:
        return len(self.grid) == strand_count

    def for_strands(self, strands: Ints) -> StrandMask:
        return StrandMask(self.grid[strands])

    def at_points(self, strands: StrandSet) -> Floats:
        """The values at the points of the strands, (point_count,)."""
        if self.grid.shape[1] == 1:
            return np.repeat(self.grid[:, 0], strands.point_counts)
        along = arc_lengths(strands.points, strands.offsets)
        whole = np.repeat(along[strands.offsets[1:] - 1], strands.point_counts)
        place = along / np.maximum(whole, 1.0e-30) * (_ALONG - 1)
        left = np.minimum(place.astype(np.int64), _ALONG - 2)
        rows = np.repeat(np.arange(strands.strand_count), strands.point_counts)
        low, high = self.grid[rows, left], self.grid[rows, left + 1]
        found: Floats = low + (place - left) * (high - low)
        return found


def sample_bilinear(
    pixels: Floats, uv: Floats, decode: Callable[[Floats], Floats] = lambda stored: stored
) -> Floats:
    """Values between the middles of the four nearest pixels, (n, ...); the image repeats beyond its
    edges.

    Args:
        pixels: (height, width, ...). uv: (n, 2).
        decode: decodes stored pixels, to (n, ...).
    """
    height, width = pixels.shape[:2]
    place = uv.astype(np.float64) * (width, height) - 0.5
    corner = np.floor(place).astype(np.int64)
    x, y = (place - corner).T.reshape(2, -1, *(1,) * (pixels.ndim - 2))
    (left, low), (right, high) = (corner % (width, height)).T, ((corner + 1) % (width, height)).T
    below = decode(pixels[low, left]) * (1.0 - x) + decode(pixels[low, right]) * x
    above = decode(pixels[high, left]) * (1.0 - x) + decode(pixels[high, right]) * x
    found: Floats = below + y * (above - below)
    return found


def _mean_at_vertices(surface: Surface, corners: Floats) -> Floats:
    """The mean of values at corners around each vertex, (vertex_count,)."""
    return means_by(surface.triangles.ravel(), corners.ravel(), len(surface.positions))


@dataclass(frozen=True, eq=False)
class Masks:
    """masks: by the names of the painted parameters."""

    masks: Mapping[str, Mask] = field(default_factory=dict)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Masks) and self.masks == other.masks

    def __bool__(self) -> bool:
        return bool(self.masks)

    def at(self, places: Places) -> Factors:
        """The factors of what grows at these places."""
        return Factors(len(places.strand), {n: each.at(places) for n, each in self.masks.items()})

    def for_strands(self, strands: Ints) -> Masks:
        """See `Mask.for_strands`."""
        return Masks({name: each.for_strands(strands) for name, each in self.masks.items()})


NO_MASKS = Masks()


@dataclass(frozen=True, eq=False)
class Factors:
    """count: of what grows. painted: of each painted parameter, (count,); all others are 1."""

    count: int
    painted: Mapping[str, Floats]

    def __getitem__(self, name: str) -> Floats:
        found = self.painted.get(name)
        return np.ones(self.count) if found is None else found

    def rows(self, names: tuple[str, ...]) -> tuple[Floats, ...]:
        """The factors of these parameters, (count,) each."""
        return tuple(self[name] for name in names)

    def take(self, chosen: Ints) -> Factors:
        """The factors of some, indices (n,)."""
        return Factors(len(chosen), {name: each[chosen] for name, each in self.painted.items()})

    def concatenated(self, more: Factors) -> Factors:
        both = {n: np.concatenate([each, more[n]]) for n, each in self.painted.items()}
        return Factors(self.count + more.count, both)

    def with_others(self, chosen: Ints, others: Factors) -> Factors:
        """The factors with those of some (n,) replaced."""
        found = {}
        for name in self.painted.keys() | others.painted.keys():
            found[name] = self[name].copy()
            found[name][chosen] = others[name]
        return Factors(self.count, found)
