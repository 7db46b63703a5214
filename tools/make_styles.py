"""Makes the hairstyles that ship, from their recipes.

python tools/make_styles.py [NAME ...]                write hairstyles/NAME.json and NAME.npz
python tools/make_styles.py --pictures FOLDER [NAME ...]   then draw each from four sides, and its
                                                           thumbnail, hairstyles/NAME.png
python tools/make_styles.py --draw-only --pictures FOLDER [NAME ...]   draw existing ones

The recipes are in tools/style_recipes.py, what they grow with in tools/style_growth.py.
"""

import argparse
import sys
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import bpy
import gpu
import numpy as np
from extension_loader import REPOSITORY, load_package
from preset_pictures import THUMBNAIL, write_thumbnail
from style_growth import Head, addon_module
from style_recipes import RECIPES

STYLES = REPOSITORY / "hairstyles"
#: where pictures look from: directions from the head to the eye
VIEWS = ((0.0, -1.0, 0.08), (-0.75, -0.75, 0.12), (-1.0, 0.0, 0.08), (0.0, 1.0, 0.12))
WIDTH, HEIGHT, SAMPLES = 220, 264, 2
#: enough children for a thumbnail
THUMBNAIL_STRANDS = 9000
#: where thumbnails look from if the style shows better from there
THUMBNAIL_VIEWS = dict.fromkeys(("ponytail", "bun", "braid"), (-0.85, 0.6, 0.2)) | dict.fromkeys(
    ("brows", "lashes"), (-0.35, -0.94, 0.05)
)


def make(names: list[str]) -> None:
    """Write the styles of these names."""
    head = Head()
    addon_module("blender.setup.hairstyles").shipped_hairstyles.cache_clear()
    hairstyles = addon_module("exchange.hairstyles")
    STYLES.mkdir(parents=True, exist_ok=True)
    for name in names:
        start = time.perf_counter()
        style = RECIPES[name](head)
        path = STYLES / f"{name}.json"
        hairstyles.write_hairstyle(path, style)
        count = 0 if style.guides is None else len(style.guides.group)
        print(f"{name}: {count:,} guides, {time.perf_counter() - start:.1f} s", flush=True)


def rig_of(name: str, max_strands: int = 1_000_000) -> tuple[Any, bpy.types.Object]:
    """The rig and the hair object of a style, added to a new scene as by an artist.

    Args:
        max_strands: limit of the number of children.
    """
    bpy.ops.wm.read_factory_settings(use_empty=True)
    setup = addon_module("blender.setup.hairstyles")
    collection = bpy.context.collection
    style = setup.named_hairstyle(name)
    run_parts = addon_module("blender.base.parts").run_parts
    is_fur = setup.grows_anywhere(style)
    head = animal() if is_fur else run_parts(setup.add_head(collection, "light"))
    bpy.context.view_layer.update()
    depsgraph = bpy.context.evaluated_depsgraph_get()
    hair = run_parts(setup.add_hairstyle(style, head, depsgraph, collection)).hair
    children = hair.data.hairloom.children
    children.strand_count = min(children.strand_count, max_strands)
    depsgraph = bpy.context.evaluated_depsgraph_get()
    source = addon_module("blender.scene.source").read_source(hair, depsgraph)
    if setup.is_bust(head) and not setup.is_face_hairstyle(style):
        face = run_parts(setup.face_hair(head, source.head, depsgraph))
        source = replace(
            source, strands=addon_module("strands.join").join_strands(source.strands, face)
        )
    rig = addon_module("blender.colliders.rigs").CachedRig.of(hair, source).rig
    return rig, hair


def animal() -> bpy.types.Object:
    """What fur is shown on: Blender's own monkey, as large as a head."""
    bpy.ops.mesh.primitive_monkey_add(size=0.2)
    monkey = bpy.context.object
    monkey.modifiers.new("Smooth", "SUBSURF").levels = 2
    return monkey


