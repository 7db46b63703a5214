"""What moves: a groom or a fin, as the window's Play, the timeline and a bake see it.

Rig and frame hashes consist of named hashes, such as "hair=3f2a settings=91bc", so that messages
can say which of them has changed.
"""

from __future__ import annotations

from typing import Any, Protocol

import bpy
from numpy.typing import NDArray

from ...params import Settings
from ...rig_flow import Solids
from ..base.digests import digest
from ..base.objects import Body

type Arrays = dict[str, NDArray[Any]]
type Hashed = NDArray[Any] | Settings | str | float | None

#: Raise it when the same input gives other motion than before, so that old bakes say so.
SOLVER_VERSION = 6
CLOTH_VERSION = 2


class Simulated(Protocol):
    """One groom or fin in motion.

    uid: session number of its object. is_playing: whether it is being simulated.
    is_stale: whether what it was read from has been edited since.
    All but `uid`, `name`, `bodies`, `stop` and `forget` raise HairloomError when what it is made
    of is gone or broken.
    """

    is_playing: bool
    is_stale: bool

    @property
    def uid(self) -> int: ...

    @property
    def name(self) -> str: ...

    @property
    def bodies(self) -> tuple[Body, ...]:
        """Its object, and what that grows on."""

    @property
    def is_made(self) -> bool:
        """Whether nothing that it needs to be simulated is being made beside the window's work."""

    @property
    def warnings(self) -> tuple[str, ...]:
        """What the artist should know, each with its remedy."""

    def rest(self, depsgraph: bpy.types.Depsgraph) -> None:
        """In its style, where its body is now, at no speed."""

    def play(
        self, depsgraph: bpy.types.Depsgraph, *, blocking: bool = True, is_frame: bool = False
    ) -> None:
        """Get ready to be simulated, from rest.

        Args:
            blocking: False: do not wait for what is to be made first, such as fields of colliders.
            is_frame: whether it begins in this very frame if it can: what takes less than a tenth
                of a second is waited for all the same.

        Raises:
            NotMadeYetError: something is being made, and nobody waits; it is as at rest until then.
        """

    def stop(self, depsgraph: bpy.types.Depsgraph) -> None:
        """Simulate no longer; back to rest."""

    def forget(self) -> None:
        """Nobody waits any more for what is on its way; touches no object."""

    def advance(self, depsgraph: bpy.types.Depsgraph, duration: float) -> None:
        """Simulate the time [s] in which everything moved to where it is now."""

    def constants(self) -> Arrays:
        """What a bake needs once: to show its frames without reading anything of the scene."""

    def recorded(self) -> Arrays:
        """This frame."""

    def show_recorded(self, frame: Arrays, solids: Solids | None = None) -> None:
        """Show a frame of a bake in place of what was simulated.

        Args:
            solids: what hair stayed out of in it, where that is known.
        """

    def rig_hash(self, depsgraph: bpy.types.Depsgraph) -> str:
        """Hashes of what a bake depends on in all its frames."""

    def frame_hash(self, depsgraph: bpy.types.Depsgraph) -> str:
        """Hashes of what drives this frame."""


def hashes(**parts: Hashed | tuple[Hashed, ...]) -> str:
    """Named hashes: "hair=3f2a settings=91bc" for parts of arrays, settings, text and numbers."""
    return " ".join(f"{name}={_hash(part)}" for name, part in parts.items())


def differences(known: str, now: str) -> tuple[str, ...]:
    """The names of the parts that differ, in words."""
    before, after = (_parts(one) for one in (known, now))
    names = [name for name in after if before.get(name) != after[name]]
    names += [name for name in before if name not in after]
    return tuple(name.replace("_", " ") for name in names)


def _parts(named: str) -> dict[str, str]:
    """A plain hash counts as one part without a name of its own."""
    pairs = (part.rpartition("=") for part in named.split())
    return {name or "what it was made from": value for name, _, value in pairs}


def _hash(part: Hashed | tuple[Hashed, ...]) -> str:
    values = part if isinstance(part, tuple) else (part,)
    return digest(*(each for value in values for each in (value, b"\0")), size=8)
