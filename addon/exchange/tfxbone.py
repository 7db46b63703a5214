"""TressFX .tfxbone: the bones that carry a .tfx groom, four weights a strand; little-endian.

i32 bone count; of each bone {i32 index, i32 length with the NUL, chars}; i32 strand count; of each
strand {i32 index, 4 x (i32 bone, f32 weight)}. This is what TressFX's loader reads; the header
struct in its TressFXFileFormat.h is not. The loader goes by the order of the strands, not by their
index, takes bone -1 for none, and gives strands beyond the last one the weights of the last one.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..arrays import Floats, Ints
from ..errors import HairloomError
from ..strands import StrandSet
from .files.binary_file import BinaryFile, write_blocks

#: Bones of one strand.
INFLUENCES = 4
#: More bones than any skeleton: a larger count is a damaged one.
MOST_BONES = 65_536
#: A sum of weights so near to 1 is 1, so that what was read is written as it was.
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

    Raises:
        HairloomError: shapes that do not fit, an index that is no bone's, no sum of 1.
    """

    names: tuple[str, ...]
    bone: Ints
    weight: Floats

    def __post_init__(self) -> None:
        object.__setattr__(self, "bone", np.ascontiguousarray(self.bone, np.int32))
        object.__setattr__(self, "weight", np.ascontiguousarray(self.weight, np.float32))
        if self.bone.shape != (len(self.bone), INFLUENCES) or self.weight.shape != self.bone.shape:
            raise _broken(f"bones of shape {self.bone.shape}, weights of {self.weight.shape}")
        if ((self.bone < 0) | (self.bone >= max(len(self.names), 1))).any():
            raise _broken(f"a bone beyond the {len(self.names)} that there are")
        if not (np.abs(self.weight.sum(axis=1, dtype=np.float64) - 1.0) < 1.0e-3).all():
            raise _broken("weights whose sum is not 1")

    @property
    def strand_count(self) -> int:
        return len(self.bone)

    def take(self, strands: Ints) -> BoneWeights:
        """Those of the strands with these indices, in this order."""
        return BoneWeights(self.names, self.bone[strands], self.weight[strands])


@dataclass(frozen=True)
class ReadBones:
    """weights: of the file's strands; notes: what was mended."""

    weights: BoneWeights
    notes: tuple[str, ...]


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
    carried, strongest, _ = _renormalised(bone, strongest)
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
    return strongest_bones(names, weights)


def read_tfxbone(path: Path) -> ReadBones:
    """Read the bones of a groom; weights are renormalised.

    Raises:
        HairloomError: the file cannot be read, is no .tfxbone file, is cut short, or a strand
            names a bone that is not there.
    """
    file = BinaryFile(path)
    content = file.content()
    indices, names, end = _bones(file, content)
    file.check("strand count", end, 4)
    (strand_count,) = struct.unpack_from("<i", content, end)
    if strand_count <= 0 or not names:
        what = "bones" if strand_count > 0 else "strands"
        raise file.error(f"it holds no {what} (byte {end if names else 0})", "Export it again")
    file.check("weights", end + 4, strand_count * _STRAND.itemsize)
    table = np.frombuffer(content, _STRAND, strand_count, end + 4)["influence"]
    weight = np.where(table["bone"] == -1, np.float32(0.0), table["weight"])
    bone = _place(table["bone"], indices, weight, file)
    bone, weight, without = _renormalised(bone, weight)
    notes: tuple[str, ...] = ()
    if without:
        notes = (f"{path.name}: {without:,} strands had no weights; '{names[0]}' carries them.",)
    return ReadBones(BoneWeights(tuple(names), bone, weight), notes)


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


def _bones(file: BinaryFile, content: bytes) -> tuple[Ints, list[str], int]:
    """Indices and names of the bones, and the byte behind them."""
    file.check("bone count", 0, 4)
    (count,) = struct.unpack_from("<i", content)
    if not 0 <= count <= MOST_BONES:
        raise file.error(
            f"this is no .tfxbone file: it would hold {count:,} bones", "Choose a .tfxbone file"
        )
    indices: list[int] = []
    names: list[str] = []
    at = 4
    for bone in range(count):
        file.check(f"bone {bone}", at, 8)
        index, length = struct.unpack_from("<2i", content, at)
        if length < 1:
            raise file.error(
                f"the name of bone {bone} would have {length} bytes (byte {at + 4})",
                "The file is damaged: copy or export it again",
            )
        file.check(f"name of bone {bone}", at + 8, length)
        text = content[at + 8 : at + 8 + length].partition(b"\0")[0]
        indices.append(index)
        names.append(text.decode("utf-8", "replace"))
        at += 8 + length
    if len(set(indices)) < count:
        raise file.error("two of its bones have the same index", "Export it again")
    return np.array(indices, np.int64), names, at


def _place(bone: Ints, indices: Ints, weight: Floats, file: BinaryFile) -> Ints:
    """From the file's indices of bones to places in its list."""
    order = np.argsort(indices)
    place = np.searchsorted(indices, bone, sorter=order)
    place = order[np.minimum(place, len(indices) - 1)]
    unknown = (indices[place] != bone) & (weight != 0.0)
    if unknown.any():
        strand, influence = (int(each[0]) for each in np.nonzero(unknown))
        raise file.error(
            f"strand {strand} hangs on bone {bone[strand, influence]}, and there is none",
            "The file is damaged: copy or export it again",
        )
    return place


def _renormalised(bone: Ints, weight: Floats) -> tuple[Ints, Floats, int]:
    """Weights with a sum of 1, the bone 0 where a weight is 0, and how many strands had none."""
    wide = np.where(np.isfinite(weight) & (weight > 0.0), weight, 0.0).astype(np.float64)
    total = wide.sum(axis=1)
    without = total == 0.0
    wide[without, 0], bone = 1.0, np.where(without[:, None], 0, bone)
    total[without] = 1.0
    scale = np.where(np.abs(total - 1.0) > _ROUNDING, total, 1.0)
    weight = (wide / scale[:, None]).astype(np.float32)
    return np.where(weight == 0.0, 0, bone), weight, int(without.sum())


def _broken(problem: str) -> HairloomError:
    return HairloomError(problem, place="bone weights", remedy="Read or make them again")
