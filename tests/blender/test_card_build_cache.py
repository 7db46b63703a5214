"""Cards that were built last are reused, but never after a change that affects them."""

from __future__ import annotations

import gc
import weakref
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import bpy
import numpy as np
import pytest
from swinging import key_x

from hairloom.addon.blender.cards import build, build_cache
from hairloom.addon.blender.cards.build_cache import CardBuildCache
from hairloom.addon.blender.cards.made_objects import card_objects
from hairloom.addon.blender.colliders import rigs
from hairloom.addon.blender.preview import previews
from hairloom.addon.blender.scene.curves import write_curves


def counted(monkeypatch: pytest.MonkeyPatch, owner: Any, name: str) -> list[str]:
    """Record each call of a function in the returned list."""
    calls: list[str] = []
    make = getattr(owner, name)

    def counting(*arguments: Any, **named: Any) -> Any:
        calls.append(name)
        return make(*arguments, **named)

    monkeypatch.setattr(owner, name, counting)
    return calls


@pytest.fixture
def builds(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    return counted(monkeypatch, build, "card_build_steps")


@pytest.fixture
def hair(new_hair: Callable[..., Any], sphere: Any, tmp_path: Path) -> Any:
    """A hedgehog of 60 strands on a keyframed sphere, set up for few cards with a small texture and
    an artist's picture."""
    key_x(sphere, {1: 0.0, 5: 0.2})
    bpy.context.scene.frame_set(1)
    made = new_hair(sphere)
    cards, texture = made.data.hairloom.cards, made.data.hairloom.card_texture
    cards.source, cards.card_count, cards.levels, cards.fly_aways = "clusters", 12, 2, 0.0
    cards.segment_count, cards.error, cards.order_by = 4, 0.0, "distance"
    made.data.hairloom.atlas.source = "made"
    made.data.hairloom.card_occlusion.rays, made.data.hairloom.card_occlusion.others = 32, True
    texture.height = texture.variant_width = 32
    made.data.hairloom.card_images.base = picture(tmp_path / "base.png", 0.5)
    bpy.context.view_layer.update()
    return made


def picture(path: Path, value: float) -> Any:
    image = bpy.data.images.get("Base") or bpy.data.images.new("Base", 32, 32)
    image.pixels.foreach_set(np.full(32 * 32 * 4, value, np.float32))
    image.file_format, image.filepath_raw = "PNG", str(path)
    image.save()
    image.source = "FILE"
    image.reload()
    return image


def make() -> None:
    assert bpy.ops.hairloom.make_cards() == {"FINISHED"}
    bpy.context.view_layer.update()


def written(folder: Path) -> dict[str, bytes]:
    """All files of an export of the active hair."""
    folder.mkdir()
    assert bpy.ops.hairloom.export_cards(filepath=str(folder / "cards.glb")) == {"FINISHED"}
    return {path.name: path.read_bytes() for path in sorted(folder.iterdir())}


def afresh(folder: Path) -> dict[str, bytes]:
    previews.previews.built_cards.forget()
    return written(folder)


def test_built_cards_are_written_without_building_them_again(
    hair: Any, tmp_path: Path, builds: list[str]
) -> None:
    own = afresh(tmp_path / "own")
    assert len(own) > 3 and len(builds) == 1
    assert written(tmp_path / "again") == own, "writing changes nothing of what is kept"
    previews.previews.built_cards.forget()
    make()
    assert len(builds) == 2
    assert written(tmp_path / "kept") == own and len(builds) == 2
    make()
    assert len(builds) == 2 and len(card_objects(hair)) == 2


def comb(hair: Any, _folder: Path) -> None:
    hair.data.position_data[7].vector.z += 0.01
    hair.data.update_tag()


def sculpt(hair: Any, _folder: Path) -> None:
    for vertex in hair.data.surface.data.vertices:
        vertex.co *= 1.05
    hair.data.surface.data.update_tag()


def ask_for_more(hair: Any, _folder: Path) -> None:
    hair.data.hairloom.cards.card_count = 14


def grow_children(hair: Any, _folder: Path) -> None:
    hair.data.hairloom.children.method = "multi"
    hair.data.hairloom.children.strand_count = 100


def dye(hair: Any, _folder: Path) -> None:
    hair.data.hairloom.shading.melanin = 0.1


def shade_less(hair: Any, _folder: Path) -> None:
    hair.data.hairloom.ambient.strength = 0.3


def paint_over_the_picture_on_disk(_hair: Any, folder: Path) -> None:
    """Another program changes the file, and Blender reloads it."""
    image = bpy.data.images["Base"]
    other = bpy.data.images.new("Other", 32, 32)
    other.pixels.foreach_set(np.full(32 * 32 * 4, 0.2, np.float32))
    other.file_format, other.filepath_raw = "PNG", str(folder / "base.png")
    other.save()
    image.reload()


def drop_the_picture(hair: Any, _folder: Path) -> None:
    hair.data.hairloom.card_images.base = None


def edit_a_card(hair: Any, _folder: Path) -> None:
    finest = card_objects(hair)[0]
    card = np.zeros(len(finest.data.polygons), np.int32)
    finest.data.attributes["made_card"].data.foreach_get("value", card)
    corners = {
        vertex
        for face in np.flatnonzero(card == 1)
        for vertex in finest.data.polygons[int(face)].vertices
    }
    for vertex in corners:
        finest.data.vertices[vertex].co.z += 0.05
    finest.data.update()


def go_to_another_frame(_hair: Any, _folder: Path) -> None:
    bpy.context.scene.frame_set(4)


def add_other_hair(hair: Any, _folder: Path) -> None:
    """Add hair that shades this hair."""
    from hedgehogs import hedgehog

    other = write_curves("Other", hedgehog(), hair.data.surface, bpy.context.collection)
    other.data.hairloom.children.method = "none"
    other.data.hairloom.widths.method = "own"


CHANGES = (
    comb,
    sculpt,
    ask_for_more,
    grow_children,
    dye,
    shade_less,
    paint_over_the_picture_on_disk,
    drop_the_picture,
    edit_a_card,
    go_to_another_frame,
    add_other_hair,
)


@pytest.mark.parametrize("change", CHANGES, ids=lambda change: change.__name__)
def test_cards_are_not_taken_for_others(
    hair: Any, tmp_path: Path, builds: list[str], change: Any
) -> None:
    make()
    before = written(tmp_path / "before")
    assert len(builds) == 1
    change(hair, tmp_path)
    bpy.context.view_layer.update()
    found = written(tmp_path / "found")
    assert len(builds) == 2, "they are others"
    assert found == afresh(tmp_path / "own") and found != before


def test_a_setting_changed_back_needs_no_rebuild(
    hair: Any, tmp_path: Path, builds: list[str]
) -> None:
    """Such as by undo."""
    make()
    hair.data.hairloom.cards.card_count = 14
    hair.data.hairloom.cards.card_count = 12
    found = written(tmp_path / "found")
    assert len(builds) == 1 and found == afresh(tmp_path / "own")


def test_other_levels_are_built(hair: Any, tmp_path: Path, builds: list[str]) -> None:
    make()
    bpy.ops.hairloom.export_cards(filepath=str(tmp_path / "cards.glb"), own_levels=True, levels=1)
    assert len(builds) == 2


def test_an_atlas_is_drawn_again_where_a_gpu_has_come_or_gone(
    hair: Any, tmp_path: Path, builds: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    hair.data.hairloom.atlas.source = "baked"
    hair.data.hairloom.atlas.size, hair.data.hairloom.card_images.base = "256", None
    for module in (build, build_cache):
        monkeypatch.setattr(module, "has_gpu", lambda: False)
    make()
    written(tmp_path / "kept")
    assert len(builds) == 1
    monkeypatch.setattr(build_cache, "has_gpu", lambda: True)
    written(tmp_path / "drawn")
    assert len(builds) == 2


@pytest.fixture
def last(monkeypatch: pytest.MonkeyPatch) -> list[weakref.ref[build.MappedCards]]:
    """Weak references to all cards that were ever kept."""
    found: list[weakref.ref[build.MappedCards]] = []
    keep = CardBuildCache.keep

    def seen(self: Any, hair: Any, inputs: Any, made: Any) -> None:
        found.append(weakref.ref(made))
        keep(self, hair, inputs, made)

    monkeypatch.setattr(CardBuildCache, "keep", seen)
    return found


def other_file(_hair: Any) -> None:
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)


def gone(hair: Any) -> None:
    bpy.data.objects.remove(hair)
    bpy.context.view_layer.update()


def ended(_hair: Any) -> None:
    previews.end()


def no_longer_previewed(hair: Any) -> None:
    previews.stop(previews.start(hair, bpy.context.evaluated_depsgraph_get()))


@pytest.mark.parametrize(
    "end", [other_file, gone, ended, no_longer_previewed], ids=lambda end: end.__name__
)
def test_cached_cards_are_freed_when_unused(hair: Any, end: Any, last: list[Any]) -> None:
    make()
    gc.collect()
    assert last[0]() is not None
    end(hair)
    gc.collect()
    assert last[0]() is None


def test_old_cards_are_released_before_new_ones_are_built(hair: Any, last: list[Any]) -> None:
    """The old cards are freed first, so that both are never in memory at once."""
    make()
    hair.data.hairloom.cards.card_count = 14
    steps = bpy.types.HAIRLOOM_OT_make_cards.steps(SimpleNamespace(), bpy.context)
    next(steps)
    next(steps)
    gc.collect()
    assert last[0]() is None
    steps.close()


def test_cards_of_previewed_hair_are_of_its_strands(
    hair: Any, tmp_path: Path, get_depsgraph: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    hair.data.hairloom.children.method = "multi"
    hair.data.hairloom.children.strand_count = 100
    own = afresh(tmp_path / "own")
    session = previews.start(hair, get_depsgraph())
    made = counted(monkeypatch, rigs.rig_flow, "prepare")
    assert afresh(tmp_path / "previewed") == own and not made
    comb(hair, tmp_path)
    bpy.context.view_layer.update()
    found = written(tmp_path / "combed")
    assert made == ["prepare"], "the preview has not read it yet"
    previews.stop(session)
    assert found == afresh(tmp_path / "combed afresh") != own
