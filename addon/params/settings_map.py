"""Settings of any number of sections as one value: immutable, comparable, typed by their class."""

from __future__ import annotations

from functools import cache
from typing import Any, cast

from .field import Settings


class SettingsMap:
    """At most one value of each `Settings` class; classes that are not in it have their defaults.

    `settings[ShadingSettings]` is a ShadingSettings. Maps are equal if they give equal settings for
    every class.
    """

    __slots__ = ("_values",)

    def __init__(self, *settings: Settings) -> None:
        # defaults are left out, so that equal maps store the same values
        self._values = {type(each): each for each in settings if each != _default(type(each))}  # type: ignore[arg-type]

    def __getitem__[S: Settings](self, kind: type[S]) -> S:
        settings = self._values.get(kind)
        return cast(S, _default(kind) if settings is None else settings)  # type: ignore[arg-type]

    def with_settings(self, *settings: Settings) -> SettingsMap:
        """The same map with these settings replaced."""
        others = (one for kind, one in self._values.items() if kind not in map(type, settings))
        return SettingsMap(*others, *settings)

    def only(self, *kinds: type[Settings]) -> SettingsMap:
        """The map with the settings of these classes only."""
        return SettingsMap(*(self[kind] for kind in kinds))

    def __eq__(self, other: object) -> bool:
        return isinstance(other, SettingsMap) and self._values == other._values

    def __hash__(self) -> int:
        return hash(frozenset(self._values.values()))

    def __repr__(self) -> str:
        return f"SettingsMap({', '.join(map(repr, self._values.values()))})"


@cache
def _default(kind: Any) -> Any:
    """The default settings of a class, cached because some are needed in each frame."""
    return kind()
