"""Builds the zips of the extension, one for each build of Blender with the wheels that fit it.

python tools/make_zips.py dist            as artists get them
python tools/make_zips.py dist --quick    with wheels as they were fetched, much sooner

Blender's own packager makes one zip of everything, and separates wheels by platform alone. Official
builds of Blender have one Python, those of Linux distributions may have a newer one, so each gets
its own, smaller zip (docs/dev/decisions.md, 148 and 338).
"""

from __future__ import annotations

import hashlib
import importlib.util
import io
import os
import re
import subprocess
import sys
import tempfile
import zipfile
from concurrent.futures import ThreadPoolExecutor
from importlib.machinery import SourceFileLoader
from pathlib import Path
from typing import Any

from make_help import fresh_help

REPOSITORY = Path(__file__).resolve().parents[1]
MANIFEST = "blender_manifest.toml"
#: Blender's names for systems, and the Pythons that it is built with there; official builds first
OFFICIAL = (3, 13)
BUILDS = [
    ("linux-x64", OFFICIAL),
    ("windows-x64", OFFICIAL),
    ("macos-arm64", OFFICIAL),
    ("linux-x64", (3, 14)),
]
#: large wheels are packed by LZMA on this system, where Blender's Python has it; least bytes
LZMA_SYSTEM, LZMA_BYTES = "linux-x64", 10_000_000
#: the wheels packed by LZMA, which takes 20 s each
PACKED = REPOSITORY / "out" / "wheels"


def extension_tool() -> Path:
    """Blender's packager, as it comes with the module bpy."""
    (spec,) = importlib.util.find_spec("bpy").submodule_search_locations
    return next(Path(spec).glob("*/scripts/addons_core/bl_pkg/cli/blender_ext.py"))


def packager() -> Any:
    """The same as a module, which decides which wheels fit."""
    loader = SourceFileLoader("blender_ext", str(extension_tool()))
    module = importlib.util.module_from_spec(importlib.util.spec_from_loader(loader.name, loader))
    sys.modules[loader.name] = module
    loader.exec_module(module)
    return module


def wheels_for(wheels: list[str], system: str, python: tuple[int, int]) -> list[str]:
    """The wheels, by file name, that a build of Blender can use."""
    tool = packager()

    def is_compatible(name: str) -> bool:
        tags = name.removesuffix(".whl").split("-")[-3:]
        versions = tool.python_versions_from_wheel_python_tag(tags[0])
        stable = tool.python_versions_from_wheel_abi_tag(tags[1], stable_only=True)
        return python in versions or (python[0],) in versions | stable

    return [n for n in tool.paths_filter_wheels_by_platform(wheels, system) if is_compatible(n)]


def manifest_for(manifest: str, system: str, wheels: list[str]) -> str:
    """The manifest of a zip for one system, with these wheels."""
    lines = "".join(f'  "./wheels/{name}",\n' for name in wheels)
    replacement = f'platforms = ["{system}"]\nwheels = [\n{lines}]\n'
    changed, count = re.subn(r"^wheels = \[\n.*?^\]\n", replacement, manifest, flags=re.M | re.S)
    assert count == 1, "the manifest has one list of wheels"
    return changed


def recompressed(wheel: bytes) -> bytes:
    """A wheel of the same files, packed by LZMA.

    alembic3d's largest library for Linux holds the table of its symbols three times, too far apart
    for Deflate: its wheel shrinks from 13.0 MB to 8.0.
    """
    cached = PACKED / f"{hashlib.sha256(wheel).hexdigest()}.whl"
    if not cached.is_file():
        packed = io.BytesIO()
        with zipfile.ZipFile(io.BytesIO(wheel)) as old, zipfile.ZipFile(packed, "w") as new:
            for entry in old.infolist():
                new.writestr(entry, old.read(entry), zipfile.ZIP_LZMA)
        cached.parent.mkdir(parents=True, exist_ok=True)
        partial = cached.with_suffix(f".{os.getpid()}")
        partial.write_bytes(packed.getvalue())
        os.replace(partial, cached)
    return cached.read_bytes()


def write_zip(
    whole: Path, folder: Path, system: str, python: tuple[int, int], is_quick: bool = False
) -> Path:
    """Write the zip for one build of Blender, a part of the whole zip."""
    suffix = "" if python == OFFICIAL else f"_python{python[0]}{python[1]}"
    path = folder / f"{whole.stem}-{system.replace('-', '_')}{suffix}.zip"
    partial = path.with_suffix(".part")
    with zipfile.ZipFile(whole) as old, zipfile.ZipFile(partial, "w", zipfile.ZIP_DEFLATED) as new:
        names = [n.removeprefix("wheels/") for n in old.namelist() if n.endswith(".whl")]
        fitting = wheels_for(names, system, python)
        for entry in old.infolist():
            is_wheel = entry.filename.endswith(".whl")
            if is_wheel and entry.filename.rpartition("/")[2] not in fitting:
                continue
            content = old.read(entry)
            if is_quick and is_wheel:
                new.writestr(entry, content, zipfile.ZIP_STORED)
                continue
            if is_wheel and system == LZMA_SYSTEM and len(content) > LZMA_BYTES:
                content = recompressed(content)
            if entry.filename == MANIFEST:
                content = manifest_for(content.decode(), system, fitting).encode()
            # wheels, which Blender's packager only stores, still shrink by a fiftieth
            new.writestr(entry, content, zipfile.ZIP_DEFLATED, compresslevel=9)
    os.replace(partial, path)
    return path


def main(folder: Path, is_quick: bool = False) -> int:
    folder.mkdir(parents=True, exist_ok=True)
    fresh_help()  # it is packed
    with tempfile.TemporaryDirectory() as temporary:
        command = [sys.executable, extension_tool(), "build", "--source-dir", REPOSITORY]
        result = subprocess.run([*map(str, command), "--output-dir", temporary])
        if result.returncode:
            return result.returncode
        (whole,) = Path(temporary).glob("*.zip")
        with ThreadPoolExecutor() as pool:
            for path in pool.map(
                lambda build: write_zip(whole, folder, *build, is_quick=is_quick), BUILDS
            ):
                print(f"{path.name}  {path.stat().st_size / 1e6:.1f} MB")
    return 0


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1]), "--quick" in sys.argv[2:]))
