"""Programs that tests run and `make setup` installs."""

from __future__ import annotations

import pytest
from three_springs import node_program


def node_or_skip() -> str:
    """Path of Node; the test is skipped where there is none, as in Blender's own Python."""
    try:
        return node_program()
    except FileNotFoundError as error:
        pytest.skip(str(error))
