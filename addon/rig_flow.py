"""The flow from a groom to its rig: roots, children, guides, weights, and all that each strand
needs to be drawn."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Protocol

import numpy as np

from .arrays import Bools, Floats, Ints, are_same
from .dynamics.colliders import DistanceField, PosedCollider
from .dynamics.held import HeldCvs
from .dynamics.neighbours import hair_length_of_guides
from .errors import HairloomError
from .groom.automatic_children import automatic_settings, is_too_sparse
from .groom.children import (
    CHILD_POINTS,
    FEWEST_CHILD_POINTS,
    Children,
    Growth,
    make_children,
)
from .groom.children_settings import ChildrenSettings
from .groom.counter_random import key_of, uniform
from .groom.guides import choose_guides, split_by_kind
from .groom.holds import Holds
from .groom.masks import Masks
from .groom.partings import Partings
from .groom.roots import RootFrames, RootHolds, bind_roots, root_frames
from .groom.settings import GuideSettings
from .groom.size_notes import length_text
from .groom.ties import NO_HOLDERS, Holders, find_holds, unused_holder_notes
from .groom.weights import GuideWeights, guide_weights
from .groom.widths import Widths, with_widths
from .refine.lead_out_at_rest import lead_out_at_rest
from .refine.ride import Riders
from .refine.thinning import even_ranks
from .shading.strand_noise import SEED_LIMIT
from .strands import StrandSet, Surface
from .strands.arc_length import typical_length
from .strands.center_lines import center_lines, curl_slack
from .strands.face import is_face_hair
from .strands.join import join_strands
from .strands.needed_points import MAX_LENGTH_LOSS, MAX_POINTS, with_all_points, with_needed_points
from .strands.resample import resample
from .strands.result_cache import NO_CACHE, ResultCache
from .strands.vectors import unit_or

#: A note is given if more than this fraction of children cannot be led out of the head.
NOTED_FRACTION_INSIDE = 0.01


@dataclass(frozen=True, eq=False)
class MotionStart:
    """The start of a motion, from which clearances between hair and colliders are computed.

    pose: of the body. colliders: as they stood. max_clearance: how far hair stays from them at
        most [m].
    """

    pose: Pose
    colliders: tuple[PosedCollider, ...]
    max_clearance: float

    def is_same_as(self, other: MotionStart) -> bool:
        """Whether both give the same clearances."""
        return (
            self.max_clearance == other.max_clearance
            and self.pose.is_same_as(other.pose)
            and len(self.colliders) == len(other.colliders)
            and all(map(PosedCollider.is_same_at_end, self.colliders, other.colliders))
        )


class Solids(Protocol):
    """The colliders that hair stays out of at one moment of a motion."""

    @property
    def motion_start(self) -> MotionStart: ...

    @property
    def colliders(self) -> tuple[PosedCollider, ...]:
        """As they stand at their frame's end."""


@dataclass(frozen=True, eq=False)
class SimulatedSolids:
    """The solids of a simulated motion; implements `Solids`."""

    motion_start: MotionStart
    colliders: tuple[PosedCollider, ...]


@dataclass(frozen=True)
class Pose:
    """Where the body is at one moment.

    head_positions: (vertex_count, 3) [m], world space, or None for hair without a head.
    matrix: (4, 4), moves rest world space to now; carries hair without a head, and colliders.
    anchors: of held hair, see `groom.holds.anchors_of`; None: no hair is held.
    solids: what cards are led out of; None: nothing, or not known.
    """

    head_positions: Floats | None
    matrix: Floats
    anchors: Floats | None = None
    solids: Solids | None = None

    def is_same_as(self, other: Pose) -> bool:
        """Whether hair is carried to the same places, bit for bit."""
        if not are_same(self.anchors, other.anchors):
            return False
        if self.head_positions is None or other.head_positions is None:
            return np.array_equal(self.matrix, other.matrix)
        return np.array_equal(self.head_positions, other.head_positions)


