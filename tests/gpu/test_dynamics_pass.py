"""Dynamics on the GPU against numpy: the same motion within rounding, and the same guarantees."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from grooms_together import Groom, play_frame
from tiers import few_by_name, few_in_commits

from hairloom.addon.dynamics.clearance import GuideClearance, guide_clearance, max_clearance
from hairloom.addon.dynamics.colliders import (
    CapsuleCollider,
    Collider,
    DistanceField,
    PosedCollider,
    SphereCollider,
    SphereSetCollider,
)
from hairloom.addon.dynamics.force_fields import (
    KINDS,
    NO_FIELDS,
    Falloff,
    ForceField,
    ForceFields,
)
from hairloom.addon.dynamics.frame import Drive
from hairloom.addon.dynamics.held import HeldCvs
from hairloom.addon.dynamics.measure import deepest_penetration, max_stretch
from hairloom.addon.dynamics.painted import PaintedGuides
from hairloom.addon.dynamics.settings import DynamicsSettings
from hairloom.addon.dynamics.state import DynamicsState, start
from hairloom.addon.dynamics.step import advance, grid_at_frame_end
from hairloom.addon.errors import HairloomError

#: tolerances [m] after half a second, in free air and at colliders. Both forms use float32 but sum
#: in another order. The initial difference, 1e-7 m, grows as long as hair is limp, and more where
#: one form just applies friction or a last Newton step and the other just does not.
FREE, TOUCHING = 1e-4, 5e-4
#: Otherwise the last Newton step changes up to 0.2 % of a segment's length, and longer substeps let
#: the difference grow faster.
TIGHT = {"length_tolerance": 0.0001, "substep_rate": 240.0}
LIMP = {"style_root": 0.3, "style_tip": 0.0, "bend": 0.1, "style_damping": 0.5}


def curly(guide_count: int, cv_count: int) -> np.ndarray:
    """Guides of 20 cm from a ball of 10 cm outwards, each with its own waves."""
    random = np.random.default_rng(guide_count)
    out = random.normal([0.0, 0.0, 1.5], 1.0, (guide_count, 3))
    out /= np.linalg.norm(out, axis=1, keepdims=True)
    share = np.linspace(0.0, 1.0, cv_count) ** 1.2
    waves = np.sin(
        share[:, None] * random.uniform(3.0, 9.0, (guide_count, 1, 3))
        + random.uniform(0.0, 6.0, (guide_count, 1, 3))
    )
    grid = out[:, None] * (0.1 + 0.2 * share[:, None]) + 0.02 * share[:, None] * waves
    return grid.astype(np.float32)


def shaking(time: float) -> np.ndarray:
    """A head that shakes by 25 degrees about z and moves by 5 cm along x, once a second."""
    swing = np.sin(np.pi * min(time, 0.5)) ** 2 * np.sin(2.0 * np.pi * time)
    matrix = np.eye(4)
    matrix[:2, :2] = [
        [np.cos(0.44 * swing), -np.sin(0.44 * swing)],
        [np.sin(0.44 * swing), np.cos(0.44 * swing)],
    ]
    matrix[0, 3] = 0.05 * swing
    return matrix


def ball_field(radius: float) -> DistanceField:
    """A sampled ball with a flattened top, so that its gradient has an edge."""
    cell = 0.01
    axis = np.arange(-radius - 3 * cell, radius + 3 * cell, cell)
    nodes = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), axis=-1)
    round_part = np.linalg.norm(nodes, axis=-1) - radius
    return DistanceField(np.maximum(round_part, nodes[..., 2] - 0.06), nodes[0, 0, 0], cell)


def plate_field() -> DistanceField:
    """A sampled plate of 8 mm that stands in the hair."""
    cell = 0.005
    axes = [np.arange(-half - 3 * cell, half + 3 * cell, cell) for half in (0.1, 0.004, 0.05)]
    nodes = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
    outside = np.abs(nodes) - np.array([0.1, 0.004, 0.05])
    values = np.linalg.norm(np.maximum(outside, 0.0), axis=-1) + np.minimum(
        outside.max(axis=-1), 0.0
    )
    return DistanceField(values, nodes[0, 0, 0] + [0.0, -0.06, 0.22], cell)


@dataclass(eq=False)
class Scene:
    """Guides on a shaking head; colliders `on_head` move with it, `standing` ones stand still."""

    values: dict[str, Any] = field(default_factory=dict)
    guide_count: int = 40
    cv_count: int = 16
    on_head: tuple[Collider, ...] = ()
    standing: tuple[Collider, ...] = ()
    force_fields: ForceFields = NO_FIELDS
    is_held: bool = False
    is_curled: bool = False
    fps: float = 60.0
    is_bent: bool = True
    swing: float = 1.0  # factor of the colliders' motion
    is_combed: bool = False  # colliders push guides no farther away than they are at rest
    is_blended: bool = False  # shown guides are a blend of style and simulation
    is_painted: bool = False  # each guide has its own values

    @property
    def settings(self) -> DynamicsSettings:
        return DynamicsSettings(**TIGHT | self.values)

    def carried(self, frame: float) -> np.ndarray:
        matrix = shaking(frame / self.fps)
        grid = curly(self.guide_count, self.cv_count)
        return (grid @ matrix[:3, :3].T + matrix[:3, 3]).astype(np.float32)

    def start(self) -> DynamicsState:
        return start(self.carried(0.0), self.room)

    @property
    def room(self) -> np.ndarray | None:
        """The stretch of segments: of most of them in two guides of three, else 0."""
        if not self.is_curled:
            return None
        random = np.random.default_rng(8)
        room = random.uniform(-0.5, 1.5, (self.guide_count, self.cv_count - 1)).clip(0.0, None)
        room[::3] = 0.0
        return room

    @cached_property
    def held(self) -> HeldCvs | None:
        """Held CVs: every second tip, and a tie around every third guide."""
        if not self.is_held:
            return None
        held = np.zeros((self.guide_count, self.cv_count), bool)
        held[::2, -1] = True
        held[::3, self.cv_count // 2 : self.cv_count // 2 + 2] = True
        return HeldCvs(held)

    def colliders(self, frame: int) -> tuple[PosedCollider, ...]:
        earlier, before, now = (shaking((frame + k) / self.fps) for k in (-1, 0, 1))
        if self.swing != 1.0:
            for matrix in (earlier, before, now):
                matrix[0, 3] *= self.swing
                matrix[1, 3] = matrix[0, 3] * 0.5
        since = earlier if self.is_bent and frame else None
        still = np.eye(4)
        return (
            *(PosedCollider(one, before, now, since) for one in self.on_head),
            *(PosedCollider(one, still, still) for one in self.standing),
        )

    def drives(self, seconds: float) -> list[Drive]:
        grids = [self.carried(frame) for frame in range(round(seconds * self.fps) + 1)]
        gravity = np.array([0.0, 0.0, -9.81])
        drives = []
        for frame, (before, now) in enumerate(pairwise(grids)):
            earlier = grids[frame - 1] if self.is_bent and frame else None
            colliders = self.colliders(frame)
            drives.append(
                Drive(
                    before,
                    now,
                    colliders,
                    gravity,
                    earlier,
                    self.force_fields,
                    held=self.held,
                    clearance=self.clearance,
                    simulated=self.simulated,
                    painted=self.painted,
                )
            )
        return drives

    @property
    def simulated(self) -> np.ndarray | None:
        """The simulated fraction of each guide, from 0 to 1."""
        if not self.is_blended:
            return None
        return np.linspace(-0.2, 1.2, self.guide_count).clip(0.0, 1.0).astype(np.float32)

    @cached_property
    def painted(self) -> PaintedGuides | None:
        """Random factors; those of stiffness also vary along the guides."""
        if not self.is_painted:
            return None
        random = np.random.default_rng(3)
        names = ("gravity", "style_root", "style_tip", "style_damping", "bend", "volume", "damping")
        rows = {name: self.cv_count if name in ("style_root", "bend") else 1 for name in names}
        return PaintedGuides(
            {name: random.uniform(0.3, 1.7, (rows[name], self.guide_count)) for name in names}
        )

    @cached_property
    def clearance(self) -> GuideClearance | None:
        if not self.is_combed:
            return None
        begun = tuple(posed.at_begin() for posed in self.colliders(0))
        return guide_clearance(self.carried(0.0), begun, max_clearance(self.settings, 0.2))


BALL = SphereCollider(np.array([0.0, 0.0, 0.0]), 0.095)
IN_THE_WAY = SphereCollider(np.array([0.05, 0.05, 0.2]), 0.05)
AT_TIPS = SphereCollider(np.array([0.0, 0.05, 0.28]), 0.1)
ROD = CapsuleCollider(np.array([-0.2, 0.05, 0.12]), np.array([0.2, 0.1, 0.16]), 0.03)
#: Thin enough for segments to collide with it, and far enough out to move by several times its
#: width in a substep.
FINGER = CapsuleCollider(np.array([-0.2, 0.1, 0.2]), np.array([0.2, 0.12, 0.24]), 0.006)
CLUSTER = SphereSetCollider(
    np.array([[0.0, 0.0, 0.0], [0.03, 0.0, 0.02], [-0.04, 0.02, 0.0], [0.0, -0.03, 0.04]]),
    np.array([0.09, 0.07, 0.06, 0.06]),
)

#: numpy also tolerates rounding errors of world coordinates, which add up in stretching curls.
LOOSE = {"length_tolerance": 0.02}

PERMUTATION = np.random.default_rng(3).permutation(256)
_ABOVE = {"center": (0.05, -0.1, 0.35), "axis": (0.48, 0.6, 0.64)}
#: Every kind, shape and falloff, each with a visible effect.
FIELDS = (
    ForceField("wind", **_ABOVE, strength=12.0, shape="plane", flow=1.0, across_fraction=1.0),
    ForceField("wind", strength=-6.0, falloff="tube", radial=Falloff(0.5, 0.02, 0.3)),
    ForceField("force", **_ABOVE, strength=8.0, distance=Falloff(1.7, 0.1, 0.5), side=-1),
    ForceField("force", **_ABOVE, strength=-0.3, is_inverse_square=True, across_fraction=0.5),
    ForceField(
        "force", strength=6.0, shape="points", place=(0.1, 0.1, 0.1), normal=(0.0, 0.6, 0.8)
    ),
    ForceField("force", strength=5.0, falloff="cone", radial=Falloff(0.4, 10.0, 60.0)),
    ForceField("vortex", **_ABOVE, strength=9.0, shape="plane"),
    ForceField("vortex", **_ABOVE, strength=40.0, flow=0.4),
    ForceField("magnet", **_ABOVE, strength=30.0, shape="line"),
    ForceField("magnet", **_ABOVE, strength=30.0, shape="plane"),
    ForceField("harmonic", **_ABOVE, strength=60.0, damping=0.2, size=0.1),
    ForceField("turbulence", **_ABOVE, strength=9.0, size=0.2),
    ForceField("turbulence", strength=9.0, size=0.0, is_global=True),
    ForceField("drag", **_ABOVE, strength=2.0, damping=1.5, distance=Falloff(1.0)),
)

IN_AIR = {
    "default": Scene(),
    "straight way": Scene(is_bent=False),
    "limp": Scene(LIMP),
    "no bend": Scene({"bend": 0.0, "damping": 6.0, "style_tip": 3.0}),
    "stiff": Scene({"style_root": 15.0, "style_tip": 8.0, "bend": 4.0}),
    "wind with gusts": Scene({"wind_speed": 6.0, "gusts": 1.0, "wind_direction": 0.7}),
    "steady wind": Scene({"gusts": 0.0, "wind_speed": 4.0}),
    "force fields": Scene(force_fields=ForceFields(FIELDS, PERMUTATION)),
    "half the force fields in wind": Scene(
        {"force_fields": 0.5, "wind_speed": 3.0}, force_fields=ForceFields(FIELDS, PERMUTATION)
    ),
    **{
        f"{kind} field": Scene(force_fields=ForceFields(fields, PERMUTATION))
        for kind in KINDS
        if (fields := tuple(one for one in FIELDS if one.kind == kind))
    },
    "drag in a current": Scene({"drag": 4.0, "wind_speed": 1.0}),
    "drag in still water": Scene({"drag": 6.0, "damping": 2.0}),
    "buoyancy": Scene({"buoyancy": 0.8}),
    "weight not held": Scene({"sag_compensation": 0.3, "gravity": 1.4}),
    "curves along": Scene(
        {"style_along": (1.0, 1.0, 0.2, 0.1, 0.3), "bend_along": (0.2, 1.0, 0.5, 0.0, 1.0)}
    ),
    "held": Scene(is_held=True),
    "held at 24 frames a second": Scene({"substep_rate": 100.0}, fps=24.0, is_held=True),
    "curls": Scene({"curl_stretch": 0.6, "sag_compensation": 0.6, **LOOSE}, is_curled=True),
    "held curls": Scene({"curl_bounce": 5.0, **LOOSE}, is_held=True, is_curled=True),
    "painted": Scene(
        LIMP | {"damping": 1.5, "wind_speed": 4.0, **LOOSE}, is_painted=True, is_curled=True
    ),
    "curls with relaxation": Scene({"length_solver": "relaxation"}, is_curled=True),
    "relaxation": Scene({"length_solver": "relaxation"}),
    "relaxation without reach": Scene(
        {"length_solver": "relaxation", "relaxations": 3, "long_range": False}, is_held=True
    ),
    "two Newton steps at most": Scene({"length_iterations": 2, "substep_rate": 60.0, **LIMP}),
    "24 frames a second": Scene({"substep_rate": 100.0}, fps=24.0),
    "more frames than substeps": Scene({"substep_rate": 50.0}, fps=60.0),
    "many substeps": Scene({"substep_rate": 2000.0}, fps=24.0),
    "blended": Scene(LIMP, is_blended=True),
    "blended and held": Scene(LIMP, is_blended=True, is_held=True, fps=50.0),
    "inherits": Scene(
        {"inherit_location": 0.6, "inherit_rotation": 0.9, "drag": 2.0, "wind_speed": 2.0},
        cv_count=8,
        fps=24.0,
    ),
    "inherits blended, in fields": Scene(
        {"inherit_location": 1.0, "inherit_rotation": 1.0},
        cv_count=8,
        fps=50.0,
        is_blended=True,
        is_held=True,
        force_fields=ForceFields(FIELDS[:2], PERMUTATION),
    ),
    "2 CVs": Scene(cv_count=2),
    "3 CVs": Scene(cv_count=3),
    "4 CVs": Scene(cv_count=4, is_held=True),
    "32 CVs": Scene(cv_count=32),
    "64 CVs": Scene(cv_count=64, guide_count=9),
    "one guide": Scene(guide_count=1),
}
AT_COLLIDERS = {
    "ball": Scene(LIMP, on_head=(BALL,)),
    "ball without friction": Scene({"friction": 0.0, **LIMP}, on_head=(BALL,)),
    "standing ball": Scene(standing=(IN_THE_WAY,)),
    "capsule": Scene(LIMP, on_head=(ROD,)),
    "finger": Scene(guide_count=20, on_head=(FINGER,), swing=10.0),
    # farther than a segment is long
    "fast plate and finger": Scene(
        guide_count=12, on_head=(plate_field(), FINGER), swing=20.0, is_held=True
    ),
    "plate and finger": Scene(guide_count=12, on_head=(plate_field(), FINGER)),
    "set of balls": Scene(LIMP, on_head=(CLUSTER,)),
    "mesh field": Scene(LIMP, guide_count=24, on_head=(ball_field(0.095),)),
    "head and ball": Scene(on_head=(ball_field(0.095),), standing=(IN_THE_WAY,)),
    "three of all kinds": Scene(on_head=(CLUSTER, ball_field(0.08)), standing=(ROD,)),
    "curls": Scene(LIMP | LOOSE, on_head=(BALL,), is_curled=True),
    "combed": Scene(
        {"radius_root": 0.02, "radius_tip": 0.05} | LIMP,
        on_head=(ball_field(0.095),),
        is_combed=True,
    ),
    "combed at a plate and a finger": Scene(
        {"radius_tip": 0.05}, guide_count=12, on_head=(plate_field(), FINGER), is_combed=True
    ),
    "one pass": Scene({"contact_passes": 1, **LIMP}, on_head=(BALL,)),
    "relaxation": Scene({"length_solver": "relaxation"}, on_head=(BALL,)),
    "held": Scene(LIMP, on_head=(BALL,), standing=(IN_THE_WAY,), is_held=True),
    "out of reach": Scene(standing=(SphereCollider(np.array([0.0, 0.0, 9.0]), 0.1),)),
    "64 CVs": Scene(cv_count=64, guide_count=9, on_head=(IN_THE_WAY,)),
    "3 CVs": Scene(cv_count=3, on_head=(AT_TIPS,)),
    "2 CVs": Scene(cv_count=2, on_head=(BALL,)),
}
UNTOUCHED = [AT_COLLIDERS["out of reach"], AT_COLLIDERS["2 CVs"]]
#: Commits test these with 8 CVs, whose programs compile three times as fast as with 16.
LONG_AT_COLLIDERS = (
    "capsule",
    "finger",
    "plate and finger",
    "head and ball",
    "three of all kinds",
    "combed at a plate and a finger",
    "standing ball",
    "mesh field",
    "curls",
    "held",
)
SHORT_AT_COLLIDERS = {
    f"{name}, 8 CVs": replace(AT_COLLIDERS[name], cv_count=8) for name in LONG_AT_COLLIDERS
}
SLOW_AT_COLLIDERS = ("64 CVs", "ball", "combed", "ball without friction", "set of balls")
SLOW_AT_COLLIDERS += (
    "fast plate and finger",
    "head and ball, 8 CVs",
    "combed at a plate and a finger, 8 CVs",
    "relaxation",
)
SLOW_IN_AIR = ("64 CVs", "32 CVs", "blended and held", "half the force fields in wind")
#: Combinations of features that other cases test separately.
SLOW_IN_AIR += ("held curls", "curls with relaxation", "held at 24 frames a second")
SLOW_IN_AIR += tuple(f"{kind} field" for kind in KINDS if f"{kind} field" in IN_AIR)


@pytest.fixture
def make_pass(gpu_context: Any) -> Callable[[DynamicsState], Any]:
    from hairloom.addon.render.dynamics_pass import DynamicsPass

    return DynamicsPass


def guides_of(dynamics: Any, guide_count: int, cv_count: int) -> np.ndarray:
    from hairloom.addon.render.strand_layout import from_strand_rows
    from hairloom.addon.render.textures import texture_to_array

    return from_strand_rows(texture_to_array(dynamics.guides), guide_count, cv_count)[..., :3]


def assert_equal(scene: Scene, make_pass: Any, tolerance: float, seconds: float = 0.5) -> None:
    state = scene.start()
    dynamics = make_pass(state)
    moved = 0.0
    for drive in scene.drives(seconds):
        state = advance(state, drive, scene.settings, 1.0 / scene.fps)
        dynamics.advance(drive, scene.settings, 1.0 / scene.fps)
        found = dynamics.read()
        assert np.abs(found.position - state.position).max() < tolerance
        assert np.abs(found.previous - state.previous).max() < tolerance
        shown = guides_of(dynamics, scene.guide_count, scene.cv_count)
        expected = grid_at_frame_end(state, drive, scene.settings, 1.0 / scene.fps)
        assert np.abs(shown - expected).max() < tolerance
        assert found.time_left == state.time_left
        assert (found.substep, found.time) == (state.substep, state.time)
        moved = max(moved, float(np.abs(state.position - drive.target_now.T).max()))
    assert moved > 0.002 or scene.cv_count == 2, "the hair must do something"


@pytest.mark.parametrize("scene", few_by_name(IN_AIR, *SLOW_IN_AIR))
def test_equals_numpy_in_air(make_pass: Any, scene: Scene) -> None:
    assert_equal(scene, make_pass, FREE)


@pytest.mark.parametrize("speed", few_in_commits([3.5, 4.0]))
def test_equals_numpy_where_a_finger_is_drawn_through_hair(make_pass: Any, speed: float) -> None:
    """All guides meet a finger that moves by more than a segment's length in a substep."""
    grid = np.zeros((6, 16, 3), np.float32)
    grid[..., 0] = np.linspace(-0.05, 0.05, 6)[:, None]
    grid[..., 2] = np.linspace(0.0, -0.25, 16)
    finger = CapsuleCollider(np.array([-0.08, 0.0, 0.0]), np.array([0.08, 0.01, 0.0]), 0.008)
    settings, places = DynamicsSettings(**TIGHT), []
    for step in range(int(0.22 / speed * 180.0) + 1):
        places.append(np.eye(4))
        places[-1][:3, 3] = 0.0, -0.14 + step * speed / 180.0, -0.13
    state = start(grid)
    dynamics = make_pass(state)
    for pair in pairwise(places):
        posed = (PosedCollider(finger, *pair),)
        drive = Drive(grid, grid, posed, np.array([0.0, 0.0, -9.81]))
        state = advance(state, drive, settings, 1.0 / 180.0)
        dynamics.advance(drive, settings, 1.0 / 180.0)
        assert np.abs(dynamics.read().position - state.position).max() < TOUCHING
        assert np.abs(dynamics.read().previous - state.previous).max() < TOUCHING
    assert state.grid[:, 8, 1].min() > 0.04, "it was swept along"


