"""What the artist sets about pictures of the render engine."""

from __future__ import annotations

from dataclasses import dataclass

from ..params import Settings, integer


@dataclass(frozen=True, kw_only=True)
class PictureSettings(Settings):
    """How many samples make one picture."""

    section = "picture"
    title = "Sampling"
    owner = "scene"

    samples: int = integer(
        32,
        label="Render Samples",
        description="Samples of each pixel in a render, each a little beside the others",
        soft=(1, 256),
        hard=(1, 65536),
    )
    viewport_samples: int = integer(
        32,
        label="Viewport Samples",
        description="Samples of each pixel that the viewport adds up while nothing moves",
        soft=(1, 64),
        hard=(1, 65536),
    )
    motion_steps: int = integer(
        16,
        label="Motion Steps",
        description="Moments in the time that the shutter is open, among which a render's samples "
        "are shared out; the scene is evaluated for each",
        soft=(2, 64),
        hard=(1, 1024),
    )
