"""The scene's gravity and its force fields."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import bpy
import numpy as np
from mathutils import noise

from ...arrays import Floats, Ints
from ...dynamics.force_fields import (
    GRADIENTS,
    NO_FIELDS,
    NO_LIMIT,
    Falloff,
    ForceField,
    ForceFields,
)
from ...strands.vectors import triple

#: Blender's kinds of fields that act on hair -> ours; and the reasons why the others do not.
_KINDS = {
    "FORCE": "force",
    "WIND": "wind",
    "VORTEX": "vortex",
    "MAGNET": "magnet",
    "HARMONIC": "harmonic",
    "TURBULENCE": "turbulence",
    "DRAG": "drag",
}
_EXCLUDED = {
    "BOID": "only boids feel it",
    "CHARGE": "hair has no charge",
    "GUIDE": "it guides particles along a curve, and is not a force",
    "LENNARDJ": "it acts only between particles with a size",
    "TEXTURE": "a texture cannot be evaluated at each point of the hair",
    "FLUID_FLOW": "a fluid cannot be evaluated at each point of the hair",
}
_SHAPES = {"POINT": "point", "LINE": "line", "PLANE": "plane", "POINTS": "points"}
#: Maximum number of vertices of a mesh with the shape Every Point.
MAX_POINTS = 64
#: Strengths are clamped to this, since numbers could overflow; hair cannot follow a thousandth.
_MAX_STRENGTH = 1.0e6


def gravity_of(scene: bpy.types.Scene) -> Floats:
    """(3,) [m/s^2], world space."""
    return np.array(scene.gravity) if scene.use_gravity else np.zeros(3)


def force_fields_of(
    owner: bpy.types.Object, depsgraph: bpy.types.Depsgraph
) -> tuple[ForceFields, tuple[str, ...]]:
    """The force fields that act on an object in this frame, and notes on others.

    As in Blender, fields that are hidden, excluded from the view layer or do not affect location
    have no effect. Fields of particles are ignored.

    Args:
        owner: hair curves or cloth. If it names a collection, only the fields in there act.
    """
    fields: list[ForceField] = []
    notes: list[str] = []
    chosen = owner.hairloom.field_collection
    names = None if chosen is None else {obj.name_full for obj in chosen.all_objects}
    for obj in depsgraph.objects:
        field = obj.field
        if field is None or field.type == "NONE" or obj.name_full == owner.name_full:
            continue
        if names is not None and obj.name_full not in names:
            continue
        reason = _exclusion_reason(obj, field)
        if reason:
            notes.append(f"{obj.name}: its force field does not act on hair: {reason}")
        elif field.apply_to_location:
            fields += _read(obj, field, depsgraph.scene.frame_current)
            if abs(field.strength) > _MAX_STRENGTH:
                notes.append(f"{obj.name}: it is too strong for hair to follow. Lower Strength.")
    if not fields:
        return NO_FIELDS, tuple(notes)
    is_turbulent = any(one.kind == "turbulence" for one in fields)
    return ForceFields(tuple(fields), permutation() if is_turbulent else None), tuple(notes)


def _exclusion_reason(obj: bpy.types.Object, field: bpy.types.FieldSettings) -> str:
    """Why a field does not act on hair; empty if it does."""
    if field.type in _EXCLUDED:
        return _EXCLUDED[field.type]
    if field.shape == "SURFACE":
        return "Surface is not supported. Set Shape to Plane or Every Point."
    if field.shape == "POINTS":
        count = len(obj.data.vertices) if obj.type == "MESH" else 0
        if not 0 < count <= MAX_POINTS:
            return f"Every Point needs a mesh of 1 to {MAX_POINTS} points"
    numbers = (field.strength, field.harmonic_damping, field.size, field.flow, field.distance_max)
    matrix = np.array(obj.matrix_world, np.float64)
    if not np.isfinite([*numbers, *matrix.ravel()]).all():
        return "it has numbers that are not finite"
    if not np.linalg.norm(matrix[:3, 2]):
        return "its scale is zero"
    return ""


def _read(obj: bpy.types.Object, field: bpy.types.FieldSettings, frame: int) -> list[ForceField]:
    """The field of an object; with the shape Every Point, one for each vertex."""
    matrix = np.array(obj.matrix_world, np.float64)
    one = ForceField(
        kind=_KINDS[field.type],
        center=triple(matrix[:3, 3]),
        axis=triple(_unit(matrix[:3, 2])),
        strength=_clamped(field.strength + _noise_of(field, frame)),
        shape=_SHAPES[field.shape],
        damping=_clamped(field.harmonic_damping),
        size=min(field.size, NO_LIMIT),
        flow=0.0 if field.type in ("HARMONIC", "DRAG") else _clamped(field.flow),
        across_fraction=field.wind_factor,
        falloff=field.falloff_type.lower(),
        side={"BOTH": 0, "POSITIVE": 1, "NEGATIVE": -1}[field.z_direction],
        distance=Falloff(
            field.falloff_power,
            field.distance_min if field.use_min_distance else 0.0,
            min(field.distance_max, NO_LIMIT) if field.use_max_distance else NO_LIMIT,
        ),
        radial=Falloff(
            field.radial_falloff,
            field.radial_min if field.use_radial_min else 0.0,
            field.radial_max if field.use_radial_max else NO_LIMIT,
        ),
        is_inverse_square=field.use_gravity_falloff,
        is_global=field.use_global_coords,
    )
    if field.shape != "POINTS":
        return [one]
    return [_at_point(one, matrix, vertex) for vertex in obj.data.vertices]


def _at_point(one: ForceField, matrix: Floats, vertex: bpy.types.MeshVertex) -> ForceField:
    place = matrix[:3, :3] @ np.array(vertex.co, np.float64) + matrix[:3, 3]
    normal = _unit(matrix[:3, :3] @ np.array(vertex.normal, np.float64))
    return replace(one, place=triple(place), normal=triple(normal))


def _noise_of(field: bpy.types.FieldSettings, frame: int) -> float:
    """What noise adds to the strength in a frame, for all hair alike; distributed as in Blender."""
    if not field.noise:
        return 0.0
    random = np.random.default_rng([field.seed, abs(frame)])
    steps, weakened = random.integers(128), 1.0 + random.random()
    sign = 1.0 if steps > 64 else -1.0
    return float(sign * steps / weakened * field.noise / 128.0)


def _clamped(value: float) -> float:
    return float(min(max(value, -_MAX_STRENGTH), _MAX_STRENGTH))


def _unit(vector: Floats) -> Floats:
    length = float(np.linalg.norm(vector))
    return vector / length if length else vector


@lru_cache(maxsize=1)
def permutation() -> Ints:
    """The permutation p of Blender's improved Perlin noise, found by sampling it, (256,).

    Near a lattice corner (x, y, z) the noise rises along the gradient number p[p[p[x] + y] + z].
    So the gradients along z at x = 0 are a window of p that begins at p[p[0] + y]. How far the
    window of y is ahead of that of y = 0 gives p[p[0] + y] - p[p[0]], from which p follows once
    p[0] is known. All values of p[0] are tried; only one explains the sampled gradients.
    """
    gradients = [_gradient(0, 0, z) for z in range(256)]
    window, edges = 24, [tuple(edge) for edge in GRADIENTS.astype(int).tolist()]
    starts = {tuple((gradients * 2)[start : start + window]): start for start in range(256)}
    offsets = np.array(
        [starts[tuple(_gradient(0, y, z) for z in range(window))] for y in range(256)]
    )
    for begin in range(256):  # p[0]
        first = (begin - offsets[-begin % 256]) % 256  # p[p[0]]
        result = (np.roll(offsets, begin) + first) % 256
        if [edges[result[(first + z) % 256] & 15] for z in range(256)] == gradients:
            return result
    raise AssertionError("Blender's noise is not Perlin's")


def _gradient(x: int, y: int, z: int) -> tuple[int, int, int]:
    near = 1.0 / 64.0
    steps = ((near, 0.0, 0.0), (0.0, near, 0.0), (0.0, 0.0, near))
    slopes = [
        noise.noise((x + a, y + b, z + c), noise_basis="PERLIN_NEW") / near for a, b, c in steps
    ]
    one, two, three = (round(slope) for slope in slopes)
    return one, two, three
