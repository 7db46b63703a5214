"""Texts with values in them, in the language of the interface."""

from __future__ import annotations

from bpy.app.translations import pgettext_iface

from ..blender.properties.properties import TRANSLATION_CONTEXT


def translated(text: str, **values: object) -> str:
    """A text in the language of the interface, with values in its braces; to be drawn with
    translate=False. The template of translations holds it if it is a literal here."""
    return pgettext_iface(text, TRANSLATION_CONTEXT).format(**values)
