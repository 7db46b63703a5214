"""Makes the bust that ships: head, neck and shoulders of MakeHuman's base mesh, which is CC0.

python tools/make_bust.py base.obj

The skin is from `base.obj` of the MakeHuman project; eyes and vertex groups are made here. The
output is addon/blender/scene/bust.npz, whose arrays addon/blender/scene/bust_data.py describes.
"""

import sys
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import bpy  # noqa: F401  mathutils lives inside it
import numpy as np
from mathutils import Vector
from mathutils.bvhtree import BVHTree

OUTPUT = Path(__file__).parents[1] / "addon" / "blender" / "scene" / "bust.npz"
#: MakeHuman's unit [m]
DECIMETRE = 0.1
#: middle of the skull, in MakeHuman's space turned to Z up [m]; it becomes the origin
MIDDLE = np.array([0.0, -0.06, 0.735])

# From here on places are in metres around that origin: x to the left of the bust, -y ahead, z up.
#: how far shoulders are lowered, and each lip is moved to the other; height of the mouth [m]
SHOULDER_DROP, LIP_SHIFT, MOUTH = 0.034, 0.0013, -0.0755
#: the cut, seen from the front: a superellipse with this middle, these half axes and this power
CUT_HEIGHT, CUT_HALF, CUT_POWER = -0.10, (0.158, 0.158), 2.4
#: corners this near to the cut are moved onto it, so that no slivers are left [m]
SNAP_DISTANCE = 0.004
#: island -> y behind which the mouth and the eye sockets are left out [m]
MAX_DEPTH = {1: -0.07, 2: -0.062, 3: -0.062}

EYE, EYE_RADIUS = np.array([0.0307767, -0.064535, -0.0065861]), 0.01495
#: angles from the eye's axis [degrees] of its rings, and how many corners each has
EYE_RINGS, EYE_CORNERS = (5, 10, 16, 22, 26, 30, 38, 50, 65, 82, 100), 16
#: how far the cornea stands out [m], and the angle at which it ends [degrees]
CORNEA, CORNEA_END = 0.0009, 30.0

#: islands of the UV map: MakeHuman's box (left, bottom, right, top), its new corner, and the factor
#: of its size
ISLANDS = (
    ((0.63, 0.14, 1.0, 0.83), (0.01, 0.02), 1.36),
    ((0.74, 0.0, 0.94, 0.14), (0.53, 0.02), 1.0),
    ((0.0, 0.54, 0.081, 0.64), (0.74, 0.02), 1.0),
    ((0.081, 0.54, 0.16, 0.64), (0.84, 0.02), 1.0),
    ((0.16, 0.66, 0.60, 0.99), (0.53, 0.50), 1.0),
)
EYE_MAPS, EYE_MAP_RADIUS = ((0.645, 0.30), (0.875, 0.30)), 0.105
#: UV corner of the cap that closes the cut, and UV units per metre
CAP_CORNER, CAP_SCALE = (0.53, 0.82), 0.75

