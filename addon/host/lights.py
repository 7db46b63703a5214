"""The scene's lights and world, as the renderer knows them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import bpy
import numpy as np
from mathutils import Vector

from ..arrays import Floats
from ..shading.lights import LIGHT_CAPACITY, Light, light_irradiance

type Color = tuple[float, float, float]

#: An area light shines into half of the space, most to the front: on its axis as brightly as a
#: point light of four times its power (Lambertian emitter, P / (pi d^2) against P / (4 pi d^2)).
_AREA_AS_POINT = 4.0


def read_lights(depsgraph: bpy.types.Depsgraph, center: Floats) -> tuple[Light, ...]:
    """The visible lights that shine most strongly on a place, strongest first, at most eight.

    Spot and area lights are taken for point lights: their cone and their size are not kept.

    Args:
        center: (3,) [m], world space.
    """
    lights = list(_lights(depsgraph))
    return tuple(sorted(lights, key=lambda light: -_strength(light, center))[:LIGHT_CAPACITY])


def read_ambient(scene: bpy.types.Scene) -> Color:
    """The world's plain colour [W/(m^2 sr)]; of an image or a sky the background's own colour."""
    world = scene.world
    if world is None:
        return (0.0, 0.0, 0.0)
    background = _background(world)
    if background is None:
        return _color(world.color)
    strength = background.inputs["Strength"].default_value
    return _color(channel * strength for channel in background.inputs["Color"].default_value)


def _lights(depsgraph: bpy.types.Depsgraph) -> Iterator[Light]:
    for instance in depsgraph.objects:
        if instance.type == "LIGHT" and instance.data.energy > 0.0:
            yield _light(instance)


def _light(instance: bpy.types.Object) -> Light:
    data, matrix = instance.data, instance.matrix_world
    power = data.energy * 2.0**data.exposure
    color = np.array(data.color)
    if data.use_temperature:
        color = color * np.array(data.temperature_color)
    if data.type == "SUN":
        return Light.sun(matrix.to_quaternion() @ Vector((0.0, 0.0, -1.0)), color, power)
    if data.type == "AREA":
        power *= _AREA_AS_POINT
    return Light.point(matrix.translation, color, power)


def _strength(light: Light, center: Floats) -> float:
    return float(light_irradiance(light, np.asarray(center, np.float64)).sum())


def _background(world: bpy.types.World) -> bpy.types.Node | None:
    if world.node_tree is None:
        return None
    nodes = world.node_tree.nodes
    return next((node for node in nodes if node.type == "BACKGROUND" and not node.mute), None)


def _color(channels: Sequence[float] | Iterator[float]) -> Color:
    red, green, blue, *_ = (float(channel) for channel in channels)
    return (red, green, blue)
