"""A ponytail on the built-in head: hair from all over the scalp, through one ring, then down."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from hairloom.addon import rig_flow
from hairloom.addon.blender.scene.built_in_head import BuiltInHead, built_in_head
from hairloom.addon.groom.children_settings import ChildrenSettings
from hairloom.addon.groom.grow import grow
from hairloom.addon.groom.holds import anchors_of
from hairloom.addon.groom.settings import GrowSettings, GuideSettings
from hairloom.addon.groom.ties import Holders, Tie
from hairloom.addon.rig_flow import Pose, Rig
from hairloom.addon.strands import StrandSet

#: Direction from the skull's middle to the ring; its distance from the skin, and its radius [m].
TOWARDS, BEYOND, RADIUS = np.array([0.0, 0.8, 0.6]), 0.025, 0.014
#: Length of hair behind the ring, and distance of hair from the skin [m].
TAIL, LIFT = 0.28, 0.006
POINTS = 24


@dataclass(frozen=True, eq=False)
class Ponytail:
    """rig: with the ring as its only tie. middle: (3,) of the ring [m]. axis: (3,) unit."""

    rig: Rig
    bust: BuiltInHead
    middle: np.ndarray
    axis: np.ndarray

    def pose(self, matrix: np.ndarray) -> Pose:
        """Head and ring moved by one matrix (4, 4)."""
        head = self.bust.surface.positions @ matrix[:3, :3].T + matrix[:3, 3]
        assert self.rig.holds is not None
        anchors = anchors_of(self.rig.holds, matrix[None], None)
        return Pose(head.astype(np.float32), matrix, anchors)


def ponytail(count: int, *, children: ChildrenSettings | None = None) -> Ponytail:
    """`count` strands of the artist, 30 to 50 cm long."""
    bust = built_in_head()
    grown = grow(bust.surface, GrowSettings(strand_count=count), bust.weights["scalp"])
    axis = TOWARDS / np.linalg.norm(TOWARDS)
    middle = axis * (_skin(bust, axis[None])[0] + BEYOND)
    strands = _combed(grown, bust, middle, axis)
    shape = np.eye(4)
    shape[:3, 2] = axis
    shape[:3, 0] = np.cross(axis, [1.0, 0.0, 0.0]) / np.linalg.norm(np.cross(axis, [1.0, 0.0, 0.0]))
    shape[:3, 1] = np.cross(axis, shape[:3, 0])
    shape[:3, :3] *= 1.2 * RADIUS
    shape[:3, 3] = middle
    rig = rig_flow.prepare(
        strands,
        bust.surface,
        GuideSettings(cv_count=POINTS),
        place="ponytail",
        children=children,
        placement=rig_flow.ChildPlacement(bust.weights["scalp"] if children is not None else None),
        widths="auto",
        holders=Holders((Tie("Scrunchy", shape),)),
    )
    return Ponytail(rig, bust, middle, axis)


def _combed(grown: StrandSet, bust: BuiltInHead, middle: np.ndarray, axis: np.ndarray) -> StrandSet:
    """The strands, from each root along the skin to the ring, through it and down."""
    random = np.random.default_rng(1)
    roots, count = grown.roots.astype(np.float64), grown.strand_count
    angle, away = random.uniform(0.0, 2.0 * np.pi, count), RADIUS * random.random(count) ** 0.5
    across = np.cross(axis, [1.0, 0.0, 0.0])
    across /= np.linalg.norm(across)
    aside = np.cos(angle)[:, None] * across + np.sin(angle)[:, None] * np.cross(axis, across)
    through = middle + aside * away[:, None]
    along = np.linspace(0.0, 1.0, 24)[None, :, None]
    one, other = (p / np.linalg.norm(p, axis=1, keepdims=True) for p in (roots, through))
    turn = np.arccos(np.clip((one * other).sum(axis=1), -1.0, 1.0))[:, None, None]
    direction = np.sin((1.0 - along) * turn) * one[:, None] + np.sin(along * turn) * other[:, None]
    direction /= np.maximum(np.linalg.norm(direction, axis=2, keepdims=True), 1e-9)
    begin, end = (np.linalg.norm(p, axis=1)[:, None] for p in (roots, through))
    fraction = along[..., 0]
    height = np.maximum(
        begin * (1.0 - fraction) + end * fraction, _on_skin(bust, direction) + LIFT * fraction**0.3
    )
    blend = np.clip((fraction - 0.8) / 0.2, 0.0, 1.0)
    height = height * (1.0 - blend) + end * blend
    to_ring = direction * height[..., None]
    to_ring[:, 0] = roots
    fall = np.linspace(0.0, 1.0, 24)[None, 1:, None]
    length = TAIL * random.uniform(0.8, 1.1, (count, 1, 1))
    bend = 1.0 - np.exp(-5.0 * fall)
    tail = through[:, None] + length * (0.22 * bend * axis + np.array([0.0, 0.0, -1.0]) * fall**1.5)
    tail = tail + aside[:, None] * (0.015 * bend + 0.02 * fall)
    points = np.concatenate([to_ring, tail], axis=1)
    number = points.shape[1]
    return replace(
        grown,
        points=points.reshape(-1, 3).astype(np.float32),
        offsets=np.arange(count + 1, dtype=np.int32) * number,
        radius=np.full(count * number, 4e-5, np.float32),
        color=None,
        root_triangle=None,
        root_barycentric=None,
    )


def _skin(bust: BuiltInHead, direction: np.ndarray) -> np.ndarray:
    """Distance of the skin from the skull's middle in unit directions (n, 3), (n,) [m]: that of the
    vertex that is nearest in direction."""
    vertices = bust.surface.positions.astype(np.float64)
    vertices = vertices[vertices[:, 2] > -0.05]
    away = np.linalg.norm(vertices, axis=1)
    towards = (vertices / away[:, None]).astype(np.float32)
    found = np.empty(len(direction))
    for first in range(0, len(direction), 2000):
        near = direction[first : first + 2000].astype(np.float32) @ towards.T
        found[first : first + 2000] = away[near.argmax(axis=1)]
    return found


def _on_skin(bust: BuiltInHead, direction: np.ndarray) -> np.ndarray:
    return _skin(bust, direction.reshape(-1, 3)).reshape(direction.shape[:2])
