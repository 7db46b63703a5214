"""What all tests share: the package `hairloom`, a GPU context, the real grooms."""

import os
from pathlib import Path
from typing import Any

import pytest
from extension_loader import REPOSITORY, load_package

load_package()


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Of the cases of a test marked `alike`, a commit runs only the first and the last."""
    families: dict[str, list[pytest.Item]] = {}
    for item in items:
        if item.get_closest_marker("alike") and not item.get_closest_marker("slow"):
            families.setdefault(item.nodeid.partition("[")[0], []).append(item)
    for cases in families.values():
        for item in cases[1:-1]:
            item.add_marker(pytest.mark.slow)


@pytest.fixture(scope="session")
def gpu_context() -> Any:
    """Blender's `gpu` module, ready to draw offscreen."""
    pytest.importorskip("bpy", reason="the GPU tests need Blender or the bpy module")
    import gpu

    gpu.init()
    return gpu


@pytest.fixture(scope="session")
def shared_data() -> Path:
    """The folder of the real grooms: HAIRLOOM_DATA, else shared/data beside the repository."""
    folder = Path(os.environ.get("HAIRLOOM_DATA") or REPOSITORY.parent / "shared" / "data")
    if not folder.is_dir():
        pytest.skip(f"the real grooms are not here: no folder {folder}; set HAIRLOOM_DATA")
    return folder
