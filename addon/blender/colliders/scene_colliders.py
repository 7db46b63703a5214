"""The colliders of one groom, or of one cloth fin.

These are the surface that the hair grows on, or the collider that the artist has chosen instead,
and all objects of a collection. `hairloom.collider_shape` sets how an object collides: as a mesh
(signed distance), as a ball or capsule around its bounding box, or not at all. Objects that cannot
be used are left out with a warning.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass, field

import bpy

from ...arrays import Ints
from ...dynamics.colliders import PosedCollider
from ...dynamics.settings import DynamicsSettings
from ...errors import HairloomError
from ...strands import Surface
from ...strands.mesh_faults import edges_of
from ..base.objects import Body
from .carriers import is_disabled
from .collider_balls import Ball, BallsPart
from .collider_parts import FieldPart, Part, ShapePart
from .collider_reader import ColliderReader, disabled_error, shape_of
from .fields import NotReadyError


@dataclass
class SceneColliders:
    """The colliders of one groom or fin, with warnings."""

    parts: list[Part]
    head_uid: int | None
    _unusable_warnings: dict[str, str] = field(default_factory=dict)
    _failure_warnings: dict[str, str] = field(default_factory=dict)
    _mesh_warnings: list[str] = field(default_factory=list)

    @classmethod
    def of(
        cls,
        owner: bpy.types.Object,
        head: Body | None,
        head_at_rest: Surface | None,
        settings: DynamicsSettings,
        depsgraph: bpy.types.Depsgraph,
        previous: SceneColliders | None,
        roots: Ints | None = None,
        *,
        blocking: bool = True,
    ) -> SceneColliders:
        """Everything that collides with `owner`, at rest in its present pose.

        Args:
            owner: the hair curves, or a fin.
            head, head_at_rest: the surface, and its mesh in world space at rest; or None.
            previous: the last colliders, whose distance fields are reused if nothing has changed.
            roots: vertices of the head that hair grows on; the head is tracked by them.
            blocking: False: do not wait for distance fields to be built.

        Raises:
            HairloomError: as `move`.
            NotReadyError: a field is being built, and the call is not blocking.
        """
        colliders = cls([], None if head is None else head.handle.uid)
        fields = {} if previous is None else previous._fields()
        balls: dict[object, list[Ball]] = {}
        is_complete = True
        for obj in collider_objects(owner, None if head is None else head.handle.find()):
            is_head = head is not None and head.handle.uid == obj.session_uid
            reader = ColliderReader(obj, depsgraph, settings, fields.get(obj.session_uid), blocking)
            try:
                if is_head and head is not None and head_at_rest is not None:
                    part = reader.part_of_head(head, head_at_rest, roots)
                else:
                    part = reader.part()
            except HairloomError as error:
                colliders._unusable_warnings[obj.name] = str(error.at(obj.name))
                continue
            except NotReadyError:  # go on, so that the other fields are begun too
                is_complete = False
                continue
            if isinstance(part, Ball):
                balls.setdefault(_parent_key(obj), []).append(part)
            elif part is not None:
                colliders.parts.append(part)
                if isinstance(part, FieldPart) and not is_head:
                    colliders._mesh_warnings += _mesh_notes(part.surface, obj.name)
        if not is_complete:
            raise NotReadyError
        colliders._mesh_warnings += _unused_collection(owner)
        colliders.parts += [BallsPart.new(group, depsgraph) for group in balls.values()]
        colliders.rest(depsgraph)
        return colliders

    @property
    def warnings(self) -> tuple[str, ...]:
        """Objects that are left out and why, and defects of those that are used."""
        of_parts = [text for part in self.parts for text in part.warnings.values()]
        unused = (*self._unusable_warnings.values(), *self._failure_warnings.values())
        return tuple(dict.fromkeys([*unused, *self._mesh_warnings, *of_parts]))

    @property
    def meshes(self) -> tuple[Surface, ...]:
        """The meshes of all mesh colliders, at rest."""
        return tuple(part.surface for part in self.parts if isinstance(part, FieldPart))

    def move(self, depsgraph: bpy.types.Depsgraph, duration: float) -> tuple[PosedCollider, ...]:
        """Move to the present pose within `duration` [s]; returns the trajectories.

        Raises:
            HairloomError: the head is gone, or it has another mesh.
        """
        posed = []
        for part in self._enabled_parts(depsgraph):
            try:
                collider, matrix = part.evaluate(depsgraph)
                posed.append(part.track.advance(collider, matrix, duration, part.deformation()))
            except HairloomError as error:
                self._drop(part, error)
        return tuple(posed)

    def rest(self, depsgraph: bpy.types.Depsgraph) -> tuple[PosedCollider, ...]:
        """Jump to the present pose, at rest; returns the colliders there.

        Raises:
            HairloomError: as `move`.
        """
        posed = []
        for part in self._enabled_parts(depsgraph):
            try:
                collider, matrix = part.evaluate(depsgraph)
                posed.append(PosedCollider(collider, matrix, matrix))
                part.track.reset(matrix)
                part.deformation()
            except HairloomError as error:
                self._drop(part, error)
        return tuple(posed)

    def static_colliders(self, depsgraph: bpy.types.Depsgraph) -> tuple[PosedCollider, ...]:
        """The colliders in the present pose, at rest. Those that cannot be used are left out; Play
        reports them."""
        posed = []
        for part in self.parts:
            with suppress(HairloomError):
                collider, matrix = part.evaluate(depsgraph)
                posed.append(PosedCollider(collider, matrix, matrix))
        return tuple(posed)

    def _enabled_parts(self, depsgraph: bpy.types.Depsgraph) -> Iterator[Part]:
        """The parts that are enabled in the scene; others start from rest when enabled again."""
        self._failure_warnings.clear()
        for part in self.parts:
            if self._is_disabled(part, depsgraph):
                part.track.before = None
                name = part.name
                self._failure_warnings[name] = str(disabled_error(name))
            else:
                yield part

    def _is_disabled(self, part: Part, depsgraph: bpy.types.Depsgraph) -> bool:
        """Sets of balls check this themselves; a hidden head still collides with its hair."""
        if isinstance(part, BallsPart) or self._is_head(part):
            return False
        assert isinstance(part, FieldPart | ShapePart)
        obj = part.carrier.body.handle.find()
        return obj is not None and is_disabled(obj, depsgraph)

    def _is_head(self, part: Part) -> bool:
        return part.uid is not None and part.uid == self.head_uid

    def _drop(self, part: Part, error: HairloomError) -> None:
        if self._is_head(part):
            raise error.at(part.name) from error
        part.track.before = None
        self._failure_warnings[part.name] = str(error.at(part.name))

    def _fields(self) -> dict[int, FieldPart]:
        parts = [part for part in self.parts if isinstance(part, FieldPart)]
        return {part.carrier.body.handle.uid: part for part in parts}


def collider_objects(
    owner: bpy.types.Object, head: bpy.types.Object | None
) -> tuple[bpy.types.Object, ...]:
    """The objects that may collide with `owner`, each once: the chosen collider, or else the head,
    then those of the collection."""
    chosen, collection = owner.hairloom.collider, owner.hairloom.collider_collection
    first = chosen if chosen is not None else head
    objects = [] if first is None else [first]
    if collection is not None:
        objects += collection.all_objects
    return tuple(obj for obj in dict.fromkeys(objects) if obj != owner)


def _unused_collection(owner: bpy.types.Object) -> Iterator[str]:
    """A warning if nothing in the collider collection collides."""
    collection = owner.hairloom.collider_collection
    if collection is None:
        return
    if all(shape_of(obj) == "none" or obj == owner for obj in collection.all_objects):
        yield (
            f"{owner.name}: nothing in the collection {collection.name} collides. Put meshes, or "
            "Empties shown as spheres, into it, or clear Colliders."
        )


def _mesh_notes(surface: Surface, name: str) -> Iterator[str]:
    """Defects that keep a mesh from being a closed surface, and their effect on hair."""
    edges = edges_of(surface)
    if edges.open_count:
        yield (
            f"{name}: {_edge_count(edges.open_count)} with only one face. Hair collides with it as "
            "if its holes were closed (Mesh > Clean Up > Fill Holes closes them)."
        )
    if edges.crowded_count:
        yield (
            f"{name}: {_edge_count(edges.crowded_count)} with more than two faces, so hair may get "
            "into it there. Delete its inner faces (Select > Select All by Trait > Interior Faces)."
        )
    if edges.opposed_count:
        yield (
            f"{name}: at {_edge_count(edges.opposed_count)} the faces point to opposite sides, so "
            "hair may get into it there. Turn them outwards (Mesh > Normals > Recalculate Outside)."
        )


def _edge_count(count: int) -> str:
    return "1 edge" if count == 1 else f"{count:,} edges"


def _parent_key(obj: bpy.types.Object) -> object:
    """The parent mesh or bone of a ball; balls with the same one move together."""
    if obj.parent is None:
        return None
    return obj.parent.session_uid, obj.parent_bone if obj.parent_type == "BONE" else ""
