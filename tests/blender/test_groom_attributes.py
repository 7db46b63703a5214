"""Attributes of a groom beside its strands, stored on hair curves."""

from dataclasses import replace

import bpy
import numpy as np
import pytest

from hairloom.addon.blender.scene.curves import read_curves, write_curves
from hairloom.addon.blender.scene.groom_attributes import (
    store_groom,
    store_group_names,
    stored_groom,
)
from hairloom.addon.blender.scene.source import read_source
from hairloom.addon.exchange.groom import Groom
from hairloom.addon.strands import StrandSet

FIELDS = ("color", "strand_id", "is_guide", "closest_guides", "guide_weights")


def full_groom(counts=(2, 5, 16, 3), seed=0):
    rng = np.random.default_rng(seed)
    offsets = np.concatenate([[0], np.cumsum(counts)])
    strands = StrandSet(
        points=rng.normal(size=(offsets[-1], 3)),
        offsets=offsets,
        radius=rng.uniform(1e-5, 1e-3, offsets[-1]),
        group=np.arange(len(counts)) % 3,
        root_uv=rng.random((len(counts), 2)),
        color=rng.random((offsets[-1], 3)) * 3.0,
    )
    # IDs that float32 cannot distinguish
    ids = (1 << 30) + np.arange(len(counts))
    return Groom(
        strands,
        strand_id=ids,
        is_guide=np.arange(len(counts)) % 2 == 0,
        closest_guides=ids[rng.integers(0, len(counts), (len(counts), 3))],
        guide_weights=rng.dirichlet(np.ones(3), len(counts)),
        group_names={0: "front", 2: "Nähte"},
    )


def written(groom):
    hair = write_curves("Hair", groom.strands, None, bpy.context.collection)
    store_groom(hair.data, groom)
    return hair


def read_back(hair):
    depsgraph = bpy.context.evaluated_depsgraph_get()
    cleaned = read_curves(hair, depsgraph)
    return Groom(cleaned.strands, **stored_groom(hair, depsgraph, cleaned.curve_indices))


def assert_same(read, groom):
    for name in FIELDS:
        expected = getattr(groom, name)
        if expected is None:
            assert getattr(read, name) is None, name
        else:
            np.testing.assert_array_equal(getattr(read, name), expected, err_msg=name)
    assert dict(read.group_names) == dict(groom.group_names)


def test_all_attributes_are_read_back_bit_for_bit():
    groom = full_groom()
    assert_same(read_back(written(groom)), groom)


def test_a_groom_of_points_alone_writes_no_attributes():
    groom = Groom(replace(full_groom().strands, color=None))
    hair = written(groom)
    assert {each.name for each in hair.data.attributes} <= {
        *("position", "radius", "curve_type", "groom_group_id", "surface_uv_coordinate")
    }
    assert_same(read_back(hair), groom)


