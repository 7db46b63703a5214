"""Mirroring hair: on a symmetric mesh only signs change, on other meshes roots are attached."""

import bpy
import numpy as np
import pytest

from hairloom.addon.blender.base.attributes import read_attribute, set_attribute
from hairloom.addon.blender.base.outcome import past_reports
from hairloom.addon.blender.command_line import command_line
from hairloom.addon.blender.scene.curves import curve_offsets, curve_points
from hairloom.addon.blender.scene.surfaces import read_surface
from hairloom.addon.strands import StrandSet
from hairloom.addon.strands.closest_point import search_of

FLIP = np.array([-1.0, 1.0, 1.0], np.float32)


@pytest.fixture
def egg():
    """A head that is symmetric bit for bit: a half sphere, mirrored."""
    bpy.ops.mesh.primitive_uv_sphere_add(radius=0.1, segments=24, ring_count=12)
    head = bpy.context.object
    head.name = "Head"
    mesh = head.data
    places = np.empty((len(mesh.vertices), 3), np.float32)
    mesh.vertices.foreach_get("co", places.ravel())
    for number, place in enumerate(places):
        other = np.linalg.norm(places - place * FLIP, axis=1).argmin()
        places[other] = FLIP * places[number]
        if other == number:
            places[number, 0] = 0.0
    mesh.vertices.foreach_set("co", places.ravel())
    mesh.update()
    return head


def hedgehog():
    """Straight strands around a ball, with 5 and 8 points in turn."""
    outward = np.random.default_rng(1).normal(size=(60, 3))
    outward /= np.linalg.norm(outward, axis=1, keepdims=True)
    counts = np.tile([5, 8], 30)
    along = [0.1 + np.linspace(0.0, 0.08, count)[:, None] for count in counts]
    points = np.concatenate([way * part for way, part in zip(outward, along, strict=True)])
    offsets = np.concatenate([[0], np.cumsum(counts)])
    return StrandSet(points, offsets, np.full(len(points), 5.0e-5), np.zeros(60))


def on_surface(head):
    """The hedgehog with its roots on the facets of the head."""
    strands = hedgehog()
    depsgraph = bpy.context.evaluated_depsgraph_get()
    surface = read_surface(head, depsgraph, need_uv=False, place="Head")
    shift = search_of(surface).closest(strands.roots).point - strands.roots
    points = strands.points + np.repeat(shift, strands.point_counts, axis=0)
    return strands.with_points(points)


def curves_of(hair):
    """The points of each curve."""
    return np.split(curve_points(hair.data), curve_offsets(hair.data)[1:-1])


def away(hair, head):
    depsgraph = bpy.context.evaluated_depsgraph_get()
    surface = read_surface(head, depsgraph, need_uv=False, place="Head")
    roots = np.array([each[0] for each in curves_of(hair)])
    return search_of(surface).closest(roots).distance


def test_on_a_symmetric_head_only_signs_change(new_hair, egg):
    hair = new_hair(egg, on_surface(egg))
    before = curves_of(hair)
    side = np.array([each[0, 0] for each in before])
    assert bpy.ops.hairloom.mirror_hair() == {"FINISHED"}
    after = curves_of(hair)
    count = int((side > 0).sum())
    assert len(after) == 2 * count
    for number, old in enumerate(np.flatnonzero(side > 0)):
        assert np.array_equal(after[number], before[old])
        assert np.array_equal(after[count + number], before[old] * FLIP)
    bpy.ops.hairloom.mirror_hair(side="negative")  # gives the same hair
    again = {each.tobytes() for each in curves_of(hair)}
    assert again == {(each + 0.0).tobytes() for each in after}


