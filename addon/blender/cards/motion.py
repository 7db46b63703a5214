"""Cards in motion: from a bake to joints, springs or textures beside the mesh."""

from __future__ import annotations

from collections.abc import Generator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ...arrays import Floats
from ...card_flow import CardMeasure, bound_cards, cards_at
from ...cards.card_mesh import CardMesh
from ...cards.export_settings import CardExportSettings
from ...cards.joint_keys import chain_keys, interpolate_keys, reduce_keys
from ...cards.joint_solve import fit_rigid_motions
from ...cards.joints import CardTracks, FitError, joint_steps, keyed_error
from ...cards.spring_bones import SpringColliders
from ...cards.spring_chains import spring_steps
from ...cards.steps import result_of
from ...cards.vertex_animation import (
    MotionLayout,
    motion_layout,
    motion_texture,
    rounding_errors,
    vertex_texels,
)
from ...dynamics.figures import CardFigures
from ...dynamics.fitting.settings import SphereFitSettings
from ...dynamics.fitting.sphere_fit import fit_spheres
from ...errors import HairloomError
from ...exchange.cards.card_formats import GLB, OBJ, CardFormat
from ...exchange.cards.glb_skin import Skeleton, with_skeleton
from ...exchange.cards.glb_springs import HeadBone, SpringSkeleton, with_springs
from ...exchange.cards.sidecar_motion import joint_motion, spring_motion, texture_motion
from ...strands import Surface
from ...strands.arc_length import typical_length
from ..bakes.guide_motion import GuideMotion
from ..base.images import write_texture

#: Fraction of the allowed error that the reduction of keys may add.
_KEY_FRACTION = 0.5
#: Number of balls that approximate the head; error of springs that is reported, as a fraction of
#: the hair's length.
HEAD_SPHERE_COUNT = 12
SPRING_ERROR = 0.1
#: Minimum number of frames: a single one holds no motion.
_MIN_FRAMES = 2


@dataclass(frozen=True, eq=False)
class MovedCards:
    """Cards in all frames. normals, tangents: as `CardTracks.moved_positions`, if requested.

    figures: of the finest level.
    """

    tracks: CardTracks
    figures: CardFigures
    normals: tuple[Floats, ...] = ()
    tangents: tuple[Floats, ...] = ()


def check_motion(
    settings: CardExportSettings, motion: GuideMotion, file_format: CardFormat
) -> None:
    """Refuse motion that cannot be written, before any work is done.

    Raises:
        HairloomError: a single frame, or a format that cannot store such motion.
    """
    if len(motion.frames) < _MIN_FRAMES:
        raise HairloomError(
            "motion needs more than one frame",
            place="frame range",
            remedy="Choose two frames or more",
        )
    if settings.motion in ("joints", "springs") and file_format != GLB:
        raise HairloomError(
            f"{settings.motion} are written to GLB, not to {file_format.title}",
            place="motion",
            remedy="Choose glTF (.glb), or a vertex texture",
        )
    if file_format == OBJ:
        raise HairloomError(
            "OBJ cannot store motion", place="motion", remedy="Choose glTF, FBX or USD"
        )


def moved_cards(
    motion: GuideMotion, levels: Sequence[CardMesh], *, space: str, with_directions: bool
) -> Generator[float, None, MovedCards]:
    """The cards in all frames; yields the fraction that is done.

    Args:
        levels: at rest, world space.
        space: "head": without the head's motion; "world": with it.
        with_directions: normals and tangents too.
    """
    rig, count = motion.rig, len(motion.frames)
    bound = [bound_cards(rig, mesh) for mesh in levels]
    measure = CardMeasure(rig, bound[0])
    names = ("positions", "normal", "tangent") if with_directions else ("positions",)
    arrays = {
        name: tuple(np.empty((len(mesh.positions), count, 3), np.float32) for mesh in levels)
        for name in names
    }
    roots = rig.guide_grid[:, 0].astype(np.float64)
    carrier: Floats = np.tile(np.eye(4), (count, 1, 1))
    turn: Floats = np.eye(3)[None]
    for number, frame in enumerate(motion.frames):
        pose, guides = motion.at(frame)
        now = guides[:, :1].astype(np.float64)
        turn, translation = fit_rigid_motions(roots, now, np.ones(len(roots)), turn)
        carrier[number, :3, :3], carrier[number, :3, 3] = turn[0], translation[0]
        back = np.eye(4) if space == "world" else carrier[number]
        for level, binding in enumerate(bound):
            mesh = cards_at(rig, binding, pose, guides)
            if not level:
                measure.add(mesh, pose.solids)
            for name in names:
                offset = back[:3, 3] if name == "positions" else 0.0
                arrays[name][level][:, number] = (getattr(mesh, name) - offset) @ back[:3, :3]
        yield (number + 1) / count
    grid = rig.guide_grid
    length = typical_length(np.linalg.norm(np.diff(grid, axis=1), axis=2).sum(axis=1))
    tracks = CardTracks(
        tuple(levels),
        arrays["positions"],
        carrier,
        length,
        roots.mean(axis=0),
        motion.frames[0],
        motion.frame_rate,
    )
    directions = (arrays.get(name, ()) for name in ("normal", "tangent"))
    return MovedCards(tracks, measure.figures, *directions)


