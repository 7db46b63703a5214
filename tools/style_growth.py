"""The tools that hairstyles are grown with: the built-in head, combing, cutting, gravity.

All lengths are in metres on the built-in head, which is upright, looks to -Y and has the origin in
the middle of its skull. Guides are arrays (guide_count, cv_count, 3), roots first.
"""

import importlib
from collections.abc import Callable
from dataclasses import dataclass, fields
from functools import cached_property
from typing import Any

import numpy as np
from extension_loader import PACKAGE
from mathutils.bvhtree import BVHTree

UP = np.array([0.0, 0.0, 1.0])
#: the crown, from which hair grows away in a whorl
CROWN = np.array([0.012, 0.062, 0.092])
#: balls over the right ear and above it, on which hair over the ears lies: centre and radius
EAR_COVER = (((0.0155, 0.012, -0.008), 0.075), ((0.02, 0.012, 0.03), 0.063))
GRAVITY, FRAME_DURATION = np.array([0.0, 0.0, -9.81]), 1.0 / 24.0

#: directions at points (n, 3) of guides, from the guides' roots and the points' arc lengths [m]
type Flow = Callable[[np.ndarray, "Roots", np.ndarray], np.ndarray]


def addon_module(module: str) -> Any:
    return importlib.import_module(f"{PACKAGE}.addon.{module}")


def unit(vectors: np.ndarray) -> np.ndarray:
    return vectors / np.maximum(np.linalg.norm(vectors, axis=-1, keepdims=True), 1e-9)


def smoothstep(low: float, high: float, value: np.ndarray) -> np.ndarray:
    """0 below `low`, 1 above `high` (or the other way round), smooth between."""
    x = np.clip((value - low) / (high - low), 0.0, 1.0)
    return x * x * (3.0 - 2.0 * x)


@dataclass(frozen=True, eq=False)
class Roots:
    """position, normal: (n, 3). triangle: (n,). barycentric: (n, 3). random: (n, 4), 0 to 1."""

    position: np.ndarray
    normal: np.ndarray
    triangle: np.ndarray
    barycentric: np.ndarray
    random: np.ndarray

    @property
    def azimuth(self) -> np.ndarray:
        """Angle from the forehead [degrees], 180 at the nape; the same on both sides."""
        return np.degrees(np.arctan2(np.abs(self.position[:, 0]), -self.position[:, 1] + 0.015))

    @property
    def height(self) -> np.ndarray:
        return self.position[:, 2]

    @property
    def side(self) -> np.ndarray:
        return np.sign(self.position[:, 0] + 1e-9)

    def joined(self, other: "Roots") -> "Roots":
        both = ((getattr(self, each.name), getattr(other, each.name)) for each in fields(self))
        return Roots(*map(np.concatenate, both))

    def take(self, index: np.ndarray) -> "Roots":
        return Roots(
            self.position[index],
            self.normal[index],
            self.triangle[index],
            self.barycentric[index],
            self.random[index],
        )


