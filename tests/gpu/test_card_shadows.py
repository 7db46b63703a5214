"""Shadows of cards on cards and on skin, and of meshes on cards."""

from __future__ import annotations

import dataclasses
from typing import Any

import flat_cards
import numpy as np
import pytest
from flat_cards import camera, mesh_of, snapshot_of

from hairloom.addon.render.camera import Camera, look_at, orthographic
from hairloom.addon.render.snapshot import SKIN, MeshSnapshot
from hairloom.addon.shading.lights import Light
from hairloom.addon.shading.marschner.look import fibre_of, root_absorption, strand_angles
from hairloom.addon.shading.marschner.tables import PREVIEW_SIZE, marschner_tables
from hairloom.addon.shading.settings import ShadingSettings
from hairloom.addon.shading.skin_seen import SkinSeen
from hairloom.addon.shading.textures import HairTextures
from hairloom.addon.shading.volume.card_opacity import (
    MAX_ALPHA,
    tau_within_card,
    tau_within_card_at_depth,
)
from hairloom.addon.shading.volume.dual import fractions, fractions_at, reflected_by_far_skin
from hairloom.addon.shading.volume.settings import VolumeSettings
from hairloom.addon.strands import Surface

pytestmark = pytest.mark.usefixtures("gpu_context")

SIZE = 32
FORMS = ["slices", "deep"]
#: shines from the eye, along +y
SUN = Light.sun((0.0, 1.0, 0.0), (1.0, 1.0, 1.0), 3.0)
PLAIN = ShadingSettings(base_color=(0.5, 0.4, 0.3))


def card(low: float, high: float, y: float, u: tuple[float, float] = (0.0, 1.0)) -> Any:
    """A card from x = low to high, z from 0 to 1. If low > high, it faces +y."""
    made = flat_cards.card((low, 0.0), (high, 1.0), y, u=u)
    return made if low < high else {**made, "normal": -made["normal"]}


def textures_of(alpha: Any) -> HairTextures:
    """Textures of one colour; `alpha` from u = 0 to u = 1."""
    alpha = np.repeat(np.atleast_2d(np.float32(alpha)), 2, axis=0)
    half = np.full((2, 2), 0.5, np.float32)
    white = np.ones((2, 2, 3), np.float32)
    return HairTextures(white, alpha, half, half, np.full((2, 2, 3), 0.5, np.float32))


def behind() -> Any:
    """A camera that sees the cards from the dark side, with x from right to left."""
    return camera(3.0)


def drawn(frame: Any, mesh: Any, textures: Any, volume: VolumeSettings, **more: Any) -> np.ndarray:
    settings = {"lights": (SUN,), "ambient": (0.0, 0.0, 0.0), "shading": PLAIN, **more}
    snapshot = snapshot_of(mesh, textures, volume=volume, **settings)
    picture: np.ndarray = frame.render_image(snapshot, behind(), SIZE, SIZE, 1)
    assert np.isfinite(picture).all()
    return picture


def of_form(form: str, **more: Any) -> VolumeSettings:
    return VolumeSettings(shadows=form, resolution=64, scattering=False, **more)


@pytest.mark.alike
@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("alpha", [0.3, 0.7, 1.0])
@pytest.mark.parametrize("model", ["kajiya_kay", "marschner"])
def test_a_card_behind_cards_has_the_light_that_they_leave(
    frame: Any, form: str, alpha: float, model: str
) -> None:
    """Against (1 - alpha)^2 where two cards are before a third one, which faces away from them, and
    against the light without them where none is."""
    look = dataclasses.replace(PLAIN, model=model)
    back = card(1.0, 0.0, 0.6, (1.0, 1.0))
    back["normal"] = -back["normal"]  # to the light
    fronts = [card(0.0, 0.5, y, (0.0, 0.0)) for y in (0.0, 0.2)]
    # the last one is the only opaque one
    textures = textures_of([alpha, 1.0])
    found, alone = (
        drawn(frame, mesh_of(*cards), textures, of_form(form), shading=look)[16, :, 0]
        for cards in ((*fronts, back), (back,))
    )
    left = (1.0 - min(alpha, MAX_ALPHA)) ** 2
    assert alone.min() > 0.01
    # seen from behind, x runs to the left
    assert found[20:30] / alone[20:30] == pytest.approx(left, rel=0.02, abs=1e-3)
    assert found[2:12] == pytest.approx(alone[2:12], rel=0.02)


