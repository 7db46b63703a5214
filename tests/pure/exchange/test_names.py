"""Names that every program and file system takes."""

from __future__ import annotations

import pytest

from hairloom.addon.exchange.files.names import plain_name


@pytest.mark.parametrize(
    ("name", "plain"),
    [
        ("Haar/Ä.001", "Haar_Ä_001"),
        ("Haar/A\u0308.001", "Haar_Ä_001"),
        ("髪 1", "髪_1"),
        ("2nd: C:\\hair", "_2nd__C__hair"),
        ("../..", "hair"),
        ("", "hair"),
        ("Hair_LOD0", "Hair_LOD0"),
        ("x²\n\0", "x___"),
    ],
)
def test_names_are_identifiers(name: str, plain: str) -> None:
    assert plain_name(name) == plain
    assert plain_name(name).isidentifier()
