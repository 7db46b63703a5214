"""A groom of the open scene in the studio, for pictures."""

from __future__ import annotations

import re
from dataclasses import dataclass, replace

import bpy

from ...arrays import Floats
from ...exchange.files.file_names import avoid_device_name
from ...paint_flow import with_painted_colors
from ...rig_flow import Pose
from ...shading.ambient_settings import AmbientSettings
from ...shading.settings import ShadingSettings
from ..cards.edits import read_edits
from ..cards.textures import chosen_pictures
from ..preview import previews
from ..properties.groom_settings import GroomSettings
from ..scene.head_look import look_of_head
from ..sessions.groom_source import GroomSource
from ..sessions.prepared_groom import PreparedGroom, prepare_groom, requested_rig
from ..sessions.session import Session
from .studio import Studio


@dataclass(frozen=True)
class ShownGroom:
    """A groom as it is now.

    points, guides: see Studio.picture.
    notes: for the artist.
    """

    studio: Studio
    pose: Pose
    points: Floats
    guides: Floats
    notes: tuple[str, ...]


def shown_groom(hair: bpy.types.Object, depsgraph: bpy.types.Depsgraph) -> ShownGroom:
    """The groom as its preview shows it; without one, in its style.

    Raises:
        HairloomError: no hair that can be used, or of another scale than the head.
    """
    session = previews.session_of(hair)
    if session is not None:
        previews.finish(session, depsgraph)
        session = previews.session_of(hair)
    if isinstance(session, Session):
        look, groom = session.settings[ShadingSettings], session.groom
        groom = replace(groom, rig=with_painted_colors(groom.rig, session.source.colors, look))
        studio = _studio(hair, groom, session.settings)
        solver = session.solver
        guides = solver.guides()
        return ShownGroom(studio, solver.pose, session.strands, guides, studio.warnings)
    request = GroomSource(hair, depsgraph).request
    settings, colors = request.settings, request.source.colors
    rig = with_painted_colors(requested_rig(request), colors, settings[ShadingSettings])
    studio = _studio(hair, prepare_groom(rig, settings[AmbientSettings]), settings)
    notes = (*request.source.warnings, *rig.notes, *studio.warnings)
    return ShownGroom(studio, rig.rest_pose, rig.strands.points, rig.guide_grid, notes)


def file_name(name: str) -> str:
    """A file name for a data-block's name."""
    return avoid_device_name(re.sub(r"[^\w .-]+", "_", name).strip(" .") or "groom")


def _studio(hair: bpy.types.Object, groom: PreparedGroom, settings: GroomSettings) -> Studio:
    pictures, _ = chosen_pictures(hair.data.hairloom.card_images)
    edits, _ = read_edits(hair, bpy.context.evaluated_depsgraph_get())
    return Studio(groom, settings, pictures, look_of_head(hair, groom.rig.head), edits)
