"""A player of skinned GLB files, written from the specification alone."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from glb_files import Glb


class Player:
    """Plays a skinned GLB vertex by vertex (specification, section 3.7.3 and appendix C)."""

    def __init__(self, path: Path) -> None:
        self.file = Glb(path)
        self.json = self.file.json

    def corners(self, seconds: float) -> list[np.ndarray]:
        """The corners of all triangles of each skinned node, by node name, in Blender's axes."""
        return [points[index] for points, index in self._placed(seconds)]

    def vertices(self, seconds: float) -> np.ndarray:
        """All vertices of the finest level, used by a triangle or not, in Blender's axes."""
        return self._placed(seconds)[0][0]

    def _placed(self, seconds: float) -> list[tuple[np.ndarray, np.ndarray]]:
        world = self._worlds(seconds)
        (skin,) = self.json["skins"]
        inverse = self.file.accessor(skin["inverseBindMatrices"]).reshape(-1, 4, 4)
        moves = np.stack([world[n] for n in skin["joints"]]) @ inverse.swapaxes(1, 2)
        nodes = [node for node in self.json["nodes"] if "skin" in node]
        found = []
        for node in sorted(nodes, key=lambda each: each["name"]):
            (primitive,) = self.json["meshes"][node["mesh"]]["primitives"]
            names = ("POSITION", "JOINTS_0", "WEIGHTS_0")
            points, joint, weight = (
                self.file.accessor(primitive["attributes"][name]) for name in names
            )
            mixed = np.einsum("nk,nkab->nab", weight, moves[joint])
            placed = np.einsum("nab,nb->na", mixed[:, :3, :3], points) + mixed[:, :3, 3]
            index = self.file.accessor(primitive["indices"]).reshape(-1, 3)
            x, y, z = np.moveaxis(placed, -1, 0)
            found.append((np.stack([x, -z, y], axis=-1), index))
        return found

    def _worlds(self, seconds: float) -> dict[int, np.ndarray]:
        local = {n: dict(node) for n, node in enumerate(self.json["nodes"])}
        (animation,) = self.json["animations"]
        for channel in animation["channels"]:
            sampler = animation["samplers"][channel["sampler"]]
            value = self._value(sampler, channel["target"]["path"], seconds)
            local[channel["target"]["node"]][channel["target"]["path"]] = value
        world: dict[int, np.ndarray] = {}

        def walk(number: int, parent: np.ndarray) -> None:
            node, matrix = local[number], np.eye(4)
            x, y, z, w = node.get("rotation", (0.0, 0.0, 0.0, 1.0))
            # q p q* for each of the three axes
            matrix[:3, 0] = [
                w * w + x * x - y * y - z * z,
                2 * (x * y + w * z),
                2 * (x * z - w * y),
            ]
            matrix[:3, 1] = [
                2 * (x * y - w * z),
                w * w - x * x + y * y - z * z,
                2 * (y * z + w * x),
            ]
            matrix[:3, 2] = [
                2 * (x * z + w * y),
                2 * (y * z - w * x),
                w * w - x * x - y * y + z * z,
            ]
            matrix[:3, 3] = node.get("translation", (0.0, 0.0, 0.0))
            world[number] = parent @ matrix
            for child in node.get("children", ()):
                walk(child, world[number])

        for root in self.json["scenes"][0]["nodes"]:
            walk(root, np.eye(4))
        return world

    def _value(self, sampler: dict[str, Any], path: str, seconds: float) -> np.ndarray:
        times = self.file.accessor(sampler["input"])[:, 0].astype(np.float64)
        values = self.file.accessor(sampler["output"]).astype(np.float64)
        after = int(np.searchsorted(times, seconds).clip(1, max(len(times) - 1, 1)))
        if len(times) == 1:
            return values[0]
        one, two = values[after - 1], values[after]
        fraction = np.clip(
            (seconds - times[after - 1]) / (times[after] - times[after - 1]), 0.0, 1.0
        )
        if path == "translation":
            return one + (two - one) * fraction
        cosine = abs(one @ two)
        angle = np.arccos(min(cosine, 1.0))
        two = two * np.sign(one @ two)
        if angle < 1e-6:
            return one
        mixed = np.sin((1.0 - fraction) * angle) * one + np.sin(fraction * angle) * two
        return mixed / np.sin(angle)
