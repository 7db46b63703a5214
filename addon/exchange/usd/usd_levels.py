"""Levels of detail in a USD file of cards as variants: all lie in one place, and one is shown."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from types import ModuleType

from ..files.atomic import write_error, write_failure_reason
from .usd_library import usd_library
from .usd_reader import error_summary

#: the name of the set, and of each variant
VARIANT_SET, _VARIANT = "LOD", "LOD{}"


def add_level_variants(path: Path, nodes: Sequence[str]) -> None:
    """Make the levels variants of their parent prim, with the finest selected.

    Args:
        nodes: the levels' names, the finest first, which are siblings.

    Raises:
        HairloomError: this Python has no OpenUSD, or the file cannot be written.
    """
    pxr = usd_library(path)
    try:
        _make_variants(pxr, path, nodes)
    except pxr.Tf.ErrorException as error:
        raise write_error(path, write_failure_reason(path, error_summary(error))) from error


def _make_variants(pxr: ModuleType, path: Path, nodes: Sequence[str]) -> None:
    stage = pxr.Usd.Stage.Open(str(path))
    levels = [prim for prim in stage.Traverse() if prim.GetName() in nodes and prim.IsA("Xform")]
    levels.sort(key=lambda prim: nodes.index(prim.GetName()))
    holder = levels[0].GetParent()
    variants = holder.GetVariantSets().AddVariantSet(VARIANT_SET)
    for number, shown in enumerate(levels):
        name = _VARIANT.format(number)
        variants.AddVariant(name)
        variants.SetVariantSelection(name)
        with variants.GetVariantEditContext():
            for level in levels:
                level.SetActive(level == shown)
    variants.SetVariantSelection(_VARIANT.format(0))
    stage.Save()
