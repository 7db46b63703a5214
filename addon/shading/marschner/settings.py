"""Settings of a fibre; shading/settings.py holds what both models share."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...params import Settings, either, number, when

_MARSCHNER = "Marschner et al. 2003"
_WIDEST = float(np.radians(60.0))
_HAS_NO_SCATTERING = either(
    when("volume.shadows", "none", unmet_reason="Scattering is on"),
    when("volume.scattering", False),
)


@dataclass(frozen=True, kw_only=True)
class MarschnerSettings(Settings):
    """Parameters of the model Marschner. Angles are in radians."""

    index_of_refraction: float = number(
        1.55,
        label="IOR",
        description="Index of refraction relative to the surrounding medium; 1.17 under water",
        soft=(1.2, 1.8),
        hard=(1.0, 4.0),
        source=_MARSCHNER,
        panel="Fibre",
        shown_when=when("shading.model", "marschner"),
    )
    cuticle_tilt: float = number(
        float(np.radians(3.0)),
        label="Separation",
        description="Tilt of the cuticle scales: shifts the first highlight towards the tips by "
        "this angle, the second towards the roots by twice as much",
        soft=(0.0, float(np.radians(10.0))),
        hard=(-float(np.radians(30.0)), float(np.radians(30.0))),
        unit="angle",
        source=_MARSCHNER,
        panel="Fibre",
        shown_when=when("shading.model", "marschner"),
    )
    eccentricity: float = number(
        1.0,
        label="Eccentricity",
        description="Ratio of the axes of the cross-section; 1 is round",
        soft=(0.8, 1.25),
        hard=(0.5, 2.0),
        source=f"{_MARSCHNER}, section 5.2.3",
        panel="Fibre",
        shown_when=when("shading.model", "marschner"),
    )
    strength_r: float = number(
        1.0,
        label="First Strength",
        description="Factor on light reflected at the surface; 1 is physical",
        soft=(0.0, 2.0),
        hard=(0.0, 100.0),
        source=_MARSCHNER,
        panel="First Highlight",
        shown_when=when("shading.model", "marschner"),
    )
    width_r: float = number(
        float(np.radians(5.0)),
        label="First Width",
        description="Width of the first highlight along the hair: standard deviation of the half "
        "angle",
        soft=(float(np.radians(1.0)), float(np.radians(20.0))),
        hard=(0.0, _WIDEST),
        unit="angle",
        source=_MARSCHNER,
        panel="First Highlight",
        shown_when=when("shading.model", "marschner"),
    )
    offset_r: float = number(
        0.0,
        label="First Offset",
        description="Additional shift of the first highlight towards the tips",
        soft=(-float(np.radians(10.0)), float(np.radians(10.0))),
        hard=(-float(np.radians(45.0)), float(np.radians(45.0))),
        unit="angle",
        panel="First Highlight",
        shown_when=when("shading.model", "marschner"),
    )
    strength_tt: float = number(
        1.0,
        label="Rim Strength",
        description="Factor on transmitted light, visible in backlit hair",
        soft=(0.0, 2.0),
        hard=(0.0, 100.0),
        source=_MARSCHNER,
        panel="Rim Light",
        shown_when=when("shading.model", "marschner"),
    )
    width_tt: float = number(
        float(np.radians(3.0)),
        label="Rim Width",
        description="Width of the transmitted light along the hair: standard deviation of the "
        "half angle",
        soft=(float(np.radians(1.0)), float(np.radians(20.0))),
        hard=(0.0, _WIDEST),
        unit="angle",
        source=_MARSCHNER,
        panel="Rim Light",
        shown_when=when("shading.model", "marschner"),
    )
    offset_tt: float = number(
        0.0,
        label="Rim Offset",
        description="Additional shift of the transmitted light towards the tips",
        soft=(-float(np.radians(10.0)), float(np.radians(10.0))),
        hard=(-float(np.radians(45.0)), float(np.radians(45.0))),
        unit="angle",
        panel="Rim Light",
        shown_when=when("shading.model", "marschner"),
    )
    strength_trt: float = number(
        1.0,
        label="Second Strength",
        description="Factor on light reflected inside the hair; 1 is physical",
        soft=(0.0, 2.0),
        hard=(0.0, 100.0),
        source=_MARSCHNER,
        panel="Second Highlight",
        shown_when=when("shading.model", "marschner"),
    )
    width_trt: float = number(
        float(np.radians(8.0)),
        label="Second Width",
        description="Width of the second highlight along the hair: standard deviation of the half "
        "angle",
        soft=(float(np.radians(1.0)), float(np.radians(20.0))),
        hard=(0.0, _WIDEST),
        unit="angle",
        source=_MARSCHNER,
        panel="Second Highlight",
        shown_when=when("shading.model", "marschner"),
    )
    offset_trt: float = number(
        0.0,
        label="Second Offset",
        description="Additional shift of the second highlight towards the tips",
        soft=(-float(np.radians(10.0)), float(np.radians(10.0))),
        hard=(-float(np.radians(45.0)), float(np.radians(45.0))),
        unit="angle",
        panel="Second Highlight",
        shown_when=when("shading.model", "marschner"),
    )
    glint_strength: float = number(
        1.0,
        label="Glint Strength",
        description="Factor on the glints beside the second highlight; 1 is physical",
        soft=(0.0, 2.0),
        hard=(0.0, 100.0),
        source=f"{_MARSCHNER}, appendix A",
        panel="Second Highlight",
        shown_when=when("shading.model", "marschner"),
    )
    glint_width: float = number(
        float(np.radians(10.0)),
        label="Glint Width",
        description="Azimuthal blur of glints",
        soft=(float(np.radians(2.0)), float(np.radians(25.0))),
        hard=(float(np.radians(0.5)), float(np.radians(90.0))),
        unit="angle",
        source=f"{_MARSCHNER}, appendix A",
        panel="Second Highlight",
        shown_when=when("shading.model", "marschner"),
    )
    azimuthal_width: float = number(
        0.0,
        label="Width Around",
        description="Azimuthal spread of light by a rough surface",
        soft=(0.0, float(np.radians(40.0))),
        hard=(0.0, _WIDEST),
        unit="angle",
        source="d'Eon et al. 2011",
        panel="Fibre",
        shown_when=when("shading.model", "marschner"),
    )
    strength_higher: float = number(
        1.0,
        label="Higher Lobes",
        description="Factor on light reflected inside the hair twice or more; 1 is physical",
        soft=(0.0, 2.0),
        hard=(0.0, 100.0),
        source="d'Eon et al. 2011; Chiang et al. 2016",
        panel="Rim Light",
        shown_when=when("shading.model", "marschner"),
    )
    fake_scattering: float = number(
        0.8,
        label="Fake Scattering",
        description="Amount of approximate scattering between strands, used while Shadows or "
        "Scattering are off",
        soft=(0.0, 2.0),
        hard=(0.0, 100.0),
        shown_when=when("shading.model", "marschner"),
        panel="Light",
        active_when=_HAS_NO_SCATTERING,
    )
    volume_shadow: float = number(
        1.0,
        label="Volume Shadow",
        description="Darkening of the groom's side facing away from lights that cast no shadows",
        soft=(0.0, 1.0),
        hard=(0.0, 1.0),
        unit="factor",
        source="Scheuermann 2004, highlights attenuated by the diffuse bias",
        shown_when=when("shading.model", "marschner"),
        panel="Light",
        active_when=when("volume.shadows", "none", unmet_reason="Shadows are on"),
    )
