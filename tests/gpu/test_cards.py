"""Drawn cards against the Python reference, and their four passes against brute-force sorting."""

from __future__ import annotations

import dataclasses
from functools import partial
from typing import Any

import flat_cards
import numpy as np
import pytest
from flat_cards import camera, constant_textures, mesh_of, snapshot_of

from hairloom.addon.render.camera import frame_camera
from hairloom.addon.render.snapshot import MeshSnapshot
from hairloom.addon.shading.card_look import card_base, mapped_tangent
from hairloom.addon.shading.kajiya_kay import kajiya_kay
from hairloom.addon.shading.lights import Light, light_at, light_irradiance
from hairloom.addon.shading.settings import ShadingSettings
from hairloom.addon.shading.texture_settings import TextureSettings
from hairloom.addon.shading.textures import hair_textures
from hairloom.addon.strands import Surface

pytestmark = pytest.mark.usefixtures("gpu_context")

SIZE = 96
PLAIN = ShadingSettings(model="kajiya_kay", base_color=(1.0, 1.0, 1.0))


@pytest.fixture(scope="module")
def front() -> Any:
    return camera()


#: a rectangle whose corners have different occlusion
card = partial(flat_cards.card, occlusion=(0.4, 0.6, 0.8, 1.0))


def sampled(texture: np.ndarray, u: np.ndarray, v: np.ndarray, *, repeats: bool) -> np.ndarray:
    """A texture sampled with linear filtering."""
    height, width = texture.shape[:2]
    x, y = u * width - 0.5, v * height - 0.5
    left, below = np.floor(x).astype(int), np.floor(y).astype(int)
    share_x, share_y = x - left, y - below
    if texture.ndim == 3:
        share_x, share_y = share_x[..., None], share_y[..., None]

    def at(row: np.ndarray, column: np.ndarray) -> np.ndarray:
        if repeats:
            return texture[row % height, column % width]
        return texture[np.clip(row, 0, height - 1), np.clip(column, 0, width - 1)]

    low = at(below, left) * (1.0 - share_x) + at(below, left + 1) * share_x
    high = at(below + 1, left) * (1.0 - share_x) + at(below + 1, left + 1) * share_x
    return low * (1.0 - share_y) + high * share_y


LIGHTS = (
    Light.sun((0.2, 0.7, -0.4), (1.0, 0.9, 0.8), 3.0),
    Light.point((0.3, -0.9, 0.9), (0.5, 0.7, 1.0), 8.0),
)
AMBIENT = (0.1, 0.2, 0.3)
LOOK = ShadingSettings(
    model="kajiya_kay", tip_tint=0.7, grey_fraction=0.2, shift_noise=0.5, sparkle=0.8
)


@pytest.mark.parametrize("tangent_map", [False, True])
@pytest.mark.parametrize("kind", ["constant", "real"])
def test_a_pixel_has_the_colour_of_the_reference(
    frame: Any, front: Any, kind: str, tangent_map: bool
) -> None:
    """One flat card that fills the picture: vertex data, textures, lights and settings."""
    if kind == "constant":
        textures = constant_textures((0.5, 0.7, 0.9), 1.0, 0.8, 0.3, (0.6, 0.95, 0.3))
    else:
        made = hair_textures(TextureSettings(variant_width=32, height=24, strand_count=6), 2)
        textures = dataclasses.replace(made, alpha=np.ones_like(made.alpha))
    tilt = 0.3
    snapshot = snapshot_of(
        mesh_of(card((0.0, 0.0), (1.0, 1.0), 0.0, tilt=tilt)),
        textures,
        cards={"has_tangent_map": tangent_map},
        lights=LIGHTS,
        ambient=AMBIENT,
        shading=LOOK,
    )
    picture = frame.render_image(snapshot, front, SIZE, SIZE, 1)

    u, z = np.meshgrid((np.arange(SIZE) + 0.5) / SIZE, (np.arange(SIZE) + 0.5) / SIZE)
    v = 1.0 - z
    point = np.stack([u, np.zeros_like(u), z], axis=-1)
    normal = np.broadcast_to([0.0, -np.cos(tilt), np.sin(tilt)], point.shape)
    tangent = np.broadcast_to([0.0, -np.sin(tilt), -np.cos(tilt)], point.shape)
    shift = sampled(textures.shift, u, v, repeats=True)
    if tangent_map:
        texel = sampled(textures.tangent, u, v, repeats=False)
        tangent = mapped_tangent(texel, tangent, normal, LOOK.shift_noise)
        shift = np.full_like(u, 0.5)
    noise = sampled(textures.noise, u, v, repeats=True)
    light = np.broadcast_to(np.array(AMBIENT), point.shape)
    to_eye = np.broadcast_to([0.0, -1.0, 0.0], point.shape)
    for lamp in LIGHTS:
        lit = kajiya_kay(tangent, normal, light_at(lamp, point)[0], to_eye, shift, noise, LOOK)
        light = light + light_irradiance(lamp, point) / np.pi * lit
    occlusion = 0.4 + 0.2 * u + 0.4 * v
    base = card_base(v, LOOK) * sampled(textures.base, u, v, repeats=False)
    expected = light * base * occlusion[..., None]
    assert (picture[..., 3] == 1.0).all()
    # GPUs blend texels by weights of 8 bits; a highlight of high exponent magnifies that
    tolerance = 2.0e-3 if kind == "constant" else 2.0e-2
    assert np.abs(picture[..., :3] / expected - 1.0).max() < tolerance
    assert np.abs(picture[..., :3] / expected - 1.0).mean() < 2.0e-3
    assert np.ptp(expected[..., 0]) > 0.02, "the light must vary"


