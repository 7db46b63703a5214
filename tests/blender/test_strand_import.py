"""Importing strands from files: the resulting objects and reports."""

from dataclasses import replace
from pathlib import Path

import bpy
import numpy as np
import pytest

from hairloom.addon.blender.scene.curves import read_curves
from hairloom.addon.blender.scene.groom_attributes import group_names, stored_groom
from hairloom.addon.exchange.alembic.groom_alembic import write_groom_alembic
from hairloom.addon.exchange.groom import Groom
from hairloom.addon.exchange.groom_presets import BLENDER, UNITY, UNREAL
from hairloom.addon.exchange.hair_file import write_hair_file
from hairloom.addon.exchange.tressfx import read_tfx, write_tfx
from hairloom.addon.exchange.usd.groom_usd import write_usd
from hairloom.addon.strands import StrandSet

pytestmark = pytest.mark.usefixtures("extension")

#: places the hair far from a sphere at the origin, so that wrong axes show
PLACE = np.array([0.3, -0.4, 1.6], np.float32)


def hairdo(count=60, place=PLACE):
    """Hair of a head at this place; every tenth strand is a guide."""
    random = np.random.default_rng(3)
    outward = random.normal(size=(count, 3))
    outward /= np.linalg.norm(outward, axis=1, keepdims=True)
    points = outward[:, None] * np.linspace(0.1, 0.18, 8)[:, None] + place
    strands = StrandSet(
        points.reshape(-1, 3),
        np.arange(count + 1) * 8,
        radius=random.uniform(2e-5, 8e-5, count * 8),
        group=np.arange(count) % 3 * 2,
        root_uv=random.random((count, 2)),
        color=random.random((count * 8, 3)),
    )
    ids = np.arange(count) + 100
    return Groom(
        strands,
        strand_id=ids,
        is_guide=np.arange(count) % 10 == 0,
        closest_guides=np.tile(ids[[0, 10, 20]], (count, 1)),
        guide_weights=np.tile([0.5, 0.25, 0.25], (count, 1)),
        group_names={0: "front", 2: "side", 4: "back"},
    )


def needs_usd():
    pytest.importorskip("pxr", reason="this Python has no OpenUSD")


def write(path, groom):
    path = Path(path)
    if path.suffix == ".abc":
        write_groom_alembic(path, groom, BLENDER)
    elif path.suffix == ".tfx":
        write_tfx(path, groom)
    elif path.suffix == ".hair":
        write_hair_file(path, groom)
    else:
        needs_usd()
        write_usd(path, groom)
    return path


@pytest.fixture
def head(sphere):
    """The sphere, moved to the hair's place, active and selected."""
    sphere.location = PLACE.tolist()
    bpy.context.view_layer.update()
    return sphere


@pytest.fixture
def read_reports(capfd):
    """A function that returns the operator's reports, and refuses tracebacks."""

    def read():
        captured = capfd.readouterr()
        assert "Traceback" not in captured.out + captured.err
        return captured.out

    return read


def imported(path, **options):
    """Import a file; returns its objects, the active one first."""
    assert bpy.ops.hairloom.import_strands(filepath=str(path), **options) == {"FINISHED"}
    active = bpy.context.view_layer.objects.active
    return [active, *(each for each in bpy.context.selected_objects if each != active)]


def groom_of(hair):
    depsgraph = bpy.context.evaluated_depsgraph_get()
    cleaned = read_curves(hair, depsgraph)
    return Groom(cleaned.strands, **stored_groom(hair, depsgraph, cleaned.curve_indices))


@pytest.mark.parametrize("suffix", [".abc", ".usdc", ".usda"])
def test_a_groom_comes_in_whole_without_a_head(tmp_path, suffix):
    groom = hairdo()
    (hair,) = imported(write(tmp_path / f"hair{suffix}", groom), guides="AMONG")
    assert hair.name == "hair" and hair.data.surface is None and hair.parent is None
    read = groom_of(hair)
    for name in ("points", "offsets", "radius", "group", "root_uv"):
        np.testing.assert_array_equal(getattr(read.strands, name), getattr(groom.strands, name))
    for name in ("color", "strand_id", "is_guide", "closest_guides", "guide_weights"):
        np.testing.assert_array_equal(getattr(read, name), getattr(groom, name), err_msg=name)
    assert dict(read.group_names) == {0: "front", 2: "side", 4: "back"}


