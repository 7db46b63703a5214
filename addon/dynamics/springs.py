"""Stretching curls: the centre line of a curled guide is a chain of springs along itself.

Each segment j may be drawn out or compressed by an extension e = |s_j| - l_j, against a tension,
for CVs of mass 1, of

    T(e) = kappa e / (1 - (e / E)^2) + T_0     E the maximum extension, T_0 the tension at rest

which is an ideal spring at first and stiffens as the curl is drawn straight. kappa is chosen such
that a guide curled along its whole length bobs at the frequency of the settings, so that motion
does not depend on the substep, the CV count or the size. T_0 is the tension of the weight that the
style carries: a groom at rest is as long as it was combed.

A step is backward Euler, linearised at the extension before it: the Newton step of `constraints`
with a compliance on the diagonal (XPBD, Macklin, Mueller and Chentanez 2016). The rest of the
substep keeps the resulting lengths. So segments without curls stay rigid, and style, contacts and
reach need not handle springs.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ..arrays import Floats, Ints
from ..strands.vectors import dot_rows
from .constraints import PINNED_COUNT, TINY, segments, spring_step
from .forces import style_tension
from .settings import DynamicsSettings

#: E at Curl Stretch 1, as a fraction of the extension at which the curl is straight.
MAX_STRETCH = 0.8
#: A spring is linearised at |e| / E up to this.
MAX_LINEARISED = np.float32(0.9)


def stiffness(settings: DynamicsSettings, cv_count: int) -> float:
    """kappa [1/s^2] of each segment of a guide with `cv_count` CVs.

    The first mode of n equal masses on n springs, one end held: omega = 2 sqrt(kappa)
    sin(pi / (4 n + 2)).
    """
    free = max(cv_count - PINNED_COUNT, 1)
    return (math.pi * settings.curl_bounce / math.sin(math.pi / (4 * free + 2))) ** 2


def max_extension_fraction(settings: DynamicsSettings) -> float:
    """E as a fraction of a curl's room."""
    return MAX_STRETCH * settings.curl_stretch


@dataclass(frozen=True)
class Springs:
    """The curled guides of a block in a frame; rows (cv_count - 2, n), one for each segment beyond
    the pinned ones.

    guides: (n,) their indices in the block, ascending.
    length: [m] at rest.
    max_extension: E [m], 0 where a segment cannot stretch.
    load: T_0 / kappa [m].
    compliance: 1 / (kappa dt^2).
    held: see `held.HeldCvs.rows`, of these guides; None if no guide of the block is held.
    """

    guides: Ints
    length: Floats
    max_extension: Floats
    load: Floats
    compliance: float
    held: Floats | None

    @classmethod
    def of(
        cls,
        curl_slack: Floats | None,
        length: Floats,
        style: Floats,
        compensated: Floats,
        held: Floats | None,
        settings: DynamicsSettings,
        dt: float,
    ) -> Springs | None:
        """The springs of a block; None if no guide can stretch.

        Args:
            curl_slack, length: (cv_count - 1, guide_count), see `state.Rest`.
            style: (3, cv_count, guide_count) world [m].
            compensated: (3,) [m/s^2], the gravity that the style carries.
            held: (cv_count, guide_count), see `held.HeldCvs.rows`; None if no CV is held.
        """
        if curl_slack is None or not settings.curl_stretch or style.shape[1] <= PINNED_COUNT:
            return None
        guides = curl_slack[PINNED_COUNT - 1 :].any(axis=0).nonzero()[0]
        if not guides.size:
            return None
        kappa = stiffness(settings, style.shape[1])
        at_rest = length[PINNED_COUNT - 1 :, guides]
        max_extension = (
            curl_slack[PINNED_COUNT - 1 :, guides]
            * at_rest
            * np.float32(max_extension_fraction(settings))
        )
        segment, tension = style_tension(compensated, style[:, :, guides])
        load = tension * np.sqrt(dot_rows(segment, segment)) / np.float32(kappa)
        own = None if held is None else held[:, guides]
        return cls(guides, at_rest, max_extension, load, 1.0 / (kappa * dt * dt), own)

    def step(self, position: Floats, previous: Floats, length: Floats) -> Floats:
        """Move curled guides by the pull of their springs in a substep, in place.

        Args:
            position, previous: (3, cv_count, guide_count) world [m], now and a substep earlier.
            length: (cv_count - 1, guide_count) [m], of all segments at rest.

        Returns:
            The lengths of all segments for the rest of the substep, in the shape of `length`.
        """
        some = position.take(self.guides, axis=2)
        _, squared = segments(previous[:, PINNED_COUNT - 1 :].take(self.guides, axis=2))
        limit = MAX_LINEARISED * self.max_extension
        extension = np.clip(np.sqrt(squared) - self.length, -limit, limit)
        squared_ratio = extension / np.maximum(self.max_extension, TINY)
        squared_ratio *= squared_ratio
        relative_compliance = np.square(1.0 - squared_ratio) / (1.0 + squared_ratio)
        relative_compliance *= self.max_extension > 0.0
        target = (
            self.length
            + extension
            - relative_compliance * (extension / (1.0 - squared_ratio) + self.load)
        )
        spring_step(some, target, relative_compliance * np.float32(self.compliance), self.held)
        position[:, :, self.guides] = some
        _, squared = segments(some[:, PINNED_COUNT - 1 :])
        lengths = length.copy()
        longest, shortest = length_limits(self.length, self.max_extension)
        lengths[PINNED_COUNT - 1 :, self.guides] = np.clip(np.sqrt(squared), shortest, longest)
        return lengths


def length_limits(length: Floats, max_extension: Floats) -> tuple[Floats, Floats]:
    """The longest and shortest lengths of segments [m], by the same factor."""
    longest = length + max_extension
    return longest, length * (length / np.maximum(longest, TINY))
