"""The buttons for files do their work, or report what is wrong, where, and what to do."""

import bpy
import numpy as np
import pytest

from hairloom.addon.blender.base.vertex_weights import weight_names
from hairloom.addon.blender.scene.curves import read_curves
from hairloom.addon.exchange.tressfx import read_tfx, write_tfx
from hairloom.addon.strands import StrandSet

pytestmark = pytest.mark.usefixtures("extension")


def grown(head, **settings):
    head.select_set(True)
    bpy.context.view_layer.objects.active = head
    assert bpy.ops.hairloom.grow(**settings) == {"FINISHED"}
    return bpy.context.object


@pytest.fixture
def read_reports(capfd):
    """A function that returns reports since its last call, and refuses tracebacks."""

    def read():
        captured = capfd.readouterr()
        assert "Traceback" not in captured.out + captured.err
        return captured.out

    return read


@pytest.fixture
def groom_file(tmp_path):
    """A .tfx of strands on the sphere of radius 0.1 m."""
    outward = np.random.default_rng(3).normal(size=(40, 3))
    outward /= np.linalg.norm(outward, axis=1, keepdims=True)
    points = outward[:, None] * np.linspace(0.1, 0.2, 8)[None, :, None]
    strands = StrandSet(points.reshape(-1, 3), np.arange(41) * 8, np.full(320, 1e-4), np.zeros(40))
    path = tmp_path / "groom.tfx"
    write_tfx(path, strands)
    return path


def test_grown_hair_stands_on_its_mesh_and_is_ready_for_blenders_tools(sphere):
    sphere.location = (1.0, 2.0, 3.0)
    hair = grown(sphere, strand_count=200, length=0.05)
    assert len(hair.data.curves) == 200
    assert hair.data.surface == sphere and hair.data.surface_uv_map == "UVMap"
    roots = np.array([curve.points[0].position for curve in hair.data.curves])
    assert np.linalg.norm(roots - np.array(sphere.location), axis=1) == pytest.approx(
        np.full(200, 0.1), rel=0.05
    )


def paint_upper_half(mesh, name, weight=1.0):
    """A vertex group with the sphere's upper half; returns the weights, (vertex_count,)."""
    upper = [vertex.index for vertex in mesh.data.vertices if vertex.co.z > 0.02]
    mesh.vertex_groups.new(name=name).add(upper, weight, "REPLACE")
    weights = np.zeros(len(mesh.data.vertices))
    weights[upper] = weight
    return weights


def strands_of(hair):
    depsgraph = bpy.context.evaluated_depsgraph_get()
    return read_curves(hair, depsgraph).strands


def test_guides_grow_along_the_normals_where_and_as_long_as_painted(sphere):
    sphere.location = (1.0, 2.0, 3.0)
    weights = paint_upper_half(sphere, "Scalp")
    attribute = sphere.data.attributes.new("long", "FLOAT", "POINT")
    attribute.data.foreach_set("value", np.full(len(weights), 0.5, np.float32))
    hair = grown(
        sphere,
        method="normals",
        per_vertex=True,
        length=0.1,
        length_variation=0.0,
        density_group="Scalp",
        length_group="long",
    )
    strands = strands_of(hair)
    assert strands.strand_count == (weights > 0.5).sum()
    assert strands.lengths() == pytest.approx(np.full(strands.strand_count, 0.05), rel=1e-4)
    outward = strands.grid - np.array(sphere.location)
    assert outward[:, 0, 2].min() > 0.02
    tip = np.linalg.norm(outward[:, -1], axis=1)
    assert tip == pytest.approx(np.full(len(tip), 0.15), abs=1e-3)


def test_a_group_is_read_after_the_modifiers(sphere):
    """One strand for each vertex of the evaluated mesh: twice as many with a Mirror modifier."""
    weights = paint_upper_half(sphere, "Scalp")
    modifier = sphere.modifiers.new("Mirror", "MIRROR")
    modifier.use_axis, modifier.use_mirror_merge = (True, False, False), False
    hair = grown(sphere, method="normals", per_vertex=True, density_group="Scalp")
    assert len(hair.data.curves) == 2 * (weights > 0.5).sum()


def test_combed_hair_takes_groups_too(sphere):
    paint_upper_half(sphere, "Crown", 0.5)
    hair = grown(sphere, strand_count=50, density_group="Crown", length_group="Crown", length=0.1)
    strands = strands_of(hair)
    assert strands.strand_count == 50
    assert strands.roots[:, 2].min() > 0.0
    assert strands.lengths().max() < 0.052


@pytest.mark.parametrize("option", ["density_group", "length_group"])
def test_a_group_that_cannot_be_used_is_named_and_grows_nothing(option, sphere, read_reports):
    paint_upper_half(sphere, "Scalp")
    sphere.vertex_groups.new(name="Empty")
    sphere.data.attributes.new("on_edges", "FLOAT", "EDGE")
    broken = sphere.data.attributes.new("broken", "FLOAT", "POINT")
    broken.data[3].value = float("nan")
    for name, message in (
        ("Scalpp", "neither a vertex group nor an attribute named 'Scalpp'.*Use one of: Scalp"),
        ("Empty", "0 on every vertex"),
        ("on_edges", "FLOAT on EDGE"),
        ("broken", "not a finite number"),
    ):
        with pytest.raises(RuntimeError, match=message):
            grown(sphere, method="normals", **{option: name})
        read_reports()
    assert [obj.name for obj in bpy.data.objects] == ["Head"]
    assert len(bpy.data.hair_curves) == 0