@pytest.mark.parametrize(
    "scene",
    few_by_name(AT_COLLIDERS | SHORT_AT_COLLIDERS, *LONG_AT_COLLIDERS, *SLOW_AT_COLLIDERS),
)
def test_equals_numpy_at_colliders(make_pass: Any, scene: Scene) -> None:
    assert_equal(scene, make_pass, TOUCHING)
    alone = replace(scene, on_head=(), standing=())
    difference = played(scene).position - played(alone).position
    assert np.abs(difference).max() > 1e-3 or scene in UNTOUCHED, "the solids must be met"


def test_guides_take_another_style_in_mid_play(make_pass: Any) -> None:
    """A longer style of another shape, while guides move."""
    scene = Scene()
    state = scene.start()
    dynamics = make_pass(state)
    for number, drive in enumerate(scene.drives(0.3)):
        if number == 6:
            style = scene.carried(0.0) * np.linspace(1.0, 1.3, scene.cv_count)[:, None]
            state = replace(state, rest=start(style).rest)
            dynamics.take_rest(state.rest)
        state = advance(state, drive, scene.settings, 1.0 / scene.fps)
        dynamics.advance(drive, scene.settings, 1.0 / scene.fps)
    assert np.abs(dynamics.read().position - state.position).max() < FREE
    assert np.abs(state.position - played(scene).position).max() > 0.005