@pytest.mark.parametrize("suffix", [".abc", ".usdc", ".tfx", ".hair"])
def test_hair_is_bound_to_the_active_mesh(tmp_path, head, read_reports, suffix):
    groom = hairdo()
    (hair,) = imported(write(tmp_path / f"hair{suffix}", groom))
    assert f"hair{suffix}: 54 strands" in read_reports()
    assert hair.data.surface == head and hair.parent == head
    assert hair.data.surface_uv_map == "UVMap" and head.add_rest_position_attribute
    strands = groom_of(hair).strands
    expected = groom.without_guides().strands
    np.testing.assert_allclose(strands.points, expected.points, atol=1e-6)
    u, v = strands.root_uv.T
    out = expected.roots - PLACE
    angle = np.abs((np.arctan2(out[:, 1], out[:, 0]) / (2 * np.pi) + 0.5) % 1.0 - u)
    assert np.median(np.minimum(angle, 1 - angle)) < 0.02  # agrees with the sphere's UVs
    assert np.abs(np.arcsin(out[:, 2] / 0.1) / np.pi + 0.5 - v).max() < 0.05


def test_hair_moves_with_the_mesh_that_it_is_bound_to(tmp_path, head):
    (hair,) = imported(write(tmp_path / "hair.abc", hairdo()))
    before = groom_of(hair).strands.points
    head.location.x += 2.0
    np.testing.assert_allclose(groom_of(hair).strands.points, before + [2, 0, 0], atol=1e-6)


def test_the_active_mesh_can_be_left_alone(tmp_path, head):
    (hair,) = imported(write(tmp_path / "hair.abc", hairdo()), onto_mesh=False)
    assert hair.data.surface is None and hair.parent is None


def test_guides_can_be_an_object_of_their_own(tmp_path, head, read_reports):
    groom = hairdo()
    hair, guides = imported(write(tmp_path / "hair.usdc", groom), guides="APART")
    assert (hair.name, guides.name) == ("hair", "hair Guides")
    assert (len(hair.data.curves), len(guides.data.curves)) == (54, 6)
    assert "54 strands and 6 guides in 3 groups" in read_reports()
    assert "groom_guide" not in hair.data.attributes
    assert groom_of(guides).is_guide.all()
    np.testing.assert_array_equal(groom_of(guides).strand_id, groom.guides().strand_id)
    assert guides.data.surface == head and group_names(guides) == {0: "front", 2: "side", 4: "back"}


@pytest.mark.parametrize("guides", ["LEAVE", "APART", "AMONG"])
def test_a_file_of_guides_alone_gives_one_object(tmp_path, guides):
    groom = hairdo().guides()
    groom = replace(groom, closest_guides=None, guide_weights=None)
    (hair,) = imported(write(tmp_path / "hair.abc", groom), guides=guides)
    assert len(hair.data.curves) == 6 and groom_of(hair).is_guide.all()


@pytest.mark.parametrize("preset", [UNREAL, UNITY], ids=["unreal", "unity"])
def test_files_for_engines_come_back_in_metres_with_z_up(tmp_path, head, preset):
    groom = hairdo()
    write_groom_alembic(tmp_path / "hair.abc", groom, replace(preset, max_points=100))
    (hair,) = imported(tmp_path / "hair.abc")
    strands = groom_of(hair).strands
    low, high = strands.bounds()
    expected = groom.without_guides().strands.bounds()
    np.testing.assert_allclose([low, high], expected, atol=1e-6)
    assert hair.data.surface == head


