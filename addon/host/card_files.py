"""Hair cards of a groom as files: the GLB, the textures beside it, and the sidecar."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass, field
from pathlib import Path

from .. import pipeline
from ..arrays import Floats
from ..cards.card_mesh import CardMesh
from ..cards.settings import CardSettings
from ..exchange.sidecar import write_sidecar
from ..pipeline import Rig
from ..shading.ambient import AmbientSettings
from ..shading.settings import ShadingSettings
from ..shading.textures import TEXTURES, HairTextures, TextureSettings, hair_textures
from .glb import write_glb
from .images import write_texture

#: textures whose fine steps would be seen in 8 bits
_DEPTHS = {"shift": "uint16", "tangent": "uint16"}


@dataclass(frozen=True)
class CardChoices:
    """All that cards hang on.

    pictures: what takes the place of generated textures, see `textures.picture_as`.
    """

    cards: CardSettings
    texture: TextureSettings
    ambient: AmbientSettings
    shading: ShadingSettings
    pictures: Mapping[str, Floats] = field(default_factory=dict)


@dataclass(frozen=True)
class WrittenCards:
    """What was written. files: the GLB first, the sidecar last."""

    mesh: CardMesh
    textures: HairTextures
    files: tuple[Path, ...]


def _untimed(_name: str) -> AbstractContextManager[None]:
    return nullcontext()


def write_cards(
    path: Path,
    rig: Rig,
    choices: CardChoices,
    stage: Callable[[str], AbstractContextManager[None]] = _untimed,
) -> WrittenCards:
    """Build the cards of a rig and write them.

    Args:
        path: of the GLB; the textures go beside it as NAME_base.png and so on.
        stage: gives a context in which a named stage is timed.

    Raises:
        HairloomError: no cards, or nothing can be written there.
    """
    with stage("build cards"):
        mesh = pipeline.cards_of(rig, choices.cards, choices.ambient)
    with stage("card texture"):
        made = hair_textures(choices.texture, mesh.atlas.columns)
        textures = made.with_pictures(choices.pictures)
    with stage("write cards"):
        write_glb(path, mesh, textures.card, name=path.stem, base_color=choices.shading.base_color)
    with stage("write textures"):
        beside = {name: path.with_name(f"{path.stem}_{name}.png") for name in TEXTURES}
        for name, file in beside.items():
            write_texture(
                file,
                getattr(textures, name),
                is_color=name == "base",
                depth=_DEPTHS.get(name, "uint8"),
            )
        sidecar = write_sidecar(
            path,
            mesh,
            textures={name: file.name for name, file in beside.items()},
            highlights=choices.texture.highlights,
        )
    return WrittenCards(mesh, textures, (path, *beside.values(), sidecar))
