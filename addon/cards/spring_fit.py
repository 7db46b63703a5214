"""Stiffness, drag and gravity of each chain, so that springs move it as it was simulated.

Differential evolution (Storn and Price 1997), for all chains at once but each independently: the
cost of a chain's values is the distance of its joints from the simulation's, and no chain moves
another one. The random seed is fixed: the same motion gives the same values.
"""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import dataclass

import numpy as np

from ..arrays import Floats
from .spring_bones import (
    STEP_RATE,
    SpringChains,
    SpringValues,
    resampled_to_frames,
    resampled_to_steps,
    simulate_springs,
)

#: Sets of values in the population, and number of rounds.
_POPULATION, _ROUNDS = 20, 30
#: Steps at the beginning of the motion that values are learnt from.
_FITTED_STEPS = 360
#: Weight of the difference of two sets, and probability that a value is taken from the new set.
_DIFFERENTIAL_WEIGHT, _CROSSOVER_PROBABILITY = 0.7, 0.8
#: Minimum and maximum of the searched values: log10 of the stiffness per step, as a fraction of the
#: bone's length, at the root and at the tip; drag at the root and at the tip; square root of the
#: gravity per step, as a fraction of the bone's length, since small values matter most. The minimum
#: of drag makes all swinging end.
_MIN_VALUES = np.array([-2.5, -2.5, 0.01, 0.01, 0.0])
_MAX_VALUES = np.array([0.5, 0.5, 1.0, 1.0, 0.4])


@dataclass(frozen=True, eq=False)
class SpringFit:
    """The values, and the root mean square distance of each chain's joints from the simulation
    [m]."""

    values: SpringValues
    error: Floats


def spring_fit(
    chains: SpringChains,
    targets: Floats,
    carrier: Floats,
    frame_rate: float,
    hit_radius: Floats,
) -> Generator[float, None, SpringFit]:
    """The values that bring joints nearest to targets; yields the fraction that is done.

    Args:
        targets: (frame_count, chains, joints, 3) [m], in the space of the head.
        carrier: (frame_count, 4, 4) of the head.
    """
    count = len(chains.rest)
    frames = max(min(len(carrier), round(_FITTED_STEPS * frame_rate / STEP_RATE)), 2)
    targets, steps = targets[:frames], resampled_to_steps(carrier[:frames], frame_rate)
    random = np.random.default_rng(0)

    def squared_errors(population: Floats) -> Floats:
        """Squared error of sets (k, chains, 5), (k, chains)."""
        own = np.tile(np.arange(count), len(population))
        values = _spring_values(
            chains.select(own), population.reshape(-1, len(_MIN_VALUES)), hit_radius[own]
        )
        places = resampled_to_frames(
            simulate_springs(chains.select(own), values, steps), frames, frame_rate
        )
        places = places.reshape(frames, len(population), count, -1, 3)
        miss = places - targets[:, None]
        error: Floats = (miss * miss).sum(axis=-1).mean(axis=(0, 3))
        return error

    population = _MIN_VALUES + (_MAX_VALUES - _MIN_VALUES) * random.random(
        (_POPULATION, count, len(_MIN_VALUES))
    )
    errors = squared_errors(population)
    for number in range(_ROUNDS):
        yield number / _ROUNDS
        best = np.take_along_axis(population, errors.argmin(axis=0)[None, :, None], axis=0)
        one, other = (population[random.permutation(_POPULATION)] for _ in range(2))
        trial = (
            population
            + _DIFFERENTIAL_WEIGHT * (best - population)
            + _DIFFERENTIAL_WEIGHT * (one - other)
        )
        trial = np.where(
            random.random(population.shape) < _CROSSOVER_PROBABILITY, trial, population
        )
        trial = np.clip(trial, _MIN_VALUES, _MAX_VALUES)
        found = squared_errors(trial)
        better = found < errors
        population, errors = (
            np.where(better[..., None], trial, population),
            np.where(better, found, errors),
        )
    best = np.take_along_axis(population, errors.argmin(axis=0)[None, :, None], axis=0)[0]
    return SpringFit(_spring_values(chains, best, hit_radius), np.sqrt(errors.min(axis=0)))


def _spring_values(chains: SpringChains, sets: Floats, hit_radius: Floats) -> SpringValues:
    """The values of sets (chains, 5), which are as in `_MIN_VALUES`."""
    lengths = chains.lengths
    along = np.linspace(0.0, 1.0, lengths.shape[1])
    log_stiffness = sets[:, 0, None] * (1.0 - along) + sets[:, 1, None] * along
    drag = sets[:, 2, None] * (1.0 - along) + sets[:, 3, None] * along
    stiffness = 10.0**log_stiffness * lengths * STEP_RATE
    gravity = np.square(sets[:, 4, None]) * lengths * STEP_RATE
    return SpringValues(stiffness, drag, gravity, hit_radius)
