"""Strands carried on the CPU, beside Blender's node "Interpolate Hair Curves" and plain numpy.

762 guides on a ball, combed, carry 4,095, 20,000 and 100,000 strands of 30 points. The node gets
the same guides of 30 points, and three of them per strand; a frame of it is an evaluation of the
depsgraph after the guides are tagged, in which it always computes roots and weights again. Ours is
`ride`, as in a frame of the preview without compute shaders: rest shapes, and weights for the roots
that the node chose, are computed beforehand. The plain numpy variants only add up displacements, so
that strands neither turn nor keep their lengths.
"""

from __future__ import annotations

import tracemalloc
from collections.abc import Callable
from functools import partial
from typing import Any

import bpy
import numpy as np
from _blender_nodes import shipped_node_group
from _shaken_head import RADIUS, guides_on, surface_of
from _turns import in_turns, milliseconds

from hairloom.addon.blender.scene.curves import read_curves, write_curves
from hairloom.addon.groom.weights import GuideWeights, guide_weights
from hairloom.addon.refine.ride import Riders, ride
from hairloom.addon.refine.smooth import points_at
from hairloom.addon.strands import StrandSet

GUIDES, POINTS, COUNTS = 762, 30, (4095, 20_000, 100_000)
GROUP = "Interpolate Hair Curves"
ASSETS = "assets/nodes/procedural_hair_node_assets.blend"
ROUNDS, CHUNK = 25, 512

Mix = Callable[[np.ndarray, np.ndarray, GuideWeights], np.ndarray]


class InterpolatedHair:
    """Guides as hair curves on a ball, with Blender's node on them."""

    def __init__(self, head: bpy.types.Object, guides: StrandSet) -> None:
        self._hair = write_curves("Guides", guides, head, bpy.context.scene.collection)
        self._modifier = self._hair.modifiers.new(GROUP, "NODES")
        self._modifier.node_group = shipped_node_group(GROUP, ASSETS)
        self._set(Input_10=3)  # Interpolation Guides

    def strands(self, count: int) -> StrandSet:
        """The node's strands, at a density that makes about this many."""
        density = count / (4.0 * np.pi * RADIUS**2)
        for _ in range(4):
            self._set(Input_15=density)
            made = self._evaluated()
            density *= count / made.strand_count
        return made

    def remove(self) -> None:
        bpy.data.objects.remove(self._hair)

    def _set(self, **values: Any) -> None:
        for name, value in values.items():
            getattr(self._modifier.properties.inputs, name).value = value

    def evaluate(self) -> None:
        self._hair.data.update_tag()
        bpy.context.view_layer.update()

    def _evaluated(self) -> StrandSet:
        self.evaluate()
        return read_curves(self._hair, bpy.context.evaluated_depsgraph_get()).strands


def gathered(rest: np.ndarray, motion: np.ndarray, weights: GuideWeights) -> np.ndarray:
    """Three gathers and their sum."""
    one, two, three = (motion[index] for index in weights.guide.T)
    w = weights.weight[:, :, None, None]
    return rest + one * w[:, 0] + two * w[:, 1] + three * w[:, 2]


def summed(rest: np.ndarray, motion: np.ndarray, weights: GuideWeights) -> np.ndarray:
    """One einsum over all."""
    return rest + np.einsum("nk,nkpj->npj", weights.weight, motion[weights.guide])


def summed_in_chunks(rest: np.ndarray, motion: np.ndarray, weights: GuideWeights) -> np.ndarray:
    """The same in pieces that fit into the cache."""
    flat = motion.reshape(len(motion), -1)
    result = rest.reshape(len(rest), -1).copy()
    for start in range(0, len(result), CHUNK):
        part = slice(start, start + CHUNK)
        guide_values = flat[weights.guide[part]]
        result[part] += np.einsum("nk,nkj->nj", weights.weight[part], guide_values)
    return result.reshape(rest.shape)


PLAIN: tuple[Mix, ...] = (gathered, summed, summed_in_chunks)


