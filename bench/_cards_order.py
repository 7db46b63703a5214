"""How often cards of Sintel's hair are drawn in a wrong order, and how long sorting takes.

A pixel is wrong if its colour after the four passes is off by more than 1/255, with a random colour
for each card and the texture's alpha (see `cards.order_check`). Figures are fractions of the pixels
that hair covers, over VIEW_COUNT views around the head, none of which the order was learnt from.
Times are processor times, as other programs may run.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace

import numpy as np
from _cards_atlas import STRANDS
from _cards_groom import sintel_rig

from hairloom.addon.blender.cards.build import baked_atlas
from hairloom.addon.card_flow import card_build_steps
from hairloom.addon.cards.atlas_settings import AtlasSettings
from hairloom.addon.cards.build import CardBuild
from hairloom.addon.cards.card_mesh import CardMesh
from hairloom.addon.cards.order_check import check_views, visible_fragments, wrong_pixels
from hairloom.addon.cards.order_views import SphereView
from hairloom.addon.cards.settings import CardSettings
from hairloom.addon.cards.sort import (
    CardOrders,
    card_orders,
    connected_components,
    order_from_eye,
    sorted_by_key,
)
from hairloom.addon.cards.steps import result_of
from hairloom.addon.params import SettingsMap
from hairloom.addon.rig_flow import Rig
from hairloom.addon.shading.settings import ShadingSettings
from hairloom.addon.shading.texture_settings import TextureSettings
from hairloom.addon.shading.textures import hair_textures
from hairloom.addon.strands import Surface

VIEW_COUNT, SIZE = 200, 128
#: views for the cards along guides
FEWER_VIEWS = 40
SORTED_TRIANGLES, ROUNDS = 100_000, 9

#: The order of triangles in a view, for front faces and for back faces.
type OrderOf = Callable[[SphereView], tuple[np.ndarray, np.ndarray]]


def order_figures() -> dict[str, float]:
    """The figures by name; `baked` names the baked texture, the others the procedural.

    order_wrong_unsorted: cards in the order in which they were built.
    order_wrong_sorted: the mesh's order for front faces, and that for back faces.
    order_wrong_perview: whole cards by the distance of their middle from the eye, for each view.
    order_wrong_perview_triangles: triangles by their own distance, as `order_from_eye` sorts them.
    order_wrong_distance: whole cards by their distance from the head, for all views.
    order_wrong_cards: whole cards in the learnt order, which has another for back faces.
    order_wrong_one_buffer: the mesh's order for front faces, also for back faces.
    order_wrong_guides_sorted, order_wrong_guides_unsorted: one card along each guide.
    sort_ms: to find the pieces of 100,000 triangles and sort them by distance, the median.
    order_seconds: to learn the orders of 800 cards; order_from_ms: to sort them for an eye.
    """
    rig = sintel_rig()
    head = rig.head
    assert head is not None
    found = {"sort_ms": sort_milliseconds()}
    for card_source, atlas_source, name in (
        ("clusters", "made", ""),
        ("clusters", "baked", "baked_"),
        ("guides", "made", "guides_"),
    ):
        mesh, alpha = cards_and_alpha(rig, card_source, atlas_source)
        begin = time.process_time()
        learnt = card_orders(mesh, head, alpha=alpha)
        found[f"order_{name}seconds"] = time.process_time() - begin
        unsorted = np.arange(len(mesh.triangles))
        orders: dict[str, OrderOf] = {"unsorted": always(unsorted), "sorted": both(learnt)}
        if card_source == "clusters":
            orders |= others(mesh, head, learnt, alpha)
        view_count = VIEW_COUNT if card_source == "clusters" else FEWER_VIEWS
        fractions = wrong_shares(mesh, head, orders, view_count, alpha)
        found |= {f"order_wrong_{name}{key}": fraction for key, fraction in fractions.items()}
        if atlas_source == "made" and card_source == "clusters":
            found["order_from_ms"] = eye_milliseconds(mesh)
    return found


def cards_and_alpha(rig: Rig, card_source: str, atlas_source: str) -> tuple[CardMesh, np.ndarray]:
    """The cards as they are built, and their texture's alpha."""
    alphas: list[np.ndarray] = []

    def alpha_of(build: CardBuild) -> np.ndarray:
        if build.plan is None:
            alphas.append(tiled_alpha(build.finest))
        else:
            alphas.append(baked_atlas(rig, build.plan, ShadingSettings(), STRANDS).alpha)
        return alphas[0]

    settings = SettingsMap(
        CardSettings(source=card_source, levels=1), AtlasSettings(source=atlas_source), STRANDS
    )
    build = result_of(card_build_steps(rig, settings, alpha_of))
    return as_built(build.finest), alphas[0]


