"""From a groom to its cards in all levels of detail: strips, tiles, occlusion, order."""

from __future__ import annotations

from collections.abc import Callable, Generator, Sequence
from dataclasses import dataclass, field, replace
from typing import cast

import numpy as np

from ..arrays import Floats, Ints, piece_starts
from ..strands import StrandSet, Surface
from ..strands.face import is_face_hair
from .applied_edits import AppliedEdits, apply_edits
from .atlas import AtlasPlan, plan_atlas
from .atlas_grid import AtlasGrid
from .atlas_settings import AtlasSettings
from .card_mesh import CardMesh
from .clusters import cluster_of_guides, is_at_rim
from .edits import CardEdits, CardRecord, EditCounts
from .fit import cluster_of_strands, fit_strips, root_slopes
from .layers import card_layers
from .levels import card_levels
from .occlusion import CardOccluder, occlusion_steps
from .occlusion_settings import CardOcclusionSettings
from .order_check import wrong_fraction
from .settings import CardSettings
from .shell_plan import ShellPlan
from .shells import build_shells, wants_shells
from .short_hair import fitted_to_length
from .skin_clearance import lift_roots, raise_between_rows
from .sort import VIEW_COUNT, CardOrders, SortBy, card_of_vertex, order_steps, with_triangle_order
from .steps import NamedSteps, Step, named
from .strand_shading import shading_from_strands
from .strip import Strips, UncutCards, guide_strips, random_tiles, strip_mesh

#: Number of views from which coarser levels are sorted.
_COARSER_VIEWS = 16
#: Number of views in which the order is checked.
_CHECKED_VIEWS = 8
#: Fraction of wrong pixels above which there is a note: fewer are hard to see.
_MIN_NOTED_WRONG = 0.1
#: Each card represents about this many strands; there are at most this many cards.
_STRANDS_PER_CARD, _MAX_CARDS = 12, 600


@dataclass(frozen=True)
class CardGroom:
    """The hair that cards are made from.

    strands: uniform, at least one.
    strand_numbers: (strand_count,) of each strand in the groom, on which its colour depends.
    guide_indices: (guide_count,) which strands are guides.
    radius: (strand_count, cv_count) [m], as strands are drawn.
    root_normal: (strand_count, 3) unit normals of the head under the roots.
    head: in the space of the strands, or None.
    occlusion: (strand_count, cv_count) ambient occlusion of the strands, which their cards take
        over; None: rays find that of the cards.
    light: (strand_count, cv_count, k) of the strands, see `strand_shading.shading_from_strands`, or
        None.
    """

    strands: StrandSet
    strand_numbers: Ints
    guide_indices: Ints
    radius: Floats
    root_normal: Floats
    head: Surface | None
    occlusion: Floats | None = None
    light: Floats | None = None


@dataclass(frozen=True)
class CardBuild:
    """Cards of a groom, ready to be drawn and written.

    levels: finest first; all show the same atlas, and a card has the same number in each. Triangles
        are in the order in which front faces are drawn.
    back_triangles: the triangles of each level once more, in the order in which back faces are
        drawn.
    errors: of each level [m], see `levels.CardLevel`: its distance from the cards at full
        resolution.
    plan: what is baked into the atlas; None: its tiles are procedural.
    shell_layers: number of layers of shells; 0: these are cards.
    wrong_fraction: fraction of the finest level's pixels that are drawn in a wrong order, see
        `order_check.wrong_fraction`.
    order_notes: remedies where that is much.
    shape_notes: where cards differ from the settings.
    light, depth: of each vertex of the finest level, see `strand_shading.StrandShading`; None where
        those of the strands are unknown.
    record: the record of the cards, world space; None for shells.
    edits: how many cards are as the artist left them; edit_notes: doubts about these.
    """

    levels: tuple[CardMesh, ...]
    back_triangles: tuple[Ints, ...]
    errors: tuple[float, ...]
    plan: AtlasPlan | ShellPlan | None
    shell_layers: int = 0
    wrong_fraction: float = 0.0
    order_notes: tuple[str, ...] = ()
    shape_notes: tuple[str, ...] = ()
    light: Floats | None = None
    depth: Floats | None = None
    record: CardRecord | None = None
    edits: EditCounts = field(default_factory=EditCounts)
    edit_notes: tuple[str, ...] = ()

    @property
    def finest(self) -> CardMesh:
        return self.levels[0]

    @property
    def notes(self) -> tuple[str, ...]:
        """All notes for the artist."""
        of_atlas = () if self.plan is None else self.plan.notes
        return (*self.shape_notes, *self.edit_notes, *of_atlas, *self.order_notes)


