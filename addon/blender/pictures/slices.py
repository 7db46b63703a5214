"""The layers of hair's shadow maps as a picture, and as an image of Blender's."""

from __future__ import annotations

import bpy
import numpy as np

from ...arrays import Floats
from ...errors import HairloomError
from ...render.opacity_tiles import opacity_tiles
from ...render.snapshot import Snapshot
from ...render.strand_pass import StrandPass
from ...shading.lights import three_point_lights
from ...shading.volume.opacity import layer_ends
from ..viewport.overlay import with_view_lights

#: name of the image that shows them, reused each time
IMAGE = "Hair Slices"


def slices_picture(snapshot: Snapshot, strand_pass: StrandPass) -> Floats:
    """The layers of all lights' maps, (height, width, 4), see `opacity_tiles`.

    Raises:
        HairloomError: there are no shadows, or no light casts any.
    """
    maps = strand_pass.opacity(snapshot)
    if maps is None:
        raise HairloomError(
            "there are no shadows whose layers could be shown",
            place="Show Opacity Map",
            remedy="Set Shadows to Deep Opacity or Opacity Slices",
        )
    return opacity_tiles(maps, len(layer_ends(snapshot.volume)))


def slices_of_view(snapshot: Snapshot, context: bpy.types.Context) -> Floats:
    """As `slices_picture`, in the light of the 3D view; without one, in the snapshot's own light.

    Raises:
        HairloomError: as `slices_picture`.
    """
    return slices_picture(lit_as_in_view(context, snapshot), StrandPass())


def lit_as_in_view(context: bpy.types.Context, snapshot: Snapshot) -> Snapshot:
    """The snapshot in the light of the 3D view; without one, in its own light."""
    space = context.space_data
    if not isinstance(space, bpy.types.SpaceView3D):
        return snapshot
    studio = three_point_lights(np.array(context.region_data.view_matrix))
    return with_view_lights(snapshot, space.shading, studio)


def filled_image(name: str, picture: Floats) -> bpy.types.Image:
    """The image of this name, filled with a scene-linear picture.

    Args:
        picture: (height, width, 4), row 0 at the bottom.
    """
    height, width = picture.shape[:2]
    image = bpy.data.images.get(name)
    if image is None:
        image = bpy.data.images.new(name, width, height, alpha=True, float_buffer=True)
    if tuple(image.size) != (width, height):
        image.generated_width, image.generated_height = width, height
    image.colorspace_settings.name = "Linear Rec.709"
    image.pixels.foreach_set(np.ascontiguousarray(picture, np.float32).ravel())
    image.update()
    return image