class Head:
    """The built-in head: where hair grows, and what it stays out of."""

    def __init__(self) -> None:
        bust = addon_module("blender.scene.built_in_head").built_in_head()
        self.surface, self.weights = bust.surface, bust.weights

    @cached_property
    def collider(self) -> Any:
        settings = addon_module("dynamics.settings").DynamicsSettings()
        field = addon_module("blender.colliders.fields").field_of(
            self.surface, settings, place="head"
        )
        return addon_module("dynamics.colliders").PosedCollider(field, np.eye(4), np.eye(4))

    @cached_property
    def with_ears_covered(self) -> tuple[Any, ...]:
        """The head, and balls that make it round where its ears are."""
        colliders = addon_module("dynamics.colliders")
        balls = [
            colliders.SphereCollider((side * x, y, z), radius)
            for side in (-1.0, 1.0)
            for (x, y, z), radius in EAR_COVER
        ]
        return self.collider, *(colliders.PosedCollider(b, np.eye(4), np.eye(4)) for b in balls)

    def skin_distance(
        self, points: np.ndarray, over_ears: bool = False
    ) -> tuple[np.ndarray, np.ndarray]:
        """Distances of points (n, 3) from the skin, negative inside, and directions away from
        it."""
        signed_distance = addon_module("dynamics.colliders.signed_distance").signed_distance
        colliders = self.with_ears_covered if over_ears else (self.collider,)
        distance, outward = signed_distance(points, colliders, 0.08)
        return distance.astype(float), outward.astype(float)

    def roots(
        self, count: int, density: Callable[[np.ndarray], np.ndarray] | str, seed: int = 1
    ) -> Roots:
        """Roots spread evenly over where the density, or a vertex group, is above 0."""
        if isinstance(density, str):
            weight = self.weights[density]
        else:
            weight = density(self.surface.positions)
        pieces = addon_module("groom.triangle_subdivision").Pieces.of(self.surface, weight)
        roots = addon_module("groom.blue_noise").spread_roots(pieces, count, seed)
        corners = self.surface.triangles[roots.triangle]
        position = np.einsum("nk,nkj->nj", roots.barycentric, self.surface.positions[corners])
        normal = self.surface.vertex_normals()[corners].astype(float)
        normal = unit(np.einsum("nk,nkj->nj", roots.barycentric, normal))
        random = np.random.default_rng(seed).random((len(position), 4))
        return Roots(position, normal, roots.triangle, roots.barycentric, random)

    def roots_near(self, points: np.ndarray, seed: int = 1) -> Roots:
        """Roots on the skin where it is nearest to points (n, 3)."""
        search = addon_module("strands.closest_point").search_of(self.surface)
        nearest = search.closest(points)
        corners = self.surface.triangles[nearest.triangle]
        normal = self.surface.vertex_normals()[corners].astype(float)
        normal = unit(np.einsum("nk,nkj->nj", nearest.barycentric, normal))
        random = np.random.default_rng(seed).random((len(points), 4))
        return Roots(nearest.point, normal, nearest.triangle, nearest.barycentric, random)

    def exit_points(self, origin: np.ndarray, directions: np.ndarray) -> np.ndarray:
        """Where rays from a point inside the head leave it. directions: (n, 3)."""
        hits = (self._tree.ray_cast(origin, direction)[0] for direction in directions)
        return np.array(list(hits))

    @cached_property
    def _tree(self) -> Any:
        return BVHTree.FromPolygons(
            self.surface.positions.tolist(), self.surface.triangles.tolist()
        )

    def weight(self, roots: Roots, group: str) -> np.ndarray:
        """A vertex group's weights at roots, (n,)."""
        weights = self.weights[group][self.surface.triangles[roots.triangle]]
        weight: np.ndarray = (roots.barycentric * weights).sum(axis=1)
        return weight

    def combed(
        self,
        roots: Roots,
        flow: Flow,
        length: np.ndarray | float,
        cv_count: int = 16,
        *,
        lift: np.ndarray | float = 0.4,
        flow_alignment: np.ndarray | float = 0.5,
        skin_attraction: Callable[[np.ndarray], np.ndarray] | None = None,
        clearance: Callable[[np.ndarray], np.ndarray] = lambda arc_length: 0.002 + 0.1 * arc_length,
        over_ears: bool = False,
    ) -> np.ndarray:
        """Guides that leave the skin and turn into the flow, outside of the head.

        Args:
            length: of each [m].
            lift: how much they leave along the normal instead of the flow, 0 to 1.
            flow_alignment: how much they turn into the flow on each centimetre, 0 to 1.
            skin_attraction: how much they follow the skin, at points (n, 3): from 1 on they do not
                leave it where it turns away. Also how much they turn back to it, for each
                centimetre of distance beyond `clearance`.
            clearance: minimum distance from the skin, by arc length [m].
            over_ears: whether they lie over the ears rather than around them.
        """
        count = len(roots.position)
        step = np.broadcast_to(np.asarray(length, float), (count,)) / (cv_count - 1)
        lift = np.broadcast_to(np.asarray(lift, float), (count,))[:, None]
        blend = 1.0 - (1.0 - np.clip(flow_alignment, 0.0, 0.999)) ** (100.0 * step)
        blend = np.broadcast_to(blend, (count,))[:, None]
        guides = np.empty((count, cv_count, 3))
        guides[:, 0], arc_length = roots.position, np.zeros(count)
        root_distance = np.minimum(self.skin_distance(roots.position, over_ears)[0], 0.0)
        direction = unit(
            lift * roots.normal + (1.0 - lift) * unit(flow(roots.position, roots, arc_length))
        )
        for cv in range(1, cv_count):
            arc_length = arc_length + step
            if cv > 1:
                target = unit(flow(guides[:, cv - 1], roots, arc_length))
                if skin_attraction is not None:
                    distance, outward = self.skin_distance(guides[:, cv - 1], over_ears)
                    strength = skin_attraction(guides[:, cv - 1])
                    # hair that lies on the head does not leave it where it turns away
                    leaving = np.maximum((target * outward).sum(axis=1), 0.0)
                    excess = np.clip((distance - clearance(arc_length)) / 0.01, 0.0, 2.0)
                    pull = np.minimum(strength, 1.0) * leaving + strength * excess
                    target = unit(target - pull[:, None] * outward)
                direction = unit((1.0 - blend) * direction + blend * target)
            point = guides[:, cv - 1] + step[:, None] * direction
            for _ in range(2):
                distance, outward = self.skin_distance(point, over_ears)
                min_distance = np.minimum(clearance(arc_length), root_distance + arc_length)
                shortfall = np.maximum(min_distance - distance, 0.0)
                point = point + shortfall[:, None] * outward
            direction = unit(point - guides[:, cv - 1])
            guides[:, cv] = guides[:, cv - 1] + step[:, None] * direction
        return guides

    def settled(
        self,
        roots: Roots,
        guides: np.ndarray,
        seconds: float = 1.5,
        *,
        over_ears: bool = False,
        **settings: float,
    ) -> np.ndarray:
        """Guides after they have fallen onto head and shoulders, by the extension's solver.

        Args:
            settings: of dynamics, instead of those of hair that hardly keeps its style.
        """
        rig_flow, motion_flow = addon_module("rig_flow"), addon_module("motion_flow")
        all_settings = addon_module("parameters").ALL_SETTINGS
        defaults = {
            "style_root": 2.0,
            "style_tip": 0.0,
            "style_along": (1.0, 0.3, 0.0, 0.0, 0.0),
            "bend": 0.6,
            "sag_compensation": 0.0,
            "damping": 3.0,
            "friction": 0.3,
            "radius_root": 0.003,
            "radius_tip": 0.006,
        }
        dynamics = all_settings["dynamics"].from_dict(defaults | settings, "style")
        strands = self.strands(roots, guides)
        guide_settings = all_settings["guides"](guide_count=len(guides), cv_count=guides.shape[1])
        rig = rig_flow.prepare(strands, self.surface, guide_settings, place="style")
        motion = motion_flow.begin(rig, rig.rest_pose)
        colliders = self.with_ears_covered if over_ears else (self.collider,)
        for _ in range(round(seconds / FRAME_DURATION)):
            motion = motion_flow.advance(
                rig,
                motion,
                motion_flow.FrameInput(rig.rest_pose, colliders, dynamics, GRAVITY, FRAME_DURATION),
            )
        result = guides.copy()
        result[rig.guides] = motion.guides
        return self.pushed_out(result)

    def gathered(
        self, roots: Roots, knot: np.ndarray, cv_count: int = 20, clearance: float = 0.004
    ) -> np.ndarray:
        """Guides drawn tight over the head to a knot, by the shortest way on it.

        Args:
            knot: (n, 3), where each ends, outside of the head.
            clearance: distance from the skin that they keep, except near roots.
        """
        center = np.array([0.0, 0.015, 0.015])
        start, end = roots.position - center, knot - center
        fraction = np.linspace(0.0, 1.0, cv_count)[None, :, None]
        radius = (1.0 - fraction) * np.linalg.norm(start, axis=1)[:, None, None]
        radius = radius + fraction * np.linalg.norm(end, axis=1)[:, None, None]
        start_direction, end_direction = unit(start)[:, None], unit(end)[:, None]
        angle = np.arccos(
            np.clip((start_direction * end_direction).sum(axis=2, keepdims=True), -0.999, 0.999)
        )
        direction = (
            np.sin((1.0 - fraction) * angle) * start_direction
            + np.sin(fraction * angle) * end_direction
        )
        guides = center + radius * direction / np.sin(angle)
        height = clearance * np.minimum(6.0 * fraction[0, :, 0], 1.0)
        for _ in range(25):
            inner = 0.5 * guides[:, 1:-1] + 0.25 * (guides[:, :-2] + guides[:, 2:])
            distance, outward = self.skin_distance(inner.reshape(-1, 3))
            shortfall = np.broadcast_to(height[1:-1], inner.shape[:2]).ravel() - distance
            inner += (np.maximum(shortfall, 0.0)[:, None] * outward).reshape(inner.shape)
            guides[:, 1:-1] = inner
        return guides

    def pushed_out(self, guides: np.ndarray, clearance: float = 0.0015) -> np.ndarray:
        """Guides whose points are at least this far from the skin, except near roots."""
        result = guides.copy()
        for cv in range(1, guides.shape[1]):
            for _ in range(3):
                distance, outward = self.skin_distance(result[:, cv])
                arc_length = np.linalg.norm(result[:, cv] - result[:, 0], axis=1)
                shortfall = np.maximum(np.minimum(clearance, 0.5 * arc_length) - distance, 0.0)
                result[:, cv] += shortfall[:, None] * outward
        return result

    def strands(self, roots: Roots, guides: np.ndarray, group: np.ndarray | None = None) -> Any:
        """Guides as a StrandSet that is bound to the head."""
        strands = addon_module("groom.bound_strands").bound_strands(
            guides, roots.triangle, roots.barycentric, self.surface
        )
        if group is None:
            return strands
        return importlib.import_module("dataclasses").replace(strands, group=group)

    def shapes(self, roots: Roots, guides: np.ndarray, group: np.ndarray | None = None) -> Any:
        """Guides as a style stores them."""
        rooted = addon_module("strands.rooted_shapes").RootedShapes
        return rooted.of(self.strands(roots, guides, group), self.surface)


