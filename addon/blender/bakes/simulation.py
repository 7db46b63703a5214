"""The interface of grooms and fins for previews, the timeline and bakes.

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

#: Increase it when the same input gives other motion than before, so that old bakes become stale.
SOLVER_VERSION = 6
CLOTH_VERSION = 2


class Simulation(Protocol):
    """One groom or fin in motion.

    uid: session number of its object. is_playing: whether it is being simulated.
    is_stale: whether its inputs have been edited since they were read.
    All but `uid`, `name`, `bodies`, `stop` and `forget` raise HairloomError when an input is gone
    or broken.
    """

    is_playing: bool
    is_stale: bool

    @property
    def uid(self) -> int: ...

    @property
    def name(self) -> str: ...

    @property
    def bodies(self) -> tuple[Body, ...]:
        """Its object, and the surface that carries it."""

    @property
    def is_made(self) -> bool:
        """Whether everything that the simulation needs is built; else it is being built in the
        background."""

    @property
    def warnings(self) -> tuple[str, ...]:
        """For the artist, each with its remedy."""

    def rest(self, depsgraph: bpy.types.Depsgraph) -> None:
        """Put it into its style, where its body is now, without velocity."""

    def play(
        self, depsgraph: bpy.types.Depsgraph, *, blocking: bool = True, is_frame: bool = False
    ) -> None:
        """Get ready to be simulated, from rest.

        Args:
            blocking: False: do not wait for what has to be built first, such as distance fields of
                colliders.
            is_frame: whether to begin in this very frame if possible: builds of less than a tenth
                of a second are waited for even if not blocking.

        Raises:
            NotReadyError: something is being built, and the call does not wait; it stays at rest
                until then.
        """

    def stop(self, depsgraph: bpy.types.Depsgraph) -> None:
        """Stop simulating and go back to rest."""

    def forget(self) -> None:
        """Cancel what is being built in the background; touches no object."""

    def advance(self, depsgraph: bpy.types.Depsgraph, duration: float) -> None:
        """Simulate the time [s] in which all bodies moved to where they are now."""

    def constants(self) -> Arrays:
        """The arrays that a bake holds once, to show its frames without reading the scene."""

    def bake_arrays(self) -> Arrays:
        """The arrays of this frame, for a bake."""

    def show_recorded(self, frame: Arrays, solids: Solids | None = None) -> None:
        """Show a frame of a bake instead of the simulation.

        Args:
            solids: the frame's colliders, where the bake holds them.
        """

    def rig_hash(self, depsgraph: bpy.types.Depsgraph) -> str:
        """Hashes of the inputs that all frames of a bake depend on."""

    def frame_hash(self, depsgraph: bpy.types.Depsgraph) -> str:
        """Hashes of the inputs that drive this frame."""


def hashes(**parts: Hashed | tuple[Hashed, ...]) -> str:
    """Named hashes: "hair=3f2a settings=91bc" for parts of arrays, settings, text and numbers."""
    return " ".join(f"{name}={_hash(part)}" for name, part in parts.items())


def differences(known: str, now: str) -> tuple[str, ...]:
    """The names of the parts that differ, in words."""
    before, after = (_hashes_by_name(one) for one in (known, now))
    names = [name for name in after if before.get(name) != after[name]]
    names += [name for name in before if name not in after]
    return tuple(name.replace("_", " ") for name in names)


def phrase_of(changed: tuple[str, ...]) -> str:
    """What has changed, by names from `differences`, for a message to the artist."""
    return ", ".join("combed or edited hair" if each == "hair" else each for each in changed)


def _hashes_by_name(named: str) -> dict[str, str]:
    """Hashes by name; a plain hash counts as one part."""
    pairs = (part.rpartition("=") for part in named.split())
    return {name or "what it was made from": value for name, _, value in pairs}


def _hash(part: Hashed | tuple[Hashed, ...]) -> str:
    values = part if isinstance(part, tuple) else (part,)
    return digest(*(each for value in values for each in (value, b"\0")), size=8)
