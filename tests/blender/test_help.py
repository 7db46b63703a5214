"""Help of panels, settings and buttons opens existing pages of the documentation."""

from __future__ import annotations

import re
import webbrowser
from pathlib import Path
from types import SimpleNamespace
from typing import Any
from urllib.parse import unquote, urlparse

import bpy
import make_help
import pytest
from bl_operators.wm import WM_OT_doc_view_manual

from hairloom.addon import registration
from hairloom.addon.parameters import ALL_SETTINGS
from hairloom.addon.ui import help as ours
from hairloom.addon.ui import panels

pytestmark = pytest.mark.usefixtures("extension")


@pytest.fixture(scope="module")
def pages(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The help pages as in the zip."""
    pytest.importorskip("sphinx", reason="it makes them")
    return make_help.write_help(tmp_path_factory.mktemp("help") / "help")


def test_pages_are_made_again_when_what_they_are_made_of_changes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    made: list[str] = []
    state = {"sum": "one"}
    monkeypatch.setattr(make_help, "HELP", tmp_path / "help")
    monkeypatch.setattr(make_help, "CHECKSUM_FILE", tmp_path / "out" / "help.sum")
    monkeypatch.setattr(make_help, "sources_checksum", lambda: state["sum"])

    def write() -> None:
        made.append(state["sum"])
        (tmp_path / "help").mkdir(exist_ok=True)

    monkeypatch.setattr(make_help, "write_help", write)
    for state["sum"] in ("one", "one", "two", "two"):
        make_help.fresh_help()
    assert made == ["one", "two"]
    (tmp_path / "help").rmdir()
    make_help.fresh_help()
    assert made == ["one", "two", "two"]


def test_every_page_and_the_tools_count_for_the_checksum(tmp_path: Path) -> None:
    names = (*make_help.PAGES, "docs/dev/page.md", "docs/picture.png", "tools/site/conf.py")
    names += ("tools/make_help.py", "tools/make_site.py")
    names += ("requirements.lock", "blender_manifest.toml")
    for name in names:
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text("as it was")
    before = make_help.sources_checksum(tmp_path)
    assert make_help.sources_checksum(tmp_path) == before
    for name in names:
        (tmp_path / name).write_text("changed")
        assert make_help.sources_checksum(tmp_path) != before, name
        (tmp_path / name).write_text("as it was")


def is_there(address: str) -> bool:
    """Whether a page exists and has this heading."""
    parts = urlparse(address)
    page = Path(unquote(parts.path))
    return page.is_file() and (not parts.fragment or f'id="{parts.fragment}"' in page.read_text())


def found(name: str) -> str | None:
    """The address that Blender opens for F1."""
    address: str | None = WM_OT_doc_view_manual._lookup_rna_url(name, verbose=False)
    return address


@pytest.mark.slow(instead="test_f1_finds_a_page_for_each_operator_and_property")
def test_every_page_and_heading_is_in_the_zip(pages: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(ours, "HELP", pages)
    _, entries = ours.manual_map()
    missing = [pattern for pattern, address in entries if not is_there(address)]
    assert missing == [] and len(entries) > 50
    assert not is_there(ours.page_url("dynamics#nowhere")), "the check finds everything"


@pytest.mark.slow(instead="test_f1_finds_a_page_for_each_operator_and_property")
def test_the_pages_need_nothing_that_was_left_out(pages: Path) -> None:
    found = list(pages.rglob("*.html"))
    assert len(found) > 20
    for page in found:
        text = page.read_text("utf-8")
        assert "<img" not in text and "_images/" not in text, page
        for source in re.findall(r'<(?:script|link)[^>]+(?:src|href)="([^"?#]+)', text):
            is_of_site = source.endswith("versions.js")  # the site's version menu
            assert is_of_site or (page.parent / source).exists(), f"{page.name} loads {source}"


def test_f1_finds_a_page_for_each_operator_and_property() -> None:
    for each in registration.CLASSES:
        if issubclass(each, bpy.types.PropertyGroup):
            for prop in each.bl_rna.properties:
                name = f"bpy.types.{each.__name__}.{prop.identifier}"
                assert (found(name) or "").startswith("file:"), name
    for name in dir(bpy.ops.hairloom):
        assert (found(f"bpy.ops.hairloom.{name}") or "").startswith("file:"), name
    blenders = found("bpy.types.Object.location")
    assert blenders is not None and "docs.blender.org" in blenders, "Blender's own are taken"


@pytest.mark.parametrize(
    ("what", "page"),
    [
        ("HAIRLOOM_PG_dynamics.gravity", "dynamics"),
        ("HAIRLOOM_PG_grow.length", "styling"),
        ("HAIRLOOM_PG_shading.base_color", "shading"),
        ("hairloom.make_cards", "cards"),
        ("hairloom.add_hairstyle", "hairstyles"),
    ],
)
def test_f1_opens_it(what: str, page: str, monkeypatch: pytest.MonkeyPatch) -> None:
    opened: list[str] = []
    monkeypatch.setattr(webbrowser, "open", opened.append)
    assert bpy.ops.wm.doc_view_manual(doc_id=what) == {"FINISHED"}
    assert [Path(urlparse(each).path).stem for each in opened] == [page]


def test_each_panel_of_hair_has_a_question_mark_for_its_own_page(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    opened: list[str] = []
    monkeypatch.setattr(webbrowser, "open", opened.append)
    asked: list[Any] = []

    class Layout:
        def operator(self, name: str, **_: Any) -> Any:
            asked.append(type("Properties", (), {"operator": name}))
            return asked[-1]

    ours_all = [each for each in registration.CLASSES if issubclass(each, bpy.types.Panel)]
    for panel in ours_all:
        drawn = SimpleNamespace(layout=Layout(), help_section=getattr(panel, "help_section", ""))
        panel.draw_header_preset(drawn, bpy.context)
        section = panel.__name__.partition("_PT_")[2].partition("_")[2]
        assert asked[-1].page in ours.PAGES.values(), section
        bpy.ops.hairloom.help(page=asked[-1].page)
    assert len(opened) == len(asked) == len(ours_all) > len(panels.CLASSES) + 8
    assert len({each.page for each in asked}) > 10, "many panels have the same page"


def test_a_page_that_nobody_wrote_is_refused() -> None:
    with pytest.raises(RuntimeError, match="no such page"):
        bpy.ops.hairloom.help(page="../../etc/passwd")


def test_every_section_of_settings_declares_its_page() -> None:
    docs = Path(__file__).parents[2] / "docs"
    for name, settings in ALL_SETTINGS.items():
        page, _, heading = settings.help_page.partition("#")
        text = (docs / f"{page}.md").read_text(encoding="utf-8")
        headings = re.findall(r"^#+ (.+)$", text, re.MULTILINE)
        known = {re.sub(r"[^a-z0-9]+", "-", each.lower()).strip("-") for each in headings}
        assert not heading or heading in known, name
