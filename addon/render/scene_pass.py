"""Draws a whole scene: meshes first, then the strands of all grooms, then their cards."""

from __future__ import annotations

import threading
from collections.abc import Hashable, Sequence, Set
from dataclasses import dataclass, replace
from itertools import chain
from typing import Any

import numpy as np

from ..arrays import Floats
from ..shading.lights import packed_lights
from ..shading.shafts_settings import ShaftSettings
from . import gpu_memory
from .accumulation import Target
from .bright_pass import one_texel
from .camera import Camera
from .groom_pass import GroomPass
from .hair_on_meshes import HairOnMeshes
from .hashed_alpha import shifts
from .holdout import Holdout
from .mesh_pass import MeshPass
from .mesh_places import MeshPlaces, PlacedMesh
from .mesh_shadows import MeshShadowPass
from .nearest import Nearest
from .opacity_maps import OpacityMaps
from .scene_snapshot import SceneSnapshot, shaded_by
from .shafts_pass import draw_separate_shafts, finish_with_shafts
from .snapshot import MeshSnapshot, Snapshot
from .strand_pass import Statistics
from .textures import texture_to_array

type Rgba = tuple[float, float, float, float]

#: For renders in the window, which draw in a separate thread, since passes share textures.
DRAW_LOCK = threading.Lock()
_NOTHING: Rgba = (0.0, 0.0, 0.0, 0.0)
_ALL: Rgba = (1.0, 1.0, 1.0, 1.0)
_NOWHERE: Rgba = (0.0, 0.0, 0.0, -1.0)


@dataclass(frozen=True, eq=False)
class SeparateShafts:
    """Shafts of light in a texture of their own, for a picture in which meshes are holes.

    light: RGBA32F texture of the picture's size into which they are drawn.
    background: the picture that is visible through the holes, see BrightShafts; None: the sky
    alone.
    shows_world: the world is in that picture, so that its bright places make shafts as bright parts
        and not also as lights.
    """

    light: Any
    background: Any = None
    shows_world: bool = False


def shafts_of(scene: SceneSnapshot) -> ShaftSettings | None:
    """The settings of a scene's shafts of light: those of the first groom that has shafts."""
    grooms = (groom.snapshot.shafts for groom in scene.grooms)
    return next((each for each in grooms if each.use_shafts), None)


