"""The light of a scene's world, by direction: an Environment from its nodes.

A plain colour, or an Environment Texture turned by a Mapping, is read directly. All other nodes,
such as a Sky Texture, are rendered by another Blender as a small panorama, once for each state of
the nodes. In a window this runs in the background; until then the world has its last rendering, or
without one its plain colour.
"""

from __future__ import annotations

import os
import sys
import tempfile
import zlib
from collections.abc import Callable, Hashable
from dataclasses import dataclass
from functools import lru_cache, partial
from pathlib import Path
from subprocess import TimeoutExpired
from typing import Any

import bpy
import numpy as np
from mathutils import Euler, Vector

from ...arrays import Floats
from ...errors import HairloomError
from ...exchange.files.child_process import python_program, run_child
from ...exchange.textures.texture_files import read_texture
from ...shading.environment import Environment, downsampled, environment_of
from ..base.blender_program import blender_command
from ..base.images import read_image
from ..base.latest_job import LatestJob

_SCRIPT = Path(__file__).with_name("render_panorama.py")
#: number of states of worlds that are cached, so that an animated one does not fill the memory
_CACHE_SIZE = 16
#: timeout [s] for another Blender to start and render a panorama, on a busy machine too
_TIMEOUT = 120.0
#: settings of nodes that do not affect light, and the depth to which groups are compared
_IGNORED_PROPERTIES = {each.identifier for each in bpy.types.Node.bl_rna.properties} - {"mute"}
_MAX_GROUP_DEPTH = 16


@dataclass(frozen=True, eq=False)
class _WorldLight:
    """A world as it was read. note: what could not be read, with its remedy; empty: all is well."""

    environment: Environment
    note: str = ""


#: cache, the most recently used last
_cache: dict[Hashable, _WorldLight] = {}


def read_environment(scene: bpy.types.Scene, *, blocking: bool = True) -> Environment:
    """The world's light; the same object while nothing of it changes.

    Args:
        blocking: False: render nodes in the background; until then the last rendering is returned,
            or without one a plain colour.
    """
    return _read(scene.world, blocking=blocking).environment


def world_notes(scene: bpy.types.Scene) -> tuple[str, ...]:
    """Notes on what of the world could not be read, with remedies; usually none."""
    note = _read(scene.world, blocking=False).note
    return (note,) if note else ()


def studio_environment(shading: bpy.types.View3DShading) -> Environment:
    """The world picture by which a 3D view is lit instead of the scene's world; black if it has
    none, as in Solid mode.

    Only the view's own settings are read, and each file once.
    """
    light = shading.selected_studio_light if shading.type in ("MATERIAL", "RENDERED") else None
    if light is None or light.type != "WORLD":
        return Environment()
    return _studio_light(light.path, shading.studiolight_rotate_z, shading.studiolight_intensity)


@lru_cache(maxsize=8)
def _studio_light(path: str, rotation: float, intensity: float) -> Environment:
    panorama = _studio_panorama(path)
    if panorama is None:
        return Environment()
    # Blender turns the lookup direction, so the picture turns the other way
    matrix = np.array(Euler((0.0, 0.0, -rotation)).to_matrix())
    return environment_of(intensity * panorama, matrix)


@lru_cache(maxsize=4)
def _studio_panorama(path: str) -> Floats | None:
    """None: it cannot be read, and Blender's own view is black."""
    try:
        return downsampled(_rgb(read_texture(Path(path), is_color=True)))
    except HairloomError as error:
        print(f"Studio light: {error}")
        return None


