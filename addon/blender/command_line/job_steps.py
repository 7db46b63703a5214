"""Jobs of the command line, and the steps that verbs share, from files to a picture."""

from __future__ import annotations

import argparse
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from pathlib import Path
from typing import Any, Self

import bpy
import numpy as np

from ...arrays import Floats
from ...cards.edits import CardEdits
from ...dynamics.settings import DynamicsSettings
from ...errors import HairloomError
from ...groom.children_settings import ChildrenSettings
from ...groom.masks import Mask, Masks, mask_names
from ...groom.painted_color import PaintedColor
from ...groom.settings import GrowSettings, GuideSettings
from ...groom.width_settings import WidthSettings
from ...paint_flow import with_painted_colors
from ...params import Settings, SettingsMap
from ...rig_flow import Pose, Rig
from ...shading.ambient_settings import AmbientSettings
from ...shading.settings import ShadingSettings
from ...wet_flow import effective_settings
from ..bakes.guide_motion import BakedGuides
from ..base.report import Report
from ..cards.edits import read_edits
from ..colliders.rigs import rig_from
from ..colliders.ties import TrackedHolders
from ..pictures.group_studio import GroupStudio, PosedCompanion
from ..pictures.studio import Studio
from ..properties.groom_settings import GroomSettings
from ..scene.curves import read_curves
from ..scene.masks import MaskReader
from ..scene.painted_colors import painted_colors
from ..scene.source import Source
from ..sessions.prepared_groom import prepare_groom
from .inputs import (
    BUILT_IN,
    Inputs,
    Sources,
    check_groom,
    find_head_name,
    read_head,
    read_head_look,
    read_inputs,
)
from .object_settings import find_hair

#: facts of the report that are summed over several grooms, and those of which the largest counts
_SUMS = ("strands", "guides", "held_strands", "children", "points")
_EXTREMES = ("cv_count", "points_of_a_strand_max")
#: facts that are only reported for each groom
_OF_EACH = ("widths", "children_line")
#: settings that a bake is made with, and keeps
_BAKED = (GrowSettings, GuideSettings, ChildrenSettings, WidthSettings, DynamicsSettings)


@dataclass(frozen=True)
class Job:
    """One call of a verb: its inputs, settings, output and report.

    stored_settings: as the artist chose them; `settings`: as they act where hair is wet or dusty.
    others: where several grooms are named, a job for each but the first.
    """

    verb: str
    sources: Sources
    stored_settings: SettingsMap
    output: Path
    options: argparse.Namespace
    report: Report
    others: tuple[Job, ...] = ()

    @property
    def parts(self) -> tuple[Job, ...]:
        """A job for each groom, this one first."""
        return (self, *self.others)

    @property
    def names(self) -> tuple[str, ...]:
        """The names of the grooms: of objects, or of files without their suffixes."""
        return tuple(
            each.sources.groom
            if each.hair is not None and each.sources.groom
            else Path(each.sources.groom or BUILT_IN).stem
            for each in self.parts
        )

    @cached_property
    def settings(self) -> SettingsMap:
        return effective_settings(self.stored_settings)

    @property
    def hair(self) -> bpy.types.Object | None:
        """The hair object of the open scene that --groom names; None if it names none."""
        return find_hair(self.sources.groom)


def read_hair(job: Job) -> Inputs:
    """Read the inputs of a job."""
    report = job.report
    print("reading", job.sources.groom or "(a groom grown here)", flush=True)
    with report.stage("read inputs"):
        inputs = read_inputs(job.sources, job.settings[GrowSettings])
    report_dropped_strands(job, inputs.dropped, inputs.groom_name)
    notes, groom = list(inputs.notes), inputs.groom
    takes_motion = getattr(job.options, "animated", False)
    if groom is not None and groom.motion is not None and not takes_motion:
        name = Path(inputs.groom_name).name
        notes.append(
            f"{name}: it moves, and only its first frame is read. To bring its motion into a "
            "scene, use the verb import."
        )
    report_notes(notes, report)
    report.facts["dropped"] = inputs.dropped
    return inputs