def played(scene: Scene) -> DynamicsState:
    """The state after half a second in numpy."""
    state = scene.start()
    for drive in scene.drives(0.5):
        state = advance(state, drive, scene.settings, 1.0 / scene.fps)
    return state


def test_more_guides_than_a_texture_has_rows(make_pass: Any) -> None:
    scene = Scene(guide_count=20000, cv_count=4, on_head=(BALL,))
    assert_equal(scene, make_pass, TOUCHING, seconds=0.1)


@dataclass(eq=False)
class Bundle(Scene):
    """Guides that hang through each other, enough for three columns of the texture."""

    guide_count: int = 300

    def carried(self, frame: float) -> np.ndarray:
        random = np.random.default_rng(7)
        grid = np.zeros((self.guide_count, self.cv_count, 3))
        along = np.linspace(0.0, 1.0, self.cv_count)
        across = random.uniform(-0.012, 0.012, (self.guide_count, 2))
        grid[..., :2] = across[:, None] * (1.0 + 2.0 * np.minimum(2.0 * along, 1.0))[:, None]
        grid[..., 2] = -0.3 * along
        matrix = shaking(frame / self.fps)
        return (grid @ matrix[:3, :3].T + matrix[:3, 3]).astype(np.float32)


FALLING = {
    "volume": 1.0,
    "sag_compensation": 0.0,
    "style_root": 0.5,
    "style_tip": 0.1,
    "bend": 0.3,
}


