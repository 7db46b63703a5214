"""A ball of combed hair, ours beside Cycles': the sheet out/shading_sheet.png.

Strands run along meridians from the top of a black ball to its bottom; one sun; no world; the same
strands, camera and fibre in both. Columns, from the left:
    1. Cycles, direct sunlight without shadows: each strand as if it were alone;
    2. ours without the approximations of shadows and of multiple scattering: must match 1;
    3. Cycles, path traced with all bounces and shadows: the reference;
    4. ours with both approximations. Computed shadows and multiple scattering are measured in
       _volume_balls.py.
Rows: black from the front, blond from the front, blond against the light.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from _shading_cycles import BLOND, Hair
from _shading_room import DISTANCE, CyclesRoom
from hair_ball import ball_mesh, combed_strands

from hairloom.addon.blender.base.images import contact_sheet, write_png
from hairloom.addon.refine.settings import DetailSettings
from hairloom.addon.render.camera import Camera, look_at, orthographic
from hairloom.addon.render.frame import render_image
from hairloom.addon.render.snapshot import MeshSnapshot, Snapshot
from hairloom.addon.shading.lights import Light
from hairloom.addon.shading.settings import ShadingSettings, StrandSettings
from hairloom.addon.strands import Surface

SHEET = Path(__file__).resolve().parents[1] / "out" / "shading_sheet.png"
SIZE, SAMPLES = 240, 4
#: paths per pixel: that end at the first strand, and that go on, whose picture is denoised
PATHS_SINGLE, PATHS_FULL = 24, 64
#: strands on the sheet, and few enough that hardly one hides another; their radius
STRANDS, FEW, RADIUS = 14_000, 2_000, 0.003
#: height of the view [m]; the ball has a radius of 1
HEIGHT = 2.3
BLACK = (2.5, 3.5, 5.0)
HAIR = Hair(0.2, float(np.radians(3.0)))
ROWS = {
    "black": (BLACK, (0.45, 0.5, 0.8)),
    "blond": (BLOND, (0.45, 0.5, 0.8)),
    "blond_against": (BLOND, (-0.5, 0.6, -0.75)),
}
#: pixels across a block over which strands are averaged before pictures are compared
BLOCK = 12


def ball_figures() -> dict[str, Any]:
    """Write the sheet; differences of single scattering from Cycles', relative to its mean.

    They are measured on few strands as well: where many overlap near the outline, only their outer
    sides are seen, and Cycles shades across a strand's width, where ours has one shade.
    """
    dense, few = combed_strands(STRANDS), combed_strands(FEW)
    core = Surface(*ball_mesh())
    room = CyclesRoom()
    room.body(core.positions, core.triangles)
    found, pictures = {}, []
    for name, (absorption, towards) in ROWS.items():
        room.sun(np.array(towards))
        room.hair(
            absorption,
            Roughness=HAIR.roughness,
            Radial_Roughness=HAIR.around,
            Offset=HAIR.offset,
        )
        single = of_cycles(room, dense, bounces=0, casts_shadow=False)
        full = of_cycles(room, dense, bounces=64, casts_shadow=True)
        ours = [drawn(snapshot_of(dense, core, absorption, towards, share)) for share in (0.0, 1.0)]
        scale = 0.35 / np.percentile(blocks(single), 95.0)
        pictures += [shown(picture, scale) for picture in (single, ours[0], full, ours[1])]
        found[f"ball_{name}_dense_difference"] = difference(ours[0], single)
        single = of_cycles(room, few, bounces=0, casts_shadow=False)
        alone = drawn(snapshot_of(few, core, absorption, towards, 0.0))
        found[f"ball_{name}difference"] = difference(alone, single)
        found[f"ball_{name}_drawn_ratio"] = float(ours[1][..., :3].mean() / full[..., :3].mean())
    SHEET.parent.mkdir(exist_ok=True)
    write_png(SHEET, contact_sheet(pictures, 4))
    return found


def of_cycles(room: CyclesRoom, grid: np.ndarray, bounces: int, casts_shadow: bool) -> np.ndarray:
    room.strands(grid, RADIUS, casts_shadow)
    room.paths(PATHS_FULL if bounces else PATHS_SINGLE, bounces, is_denoised=bounces > 0)
    return room.picture(SIZE, HEIGHT)


def snapshot_of(
    grid: np.ndarray,
    core: Surface,
    absorption: tuple[float, float, float],
    towards: tuple[float, float, float],
    stand_ins: float,
) -> Snapshot:
    """The ball as we draw it; stand_ins: strength of approximate shadows and scattering, 0 to 1."""
    fibre = HAIR.fibre(absorption)
    shading = ShadingSettings(
        model="marschner",
        pigment="absorption",
        absorption=absorption,
        cuticle_tilt=fibre.cuticle_tilt,
        width_r=fibre.width_r,
        width_tt=fibre.width_tt,
        width_trt=fibre.width_trt,
        glint_width=fibre.glint_width,
        azimuthal_width=fibre.azimuthal_width,
        color_variation=0.0,
        shift_noise=0.0,
        sparkle=0.0,
        fake_scattering=stand_ins,
        volume_shadow=stand_ins,
    )
    return Snapshot(
        grid,
        np.full(grid.shape[:2], RADIUS, np.float32),
        meshes=(replace(MeshSnapshot.of(core, color=(0.0, 0.0, 0.0)), specular=0.0),),
        lights=(Light.sun(np.negative(towards), (1.0, 1.0, 1.0), 1.0),),
        ambient=(0.0, 0.0, 0.0),
        shading=shading,
        strand_settings=StrandSettings(tip_width=1.0, minimum_width=0.0),
        detail=DetailSettings(culling="none", lod_size=0.0),
        volume_center=np.zeros(3, np.float32),
    )


def drawn(snapshot: Snapshot) -> np.ndarray:
    """The picture from +z, (SIZE, SIZE, 4)."""
    view = look_at((0.0, 0.0, DISTANCE), (0.0, 0.0, 0.0), up=(0.0, 1.0, 0.0))
    camera = Camera(view, orthographic(HEIGHT, 1.0, 1.0, 2.0 * DISTANCE))
    return render_image(snapshot, camera, SIZE, SIZE, SAMPLES)


def blocks(picture: np.ndarray) -> np.ndarray:
    """Means of blocks of pixels, (blocks, blocks, 3): they average over strands."""
    count = SIZE // BLOCK
    return picture[..., :3].reshape(count, BLOCK, count, BLOCK, 3).mean(axis=(1, 3))


def difference(ours: np.ndarray, theirs: np.ndarray) -> float:
    """Mean absolute difference of blocks, relative to the mean of theirs."""
    one, other = blocks(ours), blocks(theirs)
    return float(np.abs(one - other).mean() / other.mean())


def shown(picture: np.ndarray, scale: float) -> np.ndarray:
    shown = picture.copy()
    shown[..., :3] *= scale
    shown[..., 3] = 1.0
    return shown
