"""Hair of other grooms in the scene, which occludes the cards of one.

Occluders are all visible meshes that Make Cards or Sort Hair Cards has written, but only the finest
level of a groom's cards. A groom without such cards occludes by its strands, from which quick cards
are made for this purpose only. Objects are read in the main thread; a thread may make the cards.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Protocol

import bpy
import numpy as np

from ... import card_flow
from ...arrays import Floats
from ...cards.occlusion import CardOccluder
from ...cards.occlusion_settings import CardOcclusionSettings
from ...errors import HairloomError
from ...groom.children_settings import ChildrenSettings
from ...groom.settings import GuideSettings
from ...groom.width_settings import WidthSettings
from ...params import SettingsMap
from ...rig_flow import Rig
from ...shading.settings import StrandSettings
from ...strands import Surface
from ..base.objects import objects_in
from ..colliders.rigs import rig_from
from ..properties.groom_settings import GroomSettings
from ..scene.source import Source, read_source
from ..scene.surfaces import CARD_ATTRIBUTES, read_surface
from .material import read_alpha

#: Hair counts as unmoved within this tolerance, relative to its largest coordinate.
_STILL = 1.0e-5
_NO_MOTION = np.eye(4)


class _ReadOccluder(Protocol):
    """An object that was read."""

    def occluder(self) -> CardOccluder:
        """Raises:
        HairloomError: it cannot be made into cards.
        """
        ...

    @property
    def occlusion_inputs(self) -> tuple[object, ...]:
        """All values that its occlusion depends on."""
        ...


@dataclass(frozen=True, eq=False)
class Occluders:
    """All other hair that occludes, read from the scene as arrays that a thread may use.

    uids: session numbers of the objects, including those that cannot be used.
    notes: for the artist, from reading them.
    """

    uids: frozenset[int] = frozenset()
    notes: tuple[str, ...] = ()
    _occluders: tuple[_ReadOccluder, ...] = ()

    def cards(self) -> tuple[tuple[CardOccluder, ...], tuple[str, ...]]:
        """The hair as cards, and notes for the artist."""
        found: list[CardOccluder] = []
        notes = list(self.notes)
        for each in self._occluders:
            try:
                found.append(each.occluder())
            except HairloomError as error:
                notes.append(_occludes_nothing_note(error))
        return tuple(found), tuple(notes)

    def with_rigs(self, rigs: Sequence[tuple[SettingsMap, Rig]]) -> Occluders:
        """These, and grooms that are not in the scene, with their settings."""
        more = tuple(_KnownRig(settings, rig) for settings, rig in rigs)
        return replace(self, _occluders=(*self._occluders, *more))

    def gives_same_occlusion(self, other: Occluders) -> bool:
        """Whether both give the same occlusion."""
        if (self.uids, self.notes) != (other.uids, other.notes):
            return False
        pairs = zip(self._occluders, other._occluders, strict=True)
        return all(_are_alike(one.occlusion_inputs, two.occlusion_inputs) for one, two in pairs)


@dataclass(frozen=True, eq=False)
class _ReadMesh:
    surface: Surface
    alpha: Floats | None

    def occluder(self) -> CardOccluder:
        return CardOccluder.of_surface(self.surface, self.alpha)

    @property
    def occlusion_inputs(self) -> tuple[object, ...]:
        surface = self.surface
        return surface.positions, surface.triangles, surface.corner_uv, self.alpha


@dataclass(frozen=True, eq=False)
class _KnownRig:
    settings: SettingsMap
    rig: Rig

    def occluder(self) -> CardOccluder:
        return card_flow.occluder_of(self.rig, self.settings[StrandSettings])

    @property
    def occlusion_inputs(self) -> tuple[object, ...]:
        strands = self.rig.strands
        return strands.points, strands.offsets, strands.radius, self.settings


@dataclass(frozen=True, eq=False)
class _ReadStrands:
    source: Source
    settings: SettingsMap
    name: str

    def occluder(self) -> CardOccluder:
        rig = rig_from(self.source, self.settings, place=self.name)
        return card_flow.occluder_of(rig, self.settings[StrandSettings])

    @property
    def occlusion_inputs(self) -> tuple[object, ...]:
        source, strands = self.source, self.source.strands
        head = None if source.head is None else source.head.positions
        hair = strands.points, strands.offsets, strands.radius, strands.group
        painted = source.density, source.masks
        return *hair, head, *painted, source.partings, self.name, self.settings


def read_occluders(
    settings: CardOcclusionSettings,
    own: bpy.types.Object | None,
    depsgraph: bpy.types.Depsgraph | None = None,
    motion: Floats = _NO_MOTION,
) -> Occluders:
    """All other hair, if the settings include it.

    Args:
        own: hair curves or a mesh of cards that does not count; None leaves nothing out.
        depsgraph: None: that of the window, brought up to date.
        motion: (4, 4) of the occluded hair since rest; its inverse is applied to the others, so
            that they are where they would be if all hair were at rest.
    """
    if not settings.others:
        return Occluders()
    back = _NO_MOTION if np.array_equal(motion, _NO_MOTION) else np.linalg.pinv(motion)
    depsgraph = depsgraph or bpy.context.evaluated_depsgraph_get()
    read: list[_ReadOccluder] = []
    notes: list[str] = []
    objects = occluder_objects(own, depsgraph.view_layer)
    for obj in objects:
        try:
            if obj.type == "CURVES":
                read.append(_read_strands(obj, depsgraph, back))
            else:
                mesh, problems = _read_mesh(obj, depsgraph, back)
                read.append(mesh)
                notes += [f"{obj.name}: {problem}" for problem in problems]
        except HairloomError as error:
            notes.append(_occludes_nothing_note(error))
    return Occluders(frozenset(obj.session_uid for obj in objects), tuple(notes), tuple(read))


def _read_mesh(
    obj: bpy.types.Object, depsgraph: bpy.types.Depsgraph, back: Floats
) -> tuple[_ReadMesh, list[str]]:
    surface = read_surface(obj, depsgraph, need_uv=False, place=obj.name)
    alpha, problems = read_alpha(obj)
    return _ReadMesh(surface.transformed(back), alpha), problems


def _read_strands(
    hair: bpy.types.Object, depsgraph: bpy.types.Depsgraph, back: Floats
) -> _ReadStrands:
    source = read_source(hair, depsgraph)
    source = replace(
        source,
        strands=source.strands.transformed(back),
        head=None if source.head is None else source.head.transformed(back),
    )
    settings = GroomSettings.of(hair).sections
    of_shade = settings.only(GuideSettings, WidthSettings, ChildrenSettings, StrandSettings)
    return _ReadStrands(source, of_shade, hair.name)


def _occludes_nothing_note(error: HairloomError) -> str:
    return f"It occludes nothing: {error}"


def _are_alike(one: tuple[object, ...], other: tuple[object, ...]) -> bool:
    return all(_is_still(a, b) for a, b in zip(one, other, strict=True))


def _is_still(one: object, other: object) -> bool:
    if not (isinstance(one, np.ndarray) and isinstance(other, np.ndarray)):
        return one is other or bool(one == other)
    if one.shape != other.shape or one.dtype.kind != "f":
        return np.array_equal(one, other)
    reach = float(np.abs(one).max(initial=0.0))
    return np.allclose(one, other, rtol=0.0, atol=_STILL * reach)


def occluder_objects(
    own: bpy.types.Object | None, layer: bpy.types.ViewLayer
) -> list[bpy.types.Object]:
    """The visible meshes of cards, and hair without such, that occlude the cards of `own`."""
    seen = [obj for obj in objects_in(layer) if obj.visible_get(view_layer=layer)]
    meshes = [obj for obj in seen if _is_cards(obj)]
    carded = {obj.hairloom.card_object.groom for obj in meshes}
    groom = None if own is None else own.hairloom.card_object.groom
    left_out = {own, groom} - {None}
    cards = [each for each in meshes if not {each, each.hairloom.card_object.groom} & left_out]
    strands = [each for each in seen if _is_groom(each) and each not in carded | left_out]
    return [*cards, *strands]


def _is_cards(obj: bpy.types.Object) -> bool:
    if obj.type != "MESH" or obj.hairloom.card_object.level:
        return False
    return bool(len(obj.data.polygons)) and all(
        name in obj.data.attributes for name in CARD_ATTRIBUTES
    )


def _is_groom(obj: bpy.types.Object) -> bool:
    """Whether an object is hair curves, and not the copy that shows a bake of other hair."""
    return obj.type == "CURVES" and not obj.data.hairloom.baked_in
