"""The artist's settings for this machine's GPU, and how much of its memory is in use."""

from __future__ import annotations

from ...render import gpu_memory, gpu_objects
from ...render.capabilities import choose_image_atomics

#: whether drawing may use image atomics, see render/capabilities.py: name, label, description
ATOMICS = (
    ("automatic", "Automatic", "Use image atomics if a short test shows that they work"),
    (
        "never",
        "Never",
        "Draw as on GPUs without image atomics; strands are noisy while the view moves",
    ),
)
#: [MB] the lowest limit that can be set, and the default
MIN_MEMORY, DEFAULT_MEMORY = 128, gpu_memory.DEFAULT_MEGABYTES


def apply(*, image_atomics: str = "automatic", memory: int = DEFAULT_MEMORY) -> None:
    """Apply settings from the next draw on.

    Args:
        image_atomics: the name of one of ATOMICS. memory: [MB].
    """
    choose_image_atomics(image_atomics)
    gpu_memory.choose_budget(memory)


def memory_in_use() -> float:
    """GPU memory that Hairloom uses now [MB]."""
    return gpu_objects.bytes_in_use() / gpu_memory.MEGABYTE


def peak_memory() -> float:
    """Peak GPU memory that Hairloom has used since Blender started [MB]."""
    return gpu_objects.peak_bytes() / gpu_memory.MEGABYTE


def memory_problem() -> str:
    """A message if Hairloom uses more of the GPU's memory than its limit; else empty."""
    budget = gpu_memory.budget() / gpu_memory.MEGABYTE
    if memory_in_use() <= budget:
        return ""
    return (
        f"Hair takes {memory_in_use():,.0f} MB of the GPU's memory, and may take {budget:,.0f} "
        "MB: strands are drawn in more parts, and views at rest are redrawn. Raise GPU Memory in "
        "the preferences if the GPU has more, or lower Resolution in Shadows or the number of "
        "children"
    )
