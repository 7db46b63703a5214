"""Binary USD files (crates), checked before the library opens them.

OpenUSD trusts the counts at the beginnings of a crate's sections: a damaged file of 3 kB made it
fill 5 GB for 40 s. Here they are compared with what that many bytes can hold: LZ4 makes bytes at
most 255 times smaller, and USD's own coding leaves at least two bits of each integer.
"""

from __future__ import annotations

import struct
from pathlib import Path

from ...errors import HairloomError

#: What a crate begins with.
CRATE = b"PXR-USDC"

_HEADER_SIZE = 88
_SECTION_SIZE = 32
_MAX_SECTIONS = 64
_MAX_BYTES = 255  # from one byte of LZ4
_MAX_INTEGERS = 4 * _MAX_BYTES
#: Version from which on sections are compressed.
_COMPRESSED = (0, 4)
#: section -> counts at its beginning, compressed blocks after them
_BLOCKS = {b"FIELDS": (1, 2), b"FIELDSETS": (1, 1), b"PATHS": (2, 3), b"SPECS": (1, 3)}


def check_crate(path: Path) -> None:
    """Refuse a crate whose table of contents, or a section, claims more than is there.

    Raises:
        HairloomError: it does.
    """
    with path.open("rb") as file:
        file_size = file.seek(0, 2)
        if file_size < _HEADER_SIZE:
            raise _damaged(path, "its header", 0)
        file.seek(8)
        version = tuple(file.read(2))
        file.seek(16)
        (contents,) = struct.unpack("<q", file.read(8))
        if not _HEADER_SIZE <= contents <= file_size - 8:
            raise _damaged(path, "the place of its table of contents", 16)
        file.seek(contents)
        (count,) = struct.unpack("<Q", file.read(8))
        if not 0 < count <= min(_MAX_SECTIONS, (file_size - contents - 8) // _SECTION_SIZE):
            raise _damaged(path, "the number of its sections", contents)
        for name, start, size in struct.iter_unpack("<16sqq", file.read(count * _SECTION_SIZE)):
            if start < _HEADER_SIZE or size < 8 or start + size > file_size:
                raise _damaged(path, "the place of a section", contents)
            section = name.rstrip(b"\0")
            file.seek(start)
            if section == b"TOKENS" and size >= 24:
                tokens, full, packed = struct.unpack("<3Q", file.read(24))
                is_sound = tokens <= full <= _MAX_BYTES * packed + size
                is_sound &= packed <= size - 24 or version < _COMPRESSED
            elif section in _BLOCKS and version >= _COMPRESSED:
                is_sound = _is_sound(file.read(size), *_BLOCKS[section])
            else:
                (items,) = struct.unpack("<Q", file.read(8))
                is_sound = items <= size
            if not is_sound:
                raise _damaged(path, f"the section {section.decode('ascii', 'replace')}", start)


def _is_sound(section: bytes, counts: int, blocks: int) -> bool:
    """Whether all blocks lie inside, and the counts match their number of integers."""
    if len(section) < 8 * counts:
        return False
    place, packed = 8 * counts, 0
    for _ in range(blocks):
        if place + 8 > len(section):
            return False
        (size,) = struct.unpack_from("<Q", section, place)
        place += 8 + size
        packed += size
        if place > len(section):
            return False
    claimed = struct.unpack_from(f"<{counts}Q", section)
    return max(claimed) <= _MAX_INTEGERS * packed


def _damaged(path: Path, what: str, byte: int) -> HairloomError:
    return HairloomError(
        f"{what}, at byte {byte:,}, is not valid",
        place=str(path),
        remedy="The file is cut short or damaged: copy or export it again",
    )
