"""Reading the collider of an object, from its shape and from the artist's choice."""

from __future__ import annotations

from dataclasses import dataclass

import bpy
import numpy as np

from ...arrays import Floats, Ints
from ...dynamics.colliders import SphereCollider
from ...dynamics.settings import DynamicsSettings
from ...errors import HairloomError
from ...strands import Surface
from ...strands.affine import transform_points
from ..base.objects import Body
from ..scene.surfaces import read_surface
from .carriers import Carrier, is_deforming, is_disabled
from .collider_balls import Ball
from .collider_parts import (
    FieldPart,
    Part,
    ShapePart,
    capsule_of,
    face_bounds,
    is_evenly_scaled,
    is_invertible,
)

#: Types of objects that look solid but are not meshes.
_SOLID_TYPES = frozenset(("CURVE", "SURFACE", "META", "FONT", "VOLUME", "POINTCLOUD"))


@dataclass
class ColliderReader:
    """Makes the part of one object.

    previous: its last part, if that has a field. blocking: for a new field; see `fields.field_of`.
    """

    obj: bpy.types.Object
    depsgraph: bpy.types.Depsgraph
    settings: DynamicsSettings
    previous: FieldPart | None
    blocking: bool

    def part_of_head(self, head: Body, at_rest: Surface, roots: Ints | None) -> Part | Ball | None:
        """The part of the head, whose mesh was read when the session started, perhaps in another
        pose."""
        if shape_of(self.obj) != "mesh":
            return self.part()
        carrier = Carrier.of_mesh(head, at_rest, roots)
        return self._field_part(carrier, at_rest, np.eye(4))

    def part(self) -> Part | Ball | None:
        """Raises:
        HairloomError: it cannot collide as it should.
        NotReadyError: its field is being built, and the call is not blocking.
        """
        shape, obj = shape_of(self.obj), self.obj
        if shape == "none":
            return None
        if is_disabled(obj, self.depsgraph):
            raise disabled_error(obj.name)
        body = Body.at_rest(obj, self.depsgraph)
        if not is_invertible(body.rest):
            raise HairloomError("its scale is zero", place=obj.name, remedy="Correct its scale")
        if obj.type == "EMPTY" and shape != "mesh":
            return self._empty_shape(body, shape)
        surface = read_surface(obj, self.depsgraph, need_uv=False, place=obj.name)
        carrier = Carrier.of_mesh(body, surface)
        if shape != "mesh":
            return self._bounding_shape(carrier, surface, shape)
        if self.previous is not None and self.previous.carrier.vertex_count == carrier.vertex_count:
            matrix = self.previous.carrier.motion_from_rest(self.depsgraph)
            if self.previous.was_made_from(surface, matrix, self.settings):
                return self._reused(self.previous.carrier)
        return FieldPart.new(carrier, surface, self.settings, blocking=self.blocking)

    def _field_part(self, carrier: Carrier, surface: Surface, matrix: Floats) -> FieldPart:
        if self.previous is not None and self.previous.was_made_from(
            surface, matrix, self.settings
        ):
            return self._reused(carrier)
        return FieldPart.new(carrier, surface, self.settings, blocking=self.blocking)

    def _reused(self, carrier: Carrier) -> FieldPart:
        assert self.previous is not None
        previous = self.previous
        part = FieldPart(carrier, previous.surface, previous.distance, previous.resolution)
        part.take_deformed_field(previous)
        return part

    def _empty_shape(self, body: Body, shape: str) -> Part | Ball:
        size, middle = self.obj.empty_display_size, np.zeros(3)
        if shape == "sphere":
            return _ball_or_part(Carrier.of_object(body), Ball(body, middle, size))
        corner = np.array([size / 2.0, size / 2.0, size])
        return ShapePart(Carrier.of_object(body), *capsule_of(-corner, corner, body.rest))

    def _bounding_shape(self, carrier: Carrier, surface: Surface, shape: str) -> Part | Ball:
        rest = carrier.body.rest
        inverse = np.linalg.inv(rest)
        low, high = face_bounds(
            Surface(transform_points(surface.positions, inverse), surface.triangles)
        )
        if shape == "capsule":
            return ShapePart(carrier, *capsule_of(low, high, rest))
        ball = Ball(carrier.body, (low + high) / 2.0, float((high - low).max()) / 2.0)
        if is_deforming(self.obj):
            return ShapePart(carrier, SphereCollider(ball.center, ball.radius), rest)
        return _ball_or_part(carrier, ball)


def shape_of(obj: bpy.types.Object) -> str:
    """The shape that an object collides as: "mesh", "sphere", "capsule" or "none"."""
    chosen: str = obj.hairloom.collider_shape
    if chosen != "automatic":
        return chosen
    if obj.type == "MESH" or obj.type in _SOLID_TYPES:
        return "mesh"  # for other types, reading it reports that it is no mesh
    return "sphere" if obj.type == "EMPTY" and obj.empty_display_type == "SPHERE" else "none"


def sized_axis(empty: bpy.types.Object) -> int:
    """The axis along which the border of an Empty is one display size away from its centre."""
    return 2 if shape_of(empty) == "capsule" else 0


def _ball_or_part(carrier: Carrier, ball: Ball) -> Part | Ball:
    """A round ball, which becomes part of a set; or an ellipsoid, by its scale, as its own part."""
    if is_evenly_scaled(carrier.body.rest):
        return ball
    return ShapePart(carrier, SphereCollider(ball.center, ball.radius), carrier.body.rest)


def disabled_error(name: str) -> HairloomError:
    return HairloomError(
        "it is disabled in viewports or excluded from the view layer, so hair does not collide "
        "with it",
        place=name,
        remedy="Enable it, or take it out of the collider collection",
    )
