"""What the artist sets about shafts of light."""

from __future__ import annotations

import math
from dataclasses import dataclass

from ..params import Settings, color, integer, number, toggle, when

_IS_ON = when("shafts.use_shafts", lack="switched off")
_NGUYEN = "Nguyen and Donnelly 2005, hair of Nalu"


@dataclass(frozen=True, kw_only=True)
class ShaftSettings(Settings):
    """Light that haze or water scatters around a light, cut into shafts by what stands in it."""

    section = "shafts"
    title = "Light Shafts"
    owner = "groom"
    panel_after = "shadows"
    header_toggle = "use_shafts"

    use_shafts: bool = toggle(
        False,
        label="Light Shafts",
        description="In renders: light scattered in air or water around a light, with shafts "
        "behind the hair",
        source=_NGUYEN,
    )
    strength: float = number(
        0.4,
        label="Strength",
        description="Brightness of the haze, relative to a matt white surface in the same light",
        soft=(0.0, 1.0),
        hard=(0.0, 1000.0),
        source=_NGUYEN,
        active_when=_IS_ON,
    )
    length: float = number(
        math.radians(10.0),
        label="Length",
        description="Length of a shaft behind its occluder, as an angle of view; the haze reaches "
        "twice as far from the light",
        soft=(0.0, math.radians(45.0)),
        hard=(0.0, math.radians(86.0)),
        unit="angle",
        source=_NGUYEN,
        active_when=_IS_ON,
    )
    samples: int = integer(
        256,
        label="Samples",
        description="Number of steps outwards from a light; more resolve finer strands",
        soft=(32, 512),
        hard=(2, 4096),
        source=_NGUYEN,
        active_when=_IS_ON,
    )
    tint: tuple[float, float, float] = color(
        (1.0, 1.0, 1.0),
        label="Tint",
        description="Colour of the haze, multiplied by that of the light",
        active_when=_IS_ON,
    )
