"""Bundles the script of an exported web page: our viewer and loader, and what they use of three.js.

python tools/make_viewer.py

It needs `make setup`. A test compares the bundle with its sources.
"""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

REPOSITORY = Path(__file__).resolve().parents[1]
NODE = REPOSITORY / "tools" / "node" / "node_modules"
ESBUILD = NODE / ".bin" / "esbuild"
PAGE = REPOSITORY / "addon" / "exchange" / "cards" / "page"
BUNDLE = PAGE / "viewer.min.js"


def bundle() -> bytes:
    """The whole script, as one module without imports."""
    command = [ESBUILD, "viewer.js", "--bundle", "--minify", "--format=esm", "--target=es2022"]
    command += ["--legal-comments=none", "--log-level=error"]
    command += [f"--alias:three/addons/loaders/EXRLoader.js={PAGE / 'table_loader.js'}"]
    environment = {**os.environ, "NODE_PATH": str(NODE)}
    return subprocess.run(
        [str(each) for each in command], cwd=PAGE, env=environment, check=True, capture_output=True
    ).stdout


if __name__ == "__main__":
    BUNDLE.write_bytes(bundle())
    print(f"{BUNDLE.relative_to(REPOSITORY)}  {BUNDLE.stat().st_size / 1e6:.2f} MB")
    sys.exit(0)
