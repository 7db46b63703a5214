"""Long work of which some parts touch no data of Blender's, so that a thread can do them.

A function that works so is a generator. It reads from the scene, yields such a part, gets what that
has made, and writes it into the scene. Who calls it decides where the parts are done:

    at_once                  here and now: scripts, and jobs without a window
    ui.long_work.in_parts    in a thread, while the window shows progress and may cancel
"""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterable, Iterator
from contextlib import contextmanager
from functools import partial
from typing import Any, NamedTuple

import bpy

from ...errors import HairloomError


class Part(NamedTuple):
    """title: what it makes, as a person reads it. work: makes it, from arrays alone."""

    title: str
    work: Callable[[], Any]


type Parts[Result] = Generator[Part, Any, Result]


def at_once[Result](parts: Parts[Result]) -> Result:
    """All parts one after the other; what one raises is raised where the work waits for it."""
    step = partial(next, parts)
    while True:
        try:
            part = step()
        except StopIteration as end:
            result: Result = end.value
            return result
        try:
            step = partial(parts.send, part.work())
        except Exception as error:
            step = partial(parts.throw, error)


def together[Result](
    works: Iterable[Parts[Result]], failed: Callable[[HairloomError], None] | None = None
) -> Parts[list[Result]]:
    """Works of one part each, such as one for each hair: all that may fail or be cancelled is done
    before any of them writes.

    Args:
        failed: gets the error of each work that cannot be done, and the others are; without it, the
            first error is raised.
    """
    begun, results = [], list[Result]()
    for work in works:
        try:
            begun.append((work, (yield next(work))))
        except HairloomError as error:
            if failed is None:
                raise
            failed(error)
    for work, made in begun:
        try:
            work.send(made)
        except StopIteration as end:
            results.append(end.value)
        else:
            raise AssertionError("it has more than one part")
    return results


@contextmanager
def taken_back() -> Iterator[Callable[[], None]]:
    """Data-blocks that are added inside go again if it fails or is cancelled.

    Gives a function to be called after each addition, before the next part: only what was added by
    then goes. They are known by their numbers, since by then another file may have been loaded.
    """
    before, added = _numbers(), set[int]()
    try:
        yield lambda: added.update(_numbers() - before)
    except BaseException:  # being cancelled is none of Exception's
        bpy.data.batch_remove([each for each in _data_blocks() if each.session_uid in added])
        raise


@contextmanager
def new_blocks_removed() -> Iterator[None]:
    """Data-blocks that are added inside go again at the end, however it ends."""
    before = _numbers()
    try:
        yield
    finally:
        bpy.data.batch_remove([each for each in _data_blocks() if each.session_uid not in before])


def _numbers() -> set[int]:
    return {each.session_uid for each in _data_blocks()}


def _data_blocks() -> Iterator[bpy.types.ID]:
    for kind in bpy.data.bl_rna.properties:
        if kind.type == "COLLECTION":
            yield from getattr(bpy.data, kind.identifier)
