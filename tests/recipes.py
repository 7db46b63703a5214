"""The recipes of docs/dev/extending.md: their blocks of code, and the places that they list."""

from __future__ import annotations

import re
import shutil
from dataclasses import dataclass
from pathlib import Path

REPOSITORY = Path(__file__).resolve().parents[1]
PAGE = REPOSITORY / "docs" / "dev" / "extending.md"
#: parts of the repository that a recipe may change
_PARTS = ("__init__.py", "blender_manifest.toml", "addon", "gpu_shaders", "presets", "translations")
_LOADER = "tools/extension_loader.py"


@dataclass(frozen=True)
class Block:
    """A block of code with a file's name: a new file (`python`), or a change of one (`diff`)."""

    recipe: str
    kind: str
    path: str
    text: str

    def apply(self, tree: Path) -> None:
        """Add or change the file in a copy of the repository.

        A change is one run of lines: context begins with a space, added lines with +, removed
        lines with -.
        """
        file = tree / self.path
        if self.kind == "python":
            assert not file.exists(), f"{self.recipe}: {self.path} is there already"
            file.write_text(self.text, encoding="utf-8")
            return
        rows = self.text.splitlines()
        before = "".join(f"{row[1:]}\n" for row in rows if not row.startswith("+"))
        after = "".join(f"{row[1:]}\n" for row in rows if not row.startswith("-"))
        text = file.read_text(encoding="utf-8")
        assert text.count(before) == 1, f"{self.recipe}: {self.path} no longer has\n{before}"
        file.write_text(text.replace(before, after), encoding="utf-8")


def recipes(page: Path = PAGE) -> dict[str, str]:
    """Heading -> text of each recipe."""
    parts = re.split(r"^## (.+)$", page.read_text(encoding="utf-8"), flags=re.M)
    return dict(zip(parts[1::2], parts[2::2], strict=True))


def blocks(page: Path = PAGE) -> list[Block]:
    return [
        Block(recipe, *found)
        for recipe, text in recipes(page).items()
        for found in re.findall(r"^```(python|diff) (\S+)\n(.*?)^```$", text, flags=re.M | re.S)
    ]


def listed_files(recipe: str) -> set[str]:
    """The sources that a recipe names outside its blocks of code."""
    text = re.sub(r"^```.*?^```$", "", recipes()[recipe], flags=re.M | re.S)
    return set(re.findall(r"`((?:addon|gpu_shaders)/[\w./]+\.(?:py|glsl))`", text))


def copy_with_recipes(tree: Path) -> None:
    """A copy of the extension in which every block of every recipe has been applied."""
    for part in (*_PARTS, _LOADER):
        source, target = REPOSITORY / part, tree / part
        target.parent.mkdir(parents=True, exist_ok=True)
        if source.is_dir():
            shutil.copytree(source, target, ignore=shutil.ignore_patterns("__pycache__", "*.png"))
        else:
            shutil.copyfile(source, target)
    for block in blocks():
        block.apply(tree)
