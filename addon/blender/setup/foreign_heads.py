"""Hair on heads other than the built-in one: MakeHuman's are matched by topology, others fitted."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from functools import cache

import bpy
import numpy as np
from mathutils import Vector

from ...arrays import Floats, Ints
from ...errors import HairloomError
from ...groom.fitted_hair import OuterSkinSearch, fit_hair, warped_weights
from ...groom.head_fit import (
    LANDMARKS,
    FitModel,
    Warp,
    fit_by_vertices,
    fit_head,
    guess_landmarks,
)
from ...strands import StrandSet, Surface
from ...strands.affine import transform_points
from ...strands.rooted_shapes import RootedShapes
from ..base.mesh_arrays import edge_vertices
from ..base.objects import link_into, matrix_of
from ..base.parts import Part, Parts
from ..scene.built_in_head import built_in_head
from ..scene.bust_data import SKIN, load_bust
from ..scene.surfaces import read_positions, read_surface

#: modifiers that move vertices without changing their number
_DEFORMING = {
    "ARMATURE", "CAST", "CURVE", "DISPLACE", "HOOK", "LAPLACIANDEFORM", "LATTICE", "MESH_DEFORM",
    "SHRINKWRAP", "SIMPLE_DEFORM", "SMOOTH", "CORRECTIVE_SMOOTH", "LAPLACIANSMOOTH",
    "SURFACE_DEFORM", "WARP", "WAVE",
}  # fmt: skip
#: fraction of the built-in head's edges that a mesh must have to be MakeHuman's
_MIN_SAME_EDGES = 0.9
#: a mesh with fewer vertices is not a head
_MIN_VERTICES = 150
#: height [m] on the built-in head that separates head vertices from neck and shoulders
_CHIN = -0.115
#: distance from the mesh [m on the built-in head] beyond which a root is missing; fraction of
#: missing roots beyond which there is an error
_MISSING_DISTANCE, _MAX_MISSING_FRACTION = 0.012, 0.25
#: mean distance of the skin from the mesh [m on the built-in head] beyond which there is a warning
_LOOSE_DISTANCE = 0.002
#: distance beyond which a root is loose, likewise; fraction of loose roots for a warning
_LOOSE_ROOT_DISTANCE, _MAX_LOOSE_FRACTION = 0.004, 0.05
#: vertices farther than this from the fitted skin [m on the built-in head] get no weight in groups
_GROUP_REACH = 0.02
#: custom property of landmarks: the location at which each was guessed
_GUESSED_PROPERTY = "hairloom_guessed"
#: display size [m] of landmarks that span 0.3 m; scales with their extent
_DISPLAY_SIZE = 0.006


@dataclass(frozen=True, eq=False)
class ForeignHead:
    """A mesh with the built-in head fitted to it, in world space.

    built_in: the built-in head.
    skin: the built-in head's skin, fitted to the mesh, with its own UVs.
    away: mean distance of that skin from the mesh [m on the built-in head].
    landmarks: guessed or placed; none if the mesh is matched by its topology.
    """

    name: str
    surface: Surface
    built_in: Surface
    skin: Surface
    warp: Warp
    landmarks: dict[str, Floats]
    away: float

    @property
    def scale(self) -> float:
        """Its size relative to the built-in head."""
        return self.warp.scale

    def hair(self, guides: RootedShapes) -> tuple[StrandSet, list[str]]:
        """Guides of the built-in head on this one, except those whose roots are off the mesh; and
        warnings.

        Raises:
            HairloomError: too many roots are off the mesh.
        """
        outside = OuterSkinSearch(self.surface, self.skin, self.scale)
        made, roots = guides.on(self.built_in), guides.on(self.skin).roots
        fitted = fit_hair(made, roots, self.warp, outside, self.scale)
        missing, loose = (
            fitted.away > limit * self.scale for limit in (_MISSING_DISTANCE, _LOOSE_ROOT_DISTANCE)
        )
        if missing.mean() > _MAX_MISSING_FRACTION:
            raise HairloomError(
                f"it has no faces where {100.0 * missing.mean():.0f} % of this hair grows",
                place=self.name,
                remedy="Close its holes, or press Place Landmarks, drag them to their places and "
                "add the hairstyle again",
            )
        warnings = []
        if self.away > _LOOSE_DISTANCE:
            warnings.append(
                f"{self.name}: it is unlike the built-in head. Drag its landmarks to their places, "
                "and press Fit Again"
            )
        elif loose.mean() > _MAX_LOOSE_FRACTION:
            warnings.append(
                f"{self.name}: {100.0 * loose.mean():.0f} % of the roots had to move by more than "
                f"{1000.0 * _LOOSE_ROOT_DISTANCE * self.scale:.0f} mm to be on it. Close its "
                "holes, or drag its landmarks to their places and press Fit Again"
            )
        return fitted.strands.take(np.flatnonzero(~missing)), warnings

    def weights(self, group: str, positions: Floats) -> Floats:
        """The weights of one of the built-in head's groups at positions (n, 3) on this head."""
        own = load_bust().weights[group]
        return warped_weights(own, self.skin, positions, _GROUP_REACH * self.scale)


