"""What the artist sets about shafts of light."""

from __future__ import annotations

import math
from dataclasses import dataclass

from ..params import Settings, color, integer, number, toggle, when

_NGUYEN = "Nguyen and Donnelly 2005, hair of Nalu"


@dataclass(frozen=True, kw_only=True)
class ShaftSettings(Settings):
    """Light that haze or water scatters around a light, cut into shafts by what stands in it."""

    section = "shafts"
    title = "Light Shafts"
    owner = "groom"

    use_shafts: bool = toggle(
        False,
        label="Light Shafts",
        description="In pictures that Hairloom renders: light in the air or the water around a "
        "light, with shafts behind the hair that it shines through",
        source=_NGUYEN,
    )
    strength: float = number(
        0.4,
        label="Strength",
        description="How bright the haze is, as a fraction of matt white in the same light",
        soft=(0.0, 1.0),
        hard=(0.0, 1000.0),
        source=_NGUYEN,
        active_when=when("shafts.use_shafts"),
    )
    length: float = number(
        math.radians(10.0),
        label="Length",
        description="How far a shaft goes on behind what has cut it, as an angle of the view; "
        "the haze reaches twice as far from the light",
        soft=(0.0, math.radians(45.0)),
        hard=(0.0, math.radians(86.0)),
        unit="angle",
        source=_NGUYEN,
        active_when=when("shafts.use_shafts"),
    )
    samples: int = integer(
        256,
        label="Samples",
        description="Steps on the way out from a light; more show finer strands",
        soft=(32, 512),
        hard=(2, 4096),
        source=_NGUYEN,
        active_when=when("shafts.use_shafts"),
    )
    tint: tuple[float, float, float] = color(
        (1.0, 1.0, 1.0),
        label="Tint",
        description="Colour of the haze, times that of the light",
        active_when=when("shafts.use_shafts"),
    )
