"""Hair cards of a groom as files: the mesh, the textures beside it, and the sidecar."""

from __future__ import annotations

from collections.abc import Callable, Generator, Mapping, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from ...arrays import Floats, Ints
from ...cards.build import CardBuild
from ...cards.card_mesh import CardMesh
from ...cards.steps import result_of, retold
from ...cards.vertex_animation import motion_layout
from ...exchange.cards.card_formats import CardFormat, format_of
from ...exchange.cards.index_buffer import index_buffer
from ...exchange.cards.sidecar import SUFFIX, CardFile, sidecar_text
from ...exchange.files.file_set import written_together
from ...params import SettingsMap
from ...pipeline import Rig
from ...shading.card_look import EVEN_ALPHA
from ...shading.settings import ShadingSettings
from ..base.report import hairloom_version
from .card_making import CardInputs, MadeCards, making_steps
from .card_maps import CardMaps, made_maps
from .card_material import material_of
from .card_motion import (
    GuideMotion,
    JointMotion,
    MotionChoices,
    TextureMotion,
    check_motion,
    joint_motion_steps,
    moved_cards,
)
from .exporters import CardLook, check_cards, check_exporter, level_names, write_card_mesh
from .textures import TextureFiles, texture_channels, texture_roles, write_tables, write_textures

type Stage = Callable[[str], AbstractContextManager[None]]
#: Tells what is being done, and which share of it is done; None where nobody knows.
type FileSteps[Result] = Generator[tuple[str, float | None], None, Result]


@dataclass(frozen=True)
class CardOutput:
    """How cards are written.

    format: one of exchange.card_formats by name; None goes by the file's suffix.
    name: of the hair in the file; None is the file's.
    portable: without custom attributes, which some engines refuse.
    index_buffer: whether the sorted indices are written as they are, too.
    motion: how it is written where there is some.
    """

    format: str | None = None
    name: str | None = None
    portable: bool = True
    index_buffer: bool = False
    textures: TextureFiles = field(default_factory=TextureFiles)
    motion: MotionChoices = field(default_factory=MotionChoices)


@dataclass(frozen=True)
class WrittenCards:
    """What was written. files: the mesh first, the sidecar last.

    notes: what the artist should know, each with its remedy.
    motion: what the sidecar says of it; empty without any.
    """

    build: CardBuild
    maps: CardMaps
    files: tuple[Path, ...]
    notes: tuple[str, ...]
    motion: Mapping[str, Any] = field(default_factory=dict)

    @property
    def levels(self) -> tuple[CardMesh, ...]:
        return self.build.levels

    @property
    def mesh(self) -> CardMesh:
        """The finest level."""
        return self.build.finest


def _untimed(_name: str) -> AbstractContextManager[None]:
    return nullcontext()


def write_cards(
    path: Path,
    rig: Rig,
    inputs: CardInputs,
    output: CardOutput | None = None,
    stage: Stage = _untimed,
    motion: GuideMotion | None = None,
) -> WrittenCards:
    """Build the cards of a rig and write them.

    Args:
        path: of the mesh; the textures go beside it as NAME_base.png and so on.
        stage: gives a context in which a named stage is timed.
        motion: of this rig.

    Raises:
        HairloomError: no cards, a format that cannot be written, or nothing can be written there.
            Nothing is written then, and old files stay as they were.
    """
    output = output or CardOutput()
    check_output(path, output, motion)

    def maps_of(build: CardBuild) -> CardMaps:
        with stage("card texture"):
            return made_maps(rig, build, inputs.settings, inputs.pictures)

    with stage("build cards"):
        made = result_of(making_steps(rig, inputs, maps_of))
    return result_of(file_steps(path, made, inputs.settings, output, stage, motion))


def check_output(path: Path, output: CardOutput, motion: GuideMotion | None) -> None:
    """Refuse what cannot be written, before any work is done.

    Raises:
        HairloomError: the format, or motion in it.
    """
    path, file_format = format_of(path, output.format)
    check_exporter(file_format, str(path))
    if motion is not None:
        check_motion(output.motion, motion, file_format)


def file_steps(
    path: Path,
    made: MadeCards,
    settings: SettingsMap,
    output: CardOutput,
    stage: Stage = _untimed,
    motion: GuideMotion | None = None,
) -> FileSteps[WrittenCards]:
    """Write cards that are made; closing it leaves old files as they were.

    Raises:
        HairloomError: as `write_cards`.
    """
    path, file_format = format_of(path, output.format)
    check_cards(made.build.levels, str(path))
    with written_together(path) as folder:
        writer = _Writer(folder / path.name, made, settings, output, file_format, stage)
        told = yield from writer.steps(motion)
        names = {file.name for file in folder.iterdir() if file.is_file()}
    beside = sorted(names - {path.name, path.stem + SUFFIX})
    files = (path.name, *beside, path.stem + SUFFIX)
    paths = tuple(path.with_name(name) for name in files)
    notes = (*made.notes, *told)
    return WrittenCards(made.build, made.maps, paths, notes, writer.motion)


