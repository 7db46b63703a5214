"""Heads that are not the built-in one: MakeHuman's by their topology, others by fitting."""

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
from ...groom.fitted_hair import OuterSearch, fitted_hair, warped_weights
from ...groom.head_fit import (
    LANDMARKS,
    FitModel,
    Warp,
    fit_by_vertices,
    fit_head,
    guess_landmarks,
)
from ...strands import StrandSet, Surface
from ...strands.affine import moved
from ...strands.rooted_shapes import RootedShapes
from ..base.mesh_arrays import edge_vertices
from ..base.objects import link_into, matrix_of
from ..base.parts import Part, Parts
from ..scene.built_in_head import built_in_head
from ..scene.bust_data import SKIN, load_bust
from ..scene.surfaces import read_positions, read_surface

#: modifiers that move vertices and leave their number as it is
_DEFORMING = {
    "ARMATURE", "CAST", "CURVE", "DISPLACE", "HOOK", "LAPLACIANDEFORM", "LATTICE", "MESH_DEFORM",
    "SHRINKWRAP", "SIMPLE_DEFORM", "SMOOTH", "CORRECTIVE_SMOOTH", "LAPLACIANSMOOTH",
    "SURFACE_DEFORM", "WARP", "WAVE",
}  # fmt: skip
#: of the built-in head's edges, how many a mesh of MakeHuman's has at least
_SAME_EDGES = 0.9
#: a mesh with fewer vertices is no head
_MIN_VERTICES = 150
#: height [m] in the built-in head above which vertices are the head's, not neck or shoulders
_CHIN = -0.115
#: how far [m on the built-in head] a root may be from the mesh, and the part that may be farther
_MISSING, _MAX_MISSING = 0.012, 0.25
#: how far skin may be from a fitted mesh on average before a warning asks to look [m]
_LOOSE = 0.002
#: the same of single roots, and how many of them may be farther
_LOOSE_ROOT, _MAX_LOOSE = 0.004, 0.05
#: of vertex groups: what is farther from the fitted skin has no weight [m]
_GROUP_REACH = 0.02
#: custom property of landmarks: where each was guessed, as its location
_GUESSED = "hairloom_guessed"
#: how large landmarks are shown, as a part of a head of 1 m
_SHOWN = 0.006


@dataclass(frozen=True, eq=False)
class ForeignHead:
    """A mesh with the built-in head fitted to it, in world space.

    built_in: the built-in head.
    skin: its skin as it lies on the mesh, with its own UVs.
    away: how far from the mesh that is, on average [m on the built-in head].
    landmarks: guessed or placed; none where the topology says where everything is.
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
        """How much larger than the built-in head it is."""
        return self.warp.scale

    def hair(self, guides: RootedShapes) -> tuple[StrandSet, list[str]]:
        """Guides of the built-in head on this one, but for those below which it has no skin; and
        warnings.

        Raises:
            HairloomError: too many of them.
        """
        outside = OuterSearch(self.surface, self.skin, self.scale)
        made, roots = guides.on(self.built_in), guides.on(self.skin).roots
        fitted = fitted_hair(made, roots, self.warp, outside, self.scale)
        missing, loose = (fitted.away > limit * self.scale for limit in (_MISSING, _LOOSE_ROOT))
        if missing.mean() > _MAX_MISSING:
            raise HairloomError(
                f"it has no faces where {100.0 * missing.mean():.0f} % of this hair grows",
                place=self.name,
                remedy="Close its holes, or press Place Landmarks, drag them to their places and "
                "add the hairstyle again",
            )
        warnings = []
        if self.away > _LOOSE:
            warnings.append(
                f"{self.name}: it is unlike the built-in head. Drag its landmarks to their places, "
                "and press Fit Again"
            )
        elif loose.mean() > _MAX_LOOSE:
            warnings.append(
                f"{self.name}: {100.0 * loose.mean():.0f} % of the roots had to move by more than "
                f"{1000.0 * _LOOSE_ROOT * self.scale:.0f} mm to be on it. Close its holes, or drag "
                "its landmarks to their places and press Fit Again"
            )
        return fitted.strands.take(np.flatnonzero(~missing)), warnings

    def weights(self, group: str, positions: Floats) -> Floats:
        """What one of the built-in head's groups is at positions (n, 3) on this head."""
        own = load_bust().weights[group]
        return warped_weights(own, self.skin, positions, _GROUP_REACH * self.scale)


