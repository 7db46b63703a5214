"""The three.js module of docs/engines, in Node.js: everything that needs no browser."""

from __future__ import annotations

import json
import shutil
import subprocess
from pathlib import Path
from typing import Any

import pytest
from extension_loader import REPOSITORY
from programs import node_or_skip

MODULES = REPOSITORY / "tools" / "node" / "node_modules"
#: address -> the file's name
ADDRESSES = {
    "Zöpfe.glb": "Zöpfe",
    "a/Z%C3%B6pfe.glb?v=3": "Zöpfe",
    "100%25%20%23hair.GLB#top": "100% #hair",
}


@pytest.fixture(scope="module")
def found(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    """The output of three_module.mjs."""
    if not (MODULES / "three").is_dir():
        pytest.skip("three.js is missing: `make setup` installs it")
    folder = tmp_path_factory.mktemp("module")
    shutil.copytree(REPOSITORY / "docs" / "engines" / "three", folder, dirs_exist_ok=True)
    shutil.copy2(Path(__file__).with_name("three_module.mjs"), folder)
    (folder / "node_modules").symlink_to(MODULES)
    command = [node_or_skip(), str(folder / "three_module.mjs"), json.dumps(list(ADDRESSES))]
    result = subprocess.run(command, capture_output=True, text=True, timeout=120)
    assert result.returncode == 0, result.stderr
    printed: dict[str, Any] = json.loads(result.stdout)
    return printed


@pytest.mark.parametrize("camera", ["near", "eye", "mirror"])
def test_a_level_has_the_pixels_of_the_camera_that_draws_it(
    found: dict[str, Any], camera: str
) -> None:
    """Also after a mirror has drawn the scene from elsewhere; an eye uses its headset's pixels."""
    assert found["parts"][camera] == [0, 1]


def test_an_address_names_its_files_with_or_without_escapes(found: dict[str, Any]) -> None:
    for (address, name), files in zip(ADDRESSES.items(), found["asked"], strict=True):
        ending = ".GLB" if "GLB" in address else ".glb"
        assert set(files) == {f"{name}.hairloom.json", name + ending}, address
