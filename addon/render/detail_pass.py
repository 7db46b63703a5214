"""Detail of strands in one view, computed on the GPU: which are drawn, and in how many pieces.

Two steps. Except for the factors, textures have a texel per strand in the layout of
strand_layout.strand_rows:

    cv_points ----> detail ----> factors, totals             one invocation per strand
    totals -------> numpy -----> order, classes              read back, 8 bytes per strand

    factors RGBA32F: the pieces of sixteen segments as bytes, see lib_detail_packing.glsl; the span
                     of a strand has the index of its first texel
    totals  RG32F:   x pieces of the strand, 0 where it is not drawn; y its mean depth
    order   RGBA32F: x a strand that is drawn, y its pieces, z factor on its width; consecutive for
                     each class

Hair that moves, in a view that was at rest before, does not wait for the totals, see
detail_slots.py.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ..arrays import Floats, Ints
from ..params.glsl import struct_values
from ..refine.culling import hidden_regions
from ..refine.detail import NEAREST, PictureView
from ..refine.settings import DetailSettings
from ..refine.thinning import Thinning, thinning, width_factor
from ..strands.arc_length import segment_lengths
from . import gpu_objects
from .camera import Camera
from .detail_classes import DetailClass, detail_classes
from .detail_slots import DetailSlots
from .rest_counts import RestCounts, best_slot_pieces
from .shader_program import ShaderRecipe, program
from .shader_source import DETAIL_CHOICES, HIDDEN_REGION_CAPACITY
from .snapshot import Snapshot
from .strand_layout import StrandLayout, from_strand_rows, strand_rows, strand_rows_size
from .textures import UniformBlock, texture_from, texture_to_array

#: How far strands are drawn beyond their edge, to reach partly covered pixels [pixels].
EDGE = 0.75
_BLOCKS = (("DetailView", "detail_view"), ("DetailSettings", "detail"))


def detail_recipe(mode: str, culling: str, *, counted: bool = False) -> ShaderRecipe:
    """The program for one mode and one culling; a software driver would compute all branches.

    Args:
        counted: the program also computes the demand of strands, see detail_slots.py.
    """
    recipe = ShaderRecipe(
        name=f"detail_{mode}_{culling}",
        compute="detail.comp.glsl",
        structs=("struct_detail.glsl",),
        settings=(DetailSettings,),
        blocks=_BLOCKS,
        textures=(("FLOAT_2D", "cv_points"), ("FLOAT_2D", "strand_spans")),
        images=(("RGBA32F", "factors"), ("RG32F", "totals")),
        integers=("strand_count",),
        group_size=(64, 1),
        defines=(
            ("MODE", DETAIL_CHOICES["mode"].index(mode)),
            ("CULLING", DETAIL_CHOICES["culling"].index(culling)),
            ("COUNTED", int(counted)),
        ),
    )
    if not counted:
        return recipe
    return replace(
        recipe,
        name=f"{recipe.name}_counted",
        textures=(*recipe.textures, ("FLOAT_2D", "strand_widths")),
        images=(*recipe.images, ("RGBA32F", "strand_demand")),
    )


@dataclass(frozen=True)
class DetailOrder:
    """The strands of a groom that are drawn in one view.

    factors, order: textures as above; None where all segments have the same number of pieces.
    classes: the draws.
    strands, pieces: numbers of those drawn; for moving hair, those of the last view at rest.
    subdivisions: pieces of each segment, where all have the same number; else 0.
    slots: texture used instead of the order for moving hair; there is one class of all slots.
    """

    factors: Any
    order: Any
    classes: tuple[DetailClass, ...]
    strands: int
    pieces: int
    subdivisions: int = 0
    slots: Any = None


class DetailPass:
    """The detail of one groom in its last view. Creating one does not touch the GPU."""

    def __init__(self) -> None:
        self._inputs: tuple[Any, ...]
        self._order: DetailOrder | None
        self._rest_counts: RestCounts | None
        self._extent: GroomExtent | None = None
        self.release()

    def order(
        self,
        snapshot: Snapshot,
        points: Mapping[str, Any],
        serial: int,
        camera: Camera,
        size: tuple[int, int],
        *,
        by_depth: bool = True,
        counted: bool = False,
        reserve_fragments: Callable[[int], int] | None = None,
    ) -> DetailOrder:
        """The strands to draw; computed only when something changed since the last call.

        Args:
            points: the textures cv_points and strand_spans of the snapshot, see strand_pass.py.
            serial: grows whenever one of them is replaced or written.
            size: width and height of the final picture [pixels].
            by_depth: near strands come first; else the order does not matter.
            counted: also sum the demand of strands, so that the next frames can move.
            reserve_fragments: for moving hair, see `has_rest_counts`: a function that makes room
                for this many fragments and returns how many fit. The GPU is not waited for.

        Raises:
            ShaderError: the shader does not compile here.
        """
        view = PictureView(camera.view, camera.projection, *size)
        thinned = self._thinned(snapshot, view)
        regions = _hidden_regions(snapshot, view, thinned.widening)
        culling = "none" if snapshot.detail.culling == "hidden" else snapshot.detail.culling
        culling = "hidden" if len(regions) else culling
        is_uniform = snapshot.detail.mode == "fixed" and bool(snapshot.layout.cv_count)
        if is_uniform and culling == "none" and thinned == Thinning() and not counted:
            return _uniform_order(snapshot)
        rest_counts = None if reserve_fragments is None else self._rest_counts
        scale = _pixels_per_metre(view, snapshot.root_center)
        requirements: tuple[Any, ...] = by_depth, counted
        if rest_counts is not None and reserve_fragments is not None:
            requirements = (
                rest_counts.slots_at(scale),
                reserve_fragments(rest_counts.fragments_at(scale)),
            )
        detail_view = _view_values(view, camera, snapshot, regions)
        inputs = (
            serial,
            detail_view.tobytes(),
            snapshot.detail,
            thinned,
            self._extent,
            *requirements,
        )
        if self._order is not None and self._inputs == inputs:
            return self._order
        recipe = detail_recipe(snapshot.detail.mode, culling, counted=counted)
        slot_pieces = 1 if rest_counts is None else rest_counts.slot_pieces
        self._compute(recipe, snapshot, points, detail_view, thinned, slot_pieces)
        if rest_counts is not None:
            order = self._moving_order(rest_counts, *requirements)
        else:
            totals = self._read_totals(snapshot.strand_count)
            widths = _width_factors(snapshot, thinned)
            order = _ordered(self._factors, totals, widths, by_depth)
            self._rest_counts = (
                self._count_at_rest(snapshot, totals, widths, scale) if counted else None
            )
        self._order, self._inputs = order, inputs
        return order

    def has_rest_counts(self, snapshot: Snapshot) -> bool:
        """Whether the counts that drawing in motion needs are there for these strands."""
        return self._rest_counts is not None and self._rest_counts.matches(
            snapshot.layout, snapshot.detail
        )

    def release(self) -> None:
        """Release everything on the GPU; the next call computes the order again."""
        self._blocks = {name: UniformBlock() for _, name in _BLOCKS}
        self._inputs, self._order, self._rest_counts = (), None, None
        self._factors: Any = None
        self._totals: Any = None
        self._slots = DetailSlots()
        self._strand_widths: tuple[Any, ...] = ()

    def _thinned(self, snapshot: Snapshot, view: PictureView) -> Thinning:
        if snapshot.rank is None or snapshot.detail.lod_size <= 0.0:
            return Thinning()
        if self._extent is None or not self._extent.is_of(snapshot):
            self._extent = GroomExtent.of(snapshot)
        return self._extent.thinning(snapshot, view)

    def _compute(
        self,
        recipe: ShaderRecipe,
        snapshot: Snapshot,
        points: Mapping[str, Any],
        detail_view: Floats,
        thinned: Thinning,
        slot_pieces: int,
    ) -> None:
        """Compute the textures of factors and totals, and the demand if the recipe counts it."""
        count = snapshot.strand_count
        self._fit(snapshot.layout)
        textures = {name: points[name] for name in ("cv_points", "strand_spans")}
        images = {"factors": self._factors, "totals": self._totals}
        is_counted = recipe.images[-1][1] == "strand_demand"
        if is_counted:
            textures["strand_widths"] = self._widths_texture(snapshot, thinned)
            images["strand_demand"] = self._slots.strand_demand(count)
        shader = program(recipe)
        shader.bind(
            blocks={
                "detail_view": self._blocks["detail_view"].holding(detail_view),
                "detail": self._blocks["detail"].holding(struct_values(snapshot.detail)),
            },
            textures=textures,
            images=images,
            integers={"strand_count": count},
        )
        shader.dispatch(count)
        if is_counted:
            self._slots.sum_demand(self._totals, textures["strand_widths"], count, slot_pieces)

    def _read_totals(self, count: int) -> Floats:
        """Pieces and depth of each strand, (strand_count, 2). Waits for the GPU."""
        return from_strand_rows(texture_to_array(self._totals), count, 1).reshape(count, 2)

    def _count_at_rest(
        self, snapshot: Snapshot, totals: Floats, widths: Floats, scale: float
    ) -> RestCounts:
        """The counts at rest, for the next frames."""
        pieces = _drawn_pieces(totals, widths)
        slot_pieces, slots = best_slot_pieces(pieces)
        fragments = self._slots.demand_sums()[2]
        strands = int(np.count_nonzero(pieces))
        return RestCounts(
            *(snapshot.layout, snapshot.detail, scale, slot_pieces, slots, fragments),
            *(strands, int(pieces.sum(dtype=np.int64))),
        )

    def _moving_order(self, rest_counts: RestCounts, slot_count: int, capacity: int) -> DetailOrder:
        """The order of moving hair: this many slots, filled by the GPU."""
        slots = self._slots.filled_slots(slot_count, capacity)
        drawn = DetailClass(rest_counts.slot_pieces, 0, slot_count)
        counts = rest_counts.strands, rest_counts.pieces
        return DetailOrder(self._factors, None, (drawn,), *counts, slots=slots)

    def _widths_texture(self, snapshot: Snapshot, thinned: Thinning) -> Any:
        """A texture of factors on strands' widths, a texel per strand."""
        made_of = snapshot.rank, thinned, snapshot.strand_count
        kept = self._strand_widths
        if not kept or kept[0] is not made_of[0] or kept[1:3] != made_of[1:]:
            widths = _width_factors(snapshot, thinned)[:, None, None]
            self._strand_widths = (*made_of, texture_from(strand_rows(widths), "R32F"))
        return self._strand_widths[-1]

    def _fit(self, layout: StrandLayout) -> None:
        """Make the textures that the shader writes, or keep the last ones if their sizes fit."""
        sizes = layout.factor_size, strand_rows_size(layout.strand_count, 1)
        kept = self._factors, self._totals
        if None in kept or tuple((each.width, each.height) for each in kept) != sizes:
            self._factors = gpu_objects.texture(sizes[0], format="RGBA32F")
            self._totals = gpu_objects.texture(sizes[1], format="RG32F")


