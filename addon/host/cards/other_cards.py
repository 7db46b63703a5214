"""Hair of other grooms in the scene, as it shades the cards of one.

That is every mesh that can be seen and that Make Cards or Sort Hair Cards has written, of the cards
of a groom the finest level alone. A groom without such cards shades by its strands, of which quick
cards are made that nobody sees.
"""

from __future__ import annotations

import bpy

from ... import card_flow
from ...cards.occlusion import CardShade
from ...cards.occlusion_settings import CardOcclusionSettings
from ...errors import HairloomError
from ...shading.settings import StrandSettings
from ..scene.objects import objects_in
from ..scene.rigs import rig_of
from ..scene.source import read_source
from ..scene.surfaces import read_surface
from ..settings.properties import settings_of
from .adopted_writing import SHARES
from .card_alpha import alpha_of


def other_cards(
    settings: CardOcclusionSettings,
    own: bpy.types.Object | None,
    depsgraph: bpy.types.Depsgraph | None = None,
) -> tuple[tuple[CardShade, ...], list[str]]:
    """All other hair if it is to shade, as cards, and what the artist should know of it.

    Args:
        own: hair curves, or a mesh of cards; None leaves nothing out.
        depsgraph: None is that of the window, brought up to date.
    """
    shades: list[CardShade] = []
    notes: list[str] = []
    if not settings.others:
        return (), notes
    depsgraph = depsgraph or bpy.context.evaluated_depsgraph_get()
    for obj in shading_objects(own, depsgraph.view_layer):
        try:
            shade, problems = (_shade_of_hair if obj.type == "CURVES" else _shade_of_mesh)(
                obj, depsgraph
            )
        except HairloomError as error:
            notes.append(f"It shades nothing: {error}")
            continue
        shades.append(shade)
        notes += [f"{obj.name}: {problem}" for problem in problems]
    return tuple(shades), notes


def _shade_of_mesh(
    obj: bpy.types.Object, depsgraph: bpy.types.Depsgraph
) -> tuple[CardShade, tuple[str, ...]]:
    surface = read_surface(obj, depsgraph, need_uv=False, place=obj.name)
    alpha, problems = alpha_of(obj)
    return CardShade.of_surface(surface, alpha), tuple(problems)


def _shade_of_hair(
    hair: bpy.types.Object, depsgraph: bpy.types.Depsgraph
) -> tuple[CardShade, tuple[str, ...]]:
    rig = rig_of(hair, read_source(hair, depsgraph))
    return card_flow.shade_of(rig, settings_of(hair.data.hairloom.strands, StrandSettings)), ()


def shading_objects(
    own: bpy.types.Object | None, layer: bpy.types.ViewLayer
) -> list[bpy.types.Object]:
    """The meshes of cards and the hair that shade what is not their own."""
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
    return bool(len(obj.data.polygons)) and all(name in obj.data.attributes for name in SHARES)


def _is_groom(obj: bpy.types.Object) -> bool:
    """Hair curves; the copy of a bake stands for hair that counts already."""
    return obj.type == "CURVES" and not obj.data.hairloom.baked_in
