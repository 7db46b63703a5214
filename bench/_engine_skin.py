"""The soft shadow on Sintel's head: its difference across UV seams, and its cost.

The sheet out/skin_sheet.png: the UV-space map before and after light has spread along the skin;
below them the forehead with the plain shadow, and with the soft one.
"""

from __future__ import annotations

import os
import time
from dataclasses import replace
from pathlib import Path

import gpu
import numpy as np
from extension_loader import REPOSITORY

from hairloom.addon.blender.base.images import contact_sheet, write_png
from hairloom.addon.blender.scene.mesh_files import read_mesh_file
from hairloom.addon.exchange.tressfx import read_tfx
from hairloom.addon.render.camera import Camera, look_at, perspective
from hairloom.addon.render.frame import render_image
from hairloom.addon.render.mesh_pass import MeshPass
from hairloom.addon.render.skin_pass import SkinShadow, head_size
from hairloom.addon.render.snapshot import MeshSnapshot, Snapshot
from hairloom.addon.render.strand_pass import StrandPass
from hairloom.addon.shading.lights import three_point_lights
from hairloom.addon.shading.settings import StrandSettings
from hairloom.addon.shading.skin.diffusion import soft_shadow
from hairloom.addon.shading.skin.settings import SkinSettings
from hairloom.addon.shading.volume.settings import VolumeSettings

SHEET = REPOSITORY / "out" / "skin_sheet.png"
SIZE, ROUNDS, PLACES = 512, 5, 17
#: too little softness to be seen
HARD = 1e-6
DEEP = VolumeSettings(shadows="deep", strand_fraction=1.0)


def skin_figures() -> dict[str, float]:
    """The largest difference between the two sides of a seam, over all lights and places along all
    seams, and its 99.9th percentile, in 1/255 of a light; seconds for three pictures with the
    layout of the head, milliseconds to draw a shadow again.
    """
    snapshot = sintel()
    hard = replace(snapshot, skin=replace(snapshot.skin, softness=HARD))
    plain = replace(snapshot, skin=replace(snapshot.skin, soft_shadow=False))
    start = time.perf_counter()
    pictures, shadows = zip(*(drawn(one) for one in (hard, plain, snapshot)), strict=True)
    seconds = time.perf_counter() - start
    off = seam_differences(shadows[2][0])
    SHEET.parent.mkdir(exist_ok=True)
    maps = [padded(shadows[which][0].picture()) for which in (0, 2)]
    write_png(SHEET, contact_sheet([*maps, pictures[1], pictures[2]], 2))
    return {
        "seam_difference": float(off.max()),
        "seam_difference_999_of_1000": float(np.percentile(off, 99.9)),
        "skin_pictures_seconds": seconds,
        **milliseconds(snapshot),
    }


def sintel() -> Snapshot:
    """Sintel's bust under the studio's lights, with hair over the forehead."""
    data = Path(os.environ.get("HAIRLOOM_DATA", REPOSITORY.parent / "shared" / "data")) / "sintel"
    hair = read_tfx(data / "SintelHairOriginal-sintel_hair.16points.tfx").strands
    head = read_mesh_file(data / "sintel.obj", need_uv=True)[0]
    return Snapshot(
        hair.grid.astype(np.float32),
        hair.radius.reshape(hair.strand_count, -1).astype(np.float32),
        meshes=(MeshSnapshot.of(head, is_skin=True),),
        casters=(head,),
        lights=three_point_lights(camera(hair.bounds()).view),
        strand_settings=StrandSettings(fullness=2.0),
        volume=DEEP,
        skin=SkinSettings(),
    )


def camera(bounds: tuple[np.ndarray, np.ndarray]) -> Camera:
    """Close to the face, from the front and a little from the left."""
    low, high = (np.asarray(side, np.float64) for side in bounds)
    aim = 0.5 * (low + high) + np.array([0.0, -0.06, -0.02])
    eye = aim + np.array([-0.10, -0.42, 0.0])
    return Camera(look_at(eye, aim), perspective(np.radians(26.0), 1.0, 0.05, 5.0))


def drawn(snapshot: Snapshot) -> tuple[np.ndarray, tuple[SkinShadow, ...]]:
    """The face, and the soft shadows that it was drawn with."""
    passes = MeshPass(), StrandPass()
    low, high = snapshot.points.min(axis=0), snapshot.points.max(axis=0)
    picture = render_image(
        snapshot,
        camera((low, high)),
        SIZE,
        SIZE,
        2,
        background=(0.05, 0.05, 0.06, 1.0),
        passes=passes,
    )
    return picture, passes[0].skin.drawn_shadows


def seam_differences(shadow: SkinShadow) -> np.ndarray:
    """Differences between the two sides at places along all seams, (n,) in 1/255."""
    layout, values = shadow.layout, shadow.picture()
    fraction = np.linspace(0.0, 1.0, PLACES)[None, :, None]
    places = (layout.seams[:, :1] * (1.0 - fraction) + layout.seams[:, 1:] * fraction).reshape(
        -1, 4
    )
    islands = np.repeat(layout.seam_islands, PLACES, axis=0)
    one, two = (
        soft_shadow(values, layout, places[:, 2 * side : 2 * side + 2], islands[:, side])[0]
        for side in range(2)
    )
    return 255.0 * np.abs(one - two).max(axis=1)


def milliseconds(snapshot: Snapshot) -> dict[str, float]:
    """The minimum time over ROUNDS to draw the shadow again, by softness."""
    passes, (mesh,) = (MeshPass(), StrandPass()), snapshot.meshes
    opacity = passes[1].opacity(snapshot)
    skin_pass = passes[0].skin
    found = {}
    size = head_size(mesh.surface)
    for name, metres in (("3mm", 0.003), ("10mm", 0.01)):
        softness, times = metres / size, []
        for number in range(ROUNDS):
            # another softness each time, so that the shadow is drawn each time
            settings = replace(snapshot.skin, softness=softness * (1.0 + 1e-4 * number))
            start = time.perf_counter()
            shadows = skin_pass.shadows((mesh,), opacity, settings, len(snapshot.lights))
            shadows[id(mesh)].picture()  # waits until it is drawn
            times.append(1000.0 * (time.perf_counter() - start))
        found[f"skin_shadow_ms_{name}"] = min(times)
    return found


def padded(shadow: np.ndarray) -> np.ndarray:
    """The first three lights as colours, in a picture as large as the others."""
    rows, columns = (min(side, SIZE) for side in shadow.shape[:2])
    picture = np.zeros((SIZE, SIZE, 4), np.float32)
    picture[..., 3] = 1.0
    picture[:rows, :columns, :3] = shadow[:rows, :columns, :3]
    return picture


if __name__ == "__main__":
    gpu.init()
    for name, value in skin_figures().items():
        print(f"{name:40} {value:14.4f}")
