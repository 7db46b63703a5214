"""Hair cards of a groom as files: the mesh, its textures, and the sidecar, which describes how to
draw the cards and the look of the hair."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Callable, Generator, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import bpy
import numpy as np

from ...arrays import Floats, Ints
from ...cards.build import CardBuild
from ...cards.card_mesh import CardMesh
from ...cards.export_settings import CardExportSettings
from ...cards.joints import CardTracks
from ...cards.settings import CardSettings
from ...cards.steps import NamedSteps, Step, map_progress, named, result_of
from ...cards.uv_fans import split_fans
from ...cards.vertex_animation import motion_layout
from ...dynamics.figures import CardFigures
from ...errors import HairloomError
from ...exchange.cards.card_formats import GLB, USD, CardFormat, format_of
from ...exchange.cards.card_page import PAGE_SUFFIX
from ...exchange.cards.glb_file import GlbFile
from ...exchange.cards.glb_plain import screen_coverage, with_levels, with_material
from ...exchange.cards.glb_springs import HeadBone
from ...exchange.cards.index_buffer import IndexBuffer, index_buffer
from ...exchange.cards.sidecar import (
    SUFFIX,
    CardFile,
    conflicting_owner,
    files_of_earlier_export,
    sidecar_text,
)
from ...exchange.files.atomic import check_writable
from ...exchange.files.file_names import name_in_other_case
from ...exchange.files.file_set import atomic_file_set, back_up_foreign_files
from ...exchange.textures.card_textures import WrittenTexture, resized_to_largest
from ...exchange.textures.texture_packing import pack_textures
from ...exchange.usd.usd_levels import add_level_variants
from ...exchange.usd.usd_library import usd_library
from ...params import Settings, SettingsMap
from ...shading.card_look import VIEW_COMPENSATED_ALPHA
from ...shading.drawn_strands import in_color
from ...shading.kajiya_kay_settings import KajiyaKaySettings
from ...shading.marschner.look import fibre_of, pack_fibre
from ...shading.marschner.settings import MarschnerSettings
from ...shading.settings import ShadingSettings, SharedSettings
from ...strands import Surface
from ..bakes.guide_motion import BakedGuides, GuideMotion
from ..base.objects import Handle
from ..base.outcome import Outcome
from ..base.report import hairloom_version
from ..base.thread_work import ThreadWork
from ..colliders.rigs import CachedRig
from ..scene.bone_weights import head_bone_of
from ..scene.built_in_head import HeadLook
from ..scene.head_look import look_of_head
from .build import (
    CardInputs,
    CardMaps,
    MappedCards,
    Stage,
    build_steps,
    order_line,
    read_inputs,
    untimed,
)
from .build_cache import CardBuildCache
from .exporters import CardLook, check_cards, check_exporter, level_names, write_card_mesh
from .motion import (
    JointMotion,
    SpringMotion,
    TextureMotion,
    check_motion,
    joint_motion_steps,
    moved_cards,
    spring_motion_steps,
)
from .page import PAGE_AT_REST, check_page, write_page
from .page_head import PageHead
from .textures import (
    picture_files,
    png_of,
    texture_channels,
    texture_roles,
    write_tables,
    write_textures,
)

_UNITS = {
    "length": "m",
    "angle": "rad",
    "time": "s",
    "rate": "1/s",
    "speed": "m/s",
    "factor": "0 to 1",
    "acceleration": "m/s^2",
    "pixels": "px",
    "none": "1",
}
#: Maps that glTF's standard material can use beside the colour.
_DIRECTION_MAPS: tuple[str, ...] = ("normal", "tangent")
#: Texels of the ramp from 0 to 1, through which glTF reads occlusion from a UV map.
_RAMP_SIZE = 256
#: settings of Marschner's model only, although both models share their panel
_PIGMENT_SETTINGS = {"pigment", "melanin", "redness", "absorption"}
#: settings of strands only: on cards, textures contain their effect
_STRAND_SETTINGS = {"model", "color_source", "color_map", "brow_source", "brow_color"}
#: a suffix at least as long as those of all files beside the mesh
_LONGEST_SUFFIX = "_motion_position.exr"
_UNITS_OF_KINDS = {"color": "scene-linear Rec. 709", "choice": "name", "toggle": "true or false"}


@dataclass(frozen=True)
class CardOutput:
    """How cards are written.

    format: the name of one of exchange.card_formats; None: by the file's suffix.
    name: of the hair in the file; None: that of the file.
    head_bone: the character's bone that carries springs; None where there is none.
    head_look: how the head on a web page is drawn; None: plain skin.
    """

    format: str | None = None
    name: str | None = None
    settings: CardExportSettings = field(default_factory=CardExportSettings)
    head_bone: HeadBone | None = None
    head_look: HeadLook | None = None


@dataclass(frozen=True)
class WrittenCards:
    """The result of an export. files: the mesh first, the sidecar last.

    notes: for the artist, each with its remedy.
    motion: the sidecar's section on motion; empty without any. figures: of this motion.
    """

    build: CardBuild
    maps: CardMaps
    files: tuple[Path, ...]
    notes: tuple[str, ...]
    motion: Mapping[str, Any] = field(default_factory=dict)
    figures: CardFigures | None = None

    @property
    def levels(self) -> tuple[CardMesh, ...]:
        return self.build.levels

    @property
    def mesh(self) -> CardMesh:
        """The finest level."""
        return self.build.finest


def write_cards(
    path: Path,
    inputs: CardInputs,
    output: CardOutput | None = None,
    stage: Stage = untimed,
    motion: GuideMotion | None = None,
    on_step: Callable[[str], object] = lambda name: None,
) -> WrittenCards:
    """Build the cards of a rig and write them.

    Args:
        path: of the mesh; the textures go beside it as NAME_base.png and so on.
        stage: makes a context manager that times a named stage.
        motion: that of this rig; None: the cards are at rest.
        on_step: called with the name of what is being made, again whenever it has advanced.

    Raises:
        HairloomError: no cards, a format that cannot be written, or a folder that cannot be
            written. Nothing is written then, and old files stay as they were.
    """
    output = output or CardOutput()
    check_output(path, output, motion)
    with stage("build cards"):
        building = build_steps(inputs, stage=stage)
        made = result_of(map_progress(building, lambda step: on_step(step.name)))
    head = inputs.rig.head
    writing = file_steps(path, made, inputs.settings, output, stage, motion, head)
    return result_of(map_progress(writing, lambda step: on_step(step.name)))


def check_output(path: Path, output: CardOutput, motion: GuideMotion | None) -> None:
    """Refuse an export that is bound to fail, before any work is done.

    Raises:
        HairloomError: the path, the format, or motion in this format.
    """
    path, file_format = format_of(path, output.format)
    check_writable(path)
    check_writable(path.with_name(path.stem + _LONGEST_SUFFIX))
    _check_neighbours(path)
    check_exporter(file_format, str(path))
    check_page(output.settings, file_format, str(path))
    if motion is not None:
        check_motion(output.settings, motion, file_format)


def _check_neighbours(path: Path) -> None:
    """Refuse a name whose files would collide with another mesh's: by the sidecar, or where file
    systems ignore case.

    Raises:
        HairloomError: naming the other file.
    """
    other = conflicting_owner(path) or name_in_other_case(path)
    if other:
        raise HairloomError(
            f"{other} is in this folder, and its companion files would have the same names",
            place=str(path),
            remedy="Export under another name, or into another folder",
        )


def check_no_input(path: Path, pictures: Iterable[Path]) -> None:
    """Refuse to write textures over the pictures that they are made from.

    Raises:
        HairloomError: a picture has a name that textures of this mesh may have.
    """
    for picture in pictures:
        is_beside = os.path.realpath(picture.parent) == os.path.realpath(path.parent)
        if is_beside and picture.name.startswith(f"{path.stem}_"):
            raise HairloomError(
                f"the cards use {picture.name}, which the written textures could replace",
                place=str(path),
                remedy="Export under another name, or into another folder",
            )


def file_steps(
    path: Path,
    made: MappedCards,
    settings: SettingsMap,
    output: CardOutput,
    stage: Stage = untimed,
    motion: GuideMotion | None = None,
    head: Surface | None = None,
) -> NamedSteps[WrittenCards]:
    """Write built cards; closing the generator leaves old files as they were.

    Args:
        head: the mesh that hair grows on, for a web page.

    Raises:
        HairloomError: as `write_cards`.
    """
    path, file_format = format_of(path, output.format)
    check_cards(made.build.levels, str(path))
    with atomic_file_set(path) as folder:
        writer = _Writer(folder / path.name, made, settings, output, file_format, stage, head)
        writer_notes = yield from writer.steps(motion)
        writer_notes += back_up_foreign_files(folder, path, files_of_earlier_export(path))
        names = {file.name for file in folder.iterdir() if file.is_file()}
    beside = sorted(names - {path.name, path.stem + SUFFIX})
    files = (path.name, *beside, path.stem + SUFFIX)
    paths = tuple(path.with_name(name) for name in files)
    notes = (*made.notes, *writer_notes)
    return WrittenCards(made.build, made.maps, paths, notes, writer.motion, writer.figures)


@dataclass(frozen=True, eq=False)
class _Textures:
    """Textures that were written.

    look: the material in the mesh's file. roles, channels: see `texture_roles` and
    `texture_channels`. tables: name -> file.
    """

    look: CardLook
    roles: Mapping[str, Any]
    channels: Mapping[str, Any]
    tables: Mapping[str, str]


@dataclass(eq=False)
class _Writer:
    """Writes all files into the folder of `path`. motion, figures: see `WrittenCards`."""

    path: Path
    made: MappedCards
    settings: SettingsMap
    output: CardOutput
    file_format: CardFormat
    stage: Stage
    head: Surface | None = None
    motion: Mapping[str, Any] = field(default_factory=dict)
    figures: CardFigures | None = None

    def steps(self, motion: GuideMotion | None) -> NamedSteps[tuple[str, ...]]:
        """Write everything; returns notes for the artist."""
        build = self.made.build
        parts = map(split_fans, build.levels, build.back_triangles)
        levels, backs = zip(*parts, strict=True)
        if motion is None or self.output.settings.motion == "none":
            yield Step("Writing")
            return self._write(levels, backs)
        if self.output.settings.motion == "texture":
            return (yield from self._write_with_texture(levels, backs, motion))
        return (yield from self._write_with_skeleton(levels, backs, motion))

    def _write_with_skeleton(
        self, levels: Sequence[CardMesh], backs: Sequence[Ints], motion: GuideMotion
    ) -> NamedSteps[tuple[str, ...]]:
        settings = self.output.settings
        with self.stage("move cards"):
            steps = moved_cards(motion, levels, space="head", with_directions=False)
            moved = yield from named("Moving the cards", steps)
        kind, self.figures = settings.motion, moved.figures
        with self.stage(f"fit {kind}"):
            fitting = self._fitting(moved.tracks, motion.rig.head)
            skeleton = yield from named(f"Fitting {kind}", fitting)
        self.motion = skeleton.sidecar_section
        yield Step("Writing")
        return (*skeleton.notes, *self._write(levels, backs, skeleton=skeleton))

    def _fitting(
        self, tracks: CardTracks, head: Surface | None
    ) -> Generator[float, None, JointMotion | SpringMotion]:
        settings = self.output.settings
        if settings.motion == "springs":
            bone = self.output.head_bone
            return spring_motion_steps(tracks, settings, head, bone, str(self.path))
        return joint_motion_steps(tracks, settings)

    def _write_with_texture(
        self, levels: Sequence[CardMesh], backs: Sequence[Ints], motion: GuideMotion
    ) -> NamedSteps[tuple[str, ...]]:
        settings = self.output.settings
        count = sum(len(mesh.positions) for mesh in levels)
        motion_layout(count, len(motion.frames), str(self.path))  # refused before the work
        with self.stage("move cards"):
            steps = moved_cards(motion, levels, space=settings.motion_space, with_directions=True)
            moved = yield from named("Moving the cards", steps)
        self.figures = moved.figures
        yield Step("Writing")
        texture = TextureMotion.of(moved, settings, self.file_format, str(self.path))
        with self.stage("write motion texture"):
            self.motion = texture.sidecar_section(texture.write(self.path))
        return self._write(levels, backs, texture.texels)

    @property
    def _name(self) -> str:
        return self.output.name or self.path.stem

    def _write(
        self,
        levels: Sequence[CardMesh],
        backs: Sequence[Ints],
        texels: Sequence[Floats] = (),
        skeleton: JointMotion | SpringMotion | None = None,
    ) -> tuple[str, ...]:
        """Write textures, mesh and indices, and the sidecar last; returns notes for the artist."""
        build, maps, settings = self.made.build, self.made.maps, self.output.settings
        nodes = level_names(self._name, len(levels))
        with self.stage("write textures"):
            textures = self._write_textures()
        with self.stage("write cards"):
            self._write_mesh(levels, textures.look, texels)
            if skeleton is not None:
                skeleton.complete(self.path, nodes)
            notes = self._complete(levels, nodes)
        indices = self._write_indices(levels, backs) if settings.index_buffer else None
        sidecar = CardFile(
            self.path.name,
            self.file_format,
            tuple(levels),
            nodes,
            errors=build.errors,
            portable=not settings.attributes,
            textures=textures.roles,
            texture_files=textures.channels,
            base_gain=maps.base_gain,
            highlights=maps.highlights,
            view_compensated_alpha=VIEW_COMPENSATED_ALPHA if maps.is_view_compensated else {},
            material=material_of(self._shading, textures.tables),
            indices=indices,
            motion=self.motion,
            page=self.path.stem + PAGE_SUFFIX if settings.page else "",
            generator=hairloom_version(),
        )
        content = sidecar_text(sidecar)
        self._complete_with_digest(content)
        if settings.page:
            with self.stage("write page"):
                notes += self._write_page(sidecar, backs, skeleton)
        self.path.with_name(self.path.stem + SUFFIX).write_text(content, encoding="utf-8")
        return notes

    @property
    def _shading(self) -> ShadingSettings:
        """The look of the hair, in the base colour of the maps if they have one."""
        shading, base_color = self.settings[ShadingSettings], self.made.maps.base_color
        return shading if base_color is None else in_color(base_color, shading)

    def _write_textures(self) -> _Textures:
        maps, folder, stem = self.made.maps, self.path.parent, self.path.stem
        card = maps.plain_card(self.settings[ShadingSettings])
        all_maps = {**maps.by_name, "color": card[..., :3]}
        grid = self.made.build.finest.atlas
        written = write_textures(folder, stem, all_maps, grid, self.output.settings)
        tables = write_tables(folder, stem, self._shading)
        roles, channels = texture_roles(written, all_maps), texture_channels(written)
        return _Textures(_look(card, written), roles, channels, tables)

    def _write_mesh(
        self, levels: Sequence[CardMesh], look: CardLook, texels: Sequence[Floats]
    ) -> None:
        write_card_mesh(
            self.path,
            levels,
            self.file_format,
            look,
            name=self._name,
            portable=not self.output.settings.attributes,
            texels=texels,
        )

    def _write_indices(
        self, levels: Sequence[CardMesh], backs: Sequence[Ints]
    ) -> tuple[str, IndexBuffer]:
        """Returns the file's name, and what is in it."""
        name, indices = f"{self.path.stem}.indices.bin", index_buffer(levels, backs)
        self.path.with_name(name).write_bytes(indices.content)
        return name, indices

    def _write_page(
        self,
        sidecar: CardFile,
        backs: Sequence[Ints],
        skeleton: JointMotion | SpringMotion | None,
    ) -> tuple[str, ...]:
        """Returns notes for the artist."""
        path, output = self.path, self.output
        head = None
        if self.head is not None and output.settings.page_head:
            head = PageHead.of(path, self.head, output.head_look, self.file_format)
        carrier = skeleton.carrier if isinstance(skeleton, JointMotion) else np.eye(4)[None]
        write_page(
            path,
            self._name,
            sidecar,
            self.made,
            self._shading,
            backs,
            head,
            output.settings,
            carrier,
        )
        return (PAGE_AT_REST,) if self.motion.get("kind") in ("texture", "springs") else ()

    def _complete_with_digest(self, sidecar: str) -> None:
        """Store a digest of all files beside it in a GLB, so that engines that import a file again
        only when its bytes have changed, such as Godot, notice a changed look.
        """
        if self.file_format != GLB:
            return
        digest = hashlib.sha256(sidecar.encode())
        for path in sorted(self.path.parent.iterdir()):
            if path != self.path:
                digest.update(path.read_bytes())
        file = GlbFile.of(self.path.read_bytes(), str(self.path))
        file.content["asset"].setdefault("extras", {})["hairloom_files"] = digest.hexdigest()
        self.path.write_bytes(file.data())

    def _complete(self, levels: Sequence[CardMesh], nodes: Sequence[str]) -> tuple[str, ...]:
        """Add what Blender's exporters do not write: the choice of levels, and further maps of a
        GLB; returns notes for the artist."""
        if self.file_format == USD and len(levels) > 1:
            try:
                usd_library(self.path)
            except HairloomError as error:
                return (f"{error} Until then viewers show all levels at once.",)
            add_level_variants(self.path, nodes)
        if self.file_format == GLB:
            file = GlbFile.of(self.path.read_bytes(), str(self.path))
            with_levels(file, nodes, screen_coverage(levels, self.made.build.errors))
            ramp = np.linspace(0.0, 1.0, _RAMP_SIZE, dtype=np.float32)[None, :, None]
            maps = _direction_pictures(self.path, self.made.maps)
            with_material(file, maps, png_of(self.path, ramp))
            self.path.write_bytes(file.data())
        return ()


