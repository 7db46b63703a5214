"""The distance field of the built-in head, shipped so that the first preview need not build it.

`tools/make_bust_field.py` writes the file, with the key of its mesh. So a head that is moved,
shaped or subdivided in another way gets a field of its own.
"""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np

from ...dynamics.colliders import DistanceField
from ...strands import Surface

FILE = Path(__file__).with_name("bust_field.npz")


def shipped_field(surface: Surface, key: str) -> DistanceField | None:
    """The shipped field if it is that of this surface, else None.

    Args:
        key: of the surface and its resolution, see `fields`.
    """
    shipped = _read()
    if key != str(shipped["key"]):
        return None
    return DistanceField(shipped["values"], shipped["low"], float(shipped["cell"]), surface=surface)


@cache
def _read() -> dict[str, np.ndarray]:
    with np.load(FILE, allow_pickle=False) as file:
        return {name: file[name] for name in file.files}
