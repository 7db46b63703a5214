"""What each shipped hairstyle must fulfil, added by the artist's button to a new head, or fur to
Blender's monkey.

- seconds: from the click until all hair is shown, in the quick light that the window shows first;
  seconds_until_lit: until it has its own light. The head and its distance field exist before.
- bald: how much of the scalp inside the hairline shows through from six sides: squares of 2 mm of
  which hair covers less than a quarter, by the total area of strands in front of the skin.
- inside: strands deeper than 1 mm in the head's mesh, by winding number.
- length: difference in length of drawn strands from the curves that Blender's nodes make.
- fit_distance: distance of roots from other heads, by Blender's own search; fit_inside: strands
  inside these. They are MakeHuman's base mesh shaped as another person, Sintel's head, and one like
  a scan of that person: few triangles with noise and holes, turned, in centimetres.
- edit_ms: a stroke over curls, 20,000 of them by Blender's nodes and our children, until the
  strands follow; paint_ms: a dab on the density of 20,000 children, until they follow;
  paint_all_ms: until all strands are there; paint_light_ms: until they have their own light; see
  `_combing`.
- cards_coverage, cards_color: cards beside the strands, see `_styles_cards`. Only on request: a
  minute for each style.

Exit code 1: a limit is missed.

make bench NAME=styles
tools/bench.py styles bob curls          some styles
tools/bench.py styles fit                other heads alone
tools/bench.py styles edit               editing alone
tools/bench.py styles cards bob curls    cards of some styles, or of all of heads
"""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from unittest.mock import patch

import bpy
import numpy as np
from _combing import combed, painted, styled
from _report import report, start
from _styles_cards import card_figures
from mathutils import Vector

import hairloom
from hairloom.addon.arrays import Bools, Floats, number_in_piece
from hairloom.addon.blender.base import latest_job
from hairloom.addon.blender.colliders.fields import field_of
from hairloom.addon.blender.preview import previews, scene_events
from hairloom.addon.blender.scene.built_in_head import built_in_head
from hairloom.addon.blender.scene.curves import read_curves
from hairloom.addon.blender.scene.surfaces import read_surface
from hairloom.addon.blender.setup.hairstyles import (
    grows_anywhere,
    named_hairstyle,
    shipped_hairstyles,
)
from hairloom.addon.dynamics.colliders import PosedCollider
from hairloom.addon.dynamics.colliders.signed_distance import signed_distance
from hairloom.addon.dynamics.colliders.winding import winding_number
from hairloom.addon.dynamics.settings import DynamicsSettings
from hairloom.addon.rig_flow import Rig
from hairloom.addon.strands import StrandSet, Surface
from hairloom.addon.strands.closest_point import ClosestPointSearch

REFERENCE = "the curves that Blender evaluates, and the triangles of the built-in head"
#: least numbers of hairstyles: heads of hair; and brows, lashes, beards and fur
MIN_LIMITS = {"heads": 16, "extras": 7}
MAX_LIMITS = {
    "*_inside_percent": 0.0,
    "*_length_error_percent": 0.5,
    "*_seconds": 3.0,
    "edit_ms": 100.0,
    "paint_ms": 500.0,
    "fit_distance_mm": 0.5,
    "*_cards_coverage_percent": 10.0,
    "*_cards_color_percent": 10.0,
}
#: most skin that may show inside the hairline [%]
BALD = 1.0
#: styles that are meant to show skin -> the most [%]; None: not checked
BARE: dict[str, float | None] = {
    "buzz_cut": 3.0,
    "crop_fade": 12.0,
    "undercut": 12.0,
    "box_braids": 10.0,
    "stubble": None,
    "brows": None,
    "lashes": None,
    "moustache": None,
}
SIDES = np.concatenate([np.eye(3), -np.eye(3)[:2], [[0.0, 0.7, 0.7]]])
SQUARE, COVERED, STEP = 0.002, 0.25, 0.0006  # [m], fraction of a square, [m]
DEEP = 0.001  # [m]
_CHUNK = 2_000_000
#: styles that are added to other heads
FITTED = ("long_straight", "curls", "full_beard")
DATA = Path(os.environ.get("HAIRLOOM_DATA", Path(__file__).parents[2] / "shared" / "data"))
#: of MakeHuman's base mesh: number of vertices of its skin, and the middle of its skull [m]
SKIN, MAKEHUMANS_SKULL = 13380, np.array([0.0, -0.06, 0.735])


