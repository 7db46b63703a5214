"""Names that every program and file system accepts."""

from __future__ import annotations

import errno
import hashlib
import os
import re
import unicodedata
from collections.abc import Container, Iterable
from pathlib import Path

from ...errors import HairloomError

#: Names that Windows keeps for devices, with any suffix.
_DEVICES = re.compile(r"(con|prn|aux|nul|com[0-9¹²³]|lpt[0-9¹²³])(\..*)?", re.IGNORECASE)
_UNSAFE = re.compile(r"[^\w\-. ]+")
#: Maximum characters of a path: Windows accepts more only where it and the program are set up for
#: it.
MAX_PATH = 259 if os.name == "nt" else 4095
#: Maximum characters of a folder's name, in at most 200 bytes; Windows has 260 for a whole path.
_MAX_LETTERS = 50


def check_utf8_name(path: Path) -> None:
    """Refuse a path that most libraries cannot take.

    Raises:
        HairloomError: it is not UTF-8, as on a disk of another system.
    """
    try:
        str(path).encode("utf-8")
    except UnicodeEncodeError as error:
        raise HairloomError(
            "this name is not UTF-8, so few programs can open it",
            place=ascii(str(path)),
            remedy="Rename the file or the folder",
        ) from error


def with_added_suffix(path: Path, suffix: str) -> Path:
    """The path with a suffix after its name, whatever dots that has.

    Raises:
        HairloomError: it ends without a name, as "" and ".." do.
    """
    if path.name in ("", ".."):
        raise HairloomError(
            "it names no file", place=f"'{path}'", remedy=f"Name one, such as hair{suffix}"
        )
    return path.with_name(path.name + suffix)


def length_remark(path: Path, why: str) -> str:
    """A remark for where the system reports a path as missing that is too long for it; else ""."""
    length = len(os.path.abspath(path))
    if why != os.strerror(errno.ENOENT) or length <= MAX_PATH:
        return ""
    return f"; while it is written its path has {length} letters, and {MAX_PATH} work here"


def identifier_name(name: str, fallback: str = "hair") -> str:
    """A name of letters, digits and underscores that starts with no digit; letters of all scripts.

    Slashes, dots and the like, which are paths or namespaces to one program or another, become
    underscores. That makes it an identifier, as USD wants it (UAX #31).
    """
    composed = unicodedata.normalize("NFC", name)
    plain = "".join(sign if f"a{sign}".isidentifier() else "_" for sign in composed)
    if not plain.strip("_"):
        return fallback
    return plain if plain.isidentifier() else f"_{plain}"


def safe_folder_name(name: str, used_keys: Container[str] = (), fallback: str = "hair") -> str:
    """A name for a folder that every system accepts, and that leads nowhere else.

    Args:
        used_keys: names that are in use, in the form of `name_key`.
    """
    composed = unicodedata.normalize("NFC", name)
    plain = _UNSAFE.sub("_", composed).strip(". ") or fallback
    if len(plain) > _MAX_LETTERS:  # versions of a long name often differ at its end alone
        digest = hashlib.sha256(plain.encode()).hexdigest()[:8]
        plain = f"{plain[: _MAX_LETTERS - 9].strip('. ')}_{digest}"
    return _unused_name(avoid_device_name(plain), used_keys)


def avoid_device_name(name: str) -> str:
    """This name, or another one where Windows would open a device by it."""
    return f"_{name}" if _DEVICES.fullmatch(name) else name


def unique_names(names: Iterable[str]) -> list[str]:
    """These names, with a number added to those that equal an earlier one on some system."""
    found: list[str] = []
    used_keys: set[str] = set()
    for name in names:
        found.append(_unused_name(name, used_keys))
        used_keys.add(name_key(found[-1]))
    return found


def _unused_name(name: str, used_keys: Container[str]) -> str:
    choices = (name, *(f"{name}_{number}" for number in range(2, 10_000)))
    return next(each for each in choices if name_key(each) not in used_keys)


def name_in_other_case(path: Path) -> str:
    """The name of another file in the folder that equals this one on systems that ignore case; ""
    where there is none."""
    wanted = name_key(path.name)
    there = sorted(path.parent.iterdir()) if path.parent.is_dir() else []
    alike = (each for each in there if each.name != path.name and name_key(each.name) == wanted)
    # where the system itself ignores case, the other name is this file's
    return next((each.name for each in alike if not _is_same_file(each, path)), "")


def _is_same_file(path: Path, other: Path) -> bool:
    return other.exists() and os.path.samefile(path, other)


def name_key(name: str) -> str:
    """A form that is the same for names that any system takes as one, as Windows and macOS ignore
    case."""
    return unicodedata.normalize("NFC", name).casefold()
