"""Parameters of fitted spheres."""

from __future__ import annotations

from dataclasses import dataclass

from ...params import Settings, integer, number


@dataclass(frozen=True, kw_only=True)
class SphereFitSettings(Settings):
    """How a mesh is approximated by balls."""

    section = "sphere_fit"
    title = "Fitted Spheres"
    help_page = "dynamics#collisions"

    sphere_count: int = integer(
        60,
        label="Spheres",
        description="Number of spheres that approximate the mesh",
        soft=(4, 200),
        hard=(1, 1000),
    )
    overshoot: float = number(
        0.01,
        label="Overshoot",
        description="Distance by which spheres may stick out of the mesh, as a fraction of its "
        "longest side; higher values leave smaller gaps",
        soft=(0.0, 0.05),
        hard=(0.0, 0.5),
        unit="factor",
    )
