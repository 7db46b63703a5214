"""The inputs of a frame of dynamics for its shader: a uniform block (struct_dynamics) and a table
with one row per substep.

A row of the table, texels of RGBA32F:
    0     x the substep's end s as a fraction of the frame, y s (s - 1); z and w fractions of the
          style's displacement and curvature that swing damping gives to each CV. y and w are
          divided by r (r + 1) with the ratio r of `trajectory.curvature`, or 0 where the style
          moves straight; z and w are 0 where it moves along an arc
    1, 2  phases of the gusts' modes [rad]
    then  COLLIDER_TEXELS for each collider, see collider_textures.py
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from ..arrays import Floats
from ..dynamics.constraints import PINNED_COUNT, ROUNDING
from ..dynamics.contacts import CONTACT_MARGIN, cv_radius
from ..dynamics.force_fields import MAX_DISPLACEMENT
from ..dynamics.frame import Frame
from ..dynamics.painted import PaintedFrame
from ..dynamics.rigid_path import NO_MOTION
from ..dynamics.settings import DynamicsSettings
from ..dynamics.springs import max_extension_fraction, stiffness
from ..dynamics.style import StyleSystem, style_system
from ..dynamics.trajectory import clamped_ratio
from ..dynamics.wind import MODES
from .shader_source import SUBSTEP_TEXELS

#: The uniform block: numbers before the vectors, and vectors before those of the CVs.
_NUMBERS, _VECTORS = 16, 4 + 2 * MODES


def spans_of(frame: Frame, first: int, count: int) -> Floats:
    """Begin and end of each substep as fractions of the frame, (count, 2) float64."""
    return np.array([frame.span(number) for number in range(first, first + count)]).reshape(-1, 2)


def substep_table_of(frame: Frame, first: int, spans: Floats) -> Floats:
    """The table without colliders' texels, (substep_count, SUBSTEP_TEXELS, 4) float32."""
    table = np.zeros((len(spans), SUBSTEP_TEXELS, 4), np.float32)
    begin, end = spans.T
    table[:, 0, 0] = end
    table[:, 0, 2] = part = frame.damping_factors.style * (end - begin)
    if frame.drive.target_earlier is not None:
        ratio = clamped_ratio(frame.drive.earlier_ratio)
        table[:, 0, 1] = end * (end - 1.0) / (ratio * (ratio + 1.0))
        table[:, 0, 3] = part * (begin + end - 1.0) / (ratio * (ratio + 1.0))
    if frame.style_carrier is not None:
        table[:, 0, 2:] = 0.0
    if frame.air is not None and len(frame.air.phase):
        time = frame.time + np.arange(first, first + len(spans)) * frame.dt
        phases = np.mod(frame.air.phase - frame.air.angular_frequency * time[:, None], 2.0 * np.pi)
        table[:, 1:] = phases.reshape(len(spans), SUBSTEP_TEXELS - 1, 4)
    return table


def transforms_of(frame: Frame, first: int, count: int) -> Floats:
    """`transforms` of dynamics_pass for some substeps, (count + 1, 20, 4) float32."""
    table = np.zeros((count + 1, 5, 4, 4), np.float32)
    table[:, :, :3, :3] = np.eye(3)
    begin, bend = frame.span(first)[0], 0.0
    if frame.drive.target_earlier is not None:
        ratio = clamped_ratio(frame.drive.earlier_ratio)
        bend = 1.0 / (ratio * (ratio + 1.0))
    carrier = frame.style_carrier
    if carrier is not None:
        path = carrier.path
        ends = [frame.span(number)[1] for number in range(first, first + count)]
        places = [path.at(end) for end in ends]
        places.append(frame.root_place(first - 1) if frame.inherits_motion else path.at(begin))
        table[:, 0] = [carrier.transform(place).texels for place in places]
        table[-1, 2] = carrier.transform_back(path.now).texels
        table[-1, 3] = carrier.transform_back(path.earlier or NO_MOTION).texels
        table[-1, 4] = carrier.transform(path.at(0.5)).texels
        table[-1, 2, 3, 3] = frame.damping_factors.style
    if frame.inherits_motion:
        numbers = (*range(first, first + count), first - 1)
        table[:, 1] = [frame.inherited_motion(number).texels for number in numbers]
    table[-1, :2, 3, 3] = begin, begin * (begin - 1.0) * bend
    table[-1, 4, 3, 3] = -0.25 * bend if carrier is not None else 0.0
    return table.reshape(count + 1, 20, 4)