@dataclass(frozen=True, eq=False)
class GrownChildren:
    """How the children of a rig have grown, so that those of combed curves can be shaped again.

    parents: which of the artist's own strands they grew between. shapes: of these strands,
        resampled to one point count.
    rig_children: which of the grown children are in the rig.
    """

    growth: Growth
    parents: Ints
    shapes: StrandSet
    rig_children: Ints


@dataclass(frozen=True)
class Rig:
    """A groom made ready to move: all strands, their guides and weights.

    strands: each with the points it needs, world space at rest; bound when there is a head.
    guides: (guide_count,) indices of the strands that are simulated.
    guide_grid: (guide_count, cv_count, 3) [m], evenly spaced CVs of the guides' centre lines, which
        are simulated.
    rest_frames: of all strands, or None without a head.
    notes: what the artist should know, each with its remedy.
    own_count: how many strands, the first ones, are the artist's own; children follow in the order
        in which they are grown. None: all.
    widths: how wide the strands are, and why.
    children_line: for the artist, whether automatic children were added, and why; may be empty.
    suggested_children_method: of `ChildrenSettings`, which this line suggests; may be empty.
    holds: where strands are held by ties or by a surface; None: nowhere.
    grown_children: how they have grown; None without any, and in a rig that comes from a bake.
    baked_baby_hair: the strands that are baby hair, in a rig that comes from a bake.
    """

    strands: StrandSet
    head: Surface | None
    guides: Ints
    guide_grid: Floats
    weights: GuideWeights
    rest_frames: RootFrames | None
    notes: tuple[str, ...] = ()
    own_count: int | None = None
    widths: Widths = field(default_factory=Widths)
    children_line: str = ""
    holds: Holds | None = None
    grown_children: GrownChildren | None = None
    baked_baby_hair: Ints = field(default_factory=lambda: np.zeros(0, np.int32))
    suggested_children_method: str = ""

    @property
    def baby_hair(self) -> Ints:
        """Indices of the strands that are short, fine hair of the hairline and of partings."""
        if self.grown_children is None or self.own_count is None:
            return self.baked_baby_hair
        return self.own_count + np.flatnonzero(
            self.grown_children.growth.is_baby[self.grown_children.rig_children]
        )

    @property
    def guides_line(self) -> str:
        """Which curves are simulated and which follow, for an artist."""
        own, guides = self.strands.strand_count - self.child_count, len(self.guides)
        points = f"with {self.guide_grid.shape[1]} points each"
        if guides == own:
            line = f"All {own:,} curves are simulated, {points}"
        else:
            line = f"{guides:,} of {own:,} curves are simulated, {points}; the others follow"
        if not self.child_count:
            return line
        return f"{line}. {self.child_count:,} children follow, too"

    @cached_property
    def guide_holds(self) -> Holds | None:
        """`holds` of the guides alone, by guide index, along their centre lines."""
        if self.holds is None:
            return None
        own, cv_count = self.holds.for_strands(self.guides), self.guide_grid.shape[1]
        return own.on_lines(self.strands.take(self.guides), cv_count)

    @cached_property
    def held_face(self) -> HeldCvs | None:
        """All CVs of brows and lashes, which are too short to swing; None if there is no other hair
        or none of these."""
        is_face = is_face_hair(self.strands.group)
        chosen = is_face[self.guides] & ~is_face.all()
        if not chosen.any():
            return None
        return HeldCvs(np.repeat(chosen[:, None], self.guide_grid.shape[1], axis=1))

    @cached_property
    def curl_slack(self) -> Floats | None:
        """How far curls of guides can be stretched, see `center_lines.curl_slack`."""
        return curl_slack(self.strands.take(self.guides).lengths(), self.guide_grid)

    @cached_property
    def strands_per_guide(self) -> Floats:
        """How many strands each guide represents, (guide_count,): the sum of its weights."""
        guide, weight = self.weights.guide.ravel(), self.weights.weight.ravel()
        return np.bincount(guide, weight, len(self.guides))

    @cached_property
    def hair_of_guides(self) -> Floats:
        """See `dynamics.neighbours.hair_length_of_guides`."""
        return hair_length_of_guides(self.guide_grid, self.strands_per_guide)

    @cached_property
    def rest_sphere(self) -> tuple[Floats, float]:
        """The middle (3,) of the guides' roots at rest, and how far guides reach from it [m]."""
        middle = self.guide_grid[:, 0].mean(axis=0, dtype=np.float64)
        away = np.linalg.norm(self.guide_grid[:, 0] - middle, axis=1)
        lengths = np.linalg.norm(np.diff(self.guide_grid, axis=1), axis=2).sum(axis=1)
        return middle, float((away + lengths).max())

    @property
    def child_count(self) -> int:
        own = self.own_count
        return 0 if own is None else self.strands.strand_count - own

    @cached_property
    def root_holds(self) -> RootHolds | None:
        """The vertices of the head that hold roots; None without a head."""
        return None if self.head is None else RootHolds.of(self.strands, self.head)

    @property
    def root_vertices(self) -> Ints:
        """The head's vertices that hold roots, ascending; none without a head."""
        return np.zeros(0, np.int32) if self.root_holds is None else self.root_holds.vertices

    @cached_property
    def riders(self) -> Riders:
        return Riders.of(self.strands, self.guide_grid, self.weights, self.curl_slack)

    @cached_property
    def radius(self) -> float:
        """Half of the diagonal of the box around all strands at rest [m]."""
        low, high = self.strands.bounds()
        return float(np.linalg.norm(high - low)) / 2.0

    @cached_property
    def rest_lengths(self) -> Floats:
        """The lengths of all strands, (strand_count,) [m]."""
        return self.strands.lengths()

    @property
    def rest_pose(self) -> Pose:
        return Pose(None if self.head is None else self.head.positions, np.eye(4))


