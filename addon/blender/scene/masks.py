"""Reading the masks of a groom's settings.

A name is looked up as a vertex group, then as an attribute of the surface, then as an attribute of
the curves, then as an image on the surface's active UV map.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Self

import bpy
import numpy as np

from ...arrays import Floats, Ints
from ...errors import HairloomError
from ...groom.masks import (
    SELECTION,
    ImageMask,
    Mask,
    Masks,
    StrandMask,
    SurfaceMask,
    mask_names,
)
from ...params import Settings
from ...shading.luminance import LUMINANCE
from ...strands import StrandSet, Surface
from ..base.mesh_arrays import triangle_vertices
from ..base.vertex_weights import (
    VertexGroupWeights,
    at_corners,
    has_weights,
    image_names,
    mask_choices,
    missing_weights,
    painted_attribute,
    read_weights,
    weights_on,
)
from .curves import curve_offsets, curves_as_drawn
from .surfaces import evaluated_mesh, read_surface


@dataclass(frozen=True)
class _VertexGroups:
    """The vertex groups of a surface. corners: (triangle_count, 3) vertices of its triangles."""

    members: VertexGroupWeights
    corners: Ints

    @classmethod
    def of(cls, surface: bpy.types.Object, depsgraph: bpy.types.Depsgraph) -> Self:
        with evaluated_mesh(surface, depsgraph, surface.name) as mesh:
            return cls(VertexGroupWeights.of(mesh), triangle_vertices(mesh))

    def at_corners(self, index: int) -> Floats:
        """The weights in one group, (triangle_count, 3)."""
        corners: Floats = self.members.weights(index)[self.corners]
        return corners


@dataclass(frozen=True, eq=False)
class MaskReader:
    """What masks of a groom are read from.

    hair: its curves; None: they are from a file. surface: the object that it grows on, or None.
    head: the surface as it was read. strands: of the usable curves. curve_indices: of these.
    last_usable: the last usable state of every mask, by name.
    is_before_modifiers: whether the strands are the hair's curves before their modifiers.

    Make a new one for each reading: vertex groups are read once, and not updated.
    """

    hair: bpy.types.Object | None
    surface: bpy.types.Object | None
    head: Surface | None
    strands: StrandSet
    curve_indices: Ints
    last_usable: dict[str, Mask] = field(default_factory=dict)
    is_before_modifiers: bool = False
    _groups: list[_VertexGroups] = field(default_factory=list, init=False)

    def masks(
        self, settings: Settings, depsgraph: bpy.types.Depsgraph
    ) -> tuple[Masks, tuple[str, ...]]:
        """The masks that settings name, and warnings.

        If a mask cannot be used, its last usable state is; without one it has no effect. The
        selection is read even while it has no effect, as keyframes may turn it on.
        """
        active, labels = mask_names(settings), {p.name: p.label for p in settings.parameters()}
        names = dict(active)
        if hasattr(settings, "only_selected") and self._has_selection(depsgraph):
            names["only_selected"] = SELECTION
        masks, warnings = {}, []
        read = {name: self.read_or_last(name, depsgraph) for name in sorted(set(names.values()))}
        for parameter, name in names.items():
            mask, warning = read[name]
            if mask is not None:
                masks[parameter] = mask
            if parameter not in active or warning in warnings:
                continue
            if warning:
                warnings.append(warning)
            elif name == SELECTION and mask is not None and mask.is_zero:
                warnings.append(
                    f"{self._place}: none of its curves is selected, so none is simulated. Select"
                    " some in Sculpt or Edit Mode, or turn Only Selected off"
                )
            elif mask is not None and mask.is_zero:
                warnings.append(
                    f"{self._place}: the mask '{name}' is 0 everywhere, and so is"
                    f" {labels[parameter]}. Paint it (Weight Paint), or clear its field"
                )
        return Masks(masks), tuple(warnings)

    def read_or_last(self, name: str, depsgraph: bpy.types.Depsgraph) -> tuple[Mask | None, str]:
        """A mask, and a warning; if it cannot be used now, the one that was usable last."""
        try:
            mask = self.mask(name, depsgraph)
        except HairloomError as error:
            last = self.last_usable.get(name)
            if last is None or not self._fits(last):
                return None, str(error)
            return last, f"{error} Until then its last state is used"
        self.last_usable[name] = mask
        return mask, ""

    def mask(self, name: str, depsgraph: bpy.types.Depsgraph) -> Mask:
        """The mask of this name.

        Raises:
            HairloomError: there is none of this name, or it cannot be used.
        """
        if name == SELECTION:
            return self._selection(depsgraph)
        found = self._surface_mask(name, depsgraph)
        if found is None:
            found = self._curves_mask(name, depsgraph)
        if found is None:
            found = self._image_mask(name)
        if found is None:
            raise self._missing(name)
        return found

    @property
    def _place(self) -> str:
        obj = self.surface or self.hair
        return "hair" if obj is None else str(obj.name)

    def _fits(self, mask: Mask) -> bool:
        triangles = None if self.head is None else len(self.head.triangles)
        return mask.fits(self.strands.strand_count, triangles)

    def _surface_mask(self, name: str, depsgraph: bpy.types.Depsgraph) -> Mask | None:
        surface, head = self.surface, self.head
        if surface is None or head is None or surface.type != "MESH":
            return None
        evaluated = surface.evaluated_get(depsgraph)
        group = surface.vertex_groups.get(name)
        if group is not None:
            if not self._groups:
                self._groups.append(_VertexGroups.of(surface, depsgraph))
            corners = self._groups[0].at_corners(group.index)
        else:
            with evaluated_mesh(surface, depsgraph, surface.name) as mesh:
                if not has_weights(surface, mesh, name):
                    return None
                corners = at_corners(mesh, *weights_on(surface, mesh, name))
        if len(corners) != len(head.triangles):
            raise HairloomError(
                f"the mask '{name}' covers {len(corners):,} triangles, but the hair was made on "
                f"{len(head.triangles):,}, so it is not used",
                place=surface.name,
                remedy="Turn on the modifiers that change the mesh, then show the hair",
            )
        if np.linalg.det(np.array(evaluated.matrix_world)) < 0.0:
            corners = corners[:, ::-1]  # as triangles are, see `Surface.transformed`
        return SurfaceMask(checked_values(corners, name, surface.name))

    def _curves_mask(self, name: str, depsgraph: bpy.types.Depsgraph) -> StrandMask | None:
        found = self._curve_values(name, depsgraph)
        if found is None:
            return None
        values, domain = found
        if domain == "CURVE":
            return StrandMask(values[:, None])
        return StrandMask.of_points(self.strands, values)

    def _selection(self, depsgraph: bpy.types.Depsgraph) -> StrandMask:
        """The selection of each curve: the maximum over its points. Without the attribute, all are
        selected."""
        found = self._curve_values(SELECTION, depsgraph)
        if found is None:
            return StrandMask(np.ones((self.strands.strand_count, 1), np.float32))
        values, domain = found
        if domain == "POINT":
            values = np.maximum.reduceat(values, self.strands.offsets[:-1])
        return StrandMask(values[:, None])

    def _has_selection(self, depsgraph: bpy.types.Depsgraph) -> bool:
        return self.hair is not None and (
            painted_attribute(self._curves(self.hair, depsgraph), SELECTION) is not None
        )

    def _curves(self, hair: bpy.types.Object, depsgraph: bpy.types.Depsgraph) -> bpy.types.Curves:
        curves: bpy.types.Curves = (
            hair if self.is_before_modifiers else hair.evaluated_get(depsgraph)
        ).data
        return curves

    def _curve_values(self, name: str, depsgraph: bpy.types.Depsgraph) -> tuple[Floats, str] | None:
        """The values of an attribute on the usable curves or on their points, and its domain."""
        if self.hair is None:
            return None
        curves = self._curves(self.hair, depsgraph)
        found = painted_attribute(curves, name)
        if found is None:
            return None
        values, domain = found
        values = checked_values(values, name, self.hair.name)
        strands = self.strands
        drawn = None if self.is_before_modifiers else curves_as_drawn(curves)
        offsets = curve_offsets(curves) if drawn is None else drawn.offsets
        if drawn is not None and domain == "POINT":
            values = drawn.of(values)
        counts = np.diff(offsets)
        exist = self.curve_indices.max(initial=-1) < len(counts)
        if not (exist and np.array_equal(counts[self.curve_indices], strands.point_counts)):
            raise HairloomError(
                f"the mask '{name}' belongs to other curves than those shown",
                place=self.hair.name,
                remedy="Wait until the hair is made again",
            )
        if domain == "CURVE":
            return values[self.curve_indices], domain
        is_used = np.zeros(len(counts), bool)
        is_used[self.curve_indices] = True
        return values[np.repeat(is_used, counts)], domain

    def _image_mask(self, name: str) -> ImageMask | None:
        return image_mask(name, self.head, self._place) if name in image_names() else None

    def _missing(self, name: str) -> HairloomError:
        of_surface = None if self.surface is None else self.surface.data.attributes.get(name)
        if self.surface is not None and of_surface is not None:
            return missing_weights(self.surface, name, of_surface)
        choices = mask_choices(self.hair, self.surface)
        return HairloomError(
            f"it has neither a vertex group nor an attribute named '{name}', and there is no such"
            " image",
            place=self._place,
            remedy=f"Use one of: {', '.join(choices[:8])}"
            if choices
            else "Paint one (Weight Paint), or leave the field empty",
        )


def read_map(obj: bpy.types.Object, depsgraph: bpy.types.Depsgraph, name: str) -> Floats:
    """As `read_weights`, (vertex_count,); if the mesh has no weights of this name, an image of this
    name at the vertices.

    Raises:
        HairloomError: not a mesh, or nothing usable of this name.
    """
    if name not in image_names() or obj.type != "MESH":
        return read_weights(obj, depsgraph, name)
    with evaluated_mesh(obj, depsgraph, obj.name) as mesh:
        has_own = has_weights(obj, mesh, name)
    if has_own:
        return read_weights(obj, depsgraph, name)
    head = read_surface(obj, depsgraph, need_uv=False, place=obj.name)
    return image_mask(name, head, obj.name).on(head).astype(np.float32)


def image_mask(name: str, head: Surface | None, place: str) -> ImageMask:
    """An image on the UVs of a surface.

    Args:
        place: names the surface in messages.

    Raises:
        HairloomError: there are no UVs, or no pixels that can be used.
    """
    corner_uv = None if head is None else head.corner_uv
    image = checked_image(name, corner_uv, place, instead="a vertex group")
    assert corner_uv is not None
    return ImageMask(checked_values(image_values(image), name, place), corner_uv)


def checked_image(
    name: str, corner_uv: Floats | None, place: str, *, instead: str
) -> bpy.types.Image:
    """An image of one tile with pixels, for a surface with UVs.

    Args:
        place: names the surface in messages. instead: what the message suggests to paint instead.

    Raises:
        HairloomError: there are no UVs, no pixels, or several tiles, of which Blender's API only
            gives the pixels of the first.
    """
    if corner_uv is None:
        raise HairloomError(
            f"the image '{name}' needs a surface with UVs",
            place=place,
            remedy=f"Unwrap it (Edit Mode, UV > Unwrap), or paint {instead}",
        )
    image = bpy.data.images[name]
    if not (all(image.size) and image.has_data):  # reading the size loads the image
        raise HairloomError(
            f"the image '{name}' has no pixels",
            place=place,
            remedy="Find its file (File > External Data > Find Missing Files)",
        )
    if image.source == "TILED" and len(image.tiles) > 1:
        raise HairloomError(
            f"the image '{name}' has several tiles, but hair uses one for its whole surface",
            place=place,
            remedy=f"Use an image of one tile, or paint {instead}",
        )
    return image


def image_values(image: bpy.types.Image) -> Floats:
    """The luminance of an image's pixels as stored, without decoding, (height, width) float32."""
    (width, height), channels = image.size, image.channels
    pixels = np.empty(width * height * channels, np.float32)
    image.pixels.foreach_get(pixels)
    pixels = pixels.reshape(height, width, channels)
    if channels < 3:
        return np.ascontiguousarray(pixels[..., 0])
    luminance: Floats = pixels[..., :3] @ LUMINANCE
    return luminance


def checked_values(values: Floats, name: str, place: str) -> Floats:
    """The values, with negative ones raised to 0.

    Raises:
        HairloomError: a value is not finite.
    """
    broken = int((~np.isfinite(values)).sum())
    if broken:
        raise HairloomError(
            f"'{name}' has values that are not finite numbers ({broken:,} of {values.size:,}), so "
            "it is not used",
            place=place,
            remedy="Paint or compute it again, or clear its field",
        )
    return np.maximum(values, np.float32(0.0))
