"""TressFX .tfxbone: the bones that carry a .tfx groom, four weights a strand; little-endian.

i32 bone count; for each bone {i32 index, i32 length with the NUL, chars}; i32 strand count; for
each strand {i32 index, 4 x (i32 bone, f32 weight)}. This is what TressFX's loader reads; the header
struct in its TressFXFileFormat.h is not. The loader uses the order of strands, not their index,
reads bone -1 as none, and gives strands beyond the last one the weights of the last one.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from ..arrays import Floats, Ints
from ..errors import HairloomError
from ..strands import StrandSet
from .files.binary_file import write_blocks

#: Bones of one strand.
INFLUENCES = 4
#: A sum of weights this near to 1 counts as 1.
_ROUNDING = 1.0e-6

_STRAND = np.dtype(
    [("index", "<i4"), ("influence", [("bone", "<i4"), ("weight", "<f4")], (INFLUENCES,))]
)


@dataclass(frozen=True)
class BoneWeights:
    """Which bones carry each strand, checked when made.

    names: of the bones.
    bone: (strand_count, 4) int32, indices into `names`, 0 where the weight is 0.
    weight: (strand_count, 4) float32, not negative, their sum is 1.
    loose_count: how many strands no bone carried; they follow the first one.

    Raises:
        HairloomError: shapes that do not fit, an index of no bone, a sum that is not 1.
    """

    names: tuple[str, ...]
    bone: Ints
    weight: Floats
    loose_count: int = 0

    def __post_init__(self) -> None:
        object.__setattr__(self, "bone", np.ascontiguousarray(self.bone, np.int32))
        object.__setattr__(self, "weight", np.ascontiguousarray(self.weight, np.float32))
        if self.bone.shape != (len(self.bone), INFLUENCES) or self.weight.shape != self.bone.shape:
            raise _broken(f"bones of shape {self.bone.shape}, weights of {self.weight.shape}")
        if ((self.bone < 0) | (self.bone >= max(len(self.names), 1))).any():
            raise _broken(f"a bone index beyond the {len(self.names)} bones")
        if not (np.abs(self.weight.sum(axis=1, dtype=np.float64) - 1.0) < 1.0e-3).all():
            raise _broken("weights whose sum is not 1")

    @property
    def strand_count(self) -> int:
        return len(self.bone)

    def take(self, strands: Ints) -> BoneWeights:
        """The bones of the strands with these indices, in this order."""
        return BoneWeights(self.names, self.bone[strands], self.weight[strands])


def strongest_bones(names: tuple[str, ...], weights: Floats) -> BoneWeights:
    """The four strongest bones of each strand.

    Args:
        weights: (strand_count, bone_count), of any sum; where it is 0 the first bone carries.
    """
    count = min(INFLUENCES, weights.shape[1])
    bone = np.zeros((len(weights), INFLUENCES), np.int32)
    bone[:, :count] = np.argsort(-weights, axis=1, kind="stable")[:, :count]
    strongest = np.zeros(bone.shape, np.float32)
    strongest[:, :count] = np.take_along_axis(weights, bone[:, :count], axis=1)
    carried, strongest = _renormalised(bone, strongest)
    return BoneWeights(names, carried, strongest)


def bones_at_roots(
    strands: StrandSet, triangles: Ints, names: tuple[str, ...], vertex_weights: Floats
) -> BoneWeights:
    """The bones of strands whose roots lie on a skinned head, as its skin moves there.

    Args:
        strands: bound to the head.
        triangles: (triangle_count, 3) vertices of the head.
        vertex_weights: (vertex_count, bone_count).

    Raises:
        HairloomError: the strands are not bound.
    """
    if strands.root_triangle is None or strands.root_barycentric is None:
        raise HairloomError(
            "the strands are not bound to the head",
            place="bone weights",
            remedy="Attach the hair to its head",
        )
    corners = vertex_weights[triangles[strands.root_triangle]]
    weights = np.einsum("sc,scb->sb", strands.root_barycentric, corners)
    loose = int((weights.sum(axis=1) <= 0.0).sum())
    return replace(strongest_bones(names, weights), loose_count=loose)


def write_tfxbone(path: Path, weights: BoneWeights, strand_count: int | None = None) -> None:
    """Write the bones of a groom.

    Args:
        strand_count: of the .tfx file, if it was filled up to a multiple of 64: the last strand's
            weights are repeated.

    Raises:
        HairloomError: no strands or bones, or nothing can be written there.
    """
    if not weights.strand_count or not weights.names:
        raise HairloomError(
            "there are no bones to write", place=str(path), remedy="Choose hair on a skinned head"
        )
    count = max(strand_count or 0, weights.strand_count)
    strand = np.minimum(np.arange(count), weights.strand_count - 1)
    table = np.zeros(count, _STRAND)
    table["index"] = np.arange(count)
    table["influence"]["bone"] = weights.bone[strand]
    table["influence"]["weight"] = weights.weight[strand]
    bones = struct.pack("<i", len(weights.names))
    for index, name in enumerate(weights.names):
        text = name.encode("utf-8") + b"\0"
        bones += struct.pack("<2i", index, len(text)) + text
    write_blocks(path, [bones + struct.pack("<i", count), table])


def _renormalised(bone: Ints, weight: Floats) -> tuple[Ints, Floats]:
    """Weights with a sum of 1; the first bone carries where there are none."""
    wide = np.where(np.isfinite(weight) & (weight > 0.0), weight, 0.0).astype(np.float64)
    without = wide.sum(axis=1) == 0.0
    wide[without, 0], bone = 1.0, np.where(without[:, None], 0, bone)
    total = wide.sum(axis=1, keepdims=True)
    weight = (wide / np.where(np.abs(total - 1.0) > _ROUNDING, total, 1.0)).astype(np.float32)
    return np.where(weight == 0.0, 0, bone), weight


def _broken(problem: str) -> HairloomError:
    return HairloomError(problem, place="bone weights", remedy="Read or make them again")