#: Points that rounding moves across a cell's border push others a little differently, so the
#: tolerance is that of contacts.
AMONG_OTHERS = {
    "sparse": Scene({"volume": 1.0, "style_tip": 0.6}, guide_count=150),
    "other substeps": Scene(
        {"volume": 0.5, "substep_rate": 100.0, "style_tip": 0.3}, fps=24.0, guide_count=150
    ),
    "bundle": Bundle(FALLING, fps=24.0),
    "painted": Bundle(FALLING, fps=24.0, is_painted=True),
    "bundle and ball": Bundle(FALLING, on_head=(BALL,), fps=24.0),
}


@pytest.mark.parametrize("scene", few_by_name(AMONG_OTHERS, "bundle", "painted"))
def test_hair_among_hair_equals_numpy(make_pass: Any, scene: Scene) -> None:
    assert_equal(scene, make_pass, TOUCHING)


def test_grooms_that_feel_each_other_equal_numpy(make_pass: Any) -> None:
    """Two halves of a bundle with one or both on the GPU, and without interaction for
    comparison."""
    scene, seconds = Bundle(FALLING, fps=24.0), 0.25
    targets = [scene.carried(number) for number in range(round(seconds * scene.fps) + 1)]
    halves, ends = (slice(0, None, 2), slice(1, None, 2)), {}
    for forms in ((None, None), (make_pass, make_pass), (make_pass, None), ()):
        kinds = forms or (None, None)
        grooms = [
            Groom(targets[0][half], scene.settings, make_pass=form)
            for half, form in zip(halves, kinds, strict=True)
        ]
        for target in targets[1:]:
            near = None if forms else (frozenset(), frozenset())
            play_frame(grooms, [target[half] for half in halves], 1.0 / scene.fps, near)
        ends[forms] = np.stack([groom.state.position for groom in grooms])
    by_numpy, *others, alone = ends.values()
    assert np.abs(alone - by_numpy).max() > 0.005
    for found in others:
        assert np.abs(found - by_numpy).max() < TOUCHING


