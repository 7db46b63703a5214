"""Every parameter set of Hairloom in one table: for the command line, the docs and the tests."""

from __future__ import annotations

from .cards.atlas_settings import AtlasSettings
from .cards.drawing_settings import CardDrawingSettings
from .cards.occlusion_settings import CardOcclusionSettings
from .cards.settings import CardSettings
from .dynamics.cloth.settings import FinSettings
from .dynamics.fitting.sphere_fit import SphereFitSettings
from .dynamics.settings import DynamicsSettings
from .groom.children_settings import ChildrenSettings
from .groom.settings import GrowSettings, GuideSettings
from .params import Settings
from .refine.settings import DetailSettings
from .shading.ambient import AmbientSettings
from .shading.mesh_shadow_settings import MeshShadowSettings
from .shading.picture_settings import PictureSettings
from .shading.settings import ShadingSettings, StrandSettings
from .shading.shafts_settings import ShaftSettings
from .shading.skin.settings import SkinSettings
from .shading.textures import TextureSettings
from .shading.volume.settings import VolumeSettings

ALL_SETTINGS: dict[str, type[Settings]] = {
    settings.section: settings
    for settings in (
        GrowSettings,
        GuideSettings,
        ChildrenSettings,
        DynamicsSettings,
        FinSettings,
        SphereFitSettings,
        DetailSettings,
        StrandSettings,
        ShadingSettings,
        VolumeSettings,
        SkinSettings,
        ShaftSettings,
        AmbientSettings,
        CardSettings,
        AtlasSettings,
        CardOcclusionSettings,
        CardDrawingSettings,
        TextureSettings,
        PictureSettings,
        MeshShadowSettings,
    )
}
