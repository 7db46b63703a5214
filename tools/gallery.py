"""Draws the gallery: docs/gallery.md, and its pictures in docs/images/gallery/.

python tools/gallery.py [NAME ...]       draw all pictures, or some, and write the page
python tools/gallery.py --page           write the page alone
python tools/gallery.py --bear FILE.obj  write the mesh that fur grows on

Each picture comes from a command of SECTIONS, which runs here as the page shows it.
"""

import argparse
import importlib
import json
import os
import shlex
import sys
import tempfile
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from extension_loader import PACKAGE, REPOSITORY, load_package
from small_pictures import write_small

PAGE = REPOSITORY / "docs" / "gallery.md"
PICTURES = REPOSITORY / "docs" / "images" / "gallery"
PRESETS, STYLES = REPOSITORY / "presets", REPOSITORY / "hairstyles"
HEADLESS, BEAR = "tools/headless.py", "tools/gallery.py --bear"
SIZE = "--width 360 --height 360 --samples 2"
COLUMNS, STYLED = 3, "--style long_wavy"
HEADING = """# Gallery

Hairstyles, looks, stages, kinds of hair and cards, each with the command that draws it. These
commands work in a clone of the repository after `make setup`, and can be the start of your own:
[command-line.md](command-line.md) explains verbs and options, [parameters.md](parameters.md) all
that `--set` can change. Without `--width`, `--height` and `--samples`, pictures are larger and
smoother. This page is made by `make gallery`: do not edit it.
"""


@dataclass(frozen=True)
class Picture:
    """One picture and what draws it.

    name: of its file, and of the file that the reader's command writes.
    title: what is shown.
    options: of the verb `render`, without size and output.
    """

    name: str
    title: str
    options: str

    @property
    def command(self) -> str:
        return f"{HEADLESS} render {self.options} {SIZE} --output {self.name}.png"


@dataclass(frozen=True)
class Section:
    """Pictures under one heading; `first` are commands that make what they need."""

    title: str
    text: str
    pictures: tuple[Picture, ...]
    setup_commands: tuple[str, ...] = ()


def preset_pictures(folder: str, options: str) -> tuple[Picture, ...]:
    """A picture for each preset of a folder, whose name replaces {} in the options."""
    return tuple(
        Picture(
            f"{folder}_{path.stem}",
            json.loads(path.read_text(encoding="utf-8"))["title"],
            options.format(path.stem),
        )
        for path in sorted((PRESETS / folder).glob("*.json"))
    )


def style_pictures(names: Iterable[str]) -> tuple[Picture, ...]:
    """A picture of each of these hairstyles on the built-in head."""
    return tuple(
        Picture(
            f"style_{name}",
            json.loads((STYLES / f"{name}.json").read_text(encoding="utf-8"))["title"],
            f"--style {name}",
        )
        for name in names
    )


def hairstyles() -> list[str]:
    """The names of all that grow on a head, in the order of Blender's menu."""
    orders = {
        path.stem: json.loads(path.read_text(encoding="utf-8"))["order"]
        for path in STYLES.glob("*.json")
        if path.with_suffix(".npz").is_file()  # fur has no guides of its own
    }
    return sorted(orders, key=orders.__getitem__)


def grown(name: str, title: str, look: str, **settings: float) -> Picture:
    """Hair of the built-in head with these settings of the section `grow`."""
    sets = " ".join(f"--set grow.{setting}={value}" for setting, value in settings.items())
    return Picture(name, title, f"--preset looks/{look} {sets}")


def fur(name: str, title: str, look: str, **settings: float) -> Picture:
    """The bear with hair along its normals."""
    sets = " ".join(f"--set grow.{setting}={value}" for setting, value in settings.items())
    sets = f"--set grow.method=normals {sets}"
    return Picture(name, title, f"--head bear.obj --preset looks/{look} {sets}")