@dataclass(frozen=True, eq=False)
class HeadToFit:
    """What is read of a mesh on which hair of the built-in head is to grow.

    makehuman_positions: of its vertices, see `original_positions`, if it is MakeHuman's; else None.
    landmarks: those that it has. guessed: the names of those that have not been moved since.
    upright: (4, 4), from the mesh's present place to that when they were guessed.
    """

    name: str
    surface: Surface
    built_in: Surface
    makehuman_positions: Floats | None
    landmarks: Mapping[str, Floats]
    guessed: frozenset[str] = frozenset()
    upright: Floats = field(default_factory=lambda: np.eye(4))

    def points(self) -> dict[str, Floats] | None:
        """Landmarks to fit the built-in head to; None if the mesh has none.

        Those that the artist has dragged are used as they are, the others guessed again; on a mesh
        unlike a head, all are used as they are.
        """
        if not self.landmarks:
            return None
        dragged = {name: at for name, at in self.landmarks.items() if name not in self.guessed}
        if len(dragged) == len(LANDMARKS):
            return dragged
        upright_surface = replace(
            self.surface, positions=transform_points(self.surface.positions, self.upright)
        )
        guess, is_sure = guess_landmarks(fit_model(), upright_surface)
        back = transform_points(np.array(list(guess.values())), np.linalg.inv(self.upright))
        places = dict(zip(guess, back.astype(np.float64), strict=True))
        return {**places, **(dragged if is_sure else self.landmarks)}


def read_foreign_head(head: bpy.types.Object, depsgraph: bpy.types.Depsgraph) -> HeadToFit:
    """Read a mesh to fit the built-in head to; the scene is not changed.

    Raises:
        HairloomError: it has no faces, or too few vertices to be a head.
    """
    surface = read_surface(head, depsgraph, need_uv=False, place=head.name)
    built_in = built_in_head().surface
    if has_makehuman_topology(head.data):
        return HeadToFit(head.name, surface, built_in, original_positions(head, depsgraph), {})
    if not may_be_head(head):
        raise HairloomError(
            f"a mesh of {len(head.data.vertices)} vertices is not a head",
            place=head.name,
            remedy="Select a head, or nothing to add one; fur and Add Hair accept any mesh",
        )
    there = landmarks_of(head)
    guessed = [name for name, empty in there.items() if _is_as_guessed(empty)]
    upright = np.eye(4)
    if guessed:
        was = np.linalg.inv(np.array(there[guessed[0]].matrix_parent_inverse, np.float64))
        upright = was @ np.linalg.pinv(matrix_of(head, depsgraph))
    landmarks = placed_landmarks(head, depsgraph)
    return HeadToFit(head.name, surface, built_in, None, landmarks, frozenset(guessed), upright)


def fit_built_in_head(read: HeadToFit) -> ForeignHead:
    """The built-in head fitted to a mesh, from arrays alone.

    Raises:
        HairloomError: the mesh is too unlike a head, or its landmarks are wrong.
    """
    if read.makehuman_positions is not None:
        warp, positions = _by_topology(read.makehuman_positions)
        skin = _skin(positions)
        return ForeignHead(read.name, read.surface, read.built_in, skin, warp, {}, 0.0)
    fit = fit_head(fit_model(), read.surface, read.points(), read.name)
    skin = _skin(fit.warp(load_bust().positions))
    return ForeignHead(
        read.name, read.surface, read.built_in, skin, fit.warp, fit.landmarks, fit.away
    )


def may_be_head(mesh: bpy.types.Object) -> bool:
    """Whether it is a mesh with enough vertices for a head."""
    return mesh.type == "MESH" and len(mesh.data.vertices) >= _MIN_VERTICES


@cache
def fit_model() -> FitModel:
    """The built-in head as a model to fit to others."""
    bust = load_bust()
    is_skin = bust.makehuman >= 0
    is_open = is_skin & (bust.weights["cavity"] > 0.4)
    surface = _skin(bust.positions)
    triangles = surface.triangles[is_skin[surface.triangles].any(axis=1)]
    return FitModel(Surface(bust.positions, triangles), is_open)


def _skin(positions: Floats) -> Surface:
    """The built-in head without its eyes, with other vertex positions."""
    bust = load_bust()
    corners, material = bust.triangulated
    corners = corners[material == SKIN]
    return Surface(positions, bust.corner_vertex[corners], bust.uv[bust.corner_uv[corners]])


def has_makehuman_topology(mesh: bpy.types.Mesh) -> bool:
    """Whether a mesh, with or without the helpers for clothes, has MakeHuman's vertices."""
    own = _makehuman_edges()
    if len(mesh.vertices) <= own.max():
        return False
    return bool(np.isin(_keys(own), _keys(edge_vertices(mesh))).mean() > _MIN_SAME_EDGES)


