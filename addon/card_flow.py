"""The flow of data from a rig to its cards, at rest and in motion."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from .arrays import Bools, Floats
from .cards.atlas_settings import AtlasSettings
from .cards.build import CardBuild, CardGroom, MakeAlpha, card_steps, strand_occluder
from .cards.card_mesh import CardMesh
from .cards.card_strands import card_strands
from .cards.contacts import CardClearance, CardContacts
from .cards.edits import CardEdits
from .cards.follow import (
    CardBinding,
    bind_cards,
    card_lines,
    carried_cards,
    follow_guides,
)
from .cards.occlusion import CardOccluder
from .cards.occlusion_settings import CardOcclusionSettings
from .cards.settings import CardSettings
from .cards.steps import NamedSteps
from .dynamics.figures import CardFigures
from .dynamics.measure import are_outside, length_changes, strand_depths
from .groom.weights import guide_weights
from .light_flow import ambient_of, directional_light, rest_fields
from .motion_flow import carried_guides, root_turns
from .params import SettingsMap
from .rig_flow import MotionStart, Pose, Rig, Solids, root_normals
from .shading.ambient import occlusion_from_sky
from .shading.ambient_settings import AmbientSettings
from .shading.drawn_strands import drawn_radius, own_colors
from .shading.settings import ShadingSettings, StrandSettings
from .strands.arc_length import strand_lengths

_DEFAULT_STRANDS = StrandSettings()


def card_build_steps(
    rig: Rig,
    settings: SettingsMap,
    make_alpha: MakeAlpha = lambda _build: None,
    occluders: Sequence[CardOccluder] = (),
    edits: CardEdits | None = None,
) -> NamedSteps[CardBuild]:
    """Cards at rest in all levels of detail, with occlusion, sorted from inside to outside.

    Args:
        make_alpha: bakes the atlas and returns its alpha; see `cards.build`.
        occluders: cards of other grooms, which shade these, world space.
        edits: the artist's changes to cards made before, which are kept.

    Yields what is being made; returns the cards.

    Raises:
        HairloomError: the atlas is too small for its tiles, or there is nothing to bake into it.
    """
    groom = card_groom(rig, settings[StrandSettings])
    strands = groom.strands
    ambient = settings[AmbientSettings]
    fields = rest_fields(rig, ambient)
    occlusion = occlusion_from_sky(fields.sky.at(strands.points)[0], ambient_of(rig, ambient))
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
    build = yield from card_steps(groom, *sections, make_alpha, occluders, edits)
    if build.shell_layers:
        build = replace(build, light=directional_light(fields, build.finest.positions))
    return build


def card_groom(rig: Rig, strand_settings: StrandSettings = _DEFAULT_STRANDS) -> CardGroom:
    """The strands that cards are made from, without their occlusion.

    Baby hair is left out: its single strands lie on the skin along hairlines and partings, where
    cards would look like dashes.
    """
    number = np.delete(np.arange(rig.strands.strand_count), rig.baby_hair)
    strands = card_strands(rig.strands.take(number) if len(rig.baby_hair) else rig.strands)
    radius = drawn_radius(strands.radius.reshape(strands.strand_count, -1), strand_settings)
    # guides are the artist's own strands, which come first, so they keep their numbers
    return CardGroom(strands, number, rig.guides, radius, root_normals(rig)[number], rig.head)


def occluder_of(rig: Rig, strand_settings: StrandSettings = _DEFAULT_STRANDS) -> CardOccluder:
    """Cards that represent this groom's strands where they shade other grooms, world space."""
    return strand_occluder(card_groom(rig, strand_settings))


def bound_cards(rig: Rig, mesh: CardMesh) -> CardBinding:
    """Cards at rest, bound to the guides that they ride on."""
    used, lines = card_lines(mesh)
    guides, guide_group = rig.guide_grid, rig.strands.group[rig.guides]
    group = mesh.group[used]
    if not np.isin(group, guide_group).all():  # cards without groups
        group, guide_group = np.zeros_like(group), np.zeros_like(guide_group)
    weights = guide_weights(
        lines[:, 0], group, guides[:, 0], guide_group, strand_grid=lines, guide_grid=guides
    )
    return bind_cards(mesh, guides, weights.guide, weights.weight, rig.curl_slack)


def cards_at(rig: Rig, cards: CardBinding, pose: Pose, guides_now: Floats) -> CardMesh:
    """Cards riding on guides, led out of the solids of the pose, world space.

    Args:
        guides_now: (guide_count, cv_count, 3) [m], simulated or baked, world space.
    """
    contacts = None if pose.solids is None else _contacts(rig, cards, pose.solids)
    return follow_guides(cards, guides_now, root_turns(rig, pose), contacts)


def _contacts(rig: Rig, cards: CardBinding, solids: Solids) -> CardContacts | None:
    """The colliders of a pose with the clearances of cards, which are computed once per motion."""
    colliders = solids.colliders
    if not colliders or not solids.motion_start.colliders:
        return None
    for known, clearance in cards.clearance_cache:
        if known is solids.motion_start or known.is_same_as(solids.motion_start):
            return CardContacts(colliders, clearance)
    clearance = card_clearance(rig, cards, solids.motion_start)
    cards.clearance_cache[:] = [(solids.motion_start, clearance)]
    return CardContacts(colliders, clearance)


def card_clearance(rig: Rig, cards: CardBinding, start: MotionStart) -> CardClearance:
    """How far cards stay from colliders, from where their roots carry them as a motion begins."""
    guides = carried_guides(rig, start.pose)
    spines, vertices = carried_cards(cards, guides, root_turns(rig, start.pose))
    standing = tuple(each.at_end() for each in start.colliders)
    return CardClearance.measure(
        spines, vertices, cards.row_of_vertex, cards.offsets, standing, start.max_clearance
    )


class CardMeasure:
    """Gathers figures of cards frame by frame, as `dynamics.figures.FiguresCollector` does of
    strands."""

    def __init__(self, rig: Rig, cards: CardBinding) -> None:
        self._rig, self._cards = rig, cards
        self._lengths = strand_lengths(cards.row_middles(cards.mesh.positions), cards.offsets)
        owner = cards.card_of_row[cards.row_of_vertex]
        self._by_card = np.argsort(owner, kind="stable")
        self._offsets = np.searchsorted(owner[self._by_card], np.arange(len(cards.guide) + 1))
        self._were_outside: Bools | None = None
        self._change, self._depth = (np.zeros(len(cards.guide)) for _ in range(2))

    def add(self, mesh: CardMesh, solids: Solids | None) -> None:
        """Take another frame into account.

        Args:
            solids: what cards are led out of in this frame; None: nothing.
        """
        if not len(self._cards.guide):
            return
        lines = self._cards.row_middles(mesh.positions)
        change = length_changes(lines, self._cards.offsets, self._lengths)
        np.maximum(self._change, change, out=self._change)
        if solids is None:
            return
        if self._were_outside is None:
            start = solids.motion_start
            guides = carried_guides(self._rig, start.pose)
            _, vertices = carried_cards(self._cards, guides, root_turns(self._rig, start.pose))
            standing = tuple(each.at_end() for each in start.colliders)
            self._were_outside = are_outside(vertices[self._by_card], standing)
        points = mesh.positions[self._by_card]
        depth = strand_depths(points, self._offsets, solids.colliders, self._were_outside)
        np.maximum(self._depth, depth, out=self._depth)

    @property
    def figures(self) -> CardFigures:
        """The figures of all frames so far."""
        return CardFigures.of_frames(self._change, self._depth)
