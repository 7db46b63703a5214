"""Hairstyles on heads other than the built-in one: by topology, by fitting and by landmarks."""

from dataclasses import replace
from pathlib import Path

import bpy
import numpy as np
import pytest
from mathutils import Matrix, Vector
from mathutils.bvhtree import BVHTree
from overriding import library_overrides
from tiers import few_in_commits

from hairloom.addon.blender.base.parts import run_parts
from hairloom.addon.blender.command_line.command_line import run
from hairloom.addon.blender.preview import previews
from hairloom.addon.blender.scene.bust_data import load_bust
from hairloom.addon.blender.scene.curves import read_curves
from hairloom.addon.blender.scene.hair_nodes import add_hair_nodes
from hairloom.addon.blender.scene.surfaces import read_surface
from hairloom.addon.blender.setup import foreign_heads
from hairloom.addon.blender.setup.foreign_heads import (
    add_landmarks,
    has_makehuman_topology,
    landmarks_of,
    original_positions,
    placed_landmarks,
)
from hairloom.addon.blender.setup.hairstyles import (
    AddedHair,
    add_hairstyle,
    fit_again,
    named_hairstyle,
)
from hairloom.addon.errors import HairloomError
from hairloom.addon.exchange.hairstyles import Hairstyle
from hairloom.addon.groom.head_fit import LANDMARKS, Warp
from hairloom.addon.ui import operators_hairstyles

pytestmark = [pytest.mark.usefixtures("extension")]
#: vertex count of MakeHuman's skin, and of skin and helpers for clothes
BODY, WITH_HELPERS = 13380, 19158
#: transform of the other heads: position [m], scale, turn around Z [radians]
PLACE, LARGER, TURNED = np.array([3.0, -1.0, 1.5]), 1.3, 0.4


def added(name: str, head: bpy.types.Object, **options: str) -> AddedHair:
    style = named_hairstyle(name)
    return run_parts(add_hairstyle(style, head, depsgraph(), bpy.context.collection, **options))


def depsgraph() -> bpy.types.Depsgraph:
    bpy.context.view_layer.update()
    return bpy.context.evaluated_depsgraph_get()


def shaped(points: np.ndarray) -> np.ndarray:
    """Another person's shape: a wide jaw, a high skull, a long nose."""
    x, y, z = np.array(points, np.float64).T
    wide = 1.0 + 0.12 * np.exp(-(((z + 0.08) / 0.06) ** 2))
    high = 1.0 + 0.10 / (1.0 + np.exp(-z / 0.02))
    nose = 0.010 * np.exp(-(((z + 0.045) / 0.02) ** 2) - (x / 0.02) ** 2) * (y < -0.06)
    return np.stack([x * wide, y - nose, z * high], axis=1)


def stood(points: np.ndarray) -> np.ndarray:
    c, s = np.cos(TURNED), np.sin(TURNED)
    turn = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    return LARGER * points @ turn.T + PLACE


def bust_polygons() -> list[np.ndarray]:
    bust = load_bust()
    return np.split(bust.corner_vertex, np.cumsum(bust.sizes)[:-1])


def mesh_object(name: str, positions: np.ndarray, polygons: list[list[int]]) -> bpy.types.Object:
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(positions.tolist(), [], polygons)
    obj = bpy.data.objects.new(name, mesh)
    bpy.context.collection.objects.link(obj)
    return obj


def makehuman(count: int = BODY) -> bpy.types.Object:
    """A shaped head with MakeHuman's vertex numbers; the body has no faces."""
    bust = load_bust()
    positions = np.zeros((count, 3))
    known = bust.makehuman >= 0
    positions[bust.makehuman[known]] = shaped(bust.positions[known])
    polygons = [bust.makehuman[face] for face in bust_polygons()]
    return mesh_object("Human", positions, [f.tolist() for f in polygons if (f >= 0).all()])


def scan(ratio: float = 0.3) -> bpy.types.Object:
    """The same head with fewer triangles, scaled and turned, without MakeHuman's topology."""
    bust = load_bust()
    faces = [face.tolist() for face in bust_polygons()]
    skin = [face for face, kind in zip(faces, bust.material, strict=True) if kind == 0]
    obj = mesh_object("Scan", stood(shaped(bust.positions)), skin)
    obj.modifiers.new("Fewer", "DECIMATE").ratio = ratio
    made = bpy.data.meshes.new_from_object(obj.evaluated_get(depsgraph()))
    obj.modifiers.clear()
    obj.data = made
    return obj