#: Lines on the head as seen from an upright axis through (0, AXIS): angle from the front [degrees],
#: height [m] and width of the soft edge inside [m]. They are closed.
AXIS = 0.01
HAIRLINE = (
    *(
        (-45, 0.066, 0.018),
        (0, 0.066, 0.018),
        (10, 0.0665, 0.018),
        (22, 0.065, 0.018),
        (31, 0.060, 0.018),
    ),
    *((40, 0.052, 0.018), (47, 0.044, 0.016), (52, 0.034, 0.016), (56, 0.022, 0.014)),
    *((61, 0.010, 0.012), (66, 0.000, 0.010), (71, -0.012, 0.008), (75, -0.024, 0.008)),
    *((79, -0.024, 0.006), (81, -0.008, 0.006), (84, 0.004, 0.006), (90, 0.008, 0.008)),
    *((97, 0.007, 0.008), (103, -0.002, 0.008), (107, -0.016, 0.008), (111, -0.030, 0.010)),
    *((116, -0.043, 0.012), (124, -0.056, 0.016), (136, -0.066, 0.018), (150, -0.072, 0.020)),
    *((165, -0.076, 0.020), (180, -0.078, 0.020)),
    *((225, -0.078, 0.020), (225, 0.3, 0.02), (-45, 0.3, 0.02)),
)
BEARD = (
    *(
        (-45, -0.0515, 0.003),
        (0, -0.0515, 0.003),
        (7, -0.0525, 0.003),
        (12, -0.060, 0.004),
        (17, -0.070, 0.005),
    ),
    *((25, -0.072, 0.010), (38, -0.064, 0.012), (52, -0.052, 0.012), (64, -0.036, 0.010)),
    *((71, -0.020, 0.006), (75, -0.012, 0.006), (79, -0.020, 0.004), (81, -0.040, 0.006)),
    *((82, -0.056, 0.010), (78, -0.080, 0.014), (68, -0.100, 0.016), (50, -0.118, 0.020)),
    *((25, -0.135, 0.024), (0, -0.140, 0.024), (-45, -0.140, 0.024)),
)
#: middle line of a brow, seen from the front: x, z, half its width [m]
BROW = (
    *((0.0125, 0.0112, 0.0040), (0.0200, 0.0150, 0.0045), (0.0300, 0.0186, 0.0042)),
    *((0.0380, 0.0202, 0.0036), (0.0450, 0.0188, 0.0027), (0.0515, 0.0145, 0.0014)),
)
#: edges from the seam between face and socket to the rim of the lid
RIM_RING = 3
#: reach of the rays that find occlusion [m], and their number per point
CAVITY_REACH, CAVITY_RAYS = 0.02, 96


@dataclass
class Mesh:
    """Polygons of any size, one after the other.

    positions: (vertex_count, 3). uv: (uv_count, 2). sizes: corners of each polygon.
    corner_vertex, corner_uv: (corner_count,) indices.
    """

    positions: np.ndarray
    uv: np.ndarray
    sizes: np.ndarray
    corner_vertex: np.ndarray
    corner_uv: np.ndarray

    def polygons(self, corners: np.ndarray) -> list[np.ndarray]:
        return np.split(corners, np.cumsum(self.sizes)[:-1])

    def compact(self) -> "Mesh":
        """The mesh without unused vertices and UVs."""
        vertices, corner_vertex = np.unique(self.corner_vertex, return_inverse=True)
        uvs, corner_uv = np.unique(self.corner_uv, return_inverse=True)
        return Mesh(self.positions[vertices], self.uv[uvs], self.sizes, corner_vertex, corner_uv)


def mesh_of_polygons(
    positions: np.ndarray, uv: np.ndarray, faces: list[list[tuple[int, int]]]
) -> Mesh:
    """A mesh of polygons whose corners are (vertex, uv)."""
    corners = np.array([corner for face in faces for corner in face])
    sizes = np.array([len(face) for face in faces])
    return Mesh(positions, uv, sizes, corners[:, 0], corners[:, 1])


def read_skin(path: Path) -> Mesh:
    """The group `body` of MakeHuman's mesh around our origin."""
    vertices, uv, faces, group = [], [], [], ""
    for line in path.read_text().splitlines():
        kind, *rest = line.split() or [""]
        if kind == "v":
            vertices.append([float(one) for one in rest])
        elif kind == "vt":
            uv.append([float(one) for one in rest[:2]])
        elif kind == "g":
            group = rest[0]
        elif kind == "f" and group == "body":
            faces.append([tuple(int(one) - 1 for one in corner.split("/")[:2]) for corner in rest])
    x, y, z = np.array(vertices).T * DECIMETRE
    return mesh_of_polygons(np.stack([x, -z, y], axis=1) - MIDDLE, np.array(uv), faces)


