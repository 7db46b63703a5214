"""Hair ties, and the surface that holds tips: what holds a groom's hair beside its roots.

The ties are the objects of the groom's collection. A circle Empty is a ring of the drawn size, any
other Empty is a ball. A curve or a mesh is the ellipse that fits its points best, or a ball if it
is thick. Ties move by their matrix, and with their mesh if an armature deforms it. Objects that are
gone or disabled hold nothing.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import bpy
import numpy as np

from ...arrays import Floats, are_same
from ...dynamics.fitting.similarity import fit_similarity
from ...errors import HairloomError
from ...groom.holds import Holds, anchors_of
from ...groom.ties import Holders, Tie, TipSurface, find_holds
from ...strands.affine import transform_points
from ..base.mesh_arrays import vertex_positions
from ..base.objects import (
    Body,
    Handle,
    ObjectGoneError,
    as_mesh,
    head_of,
    link_into,
    matrix_of,
)
from ..base.vertex_weights import read_weights
from ..scene.hair_collections import add_to_collection, objects_in, remove_from_collection
from ..scene.source import posed_curves
from ..scene.surfaces import read_positions, read_surface
from .carriers import is_deforming, is_disabled
from .collider_parts import is_invertible

#: Types of objects whose points form a ring.
_RING_TYPES = frozenset(("MESH", "CURVE", "SURFACE", "FONT"))
TIE_TYPES = frozenset(("EMPTY",)) | _RING_TYPES
#: From this thickness on, relative to its width, a mesh is a ball instead of a ring.
_BALL_THICKNESS = 0.5
#: Below this width, relative to its length, a ring is a line, which holds nothing.
_LINE_WIDTH = 0.01
#: Radius of a new ring, relative to the hair's length.
_NEW_RING_RADIUS = 0.1
#: Ties are unchanged if their shape differs by less than this, relative to their size.
_SHAPE_TOLERANCE = 1.0e-4


@dataclass
class _TrackedTie:
    """A tie, and the points that it is tracked by.

    points: (n, 3) [m] world at rest, those of a mesh; none for other objects.
    """

    body: Body
    tie: Tie
    points: Floats = field(default_factory=lambda: np.zeros((0, 3)))

    def motion_from_rest(self, depsgraph: bpy.types.Depsgraph) -> Floats:
        """(4, 4), world space, from its rest to where it is now.

        Raises:
            HairloomError: it is gone, disabled or scaled to zero.
        """
        obj = self.body.resolve()
        if is_disabled(obj, depsgraph):
            raise _disabled_error(obj.name)
        if not is_invertible(matrix_of(obj, depsgraph)):
            raise HairloomError(
                "its scale is zero, so it holds no hair", place=obj.name, remedy="Correct its scale"
            )
        matrix: Floats = self.body.motion_from_rest(depsgraph)
        if not len(self.points) or not is_deforming(obj):
            return matrix
        positions = read_positions(obj, depsgraph, place=obj.name)
        if len(positions) != len(self.points):
            return matrix
        fit = fit_similarity(transform_points(self.points, matrix), positions)
        return matrix if fit is None else np.asarray(fit.matrix @ matrix)


@dataclass
class TrackedHolders:
    """The ties of one groom and the surface that holds its tips, at rest and now.

    holders: at rest. warnings: objects that cannot hold hair and why, in the pose last seen.
    """

    holders: Holders = field(default_factory=Holders)
    _ties: tuple[_TrackedTie, ...] = ()
    _tips: Handle | None = None
    _unusable_warnings: tuple[str, ...] = ()
    _display_keys: dict[int, str] = field(default_factory=dict)
    _pose_warnings: tuple[str, ...] = ()

    @classmethod
    def of(
        cls,
        hair: bpy.types.Object,
        depsgraph: bpy.types.Depsgraph,
        previous: TrackedHolders | None = None,
        to_rest: Floats | None = None,
    ) -> TrackedHolders:
        """The ties and the tip surface of hair, at rest in its present pose.

        Args:
            previous: as read before; objects that are unchanged keep their rest.
            to_rest: (4, 4), from the present pose to the rest pose of the hair.
        """
        to_rest = np.eye(4) if to_rest is None else to_rest
        ties, unusable = [], []
        for obj in ties_of(hair):
            try:
                ties.append(_reused_tie(_read_tie(obj, depsgraph, to_rest), previous))
            except HairloomError as error:
                unusable.append(str(error))
        tips = None
        try:
            tips = _read_tips(hair, depsgraph, to_rest)
        except HairloomError as error:
            unusable.append(str(error))
        surface = hair.hairloom.tip_surface
        if tips is not None and previous is not None and previous._has_tip_surface(surface):
            tips = _reused_surface(tips, previous.holders.tip_surface)
        return cls(
            Holders(tuple(one.tie for one in ties), tips),
            tuple(ties),
            None if tips is None else Handle.of(surface),
            tuple(unusable),
            {obj.session_uid: _display_key(obj) for obj in holders_of(hair)},
        )

    def _has_tip_surface(self, surface: bpy.types.Object) -> bool:
        return self._tips is not None and self._tips.uid == surface.session_uid

    @property
    def warnings(self) -> tuple[str, ...]:
        return (*self._unusable_warnings, *self._pose_warnings)

    @property
    def uids(self) -> frozenset[int]:
        """Session numbers of the ties and the tip surface."""
        ties = {one.body.handle.uid for one in self._ties}
        return frozenset(ties if self._tips is None else ties | {self._tips.uid})

    @property
    def rest_matrices(self) -> Floats:
        """(tie_count, 4, 4), matrix_world of the ties at rest."""
        return np.array([one.body.rest for one in self._ties]).reshape(-1, 4, 4)

    def with_rest_matrices(self, rests: Floats) -> TrackedHolders:
        """The same ties with these rest matrices, (tie_count, 4, 4), as those of a bake."""
        if len(rests) != len(self._ties):
            return self
        ties = []
        for one, rest in zip(self._ties, rests, strict=True):
            to_rest = rest @ np.linalg.pinv(one.body.rest)
            tie = Tie(one.tie.name, to_rest @ one.tie.shape, one.tie.is_ball)
            ties.append(
                _TrackedTie(Body(one.body.handle, rest), tie, transform_points(one.points, to_rest))
            )
        holders = Holders(tuple(one.tie for one in ties), self.holders.tip_surface)
        return TrackedHolders(
            holders, tuple(ties), self._tips, self._unusable_warnings, self._display_keys
        )

    def anchors(
        self, hair: bpy.types.Object, holds: Holds, depsgraph: bpy.types.Depsgraph
    ) -> Floats:
        """The matrices of all anchors now, (anchor_count, 4, 4), see `groom.holds.anchors_of`."""
        warnings = []
        matrices = np.full((holds.tie_count, 4, 4), np.nan)
        current = {obj.session_uid for obj in ties_of(hair)}
        for number, one in enumerate(self._ties[: holds.tie_count]):
            try:
                matrix = one.motion_from_rest(depsgraph)
                if one.body.handle.uid in current and np.isfinite(matrix).all():
                    matrices[number] = matrix
            except HairloomError as error:
                warnings.append(str(_tie_error(one.body.handle.name, error)))
        positions = None
        try:
            positions = self._tip_positions(hair, holds, depsgraph)
        except HairloomError as error:
            warnings.append(str(error))
        self._pose_warnings = tuple(warnings)
        return anchors_of(holds, matrices, positions)

    def _tip_positions(
        self, hair: bpy.types.Object, holds: Holds, depsgraph: bpy.types.Depsgraph
    ) -> Floats | None:
        obj = hair.hairloom.tip_surface
        if holds.surface is None or obj is None:
            return None
        if is_disabled(obj, depsgraph):
            raise _disabled_error(obj.name)
        positions = read_positions(obj, depsgraph, place=obj.name)
        if positions.shape != holds.surface.positions.shape:
            raise HairloomError(
                "its mesh now has a different number of vertices, so it holds no tips",
                place=obj.name,
                remedy="Press Preview again",
            )
        if not np.isfinite(positions).all():
            raise HairloomError(
                "its position is not a finite number, so it holds no tips",
                place=obj.name,
                remedy="Fix the driver, constraint or modifier that moves it",
            )
        return positions

    def is_outdated(self, hair: bpy.types.Object, edited: set[int]) -> bool:
        """Whether an object that holds hair was added or has changed its shape since it was read.

        Args:
            edited: session numbers of data-blocks whose geometry has changed.
        """
        return any(
            self._display_keys.get(obj.session_uid) != _display_key(obj)
            or (obj.data is not None and obj.data.session_uid in edited)
            for obj in holders_of(hair)
        )


def ties_of(hair: bpy.types.Object) -> tuple[bpy.types.Object, ...]:
    """The objects that may hold this hair as ties, each once."""
    return objects_in(hair, "tie_collection")


def holders_of(hair: bpy.types.Object) -> tuple[bpy.types.Object, ...]:
    """The objects that may hold this hair: ties, and the tip surface last."""
    surface = hair.hairloom.tip_surface
    return ties_of(hair) if surface is None else (*ties_of(hair), surface)


def new_ring(hair: bpy.types.Object, context: bpy.types.Context) -> bpy.types.Object:
    """A ring at the 3D cursor, parented to the surface.

    Raises:
        HairloomError: the hair has no curves.
    """
    strands = posed_curves(hair, context.evaluated_depsgraph_get()).strands
    ring = bpy.data.objects.new("Hair Tie", None)
    ring.empty_display_type = "CIRCLE"
    ring.empty_display_size = _NEW_RING_RADIUS * float(np.median(strands.lengths()))
    link_into(ring, hair.users_collection, context.scene)
    head = head_of(hair)
    if head is not None:
        ring.parent = head
        ring.matrix_parent_inverse = head.matrix_world.inverted_safe()
    ring.location = context.scene.cursor.location
    ring.rotation_euler = context.scene.cursor.rotation_euler
    context.view_layer.update()
    return ring


def add_ties(hair: bpy.types.Object, rings: list[bpy.types.Object], scene: bpy.types.Scene) -> None:
    """Put rings into the hair's collection of ties, which is made if there is none."""
    add_to_collection(hair, "tie_collection", "Ties", rings, scene)


