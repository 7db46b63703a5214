"""Where children grow: on the surface near guides, and where the artist wants them."""

from __future__ import annotations

import functools
from dataclasses import dataclass, replace

import numpy as np

from ..arrays import Bools, Floats, Ints
from ..strands import StrandSet, Surface
from ..strands.nearest import nearest_points
from .blue_noise import require_area, spread_roots
from .bound_strands import checked_weights
from .counter_random import key_of
from .dart_throwing import Samples
from .triangle_subdivision import Pieces

#: Maximum distance of a root from its nearest guide where guides surround it, in guide spacings.
_REACH = 1.75
#: The same where guides do not surround it: the hair ends a little outside of its guides.
_MARGIN = 0.4
#: The same where the artist has given a density.
_REACH_WITH_DENSITY = 4.0
#: Number of guides around a root that are examined, and the length of the mean unit vector to them
#: above which they are all on one side; at a straight edge it is 2 / pi.
_AROUND, _ONE_SIDED = 8, 0.6
#: Minimum cosine between the surface's normals at a root and at its nearest guide, so that hair
#: does not spread to the inside of a shell, or to an ear.
_SAME_SIDE = 0.5
#: The spacing of guides is the distance to this neighbour, limited to a multiple of the median.
_NEIGHBOUR, _WIDEST = 3, 4.0
#: Spacing of guides that all start in one place, as a fraction of their length.
_TUFT = 0.25
#: Triangles are split until smaller than this fraction of the reach, up to this many times.
_FINE, _SPLITS = 0.5, 8
#: Triangles that splitting may add.
_MAX_PIECES = 100_000
#: Maximum number of roots that are tried for each one wanted.
_TRIES = 32
#: The number of roots tried first is rounded up to one of this many steps in each doubling.
_STEPS = 4
#: Cells along the extent of all guides, of the lattice in which triangles with hair are found.
_CELLS = 8
#: With less than this fraction of the painted area near guides, the artist gets a warning.
_BARE = 0.95


@dataclass(frozen=True)
class ChildRoots:
    """triangle: (n,). barycentric: (n, 3) float32. point: (n, 3) float32 [m], on the surface.
    key: (n,) uint64, of each child's random numbers.
    notes: what the artist should know.
    """

    triangle: Ints
    barycentric: Floats
    point: Floats
    key: Ints
    notes: tuple[str, ...]

    def take(self, chosen: Ints) -> ChildRoots:
        """The roots with these indices, (k,), without notes."""
        return ChildRoots(
            self.triangle[chosen],
            self.barycentric[chosen],
            self.point[chosen],
            self.key[chosen],
            (),
        )


def child_roots(
    guides: StrandSet, surface: Surface, count: int, density: Floats | None, seed: int
) -> ChildRoots:
    """Roots of children, at most `count`; those of a smaller count come first.

    Without a density they lie between guides, or outside of the outermost ones by up to 0.4 of the
    spacing of guides there; with one they lie within 4 spacings of a guide.

    Raises:
        HairloomError: the surface has no area on which hair may grow, or a density that does not
            fit it or is not finite.
    """
    density = checked_weights(density, surface, "density")
    guided = _Guided.by(guides, surface, is_painted=density is not None)
    where = guided.place, guided.normal, guided.spacing
    return surface.compute_if_changed(_roots_among, *where, density, count, seed)


def _roots_among(
    surface: Surface,
    place: Floats,
    normal: Floats,
    spacing: Floats,
    density: Floats | None,
    count: int,
    seed: int,
) -> ChildRoots:
    """`child_roots` for guides at these places; see `_Guided`."""
    guided = _Guided(place, normal, spacing, density is not None)
    mass = Pieces.of(surface, density).mass
    require_area(mass)
    is_wanted = _where_wanted(surface, density, place)
    pieces, is_near = surface.compute_if_changed(_near_guides, *guided.arguments, is_wanted)
    mass_near = float(pieces.with_density(surface, density).mass[is_near].sum())
    # evenly spread roots that it takes for each one that is kept
    even = _peak(density) * float(pieces.area.sum()) / max(mass_near, 1e-300)
    tried = 1.05 * count * min(_TRIES, even) + 64.0
    # rounded up, so that one dab of a brush mostly needs no other roots
    tried = 2.0 ** (np.ceil(np.log2(tried) * _STEPS) / _STEPS)
    roots = _spread(surface, guided, is_wanted, density, count, int(tried), seed)
    is_bare = density is not None and mass_near < _BARE * float(mass.sum())
    notes = _notes(count, len(roots), is_bare, len(guided.place) == 1)
    return _on_surface(surface, roots, notes)


