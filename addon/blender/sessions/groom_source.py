"""The data that is read of one groom: curves, head and settings, and the places of both objects.

It holds numbers and arrays, never a reference into Blender's data.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import bpy
import numpy as np

from ...arrays import Floats, Ints, all_equal, are_same, pieces_of_rows
from ...dynamics.painted import PaintedGuides
from ...dynamics.settings import DynamicsSettings
from ...groom.children_settings import ChildrenSettings
from ...groom.masks import NO_MASKS, Mask, Masks, mask_names
from ...groom.rest_hair import RestHair
from ...paint_flow import painted_guides
from ...rig_flow import Pose, Rig
from ...shading.ambient_settings import AmbientSettings
from ...shading.settings import ShadingSettings
from ...strands import StrandSet, Surface
from ...strands.affine import transform_points
from ...strands.clean import Cleaned
from ...strands.result_cache import ResultCache
from ...style_flow import curves_at_rest, rig_with_style
from ..bakes.baked_rig import BakedRig, RestMatrices
from ..bakes.groom_hashes import groom_frame_hash, groom_rig_hash
from ..base.objects import Body, head_of, matrix_of
from ..colliders.ties import TrackedHolders
from ..properties.groom_settings import GroomSettings
from ..scene.curves import read_curves
from ..scene.masks import MaskReader
from ..scene.partings import parting_state, read_partings
from ..scene.poses import check_finite, read_pose
from ..scene.source import (
    Source,
    read_density,
    read_source,
    read_source_colors,
    usable_curves,
)
from ..scene.surfaces import read_positions
from .prepared_groom import BuildRequest, requested_rig

#: Points that moved by less than this, as a fraction of their distance from the origin, have not
#: moved.
_ROUNDING = 1e-6


class GroomSource:
    """One groom as it was read.

    source, settings: of the hair that is shown.
    painted: density and masks of children, as they were last read.
    request: what was last read; hair is being made from it, or is shown already.

    Args:
        hair: a hair curves object.

    Raises:
        HairloomError: no hair curves, or none are usable.
    """

    def __init__(self, hair: bpy.types.Object, depsgraph: bpy.types.Depsgraph) -> None:
        head = head_of(hair)
        self.hair = Body.at_rest(hair, depsgraph)
        self._holders = TrackedHolders.of(hair, depsgraph)
        self._last_good_masks: dict[str, Mask] = {}
        self._shown_map: tuple[str, Mask | None] | None = None
        self._overlay_mask_reader: MaskReader | None = None
        self._motion_masks = NO_MASKS
        self._painted_guides: tuple[Ints, Masks, PaintedGuides | None] | None = None
        source = read_source(hair, depsgraph, self._last_good_masks)
        self.source = replace(source, holders=self._holders.holders)
        self._last_curves = self.source.strands
        self.painted = self.source.density, self.source.masks
        uses_head = self.source.head is not None and head is not None
        self.head = Body.at_rest(head, depsgraph) if uses_head else None
        self._head_uid = head and head.session_uid
        self._parting_state = parting_state(hair)
        self.settings = GroomSettings.of(hair, depsgraph)
        self._cache = ResultCache()
        self._read_motion_masks(self._mask_reader(self.source), self.settings, depsgraph)
        self._style_warning = ""
        self._styled_rig: _StyledRig | None = None
        self.request = BuildRequest(
            self.name, self.source, self.settings, holders=self._holders, cache=self._cache
        )
        check_finite(hair.name, self.hair.rest)

    @property
    def name(self) -> str:
        return self.hair.handle.name

    @property
    def rest_matrices(self) -> RestMatrices:
        head = None if self.head is None else self.head.rest
        return RestMatrices(self.hair.rest, head, self._holders.rest_matrices)

    def is_resized(self, depsgraph: bpy.types.Depsgraph) -> bool:
        """Whether hair or head has been scaled or mirrored since rest; False if one has size 0,
        from which no hair can be made.

        Raises:
            ObjectGoneError: one of them no longer exists.
        """
        head = None if self.head is None else matrix_of(self.head.resolve(), depsgraph)
        now = RestMatrices(matrix_of(self.hair.resolve(), depsgraph), head)
        return now.is_invertible and not now.has_same_size(self.rest_matrices)

    @property
    def warnings(self) -> tuple[str, ...]:
        """Warnings about what was read, and about what holds the hair now."""
        style = filter(None, (self._style_warning,))
        own = self.source.warnings
        motion = (each for each in self._motion_warnings if each not in own)
        return (*own, *self._holders.warnings, *motion, *style)

    @property
    def holder_uids(self) -> frozenset[int]:
        """Session numbers of what holds the hair beside its roots."""
        return self._holders.uids

    def has_changed_holders(self, edited: set[int]) -> bool:
        """See `TrackedHolders.is_outdated`."""
        hair = self.hair.handle.find()
        return hair is not None and self.request.holders.is_outdated(hair, edited)

    def has_changed_partings(self) -> bool:
        """Whether partings have been added, removed, moved or edited."""
        hair = self.hair.handle.find()
        return hair is not None and not all_equal(parting_state(hair), self._parting_state)

    def rig(self) -> Rig:
        """The groom prepared to move.

        Raises:
            HairloomError: the groom is of another scale than the head.
        """
        return requested_rig(self.request)

    def use_bake(self, baked: BakedRig | None) -> None:
        """Request the rig of a bake of this groom, so that it is the same to the bit."""
        if baked is not None and (baked.rest_matrices.head is None) == (self.head is None):
            rig = self._rig_of(baked)
            self._holders = self._holders.with_rest_matrices(baked.rest_matrices.ties)
            self.request = BuildRequest(self.name, self.source, self.settings, rig, self._holders)

    def _rig_of(self, baked: BakedRig) -> Rig:
        """The rig of a bake; rest becomes the place of hair and head at the bake's rest."""
        back = baked.rest_matrices.hair @ np.linalg.pinv(self.hair.rest)
        lines = self.source.partings
        if lines is not None:
            lines = transform_points(lines.reshape(-1, 3), back).reshape(-1, 2, 3)
        rig = _with_uv(baked.rig, self.source.head)
        strands, rest = self._strands_in_pose_of(baked, back)
        self.source = replace(
            self.source, strands=strands, head=rig.head, partings=lines, rest=rest
        )
        self.hair.rest = baked.rest_matrices.hair
        if self.head is not None and baked.rest_matrices.head is not None:
            self.head.rest = baked.rest_matrices.head
        return rig

    def _strands_in_pose_of(
        self, baked: BakedRig, back: Floats
    ) -> tuple[StrandSet, RestHair | None]:
        """The strands in the pose of hair and head at a bake's rest; and the stored rest hair if
        they had to be moved there.

        Args:
            back: (4, 4), from the hair object's transform to that at the bake's rest.
        """
        read, start = self.source.at_rest, self.source.at_rest.head
        strands, head = read.strands.transformed(back), baked.rig.head
        if start is None or head is None or self.head is None or baked.rest_matrices.head is None:
            return strands, None
        start = start.transformed(baked.rest_matrices.head @ np.linalg.pinv(self.head.rest))
        rest = RestHair.find(strands, [start], head)
        return (strands, None) if rest is None else (rest.on(head), rest)

    def has_changed_head(self) -> bool:
        """Whether the artist has set another surface since."""
        head = head_of(self.hair.resolve())
        return (head and head.session_uid) != self._head_uid

    def read_again(self, depsgraph: bpy.types.Depsgraph) -> BuildRequest | None:
        """Read edited curves, weights and settings; returns a request for the hair to make from
        them, or None if the rig is still up to date.

        Curves are brought into the pose of the first reading.

        Raises:
            HairloomError: the hair is gone, or no usable hair is left.
        """
        hair, known = self.hair.resolve(), self.request
        before = known.source
        settings = GroomSettings.of(hair)
        read, stored, back = self._read_curves(hair, depsgraph)
        rest = None if before.rest is None else replace(before.rest, strands=stored)
        strands = self._on_head(stored, depsgraph)
        is_animated = settings[DynamicsSettings].animated_style
        if is_animated and np.array_equal(strands.offsets, before.strands.offsets):
            strands = strands.with_points(before.strands.points)  # they differ in each frame
        if _is_same_hair(strands, before.strands, back):
            strands, rest = before.strands, before.rest
        mask_reader = self._mask_reader(
            replace(before, strands=strands, curve_indices=read.curve_indices)
        )
        self._read_motion_masks(mask_reader, settings, depsgraph)
        density, warning = read_density(hair, mask_reader, depsgraph)
        masks, mask_warnings = mask_reader.masks(settings[ChildrenSettings], depsgraph)
        colors, color_warnings = read_source_colors(hair, strands, before.head, depsgraph)
        holding = TrackedHolders.of(hair, depsgraph, known.holders, back)
        partings, parting_warnings = before.partings, before.parting_warnings
        if self.has_changed_partings():
            self._parting_state = parting_state(hair)
            lines, parting_warnings = read_partings(hair, depsgraph)
            there = transform_points(lines.reshape(-1, 3), back).reshape(-1, 2, 3)
            partings = there if len(lines) else None
        source = replace(
            before,
            holders=holding.holders,
            strands=strands,
            rest=rest,
            dropped=read.dropped,
            curve_indices=read.curve_indices,
            density=density,
            density_warning=warning,
            masks=masks,
            mask_warnings=mask_warnings,
            colors=colors,
            color_warnings=color_warnings,
            partings=partings,
            parting_warnings=parting_warnings,
        )
        request = BuildRequest(self.name, source, settings, holders=holding, cache=self._cache)
        if (
            request.gives_same_rig_as(known)
            and request.settings[AmbientSettings] == known.settings[AmbientSettings]
        ):
            self.source = replace(
                self.source,
                dropped=read.dropped,
                density_warning=warning,
                mask_warnings=mask_warnings,
                colors=colors,
                color_warnings=color_warnings,
                parting_warnings=parting_warnings,
            )
            self.request = replace(known, settings=settings)
            return None
        self.request = request
        return request

    def _read_curves(
        self, hair: bpy.types.Object, depsgraph: bpy.types.Depsgraph
    ) -> tuple[Cleaned, StrandSet, Floats]:
        """The curves; as strands where the object was at rest; the transform back to it (4, 4)."""
        read = usable_curves(hair, depsgraph)
        back = self.hair.rest @ np.linalg.pinv(matrix_of(hair, depsgraph))
        is_there = np.allclose(back, np.eye(4))
        return read, read.strands if is_there else read.strands.transformed(back), back

    def _on_head(self, read: StrandSet, depsgraph: bpy.types.Depsgraph) -> StrandSet:
        """Curves that were read, on the head in the pose of the first reading.

        Hair that no modifier attaches is stored on the undeformed head; other hair is on the head
        as it is deformed now.
        """
        source, hair = self.request.source, self.hair.resolve()
        if source.head is None or hair.hairloom.dynamics.animated_style:
            return read
        if source.rest is not None:
            return replace(source.rest, strands=read).on(source.head)
        now = self._head_now(source.head, depsgraph)
        found = None if now is None else RestHair.find(read, [now], source.head)
        return read if found is None else found.on(source.head)

    def _head_now(self, rest: Surface, depsgraph: bpy.types.Depsgraph) -> Surface | None:
        """The head as it is deformed now, with its object's transform at rest; None if nothing
        deforms it."""
        head = None if self.head is None else self.head.handle.find()
        if self.head is None or head is None:
            return None
        if not len(head.modifiers) and head.data.shape_keys is None:
            return None
        positions = read_positions(head, depsgraph, place=head.name)
        back = self.head.rest @ np.linalg.pinv(matrix_of(head, depsgraph))
        positions = transform_points(positions, back)
        if positions.shape != rest.positions.shape or not np.isfinite(positions).all():
            return None
        return replace(rest, positions=positions)

    def moved_curves(self, depsgraph: bpy.types.Depsgraph) -> tuple[StrandSet, Ints] | None:
        """The curves that have moved since the last call, or since other hair was accepted, and
        their numbers; None if curves were added or removed, or none has moved.

        Raises:
            HairloomError: the hair is gone, or no usable hair is left.
        """
        before = self._last_curves
        _, stored, back = self._read_curves(self.hair.resolve(), depsgraph)
        strands = self._on_head(stored, depsgraph)
        if not np.array_equal(strands.offsets, before.offsets):
            return None
        farthest = max(np.abs(strands.points).max(initial=0.0), np.abs(back[:3, 3]).max())
        other = np.flatnonzero((strands.points != before.points).any(axis=1))
        away = np.abs(strands.points[other] - before.points[other]).max(axis=1)
        points = other[away > _ROUNDING * farthest]
        number = np.unique(pieces_of_rows(points, strands.offsets))
        if not len(number):
            return None
        self._last_curves = strands
        return strands.take(number), number

    def has_changed_paint(self, depsgraph: bpy.types.Depsgraph) -> bool:
        """Whether density or masks of children have changed since the last call, or since other
        hair was accepted.

        Raises:
            HairloomError: the hair is gone.
        """
        hair, (density, masks) = self.hair.resolve(), self.painted
        mask_reader, settings = self._mask_reader(self.source), self.settings[ChildrenSettings]
        self._overlay_mask_reader = mask_reader  # the overlay reads it before other paint
        self.painted = (
            read_density(hair, mask_reader, depsgraph)[0],
            mask_reader.masks(settings, depsgraph)[0],
        )
        is_same = np.array_equal(density, self.painted[0])  # type: ignore[arg-type]
        return not (is_same and masks == self.painted[1])

    def read_colors(self, depsgraph: bpy.types.Depsgraph) -> bool:
        """Read the colours painted under the shown hair; returns whether it has a colour map.

        Raises:
            HairloomError: the hair is gone.
        """
        hair, shown = self.hair.resolve(), self.source
        if not self.settings[ShadingSettings].color_map:
            return False
        colors, warnings = read_source_colors(hair, shown.strands, shown.head, depsgraph)
        self.source = replace(shown, colors=colors, color_warnings=warnings)
        return True

    def accept(self, request: BuildRequest) -> None:
        """Show the hair of this request from now on, with the present values of settings that act
        at once."""
        self.source, self._holders = request.source, request.holders
        self._overlay_mask_reader = self._shown_map = None
        self._last_curves = self.source.strands
        self.painted = self.source.density, self.source.masks
        self.settings = GroomSettings.of(self.hair.resolve()).with_built_values_of(request.settings)

    def take_settings(self) -> bool:
        """Take over settings that act at once; returns whether others need new hair."""
        settings = GroomSettings.of(self.hair.resolve())
        self.settings = settings.with_built_values_of(self.settings)
        return not settings.needs_no_rebuild(self.request.settings)

    def pose(self, rig: Rig, depsgraph: bpy.types.Depsgraph) -> Pose:
        """The present pose; see `poses.read_pose`."""
        vertex_count = None if rig.head is None else len(rig.head.positions)
        pose = read_pose(self.hair, self.head, vertex_count, depsgraph)
        if rig.holds is None:
            return pose
        return replace(
            pose, anchors=self._holders.anchors(self.hair.resolve(), rig.holds, depsgraph)
        )

    def styled_rig(self, rig: Rig, depsgraph: bpy.types.Depsgraph) -> Rig:
        """The rig in the style of this frame's curves; if their number has changed, in that of the
        last frame that fitted, with a warning.

        Raises:
            HairloomError: the hair is gone.
        """
        hair, known = self.hair.resolve(), self._styled_rig
        if known is None or known.base is not rig:
            known = _StyledRig(rig, self.source.strands, rig)
        curves = read_curves(hair, depsgraph).strands
        self._style_warning = _curve_count_warning(hair.name, curves, known.curves, depsgraph)
        if not self._style_warning:
            back = self.hair.rest @ np.linalg.pinv(matrix_of(hair, depsgraph))
            curves = curves_at_rest(rig, curves, self.pose(rig, depsgraph), back)
            if not _has_same_points(curves, known.curves, back):
                known = _StyledRig(rig, curves, rig_with_style(rig, curves))
        self._styled_rig = known
        return known.rig

    def painted_guides(self, rig: Rig) -> PaintedGuides | None:
        """Factors on settings of the motion at each guide, from masks; None: nothing is painted."""
        if not self._motion_masks:
            return None
        known = self._painted_guides
        if known is None or known[0] is not rig.guides or known[1] is not self._motion_masks:
            painted = painted_guides(rig, self._motion_masks)
            self._painted_guides = known = rig.guides, self._motion_masks, painted
        return known[2]

    def shown_map(self, rig: Rig, depsgraph: bpy.types.Depsgraph) -> Floats | None:
        """The shown map at each guide, (cv_count or 1, guide_count); None: there is none."""
        name = shown_map_name(self.hair.resolve())
        if self._shown_map is None or self._shown_map[0] != name:
            mask_reader = self._overlay_mask_reader or self._mask_reader(self.source)
            mask = mask_reader.read_or_last(name, depsgraph)[0] if name else None
            self._shown_map = name, mask
        mask = self._shown_map[1]
        painted = None if mask is None else painted_guides(rig, Masks({name: mask}))
        return None if painted is None else painted.factors[name]

    def forget_shown_map(self) -> None:
        """Read the shown map again when it is next needed."""
        self._shown_map = self._overlay_mask_reader = None

    def _mask_reader(self, source: Source) -> MaskReader:
        """The reader of masks of this source."""
        hair = self.hair.resolve()
        return MaskReader(
            hair,
            head_of(hair),
            source.head,
            source.strands,
            source.curve_indices,
            self._last_good_masks,
        )

    def _read_motion_masks(
        self, mask_reader: MaskReader, settings: GroomSettings, depsgraph: bpy.types.Depsgraph
    ) -> None:
        masks, self._motion_warnings = mask_reader.masks(settings[DynamicsSettings], depsgraph)
        if masks != self._motion_masks:
            self._motion_masks = masks

    def rig_hash(self, depsgraph: bpy.types.Depsgraph) -> str:
        """See `simulation.Simulation`."""
        hair = self.hair.resolve()
        head = None if self.head is None else self.head.resolve()
        return groom_rig_hash(hair, head, self.settings, depsgraph.scene)

    def frame_hash(self, pose: Pose, depsgraph: bpy.types.Depsgraph) -> str:
        """See `simulation.Simulation`."""
        hair = self.hair.resolve()
        head = None if self.head is None else self.head.resolve()
        return groom_frame_hash(hair, head, pose, depsgraph)


