"""The sandbox in which the engines run."""

from __future__ import annotations

import subprocess

import pytest
from extension_loader import REPOSITORY

SANDBOX = str(REPOSITORY / "tools" / "window_blender")


@pytest.fixture(scope="module")
def sandbox() -> str:
    """The program that runs a command in the sandbox with the engines."""
    result = subprocess.run([SANDBOX, "engines"], capture_output=True, text=True)
    if result.returncode == 77:
        pytest.skip(result.stderr.strip().splitlines()[-1])
    assert result.returncode == 0, result.stderr
    return SANDBOX