def _read(world: bpy.types.World | None, *, blocking: bool) -> _WorldLight:
    if world is None:
        return _cached(None, lambda: _WorldLight(Environment()))
    surface = _surface_node(world)
    if surface is None:
        return _plain_world(world)
    picture = _environment_texture(surface)
    if picture is not None:
        return picture
    if _is_plain(surface):
        return _plain_world(world)
    uid, key = world.original.session_uid, _key(world)
    if key not in _cache and not blocking:
        # while a sky is being edited, its last rendering is used until the new one is there
        _request_render(uid, key, _background_color(world))
        return _last_rendering(uid) or _plain_world(world)

    def render() -> _WorldLight:
        with tempfile.TemporaryDirectory(prefix="hairloom") as folder:
            _write(world, Path(folder))
            return _render_panorama(Path(folder), world.name, _background_color(world))

    return _cached(key, render)


def _key(world: bpy.types.World) -> Hashable:
    return "nodes", world.original.session_uid, _state(world.node_tree)


def _last_rendering(uid: int) -> _WorldLight | None:
    """The last rendering of the world with this session number; None: there is none."""
    keys = (each for each in reversed(_cache) if isinstance(each, tuple))
    return next((_cache[key] for key in keys if key[:2] == ("nodes", uid)), None)


def _request_render(uid: int, key: Hashable, plain: tuple[float, float, float]) -> None:
    """Have the world with this session number rendered in the background."""

    def begin() -> Callable[[object], tuple[Hashable, _WorldLight]]:
        worlds = (each for each in bpy.data.worlds if each.session_uid == uid)
        world = next(worlds, None)
        if world is None or world.node_tree is None:  # gone since, so the result is not used
            return lambda _: (key, _WorldLight(Environment(plain)))
        folder = tempfile.TemporaryDirectory(prefix="hairloom")
        _write(world, Path(folder.name))
        work = partial(_render_in_thread, folder, world.name, plain, _key(world))
        return lambda _: work()

    if _job.is_latest(key) and not _job.is_pending:
        _job.cancel()  # its result has dropped out of the cache
    _job.request(key, begin)


def _cached(key: Hashable, make: Callable[[], _WorldLight]) -> _WorldLight:
    read = _cache.pop(key, None) or make()
    while len(_cache) >= _CACHE_SIZE:
        del _cache[next(iter(_cache))]
    _cache[key] = read
    return read


def _plain_world(world: bpy.types.World) -> _WorldLight:
    """The colour of the Background, ignoring other nodes, or of a world without nodes."""
    color = _background_color(world)
    return _cached(("plain", color), lambda: _WorldLight(Environment(color)))


def _background_color(world: bpy.types.World) -> tuple[float, float, float]:
    nodes = () if world.node_tree is None else world.node_tree.nodes
    node = next((each for each in nodes if each.type == "BACKGROUND" and not each.mute), None)
    if node is None:
        red, green, blue = world.color
        return (red, green, blue)
    color, source = node.inputs["Color"].default_value, _linked_node(node.inputs["Color"])
    if source is not None and source.type == "RGB":
        color = source.outputs[0].default_value
    strength = node.inputs["Strength"].default_value
    red, green, blue, *_ = (max(0.0, float(channel * strength)) for channel in color)
    return (red, green, blue)


def _surface_node(world: bpy.types.World) -> bpy.types.Node | None:
    """The node linked to the world's output; None: there are no nodes, or none is linked."""
    if world.node_tree is None:
        return None
    output = world.node_tree.get_output_node("CYCLES") or world.node_tree.get_output_node("EEVEE")
    return None if output is None else _linked_node(output.inputs["Surface"])


def _is_plain(surface: bpy.types.Node) -> bool:
    if surface.type != "BACKGROUND" or surface.mute or surface.inputs["Strength"].is_linked:
        return False
    color = surface.inputs["Color"]
    source = _linked_node(color)
    return not color.is_linked or (source is not None and source.type == "RGB" and not source.mute)


