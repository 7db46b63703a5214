"""Hair curves with their own colours: read, previewed, baked, made into cards, exported."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hedgehogs import hedgehog

bpy = pytest.importorskip("bpy", reason="these tests need Blender or the bpy module")

from hairloom.addon.blender.bakes.baked_rig import RestMatrices, baked_rig_of, rig_arrays  # noqa: E402
from hairloom.addon.blender.cards.show import without_strands  # noqa: E402
from hairloom.addon.blender.preview import previews, scene_events  # noqa: E402
from hairloom.addon.blender.strands.read_hair import ExportRequest, read_still_hair  # noqa: E402
from hairloom.addon.blender.viewport import overlay  # noqa: E402
from hairloom.addon.shading.settings import ShadingSettings  # noqa: E402
from hairloom.addon.shading.wet_and_dusty import wet_and_dusty_color  # noqa: E402
from hairloom.addon.strands import StrandSet  # noqa: E402

RED, BLUE = (0.8, 0.02, 0.03), (0.01, 0.05, 0.6)


def two_colored(none: tuple[float, ...] = BLUE) -> StrandSet:
    """A hedgehog, red where x < 0, blue or `none` elsewhere."""
    strands = hedgehog()
    is_left = np.repeat(strands.roots[:, 0] < 0.0, strands.point_counts)[:, None]
    return replace(strands, color=np.where(is_left, RED, none))


@pytest.fixture
def hair(new_hair: Callable[..., Any], sphere: Any) -> Any:
    yield new_hair(sphere, two_colored())
    previews.stop_all()


def test_painting_the_curves_is_seen_in_the_preview(
    hair: Any, get_depsgraph: Callable[[], Any]
) -> None:
    session = previews.start(hair, get_depsgraph())
    shown = overlay.drawing_of(session.uid).snapshot
    assert without_strands(shown).strand_count == 0, "where cards are shown"
    grid = two_colored().color_grid
    assert grid is not None
    color = shown.color.reshape(shown.strand_count, -1, 3)
    np.testing.assert_allclose(color[:, [0, -1]], grid[:, [0, -1]], atol=1e-6)
    opaque = np.tile(np.float32([*BLUE, 1.0]), 480)
    hair.data.attributes["color"].data.foreach_set("color", opaque)
    hair.data.update_tag()
    bpy.context.view_layer.update()
    scene_events.catch_up(get_depsgraph())
    painted = overlay.drawing_of(session.uid).snapshot
    np.testing.assert_allclose(painted.color, np.broadcast_to(BLUE, painted.color.shape), atol=1e-6)
    scene_events.catch_up(get_depsgraph())
    assert overlay.drawing_of(session.uid).snapshot.color is painted.color, "nothing has changed"


def test_colours_of_wet_hair_are_seen_in_the_preview(
    hair: Any, get_depsgraph: Callable[[], Any]
) -> None:
    session = previews.start(hair, get_depsgraph())
    dry = overlay.drawing_of(session.uid).snapshot.color
    for wetness in (1.0, 0.0):
        hair.data.hairloom.shading.wetness = wetness
        scene_events.catch_up(get_depsgraph())
        shown = overlay.drawing_of(session.uid).snapshot.color
        expected = wet_and_dusty_color(dry, ShadingSettings(wetness=wetness))
        np.testing.assert_allclose(shown, expected, atol=1e-6)


def test_a_bake_keeps_the_colours(hair: Any, get_depsgraph: Callable[[], Any]) -> None:
    rig = previews.start(hair, get_depsgraph()).rig
    found = baked_rig_of(rig_arrays(rig, RestMatrices(np.eye(4), np.eye(4))), "here").rig
    np.testing.assert_array_equal(found.strands.color, rig.strands.color)


def test_a_bake_keeps_uneven_point_counts(hair: Any, get_depsgraph: Callable[[], Any]) -> None:
    rig = previews.start(hair, get_depsgraph()).rig
    strands = rig.strands
    kept = np.arange(strands.point_count) % 16 % 5 == 0
    kept[: strands.point_count // 2] = True
    offsets = np.concatenate([[0], np.cumsum(kept)])[strands.offsets]
    color = None if strands.color is None else strands.color[kept]
    uneven = replace(
        strands,
        points=strands.points[kept],
        offsets=offsets,
        radius=strands.radius[kept],
        color=color,
    )
    assert not uneven.is_uniform
    arrays = rig_arrays(replace(rig, strands=uneven), RestMatrices(np.eye(4), np.eye(4)))
    found = baked_rig_of(arrays, "here").rig.strands
    for name in ("points", "offsets", "radius", "color"):
        np.testing.assert_array_equal(getattr(found, name), getattr(uneven, name))


@pytest.mark.draws
@pytest.mark.slow
def test_cards_have_the_colours_of_their_strands(
    hair: Any, get_depsgraph: Callable[[], Any]
) -> None:
    """At least a fifth of the texels with hair are red, and a fifth blue."""
    groom = hair.data.hairloom
    groom.atlas.size = "512"
    groom.card_occlusion.rays, groom.cards.order_by = 1, "distance"
    groom.shading.color_variation = groom.shading.tip_tint = 0.0
    groom.card_drawing.shown_as = "cards"
    session = previews.start(hair, get_depsgraph())
    cards = overlay.drawing_of(session.uid).snapshot.cards
    assert cards.base_color == pytest.approx(np.maximum(RED, BLUE), abs=1e-6)
    shown = cards.textures.base * np.array(cards.base_color)
    is_hair = cards.textures.alpha > 0.0
    for color in (RED, BLUE):
        is_alike = np.isclose(shown, color, atol=1e-3).all(axis=-1) & is_hair
        assert is_alike.sum() > 0.2 * is_hair.sum()


def test_exports_have_the_colours_that_are_drawn(
    hair: Any, get_depsgraph: Callable[[], Any]
) -> None:
    groom = hair.data.hairloom
    groom.shading.model, groom.shading.base_color = "kajiya_kay", (0.25, 0.5, 0.75)
    own = read_still_hair(hair, get_depsgraph(), ExportRequest(guides=False)).groom.color
    np.testing.assert_allclose(own, two_colored().color, atol=1e-6)
    groom.shading.color_source = "look"
    request = ExportRequest(guides=False)
    assert np.unique(
        read_still_hair(hair, get_depsgraph(), request).groom.color, axis=0
    ) == pytest.approx(np.array([[0.25, 0.5, 0.75]]))
    assert read_still_hair(hair, get_depsgraph(), replace(request, color=False)).groom.color is None


def test_strands_without_a_colour_are_exported_in_the_looks(
    new_hair: Callable[..., Any], sphere: Any, get_depsgraph: Callable[[], Any]
) -> None:
    hair = new_hair(sphere, two_colored((np.nan,) * 3))
    hair.data.hairloom.shading.base_color = (0.25, 0.5, 0.75)
    out = read_still_hair(hair, get_depsgraph(), ExportRequest(guides=False, color=False))
    expected = two_colored((0.25, 0.5, 0.75)).color
    np.testing.assert_allclose(out.groom.color, expected, atol=1e-6)
    assert sum("have no usable colour" in note for note in out.notes) == 1


def test_children_are_exported_in_the_colours_of_their_guides(
    hair: Any, get_depsgraph: Callable[[], Any]
) -> None:
    hair.data.hairloom.children.method = "single"
    hair.data.hairloom.children.strand_count = 100
    color = read_still_hair(hair, get_depsgraph(), ExportRequest(guides=False)).groom.color
    is_one = [np.isclose(color, one, atol=1e-5).all(axis=1) for one in (RED, BLUE)]
    assert (is_one[0] | is_one[1]).all() and is_one[0].any() and is_one[1].any()
