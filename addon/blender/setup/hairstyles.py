"""Hairstyles: finding those that come with Hairloom, and adding one to a head."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cache, partial
from pathlib import Path

import bpy
import numpy as np

from ...arrays import Floats
from ...dynamics.colliders import DistanceField
from ...errors import HairloomError
from ...exchange.hairstyles import GROW_SECTION, Hairstyle, read_hairstyle, read_title
from ...groom.face_hair import grow_face_hair
from ...groom.grow import grow
from ...groom.settings import GrowSettings
from ...groom.widths import with_widths
from ...parameters import ALL_SETTINGS
from ...refine.lead_out_at_rest import are_inside, lead_out_at_rest
from ...shading.settings import ShadingSettings
from ...shading.wet_and_dusty import wet_and_dusty_look
from ...strands import StrandSet, Surface
from ...strands.affine import mean_scale
from ...strands.face import is_face_hair
from ...strands.rooted_shapes import RootedShapes
from ..base.objects import check_curves_editable, check_shape_editable, head_of
from ..base.parts import Part, Parts, new_blocks_removed_on_error
from ..base.vertex_weights import read_weights, set_vertex_group, weight_names
from ..colliders.fields import head_field_of
from ..properties import previews
from ..properties.presets import apply, named_preset
from ..properties.properties import settings_of
from ..scene.bust import bust_object, encoded_skin_picture
from ..scene.bust_data import load_bust
from ..scene.curves import read_curves, write_curves
from ..scene.hair_material import set_look_material
from ..scene.hair_nodes import add_hair_nodes
from ..scene.surfaces import read_surface
from ..strands.growing import replace_curves
from .foreign_heads import (
    fit_built_in_head,
    move_landmarks,
    original_positions,
    put_landmarks,
    read_foreign_head,
)
from .starting import REAL_SIZE_FACTOR, fit_motion, fitting_factor, scaled_settings

HAIRSTYLE_FOLDER = Path(__file__).resolve().parents[3] / "hairstyles"
_HEAD = "Head"
#: fraction of guides left out beyond which there is a warning
_NOTED_LOST_FRACTION = 0.02
#: depth to which modifiers may bring hair into a head [m on the built-in head]
_MAX_DEPTH = 0.0008


@dataclass(frozen=True)
class HairstyleEntry:
    """One hairstyle in a menu. name: the name that `named_hairstyle` takes."""

    name: str
    title: str
    path: Path

    @property
    def icon(self) -> int:
        """See `previews.icon_of`."""
        return previews.icon_of(self.path)


@cache
def shipped_hairstyles() -> tuple[HairstyleEntry, ...]:
    """The hairstyles that come with Hairloom, in their order."""
    found = []
    for path in HAIRSTYLE_FOLDER.glob("*.json"):
        order, title = read_title(path)
        found.append((order, HairstyleEntry(path.stem, title, path)))
    return tuple(entry for _, entry in sorted(found, key=lambda one: (one[0], one[1].name)))


def files_of_hairstyle(name: str) -> tuple[Path, Path]:
    """The files of a hairstyle that ships: its description, and its guides; fur has none."""
    path = HAIRSTYLE_FOLDER / f"{name}.json"
    return path, path.with_suffix(".npz")


def named_hairstyle(name: str) -> Hairstyle:
    """A hairstyle by its name, such as bob, or by the path of its file.

    Raises:
        HairloomError: there is no such hairstyle, or it is damaged.
    """
    by_name = {entry.name: entry.path for entry in shipped_hairstyles()}
    path = by_name.get(name) or Path(name)
    if not path.is_file():
        known = ", ".join(by_name)
        raise HairloomError(
            "there is no such hairstyle", place=name, remedy=f"Use a file or one of {known}"
        )
    return replace(read_hairstyle(path, ALL_SETTINGS), name=name)


def is_bust(mesh: bpy.types.Object) -> bool:
    """Whether a mesh object is the built-in head, which may have been posed or shaped since."""
    bust = load_bust()
    return bool(
        mesh.type == "MESH"
        and len(mesh.data.vertices) == len(bust.positions)
        and len(mesh.data.polygons) == len(bust.sizes)
        and mesh.data.uv_layers.active is not None
    )


def add_head(collection: bpy.types.Collection, skin: str) -> Parts[bpy.types.Object]:
    """The built-in head.

    Args:
        skin: one of bust_skin.TONES.
    """
    yield Part("Painting the skin", partial(encoded_skin_picture, skin))  # fills its cache
    head = bust_object(_HEAD, skin)
    collection.objects.link(head)
    return head


@dataclass(frozen=True)
class _Growth:
    """A hairstyle on a mesh, before anything of it is in the scene.

    size: of the hair, relative to its size in the hairstyle.
    factor: the size for its motion, which is 1 for heads of about human size.
    groups: weights of vertices, by name of a vertex group that the mesh lacks.
    landmarks: positions, guessed or placed, by name.
    solid: of a head other than the built-in one; modifiers must not bring hair into it.
    """

    strands: StrandSet
    size: float
    factor: float
    warnings: tuple[str, ...] = ()
    groups: Mapping[str, Floats] = field(default_factory=dict)
    landmarks: Mapping[str, Floats] = field(default_factory=dict)
    solid: DistanceField | None = None


@dataclass(frozen=True)
class AddedHair:
    """New hair. done: what else was added to the scene, a sentence each."""

    hair: bpy.types.Object
    done: tuple[str, ...]
    warnings: tuple[str, ...]


def add_hairstyle(
    style: Hairstyle,
    head: bpy.types.Object,
    depsgraph: bpy.types.Depsgraph,
    collection: bpy.types.Collection,
    *,
    hairline: str = "",
) -> Parts[AddedHair]:
    """Hair curves in this hairstyle on a head, or fur on any mesh, with its modifiers and settings.

    A head that is neither the built-in one nor MakeHuman's gets landmarks. A head without the
    vertex group for the density of the hairstyle's children gets that.

    Args:
        hairline: a vertex group or attribute of the head instead of the hairstyle's own.

    Raises:
        HairloomError: the hairstyle does not fit the mesh; a mask, preset or node group is missing,
            or a mask is empty; or the head lacks the vertex group and is linked. Nothing is added
            then, nor if it is cancelled.
    """
    masks = {**style.masks, **({"children": hairline} if hairline and style.masks else {})}
    _check_masks(style, head, depsgraph, masks.values(), needed=hairline)
    growth = yield from _growth_steps(style, head, depsgraph, masks)
    if growth.groups:
        check_shape_editable(head)
    with new_blocks_removed_on_error() as note:
        hair = write_curves(
            f"{head.name} {style.title}",
            growth.strands,
            head,
            collection,
            are_widths_estimated=True,
        )
        note()
        for one in style.modifiers:
            add_hair_nodes(hair, one.nodes, one.inputs, growth.size)
        for name in style.presets:
            for settings in named_preset(name).all:
                apply(settings, hair)
        _put_settings(style, hair)
        fit_motion(hair, growth.factor)
        warnings = (*growth.warnings, *_remove_curves_inside(hair, growth))
    hair.hairloom.children_density = masks.get("children", "")
    hair.hairloom.hairstyle = style.name
    set_look_material(
        hair.data, wet_and_dusty_look(settings_of(hair.data.hairloom.shading, ShadingSettings))
    )
    done = _add_groups_and_landmarks(growth, head, collection)
    return AddedHair(hair, done, warnings)


def _add_groups_and_landmarks(
    growth: _Growth, head: bpy.types.Object, collection: bpy.types.Collection
) -> tuple[str, ...]:
    """Give a head the vertex groups and landmarks that it lacks; returns what was done."""
    done = []
    for name, weights in growth.groups.items():
        set_vertex_group(head, name, weights)
        done.append(f"{head.name} has a vertex group '{name}' now: paint it to move the hairline")
    move_landmarks(head, growth.landmarks)
    if growth.landmarks and put_landmarks(head, growth.landmarks, collection):
        done.append(
            f"{head.name} has landmarks now: drag those that are not at their places, and press "
            "Fit Again"
        )
    return tuple(done)


def fit_again(
    grooms: Sequence[bpy.types.Object], depsgraph: bpy.types.Depsgraph
) -> Parts[tuple[str, ...]]:
    """Fit hairstyles again to the present landmarks and shapes of their heads; modifiers and
    settings stay. Returns warnings.

    Raises:
        HairloomError: some hair was not added as a hairstyle, has no head, does not fit its head,
            or is linked from another file. Nothing is changed then, nor if it is cancelled.
    """
    grown = []
    for hair in grooms:
        grown.append((yield from _growth_again_steps(hair, depsgraph)))
    warnings: list[str] = []
    for hair, growth in zip(grooms, grown, strict=True):
        replace_curves(hair, growth.strands, depsgraph)
        warnings += (*growth.warnings, *_remove_curves_inside(hair, growth))
        head = head_of(hair)
        assert head is not None, "it has grown on it"
        move_landmarks(head, growth.landmarks)
    return tuple(warnings)


def _growth_again_steps(hair: bpy.types.Object, depsgraph: bpy.types.Depsgraph) -> Parts[_Growth]:
    check_curves_editable(hair, depsgraph)
    head = head_of(hair)
    if not hair.hairloom.hairstyle or head is None:
        raise HairloomError(
            "it was not added as a hairstyle",
            place=hair.name,
            remedy="Add a hairstyle to the head (Add Hairstyle)",
        )
    style = named_hairstyle(hair.hairloom.hairstyle)
    mask = hair.hairloom.children_density
    masks = {**style.masks, **({"children": mask} if mask else {})}
    _check_masks(style, head, depsgraph, masks.values(), needed="")
    return (yield from _growth_steps(style, head, depsgraph, masks))


def _check_masks(
    style: Hairstyle,
    head: bpy.types.Object,
    depsgraph: bpy.types.Depsgraph,
    names: Iterable[str],
    needed: str,
) -> None:
    """Check the masks of a hairstyle on a head.

    Raises:
        HairloomError: a mask is empty, or is missing and cannot be made.
    """
    made = () if is_bust(head) else set(style.masks.values()) - {needed}
    for name in names:
        if name in made and name not in weight_names(head):
            continue
        if not (read_weights(head, depsgraph, name) > 0.0).any():
            raise HairloomError(
                f"the weights '{name}' are zero everywhere, so no hair would grow",
                place=head.name,
                remedy="Paint where hair is to grow, delete the group to have it made, or add a "
                "new built-in head",
            )


def _growth_steps(
    style: Hairstyle,
    head: bpy.types.Object,
    depsgraph: bpy.types.Depsgraph,
    masks: Mapping[str, str],
) -> Parts[_Growth]:
    """The hairstyle on a mesh: reads the mesh, then works on arrays alone."""
    if style.guides is None:
        title, work = f"Growing {style.title}", _fur(style, head, depsgraph)
    elif is_bust(head):
        title, work = f"Placing {style.title}", _on_bust(style.guides, head, depsgraph, masks)
    else:
        title = f"Fitting {style.title}"
        work = _on_foreign(style.guides, head, depsgraph, masks)

    def with_found_widths() -> _Growth:
        growth = work()
        return replace(growth, strands=with_widths(growth.strands, "found")[0])

    return (yield Part(title, with_found_widths))


def _fur(
    style: Hairstyle, head: bpy.types.Object, depsgraph: bpy.types.Depsgraph
) -> Callable[[], _Growth]:
    factor = fitting_factor(head, depsgraph)
    settings = scaled_settings(
        GrowSettings.from_dict(style.settings[GROW_SECTION], style.title), factor
    )
    surface = read_surface(head, depsgraph, need_uv=False, place=head.name)
    return lambda: _Growth(
        _led_out(grow(surface, settings), head_field_of(surface)), factor, factor
    )


def _on_bust(
    guides: RootedShapes,
    head: bpy.types.Object,
    depsgraph: bpy.types.Depsgraph,
    masks: Mapping[str, str],
) -> Callable[[], _Growth]:
    surface = read_surface(head, depsgraph, need_uv=True, place=head.name)
    size, name, mask = _size_of(head), head.name, masks.get("children", "")
    weights = read_weights(head, depsgraph, mask) if mask else None

    def work() -> _Growth:
        strands = guides.on(surface, size)
        if weights is not None:
            strands = _with_weighted_roots(strands, weights, surface, name, mask)
        return _Growth(strands, size, 1.0)

    return work


def _on_foreign(
    guides: RootedShapes,
    head: bpy.types.Object,
    depsgraph: bpy.types.Depsgraph,
    masks: Mapping[str, str],
) -> Callable[[], _Growth]:
    """Work that puts guides on a head other than the built-in one."""
    read, name = read_foreign_head(head, depsgraph), head.name
    mask = masks.get("children", "")
    weights = read_weights(head, depsgraph, mask) if mask in weight_names(head) else None
    positions = original_positions(head, depsgraph) if mask and weights is None else None

    def work() -> _Growth:
        foreign = fit_built_in_head(read)
        strands, warnings = foreign.hair(guides)
        groups = {}
        if weights is not None:
            strands = _with_weighted_roots(strands, weights, foreign.surface, name, mask)
        if positions is not None:
            groups[mask] = foreign.weights(mask, positions)
        solid = head_field_of(foreign.surface)
        strands = _led_out(strands, solid)
        lost = len(guides.group) - strands.strand_count
        if lost > _NOTED_LOST_FRACTION * len(guides.group):
            warnings.append(
                f"{name}: {lost:,} of {len(guides.group):,} guides were left out, since they have "
                "no place on the mesh or its vertex group"
            )
        size = foreign.scale
        factor = size if not 1.0 / REAL_SIZE_FACTOR <= size <= REAL_SIZE_FACTOR else 1.0
        landmarks = foreign.landmarks
        return _Growth(strands, size, factor, tuple(warnings), groups, landmarks, solid)

    return work


def _with_weighted_roots(
    strands: StrandSet, weights: Floats, surface: Surface, place: str, mask: str
) -> StrandSet:
    """The strands whose roots have a weight above 0.

    Raises:
        HairloomError: there are none.
    """
    triangle, barycentric = strands.root_triangle, strands.root_barycentric
    assert triangle is not None and barycentric is not None
    at = np.einsum("sk,sk->s", barycentric, weights[surface.triangles[triangle]])
    kept = np.flatnonzero(at > 0.0)
    if not len(kept):
        raise HairloomError(
            f"the weights '{mask}' are zero wherever this hair grows",
            place=place,
            remedy="Paint them where hair is to grow, or choose another group as the hairline",
        )
    return strands.take(kept)


def _remove_curves_inside(hair: bpy.types.Object, growth: _Growth) -> tuple[str, ...]:
    """Remove curves that modifiers, such as curls, bring into the head; returns warnings."""
    if growth.solid is None or not hair.modifiers:
        return ()
    bpy.context.view_layer.update()
    made = read_curves(hair, bpy.context.evaluated_depsgraph_get())
    if made.dropped or made.strands.strand_count != len(hair.data.curves):
        return (
            f"{hair.name}: its modifiers change the number of curves, so curves that they push "
            "into the head could not be left out. Turn those modifiers off and press Fit Again",
        )
    inside = np.flatnonzero(are_inside(made.strands, growth.solid, _MAX_DEPTH * growth.size))
    if 0 < len(inside) < made.strands.strand_count:
        hair.data.remove_curves(indices=inside.tolist())
    return ()


def _led_out(strands: StrandSet, solid: DistanceField | None) -> StrandSet:
    """Strands led out of the mesh that they grow on; those that stay inside, such as fur on inner
    parts, are dropped."""
    if solid is None:
        return strands
    led, is_out = lead_out_at_rest(strands, solid, float(np.median(strands.lengths())))
    return led.take(np.flatnonzero(is_out)) if is_out.any() else strands


def grows_anywhere(style: Hairstyle) -> bool:
    """Whether it is fur, which grows on any mesh."""
    return style.guides is None


def is_face_hairstyle(style: Hairstyle) -> bool:
    """Whether it is brows or lashes."""
    return style.guides is not None and bool(is_face_hair(style.guides.group).all())


def add_face_hair(
    head: bpy.types.Object,
    depsgraph: bpy.types.Depsgraph,
    collection: bpy.types.Collection,
    like: bpy.types.Object,
) -> Parts[bpy.types.Object]:
    """Brows and lashes on the built-in head, in the look of its hair.

    Raises:
        HairloomError: its groups for them are empty or gone.
    """
    surface = read_surface(head, depsgraph, need_uv=True, place=head.name)
    strands = yield from face_hair(head, surface, depsgraph)
    name = f"{head.name} Brows and Lashes"
    hair = write_curves(name, strands, head, collection, are_widths_estimated=True)
    group = like.data.hairloom.shading
    apply(settings_of(group, group.settings), hair)
    hair.data.hairloom.children.method = "none"
    return hair


def face_hair(
    head: bpy.types.Object, surface: Surface, depsgraph: bpy.types.Depsgraph
) -> Parts[StrandSet]:
    """Brows and lashes of the built-in head, by its vertex groups.

    Raises:
        HairloomError: the groups are empty or gone.
    """
    brows, lashes = (read_weights(head, depsgraph, name) for name in ("brows", "lashes"))

    def work() -> StrandSet:
        return with_widths(grow_face_hair(surface, brows, lashes), "found")[0]

    return (yield Part("Growing brows", work))


def _size_of(head: bpy.types.Object) -> float:
    """The mean scale of the head's object."""
    return mean_scale(np.array(head.matrix_world))


def _put_settings(style: Hairstyle, hair: bpy.types.Object) -> None:
    """Apply the hairstyle's own settings on top of its presets and the defaults."""
    for section in set(style.settings) - {GROW_SECTION}:
        kind, values = ALL_SETTINGS[section], style.settings[section]
        owners = hair.data.hairloom, hair.hairloom
        owner = next((one for one in owners if hasattr(one, section)), None)
        own = {} if owner is None else settings_of(getattr(owner, section), kind).as_dict()
        apply(kind.from_dict({**own, **values}, style.title), hair)
