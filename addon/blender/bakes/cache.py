"""A bake on disk: one folder, which holds a complete bake or none.

    cache.json              version, frame range and rate, shapes, hashes (see `Facts`), and
                            `frames`, the name of the folder below
    frames-hl-.../
        constants.npz       arrays that all frames share
        frame_000123.npz    one frame
        cache.json          a copy, so that this folder is a bake by itself

Arrays are in NumPy's format without pickles, so that a file from elsewhere can do no harm. Every
writer makes a frames folder with a unique name, and replaces cache.json last, in one step. So two
writers never mix their frames, a complete bake is there at all times, and nothing that a reader
holds open has to be renamed.
"""

from __future__ import annotations

import contextlib
import json
import math
import re
import shutil
import threading
from collections import OrderedDict
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Self

import numpy as np

from ...dynamics.figures import Figures
from ...errors import HairloomError
from ...exchange.files.array_file import read_arrays
from ...exchange.files.atomic import check_folder_writable, remedy_for, write_bytes_atomic
from ...exchange.files.file_moves import flush_file, flush_folder
from ...exchange.files.file_names import length_remark
from ...exchange.files.stale_temp_files import WRITER_TAG, is_stale, is_temporary, writer_tag
from .baked_solids import VARIABLE_LENGTH
from .simulation import Arrays

#: Version of the format, beyond what `layout` describes. 2: strands may have points of their own.
#: 3: frames hold the strands that were led out of colliders. 4: facts name the device, and
#: constants the start of the motion.
VERSION = 4
#: Arrays whose length may differ between frames.
_VARIABLE_LENGTH = frozenset({"led_strands", "led_points"}) | VARIABLE_LENGTH
FACTS, CONSTANTS = "cache.json", "constants.npz"
_BAKE_FILES = re.compile(r"cache\.json|constants\.npz|frame_-?\d{5,7}\.npz")
_FRAMES_FOLDER = re.compile(rf"frames-{WRITER_TAG}")
#: [bytes]: a frame takes some hundred, and JSON may take twenty times its size in memory.
_MAX_FACTS_BYTES = 1 << 25
#: Frames kept in memory: the one that is shown, and its neighbours for motion blur.
_MAX_FRAMES_IN_MEMORY = 3


@dataclass(frozen=True)
class Facts:
    """The description of a bake, in cache.json.

    owner, file: the object, and the name of its Blender file; empty where that was not saved.
    first, last: scene frames. frame_rate: [1/s].
    device: the one that simulated it. rig_hash, frame_hashes (one per frame): see
    `simulation.hashes`.
    hairloom: the version that wrote it.
    figures: measurements of the motion of hair; None for cloth, and from versions that took none.
    """

    owner: str
    first: int
    last: int
    frame_rate: float
    device: str
    rig_hash: str
    hairloom: str
    file: str = ""
    frame_hashes: tuple[str, ...] = ()
    figures: Figures | None = None

    @property
    def frame_count(self) -> int:
        return self.last - self.first + 1


