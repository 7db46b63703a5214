"""Makes the documentation's parts that come from the code: tables of parameters and verbs, the
figure of the flows, the texts to translate, the page of the gallery, the table of hairstyles, the
index of the decisions, the shading of cards in HLSL, the figures that pages quote, the pictures.

python tools/make_docs.py [--check | --pictures]

--check fails if docs/parameters.md is not up to date with the code; --pictures also runs the
demo, keeps its pictures in docs/images, and draws those of docs/refinement.md,
docs/shading.md and docs/engine.md with the thumbnails of the presets. `make gallery` draws those of
docs/gallery.md.
"""

import argparse
import importlib
import json
import subprocess
import sys
import tempfile
from pathlib import Path

import decisions_index
import figures
import flow_figure
import gallery
import hair_hlsl
import hairstyle_table
from extension_loader import PACKAGE, REPOSITORY, load_package
from small_pictures import write_small

PARAMETERS = REPOSITORY / "docs" / "parameters.md"
VERBS = REPOSITORY / "docs" / "verbs.md"
TRANSLATIONS = REPOSITORY / "translations"
IMAGES = REPOSITORY / "docs" / "images"
HEADING = """# Parameters

Every parameter with its default, range, unit and source. This page is made by `make docs` from the
declarations in the code: do not edit it.
On the command line each is set with `--set SECTION.NAME=VALUE`, such as
`--set children.method=multi`. Of switches and choices, *Allowed* has the values as `code`.
Angles are shown here in degrees: write `22deg`, since a bare 22 is 22 radians.
In Python, `obj` is the hair or the mesh that is cloth, choices are strings, and angles are radians:
`obj.data.hairloom.children.method = "multi"`.

"""


def parameter_tables() -> str:
    """The text of docs/parameters.md."""
    load_package()
    parameters = importlib.import_module(f"{PACKAGE}.addon.parameters")
    docs = importlib.import_module(f"{PACKAGE}.addon.params.docs")
    return HEADING + "\n".join(
        docs.parameter_table(settings) for settings in parameters.ALL_SETTINGS.values()
    )


def verb_tables() -> str:
    """The text of docs/verbs.md; needs Blender."""
    load_package()
    command_line = importlib.import_module(f"{PACKAGE}.addon.blender.command_line.command_line")
    return str(
        importlib.import_module(f"{PACKAGE}.addon.blender.command_line.verb_docs").page(
            command_line.VERBS
        )
    )


def write_texts_to_translate() -> None:
    """Write the template of translations, and bring each language up to date; needs Blender."""
    load_package().register()
    translations = importlib.import_module(f"{PACKAGE}.addon.ui.translations")
    classes = importlib.import_module(f"{PACKAGE}.addon.registration").CLASSES
    template = translations.texts(classes)
    for path in TRANSLATIONS.glob("*.json"):
        is_language = path.stem != translations.TEMPLATE
        content = json.loads(path.read_text(encoding="utf-8")) if is_language else {}
        texts = translations.updated(content, template)
        path.write_text(json.dumps(texts, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")


def make_pictures() -> None:
    """Run the demo in air and under water, shake a ponytail, and keep their pictures."""
    IMAGES.mkdir(exist_ok=True)
    with tempfile.TemporaryDirectory() as folder:
        demo = ["make", "-C", str(REPOSITORY), "demo", f"OUT={folder}"]
        subprocess.run(demo, check=True)
        for name in ("still", "close_up", "motion", "cards"):
            write_small(Path(folder) / f"{name}.png", IMAGES / f"{name}.jpg")
        subprocess.run([*demo, "OPTIONS=--preset dynamics/under_water"], check=True)
        write_small(Path(folder) / "motion.png", IMAGES / "under_water.jpg")
        headless = [sys.executable, str(REPOSITORY / "tools" / "headless.py")]
        style, bake = ["--style", "ponytail"], str(Path(folder) / "bake")
        subprocess.run([*headless, "simulate", *style, "--output", bake], check=True)
        shaken = Path(folder) / "ponytail.png"
        pictures = ["--output", str(Path(folder) / "still.png"), "--sheet", str(shaken)]
        subprocess.run([*headless, "render", *style, "--bake", bake, *pictures], check=True)
        write_small(shaken, IMAGES / "ponytail.jpg")
    tools = ("refinement", "preset", "shading", "volume", "engine", "styling")
    tools += ("hairstyle", "web_page", "tutorial", "cards", "shells", "motion")
    for name in tools:
        tool = [sys.executable, str(REPOSITORY / "tools" / f"{name}_pictures.py")]
        subprocess.run([*tool, str(IMAGES)], check=True)
    thumbnails = [sys.executable, str(REPOSITORY / "tools" / "preset_thumbnails.py")]
    subprocess.run(thumbnails, check=True)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--check", action="store_true")
    parser.add_argument("--pictures", action="store_true")
    arguments = parser.parse_args()
    text = parameter_tables()
    if arguments.check:
        current = PARAMETERS.is_file() and PARAMETERS.read_text(encoding="utf-8") == text
        if not current:
            print("docs/parameters.md is out of date: run make docs", file=sys.stderr)
        return 0 if current else 1
    PARAMETERS.write_text(text, encoding="utf-8")
    flow_figure.FIGURE.write_text(flow_figure.figure(), encoding="utf-8")
    hair_hlsl.write()
    VERBS.write_text(verb_tables(), encoding="utf-8")
    write_texts_to_translate()
    gallery.PAGE.write_text(gallery.page(), encoding="utf-8")
    decisions = decisions_index.PAGE.read_text(encoding="utf-8")
    decisions_index.PAGE.write_text(decisions_index.with_index(decisions), encoding="utf-8")
    hairstyles = hairstyle_table.PAGE.read_text(encoding="utf-8")
    hairstyle_table.PAGE.write_text(hairstyle_table.with_table(hairstyles), encoding="utf-8")
    figures.write_quotes()
    if arguments.pictures:
        make_pictures()
    return 0


if __name__ == "__main__":
    sys.exit(main())
