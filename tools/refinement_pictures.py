"""Draws the pictures of docs/refinement.md: children, the debug view, and a close look at one curl.

python tools/refinement_pictures.py FOLDER
"""

import importlib
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import bpy  # noqa: F401  it must come before gpu, which lives inside it
import gpu
import numpy as np
from extension_loader import PACKAGE, load_package

#: guides and strands of the Nalu demo, few and wide enough to tell their pieces apart
GUIDES, CHILDREN = 762, 4095
#: as many children as a head of hair has
FULL_COUNT = 20_000
WIDTH, HEIGHT, SAMPLES = 640, 720, 3
#: where the built-in head's hair falls over its temple [m]
TEMPLE = np.array([-0.12, -0.01, 0.075])


def addon_module(module: str) -> Any:
    return importlib.import_module(f"{PACKAGE}.addon.{module}")


def wig(children: str, count: int = CHILDREN, widths: str = "auto") -> Any:
    """A rig of wavy guides on the built-in head, with or without children; each side is a group."""
    settings = addon_module("parameters").ALL_SETTINGS
    growth = settings["grow"](strand_count=GUIDES, wave=0.018, wave_length=0.06, clump=0.3)
    bust = addon_module("blender.scene.built_in_head").built_in_head()
    head = bust.surface
    grow = addon_module("groom.grow")
    strands = grow.grow(head, growth, bust.weights["scalp"])
    return addon_module("rig_flow").prepare(
        replace(strands, group=strands.roots[:, 0] > 0.0),
        head,
        settings["guides"](guide_count=GUIDES, cv_count=9),
        place="the built-in groom",
        widths=widths,
        children=settings["children"](method=children, strand_count=count),
    )


def picture(rig: Any, look: dict[str, Any], camera: Any = None, samples: int = SAMPLES) -> Any:
    """One picture of a rig at rest.

    Args:
        look: detail settings, and debug_view.
    """
    settings, studio = (
        addon_module("parameters").ALL_SETTINGS,
        addon_module("blender.pictures.studio"),
    )
    ambient = settings["ambient"]()
    view = look.pop("debug_view", "none")
    sections = addon_module("params").SettingsMap(settings["detail"](**look))
    groom_settings = addon_module("blender.properties.groom_settings")
    groom = groom_settings.GroomSettings(sections, debug_view=view)
    studio_ = studio.Studio(
        addon_module("blender.sessions.prepared_groom").prepare_groom(rig, ambient),
        groom,
        look=addon_module("blender.scene.built_in_head").built_in_head().look("light"),
    )
    return studio_.picture(rig.rest_pose, rig.strands.points, WIDTH, HEIGHT, samples, camera)


def close_camera(rig: Any, height: float) -> Any:
    """A camera in front of the hair over the temple, showing `height` [m] from bottom to top."""
    camera = addon_module("render.camera")
    points = rig.strands.points.astype(np.float64)
    target = points[np.linalg.norm(points - TEMPLE, axis=1).argmin()]
    eye = target + np.array([-0.3, -0.3, 0.05])
    fov = 2.0 * np.arctan(height / 2.0 / np.linalg.norm(eye - target))
    projection = camera.perspective(fov, WIDTH / HEIGHT, 0.01, 2.0)
    return camera.Camera(camera.look_at(eye, target), projection)


def main(folder: Path) -> None:
    gpu.init()
    load_package().register()
    images = addon_module("blender.base.images")

    def write(name: str, pictures: list[Any]) -> None:
        images.write_png(folder / f"{name}.png", images.contact_sheet(pictures, len(pictures)))
        print(f"Wrote {name}.png", flush=True)

    full = wig("multi")
    close, closer = close_camera(full, height=0.16), close_camera(full, height=0.06)
    undivided = {"mode": "fixed", "subdivisions": 1}
    write(
        "children", [picture(wig("none", widths="own"), {}), picture(wig("multi", FULL_COUNT), {})]
    )
    write("curl", [picture(full, dict(undivided), closer), picture(full, {}, closer)])
    views = [dict(undivided), {"mode": "fixed", "subdivisions": 64}, {}]
    pictures = [picture(full, view | {"debug_view": "detail"}, close) for view in views]
    write("detail_view", pictures)
    write("guide_view", [picture(full, {"debug_view": view}) for view in ("guide", "group")])


if __name__ == "__main__":
    main(Path(sys.argv[1]))
