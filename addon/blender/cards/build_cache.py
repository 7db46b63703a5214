"""The cards that were built last, kept so that objects and files can share one build."""

from __future__ import annotations

from dataclasses import dataclass

from ...arrays import same_content
from ..base.objects import Handle
from ..base.thread_work import ThreadWork
from .build import CardInputs, MappedCards, build_in_thread, has_gpu


@dataclass(frozen=True, eq=False)
class _Built:
    """A build. is_of_gpu: whether a GPU has drawn its atlas; None: it has no drawn atlas."""

    hair: Handle
    inputs: CardInputs
    made: MappedCards
    is_of_gpu: bool | None

    def is_of(self, inputs: CardInputs) -> bool:
        if self.is_of_gpu is not None and self.is_of_gpu != has_gpu():
            return False
        return same_content(self.inputs, inputs)


class CardBuildCache:
    """At most one build; for the main thread only.

    A build is found by the content of its inputs, bit for bit, so nothing has to mark it as out of
    date. Its owner calls `forget` to free the memory.
    """

    def __init__(self) -> None:
        self._last: _Built | None = None

    def building(self, inputs: CardInputs, name: str) -> ThreadWork[MappedCards]:
        """Build cards in a thread of this name, or return those that are kept."""
        if self._last is not None and self._last.is_of(inputs):
            made = self._last.made
            return ThreadWork(lambda _: made, name)
        self.forget()  # frees memory before the new build
        return ThreadWork(lambda work: build_in_thread(work, inputs), name)

    def keep(self, hair: Handle, inputs: CardInputs, made: MappedCards) -> None:
        """Keep these cards instead of the last ones."""
        self._last = _Built(hair, inputs, made, None if made.build.plan is None else has_gpu())

    def forget(self) -> None:
        self._last = None

    def forget_gone(self) -> None:
        """Forget the cards if their hair is gone."""
        if self._last is not None and self._last.hair.find() is None:
            self.forget()