@pytest.mark.parametrize(
    ("color_noise", "sky"), [(0.5, None), (0.05, None), (0.9, None), (0.5, (0.4, 0.1, 0.2, -0.15))]
)
def test_marschner_shades_cards_as_strands(
    frame: Any, front: Any, color_noise: float, sky: tuple[float, ...] | None
) -> None:
    """Against the reference of a strand at the same place; the base texture is the ratio of that
    strand's colour to the mean. sky: openness in the card's axes, or None."""
    from hairloom.addon.shading.environment import (
        OCTANT_BLUR,
        Environment,
        hair_ambient,
        openness_from_occlusion,
    )
    from hairloom.addon.shading.marschner.look import (
        fibre_of,
        lit_fraction,
        marschner_light,
        strand_absorption,
        strand_color,
    )
    from hairloom.addon.shading.marschner.tables import marschner_tables, shape_of, table_level

    look = dataclasses.replace(
        LOOK, model="marschner", grey_fraction=0.0, tip_tint=0.0, color_variation=0.6
    )
    half = np.array(0.5)
    own, mean = (
        strand_color(strand_absorption(look, half, np.array(noise), half + 1.0))
        for noise in (color_noise, 0.5)
    )
    tilt = 0.3
    mesh = mesh_of(card((0.0, 0.0), (1.0, 1.0), 0.0, tilt=tilt))
    snapshot = snapshot_of(
        mesh,
        constant_textures(own / mean, noise=0.3, shift=0.7),
        cards={} if sky is None else {"openness": np.tile(np.float32(sky), (4, 1))},
        lights=LIGHTS,
        ambient=AMBIENT,
        shading=look,
    )
    picture = frame.render_image(snapshot, front, SIZE, SIZE, 1)
    tables = marschner_tables(shape_of(fibre_of(look)), snapshot.table_size)
    level = table_level(OCTANT_BLUR, snapshot.table_size)
    for row, column in ((20, 30), (48, 50), (90, 7)):
        u, z = (column + 0.5) / SIZE, (row + 0.5) / SIZE
        point = np.array([u, 0.0, z])
        normal = np.array([0.0, -np.cos(tilt), np.sin(tilt)])
        tangent = np.array([0.0, -np.sin(tilt), -np.cos(tilt)])
        along = np.array(1.0 - z)
        absorption = strand_absorption(look, along, np.array(color_noise), half + 1.0)
        occlusion = np.array(0.4 + 0.2 * u + 0.4 * (1.0 - z))
        lit = partial(
            marschner_light,
            tables,
            tangent,
            normal,
            to_eye=np.array([0.0, -1.0, 0.0]),
            shift_noise=np.array(0.7),
            sparkle_noise=np.array(0.3),
            absorption=absorption,
            shading=look,
        )
        openness = openness_from_occlusion(occlusion, normal)
        if sky is not None:
            axes = np.stack([each[0] for each in mesh.axes])
            openness = np.append(sky[0], np.array(sky[1:]) @ axes)
        expected = hair_ambient(
            Environment(AMBIENT),
            openness,
            lambda towards, path, lit=lit: lit(to_light=towards, level=level, tau=path[..., 0]),
        )
        for lamp in LIGHTS:
            irradiance = light_irradiance(lamp, point)
            expected += (
                lit_fraction(occlusion) * irradiance * lit(to_light=light_at(lamp, point)[0])
            )
        assert picture[row, column, :3] == pytest.approx(expected, rel=0.01)


