"""Grooms in one 3D view shade each other, tested against a render and against Beer's law."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

bpy = pytest.importorskip("bpy", reason="these tests need Blender or the bpy module")

from flat_cards import card, constant_textures, mesh_of, snapshot_of  # noqa: E402
from gpu_calls import gpu_calls  # noqa: E402
from small_view import ADDRESS, SIZE, TRANSPARENT, SmallView  # noqa: E402

from hairloom.addon.blender.viewport import overlay, views  # noqa: E402
from hairloom.addon.render import gpu_objects  # noqa: E402
from hairloom.addon.render.accumulation import Target  # noqa: E402
from hairloom.addon.render.camera import Camera, look_at, orthographic  # noqa: E402
from hairloom.addon.render.scene_pass import ScenePass  # noqa: E402
from hairloom.addon.render.scene_snapshot import DrawnGroom, SceneSnapshot  # noqa: E402
from hairloom.addon.render.snapshot import Snapshot  # noqa: E402
from hairloom.addon.render.textures import texture_to_array  # noqa: E402
from hairloom.addon.shading.lights import Light, brightest_lights  # noqa: E402
from hairloom.addon.shading.settings import ShadingSettings, StrandSettings  # noqa: E402
from hairloom.addon.shading.volume.settings import VolumeSettings  # noqa: E402
from hairloom.addon.strands import Surface  # noqa: E402

pytestmark = [pytest.mark.draws, pytest.mark.usefixtures("gpu_context", "extension")]

OPAQUE = StrandSettings(tip_width=1.0, transparency="none")
LOOK = ShadingSettings(model="kajiya_kay", base_color=(0.3, 0.3, 0.3))
VOLUME = VolumeSettings(resolution=256, layers=8, strand_fraction=1.0, bias=0.0, scattering=False)
SUN = Light.sun((0.0, 0.0, -1.0), (1.0, 1.0, 1.0), 2.0)
ASIDE = Light.sun((0.6, 0.2, -1.0), (1.0, 0.8, 0.6), 1.0)
CAMERA = Camera(
    look_at((0.0, -0.8, 0.5), (0.0, 0.0, 0.05), up=(0.0, 0.0, 1.0)),
    orthographic(0.4, 1.0, 0.0, 3.0),
)


def sheet(
    height: float, count: int, radius: float = 2.0e-4, seed: int = 1, **changes: Any
) -> Snapshot:
    """Horizontal parallel strands, 0.4 m by 0.4 m; sunlight falls straight through the sheet."""
    random = np.random.default_rng(seed)
    strands = np.zeros((count, 6, 3), np.float32)
    strands[..., 0] = np.linspace(-0.2, 0.2, 6)
    strands[..., 1] = 0.4 * ((np.arange(count) + 0.5) / count - 0.5)[:, None]
    strands[..., 2] = height + random.uniform(0.0, 0.005, (count, 1))
    made = Snapshot(
        strands,
        np.full(strands.shape[:2], radius, np.float32),
        shading=LOOK,
        strand_settings=OPAQUE,
        volume=VOLUME,
        lights=(SUN, ASIDE),
        ambient=(0.0, 0.0, 0.0),
        volume_center=np.array([0.0, 0.0, -1.0]),
    )
    return replace(made, **changes)


@pytest.fixture
def view(monkeypatch: pytest.MonkeyPatch) -> Iterator[SmallView]:
    # no window shows this view
    monkeypatch.setattr(views, "_addresses", lambda: iter((ADDRESS,)))
    overlay._overlay.drawn.clear()
    yield SmallView(CAMERA)
    overlay._overlay.drawn.clear()
    views.forget_views()


def row_of(height: float, y: float) -> int:
    """The row of the view's pixels in which a point at this height and y appears."""
    seen = CAMERA.projection @ CAMERA.view @ np.array([0.0, y, height, 1.0])
    return int(0.5 * SIZE * (1.0 + seen[1]))


def shown_in(view: SmallView) -> list[Any]:
    return list(overlay._shown_grooms(view.context, CAMERA, has_turned=False))


def of_render(*grooms: Snapshot) -> np.ndarray:
    """One sample of these grooms by the render engine, scene-linear."""
    drawn = tuple(DrawnGroom(number, each) for number, each in enumerate(grooms))
    scene = SceneSnapshot(grooms=drawn, lights=grooms[0].lights, ambient=grooms[0].ambient)
    target = Target()
    ScenePass().draw(scene, CAMERA, target, (SIZE, SIZE), TRANSPARENT)
    return texture_to_array(target.color)


def code_of(radiance: np.ndarray) -> np.ndarray:
    """The display values, 0 to 1, of Blender's view transform Standard."""
    light = np.clip(radiance, 0.0, 1.0)
    curved = 1.055 * np.maximum(light, 0.0031308) ** (1.0 / 2.4) - 0.055
    return np.where(light <= 0.0031308, 12.92 * light, curved)


