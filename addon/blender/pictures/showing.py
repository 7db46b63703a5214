"""A groom of the open scene in the studio, to be shown to others."""

from __future__ import annotations

import re
from dataclasses import dataclass

import bpy

from ... import pipeline
from ...arrays import Floats
from ...pipeline import Pose, Rig
from ...shading.ambient_settings import AmbientSettings
from ..cards.textures import chosen_pictures
from ..preview import previews
from ..properties.groom_settings import GroomSettings
from ..sessions.reading import Reading
from ..sessions.session import Session
from .studio import Studio


@dataclass(frozen=True)
class ShownGroom:
    """A groom as it is now.

    points: (strand_count, cv_count, 3) [m], world space.
    notes: what the artist should know.
    """

    studio: Studio
    pose: Pose
    points: Floats
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
        studio = _studio(hair, session.rig, session.settings)
        return ShownGroom(studio, session.solver.pose, session.strands, studio.warnings)
    reading = Reading(hair, depsgraph)
    rig = reading.rig()
    studio = _studio(hair, rig, reading.settings)
    notes = (*reading.source.warnings, *rig.notes, *studio.warnings)
    return ShownGroom(studio, rig.rest_pose, rig.strands.grid, notes)


def file_name(name: str) -> str:
    """A data-block's name as that of a file."""
    return re.sub(r"[^\w .-]+", "_", name).strip(" .") or "groom"


def _studio(hair: bpy.types.Object, rig: Rig, settings: GroomSettings) -> Studio:
    ambient = settings[AmbientSettings]
    pictures, _ = chosen_pictures(hair.data.hairloom.card_images)
    occlusion = pipeline.rest_occlusion(rig, ambient), pipeline.head_occlusion(rig, ambient)
    return Studio(rig, *occlusion, settings, pictures)
