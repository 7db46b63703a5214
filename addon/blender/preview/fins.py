"""Starting the preview of fins: by the artist, or when grooms play."""

from __future__ import annotations

import bpy

from ...errors import HairloomError
from ..sessions.fins import FinSession, fins_in
from . import previews


def start(obj: bpy.types.Object, depsgraph: bpy.types.Depsgraph) -> FinSession:
    """Preview this fin: Play, playback and its bake move it from now on.

    Raises:
        HairloomError: it is not a fin, or cannot be cloth.
    """
    session = FinSession(obj, depsgraph)
    previews.add(session, depsgraph)
    return session


def start_enabled(depsgraph: bpy.types.Depsgraph) -> list[str]:
    """Preview all fins of the view layer for which *Simulate* is on; returns warnings."""
    warnings = []
    for obj in fins_in(bpy.context.view_layer):
        if obj.hairloom.fin.enabled and previews.simulation_of(obj) is None:
            try:
                start(obj, depsgraph)
            except HairloomError as error:
                warnings.append(str(error))
    return warnings