def roots_of(hair: bpy.types.Object) -> np.ndarray:
    return np.array(read_curves(hair, depsgraph()).strands.roots, np.float64)


def away(points: np.ndarray, head: bpy.types.Object) -> float:
    """The largest distance of the points from the mesh, by Blender's own search [m]."""
    mesh, back = head.evaluated_get(depsgraph()), head.matrix_world.inverted()
    far = 0.0
    for point in points:
        local = back @ Vector(point.tolist())
        found, place, *_ = mesh.closest_point_on_mesh(local)
        assert found
        far = max(far, (head.matrix_world @ place - Vector(point.tolist())).length)
    return far


def inside_by_rays(points: np.ndarray, head: bpy.types.Object, deep: float) -> int:
    """The number of points that are inside and farther than `deep` [m] from every face. Inside
    means an odd number of crossings in each of three directions."""
    surface = read_surface(head, depsgraph(), need_uv=False, place=head.name)
    tree = BVHTree.FromPolygons(surface.positions.tolist(), surface.triangles.tolist())
    count = 0
    for point in points:
        start = Vector(point.tolist())
        if tree.find_nearest(start)[3] <= deep:
            continue
        odd = [
            crossings(tree, start, ray) % 2 for ray in ((1, 0.1, 0.9), (-0.3, 1, 0.8), (0, 0, 1))
        ]
        count += all(odd)
    return count


def crossings(tree: BVHTree, start: Vector, ray: tuple[float, float, float]) -> int:
    direction, number = Vector(ray).normalized(), 0
    while (hit := tree.ray_cast(start, direction))[0] is not None:
        start, number = hit[0] + 1e-6 * direction, number + 1
    return number


def by_barycentric(style: Hairstyle, positions: np.ndarray) -> np.ndarray:
    """Positions of the roots on the built-in head with other vertex positions; each root's triangle
    in UV space is found by testing all triangles."""
    bust = load_bust()
    corners, _ = bust.triangulated
    uv = bust.uv[bust.corner_uv[corners]].astype(np.float64)
    edges = np.stack([uv[:, 1] - uv[:, 0], uv[:, 2] - uv[:, 0]], axis=2)
    area = np.abs(np.linalg.det(edges))
    uv, edges, corners = uv[area > 0], edges[area > 0], corners[area > 0]
    inverse, found = np.linalg.inv(edges), []
    assert style.guides is not None
    for root in style.guides.root_uv.astype(np.float64):
        b, c = np.einsum("tij,tj->ti", inverse, root - uv[:, 0]).T
        weights = np.stack([1.0 - b - c, b, c], axis=1)
        best = weights.min(axis=1).argmax()
        found.append(weights[best] @ positions[bust.corner_vertex[corners[best]]])
    return np.array(found)


@pytest.mark.slow
@pytest.mark.parametrize("count", [WITH_HELPERS, BODY])
def test_a_posed_mesh_of_makehumans_has_roots_at_the_same_places_of_its_faces(count: int) -> None:
    human, style = makehuman(count), named_hairstyle("buzz_cut")
    assert has_makehuman_topology(human.data)
    human.location, human.rotation_euler, human.scale = (1, 2, 3), (0.3, -0.2, 0.9), (2, 2, 2)
    # a pose: everything above the neck nods
    human.shape_key_add(name="Basis")
    nod = human.shape_key_add(name="Nod")
    rest = np.array([vertex.co[:] for vertex in human.data.vertices])
    bend = 0.4 / (1.0 + np.exp(-(rest[:, 2] + 0.12) / 0.01))
    y, z = rest[:, 1] - 0.03, rest[:, 2] + 0.12
    posed = rest.copy()
    posed[:, 1] = 0.03 + np.cos(bend) * y - np.sin(bend) * z
    posed[:, 2] = -0.12 + np.sin(bend) * y + np.cos(bend) * z
    nod.data.foreach_set("co", posed.astype(np.float32).ravel())
    nod.value = 1.0
    made = added("buzz_cut", human)
    hair = made.hair
    assert not landmarks_of(human), "the topology says where everything is"
    matrix = np.array(human.matrix_world)
    places = np.full((len(load_bust().positions), 3), np.nan)
    known = load_bust().makehuman >= 0
    places[known] = (posed @ matrix[:3, :3].T + matrix[:3, 3])[load_bust().makehuman[known]]
    expected = by_barycentric(style, places)
    # Blender may split a quad that is not flat along the other diagonal
    gap = np.linalg.norm(roots_of(hair) - expected, axis=1) / 2.0
    assert np.median(gap) < 1e-5 and gap.max() < 5e-4
    assert away(roots_of(hair)[::40], human) < 1e-5
    assert human.vertex_groups.get("scalp") is not None
    assert len(made.done) == 1 and not made.warnings


