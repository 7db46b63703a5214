"""Sintel's hair on her head beside Cycles' path tracing: the sheet out/volume_sintel.png.

The same strands, head, camera and sun in both; the head has the colour of skin, and everything
casts shadows on everything. Hair is Principled Hair with its defaults, and ours as an artist gets
it from the node. Columns: Cycles with all bounces; ours with approximations of shadows and
scattering; ours with shadows alone; ours with shadows and multiple scattering. Rows: black, brown,
blond.

Cycles' pictures are denoised, each with its own seed, and averaged until little noise is left,
since the denoiser's errors differ from seed to seed.
"""

from __future__ import annotations

import os
from dataclasses import dataclass, replace
from pathlib import Path

import flip_evaluator
import numpy as np
from _shading_ball import BLACK, shown
from _shading_cycles import BLOND, USUAL
from _shading_room import CyclesRoom
from extension_loader import REPOSITORY

from hairloom.addon.blender.base.images import contact_sheet, write_png
from hairloom.addon.blender.scene.mesh_files import read_mesh_file
from hairloom.addon.exchange.textures.srgb import srgb_encoded
from hairloom.addon.exchange.tressfx import read_tfx
from hairloom.addon.refine.settings import DetailSettings
from hairloom.addon.render.camera import Camera, frame_camera
from hairloom.addon.render.frame import render_image
from hairloom.addon.render.snapshot import SKIN, MeshSnapshot, Snapshot
from hairloom.addon.shading.lights import Light
from hairloom.addon.shading.marschner.principled import PrincipledHair, settings_from
from hairloom.addon.shading.settings import ShadingSettings, StrandSettings
from hairloom.addon.shading.volume.settings import VolumeSettings
from hairloom.addon.strands import Surface

SHEET = REPOSITORY / "out" / "volume_sintel.png"
#: pixels across a picture, and our samples across a pixel, which are closer than strands are wide
SIZE, SAMPLES = 256, 8
#: of Cycles' pictures: paths per pixel; bounces; noise to reach, and the most pictures
PATHS, BOUNCES, NOISE, MOST_PICTURES = 64, 64, 0.01, 24
#: [m]; 2.5 times the file's, since 11,400 strands represent many more. No taper
RADIUS = 1.0e-4
SUN, STRENGTH = np.array([-0.2, -0.75, 0.6]), float(np.pi)
VIEW_DIRECTION, FIELD_OF_VIEW, MARGIN = (-0.55, -1.0, 0.18), np.radians(30.0), 0.85
#: the brightest tenth of the hair is this bright in a picture
SHOWN = 0.5
BROWN = (0.63, 1.12, 2.4)
COLORS = {"black": BLACK, "brown": BROWN, "blond": BLOND}
DUAL = VolumeSettings(
    shadows="deep",
    strand_fraction=1.0,
    extinction=1.0,
    resolution=512,
    layers=8,
    layer_depth=0.25,
    bias=0.01,
    scattering=True,
    density=0.7,
)
#: each column's strength of the approximations, and its shadows
COLUMNS = {
    "stand_ins": (1.0, VolumeSettings(shadows="none")),
    "single": (0.0, replace(DUAL, scattering=False)),
    "dual": (0.0, DUAL),
}


@dataclass(frozen=True)
class Sitter:
    """What is drawn: strands (strand_count, cv_count, 3) [m], their head, and the camera."""

    strands: np.ndarray
    head: Surface
    camera: Camera


def sintel() -> Sitter:
    data = os.environ.get("HAIRLOOM_DATA", REPOSITORY.parent / "shared" / "data")
    folder = Path(data) / "sintel"
    strands = read_tfx(folder / "SintelHairOriginal-sintel_hair.16points.tfx").strands
    camera = frame_camera(strands.bounds(), VIEW_DIRECTION, FIELD_OF_VIEW, 1.0, margin=MARGIN)
    head = read_mesh_file(folder / "sintel.obj", need_uv=False)[0]
    return Sitter(strands.grid.astype(np.float32), head, camera)


def sintel_figures() -> dict[str, float]:
    """Write the sheet; for each colour FLIP with scattering, with shadows alone and with the
    approximations; the ratio of our light on hair to Cycles' by channel; the noise left in Cycles'
    picture.

    flip_*_hair: the mean weighted by the coverage of hair.
    """
    sitter = sintel()
    covered = coverage(sitter)
    room = cycles_room(sitter)
    found = {"sintel_coverage_difference": coverage_difference(room, covered)}
    pictures = []
    for name, absorption in COLORS.items():
        truth, noise = path_traced(room, absorption)
        found[f"sintel_{name}_noise_percent"] = 100.0 * noise
        brightest = np.percentile(truth[covered > 0.5, :3].max(axis=-1), 90.0)
        row = [shown(truth, SHOWN / brightest)]
        for column, (stand_ins, volume) in COLUMNS.items():
            picture = drawn(sitter, snapshot_of(sitter, absorption, stand_ins, volume))
            row.append(shown(picture, SHOWN / brightest))
            flip = flip_map(row[0], row[-1])
            suffix = "" if column == "dual" else f"_{column}"
            found[f"flip_{name}{suffix}"] = float(flip.mean())
            found[f"flip_{name}{suffix}_hair"] = float(np.average(flip, weights=covered))
            light = [np.einsum("yxc,yx->c", one[..., :3], covered) for one in (picture, truth)]
            for channel, ratio in zip("rgb", light[0] / light[1], strict=True):
                found[f"sintel_{name}_{column}_{channel}"] = float(ratio)
        pictures += row
    SHEET.parent.mkdir(exist_ok=True)
    write_png(SHEET, contact_sheet(pictures, 1 + len(COLUMNS)))
    return found


