"""Draws the looks that ship: a thumbnail beside each preset, and all of them on one sheet.

python tools/preset_pictures.py FOLDER

FOLDER gets looks.png, where each look is shown twice: in a studio's light, and backlight the light.
"""

import importlib
import sys
from pathlib import Path
from typing import Any

import bpy  # noqa: F401  it must come before gpu, which lives inside it
import gpu
import numpy as np
from extension_loader import PACKAGE, REPOSITORY, load_package
from PIL import Image

LOOKS = REPOSITORY / "presets" / "looks"
#: [pixels]; thumbnails are square
THUMBNAIL, WIDTH, HEIGHT, SAMPLES = 192, 210, 250, 2
STRANDS = 20000
#: direction of the view, from the side that shows more of the hair; its margin
DIRECTION, MARGIN = (-0.75, -1.0, 0.25), 0.78
BACKDROP = (0.045, 0.05, 0.058)
#: levels of each channel of a thumbnail; few, so that its file is small
SHADES = 64


def addon_module(module: str) -> Any:
    return importlib.import_module(f"{PACKAGE}.addon.{module}")


def wig(strand_count: int = STRANDS) -> Any:
    """The rig of shoulder-long hair on the built-in head, with its brows and lashes."""
    settings = addon_module("parameters").ALL_SETTINGS
    growth = settings["grow"](strand_count=strand_count)
    bust = addon_module("blender.scene.built_in_head").built_in_head()
    strands = addon_module("groom.face_hair").grow_with_face(bust.surface, growth, bust.weights)
    return addon_module("rig_flow").prepare(
        strands, bust.surface, settings["guides"](), place="the built-in groom", widths="auto"
    )


def studio_of(rig: Any, *settings: Any) -> Any:
    """A studio for this hair, whose head has light skin."""
    all_settings = addon_module("parameters").ALL_SETTINGS
    return addon_module("blender.pictures.studio").Studio(
        addon_module("blender.sessions.prepared_groom").prepare_groom(
            rig, all_settings["ambient"]()
        ),
        addon_module("blender.properties.groom_settings").GroomSettings(
            addon_module("params").SettingsMap(*settings, all_settings["detail"](lod_size=0.0))
        ),
        look=addon_module("blender.scene.built_in_head").built_in_head().look("light"),
    )


def backlight(view: np.ndarray) -> tuple[Any, ...]:
    """A sun behind the hair and a weak one in front of it, fixed to the camera."""
    sun = addon_module("shading.lights").Light.sun
    to_world = np.linalg.inv(view)[:3, :3]
    suns = (((0.35, 0.5, -1.0), (1.0, 0.97, 0.93), 3.0), ((-0.6, 0.3, 0.6), (0.8, 0.9, 1.0), 0.6))
    return tuple(sun(-to_world @ np.array(towards), *light) for towards, *light in suns)


def posterized(picture: Any) -> Any:
    """The picture with SHADES levels per displayed channel."""
    encoded = addon_module("blender.base.images").display_encoded(picture)
    encoded = np.round(encoded * (SHADES - 1)) / (SHADES - 1)
    alpha = encoded[..., 3:]
    colors = addon_module("exchange.textures.srgb").srgb_decoded(encoded[..., :3])
    return np.concatenate([colors * alpha, alpha], axis=-1).astype(np.float32)


def write_thumbnail(path: Path, picture: Any) -> None:
    """Write a picture as a small file, since all go into the zip."""
    addon_module("blender.base.images").write_png(path, posterized(picture))
    with Image.open(path) as image:
        image.load()
        image.save(path, optimize=True)


def main(folder: Path) -> None:
    gpu.init()
    load_package().register()
    cameras, images = addon_module("render.camera"), addon_module("blender.base.images")
    view = addon_module("blender.pictures.studio").FIELD_OF_VIEW
    presets, rig = addon_module("blender.properties.presets"), wig()
    studio, points = studio_of(rig), rig.strands.points
    box = points.min(axis=0), points.max(axis=0)

    def picture(width: int, height: int, lights: Any = None) -> Any:
        camera = cameras.frame_camera(box, DIRECTION, view, width / height, margin=MARGIN)
        return studio.picture(
            *(rig.rest_pose, points, width, height, SAMPLES),
            camera=camera,
            lights=None if lights is None else lights(camera.view),
            is_transparent=True,
        )

    studio_stage, dark = (
        presets.named_preset(f"stage/{n}").settings for n in ("studio", "dramatic")
    )
    sheet, stages = [], ((studio_stage, None), (dark, backlight))
    for path in sorted(LOOKS.glob("*.json")):
        look = addon_module("shading.wet_and_dusty").wet_and_dusty_look(
            presets.named_preset(f"looks/{path.stem}").settings
        )
        for stage, lights in stages:
            studio.settings = studio.settings.with_settings(look, stage)
            if lights is None:
                write_thumbnail(path.with_suffix(".png"), picture(THUMBNAIL, THUMBNAIL))
            rendered = picture(WIDTH, HEIGHT, lights)
            rendered[..., :3] += BACKDROP * (1.0 - rendered[..., 3:])
            rendered[..., 3] = 1.0
            sheet.append(rendered)
        print(f"Drew {path.stem}", flush=True)
    images.write_png(folder / "looks.png", images.contact_sheet(sheet, 6))


if __name__ == "__main__":
    main(Path(sys.argv[1]))
