"""A scene as the render engine draws it, read from one depsgraph evaluation.

Reading changes nothing, and keeps no references to Blender's data.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any

import bpy
import numpy as np

from ...arrays import Floats
from ...errors import HairloomError
from ...render.scene_snapshot import DrawnGroom, SceneSnapshot
from ...render.snapshot import MeshSnapshot, Snapshot
from ...shading.mesh_shadow_settings import MeshShadowSettings
from ...shading.skin.notes import uv_notes
from ..base.objects import head_of
from ..properties.properties import settings_of
from ..scene.lights import light_warnings, read_lights
from ..scene.mesh_materials import material_notes
from ..scene.world import read_environment, world_notes
from . import engine_hair, hair_scene
from .engine_hair import HairNotReadyError
from .engine_meshes import SOLID_TYPES, read_meshes, reused_or_new

type Key = tuple[int, ...]
type IsShown = Callable[[bpy.types.Object], bool]


@dataclass(frozen=True)
class Visibility:
    """How one instance appears in the picture."""

    is_seen: bool
    is_holdout: bool
    casts_shadow: bool


@dataclass(frozen=True, eq=False)
class _ReadMesh:
    """A mesh that was read. notes: on its materials. skin_notes: on the UVs of a head, which a soft
    shadow needs."""

    matrix: Floats
    is_holdout: bool
    meshes: tuple[MeshSnapshot, ...]
    notes: tuple[str, ...] = ()
    skin_notes: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class _ReadGroom:
    """A groom that was read. state: see `engine_hair.state_key`, with matrix and holdout."""

    state: tuple[Any, ...]
    groom: DrawnGroom


@dataclass(frozen=True, eq=False)
class _Reading:
    """One reading of a scene, and what it has found so far.

    layer: whose visibility counts. is_hair_scene: whether solids only hold the hair out. changed,
    is_previewed, has_pending_preview, blocking: see `SceneReader.read`.
    """

    depsgraph: bpy.types.Depsgraph
    layer: bpy.types.ViewLayer
    is_hair_scene: bool
    changed: set[int] | None
    is_previewed: Callable[[int], bool]
    has_pending_preview: Callable[[int], bool]
    blocking: bool
    drawn: list[MeshSnapshot] = field(default_factory=list)
    casters: list[MeshSnapshot] = field(default_factory=list)
    meshes: dict[Key, _ReadMesh] = field(default_factory=dict)
    grooms: dict[Key, _ReadGroom] = field(default_factory=dict)
    warnings: list[str] = field(default_factory=list)

    def mesh_notes(self) -> tuple[str, ...]:
        """Notes on materials, and on UVs where a soft shadow needs them, each once."""
        notes = [note for each in self.meshes.values() for note in each.notes]
        if any(_has_soft_shadow(each.groom.snapshot) for each in self.grooms.values()):
            notes += [note for each in self.meshes.values() for note in each.skin_notes]
        return tuple(dict.fromkeys(notes))


class SceneReader:
    """Reads a scene repeatedly; unchanged meshes and grooms stay the same objects.

    warnings: from the last reading, each with its remedy.
    previewed: grooms that were left out because they are previewed, by session number.
    pending: session numbers of grooms whose new hair is being built; until then they are shown as
        before, if they were.
    """

    def __init__(self) -> None:
        self.warnings: tuple[str, ...] = ()
        self.previewed: dict[int, Visibility] = {}
        self.pending: set[int] = set()
        self._meshes: dict[Key, _ReadMesh] = {}
        self._grooms: dict[Key, _ReadGroom] = {}
        self._heads: frozenset[int] = frozenset()

    def read(
        self,
        depsgraph: bpy.types.Depsgraph,
        *,
        changed: set[int] | None = None,
        is_shown: IsShown = lambda _: True,
        is_previewed: Callable[[int], bool] = lambda _: False,
        has_pending_preview: Callable[[int], bool] = lambda _: False,
        blocking: bool = True,
    ) -> SceneSnapshot:
        """The scene in this evaluation.

        Args:
            changed: session numbers of data-blocks whose shape or material may have changed since
                the last reading; None: all.
            is_shown: whether an object is visible.
            is_previewed: whether a groom, by session number, is left out; its instances are not.
            has_pending_preview: whether a groom, by session number, stays as it was, since its
                preview is about to be shown.
            blocking: False: hair is built in a thread, and stays as it was until then.
        """
        drawn_scene = hair_scene.drawn_scene(depsgraph.scene)
        reading = _Reading(
            depsgraph,
            depsgraph.view_layer if drawn_scene is None else hair_scene.drawn_layer(drawn_scene),
            drawn_scene is not None,
            changed,
            is_previewed,
            has_pending_preview,
            blocking,
        )
        self.previewed, self.pending = {}, set()
        self._heads = _heads(depsgraph)
        for instance in depsgraph.object_instances:
            if instance.show_self and is_shown(_scene_object(instance)):
                self._read_instance(reading, instance)
        self._meshes, self._grooms = reading.meshes, reading.grooms
        if not blocking:  # a render's thread must not read bpy.data.objects, as the window may edit
            engine_hair.forget_deleted()
        grooms = tuple(each.groom for each in reading.grooms.values())
        environment = read_environment(depsgraph.scene_eval, blocking=blocking)
        self.warnings = (
            *reading.warnings,
            *reading.mesh_notes(),
            *light_warnings(depsgraph, environment.suns),
            *world_notes(depsgraph.scene_eval),
        )
        return SceneSnapshot(
            meshes=tuple(reading.drawn),
            casters=tuple(reading.casters),
            grooms=grooms,
            lights=read_lights(depsgraph, _center(grooms, reading.drawn), environment.suns),
            ambient=environment.ambient,
            harmonics=environment.harmonics,
            mesh_shadows=settings_of(depsgraph.scene.hairloom.mesh_shadows, MeshShadowSettings),
        )

    def _read_instance(
        self, reading: _Reading, instance: bpy.types.DepsgraphObjectInstance
    ) -> None:
        """Add an instance of an object to the reading."""
        obj, key = instance.object, _instance_key(instance)
        matrix = np.array(instance.matrix_world)
        visibility = _visibility(instance, reading.layer)
        if obj.type in SOLID_TYPES:
            if reading.is_hair_scene:
                visibility = replace(visibility, is_holdout=True)
            mesh = self._read_mesh(reading, key, obj, matrix, visibility)
            reading.meshes[key] = mesh
            if visibility.is_seen:
                reading.drawn.extend(mesh.meshes)
            if visibility.casts_shadow:
                reading.casters.extend(mesh.meshes)
            return
        if obj.type != "CURVES":
            return
        hair = obj.original
        # a preview draws a groom once; its instances are read like any other hair
        if not instance.is_instance and reading.is_previewed(hair.session_uid):
            self.previewed[hair.session_uid] = visibility
            return
        groom = None
        if reading.has_pending_preview(hair.session_uid):
            groom = self._grooms.get(key)
        elif visibility.is_seen:
            groom = self._read_groom(reading, key, hair, matrix, is_holdout=visibility.is_holdout)
        if groom is not None:
            reading.grooms[key] = groom

    def _read_mesh(
        self,
        reading: _Reading,
        key: Key,
        obj: bpy.types.Object,
        matrix: Floats,
        visibility: Visibility,
    ) -> _ReadMesh:
        previous, changed = self._meshes.get(key), reading.changed
        if (
            previous is not None
            and changed is not None
            and previous.is_holdout == visibility.is_holdout
            and np.array_equal(previous.matrix, matrix)
            and not changed & _uids(obj)
        ):
            return previous
        number = obj.pass_index
        is_head = obj.original.session_uid in self._heads
        meshes = tuple(
            replace(
                mesh,
                key=(*key, part),
                name=obj.name,
                number=number,
                is_holdout=visibility.is_holdout,
            )
            for part, mesh in enumerate(read_meshes(obj, matrix, is_head=is_head))
        )
        if previous is not None and len(previous.meshes) == len(meshes):
            pairs = zip(previous.meshes, meshes, strict=True)
            meshes = tuple(reused_or_new(old, new) for old, new in pairs)
        notes = material_notes(obj)
        skin_notes = _skin_notes(obj.name, meshes, previous) if is_head else ()
        return _ReadMesh(matrix, visibility.is_holdout, meshes, notes, skin_notes)

    def _read_groom(
        self,
        reading: _Reading,
        key: Key,
        hair: bpy.types.Object,
        matrix: Floats,
        *,
        is_holdout: bool,
    ) -> _ReadGroom | None:
        """A groom; None with a warning if it cannot be drawn, or None until it is built."""
        if hair.type != "CURVES":
            reading.warnings.append(
                f"{hair.name}: hair that modifiers create on other types of objects is not drawn. "
                "Use hair curves."
            )
            return None
        depsgraph, changed, blocking = reading.depsgraph, reading.changed, reading.blocking
        previous, owner = self._grooms.get(key), engine_hair.owner_of(hair)
        uid = owner.session_uid
        try:
            state: tuple[Any, ...]
            state = (*engine_hair.state_key(hair, depsgraph), matrix.tobytes(), is_holdout)
            if (
                previous is not None
                and changed is not None
                and previous.state == state
                and not changed & engine_hair.uids_of(hair)
            ):
                return previous
            snapshot = engine_hair.read_groom(hair, depsgraph, blocking=blocking)
        except HairNotReadyError:
            self.pending.add(uid)
            # without a state, so that it is read again
            return None if previous is None else _ReadGroom((), previous.groom)
        except HairloomError as error:
            reading.warnings.append(str(error))
            return None
        if len(key) > 1:
            own_matrix = np.array(hair.evaluated_get(depsgraph).matrix_world)
            snapshot = engine_hair.transformed(snapshot, matrix @ np.linalg.pinv(own_matrix))
        if not blocking and engine_hair.is_pending(uid):
            self.pending.add(uid)
            state = ()
        return _ReadGroom(
            state, DrawnGroom(key, snapshot, owner.name, owner.pass_index, is_holdout)
        )


def _has_soft_shadow(snapshot: Snapshot) -> bool:
    return snapshot.volume.shadows != "none" and snapshot.skin.soft_shadow


def _skin_notes(
    name: str, meshes: tuple[MeshSnapshot, ...], previous: _ReadMesh | None
) -> tuple[str, ...]:
    """Problems of a head's UVs; checked again only if the UVs have changed."""
    if not meshes:
        return ()
    skin = meshes[0].skin
    if previous is not None and previous.meshes and skin is not None:
        before = previous.meshes[0].skin
        if before is not None and before.surface.corner_uv is skin.surface.corner_uv:
            return previous.skin_notes
    head = meshes[0].surface if skin is None else skin.surface
    return tuple(f"{name}: {note}" for note in uv_notes(head))


