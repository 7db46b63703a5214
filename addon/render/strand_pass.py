"""Draws strands as ribbons that face the eye, shaded per pixel, into whatever target is bound.

Packed textures, one row a strand (column blocks beyond 16384 rows, see textures.strand_rows):
    cv_points RGBA32F: xyz position [m, world], w radius [m]     new with every new pose, unless
                                                                 it lies on the GPU already
    cv_looks  RG32F:   x ambient occlusion, y seed as a number   constant
"""

from __future__ import annotations

from typing import Any

import gpu
import numpy as np

from ..arrays import Floats
from ..params.glsl import struct_values
from ..shading.lights import pack_lights
from ..shading.settings import ShadingSettings, StrandSettings
from ..shading.strand_noise import SEED_LIMIT
from .camera import Camera
from .shader_program import ShaderRecipe, program, released_with_shaders
from .shader_source import ShaderError, output_index
from .snapshot import Snapshot
from .textures import UniformBlock, drawing_state, strand_rows, texture_from
from .view_block import view_values

STRAND_RECIPE = ShaderRecipe(
    name="strand",
    vertex="strand.vert.glsl",
    fragment="strand.frag.glsl",
    structs=("struct_view.glsl", "struct_lights.glsl"),
    settings=(StrandSettings, ShadingSettings),
    blocks=(
        ("View", "view"),
        ("Lights", "lights"),
        ("StrandSettings", "strands"),
        ("ShadingSettings", "shading"),
    ),
    textures=(("FLOAT_2D", "cv_points"), ("FLOAT_2D", "cv_looks")),
    integers=("cv_count", "samples_across", "output_encoding"),
    numbers=(("VEC3", "volume_center"),),
    varyings=(
        ("smooth", "VEC3", "strand_point"),
        ("smooth", "VEC3", "strand_tangent"),
        ("smooth", "VEC2", "strand_along_and_occlusion"),
        ("flat", "INT", "strand_seed"),
    ),
    outputs=(("VEC4", "color"),),
)


class StrandPass:
    """Keeps one groom's strands on the GPU from draw to draw.

    Making one touches no GPU; the first draw does. Arrays of a snapshot are uploaded only when
    they are other objects than in the draw before.
    """

    def __init__(self) -> None:
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
        samples: int = 1,
    ) -> None:
        """Draw all strands into the bound framebuffer, depth-tested against what is in it.

        Args:
            width, height: of the target [pixels].
            output: "scene_linear" for a picture of ours; "viewport" for a POST_VIEW handler in
                Blender's viewport, where it looks as under the view transform "Standard".
            samples: pixels of the target across one pixel of the final picture; the least width
                counts in the latter.

        Raises:
            ShaderError: the shader does not compile here, or points on the GPU were released.
        """
        if not snapshot.strand_count:
            return
        self._upload(snapshot)
        shader = program(STRAND_RECIPE)
        with drawing_state():
            shader.bind(
                blocks={
                    "view": self._blocks["view"].holding(view_values(camera, width, height)),
                    "lights": self._blocks["lights"].holding(
                        pack_lights(snapshot.lights, snapshot.ambient)
                    ),
                    "strands": self._blocks["strands"].holding(
                        struct_values(snapshot.strand_settings)
                    ),
                    "shading": self._blocks["shading"].holding(struct_values(snapshot.shading)),
                },
                textures=self._textures,
                integers={
                    "cv_count": snapshot.cv_count,
                    "samples_across": samples,
                    "output_encoding": output_index(output),
                },
                numbers={"volume_center": snapshot.center.tolist()},
            )
            self._ribbon_of(snapshot).draw_instanced(
                shader.shader, instance_start=0, instance_count=snapshot.strand_count
            )

    def release(self) -> None:
        """Let go of all that lies on the GPU; the next draw uploads again."""
        self._blocks = {name: UniformBlock() for _, name in STRAND_RECIPE.blocks}
        self._textures: dict[str, Any] = {}
        self._uploaded: dict[str, tuple[Any, ...]] = {}
        self._ribbon: Any = None
        self._ribbon_length = 0

    def _upload(self, snapshot: Snapshot) -> None:
        points = (snapshot.strands, snapshot.radius)
        if snapshot.device_points is not None:
            if snapshot.device_points.texture is None:
                raise ShaderError("strand: what the GPU has computed was released")
            self._textures["cv_points"] = snapshot.device_points.texture
            self._uploaded.pop("cv_points", None)
        elif self._is_new("cv_points", points):
            packed = np.concatenate([snapshot.strands, snapshot.radius[..., None]], axis=-1)
            self._textures["cv_points"] = texture_from(strand_rows(packed), "RGBA32F")
            self._uploaded["cv_points"] = points
        looks = (snapshot.occlusion, snapshot.seed, snapshot.strands.shape)
        if self._is_new("cv_looks", looks):
            self._textures["cv_looks"] = texture_from(strand_rows(_looks(snapshot)), "RG32F")
            self._uploaded["cv_looks"] = looks

    def _is_new(self, name: str, arrays: tuple[Any, ...]) -> bool:
        """Whether any of these is another object than last time (for shapes: another value)."""
        before = self._uploaded.get(name)
        return before is None or not all(
            old is new or (isinstance(old, tuple) and old == new)
            for old, new in zip(before, arrays, strict=True)
        )

    def _ribbon_of(self, snapshot: Snapshot) -> Any:
        """A strip of vertices without attributes: two a station, see lib_strand_geometry.glsl."""
        pieces = (snapshot.cv_count - 1) * snapshot.strand_settings.subdivisions
        length = 2 * (pieces + 1)
        if self._ribbon is None or self._ribbon_length != length:
            layout = gpu.types.GPUVertFormat()
            layout.attr_add(id="unused", comp_type="F32", len=1, fetch_mode="FLOAT")
            vertices = gpu.types.GPUVertBuf(layout, length)
            self._ribbon = gpu.types.GPUBatch(type="TRI_STRIP", buf=vertices)
            self._ribbon_length = length
        return self._ribbon


def _looks(snapshot: Snapshot) -> Floats:
    """Occlusion and seed per CV, (strand_count, cv_count, 2) float32."""
    looks = np.ones((*snapshot.strands.shape[:2], 2), np.float32)
    if snapshot.occlusion is not None:
        looks[..., 0] = snapshot.occlusion
    seed = np.arange(snapshot.strand_count) if snapshot.seed is None else snapshot.seed
    looks[..., 1] = (np.asarray(seed) % SEED_LIMIT)[:, None]
    return looks