def read_rig(job: Job) -> tuple[Rig, Inputs]:
    """Read the inputs of a job and make their rig."""
    inputs, report = read_hair(job), job.report
    with report.stage("bind roots, choose guides"):
        rig = rig_from(_source(job, inputs), job.settings, place=inputs.groom_name)
    report_notes([f"{inputs.groom_name}: {note}" for note in rig.notes], report)
    children_line = rig.children_line
    if rig.suggested_children_method:
        children_line += f" (--set children.method={rig.suggested_children_method})"
    for line in filter(None, (children_line, rig.widths.line, rig.guides_line)):
        print(f"{line}.", flush=True)
    report_rig(report, rig, inputs.groom_name)
    return colored_rig(job, rig), inputs


def _source(job: Job, inputs: Inputs) -> Source:
    """The inputs as the source of a rig, with the ties and tip surface of hair of the scene."""
    hair, holding = job.hair, TrackedHolders()
    if hair is not None:
        holding = TrackedHolders.of(hair, bpy.context.evaluated_depsgraph_get())
    report_notes(list(holding.warnings), job.report)
    return Source(
        inputs.strands,
        inputs.dropped,
        np.arange(inputs.strands.strand_count, dtype=np.int32),
        inputs.head,
        inputs.density,
        Masks(read_job_masks(job, inputs)),
        holders=holding.holders,
        partings=inputs.partings,
    )


def colored_rig(job: Job, rig: Rig) -> Rig:
    """The rig with the colours of the colour map; raises as `job_colors`."""
    return with_painted_colors(rig, job_colors(job, rig), job.settings[ShadingSettings])


def job_colors(job: Job, rig: Rig) -> PaintedColor | None:
    """The colour map under this hair; None where none is set.

    Raises:
        HairloomError: it is missing, or cannot be used.
    """
    name, place = job.settings[ShadingSettings].color_map, job.sources.groom or "hair"
    if not name:
        return None
    surface = bpy.data.objects.get(find_head_name(job.sources) or "")
    depsgraph = bpy.context.evaluated_depsgraph_get()
    count = None if rig.head is None else len(rig.head.triangles)
    return painted_colors(surface, name, depsgraph, count, place=place)


def read_job_masks(
    job: Job, inputs: Inputs, kind: type[Settings] = ChildrenSettings
) -> dict[str, Mask]:
    """The masks that settings name, by the names of the parameters.

    Raises:
        HairloomError: one of them is missing, or cannot be used.
    """
    settings, depsgraph = job.settings[kind], bpy.context.evaluated_depsgraph_get()
    names = mask_names(settings)
    if not names:
        return {}
    hair = job.hair
    kept_strands = (
        np.zeros(0, np.int32) if hair is None else read_curves(hair, depsgraph).curve_indices
    )
    head = bpy.data.objects.get(inputs.head_object_name or "")
    mask_reader = MaskReader(hair, head, inputs.head, inputs.strands, kept_strands)
    found = {parameter: mask_reader.mask(name, depsgraph) for parameter, name in names.items()}
    report_notes(list(mask_reader.masks(settings, depsgraph)[1]), job.report)
    return found


def report_rig(report: Report, rig: Rig, name: str) -> None:
    """Add the counts and bounds of a rig to the report."""
    low, high = rig.strands.bounds()
    report.facts.update(
        groom=Path(name).name,
        strands=rig.strands.strand_count,
        guides=len(rig.guides),
        held_strands=0 if rig.holds is None else len(np.unique(rig.holds.strand)),
        children=rig.child_count,
        children_line=rig.children_line,
        widths=rig.widths.line,
        cv_count=rig.guide_grid.shape[1],
        points=rig.strands.point_count,
        points_of_a_strand_max=int(rig.strands.point_counts.max()),
        bounds_m=[low.round(5).tolist(), high.round(5).tolist()],
    )


def report_dropped_strands(job: Job, dropped: Mapping[str, int], place: str) -> None:
    """Print what was dropped of the hair of this name.

    Raises:
        HairloomError: something was dropped, with --strict.
    """
    if not dropped:
        return
    reasons = ", ".join(f"{count} with {reason}" for reason, count in dropped.items())
    if job.options.strict:
        raise HairloomError(
            f"strands would be dropped: {reasons}",
            place=place,
            remedy="Fix the groom, or omit --strict",
        )
    print(f"hairloom: {place}: dropped strands: {reasons}", flush=True)


def report_notes(notes: list[str], report: Report) -> None:
    """Print notes for the artist, and add them to the report."""
    for note in notes:
        print(f"hairloom: {note}", flush=True)
    report.facts["notes"] = [*report.facts.get("notes", ()), *notes]