def over(layers: list[tuple[np.ndarray, np.ndarray]], background: np.ndarray) -> np.ndarray:
    """Premultiplied layers from back to front, each where its mask is."""
    picture = np.broadcast_to(background, (*layers[0][1].shape, 4)).copy()
    for color, mask in layers:
        blended = color + picture * (1.0 - color[..., 3:])
        picture = np.where(mask[..., None], blended, picture)
    return picture


def test_four_passes_match_sorting(frame: Any, front: Any) -> None:
    """Cards in order from back to front; some, behind all others, show their backs.

    Against the pictures of single cards, sorted by depth and blended in numpy.
    """
    textures = hair_textures(TextureSettings(variant_width=24, height=24, strand_count=6), 1)
    background = np.array([0.2, 0.1, 0.3, 1.0], np.float32)
    cards = [
        card((0.9, 0.05), (0.2, 0.8), 0.5),
        card((0.7, 0.2), (0.1, 0.9), 0.4),
        card((0.15, 0.1), (0.75, 0.95), 0.3),
        card((0.3, 0.25), (0.95, 0.85), 0.2),
        card((0.05, 0.3), (0.8, 0.7), 0.1),
    ]
    light = {"lights": LIGHTS, "ambient": AMBIENT, "shading": PLAIN}
    drawn = frame.render_image(
        snapshot_of(mesh_of(*cards), textures, **light),
        front,
        SIZE,
        SIZE,
        1,
        background=tuple(background),
    )
    layers = []
    for each in cards:
        alone = frame.render_image(
            snapshot_of(mesh_of(each), textures, **light), front, SIZE, SIZE, 1
        )
        layers.append((alone, alone[..., 3] > 0.0))
    expected = over(layers, background)
    assert np.abs(drawn - expected).max() < 1.0e-5
    fractions = [
        float(((layer[..., 3] > 0.0) & (layer[..., 3] < 1.0)).mean()) for layer, _ in layers
    ]
    assert min(fractions) > 0.02, "every card must be partly transparent"


def test_opaque_parts_hide_what_is_drawn_later_behind_them(frame: Any, front: Any) -> None:
    """Even in the wrong order, the opaque parts of the nearest card hide the others."""
    near, far = card((0.0, 0.0), (1.0, 1.0), 0.1), card((0.0, 0.0), (1.0, 1.0), 0.5)
    far["occlusion"] = np.zeros(4)  # black
    look = {"ambient": (1.0, 1.0, 1.0), "shading": PLAIN}
    picture = frame.render_image(
        snapshot_of(mesh_of(near, far), constant_textures(), **look), front, 8, 8, 1
    )
    assert (picture[..., 0] > 0.3).all()


def test_clear_parts_hide_nothing(frame: Any, front: Any) -> None:
    """Even in the wrong order, the other card is visible through clear parts of the nearest one."""
    near, far = card((0.0, 0.0), (1.0, 1.0), 0.1), card((0.0, 0.0), (1.0, 1.0), 0.5)
    near["uv"] = near["uv"] * [0.0, 1.0] + [0.1, 0.0]
    far["uv"] = far["uv"] * [0.0, 1.0] + [0.9, 0.0]
    alpha = np.repeat([[0.0, 0.0, 0.5, 0.5]], 4, axis=0).astype(np.float32)
    textures = dataclasses.replace(constant_textures(), alpha=alpha)
    picture = frame.render_image(snapshot_of(mesh_of(near, far), textures), front, 8, 8, 1)
    assert picture[..., 3] == pytest.approx(0.5, abs=1e-3)


