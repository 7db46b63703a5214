"""The cards that were built last: what makes objects or files of them next does not build them
again."""

from __future__ import annotations

from dataclasses import dataclass

from ...arrays import same_content
from ..base.objects import Handle
from ..base.thread_work import ThreadWork
from .build import CardInputs, MappedCards, built_in_thread, has_gpu


@dataclass(frozen=True, eq=False)
class _Built:
    """is_of_gpu: whether a GPU has drawn their atlas; None: they have none that is drawn."""

    hair: Handle
    inputs: CardInputs
    made: MappedCards
    is_of_gpu: bool | None

    def is_of(self, inputs: CardInputs) -> bool:
        if self.is_of_gpu is not None and self.is_of_gpu != has_gpu():
            return False
        return same_content(self.inputs, inputs)


class KeptCards:
    """One build at most, the main thread's.

    It is known by all that it was built from, bit for bit, so that nobody has to say when it is out
    of date. Whoever has this forgets it where memory is to be free again.
    """

    def __init__(self) -> None:
        self._last: _Built | None = None

    def building(self, inputs: CardInputs, name: str) -> ThreadWork[MappedCards]:
        """Build cards in a thread of this name, or take those that are kept."""
        if self._last is not None and self._last.is_of(inputs):
            made = self._last.made
            return ThreadWork(lambda _: made, name)
        self.forget()  # before others take as much memory
        return ThreadWork(lambda work: built_in_thread(work, inputs), name)

    def keep(self, hair: Handle, inputs: CardInputs, made: MappedCards) -> None:
        """These were built last."""
        self._last = _Built(hair, inputs, made, None if made.build.plan is None else has_gpu())

    def forget(self) -> None:
        self._last = None

    def forget_gone(self) -> None:
        """Forget those of hair that is gone."""
        if self._last is not None and self._last.hair.find() is None:
            self.forget()