def radiance_of(written: np.ndarray) -> np.ndarray:
    """The radiance that a view shows for the values written into it."""
    code = np.maximum(written, 0.0) ** (1.0 / 2.2)
    return np.where(code <= 0.04045, code / 12.92, ((code + 0.055) / 1.055) ** 2.4)


FORMS = {
    "deep": ({}, {}, {}),
    "slices": ({"shadows": "slices"}, {"shadows": "slices"}, {"shadows": "slices"}),
    "mixed": ({"shadows": "slices", "layers": 16}, {}, {"shadows": "none"}),
}


@pytest.mark.alike
@pytest.mark.parametrize("form", FORMS)
def test_hair_has_the_colours_of_a_render(view: SmallView, form: str) -> None:
    """Three opaque grooms, one above another, so that each pixel shows one strand."""
    changes = [replace(VOLUME, **each) for each in FORMS[form]]
    low, middle, high = (
        sheet(height, 400, seed=seed, volume=volume)
        for seed, (height, volume) in enumerate(zip((0.0, 0.06, 0.12), changes, strict=True))
    )
    found = view.shows(a=low, b=middle, c=high)
    rendered = of_render(low, middle, high)
    assert (found[..., 3] == rendered[..., 3]).all() and rendered[..., 3].mean() > 0.3
    shown = np.maximum(found[..., :3], 0.0) ** (1.0 / 2.2)
    assert np.abs(shown - code_of(rendered[..., :3])).max() < 1.0 / 255.0
    alone = view.shows(a=low)
    assert np.abs(found - alone)[alone[..., 3] > 0.0].max() > 0.1


