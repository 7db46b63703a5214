"""Imports strands from files into the open scene, as hair curves on a mesh with all attributes.

A file is read without Blender's data, so that a thread can do it: `read_in_thread`. The result is
then added to the scene in one go.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import bpy
import numpy as np

from ...errors import HairloomError
from ...exchange.files import child_process
from ...exchange.files.file_space import FileSpace
from ...exchange.groom import Groom, ReadMotion
from ...exchange.read_groom import ReadGroom
from ...exchange.strand_formats import STRAND_FORMATS, strand_format
from ...exchange.strand_reading import check_scale, read_strands
from ...groom.root_fit import better_fit
from ...groom.roots import bind_roots
from ...groom.size_notes import length_text, size_note
from ...strands import StrandSet, Surface
from ...strands.closest_point import ClosestPointSearch
from ..bakes.groom_hashes import frame_rate
from ..base.outcome import Outcome
from ..base.thread_work import ThreadWork
from ..scene.curves import write_curves
from ..scene.curves_motion import store_motion
from ..scene.groom_attributes import store_groom
from ..scene.mesh_files import scale_object
from ..scene.surfaces import read_surface, uv_map_note
from .child_python import python_for

#: title of each format, and the suffixes of its files
FILE_KINDS = tuple((each.title, each.suffixes) for each in STRAND_FORMATS)
#: treatment of guides beside strands: left out, as hair curves of their own, or among the strands
GUIDE_TREATMENTS = ("leave", "apart", "among")


@dataclass(frozen=True)
class StrandImport:
    """Options for reading files; see `strand_reading.read_strands`.

    guides: one of GUIDES.
    python: the command that starts another Python.
    """

    up: str | None = None
    scale: float = 1.0
    guides: str = "leave"
    python: Sequence[str] | None = None


@dataclass(frozen=True)
class ImportSurface:
    """The mesh that imported hair is bound to, read once for all files.

    name: of the head, as a thread must not access the object.
    surface: in world space, scaled.
    scale: applied to the head when hair is added to the scene.
    notes: for the artist.
    """

    head: bpy.types.Object
    name: str
    surface: Surface
    scale: float = 1.0
    notes: tuple[str, ...] = ()


@dataclass(frozen=True)
class FileStrands:
    """The contents of a file for the scene: each hair with its name, and a report."""

    hair: tuple[tuple[Groom, str], ...]
    outcome: Outcome


def read_import_surface(
    head: bpy.types.Object, depsgraph: bpy.types.Depsgraph, scale: float = 1.0
) -> ImportSurface:
    """The mesh as Blender shows it, scaled about the world's origin.

    Raises:
        HairloomError: it has no faces, or the scale is outside its limits.
    """
    check_scale(scale, "scale of the head")
    surface = read_surface(head, depsgraph, need_uv=False, place=head.name)
    if scale != 1.0:
        surface = replace(surface, positions=surface.positions * np.float32(scale))
    notes = tuple(filter(None, [uv_map_note(head)]))
    return ImportSurface(head, head.name, surface, scale, notes)


def import_strands(
    path: Path,
    surface: ImportSurface | None,
    collection: bpy.types.Collection,
    options: StrandImport | None = None,
) -> tuple[list[bpy.types.Object], Outcome]:
    """Read a file into hair curves, bound to a mesh if there is one.

    Returns:
        The new objects, separate guides last; and a report.

    Raises:
        HairloomError: the file cannot be read, or is of another scale or place than the mesh.
    """
    read = read_file(path, surface, options or StrandImport())
    return add_to_scene(read, surface, collection)


def read_file(path: Path, surface: ImportSurface | None, options: StrandImport) -> FileStrands:
    """Read a file and bind it to the mesh; uses none of Blender's data.

    Raises:
        HairloomError: as `import_strands`.
    """
    read = read_strands(
        path,
        up=options.up,
        scale=options.scale,
        parts="strands" if options.guides == "leave" else "both",
        python=options.python or python_for(path),
    )
    groom, warnings = _bound_groom(read, surface, options, path)
    hair = tuple((each, path.stem + end) for each, end in _separate_grooms(groom, options.guides))
    result = f"{path.name}: {_counts_text(groom)}{_motion_text(groom)}, {_format_text(path, read)}"
    return FileStrands(hair, Outcome(result, read.dropped, (*read.notes, *warnings)))


def read_in_thread(
    paths: Sequence[Path], surface: ImportSurface | None, options: StrandImport
) -> ThreadWork[list[FileStrands | HairloomError]]:
    """Read files in a thread; the result for each is its contents, or the error.

    Giving up the work ends the process that reads.
    """

    def read(path: Path) -> FileStrands | HairloomError:
        try:
            return read_file(path, surface, options)
        except HairloomError as error:
            return error

    def work(thread: ThreadWork[list[FileStrands | HairloomError]]) -> Any:
        # a context variable of this thread alone
        child_process.kill_context.set(thread.kill_context)
        results = []
        for number, path in enumerate(paths, 1):
            counter = f", {number} of {len(paths)}" if len(paths) > 1 else ""
            thread.report(f"Reading {path.name}{counter}")
            results.append(read(path))
        return results

    return ThreadWork(work, "Hairloom import")


def apply_head_scale(surface: ImportSurface) -> None:
    """Give the head its scale."""
    if surface.scale != 1.0:
        scale_object(surface.head, surface.scale)


def add_to_scene(
    read: FileStrands, surface: ImportSurface | None, collection: bpy.types.Collection
) -> tuple[list[bpy.types.Object], Outcome]:
    """Add hair to the scene; returns the new objects, separate guides last, and a report."""
    hair = [_add_groom(groom, name, surface, collection) for groom, name in read.hair]
    cut_notes = [
        f"{name}: {note}" for groom, name in read.hair for note in cut_motion_notes(groom.motion)
    ]
    return hair, replace(read.outcome, warnings=(*read.outcome.warnings, *cut_notes))


def _separate_grooms(groom: Groom, guides: str) -> list[tuple[Groom, str]]:
    """The grooms that become separate objects, each with the suffix of its name."""
    is_guide = groom.is_guide
    if guides != "apart" or is_guide is None or is_guide.all() or not is_guide.any():
        return [(groom, "")]
    unlinked = replace(groom, closest_guides=None, guide_weights=None)
    return [(replace(unlinked.without_guides(), is_guide=None), ""), (unlinked.guides(), " Guides")]


def _add_groom(
    groom: Groom, name: str, surface: ImportSurface | None, collection: bpy.types.Collection
) -> bpy.types.Object:
    hair = write_curves(name, groom.strands, surface and surface.head, collection)
    store_groom(hair.data, groom)
    if groom.motion is not None:
        animate_from_file(hair, groom.motion)
    return hair


def cut_motion_notes(motion: ReadMotion | None) -> tuple[str, ...]:
    """Notes on frames of a file that are left out of the scene."""
    note = "" if motion is None else motion.cut_note(frame_rate(bpy.context.scene))
    return (note,) if note else ()


def animate_from_file(hair: bpy.types.Object, motion: ReadMotion) -> None:
    """Let new curves, in world space, follow the motion of a file, as an animated style."""
    store_motion(hair, *motion.at_frames(frame_rate(bpy.context.scene)))
    hair.parent = None  # the file's motion is in world space: the surface must not carry them too
    hair.hairloom.dynamics.animated_style = True


def _bound_groom(
    read: ReadGroom, ground: ImportSurface | None, options: StrandImport, path: Path
) -> tuple[Groom, tuple[str, ...]]:
    """Strands bound to the mesh, with its UVs at their roots, which Blender's hair tools need."""
    groom = read.groom
    if ground is None:
        note = size_note((path.name, groom.strands.points), None)
        return groom, (note,) if note else ()
    surface = ground.surface
    unbound = groom.strands if surface.corner_uv is None else replace(groom.strands, root_uv=None)
    try:
        bound = bind_roots(unbound, surface, place=path.name)
    except HairloomError as error:
        remedy = _remedy(unbound, read.axes, surface, options)
        if remedy is None:
            raise
        raise HairloomError(error.problem, place=path.name, remedy=remedy) from error
    head = ground.name, surface.positions
    warnings = list(filter(None, [size_note((path.name, groom.strands.points), head)]))
    if distance := bound.looseness(surface):
        remedy = _remedy(unbound, read.axes, surface, options)
        remedy = remedy or "Check the axes and the place of both"
        warnings.append(
            f"{path.name}: its roots lie {length_text(distance)} from {ground.name} (median). "
            f"{remedy}."
        )
    if surface.corner_uv is None:
        warnings.append(
            f"{ground.name}: it has no UVs, so Blender's own hair tools cannot hold these strands. "
            "Unwrap it (Edit Mode, UV > Unwrap)."
        )
    return replace(groom, strands=bound.strands), tuple(warnings)


