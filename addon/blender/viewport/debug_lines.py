"""Overlays: thin lines in the 3D view that show colliders, wind, force fields and lights; what
happens to the hair, see `motion_lines`; and the guides, while brushes comb them and Blender's own
thick strands are hidden."""

from __future__ import annotations

from dataclasses import dataclass

import bpy
import gpu
import numpy as np

from ...arrays import Floats
from ...dynamics.colliders import (
    CapsuleCollider,
    Collider,
    DistanceField,
    SphereCollider,
    SphereSetCollider,
)
from ...dynamics.force_fields import ForceFields, field_effect
from ...dynamics.settings import DynamicsSettings
from ...dynamics.wind import Air, air_from_settings
from ...motion_flow import carried_guides, root_turns
from ...render import gpu_objects
from ...rig_flow import root_normals
from ...shading.lights import Light
from ...strands.affine import transform_points
from ...strands.vectors import perpendicular_axes
from ..scene.forces import force_fields_of
from ..sessions.session import Session
from .motion_lines import contact_lines, density_lines, painted_lines, stretch_lines

#: Scene-linear colours with alpha.
COLORS = {
    "colliders": (0.1, 0.75, 0.45, 0.7),
    "wind": (0.2, 0.55, 1.0, 0.9),
    "lights": (1.0, 0.8, 0.25, 0.7),
}
MOTION_LINES = {"stretch": stretch_lines, "contacts": contact_lines, "density": density_lines}
#: Colour of guides under a brush.
GUIDE_COLOR = (0.9, 0.9, 0.9, 0.35)
#: Corners of a circle.
_CORNERS = 32
#: Number of spheres of a set that are drawn; more would clutter the view.
_MAX_SPHERES = 200
#: Wind speed [m/s] whose arrow is as long as the hair is wide; head of an arrow, as a fraction.
_ARROW_SPEED, _ARROW_HEAD = 10.0, 0.2
#: Number of guides, roughly, at whose points force fields are shown.
_FIELD_GUIDES = 40
#: Length of a line to a distant light, in radii of the hair.
_LIGHT_LINE_LENGTH = 1.6


@dataclass(frozen=True, eq=False)
class Lines:
    """Lines of one colour.

    points: (2n, 3) float32 [m] world, two for each line.
    roots, normals: (n, 3) root of each line on a head, and the head's normal there; lines on the
        far side are hidden. None: all are visible.
    """

    color: tuple[float, float, float, float]
    points: Floats
    roots: Floats | None = None
    normals: Floats | None = None

    def seen_from(self, eye: Floats) -> Lines:
        """The lines that their head does not hide.

        Args:
            eye: (4,), homogeneous, as Camera.eye.
        """
        if self.roots is None or self.normals is None:
            return self
        to_eye = eye[:3] - eye[3] * self.roots
        is_seen = np.einsum("ij,ij->i", to_eye, self.normals) > 0.0
        return Lines(self.color, self.points.reshape(-1, 2, 3)[is_seen].reshape(-1, 3))


def debug_lines_of(
    session: Session, hair: bpy.types.Object, depsgraph: bpy.types.Depsgraph
) -> tuple[Lines, ...]:
    """The lines of this groom's enabled overlays."""
    wanted = hair.hairloom.shown_overlays
    combed: tuple[Lines, ...] = ()
    if is_in_sculpt_mode(hair) and hair.hairloom.hide_original and session.is_made:
        combed = (guide_lines(session),)
    if not wanted:
        return combed
    points = session.snapshot.root_center, session.rig.radius
    made = {
        "colliders": lambda: collider_lines(session, depsgraph),
        "wind": lambda: np.concatenate(
            [
                wind_lines(air_from_settings(session.settings[DynamicsSettings]), *points),
                field_lines(session, force_fields_of(hair, depsgraph)[0], points[1]),
            ]
        ),
        "lights": lambda: light_lines(session.snapshot.lights, *points),
    }
    lines = [(COLORS[kind], make()) for kind, make in made.items() if kind in wanted]
    if session.is_made:
        for kind, make_colored in MOTION_LINES.items():
            lines += make_colored(session) if kind in wanted else ()
        if "paint" in wanted:
            lines += painted_lines(session.solver.guides(), session.shown_map(depsgraph))
    return combed + tuple(
        Lines(color, points.astype(np.float32)) for color, points in lines if len(points)
    )


def is_in_sculpt_mode(hair: bpy.types.Object) -> bool:
    """Whether it is in the mode of Blender's brushes for curves."""
    return bool(hair.mode == "SCULPT_CURVES")


def guide_lines(session: Session) -> Lines:
    """The guides in their style, carried by their roots."""
    rig, pose = session.rig, session.solver.pose
    grid = carried_guides(rig, pose)
    turns = root_turns(rig, pose)
    normals = np.einsum("nij,nj->ni", turns, root_normals(rig)[rig.guides])
    points = np.stack([grid[:, :-1], grid[:, 1:]], axis=2).reshape(-1, 3)
    each = grid.shape[1] - 1
    return Lines(
        GUIDE_COLOR, points, np.repeat(grid[:, 0], each, axis=0), np.repeat(normals, each, axis=0)
    )


def collider_lines(session: Session, depsgraph: bpy.types.Depsgraph) -> Floats:
    """Lines of the groom's colliders at this moment, (2n, 3); none until they are made."""
    solids = session.solids(depsgraph)
    lines = [transform_points(shape_lines(solid.collider), solid.matrix_now) for solid in solids]
    return np.concatenate([np.zeros((0, 3)), *lines])