def relaxed(mesh: Mesh) -> Mesh:
    """The mesh with shoulders lowered from the pose of MakeHuman's model, and closed lips."""
    x, y, z = mesh.positions.T
    lowering = (
        SHOULDER_DROP * smoothstep((np.abs(x) - 0.04) / 0.14) * smoothstep((-0.10 - z) / 0.05)
    )
    lip_weight = np.exp(-(((z - MOUTH) / 0.007) ** 2)) * smoothstep((0.030 - np.abs(x)) / 0.010)
    lip_offset = LIP_SHIFT * lip_weight * smoothstep((-0.075 - y) / 0.01) * np.sign(z - MOUTH)
    positions = np.stack([x, y, z - lowering - lip_offset], axis=1)
    return Mesh(positions, mesh.uv, mesh.sizes, mesh.corner_vertex, mesh.corner_uv)


def distance_inside_cut(positions: np.ndarray) -> np.ndarray:
    """How far inside the cut points are, approximately [m]; negative outside."""
    across = np.abs(positions[:, 0]) / CUT_HALF[0]
    down = np.maximum(CUT_HEIGHT - positions[:, 2], 0.0) / CUT_HALF[1]
    radius = (across**CUT_POWER + down**CUT_POWER) ** (1.0 / CUT_POWER)
    return (1.0 - radius) * min(CUT_HALF)


def cut(mesh: Mesh) -> Mesh:
    """The part of a mesh inside the cut, with its border exactly on it."""
    positions = snapped(mesh.positions)
    inside = distance_inside_cut(positions)
    inside[np.abs(inside) < 1e-7] = 0.0
    points, uvs = list(positions), list(mesh.uv)
    new_indices: dict[tuple[int, ...], int] = {}

    def cut_corner(start_corner: tuple[int, int], end_corner: tuple[int, int]) -> tuple[int, int]:
        """The corner where an edge meets the cut."""
        start_corner, end_corner = min(start_corner, end_corner), max(start_corner, end_corner)
        start, end = positions[start_corner[0]], positions[end_corner[0]]
        fraction = cut_fraction(start, end)
        vertex = new_indices.setdefault((start_corner[0], end_corner[0]), len(points))
        if vertex == len(points):
            points.append(start + fraction * (end - start))
        key = (*start_corner, *end_corner)
        place = new_indices.setdefault(key, len(uvs))
        if place == len(uvs):
            uvs.append(
                mesh.uv[start_corner[1]]
                + fraction * (mesh.uv[end_corner[1]] - mesh.uv[start_corner[1]])
            )
        return vertex, place

    faces = []
    pairs = np.stack([mesh.corner_vertex, mesh.corner_uv], axis=1)
    for corners in np.split(pairs, np.cumsum(mesh.sizes)[:-1]):
        if not (inside[corners[:, 0]] > 0.0).any():
            continue
        face = []
        ring = [tuple(int(start_corner) for start_corner in corner) for corner in corners]
        for start_corner, end_corner in zip(ring, ring[1:] + ring[:1], strict=True):
            if inside[start_corner[0]] >= 0.0:
                face.append(start_corner)
            if inside[start_corner[0]] * inside[end_corner[0]] < 0.0:
                face.append(cut_corner(start_corner, end_corner))
        if len(face) > 2:
            faces.append(face)
    return mesh_of_polygons(np.array(points), np.array(uvs), faces).compact()


def snapped(positions: np.ndarray) -> np.ndarray:
    """Points near the cut moved onto it, along its gradient."""
    moved = positions.copy()
    near = np.abs(distance_inside_cut(moved)) < SNAP_DISTANCE
    for _ in range(8):
        here = distance_inside_cut(moved[near])
        steps = np.eye(3) * 1e-5
        slope = (
            np.stack([distance_inside_cut(moved[near] + step) - here for step in steps], axis=1)
            / 1e-5
        )
        moved[near] -= here[:, None] * slope / (slope**2).sum(axis=1, keepdims=True)
    return moved


