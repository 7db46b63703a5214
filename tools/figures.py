"""Runs all benchmarks, short, and writes their figures: bench/figures.json and docs/figures.md.

python tools/figures.py            all of them, in half an hour; `make bench`
python tools/figures.py NAME ...   some again; the figures of the others stay

The documentation quotes these figures and no others: a link to a figure of the page, such as
`[0.5](figures.md "refinement.error_px_max")`, has the figure as its text, which `make docs` writes.
Exit code 1: a limit is missed, a benchmark did not end, or all took longer than they may.
"""

from __future__ import annotations

import ast
import json
import os
import re
import subprocess
import sys
import time
from collections.abc import Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

REPOSITORY = Path(__file__).resolve().parents[1]
BENCHMARKS = REPOSITORY / "bench"
FIGURES, PAGE = BENCHMARKS / "figures.json", REPOSITORY / "docs" / "figures.md"
#: [min] for all of them
MAX_MINUTES = 30.0
#: [s] for one of them
TIMEOUT_SECONDS = 600.0
#: processors that may be busy before a benchmark begins, and for how long they are watched [s]
MAX_BUSY, WATCH_SECONDS = 0.3, 1.0
#: keys of a benchmark's JSON that describe the run, and are no figures
METADATA_KEYS = ("reference", "limits", "missed")
METADATA_KEYS += ("backend", "renderer", "is_software", "blender", "python", "numpy")
_QUOTE = re.compile(
    r'\[(?P<shown>[^\]]+)\]\((?P<page>(?:\.\./)*(?:\w+/)*figures\.md) "(?P<name>[\w.]+)"\)'
)


@dataclass(frozen=True)
class ShortRun:
    """The arguments of a benchmark's short run, and what it leaves out to save time."""

    arguments: str = ""
    left_out: str = ""


#: in the order of the data flow
BENCHES: dict[str, ShortRun] = {
    "curves_read": ShortRun(),
    "styles": ShortRun("bob edit", "22 styles, and other heads"),
    "seat": ShortRun("comb", "growing, long jobs and *Make Real*"),
    "dynamics": ShortRun("--rounds 2", "five of seven rounds"),
    "strands": ShortRun("sintel", "other grooms"),
    "contacts": ShortRun("thin", "heads of hair"),
    "ties": ShortRun(),
    "hair_grid": ShortRun("--skip-cost", "what a frame costs"),
    "endurance": ShortRun(
        "--runs 20 --minutes 0.2", "98 % of the runs, and most of the long shake"
    ),
    "refinement": ShortRun(),
    "shading": ShortRun("cost reference glsl", "Cycles"),
    "volume": ShortRun("cost transparency", "shadows, and Cycles"),
    "no_atomics": ShortRun(),
    "sight": ShortRun("lost", "crowds, covers, scales, counts of strands, and Cycles"),
    "frames": ShortRun(),
    "freeze": ShortRun(),
    "preview_frame": ShortRun(),
    "compile": ShortRun("head", "other scenes"),
    "memory": ShortRun("small", "500,000 strands at 3840 x 2160"),
    "engine": ShortRun("shafts", "stills, skin, and animations"),
    "picture": ShortRun("soft_shadows", "hair over EEVEE and Cycles, blur and environments"),
    "cards": ShortRun("order", "building, atlases, occlusion, passes, and strands"),
    "engines": ShortRun("page springs", "other programs, levels and atlases"),
    "exchange": ShortRun("usd", "Alembic, motion, kills and damaged files"),
    "faults": ShortRun("runs 40", "most of the faults"),
    "house": ShortRun(),
}


def measure(names: list[str]) -> int:
    """Run benchmarks one after another, and write the figures of each as soon as it ends."""
    results = stored_results()
    begin, is_all = time.monotonic(), len(names) == len(BENCHES)
    for number, name in enumerate(names, 1):
        print(f"[{number}/{len(names)}] {name} {BENCHES[name].arguments}", flush=True)
        result = results["benches"][name] = run(name)
        missed = ", ".join(result.get("missed", [])) or "none"
        verdict = f"missed: {missed}" if result["ended"] else "did not end"
        print(f"    {result['seconds']:.0f} s, {verdict}", flush=True)
        measured = results["benches"]
        results["benches"] = {each: measured[each] for each in BENCHES if each in measured}
        write(results)
    minutes = (time.monotonic() - begin) / 60.0
    if is_all:
        write(results | {"minutes": round(minutes, 1)})
    print(f"{minutes:.1f} minutes; see docs/figures.md")
    measured_results = [results["benches"][name] for name in names]
    is_missed = any(not each["ended"] or each["missed"] for each in measured_results)
    return int(is_missed or (is_all and minutes > MAX_MINUTES))


