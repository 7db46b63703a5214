"""The snapshot of a groom for drawing, from its rig and settings; for previews, it is kept in step
with settings, motion and light."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import bpy
import numpy as np

from ...arrays import Floats, are_same
from ...groom.painted_color import PaintedColor
from ...light_flow import HairLight
from ...paint_flow import with_colors
from ...refine.settings import DetailSettings
from ...render.hair_ball import HairBall
from ...render.snapshot import SECTIONS, Snapshot
from ...render.strand_layout import StrandLayout
from ...rig_flow import Pose, Rig, Solids, strand_seeds
from ...shading.marschner.look import fibre_of
from ...shading.marschner.tables import DEFAULT_SIZE, PREVIEW_SIZE, shape_of
from ...shading.settings import ShadingSettings
from ...shading.volume.settings import VolumeSettings
from ...shading.volume.shadow_lights import shadow_warnings
from ...shading.wet_and_dusty import is_wet_or_dusty
from ...strands import Surface
from ..cards.show import ShownCards
from ..properties.groom_settings import GroomSettings
from ..scene.lights import (
    light_warnings,
    no_light_warnings,
    read_lights,
    scene_lights_are_shown,
)
from ..scene.world import read_environment, world_notes
from .prepared_groom import PreparedGroom
from .solvers import Solver


def snapshot_of(groom: PreparedGroom) -> Snapshot:
    """The groom at rest, with everything that does not change while it moves."""
    strands, light = groom.rig.strands, groom.light
    snapshot = Snapshot(
        points=strands.points,
        radius=strands.radius,
        layout=StrandLayout(strands.offsets),
        along=strands.uneven_length_fractions,
        guide=np.ascontiguousarray(groom.rig.weights.guide[:, 0]),
        group=strands.group,
        rank=groom.rank,
        seed=strand_seeds(groom.rig),
        extinction=groom.rig.widths.extinction,
        spacing=groom.rig.widths.spacing,
        color=strands.color,
    )
    return snapshot if light is None else with_light(snapshot, light)


def with_light(snapshot: Snapshot, light: HairLight) -> Snapshot:
    """The snapshot with this light at its points."""
    return replace(
        snapshot, occlusion=light.occlusion, openness=light.openness, skin_seen=light.skin_seen
    )


def with_settings(snapshot: Snapshot, settings: GroomSettings) -> Snapshot:
    """The snapshot with these settings."""
    sections: dict[str, Any] = {name: settings[kind] for name, kind in SECTIONS.items()}
    sections["volume"] = settings[VolumeSettings].multiplied(extinction=snapshot.extinction)
    return replace(snapshot, debug_view=settings.debug_view, **sections)


def with_tables(snapshot: Snapshot, size: int) -> Snapshot:
    """The snapshot with look-up tables of this size, if its hair uses any."""
    return snapshot if snapshot.table_size == size else replace(snapshot, table_size=size)


def uses_same_tables(one: ShadingSettings, other: ShadingSettings) -> bool:
    """Whether `other` needs no new look-up tables; a change of colour never does."""
    if other.model != "marschner":
        return True
    return one.model == other.model and shape_of(fibre_of(one)) == shape_of(fibre_of(other))


def with_all_strands(snapshot: Snapshot) -> Snapshot:
    """The snapshot without culling and occluder spheres, so that all strands are drawn."""
    return replace(snapshot, occluder_spheres=None, detail=replace(snapshot.detail, culling="none"))


class GroomPicture:
    """The snapshot of a groom, and the cards in it.

    Args:
        hair: returns the object.
        is_drawn: False leaves out what only drawing needs.
        on_result: see `ShownCards`.
    """

    snapshot: Snapshot
    #: the posed head, world space
    head: Surface | None = None

    def __init__(
        self,
        hair: Callable[[], bpy.types.Object],
        *,
        is_drawn: bool,
        on_result: Callable[[], None],
    ) -> None:
        self._is_drawn = is_drawn
        self._ball = HairBall()
        self._groom: PreparedGroom | None = None
        self._colors: PaintedColor | None = None
        self._card_rigs: tuple[Rig, Rig] | None = None
        self._light_warnings: tuple[str, ...] = ()
        self.cards = ShownCards(hair, on_result)

    @property
    def warnings(self) -> tuple[str, ...]:
        """Warnings about lights, world and shadows."""
        dark = no_light_warnings(self.snapshot.lights, self.snapshot.ambient)
        return (*self._light_warnings, *dark, *self._shadow_warnings())

    def _shadow_warnings(self) -> tuple[str, ...]:
        snapshot = self.snapshot
        if snapshot.volume.shadows == "none" or not snapshot.strand_count:
            return ()
        lights = snapshot.lights if scene_lights_are_shown() else ()
        return shadow_warnings(lights, self._ball.ball(snapshot), snapshot.volume)

    def take_groom(
        self, groom: PreparedGroom, settings: GroomSettings, colors: PaintedColor | None
    ) -> None:
        """Make the snapshot of a new groom, at rest and without lights.

        Args:
            colors: colours painted under its strands.
        """
        self._groom = groom
        self.snapshot = with_settings(snapshot_of(groom), settings)
        self.take_colors(groom.rig, colors, settings)
        self._want_cards(groom.rig, settings)

    def take_hair_light(self, groom: PreparedGroom) -> None:
        """Use the light of this groom, which has as many strands and points as the one before."""
        assert groom.light is not None
        self._groom = groom
        self.snapshot = with_light(self.snapshot, groom.light)

    def take_colors(self, rig: Rig, colors: PaintedColor | None, settings: GroomSettings) -> None:
        """Use other painted colours on the same strands, those of this rig; cards get them in
        `take_settings`."""
        self._colors = colors
        found = with_colors(rig.strands, colors, settings[ShadingSettings]).color
        if not are_same(found, self.snapshot.color):
            self.snapshot = replace(self.snapshot, color=found)

    def take_settings(self, rig: Rig, was: GroomSettings, now: GroomSettings) -> bool:
        """Take over settings that act at once; returns whether `show` must be called again."""
        looks = was[ShadingSettings], now[ShadingSettings]
        if looks[0] != looks[1] and any(look.color_map or is_wet_or_dusty(look) for look in looks):
            self.take_colors(rig, self._colors, now)
        self.snapshot = with_settings(self.snapshot, now)
        if (
            not uses_same_tables(was[ShadingSettings], now[ShadingSettings])
            and not bpy.app.background
        ):
            self.snapshot = with_tables(self.snapshot, PREVIEW_SIZE)
        is_other = (
            was[DetailSettings].culling != now[DetailSettings].culling
            or was[VolumeSettings].shadows != now[VolumeSettings].shadows
        )
        return self._want_cards(rig, now) or is_other

    def _want_cards(self, rig: Rig, settings: GroomSettings) -> bool:
        """Have cards built if they are to be shown; returns whether `show` must be called again."""
        is_whole = self._groom is not None and not self._groom.is_placeholder
        if not (self._is_drawn and is_whole and settings.shows_cards):
            self.cards.forget()
            return self.snapshot.cards is not None
        self._card_rigs = rig, _with_color(rig, self.snapshot.color)
        self.cards.request(self._card_rigs[1], settings)
        return True

    @property
    def is_coarse(self) -> bool:
        """Whether it is shaded with coarse, quickly made tables, as while a slider moves."""
        return self.snapshot.table_size < DEFAULT_SIZE

    def refine(self) -> None:
        """Shade with tables of full size again."""
        self.snapshot = with_tables(self.snapshot, DEFAULT_SIZE)

    def _painted(self, rig: Rig) -> Rig:
        """The rig in the colours with which its cards were requested."""
        known = self._card_rigs
        return known[1] if known is not None and known[0] is rig else rig

    def take_lights(self, depsgraph: bpy.types.Depsgraph) -> None:
        """Take over the scene's lights and world."""
        environment = read_environment(depsgraph.scene, blocking=bpy.app.background)
        self.snapshot = replace(
            self.snapshot,
            lights=read_lights(depsgraph, self.snapshot.center, environment.suns),
            ambient=environment.ambient,
            harmonics=environment.harmonics,
        )
        self._light_warnings = (
            *light_warnings(depsgraph, environment.suns),
            *world_notes(depsgraph.scene),
        )

    def show(
        self, rig: Rig, solver: Solver, settings: GroomSettings, solids: Solids | None
    ) -> None:
        """Show the hair where the solver has it, with cards led out of these solids, if any."""
        pose, spheres = replace(solver.pose, solids=solids), None
        known = None if self._groom is None else self._groom.occluders
        if known is not None and settings[DetailSettings].culling == "hidden":
            spheres = known.at(pose)
        self.head = _head(rig, pose, self.head)
        is_shadowed = settings[VolumeSettings].shadows != "none"
        self.snapshot = replace(
            solver.with_strands(self.snapshot),
            occluder_spheres=spheres,
            casters=() if self.head is None or not is_shadowed else (self.head,),
            cards=self.cards.now(self._painted(rig), pose, solver.guides, settings.sections),
        )


def _with_color(rig: Rig, color: Floats | None) -> Rig:
    strands = rig.strands
    return rig if strands.color is color else replace(rig, strands=replace(strands, color=color))


def _head(rig: Rig, pose: Pose, known: Surface | None) -> Surface | None:
    """The posed head, world space; the known one if it has not moved, so that nothing is computed
    or uploaded again."""
    if rig.head is None or pose.head_positions is None:
        return None
    if (
        known is not None
        and known.triangles is rig.head.triangles
        and np.array_equal(known.positions, pose.head_positions)
    ):
        return known
    return Surface(pose.head_positions, rig.head.triangles)
