"""Hair cards on the GPU: current vertices, and triangles in the orders in which they are drawn."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..arrays import Floats, Ints
from ..cards.card_mesh import CardMesh
from ..cards.sort import order_from_eye
from ..shading.environment import openness_from_occlusion
from . import gpu_objects
from .card_snapshot import CardSnapshot

#: vertex attribute -> its length; the last four are of a CardSnapshot, the others of a CardMesh
ATTRIBUTES = {
    **{"position": 3, "normal": 3, "tangent": 3, "uv": 2, "occlusion": 1, "along": 1},
    **{"openness": 4, "received": 4, "beneath": 4, "depth": 1},
}
#: in CardMesh.axes: skin right beneath, as on a plane
_PLANE = np.array([0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0], np.float32)
#: in the same axes: the outward direction of the hair
_AWAY = np.array([0.0, 1.0, 0.0], np.float32)


@dataclass(eq=False)
class _Order:
    """One order of triangles, and the batch that draws it with the current vertices."""

    triangles: Ints
    indices: Any
    batch: Any = None


class CardBatches:
    """The cards of one groom on the GPU. Creating one does not touch the GPU.

    Vertices are uploaded with every new mesh, triangles only when they change.
    """

    def __init__(self) -> None:
        self.release()

    def release(self) -> None:
        """Release everything on the GPU."""
        self._mesh: CardMesh | None = None
        self._vertices: Any = None
        self._orders: dict[str, _Order] = {}
        self._eye: Floats | None = None

    def static(self, cards: CardSnapshot) -> Any:
        """The batch of all triangles in the order of the mesh."""
        self._upload(cards)
        return self._batch("static", cards.mesh.triangles)

    def sorted_batches(self, cards: CardSnapshot, eye: Floats) -> dict[str, Any]:
        """The batches of front faces and of back faces, by "front" and "back".

        Args:
            eye: (4,) homogeneous, see Camera.eye.
        """
        if cards.drawing.order == "view":
            batch = self._sorted(cards, eye)
            return {"front": batch, "back": batch}
        front = self.static(cards)
        if cards.back_triangles is None:
            return {"front": front, "back": front}
        return {"front": front, "back": self._batch("back", cards.back_triangles)}

    def _sorted(self, cards: CardSnapshot, eye: Floats) -> Any:
        """The batch sorted for this eye; nothing is uploaded if the order has not changed."""
        mesh = cards.mesh
        is_same = self._mesh is mesh and self._eye is not None and (self._eye == eye).all()
        self._upload(cards)
        if not is_same or "view" not in self._orders:
            triangles, known = mesh.triangles[order_from_eye(mesh, eye)], self._orders.get("view")
            if known is not None and np.array_equal(known.triangles, triangles):
                triangles = known.triangles
            self._eye = np.array(eye)
            return self._batch("view", triangles)
        return self._batch("view", self._orders["view"].triangles)

    def _upload(self, cards: CardSnapshot) -> None:
        if self._mesh is not cards.mesh:
            self._vertices, self._mesh = _vertices(cards), cards.mesh
            for order in self._orders.values():
                order.batch = None

    def _batch(self, name: str, triangles: Ints) -> Any:
        order = self._orders.get(name)
        if order is None or order.triangles is not triangles:
            indices = gpu_objects.index_buffer(triangles)
            order = self._orders[name] = _Order(triangles, indices)
        if order.batch is None:
            order.batch = gpu_objects.batch("TRIS", self._vertices, order.indices)
        return order.batch


def _vertices(cards: CardSnapshot) -> Any:
    mesh, seen, openness, depth = cards.mesh, cards.skin_seen, cards.openness, cards.depth
    if seen is None:
        seen = np.broadcast_to(_PLANE, (len(mesh.positions), 8))
    if openness is None:
        openness = openness_from_occlusion(mesh.occlusion, _AWAY).astype(np.float32)
    if depth is None:
        depth = np.zeros(len(mesh.positions), np.float32)
    values = {
        "position": mesh.positions,
        "occlusion": mesh.occlusion[:, None],
        "along": mesh.along[:, None],
        "openness": openness,
        "depth": depth[:, None],
        "received": seen[:, :4],
        "beneath": seen[:, 4:],
    }
    own = {name: getattr(mesh, name) for name in ATTRIBUTES if name not in values}
    return gpu_objects.vertex_buffer({name: (values | own)[name] for name in ATTRIBUTES})
