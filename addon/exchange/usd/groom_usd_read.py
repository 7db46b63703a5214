"""Reading grooms from the BasisCurves of USD files, whichever prims, bases and primvars they use.

Units, axes and the places of prims come from the file. Strands are read at rest, from default
values or those of the first time, and at all times where they move. A prim with instances is read
once for each; point instancers are not read, and of other geometry only the number is reported.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...arrays import Bools, Floats, Ints
from ...errors import HairloomError
from ...strands.clean import clean
from ..files.axes import to_z_up
from ..files.file_space import FileSpace
from ..groom import Groom
from ..read_groom import ReadGroom, unique_identities, values_of_kept_points
from ..read_motion import join_motions, valid_motion
from .usd_curves import Curves, UnusableCurvesError, read_prim
from .usd_library import usd_arrays
from .usd_reader import Arrays, unpack_prims

#: maximum number of prims that notes name one by one
_MAX_NAMED_PRIMS = 3


def read_usd(
    path: Path,
    *,
    up: str | None = None,
    scale: float | None = None,
    factor: float = 1.0,
    python: Sequence[str] | None = None,
) -> ReadGroom:
    """Read all hair of a file as one groom.

    Args:
        path: .usd, .usdc or .usda.
        up: "Y" or "Z", instead of the file's own.
        scale: metres in one unit, instead of the file's own.
        factor: further factor on lengths.
        python: the command that starts another Python, see `run_reader`.

    Returns:
        The groom: groups as the file has them, or one for each prim; the version of Epic's
        conventions that it names, else ""; notes on all that was changed or left out.

    Raises:
        HairloomError: no OpenUSD, a file that cannot be read, or one without a usable strand.
    """
    content = _UsdContent(usd_arrays(path, python), path, up, scale, factor)
    pieces = list(content.pieces())
    if not pieces:
        raise content.nothing_found()
    groom = _join_pieces(pieces, path, content.name(), content.notes)
    notes = tuple(f"{path.name}: {note}." for note in content.notes)
    return ReadGroom(groom, content.version(), content.axes, notes)


class _UsdContent:
    """The content of a file, and notes on it."""

    def __init__(
        self, arrays: Arrays, path: Path, up: str | None, scale: float | None, factor: float
    ) -> None:
        self.notes: list[str] = []
        self._arrays, self._path = arrays, path
        self._problems: list[str] = []
        self._left_out = ""
        unit = float(arrays["unit"]) if scale is None else scale
        if scale is None and not arrays["has_unit"]:
            self.notes.append("it stores no unit, so lengths were read as centimetres")
        if not (np.isfinite(unit) and unit > 0.0):
            self.notes.append(f"its unit of {unit} m is not valid and was read as a metre")
            unit = 1.0
        self.axes = FileSpace(up or str(arrays["up"]))
        self._to_blender = np.eye(4)
        self._to_blender[:3, :3] = to_z_up(np.eye(3), self.axes.up).T * (unit * factor)

    def pieces(self) -> Iterator[Curves]:
        """The curves of each prim that has usable ones."""
        notes, problems = dict[str, list[str]](), dict[str, list[str]]()
        for prim in unpack_prims(self._arrays):
            path = str(prim["path"])
            try:
                piece = read_prim(prim, self._to_blender)
            except UnusableCurvesError as error:
                problems.setdefault(str(error), []).append(path)
                continue
            for note in piece.notes:
                notes.setdefault(note, []).append(path)
            yield piece
        self._problems = _prim_notes(problems, " was left out", ", were left out")
        self.notes += _prim_notes(notes) + self._problems
        others = zip(self._arrays["others"], self._arrays["other_counts"], strict=True)
        counts = ", ".join(f"{count:,} {kind}" for kind, count in others)
        if counts:
            self._left_out = f"prims other than BasisCurves were left out ({counts})"
            self.notes.append(self._left_out)

    def nothing_found(self) -> HairloomError:
        if self._problems:
            return self._error(
                "none of its curves can be used: " + "; ".join(self._problems[:3]),
                "Export the groom again",
            )
        return self._error(
            "it has no curves" + (f": {self._left_out}" if self._left_out else ""),
            "Choose a file with BasisCurves, or export hair as curves",
        )

    def version(self) -> str:
        """The version of the conventions for grooms that the topmost prim names; "" if none."""
        major, minor = self._arrays["version"].tolist()
        return f"{major}.{minor}" if min(major, minor) >= 0 else ""

    def name(self) -> str:
        """The topmost prim's name, or the file's where that is Blender's "root"."""
        name, label = map(str, self._arrays["prim_names"])
        return self._path.stem if name in ("", "root") else label or name

    def _error(self, problem: str, remedy: str) -> HairloomError:
        return HairloomError(problem, place=str(self._path), remedy=remedy)


def _prim_notes(notes: dict[str, list[str]], one: str = "", many: str = "") -> list[str]:
    """Sentences from notes and the paths of the prims that they are on; one for many prims.

    one, many: text between the path or paths and the note.
    """
    found = []
    for note, paths in notes.items():
        if len(paths) > _MAX_NAMED_PRIMS:
            found.append(f"{len(paths):,} prims, such as {paths[0]}{many}: {note}")
        else:
            found += [f"{path}{one}: {note}" for path in paths]
    return found


