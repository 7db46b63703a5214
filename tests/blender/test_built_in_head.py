"""The built-in bust: a clean mesh of real size, with a hairline, brows, lashes and skin."""

from __future__ import annotations

import bpy
import numpy as np
import pytest

from hairloom.addon.blender.scene.built_in_head import built_in_head
from hairloom.addon.blender.scene.bust import bust_object
from hairloom.addon.blender.scene.bust_data import EYES, HAIR_GROUPS, SKIN, load_bust
from hairloom.addon.blender.scene.bust_skin import RESOLUTION, TONES, skin_picture
from hairloom.addon.blender.scene.mesh_materials import material_notes, material_of
from hairloom.addon.groom.face_hair import FaceHair, grow_brows, grow_lashes, grow_with_face
from hairloom.addon.groom.scalp import find_cranium
from hairloom.addon.groom.settings import GrowSettings
from hairloom.addon.shading.skin.notes import uv_notes
from hairloom.addon.strands.face import BROWS, LASHES


def test_it_is_a_head_of_real_size_around_its_skull() -> None:
    head = built_in_head()
    cranium = find_cranium(head.surface.positions)
    assert np.abs(cranium.center).max() < 0.03 and 0.09 < cranium.half_depth < 0.12
    low, high = head.surface.bounds()
    assert high[2] - low[2] == pytest.approx(0.37, abs=0.03)
    # symmetric, with the nose in front
    assert low[0] == pytest.approx(-high[0], abs=1e-4)
    nose = head.surface.positions[head.surface.positions[:, 1].argmin()]
    assert abs(nose[0]) < 2e-3 and -0.06 < nose[2] < -0.02


def test_its_mesh_is_clean() -> None:
    """No duplicate or empty faces, no edge with more than two faces, no overlapping UVs."""
    bust = load_bust()
    mesh = bust_object("Bust", None).data
    assert not mesh.validate()
    corners = np.split(bust.corner_vertex, np.cumsum(bust.sizes)[:-1])
    edges = np.concatenate([np.stack([face, np.roll(face, -1)], axis=1) for face in corners])
    assert len(np.unique(edges, axis=0)) == len(edges), "neighbours are turned the same way"
    assert (bust.sizes == 4).mean() > 0.9
    surface = built_in_head().surface
    a, b, c = np.moveaxis(surface.corners.astype(np.float64), 1, 0)
    assert np.linalg.norm(np.cross(b - a, c - a), axis=1).min() > 1e-12
    assert uv_notes(surface) == ()
    assert bust.uv.min() > 0.0 and bust.uv.max() < 1.0


def test_weights_fall_off_smoothly_and_lie_where_hair_grows() -> None:
    head = built_in_head()
    places = head.surface.positions
    for name in HAIR_GROUPS:
        weights = head.weights[name]
        assert weights.min() >= 0.0 and 0.9 < weights.max() <= 1.0
        mirrored = np.abs(places[:, 0] * weights).sum()
        assert abs((places[:, 0] * weights).sum()) < 0.01 * mirrored, name
    x, y, z = places.T
    scalp = head.weights["scalp"]
    assert (scalp[z > 0.1] > 0.99).all(), "on the crown"
    face = (y < -0.06) & (z < 0.05) & (np.abs(x) < 0.05)
    assert not scalp[face].any() and not scalp[z < -0.1].any()
    # the hairline is a gradient: bare forehead, partial weights, full scalp
    front = (np.abs(x) < 0.01) & (y < -0.02) & (z > 0.03)
    assert np.ptp(z[front & (scalp > 0.02) & (scalp < 0.98)]) > 0.005
    assert z[front & (scalp == 0.0)].max() < z[front & (scalp > 0.98)].min()


