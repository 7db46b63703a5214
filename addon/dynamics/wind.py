"""Wind with gusts: a mean velocity, and eddies that drift along with it.

    air(x, t) = v + |v| gusts sqrt(2 / n) sum_i a_i sin(k_i . (x - v t) + phase_i),   a_i . k_i = 0

is a sum of n random Fourier modes (Kraichnan 1970, "Diffusion by a Random Velocity Field"):
divergence-free like air, with standard deviation |v| gusts. Eddies that drift along unchanged are
Taylor's frozen turbulence (1938). The air depends on place and time only, so that it is the same
for any frame rate and order of evaluation.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from math import factorial

import numpy as np

from ..arrays import Floats
from ..strands.vectors import unit
from .motion_settings import MotionSettings

#: Modes in the sum.
MODES = 8
#: Coefficients of x^10 to x^0 in the series of sin(x) / x.
_SINE = [np.float32((-1) ** k / factorial(2 * k + 1)) for k in range(5, -1, -1)]


@dataclass(frozen=True)
class Air:
    """Moving air, or water.

    velocity: (3,) float32 mean [m/s], world.
    amplitude: (modes, 3) float32 [m/s], amplitude of each mode across its wave vector.
    wave_vector: (modes, 3) float32 [1/m], wave vectors.
    angular_frequency: (modes,) float64 [1/s], wave . velocity.
    phase: (modes,) float64 [rad].
    """

    velocity: Floats
    amplitude: Floats
    wave_vector: Floats
    angular_frequency: Floats
    phase: Floats

    def at(self, roots: Floats, time: float) -> Floats:
        """Velocity (3, n) float32 [m/s] at points (3, n) world [m], at a time [s]."""
        result = np.repeat(self.velocity[:, None], roots.shape[1], axis=1)
        turns = np.mod(self.phase - self.angular_frequency * time, 2.0 * np.pi).astype(np.float32)
        for swing, wave, turn in zip(self.amplitude, self.wave_vector, turns, strict=True):
            along = wave[0] * roots[0] + wave[1] * roots[1] + wave[2] * roots[2]
            result += swing[:, None] * sine(along + turn)
        return result


def air_from_settings(settings: MotionSettings) -> Air | None:
    """The air of these settings; None if it stands still."""
    elevation, azimuth = settings.wind_elevation, settings.wind_direction
    direction = np.array(
        [
            np.cos(elevation) * np.cos(azimuth),
            np.cos(elevation) * np.sin(azimuth),
            np.sin(elevation),
        ]
    )
    velocity = direction * settings.wind_speed
    speed = float(np.linalg.norm(velocity))
    if speed == 0.0:
        return None
    wave, across, phase = _modes(settings.gust_size, settings.gust_seed)
    if settings.gusts == 0.0:
        wave, across, phase = wave[:0], across[:0], phase[:0]
    strength = speed * settings.gusts * np.sqrt(2.0 / MODES)
    return Air(
        velocity.astype(np.float32),
        (across * strength).astype(np.float32),
        wave.astype(np.float32),
        wave.astype(np.float32).astype(np.float64) @ velocity,
        phase,
    )


@lru_cache(maxsize=8)
def _modes(size: float, seed: int) -> tuple[Floats, Floats, Floats]:
    """Wave vectors, unit vectors across them, and phases; wavelengths within half an octave of
    `size`."""
    random = np.random.default_rng(seed)
    direction = unit(random.normal(size=(MODES, 3)))
    length = size * 2.0 ** random.uniform(-0.5, 0.5, (MODES, 1))
    across = unit(np.cross(direction, unit(random.normal(size=(MODES, 3)))))
    return 2.0 * np.pi / length * direction, across, random.uniform(0.0, 2.0 * np.pi, MODES)


def sine(angle: Floats) -> Floats:
    """Sine of angles float32 [rad] by its Taylor polynomial on a quarter turn, error below 1e-6.

    Uses only sums and products, as numpy's sine differs in its last bit between processors.
    """
    turn = angle * np.float32(0.5 / np.pi) - np.float32(0.25)
    turn -= np.rint(turn)
    quarter = np.float32(0.25) - np.abs(turn)  # sin(2 pi t) = sin(2 pi quarter)
    x = quarter * np.float32(2.0 * np.pi)
    square = x * x
    result = np.full_like(x, _SINE[0])
    for factor in _SINE[1:]:
        result *= square
        result += factor
    return result * x