def cut_fraction(start: np.ndarray, end: np.ndarray) -> float:
    """The fraction of an edge at which it meets the cut, by bisection."""
    low, high = 0.0, 1.0
    start_is_in = distance_inside_cut(start[None])[0] > 0.0
    for _ in range(50):
        middle = 0.5 * (low + high)
        is_in = distance_inside_cut((start + middle * (end - start))[None])[0] > 0.0
        low, high = (middle, high) if is_in == start_is_in else (low, middle)
    return 0.5 * (low + high)


def select_polygons(mesh: Mesh, is_selected: np.ndarray) -> Mesh:
    """Some polygons of a mesh."""
    corners = np.repeat(is_selected, mesh.sizes)
    selected = mesh.corner_vertex[corners], mesh.corner_uv[corners]
    return Mesh(mesh.positions, mesh.uv, mesh.sizes[is_selected], *selected).compact()


def without_depths(mesh: Mesh) -> Mesh:
    """The mesh without the depths of the mouth and the eye sockets, which are separate islands."""
    first = np.concatenate([[0], np.cumsum(mesh.sizes)[:-1]])
    depth = np.minimum.reduceat(mesh.positions[mesh.corner_vertex, 1], first)
    island = island_of(mesh.uv)[mesh.corner_uv[first]]
    limit = np.array([MAX_DEPTH.get(number, np.inf) for number in range(len(ISLANDS))])
    return select_polygons(mesh, depth <= limit[island])


def island_of(uv: np.ndarray) -> np.ndarray:
    """The number in ISLANDS of the island that holds each UV of MakeHuman's map, -1 for none."""
    island = np.full(len(uv), -1)
    for number, (box, _, _) in enumerate(ISLANDS):
        island[((uv >= box[:2]) & (uv <= box[2:])).all(axis=1)] = number
    return island


def laid_out(mesh: Mesh) -> Mesh:
    """The mesh with the islands of its map in their new places."""
    uv, island = mesh.uv.copy(), island_of(mesh.uv)
    assert (island >= 0).all(), "a place of the map that no island holds"
    for number, (box, corner, factor) in enumerate(ISLANDS):
        here = island == number
        uv[here] = (mesh.uv[here] - box[:2]) * factor + corner
    return Mesh(mesh.positions, uv, mesh.sizes, mesh.corner_vertex, mesh.corner_uv)


def cap(mesh: Mesh) -> Mesh:
    """A separate mesh that closes the cut: a strip along it, from the front to the back."""
    ring = mesh.positions[border(mesh)]
    across, down = ring[:, 0] / CUT_HALF[0], (CUT_HEIGHT - ring[:, 2]) / CUT_HALF[1]
    turn = np.arctan2(across, down)
    first, last = int(turn.argmin()), int(turn.argmax())
    count = len(ring)
    left = (first + np.arange((last - first) % count + 1)) % count
    right = (first - np.arange((first - last) % count + 1)) % count
    faces, i, j = [], 0, 0
    while i + 1 < len(left) or j + 1 < len(right):
        advances_left = j + 1 == len(right) or (
            i + 1 < len(left) and turn[left[i + 1]] <= turn[right[j + 1]]
        )
        face = [left[i], right[j], left[i + 1] if advances_left else right[j + 1]]
        i, j = (i + 1, j) if advances_left else (i, j + 1)
        if len(set(face)) == 3:
            faces.append(face)
    order = np.argsort(turn)
    sorted_ring = ring[order][:, [0, 2]]
    length = np.concatenate(
        [[0.0], np.cumsum(np.linalg.norm(np.diff(sorted_ring, axis=0), axis=1))]
    )
    along = np.empty(count)
    along[order] = length
    uv = np.stack([along, ring[:, 1] - ring[:, 1].min()], axis=1) * CAP_SCALE + CAP_CORNER
    a, b, c = np.moveaxis(ring[np.array(faces)], 1, 0)
    outward = 0.5 * (a + b) - (0.0, 0.5 * (a + b)[:, 1].mean(), CUT_HEIGHT)
    if (np.cross(b - a, c - a) * outward).sum() < 0.0:
        faces = [face[::-1] for face in faces]
    return mesh_of_polygons(ring, uv, [[(corner, corner) for corner in face] for face in faces])


