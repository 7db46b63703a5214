"""Hair cards as they are drawn. Pure numpy: importable without gpu."""

from __future__ import annotations

from dataclasses import dataclass

from ..cards.card_mesh import CardMesh
from ..shading.textures import HairTextures


@dataclass(frozen=True, eq=False)
class CardSnapshot:
    """Cards in world space, in the order in which they are drawn: from the inside to the outside.

    has_tangent_map: the tangent map takes the place of the shift texture.

    Mesh and textures are uploaded again only when they are other objects than before.
    """

    mesh: CardMesh
    textures: HairTextures
    has_tangent_map: bool = False