@dataclass(eq=False)
class _Writer:
    """Writes all files into the folder of `path`. motion: what the sidecar says of it."""

    path: Path
    made: MadeCards
    settings: SettingsMap
    output: CardOutput
    file_format: CardFormat
    stage: Stage
    motion: Mapping[str, Any] = field(default_factory=dict)

    def steps(self, motion: GuideMotion | None) -> FileSteps[tuple[str, ...]]:
        """Gives back what the artist should know."""
        build = self.made.build
        parts = map(CardMesh.without_loose, build.levels, build.backs)
        levels, backs = zip(*parts, strict=True)
        if motion is None or self.output.motion.kind == "none":
            yield "Writing", None
            self._write(levels, backs)
            return ()
        if self.output.motion.kind == "texture":
            yield from self._write_with_texture(levels, backs, motion)
            return ()
        return (yield from self._write_with_joints(levels, backs, motion))

    def _write_with_joints(
        self, levels: Sequence[CardMesh], backs: Sequence[Ints], motion: GuideMotion
    ) -> FileSteps[tuple[str, ...]]:
        wanted = self.output.motion
        with self.stage("move cards"):
            steps = moved_cards(motion, levels, space="head", with_directions=False)
            moved = yield from retold(steps, lambda share: ("Moving the cards", share))
        with self.stage("fit joints"):
            joints: JointMotion = yield from retold(
                joint_motion_steps(moved.tracks, wanted), lambda share: ("Fitting joints", share)
            )
        self.motion = joints.facts
        yield "Writing", None
        self._write(levels, backs)
        joints.complete(self.path, level_names(self._name, len(levels)))
        return joints.notes

    def _write_with_texture(
        self, levels: Sequence[CardMesh], backs: Sequence[Ints], motion: GuideMotion
    ) -> FileSteps[None]:
        wanted = self.output.motion
        count = sum(len(mesh.positions) for mesh in levels)
        motion_layout(count, len(motion.frames), str(self.path))  # refused before the work
        with self.stage("move cards"):
            steps = moved_cards(motion, levels, space=wanted.space, with_directions=True)
            moved = yield from retold(steps, lambda share: ("Moving the cards", share))
        yield "Writing", None
        texture = TextureMotion.of(moved, wanted, self.file_format, str(self.path))
        with self.stage("write motion texture"):
            self.motion = texture.facts(texture.write(self.path))
        self._write(levels, backs, texture.texels)

    @property
    def _name(self) -> str:
        return self.output.name or self.path.stem

    def _write(
        self,
        levels: Sequence[CardMesh],
        backs: Sequence[Ints],
        texels: Sequence[Floats] = (),
    ) -> None:
        """Textures, mesh, indices, and the sidecar last."""
        path, build, maps, output = self.path, self.made.build, self.made.maps, self.output
        shading = self.settings[ShadingSettings]
        with self.stage("write textures"):
            grid = build.finest.atlas
            written = write_textures(path.parent, path.stem, maps.by_name, grid, output.textures)
            tables = write_tables(path.parent, path.stem, shading)
        roles = texture_roles(written, maps.by_name)
        look = _look(maps, roles, shading)
        with self.stage("write cards"):
            write_card_mesh(
                path,
                levels,
                self.file_format,
                look,
                name=self._name,
                portable=output.portable,
                texels=texels,
            )
        indices = None
        if output.index_buffer:
            indices = f"{path.stem}.indices.bin", index_buffer(levels, backs)
            path.with_name(indices[0]).write_bytes(indices[1].content)
        sidecar = CardFile(
            path.name,
            self.file_format,
            tuple(levels),
            level_names(self._name, len(levels)),
            errors=build.errors,
            portable=output.portable,
            textures=roles,
            texture_files=texture_channels(written),
            base_gain=maps.base_gain,
            highlights=maps.highlights,
            even_alpha=EVEN_ALPHA if maps.is_even else {},
            material=material_of(shading, tables),
            indices=indices,
            motion=self.motion,
            generator=hairloom_version(),
        )
        path.with_name(path.stem + SUFFIX).write_text(sidecar_text(sidecar), encoding="utf-8")


def _look(
    maps: CardMaps, roles: Mapping[str, Mapping[str, str]], shading: ShadingSettings
) -> CardLook:
    """The material of the mesh's own file: base, and alpha where plain nodes can name it."""
    base, alpha = roles.get("base", {}).get("file"), roles.get("alpha", {}).get("file")
    if roles.get("alpha", {}).get("channels") != ("a" if alpha == base else "r"):
        alpha = None
    red, green, blue = (min(value * maps.base_gain, 1.0) for value in shading.base_color)
    return CardLook(maps.card, base, alpha, (red, green, blue))
