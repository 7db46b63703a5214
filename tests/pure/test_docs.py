"""The documentation agrees with the code and with itself."""

from __future__ import annotations

import ast
import builtins
import re
from pathlib import Path

import decisions_index
import hairstyle_table
import make_docs
import pytest
from guide_steps import TUTORIALS

REPOSITORY = Path(__file__).parents[2]
PAGES = [
    *sorted(REPOSITORY.glob("*.md")),
    *sorted((REPOSITORY / "docs").rglob("*.md")),
    REPOSITORY / "gpu_shaders" / "README.md",
]
#: pages for programmers, and the shaders that engines reuse; all others are for artists
FOR_PROGRAMMERS = ("CONTRIBUTING.md", "docs/dev/", "docs/engines/", "gpu_shaders/")
#: folders that tools create; not in the repository
MADE = ("out/", "out/window/", "dist/")
#: limit for a picture of the user guide, so that its pages load fast
MOST_BYTES = 150_000


def test_the_parameter_tables_are_current() -> None:
    written = (REPOSITORY / "docs" / "parameters.md").read_text(encoding="utf-8")
    assert written == make_docs.parameter_tables(), "run make docs"


def texts_of(page: Path) -> str:
    """A page without its code blocks, in which brackets are not links."""
    return re.sub(r"^```.*?^```$", "", page.read_text(encoding="utf-8"), flags=re.M | re.S)


def anchors(page: Path) -> set[str]:
    """The anchors of a page's headings, as Git hosts build them."""
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


def test_the_list_of_the_readme_has_every_page() -> None:
    """Except for tutorials, which have their own list."""
    pages = texts_of(REPOSITORY / "README.md").partition("\n## Pages\n")[2]
    listed = set(re.findall(r"\]\((docs/[^)]+\.md)\)", pages))
    docs = [page.relative_to(REPOSITORY) for page in (REPOSITORY / "docs").rglob("*.md")]
    lists = Path("docs/tutorials/README.md")
    there_are = {page.as_posix() for page in docs if page.parent != lists.parent or page == lists}
    assert there_are == listed


def python_blocks(page: Path) -> list[str]:
    """The blocks of a page for artists; those of tutorials with the lines that their list puts
    first."""
    blocks = re.findall(r"^```python.*?\n(.*?)^```$", page.read_text("utf-8"), flags=re.M | re.S)
    lists = REPOSITORY / "docs" / "tutorials" / "README.md"
    if page.parent != lists.parent or page == lists:
        return blocks
    (first,) = python_blocks(lists)
    return [first + block for block in blocks]


def unknown_names(code: str) -> set[str]:
    """Names that a script uses without having imported or set them."""
    nodes = list(ast.walk(ast.parse(code)))
    names = [node for node in nodes if isinstance(node, ast.Name)]
    known = {node.id for node in names if isinstance(node.ctx, ast.Store)} | set(dir(builtins))
    known |= {each.name for node in nodes if isinstance(node, ast.Import) for each in node.names}
    return {node.id for node in names} - known


def test_a_block_of_python_can_be_run_as_it_stands() -> None:
    """What the blocks do is tested in tests/blender: test_tutorials.py, test_hairstyle_guide.py and
    test_children.py."""
    blocks = {
        str(page.relative_to(REPOSITORY)): python_blocks(page)
        for page in PAGES
        if not is_for_programmers(page)
    }
    unknown = {page: set().union(*map(unknown_names, codes)) for page, codes in blocks.items()}
    assert {page: names for page, names in unknown.items() if names} == {}
    assert {page for page, codes in blocks.items() if codes} == {
        "docs/hairstyles.md",
        "docs/refinement.md",
        "docs/tutorials/README.md",
        *(f"docs/tutorials/{name}.md" for name in TUTORIALS),
    }, "run the blocks of a new page in a test"


def test_the_table_of_the_report_has_every_key_that_verbs_write() -> None:
    """All keys that appear literally in the verbs' code. Keys of figures do not; the page explains
    them."""
    verbs = REPOSITORY / "addon" / "blender" / "command_line"
    written = set()
    for file in verbs.glob("*.py"):
        for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Call) and ast.unparse(node.func).endswith("facts.update"):
                written |= {each.arg for each in node.keywords if each.arg}
            if isinstance(node, ast.Subscript) and ast.unparse(node.value).endswith("report.facts"):
                written |= {each.value for each in [node.slice] if isinstance(each, ast.Constant)}
    page = (REPOSITORY / "docs" / "command-line.md").read_text(encoding="utf-8")
    table = page.partition("\n## The report\n")[2].partition("\n## ")[0]
    rows = " ".join(re.findall(r"^\| (`.+?) \|", table, flags=re.M))
    assert {"held_strands", "drawn", "capabilities"} <= written
    assert written <= set(re.findall("`([^`]+)`", rows))


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
    """The rooms of addon/, and the folders within its two largest rooms."""
    text = (REPOSITORY / "docs" / "dev" / "architecture.md").read_text(encoding="utf-8")
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