def _environment_texture(surface: bpy.types.Node) -> _WorldLight | None:
    """The world of an Environment Texture that is only turned and scaled in strength."""
    if surface.type != "BACKGROUND" or surface.mute or surface.inputs["Strength"].is_linked:
        return None
    node = _linked_node(surface.inputs["Color"])
    if node is None or node.type != "TEX_ENVIRONMENT" or node.mute or node.image is None:
        return None
    rotation = _rotation(node.inputs["Vector"])
    is_file = node.image.source in ("FILE", "GENERATED")
    if rotation is None or node.projection != "EQUIRECTANGULAR" or not is_file:
        return None
    image, strength = node.image, float(surface.inputs["Strength"].default_value)
    try:
        state = _image_state(image)
        key = ("picture", state, strength, rotation.tobytes())
        uid = image.original.session_uid
        return _cached(
            key, lambda: _WorldLight(environment_of(strength * _panorama(uid, state), rotation))
        )
    except HairloomError as error:
        note = f"World: {error} Until then it is black."
        return _cached(("missing", note), lambda: _WorldLight(Environment(), note))


def _rotation(socket: bpy.types.NodeSocket) -> Floats | None:
    """The rotation from a panorama's directions to the world's, (3, 3); None: it is no rotation."""
    if not socket.is_linked:
        return np.eye(3)
    node, output = socket.links[0].from_node, socket.links[0].from_socket
    if node.type == "TEX_COORD" and output.name == "Generated" and not node.mute:
        return np.eye(3)
    if node.type != "MAPPING" or node.mute or any(each.is_linked for each in node.inputs[1:]):
        return None
    values = {each.name: each.default_value for each in node.inputs[1:]}
    moves = node.vector_type in ("POINT", "TEXTURE") and Vector(values["Location"]).length > 0.0
    is_scaled = any(abs(each - 1.0) > 1e-6 for each in values["Scale"])
    before = _rotation(node.inputs["Vector"])
    if moves or is_scaled or before is None or node.vector_type == "NORMAL":
        return None
    rotation = np.array(Euler(values["Rotation"], "XYZ").to_matrix())
    return before @ (rotation if node.vector_type == "TEXTURE" else rotation.T)


def _linked_node(socket: bpy.types.NodeSocket) -> bpy.types.Node | None:
    """The node that is linked to an input, past reroutes."""
    while socket.is_linked:
        node = socket.links[0].from_node
        if node.type != "REROUTE":
            return node
        socket = node.inputs[0]
    return None


def _image_state(image: bpy.types.Image) -> Hashable:
    """A state that is equal while the pixels are."""
    path = bpy.path.abspath(image.filepath, library=image.library)
    modified = os.path.getmtime(path) if os.path.isfile(path) else 0.0
    packed = 0 if image.packed_file is None else image.packed_file.size
    file = image.original.session_uid, path, modified, packed
    state = (*file, *image.size, image.colorspace_settings.name)
    if not image.is_dirty:
        return state
    pixels = np.empty(len(image.pixels), np.float32)
    image.pixels.foreach_get(pixels)
    return (*state, zlib.crc32(pixels.tobytes()))


@lru_cache(maxsize=1)
def _panorama(uid: int, _state: Hashable) -> Floats:
    """Scene-linear pixels of the image with this session number, reduced, (rows, columns, 3).

    Cached by its state, so that it is not read again when the panorama is turned.

    Raises:
        HairloomError: its file is missing or broken.
    """
    image = next(each for each in bpy.data.images if each.session_uid == uid)
    pixels = read_image(image, is_color=True, place=f"Image '{image.name}'")
    return downsampled(pixels[..., :3] * pixels[..., 3:])


def _rgb(picture: Floats) -> Floats:
    """The colours of a picture, (rows, columns, 3), also of a grey one."""
    colors = picture[..., :3] if picture.shape[-1] >= 3 else picture[..., :1]
    return np.broadcast_to(colors, (*colors.shape[:2], 3))