def border(mesh: Mesh) -> np.ndarray:
    """The vertices around the cut, one after the other."""
    edges = {
        (int(start), int(end))
        for face in mesh.polygons(mesh.corner_vertex)
        for start, end in zip(face, np.roll(face, -1), strict=True)
    }
    next_vertex = {start: end for start, end in edges if (end, start) not in edges}
    on_cut = np.abs(distance_inside_cut(mesh.positions)) < 1e-5
    ring = [next(vertex for vertex in next_vertex if on_cut[vertex])]
    while next_vertex[ring[-1]] != ring[0]:
        ring.append(next_vertex[ring[-1]])
    assert on_cut[ring].all()
    return np.array(ring)


def eyes() -> Mesh:
    """Two eyeballs that look ahead, as rings around their axis; open behind."""
    rings = np.radians(EYE_RINGS)
    around = np.arange(EYE_CORNERS) * 2.0 * np.pi / EYE_CORNERS
    bulge = np.clip(1.0 - (np.degrees(np.concatenate([[0.0], rings])) / CORNEA_END) ** 2, 0.0, 1.0)
    radius = EYE_RADIUS + CORNEA * bulge**2
    circle = np.stack([np.cos(around), np.sin(around)], axis=1)
    ball = [(0.0, -radius[0], 0.0)]
    flat = [(0.0, 0.0)]
    for angle, size in zip(rings, radius[1:], strict=True):
        side, ahead = size * np.sin(angle), -size * np.cos(angle)
        ball += [(side * x, ahead, side * z) for x, z in circle]
        flat += list(circle * angle / rings[-1])
    faces = []
    for corner in range(EYE_CORNERS):
        following = (corner + 1) % EYE_CORNERS
        faces.append([0, 1 + corner, 1 + following])
        for ring in range(len(rings) - 1):
            low, high = 1 + ring * EYE_CORNERS, 1 + (ring + 1) * EYE_CORNERS
            faces.append([low + corner, high + corner, high + following, low + following])
    left = np.array(ball) + EYE
    right = np.array(ball) + EYE * (-1, 1, 1)
    maps = [np.array(flat) * EYE_MAP_RADIUS + middle for middle in EYE_MAPS]
    count = len(ball)
    both = [[(one + shift, one + shift) for one in face] for shift in (0, count) for face in faces]
    return mesh_of_polygons(np.concatenate([left, right]), np.concatenate(maps), both)


def joined(first: Mesh, second: Mesh) -> Mesh:
    return Mesh(
        np.concatenate([first.positions, second.positions]),
        np.concatenate([first.uv, second.uv]),
        np.concatenate([first.sizes, second.sizes]),
        np.concatenate([first.corner_vertex, second.corner_vertex + len(first.positions)]),
        np.concatenate([first.corner_uv, second.corner_uv + len(first.uv)]),
    )


def smoothstep(value: np.ndarray) -> np.ndarray:
    x = np.clip(value, 0.0, 1.0)
    return x * x * (3.0 - 2.0 * x)