@pytest.mark.slow
def test_modifiers_that_add_and_take_vertices_do_not_hide_the_topology() -> None:
    human = makehuman(WITH_HELPERS)
    before = roots_of(added("buzz_cut", human).hair)
    group = human.vertex_groups.new(name="body")
    group.add(list(range(BODY)), 1.0, "REPLACE")
    human.modifiers.new("Hide", "MASK").vertex_group = "body"
    human.modifiers.new("Smooth", "SUBSURF").levels = 2
    objects = set(bpy.data.objects.keys())
    positions = original_positions(human, depsgraph())
    assert set(bpy.data.objects.keys()) == objects
    assert np.abs(positions - [vertex.co[:] for vertex in human.data.vertices]).max() < 1e-6
    after = roots_of(added("buzz_cut", human).hair)
    assert away(after[::40], human) < 1e-5
    assert np.linalg.norm(after - before, axis=1).max() < 0.004, "smoothing moves skin by so much"


@pytest.mark.slow(instead="test_the_button_adds_to_the_selected_head_and_one_undo_takes_it_away")
def test_landmarks_are_guessed_where_they_are_on_another_person() -> None:
    head = scan()
    made, is_sure = run_parts(add_landmarks(head, depsgraph(), bpy.context.collection))
    assert is_sure and len(made) == len(LANDMARKS) and all(obj.parent == head for obj in made)
    depsgraph()
    for name, obj in landmarks_of(head).items():
        true = stood(shaped(np.array([LANDMARKS[name][1]])))[0]
        gap = np.linalg.norm(np.array(obj.matrix_world.translation) - true) / LARGER
        assert gap < 0.009, name
    # existing landmarks are not added again, a deleted one is
    bpy.data.objects.remove(landmarks_of(head)["nose"])
    again, _ = run_parts(add_landmarks(head, depsgraph(), bpy.context.collection))
    assert [obj.hairloom.landmark for obj in again] == ["nose"]


@pytest.mark.slow(instead="test_the_button_adds_to_the_selected_head_and_one_undo_takes_it_away")
@pytest.mark.parametrize("name", few_in_commits(["brows", "curls", "long_straight", "full_beard"]))
def test_on_a_scan_roots_are_on_the_skin_and_no_strand_is_in_it(name: str) -> None:
    head, style = scan(), named_hairstyle(name)
    made = added(name, head)
    hair = made.hair
    assert style.guides is not None and not made.warnings and len(made.done) == 2
    strands = read_curves(hair, depsgraph()).strands
    assert strands.strand_count > 0.95 * len(style.guides.group)
    assert away(strands.roots[::20], head) < 2e-5
    assert inside_by_rays(strands.points[::41], head, deep=0.0012) == 0
    # true places of the same roots on this person, whose shape the fit has no access to
    true = stood(shaped(by_barycentric(style, load_bust().positions)))
    if strands.strand_count == len(true):
        gap = np.linalg.norm(strands.roots - true, axis=1) / LARGER
        assert np.median(gap) < 0.004 and gap.max() < 0.015
    if not hair.modifiers:
        own = np.linalg.norm(np.diff(style.guides.shape, axis=0), axis=1)
        own = np.delete(own, style.guides.offsets[1:-1] - 1).sum() / len(style.guides.group)
        assert strands.lengths().mean() / own == pytest.approx(LARGER, rel=0.12)


@pytest.mark.slow
def test_hair_is_led_out_of_parts_of_other_heads() -> None:
    """A ball beside the neck, where long hair falls on the built-in head."""
    head, middle, radius = scan(), stood(np.array([[0.10, 0.02, -0.16]]))[0], 0.03 * LARGER
    bpy.ops.mesh.primitive_uv_sphere_add(radius=radius, location=middle.tolist())
    ball = bpy.context.object
    with bpy.context.temp_override(
        active_object=head, object=head, selected_editable_objects=[head, ball]
    ):
        bpy.ops.object.join()
    strands = read_curves(added("long_straight", head).hair, depsgraph()).strands
    away_from_ball = np.linalg.norm(strands.points - middle, axis=1)
    assert away_from_ball.min() > 0.95 * radius, "a ball of flat faces is smaller"
    assert (away_from_ball < 1.3 * radius).sum() > 100, "much hair passes it"