def test_it_outlives_saving_and_opening(tmp_path):
    groom = full_groom()
    written(groom)
    path = str(tmp_path / "groom.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path)
    bpy.ops.wm.open_mainfile(filepath=path)
    assert_same(read_back(bpy.data.objects["Hair"]), groom)


def test_attributes_of_dropped_curves_are_dropped():
    groom = full_groom()
    hair = written(groom)
    points = groom.strands.points.copy()
    points[2:7] = np.nan  # the second curve
    hair.data.position_data.foreach_set("vector", points.ravel())
    kept = groom.take(np.array([0, 2, 3]))
    read = read_back(hair)
    for name in ("color", "strand_id", "is_guide"):
        np.testing.assert_array_equal(getattr(read, name), getattr(kept, name))


def test_modifiers_carry_it_along():
    """The modifier makes new geometry, which drops the custom properties that hold names."""
    groom = full_groom()
    hair = written(groom)
    tree = bpy.data.node_groups.new("Same", "GeometryNodeTree")
    for way in ("INPUT", "OUTPUT"):
        tree.interface.new_socket("Geometry", in_out=way, socket_type="NodeSocketGeometry")
    nodes = [tree.nodes.new(name) for name in ("NodeGroupInput", "NodeGroupOutput")]
    moving = tree.nodes.new("GeometryNodeSetPosition")
    moving.inputs["Offset"].default_value = (0.0, 0.0, 1.0)
    tree.links.new(nodes[0].outputs[0], moving.inputs["Geometry"])
    tree.links.new(moving.outputs[0], nodes[1].inputs[0])
    hair.modifiers.new("Same", "NODES").node_group = tree
    read = read_back(hair)
    assert read.strands.points[0, 2] == pytest.approx(groom.strands.points[0, 2] + 1.0)
    assert_same(read, groom)


@pytest.mark.parametrize("faulty", [np.nan, -0.5, np.inf])
def test_a_strand_with_a_colour_that_cannot_be_used_has_none(faulty):
    groom = full_groom()
    hair = written(groom)
    opaque = np.ones((len(groom.color), 4), np.float32)
    opaque[:, :3] = groom.color
    opaque[3, 1] = faulty  # in the second strand
    hair.data.attributes["color"].data.foreach_set("color", opaque.ravel())
    read = read_back(hair).color
    assert np.isnan(read[2:7]).all()
    np.testing.assert_array_equal(read[:2], groom.color[:2])
    np.testing.assert_array_equal(read[7:], groom.color[7:])
    warnings = read_source(hair, bpy.context.evaluated_depsgraph_get()).warnings
    assert sum("1 of 4 strands have no usable colour" in warning for warning in warnings) == 1


def test_ids_that_are_not_unique_are_ignored():
    groom = full_groom()
    hair = written(groom)
    hair.data.attributes["groom_id"].data[1].value = int(groom.strand_id[0])
    read = read_back(hair)
    assert read.strand_id is None
    assert read.closest_guides is None
    np.testing.assert_array_equal(read.is_guide, groom.is_guide)


def test_missing_closest_guides_are_ignored():
    groom = full_groom()
    hair = written(groom)
    hair.data.attributes["groom_closest_guide_2"].data[1].value = 7
    read = read_back(hair)
    assert read.closest_guides is None and read.guide_weights is None
    np.testing.assert_array_equal(read.strand_id, groom.strand_id)


def test_a_colour_of_whole_curves_and_of_bytes_counts_too():
    groom = full_groom()
    uncolored = replace(groom.strands, color=None)
    hair = write_curves("Hair", uncolored, None, bpy.context.collection)
    painted = hair.data.attributes.new("color", "BYTE_COLOR", "CURVE")
    painted.data[2].color_srgb = (0.6, 0.0, 1.0, 1.0)
    color = read_back(hair).color
    start = groom.strands.offsets[2]
    assert color[start : start + 16] == pytest.approx(
        np.tile([[0.3185, 0.0, 1.0]], (16, 1)), abs=1e-3
    )
    assert (color[:start] == 1.0).all()  # Blender's default for a new attribute


def test_attributes_of_another_kind_are_left_alone():
    hair = write_curves("Hair", full_groom().strands, None, bpy.context.collection)
    hair.data.attributes.new("color", "FLOAT", "POINT")
    hair.data.attributes.new("groom_id", "FLOAT_VECTOR", "CURVE")
    hair.data.attributes.new("groom_guide", "BOOLEAN", "POINT")
    hair.data["groom_group_names"] = "front"
    assert_same(read_back(hair), Groom(full_groom().strands))


def test_names_with_keys_that_are_no_numbers_are_left_out():
    hair = write_curves("Hair", full_groom().strands, None, bpy.context.collection)
    store_group_names(hair.data, {-1: "none", 4: "four"})
    hair.data["groom_group_names"]["five"] = "5"
    hair.data["groom_group_names"]["6"] = 6
    assert dict(read_back(hair).group_names) == {-1: "none", 4: "four"}


def test_curves_without_curves():
    hair = bpy.data.objects.new("Empty", bpy.data.hair_curves.new("Empty"))
    bpy.context.collection.objects.link(hair)
    assert read_back(hair).strands.strand_count == 0