def test_hair_among_hair_is_elsewhere_than_alone() -> None:
    scene = Bundle(FALLING, on_head=(BALL,), fps=24.0)
    alone = Bundle(FALLING | {"volume": 0.0}, on_head=(BALL,), fps=24.0)
    assert np.abs(played(scene).position - played(alone).position).max() > 0.005


def test_hair_among_hair_is_the_same_to_the_last_bit_every_time(make_pass: Any) -> None:
    scene = Bundle(FALLING, fps=24.0, guide_count=2000)
    found = []
    for _ in range(3):
        dynamics = make_pass(scene.start())
        for drive in scene.drives(0.25):
            dynamics.advance(drive, scene.settings, 1.0 / scene.fps)
        found.append(dynamics.read())
    for other in found[1:]:
        assert np.array_equal(found[0].position, other.position)
        assert np.array_equal(found[0].push, other.push)


def test_hair_forces_continue_when_the_device_is_switched(make_pass: Any) -> None:
    """In frames of 7 and 8 substeps, with interaction in every third substep."""
    scene = Bundle(FALLING, fps=24.0)
    state = mixed = scene.start()
    for frame, drive in enumerate(scene.drives(0.5)):
        state = advance(state, drive, scene.settings, 1.0 / scene.fps)
        if frame % 2:
            mixed = advance(mixed, drive, scene.settings, 1.0 / scene.fps)
        else:
            dynamics = make_pass(mixed)
            dynamics.advance(drive, scene.settings, 1.0 / scene.fps)
            mixed = dynamics.read()
        assert np.quantile(np.abs(mixed.push - state.push), 0.99) < 1e-6
        assert np.abs(mixed.position - state.position).max() < TOUCHING


