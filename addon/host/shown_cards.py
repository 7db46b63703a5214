"""The cards that are shown in place of a groom's strands.

A build takes seconds, so that in a window it goes on beside everything else. What was shown before
stays until it is done; of the settings that change meanwhile the last ones count. In the
background, where nobody waits before a window, cards are built at once.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

import bpy

from ..arrays import Floats
from ..errors import HairloomError
from ..pipeline import Pose, Rig
from ..render.card_snapshot import CardSnapshot
from ..render.snapshot import Snapshot
from .card_builds import Build, BuiltCards, CardForm, CardsDrawn, told
from .card_images import chosen_pictures


def picture_names(group: Any) -> tuple[tuple[str, str], ...]:
    """(texture, picture) of a HAIRLOOM_PG_card_images, by name."""
    chosen = ((name, getattr(group, name)) for name in type(group).__annotations__)
    return tuple((name, image.name_full) for name, image in chosen if image is not None)


def as_shown(snapshot: Snapshot) -> Snapshot:
    """The same with its cards alone where it has any, else with its strands.

    Colours that stand for numbers are seen on strands.
    """
    if snapshot.cards is None or snapshot.debug_view != "none":
        return replace(snapshot, cards=None)
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
    """

    def __init__(self) -> None:
        self._built: BuiltCards | None = None
        self._wanted: tuple[Rig, CardForm] | None = None
        self._build: Build | None = None
        self._shown: CardSnapshot | None = None
        self.warnings: tuple[str, ...] = ()

    @property
    def is_pending(self) -> bool:
        """Whether other cards are on their way."""
        return self._build is not None

    @property
    def counts(self) -> tuple[int, int, int]:
        """Cards, triangles and vertices of what is shown."""
        if self._shown is None:
            return 0, 0, 0
        mesh = self._shown.mesh
        return mesh.card_count, len(mesh.triangles), len(mesh.positions)

    def want(self, hair: bpy.types.Object, rig: Rig, form: CardForm) -> None:
        """Cards of this rig and form from now on; nothing is built twice."""
        if self._is_wanted(rig, form):
            return
        self._wanted = rig, form
        if self._build is None:
            self._begin(hair)

    def collect(self, hair: bpy.types.Object) -> bool:
        """Take over what was built meanwhile; whether there is anything new."""
        build = self._build
        if build is None or not build.serve():
            return False
        self._take()
        if not self._is_wanted(build.rig, build.form):
            self._begin(hair)
        return True

    def now(
        self, rig: Rig, pose: Pose, guides: Callable[[], Floats], drawn: CardsDrawn
    ) -> CardSnapshot | None:
        """The cards as they are now; where the rig is another one, as they were, until those of
        this one are built. None without any.

        Args:
            guides: gives the guides of the rig (guide_count, cv_count, 3) [m, world].
        """
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
            self._build.give_up()
        self._built = self._wanted = self._build = self._shown = None
        self.warnings = ()

    def _begin(self, hair: bpy.types.Object) -> None:
        assert self._wanted is not None
        rig, form = self._wanted
        is_awaited = self._is_awaited()
        self._build = Build(rig, form, self._pictures(hair), is_awaited=is_awaited)
        if is_awaited:
            self._take()

    def _take(self) -> None:
        assert self._build is not None
        build, self._build = self._build, None
        try:
            self._built = build.result()
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
