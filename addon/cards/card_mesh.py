"""`CardMesh`: the triangles of all hair cards in the order in which they are drawn."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from ..arrays import Floats, Ints
from ..errors import HairloomError
from .atlas_grid import AtlasGrid

#: A vector shorter than this has no direction.
_MIN_LENGTH = 1.0e-12

#: Attributes of each vertex, and of each card.
VERTEX_FIELDS = ("positions", "uv", "along", "normal", "tangent", "occlusion")
CARD_FIELDS = ("group", "layer", "tile")


def _empty() -> Ints:
    return np.zeros(0, np.int32)


@dataclass(frozen=True)
class CardMesh:
    """Cards as triangles in world space, checked when made.

    positions: (vertex_count, 3) float32 [m].
    triangles: (triangle_count, 3) int32, counter-clockwise seen from outside the head.
    uv: (vertex_count, 2) float32 in [0, 1]; u runs across the card within its tile of the
        texture, v along it, upwards from the root. Row 0 of a texture is its lowest.
        (glTF counts v from the top of the picture, so there a root has the larger v.)
    along: (vertex_count,) float32 from 0 at the root to 1 at the tip.
    normal: (vertex_count, 3) float32 unit vectors, away from the head.
    tangent: (vertex_count, 3) float32 unit vectors from root to tip.
    occlusion: (vertex_count,) float32, ambient occlusion from 0, occluded, to 1, open.
    card: (triangle_count,) int32, which card a triangle belongs to. Cards keep their numbers when
        others are left out.
    group, layer, tile: (highest card number + 1 or more,) int32 of each card: its group of hair,
        its layer, 0 next to the head, and its tile of the atlas; empty becomes 0 for all.
    atlas: how the texture is divided into tiles.

    Raises:
        HairloomError: shapes that do not match, an index out of range, values that are not finite.
    """

    positions: Floats
    triangles: Ints
    uv: Floats
    normal: Floats
    tangent: Floats
    occlusion: Floats
    card: Ints
    along: Floats
    group: Ints = field(default_factory=_empty)
    layer: Ints = field(default_factory=_empty)
    tile: Ints = field(default_factory=_empty)
    atlas: AtlasGrid = field(default_factory=AtlasGrid)

    def __post_init__(self) -> None:
        vertex_count, triangle_count = len(self.positions), len(self.triangles)
        for name, (dtype, shape) in _layout(vertex_count, triangle_count).items():
            value: Floats | Ints = np.ascontiguousarray(getattr(self, name), dtype)
            if value.shape != shape:
                raise _invalid_mesh(f"{name} has shape {value.shape} instead of {shape}")
            if not np.isfinite(value).all():
                raise _invalid_mesh(f"{name} holds a value that is not finite")
            object.__setattr__(self, name, value)
        if triangle_count and not 0 <= self.triangles.min() <= self.triangles.max() < vertex_count:
            raise _invalid_mesh("a triangle refers to a vertex that does not exist")
        self._check_cards()

    def _check_cards(self) -> None:
        """Check that attributes of cards exist for all of them; empty ones become 0."""
        needed = int(self.card.max()) + 1 if len(self.card) else 0
        for name in CARD_FIELDS:
            value = np.ascontiguousarray(getattr(self, name), np.int32)
            if not len(value):
                value = np.zeros(needed, np.int32)
            if value.ndim != 1 or len(value) < needed:
                raise _invalid_mesh(f"{name} has shape {value.shape} for {needed} cards")
            object.__setattr__(self, name, value)

    @property
    def axes(self) -> tuple[Floats, Floats, Floats]:
        """At each vertex: along the card, its normal, and across both. The first is perpendicular
        to the normal, unlike the tangent. As in card.vert.glsl.
        """
        across = np.cross(self.tangent, self.normal)
        length = np.linalg.norm(across, axis=1, keepdims=True)
        across /= np.maximum(length, _MIN_LENGTH)
        return np.cross(self.normal, across), self.normal, across

    @property
    def card_count(self) -> int:
        return len(np.unique(self.card))

    def bounds(self) -> tuple[Floats, Floats]:
        """Lowest and highest corner, each (3,) [m]; zeros for a mesh without cards."""
        if not len(self.positions):
            return np.zeros(3, np.float32), np.zeros(3, np.float32)
        return self.positions.min(axis=0), self.positions.max(axis=0)

    def without_loose_vertices(self) -> CardMesh:
        """The same mesh without vertices that no triangle uses."""
        used = np.unique(self.triangles)
        vertices: dict[str, Any] = {name: getattr(self, name)[used] for name in VERTEX_FIELDS}
        triangles = np.searchsorted(used, self.triangles)
        return replace(self, triangles=triangles, **vertices)

    def with_occlusion(self, occlusion: Floats) -> CardMesh:
        """The same mesh with ambient occlusion, (vertex_count,)."""
        return replace(self, occlusion=occlusion)


def join_meshes(meshes: Sequence[CardMesh]) -> CardMesh:
    """All triangles in one mesh, one mesh after the other; card numbers stay as they are.

    The attributes of cards, and the atlas, are those of the first mesh, and must hold for all
    numbers.
    """
    starts = np.cumsum([0, *(len(mesh.positions) for mesh in meshes[:-1])])
    triangles = [mesh.triangles + start for mesh, start in zip(meshes, starts, strict=True)]
    both: dict[str, Any] = {
        name: np.concatenate([getattr(mesh, name) for mesh in meshes]) for name in VERTEX_FIELDS
    }
    card = np.concatenate([mesh.card for mesh in meshes])
    return replace(meshes[0], triangles=np.concatenate(triangles), card=card, **both)


def _layout(vertex_count: int, triangle_count: int) -> dict[str, tuple[type, tuple[int, ...]]]:
    return {
        "positions": (np.float32, (vertex_count, 3)),
        "triangles": (np.int32, (triangle_count, 3)),
        "uv": (np.float32, (vertex_count, 2)),
        "along": (np.float32, (vertex_count,)),
        "normal": (np.float32, (vertex_count, 3)),
        "tangent": (np.float32, (vertex_count, 3)),
        "occlusion": (np.float32, (vertex_count,)),
        "card": (np.int32, (triangle_count,)),
    }


def _invalid_mesh(problem: str) -> HairloomError:
    return HairloomError(
        problem, place="card mesh", remedy="Build the cards again from clean strands"
    )