def _join_pieces(pieces: list[Curves], path: Path, name: str, notes: list[str]) -> Groom:
    """All pieces as one groom of usable strands; adds to `notes`."""
    counts = np.concatenate([np.diff(piece.offsets) for piece in pieces])
    offsets = np.concatenate([[0], np.cumsum(counts)])
    groups, group_names = _groups(pieces)
    with np.errstate(over="ignore", invalid="ignore"):
        cleaned = clean(
            _concatenated([piece.points for piece in pieces]),
            offsets,
            radius=_concatenated([_radius(piece) for piece in pieces]),
            group=groups,
            root_uv=_all_or_none("root UVs", [piece.root_uv for piece in pieces], notes),
            color=_colors(pieces),
            unusable=_unusable(pieces),
        )
    if not cleaned.strands.strand_count:
        reasons = ", ".join(f"{count:,} with {why}" for why, count in cleaned.dropped.items())
        raise HairloomError(
            f"none of its strands can be used ({reasons})",
            place=str(path),
            remedy="Export the groom again",
        )
    if len(pieces) > 1:
        notes.append(f"its {len(pieces):,} prims of curves were joined into one groom")
    found, motion = join_motions([(piece.times, piece.positions) for piece in pieces]), None
    if found is not None:
        times, positions = found
        kept = np.stack([values_of_kept_points(each, offsets, cleaned) for each in positions])
        motion, note = valid_motion(times, kept)
        notes += [note] if note else []
    return Groom(
        cleaned.strands,
        name=name,
        is_guide=_guides(pieces, cleaned.curve_indices),
        group_names=group_names,
        dropped=cleaned.dropped,
        source=path,
        motion=motion,
        **_identities(pieces, cleaned.curve_indices, notes),
    )


def _unusable(pieces: list[Curves]) -> dict[str, Bools]:
    """Why curves cannot be used -> which of all."""
    none = [np.zeros(piece.curve_count, bool) for piece in pieces]
    return {
        reason: _concatenated(
            [p.unusable.get(reason, no) for p, no in zip(pieces, none, strict=True)]
        )
        for reason in dict.fromkeys(reason for piece in pieces for reason in piece.unusable)
    }


def _concatenated(arrays: list[NDArray[Any]]) -> NDArray[Any]:
    return arrays[0] if len(arrays) == 1 else np.concatenate(arrays)


def _all_or_none(
    what: str, arrays: list[NDArray[Any] | None], notes: list[str]
) -> NDArray[Any] | None:
    """All arrays as one; None if a prim has none, with a note if another one has."""
    known = [array for array in arrays if array is not None]
    if len(known) == len(arrays):
        return _concatenated(known)
    if known:
        notes.append(
            f"{what} were left out, which only {len(known):,} of its {len(arrays):,} prims have"
        )
    return None


def _radius(piece: Curves) -> Floats:
    """A piece's radii; NaN, which `clean` replaces, where they are not known."""
    if piece.radius is not None:
        return piece.radius
    return np.full(len(piece.points), np.nan, np.float32)


def _colors(pieces: list[Curves]) -> Floats | None:
    """The colours of all pieces; NaN, which means no colour, where a prim has none."""
    if all(piece.color is None for piece in pieces):
        return None
    none = np.float32(np.nan)
    return _concatenated(
        [np.full((len(p.points), 3), none) if p.color is None else p.color for p in pieces]
    )


def _groups(pieces: list[Curves]) -> tuple[Ints, dict[int, str]]:
    """Groups as prims have them, else one for each prim; and their names."""
    groups: list[Ints] = []
    names: dict[int, str] = {}
    next_group = (
        max([-1, *(int(piece.group.max()) for piece in pieces if piece.group is not None)]) + 1
    )
    for piece in pieces:
        if piece.group is None:
            groups.append(np.full(piece.curve_count, next_group, np.int32))
            if len(pieces) > 1:
                names[next_group] = piece.name
            next_group += 1
            continue
        groups.append(piece.group)
        if piece.group_name is not None:
            found, firsts = np.unique(piece.group, return_index=True)
            for group, first in zip(found.tolist(), firsts.tolist(), strict=True):
                if piece.group_name[first]:
                    names[group] = piece.group_name[first]
    return _concatenated(groups), names


def _guides(pieces: list[Curves], kept: Ints) -> Bools | None:
    """Which strands are guides; none of those of a prim that does not say."""
    if all(piece.is_guide is None for piece in pieces):
        return None
    flags = [
        np.zeros(piece.curve_count, bool) if piece.is_guide is None else piece.is_guide
        for piece in pieces
    ]
    return _concatenated(flags)[kept]


def _identities(pieces: list[Curves], kept: Ints, notes: list[str]) -> dict[str, Any]:
    """See `unique_identities`."""
    numbers = _all_or_none("IDs", [piece.strand_id for piece in pieces], notes)
    if numbers is None:
        return {}
    known = unique_identities({"strand_id": numbers[kept]}, notes)
    if not known:
        return {}
    closest = _all_or_none("closest guides", [piece.closest_guides for piece in pieces], notes)
    weights = _all_or_none("guide weights", [piece.guide_weights for piece in pieces], notes)
    if closest is None or weights is None:
        return known
    weights = weights[kept]
    broken = int((~np.isfinite(weights)).sum())
    if broken:
        notes.append(
            "closest guides were left out, because some of their weights are not numbers "
            f"({broken:,} of {weights.size:,})"
        )
        return known
    return known | {"closest_guides": closest[kept], "guide_weights": weights}