def _direction_pictures(path: Path, maps: CardMaps) -> dict[str, bytes]:
    """PNG files of the direction maps that glTF's standard material can use."""
    directions = {name: maps.by_name[name] for name in _DIRECTION_MAPS if name in maps.by_name}
    if not directions:
        return {}
    made = pack_textures(resized_to_largest(directions), "gltf")
    by_name = {each.suffix.removeprefix("_"): each.pixels for each in made}
    return {
        name: png_of(path, by_name[name]) for name in ("normal", "anisotropy") if name in by_name
    }


def _look(card: Floats, written: Sequence[WrittenTexture]) -> CardLook:
    """The material in the mesh's file: colour, and alpha if a plain material can reference it."""
    (colored,) = (texture for texture in written if "color" in texture.layout.sources)
    file, alpha = colored.path.name, None
    if colored.layout.has_coverage:
        alpha = file
    else:  # importers take the mean of all channels
        own = [each.path.name for each in written if each.layout.sources == {"alpha"}]
        alpha = own[0] if own else None
    return CardLook(card, file, alpha, is_linear=colored.color_space == "linear")


def material_of(shading: ShadingSettings, tables: Mapping[str, str]) -> dict[str, Any]:
    """The sidecar's section on the material.

    Args:
        tables: name -> file of the tables beside it, see `write_tables`.
    """
    own: type[Settings] = KajiyaKaySettings if shading.model == "kajiya_kay" else MarschnerSettings
    left_out = _STRAND_SETTINGS | (_PIGMENT_SETTINGS if own is KajiyaKaySettings else set())
    every = (*SharedSettings.parameters(), *own.parameters())
    parameters = [each for each in every if each.name not in left_out]
    content: dict[str, Any] = {
        "model": shading.model,
        "values": {each.name: getattr(shading, each.name) for each in parameters},
        "units": {
            each.name: _UNITS_OF_KINDS.get(each.kind, _UNITS[each.unit]) for each in parameters
        },
        "meanings": {each.name: each.description for each in parameters},
        "fibre": {},
        "tables": {name: {"file": file} for name, file in tables.items()},
    }
    if shading.model == "marschner":
        packed = pack_fibre(shading).tolist()
        strengths = list(fibre_of(shading).strengths)
        content["fibre"] = {"root": packed[:4], "tip": packed[4:8], "strengths": strengths}
    return content