def cycles_room(sitter: Sitter) -> CyclesRoom:
    room = CyclesRoom()
    room.strands(sitter.strands, RADIUS)
    room.body(sitter.head.positions, sitter.head.triangles, SKIN, casts_shadow=True)
    room.look(sitter.camera)
    room.sun(SUN, STRENGTH)
    return room


def coverage_difference(room: CyclesRoom, covered: np.ndarray) -> float:
    """The mean difference of hair's coverage from Cycles', over the picture."""
    room.paths(PATHS)
    room.leave_out_body(True)
    theirs = room.picture(SIZE)[..., 3]
    room.leave_out_body(False)
    return float(np.abs(theirs - covered).mean())


def path_traced(
    room: CyclesRoom, absorption: tuple[float, float, float]
) -> tuple[np.ndarray, float]:
    """Cycles' picture (SIZE, SIZE, 4), and the standard deviation of its pixels over their mean."""
    room.hair(
        absorption,
        Roughness=USUAL.roughness,
        Radial_Roughness=USUAL.around,
        Offset=USUAL.offset,
    )
    room.paths(PATHS, BOUNCES, is_denoised=True)
    seen, noise = [room.picture(SIZE, seed=seed) for seed in range(3)], np.inf
    while noise > NOISE and len(seen) < MOST_PICTURES:
        seen.append(room.picture(SIZE, seed=len(seen)))
        is_seen = seen[0][..., 3] > 0.5
        colors = np.array(seen)[:, is_seen, :3]
        variance = colors.var(axis=0, ddof=1) / len(seen)
        noise = float(np.sqrt(variance.mean()) / colors.mean())
    return np.mean(seen, axis=0), noise


def hair_settings(absorption: tuple[float, float, float], stand_ins: float) -> ShadingSettings:
    """Settings from the node, for strands alike; stand_ins: strength of the approximations."""
    node = PrincipledHair(
        parametrization="ABSORPTION",
        absorption_coefficient=absorption,
        roughness=USUAL.roughness,
        radial_roughness=USUAL.around,
        offset=USUAL.offset,
    )
    alike = ShadingSettings(
        color_variation=0.0,
        shift_noise=0.0,
        sparkle=0.0,
        fake_scattering=stand_ins,
        volume_shadow=stand_ins,
    )
    return settings_from(node, alike)[0]


def snapshot_of(
    sitter: Sitter,
    absorption: tuple[float, float, float],
    stand_ins: float,
    volume: VolumeSettings,
) -> Snapshot:
    """The hair on the head, with the sun as the only light."""
    return Snapshot(
        sitter.strands,
        np.full(sitter.strands.shape[:2], RADIUS, np.float32),
        meshes=(replace(MeshSnapshot.of(sitter.head, color=SKIN), specular=0.0),),
        lights=(Light.sun(-SUN, (1.0, 1.0, 1.0), STRENGTH),),
        ambient=(0.0, 0.0, 0.0),
        shading=hair_settings(absorption, stand_ins),
        strand_settings=StrandSettings(tip_width=1.0, minimum_width=0.0, transparency="none"),
        detail=DetailSettings(culling="none", lod_size=0.0),
        volume=volume,
    )


def coverage(sitter: Sitter) -> np.ndarray:
    """Coverage of each pixel by strands that the head does not hide, (SIZE, SIZE)."""
    snapshot = snapshot_of(sitter, BLOND, 0.0, VolumeSettings(shadows="none"))
    white = ShadingSettings(base_color=(1.0, 1.0, 1.0), color_variation=0.0, ambient=1.0)
    head = replace(snapshot.meshes[0], color=(0.0, 0.0, 0.0))
    glowing = replace(snapshot, shading=white, meshes=(head,), lights=(), ambient=(1.0, 1.0, 1.0))
    return drawn(sitter, glowing)[..., 0]


def drawn(sitter: Sitter, snapshot: Snapshot) -> np.ndarray:
    return render_image(snapshot, sitter.camera, SIZE, SIZE, SAMPLES)


def flip_map(reference: np.ndarray, picture: np.ndarray) -> np.ndarray:
    """FLIP (Andersson et al. 2020) of two scene-linear pictures, encoded as sRGB, at its default 67
    pixels per degree, (height, width).
    """
    encoded = [
        np.ascontiguousarray(srgb_encoded(np.clip(each[..., :3], 0.0, 1.0)), np.float32)
        for each in (reference, picture)
    ]
    found, _, _ = flip_evaluator.evaluate(*encoded, "LDR", applyMagma=False)
    return np.asarray(found).reshape(reference.shape[:2])