@dataclass(frozen=True, eq=False)
class GroomExtent:
    """The size of a groom, which hardly changes as it moves: computed once for its ranks and
    widths. A scaled instance has other widths.

    rank, widths: the arrays of the groom for which it was computed.
    low, high: (3,) corners of the box of all strands, relative to the mean of the roots [m].
    total_length: of all strands [m]. radius: mean [m].
    """

    rank: Floats
    widths: Floats
    low: Floats
    high: Floats
    total_length: float
    radius: float

    @classmethod
    def of(cls, snapshot: Snapshot) -> GroomExtent:
        assert snapshot.rank is not None
        points, roots = snapshot.points, snapshot.roots.mean(axis=0, dtype=np.float64)
        length = float(segment_lengths(points, snapshot.layout.offsets).sum())
        low, high = points.min(axis=0) - roots, points.max(axis=0) - roots
        radius = float(snapshot.radius.mean())
        return cls(snapshot.rank, snapshot.radius, low, high, length, radius)

    def is_of(self, snapshot: Snapshot) -> bool:
        return self.rank is snapshot.rank and self.widths is snapshot.radius

    def thinning(self, snapshot: Snapshot, view: PictureView) -> Thinning:
        """The thinning of the groom at its current place."""
        settings, roots = snapshot.strand_settings, snapshot.root_center
        return thinning(
            (self.low + roots, self.high + roots),
            self.total_length,
            self.radius * settings.fullness,
            settings.min_width,
            view,
            snapshot.detail,
        )


