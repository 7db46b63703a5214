"""Painted settings: each guide has individual values instead of the groom's.

Painted factors multiply a setting. Stiffness may also vary along a guide; other settings use the
mean along it. A frame in which nothing is painted does without this module.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from ..arrays import Floats
from .forces import DampingFactors
from .settings import DynamicsSettings
from .style import StyleSystem, painted_style_system

#: Factors of these only blend the visible motion; they do not affect the simulation.
_DISPLAY_ONLY = frozenset({"influence", "only_selected"})


@dataclass(frozen=True, eq=False)
class PaintedGuides:
    """Factors of painted settings.

    factors: by the setting's name, (cv_count, guide_count), or (1, guide_count) if constant along
        each guide; finite and not negative.
    """

    factors: Mapping[str, Floats]

    def at_cvs(self, settings: DynamicsSettings, name: str) -> Floats:
        """A setting at the CVs of all guides, (cv_count or 1, guide_count)."""
        return settings.painted(name, self.factors.get(name, np.ones((1, 1))))

    def per_guide(self, settings: DynamicsSettings, name: str) -> Floats:
        """A setting of each guide, (guide_count,), or (1,) if it is not painted."""
        return self.at_cvs(settings, name).mean(axis=0)

    @property
    def affects_motion(self) -> bool:
        """Whether anything is painted that affects the simulation."""
        return bool(self.factors.keys() - _DISPLAY_ONLY)

    def without_display_factors(self) -> PaintedGuides:
        """The same without the factors that blend the visible motion."""
        return PaintedGuides(
            {of: each for of, each in self.factors.items() if of not in _DISPLAY_ONLY}
        )

    def has_shape(self, cv_count: int, guide_count: int) -> bool:
        return all(
            each.shape in ((1, guide_count), (cv_count, guide_count)) and np.isfinite(each).all()
            for each in self.factors.values()
        )


def simulated_fraction(
    painted: PaintedGuides | None, settings: DynamicsSettings, guide_count: int
) -> Floats | None:
    """The simulated fraction of each guide's visible motion, (guide_count,) float32, see
    `blend.blended`; None: all of it for all guides."""
    factors = {} if painted is None else painted.factors
    by_selection = settings.only_selected and "only_selected" in factors
    if settings.influence == 1.0 and not by_selection and "influence" not in factors:
        return None
    fraction = np.full(guide_count, settings.influence, np.float32)
    if painted is not None and "influence" in factors:
        fraction = painted.per_guide(settings, "influence").astype(np.float32)
    if by_selection:
        fraction *= factors["only_selected"].mean(axis=0).astype(np.float32)
    return fraction


@dataclass(frozen=True, eq=False)
class PaintedFrame:
    """Individual values of guides in a frame, all float32.

    gravity, volume: (guide_count,), factors of the groom's.
    damping_factors: with values for each guide.
    style_system: see `style.StyleSystem`.
    """

    gravity: Floats
    volume: Floats
    damping_factors: DampingFactors
    style_system: StyleSystem

    def part(self, guides: slice) -> PaintedFrame:
        damped = self.damping_factors
        return PaintedFrame(
            self.gravity[guides],
            self.volume[guides],
            DampingFactors(damped.velocity[guides], damped.style[guides], damped.air[guides]),
            self.style_system.part(guides),
        )


@lru_cache(maxsize=4)
def painted_frame(
    painted: PaintedGuides, settings: DynamicsSettings, cv_count: int, guide_count: int, dt: float
) -> PaintedFrame:
    """The individual values of all guides of a groom."""

    def rows(value: Floats | float) -> Floats:
        return np.broadcast_to(np.asarray(value, np.float32), guide_count)

    def factor_of(name: str) -> Floats:
        setting = getattr(settings, name)
        return rows(painted.per_guide(settings, name) / setting if setting else 1.0)

    rates = (painted.per_guide(settings, name) for name in ("style_damping", "damping"))
    damping_factors = DampingFactors.of(settings, dt, *rates)
    root, tip, bend = (
        painted.at_cvs(settings, name) for name in ("style_root", "style_tip", "bend")
    )
    return PaintedFrame(
        factor_of("gravity"),
        factor_of("volume"),
        DampingFactors(
            rows(damping_factors.velocity), rows(damping_factors.style), rows(damping_factors.air)
        ),
        painted_style_system(settings, root, tip, bend, cv_count, dt),
    )
