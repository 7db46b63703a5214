"""Draws a thumbnail beside each preset that is not a look: dynamics, shadows and cards.

python tools/preset_thumbnails.py

Those of looks: tools/preset_pictures.py.
"""

from dataclasses import replace
from typing import Any

import bpy  # noqa: F401  it must come before gpu, which lives inside it
import gpu
import numpy as np
from extension_loader import REPOSITORY, load_package
from preset_pictures import THUMBNAIL, addon_module, studio_of, wig, write_thumbnail

PRESETS, SAMPLES = REPOSITORY / "presets", 2
#: all hair is blond here: it shows shadows best
LOOK, STRANDS = "looks/blond", 5000
#: the head turns by this much [rad] and stops; the picture is taken this many frames after it began
TURN, TURN_FRAMES, FRAMES, DURATION = np.radians(70.0), 8, 13, 1.0 / 24.0
#: enough for a picture of this size
ATLAS = "1024"
GRAVITY = np.array([0.0, 0.0, -9.81])


def turned(rig: Any, angle: float) -> Any:
    """The head turned about the upright axis."""
    matrix = np.eye(4)
    sine, cosine = np.sin(angle), np.cos(angle)
    matrix[:2, :2] = ((cosine, -sine), (sine, cosine))
    positions = rig.head.positions @ matrix[:3, :3].T
    return addon_module("rig_flow").Pose(positions.astype(np.float32), matrix)


def moved(rig: Any, dynamics: Any) -> tuple[Any, Any]:
    """Pose and strands a moment after the head has turned to the front."""
    motion_flow = addon_module("motion_flow")
    angles = [-TURN * (1.0 - min(frame / TURN_FRAMES, 1.0)) for frame in range(FRAMES)]
    motion = motion_flow.begin(rig, turned(rig, angles[0]))
    for angle in angles[1:]:
        pose = turned(rig, angle)
        motion = motion_flow.advance(
            rig, motion, motion_flow.FrameInput(pose, (), dynamics, GRAVITY, DURATION)
        )
    return motion.pose, motion_flow.strands_and_led(rig, motion)[0]


def main() -> None:
    gpu.init()
    load_package().register()
    presets = addon_module("blender.properties.presets")
    settings, rig = addon_module("parameters").ALL_SETTINGS, wig(STRANDS)
    studio = studio_of(rig, presets.named_preset(LOOK).settings)
    plain = studio.settings

    def look_and_motion(preset: Any) -> tuple[Any, tuple[Any, Any]]:
        at_rest = rig.rest_pose, rig.strands.points
        sections = {each.section: each for each in preset.all}
        if "dynamics" in sections:
            return plain, moved(rig, sections["dynamics"])
        if "volume" in sections:
            return plain.with_settings(sections["volume"]), at_rest
        atlas = replace(sections["atlas"], size=ATLAS)
        drawing = settings["card_drawing"](shown_as="cards")
        return plain.with_settings(sections["cards"], atlas, drawing), at_rest

    for section in ("dynamics", "volume", "cards"):
        for entry in presets.shipped_presets(section):
            studio.settings, (pose, points) = look_and_motion(presets.named_preset(entry.name))
            size = THUMBNAIL, THUMBNAIL, SAMPLES
            picture = studio.picture(pose, points, *size, is_transparent=True)
            write_thumbnail(entry.path.with_suffix(".png"), picture)
            print(f"Drew {entry.name}", flush=True)


if __name__ == "__main__":
    main()