def shape_lines(collider: Collider) -> Floats:
    """Lines of one collider in its own space, (2n, 3)."""
    if isinstance(collider, SphereCollider):
        return _ball(collider.center, collider.radius)
    if isinstance(collider, SphereSetCollider):
        balls = zip(collider.centers[:_MAX_SPHERES], collider.radii[:_MAX_SPHERES], strict=True)
        return np.concatenate([_ball(center, float(radius)) for center, radius in balls])
    if isinstance(collider, CapsuleCollider):
        return _capsule(collider)
    assert isinstance(collider, DistanceField)
    inside = np.argwhere(collider.values < 0.0)
    if not len(inside):  # a mesh that is thinner than a cell
        return np.empty((0, 3), np.float32)
    low, high = (collider.low + collider.cell * end(inside, axis=0) for end in (np.min, np.max))
    return _box(low, high)


def wind_length(radius: float) -> float:
    """Length [m] of the arrow for a wind of 1 m/s, for hair of this radius [m]."""
    return 2.0 * radius / _ARROW_SPEED


def wind_lines(air: Air | None, center: Floats, radius: float) -> Floats:
    """An arrow from the hair's middle in the direction of the wind, (2n, 3); none in still air."""
    if air is None:
        return np.zeros((0, 3))
    speed = float(np.linalg.norm(air.velocity))
    along = air.velocity.astype(np.float64) / speed
    length = wind_length(radius) * speed
    tip = center + length * along
    lines = [center, tip]
    for side in perpendicular_axes(along):
        for sign in (1.0, -1.0):
            lines += [tip, tip + _ARROW_HEAD * length * (0.5 * sign * side - along)]
    return np.array(lines)


def field_lines(session: Session, fields: ForceFields, radius: float) -> Floats:
    """Lines from points of some guides in the direction of the force fields there, (2n, 3)."""
    acting = fields.scaled(session.settings[DynamicsSettings].force_fields)
    if acting is None:
        return np.zeros((0, 3))
    grid = carried_guides(session.rig, session.solver.pose)
    every = max(len(grid) // _FIELD_GUIDES, 1)
    points = grid[::every, :: max(grid.shape[1] // 3, 1)].reshape(-1, 3).astype(np.float32)
    push = field_effect(acting, np.ascontiguousarray(points.T), np.zeros_like(points.T)).push.T
    strength = np.linalg.norm(push, axis=1, keepdims=True)
    scale = 2.0 * radius / np.maximum(strength, _ARROW_SPEED)  # limits the length of strong ones
    return np.stack([points, points + push * scale], axis=1).reshape(-1, 3)


def light_lines(lights: tuple[Light, ...], center: Floats, radius: float) -> Floats:
    """A line from the hair's middle towards each light, with a star at its end, (2n, 3)."""
    lines = [np.zeros((0, 3))]
    for light in lights:
        to_light = np.asarray(light.vector, np.float64) - (0.0 if light.kind == "sun" else center)
        distance = float(np.linalg.norm(to_light))
        if distance <= 0.0:
            continue
        along = to_light / distance
        reach = (
            _LIGHT_LINE_LENGTH
            * radius
            * (1.0 if light.kind == "sun" else min(distance / radius / _LIGHT_LINE_LENGTH, 1))
        )
        end = center + reach * along
        star = 0.1 * radius * np.array([along, *perpendicular_axes(along)])
        ends = np.stack([end - star, end + star], axis=1).reshape(-1, 3)
        lines += [np.array([center, end]), ends]
    return np.concatenate(lines)


def _ball(center: Floats, radius: float) -> Floats:
    axes = np.eye(3)
    return np.concatenate(
        [_circle(center, radius * axes[i], radius * axes[(i + 1) % 3]) for i in range(3)]
    )


def _capsule(capsule: CapsuleCollider) -> Floats:
    """A ring and two half circles at either end, and four lines between."""
    axis = capsule.end - capsule.start
    length = float(np.linalg.norm(axis))
    along = axis / length if length else np.array([0.0, 0.0, 1.0])
    sides = [capsule.radius * side for side in perpendicular_axes(along)]
    lines = []
    for end, out in ((capsule.start, -1.0), (capsule.end, 1.0)):
        lines.append(_circle(end, sides[0], sides[1]))
        for side in sides:
            lines.append(_circle(end, side, out * capsule.radius * along, 0.5))
    for side in (sides[0], -sides[0], sides[1], -sides[1]):
        lines.append(np.array([capsule.start + side, capsule.end + side]))
    return np.concatenate(lines)


def _circle(center: Floats, one: Floats, other: Floats, fraction: float = 1.0) -> Floats:
    """Lines of an arc, (2n, 3), from center + one through center + other."""
    angle = np.linspace(0.0, 2.0 * np.pi * fraction, int(_CORNERS * fraction) + 1)[:, None]
    corners = center + np.cos(angle) * one + np.sin(angle) * other
    return np.stack([corners[:-1], corners[1:]], axis=1).reshape(-1, 3)


def _box(low: Floats, high: Floats) -> Floats:
    corners = np.array([[(low, high)[i >> axis & 1][axis] for axis in range(3)] for i in range(8)])
    edges = [(i, i | 1 << axis) for i in range(8) for axis in range(3) if not i >> axis & 1]
    return corners[np.array(edges)].reshape(-1, 3)


def draw_lines(lines: Lines) -> None:
    """Draw lines into the current view, in front of everything; restores the GPU state."""
    points = lines.points
    shader = gpu.shader.from_builtin("UNIFORM_COLOR")
    depth, blend = gpu.state.depth_test_get(), gpu.state.blend_get()
    gpu.state.depth_test_set("NONE")
    gpu.state.blend_set("ALPHA")
    try:
        shader.bind()
        shader.uniform_float("color", lines.color)
        gpu_objects.batch("LINES", gpu_objects.vertex_buffer({"pos": points})).draw(shader)
    finally:
        gpu.state.depth_test_set(depth)
        gpu.state.blend_set(blend)