def _state(tree: bpy.types.NodeTree, depth: int = 0) -> Hashable:
    """A state that is equal while the nodes give the same light."""
    nodes = tuple((node.name, *_node_state(node, depth)) for node in tree.nodes)
    links = tuple(
        (link.from_node.name, link.from_socket.identifier)
        + (link.to_node.name, link.to_socket.identifier)
        for link in tree.links
    )
    return nodes, links


def _node_state(node: bpy.types.Node, depth: int) -> tuple[Hashable, ...]:
    names = (
        each.identifier
        for each in node.bl_rna.properties
        if each.identifier not in _IGNORED_PROPERTIES
    )
    values = tuple((name, _value(getattr(node, name), depth)) for name in names)
    inputs = tuple(_value(getattr(each, "default_value", None), depth) for each in node.inputs)
    outputs = tuple(_value(getattr(each, "default_value", None), depth) for each in node.outputs)
    return node.bl_idname, values, inputs, outputs


def _value(value: Any, depth: int) -> Hashable:
    if isinstance(value, bpy.types.Image):
        return _image_state(value)
    if isinstance(value, bpy.types.NodeTree):
        return _state(value, depth + 1) if depth < _MAX_GROUP_DEPTH else value.name_full
    if isinstance(value, bpy.types.ID):
        return value.name_full
    if isinstance(value, bpy.types.ColorRamp):
        stops = tuple((each.position, *each.color) for each in value.elements)
        return (value.interpolation, value.color_mode, value.hue_interpolation, *stops)
    if isinstance(value, bpy.types.CurveMapping):
        curves = [[(*each.location, each.handle_type) for each in c.points] for c in value.curves]
        return repr(curves)
    if isinstance(value, bpy.types.bpy_struct):
        return type(value).__name__
    return value if isinstance(value, (bool, int, float, str)) else repr(_plain_values(value))


def _plain_values(value: Any) -> Any:
    return tuple(value) if hasattr(value, "__iter__") else value


def _write(world: bpy.types.World, folder: Path) -> None:
    original = world.original
    bpy.data.libraries.write(
        str(folder / "world.blend"), {original}, path_remap="ABSOLUTE", fake_user=True
    )


def _render_panorama(folder: Path, name: str, plain: tuple[float, float, float]) -> _WorldLight:
    """The world that was written into this folder, rendered by another Blender."""
    panorama = folder / "panorama.exr"
    program, settings = blender_command(), None
    if program is None:
        # this process may have Blender's modules on its path, which only work within Blender
        program, settings = python_program(sys.executable), {"PYTHONPATH": ""}
    files = str(folder / "world.blend"), str(panorama)
    try:
        command = [*program, str(_SCRIPT), "--", *files]
        process = run_child(command, seconds=_TIMEOUT, environment=settings)
        if process.returncode == 0:
            return _WorldLight(environment_of(_rgb(read_texture(panorama, is_color=True))))
        lines = process.stderr.decode(errors="replace").strip().splitlines()
        reason = lines[-1] if lines else f"it exited with code {process.returncode}"
    except (OSError, TimeoutExpired, HairloomError) as error:
        reason = str(error)
    note = (
        f"World '{name}': another Blender could not render its nodes ({reason}), so its plain "
        "colour lights hair. Use only an Environment Texture, a Mapping and a Background."
    )
    return _WorldLight(Environment(plain), note)


def _render_in_thread(
    folder: tempfile.TemporaryDirectory[str],
    name: str,
    plain: tuple[float, float, float],
    key: Hashable,
) -> tuple[Hashable, _WorldLight]:
    with folder:
        return key, _render_panorama(Path(folder.name), name, plain)


def _take_result() -> None:
    """Take a world rendered in the background, and have worlds read again."""
    result = _job.take()
    if result is not None:
        key, read = result
        _cached(key, lambda: read)
    for scene in bpy.data.scenes:
        if scene.world is not None:
            scene.world.update_tag()


_job: LatestJob[Hashable, tuple[Hashable, _WorldLight]] = LatestJob("hairloom world", _take_result)