#: Returns the alpha of the atlas, (height, width), or None for opaque cards; may bake it from the
#: plan of this build, whose cards have no occlusion and order yet.
type MakeAlpha = Callable[[CardBuild], Floats | None]


def card_steps(
    groom: CardGroom,
    settings: CardSettings,
    atlas: AtlasSettings,
    occlusion: CardOcclusionSettings,
    make_alpha: MakeAlpha,
    other_occluders: Sequence[CardOccluder] = (),
    edits: CardEdits | None = None,
) -> NamedSteps[CardBuild]:
    """Build the cards; each step yields what is being made, and the result is returned.

    Args:
        other_occluders: cards of other grooms, which occlude these, world space.
        edits: the artist's changes of earlier cards, which are kept.

    Raises:
        HairloomError: the atlas is too small for its tiles, or there is nothing to bake into it.
    """
    if wants_shells(settings, groom.strands, groom.head, bool(edits)):
        return (
            yield from _shell_steps(groom, settings, atlas, occlusion, make_alpha, other_occluders)
        )
    yield Step("Cards from strands")
    settings, atlas, shape_notes = fitted_to_length(settings, atlas, groom.strands)
    card = card_of_strand(groom, settings)
    cards, plan = uncut_cards(groom, settings, atlas, card)
    median_width = float(np.median(cards.strips.width[:, 0])) if len(cards) else 0.0
    applied = apply_edits(edits, cards, settings, groom.head, plan is not None) if edits else None
    record = CardRecord.of(cards.strips, cards.tile, cards.atlas, groom.head)
    if applied is not None:
        cards, record = applied.cards, applied.record
    yield Step("Levels of detail")
    error = None
    if settings.source == "clusters":
        error = settings.error * float(np.median(groom.strands.lengths()))
    kept = None if applied is None else applied.kept_triangles
    levels = card_levels(cards, settings, error, kept)
    record = record.with_joined_cards(levels[0].represented_by)
    meshes, errors = zip(*((level.mesh, level.error) for level in levels), strict=True)
    meshes = tuple(lift_roots(mesh, groom.head, median_width) for mesh in meshes)
    meshes = tuple(raise_between_rows(mesh, groom.head, median_width) for mesh in meshes)
    if applied is not None:
        meshes = (applied.with_kept_mesh(meshes[0]), *meshes[1:])
    unsorted = tuple(mesh.triangles for mesh in meshes)
    build = CardBuild(meshes, unsorted, errors, plan, shape_notes=shape_notes, record=record)
    if applied is not None:
        build = replace(build, edits=applied.counts, edit_notes=applied.notes)
    yield Step("Atlas")
    alpha = make_alpha(build)
    shading = _occlusion_steps(groom, card, build, alpha, other_occluders, occlusion, applied)
    build = yield from named("Ambient occlusion", shading)
    finest = build.finest
    shaded = (finest, *(with_nearest_occlusion(finest, level) for level in build.levels[1:]))
    orders = yield from _orders(shaded, groom.head, settings, alpha)
    yield Step("Check of the order")
    first = orders[0]
    wrong = wrong_fraction(
        finest,
        groom.head,
        front=first.front,
        back=first.back,
        alpha=alpha,
        view_count=_CHECKED_VIEWS,
    )
    pairs = list(zip(shaded, orders, strict=True))
    return replace(
        build,
        levels=tuple(with_triangle_order(mesh, each.front) for mesh, each in pairs),
        back_triangles=tuple(mesh.triangles[each.back] for mesh, each in pairs),
        wrong_fraction=wrong,
        order_notes=_order_notes(wrong, settings),
    )


