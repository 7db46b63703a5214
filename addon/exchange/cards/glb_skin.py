"""Joints, weights and keys, added to a GLB of cards that Blender's exporter wrote.

Blender's exporter would need an armature with actions in the scene; here all are arrays already.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...arrays import Floats, Ints
from ...cards.card_mesh import CardMesh
from ...cards.joint_keys import ChainKeys, quaternions, relative_to_parent
from ...cards.joint_solve import Skin
from ...cards.joints import JointRig, joint_names
from ...errors import HairloomError
from .card_formats import GLB
from .glb_file import GlbFile

#: The root joint, which carries all chains.
ROOT_JOINT = "hair_root"
ANIMATION = "hair_motion"
_ARRAY_BUFFER = 34962
#: Turns Z-up vectors into the file's: (x, z, -y).
_AXES = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])
#: How far a vertex of the file may be from ours, a fraction of the hair's size.
_MAX_MISMATCH = 1.0e-5
#: Weights below this count as 0.
_MIN_WEIGHT = 1.0e-5


@dataclass(frozen=True, eq=False)
class Skeleton:
    """The joints and keys that go into the file beside the meshes, in metres and Z up.

    keys: of each chain. root: (3,) where the root joint is at rest.
    root_keys: of the root joint, as one chain with one joint; None leaves it at rest.
    frame_rate: [1/s], of the keys' frames.
    """

    rig: JointRig
    keys: tuple[ChainKeys, ...]
    root: Floats
    root_keys: ChainKeys | None
    frame_rate: float


def with_skeleton(
    data: bytes, nodes: Sequence[str], levels: Sequence[CardMesh], skeleton: Skeleton, place: str
) -> bytes:
    """The same GLB, its meshes skinned and its joints animated.

    Args:
        data: as Blender wrote it. nodes: of the levels in it.

    Raises:
        HairloomError: its vertices are not those of the levels.
    """
    file = GlbFile.of(data, place)
    rig = skeleton.rig
    joints = add_skinned(file, nodes, levels, rig.rest, skeleton.root, rig.skins, place)
    _add_animation(file, skeleton, joints)
    return file.data()


def add_skinned(
    file: GlbFile,
    nodes: Sequence[str],
    levels: Sequence[CardMesh],
    rest: Floats,
    root: Floats,
    skins: Sequence[Skin],
    place: str,
) -> list[int]:
    """Put joints at rest, and the meshes' weights, into a file.

    Args:
        rest: (chains, joints, 4, 4) rigid [m]. root: (3,) [m].
        skins: of each level; the joint after all chains is the root.

    Returns:
        The nodes of all joints, the root first, then chain after chain.

    Raises:
        HairloomError: the file's vertices are not those of the levels.
    """
    joints = _add_joints(file, rest, root)
    skin = _add_skin(file, rest, root, joints)
    for node, mesh, weights in zip(nodes, levels, skins, strict=True):
        number = file.node(node)
        _add_weights(file, number, mesh, weights, len(joints), place)
        file.content["nodes"][number]["skin"] = skin
    _add_to_scene(file, [file.node(node) for node in nodes], joints[0])
    return joints


def add_head_bone(file: GlbFile, root: int, name: str, matrix: Floats) -> None:
    """Put the root joint below a joint that has the place and the axes of a character's bone, as
    Blender's own exporter writes bones.

    Args:
        root: number of the root joint's node, whose parent does not move it.
        matrix: (4, 4) rigid, of the bone in the world [m], Z up.
    """
    nodes, (skin,) = file.content["nodes"], file.content["skins"]
    axes, at_root = np.eye(4), np.eye(4)
    axes[:3, :3] = _AXES
    at_root[:3, 3] = nodes[root]["translation"]
    bone = axes @ matrix
    local = np.linalg.inv(bone) @ at_root
    nodes[root] |= {
        "translation": local[:3, 3].tolist(),
        "rotation": quaternions(local[:3, :3]).tolist(),
    }
    place = {"translation": bone[:3, 3].tolist(), "rotation": quaternions(bone[:3, :3]).tolist()}
    number = file.append("nodes", {"name": name, "children": [root], **place})
    for node in nodes[:number]:
        if root in node.get("children", []):
            node["children"] = [number if each == root else each for each in node["children"]]
    inverse = np.asarray(file.values(skin["inverseBindMatrices"]), np.float32).reshape(-1, 16)
    own = np.linalg.inv(bone).T.reshape(1, 16).astype(np.float32)
    own[0, 3::4] = [0.0, 0.0, 0.0, 1.0]
    skin["inverseBindMatrices"] = file.add(np.concatenate([inverse, own]), "MAT4")
    skin["joints"], skin["skeleton"] = [*skin["joints"], number], number


def vertices_of(file: GlbFile, primitive: dict[str, Any], mesh: CardMesh, place: str) -> Ints:
    """The mesh's vertex for each vertex of the file, found by the order of corners.

    Raises:
        HairloomError: the file's corners are others.
    """
    corners = np.asarray(file.values(primitive["indices"])).reshape(-1).astype(np.int64)
    positions = np.asarray(file.values(primitive["attributes"]["POSITION"]))
    expected_corners = mesh.triangles.reshape(-1)
    vertex = np.full(len(positions), -1)
    if len(corners) == len(expected_corners):
        vertex[corners] = expected_corners
        low, high = mesh.bounds()
        mismatch = np.abs(GLB.to_file_space(mesh.positions[vertex]) - positions).max(initial=0.0)
        tolerance = _MAX_MISMATCH * float(np.max(high - low, initial=0.0))
        if (
            np.array_equal(vertex[corners], expected_corners)
            and vertex.min() >= 0
            and mismatch <= tolerance
        ):
            return vertex
    raise HairloomError(
        "Blender's exporter wrote other vertices than those to be skinned",
        place=place,
        remedy="Write a motion texture instead, and report your version of Blender to us",
    )


def _add_weights(
    file: GlbFile, node: int, mesh: CardMesh, skin: Skin, joint_count: int, place: str
) -> None:
    (primitive,) = file.content["meshes"][file.content["nodes"][node]["mesh"]]["primitives"]
    vertex = vertices_of(file, primitive, mesh, place)
    weight = np.where(skin.weight < _MIN_WEIGHT, 0.0, skin.weight)
    weight = (weight / weight.sum(axis=1, keepdims=True)).astype(np.float32)
    # the root is joint 0; entries without weight refer to it, too
    joint = np.where(weight > 0.0, (skin.joint + 1) % joint_count, 0)
    is_small = joint.max(initial=0) < 256
    numbers: Ints = joint[vertex].astype(np.uint8) if is_small else joint[vertex].astype(np.uint16)
    attributes = primitive["attributes"]
    attributes["JOINTS_0"] = file.add(numbers, "VEC4", target=_ARRAY_BUFFER)
    attributes["WEIGHTS_0"] = file.add(weight[vertex], "VEC4", target=_ARRAY_BUFFER)


def _add_joints(file: GlbFile, rest: Floats, root: Floats) -> list[int]:
    """Add nodes of all joints; their numbers, the root first."""
    first = {"name": ROOT_JOINT, "translation": file_vector(root), "children": []}
    numbers = [file.append("nodes", first)]
    names = iter(joint_names(*rest.shape[:2]))
    at_root = np.eye(4)
    at_root[:3, 3] = root
    for chain in rest:
        parents = [at_root, *chain[:-1]]
        parent_node: dict[str, Any] = first
        for parent, own in zip(parents, chain, strict=True):
            local = relative_to_parent(parent, own)
            node = {
                "name": next(names),
                "translation": file_vector(local[:3, 3]),
                "rotation": _rotation(quaternions(local[:3, :3])),
            }
            numbers.append(file.append("nodes", node))
            parent_node.setdefault("children", []).append(numbers[-1])
            parent_node = node
    return numbers


def _add_skin(file: GlbFile, chains: Floats, root: Floats, joints: list[int]) -> int:
    rest = np.concatenate([np.eye(4)[None], chains.reshape(-1, 4, 4)])
    rest[0, :3, 3] = root
    axes = np.eye(4)
    axes[:3, :3] = _AXES
    inverse = np.linalg.inv(axes @ rest @ axes.T)
    inverse[:, 3] = [0.0, 0.0, 0.0, 1.0]
    columns = inverse.swapaxes(-1, -2).reshape(-1, 16).astype(np.float32)
    skin = {
        "name": ROOT_JOINT,
        "joints": joints,
        "skeleton": joints[0],
        "inverseBindMatrices": file.add(columns, "MAT4"),
    }
    return file.append("skins", skin)


def _add_to_scene(file: GlbFile, meshes: list[int], root: int) -> None:
    """Put meshes and root joint below one node, as Blender's own exporter does: readers look for
    their common parent.
    """
    (scene,) = file.content["scenes"]
    if scene["nodes"] == meshes:
        name = file.content["nodes"][meshes[0]]["name"]
        scene["nodes"] = [file.append("nodes", {"name": f"{name}_rig"})]
    (parent,) = scene["nodes"]
    file.content["nodes"][parent]["children"] = [root, *meshes]


def _add_animation(file: GlbFile, skeleton: Skeleton, joints: list[int]) -> None:
    samplers: list[dict[str, Any]] = []
    channels: list[dict[str, Any]] = []
    times: dict[bytes, int] = {}

    def add(node: int, path: str, frames: Ints, values: Floats, kind: str) -> None:
        known = frames.tobytes()
        if known not in times:
            seconds = (frames / skeleton.frame_rate).astype(np.float32)
            times[known] = file.add(seconds, "SCALAR")
        output = file.add(np.ascontiguousarray(values, np.float32), kind)
        samplers.append({"input": times[known], "output": output, "interpolation": "LINEAR"})
        target = {"node": node, "path": path}
        channels.append({"sampler": len(samplers) - 1, "target": target})

    still: Floats = np.zeros(3)
    chains: list[tuple[ChainKeys, list[int], Floats]] = []
    if skeleton.root_keys is not None:
        chains.append((skeleton.root_keys, joints[:1], still))
    size = skeleton.rig.joints
    for number, own in enumerate(skeleton.keys):
        chains.append((own, joints[1 + number * size :][:size], skeleton.root))
    for keys, nodes, parent in chains:
        for joint, node in enumerate(nodes):
            rotations, translations = keys.rotation[joint], keys.translation[joint]
            translations = translations if joint else translations - parent
            add(node, "rotation", keys.frames, _rotations(rotations), "VEC4")
            add(node, "translation", keys.frames, GLB.to_file_space(translations), "VEC3")
    animation = {"name": ANIMATION, "samplers": samplers, "channels": channels}
    file.append("animations", animation)


def file_vector(vector: Floats) -> list[float]:
    """A vector (3,) in the file's space."""
    return [float(value) for value in GLB.to_file_space(vector)]


def _rotations(quaternion: Floats) -> Floats:
    """Quaternions of Z-up space in the file's axes."""
    vector = GLB.to_file_space(quaternion[..., :3])
    turned: Floats = np.concatenate([vector, quaternion[..., 3:]], axis=-1)
    return turned


def _rotation(quaternion: Floats) -> list[float]:
    return [float(value) for value in _rotations(quaternion)]
