"""Hair in a viewport smaller than its target stays in it, whatever is drawn in between."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from tiers import few_in_commits

from hairloom.addon.refine.settings import DetailSettings
from hairloom.addon.render.camera import Camera, look_at, perspective
from hairloom.addon.render.snapshot import Snapshot
from hairloom.addon.shading.lights import three_point_lights
from hairloom.addon.shading.settings import StrandSettings

pytestmark = pytest.mark.usefixtures("gpu_context")

#: size of the target, and the viewport in it: left, bottom, width, height
SIZE, VIEWPORT = (90, 70), (13, 7, 48, 40)
BACKGROUND = (0.2, 0.1, 0.0, 0.3)


@pytest.mark.parametrize(
    ("transparency", "keeps"),
    few_in_commits(
        [
            pytest.param("layers", True, id="layers, kept"),
            pytest.param("hashed", False, id="hashed"),
            pytest.param("layers", False, id="layers"),
            pytest.param("none", False, id="none"),
        ],
        2,
    ),
)
def test_hair_stays_in_its_viewport(frame: Any, transparency: str, keeps: bool) -> None:
    """With shadow maps, which have their own targets, while the view moves, rests and is shown
    again. Strands extend far beyond the viewport on all sides.
    """
    import gpu

    from hairloom.addon.render.cached_picture import CachedPicture
    from hairloom.addon.render.strand_pass import ViewState
    from hairloom.addon.render.textures import drawing_into

    left, bottom, width, height = VIEWPORT
    random = np.random.default_rng(4)
    ends = random.uniform(-2.0, 2.0, (300, 2, 3)).astype(np.float32)
    camera = Camera(
        look_at((0.0, -3.0, 0.0), (0, 0, 0)),
        perspective(0.5, width / height, 0.1, 9.0),
    )
    groom = Snapshot(
        ends,
        np.full((300, 2), 4e-3, np.float32),
        lights=three_point_lights(camera.view),
        strand_settings=StrandSettings(transparency=transparency),
        detail=DetailSettings(lod_size=0.0),
    )
    color = gpu.types.GPUTexture(SIZE, format="RGBA32F")
    depth = gpu.types.GPUTexture(SIZE, format="DEPTH_COMPONENT32F")
    target = gpu.types.GPUFrameBuffer(depth_slot=depth, color_slots=(color,))
    own, kept = frame.StrandPass(), CachedPicture()
    inside = np.zeros((SIZE[1], SIZE[0]), bool)
    inside[bottom : bottom + height, left : left + width] = True

    def draw(is_moving: bool) -> None:
        picture = kept if keeps else None
        if picture is not None:
            picture.begin()
        view = ViewState(1, is_moving=is_moving, picture=picture)
        own.draw(groom, camera, width, height, output="viewport", view=view)

    for step in ("rests", "moves", "shown again"):
        with drawing_into(target):
            target.clear(color=BACKGROUND, depth=1.0)
            gpu.state.viewport_set(*VIEWPORT)
            if step == "shown again" and keeps:
                kept.show()
            else:
                draw(step == "moves")
            assert tuple(gpu.state.viewport_get()) == VIEWPORT
        pixels = np.asarray(color.read()).reshape(SIZE[1], SIZE[0], 4)
        depths = np.asarray(depth.read()).reshape(SIZE[1], SIZE[0])
        outside = np.abs(pixels[~inside] - BACKGROUND).max()
        assert outside < 1e-6 and (depths[~inside] == 1.0).all(), step
        is_hair = (np.abs(pixels - BACKGROUND) > 0.01).any(axis=-1)
        for part in np.array_split(is_hair[bottom : bottom + height, left : left + width], 4):
            assert part.any(), step
