"""Reading a groom from the scene: its curves, and the mesh that they grow from."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any

import bpy

from ...arrays import Floats, Ints
from ...errors import HairloomError
from ...groom.children_settings import ChildrenSettings
from ...groom.masks import Mask, Masks
from ...groom.painted_color import PaintedColor
from ...groom.rest_hair import DEFORMED, RestHair
from ...groom.root_fit import LOOSE_DISTANCE
from ...groom.ties import NO_HOLDERS, Holders
from ...strands import StrandSet, Surface
from ...strands.clean import Cleaned
from ...strands.colors import color_notes
from ..base.objects import head_of
from ..properties.properties import settings_of
from .curves import read_curves
from .masks import MaskReader
from .painted_colors import read_colors
from .partings import read_partings
from .surfaces import read_rest_surfaces, read_surface

#: node group of the modifier that Blender 5.2 gives to new hair
_HAIR_DYNAMICS = "Hair Dynamics"
#: Its input for the mode, and the mode in which it only puts hair onto its deformed surface.
_MODE_INPUT, _ATTACH_ONLY = "Mode", "Animation"


@dataclass(frozen=True)
class Source:
    """Hair and head as Blender evaluates them, in world space.

    dropped: reason -> number of curves that cannot be used.
    curve_indices: (strand_count,) of the curves that became strands.
    density: (vertex_count,) how densely children grow on the head, or None.
    masks: of the settings of children.
    head_warning, density_warning: a warning with its remedy, or empty.
    mask_warnings: warnings, each with its remedy.
    colors: colours painted under the hair, or None.
    color_warnings: about these, and about strands without a colour.
    holders: what holds the hair beside its roots, at rest.
    partings: the straight pieces of its partings, (n, 2, 3) [m] world space; None: there are none.
    parting_warnings: about objects that cannot be partings.
    rest: the hair as it is stored, if it had to be moved onto the posed head; else None.
    """

    strands: StrandSet
    dropped: dict[str, int]
    curve_indices: Ints
    head: Surface | None
    density: Floats | None = None
    masks: Masks = field(default_factory=Masks)
    head_warning: str = ""
    density_warning: str = ""
    mask_warnings: tuple[str, ...] = ()
    colors: PaintedColor | None = None
    color_warnings: tuple[str, ...] = ()
    holders: Holders = NO_HOLDERS
    partings: Floats | None = None
    parting_warnings: tuple[str, ...] = ()
    rest: RestHair | None = None

    @property
    def at_rest(self) -> Source:
        """The hair as it is stored, on the undeformed head."""
        if self.rest is None:
            return self
        return replace(self, strands=self.rest.strands, head=self.rest.surface, rest=None)

    @property
    def warnings(self) -> tuple[str, ...]:
        warnings = (
            self.head_warning,
            self.density_warning,
            *self.mask_warnings,
            *self.color_warnings,
            *self.parting_warnings,
        )
        return tuple(filter(None, warnings))


def read_source(
    hair: bpy.types.Object,
    depsgraph: bpy.types.Depsgraph,
    last_usable_masks: dict[str, Mask] | None = None,
) -> Source:
    """Read hair and head; without a usable head, the hair alone, with a warning.

    Args:
        last_usable_masks: see `MaskReader`; new masks are added to it.

    Raises:
        HairloomError: the object holds no hair curves, or none that can be used.
    """
    read = usable_curves(hair, depsgraph)
    head, head_warning = _read_head(hair, depsgraph)
    strands, rest = _posed_strands(hair, read.strands, head, depsgraph)
    mask_reader = MaskReader(
        hair,
        head_of(hair),
        head,
        strands,
        read.curve_indices,
        {} if last_usable_masks is None else last_usable_masks,
    )
    density, density_warning = read_density(hair, mask_reader, depsgraph)
    settings = settings_of(hair.data.hairloom.children, ChildrenSettings)
    masks, mask_warnings = mask_reader.masks(settings, depsgraph)
    colors, color_warnings = read_source_colors(hair, strands, head, depsgraph)
    partings, parting_warnings = read_partings(hair, depsgraph)
    return Source(
        strands,
        read.dropped,
        read.curve_indices,
        head,
        density,
        masks,
        head_warning,
        density_warning,
        mask_warnings,
        colors,
        color_warnings,
        partings=partings if len(partings) else None,
        parting_warnings=parting_warnings,
        rest=rest,
    )


def posed_curves(hair: bpy.types.Object, depsgraph: bpy.types.Depsgraph) -> Cleaned:
    """Like `usable_curves`, on the posed head."""
    read, (head, _) = usable_curves(hair, depsgraph), _read_head(hair, depsgraph)
    return replace(read, strands=_posed_strands(hair, read.strands, head, depsgraph)[0])


def _posed_strands(
    hair: bpy.types.Object,
    strands: StrandSet,
    head: Surface | None,
    depsgraph: bpy.types.Depsgraph,
) -> tuple[StrandSet, RestHair | None]:
    """Strands on the posed head, and the stored rest hair if they had to be moved there. Curves of
    an animated style are used where they are."""
    if head is None or hair.hairloom.dynamics.animated_style:
        return strands, None
    rests, is_deformed_only = read_rest_surfaces(head_of(hair), depsgraph, head)
    # subdivision moves the surface too, but that is not a pose
    min_distance = DEFORMED if is_deformed_only else LOOSE_DISTANCE
    rest = RestHair.find(strands, rests, head, min_distance)
    return (strands, None) if rest is None else (rest.on(head), rest)


def read_source_colors(
    hair: bpy.types.Object,
    strands: StrandSet,
    head: Surface | None,
    depsgraph: bpy.types.Depsgraph,
) -> tuple[PaintedColor | None, tuple[str, ...]]:
    """The colours painted under hair, and all warnings about its colours."""
    colors, warnings = read_colors(hair, depsgraph, None if head is None else len(head.triangles))
    return colors, (*warnings, *color_notes(hair.name, strands))


def read_density(
    hair: bpy.types.Object, mask_reader: MaskReader, depsgraph: bpy.types.Depsgraph
) -> tuple[Floats | None, str]:
    """The density of children at each vertex of the head; without usable weights children grow
    everywhere, with a warning."""
    name = _density_name(hair)
    if mask_reader.head is None or not name:
        return None, ""
    mask, warning = mask_reader.read_or_last(name, depsgraph)
    if mask is not None and mask.is_zero:
        return None, str(_no_density(name, mask_reader.surface))
    return None if mask is None else mask.at_vertices(
        mask_reader.head, mask_reader.strands
    ), warning


def check_density(hair: bpy.types.Object, depsgraph: bpy.types.Depsgraph) -> None:
    """Check the weights that set the density of children.

    Raises:
        HairloomError: they are missing on the head, or unusable.
    """
    name = _density_name(hair)
    if not name:
        return
    read, (head, _) = usable_curves(hair, depsgraph), _read_head(hair, depsgraph)
    mask_reader = MaskReader(hair, head_of(hair), head, read.strands, read.curve_indices)
    if head is not None and mask_reader.mask(name, depsgraph).is_zero:
        raise _no_density(name, mask_reader.surface)


def _density_name(hair: bpy.types.Object) -> str:
    """Name of the weights for children's density; empty: no children, or children everywhere."""
    has_children = hair.data.hairloom.children.method != "none"
    return str(hair.hairloom.children_density) if has_children else ""


