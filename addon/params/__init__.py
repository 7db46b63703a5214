"""Parameters, each declared once.

A room's `settings.py` declares a `Settings` subclass. The checked value object (here), the Blender
properties (`blender.properties.properties`), the GLSL struct and its bytes (`params.glsl`), the
preset check (`params.preset`) and the table in the docs (`params.docs`) all derive from that one
declaration.
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
