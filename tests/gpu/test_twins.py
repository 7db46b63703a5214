"""GLSL against its Python twins, value by value, and the layout of uniform blocks."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import pytest
from gpu_rounding import tolerance

from hairloom.addon.dynamics.colliders import (
    CapsuleCollider,
    Collider,
    DistanceField,
    PosedCollider,
    SphereCollider,
    SphereSetCollider,
    signed_distance,
)
from hairloom.addon.params import Settings, choice, color, integer, number, toggle
from hairloom.addon.params.glsl import struct_values
from hairloom.addon.shading.kajiya_kay import kajiya_kay, strand_base, strand_normal
from hairloom.addon.shading.lights import Light, light_at, light_irradiance, pack_lights
from hairloom.addon.shading.microfacet import ggx_reflection, reflected_fraction
from hairloom.addon.shading.settings import ShadingSettings
from hairloom.addon.shading.strand_noise import hash_integer, hash_unit, strand_noise

pytestmark = pytest.mark.portable

CENTER = np.array([0.1, -0.2, 0.3])
WEAK = {"primary_strength": 1.0, "secondary_strength": 1.0}
SETTINGS = {
    "default": ShadingSettings(),
    "unit": ShadingSettings(**WEAK),
    "shifted": ShadingSettings(
        primary_shift=-0.4, secondary_shift=0.3, primary_exponent=300.0, shift_noise=1.0, **WEAK
    ),
    "soft": ShadingSettings(primary_exponent=1.0, secondary_exponent=2.0, sparkle=1.0, **WEAK),
}


def directions(rows: int, columns: int) -> np.ndarray:
    """Unit vectors over the whole sphere, poles included, (rows, columns, 3)."""
    polar = np.linspace(0.0, np.pi, rows)[:, None]
    around = np.linspace(0.0, 2.0 * np.pi, columns)[None, :]
    return np.stack(
        [
            np.sin(polar) * np.cos(around),
            np.sin(polar) * np.sin(around),
            np.cos(polar) + 0 * around,
        ],
        axis=-1,
    )


def with_lane(vectors: np.ndarray, lane: np.ndarray | float = 0.0) -> np.ndarray:
    lane = np.broadcast_to(np.asarray(lane), vectors.shape[:-1])[..., None]
    return np.concatenate([vectors, lane], axis=-1).astype(np.float32)


@pytest.mark.parametrize("settings", SETTINGS.values(), ids=SETTINGS)
def test_kajiya_kay(compute: Callable[..., np.ndarray], settings: ShadingSettings) -> None:
    random = np.random.default_rng(11)
    rows, columns = 64, 96
    lights = with_lane(directions(rows, columns), np.linspace(0.0, 1.0, columns))
    eyes = with_lane(directions(columns, rows).swapaxes(0, 1), random.random((rows, columns)))
    tangents = random.normal(size=(rows, columns, 3))
    tangents = with_lane(tangents / np.linalg.norm(tangents, axis=-1, keepdims=True))
    points = with_lane(random.normal(size=(rows, columns, 3)))
    found = compute(
        "kajiya_kay.glsl",
        (columns, rows),
        textures={"tangents": tangents, "points": points, "eyes": eyes, "lights": lights},
        blocks={"shading": ("ShadingSettings", struct_values(settings))},
        settings=(ShadingSettings,),
    )
    tangent = tangents[..., :3].astype(np.float64)
    normal = strand_normal(points[..., :3].astype(np.float64), tangent, CENTER)
    light, eye = lights.astype(np.float64), eyes.astype(np.float64)
    expected = kajiya_kay(
        tangent, normal, light[..., :3], eye[..., :3], light[..., 3], eye[..., 3], settings
    )
    assert expected.max() > 1.5, "the grid must meet highlights"
    # 1e-4 of the light of a highlight of strength 1; higher strengths magnify rounding
    strength = max(1.0, settings.primary_strength, settings.secondary_strength)
    assert np.abs(found[..., :3] - expected).max() < 1e-4 * strength
    along, grey = np.zeros(light.shape[:2]), np.ones(light.shape[:2])
    base = strand_base(along, light[..., 3], grey, settings)
    assert np.abs(found[..., 3] - base[..., 0]).max() < 1e-6


def test_strand_normal(compute: Callable[..., np.ndarray]) -> None:
    """Also for strands straight outwards, where any perpendicular will do."""
    tangents = directions(40, 60).astype(np.float32)
    random = np.random.default_rng(5)
    points = random.normal(size=tangents.shape)
    points[::2] = CENTER + 3.0 * tangents[::2]
    points = points.astype(np.float32)
    found = compute(
        "strand_normal.glsl",
        (60, 40),
        textures={"points": with_lane(points), "tangents": with_lane(tangents)},
        settings=(ShadingSettings,),
    )[..., :3]
    expected = strand_normal(points, tangents, CENTER.astype(np.float32))
    assert np.abs(np.linalg.norm(found, axis=-1) - 1.0).max() < 1e-5
    assert np.abs(np.sum(found * tangents, axis=-1)).max() < 1e-4
    assert np.abs(found - expected)[1::2].max() < 1e-4


def test_noise_agrees_bit_by_bit(compute: Callable[..., np.ndarray]) -> None:
    random = np.random.default_rng(3)
    queries = np.zeros((64, 64, 4), np.float32)
    queries[..., 0] = random.integers(0, 2**24, (64, 64))
    queries[..., 1] = random.integers(0, 4, (64, 64))
    queries[..., 2] = random.random((64, 64)) * 40.0
    queries[0, :, 0] = np.arange(64)
    found = compute("strand_noise.glsl", (64, 64), textures={"queries": queries})
    seed, channel = queries[..., 0].astype(np.uint32), queries[..., 1].astype(np.uint32)
    expected = hash_integer(seed * np.uint32(4) + channel)
    assert (found[..., 0] == expected >> 16).all()
    assert (found[..., 1] == expected & 0xFFFF).all()
    assert (found[..., 2] == hash_unit(seed, queries[..., 2].astype(np.uint32))).all()
    for c in range(4):
        noise = strand_noise(seed, c, queries[..., 2])
        assert np.abs(found[..., 3] - noise)[channel == c].max() < 1e-6


def test_microfacets(compute: Callable[..., np.ndarray]) -> None:
    """From mirror to chalk, from all sides, and without reflectance."""
    random = np.random.default_rng(17)
    rows, columns = 12, 400
    kinds = [(f, r) for f in (0.0, 0.028, 0.25) for r in (0.0, 0.15, 0.45, 1.0)]
    specular, roughness = np.array(kinds, np.float32).T
    normals = random.normal(size=(rows, columns, 3)).astype(np.float32)
    normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
    eyes = random.normal(size=normals.shape).astype(np.float32)
    eyes /= np.linalg.norm(eyes, axis=-1, keepdims=True)
    lights = random.normal(size=normals.shape).astype(np.float32)
    # half of them near the mirror direction
    mirrored = 2.0 * np.sum(normals * eyes, axis=-1, keepdims=True) * normals - eyes
    lights[:, ::2] = (mirrored + 0.05 * lights)[:, ::2]
    lights /= np.linalg.norm(lights, axis=-1, keepdims=True)
    found = compute(
        "microfacet.glsl",
        (columns, rows),
        textures={
            "normals": with_lane(normals),
            "lights": with_lane(lights, specular[:, None]),
            "eyes": with_lane(eyes, roughness[:, None]),
        },
    )
    for row, (f, r) in enumerate(kinds):
        vectors = (each[row].astype(np.float64) for each in (normals, lights, eyes))
        expected = ggx_reflection(*vectors, f, r)
        assert np.allclose(found[row, :, 0], expected, rtol=2e-3, atol=1e-5)
        seen = np.sum(normals[row] * eyes[row], axis=-1)
        assert found[row, :, 1] == pytest.approx(reflected_fraction(seen, f, r), abs=1e-5)


def test_lights(compute: Callable[..., np.ndarray]) -> None:
    random = np.random.default_rng(9)
    lights = [
        Light.sun((0.3, -0.2, -1.0), (1.0, 0.9, 0.8), 4.0),
        Light.point((0.5, 1.5, 1.0), (0.2, 0.4, 1.0), 60.0),
        Light.point((-2.0, 0.1, 0.3), (1.0, 1.0, 1.0), 10.0),
    ]
    points = random.normal(size=(1, 50, 3)).astype(np.float32)
    block = pack_lights(lights, (0.1, 0.2, 0.3))
    found = compute(
        "lights.glsl",
        (50, 6),
        textures={"points": with_lane(points)},
        blocks={"lights": ("Lights", block)},
        structs=("struct_lights.glsl",),
    )
    assert (found[..., 3] == 3.0).all()
    packed = block.reshape(-1, 4)
    for light in lights:
        vectors = packed[1:4, :3]
        row = int(np.abs(vectors - np.array(light.vector, np.float32)).sum(axis=1).argmin())
        direction, irradiance = found[2 * row, :, :3], found[2 * row + 1, :, :3]
        assert np.abs(direction - light_at(light, points[0])[0]).max() < 1e-5
        assert irradiance == pytest.approx(light_irradiance(light, points[0]), rel=1e-4)


@dataclass(frozen=True, kw_only=True)
class OddSettings(Settings):
    """Members in an order that needs every rule of std140."""

    section: ClassVar[str] = "odd"

    first: float = number(0.125, label="", description="", soft=(0, 1), hard=(0, 1))
    tint: tuple[float, float, float] = color((0.1, 0.2, 0.3), label="", description="")
    behind_tint: float = number(0.75, label="", description="", soft=(0, 1), hard=(0, 1))
    whole: int = integer(-12345, label="", description="", soft=(-1, 1), hard=(-99999, 9))
    is_on: bool = toggle(True, label="", description="")
    is_off: bool = toggle(False, label="", description="")
    other_tint: tuple[float, float, float] = color((0.4, 0.5, 0.6), label="", description="")
    mode: str = choice(
        "third",
        (("first", "", ""), ("second", "", ""), ("third", "", "")),
        label="",
        description="",
    )
    last: float = number(0.875, label="", description="", soft=(0, 1), hard=(0, 1))


def test_glsl_reads_every_parameter_right(compute: Callable[..., np.ndarray]) -> None:
    found = compute(
        "settings_struct.glsl",
        (7, 1),
        blocks={"odd": ("OddSettings", struct_values(OddSettings()))},
        settings=(OddSettings,),
    )[0]
    assert found[0, 0] == 0.125
    assert found[1, :3] == pytest.approx([0.1, 0.2, 0.3])
    assert found[2, 0] == 0.75
    assert found[3, 0] == -12345.0
    assert found[4, :2].tolist() == [1.0, 0.0]
    assert found[5, :3] == pytest.approx([0.4, 0.5, 0.6])
    assert found[6, :2].tolist() == [2.0, 0.875]


def test_sine(compute: Callable[..., np.ndarray]) -> None:
    angles = np.zeros((60, 64, 4), np.float32)
    angles[..., 0] = np.linspace(-60.0, 60.0, 60 * 64).reshape(60, 64)
    found = compute("sine.glsl", (64, 60), textures={"angles": angles})[..., 0]
    assert np.abs(found - np.sin(angles[..., 0].astype(np.float64))).max() < 2e-6
    edges = np.zeros((1, 8, 4), np.float32)
    edges[0, :, 0] = np.arange(8) * np.pi / 2.0
    found = compute("sine.glsl", (8, 1), textures={"angles": edges})[0, :, 0]
    assert found == pytest.approx([0.0, 1.0, 0.0, -1.0, 0.0, 1.0, 0.0, -1.0], abs=2e-6)


@pytest.mark.parametrize(
    "solid",
    [
        SphereCollider(np.array([0.1, -0.2, 0.05]), 0.3),
        CapsuleCollider(np.array([-0.2, 0.1, 0.0]), np.array([0.3, 0.2, -0.1]), 0.15),
        CapsuleCollider(np.array([0.1, 0.1, 0.1]), np.array([0.1, 0.1, 0.1]), 0.2),
        DistanceField(
            np.random.default_rng(2).random((7, 5, 9)), np.array([-0.3, -0.2, -0.4]), 0.1
        ),
    ],
    ids=["ball", "capsule", "capsule without length", "field"],
)
def test_collider_distance(
    compute: Callable[..., np.ndarray], solid: SphereCollider | CapsuleCollider | DistanceField
) -> None:
    """Also outside a field's grid, at its border, and at the exact center of a ball."""
    from hairloom.addon.render.collider_textures import field_texels, round_texels

    random = np.random.default_rng(4)
    points = random.uniform(-0.7, 0.7, (40, 32, 4)).astype(np.float32)
    points[0, 0, :3] = solid.start if isinstance(solid, CapsuleCollider) else solid.bounds[0]
    rounds, fields = np.zeros((1, 2, 4), np.float32), np.zeros((1, 1, 4), np.float32)
    field_grid = np.zeros((1, 2, 4), np.float32)
    points[..., 3] = is_field = float(isinstance(solid, DistanceField))
    if isinstance(solid, DistanceField):
        points[1, :3, :3] = solid.low, solid.low + 0.1, solid.low + 0.1 * np.array([6, 4, 8])
        fields = field_texels(solid.values)[None]
        field_grid[0, 0] = *solid.low, solid.cell
        field_grid[0, 1, :3] = solid.values.shape
    else:
        rounds = round_texels(solid)
    found = compute(
        "collider_distance.glsl",
        (32, 40),
        textures={"points": points, "field_grid": field_grid, "rounds": rounds, "fields": fields},
        defines=(("HAS_ROUNDS", 1), ("HAS_FIELDS", 1)),
    )
    distance, gradient = solid.distance(np.ascontiguousarray(points[..., :3].reshape(-1, 3).T))
    assert np.abs(found[..., 3].ravel() - distance).max() < 1e-6
    # steps at the borders of cells, where rounding decides which cell a point is in
    off = np.abs(found[..., :3].reshape(-1, 3).T - gradient).max(axis=0)
    assert (off > (2e-3 if is_field else 1e-5)).sum() <= 4 * is_field


