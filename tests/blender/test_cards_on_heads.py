"""Riding cards are led out of a head, tested against Blender's own ray casts and nearest points."""

from __future__ import annotations

import bpy  # noqa: F401  it must come before gpu, which lives inside it
import numpy as np
from guide_cards import build_cards
from mathutils import Vector
from mathutils.bvhtree import BVHTree

from hairloom.addon.blender.colliders.fields import field_of
from hairloom.addon.blender.scene.built_in_head import built_in_head
from hairloom.addon.cards.contacts import CardClearance, CardContacts
from hairloom.addon.cards.follow import bind_cards, carried_cards, follow_guides
from hairloom.addon.cards.settings import CardSettings
from hairloom.addon.dynamics.colliders import PosedCollider
from hairloom.addon.dynamics.settings import DynamicsSettings
from hairloom.addon.strands import Surface

LENGTH, CVS, KEPT, COUNT = 0.2, 16, 0.001, 60
WAYS = ((1.0, 0.1, 0.9), (-0.3, 1.0, 0.8), (0.1, -0.2, 1.0))


def depths(points: np.ndarray, head: Surface) -> np.ndarray:
    """The depth of each point inside the head by Blender's BVH, 0 outside [m]."""
    tree = BVHTree.FromPolygons(head.positions.tolist(), head.triangles.tolist())
    found = np.zeros(len(points))
    for number, point in enumerate(points):
        start = Vector(point.tolist())
        if all(crossings(tree, start, Vector(way).normalized()) % 2 for way in WAYS):
            found[number] = tree.find_nearest(start)[3]
    return found


def crossings(tree: BVHTree, start: Vector, direction: Vector) -> int:
    count, place = 0, tree.ray_cast(start, direction)[0]
    while place is not None:
        count, place = count + 1, tree.ray_cast(place + direction * 1e-5, direction)[0]
    return count


def test_no_card_enters_a_head_deeper_than_at_rest() -> None:
    made = built_in_head()
    head, random = made.surface, np.random.default_rng(5)
    scalp = np.flatnonzero(made.weights["scalp"] > 0.5)
    roots = head.positions[random.choice(scalp, COUNT, replace=False)].astype(np.float64)
    middle = head.positions[scalp].mean(axis=0) - [0.0, 0.0, 0.05]
    out = roots - middle
    out /= np.linalg.norm(out, axis=1, keepdims=True)
    along = np.linspace(0.0005, LENGTH, CVS)[None, :, None]
    guides = (roots[:, None] + out[:, None] * along).astype(np.float32)
    across = np.cross(out, random.normal(size=(COUNT, 3)))
    mesh = build_cards(guides, across.astype(np.float32), CardSettings())
    own, turns = np.arange(COUNT)[:, None], np.tile(np.eye(3), (COUNT, 1, 1))
    cards = bind_cards(mesh, guides, own, np.ones((COUNT, 1), np.float32))
    field = field_of(head, DynamicsSettings(), place="head")
    solids = (PosedCollider(field, np.eye(4), np.eye(4)),)
    carried = carried_cards(cards, guides, turns)
    contacts = CardContacts(
        solids, CardClearance.measure(*carried, cards.row_of_vertex, cards.offsets, solids, KEPT)
    )
    # all strands fall to the left, many through the head
    fall = guides[:, :1] + along * np.array([-0.8, 0.1, -0.6], np.float32)
    at_rest = depths(mesh.positions, head)
    riding = depths(follow_guides(cards, fall, turns).positions, head)
    led = depths(follow_guides(cards, fall, turns, contacts).positions, head)
    was_outside = at_rest == 0.0
    assert riding[was_outside].max() > 0.03 and (riding[was_outside] > 0.001).sum() > 100
    assert led[was_outside].max() < 0.0005
    assert (led - at_rest)[~was_outside].max(initial=0.0) < 0.0005
