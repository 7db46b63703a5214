"""A scene as the render engine draws it, read from one depsgraph evaluation.

Reading changes nothing, and keeps no references to Blender's data.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
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
from .engine_hair import HairNotMadeYetError
from .engine_meshes import SOLID_TYPES, as_before, read_meshes

type Key = tuple[int, ...]
type IsShown = Callable[[bpy.types.Object], bool]


@dataclass(frozen=True)
class Visibility:
    """How one instance takes part in the picture."""

    is_seen: bool
    is_holdout: bool
    casts: bool


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
    """A groom that was read. state: see `engine_hair.state_of`, with matrix and holdout."""

    state: tuple[Any, ...]
    groom: DrawnGroom


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
        is_expected: Callable[[int], bool] = lambda _: False,
        blocking: bool = True,
    ) -> SceneSnapshot:
        """The scene in this evaluation.

        Args:
            changed: session numbers of data-blocks whose shape or material may have changed since
                the last reading; None: all.
            is_shown: whether an object is visible.
            is_previewed: whether a groom, by session number, is left out; its instances are not.
            is_expected: whether a groom, by session number, stays as it was, since its preview is
                about to be shown.
            blocking: False: hair is built in a thread, and stays as it was until then.
        """
        warnings: list[str] = []
        drawn: list[MeshSnapshot] = []
        casters: list[MeshSnapshot] = []
        grooms: dict[Key, _ReadGroom] = {}
        read: dict[Key, _ReadMesh] = {}
        self.previewed, self.pending = {}, set()
        self._heads = _heads(depsgraph)
        behind = hair_scene.drawn_by(depsgraph.scene)
        layer = depsgraph.view_layer if behind is None else hair_scene.drawn_layer(behind)
        for instance in depsgraph.object_instances:
            obj = instance.object
            if not instance.show_self or not is_shown(_holder(instance)):
                continue
            key, matrix = _key(instance), np.array(instance.matrix_world)
            visibility = _visibility(instance, layer)
            # a preview draws a groom once; its instances are read like any other hair
            is_own = obj.type == "CURVES" and not instance.is_instance
            if behind is not None and obj.type in SOLID_TYPES:
                visibility = replace(visibility, is_holdout=True)
            if obj.type in SOLID_TYPES:
                read[key] = self._read_mesh(key, obj, matrix, visibility, changed)
                if visibility.is_seen:
                    drawn += read[key].meshes
                if visibility.casts:
                    casters += read[key].meshes
            elif is_own and is_previewed(obj.original.session_uid):
                self.previewed[obj.original.session_uid] = visibility
            elif obj.type == "CURVES" and is_expected(obj.original.session_uid):
                grooms |= {key: self._grooms[key]} if key in self._grooms else {}
            elif obj.type == "CURVES" and visibility.is_seen:
                hair = obj.original
                groom = self._read_groom(
                    key, hair, matrix, depsgraph, changed, warnings, visibility.is_holdout, blocking
                )
                grooms |= {} if groom is None else {key: groom}
        self._meshes, self._grooms = read, grooms
        if not blocking:  # a render's thread must not read bpy.data.objects, as the window may edit
            engine_hair.forget_gone()
        found = tuple(each.groom for each in grooms.values())
        center = _center(found, drawn)
        of_meshes = [note for each in read.values() for note in each.notes]
        if any(_has_soft_shadow(each.groom.snapshot) for each in grooms.values()):
            of_meshes += [note for each in read.values() for note in each.skin_notes]
        environment = read_environment(depsgraph.scene_eval, blocking=blocking)
        of_light = light_warnings(depsgraph, environment.suns)
        of_world = world_notes(depsgraph.scene_eval)
        self.warnings = (*warnings, *dict.fromkeys(of_meshes), *of_light, *of_world)
        return SceneSnapshot(
            meshes=tuple(drawn),
            casters=tuple(casters),
            grooms=found,
            lights=read_lights(depsgraph, center, environment.suns),
            ambient=environment.ambient,
            harmonics=environment.harmonics,
            mesh_shadows=settings_of(depsgraph.scene.hairloom.mesh_shadows, MeshShadowSettings),
        )

    def _read_mesh(
        self,
        key: Key,
        obj: bpy.types.Object,
        matrix: Floats,
        visibility: Visibility,
        changed: set[int] | None,
    ) -> _ReadMesh:
        known = self._meshes.get(key)
        if (
            known is not None
            and changed is not None
            and known.is_holdout == visibility.is_holdout
            and np.array_equal(known.matrix, matrix)
            and not changed & _uids(obj)
        ):
            return known
        number = obj.pass_index
        is_head = obj.original.session_uid in self._heads
        fresh = tuple(
            replace(
                mesh,
                key=(*key, part),
                name=obj.name,
                number=number,
                is_holdout=visibility.is_holdout,
            )
            for part, mesh in enumerate(read_meshes(obj, matrix, is_head=is_head))
        )
        if known is not None and len(known.meshes) == len(fresh):
            pairs = zip(known.meshes, fresh, strict=True)
            fresh = tuple(as_before(old, new) for old, new in pairs)
        notes = material_notes(obj)
        of_uv = _skin_notes(obj.name, fresh, known) if is_head else ()
        return _ReadMesh(matrix, visibility.is_holdout, fresh, notes, of_uv)

    def _read_groom(
        self,
        key: Key,
        hair: bpy.types.Object,
        matrix: Floats,
        depsgraph: bpy.types.Depsgraph,
        changed: set[int] | None,
        warnings: list[str],
        is_holdout: bool,
        blocking: bool,
    ) -> _ReadGroom | None:
        """A groom; None with a warning if it cannot be drawn, or None until it is built."""
        if hair.type != "CURVES":
            warnings.append(
                f"{hair.name}: hair that modifiers create on other types of objects is not drawn. "
                "Use hair curves."
            )
            return None
        known, uid = self._grooms.get(key), engine_hair.owner_of(hair).session_uid
        try:
            state: tuple[Any, ...]
            state = (*engine_hair.state_of(hair, depsgraph), matrix.tobytes(), is_holdout)
            is_same = known is not None and changed is not None and known.state == state
            if known is not None and is_same and not (changed or set()) & engine_hair.uids_of(hair):
                return known
            snapshot = engine_hair.read_groom(hair, depsgraph, blocking=blocking)
        except HairNotMadeYetError:
            self.pending.add(uid)
            return None if known is None else _ReadGroom((), known.groom)  # no state: read again
        except HairloomError as error:
            warnings.append(str(error))
            return None
        if len(key) > 1:
            own = np.array(hair.evaluated_get(depsgraph).matrix_world)
            snapshot = engine_hair.placed(snapshot, matrix @ np.linalg.pinv(own))
        owner = engine_hair.owner_of(hair)
        if not blocking and engine_hair.is_pending(uid):
            self.pending.add(uid)
            state = ()
        return _ReadGroom(
            state, DrawnGroom(key, snapshot, owner.name, owner.pass_index, is_holdout)
        )


def _has_soft_shadow(snapshot: Snapshot) -> bool:
    return snapshot.volume.shadows != "none" and snapshot.skin.soft_shadow


def _skin_notes(
    name: str, meshes: tuple[MeshSnapshot, ...], known: _ReadMesh | None
) -> tuple[str, ...]:
    """Problems of a head's UVs; checked again only if the UVs have changed."""
    if not meshes:
        return ()
    skin = meshes[0].skin
    if known is not None and known.meshes and skin is not None:
        before = known.meshes[0].skin
        if before is not None and before.surface.corner_uv is skin.surface.corner_uv:
            return known.skin_notes
    head = meshes[0].surface if skin is None else skin.surface
    return tuple(f"{name}: {note}" for note in uv_notes(head))


