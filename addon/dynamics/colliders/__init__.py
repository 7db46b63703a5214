"""Colliders: balls, capsules, sets of balls and closed meshes, posed by matrices."""

from .distance_field import DistanceField
from .posed import Collider, Pose, PosedCollider, poses_through, transform_points
from .shapes import CapsuleCollider, SphereCollider
from .signed_distance import signed_distance
from .sphere_set import SphereSetCollider

__all__ = [
    "CapsuleCollider",
    "Collider",
    "DistanceField",
    "Pose",
    "PosedCollider",
    "SphereCollider",
    "SphereSetCollider",
    "poses_through",
    "signed_distance",
    "transform_points",
]