@dataclass(frozen=True, eq=False)
class ChildPlacement:
    """What decides, apart from their settings, where children grow; at rest.

    density: (vertex_count,) how densely they grow on the head; None: wherever guides are near.
    masks: painted factors of their settings.
    partings: (n, 2, 3) [m] the straight pieces of lines on the head; None: no line.
    head_field: called if there are children; the field that they are led out of, or None.
    """

    density: Floats | None = None
    masks: Masks = field(default_factory=Masks)
    partings: Floats | None = None
    head_field: Callable[[], DistanceField | None] = lambda: None


DEFAULT_PLACEMENT = ChildPlacement()


def prepare(
    strands: StrandSet,
    head: Surface | None,
    settings: GuideSettings,
    *,
    place: str,
    children: ChildrenSettings | None = None,
    placement: ChildPlacement = DEFAULT_PLACEMENT,
    widths: str = "own",
    holders: Holders = NO_HOLDERS,
    cache: ResultCache = NO_CACHE,
    is_animated: bool = False,
) -> Rig:
    """Bind strands to the head, choose the guides, weigh them for every strand, find all widths,
    and what is held.

    Args:
        strands: world space at rest.
        head: world space at rest, or None for hair that only follows its object.
        place: names the groom in error messages.
        children: None: there are none.
        placement: its partings part the artist's own strands, too.
        widths: one of `groom.widths.METHODS`.
        holders: ties and a surface of tips, at rest.
        cache: intermediate results of the last rig, reused where strands have not changed, as when
            an artist combs or paints; it changes no result, only the time.
        is_animated: whether the strands will change shape, so that all keep their own points.

    Raises:
        HairloomError: no strands, or a groom of another scale than the head.
    """
    if not strands.strand_count:
        raise HairloomError(
            "it has no strands that can be used", place=place, remedy="Choose hair that has strands"
        )
    bound, root_distance = strands, 0.0
    if head is not None:
        held = bind_roots(strands, head, place=place)
        bound, root_distance = held.strands, held.looseness(head)
    if is_animated:
        own = with_all_points(bound, settings.cv_count)
    else:
        own = with_needed_points(bound, settings.cv_count)
    lines = center_lines(bound, settings.cv_count)
    reach = settings.tip_distance * _hair_length(own) if holders else 0.0
    holds = find_holds(own, holders, reach)
    kind = None if holds is None else holds.kinds(own.strand_count)
    guides = choose_guides(lines, settings, kind)
    guide_lines = lines.take(guides)
    parted = None
    if placement.partings is not None and len(placement.partings) and head is not None:
        parted = Partings.of(placement.partings, head)
    guide_kind = None if kind is None else kind[guides]
    weights = _weights(lines, guide_lines, kind, guide_kind, parted)
    notes = (*_loose_root_notes(root_distance), *_lost_length_notes(bound, own))
    rig = Rig(own, head, guides, guide_lines.grid, weights, _rest_frames(own, head), notes)
    growing = _ChildContext(placement, parted, cache, is_animated)
    if children is not None and children.method == "auto":
        rig = _with_automatic_children(rig, children, growing, widths, place)
    else:
        if children is not None and children.method != "none":
            rig = _with_children(rig, children, growing, place)
        strands, found = with_widths(
            rig.strands, widths, number=_grown_numbers(rig), fineness=_fineness(rig), cache=cache
        )
        rig = replace(rig, strands=strands, widths=found)
    if holds is None:
        return rig
    if rig.child_count:
        holds = find_holds(rig.strands, holders, reach)
    assert holds is not None
    return replace(rig, holds=holds, notes=(*rig.notes, *unused_holder_notes(holds, holders)))


