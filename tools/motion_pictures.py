"""Draws the looping animations of docs/quick_start.md and the tutorials.

python tools/motion_pictures.py FOLDER [NAME ...]       all, or those with these names

They are animated WebP, which code hosts show as pictures of a page, unlike films.
"""

import sys
import tempfile
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import bpy
import gpu
import numpy as np
from extension_loader import load_package
from guide_steps import tutorial
from PIL import Image
from styling_pictures import addon_module, grown

SIDE, SAMPLES = 480, 4
#: frames of the scene that a loop takes, at 24 a second, of which every second one is drawn
LOOP, STEP = 72, 2
#: of EEVEE, whose frames take a minute each
EEVEE_LOOP, EEVEE_SIDE, EEVEE_SAMPLES = 48, 360, 16
#: pictures in a loop of hair that does not move, and their side
STILLS, STILL_SIDE = 30, 400
#: part of a loop -> turn about the vertical axis and nod of the head [degrees]
TURNS = (
    (0.0, 0.0, 0.0),
    (0.22, 26.0, -3.0),
    (0.4, 12.0, 5.0),
    (0.62, -26.0, -3.0),
    (0.84, -8.0, 4.0),
)
#: of hair that grows: least and greatest length, and greatest wave [m]
LENGTHS, WAVE = (0.06, 0.3), 0.014
#: of WebP, up to 100
QUALITY = 86


def main(folder: Path, names: list[str]) -> None:
    gpu.init()
    load_package().register()
    for name in names or LOOPS:
        with tempfile.TemporaryDirectory() as scratch:
            pictures = []
            for path in LOOPS[name](Path(scratch)):
                pictures.append(Image.open(path).convert("RGB"))
                print(f"{name}: {len(pictures)} pictures", flush=True)
            write_loop(folder / f"{name}.webp", pictures)


def turning(scratch: Path) -> Iterator[Path]:
    """Draw the sample scene, whose head turns."""
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    bpy.ops.hairloom.sample_scene(plays=False)
    bpy.context.scene.hairloom.picture.samples = SAMPLES
    yield from rendered_turn(scratch, LOOP, SIDE)


def eevee_shot(scratch: Path) -> Iterator[Path]:
    """Draw the same by EEVEE, with motion blur."""
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    bpy.ops.hairloom.sample_scene(plays=False)
    scene = bpy.context.scene
    scene.render.engine, scene.hairloom.use_hair_scene = "BLENDER_EEVEE", True
    scene.render.use_motion_blur, scene.eevee.taa_render_samples = True, EEVEE_SAMPLES
    scene.hairloom.picture.samples = 2
    yield from rendered_turn(scratch, EEVEE_LOOP, EEVEE_SIDE)


def growing(scratch: Path) -> Iterator[Path]:
    """Draw hair while *Length* and *Wave* are dragged there and back."""
    hair = grown(length=LENGTHS[1])
    settings, camera = hair.data.hairloom.grow, camera_of(shown_now(hair))
    for number, slider in enumerate(swings()):
        settings.length = LENGTHS[0] + slider * (LENGTHS[1] - LENGTHS[0])
        settings.wave = WAVE * slider**2
        yield drawn(shown_now(hair), camera, scratch / f"{number}.png")


def melanin(scratch: Path) -> Iterator[Path]:
    """Draw hair while *Melanin* and *Redness* are dragged there and back."""
    known: dict[str, Any] = {"bpy": bpy}
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    for code in tutorial("look_like_cycles")[:2]:
        exec(compile(code, "step", "exec"), known)
    shown = shown_now(known["hair"])
    look = shown.studio.settings[addon_module("shading.settings").ShadingSettings]
    camera = camera_of(shown)
    for number, slider in enumerate(swings()):
        redness = 0.9 * float(np.sin(np.pi * slider)) ** 2
        shown.studio.show_look(replace(look, melanin=0.15 + 0.75 * slider, redness=redness))
        yield drawn(shown, camera, scratch / f"{number}.png")


