"""Makes what comes from the code: parameter tables, verbs, the texts to translate, the pictures.

python tools/make_docs.py [--check | --pictures]

--check fails when docs/parameters.md is not what the code would write; --pictures also runs the
demo, copies its pictures into docs/images, and draws those of docs/refinement.md,
docs/shading.md and docs/engine.md with the thumbnails of the presets.
"""

import argparse
import importlib
import json
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

from extension_loader import PACKAGE, REPOSITORY, load_package

PARAMETERS = REPOSITORY / "docs" / "parameters.md"
VERBS = REPOSITORY / "docs" / "verbs.md"
TEXTS = REPOSITORY / "translations" / "template.json"
IMAGES = REPOSITORY / "docs" / "images"
HEADING = """# Parameters

Made by `make docs` from the declarations in each room's `settings.py`: change them there.
On the command line each is set with `--set SECTION.NAME=VALUE`; angles there are in radians.

"""


def parameter_tables() -> str:
    """docs/parameters.md, whole."""
    load_package()
    parameters = importlib.import_module(f"{PACKAGE}.addon.parameters")
    docs = importlib.import_module(f"{PACKAGE}.addon.params.docs")
    return HEADING + "\n".join(
        docs.table(settings) for settings in parameters.ALL_SETTINGS.values()
    )


def verb_tables() -> str:
    """docs/verbs.md, whole; it takes a Blender to know."""
    load_package()
    command_line = importlib.import_module(f"{PACKAGE}.addon.blender.command_line.command_line")
    return str(
        importlib.import_module(f"{PACKAGE}.addon.blender.command_line.verb_docs").page(
            command_line.VERBS
        )
    )


def texts_to_translate() -> str:
    """translations/template.json, whole; it takes a Blender to know."""
    load_package().register()
    translations = importlib.import_module(f"{PACKAGE}.addon.ui.translations")
    classes = importlib.import_module(f"{PACKAGE}.addon.registration").CLASSES
    return json.dumps(translations.texts(classes), indent=1, ensure_ascii=False) + "\n"


def make_pictures() -> None:
    """Run the demo on the built-in head, in air and under water, and keep its pictures."""
    IMAGES.mkdir(exist_ok=True)
    with tempfile.TemporaryDirectory() as folder:
        headless = [sys.executable, str(REPOSITORY / "tools" / "headless.py")]
        subprocess.run([*headless, "demo", "--output", folder], check=True)
        for name in ("still.png", "motion.png"):
            shutil.copyfile(Path(folder) / name, IMAGES / name)
        preset = ["--preset", "dynamics/under_water"]
        subprocess.run([*headless, "demo", *preset, "--output", folder], check=True)
        shutil.copyfile(Path(folder) / "motion.png", IMAGES / "under_water.png")
    tools = ("refinement", "preset", "shading", "volume", "engine", "quick_start")
    for name in (*(f"{each}_pictures" for each in tools), "preset_thumbnails"):
        tool = [sys.executable, str(REPOSITORY / "tools" / f"{name}.py")]
        subprocess.run([*tool, str(IMAGES)], check=True)


def main() -> int:
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--check", action="store_true")
    options.add_argument("--pictures", action="store_true")
    chosen = options.parse_args()
    text = parameter_tables()
    if chosen.check:
        current = PARAMETERS.is_file() and PARAMETERS.read_text(encoding="utf-8") == text
        if not current:
            print("docs/parameters.md is out of date: run make docs", file=sys.stderr)
        return 0 if current else 1
    PARAMETERS.write_text(text, encoding="utf-8")
    VERBS.write_text(verb_tables(), encoding="utf-8")
    TEXTS.write_text(texts_to_translate(), encoding="utf-8")
    if chosen.pictures:
        make_pictures()
    return 0


if __name__ == "__main__":
    sys.exit(main())