@pytest.mark.slow
def test_a_dragged_landmark_moves_the_hair_when_it_is_fitted_again() -> None:
    head = scan()
    hair = added("buzz_cut", head).hair
    hair.data.hairloom.children.strand_count = 1234
    before = roots_of(hair)
    run_parts(fit_again([hair], depsgraph()))
    assert np.abs(roots_of(hair) - before).max() < 1e-4, "the same landmarks give the same hair"
    hairline = landmarks_of(head)["hairline"]
    hairline.location.z += 0.025
    run_parts(fit_again([hair], depsgraph()))
    after = roots_of(hair)
    near = np.linalg.norm(before - stood(shaped([LANDMARKS["hairline"][1]]))[0], axis=1) < 0.045
    assert near.sum() > 10, "roots are there"
    assert 0.008 < (after[near] - before[near])[:, 2].mean() < 0.03
    assert away(after[::40], head) < 2e-5
    assert hair.data.hairloom.children.strand_count == 1234


@pytest.mark.slow
def test_hair_follows_a_head_whose_shape_has_changed_and_landmarks_that_were_dragged_stay() -> None:
    head = scan()
    hair = added("buzz_cut", head).hair
    larger = 1.3 * np.array([vertex.co[:] for vertex in head.data.vertices]) - (0.0, 0.0, 0.5)
    head.data.vertices.foreach_set("co", larger.ravel())
    head.data.update()
    assert not run_parts(fit_again([hair], depsgraph()))
    fresh = bpy.data.objects.new("Fresh", head.data.copy())
    bpy.context.collection.objects.link(fresh)
    expected = added("buzz_cut", fresh).hair
    assert len(hair.data.curves) == len(expected.data.curves)
    there, wanted_there = (placed_landmarks(one, depsgraph()) for one in (head, fresh))
    for name in LANDMARKS:
        assert there[name] == pytest.approx(wanted_there[name], abs=1e-4)
    lengths = [read_curves(one, depsgraph()).strands.lengths() for one in (hair, expected)]
    assert np.median(lengths[0]) == pytest.approx(np.median(lengths[1]), rel=0.01)
    assert roots_of(hair) == pytest.approx(roots_of(expected), abs=1e-3)
    # after a rotation the head has the same shape, so its landmarks are not guessed again
    head.matrix_world = Matrix.Rotation(1.3, 4, "X") @ Matrix.Translation((0.3, 0.0, 0.0))
    before = roots_of(hair)
    run_parts(fit_again([hair], depsgraph()))
    assert roots_of(hair) == pytest.approx(before, abs=1e-3)
    nose = landmarks_of(head)["nose"]
    nose.location.z += 0.004
    dragged = nose.location[:]
    run_parts(fit_again([hair], depsgraph()))
    assert nose.location[:] == dragged


@pytest.mark.slow
@pytest.mark.parametrize("nodes", ["Duplicate Hair Curves", "Half"])
def test_modifiers_that_change_how_many_curves_there_are_do_not_take_others_away(nodes) -> None:
    """With other curve counts, it is unknown which curves were led into the head."""
    head = scan()
    hair = added("curls", head).hair
    count = len(hair.data.curves)
    if nodes == "Duplicate Hair Curves":
        add_hair_nodes(hair, nodes, {"Amount": 3}, 1.0)
    else:
        hair.modifiers.new("Half", "NODES").node_group = every_second_curve()
    warnings = run_parts(fit_again([hair], depsgraph()))
    assert any("change the number of curves" in each for each in warnings)
    hair.modifiers.clear()
    run_parts(fit_again([hair], depsgraph()))
    assert len(hair.data.curves) >= count, "all that it was made with"


def every_second_curve() -> bpy.types.NodeTree:
    """A node group that deletes every second curve."""
    tree = bpy.data.node_groups.new("Half", "GeometryNodeTree")
    for side in ("INPUT", "OUTPUT"):
        tree.interface.new_socket("Geometry", in_out=side, socket_type="NodeSocketGeometry")
    kinds = ("NodeGroupInput", "NodeGroupOutput", "GeometryNodeDeleteGeometry")
    come, go, delete = (tree.nodes.new(kind) for kind in kinds)
    number, odd = tree.nodes.new("GeometryNodeInputIndex"), tree.nodes.new("ShaderNodeMath")
    delete.domain, odd.operation = "CURVE", "MODULO"
    odd.inputs[1].default_value = 2.0
    for start, end in (
        (number.outputs[0], odd.inputs[0]),
        (odd.outputs[0], delete.inputs["Selection"]),
        (come.outputs[0], delete.inputs["Geometry"]),
        (delete.outputs[0], go.inputs[0]),
    ):
        tree.links.new(start, end)
    return tree


