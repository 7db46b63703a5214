"""What previewed hair stays out of: a mesh as a distance field, and where it is."""

from __future__ import annotations

from dataclasses import dataclass

import bpy
import numpy as np

from ..arrays import Floats
from ..dynamics.colliders import DistanceField, PosedCollider
from ..dynamics.settings import DynamicsSettings
from ..strands import Surface
from .objects import Body
from .surfaces import read_surface

#: A mesh that came back to within this of its rest is the same mesh [m].
_SAME_SHAPE = 1.0e-5


@dataclass
class Obstacle:
    """A rigid collider that goes with an object.

    surface, field: in world space, with the body at rest; the field takes seconds to make.
    matrix: (4, 4) from the body at rest to where it was in the last frame.
    """

    body: Body
    surface: Surface
    field: DistanceField
    resolution: int
    matrix: Floats

    @classmethod
    def new(cls, body: Body, surface: Surface, settings: DynamicsSettings) -> Obstacle:
        field = DistanceField.from_surface(surface, settings, place=body.handle.name)
        return cls(body, surface, field, settings.collider_resolution, np.eye(4))

    def move(self, depsgraph: bpy.types.Depsgraph) -> PosedCollider:
        """Go to where the body is now; the way there is one frame's motion."""
        before, self.matrix = self.matrix, self.body.moved(depsgraph)
        return PosedCollider(self.field, before, self.matrix)

    def was_made_from(self, surface: Surface, matrix: Floats, settings: DynamicsSettings) -> bool:
        """Whether it was made from this mesh, before `matrix` (4, 4) moved it from its rest."""
        if self.resolution != settings.collider_resolution:
            return False
        moved = self.surface.transformed(matrix)
        return moved.positions.shape == surface.positions.shape and np.allclose(
            moved.positions, surface.positions, rtol=0.0, atol=_SAME_SHAPE
        )


def obstacle_of(
    hair: bpy.types.Object,
    head: Body | None,
    head_at_rest: Surface | None,
    settings: DynamicsSettings,
    depsgraph: bpy.types.Depsgraph,
    known: Obstacle | None,
) -> Obstacle | None:
    """The collider that the artist chose for this hair, else its head, else none.

    Args:
        known: used again if nothing has changed.

    Raises:
        HairloomError: no faces, or no volume.
    """
    chosen = hair.hairloom.collider
    if chosen is not None:
        surface = read_surface(chosen, depsgraph, need_uv=False, place=chosen.name)
        known = known if known is not None and known.body.handle.find() == chosen else None
        if known is None or not known.was_made_from(surface, known.body.moved(depsgraph), settings):
            known = Obstacle.new(Body.at_rest(chosen, depsgraph), surface, settings)
    elif head is None or head_at_rest is None:
        return None
    elif known is None or not known.was_made_from(head_at_rest, np.eye(4), settings):
        known = Obstacle.new(head, head_at_rest, settings)
    known.move(depsgraph)
    return known