def bald(strands: StrandSet, head: Surface, group: str) -> float:
    """The percentage of squares with skin of this group in front that show it.

    Args:
        group: vertex group of the built-in head; "": the whole surface.
    """
    weights = built_in_head().weights[group] if group else np.ones(len(head.positions))
    place, is_scalp = skin_samples(head, weights > 0.5)
    hair, area = hair_samples(strands)
    shown, seen = 0, 0
    for side in SIDES:
        across = np.linalg.svd(side[None])[2][1:]
        low = (place @ across.T).min(axis=0) - 10 * SQUARE
        size = np.ceil((np.ptp(place @ across.T, axis=0) + 20 * SQUARE) / SQUARE).astype(int)
        cell, depth = cells(place, across, side, low, size)
        nearest = np.full(size.prod(), -np.inf)
        np.maximum.at(nearest, cell, depth)
        is_top = depth > nearest[cell] - 0.002
        scalp = np.bincount(cell[is_top & is_scalp], minlength=size.prod())
        other = np.bincount(cell[is_top & ~is_scalp], minlength=size.prod())
        cover = np.zeros(size.prod())
        for first in range(0, len(hair), _CHUNK):
            part = slice(first, first + _CHUNK)
            of_hair, height = cells(hair[part], across, side, low, size)
            is_before = height > nearest[of_hair] - 0.001
            cover += np.bincount(of_hair[is_before], area[part][is_before], size.prod())
        is_seen = (scalp > 0) & (other == 0)
        seen += int(is_seen.sum())
        shown += int((is_seen & (cover / SQUARE**2 < COVERED)).sum())
    return 100.0 * shown / seen


def cells(
    points: Floats, across: Floats, side: Floats, low: Floats, size: Floats
) -> tuple[Any, Floats]:
    """The square that each point is in, and how near to the eye it is."""
    place = np.floor((points @ across.T - low) / SQUARE).astype(int)
    place = np.clip(place, 0, size - 1)
    return place[:, 0] * size[1] + place[:, 1], points @ (side / np.linalg.norm(side))


def skin_samples(surface: Surface, is_scalp: Bools) -> tuple[Floats, Bools]:
    """Points of the whole head, closer to each other than squares are wide, and which are scalp."""
    corners = surface.corners.astype(np.float64)
    grid = [(a, b, 8 - a - b) for a in range(9) for b in range(9 - a)]
    weight = np.array(grid) / 8.0
    points = np.einsum("wk,tkj->twj", weight, corners).reshape(-1, 3)
    inside = is_scalp[surface.triangles].all(axis=1)
    return points, np.repeat(inside, len(weight))


def hair_samples(strands: StrandSet) -> tuple[Floats, Floats]:
    """Points along all strands, and the area [m2] that each covers."""
    first = np.delete(np.arange(strands.point_count - 1), strands.offsets[1:-1] - 1)
    begin, end = (strands.points[first + k].astype(np.float64) for k in (0, 1))
    length = np.linalg.norm(end - begin, axis=1)
    count = np.maximum(np.ceil(length / STEP).astype(int), 1)
    segment = np.repeat(np.arange(len(first)), count)
    inside = (number_in_piece(count) + 0.5) / count[segment]
    points = begin[segment] + inside[:, None] * (end - begin)[segment]
    width = strands.radius[first] + strands.radius[first + 1]
    return points.astype(np.float32), (width * length / count)[segment]


def inside_percent(strands: StrandSet, head: Surface, min_depth: float = DEEP) -> float:
    """The percentage of strands with a point in the mesh that is deeper than `min_depth` [m]."""
    field = field_of(head, DynamicsSettings(), place="head")
    posed = (PosedCollider(field, np.eye(4), np.eye(4)),)
    index = np.flatnonzero(signed_distance(strands.points, posed, 10.0 * min_depth)[0] < 0.0)
    index = index[np.abs(winding_number(strands.points[index], head)) > 0.5]
    if not len(index):
        return 0.0
    deep = index[ClosestPointSearch(head).closest(strands.points[index]).distance > min_depth]
    of_strand = np.searchsorted(strands.offsets, deep, side="right") - 1
    return 100.0 * len(np.unique(of_strand)) / strands.strand_count