def _loose_root_notes(distance: float) -> tuple[str, ...]:
    """A note on roots that lie `distance` [m] from the surface; none where that is 0."""
    if not distance:
        return ()
    return (
        f"its roots lie {length_text(distance)} from the surface (median), so they float beside "
        "it. Check unit, up axis and place of both, or press Snap to Surface.",
    )


@dataclass(frozen=True)
class _ChildContext:
    """What children depend on beside the artist's strands, see `prepare`."""

    ground: ChildPlacement
    partings: Partings | None
    cache: ResultCache
    is_animated: bool


def _grown_numbers(rig: Rig) -> Ints | None:
    """The rig's strands, numbered as if no child were left out; None: none is."""
    if rig.grown_children is None or rig.own_count is None:
        return None
    return np.concatenate(
        [np.arange(rig.own_count), rig.own_count + rig.grown_children.rig_children]
    )


def _fineness(rig: Rig) -> Floats | None:
    """The width of each strand over that of the hair around it, (strand_count,); None: all 1."""
    if rig.grown_children is None or rig.own_count is None:
        return None
    return np.append(
        np.ones(rig.own_count), rig.grown_children.growth.fineness[rig.grown_children.rig_children]
    )


def _lost_length_notes(strands: StrandSet, own: StrandSet) -> tuple[str, ...]:
    """A note on strands that need more points than they may have."""
    kept = own.lengths() / np.maximum(strands.lengths(), np.float32(1.0e-30))
    lost = 1.0 - kept[kept < 1.0 - MAX_LENGTH_LOSS]
    if not len(lost):
        return ()
    note = (
        f"{len(lost):,} strands need more than {MAX_POINTS} points. They are limited to that "
        f"number, and lose up to {100.0 * float(lost.max()):.1f} % of their length. Use fewer "
        "turns."
    )
    return (note,)


def _hair_length(strands: StrandSet) -> float:
    return typical_length(strands.lengths())


def _with_automatic_children(
    rig: Rig,
    settings: ChildrenSettings,
    growing: _ChildContext,
    widths: str,
    place: str,
) -> Rig:
    """The rig with as many children as it takes to cover the body.

    Each is as wide as the strands around it, all of which then represent fewer hairs.
    """
    hair = rig.strands.take(_parents(rig.strands))
    settings, parts = automatic_settings(hair, settings)
    count, line, suggested = hair.strand_count, "", ""
    if is_too_sparse(hair):
        suggested = "multi"
        line = (
            f"Children: none, since {count:,} curves may be guides or a part of the hair. Set "
            "Method to Between Guides to fill the space between them"
        )
    elif parts > 1.0 and rig.head is None:
        parts, line = 1.0, "Children: none, since the hair has no surface to grow them on"
    own, found = with_widths(rig.strands, widths, parts, cache=growing.cache)
    rig = replace(rig, strands=own, widths=found)
    if parts > 1.0:
        with_children = _with_children(rig, settings, growing, place)
        rig, suggested = replace(with_children, widths=found), "none"
        line = (
            f"Children: {rig.child_count:,} added, since {count:,} curves are too few for full "
            "hair. Set Method to None to see only the curves"
        )
    return replace(rig, children_line=line, suggested_children_method=suggested)


