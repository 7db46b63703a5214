"""The documentation agrees with the code and with itself."""

from __future__ import annotations

import re
from pathlib import Path

import make_docs
import pytest

REPOSITORY = Path(__file__).parents[2]
PAGES = [REPOSITORY / "README.md", *sorted((REPOSITORY / "docs").rglob("*.md"))]


def test_the_parameter_tables_are_current() -> None:
    written = (REPOSITORY / "docs" / "parameters.md").read_text(encoding="utf-8")
    assert written == make_docs.parameter_tables(), "run make docs"


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(REPOSITORY)))
def test_links_lead_somewhere(page: Path) -> None:
    links = re.findall(r"\]\(([^)#]+)", page.read_text(encoding="utf-8"))
    inside = [link for link in links if "://" not in link]
    missing = [link for link in inside if not (page.parent / link).exists()]
    assert missing == []


def test_the_architecture_page_names_every_room() -> None:
    text = (REPOSITORY / "docs" / "architecture.md").read_text(encoding="utf-8")
    addon = REPOSITORY / "addon"
    rooms = [f"{path.name}/" for path in addon.iterdir() if (path / "__init__.py").exists()]
    rooms += [path.name for path in addon.glob("*.py") if path.name != "__init__.py"]
    assert [room for room in rooms if f"`{room}`" not in text] == []