def remove_tie(hair: bpy.types.Object, name: str, context: bpy.types.Context) -> None:
    """Take an object out of the hair's collection of ties, but not out of the scene; see
    `remove_from_collection`."""
    remove_from_collection(hair, "tie_collection", "Ties", name, context)


def count_held_curves(
    hair: bpy.types.Object, ring: bpy.types.Object, depsgraph: bpy.types.Depsgraph
) -> tuple[int, int]:
    """How many of the hair's curves a ring holds in the present pose, and the number of curves.

    Raises:
        HairloomError: it cannot be a tie, or the hair has no curves.
    """
    strands = posed_curves(hair, depsgraph).strands
    holds = find_holds(strands, Holders((_read_tie(ring, depsgraph, np.eye(4)).tie,)))
    return (0 if holds is None else len(holds.strand)), strands.strand_count


def _display_key(obj: bpy.types.Object) -> str:
    """A key of what may change an object's shape without editing its data: an Empty's display."""
    return f"{obj.empty_display_type} {obj.empty_display_size}" if obj.type == "EMPTY" else obj.type


def _read_tie(
    obj: bpy.types.Object, depsgraph: bpy.types.Depsgraph, to_rest: Floats
) -> _TrackedTie:
    """Raises:
    HairloomError: it cannot be a tie.
    """
    if obj.type not in TIE_TYPES:
        raise HairloomError(
            f"it is a {obj.type.lower()} object, so no hair passes through it",
            place=obj.name,
            remedy="Use an Empty, a curve or a mesh as a tie",
        )
    if is_disabled(obj, depsgraph):
        raise _disabled_error(obj.name)
    matrix = matrix_of(obj, depsgraph)
    if not np.isfinite(matrix).all() or not is_invertible(matrix):
        raise HairloomError(
            "its scale is zero, so it holds no hair", place=obj.name, remedy="Correct its scale"
        )
    rest = to_rest @ matrix
    body = Body(Handle.of(obj), rest)
    if obj.type == "EMPTY":
        shape, is_ball = _empty_tie_shape(obj)
        return _TrackedTie(body, Tie(obj.name, rest @ shape, is_ball))
    local = _points_of(obj, depsgraph)
    shape, is_ball = _fit_tie_shape(transform_points(local, rest).astype(np.float64), obj.name)
    points = transform_points(local, rest) if obj.type == "MESH" else np.zeros((0, 3))
    return _TrackedTie(body, Tie(obj.name, shape, is_ball), points)


