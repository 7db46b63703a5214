"""Draws the picture of the web page in docs/cards_export.md: a hairstyle, in Chromium.

python tools/web_page_pictures.py FOLDER
"""

import json
import subprocess
import sys
from pathlib import Path

from extension_loader import REPOSITORY
from small_pictures import write_small

#: a folder that the browser's sandbox sees
SCRATCH = REPOSITORY / "out" / "web_page"
STYLE = "bob"
STEPS = (
    {"media": {"prefers-reduced-motion": "reduce"}},
    {"screen": [1200, 760, 1]},
    {"open": True},
    {"evaluate": "document.querySelector(\"#levels input[value='0']\").click()"},
    {"picture": "desktop.png"},
    {"screen": [390, 760, 1]},
    {"picture": "phone.png"},
)


def main(folder: Path) -> None:
    import bpy  # noqa: F401  OpenImageIO lives inside it
    import OpenImageIO as oiio

    SCRATCH.mkdir(parents=True, exist_ok=True)
    page, steps = SCRATCH / f"{STYLE}.html", SCRATCH / "steps.json"
    headless = [sys.executable, str(REPOSITORY / "tools" / "headless.py"), "cards", "--page"]
    output = ["--output", str(page.with_suffix(".glb"))]
    subprocess.run([*headless, "--style", STYLE, *output], check=True)
    steps.write_text(json.dumps(STEPS), encoding="utf-8")
    sandbox, driver = (
        REPOSITORY / "tools" / "window_blender",
        REPOSITORY / "tools" / "drive_page.py",
    )
    subprocess.run([str(sandbox), "engines"], check=True)
    command = [str(sandbox), "run", "python3", str(driver), str(page), str(steps), str(SCRATCH)]
    subprocess.run(command, check=True)
    desktop, phone = (oiio.ImageBuf(str(SCRATCH / f"{each}.png")) for each in ("desktop", "phone"))
    combined = oiio.ImageBuf(oiio.ImageSpec(1200 + 16 + 390, 760, 3, "uint8"))
    oiio.ImageBufAlgo.fill(combined, (1.0, 1.0, 1.0))
    oiio.ImageBufAlgo.paste(combined, 0, 0, 0, 0, oiio.ImageBufAlgo.channels(desktop, (0, 1, 2)))
    oiio.ImageBufAlgo.paste(combined, 1216, 0, 0, 0, oiio.ImageBufAlgo.channels(phone, (0, 1, 2)))
    combined.write(str(SCRATCH / "both.png"))
    write_small(SCRATCH / "both.png", folder / "web_page.jpg")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
