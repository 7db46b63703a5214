"""Luminance of scene-linear Rec. 709. Twin of gpu_shaders/lib_bright.glsl."""

from __future__ import annotations

import numpy as np

LUMINANCE = np.array([0.2126, 0.7152, 0.0722], np.float32)
