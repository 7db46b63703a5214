"""Refinement in the picture: vertices, errors and times of one groom, whole and close up.

Sintel's 11,400 strands of 16 CVs if the shared data is there, otherwise as many grown on Blender's
monkey. Undivided is one piece per segment; fixed 64, which would be 22 million vertices, is only
counted. All variants draw every strand: culling and thinning are off except where they are
measured.
"""

from __future__ import annotations

import os
import statistics
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import gpu
import numpy as np
from _suzanne import suzanne
from refinement_probes import adaptive_points, point_textures, read_factors

from hairloom.addon.arrays import piece_starts
from hairloom.addon.exchange.tressfx import read_tfx
from hairloom.addon.groom.grow import grow
from hairloom.addon.groom.scalp import scalp_density
from hairloom.addon.groom.settings import GrowSettings
from hairloom.addon.refine.detail import PictureView, stations
from hairloom.addon.refine.settings import DetailSettings
from hairloom.addon.refine.thinning import even_ranks
from hairloom.addon.render.camera import Camera, frame_camera, look_at, perspective
from hairloom.addon.render.detail_pass import DetailPass
from hairloom.addon.render.frame import render_image
from hairloom.addon.render.shader_program import ShaderRecipe, program
from hairloom.addon.render.shader_source import SHADER_FOLDER
from hairloom.addon.render.snapshot import Snapshot
from hairloom.addon.render.strand_pass import StrandPass
from hairloom.addon.render.textures import texture_from, texture_to_array
from hairloom.addon.shading.lights import three_point_lights

REPOSITORY = Path(__file__).resolve().parents[1]
SINTEL = Path("sintel") / "SintelHairOriginal-sintel_hair.16points.tfx"
WIDTH, HEIGHT, STRANDS, ROUNDS = 960, 720, 11_400, 15
BARE = DetailSettings(culling="none", lod_size=0.0)
UNDIVIDED = replace(BARE, mode="fixed", subdivisions=1)
#: pieces of the exact curve for each piece of the drawn line
PROBES = 8
#: strands whose corners are held in memory at once
CHUNK = 500


@dataclass(frozen=True)
class Groom:
    """name; strands (strand_count, cv_count, 3) [m] and their radius [m]."""

    name: str
    strands: np.ndarray
    radius: float

    def snapshot(self, detail: DetailSettings, **more: Any) -> Snapshot:
        radius = np.full(self.strands.shape[:2], self.radius, np.float32)
        return Snapshot(self.strands, radius, detail=detail, **more)

    def camera(self, turn: float = 0.0) -> Camera:
        """The whole head in view, from a direction turned about the vertical [rad]."""
        low, high = self.strands.min(axis=(0, 1)), self.strands.max(axis=(0, 1))
        direction = (-np.sin(0.5 + turn), -np.cos(0.5 + turn), 0.16)
        return frame_camera((low, high), direction, np.radians(30.0), WIDTH / HEIGHT)

    def close_up(self) -> Camera:
        """A lock of 3 cm that fills the screen: where the most bent strand bends most."""
        bend = np.linalg.norm(np.diff(self.strands, n=2, axis=1), axis=2)
        strand, cv = np.unravel_index(bend.argmax(), bend.shape)
        target = self.strands[strand, cv + 1].astype(np.float64)
        outward = target - self.strands[:, 0].mean(axis=0)
        eye = target + 0.06 * outward / np.linalg.norm(outward)
        return Camera(look_at(eye, target), perspective(0.5, WIDTH / HEIGHT, 0.005, 5.0))


def groom() -> Groom:
    folder = Path(os.environ.get("HAIRLOOM_DATA", REPOSITORY.parent / "shared" / "data"))
    if (folder / SINTEL).is_file():
        return Groom("Sintel", read_tfx(folder / SINTEL).strands.grid, 2.0e-4)
    head = suzanne()
    settings = GrowSettings(strand_count=STRANDS, cv_count=16)
    return Groom("grown", grow(head, settings, scalp_density(head)).grid, 2.0e-4)


def view_figures() -> dict[str, Any]:
    """All figures of the views, by name."""
    shown = groom()
    found: dict[str, Any] = {"view_groom": shown.name, "view_strands": len(shown.strands)}
    found |= vertices(shown)
    views = {"whole": shown.camera(), "close_up": shown.close_up()}
    errors = {f"error_px_{name}": error_px(shown, camera) for name, camera in views.items()}
    found |= errors | {"error_px_max": max(errors.values())}
    found |= frame_times(shown)
    found["gpu_cpu_difference"] = gpu_cpu_difference(shown)
    found["coverage_eighth_difference"] = coverage_eighth_difference(shown)
    return found


