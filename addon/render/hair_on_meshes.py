"""What hair throws on meshes beside that of the groom whose maps they are drawn with."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from .accumulation import Target
from .camera import Camera
from .hashed_alpha import shifts
from .inter_groom_shadow import InterGroomShadow
from .mesh_places import MeshPlaces, Placed
from .opacity_maps import OpacityMaps
from .shader_program import released_with_shaders
from .snapshot import MeshSnapshot

_NOWHERE = (0.0, 0.0, 0.0, -1.0)


class HairOnMeshes:
    """Asks the maps of all grooms at the nearest mesh of each pixel; making one touches no GPU.

    Meshes that are blended are left out: others are seen through them.
    """

    def __init__(self) -> None:
        self._target = Target()
        self.release()
        released_with_shaders(self)

    def release(self) -> None:
        """See shader_program.released_with_shaders."""
        self._places, self._between = MeshPlaces(), InterGroomShadow()

    def at(
        self,
        groups: Mapping[int, Sequence[MeshSnapshot]],
        maps: Sequence[OpacityMaps],
        light_count: int,
        camera: Camera,
        size: tuple[int, int],
    ) -> Any:
        """What MeshPass.draw takes as `between`; None where there is but one groom.

        Args:
            groups: meshes by the index of the maps that they are drawn with, in that order.
        """
        if len(maps) < 2:
            return None
        self._target.sized(*size).clear(_NOWHERE)
        with self._target.drawing():
            self._places.draw(_placed(groups, camera.sample), camera, *size)
        return self._between.at(self._target.color, None, list(enumerate(maps)), light_count)


def _placed(groups: Mapping[int, Sequence[MeshSnapshot]], sample: int) -> list[Placed]:
    """With the same holes as they are drawn with."""
    found = []
    for index, meshes in groups.items():
        solid = [each for each in meshes if len(each.surface.triangles)]
        solid = [each for each in solid if each.transparency != "blended"]
        found += [
            Placed(mesh, float(index), shifts(number, sample)) for number, mesh in enumerate(solid)
        ]
    return found