@pytest.mark.parametrize("low", [0.3, 0.505, 0.51])
def test_a_card_thinner_than_a_texel_takes_its_part_of_soft_light(frame: Any, low: float) -> None:
    """Against the light on its own area: without turned maps it would hit a row of texels, or
    none."""
    from hairloom.addon.render.card_pass import CardPass
    from hairloom.addon.render.mesh_pass import MeshPass
    from hairloom.addon.render.strand_pass import StrandPass

    width, alpha, samples = 0.01, 0.3, 6
    back = card(1.0, 0.0, 0.6, (1.0, 1.0))
    back["normal"] = -back["normal"]
    sun = dataclasses.replace(SUN, angle=1e-4)
    textures = textures_of([alpha, 1.0])
    found, alone = (
        frame.render_still(
            snapshot_of(
                mesh_of(*cards),
                textures,
                volume=of_form("slices"),
                lights=(sun,),
                ambient=(0.0, 0.0, 0.0),
                shading=PLAIN,
            ),
            behind(),
            *(SIZE, SIZE, samples),
            center=np.full(3, 0.5),
            passes=(MeshPass(), StrandPass()),
            card_pass=CardPass(),
        )[8:24, :, 0]
        for cards in ((card(low, low + width, 0.0, (0.0, 0.0)), back), (back,))
    )
    assert 1.0 - found.sum() / alone.sum() == pytest.approx(alpha * width, rel=0.25)