@dataclass(frozen=True, eq=False)
class CardExport:
    """The export of one hair's cards. notes: for the artist."""

    hair: Handle
    cache: CardBuildCache
    path: Path
    output: CardOutput
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
        cached_rigs: tuple[CachedRig, ...] = (),
        cache: CardBuildCache | None = None,
    ) -> CardExport:
        """Read the hair; if motion is to be written, from its bake.

        Args:
            levels: number of levels of detail; None: by the groom's own settings.
            frames: of the bake; None: all of them.
            cached_rigs: see `CachedRig.of`.
            cache: cards that were built before; the new ones are kept in it.

        Raises:
            HairloomError: no hair that can be used, no bake, or a format that cannot be written.
        """
        motion = None if output.settings.motion == "none" else BakedGuides.of(hair, frames)
        check_output(path, output, motion)
        check_no_input(path, picture_files(hair.data.hairloom.card_images))
        rig, stale = (None, ()) if motion is None else (motion.rig, motion.notes)
        inputs, notes, dropped = read_inputs(hair, depsgraph, rig, cached_rigs=cached_rigs)
        bone = head_bone_of(hair, depsgraph, inputs.rig.strands)
        output = replace(output, head_bone=bone, head_look=look_of_head(hair, inputs.rig.head))
        if levels is not None:
            cards = replace(inputs.settings[CardSettings], levels=levels)
            inputs = replace(inputs, settings=inputs.settings.with_settings(cards))
        notes += stale
        cache = CardBuildCache() if cache is None else cache
        return cls(Handle.of(hair), cache, path, output, inputs, motion, dropped, notes)

    def building(self) -> ThreadWork[MappedCards]:
        """Build the cards in a thread."""
        return self.cache.building(self.inputs, "hairloom card files")

    def writing(self, made: MappedCards) -> NamedSteps[Outcome]:
        """Write the built cards; closing the generator leaves old files as they were."""
        inputs = self.inputs
        self.cache.keep(self.hair, inputs, made)
        steps = file_steps(
            self.path,
            made,
            inputs.settings,
            self.output,
            motion=self.motion,
            head=inputs.rig.head,
        )
        return self.outcome((yield from steps))

    def outcome(self, written: WrittenCards) -> Outcome:
        """The report for the artist."""
        first, *beside = written.files
        mesh, layers = written.mesh, written.build.shell_layers
        things = f"{layers} layers of shells" if layers else f"{mesh.card_count:,} cards"
        result = (
            f"Wrote {things} in {len(written.levels)} levels of detail "
            f"to {first.parent.name}/{first.name}, with {len(beside)} files beside it. "
            f"{order_line(written.build.wrong_fraction)}"
        )
        if written.build.edits:
            result += f". {written.build.edits.report_line}"
        return Outcome(
            f"{result}{_motion_line(written)}", self.dropped, (*self.notes, *written.notes)
        )


def _motion_line(written: WrittenCards) -> str:
    """A phrase on the written motion, such as "; 127 chains of 2 joints, off by 0.6% of the
    hair's length (root mean square; 99% by less than 2.1%, the worst by 14.0%)", or "; motion
    textures of 512 x 930 texels, which round by 0.001% of the hair's length at most".
    """
    motion = written.motion
    if not motion:
        return ""
    length = motion["error"]["hair_length"]
    if motion["kind"] == "texture":
        return (
            f"; motion textures of {motion['width']} x {motion['height']} texels, rounded by at "
            f"most {motion['error']['worst'] / length * 100.0:.2g}% of the hair's length"
        )
    by = ", moved by springs" if motion["kind"] == "springs" else ""
    usual, most, worst = (
        motion["error"][name] / length for name in ("root_mean_square", "percentile_99", "worst")
    )
    return (
        f"; {motion['chains']} chains of {motion['joints_in_chain']} joints{by}, off by "
        f"{usual:.1%} of the hair's length (root mean square; 99% by less than {most:.1%}, "
        f"the worst by {worst:.1%})"
    )
