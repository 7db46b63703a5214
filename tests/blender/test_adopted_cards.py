"""Adopted cards in Blender: sorting puts their faces in order and changes nothing else."""

from __future__ import annotations

from pathlib import Path

import bpy
import numpy as np
import pytest
from sorting import sort_mesh
from tiers import few_in_commits

from hairloom.addon.blender.cards.adopt import SortOptions, read_cards
from hairloom.addon.blender.cards.mesh import reorder_faces
from hairloom.addon.cards.occlusion_settings import CardOcclusionSettings
from hairloom.addon.errors import HairloomError

QUICK = CardOcclusionSettings(rays=16)


def new_mesh(name, positions, faces, corner_uv=None):
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(np.asarray(positions).tolist(), [], faces)
    if corner_uv is not None:
        mesh.uv_layers.new(name="Hair").uv.foreach_set("vector", np.ravel(corner_uv))
    obj = bpy.data.objects.new(name, mesh)
    bpy.context.collection.objects.link(obj)
    for other in bpy.context.selected_objects:
        other.select_set(False)
    obj.select_set(True)
    bpy.context.view_layer.objects.active = obj
    bpy.context.view_layer.update()
    return obj


#: distances of the shells from the middle of the head [m], in face order
SHELLS = (0.14, 0.11, 0.17, 0.12)
ROWS = 4


@pytest.fixture
def shells(sphere):
    """Vertical strips of quads around the ball, not sorted by distance; u runs to the tip."""
    positions, faces, uv = [], [], []
    for shell in SHELLS:
        for turn in np.linspace(0.0, 2.0 * np.pi, 6, endpoint=False):
            first = len(positions)
            for row in range(ROWS + 1):
                for side in (-0.2, 0.2):
                    across = np.array([np.cos(turn + side), np.sin(turn + side)]) * shell
                    positions.append((*across, 0.05 - 0.1 * row / ROWS))
            for row in range(ROWS):
                low = first + 2 * row
                faces.append((low, low + 2, low + 3, low + 1))
                u = (row / ROWS, (row + 1) / ROWS)
                uv.append([(u[0], 0.4), (u[1], 0.4), (u[1], 0.5), (u[0], 0.5)])
    return new_mesh("Cards", positions, faces, uv)


def polygons(mesh):
    """Vertices and material index of each face."""
    return [(tuple(face.vertices), face.material_index) for face in mesh.polygons]


def values(mesh, name):
    attribute = mesh.attributes[name]
    found = np.empty(len(attribute.data), np.float32)
    attribute.data.foreach_get("value", found)
    return found


def layer(mesh, name):
    found = np.empty((len(mesh.loops), 2), np.float32)
    mesh.uv_layers[name].uv.foreach_get("vector", found.ravel())
    return found


def test_faces_are_ordered_from_the_inside_to_the_outside(shells, sphere, get_depsgraph):
    before = polygons(shells.data)
    done = sort_mesh(
        shells, get_depsgraph(), SortOptions(head=sphere, by="distance", occlusion=None)
    )
    assert (done.card_count, done.face_count) == (24, 96)
    assert done.notes == ()
    points = np.array([vertex.co for vertex in shells.data.vertices])
    distance = [
        np.linalg.norm(points[list(face.vertices), :2].mean(axis=0))
        for face in shells.data.polygons
    ]
    assert np.diff(distance).min() > -1e-6
    assert sorted(polygons(shells.data)) == sorted(before)
    again = sort_mesh(
        shells, get_depsgraph(), SortOptions(head=sphere, by="distance", occlusion=None)
    )
    assert again.moved == 0 < done.moved


