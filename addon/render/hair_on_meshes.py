"""Shadows on meshes from grooms other than the one with whose maps they are drawn."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from .accumulation import Target
from .camera import Camera
from .hashed_alpha import shifts
from .inter_groom_shadow import InterGroomShadow
from .mesh_places import MeshPlaces, PlacedMesh
from .opacity_maps import OpacityMaps
from .shader_program import released_with_shaders
from .snapshot import MeshSnapshot

_NOWHERE = (0.0, 0.0, 0.0, -1.0)


class HairOnMeshes:
    """Looks up the maps of all grooms at the nearest mesh of each pixel.

    Creating one does not touch the GPU. Blended meshes are skipped, since others are visible
    through them.
    """

    def __init__(self) -> None:
        self._target = Target()
        self.release()
        released_with_shaders(self)

    def release(self) -> None:
        """See shader_program.released_with_shaders."""
        self._places, self._inter_groom_shadow = MeshPlaces(), InterGroomShadow()

    def other_tau(
        self,
        groups: Mapping[int, Sequence[MeshSnapshot]],
        maps: Sequence[OpacityMaps],
        light_count: int,
        camera: Camera,
        size: tuple[int, int],
    ) -> Any:
        """The argument `other_tau` of MeshPass.draw; None if there is only one groom.

        Args:
            groups: meshes by the index, in `maps`, of the maps with which they are drawn.
        """
        if len(maps) < 2:
            return None
        self._target.sized(*size).clear(_NOWHERE)
        with self._target.drawing():
            self._places.draw(_placed(groups, camera.sample), camera, *size)
        return self._inter_groom_shadow.other_tau(
            self._target.color, None, list(enumerate(maps)), light_count
        )


def _placed(groups: Mapping[int, Sequence[MeshSnapshot]], sample: int) -> list[PlacedMesh]:
    """The meshes that are not blended, with the same holes as when they are drawn."""
    found = []
    for index, meshes in groups.items():
        solid = [each for each in meshes if len(each.surface.triangles)]
        solid = [each for each in solid if each.transparency != "blended"]
        found += [
            PlacedMesh(mesh, float(index), shifts(number, sample))
            for number, mesh in enumerate(solid)
        ]
    return found