def card_turn(scratch: Path) -> Iterator[Path]:
    """Draw cards from all sides."""
    known: dict[str, Any] = {"bpy": bpy}
    for code in tutorial("cards_into_godot")[:2]:
        exec(compile(code, "step", "exec"), known)
    known["hair"].data.hairloom.card_drawing.shown_as = "cards"
    bpy.ops.hairloom.turntable(
        directory=str(scratch), frames=STILLS, size=STILL_SIDE, samples=2, video=False
    )
    yield from sorted(scratch.glob("*.png"))


#: name of a file -> draws its pictures into a folder
LOOPS: dict[str, Callable[[Path], Iterator[Path]]] = {
    each.__name__: each for each in (turning, growing, melanin, card_turn, eevee_shot)
}


def swings() -> Iterator[float]:
    """For each picture, how far a slider is dragged: from 0 to 1 and back."""
    for number in range(STILLS):
        yield 0.5 - 0.5 * float(np.cos(2.0 * np.pi * number / STILLS))


def shown_now(hair: Any) -> Any:
    """The hair as its settings are now."""
    previews = addon_module("blender.preview.previews")
    for session in list(previews.sessions()):
        previews.stop(session)
    depsgraph = bpy.context.evaluated_depsgraph_get()
    return addon_module("blender.pictures.showing").shown_groom(hair, depsgraph)


def camera_of(shown: Any) -> Any:
    """The camera that frames the hair from its good side."""
    studio = shown.studio
    points = studio.framed_points(shown.pose, shown.points)
    return studio.framing_camera(points, studio.side.three_quarter, 1.0)


def drawn(shown: Any, camera: Any, path: Path) -> Path:
    """A picture of the hair with hard shadows: soft ones would take three times as long."""
    image = shown.studio.picture(
        shown.pose, shown.points, STILL_SIDE, STILL_SIDE, SAMPLES, camera, is_soft=False
    )
    shown.studio.write(path, image)
    return path


def rendered_turn(scratch: Path, frames: int, side: int) -> Iterator[Path]:
    """Render the scene's hair, baked, while its head turns there and back in that many frames."""
    scene, hair = bpy.context.scene, bpy.context.object
    turn(hair.data.surface, frames)
    bake = hair.hairloom.bake
    # after a first loop, hair begins each loop where it ends
    bake.folder, bake.use_own_range, bake.first, bake.last = str(scratch), True, 1, 2 * frames
    bpy.ops.hairloom.bake()
    scene.render.resolution_x = scene.render.resolution_y = side
    scene.render.image_settings.file_format = "PNG"
    for frame in range(frames + 1, 2 * frames + 1, STEP):
        scene.frame_set(frame)
        scene.render.filepath = str(scratch / f"{frame}.png")
        bpy.ops.render.render(write_still=True)
        yield Path(scene.render.filepath)


def turn(head: Any, frames: int) -> None:
    """Keyframes that loop smoothly."""
    head.animation_data_clear()
    for fraction, angle, nod in (*TURNS, (1.0, *TURNS[0][1:])):
        head.rotation_euler = np.radians((nod, 0.0, angle))
        head.keyframe_insert("rotation_euler", frame=1.0 + fraction * frames)
    (bag,) = head.animation_data.action.layers[0].strips[0].channelbags
    for curve in bag.fcurves:
        curve.modifiers.new("CYCLES")


def write_loop(path: Path, pictures: list[Image.Image]) -> None:
    """Write pictures as an endless loop."""
    first, *others = pictures
    first.save(
        path,
        save_all=True,
        append_images=others,
        duration=round(1000.0 * STEP / 24.0),
        loop=0,
        quality=QUALITY,
        method=6,
    )


if __name__ == "__main__":
    main(Path(sys.argv[1]), sys.argv[2:])
