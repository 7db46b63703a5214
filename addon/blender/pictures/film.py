"""Pictures of the studio as files, through Blender's view transforms."""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np

from ...arrays import Floats
from ...errors import HairloomError
from ...shading.stage_settings import StageSettings
from ..base.images import straight_alpha, write_encoded_png
from ..viewport.view_transform import ColorView, apply_view_transform

#: choice of `StageSettings.view` -> Blender's names of view transform and look
_TRANSFORMS = {
    "agx": ("AgX", "None"),
    "agx_contrast": ("AgX", "AgX - Medium High Contrast"),
    "filmic": ("Filmic", "None"),
    "standard": ("Standard", "None"),
}


def write_picture(path: Path, linear: Floats, stage: StageSettings) -> None:
    """Write a picture through this stage's film settings, as 8-bit PNG.

    Args:
        linear: (height, width, 4) scene-linear Rec.709, premultiplied alpha, row 0 at the bottom.

    Raises:
        HairloomError: it cannot be written, or this Blender has no such view transform.
    """
    straight = straight_alpha(linear)
    encoded = _display_encoded(straight[..., :3], stage)
    write_encoded_png(path, _dithered(np.concatenate([encoded, straight[..., 3:]], axis=-1)))


def _display_encoded(colors: Floats, stage: StageSettings) -> Floats:
    """Display-encoded values in [0, 1] of scene-linear colours."""
    transform, look = _TRANSFORMS[stage.view]
    view = ColorView(transform=transform, look=look, exposure=stage.exposure)
    try:
        return apply_view_transform(view, colors)
    except TypeError as error:  # this Blender has another OpenColorIO configuration
        raise HairloomError(
            f"this Blender has no view transform '{transform}' with the look '{look}'",
            place="stage.view",
            remedy="Choose another one, such as --set stage.view=standard",
        ) from error
    except (OSError, RuntimeError) as error:
        raise HairloomError(
            "colours cannot be written to the folder for temporary files",
            place=tempfile.gettempdir(),
            remedy="Free some space there, and check that you may write to it",
        ) from error


def _dithered(encoded: Floats) -> Floats:
    """Colours with noise of up to half an 8-bit step, the same in every picture, so that a soft
    backdrop has no bands. Pure black and white stay as they are."""
    noise = np.random.default_rng(0).random((*encoded.shape[:2], 3), np.float32) - 0.5
    dithered = encoded.copy()
    dithered[..., :3] = np.clip(encoded[..., :3] + noise / 255.0, 0.0, 1.0)
    return dithered