def _heads(depsgraph: bpy.types.Depsgraph) -> frozenset[int]:
    """Session numbers of the meshes on which hair of this evaluation grows."""
    hairs = (obj.original for obj in depsgraph.objects if obj.type == "CURVES")
    heads = (head_of(engine_hair.owner_of(hair)) for hair in hairs if hair.type == "CURVES")
    return frozenset(head.session_uid for head in heads if head is not None)


def _scene_object(instance: bpy.types.DepsgraphObjectInstance) -> bpy.types.Object:
    """The scene's object behind an instance: its instancer, or itself if it is no instance."""
    return (instance.parent if instance.is_instance else instance.object).original


def _instance_key(instance: bpy.types.DepsgraphObjectInstance) -> Key:
    uid = instance.object.original.session_uid
    if not instance.is_instance:
        return (uid,)
    return uid, instance.parent.original.session_uid, *instance.persistent_id


def _uids(obj: bpy.types.Object) -> set[int]:
    """Session numbers of an object, its data and its materials."""
    uids = {obj.original.session_uid}
    if obj.original.data is not None:
        uids.add(obj.original.data.session_uid)
    slots = (slot.material for slot in obj.material_slots)
    return uids | {material.original.session_uid for material in slots if material is not None}


def _visibility(
    instance: bpy.types.DepsgraphObjectInstance, layer: bpy.types.ViewLayer
) -> Visibility:
    """The artist's settings of visibility, without a preview's changes to the evaluated copy."""
    obj, scene_object = instance.object.original, _scene_object(instance)
    is_indirect = scene_object.indirect_only_get(view_layer=layer)
    # a copy for renders has the visibility of its groom
    owner = engine_hair.owner_of(obj) if obj.type == "CURVES" else obj
    flags = (each.is_holdout for each in (obj, owner, scene_object))
    is_holdout = any(flags) or scene_object.holdout_get(view_layer=layer)
    is_seen = hair_scene.is_visible_to_camera(owner) if obj.type == "CURVES" else obj.visible_camera
    return Visibility(is_seen and not is_indirect, is_holdout, obj.visible_shadow)


def _center(grooms: tuple[DrawnGroom, ...], meshes: list[MeshSnapshot]) -> Floats:
    """The centre of the lit objects, (3,) [m]: of the hair, else of the meshes."""
    if grooms:
        return np.mean([groom.snapshot.center for groom in grooms], axis=0)
    if meshes:
        bounds = [mesh.surface.bounds() for mesh in meshes]
        return (np.min([b[0] for b in bounds], axis=0) + np.max([b[1] for b in bounds], axis=0)) / 2
    return np.zeros(3)
