"""The scene's force fields: what each does at the place where a CV is.

The fields are Blender's, with the effect that they have on a particle of mass 1 (its manual,
Physics > Forces): an acceleration, a rate at which they slow down what moves, and a spin around
magnetic lines. What slows down is solved implicitly, so that it only ever slows down.

Falloff is (1 + d - near)^-power beyond `near`, and nothing beyond `far`. Powers are products and
square roots here, as numpy's own differs in its last bit from processor to processor. Turbulence
is Perlin's noise (2002, "Improving Noise"), by the permutation that Blender has.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from ..arrays import Floats, Ints
from ..strands.vectors import cross_rows, dot_rows

#: Kinds that act on hair, and shapes of what they act from. The GPU knows them by these numbers.
KINDS = ("force", "wind", "vortex", "magnet", "harmonic", "turbulence", "drag")
SHAPES = ("point", "line", "plane", "points")
FALLOFFS = ("sphere", "tube", "cone")
#: Texels of a field on the GPU, see `ForceFields.table`; the permutation has four values in each.
FIELD_TEXELS, TABLE_WIDTH = 7, 64
#: [of the hair's length] that fields move a CV at most in a substep.
FARTHEST = 0.1
#: Beyond every distance. Float32 has no room for its square, nor needs it.
ENDLESS = 3.0e38
#: Vectors shorter than this have no direction.
_TINY = np.float32(1.0e-12)
#: [m/s^2] of each axis; what is more could overflow.
_STRONGEST = np.float32(1.0e9)
#: Fractions of a power, halved this often.
_HALVES = 16
#: Octaves of turbulence.
_OCTAVES = 3
_NOWHERE = (0.0, 0.0, 0.0)
#: The gradients of Perlin's noise, by the lowest four bits of a hash.
GRADIENTS = np.array(
    [
        *((x, y, 0) for y in (1, -1) for x in (1, -1)),
        *((x, 0, z) for z in (1, -1) for x in (1, -1)),
        *((0, y, z) for z in (1, -1) for y in (1, -1)),
        *((1, 1, 0), (0, -1, 1), (-1, 1, 0), (0, -1, -1)),
    ],
    np.float32,
)
#: An angle over its sine as a polynomial of its cosine, within 1e-7, the highest power first; twin
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
    """power: of the distance. near, far: between them strength falls off."""

    power: float = 0.0
    near: float = 0.0
    far: float = ENDLESS


@dataclass(frozen=True)
class ForceField:
    """One field, world space [m].

    kind, shape, falloff: of KINDS, SHAPES, FALLOFFS.
    place, normal: where it acts from and along what; of one that acts from many points, one of
        these. center, axis: of its object; unit vectors.
    damping: of harmonic fields and of drag, which is linear by it and quadratic by its strength.
    size: of turbulence; of harmonic fields their rest length.
    flow: how much of the speed it takes, by its falloff.
    across: fraction of it that acts across strands only.
    side: 1 or -1: only where that is the sign along `normal`; 0: on both sides.
    distance: its falloff. radial: beside the axis, of tubes in metres, of cones in degrees.
    is_inverse_square: whether a force falls off with the square of the distance as well.
    is_global: whether turbulence stays where it is while its object moves.
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
    across: float = 0.0
    falloff: str = "sphere"
    side: int = 0
    distance: Falloff = field(default_factory=Falloff)
    radial: Falloff = field(default_factory=Falloff)
    is_inverse_square: bool = False
    is_global: bool = False

    @property
    def numbers(self) -> Floats:
        """(FIELD_TEXELS, 4) float32, see lib_force_fields.glsl."""
        return np.array(
            [
                [*(self.place or self.center), KINDS.index(self.kind)],
                [*(self.normal or self.axis), SHAPES.index(self.shape)],
                [*self.center, self.strength],
                [*self.axis, self.damping],
                [self.size, self.flow, self.across, FALLOFFS.index(self.falloff)],
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
    """All that act in a frame.

    permutation: (256,) of 0 to 255, of the noise; None where nothing is turbulent.
    factor: of the falloff of each.
    """

    fields: tuple[ForceField, ...] = ()
    permutation: Ints | None = None
    factor: float = 1.0

    def by(self, factor: float) -> ForceFields | None:
        """What is left of them; None where nothing acts."""
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
            row[:FIELD_TEXELS] = one.numbers
        return table

    @cached_property
    def is_across(self) -> bool:
        """Whether any acts differently across strands."""
        return any(one.across > 0.0 for one in self.fields)


#: Of a scene without any.
NO_FIELDS = ForceFields()


@dataclass(frozen=True)
class Felt:
    """What all fields together do at n points.

    push: (3, n) [m/s^2]. slowing: (n,) [1/s], which takes that part of the speed. across_push,
        across_slowing: of these, what acts across strands only. spin: (3, n) [1/s], around which
        speed turns: the acceleration is speed x spin.
    """

    push: Floats
    slowing: Floats
    across_push: Floats
    across_slowing: Floats
    spin: Floats

    def acceleration(self, velocity: Floats) -> Floats:
        """(3, n) [m/s^2] of points at this velocity that are not on a strand."""
        turned = cross_rows(velocity, self.spin)
        result: Floats = self.push - velocity * self.slowing + turned
        return result


def felt(fields: ForceFields, points: Floats, velocity: Floats) -> Felt:
    """Args:
    points: (3, n) float32 world [m]. velocity: theirs [m/s].
    """
    push, spin, across_push = (np.zeros_like(points) for _ in range(3))
    slowing, across_slowing = np.zeros_like(points[0]), np.zeros_like(points[0])
    for one in fields.fields:
        own, slows, turns = _felt_of(one, fields, points, velocity)
        push += own
        slowing += slows
        if one.across > 0.0:
            across_push += own * np.float32(one.across)
            across_slowing += slows * np.float32(one.across)
        if turns is not None:
            spin += turns
    for total in (push, across_push):
        np.clip(total, -_STRONGEST, _STRONGEST, out=total)
    return Felt(push, slowing, across_push, across_slowing, spin)


def _felt_of(
    one: ForceField, fields: ForceFields, points: Floats, velocity: Floats
) -> tuple[Floats, Floats, Floats | None]:
    """Push, slowing and spin of one field, see `Felt`."""
    place, normal, center, axis = (
        np.broadcast_to(np.array(vector, np.float32)[:, None], points.shape)
        for vector in (one.place or one.center, one.normal or one.axis, one.center, one.axis)
    )
    from_center = points - center
    away = _away(one, points - place, from_center, normal)
    distance = np.sqrt(dot_rows(away, away))
    part = _falloff(one, distance, from_center, normal) * np.float32(fields.factor)
    acts = part > 0.0
    strong, slows, turns = part * np.float32(one.strength), np.zeros_like(part), None
    if one.kind == "wind":
        push = normal * strong
    elif one.kind == "force":
        if one.is_inverse_square:
            strong = np.where(distance > _TINY, strong / (distance * distance + _TINY), 0.0)
        push = _direction(away) * strong
    elif one.kind == "vortex" and one.shape == "point":
        push = _direction(cross_rows(normal, away)) * (strong * distance)
    elif one.kind == "vortex":
        around = cross_rows(axis, from_center) * strong
        push = cross_rows(axis, around) * strong + around
        slows = acts.astype(np.float32)
    elif one.kind == "magnet":
        lines = cross_rows(normal, away) if one.shape in ("point", "line") else normal
        push, turns = np.zeros_like(points), _direction(lines) * strong
    elif one.kind == "harmonic":
        if one.size:
            away = away * ((distance - np.float32(one.size)) / np.maximum(distance, _TINY))
        push = away * -strong
        slows = acts * np.float32(one.damping * 2.0 * abs(one.strength) ** 0.5)
    elif one.kind == "turbulence":
        assert fields.permutation is not None, "it comes with turbulence"
        seen = points if one.is_global else from_center + axis
        push = turbulence(fields.permutation, seen, one.size) * strong
    else:  # drag
        push = np.zeros_like(points)
        speed = np.sqrt(dot_rows(velocity, velocity))
        slows = part * (
            speed * np.float32(min(one.strength, 2.0)) + np.float32(min(one.damping, 2.0))
        )
    if one.kind not in ("harmonic", "drag"):
        slows = slows + part * np.float32(one.flow)
    return push, slows, turns


def _away(one: ForceField, away: Floats, from_center: Floats, normal: Floats) -> Floats:
    """From the nearest place of the field's shape, (3, n) [m]."""
    if one.shape not in ("line", "plane"):
        return away
    along = normal * dot_rows(normal, from_center)
    is_beside = one.shape == "line" or one.kind == "vortex"
    return from_center - along if is_beside else along


def _falloff(one: ForceField, distance: Floats, from_center: Floats, normal: Floats) -> Floats:
    """The part of its strength that a field has, (n,)."""
    along = dot_rows(normal, from_center)
    if one.falloff == "sphere":
        part = _fallen(one.distance, distance)
    else:
        beside = from_center - normal * along
        part = _fallen(one.distance, np.abs(along))
        wide = np.sqrt(dot_rows(beside, beside))
        if one.falloff == "cone":
            length = np.maximum(np.sqrt(dot_rows(from_center, from_center)), _TINY)
            wide = _degrees(wide / length, along / length)
        part = part * _fallen(one.radial, wide)
    if one.side:
        part = part * (along * np.float32(one.side) >= 0.0)
    return part


def _fallen(falloff: Falloff, distance: Floats) -> Floats:
    beyond = np.maximum(distance + np.float32(1.0 - falloff.near), np.float32(1.0))
    return (distance <= np.float32(falloff.far)) / _power(beyond, falloff.power)


def _power(base: Floats, power: float) -> Floats:
    """base^power of numbers from 1 on, by products and roots."""
    result = np.ones_like(base)
    for _ in range(int(power)):
        result = result * base
    left, root = power - int(power), base
    for _ in range(_HALVES):
        if not left:
            break
        root, left = np.sqrt(root), 2.0 * left
        if left >= 1.0:
            result, left = result * root, left - 1.0
    return result


def _degrees(sine: Floats, cosine: Floats) -> Floats:
    """The angle of this sine and cosine, from 0 to 180."""
    flat, angle = np.abs(cosine), np.zeros_like(cosine)
    for factor in _ANGLE:
        angle = angle * flat + np.float32(factor)
    angle = angle * sine
    return np.where(cosine < 0.0, np.float32(np.pi) - angle, angle) * np.float32(180.0 / np.pi)


def _direction(vectors: Floats) -> Floats:
    """Unit vectors; nought where there is no direction."""
    length = np.sqrt(dot_rows(vectors, vectors))
    return np.where(length > _TINY, vectors / np.maximum(length, _TINY), np.float32(0.0))


def turbulence(permutation: Ints, points: Floats, size: float) -> Floats:
    """Noise of three octaves along each axis, (3, n) of -1 to 1."""
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
    """Perlin's noise of 2002 at points (3, n), (n,) of -1 to 1."""
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


def blow(
    position: Floats,
    previous: Floats,
    fields: ForceFields,
    dt: float,
    size: float,
    along: Floats | None = None,
) -> None:
    """A substep's effect on the speed, which `previous` holds; in place.

        v1 = (v + dt push) / (1 + dt slowing)
        v2 = (v1 + v1 x b + b (b . v1)) / (1 + b . b),   b = dt spin

    Args:
        position: (3, n) float32 world [m]; previous: a step of `dt` [s] earlier.
        size: of the hair [m]: a CV is moved by FARTHEST of it at most.
        along: (3, n), the direction of the strand at each CV; None: there are no strands.
    """
    step = np.float32(dt)
    velocity = (position - previous) / step
    all_of = felt(fields, position, velocity)
    blown = velocity + all_of.push * step
    if along is None or not fields.is_across:
        blown = blown * _left(all_of.slowing * step)
    else:
        straight = dot_rows(blown, along)
        beside = (blown - along * straight) * _left(all_of.slowing * step)
        straight = straight - dot_rows(all_of.across_push, along) * step
        kept = _left((all_of.slowing - all_of.across_slowing) * step)
        blown = beside + along * (straight * kept)
    if any(one.kind == "magnet" for one in fields.fields):
        turn = np.clip(all_of.spin * step, np.float32(-1.0e6), np.float32(1.0e6))
        blown = blown + cross_rows(blown, turn) + turn * dot_rows(blown, turn)
        blown = blown / (dot_rows(turn, turn) + np.float32(1.0))
    displacement = (blown - velocity) * step
    far = np.sqrt(dot_rows(displacement, displacement))
    limit = np.float32(FARTHEST * size)
    displacement = displacement * (limit / np.maximum(far, limit + _TINY))
    previous -= displacement


def _left(slowing: Floats) -> Floats:
    """The part of the speed that is left; a field may also drive on what moves."""
    return np.where(slowing > 0.0, 1.0 / (1.0 + np.abs(slowing)), 1.0 - slowing).astype(np.float32)


def along_strands(position: Floats) -> Floats:
    """Of the strands at their CVs, (3, cv_count, n), from rows of the same shape: from the CV
    before to the CV after."""
    before = np.concatenate([position[:, :1], position[:, :-1]], axis=1)
    after = np.concatenate([position[:, 1:], position[:, -1:]], axis=1)
    return _direction((after - before).reshape(3, -1)).reshape(position.shape)
