"""The hair of one groom: what was read of it, what is made of that, and what is being made."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import bpy

from ...pipeline import Pose, Rig
from ..bakes.baked_rig import BakedRig, rig_arrays
from ..bakes.simulated import Arrays
from ..base.latest_job import LatestJob
from ..base.objects import Body
from ..base.thread_work import ThreadWork
from ..properties.groom_settings import GroomSettings
from ..scene.source import Source
from .making import Made, Order, make, placeholder
from .reading import Reading


class Groom:
    """One groom as it was read and made ready to move.

    Args:
        hair: a hair curves object.
        baked: the rig of a bake of this very groom, to be the same to the bit.
        is_drawn: False leaves out what only drawing needs.
        blocking: False: the hair is made in a thread, with a few strands as its placeholder.
        arrived: is called when hair can be taken over that was made in a thread.

    Raises:
        HairloomError: no hair curves, none that can be used, or of another scale than the head.
    """

    def __init__(
        self,
        hair: bpy.types.Object,
        depsgraph: bpy.types.Depsgraph,
        baked: BakedRig | None,
        *,
        is_drawn: bool,
        blocking: bool,
        arrived: Callable[[], None],
    ) -> None:
        self._reading = Reading(hair, depsgraph)
        self._reading.use_bake(baked)
        self._is_drawn = is_drawn
        self._job = LatestJob[Order, Made]("hair", arrived)
        order = self._reading.ordered
        self.made: Made = make(order, is_drawn=is_drawn) if blocking else placeholder(order)
        if not blocking:
            self._begin()

    @property
    def uid(self) -> int:
        return self.hair.handle.uid

    @property
    def name(self) -> str:
        return self._reading.name

    @property
    def hair(self) -> Body:
        return self._reading.hair

    @property
    def head(self) -> Body | None:
        return self._reading.head

    @property
    def source(self) -> Source:
        return self._reading.source

    @property
    def settings(self) -> GroomSettings:
        """What the artist has set, as far as it is taken over."""
        return self._reading.settings

    @property
    def rig(self) -> Rig:
        return self.made.rig

    @property
    def is_made(self) -> bool:
        """Whether there is hair to be shown; False until the first one is made."""
        return self.made.is_whole

    @property
    def is_pending(self) -> bool:
        """Whether hair is being made, the first or other hair."""
        return self._job.is_pending

    @property
    def has_arrived(self) -> bool:
        """Whether the hair that was being made can be taken over."""
        return self._job.has_arrived

    def has_another_head(self) -> bool:
        """Whether the artist has set another surface since the session began."""
        return self._reading.has_another_head()

    def constants(self) -> Arrays:
        """See `baked_rig.rig_arrays`."""
        return rig_arrays(self.rig, self._reading.rests)

    def fingerprint(self, depsgraph: bpy.types.Depsgraph) -> str:
        """See `simulated.Simulated`."""
        return self._reading.fingerprint(depsgraph)

    def moment(self, depsgraph: bpy.types.Depsgraph) -> str:
        """See `simulated.Simulated`."""
        return self._reading.moment(self._pose(depsgraph), depsgraph)

    def _pose(self, depsgraph: bpy.types.Depsgraph) -> Pose:
        return self._reading.pose(self.rig, depsgraph)

    def _begin(self) -> None:
        """Have made what was ordered last, once nothing else is being made."""
        order = self._reading.ordered
        self._job.want(order, lambda: partial(_made_in_thread, order=order, before=self.made))


def _made_in_thread(work: ThreadWork[Made], order: Order, before: Made) -> Made:
    return make(order, before, is_drawn=True, report=work.report)
