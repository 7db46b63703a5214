"""Several grooms as one, each with groups of its own, which engines import as one asset."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from ..strands import StrandSet
from .groom import Groom
from .tfxbone import BoneWeights


def join_grooms(grooms: Sequence[Groom], name: str) -> tuple[Groom, tuple[str, ...]]:
    """All strands as one groom, with groups renumbered and named after their groom.

    Returns:
        The groom, and notes on attributes that are lost because not all grooms have them.
    """
    if len(grooms) == 1:
        return grooms[0], ()
    groups, names = _groups(grooms)
    values: dict[str, Any] = {
        "is_guide": _guides(grooms),
        **_new_ids(grooms),
    }
    strands = [groom.strands for groom in grooms]
    root_uv = _all_or_none([each.root_uv for each in strands])
    starts = np.cumsum([0, *(each.point_count for each in strands[:-1])])
    ends = [each.offsets[1:] + start for each, start in zip(strands, starts, strict=True)]
    joined = StrandSet(
        np.concatenate([each.points for each in strands]),
        np.concatenate([[0], *ends]),
        np.concatenate([each.radius for each in strands]),
        groups,
        root_uv,
        has_widths=all(each.has_widths for each in strands),
        color=_all_or_none([each.color for each in strands]),
    )
    notes = (
        *_loss_note(grooms, lambda groom: groom.strands.root_uv, "root UVs", "a surface with UVs"),
        *_loss_note(grooms, lambda groom: groom.color, "colours", "an attribute color"),
        *_loss_note(grooms, lambda groom: groom.closest_guides, "closest guides", "guides"),
    )
    return Groom(joined, name, group_names=names, **values), notes


def _loss_note(
    grooms: Sequence[Groom], get_value: Callable[[Groom], Any], what: str, remedy: str
) -> tuple[str, ...]:
    """A note where some grooms have this and others do not."""
    missing = [groom.name for groom in grooms if get_value(groom) is None]
    if not 0 < len(missing) < len(grooms):
        return ()
    return (
        f"{', '.join(missing)}: no {what}, so the whole file has none. Give this hair {remedy}, "
        "or write it to a separate file.",
    )


def join_bones(bones: Sequence[BoneWeights]) -> BoneWeights:
    """The bones of all strands, one groom after the other; bones of the same name become one."""
    names = tuple(dict.fromkeys(name for each in bones for name in each.names))
    index_of = {name: place for place, name in enumerate(names)}
    bone_indices = [np.array([index_of[name] for name in each.names])[each.bone] for each in bones]
    weight = np.concatenate([each.weight for each in bones])
    bone = np.where(weight == 0.0, 0, np.concatenate(bone_indices))
    return BoneWeights(names, bone, weight)


def _groups(grooms: Sequence[Groom]) -> tuple[Any, dict[int, str]]:
    """New numbers of groups, one array for all strands, and their names."""
    numbers, names, group_count = [], {}, 0
    for groom in grooms:
        old, place = np.unique(groom.strands.group, return_inverse=True)
        numbers.append(place + group_count)
        for index, group in enumerate(old.tolist()):
            own = groom.group_names.get(group, "" if len(old) == 1 else str(group))
            names[group_count + index] = f"{groom.name} {own}".strip()
        group_count += len(old)
    return np.concatenate(numbers), names


def _new_ids(grooms: Sequence[Groom]) -> dict[str, Any]:
    """New IDs of all strands, and closest guides by these; empty where no groom has IDs."""
    if all(groom.strand_id is None for groom in grooms):
        return {}
    ids, closest, id_count = [], [], 0
    for groom in grooms:
        count = groom.strands.strand_count
        old = np.arange(count) if groom.strand_id is None else groom.strand_id
        known, place = np.unique(old, return_inverse=True)
        ids.append(place + id_count)
        if groom.closest_guides is not None:
            closest.append(np.searchsorted(known, groom.closest_guides) + id_count)
        id_count += count
    if len(closest) < len(grooms):
        return {"strand_id": np.concatenate(ids)}
    weights = _all_or_none([groom.guide_weights for groom in grooms])
    return {
        "strand_id": np.concatenate(ids),
        "closest_guides": np.concatenate(closest),
        "guide_weights": weights,
    }


def _guides(grooms: Sequence[Groom]) -> Any:
    """Which strands are guides, where some grooms mark them; None where none does."""
    if all(groom.is_guide is None for groom in grooms):
        return None
    return np.concatenate(
        [
            np.zeros(g.strands.strand_count, bool) if g.is_guide is None else g.is_guide
            for g in grooms
        ]
    )


def _all_or_none(parts: list[Any]) -> Any:
    return None if any(part is None for part in parts) else np.concatenate(parts)