def _weights(
    strands: StrandSet,
    guides: StrandSet,
    kind: Ints | None = None,
    guide_kind: Ints | None = None,
    partings: Partings | None = None,
) -> GuideWeights:
    """Guide weights; held strands follow guides of the same kind, see `Holds.kinds`."""
    group, guide_group = strands.group, guides.group
    if kind is not None and guide_kind is not None:
        both = split_by_kind(np.append(group, guide_group), np.append(kind, guide_kind))
        group, guide_group = both[: len(kind)], both[len(kind) :]
    return guide_weights(
        strands.roots,
        group,
        guides.roots,
        guide_group,
        strand_grid=strands.grid,
        guide_grid=guides.grid,
        partings=partings,
    )


def _with_children(
    rig: Rig,
    settings: ChildrenSettings,
    growing: _ChildContext,
    place: str,
) -> Rig:
    """The artist's own strands, and children grown between them."""
    own, head, cache = rig.strands, rig.head, growing.cache
    ground = growing.ground
    if head is None:
        note = (
            "Children need a surface to grow from, so there are none. Give the hair a surface, or "
            "set Children to None."
        )
        return replace(rig, notes=(*rig.notes, note))
    parents, cv_count = _parents(own), rig.guide_grid.shape[1]
    shapes, notes = _parent_shapes(own.take(parents), settings.strand_count)
    made = make_children(
        shapes,
        head,
        settings,
        ground.density,
        growing.partings,
        ground.masks.for_strands(parents),
        place=place,
        cache=cache,
    )
    made, chosen = _led_out_of_head(made, ground.head_field(), _hair_length(shapes), cache)
    if growing.is_animated:
        children = with_all_points(made.strands, cv_count)
    else:
        children = with_needed_points(made.strands, cv_count, cache=cache)
    strands = join_strands(own, children)
    if len(rig.guides) < own.strand_count:
        # their shapes come from neighbours among all strands, their motion from guides alone
        lines = center_lines(own.take(rig.guides), cv_count)
        weights = _weights(
            _child_center_lines(made.strands, cv_count, cache), lines, partings=growing.partings
        )
    else:
        weights = replace(made.weights, guide=parents[made.weights.guide])
    return Rig(
        strands,
        head,
        rig.guides,
        rig.guide_grid,
        GuideWeights(
            np.concatenate([rig.weights.guide, weights.guide]),
            np.concatenate([rig.weights.weight, weights.weight]),
        ),
        _rest_frames(strands, head),
        (*rig.notes, *made.notes, *notes),
        own_count=own.strand_count,
        grown_children=GrownChildren(made.growth, parents, shapes, chosen),
    )


def _child_center_lines(children: StrandSet, cv_count: int, cache: ResultCache) -> StrandSet:
    """The centre lines of children, which have one point count; widths are dummies."""

    def of(some: Ints) -> tuple[Floats]:
        return (center_lines(children.take(some), cv_count).grid,)

    (grid,) = cache.rows("lines", (cv_count,), (children.grid,), of)
    return StrandSet(
        grid.reshape(-1, 3),
        np.arange(len(grid) + 1) * cv_count,
        np.ones(len(grid) * cv_count),
        children.group,
    )


