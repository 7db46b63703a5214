"""The scene's gravity and its force fields."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import bpy
import numpy as np
from mathutils import noise

from ...arrays import Floats, Ints
from ...dynamics.force_fields import (
    ENDLESS,
    GRADIENTS,
    NO_FIELDS,
    Falloff,
    ForceField,
    ForceFields,
)
from ...strands.vectors import triple

#: Blender's kinds that act on hair -> ours; and why the others do not.
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
    "GUIDE": "it leads particles along a curve, and is no force",
    "LENNARDJ": "it acts between particles that have a size",
    "TEXTURE": "a texture cannot be asked at every point of the hair",
    "FLUID_FLOW": "a fluid cannot be asked at every point of the hair",
}
_SHAPES = {"POINT": "point", "LINE": "line", "PLANE": "plane", "POINTS": "points"}
#: Points of a mesh that act each by itself, at most.
MAX_POINTS = 64
#: Beyond it numbers could overflow; hair cannot follow a thousandth of it.
_STRONGEST = 1.0e6


def gravity_of(scene: bpy.types.Scene) -> Floats:
    """(3,) [m/s^2], world space."""
    return np.array(scene.gravity) if scene.use_gravity else np.zeros(3)


def force_fields_of(
    owner: bpy.types.Object, depsgraph: bpy.types.Depsgraph
) -> tuple[ForceFields, tuple[str, ...]]:
    """The force fields that act on an object in this frame, and what to say of others.

    As in Blender, those that are hidden or excluded from the view layer have no effect, nor have
    those that do not affect location. Particles with a field act as if they had none.

    Args:
        owner: hair curves or cloth. Where it names a collection, only the fields in there act.
    """
    found: list[ForceField] = []
    notes: list[str] = []
    chosen = owner.hairloom.field_collection
    names = None if chosen is None else {obj.name_full for obj in chosen.all_objects}
    for obj in depsgraph.objects:
        field = obj.field
        if field is None or field.type == "NONE" or obj.name_full == owner.name_full:
            continue
        if names is not None and obj.name_full not in names:
            continue
        reason = _unusable(obj, field)
        if reason:
            notes.append(f"{obj.name}: its force field does not act on hair: {reason}")
        elif field.apply_to_location:
            found += _read(obj, field, depsgraph.scene.frame_current)
            if abs(field.strength) > _STRONGEST:
                notes.append(
                    f"{obj.name}: its strength is more than hair can follow. Lower Strength."
                )
    if not found:
        return NO_FIELDS, tuple(notes)
    is_turbulent = any(one.kind == "turbulence" for one in found)
    return ForceFields(tuple(found), permutation() if is_turbulent else None), tuple(notes)


def _unusable(obj: bpy.types.Object, field: bpy.types.FieldSettings) -> str:
    """Why a field does not act on hair; empty where it does."""
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
    """A field of an object; one for each point where every point acts."""
    matrix = np.array(obj.matrix_world, np.float64)
    one = ForceField(
        kind=_KINDS[field.type],
        center=triple(matrix[:3, 3]),
        axis=triple(_unit(matrix[:3, 2])),
        strength=_limited(field.strength + _noise_of(field, frame)),
        shape=_SHAPES[field.shape],
        damping=_limited(field.harmonic_damping),
        size=min(field.size, ENDLESS),
        flow=0.0 if field.type in ("HARMONIC", "DRAG") else _limited(field.flow),
        across=field.wind_factor,
        falloff=field.falloff_type.lower(),
        side={"BOTH": 0, "POSITIVE": 1, "NEGATIVE": -1}[field.z_direction],
        distance=Falloff(
            field.falloff_power,
            field.distance_min if field.use_min_distance else 0.0,
            min(field.distance_max, ENDLESS) if field.use_max_distance else ENDLESS,
        ),
        radial=Falloff(
            field.radial_falloff,
            field.radial_min if field.use_radial_min else 0.0,
            field.radial_max if field.use_radial_max else ENDLESS,
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
    """What noise adds to the strength in a frame, the same for all hair: spread as Blender's is."""
    if not field.noise:
        return 0.0
    random = np.random.default_rng([field.seed, abs(frame)])
    steps, weakened = random.integers(128), 1.0 + random.random()
    sign = 1.0 if steps > 64 else -1.0
    return float(sign * steps / weakened * field.noise / 128.0)


def _limited(value: float) -> float:
    return float(min(max(value, -_STRONGEST), _STRONGEST))


def _unit(vector: Floats) -> Floats:
    length = float(np.linalg.norm(vector))
    return vector / length if length else vector


@lru_cache(maxsize=1)
def permutation() -> Ints:
    """The permutation of Blender's improved Perlin noise, found by asking it, (256,).

    Beside a corner (x, y, z) of its lattice the noise rises along a gradient that
    p[p[p[x] + y] + z] chooses. So along z one sees the gradients of p from p[p[x] + y] on: how far
    the row of y is ahead of that of 0 is p[p[0] + y], less the first of them. This is all of p, but
    for where it begins, which only one place explains.
    """
    seen = [_gradient(0, 0, z) for z in range(256)]
    window, edges = 24, [tuple(edge) for edge in GRADIENTS.astype(int).tolist()]
    starts = {tuple((seen * 2)[at : at + window]): at for at in range(256)}
    ahead = np.array([starts[tuple(_gradient(0, y, z) for z in range(window))] for y in range(256)])
    for begin in range(256):  # p[0]
        first = (begin - ahead[-begin % 256]) % 256  # p[p[0]]
        found = (np.roll(ahead, begin) + first) % 256
        if [edges[found[(first + z) % 256] & 15] for z in range(256)] == seen:
            return found
    raise AssertionError("Blender's noise is not Perlin's")


def _gradient(x: int, y: int, z: int) -> tuple[int, int, int]:
    near = 1.0 / 64.0
    steps = ((near, 0.0, 0.0), (0.0, near, 0.0), (0.0, 0.0, near))
    slopes = [
        noise.noise((x + a, y + b, z + c), noise_basis="PERLIN_NEW") / near for a, b, c in steps
    ]
    one, two, three = (round(slope) for slope in slopes)
    return one, two, three
