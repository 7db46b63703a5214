"""Writing strands to a file of any format, by its suffix."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Collection, Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from ..arrays import Floats, Ints, rows_of_pieces
from ..errors import HairloomError
from .alembic.groom_alembic import write_groom_alembic
from .files.atomic import write_error
from .files.file_moves import move_file, unused_path
from .files.file_names import identifier_name, name_key, unique_names
from .files.file_set import atomic_file_set, back_up_foreign_files
from .groom import Groom, GroomMotion
from .groom_presets import GroomPreset, selected_strands
from .hair_file import write_hair_file
from .strand_export_settings import StrandExportSettings, layout_of, metres_per_unit
from .strand_formats import ALEMBIC, HAIR, TRESSFX, USD, strand_format
from .tfxbone import write_tfxbone
from .tressfx import STRANDS_AT_ONCE, write_tfx
from .usd.groom_usd import write_usd


@dataclass(frozen=True)
class WrittenStrands:
    """What was written.

    files: all of them, that of the given path first where there is one.
    notes: what the files cannot store of the groom.
    """

    files: tuple[Path, ...]
    notes: tuple[str, ...]


def write_strands(
    path: Path,
    groom: Groom,
    settings: StrandExportSettings | None = None,
    motion: GroomMotion | None = None,
) -> WrittenStrands:
    """Write a groom; all its files are there complete, or what was there before stays.

    Args:
        motion: of the groom's points; for Alembic and USD.

    Raises:
        HairloomError: a suffix, engine or option that does not exist, motion for a format without,
            nothing to write, a library that is missing, or nothing can be written there.
    """
    kind, settings = strand_format(path), settings or StrandExportSettings()
    if motion is not None and not kind.has_motion:
        raise HairloomError(
            f"{kind.title} cannot store motion",
            place=str(path),
            remedy="Write one frame, or choose Alembic (.abc) or USD (.usdc)",
        )
    return _WRITERS[kind.name](path, groom, settings, motion)


def _write_alembic(
    path: Path, groom: Groom, settings: StrandExportSettings, motion: GroomMotion | None
) -> WrittenStrands:
    preset = layout_of(ALEMBIC, settings)
    write_groom_alembic(path, groom, preset, motion=motion)
    counts = groom.strands.point_counts[selected_strands(groom, preset.parts)]
    long = int((counts > preset.max_points).sum())
    notes: tuple[str, ...] = ()
    if long:
        notes = (f"{path.name}: {long:,} strands were resampled to {preset.max_points} points.",)
    return WrittenStrands((path,), notes)


def _write_usd(
    path: Path, groom: Groom, settings: StrandExportSettings, motion: GroomMotion | None
) -> WrittenStrands:
    layout = layout_of(USD, settings)
    strands = selected_strands(groom, layout.parts)
    if motion is not None and len(strands) < groom.strands.strand_count:
        points = rows_of_pieces(strands, groom.strands.offsets)
        motion = replace(motion, positions=_positions_of(motion, points))
    write_usd(
        path,
        _part(groom, strands, layout.parts),
        up=layout.space.up,
        scale=metres_per_unit(USD, settings),
        by_group=layout.splits_groups,
        is_linear=layout.basis == "linear",
        motion=motion,
    )
    return WrittenStrands((path,), ())


def _write_tressfx(
    path: Path, groom: Groom, settings: StrandExportSettings, _motion: GroomMotion | None
) -> WrittenStrands:
    layout, scale = layout_of(TRESSFX, settings), metres_per_unit(TRESSFX, settings)
    count = None if settings.vertex_count == "fit" else int(settings.vertex_count)

    def write(file: Path, part: Groom) -> tuple[str, ...]:
        notes = write_tfx(
            file,
            part,
            up=layout.space.up,
            scale=scale,
            vertex_count=count,
            parts="both",  # they are chosen already
            held_count=settings.held_count,
            multiple_of_64=settings.pad_to_64,
            vertex_uv=settings.point_uv,
        )
        if part.bones is not None:
            strands = part.strands.strand_count
            filled = strands + (-strands % STRANDS_AT_ONCE if settings.pad_to_64 else 0)
            write_tfxbone(file.with_suffix(".tfxbone"), part.bones, filled)
        return notes

    written = _write_files(path, groom, layout, write)
    return replace(written, notes=(*written.notes, *_set_aside_old_bones(written.files)))


def _set_aside_old_bones(written: Collection[Path]) -> tuple[str, ...]:
    """Rename bones of an earlier export, which do not fit the new strands; a note for each.

    Raises:
        HairloomError: they cannot be moved.
    """
    notes = []
    for bones in sorted({file.with_suffix(".tfxbone") for file in written} - set(written)):
        if not bones.is_file():
            continue
        kept = unused_path(bones.with_stem(f"{bones.stem} old"))
        try:
            move_file(bones, kept)
        except OSError as error:
            raise write_error(bones, error.strerror or str(error)) from error
        notes.append(f"{bones.name} belongs to other strands, and is kept as {kept.name}.")
    return tuple(notes)


def _write_hair(
    path: Path, groom: Groom, settings: StrandExportSettings, _motion: GroomMotion | None
) -> WrittenStrands:
    layout, scale = layout_of(HAIR, settings), metres_per_unit(HAIR, settings)

    def write(file: Path, part: Groom) -> tuple[str, ...]:
        return write_hair_file(
            file, part, up=layout.space.up, scale=scale, parts="both", uv=settings.point_uv
        )

    return _write_files(path, groom, layout, write)


type Writer = Callable[[Path, Groom, StrandExportSettings, GroomMotion | None], WrittenStrands]

_WRITERS: dict[str, Writer] = {
    ALEMBIC.name: _write_alembic,
    USD.name: _write_usd,
    TRESSFX.name: _write_tressfx,
    HAIR.name: _write_hair,
}


def _write_files(
    path: Path,
    groom: Groom,
    layout: GroomPreset,
    write: Callable[[Path, Groom], tuple[str, ...]],
) -> WrittenStrands:
    """One file, or one for each group, with what lies beside them."""
    strands = selected_strands(groom, layout.parts)
    groom = _part(groom, strands, layout.parts)
    files = _group_files(path, groom) if layout.splits_groups else {path: np.arange(len(strands))}
    notes: list[str] = []
    with atomic_file_set(next(iter(files))) as folder:
        for file, file_strands in files.items():
            notes += write(folder / file.name, groom.take(file_strands))
        notes += back_up_foreign_files(folder, path, _names_of_earlier_export(files))
        written = sorted(
            (path.with_name(file.name) for file in folder.iterdir()),
            key=lambda file: (file not in files, file.name),
        )
    return WrittenStrands(tuple(written), tuple(notes))


def _names_of_earlier_export(files: Collection[Path]) -> set[str]:
    """The names of files that an earlier export of this has left; none if one of them is missing,
    since the others are then of something else."""
    if not all(file.is_file() for file in files):
        return set()
    return {name for file in files for name in (file.name, file.with_suffix(".tfxbone").name)}


def _group_files(path: Path, groom: Groom) -> dict[Path, Ints]:
    """The file of each group, by its name or number, and the indices of the group's strands."""
    numbers = np.unique(groom.strands.group).tolist()
    if len(numbers) < 2:
        return {path: np.arange(groom.strands.strand_count)}
    names = [identifier_name(groom.group_names.get(number, f"group{number}")) for number in numbers]
    taken = Counter(map(name_key, names))
    endings = unique_names(
        name if taken[name_key(name)] == 1 else f"{name}_{number}"
        for name, number in zip(names, numbers, strict=True)
    )
    return {
        path.with_stem(f"{path.stem}_{ending}"): np.flatnonzero(groom.strands.group == number)
        for ending, number in zip(endings, numbers, strict=True)
    }


def _part(groom: Groom, strands: Ints, parts: str) -> Groom:
    """The chosen strands, without closest guides where these are not in the file."""
    if len(strands) < groom.strands.strand_count:
        groom = groom.take(strands)
    if parts != "both" and groom.closest_guides is not None:
        return replace(groom, closest_guides=None, guide_weights=None)
    return groom


def _positions_of(motion: GroomMotion, points: Ints) -> Iterator[Floats]:
    return (frame[points] for frame in motion.positions)
