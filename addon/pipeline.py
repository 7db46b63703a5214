"""The flows of data through the pure rooms: a groom made ready, a frame of motion.

Each flow hands values from room to room and decides nothing itself. `host` calls them from the
artist's buttons and from the command line alike.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .arrays import Floats, Ints
from .dynamics.colliders import PosedCollider
from .dynamics.settings import DynamicsSettings
from .dynamics.state import DynamicsState, start
from .dynamics.step import Drive, grid_at_frame_end
from .dynamics.step import advance as advance_dynamics
from .errors import HairloomError
from .groom.children import make_children
from .groom.children_settings import ChildrenSettings
from .groom.guides import choose_guides
from .groom.roots import RootFrames, bind_roots, follow, root_frames
from .groom.settings import GuideSettings
from .groom.weights import GUIDES_PER_STRAND, GuideWeights, guide_weights
from .refine.ride import ride
from .refine.thinning import even_ranks
from .shading.ambient import ambient_occlusion, skin_occlusion
from .shading.ambient_settings import AmbientSettings
from .strands import StrandSet, Surface
from .strands.join import joined
from .strands.resample import resample

NO_WIND = np.zeros(3)


@dataclass(frozen=True)
class Pose:
    """Where the body is at one moment.

    head_positions: (vertex_count, 3) [m], world space, or None for hair without a head.
    matrix: (4, 4), moves rest world space to now; carries hair without a head, and colliders.
    """

    head_positions: Floats | None
    matrix: Floats


@dataclass(frozen=True)
class Rig:
    """A groom made ready to move: all strands at one CV count, their guides and weights.

    strands: uniform, world space at rest; bound when there is a head.
    guides: (guide_count,) indices of the strands that are simulated; where children are made they
        are the first ones, and the children follow in the order in which they are grown.
    rest_frames: of all strands, or None without a head.
    notes: what the artist should know, each with its remedy.
    """

    strands: StrandSet
    head: Surface | None
    guides: Ints
    weights: GuideWeights
    rest_frames: RootFrames | None
    notes: tuple[str, ...] = ()

    @property
    def rest_pose(self) -> Pose:
        return Pose(None if self.head is None else self.head.positions, np.eye(4))


@dataclass(frozen=True)
class Motion:
    """What one frame hands to the next.

    guides: (guide_count, cv_count, 3) [m], simulated, with their roots in this pose.
    carried_guides: the same without dynamics: their rest shape carried by the roots.
    carried_earlier: the same one frame earlier; None at the start.
    duration: of the last frame [s]; 0 at the start.
    """

    dynamics: DynamicsState
    guides: Floats
    carried_guides: Floats
    pose: Pose
    carried_earlier: Floats | None = None
    duration: float = 0.0

    def drive(
        self,
        target: Floats,
        colliders: tuple[PosedCollider, ...],
        gravity: Floats,
        duration: float,
        scene_wind: Floats,
    ) -> Drive:
        """What acts in a frame of `duration` [s] that carries the guides to `target`."""
        earlier = self.carried_earlier if duration else None
        ratio = self.duration / duration if duration else 1.0
        before = self.carried_guides
        return Drive(before, target, colliders, gravity, earlier, scene_wind, ratio)


def prepare(
    strands: StrandSet,
    head: Surface | None,
    settings: GuideSettings,
    *,
    place: str,
    children: ChildrenSettings | None = None,
    density: Floats | None = None,
) -> Rig:
    """Bind strands to the head, choose the guides, weigh them for every strand.

    Where children are wanted, they and the guides are all the hair there is.

    Args:
        strands: world space at rest.
        head: world space at rest, or None for hair that only follows its object.
        place: names the groom in error messages.
        children: None is none.
        density: (vertex_count,) how densely children grow; None: wherever guides are near.

    Raises:
        HairloomError: no strands, or a groom of another scale than the head.
    """
    if not strands.strand_count:
        raise HairloomError(
            "it has no strands that can be used", place=place, remedy="Choose hair that has strands"
        )
    bound = strands if head is None else bind_roots(strands, head, place=place).strands
    uniform = resample(bound, settings.cv_count)
    guides = choose_guides(uniform, settings)
    if children is not None and children.method != "none":
        return _with_children(uniform.take(guides), head, children, density, place)
    grid, group = uniform.grid, uniform.group
    weights = guide_weights(
        uniform.roots,
        group,
        uniform.roots[guides],
        group[guides],
        strand_grid=grid,
        guide_grid=grid[guides],
    )
    return Rig(uniform, head, guides, weights, _frames(uniform, head))


def _with_children(
    guides: StrandSet,
    head: Surface | None,
    settings: ChildrenSettings,
    density: Floats | None,
    place: str,
) -> Rig:
    """Guides, each of which rides on itself, and what grows between them."""
    own = np.arange(guides.strand_count, dtype=np.int32)
    each = np.repeat(own[:, None], GUIDES_PER_STRAND, axis=1)
    alone = np.zeros(each.shape, np.float32)
    alone[:, 0] = 1.0
    if head is None:
        note = (
            "Children need a surface to grow from, so only the guides are shown. Give the hair a "
            "surface, or set Children to None."
        )
        return Rig(guides, None, own, GuideWeights(each, alone), None, (note,))
    made = make_children(guides, head, settings, density, place=place)
    strands = joined(guides, made.strands)
    weights = GuideWeights(
        np.concatenate([each, made.weights.guide]), np.concatenate([alone, made.weights.weight])
    )
    return Rig(strands, head, own, weights, _frames(strands, head), made.notes)


def _frames(strands: StrandSet, head: Surface | None) -> RootFrames | None:
    if head is None:
        return None
    assert strands.root_triangle is not None and strands.root_barycentric is not None
    return root_frames(
        head.positions, head.triangles, strands.root_triangle, strands.root_barycentric
    )


def carried(rig: Rig, pose: Pose, chosen: Ints | slice = slice(None)) -> Floats:
    """Rest shapes of the chosen strands, each carried rigidly by its own root, (n, cv_count, 3)."""
    grid = rig.strands.grid[chosen]
    if rig.head is None or pose.head_positions is None or rig.rest_frames is None:
        return (grid @ pose.matrix[:3, :3].T + pose.matrix[:3, 3]).astype(np.float32)
    triangle, barycentric = rig.strands.root_triangle, rig.strands.root_barycentric
    assert triangle is not None and barycentric is not None
    now = root_frames(
        pose.head_positions, rig.head.triangles, triangle[chosen], barycentric[chosen]
    )
    rest = RootFrames(rig.rest_frames.origin[chosen], rig.rest_frames.rotation[chosen])
    return follow(grid, rest, now)


def begin(rig: Rig, pose: Pose) -> Motion:
    """Hair at rest in this pose."""
    guides = carried(rig, pose, rig.guides)
    return Motion(start(guides), guides, guides, pose)


def advance(
    rig: Rig,
    motion: Motion,
    pose: Pose,
    colliders: tuple[PosedCollider, ...],
    settings: DynamicsSettings,
    gravity: Floats,
    duration: float,
    scene_wind: Floats = NO_WIND,
) -> Motion:
    """One frame of motion: the roots go with the head, the dynamics moves the rest.

    Args:
        gravity: (3,) [m/s^2], world space.
        duration: time since the motion's pose [s].
        scene_wind: (3,) [m/s], world space.
    """
    target = carried(rig, pose, rig.guides)
    drive = motion.drive(target, colliders, gravity, duration, scene_wind)
    state = advance_dynamics(motion.dynamics, drive, settings, duration)
    guides, before = grid_at_frame_end(state, drive), motion.carried_guides
    return Motion(state, guides, target, pose, before, duration)


def strands_now(rig: Rig, motion: Motion) -> Floats:
    """All strands at this moment of a running motion, (strand_count, cv_count, 3) [m]."""
    return strands_at(rig, motion.pose, motion.guides)


def strands_at(rig: Rig, pose: Pose, guides_now: Floats) -> Floats:
    """All strands riding on guides, (strand_count, cv_count, 3) [m], world space.

    Args:
        guides_now: (guide_count, cv_count, 3) [m], simulated or baked, world space.
    """
    strands = carried(rig, pose)
    return ride(strands, strands[rig.guides], guides_now, rig.weights)


def rest_occlusion(rig: Rig, settings: AmbientSettings) -> Floats:
    """Ambient occlusion of every CV at rest, (strand_count, cv_count), 1 where nothing shades."""
    strands = rig.strands
    occlusion = ambient_occlusion(strands, strands.points, rig.head, settings)
    return occlusion.reshape(strands.strand_count, -1)


def head_occlusion(rig: Rig, settings: AmbientSettings) -> Floats | None:
    """The light that the hair lets through to the head, (vertex_count,); None without a head."""
    return None if rig.head is None else skin_occlusion(rig.strands, rig.head, settings)


def strand_ranks(rig: Rig) -> Floats:
    """Where each strand stands in an even order, (strand_count,) in 0 to 1: the strands of low
    rank alone are the same hair, only sparser.

    Children come in the order in which they were grown, which is such an order, after the guides.
    """
    guide_count, count = len(rig.guides), rig.strands.strand_count
    if not np.array_equal(rig.guides, np.arange(guide_count)):
        return even_ranks(rig.strands.roots)
    ranks = np.arange(count, dtype=np.float32) / np.float32(count)
    ranks[:guide_count] = even_ranks(rig.strands.roots[:guide_count]) * (guide_count / count)
    return ranks


def root_turns(rig: Rig, pose: Pose) -> Floats:
    """How the body has turned the root of each guide since rest, (guide_count, 3, 3)."""
    count, frames = len(rig.guides), rig.rest_frames
    if rig.head is None or pose.head_positions is None or frames is None:
        return np.broadcast_to(pose.matrix[:3, :3], (count, 3, 3))
    triangle, barycentric = rig.strands.root_triangle, rig.strands.root_barycentric
    assert triangle is not None and barycentric is not None
    now = root_frames(
        pose.head_positions, rig.head.triangles, triangle[rig.guides], barycentric[rig.guides]
    )
    turns: Floats = now.rotation @ frames.rotation[rig.guides].transpose(0, 2, 1)
    return turns


def root_normals(rig: Rig) -> Floats:
    """The surface's normal under each root, (strand_count, 3); without a head, outwards."""
    if rig.rest_frames is not None:
        return np.ascontiguousarray(rig.rest_frames.rotation[:, :, 2])
    outward = rig.strands.roots - rig.strands.points.mean(axis=0)
    length = np.linalg.norm(outward, axis=1, keepdims=True)
    up = np.array([0.0, 0.0, 1.0], np.float32)
    return np.where(length > 0.0, outward / np.maximum(length, 1e-12), up).astype(np.float32)
