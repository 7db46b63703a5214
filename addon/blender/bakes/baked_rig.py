"""A groom's rig to and from the arrays of a bake: enough to place all strands without the scene.

A frame holds all vertices of the head, so that all of it can be drawn however it deforms.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from ... import motion_flow
from ...arrays import Floats, Ints
from ...errors import HairloomError
from ...groom.holds import Holds
from ...groom.roots import root_frames
from ...groom.weights import GuideWeights
from ...groom.widths import Widths
from ...refine.lead_out import LedOut
from ...rig_flow import Pose, Rig
from ...strands import StrandSet, Surface
from .simulation import Arrays

#: Relative tolerance at which sizes are equal, as Blender's matrices are rounded.
_ROUNDING = 1.0e-4


@dataclass(frozen=True)
class RestMatrices:
    """matrix_world of hair and head when the rig was made, (4, 4) each; head None without one.

    ties: (tie_count, 4, 4), the same for its ties.
    """

    hair: Floats
    head: Floats | None
    ties: Floats = field(default_factory=lambda: np.zeros((0, 4, 4)))

    @property
    def is_invertible(self) -> bool:
        """Whether neither hair nor head is scaled to 0 along an axis."""
        matrices = (self.hair,) if self.head is None else (self.hair, self.head)
        return all(np.linalg.matrix_rank(each[:3, :3]) == 3 for each in matrices)

    def has_same_size(self, other: RestMatrices) -> bool:
        """Whether hair and head have the scale and handedness of the others, whatever their
        positions and rotations."""
        if self.head is None or other.head is None:
            return self.head is other.head and _has_same_scale(self.hair, other.hair)
        return _has_same_scale(self.hair, other.hair) and _has_same_scale(self.head, other.head)


@dataclass(frozen=True, eq=False)
class BakedRig:
    """The part of a groom's bake that all frames share."""

    rig: Rig
    rest_matrices: RestMatrices

    def pose(self, frame: Arrays) -> Pose:
        """The pose of the head in a frame."""
        return Pose(frame.get("head"), frame["matrix"], frame.get("anchors"))

    def fits(self, frame: Arrays) -> bool:
        """Whether a frame's arrays match this rig: guides, head vertices, anchors, style, and the
        strands that were led out of colliders."""
        head = None if self.rig.head is None else self.rig.head.positions.shape
        found = frame["head"].shape if "head" in frame else None
        anchors = None if self.rig.holds is None else (self.rig.holds.anchor_count, 4, 4)
        held = frame["anchors"].shape if "anchors" in frame else None
        guides = self.rig.guide_grid.shape
        if (found, held) != (head, anchors) or frame["guides"].shape != guides:
            return False
        style = frame.get("style"), frame.get("style_guides")
        known = self.rig.strands.points, self.rig.guide_grid
        if any(
            each is not None and each.shape != own.shape
            for each, own in zip(style, known, strict=True)
        ):
            return False
        return led_out_in(frame).fits(self.rig.strands.offsets)

    def styled_rig(self, frame: Arrays) -> Rig:
        """The rig with the style of a frame that fits, or its own where the frame has none."""
        if "style" not in frame:
            return self.rig
        strands = self.rig.strands.with_points(frame["style"])
        return replace(self.rig, strands=strands, guide_grid=frame["style_guides"])

    def strands(self, frame: Arrays) -> Floats:
        """All strands in a frame, (point_count, 3) float32 world [m].

        Raises:
            HairloomError: the frame is of another rig.
        """
        if not self.fits(frame):
            raise HairloomError(
                "a frame belongs to another groom than the bake", place="bake", remedy="Bake again"
            )
        rig, pose = self.styled_rig(frame), self.pose(frame)
        return motion_flow.strands_at(rig, pose, frame["guides"], led_out_in(frame))


def frame_arrays(pose: Pose, guides: Floats, led: LedOut, styled: Rig | None = None) -> Arrays:
    """The arrays of one frame: guides, pose, and the strands that were led out of colliders, which
    playback could not compute, as it has no colliders.

    Args:
        guides: (guide_count, cv_count, 3) world [m].
        styled: the rig with the style of this frame; None: the style is not animated.
    """
    arrays: Arrays = {
        "guides": guides,
        "matrix": np.asarray(pose.matrix, np.float64),
        "led_strands": led.strands,
        "led_points": led.points,
    }
    if pose.head_positions is not None:
        arrays["head"] = pose.head_positions
    if pose.anchors is not None:
        arrays["anchors"] = pose.anchors
    if styled is not None:
        arrays |= {"style": styled.strands.points, "style_guides": styled.guide_grid}
    return arrays


def led_out_in(frame: Arrays) -> LedOut:
    """The strands of a frame that were led out of colliders."""
    return LedOut(frame["led_strands"], frame["led_points"])


