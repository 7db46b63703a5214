"""Splits the random actions of tests/window/session_random.py among Blenders."""

from __future__ import annotations

#: Most actions of one Blender. On Vulkan, Mesa's software driver limits how much it can draw, see
#: docs/troubleshooting.md: 250 actions use up to 40,000 of 65,530 memory maps.
MAX_ACTIONS = {"opengl": 500, "vulkan": 250}
#: difference of a seed from that of its next part
SEED_STEP = 1000


def random_parts(seeds: list[str], actions: int, backend: str) -> list[dict[str, str]]:
    """The settings of each Blender.

    The remaining actions of a seed are played in another Blender, with an empty file and their own
    seed: 1003 after 3. So each part can be repeated without those before it.
    """
    parts = []
    for seed in seeds:
        for number, start in enumerate(range(0, actions, MAX_ACTIONS[backend])):
            count = min(MAX_ACTIONS[backend], actions - start)
            name = str(int(seed) + number * SEED_STEP)
            parts.append({"HAIRLOOM_SEEDS": name, "HAIRLOOM_ACTIONS": str(count)})
    return parts