@pytest.mark.parametrize("shadows", ["deep", "slices"])
def test_light_behind_a_groom_follows_beers_law(view: SmallView, shadows: str) -> None:
    """A sheet that covers half of the light's cross-section, above strands of another groom:
    exp(-1/2) of the sunlight arrives."""
    volume = replace(VOLUME, shadows=shadows, layers=16, resolution=64)
    dim = Light.sun((0.0, 0.0, -1.0), (1.0, 1.0, 1.0), 0.5)  # keeps all pixels below white
    few = sheet(0.0, 12, radius=1.0e-3, volume=volume, lights=(dim,))
    above = sheet(0.1, 400, radius=2.5e-4, volume=volume, lights=(dim,))
    alone, both = (
        radiance_of(view.shows(**grooms)[..., :3])
        for grooms in ({"a": few}, {"a": few, "b": above})
    )
    # rows that show only the lower sheet, in front of the upper one
    rows = row_of(0.0, -0.2), row_of(0.1, -0.2)
    middle = slice(rows[0] + 1, rows[1] - 1), slice(SIZE // 4, -SIZE // 4)
    seen = alone[middle].min(axis=2) > 0.0
    assert seen.sum() > 40 and alone.max() < 0.9
    left = both[middle][seen] / alone[middle][seen]
    assert np.ptp(left) < 0.1
    assert left.mean() == pytest.approx(np.exp(-0.5), abs=0.02)


def test_changes_of_one_groom_are_seen_on_the_others(view: SmallView) -> None:
    """A view keeps its picture until another groom moves, is hidden or removed."""
    layered = replace(OPAQUE, transparency="layers")
    low = sheet(0.0, 400, strand_settings=layered)
    high = sheet(0.1, 400, seed=2, strand_settings=layered)
    moved = replace(high, points=high.points + np.float32([0.15, 0.0, 0.0]))
    view.shows(a=low, b=high)
    both, again = view.drawn(), []
    calls = gpu_calls(lambda: again.append(view.drawn()))
    assert calls["draws"] == 2 and not calls.get("dispatches"), "nothing is looked up"
    np.testing.assert_allclose(again[0], both, atol=1.0 / 510.0)
    below = slice(0, row_of(0.1, -0.2) - 1)  # rows that show only the lower groom
    for name, grooms in (
        ("moved", {"a": low, "b": moved}),
        ("back", {"a": low, "b": high}),
        ("hidden", {"a": low, "b": None}),
        ("shown", {"a": low, "b": high}),
        ("gone", {"a": low}),
    ):
        view.shows(**grooms)
        found = view.drawn()  # the view is at rest
        kept = {key: each for key, each in grooms.items() if each is not None}
        views.forget_views()
        overlay._overlay.drawn.clear()
        afresh = view.shows(**kept)
        np.testing.assert_allclose(found, afresh, atol=1.0 / 255.0, err_msg=name)
        is_same = np.abs(found - both)[below].max() < 1.0 / 255.0
        assert is_same == (name in ("back", "shown")), name


def test_the_maps_of_a_groom_go_with_it(view: SmallView) -> None:
    low, high = sheet(0.0, 400), sheet(0.1, 400, seed=2)
    view.shows(a=low)
    gpu_objects.free_unused()
    before = gpu_objects.bytes_in_use()
    view.shows(a=low, b=high)
    gpu_objects.free_unused()
    assert gpu_objects.bytes_in_use() > before + (1 << 20)
    view.shows(a=low)
    gpu_objects.free_unused()
    assert gpu_objects.bytes_in_use() == before


def test_cards_of_one_groom_shade_strands_of_another_and_are_drawn_last(view: SmallView) -> None:
    """As in a render: half of the light arrives below a card with alpha 0.5."""
    dim = Light.sun((0.0, 0.0, -1.0), (1.0, 1.0, 1.0), 0.5)
    few = sheet(0.0, 12, radius=1.0e-3, lights=(dim,))
    flat = card((-0.2, -0.2), (0.2, 0.2), 0.0)
    for name in ("positions", "normal", "tangent"):
        flat[name] = flat[name] @ np.float64([[1, 0, 0], [0, 0, 1], [0, -1, 0]])
    flat["positions"][:, 2] = 0.1
    above = snapshot_of(mesh_of(flat), constant_textures(alpha=0.5), volume=VOLUME, lights=(dim,))
    above = replace(above, shading=LOOK, ambient=few.ambient)
    alone, both = (
        radiance_of(view.shows(**grooms)[..., :3])
        for grooms in ({"b": few}, {"b": few, "a": above})
    )
    below = slice(row_of(0.0, -0.2) + 1, row_of(0.1, -0.2) - 1), slice(SIZE // 4, -SIZE // 4)
    seen = alone[below].min(axis=2) > 0.0
    assert (both[below][seen] / alone[below][seen]).mean() == pytest.approx(0.5, abs=0.03)
    rendered = of_render(few, above)
    np.testing.assert_allclose(both[below], rendered[below][..., :3], atol=1.0e-3)
    assert [each.uid for each in shown_in(view)] == [2, 1], "cards blend over strands"


def test_grooms_far_apart_get_the_same_lights() -> None:
    """Grooms in one view share the eight lamps, of ten, that are brightest at the first groom."""
    lamps = [Light.point((float(x), 0.0, 0.5), (1.0, 1.0, 1.0), 10.0) for x in range(10)]
    ends = [
        sheet(0.0, 4, lights=brightest_lights(lamps, np.array([x, 0.0, 0.0]))) for x in (0.0, 9.0)
    ]
    assert ends[0].lights != ends[1].lights
    lit = overlay._with_shared_lights(ends)
    assert lit[0].lights == lit[1].lights == brightest_lights(lamps, ends[0].center)
    assert overlay._with_shared_lights(ends[:1]) == ends[:1]


def test_a_clipping_region_may_cut_the_head_away_that_hides_hair(view: SmallView) -> None:
    hidden = sheet(0.0, 4, occluder_spheres=np.float32([[0.0, 0.0, -0.2, 0.1]]))
    overlay.show(1, overlay.GroomDrawing(hidden))
    keys = []
    for is_clipped in (False, True):
        view.context.region_data.use_clip_planes = is_clipped
        (shown,) = shown_in(view)
        assert (shown.snapshot.occluder_spheres is None) is is_clipped
        assert shown.snapshot.detail.culling == ("none" if is_clipped else "hidden")
        keys.append(shown.key)
    assert keys[0] != keys[1], "its picture is drawn again"


@pytest.mark.parametrize(("left", "engine"), [(0.0, "BLENDER_EEVEE"), (1.0, "CYCLES")])
def test_without_overlays_hair_is_there_and_its_head_hides_it(
    view: SmallView, left: float, engine: str
) -> None:
    """Without overlays, EEVEE leaves depth 0 and Cycles depth 1: the head's own depth is used."""
    hair = sheet(0.0, 400)
    corners = np.float32([[-1, -0.05, -1], [0, -0.05, -1], [0, -0.05, 1], [-1, -0.05, 1]])
    # in the left half, in the middle of the hair's depth
    wall = Surface(corners, np.int32([[0, 1, 2], [0, 2, 3]]))
    all_hair = view.shows(a=hair)[..., 3]
    view.context.scene.render.engine = engine
    view.space.shading.type = "RENDERED"
    view.space.overlay.show_overlays, view.depth = False, left
    overlay.show(1, overlay.GroomDrawing(hair, head=wall))
    found = view.drawn()[..., 3]
    middle, before = SIZE // 2, row_of(0.0, -0.05)
    assert (found[:, middle + 1 :] == all_hair[:, middle + 1 :]).all()
    assert found[: before - 1, : middle - 1].mean() > 0.5, "before the wall"
    assert (found[before + 2 :, : middle - 1] == 0.0).all() and all_hair[before + 2 :].max() > 0.0
    overlay.show(
        1,
        overlay.GroomDrawing(hair, head=wall, headless_views=frozenset({view.space.as_pointer()})),
    )
    assert (view.drawn()[..., 3] == all_hair).all(), "a head that is not shown hides nothing"
    view.space.overlay.show_overlays, view.depth = True, 0.0
    assert view.drawn()[..., 3].max() == 0.0, "Blender's own depths count"
