"""The soft shadow on a head's skin as a picture: its map in UV space, see render/skin_pass.py."""

from __future__ import annotations

from dataclasses import replace

import bpy
import numpy as np

from ...arrays import Floats
from ...errors import HairloomError
from ...render.marschner_textures import hair_forward
from ...render.skin_pass import SkinPass, SkinShadow
from ...render.snapshot import MeshSnapshot, Snapshot
from ...render.strand_pass import StrandPass
from ...rig_flow import Pose, Rig
from ...shading.lights import packed_lights
from ...shading.skin.diffusion import SKIN_LIGHTS
from ...strands import Surface
from .slices import lit_as_in_view

#: name of the image that shows it, reused each time
IMAGE = "Skin Shadow"


def skin_shadow_picture(snapshot: Snapshot, strand_pass: StrandPass, *, place: str) -> Floats:
    """The transmittance of light to the skin, (rows, columns, 4) scene-linear, row 0 at v = 0.

    White is full light, and transparent texels are no skin. The maps of up to four lights are side
    by side, in the order of the lights.

    Args:
        snapshot: with the head as its meshes.
        place: for errors.

    Raises:
        HairloomError: there is no such shadow.
    """
    maps = strand_pass.opacity(snapshot)
    if maps is None or not snapshot.skin.soft_shadow or not snapshot.skin.softness:
        raise HairloomError(
            "there is no soft shadow on skin to show",
            place=place,
            remedy="Set Shadows to Deep Opacity or Opacity Slices, and Soft Shadow on Skin with a "
            "Softness above 0",
        )
    if not maps.size.map_count:
        raise HairloomError(
            "no light casts a shadow of the hair",
            place=place,
            remedy="Add a light outside of the hair, and raise Max Lights in Shadows if it is 0",
        )
    lights, skin_pass = len(packed_lights(snapshot.lights)), SkinPass()
    skin_pass.shadows(snapshot.meshes, maps, snapshot.skin, lights, hair_forward(snapshot))
    if not skin_pass.drawn_shadows:
        raise HairloomError(
            "there is no head with UVs",
            place=place,
            remedy="Choose a head, and unwrap it (UV > Unwrap in Edit Mode)",
        )
    return _side_by_side(skin_pass.drawn_shadows[0], min(maps.size.map_count, SKIN_LIGHTS))


def skin_shadow_of_view(
    snapshot: Snapshot, rig: Rig, pose: Pose, context: bpy.types.Context, *, place: str
) -> Floats:
    """As `skin_shadow_picture`, for previewed hair on its head, in the light of the 3D view.

    Raises:
        HairloomError: as `skin_shadow_picture`.
    """
    shown = lit_as_in_view(context, _with_head(snapshot, rig, pose))
    return skin_shadow_picture(shown, StrandPass(), place=place)


def _with_head(snapshot: Snapshot, rig: Rig, pose: Pose) -> Snapshot:
    """The hair with its head as a mesh."""
    head = rig.head
    if head is None or pose.head_positions is None:
        return snapshot
    surface = Surface(pose.head_positions, head.triangles, head.corner_uv)
    mesh = MeshSnapshot.of(surface, is_skin=True)
    return replace(snapshot, meshes=(mesh,), casters=())


def _side_by_side(shadow: SkinShadow, count: int) -> Floats:
    """The first `count` channels of a map, each as its own picture."""
    is_skin = shadow.layout.island >= 0
    values = np.where(is_skin[..., None], shadow.picture(), 0.0)
    pictures = [
        np.dstack([values[..., light]] * 3 + [is_skin]).astype(np.float32) for light in range(count)
    ]
    return np.concatenate(pictures, axis=1)
