"""Settings of the shadow of hair on skin."""

from __future__ import annotations

from dataclasses import dataclass

from ...params import Settings, both, integer, number, toggle, when

_GREEN = "Green 2004, GPU Gems, chapter 16: texture-space diffusion"
#: Where hair casts no shadow there is none on skin.
_IS_SOFT = both(
    when("skin.soft_shadow", unmet_reason="switched off"),
    when("volume.shadows", "deep", "slices", unmet_reason="needs Shadows"),
)


@dataclass(frozen=True, kw_only=True)
class SkinSettings(Settings):
    """Soft shadows on the head."""

    section = "skin"
    title = "Soft Shadow on Skin"
    help_page = "skin#soft-shadow-on-skin"
    owner = "groom"
    header_toggle = "soft_shadow"

    soft_shadow: bool = toggle(
        True,
        label="Soft Shadow on Skin",
        description="Diffuse light under the skin of a head with UVs, to soften the edges of the "
        "hair's shadow; needs Shadows",
        source=_GREEN,
    )
    softness: float = number(
        0.008,
        label="Softness",
        description="Distance that light spreads along the skin, as a fraction of the head's size "
        "(the square root of its area)",
        soft=(0.0, 0.04),
        hard=(0.0, 1.0),
        unit="factor",
        source=_GREEN,
        active_when=_IS_SOFT,
    )
    skin_resolution: int = integer(
        512,
        label="Skin Resolution",
        description="Texels along the longer side of the head's UV map",
        soft=(128, 2048),
        hard=(64, 4096),
        active_when=_IS_SOFT,
    )
