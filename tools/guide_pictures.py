"""Copies the pictures of docs/user_guide.md from the output of the window session.

make test-ui SESSIONS=session_guide_pictures
python tools/guide_pictures.py FOLDER

The contents of the panels are stored beside them, see tools/panel_texts.py.
"""

import shutil
import sys
from pathlib import Path

import panel_texts
from extension_loader import REPOSITORY

FROM, SESSION = REPOSITORY / "out" / "window", "guide_pictures-opengl-"


def main(folder: Path) -> int:
    pictures = sorted(FROM.glob(f"{SESSION}panel_*.png"))
    if not pictures:
        print("no pictures: run make test-ui SESSIONS=session_guide_pictures", file=sys.stderr)
        return 1
    for path in pictures:
        made = folder / path.name.removeprefix(SESSION)
        shutil.copyfile(path, made)
        print(f"{made.name}: {made.stat().st_size:,} bytes")
    panel_texts.store_texts()
    return 0


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1])))
