"""Hair cards of a groom as files: the mesh, the textures beside it, and the sidecar."""

from __future__ import annotations

import tomllib
from collections.abc import Callable, Mapping
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass, field
from pathlib import Path

from ..cards.build import CardBuild
from ..cards.card_mesh import CardMesh
from ..cards.steps import result_of
from ..exchange.card_formats import CardFormat, format_of
from ..exchange.file_set import written_together
from ..exchange.index_buffer import index_buffer
from ..exchange.sidecar import SUFFIX, CardFile, sidecar_text
from ..pipeline import Rig
from ..shading.settings import ShadingSettings
from .card_export import check_cards, check_exporter, write_card_mesh
from .card_making import CardChoices, MadeCards, making_steps
from .card_maps import CardMaps, made_maps
from .card_material import material_of, write_tables
from .card_scene import CardLook, level_names, without_loose
from .card_textures import TextureFiles, texture_channels, texture_roles, write_textures

_MANIFEST = Path(__file__).parents[2] / "blender_manifest.toml"

type Stage = Callable[[str], AbstractContextManager[None]]


@dataclass(frozen=True)
class CardOutput:
    """How cards are written.

    format: one of exchange.card_formats by name; None goes by the file's suffix.
    name: of the hair in the file; None is the file's.
    portable: without custom attributes, which some engines refuse.
    index_buffer: whether the sorted indices are written as they are, too.
    """

    format: str | None = None
    name: str | None = None
    portable: bool = True
    index_buffer: bool = False
    textures: TextureFiles = field(default_factory=TextureFiles)


@dataclass(frozen=True)
class WrittenCards:
    """What was written. files: the mesh first, the sidecar last.

    notes: what the artist should know, each with its remedy.
    """

    build: CardBuild
    maps: CardMaps
    files: tuple[Path, ...]
    notes: tuple[str, ...]

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
    choices: CardChoices,
    output: CardOutput | None = None,
    stage: Stage = _untimed,
) -> WrittenCards:
    """Build the cards of a rig and write them.

    Args:
        path: of the mesh; the textures go beside it as NAME_base.png and so on.
        stage: gives a context in which a named stage is timed.

    Raises:
        HairloomError: no cards, a format that cannot be written, or nothing can be written there.
            Nothing is written then, and old files stay as they were.
    """
    output = output or CardOutput()
    path, file_format = format_of(path, output.format)
    check_exporter(file_format, str(path))

    def maps_of(build: CardBuild) -> CardMaps:
        with stage("card texture"):
            return made_maps(rig, build, choices)

    with stage("build cards"):
        made = result_of(making_steps(rig, choices, maps_of))
    check_cards(made.build.levels, str(path))
    with written_together(path) as folder:
        _write_all(folder / path.name, made, choices, output, file_format, stage)
        names = {file.name for file in folder.iterdir() if file.is_file()}
    beside = sorted(names - {path.name, path.stem + SUFFIX})
    files = (path.name, *beside, path.stem + SUFFIX)
    paths = tuple(path.with_name(name) for name in files)
    return WrittenCards(made.build, made.maps, paths, made.build.notes)


def _write_all(
    path: Path,
    made: MadeCards,
    choices: CardChoices,
    output: CardOutput,
    file_format: CardFormat,
    stage: Stage,
) -> None:
    """All files into the folder of `path`."""
    build, maps, name = made.build, made.maps, output.name or path.stem
    parts = map(without_loose, build.levels, build.backs)
    levels, backs = zip(*parts, strict=True)
    with stage("write textures"):
        grid = build.finest.atlas
        written = write_textures(path.parent, path.stem, maps.by_name, grid, output.textures)
        tables = write_tables(path.parent, path.stem, choices.shading)
    roles = texture_roles(written, maps.by_name)
    look = _look(maps, roles, choices.shading)
    with stage("write cards"):
        write_card_mesh(path, levels, file_format, look, name=name, portable=output.portable)
    indices = None
    if output.index_buffer:
        indices = f"{path.stem}.indices.bin", index_buffer(levels, backs)
        path.with_name(indices[0]).write_bytes(indices[1].content)
    sidecar = CardFile(
        path.name,
        file_format,
        levels,
        level_names(name, len(levels)),
        errors=build.errors,
        portable=output.portable,
        textures=roles,
        texture_files=texture_channels(written),
        base_gain=maps.base_gain,
        highlights=maps.highlights,
        material=material_of(choices.shading, tables),
        indices=indices,
        generator=tomllib.loads(_MANIFEST.read_text(encoding="utf-8"))["version"],
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
