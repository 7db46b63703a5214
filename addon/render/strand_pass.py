"""Draws strands as ribbons that face the eye, shaded per pixel, into whatever target is bound.

Packed textures, one row a strand (column blocks beyond 16384 rows, see textures.strand_rows):
    cv_points RGBA32F: xyz position [m, world], w radius [m]     new with every new pose, unless
                                                                 it lies on the GPU already
    cv_looks  RG32F:   x ambient occlusion, y seed as a number   constant
    debug_numbers R32F: the guide or the group that a debug view shows

How many pieces each segment has comes from detail_pass.py, unless all have equally many.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import gpu
import numpy as np

from ..arrays import Floats
from ..params.glsl import struct_values
from ..shading.lights import kept_lights, pack_lights
from ..shading.marschner.look import pack_fibre
from ..shading.settings import ShadingSettings, StrandSettings
from ..shading.strand_noise import SEED_LIMIT
from ..shading.volume.light_frame import Ball, ball_around, reach_of, stepped_ball
from .camera import Camera
from .detail_pass import DetailOrder, DetailPass
from .display import Display
from .marschner_textures import MARSCHNER, MARSCHNER_TEXTURES, SHARES_TEXTURES
from .opacity_pass import OpacityForm, OpacityMaps, OpacityPass
from .shader_program import ShaderRecipe, program, released_with_shaders
from .shader_source import DEBUG_VIEWS, ShaderError, output_index
from .snapshot import Snapshot
from .textures import UniformBlock, drawing_state, strand_rows, texture_from
from .view_block import view_values

#: debug views that show a number of each strand
NUMBERED_VIEWS = ("guide", "group")
#: blocks of every strand program
BLOCKS = (
    ("View", "view"),
    ("Lights", "lights"),
    ("StrandSettings", "strands"),
    ("ShadingSettings", "shading"),
)


def strand_recipe(
    *,
    is_adaptive: bool,
    model: str = "kajiya_kay",
    debug_view: str = "none",
    has_display: bool = False,
    opacity: OpacityForm | None = None,
    scatters: bool = False,
) -> ShaderRecipe:
    """The program that draws every segment in equally many pieces, or each in its own.

    It holds one model of MODELS alone. A debug view has none: it is the same with either.
    With a display it looks up how the viewport shows a colour, see display.py. With opacity maps
    hair shades itself; `scatters` adds light from strand to strand, in Marschner's model.
    """
    is_marschner = model == "marschner"
    lit = f"{'_scattering' * scatters}{f'_{opacity.slots}_{opacity.is_deep}' if opacity else ''}"
    kind = f"{'adaptive' if is_adaptive else 'fixed'}{'_display' if has_display else ''}"
    textures = ["cv_points", "cv_looks"]
    textures += ["order", "factors"] if is_adaptive else []
    textures += ["debug_numbers"] if debug_view in NUMBERED_VIEWS else []
    return ShaderRecipe(
        name=f"strand_{kind}_{model}{lit}_{debug_view}",
        vertex="strand.vert.glsl",
        fragment="strand.frag.glsl",
        structs=(
            "struct_view.glsl",
            "struct_lights.glsl",
            "struct_fibre.glsl",
            "struct_opacity.glsl",
        ),
        settings=(StrandSettings, ShadingSettings),
        blocks=(
            *BLOCKS,
            *((("Fibre", "fibre"),) if is_marschner else ()),
            *((("Opacity", "opacity"),) if opacity else ()),
        ),
        textures=(
            *(("FLOAT_2D", name) for name in textures),
            *(MARSCHNER_TEXTURES if is_marschner else ()),
            *(SHARES_TEXTURES if scatters else ()),
            *(opacity.samplers if opacity else ()),
            *((("FLOAT_3D", "display_table"),) if has_display else ()),
        ),
        integers=(
            "cv_count",
            "samples_across",
            "output_encoding",
            "first_instance" if is_adaptive else "subdivisions",
        ),
        numbers=(
            ("VEC3", "volume_center"),
            *((("FLOAT", "scatter_density"),) if scatters else ()),
            *((("VEC4", "display_shaper"),) if has_display else ()),
        ),
        varyings=(
            ("smooth", "VEC3", "strand_point"),
            ("smooth", "VEC3", "strand_tangent"),
            ("smooth", "VEC2", "strand_along_and_occlusion"),
            ("flat", "INT", "strand_seed"),
            *((("flat", "INT", "strand_index"),) if debug_view != "none" else ()),
        ),
        outputs=(("VEC4", "color"),),
        defines=(
            ("ADAPTIVE", int(is_adaptive)),
            ("DEBUG", DEBUG_VIEWS.index(debug_view)),
            ("MARSCHNER", int(is_marschner)),
            ("SHADOWS", int(opacity is not None)),
            ("SCATTERING", int(scatters)),
            *(opacity.defines if opacity else ()),
            *((("DISPLAY", 1),) if has_display else ()),
        ),
    )


@dataclass(frozen=True)
class Statistics:
    """What a draw has drawn: strands, their straight pieces, and the vertices of all instances."""

    strands: int = 0
    pieces: int = 0
    vertices: int = 0


class StrandPass:
    """Keeps one groom's strands on the GPU from draw to draw.

    Making one touches no GPU; the first draw does. Arrays of a snapshot are uploaded only when
    they are other objects than in the draw before.

    statistics: of the last draw.
    """

    def __init__(self) -> None:
        self._detail = DetailPass()
        self._opacity = OpacityPass()
        self._points_serial = 0
        self.statistics = Statistics()
        self.release()
        released_with_shaders(self)

    def draw(
        self,
        snapshot: Snapshot,
        camera: Camera,
        width: int,
        height: int,
        *,
        output: str = "scene_linear",
        display: Display | None = None,
        samples: int = 1,
    ) -> None:
        """Draw all strands into the bound framebuffer, depth-tested against what is in it.

        Args:
            width, height: of the target [pixels].
            output: "scene_linear" for a picture of ours; "viewport" for a POST_VIEW handler in
                Blender's viewport.
            display: for "viewport", the view transform; None is the plain "Standard".
            samples: pixels of the target across one pixel of the final picture; the least width
                and the settings of detail count in the latter.

        Raises:
            ShaderError: the shader does not compile here, or points on the GPU were released.
        """
        self.statistics = Statistics()
        if not snapshot.strand_count:
            return
        self._upload(snapshot)
        size = width // samples, height // samples
        points, serial = self._textures["cv_points"], self._points_serial
        order = self._detail.order(snapshot, points, serial, camera, size)
        if not order.classes:
            return
        is_adaptive = order.factors is not None
        shading, debug_view = snapshot.shading, snapshot.debug_view
        model = shading.model if debug_view == "none" else "kajiya_kay"
        maps = self.opacity(snapshot) if debug_view == "none" else None
        scatters = maps is not None and model == "marschner" and snapshot.volume.scattering
        shader = program(
            strand_recipe(
                is_adaptive=is_adaptive,
                model=model,
                debug_view=debug_view,
                has_display=display is not None,
                opacity=None if maps is None else maps.form,
                scatters=scatters,
            )
        )
        integers = {
            "cv_count": snapshot.cv_count,
            "samples_across": samples,
            "output_encoding": output_index(output),
            "first_instance" if is_adaptive else "subdivisions": order.subdivisions,
        }
        blocks = {
            "view": view_values(camera, width, height),
            "lights": pack_lights(snapshot.lights, snapshot.ambient),
            "strands": struct_values(snapshot.strand_settings),
            "shading": struct_values(shading),
        }
        textures = self._bound(order, debug_view)
        if model == "marschner":
            blocks["fibre"] = pack_fibre(shading)
            textures |= MARSCHNER.of(shading, snapshot.table_size)
        numbers: dict[str, Any] = {"volume_center": snapshot.center.tolist()}
        if scatters:
            textures |= MARSCHNER.shares(shading, snapshot.table_size)
            numbers["scatter_density"] = snapshot.volume.density
        if maps is not None:
            blocks["opacity"] = maps.values
            textures |= maps.textures
        if display is not None:
            textures["display_table"] = display.table.texture
            numbers["display_shaper"] = display.shaper
        with drawing_state():
            shader.bind(
                blocks={name: self._blocks[name].holding(blocks[name]) for name in blocks},
                textures=textures,
                integers=integers,
                numbers=numbers,
            )
            for drawn in order.classes:
                if is_adaptive:
                    shader.shader.uniform_int("first_instance", drawn.first)
                self._ribbon(drawn.capacity).draw_instanced(
                    shader.shader, instance_start=0, instance_count=drawn.count
                )
        self.statistics = Statistics(
            strands=sum(drawn.count for drawn in order.classes),
            pieces=order.pieces,
            vertices=sum(drawn.vertex_count for drawn in order.classes),
        )

    def opacity(self, snapshot: Snapshot) -> OpacityMaps | None:
        """How much hair lies between each light and every place; None where it throws no shadow.

        Drawn into textures of its own, and only when something has changed.

        Raises:
            ShaderError: as `draw`.
        """
        if snapshot.volume.shadows == "none" or not snapshot.strand_count:
            return None
        self._upload(snapshot)
        return self._opacity.maps(
            self._textures["cv_points"],
            self._points_serial,
            (snapshot.strand_count, snapshot.cv_count),
            self._ball(snapshot),
            kept_lights(snapshot.lights),
            snapshot.volume,
            snapshot.strand_settings,
            (*(mesh.surface for mesh in snapshot.meshes), *snapshot.casters),
        )

    def release(self) -> None:
        """Let go of all that lies on the GPU; the next draw uploads again."""
        names = (*(name for _, name in BLOCKS), "fibre", "opacity")
        self._blocks = {name: UniformBlock() for name in names}
        self._opacity.release()
        self._extent: tuple[Floats | None, Ball | float] = (None, 0.0)
        self._textures: dict[str, Any] = {}
        self._uploaded: dict[str, tuple[Any, ...]] = {}
        self._ribbons: dict[int, Any] = {}
        self._detail.release()

    def _ball(self, snapshot: Snapshot) -> Ball:
        """Around all strands; of those on the GPU around all places that they can get to."""
        device = snapshot.device_points
        kept, found = self._extent
        if kept is not snapshot.strands or isinstance(found, float) != (device is not None):
            strands = snapshot.strands
            found = ball_around(strands) if device is None else reach_of(strands)
            self._extent = strands, found
        return stepped_ball(snapshot.root_center, found) if isinstance(found, float) else found

    def _bound(self, order: DetailOrder, debug_view: str) -> dict[str, Any]:
        """This groom's own textures by the names of strand_recipe."""
        names = ["cv_points", "cv_looks"]
        names += ["debug_numbers"] if debug_view in NUMBERED_VIEWS else []
        bound = {name: self._textures[name] for name in names}
        if order.factors is not None:
            bound |= {"order": order.order, "factors": order.factors}
        return bound

    def _upload(self, snapshot: Snapshot) -> None:
        points: tuple[Any, ...] = (snapshot.strands, snapshot.radius)
        device = snapshot.device_points
        if device is not None:
            if device.texture is None:
                raise ShaderError("strand: what the GPU has computed was released")
            points = (device, (device.serial,))
        if self._take("cv_points", points, lambda: _points_texture(snapshot)):
            self._points_serial += 1
        looks = (snapshot.occlusion, snapshot.seed, snapshot.strands.shape)
        self._take("cv_looks", looks, lambda: texture_from(strand_rows(_looks(snapshot)), "RG32F"))
        if snapshot.debug_view in NUMBERED_VIEWS:
            numbers = getattr(snapshot, snapshot.debug_view)
            shown = (numbers, snapshot.strands.shape[:1])
            self._take("debug_numbers", shown, lambda: _numbers_texture(snapshot))

    def _take(self, name: str, sources: tuple[Any, ...], make: Callable[[], Any]) -> bool:
        """Make a texture anew if a source is another object than before; tuples count by value."""
        before = self._uploaded.get(name, ())
        if len(before) == len(sources) and all(
            old is new or (isinstance(old, tuple) and old == new)
            for old, new in zip(before, sources, strict=True)
        ):
            return False
        self._textures[name] = make()
        self._uploaded[name] = sources
        return True

    def _ribbon(self, capacity: int) -> Any:
        """A strip of vertices without attributes: two a station, see lib_strand_geometry.glsl."""
        if capacity not in self._ribbons:
            layout = gpu.types.GPUVertFormat()
            layout.attr_add(id="unused", comp_type="F32", len=1, fetch_mode="FLOAT")
            vertices = gpu.types.GPUVertBuf(layout, 2 * (capacity + 1))
            self._ribbons[capacity] = gpu.types.GPUBatch(type="TRI_STRIP", buf=vertices)
        return self._ribbons[capacity]


def _points_texture(snapshot: Snapshot) -> Any:
    if snapshot.device_points is not None:
        return snapshot.device_points.texture
    packed = np.concatenate([snapshot.strands, snapshot.radius[..., None]], axis=-1)
    return texture_from(strand_rows(packed), "RGBA32F")


def _numbers_texture(snapshot: Snapshot) -> Any:
    """The number of each strand that the debug view shows, exact below 2^24; 0 without any."""
    numbers = getattr(snapshot, snapshot.debug_view)
    shown = np.zeros((snapshot.strand_count, 1, 1), np.float32)
    if numbers is not None:
        shown[:, 0, 0] = numbers
    return texture_from(strand_rows(shown), "R32F")


def _looks(snapshot: Snapshot) -> Floats:
    """Occlusion and seed per CV, (strand_count, cv_count, 2) float32."""
    looks = np.ones((*snapshot.strands.shape[:2], 2), np.float32)
    if snapshot.occlusion is not None:
        looks[..., 0] = snapshot.occlusion
    seed = np.arange(snapshot.strand_count) if snapshot.seed is None else snapshot.seed
    looks[..., 1] = (np.asarray(seed) % SEED_LIMIT)[:, None]
    return looks