def vertices(shown: Groom) -> dict[str, float]:
    """Vertices that each variant draws for the whole head, and their ratios."""
    strand_count, cv_count, _ = shown.strands.shape
    drawn = StrandPass()
    snapshot, camera = shown.snapshot(BARE), shown.camera()
    Target(WIDTH, HEIGHT).timed(lambda: drawn.draw(snapshot, camera, WIDTH, HEIGHT))
    undivided = strand_count * 2 * cv_count
    fixed64 = strand_count * 2 * ((cv_count - 1) * 64 + 1)
    adaptive = drawn.statistics.vertices
    return {
        "vertices_undivided": undivided,
        "vertices_fixed64": fixed64,
        "vertices_adaptive": adaptive,
        "vertices_fixed64_ratio": fixed64 / adaptive,
        "vertices_undivided_ratio": adaptive / undivided,
    }


def error_px(shown: Groom, camera: Camera) -> float:
    """The largest distance of the exact curve from the drawn line [pixels].

    Each piece within the picture is probed at seven places.
    """
    factors = _factors(shown, camera)
    view = PictureView(camera.view, camera.projection, WIDTH, HEIGHT)
    return max(
        _error_of(shown.strands[start : start + CHUNK], factors[start : start + CHUNK], view)
        for start in range(0, len(factors), CHUNK)
    )


def _error_of(strands: np.ndarray, factors: np.ndarray, view: PictureView) -> float:
    exact, _ = adaptive_points(strands.astype(np.float64), factors * PROBES)
    clip = np.concatenate([exact, np.ones((len(exact), 1))], axis=1) @ view.view_projection.T
    # the drawn line's corners are every eighth probe, from the root on
    starts = stations(factors)[:, -1] * PROBES + 1
    root = np.repeat(piece_starts(starts), starts)
    place = np.arange(len(clip)) - root
    corner = np.flatnonzero((place % PROBES == 0) & (np.append(place[1:], 0) > 0))
    pieces = clip[corner[:, None] + np.arange(PROBES + 1)]
    is_seen = (np.abs(pieces[..., :3]) <= pieces[..., 3:]).all(axis=2)
    is_before = pieces[..., 3].min(axis=1) > 1e-3
    pieces, is_seen = pieces[is_before], is_seen[is_before]
    if not is_seen.any():
        return 0.0
    pixels = pieces[..., :2] / pieces[..., 3:] * view.half_size
    start, chord = pixels[:, :1], pixels[:, -1:] - pixels[:, :1]
    along = ((pixels - start) * chord).sum(axis=2, keepdims=True)
    along /= np.maximum((chord * chord).sum(axis=2, keepdims=True), 1e-12)
    apart = pixels - start - np.clip(along, 0.0, 1.0) * chord
    return float(np.linalg.norm(apart, axis=2)[is_seen].max())


