"""docs/figures.md shows the measured figures, and the other pages quote them."""

from __future__ import annotations

import json
import re
from pathlib import Path

import figures
import pytest

KEPT = {"benches": {"ties": {"figures": {"ratio": 41.26, "part": 0.0123, "off_percent": 0.5}}}}


#: when and by what a benchmark was measured
SETUP = {
    "date": "2026-01-02",
    "machine": {"cores": "2", "processor": "x"},
    "is_software": True,
    **dict.fromkeys(("blender", "renderer", "backend", "python", "numpy"), "x"),
}


def test_all_benchmarks_are_run() -> None:
    assert set(figures.BENCHES) == {path.stem for path in figures.BENCHMARKS.glob("[!_]*.py")}


def test_the_page_is_current() -> None:
    assert figures.PAGE.read_text(encoding="utf-8") == figures.page(figures.stored_results()), (
        "run make docs"
    )


def test_what_was_measured_is_what_would_be_measured_today() -> None:
    found = figures.stored_results()["benches"]
    assert found
    for name, each in found.items():
        assert each["arguments"] == figures.BENCHES[name].arguments, f"run tools/figures.py {name}"


def test_each_benchmark_has_a_limit() -> None:
    """Without a limit, `make bench` would pass whatever a benchmark measures."""
    found = figures.stored_results()["benches"]
    assert [name for name, each in found.items() if each["ended"] and not each["limits"]] == []


def test_quotes_are_as_they_were_found() -> None:
    pages = figures.pages_that_quote()
    assert pages
    for path in pages:
        text = path.read_text(encoding="utf-8")
        assert figures.with_current_values(text, figures.stored_results()) == text, (
            f"{path.name}: run make docs"
        )


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ('[7 times](figures.md "ties.ratio")', '[41.3 times](figures.md "ties.ratio")'),
        ('[9](../dev/figures.md "ties.ratio")', '[41.3](../dev/figures.md "ties.ratio")'),
        ('[9 %](figures.md "ties.part")', '[1.23 %](figures.md "ties.part")'),
        ('[9 %](figures.md "ties.off_percent")', '[0.5 %](figures.md "ties.off_percent")'),
        ("[9](figures.md#ties)", "[9](figures.md#ties)"),
    ],
)
def test_a_quote_takes_the_figure_and_keeps_its_unit(text: str, expected: str) -> None:
    assert figures.with_current_values(text, KEPT) == expected


def test_a_quote_of_what_nobody_measured_is_an_error() -> None:
    with pytest.raises(KeyError):
        figures.with_current_values('[1](figures.md "ties.color")', KEPT)


def test_what_is_missed_is_said_first_and_in_its_row() -> None:
    found = {
        "ended": True,
        "arguments": "--strands 8",
        "left_out": "most strands",
        "other_work": 0.1,
        "seconds": 2.0,
        "reference": "a ring",
        "limits": {"escape_mm": "at most 1", "kept": "at least 1"},
        "missed": ["escape_mm"],
        "figures": {"escape_mm": 2.5, "kept": 1.0, "strands": 12000, "seeds": []},
        **SETUP,
    }
    kept = {"benches": {"ties": found}}
    page = figures.page(kept)
    assert "Of 2 limits 1 are missed: `ties.escape_mm`." in page
    assert "`tools/bench.py ties --strands 8`, 2 s. Beside: a ring. Left out: most strands." in page
    assert "| `escape_mm` | 2.5 | **at most 1, missed** |" in page
    assert "| `strands` | 12,000 |" in page
    assert "Not measured: curves_read, styles," in page
    found["other_work"] = 1.5
    assert "beside other work" not in page and "beside other work" in figures.page(kept)
    kept["benches"] |= {"cards": {"ended": False, "seconds": 600.0}}
    assert "Did not end: cards." in figures.page(kept)


def test_each_section_has_its_own_date_and_setup(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """Measuring one benchmark again, on another machine, leaves date and setup of the others."""
    plain = {"arguments": "", "left_out": "", "other_work": 0.0, "seconds": 1.0, "ended": True}
    plain |= {"reference": "a ring", "limits": {}, "missed": [], "figures": {}}
    kept = {"benches": {"ties": plain | SETUP, "house": plain | SETUP}}
    (tmp_path / "figures.json").write_text(json.dumps(kept), encoding="utf-8")
    monkeypatch.setattr(figures, "FIGURES", tmp_path / "figures.json")
    monkeypatch.setattr(figures, "PAGE", tmp_path / "figures.md")
    again = {"date": "2026-03-04", "is_software": False, "renderer": "NVIDIA H100"}
    monkeypatch.setattr(figures, "run", lambda name: plain | SETUP | again)
    assert figures.measure(["ties"]) == 0
    page = figures.PAGE.read_text(encoding="utf-8")
    head, ties, house = re.split(r"^## .*$", page, flags=re.M)
    assert "Measured on 2026-03-04" in ties and "A GPU drew: NVIDIA H100 (x)." in ties
    assert "Measured on 2026-01-02" in house and "A software driver, no GPU" in house
    assert "Measured" not in head and "driver" not in head + ties


def test_a_benchmark_that_fails_is_not_taken_for_one_that_found_something(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    class Done:
        stdout, stderr, returncode = "half a line", "Traceback", 1

    monkeypatch.setattr(figures.subprocess, "run", lambda *_, **__: Done)
    found = figures.run("ties")
    assert found["date"] and found["machine"]["cores"]
    assert not found["ended"] and "figures" not in found


def test_arguments_are_words_that_benchmarks_know() -> None:
    for name, short in figures.BENCHES.items():
        family = "".join(
            path.read_text(encoding="utf-8")
            for path in (figures.BENCHMARKS / f"{name}.py", *figures.BENCHMARKS.glob("_*.py"))
        )
        for word in re.findall(r"--[a-z-]+", short.arguments):
            assert f'"{word}"' in family, (name, word)


def typed(text: str, names: list[str]) -> list[str]:
    """Numbers that are typed beside the name of a figure, in a sentence or a table row."""
    name = rf"(?<![\w.])`?(?:{'|'.join(map(re.escape, names))})`?"
    in_sentences = re.findall(rf"{name}(?:(?: is|:)?\s+\d[\d.,]*|,\s+\d[\d.]*,)", text)
    in_rows = re.findall(rf"^\| *{name}[^|]*\| *\d[^|]*\|", text, re.M)
    return [*in_sentences, *in_rows]


def test_a_number_beside_the_name_of_a_figure_is_a_quote() -> None:
    """A typed number would stay when the figure is measured again."""
    found = figures.stored_results()["benches"].values()
    names = [name for each in found for name in each.get("figures", {}) if "_" in name]
    for path in sorted((figures.REPOSITORY / "docs").rglob("*.md")):
        if path != figures.PAGE and path.name != "decisions.md":  # dated: keeps its numbers
            assert typed(path.read_text(encoding="utf-8"), names) == [], path.name


@pytest.mark.parametrize(
    "text", ["a_ratio, 11, is", "(`a_ratio`: 1.00)", "a_ratio is 5", "| `a_ratio`, x | 0.1 | |"]
)
def test_a_typed_number_is_found(text: str) -> None:
    assert typed(text, ["a_ratio"])
    assert not typed('| `a_ratio`, of 4 | [1](figures.md "b.a_ratio") | 2 |', ["a_ratio"])