def test_the_device_can_be_switched_in_mid_motion(make_pass: Any) -> None:
    """Numpy and GPU in turn: the state is handed over bit for bit."""
    scene = Scene(on_head=(BALL,), fps=50.0)
    state = mixed = scene.start()
    for frame, drive in enumerate(scene.drives(0.5)):
        state = advance(state, drive, scene.settings, 1.0 / 50.0)
        if frame // 5 % 2:
            mixed = advance(mixed, drive, scene.settings, 1.0 / 50.0)
            continue
        dynamics = make_pass(mixed)
        assert dynamics.read() is mixed, "it has not moved yet"
        dynamics.advance(drive, scene.settings, 1.0 / 50.0)
        mixed = dynamics.read()
    assert np.abs(mixed.position - state.position).max() < TOUCHING
    assert (mixed.substep, mixed.time) == (state.substep, state.time)


def test_the_substep_may_change_in_mid_motion(make_pass: Any) -> None:
    scene = Scene()
    state = scene.start()
    dynamics = make_pass(state)
    for frame, drive in enumerate(scene.drives(0.5)):
        rate = (240.0, 100.0, 500.0)[frame // 8 % 3]
        settings = replace(scene.settings, substep_rate=rate)
        state = advance(state, drive, settings, 1.0 / 60.0)
        dynamics.advance(drive, settings, 1.0 / 60.0)
        assert np.abs(dynamics.read().position - state.position).max() < FREE
        assert dynamics.read().time_left == state.time_left


def test_a_frame_without_a_substep_moves_only_what_is_shown(make_pass: Any) -> None:
    scene = Scene({"substep_rate": 30.0})
    start_state, drive = scene.start(), scene.drives(0.5)[20]
    dynamics = make_pass(start_state)
    dynamics.advance(drive, scene.settings, 0.01)
    found = dynamics.read()
    assert (found.position == start_state.position).all()
    assert (found.previous == start_state.previous).all()
    assert (found.time_left, found.substep) == (0.01, 0.0)
    shown = guides_of(dynamics, scene.guide_count, scene.cv_count)
    np.testing.assert_allclose(shown[:, 0], drive.target_now[:, 0], atol=1e-6)


def test_frames_shorter_than_a_substep(make_pass: Any) -> None:
    """With all effects of the table of substeps, which has no rows then."""
    scene = Scene({"wind_speed": 6.0, "gusts": 1.0}, on_head=(BALL,), fps=1000.0)
    assert_equal(scene, make_pass, TOUCHING, seconds=0.05)


@pytest.mark.slow(instead="test_hair_among_hair_is_the_same_to_the_last_bit_every_time")
def test_twice_the_same_to_the_last_bit(make_pass: Any) -> None:
    scene = replace(SHORT_AT_COLLIDERS["head and ball, 8 CVs"], values={"wind_speed": 3.0})
    passes = [make_pass(scene.start()) for _ in range(2)]
    for drive in scene.drives(0.3):
        for dynamics in passes:
            dynamics.advance(drive, scene.settings, 1.0 / 60.0)
    one, other = (dynamics.read() for dynamics in passes)
    assert (one.position == other.position).all()
    assert (one.previous == other.previous).all()


@pytest.mark.parametrize(
    "solid", few_by_name({"ball": BALL, "field": ball_field(0.095), "set": CLUSTER}, "ball")
)
def test_no_stretch_and_no_penetration(make_pass: Any, solid: Collider) -> None:
    """The guarantees of the numpy step, with default settings and with limp hair."""
    for values in ({}, LIMP):
        scene = Scene(values, guide_count=100, on_head=(solid,))
        settings = DynamicsSettings(**values)
        dynamics = make_pass(scene.start())
        for frame, drive in enumerate(scene.drives(1.0)):
            dynamics.advance(drive, settings, 1.0 / 60.0)
            found = dynamics.read()
            assert max_stretch(found) < 0.01
            if frame > 20:  # hair that starts inside has been led out
                assert deepest_penetration(found, drive.colliders) < 0.001


@pytest.mark.alike
@pytest.mark.parametrize("number", range(12))
def test_any_settings_stay_finite(make_pass: Any, number: int) -> None:
    """Random values from the hard or soft ranges, and a head that jerks."""
    random = np.random.default_rng([8, number])
    values: dict[str, Any] = {}
    for parameter in DynamicsSettings.parameters():
        if parameter.kind == "number" and parameter.name != "max_frame_time":
            low, high = parameter.hard_range if number % 2 else parameter.soft_range
            values[parameter.name] = random.choice([low, high, random.uniform(low, high)])
    values["substep_rate"] = random.uniform(30.0, 300.0)
    settings = DynamicsSettings(**values)
    scene = Scene(on_head=(BALL,))
    dynamics = make_pass(scene.start())
    for drive in scene.drives(0.2):
        jerk = random.normal(size=3).astype(np.float32)
        drive = replace(drive, target_now=drive.target_now + jerk)
        dynamics.advance(drive, settings, 1.0 / 24.0)
    assert np.isfinite(dynamics.read().position).all(), settings


def test_bad_drives_are_refused_as_numpy_refuses_them(make_pass: Any) -> None:
    scene = Scene()
    state, drive = scene.start(), scene.drives(0.1)[0]
    dynamics = make_pass(state)
    nowhere = drive.target_now.copy()
    nowhere[3, 4, 1] = np.nan
    for bad, duration in (
        (replace(drive, target_now=drive.target_now[:5]), 0.02),
        (replace(drive, target_before=drive.target_before[:, :9]), 0.02),
        (replace(drive, target_now=nowhere), 0.02),
        (replace(drive, gravity=np.array([0.0, np.inf, 0.0])), 0.02),
        (drive, -1.0),
        (drive, np.nan),
    ):
        with pytest.raises(HairloomError) as by_numpy:
            advance(state, bad, scene.settings, duration)
        with pytest.raises(HairloomError) as by_compute:
            dynamics.advance(bad, scene.settings, duration)
        assert str(by_compute.value) == str(by_numpy.value)
    dynamics.advance(drive, scene.settings, 0.02)
    assert np.isfinite(dynamics.read().position).all(), "it goes on after an error"


def test_a_collider_that_the_gpu_does_not_know_is_refused(make_pass: Any) -> None:
    class Cube:
        bounds = (np.zeros(3), 1.0)

    scene = Scene()
    drive = scene.drives(0.1)[0]
    cube: Any = Cube()
    drive = replace(drive, colliders=(PosedCollider(cube, np.eye(4), np.eye(4)),))
    with pytest.raises(HairloomError, match="Cube"):
        make_pass(scene.start()).advance(drive, scene.settings, 0.02)


def test_no_guides(make_pass: Any) -> None:
    state = start(np.zeros((0, 8, 3), np.float32))
    dynamics = make_pass(state)
    drive = replace(Scene().drives(0.1)[0], target_before=state.grid, target_now=state.grid)
    dynamics.advance(replace(drive, target_earlier=None), DynamicsSettings(), 0.02)
    assert dynamics.read().position.shape == (3, 8, 0)
    assert dynamics.guides is None


def test_release_goes_on_from_what_was_read(make_pass: Any) -> None:
    scene = Scene(on_head=(BALL,))
    drives = scene.drives(0.2)
    kept, released = make_pass(scene.start()), make_pass(scene.start())
    for drive in drives[:5]:
        kept.advance(drive, scene.settings, 1.0 / 60.0)
        released.advance(drive, scene.settings, 1.0 / 60.0)
    shown = kept.guides
    released.read()
    released.release()
    assert released.guides is None
    for drive in drives[5:]:
        kept.advance(drive, scene.settings, 1.0 / 60.0)
        released.advance(drive, scene.settings, 1.0 / 60.0)
    assert kept.guides is shown, "the same texture, frame after frame"
    assert (released.read().position == kept.read().position).all()


def test_release_with_all_shaders(make_pass: Any) -> None:
    from hairloom.addon.render import shader_program

    scene = Scene()
    dynamics = make_pass(scene.start())
    dynamics.advance(scene.drives(0.1)[0], scene.settings, 1.0 / 60.0)
    shader_program.release()
    assert dynamics.guides is None


@pytest.mark.parametrize("pairs", ["RG32F", "RGBA32F"])
def test_the_format_for_metal_keeps_the_same_motion(
    gpu_context: Any, monkeypatch: pytest.MonkeyPatch, pairs: str
) -> None:
    """Also through a read-back, after which another pass continues."""
    from hairloom.addon.render import dynamics_pass

    scene, positions = Scene(guide_count=8), []
    for kept in ("RG32F", pairs):
        monkeypatch.setattr(dynamics_pass, "pair_format", lambda kept=kept: kept)
        state = scene.start()
        for drives in (scene.drives(0.1)[:3], scene.drives(0.1)[3:]):
            moving = dynamics_pass.DynamicsPass(state)
            for drive in drives:
                moving.advance(drive, scene.settings, 1.0 / scene.fps)
            state = moving.read()
        positions.append(state.position)
    assert np.abs(positions[0] - scene.start().position).max() > 1e-3
    np.testing.assert_array_equal(*positions)
