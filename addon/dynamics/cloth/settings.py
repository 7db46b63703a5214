"""The parameters of fins: meshes that move as cloth."""

from __future__ import annotations

from dataclasses import dataclass

from ...params import integer, number, toggle
from ..motion_settings import MotionSettings
from ..settings import DynamicsSettings


@dataclass(frozen=True, kw_only=True)
class FinSettings(MotionSettings):
    """How a mesh moves as cloth: what hangs on its edges, on the air and on colliders.

    Each vertex weighs the same. What hair has too has the same name and means the same.
    """

    section = "fin"
    title = "Cloth"
    owner = "character"
    panels = ("Cloth", "Medium & Wind", "Collisions", "Steps")

    substep_rate: float = number(
        240.0,
        label="Substeps",
        description="How often in a second air, bending and colliders act, whatever the frame rate",
        soft=(60.0, 480.0),
        hard=(30.0, 2000.0),
        unit="rate",
        source="Jakobsen 2001; fixed step with accumulator, Fiedler 2004",
        panel="Steps",
    )
    small_steps: int = integer(
        10,
        label="Small Steps",
        description="Steps of the motion and its edges in each substep; twice as many stretch a "
        "quarter as much",
        soft=(1, 24),
        hard=(1, 256),
        source="Macklin et al. 2019",
        panel="Steps",
    )
    longest_frame: float = number(
        0.25,
        label="Longest Frame",
        description="A longer pause between two frames is simulated as this much time",
        soft=(0.05, 1.0),
        hard=(0.01, 10.0),
        unit="time",
        panel="Steps",
    )
    gravity: float = number(
        1.0,
        label="Gravity",
        description="Fraction of the scene's gravity that pulls at the cloth",
        soft=(0.0, 2.0),
        hard=(-10.0, 10.0),
        panel="Cloth",
    )
    damping: float = number(
        3.0,
        label="Air Damping",
        description="How fast still air, or water, takes the speed out of a face that moves "
        "broadside, and how fast wind gives it its own",
        soft=(0.0, 10.0),
        hard=(0.0, 1000.0),
        unit="rate",
        source="Jakobsen 2001",
        panel="Medium & Wind",
    )
    drag: float = number(
        0.0,
        label="Drag",
        description="Braking by the square of the broadside speed, for each metre of way; thin "
        "cloth in air about 3, in water hundreds",
        soft=(0.0, 10.0),
        hard=(0.0, 1000.0),
        source="Rayleigh's drag equation",
        panel="Medium & Wind",
    )
    edgewise: float = number(
        0.1,
        label="Edgewise Fraction",
        description="Fraction of damping and drag that acts on motion along the face, which slips "
        "through the air",
        soft=(0.0, 1.0),
        hard=(0.0, 1.0),
        unit="factor",
        panel="Medium & Wind",
    )
    stretch: float = number(
        0.0,
        label="Stretch",
        description="How much of its length a hanging sheet of one metre gains at its upper edge "
        "by its own weight",
        soft=(0.0, 0.1),
        hard=(0.0, 10.0),
        unit="factor",
        source="XPBD, Macklin et al. 2016",
        panel="Cloth",
    )
    bend: float = number(
        1.0,
        label="Bend Stiffness",
        description="How strongly two faces keep their fold, in swings a second of their outer "
        "vertices against each other",
        soft=(0.0, 20.0),
        hard=(0.0, 1000.0),
        unit="rate",
        source="XPBD, Macklin et al. 2016",
        panel="Cloth",
    )
    shape: float = number(
        0.0,
        label="Shape Stiffness",
        description="Pull of each vertex to where the animation carries it, in swings a second",
        soft=(0.0, 10.0),
        hard=(0.0, 1000.0),
        unit="rate",
        source="Global shape constraint, Han and Harada 2012",
        panel="Cloth",
    )
    pin_pull: float = number(
        4.0,
        label="Pin Stiffness",
        description="Pull of a vertex whose pin weight is one half to where the animation carries "
        "it, in swings a second; it grows without bound towards a weight of 1",
        soft=(0.0, 20.0),
        hard=(0.0, 1000.0),
        unit="rate",
        panel="Cloth",
    )
    long_range: bool = toggle(
        True,
        label="Long Range",
        description="No vertex goes farther from its nearest pinned vertex than its way along "
        "the edges",
        source="Kim, Chentanez and Mueller 2012",
        panel="Cloth",
    )
    radius: float = number(
        0.003,
        label="Collision Radius",
        description="Distance that vertices keep from colliders",
        soft=(0.0, 0.02),
        hard=(0.0, 0.1),
        unit="length",
        panel="Collisions",
    )

    def as_dynamics(self) -> DynamicsSettings:
        """What colliders are made by, as hair has it; all else is as hair's defaults."""
        return DynamicsSettings(collider_resolution=self.collider_resolution)
