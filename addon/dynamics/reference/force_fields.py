"""Scalar reference of `force_fields`, one CV at a time in float64.

It shares with the fast form only the fields and their limit.
"""

from __future__ import annotations

import math
from itertools import product

import numpy as np

from ...arrays import Floats, Ints
from ..force_fields import MAX_DISPLACEMENT, Falloff, ForceField, ForceFields


def previous_after_fields(
    x: Floats,
    previous: Floats,
    fields: ForceFields,
    dt: float,
    size: float,
    *,
    is_strand: bool = True,
) -> Floats:
    """The previous positions (n, 3) that represent the velocity after a substep of the fields, of
    the CVs of a guide or other points (n, 3)."""
    result = previous.copy()
    for cv, place in enumerate(x):
        velocity = (place - previous[cv]) / dt
        along: Floats = np.zeros(3)
        if is_strand:
            along = _unit(x[min(cv + 1, len(x) - 1)] - x[max(cv - 1, 0)])
        change = _change(place, velocity, along, fields, dt) * dt
        far = float(np.linalg.norm(change))
        result[cv] = previous[cv] - change * min(1.0, MAX_DISPLACEMENT * size / max(far, 1e-12))
    return result


def acceleration(place: Floats, velocity: Floats, fields: ForceFields) -> Floats:
    """The acceleration of a point of mass 1, (3,) [m/s^2]."""
    total = np.zeros(3)
    for field in fields.fields:
        push, slowing, spin = _effect_of_field(field, place, velocity, fields)
        total = total + push - velocity * slowing + np.cross(velocity, spin)
    return total


def _change(
    place: Floats, velocity: Floats, along: Floats, fields: ForceFields, dt: float
) -> Floats:
    """The change of the velocity in a substep, (3,) [m/s]."""
    beside = np.eye(3) - np.outer(along, along)
    push, spin = np.zeros(3), np.zeros(3)
    slows, slows_along = 0.0, 0.0
    for field in fields.fields:
        one, slowing, turns = _effect_of_field(field, place, velocity, fields)
        push = push + one * (1.0 - field.across_fraction) + beside @ one * field.across_fraction
        slows += slowing
        slows_along += slowing * (1.0 - field.across_fraction)
        spin = spin + turns
    new_velocity = velocity + push * dt
    straight = along * float(along @ new_velocity)
    across = (new_velocity - straight) * _slowing_factor(slows * dt)
    new_velocity = across + straight * _slowing_factor(slows_along * dt)
    # v' - dt v' x spin = v, as a linear system
    x, y, z = spin * dt
    system = np.eye(3) + np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.linalg.solve(system, new_velocity) - velocity


def _slowing_factor(slowing: float) -> float:
    return 1.0 / (1.0 + slowing) if slowing > 0.0 else 1.0 - slowing


def _effect_of_field(
    field: ForceField, place: Floats, velocity: Floats, fields: ForceFields
) -> tuple[Floats, float, Floats]:
    """Push, slowing and spin of one field, see `force_fields.FieldEffect`."""
    center, axis = np.array(field.center), np.array(field.axis)
    normal = axis if field.normal is None else np.array(field.normal)
    r = place - center
    height = float(r @ normal)
    away = place - (center if field.place is None else np.array(field.place))
    if field.shape == "line" or (field.shape == "plane" and field.kind == "vortex"):
        away = r - height * normal
    elif field.shape == "plane":
        away = height * normal
    d = float(np.linalg.norm(away))
    part = fields.factor * _falloff(field, d, r, height, normal)
    nothing = np.zeros(3)
    if not part > 0.0:
        return nothing, 0.0, nothing
    strength, flow = field.strength * part, field.flow * part
    match field.kind:
        case "wind":
            return normal * strength, flow, nothing
        case "force":
            square = d * d if field.is_inverse_square else 1.0
            return (_unit(away) * strength / square if square else nothing), flow, nothing
        case "vortex" if field.shape == "point":
            return _unit(np.cross(normal, away)) * strength * d, flow, nothing
        case "vortex":
            around = np.cross(axis, r) * strength
            return np.cross(axis, around) * strength + around, 1.0 + flow, nothing
        case "magnet":
            is_around = field.shape in ("point", "line")
            lines = np.cross(normal, away) if is_around else normal
            return nothing, flow, _unit(lines) * strength
        case "harmonic":
            stretched = away * (1.0 - field.size / d) if field.size and d else away
            return (
                -stretched * strength,
                2.0 * field.damping * math.sqrt(abs(field.strength)),
                nothing,
            )
        case "turbulence":
            assert fields.permutation is not None, "it comes with turbulence"
            seen = (place if field.is_global else r + axis) / (field.size or 1.0)
            noise = [_octaves(fields.permutation, np.roll(seen, -k)) for k in range(3)]
            return np.array(noise) * strength, flow, nothing
        case _:
            speed = float(np.linalg.norm(velocity))
            quadratic, linear = min(field.strength, 2.0), min(field.damping, 2.0)
            return nothing, part * (quadratic * speed + linear), nothing


def _falloff(field: ForceField, d: float, r: Floats, height: float, normal: Floats) -> float:
    if height * field.side < 0.0:
        return 0.0
    if field.falloff == "sphere":
        return _power_falloff(field.distance, d)
    wide = float(np.linalg.norm(r - height * normal))
    if field.falloff == "cone":
        wide = math.degrees(math.atan2(wide, height))
    return _power_falloff(field.distance, abs(height)) * _power_falloff(field.radial, wide)


def _power_falloff(falloff: Falloff, d: float) -> float:
    if d > falloff.far:
        return 0.0
    return 1.0 if d < falloff.near else (1.0 + d - falloff.near) ** -falloff.power


def _unit(vector: Floats) -> Floats:
    length = float(np.linalg.norm(vector))
    result: Floats = vector / length if length > 1e-12 else np.zeros(3)
    return result


def _octaves(permutation: Ints, point: Floats) -> float:
    return sum(_perlin(permutation, point * 2**k) / 2**k for k in range(3)) * 4.0 / 7.0


def _perlin(permutation: Ints, point: Floats) -> float:
    """The noise as a weighted sum over the eight corners of the cell."""
    cell = np.floor(point)
    inside = point - cell
    fade = inside**3 * (inside * (inside * 6.0 - 15.0) + 10.0)
    total = 0.0
    for corner in product((0, 1), repeat=3):
        hashed = 0
        for axis in range(3):
            hashed = int(permutation[(hashed + int(cell[axis]) + corner[axis]) % 256])
        weight = np.prod(np.where(corner, fade, 1.0 - fade))
        total += weight * float(_gradient(hashed & 15) @ (inside - np.array(corner)))
    return float(total)


def _gradient(low_bits: int) -> Floats:
    """The vector from the middle of a cube to the middle of one of its edges."""
    edges = [(x, y, 0) for y in (1, -1) for x in (1, -1)]
    edges += [(x, 0, z) for z in (1, -1) for x in (1, -1)]
    edges += [(0, y, z) for z in (1, -1) for y in (1, -1)]
    edges += [(1, 1, 0), (0, -1, 1), (-1, 1, 0), (0, -1, -1)]
    return np.array(edges[low_bits], np.float64)
