"""Restoring the style: global and local shape of a guide in one direct solve.

Global shape pulls each CV to its place in the style that the head carries; local shape keeps the
curvature between segments, so that waves and curls keep their form wherever the strand swings
(both: Han and Harada 2012, "Real-time Hair Simulation with Efficient Hair Style Preservation").
There both are relaxed CV by CV. Here they are the energies of one quadratic problem,

    minimise  1/2 |x - x_free|^2 + 1/2 sum g_c |x_c - style_c|^2 + 1/2 sum s_i |b_i(x) - k_i|^2

    b_i(x) = (x_{i+1} - x_i) - (x_i - x_{i-1})            second difference at CV i
    k_i                                                   the same at rest, carried along by
                                                          the frame of segment i-1
    g = (omega_global dt)^2,  s = (omega_bend dt)^2       backward Euler of springs

whose matrix I + diag(g) + B^T diag(s) B is banded, constant, and the same for all guides unless
stiffness is painted: one solve with scalar factors restores even the stiffest style without
iterations, and is stable for any dt.

Frames: on each segment a tangent t and a normal u, carried from segment to segment by the smallest
rotation (Bishop 1975). With unit tangents that rotation is  u' = u - (u.t') / (1 + t.t') (t + t').

k is taken from the frames before the solve, so it follows the segment before it without acting back
on it. That would make sharp kinks tremble forever. So between GENTLE and SHARP, k is blended from
the one that turns with the strand to the one that the head carries, which does not depend on the
strand's motion.

Limitations: very stiff curls follow their root with a delay of some substeps; sharply kinked hair
swings less, because its kinks keep their direction relative to the head; a strand that folds back
on itself by 180 degrees loses its twist.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np

from ..arrays import Floats, Ints
from ..params.curve import sample_curve as curve_along
from ..strands.vectors import cross_rows, dot_rows
from .banded import SharedBand
from .constraints import PINNED, TINY, less_next, unit
from .settings import DynamicsSettings

#: A cantilever's first mode: omega = 1.8751^2 sqrt(EI / (rho A)) / L^2 (Euler-Bernoulli).
_CANTILEVER = 3.5160


#: Curvature over segment length, 2 sin(angle / 2), of a gentle bend and of a sharp kink.
GENTLE, SHARP = 0.3, 0.8


@dataclass(frozen=True)
class LocalShape:
    """The curvature of guides at rest, all float32 but the last.

    curvature: (3, cv_count - 2, guide_count) [m], each segment minus the one before it, in the
        frame of the one before it.
    hold: (cv_count - 2, guide_count), the fraction that turns with the strand, 0 at sharp kinks.
    twist_cv: (guide_count,) the CV that defines how a guide is twisted about its root segment.
    """

    curvature: Floats
    hold: Floats
    twist_cv: Ints

    def part(self, guides: slice) -> LocalShape:
        """The shape of these guides, as views."""
        return LocalShape(self.curvature[:, :, guides], self.hold[:, guides], self.twist_cv[guides])

    @cached_property
    def twist_place(self) -> Ints:
        """The indices of the twist CVs in (cv_count * guide_count), (guide_count,)."""
        return self.twist_cv * len(self.twist_cv) + np.arange(len(self.twist_cv))

    @cached_property
    def turning(self) -> Floats:
        """The part of the curvature that turns with the strand, in the shape of `curvature`."""
        return self.curvature * self.hold

    @cached_property
    def staying(self) -> Floats | None:
        """1 - hold; None if no guide has sharp kinks."""
        staying = np.float32(1.0) - self.hold
        return staying if staying.any() else None


@dataclass(frozen=True)
class StyleBand:
    """The system of the style solve.

    pull: (cv_count - 2, 1), g of each free CV. bend: (cv_count - 2, 1), s of each inner CV.
    band: the factored matrix. If stiffness is painted, all are (cv_count - 2, guide_count).
    """

    pull: Floats
    bend: Floats
    band: SharedBand

    @cached_property
    def is_bending(self) -> bool:
        return bool(self.bend.any())

    def part(self, guides: slice) -> StyleBand:
        """The system of these guides; itself if all guides share one."""
        if self.pull.shape[1] == 1:
            return self
        return StyleBand(self.pull[:, guides], self.bend[:, guides], self.band.part(guides))


@lru_cache(maxsize=8)
def style_band(settings: DynamicsSettings, cv_count: int, dt: float) -> StyleBand:
    """The system for all free CVs of any guide, without painted stiffness."""
    root, tip, bend = (
        np.array([[value]]) for value in (settings.style_root, settings.style_tip, settings.bend)
    )
    return painted_band(settings, root, tip, bend, cv_count, dt)


def painted_band(
    settings: DynamicsSettings, root: Floats, tip: Floats, bend: Floats, cv_count: int, dt: float
) -> StyleBand:
    """The system of guides with individual stiffness.

    Args:
        root, tip, bend: as in the settings, (cv_count or 1, guide_count or 1).
    """

    def rows(values: Floats, chosen: slice) -> Floats:
        return values[chosen] if len(values) > 1 else values

    free, inner = slice(PINNED, None), slice(1, -1)
    along = np.arange(PINNED, cv_count) / max(cv_count - 1, 1)
    stiff = curve_along(settings.style_along, along)[:, None]
    root, tip = rows(root, free), rows(tip, free)
    pull = (2.0 * np.pi * (tip + (root - tip) * stiff) * dt) ** 2
    segments = cv_count - 1
    bent = curve_along(settings.bend_along, np.arange(1, cv_count - 1) / max(segments, 1))
    swings = rows(bend, inner) * bent[:, None]
    stay = (2.0 * np.pi * swings * segments**2 / _CANTILEVER * dt) ** 2
    # B^T diag(s) B: s_i + 4 s_(i+1) + s_(i+2), beside it -2 (s_(i+1) + s_(i+2)), beyond it s_(i+2)
    pull, stay = np.broadcast_arrays(pull, stay)
    after = np.concatenate([stay, np.zeros((2, stay.shape[1]))])
    main = 1.0 + pull + (stay + 4.0 * after[1:-1] + after[2:])
    beside, beyond = -2.0 * (after[1:-1] + after[2:]), after[2:]
    column, bends = (values.astype(np.float32) for values in (pull, stay))
    return StyleBand(column, bends, SharedBand(main, beside, beyond))


def restore_style(position: Floats, style: Floats, shape: LocalShape, matrix: StyleBand) -> None:
    """Move the free CVs of `position` (3, cv_count, guide_count) to the minimum, in place.

    Solved for the correction, so that s does not amplify the rounding of world coordinates.
    """
    right = style[:, PINNED:] - position[:, PINNED:]
    right *= matrix.pull
    if matrix.is_bending:
        residual = _curvature_residual(position, style, shape)
        residual *= matrix.bend
        right += less_next(less_next(residual))
    matrix.band.solve(right)
    position[:, PINNED:] += right


def local_shape(position: Floats) -> LocalShape:
    """The local shape of guides (3, cv_count, guide_count) at rest."""
    twist_cv = twist_reference(position)
    curvature = rest_curvature(position, twist_cv)
    segment = np.diff(position, axis=1)
    length = np.sqrt((segment * segment).sum(axis=0))
    bent = np.sqrt((curvature * curvature).sum(axis=0))
    sharpness = bent / np.maximum((length[1:] + length[:-1]) / 2.0, TINY)
    hold = np.clip((SHARP - sharpness) / (SHARP - GENTLE), 0.0, 1.0).astype(np.float32)
    return LocalShape(curvature, hold, twist_cv)


def twist_reference(position: Floats) -> Ints:
    """The CV that is farthest from the line of the root segment, (guide_count,)."""
    beside = _across(position - position[:, :1], unit(position[:, 1] - position[:, 0])[:, None])
    squared: Floats = (beside * beside).sum(axis=0)
    return squared.argmax(axis=0)


def rest_curvature(position: Floats, twist_cv: Ints) -> Floats:
    """Second differences in the frame of the segment before, (3, cv_count - 2, guide_count)."""
    twist = position[:, twist_cv, np.arange(position.shape[2])] - position[:, 0]
    segment = position[:, 1:] - position[:, :-1]
    tangent, normal = frames(segment, twist)
    second = segment[:, 1:] - segment[:, :-1]
    axes = (tangent, normal, cross_rows(tangent, normal))
    return np.stack([(second * axis[:, :-1]).sum(axis=0) for axis in axes])


def frames(segment: Floats, twist: Floats) -> tuple[Floats, Floats]:
    """Tangent and normal (3, n, guide_count) of each segment of the same shape [m].

    The first normal points to the twist CV of the style, the others follow without twist. Normals
    of a straight guide, which has no curvature to turn, are zero.

    Args:
        twist: (3, guide_count), the vector from the style's root to its twist CV [m].
    """
    tangent = unit(segment)
    first = unit(_across(twist, tangent[:, 0]))
    middle = tangent[:, 1:] + tangent[:, :-1]
    scale = dot_rows(tangent[:, 1:], middle)  # 1 + t.t' = t'.(t + t')
    scale += np.float32(1.0e-6)
    middle /= scale
    return tangent, _carried_on(first, tangent, middle)


def _carried_on(first: Floats, tangent: Floats, middle: Floats) -> Floats:
    """The first normal (3, guide_count) carried from segment to segment, (3, n, guide_count):
    u' = u - (u.t') m, with m (3, n - 1, guide_count)."""
    along, turn = (np.ascontiguousarray(rows.transpose(1, 0, 2)) for rows in (tangent, middle))
    normal = np.empty_like(along)
    normal[0] = first
    here = list(normal)
    product, fraction = np.empty_like(first), np.empty_like(first[0])
    x, y, z = product
    for before, after, next_along, next_turn in zip(
        here[:-1], here[1:], along[1:], turn, strict=True
    ):
        np.multiply(before, next_along, product)
        np.add(x, y, fraction)
        np.add(fraction, z, fraction)
        np.multiply(next_turn, fraction, product)
        np.subtract(before, product, after)
    return np.ascontiguousarray(normal.transpose(1, 0, 2))


def _curvature_residual(position: Floats, style: Floats, shape: LocalShape) -> Floats:
    """k - b(x), (3, cv_count - 2, guide_count)."""
    segment = position[:, 1:] - position[:, :-1]
    twist = style.reshape(3, -1).take(shape.twist_place, axis=1)
    twist -= style[:, 0]
    tangent, normal = frames(segment[:, :-1], twist)
    curvature = shape.turning
    residual = cross_rows(tangent, normal)
    residual *= curvature[2]
    normal *= curvature[1]
    residual += normal
    tangent *= curvature[0]
    residual += tangent
    if shape.staying is not None:
        straight = style[:, 1:] - style[:, :-1]
        bent = straight[:, 1:] - straight[:, :-1]
        bent *= shape.staying
        residual += bent
    residual -= segment[:, 1:]
    residual += segment[:, :-1]
    return residual


def _across(vector: Floats, unit: Floats) -> Floats:
    return vector - unit * dot_rows(vector, unit)