@cache
def _makehuman_edges() -> Ints:
    """The built-in head's edges between vertices of MakeHuman's mesh, as indices there, (n, 2)."""
    bust = load_bust()
    last = np.cumsum(bust.sizes) - 1
    following = np.arange(len(bust.corner_vertex)) + 1
    following[last] = last - bust.sizes + 1
    edges = np.stack([bust.corner_vertex, bust.corner_vertex[following]], axis=1)
    edges = bust.makehuman[edges]
    return edges[(edges >= 0).all(axis=1)]


def _keys(edges: Ints) -> Ints:
    low, high = np.sort(edges.astype(np.int64), axis=1).T
    return low << 32 | high


def _by_topology(positions: Floats) -> tuple[Warp, Floats]:
    """The warp from the built-in head to a mesh of MakeHuman's, and the vertices moved by it."""
    bust = load_bust()
    known = np.flatnonzero(bust.makehuman >= 0)
    source = bust.positions[known].astype(np.float64)
    target = positions[bust.makehuman[known]].astype(np.float64)
    warp = fit_by_vertices(source, target, source[:, 2] > _CHIN)
    places = warp(bust.positions)
    places[known] = target
    return warp, places


def original_positions(head: bpy.types.Object, depsgraph: bpy.types.Depsgraph) -> Floats:
    """The vertices of a mesh, posed and shaped, but before modifiers that change their number:
    (vertex_count, 3) world space."""
    positions = read_positions(head, depsgraph, place=head.name)
    if len(positions) == len(head.data.vertices):
        return positions
    with _only_deformed(head) as same:
        return read_positions(same, bpy.context.evaluated_depsgraph_get(), place=head.name)


@contextmanager
def _only_deformed(head: bpy.types.Object) -> Iterator[bpy.types.Object]:
    """A copy of the object without modifiers that change the number of vertices."""
    same = head.copy()
    try:
        for modifier in same.modifiers:
            modifier.show_viewport &= modifier.type in _DEFORMING
        bpy.context.scene.collection.objects.link(same)
        yield same
    finally:
        bpy.data.objects.remove(same)


def placed_landmarks(head: bpy.types.Object, depsgraph: bpy.types.Depsgraph) -> dict[str, Floats]:
    """The positions of a head's landmarks by name, (3,) each, world space [m]."""
    return {
        name: np.array(obj.evaluated_get(depsgraph).matrix_world.translation, np.float64)
        for name, obj in landmarks_of(head).items()
    }


def landmarks_of(head: bpy.types.Object) -> dict[str, bpy.types.Object]:
    """The landmarks of a head, by name."""
    return {
        child.hairloom.landmark: child
        for child in head.children
        if child.hairloom.landmark in LANDMARKS and child.users_scene
    }


def add_landmarks(
    head: bpy.types.Object, depsgraph: bpy.types.Depsgraph, collection: bpy.types.Collection
) -> Parts[tuple[list[bpy.types.Object], bool]]:
    """Add Empties at guessed places for the landmarks that a head lacks; also returns whether the
    mesh is enough like a head to trust the guess.

    Raises:
        HairloomError: it has no faces.
    """
    surface = read_surface(head, depsgraph, need_uv=False, place=head.name)
    guess, is_sure = yield Part(
        "Looking for landmarks", lambda: guess_landmarks(fit_model(), surface)
    )
    return put_landmarks(head, guess, collection), is_sure


def put_landmarks(
    head: bpy.types.Object, places: Mapping[str, Floats], collection: bpy.types.Collection
) -> list[bpy.types.Object]:
    """Add Empties, at these places (3,) by name, world space [m], for the landmarks that a head
    lacks."""
    there, made = landmarks_of(head), []
    extent = float(np.linalg.norm(np.ptp(np.array(list(places.values())), axis=0)))
    for name, place in places.items():
        if name in there:
            continue
        empty = bpy.data.objects.new(f"{head.name} {LANDMARKS[name][0]}", None)
        empty.hairloom.landmark = name
        empty.empty_display_type, empty.show_in_front = "SPHERE", True
        empty.parent = head
        empty.matrix_parent_inverse = head.matrix_world.inverted_safe()
        _place_as_guessed(empty, Vector(place))
        empty.empty_display_size = _DISPLAY_SIZE * extent / 0.3
        link_into(empty, [collection], bpy.context.scene)
        made.append(empty)
    return made


def move_landmarks(head: bpy.types.Object, places: Mapping[str, Floats]) -> None:
    """Move landmarks that have not been dragged to these places (3,) by name, world space [m]."""
    for name, empty in landmarks_of(head).items():
        if name in places and _is_as_guessed(empty):
            to_world = head.matrix_world @ empty.matrix_parent_inverse
            _place_as_guessed(empty, to_world.inverted_safe() @ Vector(places[name]))


def _place_as_guessed(empty: bpy.types.Object, location: Vector) -> None:
    empty.location = location
    empty[_GUESSED_PROPERTY] = empty.location[:]


def _is_as_guessed(empty: bpy.types.Object) -> bool:
    """Whether a landmark is still where it was guessed, relative to its head."""
    guessed = empty.get(_GUESSED_PROPERTY)
    is_of_object = empty.parent_type == "OBJECT"
    return guessed is not None and is_of_object and tuple(guessed) == empty.location[:]