def _uniform_order(snapshot: Snapshot) -> DetailOrder:
    """The order of all strands in the fixed mode, which needs no pass on the GPU."""
    subdivisions = snapshot.detail.subdivisions
    pieces = (snapshot.layout.cv_count - 1) * subdivisions
    drawn = DetailClass(pieces, 0, snapshot.strand_count)
    counts = snapshot.strand_count, pieces * snapshot.strand_count
    return DetailOrder(None, None, (drawn,), *counts, subdivisions)


def _width_factors(snapshot: Snapshot, thinned: Thinning) -> Floats:
    """Factor on each strand's width, (strand_count,); 0 where it is not drawn."""
    if snapshot.rank is None or thinned == Thinning():
        return np.ones(snapshot.strand_count, np.float32)
    return width_factor(snapshot.rank, thinned.fraction, thinned.widening)


def _ordered(factors: Any, totals: Floats, widths: Floats, by_depth: bool) -> DetailOrder:
    """The order of the strands that have pieces and a width, in classes."""
    pieces = _drawn_pieces(totals, widths)
    drawn, classes = detail_classes(pieces, totals[:, 1] if by_depth else None)
    order = np.zeros((len(drawn), 1, 4), np.float32)
    order[:, 0, 0], order[:, 0, 1], order[:, 0, 2] = drawn, pieces[drawn], widths[drawn]
    texture = texture_from(strand_rows(order), "RGBA32F") if classes else None
    return DetailOrder(factors, texture, classes, len(drawn), int(pieces.sum(dtype=np.int64)))