def test_undo_takes_everything_back_and_redo_brings_it(tmp_path, head):
    path = write(tmp_path / "hair.abc", hairdo())
    bpy.ops.ed.undo_push(message="before")
    assert bpy.ops.hairloom.import_strands("EXEC_DEFAULT", True, filepath=str(path)) == {"FINISHED"}
    assert len(bpy.data.hair_curves) == 1
    bpy.ops.ed.undo()
    assert len(bpy.data.hair_curves) == 0 and [each.name for each in bpy.data.objects] == ["Head"]
    assert not bpy.data.objects["Head"].add_rest_position_attribute
    bpy.ops.ed.redo()
    (curves,) = bpy.data.hair_curves
    assert len(curves.curves) == 54 and curves.surface == bpy.data.objects["Head"]


def test_files_of_all_formats_come_in_at_once_and_bad_ones_are_reported(
    tmp_path, head, read_reports
):
    groom, names = hairdo(), ["a.abc", "b.usda", "c.tfx", "d.hair", "e.abc", "f.usdc"]
    for name in names[:4]:
        write(tmp_path / name, groom)
    (tmp_path / "e.abc").write_bytes(b"no hair in here")
    (tmp_path / "f.usdc").write_bytes(b"")
    with pytest.raises(RuntimeError) as raised:
        bpy.ops.hairloom.import_strands(
            filepath=str(tmp_path / "a.abc"),
            directory=str(tmp_path),
            files=[{"name": name} for name in names],
        )
    assert "e.abc" in str(raised.value) and "f.usdc" in str(raised.value)
    assert "Traceback" not in str(raised.value)
    read_reports()
    made = [each for each in bpy.data.objects if each.type == "CURVES"]
    assert sorted(each.name for each in made) == ["a", "b", "c", "d"]
    assert all(each.data.surface == head for each in made)


