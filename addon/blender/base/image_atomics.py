"""Whether drawing may use atomics of images: an artist's choice for this machine."""

from __future__ import annotations

from ...render.capabilities import choose_image_atomics

#: those of render/capabilities.py: name, label, description
CHOICES = (
    ("automatic", "Automatic", "Use image atomics where a small test finds that they work"),
    ("never", "Never", "Draw as on GPUs without image atomics: strands are noisy in a moving view"),
)


def choose(choice: str) -> None:
    """From the next draw on; the name of one of CHOICES."""
    choose_image_atomics(choice)