def test_mirrored_curves_keep_their_attributes(new_hair, egg):
    strands = on_surface(egg)
    hair = new_hair(egg, strands)
    curves, count = hair.data, strands.strand_count
    random = np.random.default_rng(2)
    own = np.linalg.norm(strands.roots - [0.1, 0.0, 0.0], axis=1)  # a number for each curve
    values = {
        "radius": ("POINT", random.uniform(1e-5, 1e-4, strands.point_count)),
        "color": ("POINT", random.random((strands.point_count, 4))),
        "groom_group_id": ("CURVE", random.integers(0, 5, count)),
        "groom_id": ("CURVE", np.arange(count) + 7),
        "groom_closest_guide_1": ("CURVE", np.arange(count)[::-1] + 7),
        "mine": ("CURVE", own),
    }
    for name, (domain, each) in values.items():
        kind = np.float32 if each.dtype.kind == "f" else np.int32
        set_attribute(curves, name, domain, each.astype(kind))
    source = np.flatnonzero(strands.roots[:, 0] > 0.0)
    bpy.ops.hairloom.mirror_hair()
    half, of_point = len(source), np.repeat(np.arange(count), strands.point_counts)
    for name, (domain, each) in values.items():
        if name in ("groom_id", "groom_closest_guide_1"):
            continue
        chosen = source if domain == "CURVE" else np.flatnonzero(np.isin(of_point, source))
        kept = read_attribute(curves, name, domain, None)
        assert np.allclose(kept[: len(chosen)], each[chosen], atol=1e-7), name
        assert np.array_equal(kept[: len(chosen)], kept[len(chosen) :]), name
    ids = read_attribute(curves, "groom_id", "CURVE")
    assert len(np.unique(ids)) == 2 * half
    closest = read_attribute(curves, "groom_closest_guide_1", "CURVE")
    across = dict(zip(ids.tolist(), np.roll(ids, half).tolist(), strict=True))
    assert closest[half:].tolist() == [across[each] for each in closest[:half].tolist()]
    # guides that no longer exist are replaced by the mirrored ones nearest to their places
    roots = np.array([each[0] for each in curves_of(hair)])[half:]
    for number, named in zip(source.tolist(), closest[:half].tolist(), strict=True):
        was = count - 1 - number
        if was in source:
            assert named == was + 7
        else:
            nearest = np.linalg.norm(roots - strands.roots[was], axis=1).argmin()
            assert named == ids[half + nearest]


@pytest.mark.slow(instead="test_on_a_symmetric_head_only_signs_change")
def test_on_an_asymmetric_head_roots_are_attached(new_hair, egg):
    mesh = egg.data
    places = np.empty((len(mesh.vertices), 3), np.float32)
    mesh.vertices.foreach_get("co", places.ravel())
    places[places[:, 0] < -0.01] *= 1.3
    mesh.vertices.foreach_set("co", places.ravel())
    mesh.update()
    hair = new_hair(egg, on_surface(egg))
    bpy.context.view_layer.update()
    curves = curves_of(hair)
    count = sum(each[0, 0] > 0.0 for each in curves)
    assert bpy.ops.hairloom.mirror_hair() == {"FINISHED"}
    after = curves_of(hair)
    assert len(after) == 2 * count
    assert away(hair, egg).max() < 1e-6
    moved = [
        np.linalg.norm(new[0] - old[0] * FLIP)
        for old, new in zip(after[:count], after[count:], strict=True)
    ]
    assert max(moved) > 0.01
    uv = read_attribute(hair.data, "surface_uv_coordinate", "CURVE", 2)
    assert (uv >= 0.0).all()
    assert (uv <= 1.0).all()
    assert np.ptp(uv[count:, 0]) > 0.3


