"""Moves strands to where ties and surfaces hold them, on the GPU: `refine.hold.hold_strands` after
RidePass, on textures in the layouts of `strand_layout`.

    rest_points   RGBA32F: xyz position at rest [m, world]
    strand_spans  RGBA32F: the points of each strand, see strand_layout.StrandLayout
    held_strands  RGBA32F: x a strand that is held, y its first hold, z number of its holds
    holds         RG32F: x place in CVs, y anchor
    anchors       RGBA32F: three texels each, rows of the matrix from world at rest to world now
    cv_points     RGBA32F: xyz position now [m, world], changed in place
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ..arrays import Floats
from ..groom.holds import Holds
from .shader_program import ShaderRecipe, program
from .strand_layout import StrandLayout, strand_rows
from .textures import texture_from

HOLD_RECIPE = ShaderRecipe(
    name="hold",
    compute="hold.comp.glsl",
    textures=(
        ("FLOAT_2D", "rest_points"),
        ("FLOAT_2D", "strand_spans"),
        ("FLOAT_2D", "held_strands"),
        ("FLOAT_2D", "holds"),
        ("FLOAT_2D", "anchors"),
    ),
    images=(("RGBA32F", "cv_points", "READ_WRITE"),),
    integers=("held_count",),
    group_size=(64, 1),
)


class HoldPass:
    """The holds of one groom on the GPU. Creating one does not touch the GPU; `hold` does.

    Args:
        holds: of all strands.
        layout: of rest_points and cv_points.
    """

    def __init__(self, holds: Holds, layout: StrandLayout) -> None:
        self._all, self._layout = holds, layout
        self.release()

    def release(self) -> None:
        """Release everything on the GPU."""
        self._known: Holds | None = None
        self._textures: dict[str, Any] = {}

    def hold(self, cv_points: Any, rest_points: Any, anchors: Floats | None) -> None:
        """Move the strands in a texture to where they are held.

        Args:
            anchors: see `groom.holds.anchors_of`; None: nothing is held.

        Raises:
            ShaderError: the shader does not compile here.
        """
        holds = self._all.where(anchors)
        if anchors is None or not len(holds.strand):
            return
        if holds is not self._known:
            self._upload(holds)
        anchor_rows = np.nan_to_num(anchors[:, :3])
        textures = {**self._textures, "rest_points": rest_points}
        textures["anchors"] = texture_from(strand_rows(anchor_rows), "RGBA32F")
        count, shader = self._held_count, program(HOLD_RECIPE)
        shader.bind(
            textures=textures,
            images={"cv_points": cv_points},
            integers={"held_count": count},
        )
        shader.dispatch(count)

    def _upload(self, holds: Holds) -> None:
        strand, first, count = np.unique(holds.strand, return_index=True, return_counts=True)
        held = np.zeros((len(strand), 1, 4), np.float32)
        held[:, 0, :3] = np.stack([strand, first, count], axis=1)
        table = np.stack([holds.place, holds.anchor], axis=1).astype(np.float32)[:, None]
        self._known, self._held_count = holds, len(strand)
        spans = strand_rows(self._layout.spans[:, None])
        self._textures = {
            "strand_spans": texture_from(spans, "RGBA32F"),
            "held_strands": texture_from(strand_rows(held), "RGBA32F"),
            "holds": texture_from(strand_rows(table), "RG32F"),
        }