SECTIONS = (
    Section(
        "Hairstyles",
        "The [hairstyles](hairstyles.md) that ship, on the built-in head.",
        style_pictures(hairstyles()),
    ),
    Section(
        "Looks",
        "The [looks](shading.md) that ship, on the same hair in the same light.",
        preset_pictures("looks", "--preset looks/{}"),
    ),
    Section(
        "Water and dust",
        "A hairstyle [wet and dusty](shading.md#water-and-dust).",
        (
            Picture("water_half", "Half wet", f"{STYLED} --set shading.wetness=0.5"),
            Picture("water_soaked", "Soaked", f"{STYLED} --set shading.wetness=1"),
            Picture("dust_dry", "Dusty", f"{STYLED} --set shading.dust=0.6"),
            Picture(
                "dust_wet",
                "Wet dust",
                f"{STYLED} --set shading.dust=0.6 --set shading.wetness=0.8",
            ),
        ),
    ),
    Section(
        "Stages",
        "The same hair on each [stage](command-line.md#the-stage).",
        preset_pictures("stage", "--preset looks/blond --stage {}"),
    ),
    Section(
        "Skins",
        "The skins of the built-in head.",
        tuple(
            Picture(f"skin_{tone}", tone.title(), f"--preset looks/black --skin {tone}")
            for tone in ("light", "medium", "dark")
        ),
    ),
    Section(
        "Kinds of hair",
        "What the section [grow](parameters.md#grow-grow) makes of the same head.",
        (
            grown("hair_straight", "Straight", "black", wave=0, frizz=0.0005, clump=0.3),
            grown("hair_waves", "Waves", "brown", wave=0.016, wave_length=0.09, clump=0.7),
            grown("hair_short", "Short", "grey", length=0.05, lift=0.25, wave=0.002),
            grown("hair_chin", "To the chin", "red", length=0.19, wave=0.004),
            Picture(
                "hair_tips",
                "Tips of another colour",
                "--preset looks/black --set shading.tip_color=0.05,0.45,0.6"
                " --set shading.tip_tint=1 --set shading.tint_start=0.35"
                " --set shading.tint_end=0.75",
            ),
            Picture(
                "hair_beard",
                "A beard, from a vertex group",
                "--scene sample.blend --head Head --density-group beard --preset looks/brown"
                " --set grow.length=0.03 --set grow.wave=0.003 --set grow.wave_length=0.02"
                " --set grow.volume=0.008",
            ),
        ),
        setup_commands=(f"{HEADLESS} run sample_scene --output sample.blend",),
    ),
    Section(
        "Fur",
        "Hair along the normals of a mesh, here of a bear that the first command makes.",
        (
            fur("fur_short", "Short fur", "brown", length=0.012, strand_count=60000),
            fur("fur_long", "Long fur", "blond", length=0.02, strand_count=60000),
        ),
        setup_commands=(f"{BEAR} bear.obj",),
    ),
    Section(
        "Strands and cards",
        "The strands, and each preset of [cards](cards.md) made from them. *Mobile* and *Crowd* "
        "are for hair far away.",
        (
            Picture("strands", "Strands", "--preset looks/brown"),
            *preset_pictures(
                "cards",
                "--preset looks/brown --preset cards/{} --set card_drawing.shown_as=cards",
            ),
        ),
    ),
)


def page() -> str:
    """The text of docs/gallery.md."""
    return "\n".join([HEADING, *(_section_text(section) for section in SECTIONS)])


def _section_text(section: Section) -> str:
    lines = [f"## {section.title}", "", section.text, ""]
    if section.setup_commands:
        lines += ["```sh", *(_as_shown(command) for command in section.setup_commands), "```", ""]
    for start in range(0, len(section.pictures), COLUMNS):
        row = section.pictures[start : start + COLUMNS]
        pictures = (f"![{each.title}](images/gallery/{each.name}.jpg)" for each in row)
        lines += [_table_row(each.title for each in row), _table_row("---" for _ in row)]
        lines += [_table_row(pictures), "", "```sh"]
        lines += [*(_as_shown(each.command) for each in row), "```", ""]
    return "\n".join(lines)


def _table_row(texts: Any) -> str:
    return f"| {' | '.join(texts)} |"


def _as_shown(command: str) -> str:
    return f".venv/bin/python {command}"