def _empty_tie_shape(obj: bpy.types.Object) -> tuple[Floats, bool]:
    """The shape of a tie, and whether it is a ball. Blender draws circles around an Empty's y."""
    size = obj.empty_display_size
    shape = np.diag([size, size, size, 1.0])
    if obj.empty_display_type != "CIRCLE":
        return shape, True
    return shape[:, [0, 2, 1, 3]], False


def _points_of(obj: bpy.types.Object, depsgraph: bpy.types.Depsgraph) -> Floats:
    """The points of a mesh or curve as it is drawn, (n, 3) object space."""
    with as_mesh(obj, depsgraph) as mesh:
        return np.empty((0, 3), np.float32) if mesh is None else vertex_positions(mesh)


def _fit_tie_shape(points: Floats, name: str) -> tuple[Floats, bool]:
    """The shape of a tie, and whether it is a ball, from its points (n, 3).

    Points spread evenly along an ellipse have a variance of half the squared half-axis along each
    axis; those on an ellipsoid a third.
    """
    if len(points) >= 3 and np.isfinite(points).all():
        middle = points.mean(axis=0)
        _, size, axes = np.linalg.svd(points - middle, full_matrices=False)
        size /= np.sqrt(len(points))
        if size[1] > _LINE_WIDTH * size[0] > 0.0:
            is_ball = bool(size[2] > _BALL_THICKNESS * size[0])
            half = size * np.sqrt(3.0 if is_ball else 2.0)
            half[2] = half[2] if is_ball else half[0]  # across the ring, where it has no extent
            shape = np.eye(4)
            shape[:3, :3], shape[:3, 3] = axes.T * half, middle
            return shape, is_ball
    raise HairloomError(
        "its points do not form a ring, so no hair passes through it",
        place=name,
        remedy="Use a circle, or a mesh around the hair",
    )


