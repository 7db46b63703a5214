"""Settings of shafts of light."""

from __future__ import annotations

import math
from dataclasses import dataclass

from ..params import Settings, both, choice, color, integer, number, toggle, when

_IS_ON = when("shafts.use_shafts", unmet_reason="switched off")
_NGUYEN = "Nguyen and Donnelly 2005, hair of Nalu"
_FROM_LIGHTS = both(_IS_ON, when("shafts.source", "lights", "both", unmet_reason="bright alone"))
_FROM_BRIGHT = both(_IS_ON, when("shafts.source", "bright", "both", unmet_reason="lights alone"))

#: what casts shafts
SOURCES = (
    ("lights", "Lights", "Lamps and suns, from their places in the picture"),
    (
        "bright",
        "Bright Things",
        "Bright parts of the picture: windows, emission, sky and glints, cut by objects in front "
        "of them",
    ),
    ("both", "Both", "Lights and bright things"),
)


@dataclass(frozen=True, kw_only=True)
class ShaftSettings(Settings):
    """Light that haze or water scatters, cut into shafts by what stands in its way."""

    section = "shafts"
    title = "Light Shafts"
    help_page = "light_shafts"
    owner = "groom"
    panel_after = "shadows"
    panel_note = "In renders by Hairloom, and by EEVEE and Cycles with Hairloom Hair."
    header_toggle = "use_shafts"

    use_shafts: bool = toggle(
        False,
        label="Light Shafts",
        description="Render light scattered in air or water around lights and bright things, with "
        "shafts behind the hair",
        source=_NGUYEN,
    )
    source: str = choice(
        "lights",
        SOURCES,
        label="Source",
        description="What casts the shafts",
        source=_NGUYEN,
        active_when=_IS_ON,
    )
    strength: float = number(
        0.4,
        label="Strength",
        description="Brightness of the haze, relative to a matt white surface in the same light",
        soft=(0.0, 1.0),
        hard=(0.0, 1000.0),
        source=_NGUYEN,
        active_when=_FROM_LIGHTS,
    )
    bright_strength: float = number(
        0.15,
        label="Bright Strength",
        description="Brightness of the shafts beside a bright thing, as a fraction of its own",
        soft=(0.0, 1.0),
        hard=(0.0, 1000.0),
        source=_NGUYEN,
        active_when=_FROM_BRIGHT,
    )
    bright_threshold: float = number(
        1.0,
        label="Bright Threshold",
        description="Luminance above which a thing casts shafts; white paper in full light has 1",
        soft=(0.0, 10.0),
        hard=(0.0, 10000.0),
        source=_NGUYEN,
        active_when=_FROM_BRIGHT,
    )
    length: float = number(
        math.radians(10.0),
        label="Length",
        description="Length of a shaft behind its occluder, as an angle of view; haze reaches "
        "twice this far from a light, and this far from a bright thing",
        soft=(0.0, math.radians(45.0)),
        hard=(0.0, math.radians(86.0)),
        unit="angle",
        source=_NGUYEN,
        active_when=_IS_ON,
    )
    samples: int = integer(
        256,
        label="Samples",
        description="Number of steps outwards from a light or bright thing; more steps resolve "
        "finer strands",
        soft=(32, 512),
        hard=(2, 4096),
        source=_NGUYEN,
        active_when=_IS_ON,
    )
    tint: tuple[float, float, float] = color(
        (1.0, 1.0, 1.0),
        label="Tint",
        description="Colour of the haze, multiplied by that of the light or bright thing",
        active_when=_IS_ON,
    )
