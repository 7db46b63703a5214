"""Random actions that are too many for one Blender are split; none is lost or done twice."""

from __future__ import annotations

import pytest
from random_parts import MAX_ACTIONS, random_parts


@pytest.mark.parametrize("backend", ["opengl", "vulkan"])
@pytest.mark.parametrize("actions", [1, 80, 250, 251, 500, 1200])
def test_the_parts_of_each_seed_are_all_its_actions(backend: str, actions: int) -> None:
    parts = random_parts(["3", "4"], actions, backend)
    counts = [int(part["HAIRLOOM_ACTIONS"]) for part in parts]
    assert sum(counts) == 2 * actions and min(counts) > 0 and max(counts) <= MAX_ACTIONS[backend]
    assert len({part["HAIRLOOM_SEEDS"] for part in parts}) == len(parts), "a part is played twice"


def test_vulkan_gets_more_blenders_and_the_first_parts_keep_their_seeds() -> None:
    found = [part["HAIRLOOM_SEEDS"] for part in random_parts(["1", "2"], 500, "vulkan")]
    assert found == ["1", "1001", "2", "1002"]
    assert [part["HAIRLOOM_SEEDS"] for part in random_parts(["1", "2"], 500, "opengl")] == [
        "1",
        "2",
    ]
