"""Long jobs with parts that use no data of Blender's, so that a thread can run them.

Such a job is a generator. It reads from the scene, yields a part, is sent the part's result, and
writes it into the scene. The caller decides where the parts run:

    run_parts                      in the calling thread: scripts, and jobs without a window
    ui.long_work.steps_of_parts    in a thread, while the window shows progress and may cancel
"""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterable, Iterator
from contextlib import contextmanager
from functools import partial
from typing import Any, NamedTuple

import bpy

from ...errors import HairloomError


class Part(NamedTuple):
    """title: of the result, for the user. work: computes it, from arrays alone."""

    title: str
    work: Callable[[], Any]


type Parts[Result] = Generator[Part, Any, Result]


def run_parts[Result](parts: Parts[Result]) -> Result:
    """Run all parts one after the other; a part's error is raised at the yield of that part."""
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


def batched[Result](
    jobs: Iterable[Parts[Result]], on_error: Callable[[HairloomError], None] | None = None
) -> Parts[list[Result]]:
    """Several jobs of one part each, such as one per hair: all parts, which may fail or be
    cancelled, run before any job writes.

    Args:
        on_error: called with the error of each job that fails, while the others go on; without it,
            the first error is raised.
    """
    started, results = [], list[Result]()
    for job in jobs:
        try:
            started.append((job, (yield next(job))))
        except HairloomError as error:
            if on_error is None:
                raise
            on_error(error)
    for job, part_result in started:
        try:
            job.send(part_result)
        except StopIteration as end:
            results.append(end.value)
        else:
            raise AssertionError("it has more than one part")
    return results


@contextmanager
def new_blocks_removed_on_error() -> Iterator[Callable[[], None]]:
    """Remove data-blocks that were added inside if the block fails or is cancelled.

    Yields a function to call after each addition, before the next part: only data-blocks added
    until then are removed. They are kept by session number, since another file may be loaded
    meanwhile.
    """
    existing, added = _session_uids(), set[int]()
    try:
        yield lambda: added.update(_session_uids() - existing)
    except BaseException:  # to be cancelled raises GeneratorExit, which is no Exception
        bpy.data.batch_remove([each for each in _data_blocks() if each.session_uid in added])
        raise


@contextmanager
def new_blocks_removed() -> Iterator[None]:
    """Remove data-blocks that were added inside at the end, however the block ends."""
    existing = _session_uids()
    try:
        yield
    finally:
        bpy.data.batch_remove([each for each in _data_blocks() if each.session_uid not in existing])


def _session_uids() -> set[int]:
    return {each.session_uid for each in _data_blocks()}


def _data_blocks() -> Iterator[bpy.types.ID]:
    for kind in bpy.data.bl_rna.properties:
        if kind.type == "COLLECTION":
            yield from getattr(bpy.data, kind.identifier)
