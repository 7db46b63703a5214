"""The parameters of hair in motion."""

from __future__ import annotations

import math
from dataclasses import dataclass

from ..params import choice, curve, integer, number, toggle
from .motion_settings import MotionSettings, air_damping


@dataclass(frozen=True, kw_only=True)
class DynamicsSettings(MotionSettings):
    """How guides move, keep their style and meet colliders.

    Stiffness is given as the number of swings a second that a strand would make if this stiffness
    alone brought it back: it does not depend on the substep, the CV count or the strand's length.
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
            ("automatic", "Automatic", "The GPU if Blender can compute on it, otherwise the CPU"),
            ("numpy", "CPU (numpy)", "Needs no GPU; the same result to the last bit in every run"),
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
    longest_frame: float = number(
        0.25,
        label="Longest Frame",
        description="Maximum time that is simulated between two frames",
        soft=(0.05, 1.0),
        hard=(0.01, 10.0),
        unit="time",
    )
    gravity: float = number(
        1.0,
        label="Gravity",
        description="Fraction of the scene's gravity that pulls at the hair",
        soft=(0.0, 2.0),
        hard=(-10.0, 10.0),
        is_painted=True,
    )
    sag_compensation: float = number(
        1.0,
        label="Sag Correction",
        description="Fraction of the weight that the style compensates; at 1 a groom does not sag "
        "when it comes to rest",
        soft=(0.0, 1.0),
        hard=(0.0, 1.0),
        unit="factor",
    )
    style_root: float = number(
        4.0,
        label="Root Stiffness",
        description="Stiffness that holds the first points to the style, in swings per second",
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
        description="Stiffness that holds the tip to the style, in swings per second",
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
        description="Style stiffness along the strand: 1 is that of the root, 0 that of the tip",
        hard=(0.0, 1.0),
        panel="Style",
    )
    style_damping: float = number(
        5.0,
        label="Style Damping",
        description="Rate at which swinging about the style dies away, relative to the moving head",
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
        description="Fraction of the bend stiffness along the strand, from root to tip",
        hard=(0.0, 1.0),
        panel="Style",
    )
    curl_stretch: float = number(
        0.25,
        label="Curl Stretch",
        description="How far curls and coils may be drawn out or pushed together when the hair "
        "swings, as a fraction of what there is until they are straight; 0 keeps them stiff, "
        "straight hair never stretches",
        soft=(0.0, 1.0),
        hard=(0.0, 1.0),
        unit="factor",
        panel="Style",
    )
    curl_bounce: float = number(
        2.0,
        label="Curl Bounce",
        description="Stiffness of curls along themselves, in swings per second of a strand that "
        "bobs from its root; more is stiffer",
        soft=(1.0, 8.0),
        hard=(0.1, 50.0),
        unit="rate",
        source="Springs with a compliance, Macklin, Mueller and Chentanez 2016",
        panel="Style",
    )
    volume: float = number(
        0.0,
        label="Volume",
        description="How much hair feels other hair, of its own groom and of others: it keeps its "
        "volume and its locks, and neighbours move together. At rest it changes nothing; 0 is hair "
        "that passes through hair",
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
        description="Read the curves again in each frame, so that hair returns to them as shape "
        "keys, modifiers, nodes or a cache move them; off, they are read once",
        panel="Style",
        is_animatable=False,
    )
    simulated: float = number(
        1.0,
        label="Simulated",
        description="Fraction of the motion that is simulated: at 0 hair goes exactly as its style "
        "does, at 1 as the simulation says",
        soft=(0.0, 1.0),
        hard=(0.0, 1.0),
        unit="factor",
        panel="Style",
        is_painted=True,
    )
    length_solver: str = choice(
        "direct",
        (
            ("direct", "Direct", "Solve all segments of a guide at once: no visible stretch"),
            (
                "relaxation",
                "Relaxation",
                "Solve one segment after the other, repeatedly: stretches under jerks",
            ),
        ),
        label="Length Solver",
        description="Method that keeps segments at their length",
        source="Direct: Goldenthal et al. 2007. Relaxation: Jakobsen 2001",
        panel="Lengths",
    )
    relaxations: int = integer(
        8,
        label="Relaxations",
        description="Sweeps along the guide in each substep",
        soft=(1, 32),
        hard=(1, 256),
        source="Jakobsen 2001",
        panel="Lengths",
    )
    long_range: bool = toggle(
        True,
        label="Long Range",
        description="With relaxation, let no point get farther from its root, along the strand "
        "or straight, than it is at rest",
        source="Kim, Chentanez and Mueller 2012",
        panel="Lengths",
    )
    length_tolerance: float = number(
        0.002,
        label="Length Tolerance",
        description="Guides are solved until no segment is off by more than this fraction",
        soft=(0.0005, 0.01),
        hard=(0.0001, 0.02),
        panel="Lengths",
    )
    length_iterations: int = integer(
        8,
        label="Length Iterations",
        description="Maximum number of Newton steps in each substep's last solve for segment "
        "lengths",
        soft=(1, 16),
        hard=(1, 64),
        source="Fast projection, Goldenthal et al. 2007",
        panel="Lengths",
    )
    contact_passes: int = integer(
        2,
        label="Contact Passes",
        description="Number of times that contacts and lengths are solved in turn in each substep",
        soft=(1, 4),
        hard=(1, 16),
        panel="Collisions",
    )
    radius_root: float = number(
        0.004,
        label="Root Radius",
        description="Distance of the first points from colliders, as a fraction of the hair's "
        "length",
        soft=(0.0, 0.05),
        hard=(0.0, 1.0),
        source='"Pearl" configuration, Nguyen and Donnelly 2005',
        panel="Collisions",
    )
    radius_tip: float = number(
        0.016,
        label="Tip Radius",
        description="Distance of the tip from colliders, as a fraction of the hair's length, so "
        "that no collider slips between points",
        soft=(0.0, 0.1),
        hard=(0.0, 1.0),
        source='"Pearl" configuration, Nguyen and Donnelly 2005',
        panel="Collisions",
    )
    only_selected: bool = toggle(
        False,
        label="Only Selected",
        description="Simulate the curves that are selected in Sculpt or Edit Mode; guides that are "
        "not selected stay in their style",
        panel="Shot",
    )
    inherit_location: float = number(
        0.0,
        label="Inherit Location",
        description="Fraction of the roots' movement that hair takes over at once, without lagging "
        "behind; at 1 it moves as if its head stayed in place",
        soft=(0.0, 1.0),
        hard=(0.0, 1.0),
        unit="factor",
        source="1 less the linear velocity scale of grooms in Unreal",
        panel="Shot",
    )
    inherit_rotation: float = number(
        0.0,
        label="Inherit Rotation",
        description="Fraction of the roots' rotation that hair takes over at once, without lagging "
        "behind; at 1 it moves as if its head did not turn, but for its weight",
        soft=(0.0, 1.0),
        hard=(0.0, 1.0),
        unit="factor",
        source="1 less the angular velocity scale of grooms in Unreal",
        panel="Shot",
    )
    jump_distance: float = number(
        3.0,
        label="Jump Distance",
        description="Treat a frame as a cut if the roots move farther than in the frame before "
        "by this many extents of the hair. The hair goes along without gaining speed. 0 turns this "
        "off",
        soft=(0.0, 10.0),
        hard=(0.0, 1.0e6),
        panel="Shot",
    )
    jump_turn: float = number(
        math.radians(120.0),
        label="Jump Turn",
        description="Treat a frame as a cut if the roots turn by more than this. The hair goes "
        "along without gaining speed. 0 turns this off",
        soft=(0.0, math.pi),
        hard=(0.0, math.pi),
        unit="angle",
        panel="Shot",
    )
    pre_roll: int = integer(
        0,
        label="Pre-Roll",
        description="Frames that are simulated before the first one, with the head where it is "
        "then, so that hair hangs and blows from the start",
        soft=(0, 100),
        hard=(0, 1000),
        panel="Shot",
    )
    time_scale: float = number(
        1.0,
        label="Time Scale",
        description="Speed of the hair's time; at 0 hair is frozen and goes along with its roots",
        soft=(0.0, 1.0),
        hard=(0.0, 4.0),
        panel="Shot",
    )
