"""Parameters, each declared once.

A room's `settings.py` declares a `Settings` subclass. From that one declaration come the
checked value object (here), the Blender property (`blender.properties.properties`), the GLSL struct
and its bytes (`params.glsl`), the preset check (`params.preset`) and the row in the docs
(`params.docs`).
"""

from .field import (
    Owner,
    Parameter,
    Settings,
    both,
    choice,
    color,
    color_map,
    curve,
    either,
    integer,
    number,
    toggle,
    when,
)
from .settings_map import SettingsMap

__all__ = [
    "Owner",
    "Parameter",
    "Settings",
    "SettingsMap",
    "both",
    "choice",
    "color",
    "color_map",
    "curve",
    "either",
    "integer",
    "number",
    "toggle",
    "when",
]