@dataclass(frozen=True, eq=False)
class ReadHead:
    """What is read of a mesh that hair of the built-in head is to grow on.

    own: where its vertices are, see `own_positions`, if it is MakeHuman's; else None.
    landmarks: those that it has. guessed: which of them still stand where they were guessed.
    upright: (4, 4), from where the mesh is now to where it was when they were guessed.
    """

    name: str
    surface: Surface
    built_in: Surface
    own: Floats | None
    landmarks: Mapping[str, Floats]
    guessed: frozenset[str] = frozenset()
    upright: Floats = field(default_factory=lambda: np.eye(4))

    def points(self) -> dict[str, Floats] | None:
        """Where to fit the built-in head to: landmarks that an artist has dragged or that a mesh
        unlike a head has, and a guess of the others; None if it has none."""
        if not self.landmarks:
            return None
        dragged = {name: at for name, at in self.landmarks.items() if name not in self.guessed}
        if len(dragged) == len(LANDMARKS):
            return dragged
        stood = replace(self.surface, positions=moved(self.surface.positions, self.upright))
        guess, is_sure = guess_landmarks(fit_model(), stood)
        back = moved(np.array(list(guess.values())), np.linalg.inv(self.upright))
        places = dict(zip(guess, back.astype(np.float64), strict=True))
        return {**places, **(dragged if is_sure else self.landmarks)}


def read_foreign_head(head: bpy.types.Object, depsgraph: bpy.types.Depsgraph) -> ReadHead:
    """The scene is not changed.

    Raises:
        HairloomError: it has no faces, or too few vertices to be a head.
    """
    surface = read_surface(head, depsgraph, need_uv=False, place=head.name)
    built_in = built_in_head().surface
    if has_makehuman_topology(head.data):
        return ReadHead(head.name, surface, built_in, own_positions(head, depsgraph), {})
    if not may_be_head(head):
        raise HairloomError(
            f"a mesh of {len(head.data.vertices)} vertices is no head",
            place=head.name,
            remedy="Select a head, or nothing to add one; fur and Add Hair take any mesh",
        )
    there = landmarks_of(head)
    guessed = [name for name, empty in there.items() if _is_as_guessed(empty)]
    upright = np.eye(4)
    if guessed:
        was = np.linalg.inv(np.array(there[guessed[0]].matrix_parent_inverse, np.float64))
        upright = was @ np.linalg.pinv(matrix_of(head, depsgraph))
    landmarks = placed_landmarks(head, depsgraph)
    return ReadHead(head.name, surface, built_in, None, landmarks, frozenset(guessed), upright)


def fitted_to(read: ReadHead) -> ForeignHead:
    """The built-in head fitted to a mesh, from arrays alone.

    Raises:
        HairloomError: it is too unlike a head; landmarks that are mistaken.
    """
    if read.own is not None:
        warp, positions = _by_topology(read.own)
        skin = _skin(positions)
        return ForeignHead(read.name, read.surface, read.built_in, skin, warp, {}, 0.0)
    fit = fit_head(fit_model(), read.surface, read.points(), read.name)
    skin = _skin(fit.warp(load_bust().positions))
    return ForeignHead(
        read.name, read.surface, read.built_in, skin, fit.warp, fit.landmarks, fit.away
    )


def may_be_head(mesh: bpy.types.Object) -> bool:
    """Whether it has as many vertices as a head needs."""
    return mesh.type == "MESH" and len(mesh.data.vertices) >= _MIN_VERTICES


