"""Hair cards as GLB, parsed without a library; the export leaves Blender's scene unchanged."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from glb_files import Glb, to_blender, write_glb
from guide_cards import build_cards

from hairloom.addon.cards.card_mesh import CardMesh
from hairloom.addon.cards.settings import CardSettings
from hairloom.addon.cards.sort import card_orders, with_triangle_order
from hairloom.addon.errors import HairloomError
from hairloom.addon.exchange.cards.card_formats import GLB
from hairloom.addon.shading.texture_settings import TextureSettings
from hairloom.addon.shading.textures import hair_textures

bpy = pytest.importorskip("bpy", reason="writing a GLB needs Blender or the bpy module")

from hairloom.addon.blender.cards import exporters  # noqa: E402
from hairloom.addon.blender.cards.material import ROUGHNESS  # noqa: E402

TEXTURE = TextureSettings(variant_width=32, height=128)


def hair(count: int = 120, seed: int = 2) -> CardMesh:
    """Cards around a sphere of 10 cm, each at its own distance, in random order."""
    random = np.random.default_rng(seed)
    distance = random.permutation(np.linspace(0.1, 0.16, count))
    angle = random.uniform(0.0, 2.0 * np.pi, count)
    out = np.stack([np.cos(angle), np.sin(angle), np.zeros(count)], axis=-1)
    along = np.linspace(0.0, 1.0, 16)[:, None]
    fall = along * [0.0, 0.0, -0.15] + random.uniform(-0.03, 0.03, (count, 1, 3)) * along**2
    guides = out[:, None] * distance[:, None, None] + fall
    mesh = build_cards(guides.astype(np.float32), out.astype(np.float32), CardSettings())
    return mesh.with_occlusion(random.random(len(mesh.positions)))


@pytest.fixture(scope="module")
def sorted_hair() -> CardMesh:
    mesh = hair()
    return with_triangle_order(mesh, card_orders(mesh, None).front)


@pytest.fixture(scope="module")
def texture(sorted_hair: CardMesh) -> np.ndarray:
    return hair_textures(TEXTURE, sorted_hair.atlas.columns).card


@pytest.fixture(scope="module")
def written(
    sorted_hair: CardMesh, texture: np.ndarray, tmp_path_factory: pytest.TempPathFactory
) -> Path:
    path = tmp_path_factory.mktemp("glb") / "cards.glb"
    write_glb(path, sorted_hair, texture, name="Hair")
    return path


def test_index_order_is_the_sorted_order(written: Path, sorted_hair: CardMesh) -> None:
    corners = to_blender(Glb(written).corners("POSITION"))
    np.testing.assert_array_equal(corners, sorted_hair.positions[sorted_hair.triangles])


def test_index_order_is_kept_whatever_it_is(tmp_path: Path) -> None:
    """A random order of triangles, which no exporter would choose by itself."""
    mesh = hair(30)
    shuffle = np.random.default_rng(0).permutation(len(mesh.triangles))
    mesh = replace(mesh, triangles=mesh.triangles[shuffle], card=mesh.card[shuffle])
    write_glb(tmp_path / "cards.glb", mesh, None)
    corners = to_blender(Glb(tmp_path / "cards.glb").corners("POSITION"))
    np.testing.assert_array_equal(corners, mesh.positions[mesh.triangles])


def test_cards_come_from_the_inside_to_the_outside(written: Path) -> None:
    """The file's triangles near the roots, in index order, lie farther and farther outside."""
    file = Glb(written)
    corners = to_blender(file.corners("POSITION"))
    assert len(corners) == 120 * 12 * 2 * 2
    at_root = corners[..., 2].mean(axis=1) > -0.02
    distance = np.linalg.norm(corners[at_root][..., :2].mean(axis=1), axis=1)
    assert np.corrcoef(distance, np.arange(len(distance)))[0, 1] > 0.9


def test_vertex_data_follow_the_sidecar(written: Path, sorted_hair: CardMesh) -> None:
    file, mesh = Glb(written), sorted_hair
    at_corner = mesh.triangles
    assert set(file.primitive["attributes"]) == set(GLB.attributes)
    flipped = mesh.uv[at_corner] * [1.0, -1.0] + [0.0, 1.0]
    np.testing.assert_allclose(file.corners("TEXCOORD_0"), flipped, atol=1e-6)
    occlusion_and_along = np.stack([mesh.occlusion, mesh.along], axis=1)[at_corner]
    np.testing.assert_allclose(file.corners("TEXCOORD_1"), occlusion_and_along, atol=1e-6)
    normal = to_blender(file.corners("NORMAL"))
    np.testing.assert_allclose(normal, mesh.normal[at_corner], atol=1e-4)  # rounded by Blender
    across = to_blender(file.corners("TANGENT")[..., :3])
    along = np.cross(normal, across)
    assert (along * mesh.tangent[at_corner]).sum(axis=-1).min() > 0.9
    assert len(file.accessor(0)) == len(mesh.positions)  # no vertex was split