@pytest.mark.slow(instead="test_no_heads_empty_groups_and_empty_meshes_are_refused")
def test_the_own_vertex_group_limits_where_hair_grows() -> None:
    human = makehuman()
    group = human.vertex_groups.new(name="mine")
    left = [vertex.index for vertex in human.data.vertices if vertex.co.x > 0.01]
    group.add(left, 1.0, "REPLACE")
    made = added("buzz_cut", human, hairline="mine")
    hair = made.hair
    assert roots_of(hair)[:, 0].min() > 0.0 and "left out" in made.warnings[0]
    assert hair.hairloom.children_density == "mine" and "scalp" not in human.vertex_groups


@pytest.mark.slow
def test_a_head_without_the_group_gets_the_built_in_heads() -> None:
    human = makehuman()
    added("stubble", human)
    bust, group = load_bust(), human.vertex_groups["beard"]
    known = np.flatnonzero(bust.makehuman >= 0)
    own = np.zeros(len(human.data.vertices))
    for vertex in human.data.vertices:
        own[vertex.index] = sum(m.weight for m in vertex.groups if m.group == group.index)
    assert np.abs(own[bust.makehuman[known]] - bust.weights["beard"][known]).max() < 0.01


def everything() -> set[str]:
    kinds = bpy.data.objects, bpy.data.hair_curves, bpy.data.meshes
    groups = [f"{o.name} {g.name}" for o in bpy.data.objects for g in o.vertex_groups]
    return {each.name for kind in kinds for each in kind} | set(groups)


def refused(head: bpy.types.Object, problem: str, **options: str) -> None:
    """Assert an error with a remedy, and an unchanged scene."""
    before = everything()
    with pytest.raises(HairloomError, match=problem) as error:
        added("buzz_cut", head, **options)
    assert error.value.remedy and error.value.place == head.name and everything() == before


def test_half_a_head_is_refused() -> None:
    head = scan()
    keep = [list(p.vertices) for p in head.data.polygons if p.center.x > PLACE[0]]
    half = mesh_object("Half", np.array([v.co[:] for v in head.data.vertices]), keep)
    refused(half, "no faces where|no shape of a head")


@pytest.mark.slow
def test_every_second_face_missing_is_reported() -> None:
    head = scan(0.2)
    keep = [list(p.vertices) for p in head.data.polygons if p.index % 2]
    holes = mesh_object("Holes", np.array([v.co[:] for v in head.data.vertices]), keep)
    made = added("buzz_cut", holes)
    assert any("holes" in warning for warning in made.warnings)
    assert away(roots_of(made.hair)[::40], holes) < 2e-5


@pytest.mark.slow(instead="test_half_a_head_is_refused")
def test_landmarks_on_top_of_each_other_or_mistaken_are_refused() -> None:
    head = scan()
    run_parts(add_landmarks(head, depsgraph(), bpy.context.collection))
    depsgraph()
    marks = landmarks_of(head)
    place = marks["crown"].location.copy()
    marks["crown"].location = marks["nape"].location
    refused(head, "'Crown' and 'Nape' lie on top of each other")
    marks["crown"].location = place + Vector((0.4, 0.0, 0.0))
    refused(head, "'Crown' is .* mm from where it should be")
    for mark in marks.values():
        mark.location = place
    refused(head, "lie on top of each other")


def test_no_heads_empty_groups_and_empty_meshes_are_refused() -> None:
    head = scan()
    head.vertex_groups.new(name="scalp")
    refused(head, "zero everywhere")
    refused(head, "neither a vertex group", hairline="none")
    chin = head.vertex_groups.new(name="chin")
    lowest = min(head.data.vertices, key=lambda vertex: vertex.co.z).index
    chin.add([lowest], 1.0, "REPLACE")
    refused(head, "zero wherever this hair grows", hairline="chin")
    head.vertex_groups.clear()
    tree = bpy.data.node_groups.new("Nothing", "GeometryNodeTree")
    tree.interface.new_socket("Geometry", in_out="OUTPUT", socket_type="NodeSocketGeometry")
    tree.nodes.new("NodeGroupOutput")
    head.modifiers.new("Nothing", "NODES").node_group = tree
    refused(head, "no faces")
    bpy.ops.mesh.primitive_cube_add()
    refused(bpy.context.object, "is not a head")
    bpy.ops.mesh.primitive_grid_add(x_subdivisions=30, y_subdivisions=30)
    refused(bpy.context.object, "head")


