"""Makes this repository importable as the package `hairloom`, whatever its folder is called.

Blender gives an installed extension a package name of its own; outside Blender's extension manager
the tests, the benchmarks and the tools import it under this one. Neither the root package nor
`hairloom.addon` touches bpy, so the pure rooms stay importable in plain Python.
"""

import importlib.util
import sys
from pathlib import Path
from types import ModuleType

REPOSITORY = Path(__file__).resolve().parents[1]
PACKAGE = "hairloom"


def load_package() -> ModuleType:
    """The package `hairloom`, loaded from this repository on the first call."""
    if PACKAGE in sys.modules:
        return sys.modules[PACKAGE]
    spec = importlib.util.spec_from_file_location(
        PACKAGE, REPOSITORY / "__init__.py", submodule_search_locations=[str(REPOSITORY)]
    )
    assert spec is not None and spec.loader is not None
    package = importlib.util.module_from_spec(spec)
    sys.modules[PACKAGE] = package
    try:
        spec.loader.exec_module(package)
    except BaseException:
        del sys.modules[PACKAGE]
        raise
    return package