def _shell_steps(
    groom: CardGroom,
    settings: CardSettings,
    atlas: AtlasSettings,
    occlusion: CardOcclusionSettings,
    make_alpha: MakeAlpha,
    other_occluders: Sequence[CardOccluder],
) -> NamedSteps[CardBuild]:
    """The same for shells, whose order is known."""
    yield Step("Shells from strands")
    assert groom.head is not None
    made = build_shells(
        groom.strands,
        groom.radius,
        groom.root_normal,
        groom.head,
        groom.occlusion,
        settings,
        atlas,
    )
    meshes = []
    for level in made.levels:
        own = 1.0 - occlusion.strength * (1.0 - level.mesh.occlusion)
        meshes.append(level.mesh.with_occlusion(own.astype(np.float32)))
    errors = tuple(level.error for level in made.levels)
    build = CardBuild(tuple(meshes), made.back_triangles, errors, made.plan, settings.shell_layers)
    yield Step("Atlas")
    alpha = make_alpha(build)
    if other_occluders:
        for number, mesh in enumerate(meshes):
            rays = occlusion_steps(mesh, other_occluders, [], occlusion)
            shade = yield from named("Ambient occlusion", rays)
            meshes[number] = mesh.with_occlusion(mesh.occlusion * shade)
    yield Step("Check of the order")
    finest = meshes[0]
    wrong = wrong_fraction(
        finest,
        groom.head,
        front=np.arange(len(finest.triangles)),
        back=np.arange(len(finest.triangles)).reshape(settings.shell_layers, -1)[::-1].ravel(),
        alpha=alpha,
        view_count=_CHECKED_VIEWS,
    )
    return replace(build, levels=tuple(meshes), wrong_fraction=wrong)


def _order_notes(wrong: float, settings: CardSettings) -> tuple[str, ...]:
    if wrong <= _MIN_NOTED_WRONG:
        return ()
    remedy = (
        "Give hair that hangs away from the head a group of its own, or let your engine sort cards "
        "for each view"
        if settings.order_by == "pieces"
        else "Set Order By to Pieces"
    )
    return (f"{wrong:.0%} of the hair's pixels blend in the wrong order: {remedy}",)


def _occlusion_steps(
    groom: CardGroom,
    card: Ints,
    build: CardBuild,
    alpha: Floats | None,
    other_occluders: Sequence[CardOccluder],
    occlusion: CardOcclusionSettings,
    applied: AppliedEdits | None,
) -> Generator[float, None, CardBuild]:
    """The build with the light that its finest level takes over from the strands, and their
    occlusion times that by other grooms, which rays find.

    Args:
        card: see `card_of_strand`.
    """
    mesh = build.finest
    if not len(mesh.triangles):  # all cards were deleted
        return build
    if groom.occlusion is None:
        bodies = [] if groom.head is None else [groom.head]
        own = [CardOccluder(mesh, alpha), *other_occluders]
        found = yield from occlusion_steps(mesh, own, bodies, occlusion)
        return _with_finest(build, mesh.with_occlusion(found))
    # the artist's own cards use the strands of the nearest made card
    on_strands = mesh if applied is None else replace(mesh, card=applied.model_card[mesh.card])
    of_strands = shading_from_strands(
        on_strands, groom.strands.grid, groom.occlusion, groom.light, card
    )
    shown: Floats = (1.0 - occlusion.strength * (1.0 - of_strands.occlusion)).astype(np.float32)
    if other_occluders:
        shown = shown * (yield from occlusion_steps(mesh, other_occluders, [], occlusion))
    build = replace(build, light=of_strands.light, depth=of_strands.depth)
    return _with_finest(build, mesh.with_occlusion(shown))