def _led_out_of_head(
    made: Children, head: DistanceField | None, length: float, cache: ResultCache
) -> tuple[Children, Ints]:
    """Children led out of the head, without those that cannot be, and their indices among all.

    Args:
        length: the hair's [m].
    """
    if head is None:
        return made, np.arange(made.strands.strand_count)

    def led_out(some: Ints) -> tuple[Floats, Bools]:
        led, is_out = lead_out_at_rest(made.strands.take(some), head, length)
        return led.grid, is_out

    grid, is_out = cache.rows("led out", (head, length), (made.strands.grid,), led_out)
    led = made.strands.with_points(grid.reshape(-1, 3))
    chosen, lost = np.flatnonzero(is_out), int((~is_out).sum())
    notes = made.notes
    if lost > NOTED_FRACTION_INSIDE * len(is_out):
        notes += (
            f"{lost:,} of {len(is_out):,} children would lie in the surface, so they are left "
            "out. Comb the curves around them farther out.",
        )
    weights = GuideWeights(made.weights.guide[chosen], made.weights.weight[chosen])
    return Children(led.take(chosen), weights, notes, made.growth), chosen


def _parent_shapes(parents: StrandSet, child_count: int) -> tuple[StrandSet, tuple[str, ...]]:
    """Parents resampled to one point count, from which children can be mixed, and notes.

    The count is the largest of any parent, unless children of that many points exceed memory.
    """
    needed = int(parents.point_counts.max(initial=2))
    count = min(needed, max(CHILD_POINTS // max(child_count, 1), FEWEST_CHILD_POINTS))
    if count >= needed:
        return resample(parents, needed), ()
    shapes = resample(parents, count)
    kept = shapes.lengths().sum(dtype=np.float64) / parents.lengths().sum(dtype=np.float64)
    note = (
        f"{child_count:,} children with {needed} points do not fit into memory, so they have "
        f"{count} points, and {100.0 * (1.0 - kept):.1f} % of the length of curls is lost. Use "
        "fewer children."
    )
    return shapes, (note,)


def _parents(own: StrandSet) -> Ints:
    """The strands that children grow between: all but brows and lashes, unless these are all."""
    is_face = is_face_hair(own.group)
    return np.flatnonzero(~is_face | is_face.all()).astype(np.int32)


def _rest_frames(strands: StrandSet, head: Surface | None) -> RootFrames | None:
    if head is None:
        return None
    assert strands.root_triangle is not None and strands.root_barycentric is not None
    return root_frames(
        head.positions, head.triangles, strands.root_triangle, strands.root_barycentric
    )


def strand_ranks(rig: Rig) -> Floats:
    """The rank of each strand in an even order, (strand_count,), 0 to 1: the strands below any rank
    are the same hair, only sparser.

    The artist's own strands and the children are ranked separately, so that both keep their
    fractions. Children grow in such an order, which gives their ranks: one more child hardly
    changes those of the others.
    """
    count = rig.strands.strand_count
    own = count - rig.child_count
    ranks = np.empty(count, np.float32)
    ranks[:own] = even_ranks(rig.strands.roots[:own])
    ranks[own:] = np.arange(rig.child_count) / max(rig.child_count, 1)
    return ranks


def strand_seeds(rig: Rig) -> Ints:
    """The noise seed of each strand, (strand_count,), whole numbers below 2^24.

    A child's seed is a hash of the place of its root, so that it keeps its colour when others come
    or go. A strand of the artist has the seed that it was made with, or else its number.
    """
    strands = rig.strands
    seeds = np.arange(strands.strand_count)
    if strands.seed is not None:
        seeds = np.where(strands.seed == 0, seeds, strands.seed)
    own = strands.strand_count - rig.child_count
    if rig.child_count:
        assert strands.root_triangle is not None and strands.root_barycentric is not None
        place = strands.root_barycentric[own:].view(np.uint32)
        key = key_of(strands.root_triangle[own:], place[:, 0], place[:, 1])
        seeds[own:] = uniform(key, 0) * SEED_LIMIT
    return seeds % SEED_LIMIT


def root_normals(rig: Rig) -> Floats:
    """The surface's normal under each root, (strand_count, 3); without a head, outwards."""
    if rig.rest_frames is not None:
        return np.ascontiguousarray(rig.rest_frames.rotation[:, :, 2])
    outward = rig.strands.roots - rig.strands.points.mean(axis=0)
    return unit_or(outward, (0.0, 0.0, 1.0), 1.0e-12).astype(np.float32)