@pytest.mark.parametrize("form", FORMS)
def test_thin_cards_take_less_of_the_light(frame: Any, form: str) -> None:
    """tau is scaled by the thickness, of cards in front and of the card itself."""
    back = card(1.0, 0.0, 0.6, (1.0, 1.0))
    back["normal"] = -back["normal"]
    mesh = mesh_of(card(0.0, 0.5, 0.0, (0.0, 0.0)), back)
    snapshot = snapshot_of(
        mesh,
        textures_of([0.7, 1.0]),
        volume=of_form(form),
        lights=(SUN,),
        ambient=(0.0, 0.0, 0.0),
        shading=PLAIN,
    )
    thin = dataclasses.replace(snapshot.cards, thickness=0.25)
    shown = dataclasses.replace(snapshot, cards=thin)
    found = frame.render_image(shown, behind(), SIZE, SIZE, 1)[16, :, 0]
    whole = dataclasses.replace(snapshot, volume=VolumeSettings(shadows="none"))
    open_light = frame.render_image(whole, behind(), SIZE, SIZE, 1)[16, :, 0]
    assert found[20:30] / open_light[20:30] == pytest.approx(0.3**0.25, rel=0.02)
    assert found[2:12] == pytest.approx(open_light[2:12], rel=0.02)


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("turn", [0.0, 1.1])
def test_view_compensated_cards_shade_equally_from_all_sides_of_their_strands(
    frame: Any, form: str, turn: float
) -> None:
    """A card turned about its strands before a wall of hair without self-shadowing."""
    wall = card(1.0, 0.0, 2.0, (1.0, 1.0))
    wall["normal"] = -wall["normal"]
    turned = card(0.0, 1.0, 0.0, (0.0, 0.0))
    x = turned["positions"][:, 0] - 0.5
    turned["positions"] = turned["positions"] * [0.0, 0.0, 1.0]
    turned["positions"][:, 0] = 0.5 + x * np.cos(turn)
    turned["positions"][:, 1] = 0.7 + x * np.sin(turn)
    found = []
    for cards in ((turned, wall), (wall,)):
        snapshot = snapshot_of(
            mesh_of(*cards),
            textures_of([0.6, 1.0]),
            volume=of_form(form),
            lights=(SUN,),
            ambient=(0.0, 0.0, 0.0),
            shading=PLAIN,
        )
        even = dataclasses.replace(snapshot.cards, is_view_compensated=True)
        shown = dataclasses.replace(snapshot, cards=even)
        found.append(frame.render_image(shown, behind(), SIZE, SIZE, 1)[16, 14:18, 0])
    left = 0.4 ** (2.0 / np.pi / np.cos(turn))
    assert found[1].min() > 0.01
    assert found[0] / found[1] == pytest.approx(left, rel=0.03)


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("depth", [0.0, 0.5])
def test_strands_of_a_deep_card_lie_in_front_of_the_visible_one(
    frame: Any, form: str, depth: float
) -> None:
    """On a card that faces eye and light: with long hair some strands are before the seen one, with
    short hair none."""
    alpha, volume = 0.9, of_form(form, bias=1.0e-6)
    deep = np.full(4, depth, np.float32)
    mesh = mesh_of(card(0.0, 1.0, 1.0))
    options: dict[str, Any] = {"lights": (SUN,), "ambient": (0.0, 0.0, 0.0), "shading": PLAIN}
    even = {"is_view_compensated": True, "depth": deep}
    shown, bare = (
        frame.render_image(
            snapshot_of(mesh, textures_of([alpha, alpha]), volume=each, cards=even, **options),
            camera(),
            SIZE,
            SIZE,
            1,
        )[16, 8:24, 0]
        for each in (volume, dataclasses.replace(volume, extinction=1.0e-6))
    )
    own = -np.log(1.0 - alpha) * 2.0 / np.pi
    before, _ = tau_within_card(own, own, 0.0, 1.0)
    expected = np.exp(-before) if depth else 1.0
    assert shown / bare == pytest.approx(expected, rel=0.03)


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("place", [0.4, 0.7])
def test_a_map_stores_how_deep_the_visible_strand_of_a_card_lies(
    frame: Any, form: str, place: float
) -> None:
    """Light from the eye's side meets more strands before a deeper one; from behind, the eye sees
    strands that the map does not store, and they have the average."""
    alpha, volume = 0.9, of_form(form, bias=1.0e-6)
    facing = card(0.0, 1.0, 1.0)
    turned = {**facing, "normal": -facing["normal"]}
    textures = textures_of([alpha, alpha])
    textures = dataclasses.replace(textures, place=np.full((2, 2), place, np.float32))
    options: dict[str, Any] = {"lights": (SUN,), "ambient": (0.0, 0.0, 0.0), "shading": PLAIN}
    even = {"is_view_compensated": True, "depth": np.full(4, 0.5, np.float32)}
    own = -np.log(1.0 - alpha) * 2.0 / np.pi
    unknown = tau_within_card(own, own, 0.0, 1.0)
    known = tau_within_card_at_depth(unknown, 2.0 * place - 1.0, 1.0)
    for each, (before, _) in ((facing, known), (turned, unknown)):
        shown, bare = (
            frame.render_image(
                snapshot_of(mesh_of(each), textures, volume=light, cards=even, **options),
                camera(),
                SIZE,
                SIZE,
                1,
            )[16, 8:24, 0]
            for light in (volume, dataclasses.replace(volume, extinction=1.0e-6))
        )
        assert shown / bare == pytest.approx(np.exp(-before), rel=0.03)


