"""What cards are built by, and what acts on them at once."""

from __future__ import annotations

from dataclasses import dataclass, field

from ...cards.atlas_settings import AtlasSettings
from ...cards.drawing_settings import CardDrawingSettings
from ...cards.occlusion_settings import CardOcclusionSettings
from ...cards.settings import CardSettings
from ...shading.ambient import AmbientSettings
from ...shading.settings import ShadingSettings, StrandSettings
from ...shading.textures import TextureSettings

#: What acts on cards at once: how they are drawn, and how wide the strands are.
type CardsDrawn = tuple[CardDrawingSettings, StrandSettings]


@dataclass(frozen=True)
class CardForm:
    """All that cards hang on beside the rig.

    picture_names: (texture, picture) of those that take the place of generated textures.
    shading: of the strands in the atlas. Forms are the same that differ in it by colours alone,
        since the atlas holds how strands differ from the mean, which these hardly change.
    ambient: of the strands, whose occlusion the cards take over.
    """

    cards: CardSettings = field(default_factory=CardSettings)
    atlas: AtlasSettings = field(default_factory=AtlasSettings)
    occlusion: CardOcclusionSettings = field(default_factory=CardOcclusionSettings)
    texture: TextureSettings = field(default_factory=TextureSettings)
    strands: StrandSettings = field(default_factory=StrandSettings)
    picture_names: tuple[tuple[str, str], ...] = ()
    shading: ShadingSettings = field(default_factory=ShadingSettings, compare=False)
    ambient: AmbientSettings = field(default_factory=AmbientSettings)
    variation: tuple[str, float, float] = field(init=False)

    def __post_init__(self) -> None:
        look = self.shading
        object.__setattr__(self, "variation", (look.model, look.color_variation, look.grey_share))
