"""Hair cards as they are drawn. Pure numpy: importable without gpu."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from ..arrays import Floats, Ints
from ..cards.card_mesh import CardMesh
from ..cards.drawing_settings import CardDrawingSettings
from ..shading.textures import HairTextures
from ..shading.volume.card_opacity import SHELL_LIT_LEVEL, lit_level


@dataclass(frozen=True, eq=False)
class CardSnapshot:
    """Cards in world space, in drawing order: from the inside to the outside.

    has_tangent_map: the tangent map is used instead of the shift texture.
    back_triangles: (n, 3) the triangles in the order in which their back faces are drawn; None:
        the order of the mesh. Both orders are ignored where cards are sorted for each view.
    is_view_compensated: alpha is the coverage of the strands averaged over all rotations of a card
        about them, as in a baked atlas; see card_look.view_compensated_alpha for cards at a slant.
    is_layered: the cards are shells, each of which shows a part of each strand.
    thickness: factor on the optical depth of alpha in shadows, see shading/volume/card_opacity.py.
    base_color: the colour that the base texture multiplies, for strands with colours of their own;
        None: that of the look.
    openness: (vertex_count, 4), how much of the world's light comes straight to each vertex, by
        direction in `mesh.axes`, see ambient.openness_field; None: derived from occlusion.
    skin_seen: (vertex_count, 8), the skin that each vertex sees, in `mesh.axes`, see
        light_flow.skin_seen_along_axes; None: skin right beneath, as on a plane.
    depth: (vertex_count,) [m], depth that the strands of the card fill; None: all lie in its plane.
    device: the card_textures.CardTextures shared by all passes that draw these cards; None: each
        pass makes its own.

    Mesh and textures are uploaded again only when they are new objects; triangles that are the same
    array stay on the GPU while cards move.
    """

    mesh: CardMesh
    textures: HairTextures
    has_tangent_map: bool = False
    back_triangles: Ints | None = None
    drawing: CardDrawingSettings = field(default_factory=CardDrawingSettings)
    thickness: float = 1.0
    is_view_compensated: bool = False
    is_layered: bool = False
    base_color: tuple[float, float, float] | None = None
    openness: Floats | None = None
    skin_seen: Floats | None = None
    depth: Floats | None = None
    device: Any = None

    @property
    def lit_level(self) -> int:
        """The mip level of alpha from which the optical depth of cards is computed."""
        grid = self.mesh.atlas
        level = lit_level(self.textures.alpha.shape, grid.columns, grid.rows)
        return min(level, SHELL_LIT_LEVEL) if self.is_layered else level