class ScenePass:
    """A scene on the GPU, kept from draw to draw. Creating one does not touch the GPU."""

    def __init__(self) -> None:
        self._grooms: dict[Hashable, GroomPass] = {}
        self._mesh_passes: dict[Hashable, MeshPass] = {}
        self._mesh_shadows, self._hair_on_meshes = MeshShadowPass(), HairOnMeshes()
        self._placed = MeshPlaces()
        self._holdout = Holdout()

    def draw(
        self,
        scene: SceneSnapshot,
        camera: Camera,
        target: Target,
        size: tuple[int, int],
        sky: Rgba,
        separate_shafts: SeparateShafts | None = None,
    ) -> None:
        """Draw one moment, scene-linear, premultiplied.

        Args:
            size: width and height [pixels].
            sky: background colour.
            separate_shafts: the texture for shafts of light; None: they are drawn into the picture.

        Raises:
            ShaderError: a shader does not compile here, or points on the GPU were released.
        """
        with DRAW_LOCK, gpu_memory.shared_by(len(scene.grooms)):
            self._draw(scene, camera, target, size, sky, separate_shafts)

    def _draw(
        self,
        scene: SceneSnapshot,
        camera: Camera,
        target: Target,
        size: tuple[int, int],
        sky: Rgba,
        separate_shafts: SeparateShafts | None,
    ) -> None:
        lit_grooms = {groom.key: scene.lit_snapshot(groom) for groom in scene.grooms}
        maps = self._maps(scene)
        shafts = shafts_of(scene)
        holdouts = {groom.key for groom in scene.grooms if groom.is_holdout}
        visible = lit_grooms.keys() - holdouts
        # shafts use alpha to find what stands before a light
        adds_sky_last = shafts is not None and separate_shafts is None
        target.sized(*size).clear(_NOTHING if adds_sky_last else sky)
        with target.drawing():
            self._draw_meshes(scene, camera, size, maps)
            self._draw_hair(lit_grooms, visible, camera, size, maps)
        if holdouts:
            self._holdout.cut(
                target, lambda: self._draw_hair(lit_grooms, holdouts, camera, size, maps)
            )
        color, depth = target.color, target.depth
        if separate_shafts is not None:
            separate_shafts.light.clear(format="FLOAT", value=_NOTHING)
            if shafts is not None:
                shaft_texture, background = (
                    separate_shafts.light,
                    separate_shafts.background or one_texel(sky),
                )
                lights = [
                    each
                    for each in scene.lights
                    if not (separate_shafts.shows_world and each.is_from_world)
                ]
                draw_separate_shafts(
                    shaft_texture, color, depth, background, camera, lights, shafts
                )
        elif shafts is not None:
            finish_with_shafts(color, color, depth, camera, scene.lights, shafts, sky)

    def draw_hair_shadow(
        self, scene: SceneSnapshot, camera: Camera, target: Target, size: tuple[int, int]
    ) -> None:
        """Draw the shadow of hair on meshes: the fraction of light, by colour, that hair lets
        through; 1 elsewhere.

        Arguments and errors as of `draw`.
        """
        with DRAW_LOCK, gpu_memory.shared_by(len(scene.grooms)):
            maps = self._maps(scene)
            target.sized(*size).clear(_ALL)
            with target.drawing():
                self._draw_meshes(scene, camera, size, maps, is_hair_shadow=True)

    def _maps(self, scene: SceneSnapshot) -> dict[Hashable, OpacityMaps | None]:
        """The opacity maps of each groom. Also releases grooms that are no longer in the scene."""
        self._forget_but(scene)
        lit = {groom.key: scene.lit_snapshot(groom) for groom in scene.grooms}
        return {key: self._groom(key).maps(groom) for key, groom in lit.items()}

    @property
    def statistics(self) -> tuple[Statistics, ...]:
        """The counts of each groom that was drawn last."""
        return tuple(each.strands.statistics for each in self._grooms.values())

    @property
    def notes(self) -> tuple[str, ...]:
        """Notes to the artist on the last draw, each with its remedy."""
        return tuple(dict.fromkeys(chain(*(each.notes for each in self._grooms.values()))))

    def nearest(
        self, scene: SceneSnapshot, camera: Camera, target: Target, size: tuple[int, int]
    ) -> Nearest:
        """The nearest surface at the centre of each pixel. Strands are opaque, whatever their
        transparency, and no thinner than *Min Width*; cards and meshes count where they cover at
        least a half.
        """
        with DRAW_LOCK, gpu_memory.shared_by(len(scene.grooms)):
            target.sized(*size).clear(_NOWHERE)
            with target.drawing():
                meshes = [PlacedMesh(mesh, float(index)) for index, mesh in enumerate(scene.meshes)]
                self._placed.draw(meshes, camera, *size)
            mesh = texture_to_array(target.color)[..., 3].astype(np.int32)
            groom, strand = np.full_like(mesh, -1), np.full_like(mesh, -1)
            place, depth = np.zeros(mesh.shape, np.float32), target.depths()
            for index, drawn in enumerate(scene.grooms):
                target.clear_color(_NOTHING)
                with target.drawing():
                    opaque = _opaque(scene.lit_snapshot(drawn))
                    self._groom(drawn.key).strands.draw(opaque, camera, *size, content="places")
                    self._groom(drawn.key).cards.draw_depth(drawn.snapshot, camera, *size)
                before, depth = depth, target.depths()
                here, found = depth < before, texture_to_array(target.color)
                is_strand = here & (found[..., 3] > 0.0)
                mesh[here], groom[here], strand[here] = -1, index, -1
                strand[is_strand] = found[is_strand, 0].astype(np.int32)
                place[is_strand] = found[is_strand, 1]
        return Nearest(depth, mesh, groom, strand, place)

    def on_meshes(
        self,
        scene: SceneSnapshot,
        values: Sequence[Floats],
        camera: Camera,
        target: Target,
        size: tuple[int, int],
    ) -> Floats:
        """Interpolated vertex values of the nearest mesh at each pixel, (height, width, 3); 0
        elsewhere.

        Args:
            values: (vertex_count, 3) of each mesh.
        """
        pairs = zip(scene.meshes, values, strict=True)
        with DRAW_LOCK:
            target.sized(*size).clear(_NOTHING)
            with target.drawing():
                carrying = [PlacedMesh(mesh, 0.0, vertex_values=each) for mesh, each in pairs]
                self._placed.draw(carrying, camera, *size)
            return texture_to_array(target.color)[..., :3].copy()

    def tangents(
        self, scene: SceneSnapshot, camera: Camera, target: Target, size: tuple[int, int]
    ) -> Floats:
        """Sums of the unit tangents of all visible strands, weighted by their coverage of the
        pixel, (height, width, 3), world space, root to tip. Cards have none.
        """
        with DRAW_LOCK, gpu_memory.shared_by(len(scene.grooms)):
            target.sized(*size).clear(_NOTHING)
            with target.drawing():
                self._placed.draw(_places(scene, camera.sample), camera, *size)
            target.clear_color(_NOTHING)
            with target.drawing():
                for drawn in (each for each in scene.grooms if not each.is_holdout):
                    snapshot = scene.lit_snapshot(drawn)
                    self._groom(drawn.key).strands.draw(snapshot, camera, *size, content="tangents")
            return texture_to_array(target.color)[..., :3].copy()

    def coverages(
        self, scene: SceneSnapshot, camera: Camera, target: Target, size: tuple[int, int]
    ) -> tuple[dict[str, Floats], Floats]:
        """The coverage of each pixel by each object, by name, and by all hair, in the picture of
        `draw`, (height, width) each. Blended meshes and holdouts cover nothing.
        """
        # in the order of `draw`: strands before cards, holes last
        grooms = sorted(
            scene.grooms, key=lambda each: (each.is_holdout, each.snapshot.cards is not None)
        )
        alphas = []
        with DRAW_LOCK, gpu_memory.shared_by(len(scene.grooms)):
            target.sized(*size).clear(_NOWHERE)
            with target.drawing():
                self._placed.draw(_places(scene, camera.sample), camera, *size)
            mesh = texture_to_array(target.color)[..., 3].astype(np.int32)
            for drawn in grooms:
                target.clear_color(_NOTHING)
                with target.drawing():
                    snapshot = scene.lit_snapshot(drawn)
                    self._groom(drawn.key).strands.draw(snapshot, camera, *size, content="tangents")
                    self._groom(drawn.key).cards.draw(snapshot, camera, *size)
                alphas.append(texture_to_array(target.color)[..., 3].copy())
        found: dict[str, Floats] = {}
        left = np.ones(mesh.shape, np.float32)
        for drawn, alpha in reversed(list(zip(grooms, alphas, strict=True))):
            if not drawn.is_holdout:
                found[drawn.name] = found.get(drawn.name, 0.0) + left * alpha
            left = left * (1.0 - alpha)
        hair = sum(found.values(), np.zeros_like(left))
        for index in np.unique(mesh[mesh >= 0]):
            drawn_mesh = scene.meshes[index]
            if not drawn_mesh.is_holdout:
                found[drawn_mesh.name] = found.get(drawn_mesh.name, 0.0) + left * (mesh == index)
        return found, hair

    def _draw_hair(
        self,
        lit_grooms: dict[Hashable, Snapshot],
        keys: Set[Hashable],
        camera: Camera,
        size: tuple[int, int],
        maps: dict[Hashable, OpacityMaps | None],
    ) -> None:
        """Draw only these grooms, in the order of the scene."""
        grooms = [(key, groom) for key, groom in lit_grooms.items() if key in keys]
        for key, groom in grooms:
            own = self._groom(key)
            own.strands.draw(groom, camera, *size, other_maps=own.other_maps(key, groom, maps))
        for key, groom in grooms:
            self._groom(key).cards.draw(groom, camera, *size, opacity=maps[key])

    def _groom(self, key: Hashable) -> GroomPass:
        return self._grooms.setdefault(key, GroomPass())

    def _draw_meshes(
        self,
        scene: SceneSnapshot,
        camera: Camera,
        size: tuple[int, int],
        maps: dict[Hashable, OpacityMaps | None],
        *,
        is_hair_shadow: bool = False,
    ) -> None:
        """Draw each mesh with the maps of the nearest groom, and the optical depth of the other
        grooms.
        """
        shading = [groom for groom in scene.grooms if maps[groom.key] is not None]
        centers = np.array([scene.lit_snapshot(groom).center for groom in shading]).reshape(-1, 3)
        shadows = self._mesh_shadows.maps(
            scene.casters, packed_lights(scene.lights), scene.mesh_shadows
        )
        groups: dict[int, list[MeshSnapshot]] = {}
        for mesh, index in zip(scene.meshes, shaded_by(scene.meshes, centers), strict=True):
            groups.setdefault(index, []).append(mesh)
        found = [each for groom in shading if (each := maps[groom.key]) is not None]
        light_count = len(packed_lights(scene.lights))
        other_tau = self._hair_on_meshes.other_tau(groups, found, light_count, camera, size)
        for index, meshes in groups.items():
            groom = None if index < 0 else shading[index]
            light = scene.without_hair() if groom is None else scene.lit_snapshot(groom)
            key = None if groom is None else groom.key
            mesh_pass = self._mesh_passes.setdefault(key, MeshPass())
            opacity = None if key is None else maps[key]
            draw = mesh_pass.draw_hair_shadow if is_hair_shadow else mesh_pass.draw
            draw(
                replace(light, meshes=tuple(meshes)),
                camera,
                *size,
                opacity=opacity,
                shadows=shadows,
                other_tau=other_tau,
            )

    def _forget_but(self, scene: SceneSnapshot) -> None:
        """Release grooms that are no longer in the scene."""
        keys = {groom.key for groom in scene.grooms}
        for passes in (self._grooms, self._mesh_passes):
            for key in set(passes) - keys - {None}:
                del passes[key]


def _opaque(snapshot: Snapshot) -> Snapshot:
    """The same hair with opaque strands."""
    opaque = replace(snapshot.strand_settings, transparency="none")
    return replace(snapshot, strand_settings=opaque)


def _places(scene: SceneSnapshot, sample: int) -> list[PlacedMesh]:
    """The meshes that are not blended, by index, with the same holes as when they are drawn. Others
    are visible through blended ones, which are skipped."""
    return [
        PlacedMesh(mesh, float(index), shifts(index, sample))
        for index, mesh in enumerate(scene.meshes)
        if mesh.transparency != "blended"
    ]