def _remedy(
    strands: StrandSet, axes: FileSpace, surface: Surface, options: StrandImport
) -> str | None:
    """Which axes and scale would fit the file to the mesh; None: no combination does."""
    up = "Y" if axes.up == "Z" else "Z"
    in_file = axes.to_file(strands.roots)
    candidates = {"": strands.roots, up: replace(axes, up=up).from_file(in_file)}
    fit = better_fit(candidates, ClosestPointSearch(surface))
    if fit is None:
        return None
    wanted, flags = [], []
    if fit.name:
        wanted.append(f"{fit.name} up")
        flags.append(f"--groom-up {fit.name}")
    if fit.factor != 1.0:
        scale = f"{fit.factor * options.scale:.4g}"
        wanted.append(f"a scale of {scale}")
        flags.append(f"--groom-scale {scale}")
    remedy = f"Import it with {' and '.join(wanted)} ({' '.join(flags)})"
    if fit.factor == 1.0:
        return remedy
    return f"{remedy}, or scale the head by {1.0 / fit.factor:.4g}"


def _counts_text(groom: Groom) -> str:
    """Such as "1,200 strands and 60 guides in 3 groups"."""
    guides = 0 if groom.is_guide is None else int(groom.is_guide.sum())
    strands = groom.strands.strand_count - guides
    counts = [f"{strands:,} strands"] if strands else []
    counts += [f"{guides:,} guides"] if guides else []
    groups = len(np.unique(groom.strands.group))
    return " and ".join(counts) + (f" in {groups:,} groups" if groups > 1 else "")


def _motion_text(groom: Groom) -> str:
    return "" if groom.motion is None else f", moving in {len(groom.motion.times):,} frames"


def _format_text(path: Path, read: ReadGroom) -> str:
    title = strand_format(path).title
    return f"{title} {read.version}" if read.version else title
