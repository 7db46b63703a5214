"""The parameters of hair in motion."""

from __future__ import annotations

import math
from dataclasses import dataclass

from ..params import choice, curve, integer, number, toggle
from .motion_settings import MotionSettings, air_damping


@dataclass(frozen=True, kw_only=True)
class DynamicsSettings(MotionSettings):
    """How guides move, keep their style and meet colliders.

    Stiffness is given in swings per second, the frequency of a strand that only this stiffness
    restores. So it does not depend on the substep, the CV count or the strand's length.
    """

    section = "dynamics"
    title = "Dynamics"
    help_page = "dynamics"
    owner = "character"
    panels = ("Style", "Medium & Wind", "Lengths", "Collisions", "Shot")

    damping: float = air_damping(is_painted=True)

    device: str = choice(
        "automatic",
        (
            ("automatic", "Automatic", "Use the GPU if Blender can compute on it, else the CPU"),
            ("numpy", "CPU (numpy)", "Needs no GPU; gives bit-identical results in every run"),
            ("compute", "GPU (compute)", "Fastest; guides stay on the GPU between frames"),
        ),
        label="Device",
        description="Device that runs the simulation; both give the same motion within rounding",
    )
    substep_rate: float = number(
        180.0,
        label="Substeps",
        description="Simulation steps per second, independent of the frame rate",
        soft=(60.0, 480.0),
        hard=(30.0, 2000.0),
        unit="rate",
        source="Jakobsen 2001; fixed step with accumulator, Fiedler 2004",
    )
    max_frame_time: float = number(
        0.25,
        label="Max Frame Time",
        description="Maximum time to simulate between two frames",
        soft=(0.05, 1.0),
        hard=(0.01, 10.0),
        unit="time",
    )
    gravity: float = number(
        1.0,
        label="Gravity",
        description="Factor on the scene's gravity",
        soft=(0.0, 2.0),
        hard=(-10.0, 10.0),
        is_painted=True,
    )
    sag_compensation: float = number(
        1.0,
        label="Sag Correction",
        description="Fraction of the weight that the style compensates; at 1 the groom at rest "
        "does not sag",
        soft=(0.0, 1.0),
        hard=(0.0, 1.0),
        unit="factor",
    )
    style_root: float = number(
        4.0,
        label="Root Stiffness",
        description="Stiffness that holds hair to its style near the root, in swings per second",
        soft=(0.0, 10.0),
        hard=(0.0, 1000.0),
        unit="rate",
        source="Global shape constraint, Han and Harada 2012",
        panel="Style",
        is_painted=True,
    )
    style_tip: float = number(
        1.2,
        label="Tip Stiffness",
        description="Stiffness that holds hair to its style at the tip, in swings per second",
        soft=(0.0, 10.0),
        hard=(0.0, 1000.0),
        unit="rate",
        source="Global shape constraint, Han and Harada 2012",
        panel="Style",
        is_painted=True,
    )
    style_along: tuple[float, ...] = curve(
        (1.0, 0.75, 0.5, 0.25, 0.0),
        label="Stiffness Along",
        description="Blend of the two stiffnesses along the strand: 1 is Root Stiffness, 0 is Tip "
        "Stiffness",
        hard=(0.0, 1.0),
        panel="Style",
    )
    style_damping: float = number(
        5.0,
        label="Style Damping",
        description="Rate at which swinging about the style decays, relative to the moving head",
        soft=(0.0, 20.0),
        hard=(0.0, 1000.0),
        unit="rate",
        panel="Style",
        is_painted=True,
    )
    bend: float = number(
        1.5,
        label="Bend Stiffness",
        description="Stiffness that keeps waves and curls in shape, in swings per second of a "
        "strand held at its root",
        soft=(0.0, 5.0),
        hard=(0.0, 50.0),
        unit="rate",
        source="Local shape constraint, Han and Harada 2012",
        panel="Style",
        is_painted=True,
    )
    bend_along: tuple[float, ...] = curve(
        (1.0, 1.0, 1.0, 1.0, 1.0),
        label="Bend Along",
        description="Factor on Bend Stiffness along the strand, from root to tip",
        hard=(0.0, 1.0),
        panel="Style",
    )
    curl_stretch: float = number(
        0.25,
        label="Curl Stretch",
        description="How far swinging curls may stretch or compress, as a fraction of the stretch "
        "that would straighten them; 0 keeps curls stiff. Straight hair never stretches",
        soft=(0.0, 1.0),
        hard=(0.0, 1.0),
        unit="factor",
        panel="Style",
    )
    curl_bounce: float = number(
        2.0,
        label="Curl Bounce",
        description="Stiffness of curls along the strand, in swings per second of a strand "
        "bobbing from its root; higher is stiffer",
        soft=(1.0, 8.0),
        hard=(0.1, 50.0),
        unit="rate",
        source="Springs with a compliance, Macklin, Mueller and Chentanez 2016",
        panel="Style",
    )
    volume: float = number(
        0.0,
        label="Volume",
        description="Interaction with other hair, of the same and of other grooms: it preserves "
        "volume and locks, and lets neighbours move together. It does not change hair at rest; at "
        "0 hair passes through hair",
        soft=(0.0, 1.0),
        hard=(0.0, 1.0),
        unit="factor",
        source="Grid of density and velocity, Petrovic, Henne and Anderson 2005",
        panel="Style",
        is_painted=True,
    )
    animated_style: bool = toggle(
        False,
        label="Animated Style",
        description="Read the curves in every frame, so that the style follows shape keys, "
        "modifiers, nodes or a cache. If off, they are read once",
        panel="Style",
        is_animatable=False,
    )
    influence: float = number(
        1.0,
        label="Influence",
        description="Blend between style and simulation: 0 follows the style exactly, 1 is fully "
        "simulated",
        soft=(0.0, 1.0),
        hard=(0.0, 1.0),
        unit="factor",
        panel="Style",
        is_painted=True,
    )
    length_solver: str = choice(
        "direct",
        (
            ("direct", "Direct", "Solve all segments of a guide at once, without visible stretch"),
            (
                "relaxation",
                "Relaxation",
                "Solve one segment after another, repeatedly; stretches under sudden motion",
            ),
        ),
        label="Length Solver",
        description="Method that keeps the length of segments",
        source="Direct: Goldenthal et al. 2007. Relaxation: Jakobsen 2001",
        panel="Lengths",
    )
    relaxations: int = integer(
        8,
        label="Relaxations",
        description="Number of sweeps along each guide per substep",
        soft=(1, 32),
        hard=(1, 256),
        source="Jakobsen 2001",
        panel="Lengths",
    )
    long_range: bool = toggle(
        True,
        label="Long Range",
        description="Limit each point's distance from its root, both along the strand and "
        "straight, to that at rest; acts with relaxation only",
        source="Kim, Chentanez and Mueller 2012",
        panel="Lengths",
    )
    length_tolerance: float = number(
        0.002,
        label="Length Tolerance",
        description="Maximum error of a segment's length, as a fraction, at which the solver stops",
        soft=(0.0005, 0.01),
        hard=(0.0001, 0.02),
        panel="Lengths",
    )
    length_iterations: int = integer(
        8,
        label="Length Iterations",
        description="Maximum number of Newton steps in the last length solve of each substep",
        soft=(1, 16),
        hard=(1, 64),
        source="Fast projection, Goldenthal et al. 2007",
        panel="Lengths",
    )
    contact_passes: int = integer(
        2,
        label="Contact Passes",
        description="Number of times per substep that contacts and lengths are solved in turn",
        soft=(1, 4),
        hard=(1, 16),
        panel="Collisions",
    )
    radius_root: float = number(
        0.004,
        label="Root Radius",
        description="Distance that hair keeps from colliders near its root, as a fraction of its "
        "length",
        soft=(0.0, 0.05),
        hard=(0.0, 1.0),
        source='"Pearl" configuration, Nguyen and Donnelly 2005',
        panel="Collisions",
    )
    radius_tip: float = number(
        0.016,
        label="Tip Radius",
        description="Distance that hair keeps from colliders at its tip, as a fraction of its "
        "length; large enough that no collider slips between points",
        soft=(0.0, 0.1),
        hard=(0.0, 1.0),
        source='"Pearl" configuration, Nguyen and Donnelly 2005',
        panel="Collisions",
    )
    only_selected: bool = toggle(
        False,
        label="Only Selected",
        description="Simulate only curves selected in Sculpt or Edit Mode; other guides keep "
        "their style",
        panel="Shot",
    )
    inherit_location: float = number(
        0.0,
        label="Inherit Location",
        description="Fraction of the roots' movement that hair follows rigidly, without lag; at 1 "
        "it moves as if the head stayed in place",
        soft=(0.0, 1.0),
        hard=(0.0, 1.0),
        unit="factor",
        source="1 less the linear velocity scale of grooms in Unreal",
        panel="Shot",
    )
    inherit_rotation: float = number(
        0.0,
        label="Inherit Rotation",
        description="Fraction of the roots' rotation that hair follows rigidly, without lag; at 1 "
        "it moves as if the head did not turn, apart from gravity",
        soft=(0.0, 1.0),
        hard=(0.0, 1.0),
        unit="factor",
        source="1 less the angular velocity scale of grooms in Unreal",
        panel="Shot",
    )
    jump_distance: float = number(
        3.0,
        label="Jump Distance",
        description="Treat a frame as a cut if the roots move farther than in the previous frame "
        "by this many extents of the hair. Hair follows a cut without gaining speed. 0 turns this "
        "off",
        soft=(0.0, 10.0),
        hard=(0.0, 1.0e6),
        panel="Shot",
    )
    jump_turn: float = number(
        math.radians(120.0),
        label="Jump Turn",
        description="Treat a frame as a cut if the roots turn by more than this angle. Hair "
        "follows a cut without gaining speed. 0 turns this off",
        soft=(0.0, math.pi),
        hard=(0.0, math.pi),
        unit="angle",
        panel="Shot",
    )
    pre_roll: int = integer(
        0,
        label="Pre-Roll",
        description="Number of frames to simulate before the first one, with the head in its "
        "first pose, so that gravity and wind have already taken effect",
        soft=(0, 100),
        hard=(0, 1000),
        panel="Shot",
    )
    time_scale: float = number(
        1.0,
        label="Time Scale",
        description="Speed of time for the hair; at 0 it is frozen and moves rigidly with its "
        "roots",
        soft=(0.0, 1.0),
        hard=(0.0, 4.0),
        panel="Shot",
    )