@dataclass(frozen=True)
class PosedHair:
    """Hair in one frame: the pose, the points of all strands, and the guides, world space [m]."""

    rig: Rig
    pose: Pose
    points: Floats
    guides: Floats

    @classmethod
    def of_rest(cls, rig: Rig) -> Self:
        return cls(rig, rig.rest_pose, rig.strands.points, rig.guide_grid)

    @classmethod
    def of_motion(cls, motion: BakedGuides, rig: Rig, frame: int) -> Self:
        pose, points = motion.strands(frame)
        return cls(rig, pose, points, motion.at(frame)[1])


def read_baked_motion(job: Job, frames: range | None = None) -> BakedGuides:
    """The motion of --bake: from a folder, or of the hair object that --groom names.

    Raises:
        HairloomError: no bake, or frames that it does not hold.
    """
    if job.options.bake:
        if job.sources.groom is not None:
            check_groom(job.sources.groom)
        motion = BakedGuides.in_folder(Path(job.options.bake).resolve(), frames)
    else:
        hair = job.hair
        if hair is None:
            raise HairloomError(
                "this is not a hair object",
                place=f"--groom {job.sources.groom or ''}".strip(),
                remedy="Name the baked hair of the scene with --groom, or a folder with --bake",
            )
        motion = BakedGuides.of(hair, frames)
    motion = replace(motion, rig=colored_rig(job, motion.rig))
    job.report.add_input(motion.cache.folder)
    report_notes([*motion.notes, *_idle_settings_notes(job.options)], job.report)
    report_rig(job.report, motion.rig, motion.cache.facts.owner)
    return motion


def _idle_settings_notes(options: argparse.Namespace) -> list[str]:
    """A note on settings of --set that a bake has already used. They are no error, since scripts
    give the same ones to `simulate` and to verbs that read its bake."""
    baked = {kind.section for kind in _BAKED}
    names = [each.partition("=")[0] for each in options.set]
    idle = [name for name in names if name.partition(".")[0] in baked]
    if not idle:
        return []
    return [
        f"--set {', '.join(idle)}: the bake keeps the settings that it was made with. Bake again to"
        " change them."
    ]


def posed_hair(job: Job) -> PosedHair:
    """The hair at rest, or at --frame of --bake."""
    if job.options.bake is None:
        return PosedHair.of_rest(read_rig(job)[0])
    frame = job.options.frame
    motion = read_baked_motion(job, None if frame is None else range(frame, frame + 1))
    return PosedHair.of_motion(motion, with_uvs(motion.rig, job.sources), motion.frames[0])


def posed_grooms(job: Job) -> tuple[PosedHair, ...]:
    """`posed_hair` of each groom, all in the same frame: --frame, else the first that all bakes
    hold.

    Raises:
        HairloomError: one folder of --bake for several grooms, or bakes without a common frame.
    """
    if not job.others:
        return (posed_hair(job),)
    facts = GroomFacts(job)
    if job.options.bake is None:
        return tuple(PosedHair.of_rest(facts.added(read_rig(part)[0])) for part in job.parts)
    motions, found = motions_of_grooms(job), []
    frame = common_frames(job, motions)[0]
    for part, motion in zip(job.parts, motions, strict=True):
        rig = with_uvs(motion.rig, part.sources)
        found.append(PosedHair.of_motion(motion, rig, frame))
    return tuple(found)


def motions_of_grooms(job: Job) -> tuple[BakedGuides, ...]:
    """The baked motion of each groom, in --frame or in all frames.

    Raises:
        HairloomError: as `read_baked_motion`, or one folder for several grooms.
    """
    if job.others and job.options.bake:
        raise folder_for_several_error(job)
    facts, frame = GroomFacts(job), getattr(job.options, "frame", None)
    frames, motions = None if frame is None else range(frame, frame + 1), []
    for part in job.parts:
        motions.append(read_baked_motion(part, frames))
        facts.added(motions[-1].rig)
    return tuple(motions)


def folder_for_several_error(job: Job) -> HairloomError:
    return HairloomError(
        f"a folder holds the bake of one groom, and these are several: {', '.join(job.names)}",
        place=f"--bake {job.options.bake}",
        remedy="Give --bake without a folder to use the bake of each, or name one with --groom",
    )