def block_of(
    frame: Frame, guide_count: int, cv_count: int, substep_count: int, speed_ratio: float
) -> Floats:
    """`Dynamics` in std140, float32.

    Args:
        substep_count: of this dispatch.
        speed_ratio: length of its first substep over that of the one before it.
    """
    settings, dt = frame.settings, frame.dt
    values = np.zeros(_NUMBERS + 4 * _VECTORS + 8 * cv_count, np.float32)
    values[:7].view(np.int32)[:] = (
        guide_count,
        substep_count,
        len(frame.drive.colliders),
        settings.contact_passes,
        settings.length_iterations,
        settings.relaxations,
        settings.long_range,
    )
    values[7:_NUMBERS] = (
        settings.length_tolerance,
        dt,
        frame.damping_factors.velocity,
        frame.damping_factors.air,
        settings.drag,
        settings.friction,
        settings.depenetration_speed * frame.size * dt,
        speed_ratio,
        CONTACT_MARGIN * frame.size,
    )
    vectors = values[_NUMBERS:].reshape(-1, 4)
    _fill_forces(vectors, frame)
    bounce = 1.0 / (stiffness(settings, cv_count) * dt * dt)
    vectors[3] = (
        max_extension_fraction(settings),
        bounce,
        ROUNDING * frame.size,
        MAX_DISPLACEMENT * frame.size,
    )
    values[_NUMBERS + 4 * _VECTORS :] = _cv_values(settings, cv_count, dt, frame.size)
    return values


def _fill_forces(vectors: Floats, frame: Frame) -> None:
    settings, air = frame.settings, frame.air
    pull = np.asarray(frame.drive.gravity, np.float32) * np.float32(settings.gravity)
    square = np.float32(frame.dt * frame.dt)
    vectors[0, :3] = pull * np.float32(1.0 - settings.buoyancy) * square
    vectors[0, 3] = clamped_ratio(frame.drive.earlier_ratio)
    compensated = (frame.rotation @ pull.astype(np.float64)).astype(np.float32)
    vectors[1, :3] = compensated * (np.float32(settings.sag_compensation) * square)
    if frame.force_fields is not None:
        vectors[2, 3] = frame.force_fields.factor
    if air is not None:
        vectors[2, :3] = air.velocity
        vectors[4 : 4 + len(air.amplitude), :3] = air.amplitude
        vectors[4 + MODES : 4 + MODES + len(air.wave_vector), :3] = air.wave_vector


@lru_cache(maxsize=8)
def _cv_values(settings: DynamicsSettings, cv_count: int, dt: float, size: float) -> Floats:
    """`band` and `stiffness_and_radius` of the block, flat."""
    band, stiffness_and_radius = values = np.zeros((2, cv_count, 4), np.float32)
    if cv_count > PINNED_COUNT:
        matrix = style_system(settings, cv_count, dt)
        band[:] = bands_of(matrix, cv_count, 1)[0]
        stiffness_and_radius[:, 0] = local_stiffness_of(matrix, cv_count, 1)[0]
        stiffness_and_radius[PINNED_COUNT:, 1] = cv_radius(settings, cv_count, size)
    return values.ravel()


def bands_of(matrix: StyleSystem, cv_count: int, guide_count: int) -> Floats:
    """`band` of guides, (guide_count, cv_count, 4) float32."""
    bands = np.zeros((guide_count, cv_count, 4), np.float32)
    band = matrix.band
    for lane, rows in enumerate(
        (band.lower_1, band.lower_2, band.inverse_pivot, matrix.global_stiffness)
    ):
        bands[:, PINNED_COUNT:, lane] = rows.T
    return bands


def local_stiffness_of(matrix: StyleSystem, cv_count: int, guide_count: int) -> Floats:
    """The local stiffness of guides, (guide_count, cv_count) float32."""
    stiffness = np.zeros((guide_count, cv_count), np.float32)
    stiffness[:, 1:-1] = matrix.local_stiffness.T
    return stiffness


def painted_texels(frame: Frame, painted: PaintedFrame, cv_count: int) -> Floats:
    """`painted_numbers` of dynamics_pass, (guide_count, cv_count, 4) float32."""
    guide_count = len(painted.gravity)
    own = np.zeros((guide_count, cv_count, 4), np.float32)
    own[..., 0] = local_stiffness_of(painted.style_system, cv_count, guide_count)
    damped, carried = painted.damping_factors, float(frame.damping_factors.style)
    own[:, 0] = np.stack(
        [
            damped.velocity,
            damped.air,
            damped.style / carried if carried else np.zeros(guide_count),
            painted.gravity,
        ],
        axis=1,
    )
    return own
