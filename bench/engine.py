"""The render engine: noise and reproducibility of stills, and growth of time and memory in
animations.

See the modules `_engine_...` for what is compared with what. The reference of stills is the same
scene at 1,024 samples. Limits are twice the values measured when they were set.

make bench NAME=engine          some minutes
tools/bench.py engine picture        some parts: picture, skin, shafts, frames
"""

from __future__ import annotations

import sys

from _engine_frames import frame_figures
from _engine_picture import picture_figures
from _engine_shafts import shafts_figures
from _engine_skin import skin_figures
from _report import measured, report, start

REFERENCE = "the same scene at 1,024 samples; another process; the tenth frame"
#: wrong coordinates show other parts of the picture, with a difference near 1
MAX_LIMITS = {"polar_difference": 0.006}
PARTS = {
    "picture": picture_figures,
    "skin": skin_figures,
    "shafts": shafts_figures,
    "frames": frame_figures,
}


def main(names: list[str]) -> int:
    start()
    found = measured(PARTS, names)
    return report(found, REFERENCE, max_limits=MAX_LIMITS)


sys.exit(main(sys.argv[1:]))
