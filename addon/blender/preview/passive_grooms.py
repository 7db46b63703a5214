"""Passive grooms: baked ones feel them, but they move as in their own bakes, or are at rest."""

from __future__ import annotations

import bpy
import numpy as np

from ... import motion_flow
from ...arrays import Floats
from ...dynamics.neighbours import NeighbourStyle
from ...errors import HairloomError
from ...rig_flow import Pose, Rig
from ..bakes import playback
from ..bakes.baked_rig import BakedRig
from ..base.objects import head_of, matrix_of, objects_in
from ..sessions.groom_source import GroomSource
from ..sessions.prepared_groom import build_groom
from ..sessions.session import Session
from .preview import baked_rig_for


class PassiveGroom:
    """A passive groom; implements `coupled_frame.FeltGroom`.

    Raises:
        HairloomError: there are no hair curves, none can be used, or their scale is not the head's.
    """

    def __init__(self, hair: bpy.types.Object, depsgraph: bpy.types.Depsgraph) -> None:
        self._source = GroomSource(hair, depsgraph)
        self._source.use_bake(baked_rig_for(hair, depsgraph.scene))
        self._rest_rig = build_groom(self._source.request, is_drawn=False).rig
        self.uid = int(hair.session_uid)
        self.move(depsgraph)

    @property
    def is_felt(self) -> bool:
        """See `coupled_frame.FeltGroom`."""
        hair = self._source.hair.handle.find()
        return hair is not None and not hair.hide_render

    def move(self, depsgraph: bpy.types.Depsgraph) -> None:
        """Move it to the scene's frame.

        Raises:
            HairloomError: it, its head or its bake is gone or broken.
        """
        hair, frame = self._source.hair.resolve(), depsgraph.scene.frame_current
        cache = playback.cache_of(hair) if hair.hairloom.bake.is_shown else None
        if cache is not None and cache.has_frame(frame):
            baked, arrays = BakedRig(self._rest_rig, self._source.rest_matrices), cache.frame(frame)
            if baked.fits(arrays):
                self.rig: Rig = baked.styled_rig(arrays)
                self.pose: Pose = baked.pose(arrays)
                self._guides: Floats = arrays["guides"]
                return
        self.rig, self.pose = self._rest_rig, self._source.pose(self._rest_rig, depsgraph)
        self._guides = motion_flow.style_of_guides(self.rig, self.pose)

    def guides(self) -> Floats:
        """See `coupled_frame.FeltGroom`."""
        return self._guides

    def neighbour_style(self) -> NeighbourStyle:
        """See `motion_flow.neighbour_style`."""
        return motion_flow.neighbour_style(self.rig, self.pose, self._rest_rig)


class PassiveGrooms(dict[int, PassiveGroom]):
    """The passive grooms of a bake, by session number of their objects; added once they are near.

    notes: why other grooms are not felt, by session number too.
    """

    def __init__(self) -> None:
        super().__init__()
        self.notes: dict[int, str] = {}

    def join(self, sessions: list[Session], depsgraph: bpy.types.Depsgraph) -> None:
        """Add grooms that these sessions may feel; those that cannot be used get a note instead."""
        for session in sessions:
            self.pop(session.uid, None)
        for obj in nearby_grooms(sessions, depsgraph):
            if obj.session_uid in self.keys() | self.notes.keys():
                continue
            try:
                self[obj.session_uid] = PassiveGroom(obj, depsgraph)
            except HairloomError as error:
                self.notes[obj.session_uid] = f"not felt by hair that was baked beside it: {error}"

    def move(self, depsgraph: bpy.types.Depsgraph) -> None:
        """Move all of them to the scene's frame.

        Raises:
            HairloomError: as `PassiveGroom.move`.
        """
        for each in self.values():
            each.move(depsgraph)


def nearby_grooms(
    sessions: list[Session], depsgraph: bpy.types.Depsgraph
) -> list[bpy.types.Object]:
    """Other grooms of the view layer that these may feel; fast enough for every redraw."""
    hairs = [session.hair.resolve() for session in sessions if session.feels_hair]
    balls = [_bounding_ball(hair, depsgraph) for hair in hairs]
    found, uids = [], {session.uid for session in sessions}
    for obj in objects_in(depsgraph.view_layer) if balls else ():
        is_groom = obj.type == "CURVES" and not obj.data.hairloom.baked_in
        if is_groom and not obj.hide_render and obj.session_uid not in uids:
            middle, radius = _bounding_ball(obj, depsgraph)
            if any(np.linalg.norm(place - middle) <= radius + reach for place, reach in balls):
                found.append(obj)
    return found


def _bounding_ball(hair: bpy.types.Object, depsgraph: bpy.types.Depsgraph) -> tuple[Floats, float]:
    """A ball that its hair cannot leave however it swings: centre (3,) and radius [m]."""
    corners = _corners(hair, depsgraph)
    reach = float(np.linalg.norm(np.ptp(corners, axis=0)))
    head = head_of(hair)
    if head is not None:
        corners = _corners(head, depsgraph)
    return corners.mean(axis=0), reach + float(np.linalg.norm(np.ptp(corners, axis=0))) / 2.0


def _corners(obj: bpy.types.Object, depsgraph: bpy.types.Depsgraph) -> Floats:
    """The corners of its evaluated bounding box, (8, 3) world [m]."""
    matrix = matrix_of(obj, depsgraph)
    corners = np.array(obj.evaluated_get(depsgraph).bound_box, np.float64)
    return corners @ matrix[:3, :3].T + matrix[:3, 3]
