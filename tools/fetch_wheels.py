"""Fetches the Python packages of the extension's zip into wheels/.

python tools/fetch_wheels.py

tools/wheels.sha256 has a line for each of them, as `sha256sum` writes it: only a file with that sum
is accepted, and an existing one is not fetched again, so that a second run needs no network.
Blender installs those for its own platform, which it reads from blender_manifest.toml; both lists
name the same files. They come from PyPI, or from the sources that pip is configured for
(PIP_INDEX_URL, PIP_FIND_LINKS).
"""

from __future__ import annotations

import hashlib
import os
import subprocess
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

REPOSITORY = Path(__file__).resolve().parents[1]
TABLE = REPOSITORY / "tools" / "wheels.sha256"
FOLDER = REPOSITORY / "wheels"
#: of Blender 5.2, for packages that accept any Python 3
PYTHON = "3.13"
PARALLEL_DOWNLOADS = 4


class FetchError(Exception):
    """A wheel could not be fetched; the message names a remedy."""


def pinned_wheels(table: Path = TABLE) -> dict[str, str]:
    """File name -> its SHA-256."""
    lines = [line.split() for line in table.read_text(encoding="utf-8").splitlines() if line]
    return {name: digest for digest, name in lines}


def is_downloaded(path: Path, digest: str) -> bool:
    return path.is_file() and hashlib.sha256(path.read_bytes()).hexdigest() == digest


def pip_options(name: str) -> list[str]:
    """pip's options for this wheel, instead of the one for the machine it runs on."""
    _, _, *_, python, abi, platforms = name.removesuffix(".whl").split("-")
    version = python.split(".")[-1][2:]
    options = ["--python-version", version if len(version) > 1 else PYTHON, "--abi", abi]
    for platform in platforms.split("."):
        options += ["--platform", platform]
    return options


def fetch(name: str, digest: str, folder: Path = FOLDER) -> None:
    """Fetch a wheel; raises FetchError if pip cannot get it, OSError if it cannot be written."""
    package, version, *_ = name.split("-")
    folder.mkdir(exist_ok=True)
    with tempfile.TemporaryDirectory(dir=folder) as temporary:
        pinned = Path(temporary) / "requirements.txt"
        pinned.write_text(f"{package}=={version} --hash=sha256:{digest}\n", encoding="utf-8")
        pip = [sys.executable, "-m", "pip", "download", "--quiet", "--disable-pip-version-check"]
        options = ["--no-deps", "--only-binary", ":all:", "--require-hashes", *pip_options(name)]
        result = subprocess.run(
            [*pip, *options, "--dest", temporary, "--requirement", str(pinned)],
            capture_output=True,
            text=True,
        )
        downloaded = Path(temporary) / name
        if result.returncode or not is_downloaded(downloaded, digest):
            reasons = (result.stderr or result.stdout).strip().splitlines() or ["no reason given"]
            raise FetchError(
                f"{name} cannot be fetched ({reasons[-1]}): check the network, or name your "
                f"package index in PIP_INDEX_URL, or put the file into {folder} yourself"
            )
        os.replace(downloaded, folder / name)


def main() -> int:
    missing = {n: d for n, d in pinned_wheels().items() if not is_downloaded(FOLDER / n, d)}

    def fetched(name: str) -> bool:
        print(f"fetch_wheels: {name}", flush=True)
        try:
            fetch(name, missing[name])
        except (FetchError, OSError) as error:
            print(f"fetch_wheels: {error}", file=sys.stderr)
            return False
        return True

    # threads, as the network takes the time
    with ThreadPoolExecutor(PARALLEL_DOWNLOADS) as pool:
        return 0 if all(list(pool.map(fetched, missing))) else 1


if __name__ == "__main__":
    sys.exit(main())