def write(results: Mapping[str, Any]) -> None:
    FIGURES.write_text(json.dumps(results, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")
    PAGE.write_text(page(results), encoding="utf-8")


def run(name: str) -> dict[str, Any]:
    """The result of a benchmark, run in its own process; `ended` is false if it printed no
    figures."""
    command = [sys.executable, str(REPOSITORY / "tools" / "bench.py"), name]
    command += BENCHES[name].arguments.split()
    conditions = {
        "date": datetime.now(UTC).date().isoformat(),
        "machine": machine(),
        "arguments": BENCHES[name].arguments,
        "left_out": BENCHES[name].left_out,
        "other_work": busy_processors(),
    }
    begin = time.monotonic()
    try:
        done = subprocess.run(
            command,
            cwd=REPOSITORY,
            capture_output=True,
            text=True,
            timeout=TIMEOUT_SECONDS,
            check=False,
        )
        figures = json.loads(done.stdout.splitlines()[-1])
    except (subprocess.TimeoutExpired, json.JSONDecodeError, IndexError) as error:
        print(
            f"    {type(error).__name__}: {getattr(error, 'stderr', None) or done.stderr[-2000:]}"
        )
        return {**conditions, "ended": False, "seconds": round(time.monotonic() - begin, 1)}
    metadata = {key: figures.pop(key) for key in METADATA_KEYS if key in figures}
    seconds = round(time.monotonic() - begin, 1)
    return {**conditions, "ended": True, "seconds": seconds, **metadata, "figures": figures}


def busy_processors() -> float:
    """How many processors other work takes; 0 if the system does not report it."""
    stat_file = Path("/proc/stat")
    if not stat_file.is_file():
        return 0.0

    def working() -> int:
        user, nice, system, *_ = map(int, stat_file.read_text().splitlines()[0].split()[1:])
        return user + nice + system

    before = working()
    time.sleep(WATCH_SECONDS)
    return round((working() - before) / os.sysconf("SC_CLK_TCK") / WATCH_SECONDS, 2)


def machine() -> dict[str, str]:
    """The processor that computes."""
    cores = os.cpu_count() or 1
    names = Path("/proc/cpuinfo")
    text = names.read_text(encoding="utf-8") if names.is_file() else ""
    model = re.search(r"^model name\s*: (.+)$", text, re.MULTILINE)
    return {"processor": model[1] if model else "unknown", "cores": str(cores)}


def stored_results() -> dict[str, Any]:
    """What has been measured so far."""
    if not FIGURES.is_file():
        return {"benches": {}}
    results: dict[str, Any] = json.loads(FIGURES.read_text(encoding="utf-8"))
    return results


def page(results: Mapping[str, Any]) -> str:
    """The text of docs/figures.md."""
    benches: dict[str, Any] = results["benches"]
    ended = {name: result for name, result in benches.items() if result["ended"]}
    limits = sum(len(result["limits"]) for result in ended.values())
    missed = [f"`{name}.{key}`" for name, result in ended.items() for key in result["missed"]]
    if not ended:
        return "# Figures\n\nNothing has been measured yet: `make bench` does.\n"
    lines = [
        "# Figures",
        "",
        "What is measured, how, and the results. Each section is one benchmark of `bench/`, run",
        "short so that all of them take half an hour. `make bench NAME=x` runs one whole. The",
        "other pages quote these figures. This page is made by `make bench`: do not edit it.",
        "",
        "[gpu.md](dev/gpu.md#how-fast-a-machine-is) says which GPUs have been measured.",
        "",
        f"Of {limits} limits {len(missed)} are missed{': ' if missed else ''}{', '.join(missed)}.",
    ]
    for word, names in (
        ("Did not end", [name for name in benches if name not in ended]),
        ("Not measured", [name for name in BENCHES if name not in benches]),
    ):
        if names:
            lines += ["", f"{word}: {', '.join(names)}."]
    for name, result in ended.items():
        lines += ["", *section(name, result)]
    return "\n".join(lines) + "\n"


def section(name: str, result: Mapping[str, Any]) -> list[str]:
    command = f"tools/bench.py {name} {result['arguments']}".strip()
    left_out = f" Left out: {result['left_out']}." if result["left_out"] else ""
    if result["other_work"] > MAX_BUSY:
        left_out += " **Measured beside other work: its times count for little.**"
    lines = [
        f"## {name}",
        "",
        summary(name),
        "",
        f"`{command}`, {result['seconds']:.0f} s. Beside: {result['reference']}.{left_out}",
        "",
        measured_on(result),
        "",
        "| figure | found | limit |",
        "| --- | ---: | --- |",
    ]
    for key, value in result["figures"].items():
        limit = result["limits"].get(key, "")
        mark = f"**{limit}, missed**" if key in result["missed"] else limit
        lines.append(f"| `{key}` | {number(value)} | {mark} |")
    return lines


def measured_on(result: Mapping[str, Any]) -> str:
    """When a benchmark ran, and what computed and drew."""
    drawn = "**A software driver, no GPU**" if result["is_software"] else "A GPU"
    return (
        f"Measured on {result['date']} with {result['machine']['cores']} cores of "
        f"{result['machine']['processor']}, Blender {result['blender']}, "
        f"Python {result['python']}, numpy {result['numpy']}. "
        f"{drawn} drew: {result['renderer']} ({result['backend']})."
    )


def summary(name: str) -> str:
    """The first paragraph of a benchmark's docstring."""
    source = (BENCHMARKS / f"{name}.py").read_text(encoding="utf-8")
    docstring = (ast.get_docstring(ast.parse(source)) or "").split("\n\n")[0]
    return " ".join(docstring.split())


def number(value: Any) -> str:
    """A value as the page shows it: three significant digits, or a word."""
    if isinstance(value, bool) or value is None or isinstance(value, (str, list)):
        return ", ".join(map(str, value)) or "none" if isinstance(value, list) else str(value)
    if isinstance(value, int) or (value == round(value) and abs(value) < 1e6):
        return f"{int(value):,}"
    if abs(value) >= 100.0:
        return f"{value:,.0f}"
    return f"{value:.3g}"


def with_current_values(text: str, results: Mapping[str, Any]) -> str:
    """The text of a page with the latest value of each figure that it quotes.

    Text after the number stays: `[41 times](figures.md "refinement.node_ratio")`. A figure that is
    a fraction is converted if the quote is a percentage.

    Raises:
        KeyError: no benchmark found a figure of this name.
    """

    def shown(match: re.Match[str]) -> str:
        bench, key = match["name"].split(".")
        value = results["benches"][bench]["figures"][key]
        quoted_number = re.match(r"[\d.,e+-]*\d", match["shown"])
        unit = match["shown"][quoted_number.end() :] if quoted_number else ""
        if unit.strip() == "%" and "percent" not in key:
            value = 100.0 * value
        return f'[{number(value)}{unit}]({match["page"]} "{match["name"]}")'

    return _QUOTE.sub(shown, text)


def pages_that_quote() -> list[Path]:
    found = [REPOSITORY / "README.md", *sorted((REPOSITORY / "docs").rglob("*.md"))]
    return [path for path in found if _QUOTE.search(path.read_text(encoding="utf-8"))]


def write_quotes() -> None:
    """Bring the quotes of all pages up to date, and the page of the figures."""
    results = stored_results()
    PAGE.write_text(page(results), encoding="utf-8")
    for path in pages_that_quote():
        text = path.read_text(encoding="utf-8")
        path.write_text(with_current_values(text, results), encoding="utf-8")


def main(names: list[str]) -> int:
    unknown = [name for name in names if name not in BENCHES]
    if unknown:
        print(f"No such benchmark: {', '.join(unknown)}. There are {', '.join(BENCHES)}.")
        return 2
    return measure(names or list(BENCHES))


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