class CacheWriter:
    """Writes a bake, frame after frame.

    `finish` completes it, `publish` lets it replace the bake before, and `abandon` removes an
    incomplete one.

    Raises:
        HairloomError: the folder cannot be written, or holds files that are not of a bake.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self._frames = folder / f"frames-{writer_tag()}"
        self._frame_hashes: list[str] = []
        self._layout: dict[str, list[Any]] = {}
        self._content: dict[str, Any] = {}
        self._previous_facts: bytes | None = None
        self._is_complete = self._is_published = False
        try:
            if folder.exists():
                _check_no_foreign_files(folder)
                _remove_stale(folder)
            self._frames.mkdir(parents=True)
        except OSError as error:
            raise _write_error(folder, error) from error

    def add_constants(self, arrays: Arrays) -> None:
        self._save(CONSTANTS, arrays)

    def add(self, frame: int, arrays: Arrays, frame_hash: str) -> None:
        """Frames come in order; all hold arrays of the same names, types and shapes, except for the
        lengths of `_VARIABLE_LENGTH`."""
        layout = {name: [kind, list(shape)] for name, (kind, shape) in _layout_of(arrays).items()}
        assert not self._frame_hashes or layout == self._layout, "the frames of a bake are alike"
        self._layout = layout
        self._frame_hashes.append(frame_hash)
        self._save(_frame_name(frame), arrays)

    def finish(self, facts: Facts) -> None:
        """Complete the bake once all frames are written; it is not shown before `publish`.

        Raises:
            HairloomError: it cannot be written.
        """
        assert len(self._frame_hashes) == facts.frame_count, "all frames are there"
        self._content = {"version": VERSION, **asdict(facts), "layout": self._layout}
        self._content["frame_hashes"] = self._frame_hashes
        write_bytes_atomic(self._frames / FACTS, _facts_text(self._content, "."))
        flush_folder(self.folder)
        self._is_complete = True

    def publish(self) -> None:
        """Replace the earlier bake by this one, in one step.

        Raises:
            HairloomError: it cannot be replaced. The new one is kept where the message says.
        """
        current = self.folder / FACTS
        try:
            self._previous_facts = current.read_bytes() if current.is_file() else None
            write_bytes_atomic(current, _facts_text(self._content, self._frames.name))
        except (OSError, HairloomError) as error:
            raise HairloomError(
                "the bake is done, but cannot replace the previous one",
                place=str(self.folder),
                remedy=f"Choose {self._frames} as the folder of the bake, or close other programs "
                "that use this folder and bake again",
            ) from error
        self._is_published = True

    def unpublish(self) -> None:
        """Undo `publish`, since the bake of another object could not be published."""
        if self._is_published and self._previous_facts is not None:
            write_bytes_atomic(self.folder / FACTS, self._previous_facts)
        elif self._is_published:
            (self.folder / FACTS).unlink(missing_ok=True)
        self._is_published = False

    def remove_previous(self) -> None:
        """Remove the frames of the bake before this one.

        Frames that another program holds open stay until a later Blender process bakes here.
        """
        if self._previous_facts is not None:
            _remove_frames(self.folder, _frames_folder_in(self._previous_facts))

    def abandon(self) -> None:
        """Leave the folder as it was; but a complete bake may be hours of work, and stays."""
        if not self._is_complete:
            shutil.rmtree(self._frames, ignore_errors=True)
            _remove_if_empty(self.folder)

    def _save(self, name: str, arrays: Arrays) -> None:
        try:
            with open(self._frames / name, "wb") as file:
                np.savez(file, allow_pickle=False, **arrays)
            flush_file(self._frames / name)
        except OSError as error:
            raise _write_error(self.folder, error) from error


def check_bake_folder(folder: Path) -> None:
    """Refuse, before hours of work, a folder that no bake can be written into. Writes nothing.

    Raises:
        HairloomError: nothing can be written there, or it holds files that are not of a bake.
    """
    check_folder_writable(folder)
    try:
        if folder.exists():
            _check_no_foreign_files(folder)
    except OSError as error:
        raise _write_error(folder, error) from error


class Cache:
    """A bake, whose frames are read on demand.

    Raises:
        HairloomError: there is none, it is damaged, or of another version.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        content = _read_facts(folder / FACTS)
        try:
            self._frame_folder = folder / _checked_name(content["frames"])
            self._layout = {str(n): (str(d), tuple(s)) for n, (d, s) in content["layout"].items()}
            names = Facts.__dataclass_fields__.keys() - {"frame_hashes", "figures"}
            self.facts = Facts(
                **{name: content[name] for name in names},
                frame_hashes=tuple(content["frame_hashes"]),
                figures=Figures.of(content.get("figures")),
            )
            _check_facts(self.facts)
        except (KeyError, TypeError, ValueError, AttributeError, OverflowError) as error:
            raise _damaged(folder / FACTS, str(error)) from error
        self._lock = threading.Lock()  # renders read in their own thread
        self._frames: OrderedDict[int, Arrays] = OrderedDict()
        self._constants: Arrays | None = None

    def has_frame(self, frame: int) -> bool:
        return self.facts.first <= frame <= self.facts.last

    def frame_hash(self, frame: int) -> str:
        return self.facts.frame_hashes[frame - self.facts.first]

    def constants(self) -> Arrays:
        if self._constants is None:
            self._constants = _read_arrays(self._frame_folder / CONSTANTS)
        return self._constants

    def frame(self, frame: int) -> Arrays:
        """The arrays of one frame; do not write to them.

        Raises:
            HairloomError: the file is gone or damaged.
        """
        with self._lock:
            if frame not in self._frames:
                self._frames[frame] = self._read(_frame_name(frame))
                while len(self._frames) > _MAX_FRAMES_IN_MEMORY:
                    self._frames.popitem(last=False)
            self._frames.move_to_end(frame)
            return self._frames[frame]

    def _read(self, name: str) -> Arrays:
        path = self._frame_folder / name
        arrays = _read_arrays(path)
        if _layout_of(arrays) != self._layout:
            raise _damaged(path, "its arrays differ from those of the other frames")
        return arrays

    @classmethod
    def find(cls, folder: Path) -> Self | None:
        """The bake in this folder; None where there is none."""
        return cls(folder) if (folder / FACTS).is_file() else None


