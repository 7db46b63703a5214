"""Strands of one point count as grids, (strand_count, point_count, 3)."""

from __future__ import annotations

from hairloom.addon.arrays import Floats
from hairloom.addon.blender.bakes import playback
from hairloom.addon.blender.bakes.cache import Cache
from hairloom.addon.blender.sessions.session import Session


def strand_grid(session: Session) -> Floats:
    """The strands that a session shows."""
    return session.strands.reshape(session.rig.strands.strand_count, -1, 3)


def baked_grid(cache: Cache, frame: int, subframe: float = 0.0) -> Floats:
    strands = playback.rig_in(cache).rig.strands
    return playback.strands_in(cache, frame, subframe).reshape(strands.strand_count, -1, 3)
