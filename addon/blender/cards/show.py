"""The cards that are shown instead of a groom's strands.

A build takes seconds, so with a window it runs in a thread, and the previous cards or strands stay
until it is done. In background mode the call waits for it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial

import bpy
import numpy as np

from ...arrays import Floats
from ...card_flow import CardMeasure
from ...cards.edits import CardEdits
from ...cards.occlusion_settings import CardOcclusionSettings
from ...dynamics.figures import CardFigures
from ...errors import HairloomError
from ...params import SettingsMap
from ...render.card_snapshot import CardSnapshot
from ...render.snapshot import Snapshot
from ...render.strand_layout import NO_STRANDS
from ...rig_flow import Pose, Rig, Solids
from ..base import latest_job
from ..base.latest_job import LatestJob, Work
from ..properties.groom_settings import GroomSettings
from .build import BuiltCards, CardInputs, cards_key, counts_line, order_line
from .edits import read_edits, same_edits
from .occluders import Occluders, read_occluders
from .textures import chosen_pictures


def as_shown(snapshot: Snapshot) -> Snapshot:
    """The snapshot with its cards alone if it has any, else with its strands.

    Debug views, whose colours show numbers, are drawn on strands.
    """
    if snapshot.cards is None or snapshot.debug_view != "none":
        return replace(snapshot, cards=None)
    return without_strands(snapshot)


def without_strands(snapshot: Snapshot) -> Snapshot:
    """The snapshot without strands, with its cards if it has any."""
    return replace(
        snapshot,
        points=np.zeros((0, 3), np.float32),
        radius=np.zeros(0, np.float32),
        layout=NO_STRANDS,
        along=None,
        volume_center=snapshot.center,
        device_points=None,
        occlusion=None,
        openness=None,
        skin_seen=None,
        seed=None,
        guide=None,
        group=None,
        rank=None,
        occluder_spheres=None,
        color=None,
    )


class ShownCards:
    """The cards of one groom: those that are shown, and those that are being built.

    warnings: about the cards, or why there are none.

    Args:
        hair: finds the object. on_result: called when `collect` has cards to take over.
    """

    def __init__(
        self, hair: Callable[[], bpy.types.Object], on_result: Callable[[], None] = lambda: None
    ) -> None:
        self._hair = hair
        self._job = LatestJob[tuple[Rig, GroomSettings], BuiltCards](
            "hairloom cards", on_result, _same
        )
        self._built: BuiltCards | None = None
        self._wanted: tuple[Rig, GroomSettings] | None = None
        self._shown: CardSnapshot | None = None
        self._occluders = Occluders()
        self._edits: CardEdits | None = None
        self._doubts: tuple[str, ...] = ()
        self._motion: Floats = np.eye(4)
        self.warnings: tuple[str, ...] = ()

    @property
    def is_pending(self) -> bool:
        """Whether other cards are being built."""
        return self._job.is_pending

    @property
    def stage(self) -> str:
        """The current stage of cards that are being built."""
        return self._job.stage

    @property
    def has_result(self) -> bool:
        """Whether `collect` has cards to take over."""
        return self._job.has_result

    @property
    def counts(self) -> tuple[int, int, int]:
        """Numbers of cards, triangles and vertices that are shown."""
        if self._shown is None:
            return 0, 0, 0
        mesh = self._shown.mesh
        return mesh.card_count, len(mesh.triangles), len(mesh.positions)

    @property
    def lines(self) -> tuple[str, ...]:
        """Lines about the shown cards, for the panel."""
        if self._built is None or self._shown is None:
            return ()
        cards, triangles, _ = self.counts
        line = counts_line(cards, triangles, self._built.shell_layers)
        return line, order_line(self._built.wrong_fraction)

    def request(self, rig: Rig, settings: GroomSettings) -> None:
        """Show cards of this rig with these settings from now on; the same are not built twice."""
        if self._wanted is None or not _same(self._wanted, (rig, settings)):
            self._wanted = rig, settings
            self._build()

    @property
    def is_shaded_by_others(self) -> bool:
        """Whether other hair occludes the shown cards."""
        return self._wanted is not None and self._wanted[1][CardOcclusionSettings].others

    @property
    def shaded_by(self) -> frozenset[int]:
        """Session numbers of the other hair that occludes the cards shown or being built."""
        return self._occluders.uids

    def look_again(self) -> None:
        """Build the cards again if other hair has moved or changed, or if the artist has edited
        cards in the scene."""
        if self._wanted is None:
            return
        occluders, edits = self._read_occluders(self._wanted[1]), self._read_edits()
        if not (occluders.gives_same_occlusion(self._occluders) and same_edits(edits, self._edits)):
            self._job.cancel()
            self._build(occluders)

    def collect(self) -> None:
        """Take over the cards that were built in the thread."""
        self._take(self._job.take)

    def now(
        self, rig: Rig, pose: Pose, guides: Callable[[], Floats], settings: SettingsMap
    ) -> CardSnapshot | None:
        """The cards in the current pose; while cards of another rig are still shown, as they were.
        None if there are none.

        Args:
            guides: returns the guides of the rig (guide_count, cv_count, 3) [m, world].
        """
        self._motion = pose.matrix
        built = self._built
        if built is None:
            return None
        if built.rig is rig:
            self._shown = built.at(pose, guides(), settings)
        elif self._shown is not None:
            self._shown = built.with_drawing_settings(self._shown, settings)
        return self._shown

    def figures(self, solids: Solids | None) -> CardFigures | None:
        """Stretch of the shown cards, and their depth in colliders; None without cards.

        Args:
            solids: the colliders that they are led out of; None: none.
        """
        built, shown = self._built, self._shown
        if built is None or shown is None:
            return None
        if shown.mesh.triangles is not built.binding.mesh.triangles:  # others are shown as yet
            return None
        measure = CardMeasure(built.rig, built.binding)
        measure.add(shown.mesh, solids)
        return measure.figures

    def forget(self) -> None:
        """Show strands again, and drop cards that are being built."""
        self._job.cancel()
        self._built = self._wanted = self._shown = None
        self._occluders = Occluders()
        self.warnings = ()

    def _build(self, occluders: Occluders | None = None) -> None:
        """Build the wanted cards, in a thread or, where calls block, at once."""
        assert self._wanted is not None
        rig, settings = self._wanted
        if latest_job.is_blocking():
            self._take(lambda: BuiltCards.build(self._read(rig, settings, occluders)))
        else:
            self._job.request(self._wanted, lambda: self._begun(rig, settings, occluders))

    def _begun(
        self, rig: Rig, settings: GroomSettings, occluders: Occluders | None
    ) -> Work[BuiltCards]:
        return partial(BuiltCards.build_in_thread, inputs=self._read(rig, settings, occluders))

    def _read(self, rig: Rig, settings: GroomSettings, occluders: Occluders | None) -> CardInputs:
        """The inputs, with pictures, the artist's edits and other hair as they are now."""
        self._occluders = occluders or self._read_occluders(settings)
        self._edits = self._read_edits()
        pictures, _ = chosen_pictures(self._hair().data.hairloom.card_images)
        return CardInputs(rig, settings.sections, pictures, self._occluders, self._edits)

    def _read_edits(self) -> CardEdits | None:
        """The artist's edits; if they cannot be read, there are none, with a warning."""
        depsgraph = bpy.context.view_layer.depsgraph
        try:
            edits, self._doubts = read_edits(self._hair(), depsgraph, self._motion)
        except HairloomError as error:
            edits, self._doubts = None, (str(error),)
        return edits

    def _read_occluders(self, settings: GroomSettings) -> Occluders:
        depsgraph = bpy.context.view_layer.depsgraph
        return read_occluders(
            settings[CardOcclusionSettings], self._hair(), depsgraph, self._motion
        )

    def _take(self, result: Callable[[], BuiltCards | None]) -> None:
        try:
            built = result()
        except HairloomError as error:
            self._built = self._shown = None
            self.warnings = (f"Strands are shown, because there are no cards. {error}",)
            return
        if built is not None:
            self._built, self.warnings = built, (*built.notes, *self._doubts)


def _same(one: tuple[Rig, GroomSettings], other: tuple[Rig, GroomSettings]) -> bool:
    return one[0] is other[0] and cards_key(one[1]) == cards_key(other[1])
