"""The head of a web page has the mesh and the materials of the head."""

from __future__ import annotations

from pathlib import Path

import bpy
import numpy as np
import pytest

from hairloom.addon.blender.cards.page_head import PageHead
from hairloom.addon.blender.scene.built_in_head import built_in_head
from hairloom.addon.blender.scene.head_look import head_look
from hairloom.addon.blender.scene.surfaces import read_surface
from hairloom.addon.exchange.cards.card_formats import GLB
from hairloom.addon.exchange.textures.texture_files import read_texture


def arrays(page: PageHead) -> tuple[np.ndarray, ...]:
    """The triangles' corners in Blender's axes, their normals and their UVs."""
    triangles = np.frombuffer(page.files["head.triangles"], np.uint32).reshape(-1, 3)
    x, y, z = np.frombuffer(page.files["head.positions"], np.float32).reshape(-1, 3).T
    normal_x, normal_y, normal_z = (
        np.frombuffer(page.files["head.normals"], np.float32).reshape(-1, 3).T
    )
    positions, normals = np.stack([x, -z, y], 1), np.stack([normal_x, -normal_z, normal_y], 1)
    uv = np.frombuffer(page.files.get("head.uv", b""), np.float32).reshape(-1, 2)
    return positions[triangles], normals[triangles], uv[triangles] if len(uv) else uv


@pytest.mark.portable
def test_our_bust_has_its_skin_and_its_eyes(tmp_path: Path) -> None:
    bust = built_in_head()
    head, look = bust.surface, bust.look("light")
    page = PageHead.of(tmp_path / "hair.glb", head, look, GLB)
    assert list(tmp_path.iterdir()) == []
    skin, eyes = page.parts
    assert skin["triangles"] + eyes["triangles"] == len(head.triangles)
    assert eyes["roughness"] < skin["roughness"] and skin["picture"] == eyes["picture"]
    order = np.concatenate([triangles for triangles, _ in look])
    positions, normals, uv = arrays(page)
    size = np.ptp(head.positions, axis=0).max()
    np.testing.assert_allclose(positions, head.corners[order], atol=size * 2.0**-13)
    np.testing.assert_allclose(normals, head.vertex_normals()[head.triangles[order]], atol=2e-3)
    assert head.corner_uv is not None
    np.testing.assert_allclose(uv, head.corner_uv[order], atol=2.0**-14)


def test_a_picture_is_what_the_renderer_has(tmp_path: Path) -> None:
    """The page's picture, read by OpenImageIO, equals the renderer's."""
    bust = built_in_head()
    page = PageHead.of(tmp_path / "hair.glb", bust.surface, bust.look("dark"), GLB)
    file = tmp_path / "skin.webp"
    file.write_bytes(page.files["head.0.webp"])
    picture, (_, material) = read_texture(file, is_color=True), bust.look("dark")[0]
    assert material.pictures is not None and material.pictures.color is not None
    painted = material.pictures.color[..., :3]
    assert picture.shape[:2] == painted.shape[:2]
    assert np.abs(picture[..., :3] - painted).mean() < 0.01
    assert page.parts[0]["color"] == pytest.approx(material.color)


def test_own_materials_are_kept_and_a_head_without_any_is_plain_skin(
    tmp_path: Path, sphere: bpy.types.Object
) -> None:
    surface = read_surface(
        sphere, bpy.context.evaluated_depsgraph_get(), need_uv=False, place="Head"
    )
    plain = PageHead.of(tmp_path / "hair.glb", surface, head_look("Head", surface, "light"), GLB)
    assert [each["picture"] for each in plain.parts] == [None] and "head.uv" not in plain.files
    for color in ((0.1, 0.2, 0.3, 1.0), (0.7, 0.6, 0.5, 1.0)):
        material = bpy.data.materials.new("Half")
        assert material.node_tree is not None
        material.node_tree.nodes["Principled BSDF"].inputs["Base Color"].default_value = color
        sphere.data.materials.append(material)
    for polygon in sphere.data.polygons:
        polygon.material_index = int(polygon.center.z > 0.0)
    own = PageHead.of(tmp_path / "hair.glb", surface, head_look("Head", surface, "light"), GLB)
    assert [each["color"] for each in own.parts] == [
        pytest.approx((0.1, 0.2, 0.3)),
        pytest.approx((0.7, 0.6, 0.5)),
    ]
    upper = arrays(own)[0][own.parts[0]["triangles"] :]
    assert upper.mean(axis=1)[:, 2].min() > -1e-3