def test_light_is_looked_up_at_the_visible_strand(frame: Any) -> None:
    """Light from the side is blocked by a small card before the plane of another card. On a deep
    card, the foremost strands lie before the small card and are lit."""
    mesh = mesh_of(card(0.0, 1.0, 1.0), card(0.0, 0.3, 0.8))
    sun = Light.sun((1.0, 1.0, 0.0), (1.0, 1.0, 1.0), 3.0)
    shade = []
    for depth in (0.0, 6.0):
        even = {"is_view_compensated": True, "depth": np.repeat(np.float32([depth, 0.0]), 4)}
        snapshot = snapshot_of(
            mesh,
            textures_of([0.9, 0.9]),
            volume=VolumeSettings(resolution=128, scattering=False, slices=24, shadows="slices"),
            cards=even,
            lights=(sun,),
            ambient=(0.0, 0.0, 0.0),
            shading=PLAIN,
        )
        row = frame.render_image(snapshot, camera(), 64, 64, 1)[32, :, 0]
        shade.append(row[24:28].mean() / row[44:56].mean())
    assert shade[0] < 0.6
    assert shade[1] > 0.95


@pytest.mark.parametrize("form", FORMS)
def test_clumps_finer_than_a_texel_block_their_mean_tau(frame: Any, form: str) -> None:
    """Sixteen locks across a card, finer than the map's texels: the wall behind gets their mean
    tau, not the tau of their mean alpha."""
    stripes = np.tile(np.repeat([0.1, 0.9], 32), 8)
    textures = textures_of(np.append(stripes, np.ones(512)))
    textures = dataclasses.replace(textures, alpha=np.repeat(textures.alpha, 256, axis=0))
    wall = card(1.0, 0.0, 0.6, (0.75, 0.75))
    wall["normal"] = -wall["normal"]
    far = card(9.0, 8.0, 0.6, (0.75, 0.75))
    locks = card(0.0, 1.0, 0.0, (0.0, 0.5))
    found, alone = (
        drawn(frame, mesh_of(*cards), textures, of_form(form))[4:28, 4:28, 0]
        for cards in ((locks, wall, far), (wall, far))
    )
    tau = 0.5 * -(np.log(0.1) + np.log(0.9))
    assert -np.log(found / alone).mean() == pytest.approx(tau, rel=0.1)
    assert tau > 1.5 * -np.log(0.5)


@pytest.mark.parametrize("form", FORMS)
def test_cards_shade_the_skin_and_a_mesh_shades_cards(frame: Any, form: str) -> None:
    def wall(y: float, low: float, high: float) -> Any:
        corners = np.array([[low, y, -1], [high, y, -1], [high, y, 2], [low, y, 2]], np.float32)
        surface = Surface(corners, np.array([[0, 1, 2], [0, 2, 3]], np.int32))
        return MeshSnapshot.of(surface, color=(0.5, 0.5, 0.5))

    mesh, textures = mesh_of(card(0.0, 0.5, 0.0)), textures_of([0.6, 0.6])
    skin = wall(0.3, -1.0, 2.0)
    front = Camera(
        look_at((0.5, -3.0, 0.5), (0.5, 0.0, 0.5), up=(0.0, 0.0, 1.0)),
        orthographic(1.0, 1.0, 0.0, 9.0),
    )
    # the wall as seen past the cards
    past = Camera(look_at((2.5, -1.0, 0.5), (0.4, 0.3, 0.5)), orthographic(1.0, 1.0, 0.0, 9.0))

    def seen(volume: VolumeSettings, camera: Any, **more: Any) -> np.ndarray:
        snapshot = snapshot_of(
            mesh, textures, lights=(SUN,), ambient=(0, 0, 0), shading=PLAIN, volume=volume, **more
        )
        picture: np.ndarray = frame.render_image(snapshot, camera, SIZE, SIZE, 1)
        return picture[..., 0]

    lit, shaded = (seen(each, past, meshes=(skin,)) for each in (of_form("none"), of_form(form)))
    ratio = shaded / np.maximum(lit, 1e-9)
    assert ratio[lit > 0.0].max() > 0.99
    assert ratio[lit > 0.0].min() == pytest.approx(0.4, abs=0.02)
    hidden = seen(
        of_form(form), front, meshes=(wall(9.0, -1, 2),), casters=(wall(-1, 0, 2).surface,)
    )
    assert hidden[:, 3:13].max() < 1e-6
    shown = seen(of_form(form), front, meshes=(wall(9.0, -1, 2),))
    assert shown[:, 3:13].min() > 0.01


