"""Writes the pages that *Help* opens in Blender: the site without its pictures, as `help/`.

`make zip` puts them into the extension, so that they are there without a network, and of the
version that is installed. Without pictures they take one megabyte of the zip, with them fourteen.

    python tools/make_help.py
"""

from __future__ import annotations

import re
import shutil
import tempfile
from pathlib import Path

from make_site import REPOSITORY, write_site

HELP = REPOSITORY / "help"
#: of the site, what reading does not need
_LEFT_OUT = shutil.ignore_patterns("_images", "_sources", "_downloads", "images", "*.inv", "*.map")
_PICTURE = re.compile(r"<a [^>]*image-reference[^>]*>\s*<img [^>]*>\s*</a>|<img [^>]*>")


def write_help(folder: Path = HELP) -> Path:
    """Write them instead of those that are there."""
    with tempfile.TemporaryDirectory() as site:
        version = write_site(Path(site))
        shutil.rmtree(folder, ignore_errors=True)
        shutil.copytree(version, folder, ignore=_LEFT_OUT)
    for page in folder.rglob("*.html"):
        page.write_text(_PICTURE.sub("", page.read_text("utf-8")), "utf-8")
    return folder


if __name__ == "__main__":
    print(write_help())
