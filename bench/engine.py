"""The render engine: clean stills, the same everywhere, and animations that do not grow.

See the modules `_engine_...` for what is compared with what. The reference of stills is the same
scene at 1,024 samples.

make bench NAME=engine          some minutes
"""

from __future__ import annotations

import sys
from typing import Any

from _engine_frames import frame_figures
from _engine_picture import picture_figures
from _engine_shafts import shafts_figures
from _engine_skin import skin_figures
from _report import report, start

REFERENCE = "the same scene at 1,024 samples; another process; the tenth frame"


def main() -> int:
    start()
    found: dict[str, Any] = {
        **picture_figures(),
        **skin_figures(),
        **shafts_figures(),
        **frame_figures(),
    }
    return report(found, REFERENCE)


sys.exit(main())
