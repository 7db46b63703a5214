"""An artist's own cards, sorted in one call."""

from typing import Any

from hairloom.addon.blender.cards.adopt import SortedCards, SortOptions, sort_steps
from hairloom.addon.cards.steps import result_of


def sort_mesh(obj: Any, depsgraph: Any, options: SortOptions) -> SortedCards:
    """All steps of `sort_steps` at once."""
    return result_of(sort_steps(obj, depsgraph, options))