def _peak(density: Floats | None) -> float:
    return 1.0 if density is None else float(density.max())


def _where_wanted(surface: Surface, density: Floats | None, place: Floats) -> Bools:
    """Triangles (triangle_count,) in those cells of a lattice in which hair grows anywhere.

    By cells, since a brush at the edge of the hair mostly stays within them.
    """
    if density is None:
        return np.ones(len(surface.triangles), bool)
    grows = (density[surface.triangles] > 0.0).any(axis=1)
    size = max(float(np.linalg.norm(np.ptp(place, axis=0))) / _CELLS, 1e-6)
    cell = np.floor(surface.corners.mean(axis=1) / size).astype(np.int64)
    _, number = np.unique(key_of(cell[:, 0], cell[:, 1], cell[:, 2]), return_inverse=True)
    is_wanted: Bools = np.bincount(number, grows)[number] > 0.0
    return is_wanted


@dataclass(frozen=True)
class _Guided:
    """The places of guides, which decide what is among them.

    place: (place_count, 3) float64 [m], where guides are held, each place once.
    normal: (place_count, 3) of the surface there.
    spacing: (place_count,) how far others are from it [m], never 0.
    is_painted: whether a density decides where children grow, and guides only how far away.
    """

    place: Floats
    normal: Floats
    spacing: Floats
    is_painted: bool

    @classmethod
    def by(cls, guides: StrandSet, surface: Surface, *, is_painted: bool) -> _Guided:
        triangle, barycentric = guides.root_triangle, guides.root_barycentric
        assert triangle is not None and barycentric is not None
        root = np.einsum("nk,nkj->nj", barycentric, surface.corners[triangle].astype(np.float64))
        place, first = np.unique(root, axis=0, return_index=True)
        normal = surface.compute_once(Surface.triangle_normals)[triangle[first]]
        if len(place) == 1:
            tuft = _TUFT * float(guides.lengths().mean())
            return cls(place, normal, np.array([max(tuft, 1e-6)]), is_painted)
        _, gap = nearest_points(place, place, _NEIGHBOUR + 1)
        apart = gap[:, -1]
        return cls(place, normal, np.minimum(apart, _WIDEST * np.median(apart)), is_painted)

    @property
    def arguments(self) -> tuple[Floats, Floats, Floats, bool]:
        return self.place, self.normal, self.spacing, self.is_painted

    @property
    def reach(self) -> Floats:
        """How far a root may be from each place if it is the nearest one, (place_count,) [m]."""
        return self.spacing * (_REACH_WITH_DENSITY if self.is_painted else _REACH)

    def holds(self, point: Floats, normal: Floats) -> Bools:
        """Whether children may grow at points (n, 3), on a surface with these normals (n, 3)."""
        near, gap = nearest_points(point, self.place, 1 if self.is_painted else _AROUND)
        is_near: Bools = gap[:, 0] <= self.reach[near[:, 0]]
        if self.is_painted:
            return is_near
        is_near &= (normal * self.normal[near[:, 0]]).sum(axis=1) >= _SAME_SIDE
        middle = np.zeros(point.shape)
        for rank in range(near.shape[1]):
            middle += (self.place[near[:, rank]] - point) / np.maximum(gap[:, rank, None], 1e-12)
        one_sided = np.linalg.norm(middle, axis=1) / near.shape[1]
        is_beside = gap[:, 0] <= _MARGIN * self.spacing[near[:, 0]]
        return is_near & ((one_sided <= _ONE_SIDED) | is_beside)


def _near_guides(
    surface: Surface,
    place: Floats,
    normal: Floats,
    spacing: Floats,
    is_painted: bool,
    is_wanted: Bools,
) -> tuple[Pieces, Bools]:
    """The parts of some triangles that may be near guides, with large triangles split to leave out
    the rest; and whether the middle of each part is near guides.

    Roots that are thrown away cost as much as others, and guides may stand on a small part of a
    large mesh, or of a large triangle.
    """
    guided = _Guided(place, normal, spacing, is_painted)
    pieces = Pieces.of(surface, None).take(is_wanted)
    done, max_pieces = [], len(pieces) + _MAX_PIECES
    pieces = pieces.take(pieces.mass > 0.0)
    for split in range(_SPLITS + 1):
        center = pieces.point.mean(axis=1)
        extent = np.linalg.norm(pieces.point - center[:, None], axis=2).max(axis=1)
        nearest, gap = (part[:, 0] for part in nearest_points(center, guided.place, 1))
        is_possible = gap <= extent + guided.reach.max()
        reach = guided.reach[nearest]
        is_fine = (extent <= _FINE * reach) | (gap + extent <= reach)
        done.append(pieces.take(is_possible & is_fine))
        pieces = pieces.take(is_possible & ~is_fine)
        if split == _SPLITS or 4 * len(pieces) > max_pieces:
            break
        pieces = pieces.split()
    near = functools.reduce(Pieces.concatenated, [*done, pieces])
    return near, guided.holds(near.point.mean(axis=1), near.normal)