def draw(names: list[str]) -> None:
    """Run the commands of all pictures, or of those named."""
    unknown = set(names) - {each.name for section in SECTIONS for each in section.pictures}
    if unknown:
        sys.exit(f"There is no picture {', '.join(sorted(unknown))}")
    run = command_line()
    PICTURES.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as folder:
        os.chdir(folder)
        for section in SECTIONS:
            chosen = [each for each in section.pictures if not names or each.name in names]
            for command in (
                *(section.setup_commands if chosen else ()),
                *(each.command for each in chosen),
            ):
                print(command, flush=True)
                run(command)
            for each in chosen:
                write_small(Path(f"{each.name}.png"), PICTURES / f"{each.name}.jpg")
        os.chdir(REPOSITORY)


def command_line() -> Callable[[str], None]:
    """A function that runs a command in this process, so that Blender starts once, and each groom
    is grown once."""
    import bpy  # noqa: F401  it must come before gpu, which lives inside it
    import gpu

    gpu.init()
    load_package().register()
    folder = f"{PACKAGE}.addon.blender.command_line"
    hairloom = importlib.import_module(f"{folder}.command_line")
    grow_once(importlib.import_module(f"{folder}.inputs"))

    def run(command: str) -> None:
        tool, *arguments = shlex.split(command)
        if tool != HEADLESS:
            write_bear(Path(arguments[-1]))
        elif hairloom.run(arguments):
            sys.exit(f"This failed: {command}")

    return run


def grow_once(inputs: Any) -> None:
    """Keep the hair of the built-in head: growing it takes longer than drawing it."""
    grow, cache = inputs.grow_with_face, {}

    def cached_grow(surface: Any, settings: Any, weights: Any, length: Any = None) -> Any:
        if settings not in cache:
            cache[settings] = grow(surface, settings, weights, length)
        return cache[settings]

    inputs.grow_with_face = cached_grow


#: centre and half axes [m] of each part of a sitting bear that looks to -Y; its right limbs are
#: mirrored
BEAR_PARTS = (
    ((0.0, 0.0, 0.12), (0.105, 0.09, 0.125)),
    ((0.0, -0.01, 0.30), (0.092, 0.08, 0.082)),
    ((0.0, -0.1, 0.275), (0.045, 0.05, 0.036)),
)
BEAR_LIMBS = (
    ((0.072, 0.0, 0.375), (0.032, 0.02, 0.032)),
    ((0.12, -0.05, 0.15), (0.035, 0.075, 0.038)),
    ((0.085, -0.115, 0.035), (0.045, 0.085, 0.042)),
)


def write_bear(path: Path) -> None:
    """A bear of ellipsoids that flow into each other, as a mesh."""
    import bpy

    bpy.ops.wm.read_factory_settings(use_empty=True)
    data = bpy.data.metaballs.new("Bear")
    data.resolution = 0.008
    ball = bpy.data.objects.new("Bear", data)
    bpy.context.collection.objects.link(ball)
    mirrored = [((-x, y, z), axes) for (x, y, z), axes in BEAR_LIMBS]
    for center, axes in (*BEAR_PARTS, *BEAR_LIMBS, *mirrored):
        part = data.elements.new(type="ELLIPSOID")
        part.co, part.radius = center, 1.6
        part.size_x, part.size_y, part.size_z = axes
    bpy.context.view_layer.update()
    mesh = bpy.data.meshes.new_from_object(
        ball.evaluated_get(bpy.context.evaluated_depsgraph_get())
    )
    bear = bpy.data.objects.new("Bear", mesh)
    bpy.data.objects.remove(ball)
    bpy.context.collection.objects.link(bear)
    bpy.context.view_layer.objects.active = bear
    bear.select_set(True)
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.select_all(action="SELECT")
    bpy.ops.uv.smart_project()
    bpy.ops.object.mode_set(mode="OBJECT")
    bpy.ops.wm.obj_export(filepath=str(path.resolve()), export_materials=False)


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("names", nargs="*", metavar="NAME")
    parser.add_argument("--page", action="store_true")
    parser.add_argument("--bear", type=Path, metavar="FILE.obj")
    arguments = parser.parse_args()
    if arguments.bear:
        write_bear(arguments.bear)
        return 0
    if not arguments.page:
        draw(arguments.names)
    PAGE.write_text(page(), encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
