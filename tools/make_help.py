"""Writes the pages that *Help* opens in Blender: the site without its pictures, as `help/`.

`make zip` adds them to the extension, so that they need no network and match the installed version.
Without pictures they take one megabyte of the zip, with them fourteen. Sphinx takes ten seconds, so
pages are only written again when their sources have changed.

    python tools/make_help.py
"""

from __future__ import annotations

import hashlib
import re
import shutil
import tempfile
from pathlib import Path

from make_site import PAGES, REPOSITORY, write_site

HELP = REPOSITORY / "help"
#: checksum of the sources of the pages
CHECKSUM_FILE = REPOSITORY / "out" / "help.sum"
#: files of the site that reading does not need
_EXCLUDED_FILES = shutil.ignore_patterns(
    "_images", "_sources", "_downloads", "images", "*.inv", "*.map"
)
_PICTURE = re.compile(r"<a [^>]*image-reference[^>]*>\s*<img [^>]*>\s*</a>|<img [^>]*>")


def sources_checksum(repository: Path = REPOSITORY) -> str:
    """A checksum of all sources of the pages, and of the tools that make them."""
    tools = (
        "tools/make_help.py",
        "tools/make_site.py",
        "requirements.lock",
        "blender_manifest.toml",
    )
    files = [repository / name for name in (*PAGES, *tools)]
    for folder in ("docs", "tools/site"):
        files += [f for f in (repository / folder).rglob("*") if f.is_file() and f.suffix != ".pyc"]
    checksum = hashlib.sha256()
    for file in sorted(files):
        content = file.read_bytes()
        checksum.update(f"{file.relative_to(repository)} {len(content)} ".encode() + content)
    return checksum.hexdigest()


def fresh_help() -> None:
    """Write the pages, unless they are those of this state of the repository."""
    checksum = sources_checksum()
    if HELP.is_dir() and CHECKSUM_FILE.is_file() and CHECKSUM_FILE.read_text() == checksum:
        return
    CHECKSUM_FILE.unlink(missing_ok=True)  # in case writing is interrupted
    write_help()
    CHECKSUM_FILE.parent.mkdir(exist_ok=True)
    CHECKSUM_FILE.write_text(checksum)


def write_help(folder: Path = HELP) -> Path:
    """Write the pages in place of existing ones."""
    with tempfile.TemporaryDirectory() as site:
        version = write_site(Path(site))
        shutil.rmtree(folder, ignore_errors=True)
        shutil.copytree(version, folder, ignore=_EXCLUDED_FILES)
    for page in folder.rglob("*.html"):
        page.write_text(_PICTURE.sub("", page.read_text("utf-8")), "utf-8")
    return folder


if __name__ == "__main__":
    fresh_help()
    print(HELP)