def _with_finest(build: CardBuild, mesh: CardMesh) -> CardBuild:
    return replace(build, levels=(mesh, *build.levels[1:]))


def card_of_strand(groom: CardGroom, settings: CardSettings) -> Ints:
    """The card that represents each strand, (strand_count,). Second cards of crossed pairs follow
    after all others, in the same order."""
    grid, group = groom.strands.grid, groom.strands.group
    if settings.source == "guides":
        return cluster_of_guides(grid, group, groom.guide_indices)
    return cluster_of_strands(grid, group, settings, groom.root_normal)


def _orders(
    levels: Sequence[CardMesh], head: Surface | None, settings: CardSettings, alpha: Floats | None
) -> NamedSteps[list[CardOrders]]:
    """The orders of each level; coarser ones are sorted from fewer views."""
    sort_by = cast("SortBy", settings.order_by)
    orders = []
    for number, mesh in enumerate(levels):
        view_count = _COARSER_VIEWS if number else VIEW_COUNT
        steps = order_steps(mesh, head, sort_by, view_count=view_count, alpha=alpha)
        name = f"Order of level {number}" if len(levels) > 1 else "Order"
        orders.append((yield from named(name, steps)))
    return orders


def uncut_cards(
    groom: CardGroom, settings: CardSettings, atlas: AtlasSettings, cluster: Ints
) -> tuple[UncutCards, AtlasPlan | None]:
    """The strips of all cards, with their groups, layers and tiles; and the plan of the atlas, if
    baked.

    Args:
        cluster: see `card_of_strand`.
    """
    strands, guides, is_baked = groom.strands, groom.guide_indices, atlas.source == "baked"
    grid, radius = strands.grid, strands.radius.reshape(strands.grid.shape[:2])
    _, found, count = np.unique(cluster, return_index=True, return_counts=True)
    first: Ints = found
    if settings.source == "guides":
        first = guides
        is_baked &= len(grid) > len(guides)  # guides alone represent bundles without strands
        count = count if is_baked else np.ones_like(count)
        rows = replace(settings, segment_count=grid.shape[1] - 1) if is_baked else settings
        strips = guide_strips(grid[guides], groom.root_normal[guides], rows)
    else:
        strips = fit_strips(grid, radius, cluster, groom.root_normal, settings)
    # second cards of crossed pairs follow after all others, and represent the same strands
    owner = np.resize(np.arange(len(first)), len(strips))
    cards = _with_random_tiles(strips, count[owner], strands.group[first][owner], settings)
    cards = _with_outward_normals(cards, groom)
    uncrossed = strips.select(np.arange(len(first)))
    slope = root_slopes(uncrossed.frames, grid, cluster)
    # root edges of second cards are square
    cards = replace(cards, root_slope=np.pad(slope, (0, len(strips) - len(first))))
    if not is_baked:
        return cards, None
    rim = is_at_rim(grid, groom.root_normal, len(grid) / len(first))
    plan = plan_atlas(
        uncrossed,
        grid,
        groom.radius,
        cluster,
        strands.group,
        atlas,
        strands.color_grid,
        root_slope=slope,
        is_rim=np.bincount(cluster, rim) > 0.5 * np.bincount(cluster),
    )
    strips = _with_width_factor(cards.strips, plan.width_factor[owner])
    return replace(cards, strips=strips, tile=plan.tile[owner], atlas=plan.grid), plan


def _with_outward_normals(cards: UncutCards, groom: CardGroom) -> UncutCards:
    """The cards with normals away from the middle of all roots, as strands have."""
    return replace(cards, center=groom.strands.roots.mean(axis=0, dtype=np.float64))