def test_a_mesh_before_a_card_hides_it_and_one_behind_shines_through(
    frame: Any, front: Any
) -> None:
    square = np.array([[0, 0, 0], [0.5, 0, 0], [0.5, 0, 1], [0, 0, 1]], np.float32)
    blue = MeshSnapshot.of(Surface(square, np.array([[0, 1, 2], [0, 2, 3]])), color=(0.0, 0.0, 1.0))
    mesh = dataclasses.replace(blue, specular=0.0)
    cards = mesh_of(card((0.0, 0.0), (1.0, 0.5), 0.3), card((0.0, 0.5), (1.0, 1.0), -0.3))
    picture = frame.render_image(
        snapshot_of(
            dataclasses.replace(cards, occlusion=np.ones(8)),
            constant_textures((1.0, 0.0, 0.0), alpha=0.5),
            meshes=(mesh,),
            ambient=(1.0, 1.0, 1.0),
            shading=PLAIN,
        ),
        front,
        8,
        8,
        1,
    )
    assert picture[2, 2] == pytest.approx([0.0, 0.0, 1.0, 1.0]), "behind the mesh"
    assert picture[6, 2] == pytest.approx([0.5, 0.0, 0.5, 1.0], abs=1e-3), "before it"
    assert picture[6, 6] == pytest.approx([0.5, 0.0, 0.0, 0.5], abs=1e-3), "before nothing"


def test_equal_depth_loses_no_pixel(frame: Any) -> None:
    """For opaque cards at all angles, every pixel that has primed the depth is shaded."""
    random = np.random.default_rng(4)
    cards = []
    for _ in range(60):
        each = card((-0.1, -0.1), (0.1, 0.1), 0.0)
        turn, _ = np.linalg.qr(random.normal(size=(3, 3)))
        each["positions"] = each["positions"] @ turn + random.uniform(-0.3, 0.3, 3)
        each["occlusion"] = np.ones(4)
        cards.append(each)
    snapshot = snapshot_of(
        mesh_of(*cards), constant_textures(), ambient=(1.0, 1.0, 1.0), shading=PLAIN
    )
    camera = frame_camera(
        (np.full(3, -0.4), np.full(3, 0.4)), (0.3, -1.0, 0.2), np.radians(40), 1.0
    )
    picture = frame.render_image(snapshot, camera, 300, 300, 1)
    mesh = snapshot.cards.mesh
    plain = MeshSnapshot.of(Surface(mesh.positions, mesh.triangles))
    as_mesh = dataclasses.replace(snapshot, cards=None, meshes=(plain,))
    covered = frame.render_image(as_mesh, camera, 300, 300, 1)[..., 3] > 0.0
    assert 0.2 < covered.mean() < 0.9
    np.testing.assert_allclose(picture[covered], 1.0, atol=1.0e-6)
    assert (picture[~covered] == 0.0).all()


def test_passes_keep_what_did_not_change(frame: Any, front: Any) -> None:
    from hairloom.addon.render.card_pass import CardPass

    first = snapshot_of(
        mesh_of(card((0.0, 0.0), (1.0, 1.0), 0.0)), constant_textures(), shading=PLAIN
    )
    second = dataclasses.replace(
        first, cards=dataclasses.replace(first.cards, textures=constant_textures((1.0, 0.0, 0.0)))
    )
    kept = CardPass()
    for shown in (first, second, first):
        alone = frame.render_image(shown, front, 8, 8, 1)
        again = frame.render_image(shown, front, 8, 8, 1, card_pass=kept)
        assert (alone == again).all()
        assert alone[4, 4, 3] == 1.0


def test_state_is_as_it_was_found(gpu_context: Any, front: Any) -> None:
    from hairloom.addon.render.card_pass import CardPass

    snapshot = snapshot_of(mesh_of(card((0.0, 0.0), (1.0, 1.0), 0.0)), constant_textures(alpha=0.5))
    state = gpu_context.state
    offscreen = gpu_context.types.GPUOffScreen(8, 8, format="RGBA32F")

    def found() -> tuple[Any, ...]:
        return state.depth_test_get(), state.depth_mask_get(), state.blend_get()

    with offscreen.bind():
        framebuffer = state.active_framebuffer_get()
        framebuffer.clear(color=(0.0, 0.0, 0.0, 0.0), depth=1.0)
        state.depth_test_set("GREATER")
        state.depth_mask_set(False)
        state.blend_set("ALPHA")
        before = found()
        CardPass().draw(snapshot, front, 8, 8)
        assert found() == before
        state.depth_test_set("NONE")
        state.depth_mask_set(True)
        state.blend_set("NONE")
    alpha = np.array(offscreen.texture_color.read()).reshape(8, 8, 4)[..., 3]
    offscreen.free()
    assert alpha == pytest.approx(0.5, abs=1e-3)