def test_growing_is_undone_in_one_step(sphere):
    paint_upper_half(sphere, "Scalp")
    bpy.ops.ed.undo_push(message="before")
    bpy.ops.hairloom.grow("EXEC_DEFAULT", True, method="normals", density_group="Scalp")
    assert len(bpy.data.hair_curves) == 1
    bpy.ops.ed.undo()
    assert [obj.name for obj in bpy.data.objects] == ["Head"]
    assert len(bpy.data.hair_curves) == 0


def test_the_weights_of_a_mesh_are_offered_by_name(sphere):
    paint_upper_half(sphere, "Scalp")
    sphere.data.attributes.new("long", "FLOAT", "POINT")
    sphere.data.attributes.new("on_faces", "FLOAT", "FACE")
    sphere.data.attributes.new("on_edges", "FLOAT", "EDGE")
    assert weight_names(sphere) == ["Scalp", "long", "on_faces"]


def test_growing_on_a_mesh_without_faces_is_reported(sphere, read_reports):
    sphere.data.clear_geometry()
    for way in ("combed", "normals"):
        with pytest.raises(RuntimeError, match="no faces"):
            grown(sphere, method=way)
    read_reports()


def test_growing_needs_a_mesh(read_reports):
    with pytest.raises(RuntimeError, match="Select the mesh to grow hair on"):
        bpy.ops.hairloom.grow()


def test_a_head_without_uvs_is_a_warning_with_the_remedy(sphere, groom_file, read_reports):
    sphere.data.uv_layers.remove(sphere.data.uv_layers[0])
    sphere.data.update()
    assert bpy.ops.hairloom.import_strands(filepath=str(groom_file)) == {"FINISHED"}
    assert "Unwrap" in read_reports()
    out = groom_file.with_name("out.tfx")
    assert bpy.ops.hairloom.export_tressfx(filepath=str(out)) == {"FINISHED"}
    assert "Unwrap" in read_reports() and out.is_file()


def test_exported_strands_equal_the_imported_ones(sphere, groom_file, read_reports):
    bpy.ops.hairloom.import_strands(filepath=str(groom_file))
    out = groom_file.with_name("out.tfx")
    assert bpy.ops.hairloom.export_tressfx(filepath=str(out)) == {"FINISHED"}
    assert "40 strands" in read_reports()
    before, after = read_tfx(groom_file).strands, read_tfx(out).strands
    assert after.points == pytest.approx(before.points, abs=1e-6)


def test_export_axes_and_scale_invert_those_of_import(groom_file):
    bpy.ops.hairloom.import_strands(filepath=str(groom_file), up="Z", scale=0.01)
    out = groom_file.with_name("out.tfx")
    bpy.ops.hairloom.export_tressfx(filepath=str(out), up="Z", scale=0.01)
    before, after = read_tfx(groom_file).strands, read_tfx(out).strands
    assert after.points == pytest.approx(before.points, rel=1e-5, abs=1e-6)


@pytest.mark.slow
def test_cards_are_written_with_their_sidecar(sphere, tmp_path, read_reports):
    hair = grown(sphere, strand_count=300, length=0.05)
    hair.data.hairloom.guides.guide_count = 20
    hair.data.hairloom.cards.source, hair.data.hairloom.atlas.source = "guides", "made"
    out = tmp_path / "cards.glb"
    data_blocks = {data.name_full for data in bpy.data.user_map()}
    assert bpy.ops.hairloom.export_cards(filepath=str(out)) == {"FINISHED"}
    assert out.read_bytes()[:4] == b"glTF"
    assert sorted(path.name for path in tmp_path.iterdir()) == [
        "cards.glb",
        "cards.hairloom.json",
        *sorted(
            [
                f"cards_{name}.png"
                for name in ("alpha", "base", "color", "noise", "shift", "tangent")
            ]
            + [f"cards_{name}.exr" for name in ("azimuthal", "longitudinal", "paths")]
        ),
    ]
    assert "20 cards" in read_reports()
    assert {data.name_full for data in bpy.data.user_map()} == data_blocks


@pytest.mark.parametrize("operator", ["export_cards", "export_tressfx"])
def test_hair_without_curves_is_not_exported(operator, sphere, tmp_path, read_reports):
    hair = grown(sphere, strand_count=10)
    hair.data.remove_curves()
    with pytest.raises(RuntimeError, match="no curves"):
        getattr(bpy.ops.hairloom, operator)(filepath=str(tmp_path / "out.glb"))
    read_reports()
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("operator", "name"), [("export_cards", "x.glb"), ("export_tressfx", "x.tfx")]
)
def test_a_place_that_cannot_be_written_to_is_named(operator, name, sphere, tmp_path, read_reports):
    grown(sphere, strand_count=50)
    (tmp_path / "no folder").write_text("a file")
    path = tmp_path / "no folder" / name
    with pytest.raises(RuntimeError, match="no folder"):
        getattr(bpy.ops.hairloom, operator)(filepath=str(path))
    read_reports()
    assert [path.name for path in tmp_path.iterdir()] == ["no folder"]