def _layout_of(arrays: Arrays) -> dict[str, tuple[str, tuple[int, ...]]]:
    """Type and shape of each array; `_VARIABLE_LENGTH` count as if they were empty."""
    return {
        name: (str(a.dtype), (0, *a.shape[1:]) if name in _VARIABLE_LENGTH else tuple(a.shape))
        for name, a in arrays.items()
    }


def facts_in(folder: Path) -> Facts | None:
    """The facts of the bake in a folder; None where there is none, or a damaged one, which any
    bake may replace."""
    try:
        cache = Cache.find(folder)
    except HairloomError:
        return None
    return None if cache is None else cache.facts


def owner_and_file(folder: Path) -> tuple[str, str]:
    """The object and the file whose bake is in a folder; empty where that is not known."""
    facts = facts_in(folder)
    return ("", "") if facts is None else (facts.owner, facts.file)


def delete(folder: Path) -> None:
    """Delete the files of a bake, and the folder if nothing else is in it.

    Raises:
        HairloomError: a file cannot be deleted.
    """
    try:
        content = (folder / FACTS).read_bytes() if (folder / FACTS).is_file() else b""
        # the facts go first: without them, the files that are left are no bake
        (folder / FACTS).unlink(missing_ok=True)
        _remove(folder / _frames_folder_in(content))
        if folder.is_dir():
            _remove_stale(folder)
            _remove_if_empty(folder)
    except OSError as error:
        raise _write_error(folder, error) from error


def _facts_text(content: dict[str, Any], frames: str) -> bytes:
    return json.dumps(content | {"frames": frames}, indent=1).encode()


def _checked_name(frames: object) -> str:
    """The name of a frames folder as we write them; refuses a path, which could lead anywhere.

    Raises:
        ValueError: it is none.
    """
    if not isinstance(frames, str) or not (frames == "." or _FRAMES_FOLDER.fullmatch(frames)):
        raise ValueError("its frames are in no folder of its own")
    return frames


def _frames_folder_in(facts: bytes) -> str:
    """The frames folder that this content of cache.json names; "." where it names none."""
    try:
        return _checked_name(json.loads(facts)["frames"])
    except (ValueError, TypeError, KeyError, RecursionError):
        return "."


def _remove(folder: Path) -> None:
    """Remove the files of a bake from a folder, and the folder if it is empty then.

    Raises:
        OSError: a file cannot be removed.
    """
    for path in sorted(folder.iterdir()) if folder.is_dir() else ():
        if _BAKE_FILES.fullmatch(path.name):
            path.unlink()
    _remove_if_empty(folder)


def _remove_if_empty(folder: Path) -> None:
    if folder.is_dir() and not folder.is_symlink() and not any(folder.iterdir()):
        folder.rmdir()


