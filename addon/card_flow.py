"""The flow of data from a groom that was made ready to its cards, which move with it."""

from __future__ import annotations

from collections.abc import Generator, Sequence
from dataclasses import replace

import numpy as np

from .arrays import Floats
from .cards.atlas_settings import AtlasSettings
from .cards.build import AlphaOf, CardBuild, CardGroom, card_steps, strand_occluder
from .cards.card_mesh import CardMesh
from .cards.card_strands import card_strands
from .cards.edits import CardEdits
from .cards.follow import CardBinding, bind_cards, card_lines, follow_guides
from .cards.occlusion import CardOccluder
from .cards.occlusion_settings import CardOcclusionSettings
from .cards.settings import CardSettings
from .groom.weights import guide_weights
from .light_flow import ambient_of, directional_light, rest_fields
from .motion_flow import root_turns
from .params import SettingsMap
from .rig_flow import Pose, Rig, root_normals
from .shading.ambient import occlusion_by
from .shading.ambient_settings import AmbientSettings
from .shading.drawn_strands import drawn_radius, own_colors
from .shading.settings import ShadingSettings, StrandSettings

_AS_THEY_ARE = StrandSettings()


def card_build_steps(
    rig: Rig,
    settings: SettingsMap,
    alpha_of: AlphaOf = lambda _build: None,
    others: Sequence[CardOccluder] = (),
    edits: CardEdits | None = None,
) -> Generator[str, None, CardBuild]:
    """Cards at rest in all levels of detail, with occlusion, from inside to outside.

    Args:
        alpha_of: the alpha of the atlas, which is best baked here; see `cards.build`.
        others: cards of other grooms, which shade these, world space.
        edits: what the artist has changed of cards that were made before, which is kept.

    Yields what comes next, and returns the cards.

    Raises:
        HairloomError: the atlas is too small for its tiles, or there is nothing to bake into it.
    """
    groom = card_groom(rig, settings[StrandSettings])
    strands = groom.strands
    ambient = settings[AmbientSettings]
    fields = rest_fields(rig, ambient)
    occlusion = occlusion_by(fields.sky.at(strands.points)[0], ambient_of(rig, ambient))
    light = directional_light(fields, strands.points)
    of_points = np.repeat(strands.group, strands.point_counts)
    color = own_colors(strands.color, of_points, settings[ShadingSettings])
    groom = replace(
        groom,
        strands=replace(strands, color=color),
        occlusion=occlusion.reshape(strands.strand_count, -1),
        light=light.reshape(*strands.grid.shape[:2], -1),
    )
    sections = settings[CardSettings], settings[AtlasSettings], settings[CardOcclusionSettings]
    build = yield from card_steps(groom, *sections, alpha_of, others, edits)
    if build.shell_layers:
        build = replace(build, light=directional_light(fields, build.finest.positions))
    return build


def card_groom(rig: Rig, drawn: StrandSettings = _AS_THEY_ARE) -> CardGroom:
    """What cards are made from, without the occlusion of the strands.

    Baby hair is left out: it lies singly on the skin along hairlines and partings, and cards of it
    would be dashes there.
    """
    number = np.delete(np.arange(rig.strands.strand_count), rig.baby_hair)
    strands = card_strands(rig.strands.take(number) if len(rig.baby_hair) else rig.strands)
    radius = drawn_radius(strands.radius.reshape(strands.strand_count, -1), drawn)
    # guides are the artist's own strands, which come first, so they keep their numbers
    return CardGroom(strands, number, rig.guides, radius, root_normals(rig)[number], rig.head)


def occluder_of(rig: Rig, drawn: StrandSettings = _AS_THEY_ARE) -> CardOccluder:
    """What shades others instead of this groom's strands, world space."""
    return strand_occluder(card_groom(rig, drawn))


def bound_cards(rig: Rig, mesh: CardMesh) -> CardBinding:
    """Cards at rest, tied to the guides that they ride on from then on."""
    used, lines = card_lines(mesh)
    guides, guide_group = rig.guide_grid, rig.strands.group[rig.guides]
    group = mesh.group[used]
    if not np.isin(group, guide_group).all():  # cards that know of no groups
        group, guide_group = np.zeros_like(group), np.zeros_like(guide_group)
    weights = guide_weights(
        lines[:, 0], group, guides[:, 0], guide_group, strand_grid=lines, guide_grid=guides
    )
    return bind_cards(mesh, guides, weights.guide, weights.weight, rig.curl_room)


def cards_at(rig: Rig, cards: CardBinding, pose: Pose, guides_now: Floats) -> CardMesh:
    """Cards riding on guides, world space; arguments as of `strands_at`."""
    return follow_guides(cards, guides_now, root_turns(rig, pose))
