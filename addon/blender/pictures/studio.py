"""The studio, which draws pictures of a groom on its head, on a stage, with a fixed camera."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Mapping
from dataclasses import replace
from functools import cached_property, partial
from pathlib import Path

import numpy as np

from ...arrays import Floats
from ...cards.edits import CardEdits
from ...motion_flow import style_of_guides
from ...params import Settings
from ...render.camera import Camera, frame_points
from ...render.card_pass import CardPass
from ...render.card_snapshot import CardSnapshot
from ...render.frame import render_image, render_still, still_samples
from ...render.good_side import GoodSide, good_side
from ...render.hair_ball import HairBall
from ...render.mesh_pass import MeshPass
from ...render.snapshot import MeshSnapshot, Snapshot
from ...render.strand_pass import Statistics, StrandPass, noise_free_samples
from ...rig_flow import Pose
from ...shading.lights import Light
from ...shading.skin.notes import skin_notes
from ...shading.stage import backdrop, over_backdrop, stage_lights
from ...shading.stage_settings import StageSettings
from ...shading.volume.light_frame import Ball
from ...shading.volume.shadow_lights import shadow_warnings
from ...strands import StrandSet, Surface
from ..base.gpu_context import ensure_gpu
from ..cards.build import BuiltCards, CardInputs, cards_key
from ..cards.show import as_shown
from ..properties.groom_settings import GroomSettings
from ..scene.built_in_head import HeadLook
from ..sessions.prepared_groom import PreparedGroom
from ..sessions.snapshots import snapshot_of, with_settings
from .film import write_picture
from .head_parts import head_parts
from .skin_picture import skin_shadow_picture
from .slices import slices_picture

FIELD_OF_VIEW = np.radians(30.0)
#: distance from the groom up to which the head is framed too, as a fraction of the groom's size
HEAD_MARGIN = 0.25
#: for a close-up: its direction (degrees from the front, and z), and the radius that it shows, as a
#: fraction of the groom's size
CLOSE_UP, CLOSE_REACH = (50.0, 0.3), 0.2
#: margin around the framed points, as a factor
MARGIN = 1.16


class Studio:
    """Draws one groom at any time of its motion, with the same framing, so that pictures compare.

    Args:
        card_pictures: used instead of generated textures where cards are shown.
        look: materials of the head, see head_look; None: plain skin.
        edits: the artist's edits to cards, or None.
    """

    def __init__(
        self,
        groom: PreparedGroom,
        settings: GroomSettings,
        card_pictures: Mapping[str, Floats] | None = None,
        look: HeadLook | None = None,
        edits: CardEdits | None = None,
    ) -> None:
        ensure_gpu()
        self._groom, self._rig, self._snapshot = groom, groom.rig, snapshot_of(groom)
        self._passes, self._card_pass = (MeshPass(), StrandPass()), CardPass()
        self._notes: dict[str, None] = {}
        self._cameras: dict[float, Camera] = {}
        self._cards: tuple[Hashable, BuiltCards] | None = None
        self._card_pictures, self._look, self._edits = card_pictures or {}, look, edits
        self.settings = self._own_settings = settings

    @property
    def _rest_snapshot(self) -> Snapshot:
        return with_settings(self._snapshot, self.settings)

    def picture(
        self,
        pose: Pose,
        points: Floats,
        width: int,
        height: int,
        samples: int,
        camera: Camera | None = None,
        *,
        lights: tuple[Light, ...] | None = None,
        guides: Floats | None = None,
        is_transparent: bool = False,
        is_soft: bool = True,
        on_sample: Callable[[int], object] = lambda done: None,
    ) -> Floats:
        """Hair at these points on the head in this pose, (height, width, 4) scene-linear.

        Args:
            points: (point_count, 3) [m], world space.
            samples: sub-pixels along each side of a pixel.
            camera: None: the studio's own.
            lights: None: those of the stage, which are attached to the camera.
            guides: (guide_count, cv_count, 3) [m] that cards ride on; None: in their style.
            is_transparent: without the backdrop.
            is_soft: soft shadows; without them, a picture takes a third of the time.
            on_sample: with soft shadows, called with the number of samples that are done, of
                `sample_count`.
        """
        camera = camera or self._camera(width / height)
        snapshot = replace(
            self.snapshot(pose, points, guides),
            meshes=self._meshes_of_picture(pose),
            lights=self.lights(camera) if lights is None else lights,
            ambient=self.stage.ambient,
        )
        picture = self._draw(snapshot, camera, width, height, samples, is_soft, on_sample)
        return (
            picture
            if is_transparent
            else over_backdrop(picture, backdrop(self.stage, width, height))
        )

    def snapshot(self, pose: Pose, points: Floats, guides: Floats | None = None) -> Snapshot:
        """The hair as `picture` draws it, without meshes and lights; arguments as there."""
        occluders = self._groom.occluders
        return as_shown(
            replace(
                self._rest_snapshot,
                points=points,
                occluder_spheres=None if occluders is None else occluders.at(pose),
                cards=self._cards_at(pose, guides),
            )
        )

    def show_look(self, *look: Settings) -> None:
        """Draw with other settings of these kinds, until the next call; with none, with its own."""
        own = self._own_settings
        self.settings = own.with_settings(*look) if look else own

    def sample_count(self, samples: int) -> int:
        """The number of samples of a picture with soft shadows."""
        return still_samples(self._rest_snapshot.strand_settings, samples)

    def _draw(
        self,
        snapshot: Snapshot,
        camera: Camera,
        width: int,
        height: int,
        samples: int,
        is_soft: bool = True,
        on_sample: Callable[[int], object] = lambda done: None,
    ) -> Floats:
        draw: Callable[..., Floats] = partial(
            render_still, center=self._ball.center, on_sample=on_sample
        )
        if not is_soft and noise_free_samples(snapshot.strand_settings) == 1:
            draw = render_image
        picture = draw(
            *(snapshot, camera, width, height, samples),
            passes=self._passes,
            card_pass=self._card_pass,
        )
        self._notes |= dict.fromkeys((*self.statistics.notes, *self._card_pass.notes))
        return picture

    @property
    def notes(self) -> tuple[str, ...]:
        """Notes for the artist on all pictures so far, each with its remedy."""
        return tuple(self._notes)

    def write(self, path: Path, picture: Floats) -> None:
        """Write a picture, or several in one, through the stage's film settings.

        Raises:
            HairloomError: it cannot be written.
        """
        write_picture(path, picture, self.stage)

    @property
    def head_occlusion(self) -> Floats | None:
        """(vertex_count,) fraction of ambient light that this hair lets through to the head."""
        return self._groom.head_occlusion

    @property
    def stage(self) -> StageSettings:
        return self.settings[StageSettings]

    def lights(self, camera: Camera | None = None) -> tuple[Light, ...]:
        """The lights of the stage, around the groom at rest, attached to a camera.

        They are mirrored so that the main light is on the side of the hair that the camera sees.

        Args:
            camera: None: the studio's own.
        """
        camera = camera or self._camera(1.0)
        front, eye = self.side.front, np.linalg.inv(camera.view)[:3, 3] - self._ball.center
        is_mirrored = bool(front[0] * eye[1] - front[1] * eye[0] < 0.0)
        return stage_lights(self.stage, camera.view, self._ball, is_mirrored=is_mirrored)

    @cached_property
    def _ball(self) -> Ball:
        low, high = self.bounds(self._rig.rest_pose, self._rig.strands.points)
        return Ball(0.5 * (low + high), 0.5 * float(np.linalg.norm(high - low)))

    @cached_property
    def side(self) -> GoodSide:
        """The directions from which the groom at rest is best seen. Children do not count, since
        they are random and would change the view."""
        return good_side(self.parents, self.head)

    @property
    def parents(self) -> StrandSet:
        """The strands at rest, without children."""
        return self._rig.strands.take(
            np.arange(self._rig.strands.strand_count - self._rig.child_count)
        )

    @property
    def head(self) -> Surface | None:
        """The head at rest."""
        return self._rig.head

    def _cards_at(self, pose: Pose, guides: Floats | None) -> CardSnapshot | None:
        """The cards on these guides; None if strands are shown."""
        if not self.settings.shows_cards:
            return None
        key, sections = cards_key(self.settings), self.settings.sections
        if self._cards is None or self._cards[0] != key:
            inputs = CardInputs(self._rig, sections, self._card_pictures, edits=self._edits)
            self._cards = key, BuiltCards.build(inputs)
        if guides is None:
            guides = style_of_guides(self._rig, pose)
        return self._cards[1].at(pose, guides, sections)

    def slices(self, pose: Pose, points: Floats) -> Floats:
        """The layers of the shadow maps in the studio's light, see opacity_tiles.

        Raises:
            HairloomError: there are none.
        """
        return slices_picture(self._lit_snapshot(pose, points), self._passes[1])

    def skin_shadow(self, pose: Pose, points: Floats) -> Floats:
        """The soft shadow on the head in the studio's light, see skin_shadow_picture.

        Raises:
            HairloomError: there is none.
        """
        snapshot = self._lit_snapshot(pose, points)
        return skin_shadow_picture(snapshot, self._passes[1], place="--skin-shadow")

    def _lit_snapshot(self, pose: Pose, points: Floats) -> Snapshot:
        return replace(
            self._rest_snapshot,
            points=points,
            meshes=self.meshes(pose),
            lights=self.lights(),
        )

    def card_picture(
        self,
        cards: CardSnapshot,
        width: int,
        height: int,
        samples: int,
        camera: Camera | None = None,
    ) -> Floats:
        """A picture of these cards instead of the strands at rest, (height, width, 4); arguments as
        in `picture`."""
        camera = camera or self._camera(width / height)
        snapshot = Snapshot(
            points=np.zeros((0, 3), np.float32),
            radius=np.zeros(0, np.float32),
            meshes=self.meshes(self._rig.rest_pose),
            lights=self.lights(camera),
            ambient=self.stage.ambient,
            shading=self._rest_snapshot.shading,
            volume=self._rest_snapshot.volume,
            skin=self._rest_snapshot.skin,
            cards=cards,
        )
        picture = self._draw(snapshot, camera, width, height, samples)
        return over_backdrop(picture, backdrop(self.stage, width, height))

    @property
    def warnings(self) -> tuple[str, ...]:
        """Warnings about shadows in the studio's light, and about materials of the head."""
        lights = self.lights()
        snapshot = self._rest_snapshot
        return (
            *shadow_warnings(lights, HairBall().ball(snapshot), snapshot.volume),
            *skin_notes(self._rig.head, snapshot.skin, snapshot.volume),
            *dict.fromkeys(note for _, material in self._look or () for note in material.notes),
        )

    @property
    def statistics(self) -> Statistics:
        """The counts of the hair that was drawn in the last picture."""
        return self._passes[1].statistics

    def framed_points(self, pose: Pose, points: Floats) -> Floats:
        """Points that pictures show, (n, 3) [m]: the hair, and vertices of the head near it."""
        hair = points.reshape(-1, 3)
        if pose.head_positions is None:
            return hair
        low, high = hair.min(axis=0), hair.max(axis=0)
        margin = HEAD_MARGIN * float(np.max(high - low))
        head = pose.head_positions
        is_near = ((head > low - margin) & (head < high + margin)).all(axis=1)
        return np.concatenate([hair, head[is_near]])

    def bounds(self, pose: Pose, points: Floats) -> tuple[Floats, Floats]:
        """Lowest and highest corner [m] of the points that pictures show."""
        framed = self.framed_points(pose, points)
        return framed.min(axis=0), framed.max(axis=0)

    def framing_camera(self, points: Floats, direction: Floats, aspect: float) -> Camera:
        """A camera in this direction from points (n, 3) [m] that frames them with a margin."""
        return frame_points(points, direction, FIELD_OF_VIEW, aspect, margin=MARGIN)

    def _camera(self, aspect: float) -> Camera:
        """The camera that frames the groom at rest and the head near it, with room for motion."""
        if (
            aspect not in self._cameras
        ):  # cached, as there may be a million points, and this is called in each frame
            points = self.framed_points(self._rig.rest_pose, self._rig.strands.points)
            self._cameras[aspect] = self.framing_camera(points, self.side.three_quarter, aspect)
        return self._cameras[aspect]

    def close_up(self, aspect: float) -> Camera:
        """The camera that frames the part of the groom at rest around the root nearest the eye."""
        direction, roots = self.side.turned(*CLOSE_UP), self._rig.strands.roots
        points = self.framed_points(self._rig.rest_pose, self._rig.strands.points)
        nearest = roots[(roots @ direction).argmax()]
        reach = CLOSE_REACH * float(np.ptp(points, axis=0).max())
        is_near = np.linalg.norm(points - nearest, axis=1) < reach
        return self.framing_camera(points[is_near], direction, aspect)

    def strand_middles(self, points: Floats) -> Floats:
        """The middle point of each strand, (strand_count, 3) [m]; points as for `picture`."""
        offsets = self._rig.strands.offsets
        return points.reshape(-1, 3)[(offsets[:-1] + offsets[1:]) // 2]

    def _meshes_of_picture(self, pose: Pose) -> tuple[MeshSnapshot, ...]:
        return self.meshes(pose)

    def meshes(self, pose: Pose, occlusion: Floats | None = None) -> tuple[MeshSnapshot, ...]:
        """The parts of the head in this pose; none without a head.

        Args:
            occlusion: (vertex_count,) instead of that by this hair, see MeshSnapshot.
        """
        if self._rig.head is None or pose.head_positions is None:
            return ()
        head = self._rig.head
        surface = Surface(pose.head_positions, head.triangles, head.corner_uv)
        if occlusion is None:
            occlusion = self.head_occlusion
        head_mesh = MeshSnapshot.of(surface, occlusion=occlusion, is_skin=True)
        return (head_mesh,) if self._look is None else head_parts(head_mesh, self._look)