def inside_line(positions: np.ndarray, line: tuple[tuple[float, ...], ...]) -> np.ndarray:
    """0 outside of a closed line on the head, rising to 1 over its soft edge inside."""
    x, y, z = positions.T
    # angles as lengths on the head, whose radius is about 8.5 cm
    to_metres = np.radians(1.0) * 0.085
    position = np.stack([np.degrees(np.arctan2(np.abs(x), AXIS - y)) * to_metres, z], axis=1)
    corners = np.array(line)
    corners[:, 0] *= to_metres
    nearest, width = np.full(len(position), np.inf), np.ones(len(position))
    crossings = np.zeros(len(position), int)
    for start, end in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        along = end[:2] - start[:2]
        fraction = np.clip((position - start[:2]) @ along / (along @ along), 0.0, 1.0)
        distance = np.linalg.norm(position - start[:2] - fraction[:, None] * along, axis=1)
        width = np.where(distance < nearest, start[2] + fraction * (end[2] - start[2]), width)
        nearest = np.minimum(nearest, distance)
        spans = (start[1] > position[:, 1]) != (end[1] > position[:, 1])
        with np.errstate(divide="ignore", invalid="ignore"):
            crossing_x = start[0] + (position[:, 1] - start[1]) / along[1] * along[0]
        crossings += spans & (position[:, 0] < crossing_x)
    return np.where(crossings % 2 == 1, smoothstep(nearest / width), 0.0)


def brows(positions: np.ndarray) -> np.ndarray:
    position = np.stack([np.abs(positions[:, 0]), positions[:, 2]], axis=1)
    line, weight = np.array(BROW), np.zeros(len(position))
    for start, end in pairwise(line):
        along = end[:2] - start[:2]
        fraction = np.clip((position - start[:2]) @ along / (along @ along), 0.0, 1.0)
        distance = np.linalg.norm(position - start[:2] - fraction[:, None] * along, axis=1)
        half = start[2] + fraction * (end[2] - start[2])
        weight = np.maximum(weight, smoothstep(0.8 * (1.9 - distance / half)))
    return weight * (positions[:, 1] < -0.04)


def lips(mesh: Mesh, mouth: np.ndarray) -> np.ndarray:
    """The red of the lips, seen from the front, and the mouth.

    Args:
        mouth: (corner_count,) whether a corner is of the mouth's island.
    """
    x, y, z = mesh.positions.T
    across = np.abs(x) / 0.0262
    bow = 0.0012 * np.exp(-((x / 0.0035) ** 2))
    top = -0.0755 + 0.0098 * np.clip(1.0 - across**1.8, 0.0, 1.0) ** 0.8 - bow
    bottom = -0.0760 - 0.0108 * np.clip(1.0 - across**2.4, 0.0, 1.0) ** 0.7
    edge = np.minimum(top - z, z - bottom) / 0.0016
    red = smoothstep(edge + 0.7) * (y < -0.07) * (across < 1.0)
    red[mesh.corner_vertex[mouth]] = 1.0
    return red


def lid_rims(mesh: Mesh, sockets: np.ndarray) -> np.ndarray:
    """1 on the outer rims of the lids, a few rings of vertices away from the seam between the face
    and the sockets.

    Args:
        sockets: (corner_count,) whether a corner is of a socket's island.
    """
    of_socket, of_face = np.zeros((2, len(mesh.positions)), bool)
    of_socket[mesh.corner_vertex[sockets]] = True
    of_face[mesh.corner_vertex[~sockets]] = True
    edges = {
        (int(start), int(end))
        for face in mesh.polygons(mesh.corner_vertex)
        for start, end in zip(face, np.roll(face, -1), strict=True)
    }
    starts, ends = np.array([edge for edge in edges if of_face[list(edge)].all()]).T
    ring = np.where(of_socket & of_face, 0, RIM_RING + 1)
    for step in range(RIM_RING):
        for start, end in ((starts, ends), (ends, starts)):
            neighbors = end[ring[start] == step]
            ring[neighbors] = np.minimum(ring[neighbors], step + 1)
    # no lashes in the inner corner, at the caruncle
    distance = np.abs(mesh.positions[:, 0]) - EYE[0]
    return (ring == RIM_RING) * smoothstep((distance + 0.0115) / 0.003)


