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
        description="Samples that the viewport accumulates while nothing moves. In previews over "
        "other engines they soften the shadows of lights with a size; each sample draws the hair "
        "and its shadow maps once. With 1 sample, or without a GPU, shadows stay hard there",
        soft=(1, 64),
        hard=(1, 65536),
    )
    motion_steps: int = integer(
        16,
        label="Motion Steps",
        description="Number of times the scene is evaluated while the shutter is open; render "
        "samples are divided among them",
        soft=(2, 64),
        hard=(1, 1024),
    )
