"""Draws the looks that ship: a thumbnail beside each preset, and all of them on one sheet.

python tools/preset_pictures.py FOLDER

FOLDER gets looks.png, where each look is shown twice: in a studio's light, and against the light.
"""

import importlib
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import bpy  # noqa: F401  it must come before gpu, which lives inside it
import gpu
import numpy as np
from extension_loader import PACKAGE, REPOSITORY, load_package

LOOKS = REPOSITORY / "presets" / "looks"
#: [pixels]; thumbnails are square
THUMBNAIL, WIDTH, HEIGHT, SAMPLES = 192, 210, 250, 2
STRANDS = 9000
#: from behind the ear, where there is the most hair
DIRECTION = (-0.9, 0.75, 0.35)
NO_BACKDROP = (0.0, 0.0, 0.0, 0.0)
BACKDROP = (0.045, 0.05, 0.058, 1.0)
#: of each channel of a thumbnail; few, so that a picture of hair stays a small file
SHADES = 64


def of_addon(module: str) -> Any:
    return importlib.import_module(f"{PACKAGE}.addon.{module}")


def wig() -> Any:
    """A snapshot of shoulder-long hair on the built-in head."""
    settings, pipeline = of_addon("parameters").ALL_SETTINGS, of_addon("pipeline")
    grown = settings["grow"](strand_count=STRANDS, wave=0.006, wave_length=0.09, clump=0.25)
    bust = of_addon("blender.scene.built_in_head").built_in_head()
    head = bust.surface
    grow = of_addon("groom.grow")
    strands = grow.grow(head, grown, bust.weights["scalp"])
    rig = pipeline.prepare(
        strands, head, settings["guides"](), place="the built-in groom", widths="auto"
    )
    ambient = settings["ambient"]()
    groom = of_addon("blender.sessions.prepared_groom").prepared(rig, ambient, with_occluders=False)
    snapshot = of_addon("blender.sessions.snapshots").snapshot_of(groom)
    return replace(
        snapshot,
        meshes=(of_addon("render.snapshot").MeshSnapshot.of(head, occlusion=groom.head_occlusion),),
        detail=settings["detail"](lod_height=0.0),
    )


def against(view: np.ndarray) -> tuple[Any, ...]:
    """A sun behind the hair and a weak one before it, which hang on the camera."""
    sun = of_addon("shading.lights").Light.sun
    to_world = np.linalg.inv(view)[:3, :3]
    suns = (((0.35, 0.5, -1.0), (1.0, 0.97, 0.93), 3.0), ((-0.6, 0.3, 0.6), (0.8, 0.9, 1.0), 0.6))
    return tuple(sun(-to_world @ np.array(towards), *light) for towards, *light in suns)


def coarse(picture: Any) -> Any:
    """The same picture in a few shades, as they are shown."""
    shown = of_addon("blender.base.images").display_encoded(picture)
    shown = np.round(shown * (SHADES - 1)) / (SHADES - 1)
    alpha = shown[..., 3:]
    colors = of_addon("exchange.textures.srgb").srgb_decoded(shown[..., :3])
    return np.concatenate([colors * alpha, alpha], axis=-1).astype(np.float32)


def main(folder: Path) -> None:
    gpu.init()
    load_package().register()
    frame, images = of_addon("render.frame"), of_addon("blender.base.images")
    studio, lights = of_addon("blender.pictures.studio"), of_addon("shading.lights")
    presets = of_addon("blender.properties.presets")
    hair = wig()
    points = hair.points
    box = points.min(axis=0), points.max(axis=0)

    def picture(
        look: Any, light: Any, size: tuple[int, int], room: float, backdrop: tuple[float, ...]
    ) -> Any:
        camera = frame.frame_camera(
            box, DIRECTION, studio.FIELD_OF_VIEW, size[0] / size[1], margin=room
        )
        lit = replace(hair, shading=look, lights=light(camera.view))
        return frame.render_image(lit, camera, *size, SAMPLES, background=backdrop)

    sheet = []
    for path in sorted(LOOKS.glob("*.json")):
        look = presets.named_preset(f"looks/{path.stem}").settings
        square = (THUMBNAIL, THUMBNAIL)
        thumbnail = picture(look, lights.three_point_lights, square, 0.75, NO_BACKDROP)
        images.write_png(path.with_suffix(".png"), coarse(thumbnail))
        for light in (lights.three_point_lights, against):
            sheet.append(picture(look, light, (WIDTH, HEIGHT), 0.75, BACKDROP))
        print(f"Drew {path.stem}", flush=True)
    images.write_png(folder / "looks.png", images.contact_sheet(sheet, 6))


if __name__ == "__main__":
    main(Path(sys.argv[1]))