@dataclass(frozen=True, eq=False)
class JointMotion:
    """A skeleton that is ready to be written, and its error."""

    tracks: CardTracks
    skeleton: Skeleton
    error: FitError
    settings: CardExportSettings

    @property
    def carrier(self) -> Floats:
        """The root joint's motion from rest, (frame_count, 4, 4), world space; (1, 4, 4) if it does
        not move."""
        if self.settings.motion_space == "world":
            return self.tracks.carrier
        return np.eye(4)[None]

    @property
    def relative_error(self) -> float:
        """The error as a fraction of the hair's length."""
        return self.error.root_mean_square / self.tracks.hair_length

    @property
    def notes(self) -> tuple[str, ...]:
        """For the artist, if the error is larger than allowed."""
        wanted = self.settings.joint_error / 100.0
        if self.relative_error <= wanted:
            return ()
        return (
            f"Joints are off by {self.relative_error:.1%} of the hair's length (root mean square; "
            f"the worst by {self.error.maximum / self.tracks.hair_length:.1%}), more than the "
            f"{wanted:.1%} allowed. Allow more chains, or more joints in each.",
        )

    @property
    def sidecar_section(self) -> dict[str, Any]:
        return joint_motion(self.tracks, self.skeleton, self.error, self.settings.motion_space)

    def complete(self, path: Path, nodes: Sequence[str]) -> None:
        """Add the skeleton to the GLB at this path."""
        data = path.read_bytes()
        levels = self.tracks.levels
        path.write_bytes(with_skeleton(data, nodes, levels, self.skeleton, path.name))


def joint_motion_steps(
    tracks: CardTracks, settings: CardExportSettings
) -> Generator[float, None, JointMotion]:
    """Fit joints and keys; yields the fraction that is done."""
    allowed = settings.joint_error / 100.0 * tracks.hair_length * _KEY_FRACTION
    rig = yield from joint_steps(tracks, settings)
    keys = result_of(chain_keys(rig, allowed))
    yield 0.95
    turn, place = zip(*(interpolate_keys(each, tracks.frame_count) for each in keys), strict=True)
    error = keyed_error(tracks, rig, np.stack(turn), np.stack(place))
    root_keys = None
    if settings.motion_space == "world":
        carried = tracks.carrier[:, :3, :3] @ tracks.root + tracks.carrier[:, :3, 3]
        size = np.ptp(tracks.levels[0].positions, axis=0).max()
        reach = np.array([float(size)])
        # relative to the root joint's rest, which is a translation only
        root_keys = reduce_keys(tracks.carrier[None, :, :3, :3], carried[None], reach, allowed)
    skeleton = Skeleton(rig, keys, tracks.root, root_keys, tracks.frame_rate)
    yield 1.0
    return JointMotion(tracks, skeleton, error, settings)


@dataclass(frozen=True, eq=False)
class SpringMotion:
    """Springs that are ready to be written, and their error. notes: for the artist."""

    tracks: CardTracks
    skeleton: SpringSkeleton
    notes: tuple[str, ...]

    @property
    def sidecar_section(self) -> dict[str, Any]:
        return spring_motion(self.tracks, self.skeleton, self.skeleton.rig.error)

    def complete(self, path: Path, nodes: Sequence[str]) -> None:
        """Add joints and springs to the GLB at this path."""
        data = path.read_bytes()
        levels = self.tracks.levels
        path.write_bytes(with_springs(data, nodes, levels, self.skeleton, path.name))


