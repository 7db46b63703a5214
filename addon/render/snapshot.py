"""What is drawn, as plain arrays: no live data of Blender ever reaches a pass.

Pure numpy: importable without gpu.
"""

from __future__ import annotations

from collections.abc import Hashable
from dataclasses import dataclass, field, fields
from inspect import isclass
from typing import Any

import numpy as np

from ..arrays import Floats, Ints
from ..dynamics.colliders import PosedCollider
from ..params import Settings
from ..refine.settings import DetailSettings
from ..shading.lights import Light
from ..shading.marschner.tables import DEFAULT_SIZE
from ..shading.settings import ShadingSettings, StrandSettings
from ..shading.shafts_settings import ShaftSettings
from ..shading.skin.settings import SkinSettings
from ..shading.volume.settings import VolumeSettings
from ..strands import Surface
from .card_snapshot import CardSnapshot
from .shader_source import DEBUG_VIEWS
from .strand_layout import NO_STRANDS, StrandLayout

type Color = tuple[float, float, float]

#: how meshes that do not cover all are drawn
TRANSPARENCIES = ("opaque", "hashed", "blended")
#: what a snapshot has of each point, and its channels
_OF_POINTS = {
    "points": (3,),
    "rest": (3,),
    "radius": (),
    "along": (),
    "occlusion": (),
    "openness": (4,),
    "skin_seen": (8,),
    "color": (3,),
}
SKIN: Color = (0.55, 0.38, 0.31)
#: an index of refraction of 1.4 gives ((1.4 - 1) / (1.4 + 1))^2
SKIN_SPECULAR, SKIN_ROUGHNESS = 0.028, 0.45


@dataclass(frozen=True, eq=False)
class Skin:
    """The head that a mesh is, or is a part of, for the soft shadow on it (render/skin_pass.py).

    surface: the whole head, world space; hand its triangles and UVs on as the same objects while
        they are the same.
    triangle: (triangle_count,) of the mesh: which of the head's they are; None is all of them.
    """

    surface: Surface
    triangle: Ints | None = None


@dataclass(frozen=True, eq=False)
class MeshPictures:
    """Pictures of a material, laid over the UVs of the mesh's surface, again and again beyond them.

    Hand the same array on where nothing changed. Row 0 is at v = 0.

    color: (height, width, 4) scene-linear, straight alpha, instead of the mesh's own colour.
    normal: (height, width, 4) normals in tangent space, 0 to 1; bump: how strong they are.
    """

    color: Floats | None = None
    normal: Floats | None = None
    bump: float = 1.0