def added(name: str) -> tuple[Rig, float, float, float]:
    """The rig, the seconds until it was shown and until it had its own light, and the worst error
    of lengths [%]. It is made in a thread, as in a window."""
    scene_events.clear()
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    if grows_anywhere(named_hairstyle(name)):
        bpy.ops.mesh.primitive_monkey_add(size=0.2)
        bpy.context.object.modifiers.new("Smooth", "SUBSURF").levels = 2
    else:
        bpy.ops.hairloom.add_hairstyle(style="buzz_cut", plays=False)
        bpy.ops.hairloom.preview()
        head = next(obj for obj in bpy.data.objects if obj.type == "MESH")
        bpy.context.view_layer.objects.active = head
    start = time.process_time(), time.perf_counter()

    def passed() -> float:
        """The smaller of two times: other load must not count, nor several cores more than once."""
        return min(time.process_time() - start[0], time.perf_counter() - start[1])

    with patch.object(latest_job, "is_blocking", lambda: False):
        bpy.ops.hairloom.add_hairstyle(style=name, plays=False)
    hair, depsgraph = bpy.context.object, bpy.context.evaluated_depsgraph_get()
    session = previews.session_of(hair)
    assert session is not None
    while session.is_pending and not session.is_lighting:
        session.take_made(depsgraph)
    seconds = passed()
    session.finish(depsgraph)
    lit = passed()
    drawn = session.rig.strands
    made = read_curves(hair, bpy.context.evaluated_depsgraph_get()).strands
    ratio = drawn.lengths()[: made.strand_count] / made.lengths()
    return session.rig, seconds, lit, 100.0 * float(np.abs(ratio - 1.0).max())


def other_heads() -> Iterator[tuple[str, Any]]:
    """The name and the object of each head, selected in a new scene."""
    for name, make in (("makehuman", _makehuman), ("sintel", _sintel), ("scan", _scan)):
        scene_events.clear()
        bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
        head = make()
        bpy.context.view_layer.objects.active = head
        head.select_set(True)
        yield name, head


def _makehuman() -> Any:
    """MakeHuman's base mesh with its helpers, with a wide jaw, a high skull and a long nose."""
    bpy.ops.wm.obj_import(filepath=str(DATA / "makehuman" / "mh_base.obj"), global_scale=0.1)
    head = bpy.context.object
    bpy.ops.object.transform_apply()
    points = np.array([vertex.co[:] for vertex in head.data.vertices]) - MAKEHUMANS_SKULL
    x, y, z = points.T
    wide = 1.0 + 0.12 * np.exp(-(((z + 0.08) / 0.06) ** 2))
    high = 0.08 * (z + 0.12) / (1.0 + np.exp(-(z + 0.12) / 0.02))
    nose = 0.012 * np.exp(-(((z + 0.045) / 0.02) ** 2) - (x / 0.02) ** 2) * (y < -0.06)
    shaped = np.stack([x * wide, y - nose, z + high], axis=1) + MAKEHUMANS_SKULL
    head.data.vertices.foreach_set("co", shaped.astype(np.float32).ravel())
    skin = {vertex for face in head.data.polygons for vertex in face.vertices if vertex < SKIN}
    head.vertex_groups.new(name="body").add(sorted(skin), 1.0, "REPLACE")
    head.modifiers.new("Hide Helpers", "MASK").vertex_group = "body"
    return head


def _sintel() -> Any:
    bpy.ops.wm.obj_import(filepath=str(DATA / "sintel" / "sintel.obj"))
    return bpy.context.object


def _scan() -> Any:
    head = _makehuman()
    surface = read_surface(head, bpy.context.evaluated_depsgraph_get(), need_uv=False, place="head")
    above = (surface.corners[..., 2] > MAKEHUMANS_SKULL[2] - 0.16).all(axis=1)
    bpy.data.objects.remove(head)
    mesh = bpy.data.meshes.new("Scan")
    mesh.from_pydata(surface.positions.tolist(), [], surface.triangles[above].tolist())
    whole = bpy.data.objects.new("Scan", mesh)
    bpy.context.collection.objects.link(whole)
    whole.modifiers.new("Fewer", "DECIMATE").ratio = 0.3
    depsgraph = bpy.context.evaluated_depsgraph_get()
    few = read_surface(whole, depsgraph, need_uv=False, place="scan")
    bpy.data.objects.remove(whole)
    random = np.random.default_rng(1)
    noisy = 100.0 * (few.positions + random.normal(0.0, 0.0006, few.positions.shape))
    triangles = few.triangles[random.random(len(few.triangles)) > 0.01]
    mesh = bpy.data.meshes.new("Scan")
    mesh.from_pydata(noisy.tolist(), [], triangles.tolist())
    head = bpy.data.objects.new("Scan", mesh)
    head.rotation_euler.z = np.radians(25.0)
    bpy.context.collection.objects.link(head)
    bpy.context.view_layer.update()
    return head


