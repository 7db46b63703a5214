"""The parameters of settling: letting combed hair fall onto the body."""

from __future__ import annotations

from dataclasses import dataclass, replace

from ..params import Settings, number
from .settings import DynamicsSettings

#: Minimum air damping of falling hair [1/s], so that it comes to rest without swinging.
_DAMPING = 3.0


@dataclass(frozen=True, kw_only=True)
class SettleSettings(Settings):
    """How combed hair falls onto head and shoulders."""

    section = "settle"
    title = "Settle"
    help_page = "styling#settle"

    seconds: float = number(
        2.0,
        label="Time",
        description="Maximum time that the hair falls; it stops earlier once nothing moves",
        unit="time",
        soft=(0.1, 5.0),
        hard=(0.0, 60.0),
    )
    stiffness: float = number(
        0.4,
        label="Stiffness",
        description="Fraction of the stiffness set under Dynamics that holds the combed shape "
        "while hair falls; at 0 it hangs limp from its roots",
        unit="factor",
        soft=(0.0, 1.0),
        hard=(0.0, 10.0),
    )

    def falling(self, own: DynamicsSettings) -> DynamicsSettings:
        """The dynamics of falling hair: full weight, still air, a fraction of its stiffness."""
        held = dict.fromkeys(("style_root", "style_tip", "bend"), self.stiffness)
        return replace(
            own.multiplied(**held),
            influence=1.0,
            only_selected=False,
            sag_compensation=0.0,
            buoyancy=0.0,
            drag=0.0,
            wind_speed=0.0,
            damping=max(own.damping, _DAMPING),
        )