def _read_tips(
    hair: bpy.types.Object, depsgraph: bpy.types.Depsgraph, to_rest: Floats
) -> TipSurface | None:
    obj = hair.hairloom.tip_surface
    if obj is None:
        return None
    if is_disabled(obj, depsgraph):
        raise _disabled_error(obj.name)
    surface = read_surface(obj, depsgraph, need_uv=False, place=obj.name)
    group = hair.hairloom.tip_group
    weight = read_weights(obj, depsgraph, group) if group else None
    return TipSurface(obj.name, surface.transformed(to_rest), weight)


def _reused_tie(read: _TrackedTie, previous: TrackedHolders | None) -> _TrackedTie:
    """The tie as read before, unless its shape has changed; a new pose is no change of shape."""
    for one in () if previous is None else previous._ties:
        if one.body.handle.uid != read.body.handle.uid:
            continue
        here, there = (np.linalg.pinv(each.body.rest) @ each.tie.shape for each in (read, one))
        is_alike = read.tie.is_ball == one.tie.is_ball and len(read.points) == len(one.points)
        # a ring's axes in its own plane and their signs are arbitrary, so compare squares
        squares = [each[:3, :3] @ each[:3, :3].T for each in (here, there)]
        size = float(np.trace(squares[1]))
        if (
            is_alike
            and np.abs(squares[0] - squares[1]).max() <= _SHAPE_TOLERANCE * size
            and np.abs(here[:3, 3] - there[:3, 3]).max() <= _SHAPE_TOLERANCE * np.sqrt(size)
        ):
            return one
        to_rest = one.body.rest @ np.linalg.pinv(read.body.rest)
        tie = Tie(read.tie.name, to_rest @ read.tie.shape, read.tie.is_ball)
        return _TrackedTie(one.body, tie, transform_points(read.points, to_rest))
    return read


def _reused_surface(read: TipSurface, previous: TipSurface | None) -> TipSurface:
    """The surface as read before if it has the same triangles, since only its pose may differ."""
    if previous is None:
        return read
    one, other = read.surface.triangles, previous.surface.triangles
    is_same = one.shape == other.shape and bool((one == other).all())
    if not is_same:
        return read
    has_same_weight = are_same(read.weight, previous.weight)
    return previous if has_same_weight else replace(previous, weight=read.weight)


def _disabled_error(name: str) -> HairloomError:
    return HairloomError(
        "it is disabled in viewports or excluded from the view layer, so it holds no hair",
        place=name,
        remedy="Enable it",
    )


def _tie_error(name: str, error: HairloomError) -> HairloomError:
    if not isinstance(error, ObjectGoneError):
        return error
    return HairloomError(
        "this tie is gone, so it holds no hair", place=name, remedy="Undo that, or add another tie"
    )
