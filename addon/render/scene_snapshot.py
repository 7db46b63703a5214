"""A whole scene for drawing: meshes, grooms and lights, as plain arrays.

Pure numpy: importable without gpu.
"""

from __future__ import annotations

from collections.abc import Hashable
from dataclasses import dataclass, field, replace

import numpy as np

from ..arrays import Floats
from ..shading.lights import Light
from ..shading.mesh_shadow_settings import MeshShadowSettings
from .light_samples import lights_at
from .snapshot import Color, MeshSnapshot, Snapshot


@dataclass(frozen=True, eq=False)
class DrawnGroom:
    """One groom of a scene.

    key: equal from moment to moment.
    snapshot: its meshes, lights and ambient are ignored; those of the scene are used.
    name, number: of its object, for Cryptomattes and the object mask.
    is_holdout: it hides what is behind it and is itself a hole in the picture.
    """

    key: Hashable
    snapshot: Snapshot
    name: str = ""
    number: int = 0
    is_holdout: bool = False


@dataclass(frozen=True, eq=False)
class SceneSnapshot:
    """One moment of a scene.

    casters: meshes that cast shadows, visible or not, world space.
    mesh_shadows: settings of shadows of meshes on meshes.
    ambient, harmonics: the world's, see Snapshot.
    """

    meshes: tuple[MeshSnapshot, ...] = ()
    casters: tuple[MeshSnapshot, ...] = ()
    grooms: tuple[DrawnGroom, ...] = ()
    lights: tuple[Light, ...] = ()
    ambient: Color = (0.0, 0.0, 0.0)
    harmonics: Floats | None = None
    mesh_shadows: MeshShadowSettings = field(default_factory=MeshShadowSettings)
    _lit_snapshots: dict[Hashable, Snapshot] = field(default_factory=dict, init=False, repr=False)

    def lit_snapshot(self, groom: DrawnGroom) -> Snapshot:
        """The groom in the scene's light, on its nearest mesh, with all meshes that cast shadows;
        the same object for each call.
        """
        if groom.key not in self._lit_snapshots:
            near = _nearest(self.casters, groom.snapshot.center)
            others = tuple(mesh for mesh in self.casters if mesh is not near)
            self._lit_snapshots[groom.key] = replace(
                groom.snapshot,
                meshes=() if near is None else (near,),
                casters=others,
                lights=self.lights,
                ambient=self.ambient,
                harmonics=self.harmonics,
            )
        return self._lit_snapshots[groom.key]

    def at_sample(self, sample: int) -> SceneSnapshot:
        """The same moment with one point of each light, see light_samples.py."""
        centers = [self.lit_snapshot(groom).center for groom in self.grooms]
        center = np.mean(centers, axis=0) if centers else np.zeros(3)
        lights = lights_at(self.lights, sample, center)
        return self if lights == self.lights else replace(self, lights=lights)

    def without_hair(self) -> Snapshot:
        """A snapshot with only the lights, for meshes that no hair shades."""
        none = np.zeros((0, 3), np.float32)
        return Snapshot(
            none,
            none[:, 0],
            lights=self.lights,
            ambient=self.ambient,
            harmonics=self.harmonics,
        )


def shaded_by(meshes: tuple[MeshSnapshot, ...], centers: Floats) -> list[int]:
    """For each mesh the groom whose shadow falls on it: the nearest one.

    Args:
        centers: (groom_count, 3) [m], the middles of the grooms that cast shadows.

    Returns:
        Indices into `centers`; all -1 if there are none.
    """
    if not len(centers):
        return [-1] * len(meshes)
    return [int(_distances(mesh, centers).argmin()) for mesh in meshes]


def _nearest(meshes: tuple[MeshSnapshot, ...], center: Floats) -> MeshSnapshot | None:
    """The mesh from which hair around this place probably grows: the one with the nearest box; of
    several, such as those whose boxes contain the place, skin before a cap worn on it, then the
    smallest.
    """

    def rank(mesh: MeshSnapshot) -> tuple[float, bool, float]:
        low, high = mesh.surface.bounds()
        distance = float(_distances(mesh, center[None])[0])
        return distance, mesh.skin is None, float(np.linalg.norm(high - low))

    return min(meshes, key=rank, default=None)


def _distances(mesh: MeshSnapshot, places: Floats) -> Floats:
    """Squares of the distances [m^2] of places (n, 3) from a mesh's box, (n,)."""
    low, high = mesh.surface.bounds()
    outside = np.maximum(low - places, places - high).clip(min=0.0)
    squares: Floats = (outside**2).sum(axis=1)
    return squares
