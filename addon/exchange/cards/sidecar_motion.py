"""The sidecar's description of cards in motion, as plain data in the file's own units and axes."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from ...arrays import Floats
from ...cards.joints import CardTracks, FitError
from ...cards.spring_bones import DOWN, STEP_RATE
from ...cards.vertex_animation import MotionLayout
from .card_formats import GLB, CardFormat
from .glb_skin import ANIMATION, ROOT_JOINT, Skeleton
from .glb_springs import SPRINGS, SpringSkeleton, collider_list, spring_list

#: format -> where the texel of each vertex is
TEXEL_ATTRIBUTES = {"glb": "TEXCOORD_2", "fbx": "LayerElementUV 2", "usd": "primvars:st2"}
TEXTURE_MEANINGS = {
    "position": "from the position of the vertex in the file to its position in the frame",
    "normal": "of the card in the frame, unit length",
    "tangent": "along the strands in the frame, from root to tip, unit length",
}
_SPACES = {
    "head": "without the motion of the head: attach the object, or its root joint, to the head, "
    "in the head's rest position in the file",
    "world": "with the motion of the head: do not move the object",
}
_HOW_TO_READ = (
    "values = texture at texel + (0, frame * frame_step), nearest texel, no mip maps, no sRGB, no "
    "compression; signed floats in the units and axes of the file. Between two frames, "
    "interpolate their values and normalize directions"
)
_HOW_TO_PLAY = (
    "linear blend skinning; slerp rotations and interpolate translations linearly between keys. "
    "Keys that this reproduces are left out"
)

_HOW_TO_SPRING = (
    "attach root_joint to the head. Step each chain step_rate times per second, from root to tip. "
    "A bone's tail is the next joint: tail += (tail - previous tail) * (1 - drag) + (unit "
    "direction of the bone at rest, rotated with its parent) * stiffness / step_rate + "
    "gravity_direction * gravity / step_rate; restore the bone's length; for each collider of the "
    "chain that is nearer than radius + hit_radius, push the tail out and restore the bone's "
    "length again; rotate the bone by the smallest rotation that points it at its tail"
)


def spring_motion(tracks: CardTracks, skeleton: SpringSkeleton, error: FitError) -> dict[str, Any]:
    """The motion of a GLB with springs."""
    rig = skeleton.rig
    chains, joints = rig.chains.rest.shape[:2]
    return {
        "kind": "springs",
        **_common(tracks, "head"),
        "extension": SPRINGS,
        "root_joint": ROOT_JOINT,
        "root_place": GLB.to_file_space(skeleton.root).tolist(),
        **({"head_bone": skeleton.bone.name} if skeleton.bone else {}),
        "chains": chains,
        "joints_in_chain": joints,
        "joints": chains * joints + 1,
        "influences": rig.skins[0].joint.shape[1],
        "step_rate": STEP_RATE,
        "gravity_direction": GLB.to_file_space(DOWN).tolist(),
        "colliders": collider_list(rig.chains.colliders, skeleton.root),
        "springs": spring_list(rig),
        "error": _error(error, tracks, GLB.units_per_metre),
        "how": _HOW_TO_SPRING,
    }


def joint_motion(
    tracks: CardTracks, skeleton: Skeleton, error: FitError, space: str
) -> dict[str, Any]:
    """The motion of a GLB with joints."""
    rig, scale = skeleton.rig, GLB.units_per_metre
    return {
        "kind": "joints",
        **_common(tracks, space),
        "animation": ANIMATION,
        "root_joint": ROOT_JOINT,
        "root_place": GLB.to_file_space(skeleton.root).tolist(),
        "chains": rig.chains,
        "joints_in_chain": rig.joints,
        "joints": rig.chains * rig.joints + 1,
        "keys": sum(len(keys.frames) for keys in skeleton.keys) * rig.joints,
        "influences": rig.skins[0].joint.shape[1],
        "error": _error(error, tracks, scale),
        "how": _HOW_TO_PLAY,
    }


def texture_motion(
    tracks: CardTracks,
    file_format: CardFormat,
    layout: MotionLayout,
    files: Mapping[str, str],
    depth: str,
    bounds: tuple[Floats, Floats],
    error: FitError,
    space: str,
) -> dict[str, Any]:
    """The motion in a vertex animation texture.

    Args:
        files: position, normal and tangent -> file.
        bounds: lowest and highest corner of all frames [m], Z up.
    """
    corners = file_format.to_file_space(np.stack(bounds))
    down = 1.0 if file_format == GLB else -1.0
    return {
        "kind": "texture",
        **_common(tracks, space),
        "textures": {
            name: {"file": file, "meaning": TEXTURE_MEANINGS[name]} for name, file in files.items()
        },
        "depth": depth,
        "width": layout.width,
        "height": layout.height,
        "rows_per_frame": layout.rows,
        "texel": TEXEL_ATTRIBUTES[file_format.name],
        "frame_step": down * layout.frame_step,
        "bounds": {
            "minimum": corners.min(axis=0).tolist(),
            "maximum": corners.max(axis=0).tolist(),
        },
        "error": _error(error, tracks, file_format.units_per_metre),
        "how": _HOW_TO_READ,
    }


def _error(error: FitError, tracks: CardTracks, scale: float) -> dict[str, float]:
    """The errors in a file with `scale` units in a metre."""
    return {
        "root_mean_square": error.root_mean_square * scale,
        "percentile_99": error.percentile_99 * scale,
        "worst": error.maximum * scale,
        "hair_length": tracks.hair_length * scale,
    }


def _common(tracks: CardTracks, space: str) -> dict[str, Any]:
    return {
        "frames": {
            "first": tracks.first_frame,
            "count": tracks.frame_count,
            "rate": tracks.frame_rate,
        },
        "space": space,
        "space_means": _SPACES[space],
    }
