"""The parameters of fins: meshes that move as cloth."""

from __future__ import annotations

from dataclasses import dataclass

from ...params import integer, number, toggle
from ..motion_settings import MotionSettings
from ..settings import DynamicsSettings


@dataclass(frozen=True, kw_only=True)
class FinSettings(MotionSettings):
    """How a mesh moves as cloth: its edges, the air and colliders.

    All vertices have the same mass. Parameters that hair has too have the same names and meanings.
    """

    section = "fin"
    title = "Cloth"
    help_page = "dynamics#cloth"
    owner = "character"
    panels = ("Cloth", "Medium & Wind", "Collisions", "Steps")

    substep_rate: float = number(
        240.0,
        label="Substeps",
        description="Steps per second for air, bending and colliders, independent of the frame "
        "rate",
        soft=(60.0, 480.0),
        hard=(30.0, 2000.0),
        unit="rate",
        source="Jakobsen 2001; fixed step with accumulator, Fiedler 2004",
        panel="Steps",
    )
    small_steps: int = integer(
        10,
        label="Small Steps",
        description="Number of motion and edge steps per substep; doubling them quarters the "
        "stretch",
        soft=(1, 24),
        hard=(1, 256),
        source="Macklin et al. 2019",
        panel="Steps",
    )
    max_frame_time: float = number(
        0.25,
        label="Max Frame Time",
        description="Maximum time to simulate between two frames",
        soft=(0.05, 1.0),
        hard=(0.01, 10.0),
        unit="time",
        panel="Steps",
    )
    gravity: float = number(
        1.0,
        label="Gravity",
        description="Factor on the scene's gravity",
        soft=(0.0, 2.0),
        hard=(-10.0, 10.0),
        panel="Cloth",
    )
    damping: float = number(
        3.0,
        label="Air Damping",
        description="Rate at which a face that moves broadside takes on the speed of the air or "
        "water around it",
        soft=(0.0, 10.0),
        hard=(0.0, 1000.0),
        unit="rate",
        source="Jakobsen 2001",
        panel="Medium & Wind",
    )
    drag: float = number(
        0.0,
        label="Drag",
        description="Quadratic drag on broadside motion, per metre travelled: about 3 for thin "
        "cloth in air, hundreds in water",
        soft=(0.0, 10.0),
        hard=(0.0, 1000.0),
        source="Rayleigh's drag equation",
        panel="Medium & Wind",
    )
    edgewise: float = number(
        0.1,
        label="Edgewise Drag",
        description="Fraction of Air Damping and Drag that acts on motion along the face",
        soft=(0.0, 1.0),
        hard=(0.0, 1.0),
        unit="factor",
        panel="Medium & Wind",
    )
    stretch: float = number(
        0.0,
        label="Stretch",
        description="Stretch at the upper edge of a one-metre sheet hanging under its own weight",
        soft=(0.0, 0.1),
        hard=(0.0, 10.0),
        unit="factor",
        source="XPBD, Macklin et al. 2016",
        panel="Cloth",
    )
    bend: float = number(
        1.0,
        label="Bend Stiffness",
        description="Stiffness of the fold between two faces, in swings per second of their outer "
        "vertices",
        soft=(0.0, 20.0),
        hard=(0.0, 1000.0),
        unit="rate",
        source="XPBD, Macklin et al. 2016",
        panel="Cloth",
    )
    shape: float = number(
        0.0,
        label="Shape Stiffness",
        description="Stiffness that holds each vertex to its animated position, in swings per "
        "second",
        soft=(0.0, 10.0),
        hard=(0.0, 1000.0),
        unit="rate",
        source="Global shape constraint, Han and Harada 2012",
        panel="Cloth",
    )
    pin_pull: float = number(
        4.0,
        label="Pin Stiffness",
        description="Stiffness that holds a vertex of pin weight 0.5 to its animated position, in "
        "swings per second; it grows without bound towards a weight of 1",
        soft=(0.0, 20.0),
        hard=(0.0, 1000.0),
        unit="rate",
        panel="Cloth",
    )
    long_range: bool = toggle(
        True,
        label="Long Range",
        description="Limit each vertex's distance from its nearest pinned vertex to the distance "
        "along edges",
        source="Kim, Chentanez and Mueller 2012",
        panel="Cloth",
    )
    radius: float = number(
        0.012,
        label="Collision Radius",
        description="Distance that vertices keep from colliders, in quarters of the cloth's extent",
        soft=(0.0, 0.1),
        hard=(0.0, 1.0),
        panel="Collisions",
    )

    def as_dynamics(self) -> DynamicsSettings:
        """The settings that colliders are made with, as for hair; the rest are hair's defaults."""
        return DynamicsSettings(collider_resolution=self.collider_resolution)
