"""Ambient occlusion of Sintel's cards against brute force: random rays through Blender's BVH tree.

The reference casts cosine-weighted rays about the normal from a sample of vertices, one at a time,
and follows each from card to card until it hits the head or escapes.
"""

from __future__ import annotations

import time

import numpy as np
from _cards_groom import sintel_rig
from mathutils import Vector
from mathutils.bvhtree import BVHTree

from hairloom.addon.card_flow import card_build_steps
from hairloom.addon.cards.atlas_settings import AtlasSettings
from hairloom.addon.cards.card_mesh import CardMesh
from hairloom.addon.cards.occlusion import CardOccluder, diagonal_of, vertex_occlusion
from hairloom.addon.cards.occlusion_settings import CardOcclusionSettings
from hairloom.addon.cards.settings import CardSettings
from hairloom.addon.cards.steps import result_of
from hairloom.addon.params import SettingsMap
from hairloom.addon.shading.texture_settings import TextureSettings
from hairloom.addon.shading.textures import hair_textures
from hairloom.addon.strands import Surface

VERTICES, ROUNDS = 20_000, 3
#: vertices that are compared, and rays of the reference from each
COMPARED, REFERENCE_RAYS = 150, 1600
#: distance behind a hit at which a ray goes on [m]; it ends with less light than DARK
STEP, DARK = 1.0e-5, 1.0e-3
CARDS = CardSettings(source="clusters", card_count=800, error=0.001)


def occlusion_figures() -> dict[str, float]:
    """ao_seconds: for VERTICES vertices of 256 rays each, the minimum over ROUNDS;
    ao_processor_seconds: likewise, processor time; ao_error, ao_bias: mean absolute and mean
    difference from brute force; ao_deep, ao_open: 5th and 99th percentile of openness."""
    mesh, alpha, head = sintel_cards()
    settings, occluders = CardOcclusionSettings(), [CardOccluder(mesh, alpha)]
    timings = []
    for _ in range(ROUNDS):
        started, processed = time.perf_counter(), time.process_time()
        found = vertex_occlusion(mesh, occluders, [head], settings)
        timings.append((time.perf_counter() - started, time.process_time() - processed))
    seconds, processor = np.min(timings, axis=0) * VERTICES / len(mesh.positions)
    chosen = np.random.default_rng(1).choice(len(found), COMPARED, replace=False)
    error = found[chosen] - brute_force(mesh, alpha, head, chosen, settings)
    return {
        "ao_seconds": float(seconds),
        "ao_processor_seconds": float(processor),
        "ao_vertices": float(len(mesh.positions)),
        "ao_triangles": float(len(mesh.triangles)),
        "ao_error": float(np.abs(error).mean()),
        "ao_bias": float(error.mean()),
        "ao_deep": float(np.percentile(found, 5)),
        "ao_open": float(np.percentile(found, 99)),
    }


def sintel_cards() -> tuple[CardMesh, np.ndarray, Surface]:
    """Cards of Sintel's hair, the alpha of their texture, and her head."""
    rig = sintel_rig()
    assert rig.head is not None
    quick = CardOcclusionSettings(rays=1)
    settings = SettingsMap(CARDS, AtlasSettings(source="made"), quick)
    mesh = result_of(card_build_steps(rig, settings)).finest
    return mesh, hair_textures(TextureSettings(), mesh.atlas.columns).alpha, rig.head


def brute_force(
    mesh: CardMesh,
    alpha: np.ndarray,
    head: Surface,
    chosen: np.ndarray,
    settings: CardOcclusionSettings,
) -> np.ndarray:
    """The openness of the chosen vertices by brute force, (len(chosen),)."""
    count = len(mesh.positions)
    points = np.concatenate([mesh.positions, head.positions]).astype(np.float64)
    triangles = np.concatenate([mesh.triangles, head.triangles + count])
    tree = BVHTree.FromPolygons(points.tolist(), triangles.tolist(), all_triangles=True)
    card = np.zeros(count, np.int64)
    card[mesh.triangles] = mesh.card[:, None]
    scene = _Scene(tree, mesh, alpha, points[triangles], settings)
    random, found = np.random.default_rng(0), []
    for vertex in chosen.tolist():
        directions = random.normal(size=(REFERENCE_RAYS, 3))
        directions /= np.linalg.norm(directions, axis=1, keepdims=True)
        directions += mesh.normal[vertex]
        directions /= np.linalg.norm(directions, axis=1, keepdims=True)
        start = points[vertex]
        found.append(np.mean([scene.light(start, ray, int(card[vertex])) for ray in directions]))
    return np.array(found)


class _Scene:
    def __init__(
        self,
        tree: BVHTree,
        mesh: CardMesh,
        alpha: np.ndarray,
        corners: np.ndarray,
        settings: CardOcclusionSettings,
    ) -> None:
        self._tree, self._mesh, self._alpha = tree, mesh, alpha
        self._corners, self._settings = corners, settings
        self._extent = diagonal_of(mesh)  # the mesh holds all cards

    def light(self, start: np.ndarray, direction: np.ndarray, own: int) -> float:
        """The fraction of light that arrives along one ray."""
        light, travelled = 1.0, 1.0e-4
        origin, ray = Vector(start), Vector(direction)
        while light > DARK:
            place, normal, index, gap = self._tree.ray_cast(origin + ray * travelled, ray)
            if index is None:
                return light
            travelled += gap
            if travelled > self._settings.reach * self._extent:
                return light
            if index >= len(self._mesh.triangles):
                if normal.dot(ray) < 0.0:
                    return 0.0
            elif (
                self._mesh.card[index] != own
                or travelled > self._settings.self_occlusion_distance * self._extent
            ):
                through = 1.0 - self._alpha_at(index, np.array(place))
                light *= through**self._settings.extinction
            travelled += STEP
        return light

    def _alpha_at(self, triangle: int, place: np.ndarray) -> float:
        a, b, c = self._corners[triangle]
        one, two, there = b - a, c - a, place - a
        (bb, bc, cc), (b_there, c_there) = (
            (one @ one, one @ two, two @ two),
            (one @ there, two @ there),
        )
        area = bb * cc - bc * bc
        second, third = (cc * b_there - bc * c_there) / area, (bb * c_there - bc * b_there) / area
        uv = self._mesh.uv[self._mesh.triangles[triangle]]
        u, v = uv[0] + second * (uv[1] - uv[0]) + third * (uv[2] - uv[0])
        height, width = self._alpha.shape
        column = min(max(int(u * width), 0), width - 1)
        return float(self._alpha[min(max(int(v * height), 0), height - 1), column])