def cavities(mesh: Mesh) -> np.ndarray:
    """The fraction of the directions around each vertex that is not occluded by nearby skin."""
    tree = BVHTree.FromPolygons(mesh.positions.tolist(), mesh.polygons(mesh.corner_vertex))
    normals = vertex_normals(mesh)
    number = np.arange(CAVITY_RAYS) + 0.5
    height = 1.0 - 2.0 * number / CAVITY_RAYS
    turn = np.pi * (1.0 + 5.0**0.5) * number
    ring = np.sqrt(1.0 - height**2)
    sphere = np.stack([ring * np.cos(turn), ring * np.sin(turn), height], axis=1)
    # rays are cosine-weighted about the normal
    openness = np.empty(len(mesh.positions))
    for vertex, (point, normal) in enumerate(zip(mesh.positions, normals, strict=True)):
        rays = sphere + normal
        start = Vector(point + 1e-4 * normal)
        hits = [tree.ray_cast(start, Vector(ray), CAVITY_REACH)[3] for ray in rays]
        # farther hits occlude less
        occlusion = sum(1.0 - hit / CAVITY_REACH for hit in hits if hit is not None)
        openness[vertex] = 1.0 - occlusion / CAVITY_RAYS
    return openness


def vertex_normals(mesh: Mesh) -> np.ndarray:
    normals = np.zeros_like(mesh.positions)
    for face in mesh.polygons(mesh.corner_vertex):
        ring = mesh.positions[face]
        normals[face] += np.cross(ring, np.roll(ring, -1, axis=0)).sum(axis=0)
    return normals / np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-12)


def indices_in(whole: Mesh, part: np.ndarray) -> np.ndarray:
    """The vertex of a mesh at each of these points, -1 where none is: those made at the cut."""
    index = {tuple(point): number for number, point in enumerate(whole.positions)}
    return np.array([index.get(tuple(point), -1) for point in part])


def main(path: Path) -> None:
    whole = relaxed(read_skin(path))
    skin = without_depths(cut(whole))
    makehuman = indices_in(whole, skin.positions)
    island = island_of(skin.uv)[skin.corner_uv]
    lashes, red = lid_rims(skin, np.isin(island, (2, 3))), lips(skin, island == 1)
    skin, sole, balls = laid_out(skin), cap(skin), eyes()
    both = joined(joined(skin, sole), balls)
    count = len(both.positions) - len(skin.positions)
    weights = {
        "scalp": inside_line(skin.positions, HAIRLINE),
        "brows": brows(skin.positions),
        "lashes": lashes,
        "beard": inside_line(skin.positions, BEARD) * (1.0 - red),
        "lips": red,
    }
    groups = {name: np.concatenate([value, np.zeros(count)]) for name, value in weights.items()}
    groups["cavity"] = cavities(both)
    makehuman = np.concatenate([makehuman, np.full(count, -1)])
    is_eye = np.arange(len(both.sizes)) >= len(both.sizes) - len(balls.sizes)
    np.savez_compressed(
        OUTPUT,
        positions=both.positions.astype(np.float32),
        uv=both.uv.astype(np.float32),
        sizes=both.sizes.astype(np.uint8),
        corner_vertex=both.corner_vertex.astype(np.uint16),
        corner_uv=both.corner_uv.astype(np.uint16),
        material=is_eye.astype(np.uint8),
        makehuman=makehuman.astype(np.int16),
        **{name: np.round(255 * value).astype(np.uint8) for name, value in groups.items()},
    )
    low, high = both.positions.min(axis=0), both.positions.max(axis=0)
    print(
        f"{len(both.positions)} vertices, {len(both.sizes)} polygons from {low.round(3)} to "
        f"{high.round(3)} m: {OUTPUT.stat().st_size / 1024:.0f} KiB"
    )


if __name__ == "__main__":
    main(Path(sys.argv[1]))
