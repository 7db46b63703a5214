"""Hair cards of an object into files, as the artist's buttons ask for it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import bpy

from ...cards.settings import CardSettings
from ...pipeline import Rig
from ..base.outcome import Outcome, notes_of
from ..base.thread_work import ThreadWork
from ..scene.rigs import rig_of
from ..scene.source import read_source
from .card_builds import made_in_thread
from .card_files import CardOutput, FileSteps, WrittenCards, check_output, file_steps
from .card_making import CardInputs, MadeCards, card_inputs, order_line
from .card_motion import GuideMotion, baked_motion


@dataclass(frozen=True, eq=False)
class CardExport:
    """What is written of one hair, and where. notes: what the artist should know."""

    path: Path
    output: CardOutput
    rig: Rig
    inputs: CardInputs
    motion: GuideMotion | None
    dropped: dict[str, int]
    notes: tuple[str, ...]

    @classmethod
    def of(
        cls,
        hair: bpy.types.Object,
        depsgraph: bpy.types.Depsgraph,
        path: Path,
        output: CardOutput,
        *,
        levels: int | None = None,
        frames: range | None = None,
    ) -> CardExport:
        """Read the hair; where it is to move, from its bake.

        Args:
            levels: of detail; None is what the groom's own settings say.
            frames: of the bake; None is all of them.

        Raises:
            HairloomError: no hair that can be used, no bake, or a format that cannot be written.
        """
        inputs, warnings = card_inputs(hair)
        if levels is not None:
            cards = replace(inputs.settings[CardSettings], levels=levels)
            inputs = replace(inputs, settings=inputs.settings.with_settings(cards))
        if output.motion.kind != "none":
            motion = baked_motion(hair, frames)
            check_output(path, output, motion)
            notes = (*notes_of(hair, motion.rig), *motion.notes, *warnings)
            return cls(path, output, motion.rig, inputs, motion, {}, notes)
        check_output(path, output, None)
        source = read_source(hair, depsgraph)
        rig = rig_of(hair, source)
        notes = (*source.warnings, *notes_of(hair, rig), *warnings)
        return cls(path, output, rig, inputs, None, source.dropped, notes)

    def making(self) -> ThreadWork[MadeCards]:
        """Build the cards in a thread."""
        return ThreadWork(
            lambda work: made_in_thread(work, self.rig, self.inputs), "hairloom card files"
        )

    def writing(self, made: MadeCards) -> FileSteps[Outcome]:
        """Write the cards that were made; closing it leaves old files as they were."""
        steps = file_steps(self.path, made, self.inputs.settings, self.output, motion=self.motion)
        return self._told(steps)

    def _told(self, steps: FileSteps[WrittenCards]) -> FileSteps[Outcome]:
        written = yield from steps
        return self.outcome(written)

    def outcome(self, written: WrittenCards) -> Outcome:
        """What the artist is told."""
        first, *beside = (file.name for file in written.files)
        result = (
            f"Wrote {written.mesh.card_count:,} cards in {len(written.levels)} levels of detail "
            f"to {first}, with {len(beside)} files beside it. "
            f"{order_line(written.build.wrong_share)}"
        )
        return Outcome(
            f"{result}{_motion_line(written)}", self.dropped, (*self.notes, *written.notes)
        )


def _motion_line(written: WrittenCards) -> str:
    """How the motion was written, such as "; 127 chains of 2 joints, off by 0.6% of the
    hair's length (root mean square; 99% by less than 2.1%, the worst by 14.0%)".
    """
    motion = written.motion
    if not motion:
        return ""
    if motion["kind"] == "texture":
        return f"; motion textures of {motion['width']} x {motion['height']} texels"
    length = motion["error"]["hair_length"]
    share, most, worst = (
        motion["error"][name] / length for name in ("root_mean_square", "percentile_99", "worst")
    )
    return (
        f"; {motion['chains']} chains of {motion['joints_in_chain']} joints, off by {share:.1%} of "
        f"the hair's length (root mean square; 99% by less than {most:.1%}, the worst by "
        f"{worst:.1%})"
    )
