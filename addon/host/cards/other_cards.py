"""Hair cards that stand in the scene, as they shade those of another groom.

That is every mesh that can be seen and that Make Cards or Sort Hair Cards has written, of the cards
of a groom the finest level alone. Grooms that have no cards do not count.
"""

from __future__ import annotations

from collections.abc import Iterator

import bpy

from ...cards.occlusion import CardShade
from ...cards.occlusion_settings import CardOcclusionSettings
from ..scene.surfaces import read_surface
from .adopted_writing import SHARES
from .card_alpha import alpha_of


def other_cards(
    settings: CardOcclusionSettings,
    own: bpy.types.Object | None,
    depsgraph: bpy.types.Depsgraph | None = None,
) -> tuple[tuple[CardShade, ...], list[str]]:
    """All cards but those of `own` if they are to shade, and what the artist should know of them.

    Args:
        own: hair curves, or a mesh of cards; None leaves nothing out.
        depsgraph: None is that of the window, brought up to date.
    """
    shades: list[CardShade] = []
    notes: list[str] = []
    if not settings.others:
        return (), notes
    depsgraph = depsgraph or bpy.context.evaluated_depsgraph_get()
    for obj in _card_meshes(own, depsgraph):
        surface = read_surface(obj, depsgraph, need_uv=False, place=obj.name)
        alpha, problems = alpha_of(obj)
        shades.append(CardShade.of_surface(surface, alpha))
        notes += [f"{obj.name}: {problem}" for problem in problems]
    return tuple(shades), notes


def _card_meshes(
    own: bpy.types.Object | None, depsgraph: bpy.types.Depsgraph
) -> Iterator[bpy.types.Object]:
    layer = depsgraph.view_layer
    for obj in layer.objects:
        made = obj.hairloom.card_object
        is_own = own is not None and own in (obj, made.groom)
        if obj.type != "MESH" or is_own or made.level:
            continue
        is_cards = all(name in obj.data.attributes for name in SHARES)
        if is_cards and len(obj.data.polygons) and obj.visible_get(view_layer=layer):
            yield obj
