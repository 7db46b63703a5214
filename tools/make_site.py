"""Writes the documentation as a site: `make site`.

The pages are those of the repository, with the same links. Each version has a folder of its own in
out/site and a menu of all versions there. The site needs no server and no network.

    python tools/make_site.py [FOLDER]
"""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import tempfile
import tomllib
from pathlib import Path

from guide_steps import TUTORIALS

REPOSITORY = Path(__file__).resolve().parents[1]
#: files that become pages, beside all of docs
PAGES = ("README.md", "CONTRIBUTING.md", "CHANGELOG.md", "gpu_shaders/README.md")
#: the menu: readers -> pages
MENU = {
    "Artists": (
        "docs/quick_start",
        "docs/tutorials/README",
        *(f"docs/tutorials/{name}" for name in TUTORIALS),
        "docs/user_guide",
        "docs/hairstyles",
        "docs/styling",
        "docs/refinement",
        "docs/painting",
        "docs/dynamics",
        "docs/shading",
        "docs/light_shafts",
        "docs/skin",
        "docs/engine",
        "docs/strands_import",
        "docs/gallery",
        "docs/troubleshooting",
        "docs/glossary",
    ),
    "Engines": (
        "docs/cards",
        "docs/cards_export",
        "docs/card_textures",
        "docs/engines/README",
        "docs/engines/unreal",
        "docs/strands_export",
    ),
    "Pipelines": ("docs/command-line", "docs/verbs", "docs/parameters", "docs/farm/README"),
    "Programmers": (
        "docs/how_it_works",
        "CONTRIBUTING",
        "docs/dev/architecture",
        "docs/dev/development",
        "docs/dev/extending",
        "docs/dev/gpu",
        "docs/figures",
        "docs/dev/shading",
        "docs/dev/dynamics",
        "docs/dev/cards",
        "docs/dev/refinement",
        "docs/dev/hairstyles",
        "gpu_shaders/README",
        "docs/dev/decisions",
        "CHANGELOG",
    ),
}
_FORWARD = '<!doctype html><meta http-equiv="refresh" content="0; url={0}">\n'


def write_site(site: Path, repository: Path = REPOSITORY) -> Path:
    """Write the pages of this version below `site`, and the list of all versions there.

    Returns:
        the folder of this version.

    Raises:
        subprocess.CalledProcessError: a link leads nowhere, or a page is in no menu; Sphinx has
            printed which.
    """
    version = tomllib.loads((repository / "blender_manifest.toml").read_text())["version"]
    folder = site / version
    with tempfile.TemporaryDirectory() as pages:
        _gather(repository, Path(pages))
        shutil.rmtree(folder, ignore_errors=True)  # pages that are gone go from the site too
        subprocess.run(
            [sys.executable, "-m", "sphinx", "-b", "html", "--fail-on-warning", "--keep-going"]
            + ["--quiet", "-c", str(REPOSITORY / "tools" / "site"), pages, str(folder)],
            env=os.environ | {"HAIRLOOM_VERSION": version},
            check=True,
        )
    (folder / "index.html").write_text(_FORWARD.format("README.html"))
    versions = sorted((each.parent.name for each in site.glob("*/README.html")), reverse=True)
    (site / "versions.js").write_text(f"const versions = {json.dumps(versions)};\n")
    (site / "index.html").write_text(_FORWARD.format(f"{versions[0]}/README.html"))
    return folder


def _gather(repository: Path, pages: Path) -> None:
    """Copy the sources of pages, the first of them with the menu, and the pictures of presets."""
    shutil.copytree(repository / "docs", pages / "docs")
    pictures = [each.relative_to(repository) for each in (repository / "presets").rglob("*.png")]
    for file in (*map(Path, PAGES), *pictures):
        (pages / file).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(repository / file, pages / file)
    with (pages / PAGES[0]).open("a", encoding="utf-8") as index:
        for title, names in MENU.items():
            lines = ("```{toctree}", ":hidden:", f":caption: {title}", "", *names, "```")
            index.write("\n" + "\n".join(lines) + "\n")


if __name__ == "__main__":
    print(write_site(Path(sys.argv[1]) if len(sys.argv) > 1 else REPOSITORY / "out" / "site"))