@pytest.mark.parametrize(
    "tone", ["light", *(pytest.param(tone, marks=pytest.mark.slow) for tone in ("medium", "dark"))]
)
def test_skin_is_redder_where_blood_is_and_never_bright_as_paper(tone: str) -> None:
    picture = skin_picture(tone)
    assert picture.shape == (RESOLUTION, RESOLUTION, 4) and (picture[..., 3] == 1.0).all()
    assert picture[..., :3].min() >= 0.0 and picture[..., :3].max() < 0.9
    head, bust = built_in_head(), load_bust()
    corners, material = bust.triangulated
    texel = (bust.uv[bust.corner_uv[corners]].mean(axis=1) * RESOLUTION).astype(int)
    color = picture[texel[:, 1], texel[:, 0], :3]
    lips = bust.weights["lips"][bust.corner_vertex[corners]].min(axis=1) > 0.99
    bare = np.all(
        [
            bust.weights[n][bust.corner_vertex[corners]].max(axis=1) == 0.0
            for n in (*HAIR_GROUPS, "lips")
        ],
        axis=0,
    )
    skin = color[bare & (material == SKIN)].mean(axis=0)
    assert skin[0] > skin[1] > skin[2]
    assert (color[lips].mean(axis=0) / skin)[0] > (color[lips].mean(axis=0) / skin)[1]
    assert color[material == EYES].min() < 0.02, "pupils"
    assert head.look(tone)[0][1].color == TONES[tone].skin


def test_its_materials_are_plain_to_the_renderer_and_to_blender() -> None:
    head = bust_object("Bust", "light")
    assert material_notes(head) == ()
    skin, eyes = (material_of(slot.material) for slot in head.material_slots)
    for (_, expected), found in zip(built_in_head().look("light"), (skin, eyes), strict=True):
        assert found.specular == pytest.approx(expected.specular, abs=1e-5)
        assert found.roughness == pytest.approx(expected.roughness)
        assert found.pictures is not None and expected.pictures is not None
        one, other = found.pictures.color, expected.pictures.color
        assert one is not None and other is not None and np.abs(one - other).max() < 0.01
    assert sorted(group.name for group in head.vertex_groups) == sorted(HAIR_GROUPS)
    assert {modifier.type for modifier in head.modifiers} == {"SUBSURF"}


def test_brows_and_lashes_leave_the_skin_and_keep_their_places() -> None:
    head, hair = built_in_head(), FaceHair(brow_count=150, lash_count=120)
    brows = grow_brows(head.surface, head.weights["brows"], hair).grid
    lashes = grow_lashes(head.surface, head.weights["lashes"], hair).grid
    assert brows.shape == (150, hair.cv_count, 3) and lashes.shape == (120, hair.cv_count, 3)
    length = np.linalg.norm(np.diff(brows, axis=1), axis=2).sum(axis=1)
    assert length.max() <= hair.brow_length + 1e-6 and length.min() > 0.4 * hair.brow_length
    # brows grow outwards, lashes forwards, and the tips of the upper lashes up
    outward = (np.abs(brows[:, -1, 0]) - np.abs(brows[:, 0, 0])) > 0.0
    assert outward.mean() > 0.95
    assert (lashes[:, -1, 1] < lashes[:, 0, 1]).all()
    is_upper = lashes[:, 0, 2] > np.median(lashes[:, 0, 2]) + 0.002
    assert (lashes[is_upper, -1, 2] > lashes[is_upper, 0, 2]).mean() > 0.95
    # tips are outside the lids
    assert (lashes[:, -1, 1] < -0.07).all()


def test_hair_has_a_group_for_each_part() -> None:
    head = built_in_head()
    strands = grow_with_face(head.surface, GrowSettings(strand_count=50, length=0.05), head.weights)
    assert list(np.unique(strands.group)) == [0, BROWS, LASHES] and (strands.group == 0).sum() == 50
    assert strands.is_bound


def test_nothing_is_left_in_the_scene() -> None:
    before = len(bpy.data.objects), len(bpy.data.meshes)
    built_in_head.cache_clear()
    built_in_head()
    assert (len(bpy.data.objects), len(bpy.data.meshes)) == before
