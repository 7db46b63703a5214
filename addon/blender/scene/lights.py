"""The scene's lights and world, in the renderer's terms."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace

import bpy
import numpy as np
from mathutils import Matrix

from ...arrays import Floats
from ...shading.area_lights import Panel
from ...shading.lights import LIGHT_CAPACITY, Cone, Light, brightest_lights

type Color = tuple[float, float, float]


def read_lights(
    depsgraph: bpy.types.Depsgraph, center: Floats, suns: Sequence[Light] = ()
) -> tuple[Light, ...]:
    """The up to eight visible lights that are brightest at a point, brightest first.

    Read as Cycles does, except for shadows, light linking, instanced lights, nodes other than a
    plain Emission, and EEVEE's diffuse and specular factors.

    Args:
        center: (3,) [m], world space.
        suns: the suns in the world's environment.
    """
    return brightest_lights([*_lights(depsgraph), *suns], center)


def light_warnings(depsgraph: bpy.types.Depsgraph, suns: Sequence[Light] = ()) -> tuple[str, ...]:
    """Warnings about the scene's lights, each with its remedy; usually none.

    Args:
        suns: see `read_lights`.
    """
    count = sum(1 for _ in _lights(depsgraph)) + len(suns)
    if count <= LIGHT_CAPACITY:
        return ()
    of_world = f" ({len(suns)} from the world)" if suns else ""
    return (
        f"Lights: {count} shine here{of_world}, but the preview draws only the {LIGHT_CAPACITY} "
        "that are brightest at the middle of the hair. Hide those that add least.",
    )


def no_light_warnings(lights: Sequence[Light], ambient: Color) -> tuple[str, ...]:
    """A warning if a view uses the scene's lights but there are none.

    Such a view lights hair by the world alone, or, if that is black, by studio lights; see
    `overlay.with_view_lights`.
    """
    if lights or not scene_lights_are_shown():
        return ()
    if any(ambient):
        return (
            "Lights: there is no light, so views with Scene Lights on show hair in the world's "
            "colour only. Add a light, or turn Scene Lights off in Viewport Shading.",
        )
    return (
        "Lights: there is no light and the world is black, so studio lights are used. "
        "Add a light, or give the world a colour.",
    )


def scene_lights_are_shown() -> bool:
    """Whether any view uses the scene's lights."""
    return any(uses_scene_light(each)[0] for each in _open_shadings())


def uses_scene_light(shading: bpy.types.View3DShading) -> tuple[bool, bool]:
    """Whether a 3D view uses the scene's lights, and whether it uses the scene's world."""
    if shading.type == "MATERIAL":
        return shading.use_scene_lights, shading.use_scene_world
    if shading.type == "RENDERED":
        return shading.use_scene_lights_render, shading.use_scene_world_render
    return False, False


def _open_shadings() -> Iterator[bpy.types.View3DShading]:
    """The shading of all open 3D views."""
    for window in bpy.context.window_manager.windows:
        for area in window.screen.areas:
            if area.type == "VIEW_3D":
                yield area.spaces.active.shading


def _lights(depsgraph: bpy.types.Depsgraph) -> Iterator[Light]:
    for instance in depsgraph.objects:
        if instance.type == "LIGHT":
            light = _light(instance)
            if light is not None and sum(light.power) > 0.0:
                yield replace(light, name=instance.name, casts_shadow=instance.data.use_shadow)


def _light(instance: bpy.types.Object) -> Light | None:
    """None: it is a portal and emits no light, or its scale is zero and it has no direction."""
    data, matrix = instance.data, instance.matrix_world
    color = _emission(data) * np.array(data.color) * data.energy * 2.0**data.exposure
    if data.use_temperature:
        color = color * np.array(data.temperature_color)
    location = np.array(matrix.translation)
    direction = -np.array(matrix.col[2][:3])
    if data.type in ("SUN", "AREA") and not direction.any():
        return None
    if data.type == "SUN":
        strength = 1.0 if data.normalize else _sun_disk(data.angle)
        return Light.sun(direction, color, strength, data.angle)
    if data.type == "AREA":
        if _is_portal(data):
            return None
        panel = _panel(data, matrix)
        return Light.area(location, color, 1.0 if data.normalize else _panel_size(panel), panel)
    radius, is_ball = data.shadow_soft_size, not data.use_soft_falloff
    power = 1.0 if data.normalize or radius == 0.0 else 4.0 * np.pi * radius * radius
    if data.type == "SPOT":
        cone = Cone(_inverse(matrix), data.spot_size, data.spot_blend)
        return Light.spot(location, color, power, cone, radius, is_ball)
    return Light.point(location, color, power, radius, is_ball)


def _sun_disk(angle: float) -> float:
    """Irradiance of a sun of this full angle [rad] and the radiance 1."""
    return float(np.pi * np.sin(0.5 * angle) ** 2) if angle > 0.0 else 1.0


def _panel(data: bpy.types.AreaLight, matrix: Matrix) -> Panel:
    """Scaling the object enlarges an area light, but does not widen its spread."""
    right, up, back = (np.array(matrix.col[axis][:3]) for axis in range(3))
    height = data.size_y if data.shape in ("RECTANGLE", "ELLIPSE") else data.size
    direction = -back / np.linalg.norm(back)
    width_scale, height_scale = float(np.linalg.norm(right)), float(np.linalg.norm(up))
    # the axes of an area light are perpendicular, even if its matrix is sheared
    up = np.cross(direction, right)
    if not up.any():
        right = np.cross(direction, np.eye(3)[np.abs(direction).argmin()])
        up = np.cross(direction, right)
    right = np.cross(up, direction)
    return Panel(
        right=_triple(right / np.linalg.norm(right)),
        up=_triple(up / np.linalg.norm(up)),
        shines_along=_triple(direction),
        half_width=0.5 * data.size * width_scale,
        half_height=0.5 * height * height_scale,
        is_round=data.shape in ("DISK", "ELLIPSE"),
        spread=data.spread,
    )


def _panel_size(panel: Panel) -> float:
    """Area [m^2]."""
    size = 4.0 * panel.half_width * panel.half_height
    return size * np.pi / 4.0 if panel.is_round else size


def _is_portal(data: bpy.types.AreaLight) -> bool:
    """Whether it is a portal, which only guides Cycles' sampling; Cycles may be disabled."""
    cycles = getattr(data, "cycles", None)
    return cycles is not None and cycles.is_portal


def _inverse(matrix: Matrix) -> tuple[Color, Color, Color]:
    """Rows that turn directions into an object's own axes, up to a common factor."""
    rows = np.array(matrix.to_3x3().inverted_safe())
    x, y, z = rows / np.abs(rows).max()
    return _triple(x), _triple(y), _triple(z)


def _emission(data: bpy.types.Light) -> Floats:
    """The factor from a light's nodes, if they are one plain Emission."""
    node = _node(data.node_tree, "EMISSION")
    if node is None:
        return np.ones(3)
    color, strength = node.inputs["Color"], node.inputs["Strength"]
    return np.array(color.default_value[:3]) * strength.default_value


def _node(tree: bpy.types.NodeTree | None, kind: str) -> bpy.types.Node | None:
    nodes = () if tree is None else tree.nodes
    return next((node for node in nodes if node.type == kind and not node.mute), None)


def _triple(values: Iterable[float]) -> Color:
    first, second, third, *_ = (float(value) for value in values)
    return (first, second, third)
