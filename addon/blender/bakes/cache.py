"""A bake on disk: one folder, which is there whole or not at all.

    cache.json          version, frames, rate, shapes, hashes (see `Facts`)
    constants.npz       what all frames share
    frame_000123.npz    one frame

Numpy's own format without pickles, so that a file from elsewhere can do no harm. A new bake is
written to NAME.new beside NAME and takes its place when it is whole; what breaks off in between
leaves the old one as it was, and is tidied up by the next who opens the folder.
"""

from __future__ import annotations

import json
import math
import os
import re
from collections import OrderedDict
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Self

import numpy as np

from ...errors import HairloomError
from ...exchange.files.array_file import read_arrays
from .simulated import Arrays

VERSION = 1
FACTS, CONSTANTS = "cache.json", "constants.npz"
_OURS = re.compile(r"cache\.json|constants\.npz|frame_-?\d{5,7}\.npz")
#: A frame has some hundred bytes there; JSON may take twenty times its size in memory.
_LARGEST_FACTS = 1 << 25
#: Frames kept in memory: the one that is shown, and its neighbours for motion blur.
_KEPT = 3


@dataclass(frozen=True)
class Facts:
    """What is known of a bake without reading its frames.

    first, last: scene frames. frame_rate: [1/s].
    form: what computed it. rig_hash, frame_hashes (one for each frame): see `simulated.hashes`.
    hairloom: the version that wrote it.
    """

    owner: str
    first: int
    last: int
    frame_rate: float
    form: str
    rig_hash: str
    hairloom: str
    frame_hashes: tuple[str, ...] = ()

    @property
    def frame_count(self) -> int:
        return self.last - self.first + 1


