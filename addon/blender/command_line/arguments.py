"""The words after `--command hairloom`: misspelt options and empty values are refused."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from itertools import pairwise
from typing import Any

from ...errors import HairloomError, did_you_mean

#: between an option and the one that is suggested, so that --object does not suggest --set
_SIMILARITY = 0.7


def option_name(name: str) -> str:
    """How the option with this name in the parsed options is typed: skip_existing is
    --skip-existing."""
    return "--" + name.replace("_", "-")


class VerbParser(argparse.ArgumentParser):
    """The options of a verb. Unknown ones are reported below the usage of this verb, with a
    similar one; argparse itself names them below the list of verbs."""

    def parse_known_args(  # type: ignore[override]
        self, args: Sequence[str] | None = None, namespace: Any = None
    ) -> tuple[Any, list[str]]:
        options, unknown = super().parse_known_args(args, namespace)
        if unknown:
            known = [name for action in self._actions for name in action.option_strings]
            question = did_you_mean(unknown[0].partition("=")[0], known, 1, _SIMILARITY).strip()
            ending = f". {question}" if question else ""
            self.error(f"unrecognized arguments: {' '.join(unknown)}{ending}")
        return options, unknown


def check_empty_values(arguments: Sequence[str]) -> None:
    """Refuse empty values, as from variables that are not set: the job would use something else
    instead, such as the built-in head or the current folder.

    Raises:
        HairloomError: naming the option.
    """
    for before, word in pairwise(["", *arguments]):
        name, equals, value = word.partition("=")
        if not word or (equals and not value and name.startswith("--")):
            raise HairloomError(
                "an empty value is given",
                place=name or before,
                remedy="Give a value or omit it; if it comes from a variable, that may be empty",
            )
