"""Packing presets: the content of each channel, the differences between engines, and unpacking."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from hairloom.addon.cards.atlas_maps import MAP_NAMES
from hairloom.addon.errors import HairloomError
from hairloom.addon.exchange.textures.texture_packing import (
    MAP_MEANINGS,
    PRESETS,
    pack_textures,
    texture_layouts,
)

COLORS = ("color", "base")
THREE = ("color", "base", "normal", "tangent")


def random_maps() -> dict[str, np.ndarray]:
    random = np.random.default_rng(8)
    shapes = {name: (5, 7, 3) if name in THREE else (5, 7) for name in MAP_MEANINGS}
    return {name: random.random(shape).astype(np.float32) for name, shape in shapes.items()}


def channel(preset: str, suffix: str, letter: str, maps: dict[str, np.ndarray]) -> np.ndarray:
    (texture,) = [each for each in pack_textures(maps, preset) if each.suffix == suffix]
    return texture.pixels[..., "rgba".index(letter)]


@pytest.mark.parametrize("preset", PRESETS)
def test_unpacking_by_the_roles_gives_the_maps_back(preset: str) -> None:
    """Using only the words of the sidecar."""
    maps, found = random_maps(), {}
    for texture in pack_textures(maps, preset):
        assert texture.pixels.shape == (5, 7, len(texture.roles))
        assert texture.pixels.dtype == np.float32
        for index, role in enumerate(texture.roles.values()):
            values = texture.pixels[..., index]
            if constant := re.fullmatch(r"always ([\d.]+)", role):
                assert (values == float(constant[1])).all()
                continue
            name, _, about = role.partition(": ")
            axis = ""
            if name in THREE:
                axis = re.search(r"\b(red|green|blue|x|y|z)\b", about)[1]
            is_inverted = about.startswith(("0.5 - 0.5", "1 - "))
            found[name, axis] = 1.0 - values if is_inverted else values
    assert len(found) >= 7
    for (name, axis), values in found.items():
        original = maps[name]
        if axis:
            original = (
                original[..., ("red green blue" if name in COLORS else "xyz").split().index(axis)]
                if name in COLORS
                else original[..., "xyz".index(axis)]
            )
        np.testing.assert_allclose(values, original, atol=1e-6)


def test_the_names_and_channels_that_unreal_asks_for() -> None:
    """Against the slot names of its layouts "Card Default" and "Card Compact"."""
    slots = {
        "_Depth": "depth",
        "_Coverage": "alpha",
        "_Tangent": "tangent tangent tangent",
        "_Attributes": "always along strand_id",
        "_Material": "color color color roughness",
        "_Auxiliary": "occlusion shift noise always",
    }
    compact = {
        "_TangentCoordU": "tangent tangent tangent along",
        "_CoverageDepthSeed": "alpha depth strand_id",
        "_ColorRoughness": "color color color roughness",
    }
    for preset, expected in (("unreal", slots), ("unreal_compact", compact)):
        found = {
            layout.suffix: " ".join(role.split(":")[0].split()[0] for role in layout.roles.values())
            for layout in PRESETS[preset]
        }
        assert found == expected | {"_base": "base base base"}  # for our own shaders


@pytest.mark.parametrize(
    ("preset", "suffix", "is_down"),
    [
        ("hairloom", "_normal", False),
        ("gltf", "_normal", False),
        ("unity_hdrp", "_NormalMap", False),
        ("godot", "_normal", False),
        ("hairloom", "_tangent", False),
        ("unity_hdrp", "_HairStrandDirection", False),
        ("unreal", "_Tangent", True),
        ("unreal_compact", "_TangentCoordU", True),
    ],
)
def test_green_runs_as_the_engine_has_it(preset: str, suffix: str, is_down: bool) -> None:
    """Upwards, except in Unreal: a direction that leans towards the tip has green above 0.5."""
    maps = random_maps()
    up = np.array([0.6, 0.8, 0.0]) * 0.5 + 0.5
    maps["normal"] = maps["tangent"] = np.broadcast_to(up, (5, 7, 3)).astype(np.float32)
    green = channel(preset, suffix, "g", maps)
    np.testing.assert_allclose(green, 0.1 if is_down else 0.9, atol=1e-6)
    np.testing.assert_allclose(channel(preset, suffix, "r", maps), 0.8, atol=1e-6)


@pytest.mark.parametrize(("preset", "suffix"), [("gltf", "_anisotropy"), ("godot", "_flow")])
def test_anisotropy_stretches_highlights_across_strands(preset: str, suffix: str) -> None:
    """KHR_materials_anisotropy stores the direction of the greater roughness, across the strand.

    It is at a right angle to the strand's direction. Strength is 1 in the channel that the engine
    reads: blue in glTF, alpha in Godot.
    """
    maps = random_maps()
    angle = np.random.default_rng(1).uniform(-np.pi, np.pi, (5, 7))
    tangent = np.stack([np.cos(angle), np.sin(angle), np.zeros_like(angle)], axis=-1)
    maps["tangent"] = (0.5 * tangent + 0.5).astype(np.float32)
    red, green = (2.0 * channel(preset, suffix, letter, maps) - 1.0 for letter in "rg")
    np.testing.assert_allclose(red * tangent[..., 0] + green * tangent[..., 1], 0.0, atol=1e-6)
    np.testing.assert_allclose(red**2 + green**2, 1.0, atol=1e-6)
    maps["tangent"] = np.broadcast_to([0.5, 1.0, 0.5], (5, 7, 3)).astype(np.float32)
    np.testing.assert_allclose(channel(preset, suffix, "r", maps), 1.0)  # along u: the TANGENT
    np.testing.assert_allclose(channel(preset, suffix, "g", maps), 0.5)
    assert (channel(preset, suffix, "b" if preset == "gltf" else "a", maps) == 1.0).all()


@pytest.mark.parametrize("preset", PRESETS)
def test_colours_are_srgb_and_nothing_else_is(preset: str) -> None:
    for layout in PRESETS[preset]:
        assert layout.is_color == bool(layout.sources & set(COLORS))
        assert layout.color_space == ("sRGB" if layout.is_color else "linear")
        assert layout.depth in ("uint8", "uint16")
        assert layout.has_coverage == (layout.roles.get("a") == "alpha: coverage")
        assert not layout.is_normal_map or layout.sources == {"normal"}


@pytest.mark.parametrize("preset", PRESETS)
def test_every_preset_has_what_a_card_needs(preset: str) -> None:
    held = set().union(*(layout.sources for layout in PRESETS[preset]))
    assert {"alpha", "color", "base", "tangent"} <= held <= set(MAP_MEANINGS)
    suffixes = [layout.suffix for layout in PRESETS[preset]]
    assert len({suffix.lower() for suffix in suffixes}) == len(suffixes)


def test_all_maps_of_an_atlas_can_be_packed() -> None:
    assert set(MAP_NAMES) <= set(MAP_MEANINGS)
    held = set().union(*(layout.sources for layout in PRESETS["hairloom"]))
    assert held == set(MAP_MEANINGS) - {"roughness"}


def test_missing_maps_are_replaced_by_neutral_values() -> None:
    maps = {name: values for name, values in random_maps().items() if name in ("alpha", "color")}
    assert [each.suffix for each in texture_layouts("unreal", maps)] == ["_Coverage", "_Material"]
    (tangent,) = texture_layouts("unreal_compact", maps | {"along": maps["alpha"]})[:1]
    np.testing.assert_allclose(tangent.pack(maps)[0, 0], [0.5, 0.0, 0.5, 0.0])  # down is tipwards
    (orm,) = [each for each in PRESETS["gltf"] if each.suffix == "_occlusionRoughnessMetallic"]
    np.testing.assert_allclose(orm.pack(maps)[0, 0], [1.0, 0.4, 0.0])
    (normal,) = [each for each in PRESETS["gltf"] if each.suffix == "_normal"]
    np.testing.assert_allclose(normal.pack(maps)[0, 0], [0.5, 0.5, 1.0])


def test_invalid_maps_and_presets_are_refused() -> None:
    maps = random_maps()
    for wrong, problem in (
        ({}, "no maps"),
        ({"alpha": maps["alpha"], "gloss": maps["alpha"]}, "'gloss'"),
        ({"alpha": maps["alpha"], "base": maps["alpha"]}, "'base'"),
        ({"alpha": maps["alpha"], "depth": maps["depth"][1:]}, "'depth'"),
    ):
        with pytest.raises(HairloomError, match=problem):
            pack_textures(wrong, "gltf")
    with pytest.raises(HairloomError, match=r"'cryengine'.*hairloom, gltf, unreal"):
        pack_textures(maps, "cryengine")


def test_the_documentation_has_the_same_tables() -> None:
    """docs/card_textures.md has a row for each file."""
    page = Path(__file__).parents[3] / "docs" / "card_textures.md"
    sections = re.split(r"^### (\w+)$", page.read_text(encoding="utf-8"), flags=re.MULTILINE)
    written = dict(zip(sections[1::2], sections[2::2], strict=True))
    assert list(written) == list(PRESETS)
    axes = {"color": "rgb", "base": "rgb", "normal": "xyz", "tangent": "xyz"}
    for preset, section in written.items():
        rows = [[cell.strip() for cell in row.split("|")[1:-1]] for row in section.splitlines()
                if row.startswith("| `")]  # fmt: skip
        for row, layout in zip(rows, PRESETS[preset], strict=True):
            cells = [f"`{layout.suffix}`"]
            for held in layout.channels:
                axis = axes[held.source][held.component] if held.source in axes else ""
                sign = "-" if held.is_inverted else ""
                name = f"{held.source}.{axis}" if axis else held.source or f"{held.constant:g}"
                cells.append(sign + name)
            assert row == [*cells, *[""] * (5 - len(cells)), layout.color_space]
