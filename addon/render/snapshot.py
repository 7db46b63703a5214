"""The data that is drawn, as plain arrays: passes never access live Blender data.

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

#: ways of drawing partly transparent meshes
TRANSPARENCIES = ("opaque", "hashed", "blended")
#: fields of a snapshot with a value for each point, and their channels
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

    surface: the whole head, world space; pass the same objects for triangles and UVs while they do
        not change.
    triangle: (triangle_count,) for each triangle of the mesh its index in the head; None: the mesh
        is the head.
    """

    surface: Surface
    triangle: Ints | None = None


@dataclass(frozen=True, eq=False)
class MeshPictures:
    """Pictures of a material over the UVs of the mesh's surface, repeated beyond 0..1.

    Pass the same array while nothing changes. Row 0 is at v = 0.

    color: (height, width, 4) scene-linear, straight alpha, instead of the mesh's own colour.
    normal: (height, width, 4) normals in tangent space, 0 to 1; bump: their strength.
    """

    color: Floats | None = None
    normal: Floats | None = None
    bump: float = 1.0


@dataclass(frozen=True, eq=False)
class MeshSnapshot:
    """A lit mesh in world space.

    vertex_normals: (vertex_count, 3) unit vectors.
    color: scene-linear albedo.
    occlusion: (vertex_count,) fraction of ambient light that arrives, 0 to 1; None: 1 everywhere.
    specular: reflectance of the boundary at normal incidence.
    roughness: of the boundary, as in Principled.
    key: of the mesh, equal from moment to moment. name: of its object, in Cryptomattes.
    number: of its object, in object masks.
    is_holdout: it hides what is behind it and is itself a hole in the picture.
    skin: the head that it is a part of; None: it is not skin, and shadows on it have hard edges.
    pictures: of its material; None, or on a surface without UVs: its colour alone.
    alpha: its coverage, times the alpha of its picture.
    emission: scene-linear radiance that it emits towards the eye; it lights nothing.
    transparency: one of TRANSPARENCIES: "opaque" ignores alpha; "hashed" has holes, finer than
        pixels, as many as alpha requires; "blended" is drawn last, the farthest first.
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


#: a mesh that casts shadows, with alpha or opaque
type Caster = Surface | MeshSnapshot


def surface_of(caster: Caster) -> Surface:
    return caster.surface if isinstance(caster, MeshSnapshot) else caster


@dataclass(eq=False)
class DevicePoints:
    """CVs that are computed on the GPU and stay there.

    Their owner writes each next moment into the same texture, so a draw shows their current state;
    and releases it at the end of the GPU.

    layout: of the texture.
    texture: RGBA32F, xyz position [m, world] and w radius [m]; None before the first moment and
        after the release.
    center: (3,) [m], the middle of all roots.
    serial: grows whenever the texture is written, so that readers can tell what is out of date.
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

    Each strand has as many points as it needs. Values of points may also be given as a grid,
    (strand_count, cv_count, ...), for strands of one point count; they are stored point by point.

    points: (point_count, 3) float32 [m], world space, strand after strand, root first.
    radius: (point_count,) float32 [m].
    layout: the points of each strand; set from the shape of a grid. Pass the same one on.
    along: (point_count,) arc length of each point at rest as a fraction of its strand's length, 0
        at the root and 1 at the tip; None: points are evenly spaced.
    extinction, spacing: factor on the light that a strand blocks, and distance [m] of strands that
        represent the hairs between them, see `groom.widths.Widths`.
    occlusion: (point_count,) fraction of ambient light that arrives, 0 to 1; None: 1 everywhere.
    openness: (point_count, 4), how much of the world's light comes straight to each point, by
        direction, see ambient.openness_field; None: derived from occlusion and the hair's volume.
    skin_seen: (point_count, 8), the skin that each point sees, see
        light_flow.skin_seen_along_axes; None: skin right beneath, as under hair on a plane.
    color: (point_count, 3) scene-linear, the strands' own colours; NaN all along a strand, or None
        for all, means the look's colour. Used if the look requires it, see
        drawn_strands.drawn_color.
    seed: (strand_count,) whole numbers below 2^24 for the noise of each strand; None: each strand's
        index.
    ambient, harmonics: the world's mean radiance [W/(m^2 sr)], and its dependence on direction,
        (8, 3), see shading/environment.py; None: it has none.
    volume_center: (3,) [m], centre from which normals of the hair's volume point away; None: the
        middle of all roots.
    device_points: the same strands moved on the GPU; they are drawn instead of `points` and
        `radius`, which then only give the size of the hair.
    guide, group: (strand_count,) whole numbers for debug_view; None: 0 everywhere.
    rank: (strand_count,) in 0..1, below 1: as a groom gets small, strands of high rank are omitted
        first (refine/thinning.py); None: all are always drawn.
    occluder_spheres: (k, 4) xyz center and w radius [m, world] of spheres inside the head that hide
        the strands behind them (refine/culling.py). Only the first 16 are used; None: no culling.
    debug_view: one of DEBUG_VIEWS.
    rest: (point_count, 3) [m], the strands in their style, with whose lengths "stretch" compares;
        None: the strands are at rest.
    solids: colliders in their current pose, for "depth"; empty: depths are unknown.
    casters: meshes that are not drawn here but cast shadows on the hair, world space.
    table_size: texels across Marschner's look-up tables; PREVIEW_SIZE while the fibre's shape
        changes.
    cards: hair cards, drawn after meshes and strands (render/card_pass.py).

    A pass uploads an array again only when it is a new object: pass the same array while nothing
    changes, and a new array, not the old one overwritten, when something does.

    Raises:
        ValueError: shapes that do not match.
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
        if self.device_points is not None and not self.device_points.layout.has_same_counts(
            self.layout
        ):
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
        if not self.layout.has_same_counts(layout):
            object.__setattr__(self, "layout", layout)
        for name, channels in _OF_POINTS.items():
            values = getattr(self, name)
            if np.shape(values) == (*grid[:2], *channels):
                object.__setattr__(self, name, np.reshape(values, (-1, *channels)))

    @property
    def all_casters(self) -> tuple[Caster, ...]:
        """Meshes that cast shadows on the hair, drawn here or not."""
        return (*self.meshes, *self.casters)

    @property
    def strand_count(self) -> int:
        return self.layout.strand_count

    @property
    def has_world(self) -> bool:
        """Whether there is light from the world."""
        return any(self.ambient)

    @property
    def center(self) -> Floats:
        """The centre from which normals of the hair's volume point away, (3,) [m]."""
        if self.volume_center is not None:
            return np.asarray(self.volume_center, np.float32)
        return self.root_center

    @property
    def skin_color(self) -> Color:
        """The albedo that reflects light behind the hair: the mean colour of the meshes; SKIN if
        there are only casters, whose colour is unknown; black without any.
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


#: field of a snapshot -> the class of its settings
SECTIONS: dict[str, type[Settings]] = {
    each.name: each.default_factory
    for each in fields(Snapshot)
    if isclass(each.default_factory) and issubclass(each.default_factory, Settings)
}