def _with_uv(rig: Rig, read: Surface | None) -> Rig:
    """The rig of a bake, with the UVs of the head as it was read: bakes store none, and images
    need them."""
    head = rig.head
    if head is None or read is None or not np.array_equal(head.triangles, read.triangles):
        return rig
    return replace(rig, head=replace(head, corner_uv=read.corner_uv))


def shown_map_name(hair: bpy.types.Object) -> str:
    """The map that the overlay shows: the chosen one, else the first that a setting names."""
    settings = GroomSettings.of(hair)
    named = (
        hair.hairloom.shown_map,
        *mask_names(settings[DynamicsSettings]).values(),
        *mask_names(settings[ChildrenSettings]).values(),
        settings.children_density,
    )
    return next(filter(None, named), "")


def _curve_count_warning(
    name: str, now: StrandSet, known: StrandSet, depsgraph: bpy.types.Depsgraph
) -> str:
    """A warning if a frame's curves are not those that the hair was made from; else ""."""
    if np.array_equal(now.offsets, known.offsets):
        return ""
    counts = (
        f"{now.strand_count:,} usable curves with {now.point_count:,} points, not"
        f" {known.strand_count:,} with {known.point_count:,}"
    )
    return (
        f"{name}: in frame {depsgraph.scene.frame_current} it has {counts}, so its style stays "
        "that of the last frame that matches. Keep the number of curves and points constant in "
        "modifiers and caches, or turn Animated Style off"
    )


@dataclass(frozen=True, eq=False)
class _StyledRig:
    """A rig in the style of a frame.

    base: the rig that it was made from. curves: the artist's curves in that frame, at rest.
    """

    base: Rig
    curves: StrandSet
    rig: Rig


def _is_same_hair(one: StrandSet, other: StrandSet, back: Floats) -> bool:
    """Whether two readings give the same hair, within the rounding of the transform `back`."""
    return (
        np.array_equal(one.offsets, other.offsets)
        and _has_same_points(one, other, back)
        and np.allclose(one.radius, other.radius, rtol=1e-5)
        and np.array_equal(one.group, other.group)
        and are_same(one.color, other.color)
        and are_same(one.seed, other.seed)
        and are_same(one.root_uv, other.root_uv)
    )


def _has_same_points(one: StrandSet, other: StrandSet, back: Floats) -> bool:
    """Whether two readings give the same points, within the rounding of the transform `back`."""
    farthest = max(np.abs(one.points).max(initial=0.0), np.abs(back[:3, 3]).max())
    return np.allclose(one.points, other.points, rtol=0.0, atol=_ROUNDING * farthest)