def test_material_is_blended_and_double_sided(written: Path) -> None:
    (material,) = Glb(written).json["materials"]
    assert material["alphaMode"] == "BLEND"
    assert material["doubleSided"] is True
    surface = material["pbrMetallicRoughness"]
    assert "baseColorFactor" not in surface  # the texture has the hair's own colour
    assert surface["metallicFactor"] == 0
    assert surface["roughnessFactor"] == pytest.approx(ROUGHNESS)
    assert surface["baseColorTexture"].get("texCoord", 0) == 0
    (sampler,) = Glb(written).json["samplers"]
    clamp_to_edge = 33071
    assert (sampler["wrapS"], sampler["wrapT"]) == (clamp_to_edge, clamp_to_edge)


def test_the_embedded_picture_is_the_texture(
    written: Path, texture: np.ndarray, tmp_path: Path
) -> None:
    file = Glb(written)
    (picture,) = file.json["images"]
    png = tmp_path / "picture.png"
    png.write_bytes(file.view(picture["bufferView"]))
    image = bpy.data.images.load(str(png))
    try:
        pixels = np.empty(texture.size, np.float32)
        image.pixels.foreach_get(pixels)
    finally:
        bpy.data.images.remove(image)
    pixels = pixels.reshape(texture.shape)
    np.testing.assert_allclose(pixels[..., 3], texture[..., 3], atol=0.51 / 255.0)
    coded = 1.055 * texture[..., :3] ** (1 / 2.4) - 0.055
    # also where alpha is 0, otherwise there are dark fringes
    np.testing.assert_allclose(pixels[..., :3], coded, atol=0.51 / 255.0)


def test_custom_attributes_only_where_they_are_asked_for(
    written: Path, sorted_hair: CardMesh, tmp_path: Path
) -> None:
    assert not [n for n in Glb(written).primitive["attributes"] if n.startswith("_")]
    path = tmp_path / "cards.glb"
    write_glb(path, sorted_hair, None, portable=False)
    occlusion = Glb(path).corners("_AO")[..., 0]
    np.testing.assert_allclose(occlusion, sorted_hair.occlusion[sorted_hair.triangles], atol=1e-6)


def block_counts() -> dict[str, int]:
    """The number of data-blocks of every kind."""
    kinds = [p.identifier for p in bpy.data.bl_rna.properties if p.type == "COLLECTION"]
    return {kind: len(getattr(bpy.data, kind)) for kind in kinds}


def test_the_users_scene_is_left_alone(sorted_hair: CardMesh, tmp_path: Path) -> None:
    """In Edit Mode, in a second view layer, at another frame."""
    bpy.ops.mesh.primitive_cube_add()
    window, scene = bpy.context.window, bpy.context.scene
    window.view_layer = scene.view_layers.new("second")
    scene.frame_set(7)
    cube = bpy.data.objects["Cube"]
    window.view_layer.objects.active = cube
    bpy.ops.object.mode_set(mode="EDIT")
    before = block_counts()
    write_glb(tmp_path / "cards.glb", sorted_hair, None)
    assert block_counts() == before
    assert (window.scene, window.view_layer.name, scene.frame_current) == (scene, "second", 7)
    assert cube.mode == "EDIT"
    assert window.view_layer.objects.active == cube
    bpy.ops.object.mode_set(mode="OBJECT")


def test_an_impossible_path_leaves_nothing(sorted_hair: CardMesh, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    before = block_counts()
    with pytest.raises(HairloomError, match="cannot be written"):
        write_glb(tmp_path / "file" / "cards.glb", sorted_hair, None)
    assert block_counts() == before
    assert [path.name for path in tmp_path.iterdir()] == ["file"]


def test_a_failing_exporter_leaves_the_old_file_and_no_data(
    sorted_hair: CardMesh, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "cards.glb"
    path.write_bytes(b"old")
    before, scene = block_counts(), bpy.context.window.scene

    def half(temporary: Path, *_: object, **__: object) -> None:
        temporary.write_bytes(b"half")
        raise KeyboardInterrupt

    monkeypatch.setitem(exporters._EXPORTERS, "glb", half)
    with pytest.raises(KeyboardInterrupt):
        write_glb(path, sorted_hair, None)
    assert path.read_bytes() == b"old"
    assert [entry.name for entry in tmp_path.iterdir()] == ["cards.glb"]
    assert block_counts() == before
    assert bpy.context.window.scene == scene


def test_no_cards_and_no_exporter_are_messages(sorted_hair: CardMesh, tmp_path: Path) -> None:
    empty = build_cards(np.zeros((0, 16, 3)), np.zeros((0, 3)), CardSettings())
    with pytest.raises(HairloomError, match="no cards"):
        write_glb(tmp_path / "cards.glb", empty, None)
    bpy.ops.preferences.addon_disable(module="io_scene_gltf2")
    try:
        with pytest.raises(HairloomError, match="switched off"):
            write_glb(tmp_path / "cards.glb", sorted_hair, None)
    finally:
        bpy.ops.preferences.addon_enable(module="io_scene_gltf2")
    assert list(tmp_path.iterdir()) == []