def test_strand_direction_is_found_even_if_u_runs_along_cards(shells, sphere, get_depsgraph):
    cards = read_cards(shells, get_depsgraph(), SortOptions(head=sphere)).cards.mesh
    np.testing.assert_allclose(cards.along, (0.05 - cards.positions[:, 2]) / 0.1, atol=1e-5)
    np.testing.assert_allclose(cards.tangent[:, 2], -1.0, atol=1e-5)
    outward = np.einsum("ij,ij->i", cards.normal[:, :2], cards.positions[:, :2])
    assert outward.min() > 0.0


def test_occlusion_attribute_and_map_agree_at_each_vertex(shells, sphere, get_depsgraph):
    sort_mesh(shells, get_depsgraph(), SortOptions(head=sphere, occlusion=QUICK))
    mesh = shells.data
    openness, along = values(mesh, "occlusion"), values(mesh, "along")
    shell = np.linalg.norm([vertex.co[:2] for vertex in mesh.vertices], axis=1)
    assert openness[shell < 0.125].mean() < 0.6
    np.testing.assert_array_equal(openness[shell > 0.16], 1.0)
    corner = np.array([loop.vertex_index for loop in mesh.loops])
    np.testing.assert_allclose(layer(mesh, "Occlusion"), np.stack([openness, along], 1)[corner])
    assert mesh.uv_layers.active.name == "Hair"
    uv = read_cards(shells, get_depsgraph(), SortOptions(head=sphere)).cards.mesh.uv
    # it must not be taken for the UVs of the texture
    mesh.uv_layers.active = mesh.uv_layers["Occlusion"]
    again = read_cards(shells, get_depsgraph(), SortOptions(head=sphere)).cards.mesh.uv
    np.testing.assert_array_equal(again, uv)
    once = layer(mesh, "Occlusion")
    sort_mesh(shells, get_depsgraph(), SortOptions(head=sphere, occlusion=QUICK))
    np.testing.assert_allclose(layer(mesh, "Occlusion"), once, atol=1e-6)
    assert len(mesh.uv_layers) == 2