def rig_arrays(rig: Rig, rests: RestMatrices) -> Arrays:
    """The arrays from which `baked_rig_of` makes the rig again."""
    strands = rig.strands
    arrays: Arrays = {
        "strands": strands.points,
        "offsets": strands.offsets,
        "radius": strands.radius,
        "group": strands.group,
        "guides": rig.guides,
        "guide_grid": rig.guide_grid,
        "weight_guide": rig.weights.guide,
        "weight": rig.weights.weight,
        "hair_rest": rests.hair,
        "notes": np.array(rig.notes, np.str_),
        "own_count": np.array(strands.strand_count - rig.child_count),
        "widths": np.array(rig.widths.numbers),
        "widths_reason": np.array(rig.widths.reason, np.str_),
        "children_line": np.array(rig.children_line, np.str_),
        "baby_hair": rig.baby_hair,
    }
    if rig.holds is not None:
        arrays |= _hold_arrays(rig.holds) | {"tie_rests": rests.ties}
    if strands.root_uv is not None:
        arrays["root_uv"] = strands.root_uv
    if strands.color is not None:
        arrays["color"] = strands.color
    if strands.seed is not None:
        arrays["seed"] = strands.seed
    if rig.head is not None and rests.head is not None:
        assert strands.root_triangle is not None and strands.root_barycentric is not None
        arrays |= {
            "root_triangle": strands.root_triangle,
            "root_barycentric": strands.root_barycentric,
            "head_positions": rig.head.positions,
            "head_triangles": rig.head.triangles,
            "head_rest": rests.head,
        }
    return arrays


def _hold_arrays(holds: Holds) -> Arrays:
    arrays: Arrays = {
        "hold_strand": holds.strand,
        "hold_place": holds.place,
        "hold_anchor": holds.anchor,
        "tie_count": np.array(holds.tie_count),
    }
    if holds.surface is not None and holds.tip_triangle is not None:
        assert holds.tip_barycentric is not None
        arrays |= {
            "tip_positions": holds.surface.positions,
            "tip_triangles": holds.surface.triangles,
            "tip_triangle": holds.tip_triangle,
            "tip_barycentric": holds.tip_barycentric,
        }
    return arrays


def _holds_of(arrays: Arrays, strands: StrandSet) -> Holds | None:
    if "hold_strand" not in arrays:
        return None
    surface = None
    if "tip_positions" in arrays:
        surface = Surface(arrays["tip_positions"], arrays["tip_triangles"])
        _check_indices(arrays["tip_triangle"], len(surface.triangles))
    holds = Holds(
        arrays["hold_strand"],
        arrays["hold_place"],
        arrays["hold_anchor"],
        int(arrays["tie_count"]),
        surface,
        arrays.get("tip_triangle"),
        arrays.get("tip_barycentric"),
    )
    if not len(holds.strand) == len(holds.place) == len(holds.anchor):
        raise ValueError("holds do not fit together")
    _check_indices(holds.strand, strands.strand_count)
    _check_indices(holds.anchor, holds.anchor_count)
    last = strands.point_counts[holds.strand] - 1
    if not ((holds.place >= 0.0) & (holds.place <= last)).all():
        raise ValueError("a hold is at no point of its strand")
    return holds


def baked_rig_of(arrays: Arrays, place: str) -> BakedRig:
    """The rig that these arrays were made from.

    Raises:
        HairloomError: arrays are missing or do not fit together.
    """
    try:
        return _baked_rig_of(arrays)
    except (KeyError, ValueError, IndexError, HairloomError) as error:
        raise HairloomError(
            f"this bake is damaged ({error})", place=place, remedy="Bake again"
        ) from error


def _baked_rig_of(arrays: Arrays) -> BakedRig:
    head, frames = None, None
    if "head_positions" in arrays:
        head = Surface(arrays["head_positions"], arrays["head_triangles"])
        _check_indices(arrays["root_triangle"], len(head.triangles))
        frames = root_frames(
            head.positions, head.triangles, arrays["root_triangle"], arrays["root_barycentric"]
        )
    strands = StrandSet(
        points=arrays["strands"],
        offsets=arrays["offsets"],
        radius=arrays["radius"],
        group=arrays["group"],
        root_uv=arrays.get("root_uv"),
        root_triangle=arrays.get("root_triangle"),
        root_barycentric=arrays.get("root_barycentric"),
        color=arrays.get("color"),
        seed=arrays.get("seed"),
    )
    _check_indices(arrays["guides"], strands.strand_count)
    _check_indices(arrays["weight_guide"], len(arrays["guides"]))
    weights = GuideWeights(arrays["weight_guide"], arrays["weight"])
    notes = tuple(str(note) for note in arrays.get("notes", ()))
    rig = Rig(
        strands,
        head,
        arrays["guides"],
        arrays["guide_grid"],
        weights,
        frames,
        notes,
        int(arrays["own_count"]),
        Widths.of(arrays["widths"], str(arrays["widths_reason"])),
        str(arrays["children_line"]),
        _holds_of(arrays, strands),
        baked_baby_hair=arrays.get("baby_hair", np.zeros(0, np.int32)),
    )
    _check_indices(rig.baby_hair, strands.strand_count)
    ties = arrays.get("tie_rests", np.zeros((0, 4, 4)))
    rests = RestMatrices(arrays["hair_rest"], arrays.get("head_rest"), ties)
    return BakedRig(rig, rests)


def _has_same_scale(one: Floats, other: Floats) -> bool:
    """Whether two (4, 4) matrices give every vector the same length, and the same handedness."""
    one, other = one[:3, :3], other[:3, :3]
    lengths, known = one.T @ one, other.T @ other
    is_mirrored = np.linalg.det(one) * np.linalg.det(other) < 0.0
    return not is_mirrored and np.allclose(lengths, known, 0.0, _ROUNDING * np.abs(known).max())


def _check_indices(indices: Ints, count: int) -> None:
    if len(indices) and not 0 <= indices.min() <= indices.max() < count:
        raise ValueError("an index points to nothing")
