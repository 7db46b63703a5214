"""The work of the GPU in frames of the preview, and the work that is reused.

Grown hair on Suzanne's head in a studio's light, as a view in Solid shows it, at 320 x 240.
Variants take turns; a time is the minimum over ROUNDS, until the GPU is done. A software driver is
timed by processor time, which other load does not change.

make bench NAME=frames          two minutes; exits with an error beyond a limit
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import count
from typing import Any

import numpy as np
from _report import report, start
from _suzanne import suzanne
from _volume_transparency import _target
from gpu_calls import gpu_calls

from hairloom.addon.groom.grow import grow
from hairloom.addon.groom.scalp import scalp_density
from hairloom.addon.groom.settings import GrowSettings
from hairloom.addon.render.cached_picture import CachedPicture
from hairloom.addon.render.camera import Camera, frame_camera
from hairloom.addon.render.groom_pass import GroomPass
from hairloom.addon.render.opacity_maps import OpacityMaps
from hairloom.addon.render.snapshot import Snapshot
from hairloom.addon.render.strand_layers import is_software
from hairloom.addon.render.strand_pass import StrandPass, ViewState
from hairloom.addon.render.textures import drawing_into
from hairloom.addon.shading.lights import three_point_lights
from hairloom.addon.strands import StrandSet

REFERENCE = "the same view drawn afresh, drawn as at rest, one view"
STRANDS, WIDTH, HEIGHT, ROUNDS = 3000, 320, 240, 7
#: turn of a view from frame to frame [rad]
TURN = float(np.radians(1.5))
#: figure -> upper limit
MAX_LIMITS = {
    "readbacks_per_frame": 0,
    "playing_ratio": 1.2,
    "still_readbacks": 0,
    "still_view_ratio": 0.1,
    "orbit_solid_ratio": 0.6,
    "two_views_ratio": 2.1,
    "draws_per_groom": 40,
    "grooms_2_ratio": 1.2,
    "grooms_4_ratio": 1.3,
}


def main() -> int:
    start()
    stage = Stage.of_suzanne()
    found = {
        **stage.call_figures(),
        **stage.playing_figures(),
        **stage.still_figures(),
        **stage.orbit_figures(),
        **stage.two_view_figures(),
        **stage.groom_figures(),
    }
    return report(found, REFERENCE, max_limits=MAX_LIMITS)


@dataclass(eq=False)
class Stage:
    """Hair, and a target into which views of it are drawn."""

    strands: StrandSet
    target: Any
    color: Any
    numbers: Iterator[int] = field(default_factory=count)

    @classmethod
    def of_suzanne(cls) -> Stage:
        head = suzanne()
        strands = grow(head, GrowSettings(strand_count=STRANDS), scalp_density(head))
        return cls(strands, *_target(WIDTH, HEIGHT))

    def hair(self) -> Snapshot:
        """The hair, moved a little, so that nothing that depends on its position is reused."""
        moved = self.strands.points + np.float32(1.0e-4 * next(self.numbers))
        return Snapshot(
            moved.reshape(self.strands.grid.shape), self.strands.radius.reshape(STRANDS, -1)
        )

    def camera(self, angle: float) -> Camera:
        direction = float(np.sin(angle)), -float(np.cos(angle)), 0.2
        return frame_camera(self.strands.bounds(), direction, 0.5, WIDTH / HEIGHT)

    def draw(
        self,
        own: StrandPass,
        hair: Snapshot,
        angle: float,
        others: Sequence[OpacityMaps] = (),
        **options: Any,
    ) -> None:
        camera, view = self.camera(angle), ViewState(**{"name": 0} | options)
        lit = replace(hair, lights=three_point_lights(camera.view))
        shown = {"output": "viewport", "other_maps": others, "view": view}
        self.put(lambda: own.draw(lit, camera, WIDTH, HEIGHT, **shown))

    def put(self, draw: Callable[[], None]) -> None:
        with drawing_into(self.target):
            self.target.clear(color=(0.0, 0.0, 0.0, 0.0), depth=1.0)
            draw()

    def took(self, draw: Callable[[], None]) -> float:
        """Seconds until the GPU is done."""
        clock = time.process_time if is_software() else time.perf_counter
        self.color.read()
        begin = clock()
        draw()
        self.color.read()
        return clock() - begin

    def call_figures(self) -> dict[str, float]:
        """GPU calls of a frame that plays, and of one whose view turns."""
        own, hair, moving = StrandPass(), self.hair(), {"is_moving": True}
        self.draw(own, hair, 0.0)
        playing = gpu_calls(lambda: self.draw(own, self.hair(), 0.0, **moving))
        turning = gpu_calls(lambda: self.draw(own, hair, TURN, is_turning=True, **moving))
        return {
            "readbacks_per_frame": max(playing["reads"], turning["reads"]),
            "draws_per_groom": playing["draws"],
            "dispatches_per_groom": playing["dispatches"],
        }

    def playing_figures(self) -> dict[str, float]:
        """Hair that plays, relative to the same drawn as if at rest."""
        exact, moving = StrandPass(), StrandPass()
        for own in (exact, moving):
            self.draw(own, self.hair(), 0.0)
        in_rest, in_motion = self.least(
            lambda: self.draw(exact, self.hair(), 0.0),
            lambda: self.draw(moving, self.hair(), 0.0, is_moving=True),
        )
        return {"playing_ratio": in_motion / in_rest}

    def still_figures(self) -> dict[str, float]:
        """An unchanged view shown from its kept picture, relative to drawing it again."""
        own, hair, kept_picture = StrandPass(), self.hair(), CachedPicture()

        def keep() -> None:
            kept_picture.begin()
            own.draw(
                lit, camera, WIDTH, HEIGHT, output="viewport", view=ViewState(picture=kept_picture)
            )

        camera = self.camera(0.0)
        lit = replace(hair, lights=three_point_lights(camera.view))
        self.put(keep)
        calls = gpu_calls(lambda: self.put(kept_picture.show))
        afresh, again = self.least(
            lambda: self.draw(own, hair, 0.0), lambda: self.put(kept_picture.show)
        )
        return {
            "still_readbacks": calls["reads"],
            "still_draws": calls["draws"],
            "still_view_ms": 1000.0 * again,
            "still_view_afresh_ms": 1000.0 * afresh,
            "still_view_ratio": again / afresh,
        }

    def orbit_figures(self) -> dict[str, float]:
        """A view that turns in Solid, relative to one drawn in each frame as at rest."""
        hair, all_maps, few_maps = self.hair(), StrandPass(), StrandPass()
        angles = np.arange(2 * ROUNDS + 2) * TURN
        for own in (all_maps, few_maps):
            self.draw(own, hair, 0.0)
        times: tuple[list[float], list[float]] = [], []
        for angle in angles[1:].tolist():
            for own, is_turning, frame_times in (
                (all_maps, False, times[0]),
                (few_maps, True, times[1]),
            ):
                frame_times.append(
                    self.took(
                        lambda o=own, a=angle, t=is_turning: self.draw(
                            o, hair, a, is_turning=t, is_moving=t
                        )
                    )
                )
        # some frames draw a map and some do not: average over the middle half
        middle = [float(np.mean(np.sort(each)[ROUNDS // 2 : -ROUNDS // 2])) for each in times]
        return {"orbit_solid_ms": 1000.0 * middle[1], "orbit_solid_ratio": middle[1] / middle[0]}

    def two_view_figures(self) -> dict[str, float]:
        """Hair that plays in two views, relative to one."""
        alone, both = StrandPass(), StrandPass()

        def one() -> None:
            self.draw(alone, self.hair(), 0.0, name="a", is_moving=True)

        def two() -> None:
            hair = self.hair()
            self.draw(both, hair, 0.0, name="a", is_moving=True)
            self.draw(both, hair, 0.0 + TURN, name="b", is_moving=True)

        in_one, in_two = self.least(one, two)
        return {"two_views_ratio": in_two / in_one}

    def groom_figures(self) -> dict[str, float]:
        """Two and four grooms that play in one place and shade each other, relative to the same
        grooms shading only themselves."""
        found: dict[str, float] = {}
        for number in (2, 4):
            kinds = [[GroomPass() for _ in range(number)] for _ in range(2)]
            alone, shared = self.least(
                *(
                    partial(self._draw_grooms, kind, is_shared)
                    for kind, is_shared in zip(kinds, (False, True), strict=True)
                )
            )
            found |= {
                f"grooms_{number}_ms": 1000.0 * shared,
                f"grooms_{number}_ratio": shared / alone,
            }
        return found

    def _draw_grooms(self, passes: list[GroomPass], is_shared: bool) -> None:
        camera = self.camera(0.0)
        lights = three_point_lights(camera.view)
        hair = [replace(self.hair(), lights=lights) for _ in passes]
        maps = {
            index: own.maps(each, view=0)
            for index, (own, each) in enumerate(zip(passes, hair, strict=True))
            if is_shared
        }
        for index, (own, each) in enumerate(zip(passes, hair, strict=True)):
            others = own.other_maps(index, each, maps)
            self.draw(own.strands, each, 0.0, others=others, is_moving=True)

    def least(self, *works: Callable[[], None]) -> list[float]:
        """Seconds of each: the minimum over rounds in which they take turns, without the first
        round."""
        rounds = [[self.took(work) for work in works] for _ in range(ROUNDS + 1)]
        return np.min(rounds[1:], axis=0).tolist()


if __name__ == "__main__":
    sys.exit(main())