def fit_figures() -> dict[str, float]:
    """The worst of three styles on each of the other heads: distance of a root [mm, at the size of
    the built-in head], strands inside [%], and seconds."""
    found: dict[str, float] = {}
    for style in FITTED:
        for name, head in other_heads():
            start = time.process_time()
            bpy.ops.hairloom.add_hairstyle(style=style, plays=False)
            took, hair = time.process_time() - start, bpy.context.object
            session = previews.session_of(hair)
            assert session is not None and session.rig.head is not None
            larger = 100.0 if name == "scan" else 1.0
            depsgraph = bpy.context.evaluated_depsgraph_get()
            mesh, far = head.evaluated_get(depsgraph), 0.0
            back = head.matrix_world.inverted()
            for root in read_curves(hair, depsgraph).strands.roots:
                local = back @ Vector(root.tolist())
                far = max(far, (mesh.closest_point_on_mesh(local)[1] - local).length)
            inside = inside_percent(session.rig.strands, session.rig.head, DEEP * larger)
            figures = {
                "fit_distance_mm": 1000.0 * far / larger,
                "fit_inside_percent": inside,
                "fit_seconds": took,
            }
            print(style, name, {key: round(value, 5) for key, value in figures.items()}, flush=True)
            for key, value in figures.items():
                found[f"{name}_{key}"] = max(found.get(f"{name}_{key}", 0.0), value)
    for key in ("fit_distance_mm", "fit_inside_percent", "fit_seconds"):
        found[key] = max(value for name, value in found.items() if name.endswith(f"_{key}"))
    return found


def main(names: list[str]) -> int:
    start()
    hairloom.register()
    field_of(built_in_head().surface, DynamicsSettings(), place="head")
    styles = [entry.name for entry in shipped_hairstyles()]
    found: dict[str, Any] = {"styles": len(styles)}
    masks = [named_hairstyle(name).masks.get("children", "") for name in styles]
    heads = masks.count("scalp")
    found |= {"heads": heads, "extras": len(styles) - heads}
    max_limits = dict(MAX_LIMITS)
    if not names or "fit" in names:
        found |= fit_figures()
    if not names or "edit" in names:
        hair = styled("curls")
        found |= {"edit_ms": combed(hair)["comb_ms"], **painted(hair)}
    parts = ("fit", "edit", "cards")
    chosen = [name for name in names if name not in parts]
    if "cards" in names:
        own = [name for name, mask in zip(styles, masks, strict=True) if mask == "scalp"]
        for name in chosen or own:
            figures = card_figures(name)
            print(name, {key: round(value, 3) for key, value in figures.items()}, flush=True)
            found |= {f"{name}_{key}": value for key, value in figures.items()}
        return report(found, REFERENCE, max_limits=max_limits, min_limits=MIN_LIMITS)
    for name in chosen or (styles if not names else []):
        rig, seconds, lit, length_error = added(name)
        head, group = rig.head, named_hairstyle(name).masks.get("children", "")
        assert head is not None
        figures = {
            "strands": rig.strands.strand_count,
            "inside_percent": inside_percent(rig.strands, head),
            "length_error_percent": length_error,
            "seconds": seconds,
            "seconds_until_lit": lit,
        }
        bare = BARE.get(name, BALD)
        if bare is not None:
            figures["bald_percent"] = bald(rig.strands, head, group)
            max_limits[f"{name}_bald_percent"] = bare
        found |= {f"{name}_{key}": value for key, value in figures.items()}
        print(name, {key: round(value, 3) for key, value in figures.items()}, flush=True)
    return report(found, REFERENCE, max_limits=max_limits, min_limits=MIN_LIMITS)


sys.exit(main(sys.argv[1:]))
