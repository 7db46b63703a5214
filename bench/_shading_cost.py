"""What shading costs: a frame under either model, and a slider that moves.

Sintel's 11,400 strands under three lights (see _refinement_views). All rounds are interleaved, so
that load on the machine affects all variants alike.
"""

from __future__ import annotations

import statistics
import time
from collections.abc import Iterator
from dataclasses import replace

from _refinement_views import HEIGHT, WIDTH, Target, groom

from hairloom.addon.refine.settings import DetailSettings
from hairloom.addon.render.camera import Camera
from hairloom.addon.render.marschner_textures import MARSCHNER
from hairloom.addon.render.snapshot import Snapshot
from hairloom.addon.render.strand_layout import StrandLayout
from hairloom.addon.render.strand_pass import StrandPass
from hairloom.addon.shading.lights import three_point_lights
from hairloom.addon.shading.marschner.tables import DEFAULT_SIZE, PREVIEW_SIZE
from hairloom.addon.shading.settings import ShadingSettings

ROUNDS = 15
#: strands, and pixels along a side, where only the draw call is timed
FEW = 64
MARSCHNER_LOOK = ShadingSettings(model="marschner")


def cost_figures() -> dict[str, float]:
    """The figures by name.

    frame_ratio_models: time of a frame with Marschner over that with Kajiya-Kay.
    slider_colour_ms, slider_shape_ms: how much longer a draw call computes after a change of
        colour, and of the fibre's shape, with tables of the preview's size.
    refine_ms: the same for a shape, with tables of the size at rest.
    """
    shown = groom()
    camera = shown.camera()
    snapshot = shown.snapshot(DetailSettings(), lights=three_point_lights(camera.view))
    return {
        "frame_ratio_models": frame_ratio(snapshot, camera),
        "slider_colour_ms": delay_ms(snapshot, camera, _colors(), PREVIEW_SIZE),
        "slider_shape_ms": delay_ms(snapshot, camera, _shapes(), PREVIEW_SIZE),
        "refine_ms": delay_ms(snapshot, camera, _shapes(), DEFAULT_SIZE),
    }


def frame_ratio(snapshot: Snapshot, camera: Camera) -> float:
    """The ratio of median times, each until a pixel can be read back."""
    target, drawn = Target(WIDTH, HEIGHT), StrandPass()
    looks = [replace(snapshot, shading=look) for look in (MARSCHNER_LOOK, ShadingSettings())]
    times: list[list[float]] = [[], []]
    for _ in range(ROUNDS + 1):
        for look, own in zip(looks, times, strict=True):
            own.append(target.timed(lambda s=look: drawn.draw(s, camera, WIDTH, HEIGHT)))
    marschner, kajiya_kay = (statistics.median(own[1:]) for own in times)
    return marschner / kajiya_kay


def delay_ms(
    snapshot: Snapshot, camera: Camera, changes: Iterator[ShadingSettings], size: int
) -> float:
    """The median time that a draw call takes longer after a change than without one.

    Measured in the calling thread's processor time, which other programs do not affect, and with
    few strands, as the tables do not depend on their number.
    """
    cvs = snapshot.layout.cv_count
    few = replace(
        snapshot,
        points=snapshot.points[: FEW * cvs],
        radius=snapshot.radius[: FEW * cvs],
        layout=StrandLayout.uniform(FEW, cvs),
    )
    target, drawn = Target(FEW, FEW), StrandPass()
    MARSCHNER.release()

    def call_ms(shading: ShadingSettings) -> float:
        """The draw call's own time; the wait for the GPU is not timed."""
        shown = replace(few, shading=shading, table_size=size)
        took = 0.0

        def draw() -> None:
            nonlocal took
            begin = time.thread_time()
            drawn.draw(shown, camera, FEW, FEW)
            took = (time.thread_time() - begin) * 1000.0

        target.timed(draw)
        return took

    call_ms(MARSCHNER_LOOK)
    return statistics.median(call_ms(shading) - call_ms(shading) for shading in changes)


def _colors() -> Iterator[ShadingSettings]:
    for step in range(ROUNDS):
        yield replace(MARSCHNER_LOOK, base_color=(0.02 + 0.03 * step, 0.1, 0.05))


def _shapes() -> Iterator[ShadingSettings]:
    for step in range(ROUNDS):
        yield replace(MARSCHNER_LOOK, width_r=0.05 + 0.01 * step)
