"""Every module of the extension can be imported in the current Blender."""

import importlib
import pkgutil

import pytest

from hairloom import addon

pytestmark = pytest.mark.portable


def test_every_module_is_imported():
    names = [each.name for each in pkgutil.walk_packages(addon.__path__, f"{addon.__name__}.")]
    assert len(names) > 300
    for name in names:
        importlib.import_module(name)
