"""The tools that hairstyles are grown with: the built-in head, combing, cutting, gravity.

All lengths are in metres on the built-in head, which is upright, looks to -Y and has the origin in
the middle of its skull. A lock is one guide; locks are (lock_count, cv_count, 3), roots first.
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
#: balls over the right ear and above it, which hair over the ears lies on: place and radius
EAR_COVER = (((0.0155, 0.012, -0.008), 0.075), ((0.02, 0.012, 0.03), 0.063))
GRAVITY, FRAME = np.array([0.0, 0.0, -9.81]), 1.0 / 24.0

#: directions at points (n, 3) of locks, from the locks' roots and the points' `reached` (n,) [m]
type Flow = Callable[[np.ndarray, "Roots", np.ndarray], np.ndarray]


def addon_module(module: str) -> Any:
    return importlib.import_module(f"{PACKAGE}.addon.{module}")


def unit(vectors: np.ndarray) -> np.ndarray:
    return vectors / np.maximum(np.linalg.norm(vectors, axis=-1, keepdims=True), 1e-9)


def ramp(low: float, high: float, value: np.ndarray) -> np.ndarray:
    """0 below `low`, 1 above `high` (or the other way round), smooth between."""
    x = np.clip((value - low) / (high - low), 0.0, 1.0)
    return x * x * (3.0 - 2.0 * x)


@dataclass(frozen=True, eq=False)
class Roots:
    """place, normal: (n, 3). triangle: (n,). barycentric: (n, 3). random: (n, 4) from 0 to 1."""

    place: np.ndarray
    normal: np.ndarray
    triangle: np.ndarray
    barycentric: np.ndarray
    random: np.ndarray

    @property
    def around(self) -> np.ndarray:
        """Angle from the forehead [degrees], 180 at the nape; the same on both sides."""
        return np.degrees(np.arctan2(np.abs(self.place[:, 0]), -self.place[:, 1] + 0.015))

    @property
    def height(self) -> np.ndarray:
        return self.place[:, 2]

    @property
    def side(self) -> np.ndarray:
        return np.sign(self.place[:, 0] + 1e-9)

    def and_also(self, other: "Roots") -> "Roots":
        both = ((getattr(self, each.name), getattr(other, each.name)) for each in fields(self))
        return Roots(*map(np.concatenate, both))

    def take(self, index: np.ndarray) -> "Roots":
        return Roots(
            self.place[index],
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

    def away(self, points: np.ndarray, over_ears: bool = False) -> tuple[np.ndarray, np.ndarray]:
        """Distances of points (n, 3) from the skin, negative inside, and directions away from
        it."""
        found = addon_module("dynamics.colliders.signed_distance").signed_distance
        solid = self.with_ears_covered if over_ears else (self.collider,)
        distance, outward = found(points, solid, 0.08)
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
        found = addon_module("groom.blue_noise").spread_roots(pieces, count, seed)
        corners = self.surface.triangles[found.triangle]
        place = np.einsum("nk,nkj->nj", found.barycentric, self.surface.positions[corners])
        normal = self.surface.vertex_normals()[corners].astype(float)
        normal = unit(np.einsum("nk,nkj->nj", found.barycentric, normal))
        random = np.random.default_rng(seed).random((len(place), 4))
        return Roots(place, normal, found.triangle, found.barycentric, random)

    def roots_near(self, points: np.ndarray, seed: int = 1) -> Roots:
        """Roots on the skin where it is nearest to points (n, 3)."""
        search = addon_module("strands.closest_point").search_of(self.surface)
        found = search.closest(points)
        corners = self.surface.triangles[found.triangle]
        normal = self.surface.vertex_normals()[corners].astype(float)
        normal = unit(np.einsum("nk,nkj->nj", found.barycentric, normal))
        random = np.random.default_rng(seed).random((len(points), 4))
        return Roots(found.point, normal, found.triangle, found.barycentric, random)

    def left_by(self, middle: np.ndarray, ray: np.ndarray) -> np.ndarray:
        """Where rays (n, 3) from a place within the head leave it."""
        hits = (self._tree.ray_cast(middle, direction)[0] for direction in ray)
        return np.array(list(hits))

    @cached_property
    def _tree(self) -> Any:
        return BVHTree.FromPolygons(
            self.surface.positions.tolist(), self.surface.triangles.tolist()
        )

    def weight(self, roots: Roots, group: str) -> np.ndarray:
        """A vertex group's weights at roots, (n,)."""
        weights = self.weights[group][self.surface.triangles[roots.triangle]]
        found: np.ndarray = (roots.barycentric * weights).sum(axis=1)
        return found

    def combed(
        self,
        roots: Roots,
        flow: Flow,
        length: np.ndarray | float,
        cv_count: int = 16,
        *,
        lift: np.ndarray | float = 0.4,
        follow: np.ndarray | float = 0.5,
        hug: Callable[[np.ndarray], np.ndarray] | None = None,
        clearance: Callable[[np.ndarray], np.ndarray] = lambda reached: 0.002 + 0.1 * reached,
        over_ears: bool = False,
    ) -> np.ndarray:
        """Locks that leave the skin and turn into the flow, outside of the head.

        Args:
            length: of each [m].
            lift: how much they leave along the normal instead of the flow, 0 to 1.
            follow: how much they turn into the flow on each centimetre, 0 to 1.
            hug: how much they turn back to the skin, at points (n, 3), for each centimetre of
                distance beyond `clearance`.
            clearance: least distance from the skin, by the length reached [m].
            over_ears: whether they lie over the ears rather than around them.
        """
        count = len(roots.place)
        step = np.broadcast_to(np.asarray(length, float), (count,)) / (cv_count - 1)
        lift = np.broadcast_to(np.asarray(lift, float), (count,))[:, None]
        turn = 1.0 - (1.0 - np.clip(follow, 0.0, 0.999)) ** (100.0 * step)
        turn = np.broadcast_to(turn, (count,))[:, None]
        locks = np.empty((count, cv_count, 3))
        locks[:, 0], reached = roots.place, np.zeros(count)
        at_root = np.minimum(self.away(roots.place, over_ears)[0], 0.0)
        ahead = unit(lift * roots.normal + (1.0 - lift) * unit(flow(roots.place, roots, reached)))
        for cv in range(1, cv_count):
            reached = reached + step
            if cv > 1:
                wanted = unit(flow(locks[:, cv - 1], roots, reached))
                if hug is not None:
                    distance, outward = self.away(locks[:, cv - 1], over_ears)
                    too_far = np.clip((distance - clearance(reached)) / 0.01, 0.0, 2.0)
                    back = hug(locks[:, cv - 1]) * too_far
                    wanted = unit(wanted - back[:, None] * outward)
                ahead = unit((1.0 - turn) * ahead + turn * wanted)
            point = locks[:, cv - 1] + step[:, None] * ahead
            for _ in range(2):
                distance, outward = self.away(point, over_ears)
                kept = np.minimum(clearance(reached), at_root + reached)
                lacking = np.maximum(kept - distance, 0.0)
                point = point + lacking[:, None] * outward
            ahead = unit(point - locks[:, cv - 1])
            locks[:, cv] = locks[:, cv - 1] + step[:, None] * ahead
        return locks

    def settled(
        self,
        roots: Roots,
        locks: np.ndarray,
        seconds: float = 1.5,
        *,
        over_ears: bool = False,
        **settings: float,
    ) -> np.ndarray:
        """Locks after they have fallen onto head and shoulders, by the extension's solver.

        Args:
            settings: of dynamics, instead of those of hair that hardly keeps its style.
        """
        rig_flow, motion_flow = addon_module("rig_flow"), addon_module("motion_flow")
        all_settings = addon_module("parameters").ALL_SETTINGS
        loose = {
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
        dynamics = all_settings["dynamics"].from_dict(loose | settings, "style")
        strands = self.strands(roots, locks)
        guides = all_settings["guides"](guide_count=len(locks), cv_count=locks.shape[1])
        rig = rig_flow.prepare(strands, self.surface, guides, place="style")
        motion = motion_flow.begin(rig, rig.rest_pose)
        solid = self.with_ears_covered if over_ears else (self.collider,)
        for _ in range(round(seconds / FRAME)):
            motion = motion_flow.advance(
                rig, motion, motion_flow.FrameInput(rig.rest_pose, solid, dynamics, GRAVITY, FRAME)
            )
        fallen = locks.copy()
        fallen[rig.guides] = motion.guides
        return self.pushed_out(fallen)

    def gathered(
        self, roots: Roots, knot: np.ndarray, cv_count: int = 20, clearance: float = 0.004
    ) -> np.ndarray:
        """Locks drawn tight over the head to a knot, by the shortest way on it.

        Args:
            knot: (n, 3), where each ends, outside of the head.
            clearance: distance from the skin that they keep, except near roots.
        """
        middle = np.array([0.0, 0.015, 0.015])
        first, last = roots.place - middle, knot - middle
        part = np.linspace(0.0, 1.0, cv_count)[None, :, None]
        radius = (1.0 - part) * np.linalg.norm(first, axis=1)[:, None, None]
        radius = radius + part * np.linalg.norm(last, axis=1)[:, None, None]
        one, other = unit(first)[:, None], unit(last)[:, None]
        angle = np.arccos(np.clip((one * other).sum(axis=2, keepdims=True), -0.999, 0.999))
        turned = np.sin((1.0 - part) * angle) * one + np.sin(part * angle) * other
        locks = middle + radius * turned / np.sin(angle)
        height = clearance * np.minimum(6.0 * part[0, :, 0], 1.0)
        for _ in range(25):
            inner = 0.5 * locks[:, 1:-1] + 0.25 * (locks[:, :-2] + locks[:, 2:])
            distance, outward = self.away(inner.reshape(-1, 3))
            lacking = np.broadcast_to(height[1:-1], inner.shape[:2]).ravel() - distance
            inner += (np.maximum(lacking, 0.0)[:, None] * outward).reshape(inner.shape)
            locks[:, 1:-1] = inner
        return locks

    def pushed_out(self, locks: np.ndarray, clearance: float = 0.0015) -> np.ndarray:
        """Locks whose points are at least this far from the skin, except near roots."""
        kept = locks.copy()
        for cv in range(1, locks.shape[1]):
            for _ in range(3):
                distance, outward = self.away(kept[:, cv])
                reached = np.linalg.norm(kept[:, cv] - kept[:, 0], axis=1)
                lacking = np.maximum(np.minimum(clearance, 0.5 * reached) - distance, 0.0)
                kept[:, cv] += lacking[:, None] * outward
        return kept

    def strands(self, roots: Roots, locks: np.ndarray, group: np.ndarray | None = None) -> Any:
        """Locks as a StrandSet that is bound to the head."""
        strands = addon_module("groom.bound_strands").bound_strands(
            locks, roots.triangle, roots.barycentric, self.surface
        )
        if group is None:
            return strands
        return importlib.import_module("dataclasses").replace(strands, group=group)

    def shapes(self, roots: Roots, locks: np.ndarray, group: np.ndarray | None = None) -> Any:
        """Locks as a style stores them."""
        rooted = addon_module("strands.rooted_shapes").RootedShapes
        return rooted.of(self.strands(roots, locks, group), self.surface)


def waved(locks: np.ndarray, height: np.ndarray, length: float, phase: np.ndarray) -> np.ndarray:
    """Locks with flat sideways waves, like long hair; locks that lie over each other wave at the
    same heights.

    Args:
        height: of the waves at each point (n, cv_count) [m].
        length: of one wave, downwards [m].
        phase: of each lock (n,) [rad].
    """
    ahead = unit(np.gradient(locks, axis=1))
    out = unit(locks * (1.0, 1.0, 0.0))
    across = unit(np.cross(ahead, out))
    turn = phase[:, None] - 2.0 * np.pi * locks[..., 2] / length
    aside = np.sin(turn)[..., None] * across
    # a lock twists a little where it turns back
    off = 0.3 * np.sin(turn + 0.6 * np.pi)[..., None] * np.cross(across, ahead)
    return locks + height[..., None] * (aside + off)


def cut(locks: np.ndarray, inside: Callable[[np.ndarray], np.ndarray]) -> np.ndarray:
    """Locks cut where they leave a shape for the first time, with as many points as before.

    Args:
        inside: how far points (n, 3) are within the shape, negative outside, (n,).
    """
    count, cv_count = locks.shape[:2]
    value = inside(locks.reshape(-1, 3)).reshape(count, cv_count)
    is_out = value < 0.0
    is_out[:, 0] = False
    first = np.where(is_out.any(axis=1), is_out.argmax(axis=1), cv_count - 1)
    row = np.arange(count)
    before, after = value[row, first - 1], value[row, first]
    part = np.where(after < 0.0, before / np.maximum(before - after, 1e-9), 1.0)
    return shortened(locks, np.clip(first - 1 + part, 0.35, cv_count - 1.0))


def shortened(locks: np.ndarray, last: np.ndarray) -> np.ndarray:
    """Locks up to these places, in points from the root (n,), with as many points as before."""
    cv_count = locks.shape[1]
    place = last[:, None] * np.linspace(0.0, 1.0, cv_count)
    left = np.minimum(place.astype(int), cv_count - 2)
    inside = (place - left)[..., None]
    row = np.arange(len(locks))[:, None]
    return (1.0 - inside) * locks[row, left] + inside * locks[row, left + 1]


def evenly(paths: np.ndarray, cv_count: int) -> np.ndarray:
    """Locks along these paths (n, m, 3), with points evenly spaced along each."""
    steps = np.linalg.norm(np.diff(paths, axis=1), axis=2)
    reached = np.concatenate([np.zeros((len(paths), 1)), np.cumsum(steps, axis=1)], axis=1)
    locks = np.empty((len(paths), cv_count, 3))
    for lock, (path, along) in enumerate(zip(paths, reached, strict=True)):
        wanted = np.linspace(0.0, along[-1], cv_count)
        locks[lock] = np.stack([np.interp(wanted, along, path[:, k]) for k in range(3)], axis=1)
    return locks


def along_skin(direction: np.ndarray, roots: Roots) -> np.ndarray:
    """Directions projected onto the skin at the roots."""
    return unit(direction - roots.normal * (direction * roots.normal).sum(axis=1)[:, None])
