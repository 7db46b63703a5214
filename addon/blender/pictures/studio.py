"""The studio of the command line: a groom on its head under three lights, before one camera."""

from __future__ import annotations

from collections.abc import Hashable, Mapping
from dataclasses import replace

import numpy as np

from ...arrays import Floats
from ...pipeline import Pose
from ...render.camera import Camera, frame_camera
from ...render.card_pass import CardPass
from ...render.card_snapshot import CardSnapshot
from ...render.frame import render_image
from ...render.hair_ball import HairBall
from ...render.mesh_pass import MeshPass
from ...render.snapshot import MeshSnapshot, Snapshot
from ...render.strand_pass import Statistics, StrandPass
from ...shading.lights import Light, three_point_lights
from ...shading.skin.notes import skin_notes
from ...shading.volume.shadow_lights import shadow_warnings
from ...strands import Surface
from ..base.gpu_context import ensure_gpu
from ..cards.build import BuiltCards, CardInputs, cards_key
from ..cards.show import as_shown
from ..properties.groom_settings import GroomSettings
from ..scene.built_in_head import HeadLook
from ..sessions.prepared_groom import PreparedGroom
from ..sessions.snapshots import snapshot_of, with_settings
from .head_parts import head_parts
from .skin_picture import shown_skin_shadow
from .slices import shown_slices

#: three-quarter view from the front; heads face -Y
VIEW_DIRECTION = (-0.55, -1.0, 0.18)
FIELD_OF_VIEW = np.radians(30.0)
#: how far around the groom its head is shown, as a fraction of the groom's size
HEAD_ROOM = 0.25
#: below 1, because nothing fills the corners of the box that the camera holds
MARGIN = 0.85
BACKDROP = (0.045, 0.05, 0.058, 1.0)

type Rgba = tuple[float, float, float, float]


class Studio:
    """Draws moments of one groom, always with the same framing, so that pictures compare.

    Args:
        card_pictures: what takes the place of textures where cards are shown.
        look: materials of the head; None is plain skin.
    """

    def __init__(
        self,
        groom: PreparedGroom,
        settings: GroomSettings,
        card_pictures: Mapping[str, Floats] | None = None,
        look: HeadLook | None = None,
    ) -> None:
        ensure_gpu()
        self._groom, self._rig, self._snapshot = groom, groom.rig, snapshot_of(groom)
        self._passes, self._card_pass = (MeshPass(), StrandPass()), CardPass()
        self._cards: tuple[Hashable, BuiltCards] | None = None
        self._card_pictures, self._look = card_pictures or {}, look
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
        background: Rgba = BACKDROP,
    ) -> Floats:
        """Hair at these points on the head in this pose, (height, width, 4) scene-linear.

        Args:
            points: (strand_count, cv_count, 3) [m], world space.
            samples: sub-pixels along each side of a pixel.
            camera: in place of the studio's own.
            lights: in place of three that are attached to the camera.
            background: premultiplied.
        """
        camera, occluders = camera or self._camera(width / height), self._groom.occluders
        snapshot = replace(
            self._at_rest,
            strands=points,
            meshes=self._meshes(pose),
            lights=three_point_lights(camera.view) if lights is None else lights,
            occluder_spheres=None if occluders is None else occluders.at(pose),
            cards=self._cards_at(pose, points),
        )
        return render_image(
            as_shown(snapshot),
            camera,
            width,
            height,
            samples,
            background=background,
            passes=self._passes,
            card_pass=self._card_pass,
        )

    def _cards_at(self, pose: Pose, points: Floats) -> CardSnapshot | None:
        """The cards riding on the guides among these strands, where cards are shown."""
        if not self.settings.shows_cards:
            return None
        key, sections = cards_key(self.settings), self.settings.sections
        if self._cards is None or self._cards[0] != key:
            inputs = CardInputs(self._rig, sections, self._card_pictures)
            self._cards = key, BuiltCards.now(inputs)
        return self._cards[1].at(pose, points[self._rig.guides], sections)

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
            strands=points,
            meshes=self._meshes(pose),
            lights=three_point_lights(self._camera(1.0).view),
        )

    def card_picture(
        self,
        cards: CardSnapshot,
        width: int,
        height: int,
        samples: int,
        camera: Camera | None = None,
    ) -> Floats:
        """These cards in place of the strands at rest; arguments as in `picture`."""
        camera = camera or self._camera(width / height)
        cv_count = self._at_rest.cv_count
        snapshot = Snapshot(
            strands=np.zeros((0, cv_count, 3), np.float32),
            radius=np.zeros((0, cv_count), np.float32),
            meshes=self._meshes(self._rig.rest_pose),
            lights=three_point_lights(camera.view),
            shading=self._at_rest.shading,
            volume=self._at_rest.volume,
            skin=self._at_rest.skin,
            cards=cards,
        )
        return render_image(
            snapshot,
            camera,
            width,
            height,
            samples,
            background=BACKDROP,
            passes=self._passes,
            card_pass=self._card_pass,
        )

    @property
    def warnings(self) -> tuple[str, ...]:
        """What the artist should know about shadows, in the studio's light."""
        lights = three_point_lights(self._camera(1.0).view)
        snapshot = self._at_rest
        return (
            *shadow_warnings(lights, HairBall().of(snapshot), snapshot.volume),
            *skin_notes(self._rig.head, snapshot.skin, snapshot.volume),
        )

    @property
    def statistics(self) -> Statistics:
        """What was drawn of the hair in the last picture."""
        return self._passes[1].statistics

    def bounds(self, pose: Pose, points: Floats) -> tuple[Floats, Floats]:
        """Lowest and highest corner [m] of hair and of what of the head is near it."""
        places = points.reshape(-1, 3)
        low, high = places.min(axis=0), places.max(axis=0)
        if pose.head_positions is not None:
            room = HEAD_ROOM * float(np.max(high - low))
            head_low, head_high = pose.head_positions.min(axis=0), pose.head_positions.max(axis=0)
            low = np.minimum(low, np.maximum(head_low, low - room))
            high = np.maximum(high, np.minimum(head_high, high + room))
        return low, high

    def _camera(self, aspect: float) -> Camera:
        """Holds the groom at rest and what of the head is near it, with room for the motion."""
        held = self.bounds(self._rig.rest_pose, self._rig.strands.grid)
        return frame_camera(held, VIEW_DIRECTION, FIELD_OF_VIEW, aspect, margin=MARGIN)

    def _meshes(self, pose: Pose) -> tuple[MeshSnapshot, ...]:
        if self._rig.head is None or pose.head_positions is None:
            return ()
        head = self._rig.head
        surface = Surface(pose.head_positions, head.triangles, head.corner_uv)
        whole = MeshSnapshot.of(surface, occlusion=self._groom.head_occlusion, is_skin=True)
        return (whole,) if self._look is None else head_parts(whole, self._look)
