"""The parameters that hair and cloth share: the medium, wind, and contacts."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from ..params import Settings, integer, number

#: keyframes may turn the wind by several turns: sixteen at most [rad]
_MAX_TURNED = math.radians(16.0 * 360.0)


def air_damping(*, is_painted: bool) -> Any:
    """Declare the air damping; it may be painted for hair, not for cloth."""
    return number(
        0.5,
        label="Air Damping",
        description="Rate at which hair takes on the speed of the air or water around it",
        soft=(0.0, 10.0),
        hard=(0.0, 1000.0),
        unit="rate",
        source="Jakobsen 2001",
        panel="Medium & Wind",
        is_painted=is_painted,
    )


@dataclass(frozen=True, kw_only=True)
class MotionSettings(Settings):
    """The settings that hair and cloth share; a base class, not a section of its own."""

    buoyancy: float = number(
        0.0,
        label="Buoyancy",
        description="Fraction of the weight that the surrounding medium carries: 0 in air, 1 "
        "floats",
        soft=(0.0, 1.0),
        hard=(0.0, 2.0),
        source="Archimedes",
        panel="Medium & Wind",
    )
    damping: float = air_damping(is_painted=False)
    drag: float = number(
        0.0,
        label="Drag",
        description="Quadratic drag through air or water, per metre travelled; typically a few in "
        "water",
        soft=(0.0, 10.0),
        hard=(0.0, 1000.0),
        source="Rayleigh's drag equation",
        panel="Medium & Wind",
    )
    wind_speed: float = number(
        0.0,
        label="Wind Speed",
        description="Speed of the wind, or of the current under water; the same everywhere",
        soft=(0.0, 20.0),
        hard=(0.0, 200.0),
        unit="speed",
        panel="Medium & Wind",
    )
    wind_direction: float = number(
        0.0,
        label="Wind Direction",
        description="Direction in which the wind blows: 0 is world +X, 90 degrees is +Y",
        soft=(-math.pi, math.pi),
        hard=(-_MAX_TURNED, _MAX_TURNED),
        unit="angle",
        panel="Medium & Wind",
    )
    wind_elevation: float = number(
        0.0,
        label="Wind Elevation",
        description="Angle by which the wind blows upwards",
        soft=(-0.5 * math.pi, 0.5 * math.pi),
        hard=(-_MAX_TURNED, _MAX_TURNED),
        unit="angle",
        panel="Medium & Wind",
    )
    gusts: float = number(
        0.5,
        label="Gusts",
        description="Strength of gusts, as a fraction of the wind speed",
        soft=(0.0, 2.0),
        hard=(0.0, 10.0),
        source="Random Fourier modes, Kraichnan 1970",
        panel="Medium & Wind",
    )
    gust_size: float = number(
        0.5,
        label="Gust Size",
        description="Distance from one gust to the next",
        soft=(0.05, 5.0),
        hard=(0.01, 1000.0),
        unit="length",
        panel="Medium & Wind",
    )
    gust_seed: int = integer(
        1,
        label="Gust Seed",
        description="Random seed of the gusts",
        soft=(0, 100),
        hard=(0, 2**31 - 1),
        panel="Medium & Wind",
    )
    force_fields: float = number(
        1.0,
        label="Force Fields",
        description="Factor on the scene's force fields, each acting where it is placed; 0 "
        "ignores them",
        soft=(0.0, 1.0),
        hard=(0.0, 10.0),
        panel="Medium & Wind",
    )
    friction: float = number(
        0.3,
        label="Friction",
        description="Coefficient of friction with colliders",
        soft=(0.0, 1.0),
        hard=(0.0, 10.0),
        source="Coulomb; position-based as in Macklin et al. 2014",
        panel="Collisions",
    )
    depenetration_speed: float = number(
        2.0,
        label="Exit Speed",
        description="Speed at which points that start inside a collider are pushed out, in "
        "lengths of the hair per second; for cloth, in quarters of its extent per second",
        soft=(0.2, 20.0),
        hard=(0.001, 1000.0),
        unit="rate",
        panel="Collisions",
    )
    collider_resolution: int = integer(
        56,
        label="Grid Resolution",
        description="Cells along the longest side of a mesh collider's distance field",
        soft=(24, 96),
        hard=(8, 192),
        panel="Collisions",
    )
