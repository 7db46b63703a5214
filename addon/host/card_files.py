"""Hair cards of a groom as files: the GLB and its sidecar."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass
from pathlib import Path

from .. import pipeline
from ..cards.card_mesh import CardMesh
from ..cards.settings import CardSettings
from ..exchange.sidecar import write_sidecar
from ..pipeline import Rig
from ..shading.ambient import AmbientSettings
from ..shading.settings import ShadingSettings
from ..shading.textures import TextureSettings, card_texture
from .glb import write_glb


@dataclass(frozen=True)
class CardChoices:
    """All parameters that cards hang on."""

    cards: CardSettings
    texture: TextureSettings
    ambient: AmbientSettings
    shading: ShadingSettings


def _untimed(_name: str) -> AbstractContextManager[None]:
    return nullcontext()


def write_cards(
    path: Path,
    rig: Rig,
    choices: CardChoices,
    stage: Callable[[str], AbstractContextManager[None]] = _untimed,
) -> tuple[CardMesh, Path]:
    """Build the cards of a rig and write them; returns them, and the path of the sidecar.

    Args:
        stage: gives a context in which a named stage is timed.

    Raises:
        HairloomError: no cards, or nothing can be written there.
    """
    with stage("build cards"):
        mesh = pipeline.cards_of(rig, choices.cards, choices.ambient)
    with stage("card texture"):
        texture = card_texture(choices.texture, mesh.atlas_columns)
    with stage("write cards"):
        write_glb(path, mesh, texture, name=path.stem, base_color=choices.shading.base_color)
        sidecar = write_sidecar(path, mesh)
    return mesh, sidecar
