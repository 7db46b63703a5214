"""Into how many Blenders the random actions of tests/window/session_random.py are split."""

from __future__ import annotations

#: Actions that one Blender can do. On Vulkan Mesa's software driver lets it draw so much and no
#: more, see docs/troubleshooting.md: 250 actions leave up to 40,000 memory maps of 65,530.
MOST_ACTIONS = {"opengl": 500, "vulkan": 250}
#: between a seed and the one that its next part has
NEXT_PART = 1000


def random_parts(seeds: list[str], actions: int, backend: str) -> list[dict[str, str]]:
    """The settings of each Blender.

    What is left of a seed goes on in another Blender, with an empty file and a seed of its own:
    1003 after 3. So each part is played again alone, without what came before it.
    """
    parts = []
    for seed in seeds:
        for number, begun in enumerate(range(0, actions, MOST_ACTIONS[backend])):
            count = min(MOST_ACTIONS[backend], actions - begun)
            name = str(int(seed) + number * NEXT_PART)
            parts.append({"HAIRLOOM_SEEDS": name, "HAIRLOOM_ACTIONS": str(count)})
    return parts