def _heads(depsgraph: bpy.types.Depsgraph) -> frozenset[int]:
    """Session numbers of the meshes on which hair of this evaluation grows."""
    hairs = (obj.original for obj in depsgraph.objects if obj.type == "CURVES")
    heads = (head_of(engine_hair.owner_of(hair)) for hair in hairs if hair.type == "CURVES")
    return frozenset(head.session_uid for head in heads if head is not None)


def _holder(instance: bpy.types.DepsgraphObjectInstance) -> bpy.types.Object:
    """The scene's object behind an instance: its instancer, or itself if it is no instance."""
    return (instance.parent if instance.is_instance else instance.object).original


def _key(instance: bpy.types.DepsgraphObjectInstance) -> Key:
    uid = instance.object.original.session_uid
    if not instance.is_instance:
        return (uid,)
    return uid, instance.parent.original.session_uid, *instance.persistent_id


def _uids(obj: bpy.types.Object) -> set[int]:
    """Session numbers of an object, its data and its materials."""
    found = {obj.original.session_uid}
    if obj.original.data is not None:
        found.add(obj.original.data.session_uid)
    slots = (slot.material for slot in obj.material_slots)
    return found | {material.original.session_uid for material in slots if material is not None}


def _visibility(
    instance: bpy.types.DepsgraphObjectInstance, layer: bpy.types.ViewLayer
) -> Visibility:
    """The artist's settings of visibility, without a preview's changes to the evaluated copy."""
    obj, holder = instance.object.original, _holder(instance)
    is_indirect = holder.indirect_only_get(view_layer=layer)
    # a copy for renders has the visibility of its groom
    owner = engine_hair.owner_of(obj) if obj.type == "CURVES" else obj
    marked = (each.is_holdout for each in (obj, owner, holder))
    is_holdout = any(marked) or holder.holdout_get(view_layer=layer)
    is_seen = hair_scene.was_seen(owner) if obj.type == "CURVES" else obj.visible_camera
    return Visibility(is_seen and not is_indirect, is_holdout, obj.visible_shadow)


def _center(grooms: tuple[DrawnGroom, ...], meshes: list[MeshSnapshot]) -> Floats:
    """The centre of the lit objects, (3,) [m]: of the hair, else of the meshes."""
    if grooms:
        return np.mean([groom.snapshot.center for groom in grooms], axis=0)
    if meshes:
        bounds = [mesh.surface.bounds() for mesh in meshes]
        return (np.min([b[0] for b in bounds], axis=0) + np.max([b[1] for b in bounds], axis=0)) / 2
    return np.zeros(3)
