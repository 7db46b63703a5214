"""Shells: layers of the skin, one above the other, each of which shows the strands that cross it.

Short hair looks like a surface, but as cards it shows scales and tufts. Shells (Lengyel, Praun,
Finkelstein and Hoppe 2001, "Real-time fur over arbitrary surfaces") are copies of the skin's
triangles, further and further out: along the strands as they are combed, not along the normal. A
layer represents a slab of the hair; its texture, see shell_plan.py, shows the pieces of the groom's
own strands in the slab.

The layers are drawn from the inside to the outside, which is back to front wherever the skin faces
the eye, so that blending needs no sorting (Scheuermann 2004). Every piece of skin with all its
layers counts as a card: it rides on guides, and has a group and tiles.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..arrays import Floats, Ints
from ..errors import HairloomError
from ..strands import StrandSet, Surface
from ..strands.face import is_face_hair
from ..strands.frames import volume_normals
from ..strands.nearest import nearest_points
from ..strands.triangles import area_vectors
from ..strands.vectors import unit
from .atlas_settings import AtlasSettings
from .card_mesh import CardMesh
from .levels import CardLevel
from .settings import CardSettings
from .shell_hair import ShortHair
from .shell_plan import Patches, ShellPlan, plan_shells
from .shell_skin import FineSkin, ShellSkin, coarse_skin, fine_skin
from .strip import mean_spacing

#: Hair is short if it is shorter than this fraction of the side of the square that its roots fill;
#: shells cannot show hair longer than the second fraction.
SHORT, _TOO_LONG = 0.12, 0.4
#: Minimum number of strands for shells.
_MIN_STRANDS = 100
#: Triangles of the finest level if no number is set.
_DEFAULT_TRIANGLES = 12_000
#: Approximate number of triangles of a patch, and minimum strands on it: fewer make no pattern.
_TRIANGLES_PER_PATCH, _MIN_STRANDS_PER_PATCH = 2, 8
#: Minimum cosine between a normal of the hair's volume and that of the layer.
_MIN_FRONT_COSINE = 0.3


@dataclass(frozen=True, eq=False)
class Shells:
    """levels: finest first, triangles from the inside to the outside, with occlusion.
    back_triangles: for each level the triangles for back faces, from the outside to the inside.
        plan: of the atlas."""

    levels: tuple[CardLevel, ...]
    back_triangles: tuple[Ints, ...]
    plan: ShellPlan


def wants_shells(
    settings: CardSettings, strands: StrandSet, head: Surface | None, has_edits: bool
) -> bool:
    """Whether shells are made of this hair.

    Raises:
        HairloomError: the settings want shells, but this hair can have none, or its cards were
            edited.
    """
    if settings.kind == "cards":
        return False
    problem = _problem(strands, head)
    if has_edits and settings.kind == "shells":
        raise HairloomError(
            "its cards were edited, and shells would replace them",
            place=settings.title,
            remedy="Set Kind to Cards or to Automatic, or press Discard Edits",
        )
    if settings.kind == "shells":
        if problem is not None:
            raise HairloomError(
                problem, place=settings.title, remedy="Set Kind to Cards, or to Automatic"
            )
        return True
    is_plain = settings.source == "clusters" and not has_edits
    return (
        is_plain
        and problem is None
        and _median_length(strands) < SHORT * _root_square_side(strands)
    )


def _problem(strands: StrandSet, head: Surface | None) -> str | None:
    """Why this hair can have no shells; None if it can."""
    if head is None or not len(head.triangles):
        return "shells are layers of the skin, and this hair has no surface"
    if is_face_hair(strands.group).any():
        return "brows and lashes cannot be shells, which show hair as layers over skin"
    if strands.strand_count < _MIN_STRANDS:
        count = "1 strand" if strands.strand_count == 1 else f"{strands.strand_count} strands"
        return f"{count} cannot fill shells, which need {_MIN_STRANDS} or more"
    length, side = _median_length(strands), _root_square_side(strands)
    if length > _TOO_LONG * side:
        return (
            f"its hair is {100.0 * length:.3g} cm long and grows on {100.0 * side:.3g} cm of skin; "
            f"shells show hair up to {100.0 * _TOO_LONG * side:.3g} cm there"
        )
    return None


def _median_length(strands: StrandSet) -> float:
    return float(np.median(strands.lengths()))


def _root_square_side(strands: StrandSet) -> float:
    """Side of the square that the roots fill [m]."""
    return _spacing(strands) * strands.strand_count**0.5


def _spacing(strands: StrandSet) -> float:
    """Spacing of as many roots in a square grid [m]: the nearest of random points is half as
    far."""
    return 2.0 * mean_spacing(strands.roots)


def build_shells(
    strands: StrandSet,
    radius: Floats,
    root_normal: Floats,
    head: Surface,
    occlusion: Floats | None,
    settings: CardSettings,
    atlas: AtlasSettings,
) -> Shells:
    """The shells of short hair, in all levels of detail.

    Args:
        strands: uniform. radius: (strand_count, cv_count) [m], as they are drawn.
        root_normal: (strand_count, 3). occlusion: (strand_count, cv_count), or None.

    Raises:
        HairloomError: the atlas or the budget of triangles is too small.
    """
    layers = settings.shell_layers
    hair = ShortHair.of(strands, occlusion, layers)
    budget = settings.max_triangles or _DEFAULT_TRIANGLES
    fine = fine_skin(head, strands.roots, _spacing(strands), budget // layers)
    skins = _skins(fine, head, budget, settings)
    first = _ShellLevel.of(skins[0], hair, strands.strand_count)
    plan = plan_shells(first.patches, strands, radius, root_normal, layers, atlas)
    center = strands.roots.mean(axis=0, dtype=np.float64)
    levels = [first, *(_ShellLevel.of(skin, hair, strands.strand_count) for skin in skins[1:])]
    meshes = [each.mesh(plan, strands, center) for each in levels]
    return Shells(
        tuple(CardLevel(mesh, skin.error) for mesh, skin in zip(meshes, skins, strict=True)),
        tuple(_outside_in(mesh, layers) for mesh in meshes),
        plan,
    )


def _skins(
    fine: FineSkin, head: Surface, budget: int, settings: CardSettings
) -> tuple[ShellSkin, ...]:
    """The skin of each level; each has half the triangles of the one before."""
    skins: list[ShellSkin] = []
    for level in range(settings.levels):
        skin = coarse_skin(fine, head, budget // 2**level // settings.shell_layers)
        if skin is None:
            break
        skins.append(skin)
    if not skins:
        raise HairloomError(
            f"{budget:,} triangles are too few for {settings.shell_layers} layers of this skin",
            place=settings.title,
            remedy="Raise Max Triangles, or lower Shell Layers",
        )
    return tuple(skins)


def _outside_in(mesh: CardMesh, layers: int) -> Ints:
    parts: Ints = mesh.triangles.reshape(layers, -1, 3)[::-1].reshape(-1, 3)
    return parts


@dataclass(frozen=True, eq=False)
class _ShellLevel:
    """A level's skin in patches, and the hair at its vertices.

    vertex, patch: (n,) of each vertex of a layer, in which patches share no vertices.
    triangles: (m, 3) of these. place: (n, 2) in the plane of its patch [m].
    """

    skin: ShellSkin
    hair: ShortHair
    patches: Patches
    vertex: Ints
    patch: Ints
    triangles: Ints
    place: Floats

    @classmethod
    def of(cls, skin: ShellSkin, hair: ShortHair, strand_count: int) -> _ShellLevel:
        hair_at_vertices = hair.average_around(skin.positions)
        count = min(
            len(skin.triangles) // _TRIANGLES_PER_PATCH, strand_count // _MIN_STRANDS_PER_PATCH
        )
        of_triangle = skin.patches(
            max(count, 1), skin.positions + hair_at_vertices.shift[:, 1::2].swapaxes(0, 1)
        )
        key = of_triangle[:, None] * len(skin.positions) + skin.triangles
        keys, index = np.unique(key, return_inverse=True)
        patch, vertex = np.divmod(keys, len(skin.positions))
        patches, place = Patches.of(skin, of_triangle, hair_at_vertices, vertex, patch)
        triangles = np.asarray(index).reshape(-1, 3)
        return cls(skin, hair_at_vertices, patches, vertex, patch, triangles, place)

    def mesh(self, plan: ShellPlan, strands: StrandSet, center: Floats) -> CardMesh:
        """All layers, from the innermost to the outermost."""
        layers, count = plan.layers, len(self.vertex)
        skin, hair, vertex = self.skin.raised_positions, self.hair, self.vertex
        positions = skin[vertex] + hair.shift[vertex][:, 1::2].swapaxes(0, 1)
        outwards = self._outwards(positions)
        step = np.diff(hair.shift[vertex][:, ::2], axis=1).swapaxes(0, 1)
        tangent = unit(step)
        normal = volume_normals(positions, tangent, center)
        is_front = np.einsum("lvi,lvi->lv", normal, outwards) > _MIN_FRONT_COSINE
        normal = np.where(is_front[..., None], normal, outwards)
        half = np.maximum(plan.half_side, self.patches.extent)[self.patch, None]
        across = 0.5 + self.place / (2.0 * half)
        pattern = plan.pattern_of(self.patches)
        tile = pattern * layers
        uv = [
            plan.grid.uv(tile[self.patch] + layer, across[:, 0], across[:, 1])
            for layer in range(layers)
        ]
        starts = np.arange(layers, dtype=np.int32)[:, None, None] * count
        along = np.repeat((np.arange(layers) + 0.5) / layers, count)
        nearest = nearest_points(self.patches.center, strands.roots, 1)[0][:, 0]
        patch_count = len(self.patches.center)
        return CardMesh(
            positions=positions.reshape(-1, 3),
            triangles=(starts + self.triangles).reshape(-1, 3),
            uv=np.concatenate(uv),
            normal=normal.reshape(-1, 3),
            tangent=tangent.reshape(-1, 3),
            occlusion=hair.occlusion[vertex].T.reshape(-1),
            card=np.tile(self.patch[self.triangles[:, 0]], layers),
            along=along,
            group=strands.group[nearest],
            layer=np.zeros(patch_count, np.int32),
            tile=tile,
            atlas=plan.grid,
        )

    def _outwards(self, placed: Floats) -> Floats:
        """Unit normals of the patches of all layers at their vertices `placed`, (layers, n, 3)."""
        across = np.zeros_like(placed)
        for layer, positions in zip(across, placed, strict=True):
            np.add.at(layer, self.triangles, area_vectors(positions[self.triangles])[:, None])
        return unit(across)