def _no_density(name: str, head: bpy.types.Object | None) -> HairloomError:
    return HairloomError(
        f"the weights '{name}' are zero everywhere",
        place="hair" if head is None else head.name,
        remedy="Paint where children should grow, or clear their Density field",
    )


def hair_dynamics_modifiers(hair: bpy.types.Object) -> list[bpy.types.Modifier]:
    """The object's modifiers with Blender's own hair dynamics that simulate in viewport or render.

    They would move the hair a second time. Those in mode *Animation*, as new hair has them, only
    put it onto its surface.
    """
    return [
        modifier
        for modifier in hair.modifiers
        if modifier.type == "NODES"
        and modifier.node_group is not None
        and modifier.node_group.name.startswith(_HAIR_DYNAMICS)
        and (modifier.show_viewport or modifier.show_render)
        and ((mode := _mode_input(modifier)) is None or mode.value != _ATTACH_ONLY)
    ]


def _mode_input(modifier: bpy.types.Modifier) -> Any:
    """The input with the mode of Hair Dynamics; None in a group without one."""
    sockets = modifier.node_group.interface.items_tree
    found = [each for each in sockets if each.item_type == "SOCKET" and each.name == _MODE_INPUT]
    return getattr(modifier.properties.inputs, found[0].identifier, None) if found else None


def check_no_hair_dynamics(hair: bpy.types.Object) -> None:
    """Refuse to simulate twice.

    Raises:
        HairloomError: Blender's own hair dynamics moves this hair already.
    """
    for modifier in hair_dynamics_modifiers(hair):
        if modifier.show_viewport:
            raise HairloomError(
                f"its modifier {modifier.name} simulates it already",
                place=hair.name,
                remedy="Press Mute Hair Dynamics, which leaves the hair on its surface",
            )


def dynamics_warnings(hair: bpy.types.Object) -> tuple[str, ...]:
    """A warning about Blender's own hair dynamics, if it is on."""
    return tuple(
        f"{hair.name}: its modifier {modifier.name} simulates it too, so Hairloom does not. "
        "Press Mute Hair Dynamics."
        for modifier in hair_dynamics_modifiers(hair)
        if modifier.show_viewport
    )


def mute_hair_dynamics(hair: bpy.types.Object) -> int:
    """Set Blender's own hair dynamics to only put hair onto its surface; modifiers without that
    mode are turned off. Returns how many were changed."""
    modifiers = hair_dynamics_modifiers(hair)
    for modifier in modifiers:
        mode = _mode_input(modifier)
        if mode is None:
            modifier.show_viewport = modifier.show_render = False
        else:
            mode.value = _ATTACH_ONLY
    if modifiers:
        hair.update_tag()
    return len(modifiers)


def usable_curves(hair: bpy.types.Object, depsgraph: bpy.types.Depsgraph) -> Cleaned:
    """Like `read_curves`, but it is an error if no curve can be used.

    Raises:
        HairloomError: the object holds no hair curves, or none that can be used.
    """
    read = read_curves(hair, depsgraph)
    if not read.strands.strand_count:
        reasons = ", ".join(f"{count:,} with {reason}" for reason, count in read.dropped.items())
        raise HairloomError(
            f"none of its curves can be used ({reasons})" if reasons else "it has no curves",
            place=hair.name,
            remedy="Add curves of two points or more, or undo what removed them",
        )
    return read


def _read_head(
    hair: bpy.types.Object, depsgraph: bpy.types.Depsgraph
) -> tuple[Surface | None, str]:
    """The head, if it is usable, and a warning or an empty string."""
    head = head_of(hair)
    if head is None:
        return None, (
            f"{hair.name}: it has no surface, so it only follows its own object and collides with "
            "nothing. Set Surface in its Data properties."
        )
    try:
        surface = read_surface(head, depsgraph, need_uv=False, place=head.name)
    except HairloomError as error:
        return None, str(error)
    if surface.corner_uv is None:
        return surface, (
            f"{head.name}: it has no UVs, so exported strands have no root UVs. "
            "Unwrap it (Edit Mode, UV > Unwrap)."
        )
    return surface, ""
