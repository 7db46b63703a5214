"""The properties of a fin beside its parameters; they live on its object."""

from __future__ import annotations

from typing import Any

from bpy.props import BoolProperty, StringProperty

from .properties import OVERRIDABLE

FIN_PROPERTIES: dict[str, Any] = {
    "enabled": BoolProperty(
        name="Simulate",
        description="Simulate this fin when Play is pressed, in playback and in bakes",
        default=True,
        override=OVERRIDABLE,
    ),
    "pin_group": StringProperty(
        name="Pin Group",
        description="Vertex group that the animation carries: at weight 1 firmly, below softly; "
        "empty: nothing is pinned, and the mesh falls",
        override=OVERRIDABLE,
    ),
}