def as_built(mesh: CardMesh) -> CardMesh:
    """Triangles sorted by card, those of a card from root to tip."""
    owner = np.lexsort((mesh.triangles.min(axis=1), mesh.card))
    return replace(mesh, triangles=mesh.triangles[owner], card=mesh.card[owner])


def always(front: np.ndarray, back: np.ndarray | None = None) -> OrderOf:
    return lambda _: (front, front if back is None else back)


def both(orders: CardOrders) -> OrderOf:
    return always(orders.front, orders.back)


def others(
    mesh: CardMesh, head: Surface, learnt: CardOrders, alpha: np.ndarray
) -> dict[str, OrderOf]:
    def per_view(view: SphereView) -> tuple[np.ndarray, np.ndarray]:
        away = mesh.positions[mesh.triangles].mean(axis=1) - eye_of(view)
        far = np.linalg.norm(away, axis=1)
        middle = np.bincount(mesh.card, far) / np.maximum(np.bincount(mesh.card), 1)
        order = np.argsort(-middle[mesh.card], kind="stable")
        return order, order

    def per_view_triangles(view: SphereView) -> tuple[np.ndarray, np.ndarray]:
        order = order_from_eye(mesh, np.append(eye_of(view), 1.0))
        return order, order

    return {
        "perview": per_view,
        "perview_triangles": per_view_triangles,
        "distance": both(card_orders(mesh, head, "distance")),
        "cards": both(card_orders(mesh, head, "cards", alpha=alpha)),
        "one_buffer": always(learnt.front),
    }


def eye_of(view: SphereView) -> np.ndarray:
    return view.middle + view.direction * view.distance


def wrong_shares(
    mesh: CardMesh,
    head: Surface,
    orders: dict[str, OrderOf],
    view_count: int,
    alpha: np.ndarray,
) -> dict[str, float]:
    """The fraction of wrong pixels for each order, over the same views."""
    wrong, covered = dict.fromkeys(orders, 0), 0
    for view in check_views(mesh, view_count, SIZE):
        seen = visible_fragments(mesh, head, view, alpha)
        for name, order_of in orders.items():
            is_wrong = wrong_pixels(mesh, seen, *order_of(view))
            wrong[name] += int(is_wrong.sum())
        covered += len(is_wrong)
    return {name: count / covered for name, count in wrong.items()}


def tiled_alpha(mesh: CardMesh) -> np.ndarray:
    """The alpha of the procedural texture in every tile of the mesh's atlas."""
    atlas = mesh.atlas
    settings = TextureSettings(variant_width=64, height=256)
    strips = hair_textures(settings, min(atlas.columns, 4)).alpha
    repeats = -(-atlas.columns // min(atlas.columns, 4))
    row = np.tile(strips, (1, repeats))[:, : atlas.columns * settings.variant_width]
    return np.tile(row, (atlas.rows, 1))


def sort_milliseconds() -> float:
    """To sort strips of 20 triangles by random distances."""
    random = np.random.default_rng(0)
    count = SORTED_TRIANGLES // 20
    strip = np.arange(20)[:, None] + np.arange(3)
    triangles = (np.arange(count)[:, None, None] * 22 + strip).reshape(-1, 3)
    points = random.random((count * 22, 3))
    mesh = CardMesh(
        positions=points,
        triangles=triangles,
        uv=points[:, :2],
        normal=points,
        tangent=points,
        occlusion=points[:, 0],
        card=np.repeat(np.arange(count), 20),
        along=points[:, 0],
    )
    distance = random.random(count)

    def once() -> float:
        begin = time.process_time()
        connected_components(mesh.triangles)
        sorted_by_key(mesh, distance)
        return time.process_time() - begin

    return 1e3 * float(np.median([once() for _ in range(ROUNDS)]))


def eye_milliseconds(mesh: CardMesh) -> float:
    def once(eye: np.ndarray) -> float:
        begin = time.process_time()
        order_from_eye(mesh, eye)
        return time.process_time() - begin

    eyes = np.random.default_rng(0).standard_normal((ROUNDS, 4))
    return 1e3 * float(np.median([once(eye) for eye in eyes]))
