"""The parameters of moving air, or water, which hair and fins share."""

from __future__ import annotations

import math
from dataclasses import dataclass

from ..params import Settings, integer, number

#: keyframes may turn the wind round and round: sixteen turns [rad]
_MOST_TURNED = math.radians(16.0 * 360.0)


@dataclass(frozen=True, kw_only=True)
class WindSettings(Settings):
    """A mean velocity and gusts; a base of settings, not a section of its own."""

    wind_speed: float = number(
        0.0,
        label="Wind",
        description="Speed of the air, or of the current under water; the scene's wind force "
        "fields add to it",
        soft=(0.0, 20.0),
        hard=(0.0, 200.0),
        unit="speed",
    )
    wind_direction: float = number(
        0.0,
        label="Wind Direction",
        description="Where the wind blows to: 0 is world +X, a quarter turn +Y",
        soft=(-math.pi, math.pi),
        hard=(-_MOST_TURNED, _MOST_TURNED),
        unit="angle",
    )
    wind_rise: float = number(
        0.0,
        label="Wind Rise",
        description="How steeply the wind blows upwards",
        soft=(-0.5 * math.pi, 0.5 * math.pi),
        hard=(-_MOST_TURNED, _MOST_TURNED),
        unit="angle",
    )
    gusts: float = number(
        0.5,
        label="Gusts",
        description="How strongly the wind swells and turns, as a share of its speed",
        soft=(0.0, 2.0),
        hard=(0.0, 10.0),
        source="Random Fourier modes, Kraichnan 1970",
    )
    gust_size: float = number(
        0.5,
        label="Gust Size",
        description="Length of a gust from one swell to the next",
        soft=(0.05, 5.0),
        hard=(0.01, 1000.0),
        unit="length",
    )
    gust_seed: int = integer(
        1,
        label="Gust Seed",
        description="Another seed gives other gusts of the same kind",
        soft=(0, 100),
        hard=(0, 2**31 - 1),
    )
