"""The inputs, on the GPU, of all programs that draw the curves of strands."""

from __future__ import annotations

from typing import Any

from .shader_feature import ShaderFeature
from .strand_layout import StrandLayout, strand_rows
from .textures import texture_from


def curves_feature(cv_points: Any, strand_spans: Any, cv_attributes: Any = None) -> ShaderFeature:
    """The feature of all programs that draw curves.

    Args:
        cv_points, strand_spans, cv_attributes: textures, see strand_pass.py. cv_attributes only if
            points are unevenly spaced, since it stores their positions along the strand.
    """
    textures = {"cv_points": ("FLOAT_2D", cv_points), "strand_spans": ("FLOAT_2D", strand_spans)}
    if cv_attributes is None:
        return ShaderFeature(textures=textures)
    textures["cv_attributes"] = ("FLOAT_2D", cv_attributes)
    return ShaderFeature(name="uneven", textures=textures, defines={"UNEVEN": 1})


def spans_texture(layout: StrandLayout) -> Any:
    """The texture strand_spans."""
    return texture_from(strand_rows(layout.spans[:, None]), "RGBA32F")