def _with_random_tiles(
    strips: Strips, strand_count: Ints, group: Ints, settings: CardSettings
) -> UncutCards:
    """Cards with random tiles."""
    layer = card_layers(strips, settings.layers)
    # single strands lie outermost, as artists place them
    is_loose = (strand_count == 1) & (strand_count.max() > 1)
    # and so do brows and lashes
    is_outermost = is_loose | is_face_hair(group)
    layer = np.where(is_outermost, settings.layers - 1, layer).astype(np.int32)
    atlas = AtlasGrid(columns=settings.atlas_columns)
    tile = random_tiles(len(strips), atlas, settings.seed)
    strips = _with_width_factor(strips, _base_widths(layer, settings))
    return UncutCards(strips, strand_count.astype(np.int32), group, layer, tile, atlas)


def _base_widths(layer: Ints, settings: CardSettings) -> Floats:
    """`base_width` for the lowest layer, 1 for the outermost, steps between, (card_count,)."""
    depth = 1.0 - layer / max(settings.layers - 1, 1)
    return 1.0 + (settings.base_width - 1.0) * depth * (settings.layers > 1)


def _with_width_factor(strips: Strips, factor: Floats) -> Strips:
    return replace(strips, width=(strips.width * factor[:, None]).astype(np.float32))


def with_nearest_occlusion(finest: CardMesh, level: CardMesh) -> CardMesh:
    """A coarser level, with each vertex's occlusion from the vertex of its card that is nearest in
    the atlas."""
    owner = card_of_vertex(finest)
    vertices = np.argsort(owner, kind="stable")
    count = np.bincount(owner, minlength=len(finest.group))
    start = piece_starts(count)
    owner_in_level = card_of_vertex(level)
    step = np.arange(int(count.max(initial=0)))
    candidate = vertices[
        start[owner_in_level, None] + np.minimum(step, count[owner_in_level, None] - 1)
    ]
    # along and across count equally, whatever the shape of a tile
    tiles = np.array([finest.atlas.columns, finest.atlas.rows])
    gap = (finest.uv[candidate] - level.uv[:, None]) * tiles
    nearest = np.einsum("vci,vci->vc", gap, gap).argmin(axis=1)
    return level.with_occlusion(
        finest.occlusion[candidate[np.arange(len(owner_in_level)), nearest]]
    )


def strand_occluder(groom: CardGroom) -> CardOccluder:
    """Strands as cards that only occlude others, for grooms without cards.

    The cards follow clusters of strands, each row as dense as the strands in it.

    Strands block light from everywhere with pi / 4 of their area, cards with half of theirs times
    tau (Cauchy, see shading/volume/card_opacity.py). So a row that is w wide and holds strands of
    radius r has tau = pi / 2 sum 2 r / w. Nothing is baked, sorted or shaded: it takes a second
    where cards take a minute. A row of texels is a row of all cards, a column of texels one card.
    """
    strands, radius = groom.strands, groom.radius
    count = min(max(strands.strand_count // _STRANDS_PER_CARD, 1), _MAX_CARDS)
    settings = CardSettings(source="clusters", card_count=count, fly_aways=0.0)
    cluster = cluster_of_strands(strands.grid, strands.group, settings)
    strips = fit_strips(strands.grid, radius, cluster, groom.root_normal, settings)
    covered = np.zeros(strips.width.shape)
    np.add.at(covered, cluster, 2.0 * radius)
    tau = 0.5 * np.pi * covered / np.maximum(strips.width, 1.0e-9)
    numbers = np.arange(len(strips), dtype=np.int32)
    same = np.zeros_like(numbers)
    cards = UncutCards(strips, same, same, same, numbers, AtlasGrid(columns=len(strips)))
    mesh = strip_mesh([(numbers, strips)], cards, 1, settings)
    return CardOccluder(mesh, (1.0 - np.exp(-tau)).T.astype(np.float32))
