"""The documentation as a site: valid links, a menu, and no files from other hosts."""

from __future__ import annotations

import re
import shutil
import subprocess
from pathlib import Path

import make_site
import pytest
from make_site import REPOSITORY, write_site
from tiers import few_in_commits

pytest.importorskip("sphinx", reason="it is for development alone")


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("site")
    (folder / "0.0.9").mkdir()
    (folder / "0.0.9" / "README.html").write_text("an older version")
    return write_site(folder)


def test_each_page_is_in_a_menu() -> None:
    pages = {page.relative_to(REPOSITORY) for page in (REPOSITORY / "docs").rglob("*.md")}
    in_menu = {Path(f"{page}.md") for menu in make_site.MENU.values() for page in menu}
    assert pages <= in_menu


@pytest.mark.slow(instead="test_a_link_that_leads_nowhere_ends_it")
def test_each_page_of_the_repository_is_a_page(site: Path) -> None:
    pages = {page.relative_to(REPOSITORY) for page in (REPOSITORY / "docs").rglob("*.md")}
    assert len(pages) > 20
    for page in pages:
        assert (site / page.with_suffix(".html")).is_file(), page


@pytest.mark.slow(instead="test_a_link_that_leads_nowhere_ends_it")
def test_it_can_be_read_from_a_folder_without_a_network(site: Path) -> None:
    assert (site / "searchindex.js").stat().st_size > 10_000
    for page in site.rglob("*.html"):
        loaded = re.findall(
            r'<(?:script|link|img|iframe)[^>]+(?:src|href)="([^"]+)"', page.read_text()
        )
        for source in loaded:
            assert "://" not in source, f"{page.name} loads {source}"
            target = page.parent / source.partition("?")[0].partition("#")[0]
            assert target.exists(), f"{page.name} loads {source}, which is not there"


@pytest.mark.slow(instead="test_a_link_that_leads_nowhere_ends_it")
def test_it_knows_all_versions_and_begins_with_the_newest(site: Path) -> None:
    assert (
        site.parent / "versions.js"
    ).read_text() == f'const versions = ["{site.name}", "0.0.9"];\n'
    assert f"{site.name}/README.html" in (site.parent / "index.html").read_text()
    assert "README.html" in (site / "index.html").read_text()
    assert "versions.js" in (site / "docs" / "dev" / "shading.html").read_text()


@pytest.mark.parametrize("link", few_in_commits(["nowhere.md", "a.md#nowhere"]))
def test_a_link_that_leads_nowhere_ends_it(
    link: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    small = tmp_path / "small"
    (small / "docs").mkdir(parents=True)
    (small / "gpu_shaders").mkdir()
    for page in ("README", "CONTRIBUTING", "CHANGELOG", "gpu_shaders/README", "docs/a"):
        (small / f"{page}.md").write_text(f"# {page.replace('/', ' ')}\n")
    (small / "docs" / "b.md").write_text(f"# b\n\nSee [there]({link}).\n")
    shutil.copy(REPOSITORY / "blender_manifest.toml", small)
    others = ("CONTRIBUTING", "CHANGELOG", "gpu_shaders/README", "docs/a", "docs/b")
    monkeypatch.setattr(make_site, "MENU", {"All": others})
    with pytest.raises(subprocess.CalledProcessError):
        write_site(tmp_path / "site", small)
    (small / "docs" / "b.md").write_text("# b\n\nSee [there](a.md#docs-a).\n")
    assert (write_site(tmp_path / "site", small) / "docs" / "b.html").is_file()