def test_a_turned_head_is_mirrored_across_its_own_axis(new_hair, egg):
    egg.location, egg.rotation_euler = (0.3, -0.2, 0.1), (0.4, 0.7, 1.1)
    bpy.context.view_layer.update()
    matrix = np.array(egg.matrix_world)
    hair = new_hair(egg, hedgehog().transformed(matrix))
    back = np.linalg.inv(matrix)
    own = [each @ back[:3, :3].T + back[:3, 3] for each in curves_of(hair)]
    assert bpy.ops.hairloom.mirror_hair(side="negative", axis="y") == {"FINISHED"}
    after = [each @ back[:3, :3].T + back[:3, 3] for each in curves_of(hair)]
    source = [each for each in own if each[0, 1] < 0.0]
    for old, kept, new in zip(source, after, after[len(source) :], strict=False):
        assert np.abs(kept - old).max() < 1e-6
        assert np.abs(new - old * [1.0, -1.0, 1.0]).max() < 1e-6


def test_curves_in_the_middle_stay_and_the_report_counts(new_hair, egg, tmp_path, capsys):
    strands = on_surface(egg)
    points = strands.points.copy()
    points[: strands.offsets[5], 0] = 0.0
    hair = new_hair(egg, strands.with_points(points))
    name = hair.name
    roots = points[strands.offsets[:-1], 0]
    more, less = int((roots > 0).sum()), int((roots < 0).sum())
    scene, output = (str(tmp_path / f"{each}.blend") for each in "ab")
    bpy.ops.wm.save_as_mainfile(filepath=scene)
    run = ["run", "mirror_hair", "--scene", scene, "--object", name, "--set", "side=negative"]
    assert command_line.run([*run, "--output", output]) == 0
    message = f"{name}: {less} curves mirrored, {more} replaced, 5 in the middle left unchanged"
    assert message in capsys.readouterr().out
    bpy.ops.wm.open_mainfile(filepath=output)
    assert len(bpy.data.objects[name].data.curves) == 2 * less + 5


def test_undo_and_kept_shapes(new_hair, egg):
    hair = new_hair(egg, on_surface(egg))
    name, long = hair.name, curves_of(hair)
    plane = bpy.data.objects.new("Plane", None)
    bpy.context.collection.objects.link(plane)
    plane.location.z = -0.12
    plane.select_set(True)
    bpy.context.view_layer.update()
    bpy.ops.hairloom.trim_to_shape()
    bpy.ops.ed.undo_push(message="trimmed")
    bpy.ops.hairloom.mirror_hair()
    past_reports.clear()
    bpy.ops.hairloom.revert_trim()
    assert not any("are lost, too" in each.text for each in past_reports), "it is mirrored, too"
    expected = [each for each in long if each[0, 0] > 0.0]
    expected += [each * FLIP for each in expected]
    assert np.array_equal(np.concatenate(curves_of(hair)), np.concatenate(expected))
    bpy.ops.ed.undo_push(message="mirrored")
    bpy.ops.ed.undo()
    assert len(bpy.data.objects[name].data.curves) == 60


def test_all_hair_on_one_side_grows_on_both_with_its_texts(new_hair, egg):
    strands = on_surface(egg)
    hair = new_hair(egg, strands.take(np.flatnonzero(strands.roots[:, 0] > 0.0)))
    count = len(hair.data.curves)
    text = hair.data.attributes.new("note", "STRING", "CURVE")
    for number in range(count):
        text.data[number].value = f"{number}".encode()
    bpy.ops.hairloom.mirror_hair()
    texts = [each.value for each in hair.data.attributes["note"].data]
    assert texts[:count] == texts[count:] == [f"{number}".encode() for number in range(count)]


def test_objects_that_cannot_be_mirrored_are_refused(new_hair, egg):
    strands = on_surface(egg)
    hair = new_hair(egg, strands.take(np.flatnonzero(strands.roots[:, 0] < 0.0)))
    before = curve_points(hair.data)
    with pytest.raises(RuntimeError, match="no curves on the positive side of X"):
        bpy.ops.hairloom.mirror_hair()
    hair.data.surface = hair.parent = None
    with pytest.raises(RuntimeError, match="no surface"):
        bpy.ops.hairloom.mirror_hair(side="negative")
    assert np.array_equal(curve_points(hair.data), before)
