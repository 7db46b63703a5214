"""Settings that are painted: each guide has its own numbers where all others share one.

What is painted multiplies a setting. Stiffness may differ along a guide as well; of all else a
guide has one number, the mean along it. A frame in which nothing is painted knows nothing of this.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from ..arrays import Floats
from .forces import Damped
from .settings import DynamicsSettings
from .style import StyleBand, painted_band

#: By what is painted of these, less is seen of the motion.
_SEEN = frozenset({"simulated", "only_selected"})


@dataclass(frozen=True, eq=False)
class PaintedGuides:
    """factors: of each painted setting by its name, (cv_count, guide_count) or (1, guide_count)
    where it is alike along each guide; not negative and finite."""

    factors: Mapping[str, Floats]

    def along(self, settings: DynamicsSettings, name: str) -> Floats:
        """A setting at the CVs of all guides, (cv_count or 1, guide_count)."""
        return settings.painted(name, self.factors.get(name, np.ones((1, 1))))

    def of_guides(self, settings: DynamicsSettings, name: str) -> Floats:
        """A setting of each guide, (guide_count,), or (1,) where it is not painted."""
        return self.along(settings, name).mean(axis=0)

    @property
    def is_of_motion(self) -> bool:
        """Whether any is painted but what is seen of the motion."""
        return bool(self.factors.keys() - _SEEN)

    def all_seen(self) -> PaintedGuides:
        """The same where all of the motion is seen."""
        return PaintedGuides({of: each for of, each in self.factors.items() if of not in _SEEN})

    def fits(self, cv_count: int, guide_count: int) -> bool:
        return all(
            each.shape in ((1, guide_count), (cv_count, guide_count)) and np.isfinite(each).all()
            for each in self.factors.values()
        )


def simulated_of(
    painted: PaintedGuides | None, settings: DynamicsSettings, guide_count: int
) -> Floats | None:
    """How much of each guide is simulated, (guide_count,) float32, see `blend.blended`; None: all
    of all."""
    factors = {} if painted is None else painted.factors
    by_selection = settings.only_selected and "only_selected" in factors
    if settings.simulated == 1.0 and not by_selection and "simulated" not in factors:
        return None
    fraction = np.full(guide_count, settings.simulated, np.float32)
    if painted is not None and "simulated" in factors:
        fraction = painted.of_guides(settings, "simulated").astype(np.float32)
    if by_selection:
        fraction *= factors["only_selected"].mean(axis=0).astype(np.float32)
    return fraction


@dataclass(frozen=True, eq=False)
class PaintedFrame:
    """What guides have of their own in a frame, all float32.

    gravity, volume: (guide_count,) by which what all others have is multiplied.
    damped: of each guide.
    matrix: see `style.StyleBand`.
    """

    gravity: Floats
    volume: Floats
    damped: Damped
    matrix: StyleBand

    def part(self, guides: slice) -> PaintedFrame:
        damped = self.damped
        return PaintedFrame(
            self.gravity[guides],
            self.volume[guides],
            Damped(damped.kept[guides], damped.carried[guides], damped.air[guides]),
            self.matrix.part(guides),
        )


@lru_cache(maxsize=4)
def painted_frame(
    painted: PaintedGuides, settings: DynamicsSettings, cv_count: int, guide_count: int, dt: float
) -> PaintedFrame:
    """Of all guides of a groom."""

    def rows(values: Floats | float) -> Floats:
        return np.broadcast_to(np.asarray(values, np.float32), guide_count)

    def times(name: str) -> Floats:
        whole = getattr(settings, name)
        return rows(painted.of_guides(settings, name) / whole if whole else 1.0)

    rates = (painted.of_guides(settings, name) for name in ("style_damping", "damping"))
    damped = Damped.of(settings, dt, *rates)
    root, tip, bend = (
        painted.along(settings, name) for name in ("style_root", "style_tip", "bend")
    )
    return PaintedFrame(
        times("gravity"),
        times("volume"),
        Damped(rows(damped.kept), rows(damped.carried), rows(damped.air)),
        painted_band(settings, root, tip, bend, cv_count, dt),
    )
