"""Hairstyles: those that come with Hairloom, and how one is added to a head."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from pathlib import Path

import bpy
import numpy as np

from ...errors import HairloomError
from ...exchange.hairstyles import GROWN, Hairstyle, read_hairstyle, read_title
from ...groom.face_hair import grow_face_hair
from ...groom.grow import grow
from ...groom.settings import GrowSettings
from ...parameters import ALL_SETTINGS
from ...refine.lead_out_at_rest import led_out_at_rest
from ...shading.settings import ShadingSettings
from ...strands import StrandSet, Surface
from ...strands.affine import mean_scale
from ...strands.face import is_face_hair
from ..base.vertex_weights import read_weights
from ..colliders.fields import solid_of
from ..properties import previews
from ..properties.presets import apply, named_preset
from ..properties.properties import settings_of
from ..scene.bust import bust_object
from ..scene.bust_data import load_bust
from ..scene.curves import write_curves
from ..scene.hair_material import put_look_material
from ..scene.hair_nodes import add_hair_nodes
from ..scene.surfaces import read_surface
from .starting import fit_motion, fitted, fitting_factor

HAIRSTYLE_FOLDER = Path(__file__).resolve().parents[3] / "hairstyles"
_HEAD = "Head"


@dataclass(frozen=True)
class Entry:
    """One style in a menu. name: as `named_hairstyle` knows it."""

    name: str
    title: str
    path: Path

    @property
    def icon(self) -> int:
        """See `previews.icon_of`."""
        return previews.icon_of(self.path)


@cache
def shipped() -> tuple[Entry, ...]:
    """The styles that come with Hairloom, in their order."""
    found = []
    for path in HAIRSTYLE_FOLDER.glob("*.json"):
        order, title = read_title(path)
        found.append((order, Entry(path.stem, title, path)))
    return tuple(entry for _, entry in sorted(found, key=lambda one: (one[0], one[1].name)))


def files_of_hairstyle(name: str) -> tuple[Path, Path]:
    """Where a style that ships says what it is, and where its guides are; fur has none."""
    path = HAIRSTYLE_FOLDER / f"{name}.json"
    return path, path.with_suffix(".npz")


def named_hairstyle(name: str) -> Hairstyle:
    """A style by its name, such as bob, or by the path of its file.

    Raises:
        HairloomError: there is no such style, or it is damaged.
    """
    by_name = {entry.name: entry.path for entry in shipped()}
    path = by_name.get(name) or Path(name)
    if not path.is_file():
        known = ", ".join(by_name)
        raise HairloomError(
            "there is no such hairstyle", place=name, remedy=f"Use a file or one of {known}"
        )
    return read_hairstyle(path, ALL_SETTINGS)


def is_bust(mesh: bpy.types.Object) -> bool:
    """Whether a mesh object is the built-in head, which may have been posed or shaped since."""
    bust = load_bust()
    return bool(
        mesh.type == "MESH"
        and len(mesh.data.vertices) == len(bust.positions)
        and len(mesh.data.polygons) == len(bust.sizes)
        and mesh.data.uv_layers.active is not None
    )


def add_head(collection: bpy.types.Collection, skin: str) -> bpy.types.Object:
    """The built-in head.

    Args:
        skin: one of bust_skin.TONES.
    """
    head = bust_object(_HEAD, skin)
    collection.objects.link(head)
    return head


def add_hairstyle(
    style: Hairstyle,
    head: bpy.types.Object,
    depsgraph: bpy.types.Depsgraph,
    collection: bpy.types.Collection,
) -> bpy.types.Object:
    """Hair curves in this style on the built-in head, or fur on any mesh, with its modifiers and
    settings.

    Raises:
        HairloomError: a mesh that it does not grow on, a mask that it has not or that is empty, a
            preset or node group that is not there. Nothing is added then.
    """
    if not (grows_anywhere(style) or is_bust(head)):
        raise HairloomError(
            "this is not the built-in head",
            place=head.name,
            remedy="Select a built-in head, or nothing to add one; fur and Add Hair take others",
        )
    for name in style.masks.values():
        if not (read_weights(head, depsgraph, name) > 0.0).any():
            raise HairloomError(
                f"the weights '{name}' are zero everywhere, so no hair would grow",
                place=head.name,
                remedy="Paint where hair is to grow, or add a new built-in head",
            )
    strands, factor = _strands(style, head, depsgraph)
    hair = write_curves(f"{head.name} {style.title}", strands, head, collection)
    try:
        for one in style.modifiers:
            add_hair_nodes(hair, one.nodes, one.inputs)
        for name in style.presets:
            for settings in named_preset(name).all:
                apply(settings, hair)
        _put_settings(style, hair)
        fit_motion(hair, factor)
    except HairloomError:
        curves = hair.data
        bpy.data.objects.remove(hair)
        bpy.data.hair_curves.remove(curves)
        raise
    hair.hairloom.children_density = style.masks.get("children", "")
    put_look_material(hair.data, settings_of(hair.data.hairloom.shading, ShadingSettings))
    return hair


def _strands(
    style: Hairstyle, head: bpy.types.Object, depsgraph: bpy.types.Depsgraph
) -> tuple[StrandSet, float]:
    """The style's curves on this mesh, and how much larger than a head's fur is there."""
    if style.guides is None:
        factor = fitting_factor(head, depsgraph)
        settings = fitted(GrowSettings.from_dict(style.settings[GROWN], style.title), factor)
        surface = read_surface(head, depsgraph, need_uv=False, place=head.name)
        return _outside(grow(surface, settings), surface), factor
    surface = read_surface(head, depsgraph, need_uv=True, place=head.name)
    return style.guides.on(surface, _size_of(head)), 1.0


def _outside(fur: StrandSet, surface: Surface) -> StrandSet:
    """Fur led out of the mesh that it grows on, without what grows on parts within it."""
    solid = solid_of(surface)
    if solid is None:
        return fur
    led, is_out = led_out_at_rest(fur, solid, float(np.median(fur.lengths())))
    return led.take(np.flatnonzero(is_out)) if is_out.any() else fur


def grows_anywhere(style: Hairstyle) -> bool:
    """Whether it is fur."""
    return style.guides is None


def is_of_face(style: Hairstyle) -> bool:
    """Whether it is brows or lashes."""
    return style.guides is not None and bool(is_face_hair(style.guides.group).all())


def add_face_hair(
    head: bpy.types.Object,
    depsgraph: bpy.types.Depsgraph,
    collection: bpy.types.Collection,
    like: bpy.types.Object,
) -> bpy.types.Object:
    """Brows and lashes on the built-in head, in the look of its hair.

    Raises:
        HairloomError: its groups for them are empty or gone.
    """
    surface = read_surface(head, depsgraph, need_uv=True, place=head.name)
    strands = face_hair(head, surface, depsgraph)
    hair = write_curves(f"{head.name} Brows and Lashes", strands, head, collection)
    group = like.data.hairloom.shading
    apply(settings_of(group, group.settings), hair)
    hair.data.hairloom.children.method = "none"
    return hair


def face_hair(
    head: bpy.types.Object, surface: Surface, depsgraph: bpy.types.Depsgraph
) -> StrandSet:
    """Brows and lashes of the built-in head, where its own vertex groups say.

    Raises:
        HairloomError: these are empty or gone.
    """
    brows, lashes = (read_weights(head, depsgraph, name) for name in ("brows", "lashes"))
    return grow_face_hair(surface, brows, lashes)


def _size_of(head: bpy.types.Object) -> float:
    """How much larger than by its own measures the head stands in the scene."""
    return mean_scale(np.array(head.matrix_world))


def _put_settings(style: Hairstyle, hair: bpy.types.Object) -> None:
    """The style's own values, over those of its presets and the defaults."""
    for section in set(style.settings) - {GROWN}:
        kind, values = ALL_SETTINGS[section], style.settings[section]
        owners = hair.data.hairloom, hair.hairloom
        owner = next((one for one in owners if hasattr(one, section)), None)
        own = {} if owner is None else settings_of(getattr(owner, section), kind).as_dict()
        apply(kind.from_dict({**own, **values}, style.title), hair)
