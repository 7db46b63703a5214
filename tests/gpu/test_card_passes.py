"""The passes that draw cards, their states, and the orders of triangles."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Any

import flat_cards
import numpy as np
import pytest
from flat_cards import camera, card, constant_textures

from hairloom.addon.cards.card_mesh import CardMesh
from hairloom.addon.cards.drawing_settings import CardDrawingSettings
from hairloom.addon.render.camera import Camera, look_at, orthographic
from hairloom.addon.render.snapshot import MeshSnapshot
from hairloom.addon.shading.card_look import mapped_normal
from hairloom.addon.shading.kajiya_kay import kajiya_kay
from hairloom.addon.shading.lights import Light
from hairloom.addon.shading.settings import ShadingSettings
from hairloom.addon.shading.texture_settings import TextureSettings
from hairloom.addon.shading.textures import HairTextures, hair_textures
from hairloom.addon.strands import Surface

pytestmark = pytest.mark.usefixtures("gpu_context")

SIZE = 96
LIGHTS = (
    Light.sun((0.2, 0.7, -0.4), (1.0, 0.9, 0.8), 3.0),
    Light.point((0.3, -0.9, 0.9), (0.5, 0.7, 1.0), 8.0),
)
LOOK = {
    "lights": LIGHTS,
    "ambient": (0.1, 0.2, 0.3),
    "shading": ShadingSettings(model="kajiya_kay", base_color=(0.8, 0.6, 0.4)),
}
THREE = CardDrawingSettings(passes="three")
#: from the paper, for each pass: alpha test, colour, depth write, depth test, culled faces
PAPER = {
    "four": (
        (True, False, True, "LESS", "NONE"),
        (False, True, False, "EQUAL", "NONE"),
        (False, True, False, "LESS", "FRONT"),
        (False, True, True, "LESS", "BACK"),
    ),
    "three": (
        (True, True, True, "LESS", "NONE"),
        (True, True, False, "LESS", "FRONT"),
        (True, True, True, "LESS", "BACK"),
    ),
}


def mesh_of(*cards: tuple[float, float, float, float, float]) -> CardMesh:
    """Rectangles (low x, low z, high x, high z, y) that face -y, or +y if low x > high x."""
    return flat_cards.mesh_of(*(card((x0, z0), (x1, z1), y) for x0, z0, x1, z1, y in cards))


STACK = (
    (0.05, 0.05, 0.8, 0.8, 0.5),
    (0.1, 0.2, 0.7, 0.9, 0.4),
    (0.15, 0.1, 0.75, 0.95, 0.3),
    (0.3, 0.25, 0.95, 0.85, 0.2),
    (0.05, 0.3, 0.8, 0.7, 0.1),
)


def hairy() -> HairTextures:
    return hair_textures(TextureSettings(variant_width=24, height=24, strand_count=6), 1)


def snapshot_of(
    mesh: CardMesh,
    textures: HairTextures,
    drawing: CardDrawingSettings | None = None,
    *,
    back: Any = None,
    **more: Any,
) -> Any:
    cards = {"back_triangles": back, "drawing": drawing or CardDrawingSettings()}
    return flat_cards.snapshot_of(mesh, textures, cards=cards, **{**LOOK, **more})


def painted(frame: Any, cards: list[Any], view: Any, textures: HairTextures) -> np.ndarray:
    """Cards drawn one by one and composited in numpy, the farthest first."""
    picture = np.zeros((SIZE, SIZE, 4), np.float32)
    for each in cards:
        alone = frame.render_image(snapshot_of(mesh_of(each), textures), view, SIZE, SIZE, 1)
        picture = alone + picture * (1.0 - alone[..., 3:])
    return picture


@pytest.mark.parametrize("scheme", ["four", "three"])
@pytest.mark.parametrize("model", ["kajiya_kay", "marschner"])
def test_states_are_those_of_the_paper(
    frame: Any, monkeypatch: Any, scheme: str, model: str
) -> None:
    """The GPU state at each draw, with `skip_clear` as in the paper."""
    from hairloom.addon.render import card_pass

    now: dict[str, Any] = {}
    drawn = []
    state = card_pass.gpu.state
    for name in ("depth_test", "depth_mask", "blend", "face_culling", "color_mask"):
        real = getattr(state, f"{name}_set")

        def recorded(*values: Any, name: str = name, real: Any = real) -> None:
            now[name] = values
            real(*values)

        monkeypatch.setattr(state, f"{name}_set", recorded)

    class Batch:
        def draw(self, shader: Any) -> None:
            drawn.append(dict(now))

    programs = []
    real_bound = card_pass.bound

    def bound(*given: Any, **own: Any) -> Any:
        shader = real_bound(*given, **own)
        programs.append(shader.recipe)
        return shader

    monkeypatch.setattr(card_pass, "bound", bound)
    monkeypatch.setattr(
        card_pass.CardBatches, "sorted_batches", lambda *_: {"front": Batch(), "back": Batch()}
    )
    shading = dataclasses.replace(LOOK["shading"], model=model)
    drawing = CardDrawingSettings(passes=scheme, skip_clear=False)
    frame.render_image(
        snapshot_of(mesh_of(*STACK), hairy(), drawing, shading=shading), camera(), 8, 8, 1
    )
    found = tuple(
        (
            _tests_alpha(recipe),
            each["color_mask"] == (True,) * 4,
            each["depth_mask"][0],
            each["depth_test"][0],
            each["face_culling"][0],
        )
        for each, recipe in zip(drawn, programs, strict=True)
    )
    assert found == PAPER[scheme]
    blends = [each["blend"][0] for each in drawn]
    assert blends[-2:] == ["ALPHA_PREMULT"] * 2 and set(blends[:-2]) == {"NONE"}


def _tests_alpha(recipe: Any) -> bool:
    """Whether a program can discard, which the shader does in two branches."""
    defines = dict(recipe.defines)
    source = Path(recipe.folders[0] / recipe.fragment).read_text(encoding="utf-8")
    prime, shaded = source.split("#else\n#  include")
    assert prime.count("discard") == 1 and "#if PRIME" in prime
    clipped = shaded.split("#  if CLIPPED")[1].split("#  endif")[0]
    assert shaded.count("discard") == clipped.count("discard") == 1
    return bool(defines["PRIME"] or defines["CLIPPED"])


def test_three_passes_draw_the_same_where_nothing_overlaps(frame: Any) -> None:
    apart = mesh_of(
        (0.02, 0.02, 0.48, 0.48, 0.1), (0.98, 0.52, 0.52, 0.98, 0.3), (0.02, 0.52, 0.48, 0.98, 0.2)
    )
    four, three = (
        frame.render_image(snapshot_of(apart, hairy(), drawing), camera(), SIZE, SIZE, 1)
        for drawing in (None, THREE)
    )
    opaque = four[..., 3] == 1.0
    assert opaque.mean() > 0.01 and ((four[..., 3] > 0.0) & ~opaque).mean() > 0.15
    # only pixels below the minimum alpha or above the opaque one may differ
    assert np.abs(four - three).max() < 0.011
    assert np.abs(four - three).mean() < 1e-4


@pytest.mark.parametrize("drawing", [CardDrawingSettings(), THREE])
def test_a_head_hides_cards_behind_it(frame: Any, drawing: CardDrawingSettings) -> None:
    wall = np.array([[0, 0.25, 0], [1, 0.25, 0], [1, 0.25, 1], [0, 0.25, 1]], np.float32)
    head = MeshSnapshot.of(Surface(wall, np.array([[0, 1, 2], [0, 2, 3]])), color=(0.0, 0.0, 1.0))
    near = [each for each in STACK if each[4] < 0.25]
    view = camera()
    with_all, with_near = (
        frame.render_image(
            snapshot_of(mesh_of(*cards), hairy(), drawing, meshes=(head,)), view, SIZE, SIZE, 1
        )
        for cards in (STACK, near)
    )
    np.testing.assert_array_equal(with_all, with_near)
    assert len(near) == 2


@pytest.mark.parametrize("passes", ["four", "three"])
@pytest.mark.parametrize("y", [-1.0, 2.0])
def test_the_order_of_a_view_is_the_painters(frame: Any, y: float, passes: str) -> None:
    """For cards in any order in the mesh, seen from the front and from +y, from behind."""
    shuffled = [STACK[index] for index in (3, 0, 4, 2, 1)]
    view = camera(y)
    drawing = CardDrawingSettings(order="view", passes=passes)
    picture = frame.render_image(
        snapshot_of(mesh_of(*shuffled), hairy(), drawing), view, SIZE, SIZE, 1
    )
    far_first = sorted(STACK, key=lambda each: -each[4] if y < 0.0 else each[4])
    expected = painted(frame, far_first, view, hairy())
    # three passes drop pixels below the minimum alpha
    assert np.abs(picture - expected).max() < (1e-5 if passes == "four" else 0.02)
    static = frame.render_image(snapshot_of(mesh_of(*shuffled), hairy()), view, SIZE, SIZE, 1)
    assert np.abs(static - expected).max() > 0.1, "the mesh's own order must be wrong here"


def test_back_faces_have_an_order_of_their_own(frame: Any) -> None:
    """From behind, the order from the inside to the outside is nearest first."""
    mesh, view = mesh_of(*STACK), camera(2.0)
    expected = painted(frame, list(reversed(STACK)), view, hairy())
    # a card's two triangles do not overlap
    back = mesh.triangles[::-1]
    picture = frame.render_image(snapshot_of(mesh, hairy(), back=back), view, SIZE, SIZE, 1)
    assert np.abs(picture - expected).max() < 1e-5
    static = frame.render_image(snapshot_of(mesh, hairy()), view, SIZE, SIZE, 1)
    assert np.abs(static - expected).max() > 0.1


def test_an_order_goes_up_only_when_it_changes(frame: Any, monkeypatch: Any) -> None:
    from hairloom.addon.render import card_batches
    from hairloom.addon.render.card_pass import CardPass

    made = []
    real = card_batches.gpu_objects.index_buffer

    def counted(triangles: Any) -> Any:
        made.append(1)
        return real(triangles)

    monkeypatch.setattr(card_batches.gpu_objects, "index_buffer", counted)
    drawing, cards = CardDrawingSettings(order="view"), CardPass()
    mesh = mesh_of(*STACK)
    shown = snapshot_of(mesh, hairy(), drawing)
    moved = dataclasses.replace(mesh, positions=mesh.positions + np.float32(0.01))
    near = Camera(look_at((0.52, -1.0, 0.5), (0.5, 0.0, 0.5)), orthographic(1.0, 1.0, -3.0, 5.0))
    for snapshot, view, expected in (
        (shown, camera(), 1),
        (shown, camera(), 1),
        (shown, near, 1),
        (snapshot_of(moved, hairy(), drawing), near, 1),
        (shown, camera(2.0), 2),
    ):
        frame.render_image(snapshot, view, 8, 8, 1, card_pass=cards)
        assert len(made) == expected


def test_clear_pixels_hide_what_comes_later_only_without_the_test(frame: Any) -> None:
    """Why the last pass tests alpha by default: with the paper's states, clear parts of the nearest
    card hide cards that are drawn after it.
    """
    mesh = mesh_of((0.0, 0.0, 1.0, 1.0, 0.1), (0.0, 0.0, 1.0, 1.0, 0.5))
    mesh = dataclasses.replace(
        mesh, uv=np.repeat([[0.1, 0.5], [0.9, 0.5]], 4, axis=0).astype(np.float32)
    )
    alpha = np.repeat([[0.0, 0.0, 0.5, 0.5]], 4, axis=0).astype(np.float32)
    textures = dataclasses.replace(constant_textures(noise=0.5), alpha=alpha)
    for skip_clear, expected in ((True, 0.5), (False, 0.0)):
        drawing = CardDrawingSettings(skip_clear=skip_clear)
        shown = snapshot_of(mesh, textures, drawing)
        picture = frame.render_image(shown, camera(), 8, 8, 1)
        assert picture[..., 3] == pytest.approx(expected, abs=1e-3)


def test_a_normal_map_bends_the_normal(frame: Any) -> None:
    """The twin of `mapped_normal`, tested through the diffuse term."""
    texel = np.float32((0.8, 0.6, 0.85))
    bent = constant_textures(noise=0.5, normal=np.broadcast_to(texel, (4, 4, 3)))
    sun = Light.sun((-0.6, 0.7, -0.2), (1.0, 1.0, 1.0), 3.0)
    view, mesh = camera(), mesh_of((0.0, 0.0, 1.0, 1.0, 0.0))
    light = {"lights": (sun,), "ambient": (0.0, 0.0, 0.0)}
    flat, mapped = (
        frame.render_image(snapshot_of(mesh, textures, **light), view, 8, 8, 1)[4, 4, :3]
        for textures in (constant_textures(noise=0.5), bent)
    )
    normal, tangent = np.array([0.0, -1.0, 0.0]), np.array([0.0, 0.0, -1.0])
    to_light, to_eye = -np.array([-0.6, 0.7, -0.2]), np.array([0.0, -1.0, 0.0])
    to_light /= np.linalg.norm(to_light)
    half, look = np.array(0.5), LOOK["shading"]
    lit = [
        kajiya_kay(tangent, each, to_light, to_eye, half, half, look)
        for each in (normal, mapped_normal(texel, tangent, normal))
    ]
    assert mapped / flat == pytest.approx(lit[1] / lit[0], rel=2e-3)
    assert np.abs(mapped / flat - 1.0).max() > 0.1


def test_viewport_colors_are_encoded_before_they_are_premultiplied(frame: Any) -> None:
    """Colours as viewport handlers must write them: encoded unpremultiplied, then times alpha."""
    import gpu

    from hairloom.addon.exchange.textures.srgb import srgb_encoded
    from hairloom.addon.render.card_pass import CardPass

    dim = {"lights": (Light.sun((0.2, 0.7, -0.4), (1.0, 0.9, 0.8), 0.4),)}
    shown = snapshot_of(
        mesh_of((0.0, 0.0, 1.0, 1.0, 0.0)), constant_textures(alpha=0.5, noise=0.5), **dim
    )
    linear = frame.render_image(shown, camera(), 8, 8, 1)[4, 4]
    offscreen = gpu.types.GPUOffScreen(8, 8, format="RGBA32F")
    with offscreen.bind():
        gpu.state.active_framebuffer_get().clear(color=(0.0, 0.0, 0.0, 0.0), depth=1.0)
        CardPass().draw(shown, camera(), 8, 8, output="viewport")
    found = np.array(offscreen.texture_color.read()).reshape(8, 8, 4)[4, 4]
    offscreen.free()
    straight = linear[:3] / linear[3]
    assert found[:3] == pytest.approx(srgb_encoded(straight) ** 2.2 * 0.5, rel=5e-3)
    assert found[3] == pytest.approx(0.5, abs=1e-3)