@dataclass(frozen=True, eq=False)
class MeshSnapshot:
    """A lit mesh in world space.

    vertex_normals: (vertex_count, 3) unit vectors.
    color: scene-linear albedo.
    occlusion: (vertex_count,) light that arrives, 0 to 1; None is 1 everywhere.
    specular: the fraction of the light that the boundary reflects where it falls straight in.
    roughness: of the boundary, as Principled has it.
    key: of the mesh, equal from moment to moment. name: of its object, in Cryptomattes.
    number: what object masks hold where it is seen.
    is_holdout: it hides what is behind it and is a hole in the picture itself.
    skin: the head that it is a part of; None is no skin, on which shadows have hard edges.
    pictures: of its material; None, and on a surface without UVs, its colour alone.
    alpha: how much it covers, times the alpha of its picture.
    emission: scene-linear light that it gives off to the eye alone.
    transparency: one of TRANSPARENCIES: "opaque" whatever alpha says; "hashed" has as many holes as
        alpha asks for, finer than pixels; "blended" is drawn last, the farthest first.
    """

    surface: Surface
    vertex_normals: Floats
    color: Color = SKIN
    occlusion: Floats | None = None
    specular: float = SKIN_SPECULAR
    roughness: float = SKIN_ROUGHNESS
    key: Hashable = None
    name: str = ""
    number: int = 0
    is_holdout: bool = False
    skin: Skin | None = None
    pictures: MeshPictures | None = None
    alpha: float = 1.0
    transparency: str = "opaque"
    emission: Color = (0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        if self.transparency not in TRANSPARENCIES:
            raise ValueError(
                f"transparency {self.transparency!r} is none of {', '.join(TRANSPARENCIES)}"
            )

    @classmethod
    def of(
        cls,
        surface: Surface,
        color: Color = SKIN,
        occlusion: Floats | None = None,
        *,
        is_skin: bool = False,
    ) -> MeshSnapshot:
        """A mesh with smooth normals of its own."""
        skin = Skin(surface) if is_skin else None
        return cls(surface, surface.vertex_normals(), color, occlusion, skin=skin)


#: what throws shadows: a mesh with its alpha, or one that covers all
type Caster = Surface | MeshSnapshot


def surface_of(caster: Caster) -> Surface:
    return caster.surface if isinstance(caster, MeshSnapshot) else caster


@dataclass(eq=False)
class DevicePoints:
    """CVs that are computed on the GPU and stay there.

    Whoever computes them writes the next moment into the same texture, so a picture shows them as
    they are when it is drawn, and lets go of it when the GPU goes.

    layout: where they lie in the texture.
    texture: RGBA32F, xyz position [m, world] and w radius [m]; None before the first moment and
        after the release.
    center: (3,) [m], the middle of all roots.
    serial: grows whenever the texture is written, so that others know what is out of date.
    """

    layout: StrandLayout
    texture: Any = None
    center: Floats = field(default_factory=lambda: np.zeros(3, np.float32))
    serial: int = 0

    def release(self) -> None:
        self.texture = None
        self.serial += 1


@dataclass(frozen=True, eq=False)
class Snapshot:
    """One moment of hair, the meshes around it, and the light.

    Strands have as many points as each needs. What belongs to points is taken as a grid as well,
    (strand_count, cv_count, ...), of strands that have equally many; it is held point by point.

    points: (point_count, 3) float32 [m], world space, strand after strand, root first.
    radius: (point_count,) float32 [m].
    layout: which points each strand has; of a grid it follows. Hand the same one on.
    along: (point_count,) the fraction of its strand's length at which each point lies at rest, 0 at
        the root and 1 at the tip; None where points are evenly spaced.
    extinction, spacing: factor on the light that a strand blocks, and how far apart [m] the strands
        are whose hairs fill the space between them, see `groom.widths.Widths`.
    occlusion: (point_count,) ambient light that arrives, 0 to 1; None is 1 everywhere.
    openness: (point_count, 4), how much of the world's light comes straight to each point, by
        direction, see ambient.openness_field; None is what occlusion and the hair's volume say.
    skin_seen: (point_count, 8), the skin that each point sees, see light_flow.skin_seen_by;
        None is skin right beneath, as under hair on a plane.
    color: (point_count, 3) scene-linear, the strands' own; None is the look's, and so is NaN, all
        along a strand. Counts where the look wants it, see drawn_strands.drawn_color.
    seed: (strand_count,) whole numbers below 2^24, which the noise of a strand depends on; None is
        each strand's index.
    ambient, harmonics: the world's mean radiance [W/(m^2 sr)], and how it differs by direction,
        (8, 3), see shading/environment.py; None is not at all.
    volume_center: (3,) [m], what strands look away from; None is the middle of all roots.
    device_points: the same strands where the GPU has moved them; they are drawn in place of
        `points` and `radius`, which then only say how large the hair is.
    guide, group: (strand_count,) whole numbers, what debug_view shows; None is 0 everywhere.
    rank: (strand_count,) in 0..1, below 1: when a groom gets small, strands of high rank go first
        (refine/thinning.py); None draws all of them always.
    occluder_spheres: (k, 4) xyz center and w radius [m, world] of spheres inside the head that hide
        the strands behind them (refine/culling.py). The first 16 count; None hides nothing.
    debug_view: one of DEBUG_VIEWS.
    rest: (point_count, 3) [m], the strands in their style, whose lengths "stretch" compares; None:
        these are at rest.
    solids: colliders as they stand, from which "depth" measures; none: it is not known.
    casters: meshes that are not drawn here but throw shadows on the hair, world space.
    table_size: texels across Marschner's look-up tables; PREVIEW_SIZE while their shape changes.
    cards: hair cards, drawn after meshes and strands (render/card_pass.py).

    A pass uploads an array again only when it is another object than before: hand the same array
    on where nothing changed, and a new array (not the old one rewritten) where something did.

    Raises:
        ValueError: shapes that do not fit.
    """

    points: Floats
    radius: Floats
    occlusion: Floats | None = None
    openness: Floats | None = None
    skin_seen: Floats | None = None
    seed: Ints | None = None
    meshes: tuple[MeshSnapshot, ...] = ()
    lights: tuple[Light, ...] = ()
    ambient: Color = (0.05, 0.05, 0.05)
    harmonics: Floats | None = None
    shading: ShadingSettings = field(default_factory=ShadingSettings)
    strand_settings: StrandSettings = field(default_factory=StrandSettings)
    detail: DetailSettings = field(default_factory=DetailSettings)
    volume: VolumeSettings = field(default_factory=VolumeSettings)
    skin: SkinSettings = field(default_factory=SkinSettings)
    shafts: ShaftSettings = field(default_factory=ShaftSettings)
    volume_center: Floats | None = None
    device_points: DevicePoints | None = None
    guide: Ints | None = None
    group: Ints | None = None
    rank: Floats | None = None
    occluder_spheres: Floats | None = None
    debug_view: str = "none"
    rest: Floats | None = None
    solids: tuple[PosedCollider, ...] = ()
    casters: tuple[Caster, ...] = ()
    table_size: int = DEFAULT_SIZE
    cards: CardSnapshot | None = None
    extinction: float = 1.0
    spacing: float = 0.0
    color: Floats | None = None
    layout: StrandLayout = NO_STRANDS
    along: Floats | None = None

    def __post_init__(self) -> None:
        self._hold_point_by_point()
        points, strands = (self.layout.point_count,), (self.layout.strand_count,)
        expected: dict[str, tuple[int, ...]] = {
            "points": (*points, 3),
            "rest": (*points, 3),
            "radius": points,
            "along": points,
            "occlusion": points,
            "openness": (*points, 4),
            "skin_seen": (*points, 8),
            "color": (*points, 3),
            "seed": strands,
            "guide": strands,
            "group": strands,
            "rank": strands,
            "volume_center": (3,),
        }
        if self.occluder_spheres is not None:
            expected["occluder_spheres"] = (len(self.occluder_spheres), 4)
        for name, shape in expected.items():
            value = getattr(self, name)
            if value is not None and np.shape(value) != shape:
                raise ValueError(f"{name} has shape {np.shape(value)}, not {shape}")
        if self.device_points is not None and not self.device_points.layout.is_as(self.layout):
            raise ValueError("device_points are of other strands")
        if self.debug_view not in DEBUG_VIEWS:
            raise ValueError(f"debug_view {self.debug_view!r} is none of {', '.join(DEBUG_VIEWS)}")

    def _hold_point_by_point(self) -> None:
        grid = np.shape(self.points)
        if len(grid) != 3:
            return
        if grid[1] < 2:
            raise ValueError(f"strands have shape {grid}, not (S, C >= 2, 3)")
        layout = StrandLayout.uniform(grid[0], grid[1])
        if not self.layout.is_as(layout):
            object.__setattr__(self, "layout", layout)
        for name, channels in _OF_POINTS.items():
            values = getattr(self, name)
            if np.shape(values) == (*grid[:2], *channels):
                object.__setattr__(self, name, np.reshape(values, (-1, *channels)))

    @property
    def all_casters(self) -> tuple[Caster, ...]:
        """Meshes that throw shadows on the hair, drawn here or not."""
        return (*self.meshes, *self.casters)

    @property
    def strand_count(self) -> int:
        return self.layout.strand_count

    @property
    def has_world(self) -> bool:
        """Whether light comes from all around."""
        return any(self.ambient)

    @property
    def center(self) -> Floats:
        """What strands look away from, (3,) [m]."""
        if self.volume_center is not None:
            return np.asarray(self.volume_center, np.float32)
        return self.root_center

    @property
    def skin_color(self) -> Color:
        """What light through the hair comes back off: the mean colour of the meshes; of meshes that
        only throw shadows no colour is known, so they are skin; black without any.
        """
        if not self.meshes:
            return SKIN if self.casters else (0.0, 0.0, 0.0)
        red, green, blue = np.mean([mesh.color for mesh in self.meshes], axis=0).tolist()
        return red, green, blue

    @property
    def root_center(self) -> Floats:
        """The middle of all roots, (3,) [m]."""
        if self.device_points is not None:
            return self.device_points.center
        if not self.strand_count:
            return np.zeros(3, np.float32)
        return self.roots.mean(axis=0, dtype=np.float64).astype(np.float32)

    @property
    def roots(self) -> Floats:
        """First point of each strand, (strand_count, 3) [m]."""
        return self.points[self.layout.offsets[:-1]]


#: field of a snapshot -> the settings that it holds
SECTIONS: dict[str, type[Settings]] = {
    each.name: each.default_factory
    for each in fields(Snapshot)
    if isclass(each.default_factory) and issubclass(each.default_factory, Settings)
}
