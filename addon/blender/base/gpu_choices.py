"""What an artist chooses about the GPU of this machine, and how much of its memory is taken."""

from __future__ import annotations

from ...render import gpu_memory, gpu_objects
from ...render.capabilities import choose_image_atomics

#: whether drawing may use atomics of images; those of render/capabilities.py: name, label,
#: description
ATOMICS = (
    ("automatic", "Automatic", "Use image atomics if a short test shows that they work"),
    (
        "never",
        "Never",
        "Draw as on GPUs without image atomics; strands are noisy while the view moves",
    ),
)
#: [MB] that hair may take at least, and where nobody chooses
MIN_MEMORY, DEFAULT_MEMORY = 128, gpu_memory.DEFAULT


def choose(*, image_atomics: str = "automatic", memory: int = DEFAULT_MEMORY) -> None:
    """From the next draw on.

    Args:
        image_atomics: the name of one of ATOMICS. memory: [MB].
    """
    choose_image_atomics(image_atomics)
    gpu_memory.choose_budget(memory)


def memory_in_use() -> float:
    """Of the GPU, by all that Hairloom draws [MB]."""
    return gpu_objects.bytes_in_use() / gpu_memory.MEGABYTE


def peak_memory() -> float:
    """The most that was in use at once since Blender started [MB]."""
    return gpu_objects.peak_bytes() / gpu_memory.MEGABYTE


def memory_problem() -> str:
    """What to do where more of the GPU's memory is taken than may be; else empty."""
    budget = gpu_memory.budget() / gpu_memory.MEGABYTE
    if memory_in_use() <= budget:
        return ""
    return (
        f"Hair takes {memory_in_use():,.0f} MB of the GPU's memory, and may take {budget:,.0f} "
        "MB: strands are drawn in more parts, and views at rest are redrawn. Raise GPU Memory in "
        "the preferences if the GPU has more, or lower Resolution in Shadows or the number of "
        "children"
    )