@pytest.fixture
def few(monkeypatch: pytest.MonkeyPatch) -> None:
    def with_few(name: str) -> Hairstyle:
        return replace(named_hairstyle(name), settings={"children": {"method": "none"}})

    monkeypatch.setattr(operators_hairstyles, "named_hairstyle", with_few)


@pytest.mark.usefixtures("few")
def test_the_button_adds_to_the_selected_head_and_one_undo_takes_it_away() -> None:
    head = scan()
    bpy.context.view_layer.objects.active = head
    head.select_set(True)
    bpy.ops.ed.undo_push(message="before")
    before = everything()
    assert bpy.ops.hairloom.add_hairstyle("EXEC_DEFAULT", True, style="buzz_cut", plays=False) == {
        "FINISHED"
    }
    hair = bpy.context.object
    assert hair.parent == bpy.data.objects["Scan"] and len(landmarks_of(hair.parent)) == 10
    assert "Head" not in bpy.data.objects and len(previews.sessions()) == 1
    placed = roots_of(hair)
    landmarks_of(hair.parent)["crown"].location.z += 0.02
    assert bpy.ops.hairloom.fit_again() == {"FINISHED"}
    assert np.abs(roots_of(hair) - placed).max() > 0.005
    bpy.ops.ed.undo()
    assert everything() == before


@pytest.mark.slow
@pytest.mark.usefixtures("few")
def test_a_cube_is_passed_over_for_the_built_in_head() -> None:
    bpy.ops.mesh.primitive_cube_add()
    assert bpy.ops.hairloom.add_hairstyle(style="buzz_cut", plays=False) == {"FINISHED"}
    assert bpy.context.object.parent.name == "Head"


@pytest.mark.slow
@pytest.mark.draws
def test_the_command_line_takes_a_head_of_the_scene(tmp_path: Path) -> None:
    scan()
    scene = tmp_path / "scan.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(scene))
    options = ["--width", "48", "--height", "48", "--samples", "1"]
    options += ["--set", "children.strand_count=300", "--output", str(tmp_path / "buzz.png")]
    arguments = ["render", "--scene", str(scene), "--style", "buzz_cut", "--head", "Scan"]
    assert run(arguments + options) == 0
    assert run(arguments[:-1] + ["Nobody", *options]) == 1


def test_a_warp_moves_landmarks_to_their_targets_and_leaves_far_points() -> None:
    random = np.random.default_rng(2)
    source = random.uniform(-0.1, 0.1, (12, 3))
    expected = source + random.normal(0.0, 0.004, source.shape)
    warp = Warp(np.eye(4)).with_bend(source, expected, 0.3, 0.0)
    assert np.abs(warp(source) - expected).max() < 1e-9
    assert np.abs(warp(source + 5.0) - source - 5.0).max() == 0.0
    bent = warp.with_bend(expected, source, 0.3, 0.0)  # the inverse warp
    assert np.abs(bent(source) - source).max() < 1e-9


def test_which_objects_can_be_a_head() -> None:
    bpy.ops.mesh.primitive_cube_add()
    assert not foreign_heads.may_be_head(bpy.context.object)
    assert not has_makehuman_topology(scan().data)
    mesh = makehuman().data
    assert has_makehuman_topology(mesh)
    shuffled = bpy.data.meshes.new("Shuffled")
    order = np.random.default_rng(0).permutation(BODY)
    shuffled.from_pydata(
        [(0.0, 0.0, 0.0)] * BODY, [], [[int(order[v]) for v in p.vertices] for p in mesh.polygons]
    )
    assert not has_makehuman_topology(shuffled)


def test_an_overridden_head_gets_no_weights_that_are_not_saved(tmp_path):
    makehuman()
    (head,) = library_overrides(tmp_path)
    with pytest.raises(HairloomError, match="cannot change the mesh"):
        added("bob", head)
    assert not head.vertex_groups and not bpy.data.hair_curves
