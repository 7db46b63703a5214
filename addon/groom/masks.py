"""Painted masks: by what a setting of children is multiplied, wherever they grow."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from ..arrays import Floats, Ints
from ..strands import Surface
from .children_settings import ChildrenSettings

#: parameter that may be painted -> the one that names its mask
MASKS = {each.of: each.name for each in ChildrenSettings.parameters() if each.kind == "mask"}
#: parameter -> its label
LABELS = {each.name: each.label for each in ChildrenSettings.parameters()}


@dataclass(frozen=True, eq=False)
class Masks:
    """weights: of each painted parameter by its name, (vertex_count,), not negative and finite."""

    weights: Mapping[str, Floats] = field(default_factory=dict)

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Masks) or self.weights.keys() != other.weights.keys():
            return False
        return all(np.array_equal(each, other.weights[name]) for name, each in self.weights.items())

    def at(self, surface: Surface, triangle: Ints, barycentric: Floats) -> Factors:
        """Of children that grow there, (n,)."""
        factors = {}
        for name in MASKS:
            weights = self.weights.get(name)
            if weights is None:
                factors[name] = np.ones(len(triangle))
                continue
            a, b, c = weights[surface.triangles[triangle]].astype(np.float64).T
            # so that it is exactly the same where it is painted evenly
            factors[name] = a + barycentric[:, 1] * (b - a) + barycentric[:, 2] * (c - a)
        return Factors(factors)


NO_MASKS = Masks()


def mask_names(settings: ChildrenSettings) -> dict[str, str]:
    """Of each parameter that has a mask, the name of that; children that are as many as the body
    needs have none."""
    if settings.method not in ("multi", "single"):
        return {}
    named = {of: str(getattr(settings, name)) for of, name in MASKS.items()}
    return {of: name for of, name in named.items() if name}


@dataclass(frozen=True, eq=False)
class Factors:
    """by_name: of each parameter that may be painted, (child_count,)."""

    by_name: Mapping[str, Floats]

    def __getitem__(self, name: str) -> Floats:
        return self.by_name[name]

    @property
    def rows(self) -> tuple[Floats, ...]:
        return tuple(self.by_name.values())

    def take(self, chosen: Ints) -> Factors:
        return Factors({name: each[chosen] for name, each in self.by_name.items()})

    def and_also(self, more: Factors) -> Factors:
        return Factors(
            {name: np.concatenate([each, more[name]]) for name, each in self.by_name.items()}
        )

    def with_others(self, chosen: Ints, others: Factors) -> Factors:
        """With those of some children (n,) others."""
        found = {}
        for name, each in self.by_name.items():
            found[name] = each.copy()
            found[name][chosen] = others[name]
        return Factors(found)
