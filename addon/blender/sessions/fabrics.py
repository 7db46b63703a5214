"""Makes the fabric of a fin when it begins to play.

That takes a second for 10,000 vertices, too long for a window to freeze. So Play and playback make
it in the background, and it is cached, as each loop of playback begins with the same mesh.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...arrays import Floats, Ints
from ...dynamics.cloth.state import Fabric, start_cloth
from ..base.redraw import redraw_panels
from ..base.thread_work import ThreadWork
from ..colliders.fields import NotReadyError

#: Meshes with at most this many triangles take a hundredth of a second, and are waited for.
MAX_BLOCKING_TRIANGLES = 500


@dataclass(frozen=True, eq=False)
class ClothMesh:
    """A mesh that is to move as cloth; arrays as in `start_cloth`."""

    positions: Floats
    triangles: Ints
    pin: Floats
    edges: Ints

    def has_same_fabric(self, other: ClothMesh) -> bool:
        """Whether everything except the positions is the same."""
        return (
            len(self.positions) == len(other.positions)
            and np.array_equal(self.triangles, other.triangles)
            and np.array_equal(self.pin, other.pin)
            and np.array_equal(self.edges, other.edges)
        )

    def is_same_as(self, other: ClothMesh) -> bool:
        return self.has_same_fabric(other) and np.array_equal(self.positions, other.positions)

    def fabric(self) -> Fabric:
        """The fabric of this mesh.

        Raises:
            HairloomError: see `start_cloth`.
        """
        return start_cloth(self.positions, self.triangles, self.pin, self.edges).fabric


class FabricJob:
    """The fabric of the mesh that was requested last."""

    def __init__(self) -> None:
        self._mesh: ClothMesh | None = None
        self._fabric: Fabric | None = None
        self._work: ThreadWork[Fabric] | None = None

    @property
    def is_pending(self) -> bool:
        """Whether it is being made."""
        return self._work is not None and not self._work.is_done

    def fabric_of(self, mesh: ClothMesh, *, blocking: bool) -> Fabric:
        """The fabric of this mesh. If work has begun for the same mesh in another pose, its result
        is used, so that a moving mesh is waited for only once.

        Args:
            blocking: False: have it made in a thread, unless it is quick.

        Raises:
            HairloomError: see `start_cloth`.
            NotReadyError: it is being made, and the call does not block.
        """
        if blocking or len(mesh.triangles) <= MAX_BLOCKING_TRIANGLES:
            self.cancel()
            if self._fabric is None or self._mesh is None or not self._mesh.is_same_as(mesh):
                self._mesh, self._fabric = mesh, mesh.fabric()
            return self._fabric
        work, self._work = self._work, None
        if work is not None and self._mesh is not None and self._mesh.has_same_fabric(mesh):
            if not work.is_done:
                self._work = work
                raise NotReadyError
            redraw_panels()
            self._fabric = work.result()
            return self._fabric
        if self._fabric is None or self._mesh is None or not self._mesh.is_same_as(mesh):
            self._mesh, self._fabric = mesh, None
            self._work = ThreadWork(lambda _: mesh.fabric(), "fabric")
            redraw_panels()
            raise NotReadyError
        return self._fabric

    def cancel(self) -> None:
        """Cancel the fabric that is being made."""
        if self._work is not None:
            self._work.cancel()
            self._mesh = self._work = None