@cache
def fit_model() -> FitModel:
    """The built-in head as others are fitted to it."""
    bust = load_bust()
    is_skin = bust.makehuman >= 0
    is_open = is_skin & (bust.weights["cavity"] > 0.4)
    surface = _skin(bust.positions)
    triangles = surface.triangles[is_skin[surface.triangles].any(axis=1)]
    return FitModel(Surface(bust.positions, triangles), is_open)


def _skin(positions: Floats) -> Surface:
    """The built-in head without its eyes, with its vertices elsewhere."""
    bust = load_bust()
    corners, material = bust.fans
    corners = corners[material == SKIN]
    return Surface(positions, bust.corner_vertex[corners], bust.uv[bust.corner_uv[corners]])


def has_makehuman_topology(mesh: bpy.types.Mesh) -> bool:
    """Whether a mesh, with or without the helpers for clothes, has MakeHuman's vertices."""
    own = _makehuman_edges()
    if len(mesh.vertices) <= own.max():
        return False
    return bool(np.isin(_keys(own), _keys(edge_vertices(mesh))).mean() > _SAME_EDGES)


@cache
def _makehuman_edges() -> Ints:
    """The edges of the built-in head between vertices of MakeHuman's, by its numbers, (n, 2)."""
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
    """From the built-in head to a mesh of MakeHuman's, and where its own vertices are there."""
    bust = load_bust()
    known = np.flatnonzero(bust.makehuman >= 0)
    source = bust.positions[known].astype(np.float64)
    target = positions[bust.makehuman[known]].astype(np.float64)
    warp = fit_by_vertices(source, target, source[:, 2] > _CHIN)
    places = warp(bust.positions)
    places[known] = target
    return warp, places


def own_positions(head: bpy.types.Object, depsgraph: bpy.types.Depsgraph) -> Floats:
    """Where the vertices of a mesh are before modifiers add some or take some away, but as posed
    and shaped: (vertex_count, 3) world space."""
    positions = read_positions(head, depsgraph, place=head.name)
    if len(positions) == len(head.data.vertices):
        return positions
    with _only_deformed(head) as same:
        return read_positions(same, bpy.context.evaluated_depsgraph_get(), place=head.name)


@contextmanager
def _only_deformed(head: bpy.types.Object) -> Iterator[bpy.types.Object]:
    """The same object without modifiers that change how many vertices there are."""
    same = head.copy()
    try:
        for modifier in same.modifiers:
            modifier.show_viewport &= modifier.type in _DEFORMING
        bpy.context.scene.collection.objects.link(same)
        yield same
    finally:
        bpy.data.objects.remove(same)


def placed_landmarks(head: bpy.types.Object, depsgraph: bpy.types.Depsgraph) -> dict[str, Floats]:
    """Where the landmarks of a head are, by name, in world space; none if it has none."""
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
    """Empties where landmarks may be, for those that a head lacks; and whether the mesh is like a
    head, so that the guess may be good.

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
    """Empties at places in world space, for those that a head lacks."""
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
        _put_guess(empty, Vector(place))
        empty.empty_display_size = _SHOWN * extent / 0.3
        link_into(empty, [collection], bpy.context.scene)
        made.append(empty)
    return made


def move_landmarks(head: bpy.types.Object, places: Mapping[str, Floats]) -> None:
    """Move the landmarks that nobody has dragged to where they are now, in world space."""
    for name, empty in landmarks_of(head).items():
        if name in places and _is_as_guessed(empty):
            to_world = head.matrix_world @ empty.matrix_parent_inverse
            _put_guess(empty, to_world.inverted_safe() @ Vector(places[name]))


def _put_guess(empty: bpy.types.Object, location: Vector) -> None:
    empty.location = location
    empty[_GUESSED] = empty.location[:]


def _is_as_guessed(empty: bpy.types.Object) -> bool:
    """Whether a landmark still stands where it was guessed, by its place on its head."""
    guessed = empty.get(_GUESSED)
    is_of_object = empty.parent_type == "OBJECT"
    return guessed is not None and is_of_object and tuple(guessed) == empty.location[:]