@pytest.mark.parametrize("reach", [1.0e6, 0.05])
@pytest.mark.parametrize("chosen", [(0, 1, 2), (0,), (1,), (2,)])
def test_signed_distance(
    compute: Callable[..., np.ndarray], chosen: tuple[int, ...], reach: float
) -> None:
    """For several colliders of all kinds, or for one, moved, turned and scaled."""
    from hairloom.addon.render.collider_textures import ColliderTextures

    random = np.random.default_rng(8)
    axis = np.linspace(-0.2, 0.2, 12)
    nodes = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), axis=-1)
    solids: tuple[Collider, ...] = (
        CapsuleCollider(np.array([-0.2, 0.1, 0.0]), np.array([0.3, 0.2, -0.1]), 0.05),
        DistanceField(np.abs(nodes).max(axis=-1) - 0.11, nodes[0, 0, 0], axis[1] - axis[0]),
        SphereSetCollider(random.normal(0.0, 0.2, (9, 3)), random.uniform(0.02, 0.1, 9)),
    )
    posed = []
    for collider in solids:
        matrix = np.eye(4)
        matrix[:3, :3] = np.linalg.qr(random.normal(size=(3, 3)))[0] * [1.2, 0.8, 1.0]
        matrix[:3, 3] = random.normal(0.0, 0.1, 3)
        posed.append(PosedCollider(collider, np.eye(4), matrix))
    points = random.uniform(-0.6, 0.6, (40, 32, 4)).astype(np.float32)
    points[..., 3] = reach
    solids = tuple(solids[place] for place in chosen)
    posed = [posed[place] for place in chosen]
    textures = ColliderTextures.of(solids)
    kinds = textures.kinds
    there = {
        "solids": textures.solids(tuple(posed)),
        "rounds": textures.rounds,
        "fields": textures.fields,
    }
    found = compute(
        "signed_distance.glsl",
        (32, 40),
        textures={"points": points},
        samplers={name: ("FLOAT_2D", there[name]) for name in kinds.textures},
        defines=(*kinds.defines, ("solid_count", len(solids))),
    )
    distance, outward = signed_distance(points[..., :3].reshape(-1, 3), posed, reach)
    assert (distance < 0.0).any() and (distance > 0.04).any()
    off = np.abs(found[..., 3].ravel() - distance)
    # a field's distance is divided by its gradient's length; square roots of drivers have 1e-5
    assert off.max() < (tolerance(2e-5, 2e-4) if 1 in chosen else 2e-6)
    # rounding decides at borders of cells and at equal distances to two solids
    off = np.abs(found[..., :3].reshape(-1, 3) - outward).max(axis=1)
    assert (off > 1e-3).sum() <= 6
