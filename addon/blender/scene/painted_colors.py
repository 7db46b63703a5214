"""Reading the colours that are painted on the surface under hair.

A name is looked up as a colour attribute of the surface, then as an image on the surface's active
UV map.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import bpy
import numpy as np

from ...arrays import Floats
from ...errors import HairloomError
from ...exchange.textures.srgb import srgb_decoded
from ...groom.painted_color import ImageColor, PaintedColor, SurfaceColor
from ...groom.roots import bind_roots
from ...paint_flow import with_colors
from ...shading.settings import ShadingSettings
from ..base.attributes import read_attribute
from ..base.mesh_arrays import triangle_corners
from ..base.objects import head_of
from ..base.vertex_weights import at_corners, color_choices, image_names, is_color
from .curves import read_original_curves
from .masks import checked_image, checked_values
from .surfaces import evaluated_mesh, read_corner_uv, read_surface

#: Colour spaces of images whose stored pixels are scene-linear Rec. 709 already.
_LINEAR = ("Linear Rec.709", "Non-Color")


def read_colors(
    hair: bpy.types.Object, depsgraph: bpy.types.Depsgraph, triangle_count: int | None
) -> tuple[PaintedColor | None, tuple[str, ...]]:
    """The colour map that the hair's look names, None if there is none or it is unusable; and
    warnings.

    Args:
        triangle_count: of the surface that the hair was made on; None: there is none.
    """
    name = hair.data.hairloom.shading.color_map
    if not name:
        return None, ()
    try:
        colors = painted_colors(head_of(hair), name, depsgraph, triangle_count, place=hair.name)
    except HairloomError as error:
        return None, (f"{error}. Until then the look's colour is used",)
    return colors, ()


def painted_colors(
    surface: bpy.types.Object | None,
    name: str,
    depsgraph: bpy.types.Depsgraph,
    triangle_count: int | None,
    *,
    place: str,
) -> PaintedColor:
    """The colours of this name.

    Args:
        surface: an object; None: the hair has none in this scene.
        place: names the hair in messages.

    Raises:
        HairloomError: there are none, or they are unusable.
    """
    if surface is None or triangle_count is None:
        raise HairloomError(
            f"the colour map '{name}' needs a surface, and it has none",
            place=place,
            remedy="Set Surface in its Data properties, or clear Colour Map",
        )
    with evaluated_mesh(surface, depsgraph, surface.name) as mesh:
        colors = _of_attribute(mesh, name, surface.name) or _of_image(mesh, name, surface.name)
        mesh_triangle_count = len(mesh.loop_triangle_polygons)
    if colors is None:
        raise _missing(surface, name)
    if mesh_triangle_count != triangle_count:
        raise HairloomError(
            f"the colour map '{name}' covers {mesh_triangle_count:,} triangles, but the hair "
            f"was made on {triangle_count:,}",
            place=surface.name,
            remedy="Turn on the modifiers that change the mesh, then show the hair",
        )
    if np.linalg.det(np.array(surface.evaluated_get(depsgraph).matrix_world)) < 0.0:
        return colors.mirrored()  # as triangles are, see `Surface.transformed`
    return colors


def colors_of_curves(
    hair: bpy.types.Object, look: ShadingSettings, depsgraph: bpy.types.Depsgraph
) -> tuple[Floats | None, tuple[str, ...]]:
    """The colour under each curve before all modifiers, (curve_count, 4), -1 where it has the
    look's colour; None without a colour map. And warnings.

    Modifiers that add curves pass the colours on to these.

    Raises:
        HairloomError: the scale of the curves is not that of their surface.
    """
    surface = head_of(hair)
    if not look.color_map or surface is None or surface.type != "MESH":
        return None, read_colors(hair, depsgraph, None)[1]
    head = read_surface(surface, depsgraph, need_uv=False, place=surface.name)
    painted, notes = read_colors(hair, depsgraph, len(head.triangles))
    if painted is None:
        return None, notes
    cleaned = read_original_curves(hair, depsgraph)
    strands = with_colors(bind_roots(cleaned.strands, head, place=hair.name).strands, painted, look)
    colors = np.full((len(hair.data.curves), 4), -1.0, np.float32)
    colors[:, 3] = 1.0
    if strands.color is not None:
        colors[cleaned.curve_indices, :3] = np.nan_to_num(
            strands.color[strands.offsets[:-1]], nan=-1.0
        )
    return colors, notes


def _of_attribute(mesh: bpy.types.Mesh, name: str, place: str) -> SurfaceColor | None:
    attribute = mesh.attributes.get(name)
    if attribute is None or not is_color(attribute):
        return None
    values = checked_values(read_attribute(mesh, name, attribute.domain, 4), name, place)
    return SurfaceColor(at_corners(mesh, _premultiplied(values), attribute.domain))


def _of_image(mesh: bpy.types.Mesh, name: str, place: str) -> ImageColor | None:
    if name not in image_names():
        return None
    corner_uv = read_corner_uv(mesh, triangle_corners(mesh))
    image = checked_image(name, corner_uv, place, instead="a colour attribute")
    assert corner_uv is not None
    (width, height), channels = image.size, image.channels
    decode = _decoder(image, place)
    pixels = np.empty(width * height * channels, np.float32)
    image.pixels.foreach_get(pixels)
    if image.is_float:  # other images are stored as integers, which are always finite
        pixels = checked_values(pixels, name, place)
    return ImageColor(pixels.reshape(height, width, channels), decode, corner_uv)


def _decoder(image: bpy.types.Image, place: str) -> Callable[[Floats], Floats]:
    """The function from stored pixels to scene-linear premultiplied colours.

    Pixels of float images are so already, whatever the colour space; others are as in the file.
    """
    space, has_opacity = image.colorspace_settings.name, image.alpha_mode in ("STRAIGHT", "PREMUL")
    if image.is_float:
        return partial(_with_opacity, has_opacity=has_opacity)
    if space != "sRGB" and space not in _LINEAR:
        raise HairloomError(
            f"the image '{image.name}' is in the colour space '{space}', which is not supported",
            place=place,
            remedy="Set its Color Space to sRGB (Image Editor > Sidebar > Image)",
        )
    return partial(_decode, is_srgb=space == "sRGB", has_opacity=has_opacity)


def _decode(stored: Floats, *, is_srgb: bool, has_opacity: bool) -> Floats:
    rgba = _with_opacity(stored, has_opacity=has_opacity)
    if is_srgb:
        rgba[:, :3] = srgb_decoded(rgba[:, :3])
    return _premultiplied(rgba)


def _with_opacity(stored: Floats, *, has_opacity: bool) -> Floats:
    """Pixels (n, channels) as colours with an opacity, (n, 4)."""
    rgba = np.ones((len(stored), 4), np.float32)
    rgba[:, :3] = stored[:, :3] if stored.shape[1] >= 3 else stored[:, :1]
    if has_opacity and stored.shape[1] == 4:
        rgba[:, 3] = np.minimum(stored[:, 3], 1.0)
    return rgba


def _premultiplied(values: Floats) -> Floats:
    """Colours times their opacity, (n, 4)."""
    opacity = np.minimum(values[:, 3:], np.float32(1.0))
    return np.concatenate([values[:, :3] * opacity, opacity], axis=1)


def _missing(surface: bpy.types.Object, name: str) -> HairloomError:
    choices = ", ".join(color_choices(surface)[:8])
    return HairloomError(
        f"it has no colour attribute named '{name}', and there is no such image",
        place=surface.name,
        remedy=f"Use one of: {choices}"
        if choices
        else "Add one (Data > Color Attributes) and paint it (Vertex Paint), or clear Colour Map",
    )
