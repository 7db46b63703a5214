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
    """Cards in world space, in the order in which they are drawn: from the inside to the outside.

    has_tangent_map: the tangent map takes the place of the shift texture.
    back_triangles: (n, 3) the triangles in the order in which their back faces are drawn; None is
        the order of the mesh. Neither counts where cards are sorted for each view.
    is_view_compensated: alpha is what the strands cover on the mean of all turns of a card, as
        a baked atlas has it; cards cover as much at a slant, see card_look.view_compensated_alpha.
    is_layered: they are shells, each of which shows a part of each strand.
    thickness: of the hair that alpha stands for in shadows, see shading/volume/card_opacity.py.
    base_color: that the base texture is a factor of, where it is not the look's: of strands that
        have colours of their own.
    openness: (vertex_count, 4), how much of the world's light comes straight to each vertex, by
        direction and by `mesh.axes`, see ambient.openness_field; None is what occlusion says.
    skin_seen: (vertex_count, 8), the skin that each vertex sees, by
        `mesh.axes`, see light_flow.skin_seen_by; None is skin right beneath, as on a plane.
    depth: (vertex_count,) [m], how deep the strands of the card lie; None: in its plane.
    device: the card_textures.CardTextures that all who draw these cards share; None: each its own.

    Mesh and textures are uploaded again only when they are other objects than before; triangles
    that are the same array stay on the GPU while cards move.
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
        """The level of alpha that says how much light cards take."""
        grid = self.mesh.atlas
        level = lit_level(self.textures.alpha.shape, grid.columns, grid.rows)
        return min(level, SHELL_LIT_LEVEL) if self.is_layered else level