def studio_of(rig: Any, hair: bpy.types.Object) -> Any:
    """A studio that draws this hair in its own look."""
    parameters = addon_module("parameters").ALL_SETTINGS
    is_bust = addon_module("blender.setup.hairstyles").is_bust(hair.parent)
    object_settings = addon_module("blender.command_line.object_settings").settings_of_object(hair)
    settings = {section: kind() for section, kind in parameters.items()} | object_settings
    return addon_module("blender.pictures.studio").Studio(
        addon_module("blender.sessions.prepared_groom").prepare_groom(rig, settings["ambient"]),
        addon_module("blender.properties.groom_settings").GroomSettings(
            addon_module("params").SettingsMap(*settings.values())
        ),
        look=addon_module("blender.scene.built_in_head").built_in_head().look("light")
        if is_bust
        else None,
    )


def camera_at(rig: Any, direction: tuple[float, float, float], aspect: float) -> Any:
    """A camera that frames the hair and the head down to the shoulders; for brows and lashes, the
    face."""
    low, high = rig.strands.bounds()
    if addon_module("strands.face").is_face_hair(rig.strands.group).all():
        low, high = low - 0.02, high + 0.02
    else:
        low, high = np.minimum(low, (-0.11, -0.11, -0.2)), np.maximum(high, (0.11, 0.12, 0.12))
    return addon_module("render.camera").frame_camera(
        (low, high), direction, np.radians(24.0), aspect, margin=0.95
    )


def draw_thumbnail(name: str) -> None:
    """Draw hairstyles/NAME.png, with fewer strands, as it is small."""
    rig, hair = rig_of(name, THUMBNAIL_STRANDS)
    camera = camera_at(rig, THUMBNAIL_VIEWS.get(name, VIEWS[1]), 1.0)
    size = THUMBNAIL, THUMBNAIL, SAMPLES
    picture = studio_of(rig, hair).picture(
        rig.rest_pose, rig.strands.points, *size, camera=camera, is_transparent=True
    )
    write_thumbnail(STYLES / f"{name}.png", picture)
    print(f"{name}: thumbnail", flush=True)


def draw(name: str, folder: Path) -> None:
    """Draw NAME.png: the style from the front, three quarters, the side and the back."""
    rig, hair = rig_of(name)
    studio = studio_of(rig, hair)
    pictures = [
        studio.picture(
            rig.rest_pose,
            rig.strands.points,
            WIDTH,
            HEIGHT,
            SAMPLES,
            camera=camera_at(rig, direction, WIDTH / HEIGHT),
        )
        for direction in VIEWS
    ]
    folder.mkdir(parents=True, exist_ok=True)
    sheet = addon_module("blender.base.images").contact_sheet(pictures, len(VIEWS))
    studio.write(folder / f"{name}.png", sheet)
    count, notes = rig.strands.strand_count, [*rig.notes, *studio.notes]
    print(f"{name}: {count:,} strands; {rig.widths.line}. {notes}", flush=True)


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("names", nargs="*", metavar="NAME", default=[])
    parser.add_argument("--pictures", type=Path, metavar="FOLDER")
    parser.add_argument("--draw-only", action="store_true", help="what there is")
    parser.add_argument("--thumbnails", action="store_true", help="draw these alone")
    arguments = parser.parse_args()
    names = arguments.names or list(RECIPES)
    unknown = sorted(set(names) - set(RECIPES))
    if unknown:
        sys.exit(f"There is no recipe {', '.join(unknown)}; there are {', '.join(RECIPES)}")
    gpu.init()
    load_package().register()
    if not arguments.draw_only:
        make(names)
    for name in names if arguments.pictures else ():
        draw_thumbnail(name)
    for name in names if arguments.pictures and not arguments.thumbnails else ():
        draw(name, arguments.pictures.resolve())
    return 0


if __name__ == "__main__":
    sys.exit(main())
