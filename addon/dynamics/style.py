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
on it. That would make sharp kinks tremble forever. So between GENTLE_BEND and SHARP_KINK, k is
blended from the one that turns with the strand to the one that the head carries, which does not
depend on the strand's motion.

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
from .banded import PentadiagonalSystem
from .constraints import PINNED_COUNT, TINY, minus_next, unit
from .settings import DynamicsSettings

#: A cantilever's first mode: omega = 1.8751^2 sqrt(EI / (rho A)) / L^2 (Euler-Bernoulli).
_CANTILEVER = 3.5160


#: Curvature over segment length, 2 sin(angle / 2), of a gentle bend and of a sharp kink.
GENTLE_BEND, SHARP_KINK = 0.3, 0.8


@dataclass(frozen=True)
class LocalShape:
    """The curvature of guides at rest, all float32 but the last.

    curvature: (3, cv_count - 2, guide_count) [m], each segment minus the one before it, in the
        frame of the one before it.
    turning_fraction: (cv_count - 2, guide_count), the fraction that turns with the strand, 0 at
        sharp kinks.
    twist_cv: (guide_count,) the CV that defines how a guide is twisted about its root segment.
    """

    curvature: Floats
    turning_fraction: Floats
    twist_cv: Ints

    def part(self, guides: slice) -> LocalShape:
        """The shape of these guides, as views."""
        return LocalShape(
            self.curvature[:, :, guides], self.turning_fraction[:, guides], self.twist_cv[guides]
        )

    @cached_property
    def twist_index(self) -> Ints:
        """The indices of the twist CVs in (cv_count * guide_count), (guide_count,)."""
        return self.twist_cv * len(self.twist_cv) + np.arange(len(self.twist_cv))

    @cached_property
    def turning_curvature(self) -> Floats:
        """The part of the curvature that turns with the strand [m], in the shape of `curvature`."""
        return self.curvature * self.turning_fraction

    @cached_property
    def fixed_fraction(self) -> Floats | None:
        """1 - hold; None if no guide has sharp kinks."""
        fixed = np.float32(1.0) - self.turning_fraction
        return fixed if fixed.any() else None


@dataclass(frozen=True)
class StyleSystem:
    """The system of the style solve.

    global_stiffness: (cv_count - 2, 1), g of each free CV. local_stiffness: (cv_count - 2, 1), s of
        each inner CV.
    band: the factored matrix. If stiffness is painted, all are (cv_count - 2, guide_count).
    """

    global_stiffness: Floats
    local_stiffness: Floats
    band: PentadiagonalSystem

    @cached_property
    def has_bending(self) -> bool:
        return bool(self.local_stiffness.any())

    def part(self, guides: slice) -> StyleSystem:
        """The system of these guides; itself if all guides share one."""
        if self.global_stiffness.shape[1] == 1:
            return self
        return StyleSystem(
            self.global_stiffness[:, guides],
            self.local_stiffness[:, guides],
            self.band.part(guides),
        )


@lru_cache(maxsize=8)
def style_system(settings: DynamicsSettings, cv_count: int, dt: float) -> StyleSystem:
    """The system for all free CVs of any guide, without painted stiffness."""
    root, tip, bend = (
        np.array([[value]]) for value in (settings.style_root, settings.style_tip, settings.bend)
    )
    return painted_style_system(settings, root, tip, bend, cv_count, dt)


def painted_style_system(
    settings: DynamicsSettings, root: Floats, tip: Floats, bend: Floats, cv_count: int, dt: float
) -> StyleSystem:
    """The system of guides with individual stiffness.

    Args:
        root, tip, bend: as in the settings, (cv_count or 1, guide_count or 1).
    """

    def rows(values: Floats, chosen: slice) -> Floats:
        return values[chosen] if len(values) > 1 else values

    free, inner = slice(PINNED_COUNT, None), slice(1, -1)
    along = np.arange(PINNED_COUNT, cv_count) / max(cv_count - 1, 1)
    blend = curve_along(settings.style_along, along)[:, None]
    root, tip = rows(root, free), rows(tip, free)
    global_stiffness = (2.0 * np.pi * (tip + (root - tip) * blend) * dt) ** 2
    segments = cv_count - 1
    bend_factor = curve_along(settings.bend_along, np.arange(1, cv_count - 1) / max(segments, 1))
    frequency = rows(bend, inner) * bend_factor[:, None]
    local_stiffness = (2.0 * np.pi * frequency * segments**2 / _CANTILEVER * dt) ** 2
    # B^T diag(s) B: s_i + 4 s_(i+1) + s_(i+2), beside it -2 (s_(i+1) + s_(i+2)), beyond it s_(i+2)
    global_stiffness, local_stiffness = np.broadcast_arrays(global_stiffness, local_stiffness)
    padded = np.concatenate([local_stiffness, np.zeros((2, local_stiffness.shape[1]))])
    diagonal = 1.0 + global_stiffness + (local_stiffness + 4.0 * padded[1:-1] + padded[2:])
    off_diagonal_1, off_diagonal_2 = -2.0 * (padded[1:-1] + padded[2:]), padded[2:]
    column, bends = (values.astype(np.float32) for values in (global_stiffness, local_stiffness))
    return StyleSystem(column, bends, PentadiagonalSystem(diagonal, off_diagonal_1, off_diagonal_2))


