"""The documentation agrees with the code and with itself."""

from __future__ import annotations

import re
from pathlib import Path

import make_docs
import pytest

REPOSITORY = Path(__file__).parents[2]
PAGES = [
    REPOSITORY / "README.md",
    REPOSITORY / "CHANGELOG.md",
    *sorted((REPOSITORY / "docs").rglob("*.md")),
]
#: of a picture of the user guide, so that a page of them loads at once
MOST_BYTES = 150_000


def test_the_parameter_tables_are_current() -> None:
    written = (REPOSITORY / "docs" / "parameters.md").read_text(encoding="utf-8")
    assert written == make_docs.parameter_tables(), "run make docs"


def texts_of(page: Path) -> str:
    """A page without its code blocks, whose brackets are no links."""
    return re.sub(r"^```.*?^```$", "", page.read_text(encoding="utf-8"), flags=re.M | re.S)


def anchors(page: Path) -> set[str]:
    """What links may lead to in a page, as hosts of git name its headings."""
    found: list[str] = []
    for heading in re.findall(r"^#+ (.+)$", texts_of(page), flags=re.M):
        kept = re.sub(r"[^\w\- ]", "", heading.strip().lower())
        found.append(kept.replace(" ", "-"))
    return set(found)


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(REPOSITORY)))
def test_links_lead_somewhere(page: Path) -> None:
    links = [link.split(" ")[0] for link in re.findall(r"\]\(([^)]+)\)", texts_of(page))]
    missing = []
    for link in links:
        if "://" in link:
            continue
        path, _, anchor = link.partition("#")
        target = page.parent / path if path else page
        is_there = target.exists() and (not anchor or anchor in anchors(target))
        missing += [] if is_there else [link]
    assert missing == []


def test_every_page_is_reached_from_the_readme() -> None:
    reached, waiting = set(), [REPOSITORY / "README.md"]
    while waiting:
        page = waiting.pop().resolve()
        if page in reached:
            continue
        reached.add(page)
        links = re.findall(r"\]\(([^)#]+\.md)", texts_of(page))
        waiting += [page.parent / link for link in links if "://" not in link]
    assert [str(page) for page in PAGES if page.resolve() not in reached] == []


def test_every_picture_is_shown_and_small() -> None:
    shown = {
        (page.parent / link).resolve()
        for page in PAGES
        for link in re.findall(r"!\[[^\]]*\]\(([^)]+)\)", texts_of(page))
    }
    pictures = sorted((REPOSITORY / "docs" / "images").glob("*.png"))
    assert [path.name for path in pictures if path.resolve() not in shown] == []
    guide = [path for path in pictures if path.name.startswith("panel_")]
    assert [path.name for path in guide if path.stat().st_size > MOST_BYTES] == []


def test_the_architecture_page_names_every_room() -> None:
    """Those of addon/, and the folders within its two largest."""
    text = (REPOSITORY / "docs" / "architecture.md").read_text(encoding="utf-8")
    addon = REPOSITORY / "addon"
    rooms = [f"{path.name}/" for path in addon.iterdir() if (path / "__init__.py").exists()]
    rooms += [path.name for path in addon.glob("*.py") if path.name != "__init__.py"]
    rooms += [
        f"{large}/{path.name}/"
        for large in ("blender", "exchange")
        for path in (addon / large).iterdir()
        if (path / "__init__.py").exists()
    ]
    assert [room for room in rooms if f"`{room}`" not in text] == []


def test_the_pages_for_programmers_name_files_that_are_there() -> None:
    """A path from addon/ or from the top, or the bare name of a file."""
    files = {
        path.relative_to(REPOSITORY).as_posix()
        for room in ("addon", "gpu_shaders", "tests", "tools", "bench")
        for path in (REPOSITORY / room).rglob("*")
        if "__pycache__" not in path.parts
    }
    named = {path.rpartition("/")[2] for path in files} | files
    named |= {path.removeprefix("addon/") for path in files}
    for page in ("architecture.md", "development.md", "dynamics.md", "refinement.md", "shading.md"):
        text = (REPOSITORY / "docs" / page).read_text(encoding="utf-8")
        told = re.findall(r"`([\w/]+(?:\.comp)?\.(?:py|glsl)|(?:blender|exchange)/[\w/]+)`", text)
        gone = [name for name in told if name.rstrip("/") not in named | {"bench/x.py"}]
        # a formula's file may be named from its room on, as in `volume/dual.py`
        gone = [name for name in gone if not any(path.endswith(f"/{name}") for path in files)]
        assert gone == [], page