def frame_times(shown: Groom) -> dict[str, float]:
    """Milliseconds per frame while the camera turns, so that each frame computes all detail again.

    Medians over rounds in which the variants take turns, at full size and at half.
    """
    settings_by_name = {"undivided": UNDIVIDED, "adaptive": BARE}
    snapshots = {name: shown.snapshot(settings) for name, settings in settings_by_name.items()}
    passes = {(name, part): StrandPass() for name in settings_by_name for part in (1, 2)}
    targets = {part: Target(WIDTH // part, HEIGHT // part) for part in (1, 2)}
    times: dict[tuple[str, int], list[float]] = {key: [] for key in passes}
    for turn in range(ROUNDS + 2):
        camera = shown.camera(0.02 * turn)
        lights = three_point_lights(camera.view)
        for (name, part), drawn in passes.items():
            draw = partial(
                drawn.draw,
                replace(snapshots[name], lights=lights),
                camera,
                WIDTH // part,
                HEIGHT // part,
            )
            times[name, part].append(targets[part].timed(draw))
    found = {}
    for part, suffix in ((1, ""), (2, "_half")):
        medians = {name: statistics.median(times[name, part][2:]) for name in settings_by_name}
        found |= {f"frame_ms_{name}{suffix}": medians[name] for name in settings_by_name}
        ratios = [
            adaptive / undivided
            for undivided, adaptive in zip(
                times["undivided", part][2:], times["adaptive", part][2:], strict=True
            )
        ]
        found[f"frame_ratio_undivided{suffix}"] = statistics.median(ratios)
    return found


def gpu_cpu_difference(shown: Groom) -> float:
    """The largest distance of the GPU's stations from the CPU's, as a fraction of the strand's
    length."""
    factors = _factors(shown, shown.close_up())
    max_pieces = int(stations(factors)[:, -1].max())
    shader = program(
        ShaderRecipe(
            name="station_points",
            compute="station_points.glsl",
            structs=("struct_view.glsl",),
            textures=tuple(("FLOAT_2D", name) for name in ("cv_points", "factors", "totals")),
            images=(("RGBA32F", "result"),),
            folders=(REPOSITORY / "tests" / "gpu" / "shaders", SHADER_FOLDER),
        )
    )
    max_difference = 0.0
    for start in range(0, len(factors), CHUNK):
        own, strands = factors[start : start + CHUNK], shown.strands[start : start + CHUNK]
        packed = np.ones((len(own), -(-own.shape[1] // 16) * 16), np.uint8)
        packed[:, : own.shape[1]] = own
        totals = stations(own)[:, -1]
        textures = {
            "cv_points": np.concatenate([strands, strands[..., :1]], axis=-1),
            "factors": packed.view(np.float32).reshape(len(own), -1, 4),
            "totals": np.repeat(totals[:, None, None], 4, axis=2),
        }
        result = gpu.types.GPUTexture((max_pieces + 1, len(own)), format="RGBA32F")
        uploaded = {name: texture_from(pixels, "RGBA32F") for name, pixels in textures.items()}
        shader.bind(textures=uploaded, images={"result": result})
        gpu.compute.dispatch(shader.shader, -(-(max_pieces + 1) // 8), -(-len(own) // 8), 1)
        pixels = texture_to_array(result)
        gpu.shader.unbind()
        corners, offsets = adaptive_points(strands, own)
        strand = np.repeat(np.arange(len(own)), totals + 1)
        place = np.arange(len(corners)) - offsets[strand]
        length = np.linalg.norm(np.diff(strands, axis=1), axis=2).sum(axis=1)
        apart = np.linalg.norm(pixels[strand, place, :3] - corners, axis=1)
        max_difference = max(max_difference, float((apart / length[strand]).max()))
    return max_difference


def coverage_eighth_difference(shown: Groom) -> float:
    """Relative difference in coverage of an eighth of the strands from all, in the worst view.

    The groom is 135 and 68 pixels high; strands are ranked by `even_ranks`.
    """
    rank = even_ranks(shown.strands[:, 0])
    max_difference = 0.0
    for size in ((192, 144), (96, 72)):
        covered = {}
        for name, detail in (
            ("all", BARE),
            ("eighth", replace(BARE, lod_size=1.0e5, min_density=0.125)),
        ):
            snapshot = shown.snapshot(detail, rank=rank)
            covered[name] = float(render_image(snapshot, shown.camera(), *size, 4)[..., 3].mean())
        max_difference = max(max_difference, abs(covered["eighth"] / covered["all"] - 1.0))
    return max_difference


def _factors(shown: Groom, camera: Camera) -> np.ndarray:
    """Detail factors, as the GPU computes them."""
    snapshot = shown.snapshot(BARE)
    order = DetailPass().order(snapshot, point_textures(snapshot), 1, camera, (WIDTH, HEIGHT))
    return read_factors(order, *shown.strands.shape[:2])


class Target:
    """A framebuffer and its textures, which it does not keep alive itself."""

    def __init__(self, width: int, height: int) -> None:
        self._color = gpu.types.GPUTexture((width, height), format="RGBA16F")
        self._depth = gpu.types.GPUTexture((width, height), format="DEPTH_COMPONENT32F")
        self.framebuffer = gpu.types.GPUFrameBuffer(
            depth_slot=self._depth, color_slots=(self._color,)
        )

    def timed(self, draw: Callable[[], None]) -> float:
        """Milliseconds until the picture is drawn: until one pixel can be read back."""
        with self.framebuffer.bind():
            self.framebuffer.clear(color=(0.0, 0.0, 0.0, 0.0), depth=1.0)
            begin = time.perf_counter()
            draw()
            self.framebuffer.read_color(0, 0, 1, 1, 4, 0, "FLOAT")
            return (time.perf_counter() - begin) * 1000.0