def restore_style(position: Floats, style: Floats, shape: LocalShape, system: StyleSystem) -> None:
    """Move the free CVs of `position` (3, cv_count, guide_count) to the minimum, in place.

    Solved for the correction, so that s does not amplify the rounding of world coordinates.
    """
    right = style[:, PINNED_COUNT:] - position[:, PINNED_COUNT:]
    right *= system.global_stiffness
    if system.has_bending:
        residual = _curvature_residual(position, style, shape)
        residual *= system.local_stiffness
        right += minus_next(minus_next(residual))
    system.band.solve(right)
    position[:, PINNED_COUNT:] += right


def local_shape(position: Floats) -> LocalShape:
    """The local shape of guides (3, cv_count, guide_count) at rest."""
    twist_cv = twist_reference(position)
    curvature = rest_curvature(position, twist_cv)
    segment = np.diff(position, axis=1)
    length = np.sqrt((segment * segment).sum(axis=0))
    bent = np.sqrt((curvature * curvature).sum(axis=0))
    sharpness = bent / np.maximum((length[1:] + length[:-1]) / 2.0, TINY)
    turning_fraction = np.clip(
        (SHARP_KINK - sharpness) / (SHARP_KINK - GENTLE_BEND), 0.0, 1.0
    ).astype(np.float32)
    return LocalShape(curvature, turning_fraction, twist_cv)


def twist_reference(position: Floats) -> Ints:
    """The CV that is farthest from the line of the root segment, (guide_count,)."""
    beside = _perpendicular(
        position - position[:, :1], unit(position[:, 1] - position[:, 0])[:, None]
    )
    squared: Floats = (beside * beside).sum(axis=0)
    return squared.argmax(axis=0)


def rest_curvature(position: Floats, twist_cv: Ints) -> Floats:
    """Second differences in the frame of the segment before, (3, cv_count - 2, guide_count)."""
    twist = position[:, twist_cv, np.arange(position.shape[2])] - position[:, 0]
    segment = position[:, 1:] - position[:, :-1]
    tangent, normal = segment_frames(segment, twist)
    second = segment[:, 1:] - segment[:, :-1]
    axes = (tangent, normal, cross_rows(tangent, normal))
    return np.stack([(second * axis[:, :-1]).sum(axis=0) for axis in axes])


def segment_frames(segment: Floats, twist: Floats) -> tuple[Floats, Floats]:
    """Tangent and normal (3, n, guide_count) of each segment of the same shape [m].

    The first normal points to the twist CV of the style, the others follow without twist. Normals
    of a straight guide, which has no curvature to turn, are zero.

    Args:
        twist: (3, guide_count), the vector from the style's root to its twist CV [m].
    """
    tangent = unit(segment)
    first = unit(_perpendicular(twist, tangent[:, 0]))
    transport = tangent[:, 1:] + tangent[:, :-1]
    scale = dot_rows(tangent[:, 1:], transport)  # 1 + t.t' = t'.(t + t')
    scale += np.float32(1.0e-6)
    transport /= scale
    return tangent, _parallel_transported(first, tangent, transport)


def _parallel_transported(first_normal: Floats, tangent: Floats, transport: Floats) -> Floats:
    """The first normal (3, guide_count) carried from segment to segment, (3, n, guide_count):
    u' = u - (u.t') m, with m (3, n - 1, guide_count)."""
    along, turn = (np.ascontiguousarray(rows.transpose(1, 0, 2)) for rows in (tangent, transport))
    normal = np.empty_like(along)
    normal[0] = first_normal
    here = list(normal)
    product, fraction = np.empty_like(first_normal), np.empty_like(first_normal[0])
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
    twist = style.reshape(3, -1).take(shape.twist_index, axis=1)
    twist -= style[:, 0]
    tangent, normal = segment_frames(segment[:, :-1], twist)
    curvature = shape.turning_curvature
    residual = cross_rows(tangent, normal)
    residual *= curvature[2]
    normal *= curvature[1]
    residual += normal
    tangent *= curvature[0]
    residual += tangent
    if shape.fixed_fraction is not None:
        straight = style[:, 1:] - style[:, :-1]
        bent = straight[:, 1:] - straight[:, :-1]
        bent *= shape.fixed_fraction
        residual += bent
    residual -= segment[:, 1:]
    residual += segment[:, :-1]
    return residual


def _perpendicular(vector: Floats, unit: Floats) -> Floats:
    return vector - unit * dot_rows(vector, unit)
