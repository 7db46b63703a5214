"""Hair cards as GLB in independent programs: Khronos's validator and Panda3D."""

from __future__ import annotations

import importlib.util
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from glb_files import validator_report, write_glb
from guide_cards import build_cards

from hairloom.addon.cards.card_mesh import CardMesh
from hairloom.addon.cards.settings import CardSettings
from hairloom.addon.cards.sort import card_orders, with_triangle_order
from hairloom.addon.shading.texture_settings import TextureSettings
from hairloom.addon.shading.textures import hair_textures

pytest.importorskip("bpy", reason="writing a GLB needs Blender or the bpy module")


PANDA_VIEW = Path(__file__).parent / "panda_view.py"


@pytest.fixture(scope="module")
def curtain() -> tuple[CardMesh, np.ndarray]:
    """Sorted cards around a circle, and their texture, which fades out at the tips."""
    angle = np.linspace(0.0, 2.0 * np.pi, 40, endpoint=False)
    out = np.stack([np.cos(angle), np.sin(angle), np.zeros(40)], axis=-1)
    fall = np.linspace([0.0, 0.0, 0.1], [0.0, 0.0, -0.1], 8)
    guides = out[:, None] * 0.1 + fall + out[:, None] * np.linspace(0.0, 0.05, 8)[:, None] ** 2
    settings = CardSettings(width_factor=1.5)
    mesh = build_cards(guides.astype(np.float32), out.astype(np.float32), settings)
    texture = hair_textures(TextureSettings(variant_width=16, height=64), mesh.atlas.columns).card
    return with_triangle_order(mesh, card_orders(mesh, None).front), texture


@pytest.mark.parametrize("portable", [True, False])
@pytest.mark.parametrize("has_texture", [True, False])
def test_khronos_validator_finds_no_fault(
    curtain: tuple[CardMesh, np.ndarray], tmp_path: Path, portable: bool, has_texture: bool
) -> None:
    mesh, texture = curtain
    path = tmp_path / "cards.glb"
    write_glb(path, mesh, texture if has_texture else None, portable=portable)
    report = validator_report(path)
    assert (report["issues"]["numErrors"], report["issues"]["numWarnings"]) == (0, 0), report
    assert report["info"]["totalTriangleCount"] == len(mesh.triangles)


def test_khronos_validator_sees_a_damaged_file(
    curtain: tuple[CardMesh, np.ndarray], tmp_path: Path
) -> None:
    """A damaged file, which shows that the test above can fail."""
    path = tmp_path / "cards.glb"
    write_glb(path, curtain[0], None)
    path.write_bytes(path.read_bytes().replace(b'"VEC3"', b'"VEC5"', 1))
    assert validator_report(path)["issues"]["numErrors"] > 0


def drawn_by_panda(path: Path, size: int, extent: float) -> np.ndarray:
    """Panda3D's picture, looking along +Y at the origin, (size, size, 3), row 0 at the bottom."""
    for module in ("panda3d", "gltf"):
        if importlib.util.find_spec(module) is None:
            pytest.skip(f"{module} is missing: `make setup` installs it")
    picture = path.with_suffix(".npy")
    command = [sys.executable, str(PANDA_VIEW), str(path), str(picture), str(size), str(extent)]
    result = subprocess.run(command, capture_output=True, text=True, timeout=120)
    assert result.returncode == 0, result.stderr
    return np.load(picture)[..., :3] / 255.0


def area_of(one: np.ndarray, two: np.ndarray) -> np.ndarray:
    return one[..., 0] * two[..., 1] - one[..., 1] * two[..., 0]


def filtered(texture: np.ndarray, uv: np.ndarray) -> np.ndarray:
    """Bilinear texture lookup, clamped at the edges, as engines filter."""
    height, width = texture.shape[:2]
    place = uv * (width, height) - 0.5
    low = np.floor(place).astype(int)
    column, row = low[..., 0], low[..., 1]
    x, y = np.moveaxis((place - low)[..., None], -2, 0)

    def texel(at: np.ndarray, across: np.ndarray) -> np.ndarray:
        return texture[at.clip(0, height - 1), across.clip(0, width - 1)]

    def mixed(at: np.ndarray) -> np.ndarray:
        return texel(at, column) * (1.0 - x) + texel(at, column + 1) * x

    return mixed(row) * (1.0 - y) + mixed(row + 1) * y


def composed(mesh: CardMesh, texture: np.ndarray, size: int, extent: float) -> np.ndarray:
    """The same picture, triangle by triangle: filtered texture, depth test and write, blend over.

    Filtering matters most for alpha: a pixel of tiny alpha still writes depth and hides everything
    that is drawn later behind it. The number of such pixels depends on the order of the cards.
    """
    picture, depth = np.zeros((size, size, 3)), np.full((size, size), np.inf)
    pixel = (mesh.positions[:, [0, 2]].astype(np.float64) / extent + 0.5) * size - 0.5
    for triangle in mesh.triangles:
        a, b, c = pixel[triangle]
        low = np.ceil(np.minimum(np.minimum(a, b), c)).astype(int).clip(0)
        high = np.floor(np.maximum(np.maximum(a, b), c)).astype(int).clip(max=size - 1) + 1
        (x, y), area = np.mgrid[low[0] : high[0], low[1] : high[1]], area_of(b - a, c - a)
        at = np.stack([x, y], axis=-1)
        weight = np.stack([area_of(c - b, at - b), area_of(a - c, at - c)], axis=-1) / area
        weight = np.concatenate([weight, 1.0 - weight.sum(axis=-1, keepdims=True)], axis=-1)
        y_depth, uv = weight @ mesh.positions[triangle, 1], weight @ mesh.uv[triangle]
        texel = filtered(texture, uv)
        shown = (weight >= 0.0).all(axis=-1) & (y_depth < depth[y, x]) & (texel[..., 3] > 0.0)
        x, y, alpha = x[shown], y[shown], texel[shown][:, 3:]
        picture[y, x] = picture[y, x] * (1.0 - alpha) + texel[shown][:, :3] * alpha
        depth[y, x] = y_depth[shown]
    return picture