class CacheWriter:
    """Writes a bake, frame after frame; `finish` puts it in place, `abandon` removes it.

    Raises:
        HairloomError: the folder cannot be written, or holds files that are not of a bake.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self._new, self._old = _beside(folder, ".new"), _beside(folder, ".old")
        self._frame_hashes: list[str] = []
        self._layout: dict[str, list[Any]] = {}
        try:
            recover(folder)
            if folder.exists():
                _check_ours(folder)
            _remove(self._new)
            self._new.mkdir(parents=True)
        except OSError as error:
            raise _unwritable(folder, error) from error

    def add_constants(self, arrays: Arrays) -> None:
        self._save(CONSTANTS, arrays)

    def add(self, frame: int, arrays: Arrays, frame_hash: str) -> None:
        """Frames come in order; all hold arrays of the same names, types and shapes."""
        layout = {name: [str(a.dtype), list(a.shape)] for name, a in arrays.items()}
        assert not self._frame_hashes or layout == self._layout, "the frames of a bake are alike"
        self._layout = layout
        self._frame_hashes.append(frame_hash)
        self._save(_frame_name(frame), arrays)

    def finish(self, facts: Facts) -> None:
        """Replace the earlier bake by this one, complete."""
        assert len(self._frame_hashes) == facts.frame_count, "all frames are there"
        content = {"version": VERSION, **asdict(facts), "layout": self._layout}
        content["frame_hashes"] = self._frame_hashes
        try:
            with open(self._new / FACTS, "w", encoding="utf-8") as file:
                json.dump(content, file, indent=1)
                file.flush()
                os.fsync(file.fileno())
            _remove(self._old)
            if self.folder.exists():
                os.replace(self.folder, self._old)
            os.replace(self._new, self.folder)
            _remove(self._old)
        except OSError as error:
            raise _unwritable(self.folder, error) from error

    def abandon(self) -> None:
        """Leave the folder as it was."""
        _remove(self._new)

    def _save(self, name: str, arrays: Arrays) -> None:
        try:
            with open(self._new / name, "wb") as file:
                np.savez(file, allow_pickle=False, **arrays)
        except OSError as error:
            raise _unwritable(self.folder, error) from error


class Cache:
    """A bake that is read as its frames are asked for.

    Raises:
        HairloomError: there is none, it is damaged, or of a newer version.
    """

    def __init__(self, folder: Path) -> None:
        recover(folder)
        self.folder = folder
        content = _read_facts(folder / FACTS)
        try:
            self._layout = {str(n): (str(d), tuple(s)) for n, (d, s) in content["layout"].items()}
            names = [name for name in Facts.__dataclass_fields__ if name != "frame_hashes"]
            self.facts = Facts(
                **{name: content[name] for name in names},
                frame_hashes=tuple(content["frame_hashes"]),
            )
            _check(self.facts)
        except (KeyError, TypeError, ValueError, AttributeError, OverflowError) as error:
            raise _damaged(folder / FACTS, str(error)) from error
        self._frames: OrderedDict[int, Arrays] = OrderedDict()
        self._constants: Arrays | None = None

    def holds(self, frame: int) -> bool:
        return self.facts.first <= frame <= self.facts.last

    def frame_hash(self, frame: int) -> str:
        return self.facts.frame_hashes[frame - self.facts.first]

    def constants(self) -> Arrays:
        if self._constants is None:
            self._constants = _read_arrays(self.folder / CONSTANTS)
        return self._constants

    def frame(self, frame: int) -> Arrays:
        """The arrays of one frame; do not write to them.

        Raises:
            HairloomError: the file is gone or damaged.
        """
        if frame not in self._frames:
            path = self.folder / _frame_name(frame)
            arrays = _read_arrays(path)
            found = {name: (str(a.dtype), tuple(a.shape)) for name, a in arrays.items()}
            if found != self._layout:
                raise _damaged(path, "its arrays are not those of the other frames")
            self._frames[frame] = arrays
            while len(self._frames) > _KEPT:
                self._frames.popitem(last=False)
        self._frames.move_to_end(frame)
        return self._frames[frame]

    @classmethod
    def found(cls, folder: Path) -> Self | None:
        """The bake in this folder; None where there is none."""
        recover(folder)
        return cls(folder) if (folder / FACTS).is_file() else None


def recover(folder: Path) -> None:
    """Finish, or take back, a replacement that was broken off between its two steps."""
    new, old = _beside(folder, ".new"), _beside(folder, ".old")
    if folder.exists() or not old.is_dir():
        return
    os.replace(new if (new / FACTS).is_file() else old, folder)


def delete(folder: Path) -> None:
    """Delete a bake: its files only, and the folder if nothing else is in it.

    Raises:
        HairloomError: a file cannot be deleted.
    """
    try:
        for each in (folder, _beside(folder, ".new"), _beside(folder, ".old")):
            _remove(each)
    except OSError as error:
        raise _unwritable(folder, error) from error


def _remove(folder: Path) -> None:
    if not folder.is_dir():
        return
    rest = 0
    # the facts go first: without them nobody takes what is left for a bake
    for path in sorted(folder.iterdir()):
        if _OURS.fullmatch(path.name):
            path.unlink()
        else:
            rest += 1
    if not rest:
        folder.rmdir()


def _check_ours(folder: Path) -> None:
    foreign = [path.name for path in folder.iterdir() if not _OURS.fullmatch(path.name)]
    if foreign:
        raise HairloomError(
            f"this folder holds other files too, such as {foreign[0]}",
            place=str(folder),
            remedy="Choose an empty folder, or a new one, for the bake",
        )


def _beside(folder: Path, ending: str) -> Path:
    return folder.with_name(folder.name + ending)


def _frame_name(frame: int) -> str:
    return f"frame_{frame:06d}.npz"


def _read_facts(path: Path) -> dict[str, Any]:
    try:
        if path.stat().st_size > _LARGEST_FACTS:
            raise ValueError(f"it has more than {_LARGEST_FACTS:,} bytes")
        content = json.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError as error:
        raise HairloomError("there is no bake", place=str(path.parent), remedy="Bake") from error
    except (OSError, ValueError, RecursionError) as error:
        raise _damaged(path, str(error)) from error
    version = content.get("version") if isinstance(content, dict) else None
    if not isinstance(version, int):
        raise _damaged(path, "it names no version")
    if version > VERSION:
        raise HairloomError(
            f"this bake was made by a newer Hairloom (version {version} of the format)",
            place=str(path),
            remedy="Update Hairloom, or bake again",
        )
    return content


def _check(facts: Facts) -> None:
    """Raise ValueError or TypeError for what no bake says of itself."""
    if not (isinstance(facts.first, int) and isinstance(facts.last, int)):
        raise TypeError("its frames are no whole numbers")
    texts = (facts.owner, facts.form, facts.rig_hash, facts.hairloom, *facts.frame_hashes)
    if not all(isinstance(text, str) for text in texts):
        raise TypeError("names and hashes are no texts")
    if len(facts.frame_hashes) != facts.frame_count:
        raise ValueError("frames are missing")
    if not (math.isfinite(facts.frame_rate) and facts.frame_rate > 0.0):
        raise ValueError("the frame rate is no positive number")


def _read_arrays(path: Path) -> Arrays:
    """All arrays of a file.

    Raises:
        HairloomError: it is gone or damaged, or claims more than it holds.
    """
    try:
        return read_arrays(path)
    except (OSError, ValueError) as error:
        raise _damaged(path, str(error)) from error


def _damaged(path: Path, why: str) -> HairloomError:
    return HairloomError(
        f"this file of a bake is missing or damaged ({why})", place=str(path), remedy="Bake again"
    )


def _unwritable(folder: Path, error: OSError) -> HairloomError:
    return HairloomError(
        f"the bake cannot be written ({error.strerror or error})",
        place=str(folder),
        remedy="Choose a folder that you may write to, with space left",
    )