def spring_motion_steps(
    tracks: CardTracks,
    settings: CardExportSettings,
    head: Surface | None,
    bone: HeadBone | None,
    place: str,
) -> Generator[float, None, SpringMotion]:
    """Fit springs; yields the fraction that is done.

    Args:
        bone: the one that carries the head; None where there is none.
    """
    colliders, notes = _head_colliders(head, place)
    rig = yield from spring_steps(tracks, settings.spring_joints, colliders)
    skeleton = SpringSkeleton(rig, tracks.root, bone)
    error = rig.error.percentile_99 / tracks.hair_length
    if error > SPRING_ERROR:
        notes += (
            f"Springs are off by up to {error:.0%} of the hair's length (99% of all vertices): "
            "engines will move this hair differently from the bake. Allow more spring joints, or "
            "choose joints.",
        )
    return SpringMotion(tracks, skeleton, notes)


def _head_colliders(head: Surface | None, place: str) -> tuple[SpringColliders, tuple[str, ...]]:
    """The balls that springs stay out of, and a note if there are none."""
    nothing = SpringColliders.spheres(np.empty((0, 3)), np.empty(0))
    if head is None:
        return nothing, ("This hair has no head, so its springs collide with nothing.",)
    try:
        fit = fit_spheres(head, SphereFitSettings(sphere_count=HEAD_SPHERE_COUNT), place=place)
    except HairloomError as error:
        return nothing, (f"{error} Until then springs collide with nothing.",)
    return SpringColliders.spheres(fit.centers, fit.radii), ()


@dataclass(frozen=True, eq=False)
class TextureMotion:
    """Motion that is ready to be written as textures."""

    moved: MovedCards
    layout: MotionLayout
    settings: CardExportSettings
    file_format: CardFormat

    @classmethod
    def of(
        cls, moved: MovedCards, settings: CardExportSettings, file_format: CardFormat, place: str
    ) -> TextureMotion:
        tracks = moved.tracks
        count = sum(len(mesh.positions) for mesh in tracks.levels)
        return cls(moved, motion_layout(count, tracks.frame_count, place), settings, file_format)

    @property
    def texels(self) -> tuple[Floats, ...]:
        """The texels of each level's vertices, (vertex_count, 2), with v from the top."""
        sizes = [len(mesh.positions) for mesh in self.moved.tracks.levels]
        return tuple(np.split(vertex_texels(self.layout), np.cumsum(sizes)[:-1]))

    def write(self, path: Path) -> dict[str, str]:
        """Write the textures beside the mesh; position, normal and tangent -> file."""
        moved = self.moved
        every = {"position": self._offsets, "normal": moved.normals, "tangent": moved.tangents}
        files = {}
        for name, parts in every.items():
            values = self.file_format.to_file_space(np.concatenate(parts))
            if name != "position":
                values = values / self.file_format.units_per_metre
            files[name] = f"{path.stem}_motion_{name}.exr"
            write_texture(
                path.with_name(files[name]),
                motion_texture(values, self.layout),
                is_color=False,
                depth=self.settings.motion_depth,
            )
        return files

    @property
    def _offsets(self) -> list[Floats]:
        """The offsets of each level's vertices from rest, (vertex_count, frame_count, 3) [m]."""
        tracks = self.moved.tracks
        rests = [mesh.positions[:, None] for mesh in tracks.levels]
        return [now - rest for now, rest in zip(tracks.moved_positions, rests, strict=True)]

    @property
    def error(self) -> FitError:
        """The error of vertices by the rounding of stored values."""
        scale, depth = np.float32(self.file_format.units_per_metre), self.settings.motion_depth
        misses = [rounding_errors(each * scale, depth) / scale for each in self._offsets]
        return FitError.of([np.linalg.norm(miss, axis=-1).ravel() for miss in misses])

    def sidecar_section(self, files: dict[str, str]) -> dict[str, Any]:
        tracks = self.moved.tracks
        low: Floats = np.stack([each.min(axis=(0, 1)) for each in tracks.moved_positions]).min(
            axis=0
        )
        high: Floats = np.stack([each.max(axis=(0, 1)) for each in tracks.moved_positions]).max(
            axis=0
        )
        return texture_motion(
            tracks,
            self.file_format,
            self.layout,
            files,
            self.settings.motion_depth,
            (low, high),
            self.error,
            self.settings.motion_space,
        )