def test_panda3d_draws_what_a_slow_compositor_draws(
    curtain: tuple[CardMesh, np.ndarray], tmp_path: Path
) -> None:
    mesh, texture = curtain
    path = tmp_path / "cards.glb"
    write_glb(path, mesh, texture)
    drawn, expected = drawn_by_panda(path, 400, 0.3), composed(mesh, texture, 400, 0.3)
    upside_down = composed(mesh, texture[::-1], 400, 0.3)

    def overlap(other: np.ndarray) -> float:
        one, two = drawn.max(axis=-1) > 0.2, other.max(axis=-1) > 0.2
        return (one & two).sum() / (one | two).sum()

    assert 0.1 < (expected.max(axis=-1) > 0.2).mean() < 0.9
    assert overlap(expected) > 0.96  # measured 0.978; 0.89 with a compositor that does not filter
    assert overlap(upside_down) < 0.7
    assert np.abs(drawn - expected).mean() < 0.01
    assert np.abs(drawn - upside_down).mean() > 0.1


@pytest.mark.slow(instead="test_panda3d_draws_what_a_slow_compositor_draws")
def test_panda3d_composes_what_a_slow_compositor_composes(
    curtain: tuple[CardMesh, np.ndarray], tmp_path: Path
) -> None:
    """Each card has one colour and alpha, so that texture filters make no difference."""
    mesh, _ = curtain
    random, columns = np.random.default_rng(7), mesh.atlas.columns
    colors = np.concatenate([random.random((columns, 3)), np.full((columns, 1), 0.5)], axis=1)
    flat = np.tile(colors.repeat(16, axis=0), (16, 1, 1)).astype(np.float32)
    middle = (np.floor(mesh.uv[:, 0] * columns).clip(0, columns - 1) + 0.5) / columns
    card_middle = np.zeros(int(mesh.card.max()) + 1)
    card_middle[mesh.card] = middle[mesh.triangles].min(axis=1)
    owner = np.zeros(len(mesh.positions), int)
    owner[mesh.triangles] = mesh.card[:, None]
    plain = replace(mesh, uv=np.stack([card_middle[owner], np.full(len(owner), 0.5)], axis=1))
    path = tmp_path / "plain.glb"
    write_glb(path, plain, flat)

    def off(other: CardMesh) -> float:
        expected = composed(other, flat, 400, 0.3)
        return (np.abs(drawn - expected).max(axis=-1) > 4.0 / 255.0).mean()

    drawn = drawn_by_panda(path, 400, 0.3)
    assert (drawn.max(axis=-1) > 0.1).mean() > 0.1
    assert off(plain) < 0.01
    other_order = replace(plain, triangles=plain.triangles[::-1], card=plain.card[::-1])
    assert off(other_order) > 0.05


@pytest.mark.slow(instead="test_panda3d_draws_what_a_slow_compositor_draws")
def test_panda3d_blends_in_index_order(tmp_path: Path) -> None:
    """Four sheets of one colour each, one behind another: their blend shows the order."""
    depths = [0.3, 0.1, 0.2, 0.0]  # the viewer is at -y, so this is no depth order
    guides = np.array([[[0, y, 0.1], [0, y, -0.1]] for y in depths], np.float32)
    settings = CardSettings(segment_count=1, column_count=1, tip_width=1.0, bend=0.0)
    mesh = build_cards(guides, np.tile([0.0, -1.0, 0.0], (4, 1)), settings)
    colors = np.array([[1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 1, 1]], np.float32)
    flat = np.concatenate([colors, np.full((4, 1), 0.5)], axis=1).repeat(16, axis=0)
    texture = np.tile(flat, (16, 1, 1))
    uv = np.stack([np.repeat((np.arange(4) + 0.5) / 4, 4), np.full(16, 0.5)], axis=1)

    def drawn(order: list[int]) -> np.ndarray:
        triangles = mesh.triangles.reshape(4, 2, 3)[order].reshape(-1, 3)
        write_glb(tmp_path / "sheets.glb", replace(mesh, triangles=triangles, uv=uv), texture)
        return drawn_by_panda(tmp_path / "sheets.glb", 64, 0.1)[32, 32]

    def blended(order: list[int]) -> np.ndarray:
        color, nearest = np.zeros(3), np.inf
        for card in order:
            if depths[card] < nearest:  # Panda3D writes depth
                color, nearest = 0.5 * color + 0.5 * colors[card], depths[card]
        return color

    for order in ([0, 2, 1, 3], [2, 0, 1, 3], [1, 0, 3, 2]):
        np.testing.assert_allclose(drawn(order), blended(order), atol=2.0 / 255.0)