def test_light_from_strand_to_strand_brightens_light_cards_and_not_black(frame: Any) -> None:
    mesh = mesh_of(*(card(0.0, 1.0, 0.1 * layer) for layer in range(4)))
    gain = []
    for melanin in (0.1, 1.0):
        look = dataclasses.replace(
            PLAIN, model="marschner", pigment="melanin", melanin=melanin, fake_scattering=0.0
        )
        alone, among = (
            drawn(frame, mesh, textures_of([0.6, 0.6]), volume, shading=look)[..., 0].mean()
            for volume in (of_form("deep"), dataclasses.replace(of_form("deep"), scattering=True))
        )
        gain.append(among - alone)
    assert gain[0] > 0.02 and abs(gain[1]) < 0.02 * gain[0]


def test_cards_gain_the_light_off_far_skin_of_the_reference(frame: Any) -> None:
    """Also with a tangent not perpendicular to the normal, as CardMesh.axes uses it."""
    bent = {**card(1.0, 0.0, 0.0), "tangent": np.repeat([[0.0, 0.6, -0.8]], 4, axis=0)}
    mesh, textures = mesh_of(bent), textures_of([1.0, 1.0])
    look = dataclasses.replace(
        PLAIN, model="marschner", pigment="melanin", melanin=0.3, grey_fraction=0.0, tip_tint=0.0
    )
    received, depth = np.array([0.6, 0.15, 0.8, 0.4]), 2.0
    seen = np.tile(np.float32([*received, 0.0, 0.5, 0.1, depth]), (4, 1))
    options: dict[str, Any] = {
        "casters": (Surface(np.float32([[9, 9, 9], [9, 9, 8], [9, 8, 9]]), np.array([[0, 1, 2]])),),
        "shading": look,
        "table_size": PREVIEW_SIZE,
    }
    volume = dataclasses.replace(of_form("deep"), scattering=True)
    lit, unlit = (
        drawn(frame, mesh, textures, volume, cards={"skin_seen": each}, **options)
        for each in (seen, seen * np.float32([0, 0, 0, 0, 1, 1, 1, 1]))
    )
    axes = np.array([each[0] for each in mesh.axes], np.float64)
    world = SkinSeen(np.array([received[0], *(received[1:] @ axes)]), np.array(depth), np.zeros(3))
    tangent, normal = mesh.tangent[0].astype(np.float64), mesh.normal[0].astype(np.float64)
    toward = np.array([0.0, -1.0, 0.0])
    eye = np.array([0.0, 1.0, 0.0])
    theta_i, theta_r, _ = strand_angles(tangent, normal, toward, eye, np.array(0.5), look)
    sides = fractions(marschner_tables(fibre_of(look), PREVIEW_SIZE))
    lobes = (
        fractions_at(side, np.cos(0.5 * (theta_r - theta_i)), root_absorption(look))
        for side in (sides.forward, sides.backward)
    )
    expected = 3.0 * reflected_by_far_skin(
        np.array(normal @ eye), *lobes, toward, world, np.array(SKIN)
    )
    found = (lit - unlit)[SIZE // 2, SIZE // 2, :3]
    assert expected.max() > 0.01
    np.testing.assert_allclose(found, expected, rtol=0.01)


def test_maps_are_drawn_again_only_when_something_changed(gpu_context: Any) -> None:
    from hairloom.addon.render.card_pass import CardPass

    cards = CardPass()
    mesh, volume = mesh_of(card(0.0, 1.0, 0.0)), of_form("deep")
    first = snapshot_of(mesh, textures_of([1.0, 1.0]), lights=(SUN,), volume=volume)
    maps = cards.opacity(first)
    assert maps is not None and cards.opacity(first) is maps
    other = dataclasses.replace(first.cards, textures=textures_of([0.5, 0.5]))
    again = cards.opacity(dataclasses.replace(first, cards=other))
    assert again is not maps
    assert cards.opacity(dataclasses.replace(first, volume=VolumeSettings(shadows="none"))) is None
