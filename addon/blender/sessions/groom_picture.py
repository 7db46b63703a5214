"""What is drawn of one groom while it is previewed, in step with its settings, motion and light."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import bpy

from ...pipeline import Pose, Rig
from ...refine.settings import DetailSettings
from ...render.hair_ball import HairBall
from ...render.snapshot import Snapshot
from ...shading.marschner.tables import DEFAULT_SIZE, PREVIEW_SIZE
from ...shading.settings import ShadingSettings
from ...shading.volume.settings import VolumeSettings
from ...shading.volume.shadow_lights import shadow_warnings
from ...strands import Surface
from ..cards.show import ShownCards
from ..properties.groom_settings import GroomSettings
from ..scene.lights import (
    light_warnings,
    no_light_warnings,
    read_ambient,
    read_lights,
    scene_lights_are_shown,
)
from .making import Made
from .shown import shapes_alike, snapshot_of, with_settings, with_tables
from .solvers import Solver


class GroomPicture:
    """The snapshot of a groom, and the cards in it.

    Args:
        hair: finds the object.
        is_drawn: False leaves out what only drawing needs.
        arrived: see `ShownCards`.
    """

    snapshot: Snapshot

    def __init__(
        self,
        hair: Callable[[], bpy.types.Object],
        *,
        is_drawn: bool,
        arrived: Callable[[], None],
    ) -> None:
        self._is_drawn = is_drawn
        self._ball = HairBall()
        self._made: Made | None = None
        self._light_warnings: tuple[str, ...] = ()
        self.cards = ShownCards(hair, arrived)

    @property
    def warnings(self) -> tuple[str, ...]:
        """What the artist should know about the light."""
        dark = no_light_warnings(self.snapshot.lights, self.snapshot.ambient)
        return (*self._light_warnings, *dark, *self._shadow_warnings())

    def _shadow_warnings(self) -> tuple[str, ...]:
        snapshot = self.snapshot
        if snapshot.volume.shadows == "none" or not snapshot.strand_count:
            return ()
        lights = snapshot.lights if scene_lights_are_shown() else ()
        return shadow_warnings(lights, self._ball.of(snapshot), snapshot.volume)

    def take_made(self, made: Made, settings: GroomSettings) -> None:
        """All that hangs on the strands; it stands at rest, without light."""
        self._made = made
        snapshot = snapshot_of(made.rig, made.occlusion, made.rank)
        self.snapshot = with_settings(snapshot, settings)
        self._want_cards(made.rig, settings)

    def take_settings(self, rig: Rig, was: GroomSettings, now: GroomSettings) -> bool:
        """Take over what acts at once; whether hair has to be shown again where it is."""
        self.snapshot = with_settings(self.snapshot, now)
        if not shapes_alike(was[ShadingSettings], now[ShadingSettings]) and not bpy.app.background:
            self.snapshot = with_tables(self.snapshot, PREVIEW_SIZE)
        is_other = (
            was[DetailSettings].culling != now[DetailSettings].culling
            or was[VolumeSettings].shadows != now[VolumeSettings].shadows
        )
        return self._want_cards(rig, now) or is_other

    def _want_cards(self, rig: Rig, settings: GroomSettings) -> bool:
        """Have cards built if they are to be shown; whether what is shown of them changes now."""
        is_whole = self._made is not None and self._made.is_whole
        if not (self._is_drawn and is_whole and settings.shows_cards):
            self.cards.forget()
            return self.snapshot.cards is not None
        self.cards.want(rig, settings)
        return True

    @property
    def is_coarse(self) -> bool:
        """Whether a slider is being moved, so that it is shaded by tables that are quickly made."""
        return self.snapshot.table_size < DEFAULT_SIZE

    def refine(self) -> None:
        """Shade by tables of full size again."""
        self.snapshot = with_tables(self.snapshot, DEFAULT_SIZE)

    def light(self, depsgraph: bpy.types.Depsgraph) -> None:
        """Take over the scene's lights and world."""
        self.snapshot = replace(
            self.snapshot,
            lights=read_lights(depsgraph, self.snapshot.center),
            ambient=read_ambient(depsgraph.scene),
        )
        self._light_warnings = light_warnings(depsgraph)

    def show(self, rig: Rig, solver: Solver, settings: GroomSettings) -> None:
        """The hair where the solver has it."""
        pose, hiders = solver.pose, None
        known = None if self._made is None else self._made.hiders
        if known is not None and settings[DetailSettings].culling == "hidden":
            hiders = known.at(pose)
        self.snapshot = replace(
            solver.shown(self.snapshot),
            hiders=hiders,
            casters=_casters(rig, pose, settings),
            cards=self.cards.now(rig, pose, solver.guides, settings.sections),
        )


def _casters(rig: Rig, pose: Pose, settings: GroomSettings) -> tuple[Surface, ...]:
    """The head as it is posed, where its shadow is wanted."""
    if (
        rig.head is None
        or pose.head_positions is None
        or settings[VolumeSettings].shadows == "none"
    ):
        return ()
    return (Surface(pose.head_positions, rig.head.triangles),)
