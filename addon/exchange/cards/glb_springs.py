"""Joints, weights and springs, added to a GLB of cards: VRMC_springBone, which UniVRM, three-vrm,
Godot VRM and others simulate.

VRM Consortium, "VRMC_springBone 1.0". Its numbers are those of `SpringValues`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from ...arrays import Floats
from ...cards.card_mesh import CardMesh
from ...cards.joints import joint_names
from ...cards.spring_bones import DOWN, SpringColliders
from ...cards.spring_chains import SpringRig
from .card_formats import GLB
from .glb_file import GlbFile
from .glb_skin import ROOT_JOINT, add_head_bone, add_skinned, file_vector

SPRINGS = "VRMC_springBone"
_VERSION = "1.0"


@dataclass(frozen=True, eq=False)
class HeadBone:
    """The bone of a character that carries its hair. matrix: (4, 4) rigid, its place at rest in the
    world [m], Z up, with y along the bone.
    """

    name: str
    matrix: Floats


@dataclass(frozen=True, eq=False)
class SpringSkeleton:
    """The joints and springs that go into the file beside the meshes, in metres and Z up.

    root: (3,) where the root joint, which rides on the head, is at rest.
    bone: the one that carries the root joint; None where the character has no bones.
    """

    rig: SpringRig
    root: Floats
    bone: HeadBone | None = None


def with_springs(
    data: bytes,
    nodes: Sequence[str],
    levels: Sequence[CardMesh],
    skeleton: SpringSkeleton,
    place: str,
) -> bytes:
    """The same GLB, its meshes skinned to chains that springs move.

    Args:
        data: as Blender wrote it. nodes: of the levels in it.

    Raises:
        HairloomError: its vertices are not those of the levels.
    """
    file, rig = GlbFile.of(data, place), skeleton.rig
    chains = rig.chains
    joints = add_skinned(file, nodes, levels, chains.rest, skeleton.root, rig.skins, place)
    if skeleton.bone is not None:
        add_head_bone(file, joints[0], skeleton.bone.name, skeleton.bone.matrix)
    file.content.setdefault("extensions", {})[SPRINGS] = _extension(skeleton, joints)
    file.content.setdefault("extensionsUsed", []).append(SPRINGS)
    return file.data()


def spring_list(rig: SpringRig) -> list[dict[str, Any]]:
    """For each chain its joints by name, the values of their springs, and the colliders that it
    stays out of. The last joint ends the chain, so it has no values.
    """
    chains, values = rig.chains, rig.values
    count, size = chains.rest.shape[:2]
    names = joint_names(count, size)
    return [
        {
            "joints": names[chain * size :][:size],
            "stiffness": _rounded(values.stiffness[chain]),
            "drag": _rounded(values.drag[chain]),
            "gravity": _rounded(values.gravity[chain]),
            "hit_radius": _rounded(values.hit_radius[chain]),
            "colliders": [int(number) for number in chains.collides[chain].nonzero()[0]],
        }
        for chain in range(count)
    ]


def collider_list(balls: SpringColliders, root: Floats) -> list[dict[str, Any]]:
    """Balls and capsules, in the space of the root joint, which is at `root`, (3,) [m]."""
    shapes: list[dict[str, Any]] = []
    for center, tail, radius in zip(balls.center, balls.tail, balls.radius, strict=True):
        shape = {"offset": file_vector(center - root), "radius": float(radius)}
        is_capsule = bool((center != tail).any())
        shapes.append(
            {"capsule": {**shape, "tail": file_vector(tail - root)}}
            if is_capsule
            else {"sphere": shape}
        )
    return shapes


def _extension(skeleton: SpringSkeleton, joints: list[int]) -> dict[str, Any]:
    """joints: nodes, the root first."""
    rig, root = skeleton.rig, joints[0]
    shapes = collider_list(rig.chains.colliders, skeleton.root)
    node = dict(zip(joint_names(*rig.chains.rest.shape[:2]), joints[1:], strict=True))
    springs = [
        {
            "name": f"{ROOT_JOINT}_{number}",
            "joints": _joints(spring, node),
            **({"colliderGroups": spring["colliders"]} if spring["colliders"] else {}),
        }
        for number, spring in enumerate(spring_list(rig))
    ]
    extension: dict[str, Any] = {"specVersion": _VERSION, "springs": springs}
    if shapes:
        extension["colliders"] = [{"node": root, "shape": shape} for shape in shapes]
        # a group for each collider, since a chain refers to groups
        extension["colliderGroups"] = [
            {"name": f"head_{number}", "colliders": [number]} for number in range(len(shapes))
        ]
    return extension


def _joints(spring: dict[str, Any], node: dict[str, int]) -> list[dict[str, Any]]:
    *bones, end = spring["joints"]
    down = GLB.to_file_space(DOWN).tolist()
    return [
        {
            "node": node[name],
            "stiffness": spring["stiffness"][number],
            "dragForce": spring["drag"][number],
            "gravityPower": spring["gravity"][number],
            "gravityDir": down,
            "hitRadius": spring["hit_radius"][number],
        }
        for number, name in enumerate(bones)
    ] + [{"node": node[end]}]


def _rounded(values: Floats) -> list[float]:
    """To six digits: none of them is measured better."""
    return [float(f"{value:.6g}") for value in values]
