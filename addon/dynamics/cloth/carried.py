"""The path on which the animation carries cloth within a frame."""

from __future__ import annotations

import numpy as np

from ...arrays import Floats
from ..frame import Drive
from ..rigid_path import CarriedPath, Carrier
from .state import Fabric, vertex_rows

#: Approximate number of pinned vertices from which the cloth's rotation is computed.
MAX_ROTATION_VERTICES = 256


def pinned_path(fabric: Fabric, drive: Drive, origin: Floats) -> CarriedPath:
    """The path of all vertices (3, n) as the animation carries them, float32 [m] from `origin`.

    Arcs follow the rotation of the pinned vertices as a whole, as of the body they are pinned to.
    """
    rows = [
        None if target is None else vertex_rows(target) - origin
        for target in (drive.target_before, drive.target_now, drive.target_earlier)
    ]
    pinned = np.flatnonzero(fabric.pinned)
    pinned = pinned[:: max(len(pinned) // MAX_ROTATION_VERTICES, 1)]
    before, now, earlier = (None if one is None else one[:, pinned] for one in rows)
    assert before is not None and now is not None
    carrier = Carrier.through(before, now, earlier, drive.earlier_ratio)
    before, now, earlier = rows
    assert before is not None and now is not None
    arc = carrier if carrier.path.is_arc else None
    return CarriedPath.through(before, now, earlier, drive.earlier_ratio, arc).as_floats()
