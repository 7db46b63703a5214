"""The cards that are shown in place of a groom's strands.

A build takes seconds, so that in a window it goes on beside everything else. What was shown before
stays until it is done. In the background they are built at once.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial

import bpy
import numpy as np

from ...arrays import Floats
from ...errors import HairloomError
from ...pipeline import Pose, Rig
from ...render.card_snapshot import CardSnapshot
from ...render.snapshot import Snapshot
from ..base import latest_job
from ..base.latest_job import LatestJob, Work
from ..properties.card_form import CardForm, CardsDrawn
from .card_builds import BuiltCards, built_cards, cards_built_in_thread, told
from .card_images import chosen_pictures
from .card_making import order_line
from .occluders import OtherHair, read_other_hair


def as_shown(snapshot: Snapshot) -> Snapshot:
    """The same with its cards alone where it has any, else with its strands.

    Colours that stand for numbers are seen on strands.
    """
    if snapshot.cards is None or snapshot.debug_view != "none":
        return replace(snapshot, cards=None)
    return without_strands(snapshot)


def without_strands(snapshot: Snapshot) -> Snapshot:
    """The same with its cards at most."""
    none = snapshot.strands[:0]
    return replace(
        snapshot,
        strands=none,
        radius=none[..., 0],
        volume_center=snapshot.center,
        device_points=None,
        occlusion=None,
        seed=None,
        guide=None,
        group=None,
        rank=None,
        hiders=None,
    )


class ShownCards:
    """The cards of one groom: those that are shown, and those that are being built.

    warnings: what the artist should know of them, or why there are none.

    Args:
        hair: finds the object. arrived: is called when `collect` has something to take over.
    """

    def __init__(
        self, hair: Callable[[], bpy.types.Object], arrived: Callable[[], None] = lambda: None
    ) -> None:
        self._hair = hair
        self._job = LatestJob[tuple[Rig, CardForm], BuiltCards]("hairloom cards", arrived, _same)
        self._built: BuiltCards | None = None
        self._wanted: tuple[Rig, CardForm] | None = None
        self._shown: CardSnapshot | None = None
        self._others = OtherHair()
        self._motion: Floats = np.eye(4)
        self.warnings: tuple[str, ...] = ()

    @property
    def is_pending(self) -> bool:
        """Whether other cards are on their way."""
        return self._job.is_pending

    @property
    def has_arrived(self) -> bool:
        """Whether `collect` has something to take over."""
        return self._job.has_arrived

    @property
    def counts(self) -> tuple[int, int, int]:
        """Cards, triangles and vertices of what is shown."""
        if self._shown is None:
            return 0, 0, 0
        mesh = self._shown.mesh
        return mesh.card_count, len(mesh.triangles), len(mesh.positions)

    @property
    def lines(self) -> tuple[str, ...]:
        """What is shown, for the panel."""
        if self._built is None or self._shown is None:
            return ("Cards are being built",) if self.is_pending else ()
        cards, triangles, _ = self.counts
        return f"{cards:,} cards, {triangles:,} triangles", order_line(self._built.wrong_share)

    def want(self, rig: Rig, form: CardForm) -> None:
        """Cards of this rig and form from now on; nothing is built twice."""
        if self._wanted is None or not _same(self._wanted, (rig, form)):
            self._wanted = rig, form
            self._build()

    @property
    def is_shaded_by_others(self) -> bool:
        """Whether other hair shades what is shown."""
        return self._wanted is not None and self._wanted[1].occlusion.others

    @property
    def shaded_by(self) -> frozenset[int]:
        """Session numbers of the other hair that shades what is shown, or what is being built."""
        return self._others.uids

    def shade_again(self) -> None:
        """The same cards once more if other hair is elsewhere or other hair now."""
        if self._wanted is None:
            return
        others = self._read_others(self._wanted[1])
        if not others.is_like(self._others):
            self._job.cancel()
            self._build(others)

    def collect(self) -> None:
        """Take over what was built meanwhile."""
        self._take(self._job.take)

    def now(
        self, rig: Rig, pose: Pose, guides: Callable[[], Floats], drawn: CardsDrawn
    ) -> CardSnapshot | None:
        """The cards as they are now; where the rig is another one, as they were, until those of
        this one are built. None without any.

        Args:
            guides: gives the guides of the rig (guide_count, cv_count, 3) [m, world].
        """
        self._motion = pose.matrix
        built = self._built
        if built is None:
            return None
        if built.rig is rig:
            self._shown = built.at(pose, guides(), drawn)
        elif self._shown is not None:
            self._shown = built.drawn(self._shown, drawn)
        return self._shown

    def forget(self) -> None:
        """Strands are shown; cards that are on their way are not waited for."""
        self._job.cancel()
        self._built = self._wanted = self._shown = None
        self._others = OtherHair()
        self.warnings = ()

    def _build(self, others: OtherHair | None = None) -> None:
        """Have what is wanted built; at once where nothing goes on until then."""
        assert self._wanted is not None
        rig, form = self._wanted
        if not latest_job.is_blocking():
            self._job.want(self._wanted, lambda: self._begun(rig, form, others))
            return
        pictures, others = self._read(form, others)
        self._take(lambda: built_cards(rig, form, pictures, others))

    def _begun(self, rig: Rig, form: CardForm, others: OtherHair | None) -> Work[BuiltCards]:
        pictures, others = self._read(form, others)
        return partial(cards_built_in_thread, rig=rig, form=form, pictures=pictures, others=others)

    def _read(
        self, form: CardForm, others: OtherHair | None
    ) -> tuple[Mapping[str, Floats], OtherHair]:
        """The chosen pictures and the other hair as they are now."""
        self._others = others or self._read_others(form)
        return chosen_pictures(self._hair().data.hairloom.card_images)[0], self._others

    def _read_others(self, form: CardForm) -> OtherHair:
        depsgraph = bpy.context.view_layer.depsgraph
        return read_other_hair(form.occlusion, self._hair(), depsgraph, self._motion)

    def _take(self, result: Callable[[], BuiltCards | None]) -> None:
        try:
            built = result()
        except HairloomError as error:
            self._built, self._shown, self.warnings = None, None, (told(error),)
            return
        if built is not None:
            self._built, self.warnings = built, built.notes


def _same(one: tuple[Rig, CardForm], other: tuple[Rig, CardForm]) -> bool:
    return one[0] is other[0] and one[1] == other[1]