def _remove_frames(folder: Path, name: str) -> None:
    """Remove the frames of a replaced bake, except for those that a program holds open."""
    if name != ".":
        shutil.rmtree(folder / name, ignore_errors=True)
        return
    for path in folder.iterdir():
        if path.name != FACTS and _BAKE_FILES.fullmatch(path.name):
            with contextlib.suppress(OSError):
                path.unlink()


def _remove_stale(folder: Path) -> None:
    """Remove frames that cache.json does not name and whose writers are gone."""
    facts = folder / FACTS
    current = _frames_folder_in(facts.read_bytes()) if facts.is_file() else ""
    for path in folder.iterdir():
        name = _FRAMES_FOLDER.fullmatch(path.name)
        if name is not None and path.name != current and is_stale(path, name):
            shutil.rmtree(path, ignore_errors=True)


def _check_no_foreign_files(folder: Path) -> None:
    """Raise HairloomError if a folder holds other files than those of a bake."""
    foreign = [
        path.name
        for path in folder.iterdir()
        if not (_BAKE_FILES.fullmatch(path.name) or _FRAMES_FOLDER.fullmatch(path.name))
        and not is_temporary(path.name)
    ]
    if foreign:
        raise HairloomError(
            f"this folder holds other files too, such as {foreign[0]}",
            place=str(folder),
            remedy="Choose an empty folder, or a new one, for the bake",
        )


def _frame_name(frame: int) -> str:
    return f"frame_{frame:06d}.npz"


def _read_facts(path: Path) -> dict[str, Any]:
    try:
        if path.stat().st_size > _MAX_FACTS_BYTES:
            raise ValueError(f"it has more than {_MAX_FACTS_BYTES:,} bytes")
        content = json.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError as error:
        inner = sorted(each.parent.name for each in path.parent.glob(f"*/{path.name}"))
        of_several = f"Choose one of those in it: {', '.join(inner)}"
        raise HairloomError(
            "there is no bake here",
            place=str(path.parent),
            remedy=of_several if inner else "Bake first, or choose the folder of a bake",
        ) from error
    except UnicodeDecodeError as error:
        raise _damaged(path, "it is not text") from error
    except (OSError, ValueError, RecursionError) as error:
        raise _damaged(path, str(error)) from error
    version = content.get("version") if isinstance(content, dict) else None
    if not isinstance(version, int):
        raise _damaged(path, "it has no version")
    if version > VERSION:
        raise HairloomError(
            f"this bake was made by a newer Hairloom (version {version} of the format)",
            place=str(path),
            remedy="Update Hairloom, or bake again",
        )
    if version < VERSION:
        raise HairloomError(
            f"this bake was made by an older Hairloom (version {version} of the format)",
            place=str(path),
            remedy="Bake again",
        )
    return content


def _check_facts(facts: Facts) -> None:
    """Raise ValueError or TypeError for facts that no bake can have."""
    if not (isinstance(facts.first, int) and isinstance(facts.last, int)):
        raise TypeError("its frames are not whole numbers")
    texts = (
        facts.owner,
        facts.file,
        facts.device,
        facts.rig_hash,
        facts.hairloom,
        *facts.frame_hashes,
    )
    if not all(isinstance(text, str) for text in texts):
        raise TypeError("names or hashes are not text")
    if len(facts.frame_hashes) != facts.frame_count:
        raise ValueError("frames are missing")
    if not (math.isfinite(facts.frame_rate) and facts.frame_rate > 0.0):
        raise ValueError("the frame rate is not a positive number")


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


def _write_error(folder: Path, error: OSError) -> HairloomError:
    why = error.strerror or str(error)
    remark = length_remark(folder / f"frames-{writer_tag()}" / _frame_name(0), why)
    return HairloomError(
        f"the bake cannot be written ({why}{remark})",
        place=str(folder),
        remedy="Choose a folder with a shorter path" if remark else remedy_for(why),
    )