def node_figures() -> dict[str, float]:
    """Milliseconds, the minimum over ROUNDS in turns, and ratios (bench/refinement.py).

    node_ratio_N: the node's time over ours. numpy_ratio_N: our time over that of the fastest plain
    variant. peak_memory_ratio: peak memory over the size of the result.
    """
    bpy.ops.mesh.primitive_uv_sphere_add(radius=RADIUS, segments=48, ring_count=24)
    head = bpy.context.object
    guides = guides_on(surface_of(head), GUIDES)
    guide_rest = _with_points(guides.grid)
    guide_now = guide_rest + np.random.default_rng(1).normal(0.0, 0.01, guide_rest.shape)
    guide_now = guide_now.astype(np.float32)
    motion = guide_now - guide_rest
    node = InterpolatedHair(head, _strand_set(guide_rest, guides))
    figures: dict[str, float] = {}
    peaks = []
    for count in COUNTS:
        made = node.strands(count)
        assert abs(made.strand_count / count - 1.0) < 0.02, made.strand_count
        assert made.grid.shape[1] == POINTS
        weights = _weights(made.grid[:, 0], guides, count)
        rest = summed_in_chunks(np.zeros((count, POINTS, 3), np.float32), guide_rest, weights)
        strands = _strand_set(rest)
        riders = Riders.of(strands, guide_rest, weights)
        carry = partial(ride, strands.points, riders, guide_rest, guide_now)
        works = {"node": node.evaluate, "ride": carry}
        works |= {mix.__name__: partial(mix, rest, motion, weights) for mix in PLAIN}
        times = in_turns(
            {name: partial(milliseconds, work) for name, work in works.items()}, ROUNDS
        )
        node_ms = min(times["node"]) * count / made.strand_count
        ours, plain = min(times["ride"]), min(min(times[mix.__name__]) for mix in PLAIN)
        figures |= {
            f"node_ms_{count}": round(node_ms, 2),
            f"ride_ms_{count}": round(ours, 3),
            f"numpy_ms_{count}": round(plain, 3),
            f"node_ratio_{count}": round(node_ms / ours, 1),
            f"numpy_ratio_{count}": round(ours / plain, 2),
        }
        peaks.append(_peak_ratio(carry))
    node.remove()
    bpy.data.objects.remove(head)
    return figures | {"peak_memory_ratio": round(max(peaks), 2)}


def _with_points(grid: np.ndarray) -> np.ndarray:
    """Strands as POINTS points of their curves, (strand_count, POINTS, 3)."""
    strand_count, cv_count, _ = grid.shape
    place = np.linspace(0.0, cv_count - 1, POINTS)
    segment = np.minimum(place.astype(int), cv_count - 2)
    strand = np.repeat(np.arange(strand_count), POINTS)
    points = points_at(
        grid, strand, np.tile(segment, strand_count), np.tile(place - segment, strand_count)
    )
    return points.reshape(strand_count, POINTS, 3).astype(np.float32)


def _peak_ratio(work: Callable[[], np.ndarray]) -> float:
    tracemalloc.start()
    size = work().nbytes
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    return peak / size


def _weights(roots: np.ndarray, guides: StrandSet, count: int) -> GuideWeights:
    """Weights of `count` strands at these roots, of which some repeat or drop out to make the
    count."""
    roots = roots[np.linspace(0, len(roots) - 1, count).round().astype(int)]
    group = np.zeros(GUIDES, np.int32)
    return guide_weights(roots, np.zeros(count, np.int32), guides.grid[:, 0], group)


def _strand_set(grid: np.ndarray, like: StrandSet | None = None) -> StrandSet:
    count, points, _ = grid.shape
    return StrandSet(
        points=grid.reshape(-1, 3),
        offsets=np.arange(count + 1) * points,
        radius=np.full(count * points, 4.0e-5),
        group=np.zeros(count),
        root_uv=None if like is None else like.root_uv,
    )