def _drawn_pieces(totals: Floats, widths: Floats) -> Ints:
    """Pieces of each strand, (strand_count,); 0 where it is not drawn."""
    return np.where(widths > 0.0, totals[:, 0], 0.0).astype(np.int32)


def _hidden_regions(snapshot: Snapshot, view: PictureView, widening: float) -> Floats:
    """The regions that the occluder spheres hide, (k, 12) as in lib_culling.glsl."""
    if snapshot.detail.culling != "hidden" or snapshot.occluder_spheres is None:
        return np.zeros((0, 12), np.float32)
    settings = snapshot.strand_settings
    radius = float(snapshot.radius.max()) * settings.fullness * widening
    half_width = max(settings.minimum_width / 2.0, EDGE) * widening
    spheres = snapshot.occluder_spheres[:HIDDEN_REGION_CAPACITY]
    regions = hidden_regions(spheres, view, half_width, radius)
    packed = np.zeros((len(regions.nearest), 12), np.float32)
    packed[:, 0:3], packed[:, 3] = regions.origin, regions.nearest
    packed[:, 4:7], packed[:, 7] = regions.axis, regions.width
    packed[:, 8] = regions.slope
    return packed


def _view_values(view: PictureView, camera: Camera, snapshot: Snapshot, regions: Floats) -> Floats:
    """`DetailView` in std140, (28 + 12 HIDDEN_REGION_CAPACITY,); GLSL's matrices are stored
    by columns."""
    space = np.zeros(12 * HIDDEN_REGION_CAPACITY)
    space[: regions.size] = regions.ravel()
    fullness = snapshot.strand_settings.fullness * _focal_length(view)
    picture, middle = [*view.half_size, 0.0, fullness], [*snapshot.root_center, len(regions)]
    values: list[Any] = [view.view_projection.T.ravel(), camera.eye, picture, middle, space]
    return np.concatenate(values).astype(np.float32)


def _focal_length(view: PictureView) -> float:
    """Pixels per metre at depth 1, measured as clip w; the geometric mean for pixels that are not
    square."""
    across, upward = np.diag(view.projection)[:2] * view.half_size
    return float(np.sqrt(across * upward))


def _pixels_per_metre(view: PictureView, place: Floats) -> float:
    depth = float(view.view_projection[3] @ [*place, 1.0])
    return _focal_length(view) / max(abs(depth), NEAREST)