@pytest.mark.parametrize("damage", ["truncated", "garbage", "empty", "missing", "not a number"])
@pytest.mark.parametrize("suffix", [".abc", ".usdc", ".tfx", ".hair"])
def test_a_file_that_cannot_be_used_is_named_and_leaves_nothing(
    tmp_path, head, read_reports, suffix, damage
):
    groom = replace(hairdo(30), is_guide=None)
    path = write(tmp_path / f"groom{suffix}", groom)
    content = path.read_bytes()
    if damage == "truncated":
        path.write_bytes(content[: len(content) // 2])
    elif damage == "garbage":
        path.write_bytes(b"x" * 500)
    elif damage == "empty":
        path.write_bytes(b"")
    elif damage == "missing":
        path.unlink()
    else:
        x, y, z = groom.strands.points.T
        in_file = [x, y, z] if suffix in (".usdc", ".hair") else [x, z, -y]
        for point in np.stack(in_file, axis=1).astype("<f4"):
            assert point.tobytes() in content
            content = content.replace(point.tobytes(), np.full(3, np.nan, "<f4").tobytes())
        path.write_bytes(content)
    with pytest.raises(RuntimeError, match=rf"groom\{suffix}") as raised:
        imported(path)
    assert "Traceback" not in str(raised.value)
    read_reports()
    assert [obj.name for obj in bpy.data.objects] == ["Head"]
    assert len(bpy.data.hair_curves) == 0


@pytest.mark.parametrize(
    ("suffix", "written", "wish", "options"),
    [
        (".tfx", {"scale": 0.01}, "a scale of 0.01 (--groom-scale 0.01)", {"scale": 0.01}),
        (".tfx", {"up": "Z"}, "Z up (--groom-up Z)", {"up": "Z"}),
        (
            ".tfx",
            {"up": "Z", "scale": 0.0254},
            "Z up and a scale of 0.0254 (--groom-up Z --groom-scale 0.0254)",
            {"up": "Z", "scale": 0.0254},
        ),
        (".hair", {"up": "Y"}, "Y up (--groom-up Y)", {"up": "Y"}),
    ],
)
def test_a_file_of_another_unit_or_axes_is_reported_with_fitting_options(
    tmp_path, head, read_reports, suffix, written, wish, options
):
    path = tmp_path / f"hair{suffix}"
    (write_tfx if suffix == ".tfx" else write_hair_file)(path, hairdo(), **written)
    with pytest.raises(RuntimeError) as raised:
        imported(path)
    assert f"hair{suffix}" in str(raised.value) and f"Import it with {wish}" in str(raised.value)
    assert len(bpy.data.hair_curves) == 0
    (hair,) = imported(path, **options)
    np.testing.assert_allclose(
        groom_of(hair).strands.points, hairdo().without_guides().strands.points, atol=1e-5
    )
    read_reports()


def test_the_message_about_a_small_factor_names_the_right_one(tmp_path, head, read_reports):
    write_tfx(tmp_path / "hair.tfx", hairdo(), scale=0.01)
    with pytest.raises(RuntimeError, match=r"a scale of 0\.01 "):
        imported(tmp_path / "hair.tfx", scale=0.1)
    read_reports()


def test_hair_with_other_axes_that_is_near_by_chance_comes_in_with_a_warning(
    tmp_path, sphere, read_reports
):
    """With the head at the origin, turned hair of its upper half is still near it."""
    groom = hairdo(place=np.zeros(3, np.float32))
    sphere.scale = (1.0, 1.3, 0.8)
    sphere.location.z = 0.02
    bpy.context.view_layer.update()
    points = groom.strands.points * [1.0, 1.3, 0.8] + [0.0, 0.0, 0.02]
    groom = replace(groom, strands=replace(groom.strands, points=points.astype(np.float32)))
    write_tfx(tmp_path / "hair.tfx", groom, up="Z")
    (hair,) = imported(tmp_path / "hair.tfx")
    assert "mm from Head (median). Import it with Z up" in read_reports()
    assert len(hair.data.curves) == 54
    imported(tmp_path / "hair.tfx", up="Z")
    assert "median" not in read_reports()


@pytest.mark.parametrize(
    ("scale", "words"),
    [(0.001, "Scale hair.tfx by 0.01 (--groom-scale 0.01)"), (100.0, "mm large")],
)
def test_hair_of_an_odd_size_without_a_head_is_a_warning(tmp_path, read_reports, scale, words):
    write_tfx(tmp_path / "hair.tfx", hairdo(), scale=scale)
    imported(tmp_path / "hair.tfx")
    assert words in read_reports()


def test_hair_and_head_in_centimetres_are_reported_and_scaled_together(
    tmp_path, head, read_reports
):
    """A head of 24 m at the origin, whose object has its own scale, and hair on it."""
    head.scale *= 100.0
    head.location *= 100.0
    bpy.context.view_layer.update()
    large = np.array(head.matrix_world)
    write_tfx(tmp_path / "hair.tfx", hairdo(), scale=0.01)
    imported(tmp_path / "hair.tfx")
    bpy.context.view_layer.objects.active = head
    head.select_set(True)
    assert "Scale both by 0.01 (--groom-scale 0.01 --head-scale 0.01)" in read_reports()
    (hair,) = imported(tmp_path / "hair.tfx", scale=0.01, head_scale=0.01)
    assert "centimetres" not in read_reports()
    expected = np.diag([0.01, 0.01, 0.01, 1.0]) @ large
    np.testing.assert_allclose(np.array(head.matrix_world), expected, atol=1e-6)
    points = read_curves(hair, bpy.context.evaluated_depsgraph_get()).strands.points
    np.testing.assert_allclose(points, hairdo().without_guides().strands.points, atol=1e-5)


def test_of_several_uv_maps_the_one_that_counts_is_named(tmp_path, head, read_reports):
    imported(write(tmp_path / "hair.abc", hairdo()))
    assert "UV maps" not in read_reports()
    other = head.data.uv_layers.new(name="Lightmap")
    head.data.uv_layers.active = other
    bpy.context.view_layer.objects.active = head
    head.select_set(True)
    (hair,) = imported(write(tmp_path / "hair.abc", hairdo()))
    assert "2 UV maps, and hair and its shadow use the active one, 'Lightmap'" in read_reports()
    assert hair.data.surface_uv_map == "Lightmap"


def test_a_head_without_uvs_keeps_those_of_the_file_and_is_reported(tmp_path, head, read_reports):
    head.data.uv_layers.remove(head.data.uv_layers[0])
    head.data.update()
    groom = hairdo()
    (hair,) = imported(write(tmp_path / "hair.abc", groom), guides="AMONG")
    assert "Unwrap" in read_reports()
    np.testing.assert_array_equal(groom_of(hair).strands.root_uv, groom.strands.root_uv)


def test_a_head_without_faces_is_refused(tmp_path, head, read_reports):
    head.data.clear_geometry()
    with pytest.raises(RuntimeError, match="Head: this mesh has no faces"):
        imported(write(tmp_path / "hair.abc", hairdo()))
    read_reports()
    assert len(bpy.data.hair_curves) == 0


def test_what_the_button_makes_is_what_other_functions_of_ours_read(tmp_path, head):
    """Previews, cards and exports read hair with these functions."""
    (hair,) = imported(write(tmp_path / "hair.abc", hairdo()))
    assert bpy.ops.hairloom.export_cards.poll()
    assert bpy.context.view_layer.objects.active == hair
    assert [each.name for each in bpy.context.selected_objects] == ["hair"]


def test_blenders_own_exports_of_hair_come_in(tmp_path, head, read_reports):
    """Blender's Alembic and USD exporters write hair curves without our attributes."""
    needs_usd()
    groom = hairdo()
    (hair,) = imported(write(tmp_path / "hair.abc", groom))
    bpy.ops.wm.alembic_export(filepath=str(tmp_path / "own.abc"), selected=True)
    bpy.ops.wm.usd_export(filepath=str(tmp_path / "own.usdc"), selected_objects_only=True)
    expected = groom_of(hair).strands
    for name in ("own.abc", "own.usdc"):
        bpy.context.view_layer.objects.active = head
        head.select_set(True)
        (again,) = imported(tmp_path / name)
        strands = groom_of(again).strands
        np.testing.assert_allclose(strands.points, expected.points, atol=1e-6)
        np.testing.assert_allclose(strands.radius, expected.radius, rtol=1e-4)
        assert again.data.surface == head
    read_reports()


def test_the_ponytail_of_four_files_comes_in_at_once(shared_data, read_reports):
    folder = Path(shared_data) / "tressfx_ponytail"
    files = [{"name": path.name} for path in sorted(folder.glob("*.tfx"))]
    assert bpy.ops.hairloom.import_strands(
        filepath=str(folder / files[0]["name"]), directory=str(folder), files=files
    ) == {"FINISHED"}
    assert len([obj for obj in bpy.data.objects if obj.type == "CURVES"]) == len(files) == 4
    assert len(bpy.context.selected_objects) == 4
    read_reports()


@pytest.mark.parametrize("suffix", [".abc", ".usdc", ".hair"])
def test_sintel_goes_through_every_format_onto_her_head(
    shared_data, tmp_path, suffix, read_reports
):
    folder = Path(shared_data) / "sintel"
    bpy.ops.wm.obj_import(filepath=str(folder / "sintel.obj"))
    (head,) = bpy.context.selected_objects
    bpy.context.view_layer.objects.active = head
    original = read_tfx(folder / "SintelHairOriginal-sintel_hair.16points.tfx").groom
    (hair,) = imported(write(tmp_path / f"sintel{suffix}", original))
    strands = groom_of(hair).strands
    np.testing.assert_array_equal(strands.points, original.strands.points)
    assert hair.data.surface == head and strands.root_uv.min() >= 0.0
    assert "11,400 strands" in read_reports()


def test_dropping_and_the_menu_know_all_formats():
    handler = bpy.types.HAIRLOOM_FH_strands
    assert handler.bl_file_extensions == ".abc;.usdc;.usd;.usda;.tfx;.hair"
    assert handler.bl_import_operator == "hairloom.import_strands"
    operator = bpy.types.HAIRLOOM_OT_import_strands
    assert {"REGISTER", "UNDO"} <= operator.bl_options
    properties = bpy.ops.hairloom.import_strands.get_rna_type().properties
    assert {"filepath", "directory", "files"} <= set(properties.keys())
