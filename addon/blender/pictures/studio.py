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
from ...render.camera import Camera, frame_points
from ...render.card_pass import CardPass
from ...render.card_snapshot import CardSnapshot
from ...render.frame import render_image, render_still
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
from ...strands import Surface
from ..base.gpu_context import ensure_gpu
from ..cards.build import BuiltCards, CardInputs, cards_key
from ..cards.show import as_shown
from ..properties.groom_settings import GroomSettings
from ..scene.built_in_head import HeadLook
from ..sessions.prepared_groom import PreparedGroom
from ..sessions.snapshots import snapshot_of, with_settings
from .film import write_picture
from .head_parts import head_parts
from .skin_picture import shown_skin_shadow
from .slices import shown_slices

FIELD_OF_VIEW = np.radians(30.0)
#: distance around the groom within which the head is shown, as a fraction of the groom's size
HEAD_ROOM = 0.25
#: for a close-up: its direction (degrees from the front, and z), and the radius that it shows, as a
#: fraction of the groom's size
CLOSE_UP, CLOSE_REACH = (50.0, 0.3), 0.2
#: margin around the points that the camera holds, as a factor
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
        self.settings = settings

    @property
    def _at_rest(self) -> Snapshot:
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
        """
        camera, occluders = camera or self._camera(width / height), self._groom.occluders
        snapshot = replace(
            self._at_rest,
            points=points,
            meshes=self._meshes(pose),
            lights=self.lights(camera) if lights is None else lights,
            ambient=self.stage.ambient,
            occluder_spheres=None if occluders is None else occluders.at(pose),
            cards=self._cards_at(pose, guides),
        )
        picture = self._drawn(as_shown(snapshot), camera, width, height, samples, is_soft)
        return (
            picture
            if is_transparent
            else over_backdrop(picture, backdrop(self.stage, width, height))
        )

    def _drawn(
        self,
        snapshot: Snapshot,
        camera: Camera,
        width: int,
        height: int,
        samples: int,
        is_soft: bool = True,
    ) -> Floats:
        draw: Callable[..., Floats] = partial(render_still, center=self._ball.center)
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
    def stage(self) -> StageSettings:
        return self.settings[StageSettings]

    def lights(self, camera: Camera) -> tuple[Light, ...]:
        """The lights of the stage, around the groom at rest, attached to a camera.

        They are mirrored so that the main light is on the side of the hair that the camera sees.
        """
        front, eye = self.side.front, np.linalg.inv(camera.view)[:3, 3] - self._ball.center
        is_mirrored = bool(front[0] * eye[1] - front[1] * eye[0] < 0.0)
        return stage_lights(self.stage, camera.view, self._ball, is_mirrored=is_mirrored)

    @cached_property
    def _ball(self) -> Ball:
        low, high = self.bounds(self._rig.rest_pose, self._rig.strands.points)
        return Ball(0.5 * (low + high), 0.5 * float(np.linalg.norm(high - low)))

    @cached_property
    def side(self) -> GoodSide:
        """The directions from which the groom at rest is best seen, by its own strands: children,
        which are random, would change the view.
        """
        own = np.arange(self._rig.strands.strand_count - self._rig.child_count)
        return good_side(self._rig.strands.take(own), self._rig.head)

    def _cards_at(self, pose: Pose, guides: Floats | None) -> CardSnapshot | None:
        """The cards on these guides; None where strands are shown."""
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
        return shown_slices(self._in_its_light(pose, points), self._passes[1])

    def skin_shadow(self, pose: Pose, points: Floats) -> Floats:
        """The soft shadow on the head in the studio's light, see shown_skin_shadow.

        Raises:
            HairloomError: there is none.
        """
        snapshot = self._in_its_light(pose, points)
        return shown_skin_shadow(snapshot, self._passes[1], place="--skin-shadow")

    def _in_its_light(self, pose: Pose, points: Floats) -> Snapshot:
        return replace(
            self._at_rest,
            points=points,
            meshes=self._meshes(pose),
            lights=self.lights(self._camera(1.0)),
        )

    def card_picture(
        self,
        cards: CardSnapshot,
        width: int,
        height: int,
        samples: int,
        camera: Camera | None = None,
    ) -> Floats:
        """A picture of these cards instead of the strands at rest; arguments as in `picture`."""
        camera = camera or self._camera(width / height)
        snapshot = Snapshot(
            points=np.zeros((0, 3), np.float32),
            radius=np.zeros(0, np.float32),
            meshes=self._meshes(self._rig.rest_pose),
            lights=self.lights(camera),
            ambient=self.stage.ambient,
            shading=self._at_rest.shading,
            volume=self._at_rest.volume,
            skin=self._at_rest.skin,
            cards=cards,
        )
        picture = self._drawn(snapshot, camera, width, height, samples)
        return over_backdrop(picture, backdrop(self.stage, width, height))

    @property
    def warnings(self) -> tuple[str, ...]:
        """Warnings about shadows in the studio's light, and about materials of the head."""
        lights = self.lights(self._camera(1.0))
        snapshot = self._at_rest
        return (
            *shadow_warnings(lights, HairBall().ball(snapshot), snapshot.volume),
            *skin_notes(self._rig.head, snapshot.skin, snapshot.volume),
            *dict.fromkeys(note for _, material in self._look or () for note in material.notes),
        )

    @property
    def statistics(self) -> Statistics:
        """The counts of what was drawn of the hair in the last picture."""
        return self._passes[1].statistics

    def held(self, pose: Pose, points: Floats) -> Floats:
        """Points that pictures show, (n, 3) [m]: the hair, and vertices of the head near it."""
        places = points.reshape(-1, 3)
        if pose.head_positions is None:
            return places
        low, high = places.min(axis=0), places.max(axis=0)
        room = HEAD_ROOM * float(np.max(high - low))
        head = pose.head_positions
        is_near = ((head > low - room) & (head < high + room)).all(axis=1)
        return np.concatenate([places, head[is_near]])

    def bounds(self, pose: Pose, points: Floats) -> tuple[Floats, Floats]:
        """Lowest and highest corner [m] of the points that pictures show."""
        held = self.held(pose, points)
        return held.min(axis=0), held.max(axis=0)

    def framed(self, held: Floats, direction: Floats, aspect: float) -> Camera:
        """A camera in this direction from points (n, 3) [m] that frames them with a margin."""
        return frame_points(held, direction, FIELD_OF_VIEW, aspect, margin=MARGIN)

    def _camera(self, aspect: float) -> Camera:
        """The camera that frames the groom at rest and the head near it, with room for motion."""
        if aspect not in self._cameras:  # kept, as there may be a million points, in each frame
            held = self.held(self._rig.rest_pose, self._rig.strands.points)
            self._cameras[aspect] = self.framed(held, self.side.three_quarter, aspect)
        return self._cameras[aspect]

    def close_up(self, aspect: float) -> Camera:
        """The camera that frames the part of the groom at rest around the root nearest the eye."""
        direction, roots = self.side.turned(*CLOSE_UP), self._rig.strands.roots
        held = self.held(self._rig.rest_pose, self._rig.strands.points)
        nearest = roots[(roots @ direction).argmax()]
        reach = CLOSE_REACH * float(np.ptp(held, axis=0).max())
        return self.framed(held[np.linalg.norm(held - nearest, axis=1) < reach], direction, aspect)

    def middles(self, points: Floats) -> Floats:
        """The middle point of each strand, (strand_count, 3) [m]; points as for `picture`."""
        offsets = self._rig.strands.offsets
        return points.reshape(-1, 3)[(offsets[:-1] + offsets[1:]) // 2]

    def _meshes(self, pose: Pose) -> tuple[MeshSnapshot, ...]:
        if self._rig.head is None or pose.head_positions is None:
            return ()
        head = self._rig.head
        surface = Surface(pose.head_positions, head.triangles, head.corner_uv)
        whole = MeshSnapshot.of(surface, occlusion=self._groom.head_occlusion, is_skin=True)
        return (whole,) if self._look is None else head_parts(whole, self._look)