def test_the_architecture_page_names_every_phase_of_a_preview() -> None:
    page = (REPOSITORY / "docs" / "dev" / "architecture.md").read_text(encoding="utf-8")
    source = (REPOSITORY / "addon/blender/preview/phases.py").read_text(encoding="utf-8")
    (phases,) = re.findall(r'^Phase = Enum\("Phase", "([A-Z_ ]+)"\)', source, flags=re.M)
    assert re.findall(r"^\| `([A-Z_]+)` \|", page, flags=re.M) == phases.split()


def files_named_in(text: str) -> list[str]:
    """The source files that a text names in backticks."""
    return re.findall(r"`((?:[\w.*/-]+/)?[\w.*-]+\.(?:py|glsl|toml))`", text)


def folders_named_in(text: str) -> list[str]:
    return re.findall(r"`((?:[\w.-]+/)+)`", text)


def is_there(name: str, page: Path) -> bool:
    """Whether a file or folder exists, relative to the repository, addon/ or the page's folder; a *
    matches any text."""
    if Path(name).name.removeprefix("session_").startswith(("x.", "lib_x.", "struct_x.")):
        return True  # any file of that kind
    tops = (REPOSITORY, REPOSITORY / "addon", page.parent)
    return any(any(top.glob(name.rstrip("/"))) for top in tops)


def is_for_programmers(page: Path) -> bool:
    return page.relative_to(REPOSITORY).as_posix().startswith(FOR_PROGRAMMERS)


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(REPOSITORY)))
def test_a_page_names_files_that_are_there(page: Path) -> None:
    named = files_named_in(texts_of(page))
    if is_for_programmers(page):
        named += [name for name in folders_named_in(texts_of(page)) if name not in MADE]
    assert [name for name in named if not is_there(name, page)] == []


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(REPOSITORY)))
def test_pages_for_artists_name_no_sources(page: Path) -> None:
    if is_for_programmers(page):
        return
    named = files_named_in(texts_of(page))
    assert [name for name in named if name.endswith((".py", ".glsl"))] == []


def test_a_file_is_named_by_its_whole_path() -> None:
    """The two tests above can fail."""
    page = REPOSITORY / "docs" / "dev" / "architecture.md"
    text = (
        "See `step.py`, `dynamics/step.py`, `addon/dynamics/`, `lib_dual.glsl`, `way` and `x: y/`."
    )
    named = files_named_in(text) + folders_named_in(text)
    assert named == ["step.py", "dynamics/step.py", "lib_dual.glsl", "addon/dynamics/"]
    assert [is_there(name, page) for name in named] == [False, True, False, True]


def test_the_table_of_hairstyles_is_that_of_their_files() -> None:
    text = hairstyle_table.PAGE.read_text(encoding="utf-8")
    assert hairstyle_table.table() in text, "run make docs"
    assert hairstyle_table.with_table(text.replace("45,000", "44,000")) == text


def test_decisions_have_a_number_a_day_a_status_and_a_topic() -> None:
    text = decisions_index.PAGE.read_text(encoding="utf-8")
    entries = re.split(r"^## ", text, flags=re.M)[1:]
    status = r"\n\n\d{4}-\d\d-\d\d · (accepted|superseded by ((?:\d+(?: and )?)+)) · (\w+)\n\n\*\*"

    numbers = [int(entry.partition(".")[0]) for entry in entries]
    # work in parallel may reserve numbers, so that some can be missing
    assert numbers == sorted(set(numbers))
    for number, entry in zip(numbers, entries, strict=True):
        title = entry.partition("\n")[0]
        found = re.search(status, entry)
        assert found, title
        later = [int(other) for other in re.findall(r"\d+", found.group(2) or "")]
        assert all(number < other and other in numbers for other in later), title
        assert found.group(3) in decisions_index.TOPICS, title
        assert "**Decision.** " in entry, title

    assert len(entries) > 50
    assert decisions_index.with_index(text) == text, "run make docs"
