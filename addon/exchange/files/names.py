"""Names that every program and file system takes."""

from __future__ import annotations

import unicodedata


def plain_name(name: str, fallback: str = "hair") -> str:
    """A name of letters, digits and underscores that starts with no digit; letters of all scripts.

    Slashes, dots and the like, which are paths or namespaces to one program or another, become
    underscores. That makes it an identifier, as USD wants it (UAX #31).
    """
    composed = unicodedata.normalize("NFC", name)
    plain = "".join(sign if f"a{sign}".isidentifier() else "_" for sign in composed)
    if not plain.strip("_"):
        return fallback
    return plain if plain.isidentifier() else f"_{plain}"
