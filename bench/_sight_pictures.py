"""Pictures of the studio with default settings: at any scale, with any number of strands, and
beside Cycles.

FLIP (Andersson et al. 2020), at its default 67 pixels per degree, is averaged over pixels that hair
mostly covers.

With fewer strands, a groom's strands are at other pixels, in any renderer. So `count_flip` is
measured at a distance at which a pixel is as wide as the spacing of the fewest strands: pictures
are reduced by an integer factor, in linear light. Even so, two disjoint grooms of as many strands
differ by `count_flip_floor`: no renderer could show fewer strands as more without that noise. So
the limit is on `count_flip_excess`, the part above the floor; both are of the same run, and each
count has the floor of its own pair of grooms, since few strands make more noise. `count_flip_pixel`
is measured on the full pictures and has no limit. One camera and the same lights serve all, as a
camera fitted to each groom might see it from another side.

Beside Cycles all colours share the exposure at which blond, the brightest, is bright in the
picture: black hair is dark in any picture, and users see it so. `cycles_flip_shown_COLOR`, without
a limit, is measured with an exposure for each colour, which is some twenty times higher for black.
"""

from __future__ import annotations

from dataclasses import replace

import flip_evaluator
import numpy as np
from _shading_room import CyclesRoom
from _sight_cover import coverage
from _sight_grooms import Pair, rig_of, scaled

from hairloom.addon import rig_flow
from hairloom.addon.blender.pictures.studio import FIELD_OF_VIEW, Studio
from hairloom.addon.blender.properties.groom_settings import GroomSettings
from hairloom.addon.blender.scene.built_in_head import built_in_head
from hairloom.addon.blender.sessions.prepared_groom import prepare_groom
from hairloom.addon.exchange.textures.srgb import srgb_encoded
from hairloom.addon.groom.children_settings import ChildrenSettings
from hairloom.addon.groom.face_hair import grow_with_face
from hairloom.addon.groom.grow import grow
from hairloom.addon.groom.settings import GrowSettings
from hairloom.addon.render.camera import Camera
from hairloom.addon.render.snapshot import SKIN
from hairloom.addon.rig_flow import Rig
from hairloom.addon.shading.ambient_settings import AmbientSettings
from hairloom.addon.shading.drawn_strands import drawn_radius
from hairloom.addon.shading.lights import Light
from hairloom.addon.shading.marschner.principled import PrincipledHair, settings_from
from hairloom.addon.shading.settings import ShadingSettings, StrandSettings
from hairloom.addon.shading.stage_settings import StageSettings
from hairloom.addon.strands.arc_length import length_fractions

SIZE, SAMPLES = 320, 3
#: Cycles' pictures of a colour, each with its own seed and denoised; paths per pixel; bounces
SEEDS, PATHS, BOUNCES = 3, 64, 64
#: direction to the sun, and its strength [W/m^2]
SUN, STRENGTH = np.array([-0.2, -0.75, 0.6]), float(np.pi)
#: absorption of the hair, per radius
COLORS = {
    "black": (2.4, 3.6, 5.7),
    "brown": (0.63, 1.12, 2.4),
    "red": (0.2, 0.8, 2.3),
    "blond": (0.06, 0.12, 0.3),
}
#: the brightest tenth of the brightest hair is this bright in a picture
SHOWN = 0.5
COUNTS = (5_000, 20_000, 100_000)
#: Cycles' room is black
_UNLIT = ("ambient", "backdrop_center", "backdrop_edge")
#: least coverage of a pixel that counts as hair
_IS_HAIR = 0.5
#: parameters of a look that Principled Hair does not have
_UNKNOWN = ("color_variation", "shift_noise", "sparkle")


def scale_flip(pair: Pair, name: str) -> float:
    """FLIP between a groom and the same, with its head, a thousand times smaller and larger."""
    one, hair = _picture(rig_of(pair, name))
    return max(
        _flip(one, _picture(rig_of(scaled(pair, factor), name))[0], hair) for factor in (1e-3, 1e3)
    )


def count_figures() -> dict[str, float]:
    """The built-in groom with all strands, and with evenly chosen fewer: with default children,
    which fill gaps, and without.
    """
    shipped = _count_figures(ChildrenSettings().method)
    bare = {f"{name}_without_children": value for name, value in _count_figures("none").items()}
    return shipped | bare


def _count_figures(children: str) -> dict[str, float]:
    head = built_in_head()
    # without brows and lashes: thinned out, they leave bare skin, as in no real groom
    settings = GrowSettings(strand_count=COUNTS[-1])
    grown = grow(head.surface, settings, head.weights["scalp"])
    whole = rig_of((grown, head.surface), "built-in", "none")
    order = np.argsort(rig_flow.strand_ranks(whole), kind="stable")
    studio = _studio(whole)
    camera = studio._camera(1.0)
    lights = studio.lights(camera)

    def seen(chosen: np.ndarray) -> np.ndarray:
        rig = rig_of((grown.take(np.sort(chosen)), head.surface), "built-in", children)
        return _picture(rig, None, lights, camera)[0]

    truth, hair = _picture(whole, None, lights, camera)
    fewest = rig_of((grown.take(np.sort(order[: COUNTS[0]])), head.surface), "built-in", "none")
    size = int(np.ceil(fewest.widths.spacing / _pixel_size(camera, whole)))
    is_hair = _reduced(hair[..., None], size)[..., 0] > 0.5
    coarse = _reduced(truth, size)
    found, floors, pixels, light = [], [], [], []
    for count in COUNTS[:-1]:
        picture, equal = (seen(order[first : first + count]) for first in (0, count))
        found.append(_flip(coarse, _reduced(picture, size), is_hair))
        floors.append(_flip(_reduced(equal, size), _reduced(picture, size), is_hair))
        pixels.append(_flip(truth, picture, hair))
        light.append(float(picture[hair, :3].mean()) / float(truth[hair, :3].mean()))
    excess = np.subtract(found, floors)
    worst_index = int(excess.argmax())
    return {
        "count_flip": found[worst_index],
        "count_flip_floor": floors[worst_index],
        "count_flip_excess": float(excess[worst_index]),
        "count_flip_pixel": max(pixels),
        "count_light_percent": 100.0 * max(abs(each - 1.0) for each in light),
        "count_pixels_to_one": float(size),
    }