def waved(guides: np.ndarray, height: np.ndarray, length: float, phase: np.ndarray) -> np.ndarray:
    """Guides with flat sideways waves, like long hair; guides that lie over each other wave at the
    same heights.

    Args:
        height: of the waves at each point (n, cv_count) [m].
        length: of one wave, downwards [m].
        phase: of each guide (n,) [rad].
    """
    tangent = unit(np.gradient(guides, axis=1))
    outward = unit(guides * (1.0, 1.0, 0.0))
    sideways = unit(np.cross(tangent, outward))
    angle = phase[:, None] - 2.0 * np.pi * guides[..., 2] / length
    wave = np.sin(angle)[..., None] * sideways
    # a guide twists a little where it turns back
    twist = 0.3 * np.sin(angle + 0.6 * np.pi)[..., None] * np.cross(sideways, tangent)
    return guides + height[..., None] * (wave + twist)


def cut(guides: np.ndarray, inside: Callable[[np.ndarray], np.ndarray]) -> np.ndarray:
    """Guides cut where they leave a shape for the first time, with as many points as before.

    Args:
        inside: how far points (n, 3) are within the shape, negative outside, (n,).
    """
    count, cv_count = guides.shape[:2]
    value = inside(guides.reshape(-1, 3)).reshape(count, cv_count)
    is_outside = value < 0.0
    is_outside[:, 0] = False
    first = np.where(is_outside.any(axis=1), is_outside.argmax(axis=1), cv_count - 1)
    row = np.arange(count)
    value_before, value_after = value[row, first - 1], value[row, first]
    fraction = np.where(
        value_after < 0.0, value_before / np.maximum(value_before - value_after, 1e-9), 1.0
    )
    return shortened(guides, np.clip(first - 1 + fraction, 0.35, cv_count - 1.0))


