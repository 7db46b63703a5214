"""Animated pictures are small enough to load, smooth, and loop without a jump."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("PIL", reason="it is for development alone")
from PIL import Image, ImageSequence

IMAGES = Path(__file__).resolve().parents[2] / "docs" / "images"
FILES = sorted(IMAGES.glob("*.webp"))
MOST_BYTES = 1_000_000


def test_there_are_some() -> None:
    assert FILES


@pytest.mark.parametrize("file", FILES, ids=lambda file: file.stem)
def test_a_loop_is_small_and_goes_on_without_a_jump(file: Path) -> None:
    assert file.stat().st_size < MOST_BYTES
    with Image.open(file) as picture:
        assert picture.info["loop"] == 0, "it ends"
        frames, durations = [], set()
        for each in ImageSequence.Iterator(picture):
            frames.append(np.asarray(each.convert("RGB"), np.float32))
            durations.add(each.info["duration"])
    (duration,) = durations
    assert 12.0 <= 1000.0 / duration <= 15.0
    assert 2.0 <= len(frames) * duration / 1000.0 <= 4.0
    steps = [float(np.abs(a - b).mean()) for a, b in pairwise(frames)]
    jump = float(np.abs(frames[-1] - frames[0]).mean())
    assert min(steps) > 0.0, "it stands still"
    assert jump < 1.5 * max(steps), f"it jumps by {jump:.1f}, and else by {max(steps):.1f}"
