"""Settings of pictures of the render engine."""

from __future__ import annotations

from dataclasses import dataclass

from ..params import Settings, integer


@dataclass(frozen=True, kw_only=True)
class PictureSettings(Settings):
    """How many samples make one picture."""

    section = "picture"
    title = "Sampling"
    help_page = "engine#samples"
    owner = "scene"

    samples: int = integer(
        32,
        label="Render Samples",
        description="Samples per pixel in a render",
        soft=(1, 256),
        hard=(1, 65536),
    )
    viewport_samples: int = integer(
        32,
        label="View Samples",
        description="Samples that the viewport adds up while nothing moves. In the preview over "
        "other engines they soften the shadows of lights that have a size: each draws the hair and "
        "its shadow maps once. With 1, or without a GPU, shadows stay hard there",
        soft=(1, 64),
        hard=(1, 65536),
    )
    motion_steps: int = integer(
        16,
        label="Motion Steps",
        description="Number of times that the scene is evaluated while the shutter is open; the "
        "samples of a render are divided among them",
        soft=(2, 64),
        hard=(1, 1024),
    )