def shortened(guides: np.ndarray, end: np.ndarray) -> np.ndarray:
    """Guides up to these positions, in points from the root (n,), with as many points as before."""
    cv_count = guides.shape[1]
    position = end[:, None] * np.linspace(0.0, 1.0, cv_count)
    left = np.minimum(position.astype(int), cv_count - 2)
    fraction = (position - left)[..., None]
    row = np.arange(len(guides))[:, None]
    return (1.0 - fraction) * guides[row, left] + fraction * guides[row, left + 1]


def resampled(paths: np.ndarray, cv_count: int) -> np.ndarray:
    """Guides along these paths (n, m, 3), with points evenly spaced along each."""
    lengths = np.linalg.norm(np.diff(paths, axis=1), axis=2)
    arc_length = np.concatenate([np.zeros((len(paths), 1)), np.cumsum(lengths, axis=1)], axis=1)
    guides = np.empty((len(paths), cv_count, 3))
    for guide, (path, distance) in enumerate(zip(paths, arc_length, strict=True)):
        targets = np.linspace(0.0, distance[-1], cv_count)
        guides[guide] = np.stack(
            [np.interp(targets, distance, path[:, k]) for k in range(3)], axis=1
        )
    return guides


def tangent_to_skin(direction: np.ndarray, roots: Roots) -> np.ndarray:
    """Directions projected onto the skin at the roots."""
    return unit(direction - roots.normal * (direction * roots.normal).sum(axis=1)[:, None])
