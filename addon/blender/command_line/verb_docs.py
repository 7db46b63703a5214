"""The page of the documentation that lists all verbs and their options."""

from __future__ import annotations

import argparse
from collections.abc import Iterable, Iterator

from .verb import Verb

_HEADING = """# Verbs

Every verb of the command line with its options; `VERB --help` says the same.
[command-line.md](command-line.md) says how to call them. This page is made by `make docs` from the
verbs themselves: do not edit it.
"""
#: titles of groups of options that many verbs share, which the page lists once
_SHARED = ("what to work on (files, or objects of the scene)", "settings", "the job")

type Groups = dict[str, list[argparse.Action]]


def page(verbs: Iterable[Verb]) -> str:
    """The text of docs/verbs.md."""
    shared: Groups = {}
    lines = [_HEADING]
    for verb in verbs:
        groups = _groups(verb)
        for title in filter(groups.__contains__, _SHARED):
            shared[title] = max(shared.get(title, []), groups.pop(title), key=len)
        lines += _verb_lines(verb, groups)
    lines += ["## Options that verbs share", ""]
    for title in _SHARED:
        lines += [f"**{_heading(title)}**", "", *_table(shared[title])]
    return "\n".join(lines).rstrip() + "\n"


def _groups(verb: Verb) -> Groups:
    """A verb's options by the titles of their groups, as --help shows them."""
    parser = argparse.ArgumentParser(add_help=False)
    verb.add_all_options(parser)
    found = {str(group.title): list(group._group_actions) for group in parser._action_groups}
    return {title: actions for title, actions in found.items() if actions}


def _verb_lines(verb: Verb, groups: Groups) -> Iterator[str]:
    yield from (f"## `{verb.name}`", "", verb.summary, "")
    actions = [action for group in groups.values() for action in group]
    yield from _table(actions)
    also = ["What to work on"] * verb.takes_hair + ["Settings"] * verb.takes_settings + ["The job"]
    yield f"It also takes the [shared options](#options-that-verbs-share): {', '.join(also)}."
    yield ""


def _table(actions: list[argparse.Action]) -> Iterator[str]:
    yield from ("| Option | Meaning |", "| --- | --- |")
    for action in actions:
        required = " Required." if action.required and action.option_strings else ""
        meaning = (action.help or "").replace("|", "\\|")
        yield f"| `{_usage(action)}` | {meaning}{'.' if required else ''}{required} |"
    yield ""


def _usage(action: argparse.Action) -> str:
    """The form of an option, such as --frames FIRST LAST."""
    name = action.option_strings[0] if action.option_strings else ""
    if action.nargs == 0:
        return "` / `".join(action.option_strings)
    if action.metavar is not None:
        values = action.metavar if isinstance(action.metavar, str) else " ".join(action.metavar)
    elif action.choices is not None:
        values = " / ".join(map(str, action.choices))
    else:
        values = action.dest.upper()
    return f"{name} {values}".strip()


def _heading(title: str) -> str:
    return title[0].upper() + title[1:]
