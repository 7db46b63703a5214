"""The web page of Sintel's cards: how large it is, and whether Chromium opens it from its file
without a network and without console messages."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
from pathlib import Path
from typing import Any

from hairloom.addon.blender.command_line import command_line

REPOSITORY = Path(__file__).parents[1]
SANDBOX = str(REPOSITORY / "tools" / "window_blender")
#: a folder that the browser's sandbox sees
OUTPUT = REPOSITORY / "out" / "bench_page"
STEPS = (
    {"media": {"prefers-reduced-motion": "reduce"}},
    {"screen": [1280, 800, 1]},
    {"open": True},
    {"picture": "page.png"},
    {"evaluate": "document.documentElement.dataset.state"},
)


def page_figures() -> dict[str, Any]:
    """page_bytes: of the whole file, with default options. page_errors: console messages, requests
    for anything outside the page, and 1 if the page is not ready."""
    shutil.rmtree(OUTPUT, ignore_errors=True)
    folder = Path(os.environ.get("HAIRLOOM_DATA", REPOSITORY.parent / "shared" / "data")) / "sintel"
    strands, head = folder / "SintelHairOriginal-sintel_hair.16points.tfx", folder / "sintel.obj"
    files = ["--groom", str(strands), "--head", str(head), "--output", str(OUTPUT / "sintel.glb")]
    assert command_line.run(["cards", "--page", *files]) == 0
    (OUTPUT / "steps.json").write_text(json.dumps(STEPS), encoding="utf-8")
    driver, page = REPOSITORY / "tools" / "drive_page.py", OUTPUT / "sintel.html"
    command = [SANDBOX, "run", "python3", str(driver), str(page), str(OUTPUT / "steps.json")]
    subprocess.run([SANDBOX, "engines"], check=True)
    subprocess.run([*command, str(OUTPUT)], check=True, timeout=500)
    report = json.loads((OUTPUT / "report.json").read_text(encoding="utf-8"))
    outside = [each for each in report["requests"][1:] if not each.startswith("blob:")]
    errors = len(report["complaints"]) + len(outside) + (report["values"][-1] != "ready")
    return {"page_bytes": page.stat().st_size, "page_errors": errors}
