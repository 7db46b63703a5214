"""The scene's force fields and their effect on CVs.

The fields are Blender's, with their effect on a particle of mass 1 (its manual, Physics > Forces):
an acceleration, a rate of slowing down, and a spin around magnetic field lines. Slowing down is
solved implicitly, so that it cannot reverse a motion.

Falloff is (1 + d - near)^-power beyond `near`, and 0 beyond `far`. Powers are computed by products
and square roots, as numpy's own differ in their last bit between processors. Turbulence is Perlin's
noise (2002, "Improving Noise") with Blender's permutation.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from ..arrays import Floats, Ints
from ..strands.vectors import cross_rows, dot_rows

#: Kinds that act on hair, shapes of their sources, and falloffs; indices are used on the GPU.
KINDS = ("force", "wind", "vortex", "magnet", "harmonic", "turbulence", "drag")
SHAPES = ("point", "line", "plane", "points")
FALLOFFS = ("sphere", "tube", "cone")
#: Texels of a field on the GPU, see `ForceFields.table`; width of that table, with four values of
#: the permutation in each texel.
FIELD_TEXELS, TABLE_WIDTH = 7, 64
#: Maximum displacement of a CV by fields in a substep, as a fraction of the hair's length.
MAX_DISPLACEMENT = 0.1
#: Farther than any distance. Its square overflows in float32, but is not needed.
NO_LIMIT = 3.0e38
#: Vectors shorter than this have no direction.
_TINY = np.float32(1.0e-12)
#: Maximum acceleration along each axis [m/s^2], to avoid overflow.
_MAX_ACCELERATION = np.float32(1.0e9)
#: Number of binary digits of the fraction of a power.
_POWER_BITS = 16
#: Octaves of turbulence.
_OCTAVES = 3
_NOWHERE = (0.0, 0.0, 0.0)
#: The gradients of Perlin's noise, indexed by the lowest four bits of a hash.
GRADIENTS = np.array(
    [
        *((x, y, 0) for y in (1, -1) for x in (1, -1)),
        *((x, 0, z) for z in (1, -1) for x in (1, -1)),
        *((0, y, z) for z in (1, -1) for y in (1, -1)),
        *((1, 1, 0), (0, -1, 1), (-1, 1, 0), (0, -1, -1)),
    ],
    np.float32,
)
#: An angle over its sine as a polynomial of its cosine, error below 1e-7, highest power first; twin
#: of lib_angle.glsl.
_ANGLE = (
    0.01765366829931736,
    -0.0979687049984932,
    0.2532384693622589,
    -0.4245661795139313,
    0.5570220351219177,
    -0.6610894799232483,
    0.7848962545394897,
    -0.9999822378158569,
    1.570796251296997,
)


@dataclass(frozen=True)
class Falloff:
    """How strength falls off with distance, see above.

    power: of the distance. near, far: range in which it falls off; it is 0 beyond `far`.
    """

    power: float = 0.0
    near: float = 0.0
    far: float = NO_LIMIT


@dataclass(frozen=True)
class ForceField:
    """One field, world space [m].

    kind, shape, falloff: of KINDS, SHAPES, FALLOFFS.
    center, axis: place and Z axis of its object, a unit vector.
    place, normal: source of the field and its direction if they differ from these, as for one of
        many points that it acts from.
    damping: of harmonic fields; the linear part of drag, whose quadratic part is its strength.
    size: of turbulence; for harmonic fields the rest length.
    flow: rate at which it slows down motion [1/s], scaled by its falloff.
    across_fraction: fraction of the field that acts across strands only.
    side: 1 or -1: the side along `normal` that it acts on; 0: both sides.
    distance: falloff by distance, along the axis for tubes and cones. radial: across the axis, in
        metres for tubes and in degrees for cones.
    is_inverse_square: whether a force falls off with the square of the distance as well.
    is_global: whether turbulence stays in place while its object moves.
    """

    kind: str
    center: tuple[float, float, float] = _NOWHERE
    axis: tuple[float, float, float] = (0.0, 0.0, 1.0)
    strength: float = 1.0
    shape: str = "point"
    place: tuple[float, float, float] | None = None
    normal: tuple[float, float, float] | None = None
    damping: float = 0.0
    size: float = 0.0
    flow: float = 0.0
    across_fraction: float = 0.0
    falloff: str = "sphere"
    side: int = 0
    distance: Falloff = field(default_factory=Falloff)
    radial: Falloff = field(default_factory=Falloff)
    is_inverse_square: bool = False
    is_global: bool = False

    @property
    def texels(self) -> Floats:
        """(FIELD_TEXELS, 4) float32, see lib_force_fields.glsl."""
        return np.array(
            [
                [*(self.place or self.center), KINDS.index(self.kind)],
                [*(self.normal or self.axis), SHAPES.index(self.shape)],
                [*self.center, self.strength],
                [*self.axis, self.damping],
                [self.size, self.flow, self.across_fraction, FALLOFFS.index(self.falloff)],
                [self.distance.power, self.distance.near, self.distance.far, self.side],
                [
                    self.radial.power,
                    self.radial.near,
                    self.radial.far,
                    self.is_inverse_square + 2 * self.is_global,
                ],
            ],
            np.float32,
        )


@dataclass(frozen=True, eq=False)
class ForceFields:
    """All fields that act in a frame.

    permutation: (256,) of 0 to 255, of the noise; None if no field is turbulent.
    factor: common factor of their strengths, applied to the falloff.
    """

    fields: tuple[ForceField, ...] = ()
    permutation: Ints | None = None
    factor: float = 1.0

    def scaled(self, factor: float) -> ForceFields | None:
        """The fields with this factor; None if nothing acts."""
        if not self.fields or factor <= 0.0:
            return None
        return replace(self, factor=factor)

    @cached_property
    def table(self) -> Floats:
        """For the GPU, (1 + fields, TABLE_WIDTH, 4) float32: the permutation, then the fields."""
        table = np.zeros((1 + len(self.fields), TABLE_WIDTH, 4), np.float32)
        if self.permutation is not None:
            table[0] = self.permutation.reshape(TABLE_WIDTH, 4)
        for row, one in zip(table[1:], self.fields, strict=True):
            row[:FIELD_TEXELS] = one.texels
        return table

    @cached_property
    def acts_across(self) -> bool:
        """Whether any field acts partly across strands only."""
        return any(one.across_fraction > 0.0 for one in self.fields)


NO_FIELDS = ForceFields()


@dataclass(frozen=True)
class FieldEffect:
    """The effect of all fields together at n points.

    push: (3, n) [m/s^2], acceleration.
    slowing_rate: (n,) [1/s], rate at which the velocity decays.
    across_push, across_slowing: the parts of these that act across strands only.
    spin: (3, n) [1/s], turns the velocity: the acceleration is velocity x spin.
    """

    push: Floats
    slowing_rate: Floats
    across_push: Floats
    across_slowing: Floats
    spin: Floats

    def acceleration(self, velocity: Floats) -> Floats:
        """The acceleration (3, n) [m/s^2] of points at this velocity that are not on a strand."""
        turned = cross_rows(velocity, self.spin)
        result: Floats = self.push - velocity * self.slowing_rate + turned
        return result


def field_effect(fields: ForceFields, points: Floats, velocity: Floats) -> FieldEffect:
    """The effect of all fields at points.

    Args:
        points: (3, n) float32 world [m]. velocity: (3, n) float32 [m/s].
    """
    push, spin, across_push = (np.zeros_like(points) for _ in range(3))
    slowing, across_slowing = np.zeros_like(points[0]), np.zeros_like(points[0])
    for one in fields.fields:
        own_push, own_slowing, own_spin = _effect_of_field(one, fields, points, velocity)
        push += own_push
        slowing += own_slowing
        if one.across_fraction > 0.0:
            across_push += own_push * np.float32(one.across_fraction)
            across_slowing += own_slowing * np.float32(one.across_fraction)
        if own_spin is not None:
            spin += own_spin
    for total in (push, across_push):
        np.clip(total, -_MAX_ACCELERATION, _MAX_ACCELERATION, out=total)
    return FieldEffect(push, slowing, across_push, across_slowing, spin)


def _effect_of_field(
    field: ForceField, fields: ForceFields, points: Floats, velocity: Floats
) -> tuple[Floats, Floats, Floats | None]:
    """Push, slowing and spin of one field, see `FieldEffect`."""
    place, normal, center, axis = (
        np.broadcast_to(np.array(vector, np.float32)[:, None], points.shape)
        for vector in (
            field.place or field.center,
            field.normal or field.axis,
            field.center,
            field.axis,
        )
    )
    from_center = points - center
    away = _from_shape(field, points - place, from_center, normal)
    distance = np.sqrt(dot_rows(away, away))
    falloff = _falloff(field, distance, from_center, normal) * np.float32(fields.factor)
    acts = falloff > 0.0
    strength, slowing, spin = falloff * np.float32(field.strength), np.zeros_like(falloff), None
    if field.kind == "wind":
        push = normal * strength
    elif field.kind == "force":
        if field.is_inverse_square:
            strength = np.where(distance > _TINY, strength / (distance * distance + _TINY), 0.0)
        push = _direction(away) * strength
    elif field.kind == "vortex" and field.shape == "point":
        push = _direction(cross_rows(normal, away)) * (strength * distance)
    elif field.kind == "vortex":
        around = cross_rows(axis, from_center) * strength
        push = cross_rows(axis, around) * strength + around
        slowing = acts.astype(np.float32)
    elif field.kind == "magnet":
        lines = cross_rows(normal, away) if field.shape in ("point", "line") else normal
        push, spin = np.zeros_like(points), _direction(lines) * strength
    elif field.kind == "harmonic":
        if field.size:
            away = away * ((distance - np.float32(field.size)) / np.maximum(distance, _TINY))
        push = away * -strength
        slowing = acts * np.float32(field.damping * 2.0 * abs(field.strength) ** 0.5)
    elif field.kind == "turbulence":
        assert fields.permutation is not None, "it comes with turbulence"
        noise_points = points if field.is_global else from_center + axis
        push = turbulence(fields.permutation, noise_points, field.size) * strength
    else:  # drag
        push = np.zeros_like(points)
        speed = np.sqrt(dot_rows(velocity, velocity))
        slowing = falloff * (
            speed * np.float32(min(field.strength, 2.0)) + np.float32(min(field.damping, 2.0))
        )
    if field.kind not in ("harmonic", "drag"):
        slowing = slowing + falloff * np.float32(field.flow)
    return push, slowing, spin


def _from_shape(field: ForceField, away: Floats, from_center: Floats, normal: Floats) -> Floats:
    """The vectors from the nearest point of the field's shape, (3, n) [m].

    Args:
        away: (3, n), from the field's place.
    """
    if field.shape not in ("line", "plane"):
        return away
    along = normal * dot_rows(normal, from_center)
    is_beside = field.shape == "line" or field.kind == "vortex"
    return from_center - along if is_beside else along


def _falloff(field: ForceField, distance: Floats, from_center: Floats, normal: Floats) -> Floats:
    """The fraction of its strength that a field has at each point, (n,)."""
    along = dot_rows(normal, from_center)
    if field.falloff == "sphere":
        part = _power_falloff(field.distance, distance)
    else:
        beside = from_center - normal * along
        part = _power_falloff(field.distance, np.abs(along))
        wide = np.sqrt(dot_rows(beside, beside))
        if field.falloff == "cone":
            length = np.maximum(np.sqrt(dot_rows(from_center, from_center)), _TINY)
            wide = _degrees(wide / length, along / length)
        part = part * _power_falloff(field.radial, wide)
    if field.side:
        part = part * (along * np.float32(field.side) >= 0.0)
    return part


def _power_falloff(falloff: Falloff, distance: Floats) -> Floats:
    beyond = np.maximum(distance + np.float32(1.0 - falloff.near), np.float32(1.0))
    return (distance <= np.float32(falloff.far)) / _power(beyond, falloff.power)


def _power(base: Floats, power: float) -> Floats:
    """base^power for base >= 1, by products and square roots."""
    result = np.ones_like(base)
    for _ in range(int(power)):
        result = result * base
    remainder, root = power - int(power), base
    for _ in range(_POWER_BITS):
        if not remainder:
            break
        root, remainder = np.sqrt(root), 2.0 * remainder
        if remainder >= 1.0:
            result, remainder = result * root, remainder - 1.0
    return result


def _degrees(sine: Floats, cosine: Floats) -> Floats:
    """The angle with this sine and cosine, from 0 to 180 degrees."""
    flat, angle = np.abs(cosine), np.zeros_like(cosine)
    for factor in _ANGLE:
        angle = angle * flat + np.float32(factor)
    angle = angle * sine
    return np.where(cosine < 0.0, np.float32(np.pi) - angle, angle) * np.float32(180.0 / np.pi)


def _direction(vectors: Floats) -> Floats:
    """Unit vectors; zero where there is no direction."""
    length = np.sqrt(dot_rows(vectors, vectors))
    return np.where(length > _TINY, vectors / np.maximum(length, _TINY), np.float32(0.0))


def turbulence(permutation: Ints, points: Floats, size: float) -> Floats:
    """Three octaves of noise for each axis, (3, n), from -1 to 1."""
    scaled = points * np.float32(1.0 / size if size else 1.0)
    sums = []
    for axis in range(3):
        turned = scaled[[axis, (axis + 1) % 3, (axis + 2) % 3]]
        octaves = [
            perlin(permutation, turned * np.float32(2**octave)) * np.float32(0.5**octave)
            for octave in range(_OCTAVES)
        ]
        sums.append(sum(octaves) * np.float32(4.0 / 7.0))
    return np.stack(sums)


def perlin(permutation: Ints, points: Floats) -> Floats:
    """Perlin's noise of 2002 at points (3, n), (n,), from -1 to 1."""
    whole = np.floor(points)
    cell = np.mod(whole, np.float32(256.0)).astype(np.int32) & 255
    inside = points - whole
    fade = inside * inside * inside * (inside * (inside * 6.0 - 15.0) + 10.0)
    twice = np.tile(permutation, 2)
    gradient = np.ascontiguousarray(GRADIENTS[twice & 15].T)
    seen = np.stack([inside, inside - np.float32(1.0)])
    values = []
    for x in (0, 1):
        along_x = twice.take(cell[0] + x)
        for y in (0, 1):
            along_y = twice.take(along_x + cell[1] + y)
            for z in (0, 1):
                corner = along_y + cell[2] + z
                value = gradient[0].take(corner) * seen[x, 0]
                value += gradient[1].take(corner) * seen[y, 1]
                value += gradient[2].take(corner) * seen[z, 2]
                values.append(value)
    blended = values
    for axis in (2, 1, 0):  # the last axis runs fastest
        blended = [
            low + fade[axis] * (high - low)
            for low, high in zip(blended[::2], blended[1::2], strict=True)
        ]
    return blended[0]


