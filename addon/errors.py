"""The one kind of error that reaches an artist as a message instead of a traceback.

It is in none of the rooms because every room raises it; only `blender` and `ui` turn it into an
operator report, or a line on stderr with a non-zero exit code.
"""

from __future__ import annotations

from collections.abc import Iterable
from difflib import get_close_matches


class HairloomError(Exception):
    """Bad input: what is wrong, where it was found, and what to do about it.

    Args:
        problem: what is wrong, one sentence without a full stop.
        place: the file, object or field in which it was found.
        remedy: what the reader can do, an imperative without a full stop.
    """

    def __init__(self, problem: str, *, place: str, remedy: str) -> None:
        super().__init__(f"{place}: {problem}. {remedy}.")
        self.problem = problem
        self.place = place
        self.remedy = remedy

    def at(self, place: str) -> HairloomError:
        """A copy with another place, such as the name that the artist knows."""
        return HairloomError(self.problem, place=place, remedy=self.remedy)


def did_you_mean(name: str, known: Iterable[str], count: int = 3, similarity: float = 0.6) -> str:
    """The start of a remedy, such as "Did you mean a or b? ", for a wrong name; empty if no known
    one is similar.

    Args:
        similarity: the least, from 0 to 1; see `difflib.get_close_matches`.
    """
    matches = get_close_matches(name, list(known), count, similarity)
    return f"Did you mean {' or '.join(matches)}? " if matches else ""