def cycles_figures() -> dict[str, float]:
    """The built-in groom under one sun, path traced with the same curves, widths and fibres."""
    head = built_in_head()
    grown = grow_with_face(head.surface, GrowSettings(), head.weights)
    rig = rig_of((grown, head.surface), "built-in")
    room, camera = CyclesRoom(), _studio(rig)._camera(1.0)
    strands = rig.strands
    drawn = drawn_radius(
        strands.radius, StrandSettings(), length_fractions(strands.points, strands.offsets)
    )
    room.strands(strands.points, drawn, counts=strands.point_counts)
    room.body(head.surface.positions, head.surface.triangles, SKIN, casts_shadow=True)
    room.look(camera)
    room.sun(SUN, STRENGTH)
    pairs = {}
    for name, absorption in COLORS.items():
        node, shading = plain_look(absorption)
        dark = replace(StageSettings(), **dict.fromkeys(_UNLIT, (0.0, 0.0, 0.0)))
        settings = GroomSettings().with_settings(shading, dark)
        sun = (Light.sun(-SUN, (1.0, 1.0, 1.0), STRENGTH),)
        ours, hair = _picture(rig, settings, sun)
        room.hair(
            absorption,
            Roughness=node.roughness,
            Radial_Roughness=node.radial_roughness,
            Offset=node.offset,
        )
        room.paths(PATHS, BOUNCES, is_denoised=True)
        truth = np.mean([room.picture(SIZE, seed=seed) for seed in range(SEEDS)], axis=0)
        exposure = SHOWN / np.percentile(truth[hair, :3].max(axis=-1), 90.0)
        pairs[name] = truth, ours, float(exposure)
    min_exposure = min(exposure for _, _, exposure in pairs.values())
    found = {}
    for name, (truth, ours, exposure) in pairs.items():
        found[f"cycles_flip_{name}"] = _flip(truth * min_exposure, ours * min_exposure, hair)
        found[f"cycles_flip_shown_{name}"] = _flip(truth * exposure, ours * exposure, hair)
        light = ours[hair, :3].mean(axis=0) / truth[hair, :3].mean(axis=0)
        found |= {
            f"cycles_light_{name}_{channel}": float(light[n]) for n, channel in enumerate("rgb")
        }
    return {"cycles_flip_hair": max(found[f"cycles_flip_{name}"] for name in COLORS), **found}


def plain_look(absorption: tuple[float, float, float]) -> tuple[PrincipledHair, ShadingSettings]:
    """Principled Hair with its defaults, and a look of only the parameters that it has."""
    node = PrincipledHair(parametrization="ABSORPTION", absorption_coefficient=absorption)
    plain = replace(ShadingSettings(), **dict.fromkeys(_UNKNOWN, 0.0))
    return node, settings_from(node, plain)[0]


def _picture(
    rig: Rig,
    settings: GroomSettings | None = None,
    lights: tuple[Light, ...] | None = None,
    camera: Camera | None = None,
) -> tuple[np.ndarray, np.ndarray]:
    """The studio's picture, (SIZE, SIZE, 4), and a mask of its hair."""
    studio = _studio(rig, settings)
    camera = camera or studio._camera(1.0)
    points = rig.strands.points
    drawn = studio.picture(rig.rest_pose, points, SIZE, SIZE, SAMPLES, camera, lights=lights)
    return drawn, coverage(rig, camera, SIZE, SAMPLES) > _IS_HAIR


def _studio(rig: Rig, settings: GroomSettings | None = None) -> Studio:
    settings = settings or GroomSettings()
    return Studio(prepare_groom(rig, settings[AmbientSettings]), settings)


def _pixel_size(camera: Camera, rig: Rig) -> float:
    """The width of a pixel at the depth of the hair's middle [m]."""
    low, high = rig.strands.bounds()
    depth = -(camera.view @ np.append(0.5 * (low + high), 1.0))[2]
    return float(2.0 * depth * np.tan(0.5 * FIELD_OF_VIEW) / SIZE)


def _reduced(picture: np.ndarray, size: int) -> np.ndarray:
    """Means of squares of `size` pixels a side; a remainder at the border is dropped."""
    rows, columns = (side // size for side in picture.shape[:2])
    squares = picture[: rows * size, : columns * size].astype(np.float64)
    found: np.ndarray = squares.reshape(rows, size, columns, size, -1).mean(axis=(1, 3))
    return found


def _flip(truth: np.ndarray, picture: np.ndarray, where: np.ndarray) -> float:
    encoded = [
        np.ascontiguousarray(srgb_encoded(np.clip(each[..., :3], 0.0, 1.0)), np.float32)
        for each in (truth, picture)
    ]
    found, _, _ = flip_evaluator.evaluate(*encoded, "LDR", applyMagma=False)
    return float(np.asarray(found).reshape(where.shape)[where].mean())
