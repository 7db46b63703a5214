"""The cards that are shown in place of a groom's strands.

A build takes seconds, so that in a window it goes on beside everything else. What was shown before
stays until it is done; of the settings that change meanwhile the last ones count. In the
background, where nobody waits before a window, cards are built at once.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import bpy
import numpy as np

from ...arrays import Floats
from ...errors import HairloomError
from ...pipeline import Pose, Rig
from ...render.card_snapshot import CardSnapshot
from ...render.snapshot import Snapshot
from ..base.thread_work import ThreadWork
from ..properties.card_form import CardForm, CardsDrawn
from .card_builds import BuiltCards, building_cards, built_cards, told
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


@dataclass(frozen=True, eq=False)
class _Building:
    """Cards on their way."""

    rig: Rig
    form: CardForm
    work: ThreadWork[BuiltCards]


class ShownCards:
    """The cards of one groom: those that are shown, and those that are being built.

    warnings: what the artist should know of them, or why there are none.
    """

    def __init__(self) -> None:
        self._built: BuiltCards | None = None
        self._wanted: tuple[Rig, CardForm] | None = None
        self._build: _Building | None = None
        self._shown: CardSnapshot | None = None
        self._others = OtherHair()
        self._motion: Floats = np.eye(4)
        self.warnings: tuple[str, ...] = ()

    @property
    def is_pending(self) -> bool:
        """Whether other cards are on their way."""
        return self._build is not None

    @property
    def asks(self) -> bool:
        """Whether what is on its way waits for `serve`."""
        return self._build is not None and self._build.work.asks

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

    def want(self, hair: bpy.types.Object, rig: Rig, form: CardForm) -> None:
        """Cards of this rig and form from now on; nothing is built twice."""
        if self._is_wanted(rig, form):
            return
        self._wanted = rig, form
        if self._build is None:
            self._begin(hair)

    @property
    def is_shaded_by_others(self) -> bool:
        """Whether other hair shades what is shown."""
        return self._wanted is not None and self._wanted[1].occlusion.others

    @property
    def shaded_by(self) -> frozenset[int]:
        """Session numbers of the other hair that shades what is shown, or what is being built."""
        return self._others.uids

    def shade_again(self, hair: bpy.types.Object) -> None:
        """The same cards once more if other hair is elsewhere or other hair now."""
        if self._wanted is None:
            return
        others = self._read_others(hair)
        if others.is_like(self._others):
            return
        if self._build is not None:
            self._build.work.give_up()
            self._build = None
        self._begin(hair, others)

    def serve(self) -> bool:
        """Do a part of what only the main thread may; whether there is something to collect."""
        return self._build is not None and self._build.work.serve()

    def collect(self, hair: bpy.types.Object) -> None:
        """Take over what was built meanwhile."""
        build, self._build = self._build, None
        assert build is not None
        self._take(build.work.result)
        if not self._is_wanted(build.rig, build.form):
            self._begin(hair)

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
        if self._build is not None:
            self._build.work.give_up()
        self._built = self._wanted = self._build = self._shown = None
        self._others = OtherHair()
        self.warnings = ()

    def _begin(self, hair: bpy.types.Object, others: OtherHair | None = None) -> None:
        assert self._wanted is not None
        rig, form = self._wanted
        pictures = self._pictures(hair)
        self._others = others = others or self._read_others(hair)
        if self._is_awaited():
            self._take(lambda: built_cards(rig, form, pictures, others))
        else:
            self._build = _Building(rig, form, building_cards(rig, form, pictures, others))

    def _read_others(self, hair: bpy.types.Object) -> OtherHair:
        assert self._wanted is not None
        depsgraph = bpy.context.view_layer.depsgraph
        return read_other_hair(self._wanted[1].occlusion, hair, depsgraph, self._motion)

    def _take(self, result: Callable[[], BuiltCards]) -> None:
        try:
            self._built = result()
            self.warnings = self._built.notes
        except HairloomError as error:
            self._built, self._shown, self.warnings = None, None, (told(error),)

    def _is_wanted(self, rig: Rig, form: CardForm) -> bool:
        wanted = self._wanted
        return wanted is not None and wanted[0] is rig and wanted[1] == form

    def _is_awaited(self) -> bool:
        """Whether nothing goes on until cards are built."""
        return bool(bpy.app.background)

    def _pictures(self, hair: bpy.types.Object) -> Mapping[str, Floats]:
        return chosen_pictures(hair.data.hairloom.card_images)[0]