def decorated(obj):
    """Give a mesh one of everything that sorting might lose."""
    mesh, random = obj.data, np.random.default_rng(0)
    for name in ("One", "Two"):
        mesh.materials.append(bpy.data.materials.new(name))
    for face in mesh.polygons:
        face.material_index, face.use_smooth = face.index % 2, face.index % 3 == 0
    for number, name in enumerate(("Pony", "Fringe")):
        group = obj.vertex_groups.new(name=name)
        for vertex in mesh.vertices:
            group.add([vertex.index], ((vertex.index + number) % 7) / 7.0, "REPLACE")
    obj.shape_key_add(name="Basis")
    key = obj.shape_key_add(name="Blown")
    for point in key.data:
        point.co.x += 0.01 + 0.1 * point.co.z
    key.value = 0.25
    for domain, count in (
        ("POINT", len(mesh.vertices)),
        ("EDGE", len(mesh.edges)),
        ("FACE", len(mesh.polygons)),
        ("CORNER", len(mesh.loops)),
    ):
        for kind in ("FLOAT", "INT", "BOOLEAN", "INT8"):
            made = mesh.attributes.new(f"{domain} {kind}", kind, domain)
            made.data.foreach_set(
                "value",
                (random.random(count) * 9).astype(int).astype(float)
                if kind == "FLOAT"
                else (random.random(count) * 2).astype(int),
            )
    color = mesh.color_attributes.new("Paint", "BYTE_COLOR", "CORNER")
    color.data.foreach_set("color", random.random(4 * len(mesh.loops)).round(1))
    normals = random.normal(size=(len(mesh.vertices), 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    mesh.normals_split_custom_set_from_vertices(normals.tolist())
    for edge in mesh.edges:
        edge.use_seam, edge.use_edge_sharp = edge.index % 5 == 0, edge.index % 7 == 0
    mesh["note"] = "kept"


def everything(obj):
    """All data of a mesh by element: faces and corners are identified by their vertices."""
    mesh = obj.data
    faces = [tuple(face.vertices) for face in mesh.polygons]
    corners = [(face, at) for face in faces for at in range(len(face))]
    at_domain = {
        "POINT": list(range(len(mesh.vertices))),
        "EDGE": list(range(len(mesh.edges))),
        "FACE": faces,
        "CORNER": corners,
    }
    found = {"materials": [slot.name for slot in mesh.materials], "note": mesh["note"]}
    for attribute in mesh.attributes:
        if attribute.name.startswith("."):
            continue
        part = next(n for n in ("value", "color", "vector") if hasattr(attribute.data[0], n))
        items = [np.array(getattr(item, part), float) for item in attribute.data]
        read = [item.round(5).tolist() for item in items]
        found[attribute.name] = sorted(zip(at_domain[attribute.domain], read, strict=True))
    found["normals"] = sorted(
        zip(corners, [[round(c, 3) for c in n.vector] for n in mesh.corner_normals], strict=True)
    )
    found["weights"] = [[(m.group, round(m.weight, 5)) for m in v.groups] for v in mesh.vertices]
    found["keys"] = {
        key.name: (key.value, [tuple(np.round(point.co, 6)) for point in key.data])
        for key in mesh.shape_keys.key_blocks
    }
    return found


def test_all_mesh_data_survives_sorting(shells, sphere, get_depsgraph):
    decorated(shells)
    bpy.context.view_layer.update()
    before = everything(shells)
    done = sort_mesh(shells, get_depsgraph(), SortOptions(head=sphere, occlusion=None))
    assert done.moved > 50
    after = everything(shells)
    assert set(after) == set(before)
    for name, value in before.items():
        assert after[name] == value, name


def test_deforming_modifiers_are_applied_and_generating_ones_are_reported(
    shells, sphere, get_depsgraph
):
    shells.shape_key_add(name="Basis")
    key = shells.shape_key_add(name="Aside")
    for point in key.data:
        point.co.x += 1.0
    key.value = 1.0
    bpy.context.view_layer.update()
    source = read_cards(shells, get_depsgraph(), SortOptions(head=sphere))
    assert source.cards.mesh.positions[:, 0].min() > 0.8
    shells.modifiers.new("Thick", "SOLIDIFY").thickness = 0.01
    bpy.context.view_layer.update()
    done = sort_mesh(shells, get_depsgraph(), SortOptions(head=sphere, occlusion=None))
    assert any("Modifiers" in note for note in done.notes)
    assert done.face_count == 96


def test_a_mirrored_object_is_sorted_and_shaded_as_the_plain_one(shells, sphere, get_depsgraph):
    plain = read_cards(shells, get_depsgraph(), SortOptions(head=sphere)).cards.mesh
    sort_mesh(shells, get_depsgraph(), SortOptions(head=sphere, occlusion=QUICK))
    expected = values(shells.data, "occlusion"), layer(shells.data, "Occlusion")
    for vertex in shells.data.vertices:
        vertex.co.x *= -1.0
    shells.scale = (-1.0, 1.0, 1.0)
    bpy.context.view_layer.update()
    mirrored = read_cards(shells, get_depsgraph(), SortOptions(head=sphere)).cards.mesh
    outward = np.einsum("ij,ij->i", mirrored.normal, plain.normal)
    assert outward.shape == plain.along.shape
    assert (mirrored.normal[:, :2] * mirrored.positions[:, :2]).sum(axis=1).min() > 0.0
    sort_mesh(shells, get_depsgraph(), SortOptions(head=sphere, occlusion=QUICK))
    np.testing.assert_allclose(values(shells.data, "occlusion"), expected[0], atol=1e-4)
    np.testing.assert_allclose(layer(shells.data, "Occlusion"), expected[1], atol=1e-4)


def test_a_vertex_group_is_drawn_after_all_others(shells, sphere, get_depsgraph):
    group = shells.vertex_groups.new(name="Inner")
    inner = [v.index for v in shells.data.vertices if np.linalg.norm(v.co[:2]) < 0.115]
    group.add(inner, 1.0, "REPLACE")
    choices = SortOptions(head=sphere, dangling="Inner", occlusion=None)
    sort_mesh(shells, get_depsgraph(), choices)
    last = [set(face.vertices) <= set(inner) for face in shells.data.polygons]
    assert sum(last) == 24 and all(last[-24:])
    with pytest.raises(HairloomError, match="no vertex group 'Outer'"):
        sort_mesh(shells, get_depsgraph(), SortOptions(head=sphere, dangling="Outer"))


def clear_material(obj):
    """Give an object a material whose picture is transparent everywhere."""
    material = bpy.data.materials.new("Hair")
    obj.data.materials.append(material)
    image = bpy.data.images.new("Clear", 4, 4, alpha=True)
    image.pixels.foreach_set(np.tile(np.float32([1.0, 1.0, 1.0, 0.0]), 16))
    surface = material.node_tree.nodes["Principled BSDF"]
    picture = material.node_tree.nodes.new("ShaderNodeTexImage")
    picture.image = image
    material.node_tree.links.new(picture.outputs["Alpha"], surface.inputs["Alpha"])


def test_alpha_comes_from_the_material(shells, sphere, get_depsgraph):
    sort_mesh(shells, get_depsgraph(), SortOptions(head=sphere, occlusion=QUICK))
    opaque = values(shells.data, "occlusion")
    clear_material(shells)
    done = sort_mesh(shells, get_depsgraph(), SortOptions(head=sphere, occlusion=QUICK))
    clear = values(shells.data, "occlusion")
    assert done.notes == ()
    assert (clear >= opaque - 1e-6).all() and clear.mean() > opaque.mean() + 0.1
    clear_material(shells)
    (note,) = sort_mesh(shells, get_depsgraph(), SortOptions(head=sphere, occlusion=QUICK)).notes
    assert "several alpha pictures" in note and "'Clear' was used" in note


def test_order_accounts_for_the_alpha_of_the_material(shells, sphere, get_depsgraph):
    """Sorting by pieces uses the material's alpha: fully transparent cards hide nothing and keep
    the order of distance."""

    def order(by):
        sort_mesh(shells, get_depsgraph(), SortOptions(head=sphere, by=by, occlusion=None))
        return polygons(shells.data)

    sphere.location.x = 0.4  # so that the best order differs from the order of distance
    seen, by_distance = order("pieces"), order("distance")
    assert seen != by_distance
    clear_material(shells)
    assert order("pieces") == by_distance


def test_the_operator_sorts_reports_and_can_be_undone(extension, shells, sphere):
    shells.parent = sphere
    other = bpy.data.objects.new("Twin", shells.data)
    bpy.context.collection.objects.link(other)
    bpy.context.view_layer.update()
    bpy.ops.ed.undo_push(message="before")
    before = polygons(shells.data)
    assert bpy.ops.hairloom.sort_cards(
        "EXEC_DEFAULT", True, head="Head", use_occlusion=True, rays=8
    ) == {"FINISHED"}
    assert polygons(bpy.data.objects["Cards"].data) != before
    bpy.ops.ed.undo()
    assert polygons(bpy.data.objects["Cards"].data) == before
    assert "occlusion" not in bpy.data.objects["Cards"].data.attributes


def refused(**changed):
    with pytest.raises(RuntimeError) as caught:
        bpy.ops.hairloom.sort_cards(**changed)
    return str(caught.value)


def test_meshes_that_cannot_be_sorted_are_reported(extension, shells, sphere):
    bpy.context.view_layer.objects.active = shells
    assert "no such object" in refused(head="Nobody")
    assert "can grow from" in refused(head="Cards")
    assert "no such picture" in refused(alpha="Nothing")
    shells.data.uv_layers.remove(shells.data.uv_layers[0])
    shells.data.update_tag()
    before = polygons(shells.data)
    assert "no UVs" in refused(head="Head")
    assert polygons(shells.data) == before
    new_mesh("Empty", [(0, 0, 0)], [])
    assert "no faces" in refused()
    bpy.ops.object.mode_set(mode="EDIT")
    assert not bpy.ops.hairloom.sort_cards.poll()


def test_doubtful_cards_are_noted(sphere, get_depsgraph):
    flat = [(0, 0, 0.2), (0.1, 0, 0.2), (0.1, 0.1, 0.2), (0, 0.1, 0.2)]
    square = [(0, 0), (1, 0), (1, 1), (0, 1)]
    one = new_mesh("One", flat, [(0, 1, 2, 3)], square)
    bpy.context.collection.objects.link(bpy.data.objects.new("Twin", one.data))
    notes = sort_mesh(one, get_depsgraph(), SortOptions()).notes
    for expected in ("are connected", "no head", "2 objects share the mesh 'One'"):
        assert any(expected in note for note in notes)
    point = [(0.0, 0.0, 0.3)] * 4
    two = new_mesh("Two", flat + point, [(0, 1, 2, 3), (4, 5, 6, 7)], square * 2)
    notes = sort_mesh(two, get_depsgraph(), SortOptions(head=sphere)).notes
    assert any("has any area" in note for note in notes)
    assert np.isfinite(layer(two.data, "Occlusion")).all()


@pytest.mark.parametrize("name", few_in_commits(["long01", "ponytail01"]))
@pytest.mark.slow
def test_real_cards_leave_blender_in_their_order(
    extension, get_depsgraph, shared_data: Path, tmp_path: Path, name: str
):
    for file in ("mh_base", name):
        path = shared_data / "makehuman" / f"{file}.obj"
        bpy.ops.wm.obj_import(filepath=str(path), global_scale=0.1)
    hair, body = (bpy.data.objects[each] for each in (name, "mh_base"))
    uv = {tuple(face.vertices): None for face in hair.data.polygons}
    done = sort_mesh(hair, get_depsgraph(), SortOptions(head=body, occlusion=QUICK))
    assert done.moved > 0.5 * done.face_count
    sorted_faces = polygons(hair.data)
    assert {vertices for vertices, _ in sorted_faces} == set(uv)
    unshaded = SortOptions(head=body, occlusion=None)
    assert sort_mesh(hair, get_depsgraph(), unshaded).moved == 0
    reorder_faces(hair.data, np.random.default_rng(0).permutation(done.face_count))
    assert sort_mesh(hair, get_depsgraph(), unshaded).moved > 0.5 * done.face_count
    assert polygons(hair.data) == sorted_faces
    hair.select_set(True)
    body.select_set(False)
    written = tmp_path / "hair.obj"
    bpy.ops.wm.obj_export(filepath=str(written), export_selected_objects=True, export_uv=False)
    faces = [
        tuple(int(part.split("/")[0]) - 1 for part in line.split()[1:])
        for line in written.read_text().splitlines()
        if line.startswith("f ")
    ]
    assert faces == [tuple(face.vertices) for face in hair.data.polygons]


@pytest.mark.parametrize("taken", ["Occlusion", "occlusion", "along"])
def test_data_of_the_artist_with_our_names_is_not_replaced(shells, sphere, get_depsgraph, taken):
    mesh = shells.data
    if taken == "Occlusion":
        mesh.uv_layers.new(name=taken)
    else:
        mesh.attributes.new(taken, "INT", "FACE")
    before = polygons(mesh)
    with pytest.raises(HairloomError, match=f"already has the .*{taken}"):
        sort_mesh(shells, get_depsgraph(), SortOptions(head=sphere, occlusion=QUICK))
    assert polygons(mesh) == before
    sort_mesh(shells, get_depsgraph(), SortOptions(head=sphere, occlusion=None))
