"""Triangles of a surface, whole or split, with their places in it."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..arrays import Bools, Floats, Ints
from ..strands import Surface
from ..strands.triangles import area_vectors, areas_of, quartered
from ..strands.vectors import unit
from .counter_random import key_of


@dataclass(frozen=True)
class Pieces:
    """Triangles of a surface, whole or split, over which roots are spread.

    parent: (n,) triangles of the surface.
    corner: (n, 3, 3) barycentric coordinates in it, of each corner.
    point: (n, 3, 3) [m], the corners.
    density: (n, 3) at the corners.
    key: (n,) uint64, of its random numbers; the same whatever other pieces there are.
    """

    parent: Ints
    corner: Floats
    point: Floats
    density: Floats
    key: Ints

    @classmethod
    def of(cls, surface: Surface, density: Floats | None) -> Pieces:
        """All triangles, whole.

        Args:
            density: (vertex_count,); None: 1 everywhere.
        """
        count = len(surface.triangles)
        weights = np.ones(len(surface.positions)) if density is None else density
        return cls(
            np.arange(count),
            np.broadcast_to(np.eye(3), (count, 3, 3)),
            surface.corners.astype(np.float64),
            weights[surface.triangles],
            np.arange(count, dtype=np.uint64),
        )

    def __len__(self) -> int:
        return len(self.parent)

    @property
    def mass(self) -> Floats:
        """Area x density, (n,) [m^2]."""
        return self.area * self.density.mean(axis=1)

    @property
    def area(self) -> Floats:
        """(n,) [m^2]."""
        return areas_of(self.point)

    @property
    def normal(self) -> Floats:
        """Unit normals, (n, 3); zero for one without area."""
        return unit(area_vectors(self.point))

    def with_density(self, surface: Surface, density: Floats | None) -> Pieces:
        """The pieces with another density of the surface, (vertex_count,), see `of`."""
        weights = np.ones(len(surface.positions)) if density is None else density
        whole = weights[surface.triangles[self.parent]]
        return replace(self, density=np.einsum("nck,nk->nc", self.corner, whole))

    def take(self, chosen: Bools) -> Pieces:
        """The pieces that a mask (n,) chooses."""
        return Pieces(
            self.parent[chosen],
            self.corner[chosen],
            self.point[chosen],
            self.density[chosen],
            self.key[chosen],
        )

    def concatenated(self, other: Pieces) -> Pieces:
        return Pieces(
            np.concatenate([self.parent, other.parent]),
            np.concatenate([self.corner, other.corner]),
            np.concatenate([self.point, other.point]),
            np.concatenate([self.density, other.density]),
            np.concatenate([self.key, other.key]),
        )

    def split(self) -> Pieces:
        """Each piece split in four."""
        corner, point, density = map(quartered, (self.corner, self.point, self.density))
        key = key_of(self.key[:, None], 1 + np.arange(4)).ravel()
        return Pieces(np.repeat(self.parent, 4), corner, point, density, key)
