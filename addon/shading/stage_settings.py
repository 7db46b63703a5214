"""Settings of the stage for pictures without a scene."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..params import Settings, choice, color, number

VIEWS = (
    ("agx", "AgX", "Blender's default: bright colours fade to white as on film"),
    ("agx_contrast", "AgX, High Contrast", "AgX with deeper shadows"),
    ("filmic", "Filmic", "Blender's default before AgX"),
    ("standard", "Standard", "No tone mapping: values brighter than white are clipped"),
)


def _strength(default: float, label: str, description: str) -> Any:
    return number(
        default,
        label=label,
        description=f"{description}, in W/m² at the hair",
        soft=(0.0, 20.0),
        hard=(0.0, 10_000.0),
    )


def _angle(default: float, label: str, description: str, max_degrees: float) -> Any:
    """A setting from -max_degrees to max_degrees; default too in degrees."""
    span = float(np.radians(-max_degrees)), float(np.radians(max_degrees))
    return number(
        float(np.radians(default)),
        label=label,
        description=description,
        soft=span,
        hard=span,
        unit="angle",
    )


def _side(default: float, label: str, light: str) -> Any:
    return _angle(
        default,
        label,
        f"Horizontal angle from the camera to the {light}, towards the side of the hair that the "
        "camera sees",
        180.0,
    )


def _height(default: float, label: str, light: str) -> Any:
    return _angle(default, label, f"Angle of the {light} above the camera", 90.0)


@dataclass(frozen=True, kw_only=True)
class StageSettings(Settings):
    """Three lights that go with the camera, the light from all sides, the backdrop and the film."""

    section = "stage"
    title = "Stage"
    help_page = "user_guide#show-and-export"
    owner = "job"

    key: float = _strength(3.8, "Key", "Main light")
    key_side: float = _side(62.0, "Key Side", "main light")
    key_height: float = _height(40.0, "Key Height", "main light")
    fill: float = _strength(1.3, "Fill", "Light that fills the shadows of the main light")
    fill_side: float = _side(-30.0, "Fill Side", "fill light")
    fill_height: float = _height(5.0, "Fill Height", "fill light")
    rim: float = _strength(1.4, "Rim", "Light from behind, which shines through the hair")
    rim_side: float = _side(130.0, "Rim Side", "light from behind")
    rim_height: float = _height(22.0, "Rim Height", "light from behind")
    distance: float = number(
        5.0,
        label="Distance",
        description="Distance of the lights, in radii of the subject; nearer lights fall off more",
        soft=(2.0, 20.0),
        hard=(1.5, 1000.0),
    )
    warmth: float = number(
        0.4,
        label="Warmth",
        description="Warmth of the main light and coolness of the other lights; negative values "
        "swap them",
        soft=(-1.0, 1.0),
        hard=(-1.0, 1.0),
    )
    ambient: tuple[float, float, float] = color(
        (0.3, 0.32, 0.35),
        label="Ambient",
        description="Light from all sides",
        maximum=100.0,
    )
    backdrop_center: tuple[float, float, float] = color(
        (0.085, 0.105, 0.135),
        label="Backdrop Centre",
        description="Colour of the backdrop behind the hair",
        maximum=100.0,
    )
    backdrop_edge: tuple[float, float, float] = color(
        (0.009, 0.012, 0.018),
        label="Backdrop Edge",
        description="Colour of the backdrop in the corners of the picture",
        maximum=100.0,
    )
    exposure: float = number(
        0.0,
        label="Exposure",
        description="Brightness of the picture, in stops",
        soft=(-3.0, 3.0),
        hard=(-20.0, 20.0),
    )
    view: str = choice(
        "agx_contrast",
        VIEWS,
        label="View",
        description="View transform of the pictures",
    )
