"""Where the curves of strands are on the GPU, as all programs that draw them take it."""

from __future__ import annotations

from typing import Any

from .shader_feature import ShaderFeature
from .strand_layout import StrandLayout, strand_rows
from .textures import texture_from


def curves_feature(cv_points: Any, strand_spans: Any, cv_looks: Any = None) -> ShaderFeature:
    """What all programs that draw curves have.

    Args:
        cv_points, strand_spans, cv_looks: textures, see strand_pass.py. The last one only where
            points are unevenly spaced, so that they say themselves how far along they are.
    """
    textures = {"cv_points": ("FLOAT_2D", cv_points), "strand_spans": ("FLOAT_2D", strand_spans)}
    if cv_looks is None:
        return ShaderFeature(textures=textures)
    textures["cv_looks"] = ("FLOAT_2D", cv_looks)
    return ShaderFeature(name="uneven", textures=textures, defines={"UNEVEN": 1})


def spans_texture(layout: StrandLayout) -> Any:
    """The texture strand_spans."""
    return texture_from(strand_rows(layout.spans[:, None]), "RGBA32F")