def common_frames(job: Job, motions: Sequence[BakedGuides]) -> range:
    """The frames that all motions hold.

    Raises:
        HairloomError: there are none.
    """
    first = max(each.frames[0] for each in motions)
    frames = range(first, min(each.frames[-1] for each in motions) + 1)
    if not frames:
        held = (f"{each.frames[0]} to {each.frames[-1]}" for each in motions)
        pairs = ", ".join(f"{name}: {each}" for name, each in zip(job.names, held, strict=True))
        raise HairloomError(
            f"their bakes have no frame in common ({pairs})",
            place="--bake",
            remedy="Bake them together, or name one of them with --groom",
        )
    return frames


class GroomFacts:
    """What the report says of several grooms: each by itself under "grooms", and their sums. For
    one groom, the report stays as it is."""

    def __init__(self, job: Job) -> None:
        self._job, self._grooms = job, list[dict[str, Any]]()

    def added[Result](self, result: Result) -> Result:
        """Take the facts that the report now has of one groom; returns the argument."""
        facts = self._job.report.facts
        if not self._job.others:
            return result
        known = (*_SUMS, *_EXTREMES, *_OF_EACH, "groom", "dropped", "bounds_m")
        self._grooms.append({name: facts[name] for name in known if name in facts})
        lows, highs = zip(*(each["bounds_m"] for each in self._grooms), strict=True)
        dropped: Counter[str] = Counter()
        for each in self._grooms:
            dropped.update(each.get("dropped", {}))
        facts |= {n: sum(each[n] for each in self._grooms) for n in _SUMS if n in facts}
        facts |= {n: max(each[n] for each in self._grooms) for n in _EXTREMES if n in facts}
        facts |= {
            "groom": ", ".join(each["groom"] for each in self._grooms),
            "dropped": dict(dropped),
            "bounds_m": [np.min(lows, axis=0).tolist(), np.max(highs, axis=0).tolist()],
            "grooms": list(self._grooms),
        }
        for name in _OF_EACH:
            facts.pop(name, None)
        return result


def with_uvs(rig: Rig, sources: Sources) -> Rig:
    """A bake's rig with the UVs of the head, which bakes do not hold and which the shadow on the
    head needs. Unchanged if no head is named, or if its triangles have changed."""
    head = read_head(replace(sources, need_uv=False, need_head=False))
    if rig.head is None or head is None or not np.array_equal(head.triangles, rig.head.triangles):
        return rig
    return replace(rig, head=replace(rig.head, corner_uv=head.corner_uv))


def card_edits(job: Job) -> CardEdits | None:
    """The artist's edits to the cards of --groom in the scene; None with --discard-edits."""
    hair = job.hair
    if hair is None or getattr(job.options, "discard_edits", False):
        return None
    edits, notes = read_edits(hair, bpy.context.evaluated_depsgraph_get())
    report_notes(list(notes), job.report)
    return edits


def open_studio(job: Job, rig: Rig) -> Studio:
    """The studio that draws this job's hair."""
    studio = _studio(job, rig)
    report_notes(list(studio.warnings), job.report)
    return studio


def open_studio_of(job: Job, hair: Sequence[PosedHair]) -> Studio:
    """The studio that draws all grooms of this job, see `posed_grooms`, together."""
    if not job.others:
        return open_studio(job, hair[0].rig)
    companions = [
        PosedCompanion(_studio(part, each.rig), each.pose, each.points, each.guides)
        for part, each in zip(job.others, hair[1:], strict=True)
    ]
    studio = _studio(job, hair[0].rig, partial(GroupStudio, companions))
    report_notes(list(studio.warnings), job.report)
    return studio


def _studio(job: Job, rig: Rig, kind: Callable[..., Studio] = Studio) -> Studio:
    """The studio of one groom."""
    with job.report.stage("ambient occlusion"):
        groom = prepare_groom(rig, job.settings[AmbientSettings])
    edits = card_edits(job)
    look = read_head_look(job.sources, rig.head)
    return kind(groom, GroomSettings(job.settings), look=look, edits=edits)


def finish(job: Job, output: Path) -> None:
    """Print the name of the result, and add it to the report if nothing else was."""
    if not job.report.facts["outputs"]:
        job.report.add_output(output)
    print(f"Wrote {output}")
