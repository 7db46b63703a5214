"""Where the animation carries cloth within a frame."""

from __future__ import annotations

import numpy as np

from ...arrays import Floats
from ..frame import Drive
from ..rigid_path import CarriedPath, Carrier
from .state import Fabric, vertex_rows

#: Pinned vertices, about, that tell how cloth turns as a whole.
TURNED_BY = 256


def pinned_path(fabric: Fabric, drive: Drive, origin: Floats) -> CarriedPath:
    """The way of all vertices (3, n) as the animation carries them, float32 [m] from `origin`.

    They turn as the pinned ones do as a whole, as what these are pinned to.
    """
    rows = [
        None if target is None else vertex_rows(target) - origin
        for target in (drive.target_before, drive.target_now, drive.target_earlier)
    ]
    pinned = np.flatnonzero(fabric.pinned)
    pinned = pinned[:: max(len(pinned) // TURNED_BY, 1)]
    before, now, earlier = (None if one is None else one[:, pinned] for one in rows)
    assert before is not None and now is not None
    carrier = Carrier.through(before, now, earlier, drive.earlier_ratio)
    before, now, earlier = rows
    assert before is not None and now is not None
    arc = carrier if carrier.path.is_arc else None
    return CarriedPath.through(before, now, earlier, drive.earlier_ratio, arc).as_floats()
