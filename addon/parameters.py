"""Every parameter set of Hairloom in one table: for properties, presets, command line and docs.

A set is found by where it is declared: in a module of a pure room named `settings` or
`*_settings`. A new section needs no other registration.
"""

from __future__ import annotations

import pkgutil
from collections.abc import Iterator
from importlib import import_module
from inspect import isclass

from . import cards, dynamics, exchange, groom, refine, shading
from .params import Owner, Settings

#: in the order of the docs
_ROOMS = (groom, dynamics, refine, shading, cards, exchange)


def _declared() -> Iterator[type[Settings]]:
    for room in _ROOMS:
        modules = [each.name for each in pkgutil.walk_packages(room.__path__, f"{room.__name__}.")]
        # of a folder, settings.py comes before others
        for name in sorted(modules, key=lambda name: name.replace(".settings", ".")):
            if name.endswith(("settings", "_settings")):
                module = import_module(name)
                yield from (
                    each
                    for each in vars(module).values()
                    if isclass(each)
                    and issubclass(each, Settings)
                    and each.section
                    and each.__module__ == name
                )


#: section -> its class
ALL_SETTINGS: dict[str, type[Settings]] = {each.section: each for each in _declared()}


def sections_of(owner: Owner) -> tuple[str, ...]:
    """The sections that this owner keeps."""
    return tuple(section for section, kind in ALL_SETTINGS.items() if kind.owner == owner)