def _spread(
    surface: Surface,
    guided: _Guided,
    is_wanted: Bools,
    density: Floats | None,
    count: int,
    tried: int,
    seed: int,
) -> Samples:
    """Roots near guides, at most `count`, on triangles of the surface.

    Every prefix of evenly spread roots is spread evenly. So where hair is to grow half as densely,
    the first half of the roots is enough: roots come in the order of their number divided by the
    density at them. Painting changes no numbers, so roots stay wherever nothing was painted.

    Args:
        is_wanted: (triangle_count,), at least all triangles on which hair grows.
        tried: how many roots to try first; this is doubled while they are not enough.
    """
    max_tried = _TRIES * max(count, 1000)
    while True:
        roots, number = surface.compute_if_changed(
            _even_roots, *guided.arguments, is_wanted, tried, seed
        )
        if density is not None:
            weights = density[surface.triangles[roots.triangle]] / _peak(density)
            of_root = np.einsum("nk,nk->n", roots.barycentric, weights)
            never = np.full(len(roots), np.inf)
            order = np.divide(number + 0.5, of_root, out=never, where=of_root > 0.0)
        else:
            order = number + 0.5
        chosen = np.argsort(order, kind="stable")
        chosen = chosen[order[chosen] < np.inf][:count]
        is_sure = len(chosen) == count and order[chosen].max(initial=0.0) <= tried
        if is_sure or not len(roots) or tried >= max_tried:
            return roots.take(chosen)
        tried = min(max_tried, 2 * tried)


def _even_roots(
    surface: Surface,
    place: Floats,
    normal: Floats,
    spacing: Floats,
    is_painted: bool,
    is_wanted: Bools,
    tried: int,
    seed: int,
) -> tuple[Samples, Ints]:
    """The roots near guides among `tried` roots spread evenly over some triangles of a surface, on
    triangles of the whole surface; and their numbers among those tried, (n,).
    """
    guided = _Guided(place, normal, spacing, is_painted)
    pieces, _ = surface.compute_if_changed(_near_guides, *guided.arguments, is_wanted)
    if not len(pieces):
        return Samples.none(), np.zeros(0, np.int64)
    roots = spread_roots(pieces, tried, seed, Pieces.of(surface, None))
    point = np.einsum("nk,nkj->nj", roots.barycentric, pieces.point[roots.triangle])
    number = np.flatnonzero(guided.holds(point, pieces.normal[roots.triangle]))
    roots = roots.take(number)
    piece = roots.triangle
    inside = np.einsum("nk,nkj->nj", roots.barycentric, pieces.corner[piece])
    return replace(roots, triangle=pieces.parent[piece], barycentric=inside), number


def _on_surface(surface: Surface, roots: Samples, notes: tuple[str, ...]) -> ChildRoots:
    """The roots, placed exactly where `roots.root_frames` will find them."""
    kept = roots.barycentric.astype(np.float32)
    a, b, c = np.moveaxis(surface.corners[roots.triangle].astype(np.float64), 1, 0)
    point = a + kept[:, 1:2] * (b - a) + kept[:, 2:3] * (c - a)
    return ChildRoots(roots.triangle, kept, point.astype(np.float32), roots.key, notes)


def _notes(wanted: int, found: int, is_bare: bool, is_tuft: bool) -> tuple[str, ...]:
    notes = []
    if is_tuft:
        notes.append(
            "All guides start in one place, so children grow only close to it."
            " Draw guides wherever hair is to grow."
        )
    if found < wanted:
        notes.append(
            f"Only {found:,} of {wanted:,} children have room near guides. Draw guides wherever "
            "hair is to grow."
        )
    if is_bare:
        notes.append(
            "Part of the painted area is too far from all guides and stays bare. Draw guides "
            "there, or paint less."
        )
    return tuple(notes)
