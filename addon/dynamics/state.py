"""The state of the simulated guides, kept from one frame to the next.

Everything is a structure of arrays, (3, cv_count, guide_count) float32 in world space: a numpy call
processes one CV, or all CVs, of every guide at once, in contiguous memory. That is 8 to 16 times
faster than an array of points.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..arrays import Floats
from ..errors import HairloomError
from .constraints import PINNED_COUNT
from .groom_rotation import sample_around_mean
from .hair_grid import HairGrid
from .rigid_path import AT_REST, KnownSubstep, LastSubstep
from .style import LocalShape, local_shape


@dataclass(frozen=True)
class Rest:
    """The style as it was when the simulation started; constant.

    position: (3, cv_count, guide_count) float32 world [m].
    length: (cv_count - 1, guide_count) float32 [m] of each segment.
    shape: the local shape that is kept however the guides swing.
    size: the median length of all guides [m], the unit of distances in the settings.
    curl_slack: (cv_count - 1, guide_count) float32, the fraction of its length by which each
        segment can be drawn out until its curls are straight; None if no guide is curled.
    strands: (guide_count,) how many strands each guide stands for; None: equally many.
    """

    position: Floats
    length: Floats
    shape: LocalShape
    size: float = 0.0
    curl_slack: Floats | None = None
    strands: Floats | None = None

    @cached_property
    def hair_grid(self) -> HairGrid:
        """The hair grid at rest, without other grooms."""
        return HairGrid.at_rest(self.position, self.size, self.strands)

    @cached_property
    def sample_points(self) -> Floats:
        """See `groom_rotation.sample_around_mean`."""
        return sample_around_mean(self.position.T)

    def part(self, guides: slice) -> Rest:
        """The rest of these guides, as views."""
        if guides == slice(0, self.position.shape[2]):
            return self  # with its cached properties
        return Rest(
            self.position[:, :, guides],
            self.length[:, guides],
            self.shape.part(guides),
            self.size,
            None if self.curl_slack is None else self.curl_slack[:, guides],
            None if self.strands is None else self.strands[guides],
        )


@dataclass(frozen=True, eq=False)
class StyleRows:
    """A style as passed in, (guide_count, cv_count, 3), and as rows (3, cv_count, guide_count)
    float32, world [m]."""

    grid: Floats
    rows: Floats


@dataclass(frozen=True)
class DynamicsState:
    """Guides in motion.

    position, previous: (3, cv_count, guide_count) float32 world [m], one substep apart.
    rest: the style and the lengths to keep.
    substep: length [s] of the last substep; 0 if there was none.
    time_left: time [s] that has passed but is not yet simulated, shorter than a substep.
    time: [s] simulated since the start; gusts depend on it.
    styles: the last frame's styles, which the next frame need not convert and check again.
    push: (3, cv_count, guide_count) [m], the displacement of each CV by other hair in each substep,
        until it is computed again; None: compute it in the next substep.
    root_places: where the roots as a whole were in the last substep.
    """

    position: Floats
    previous: Floats
    rest: Rest
    substep: float = 0.0
    time_left: float = 0.0
    time: float = 0.0
    styles: tuple[StyleRows, ...] = ()
    push: Floats | None = None
    root_places: LastSubstep | KnownSubstep = AT_REST

    def __post_init__(self) -> None:
        self.position.flags.writeable = False
        self.previous.flags.writeable = False

    @property
    def cv_count(self) -> int:
        return int(self.position.shape[1])

    @property
    def guide_count(self) -> int:
        return int(self.position.shape[2])

    @property
    def grid(self) -> Floats:
        """CVs as (guide_count, cv_count, 3) float32 world [m]."""
        return np.ascontiguousarray(self.position.transpose(2, 1, 0))


def start(
    guide_grid: Floats, curl_slack: Floats | None = None, strands: Floats | None = None
) -> DynamicsState:
    """Guides at rest in their style.

    Args:
        guide_grid: (guide_count, cv_count, 3) world [m], cv_count at least 2.
        curl_slack: (guide_count, cv_count - 1), see `strands.center_lines.curl_slack`; None: no
            curls.
        strands: (guide_count,) how many strands each guide stands for; None: equally many.

    Raises:
        HairloomError: another shape, or a CV that is not finite.
    """
    position = rows_of(guide_grid, "guides")
    if position.shape[1] < PINNED_COUNT:
        raise HairloomError(
            "a guide needs at least two CVs", place="guides", remedy="Raise the CV count"
        )
    segment = np.diff(position, axis=1)
    length = np.sqrt((segment * segment).sum(axis=0))
    rest = Rest(
        position=position,
        length=length,
        shape=local_shape(position),
        size=float(np.median(length.sum(axis=0))) if length.size else 0.0,
        curl_slack=None if curl_slack is None else np.ascontiguousarray(curl_slack.T, np.float32),
        strands=strands,
    )
    for array in (
        rest.length,
        rest.shape.curvature,
        rest.shape.turning_fraction,
        rest.shape.twist_cv,
    ):
        array.flags.writeable = False
    return DynamicsState(position, position, rest)


def rows_of(grid: Floats, place: str) -> Floats:
    """(guide_count, cv_count, 3) points as contiguous rows (3, cv_count, guide_count) float32.

    Raises:
        HairloomError: another shape, or a value that is not finite.
    """
    return as_rows(checked_grid(grid, place))


def as_rows(grid: Floats) -> Floats:
    """`rows_of` without checks: (3, cv_count, guide_count) float32."""
    return np.ascontiguousarray(grid.transpose(2, 1, 0), np.float32)


def checked_grid(grid: Floats, place: str) -> Floats:
    """The grid itself, checked: (guide_count, cv_count, 3).

    Raises:
        HairloomError: another shape, or a value that is not finite.
    """
    if grid.ndim != 3 or grid.shape[2] != 3:
        raise HairloomError(
            f"CVs have shape {grid.shape} instead of (guides, CVs, 3)",
            place=place,
            remedy="Resample the guides to one CV count",
        )
    if not np.isfinite(grid).all():
        raise HairloomError(
            "a CV is not a finite number", place=place, remedy="Check what moves the surface"
        )
    return grid