def apply_force_fields(
    position: Floats,
    previous: Floats,
    fields: ForceFields,
    dt: float,
    size: float,
    directions: Floats | None = None,
) -> None:
    """Apply a substep of the fields to the velocity, which `previous` holds, in place.

        v1 = (v + dt push) / (1 + dt slowing)
        v2 = (v1 + v1 x b + b (b . v1)) / (1 + b . b),   b = dt spin

    Args:
        position: (3, n) float32 world [m]; previous: a step of `dt` [s] earlier.
        size: of the hair [m]; a CV is moved by at most MAX_DISPLACEMENT times this.
        directions: (3, n), the direction of the strand at each CV; None: no strands.
    """
    step = np.float32(dt)
    velocity = (position - previous) / step
    effect = field_effect(fields, position, velocity)
    new_velocity = velocity + effect.push * step
    if directions is None or not fields.acts_across:
        new_velocity = new_velocity * _slowing_factor(effect.slowing_rate * step)
    else:
        along_strand = dot_rows(new_velocity, directions)
        across_strand = (new_velocity - directions * along_strand) * _slowing_factor(
            effect.slowing_rate * step
        )
        along_strand = along_strand - dot_rows(effect.across_push, directions) * step
        slowing_factor = _slowing_factor((effect.slowing_rate - effect.across_slowing) * step)
        new_velocity = across_strand + directions * (along_strand * slowing_factor)
    if any(one.kind == "magnet" for one in fields.fields):
        turn = np.clip(effect.spin * step, np.float32(-1.0e6), np.float32(1.0e6))
        new_velocity = (
            new_velocity + cross_rows(new_velocity, turn) + turn * dot_rows(new_velocity, turn)
        )
        new_velocity = new_velocity / (dot_rows(turn, turn) + np.float32(1.0))
    displacement = (new_velocity - velocity) * step
    length = np.sqrt(dot_rows(displacement, displacement))
    limit = np.float32(MAX_DISPLACEMENT * size)
    displacement = displacement * (limit / np.maximum(length, limit + _TINY))
    previous -= displacement


def _slowing_factor(slowing: Floats) -> Floats:
    """The factor of the velocity; fields with negative slowing increase it."""
    return np.where(slowing > 0.0, 1.0 / (1.0 + np.abs(slowing)), 1.0 - slowing).astype(np.float32)


def strand_directions(position: Floats) -> Floats:
    """Unit directions of strands at their CVs, (3, cv_count, n), from rows of the same shape: from
    the previous to the next CV."""
    before = np.concatenate([position[:, :1], position[:, :-1]], axis=1)
    after = np.concatenate([position[:, 1:], position[:, -1:]], axis=1)
    return _direction((after - before).reshape(3, -1)).reshape(position.shape)
