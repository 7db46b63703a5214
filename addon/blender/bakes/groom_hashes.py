"""The hashes of the inputs that a groom's bake depends on.

A rig hash is the same in every frame of the scene: it is taken from the original data, in object
space and before modifiers. Changes by modifiers and animation show in the frame hashes.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

import bpy
import numpy as np

from ...arrays import Floats, Ints
from ...dynamics.settings import DynamicsSettings
from ...groom.children_settings import ChildrenSettings
from ...groom.masks import SELECTION, mask_names
from ...groom.settings import GuideSettings
from ...groom.width_settings import WidthSettings
from ...rig_flow import Pose
from ...wet_flow import wet_dynamics
from ..base.attributes import read_attribute
from ..base.mesh_arrays import corner_vertices, vertex_positions
from ..base.objects import head_of, matrix_of
from ..base.vertex_weights import painted_attribute, weight_names, weights_on
from ..colliders.carriers import is_deforming, is_disabled
from ..colliders.collider_reader import shape_of
from ..colliders.scene_colliders import collider_objects
from ..colliders.ties import holders_of
from ..properties.groom_settings import GroomSettings
from ..properties.properties import settings_of
from ..scene.curves import (
    GROUP_ATTRIBUTES,
    SHAPE_ATTRIBUTES,
    VALUE_ATTRIBUTES,
    curve_offsets,
    curve_points,
    read_curves,
)
from ..scene.forces import force_fields_of, gravity_of
from ..scene.masks import image_values
from ..scene.partings import parting_state, partings_of
from ..scene.surfaces import read_positions
from .simulation import SOLVER_VERSION, Hashed, hashes

#: The parts of a rig hash that determine the rig; the others only matter to a bake.
RIG_PARTS = ("hair", "head", "guides", "widths", "children", "partings", "ties", "style", "paint")


def groom_rig_hash(
    hair: bpy.types.Object,
    head: bpy.types.Object | None,
    settings: GroomSettings,
    scene: bpy.types.Scene,
) -> str:
    """Named hashes, see `simulation.hashes`; messages report changes by these names."""
    grown: dict[str, tuple[Hashed, ...]] = {}
    if settings[ChildrenSettings].method != "none":
        grown["children"] = (
            _children(hair, settings),
            *_paint(hair, head, settings.children_density),
            *_paint(hair, head, *mask_names(settings[ChildrenSettings]).values()),
        )
    lines = _parting_shapes(hair)
    if lines:
        grown["partings"] = lines
    held = _tie_shapes(hair)
    if held:
        grown["ties"] = held
    dynamics = settings[DynamicsSettings]
    if dynamics.animated_style:
        grown["style"] = ("animated",)
    others = _other_grooms(hair, scene) if dynamics.volume > 0.0 else []
    if others:
        grown["other_grooms"] = tuple(sorted(map(_shape_of_groom, others)))
    painted = [name for name in mask_names(dynamics).values() if name != SELECTION]
    if painted:
        grown["paint"] = _paint(hair, head, *painted)
    return hashes(
        hair=_curves_parts(hair),
        head=() if head is None else mesh_parts(head),
        guides=settings[GuideSettings],
        widths=settings[WidthSettings],
        **grown,
        colliders=collider_shapes(hair, head),
        frame_rate=frame_rate(scene),
        solver=str(SOLVER_VERSION),
    )


def groom_frame_hash(
    hair: bpy.types.Object,
    head: bpy.types.Object | None,
    pose: Pose,
    depsgraph: bpy.types.Depsgraph,
) -> str:
    """Named hashes of the inputs that drive a groom in the scene's frame.

    Args:
        head: the one that carries it. pose: see `poses.read_pose`.
    """
    ties = _places(holders_of(hair), depsgraph)
    style = _style(hair, depsgraph)
    settings = _dynamics(hair)
    others = _other_grooms(hair, depsgraph.scene) if settings.volume > 0.0 else []
    places = sorted(_place_of_groom(other, head, depsgraph) for other in others)
    selection = _paint(hair, None, SELECTION) if settings.only_selected else ()
    return hashes(
        pose=pose.matrix if pose.head_positions is None else pose.head_positions,
        settings=settings,
        colliders=collider_places(hair, head, depsgraph),
        **({"ties": ties} if ties else {}),
        **({"style": style} if style else {}),
        **({"selection": selection} if selection else {}),
        **({"other_grooms": tuple(places)} if places else {}),
        forces=(gravity_of(depsgraph.scene), force_fields_of(hair, depsgraph)[0].table),
    )


def _other_grooms(hair: bpy.types.Object, scene: bpy.types.Scene) -> list[bpy.types.Object]:
    """The grooms that this one may feel, wherever they are."""
    grooms = (each for each in scene.objects if each.type == "CURVES" and each != hair)
    return [each for each in grooms if not (each.data.hairloom.baked_in or each.hide_render)]


def _shape_of_groom(other: bpy.types.Object) -> str:
    """The hash of another groom's curves and of the settings that make its guides and children."""
    settings = GroomSettings.of(other)
    made = settings[GuideSettings], _children(other, settings), *_curves_parts(other)
    return hashes(groom=made)


def _place_of_groom(
    other: bpy.types.Object, known: bpy.types.Object | None, depsgraph: bpy.types.Depsgraph
) -> str:
    """The hash of what drives another groom in the scene's frame, without colliders and forces.

    Args:
        known: a head that is hashed already.
    """
    head = head_of(other)
    body = () if head is None or head == known else _places([head], depsgraph)
    style = _style(other, depsgraph)
    return hashes(groom=(_dynamics(other), matrix_of(other, depsgraph), *body, *style))


def _children(hair: bpy.types.Object, settings: GroomSettings) -> ChildrenSettings:
    """The settings that children are grown with; without wetness where hair data is animated, since
    keys of wetness grow no other children."""
    if hair.data.animation_data is None:
        return settings[ChildrenSettings]
    return settings_of(hair.data.hairloom.children, ChildrenSettings)


def _style(hair: bpy.types.Object, depsgraph: bpy.types.Depsgraph) -> tuple[Floats | Ints, ...]:
    """The frame's curves where the style is animated, else nothing."""
    if not _dynamics(hair).animated_style:
        return ()
    strands = read_curves(hair, depsgraph).strands
    return strands.points, strands.offsets


def settings_hash(hair: bpy.types.Object) -> str:
    """The part of a frame hash that comes from the settings."""
    return hashes(settings=_dynamics(hair))


def _dynamics(hair: bpy.types.Object) -> DynamicsSettings:
    """The dynamics settings alone, which each frame needs. The device is left out, since the motion
    is the same on all of them."""
    settings = settings_of(hair.hairloom.dynamics, DynamicsSettings)
    return replace(wet_dynamics(settings, hair.data.hairloom.shading.wetness), device="automatic")


def collider_places(
    owner: bpy.types.Object, head: bpy.types.Object | None, depsgraph: bpy.types.Depsgraph
) -> tuple[Floats | str, ...]:
    """Where the colliders of a groom or fin are now, and which of them collide; without the head,
    which is in the pose."""
    return _places([obj for obj in collider_objects(owner, head) if obj != head], depsgraph)


def _places(
    objects: Iterable[bpy.types.Object], depsgraph: bpy.types.Depsgraph
) -> tuple[Floats | str, ...]:
    """Where objects are now, in which shape, and which are left out."""
    places: list[Floats | str] = []
    for obj in objects:
        places += [f"{is_disabled(obj, depsgraph)}", matrix_of(obj, depsgraph)]
        if obj.type == "MESH" and (len(obj.modifiers) or is_deforming(obj)):
            places.append(read_positions(obj, depsgraph, place=obj.name))
    return tuple(places)


def collider_shapes(
    owner: bpy.types.Object, head: bpy.types.Object | None
) -> tuple[Floats | Ints | str, ...]:
    """The shapes of the colliders of a groom or fin, wherever they are."""
    parts: list[Floats | Ints | str] = []
    for obj in collider_objects(owner, head):
        shape = shape_of(obj)
        parts.append(f"{shape} {obj.empty_display_size if obj.type == 'EMPTY' else ''}")
        if obj.type == "MESH" and shape != "none":
            parts += mesh_parts(obj)
    return tuple(parts)


def _tie_shapes(hair: bpy.types.Object) -> tuple[Floats | Ints | str, ...]:
    """The hair ties and the tip surface of hair, and where the artist has put them."""
    parts: list[Floats | Ints | str] = []
    for obj in holders_of(hair):
        parts.append(f"{obj.name} {obj.type} {obj == hair.hairloom.tip_surface}")
        if obj.type == "EMPTY":
            parts.append(f"{obj.empty_display_type} {obj.empty_display_size}")
        elif obj.type == "MESH":
            parts += mesh_parts(obj)
        if obj == hair.hairloom.tip_surface and hair.hairloom.tip_group:
            parts += _paint(hair, obj, hair.hairloom.tip_group)
        if obj.animation_data is None and not len(obj.constraints):
            parts += [np.array(obj.matrix_parent_inverse), np.array(obj.matrix_basis)]
    return tuple(parts)


def _parting_shapes(hair: bpy.types.Object) -> tuple[Floats | str, ...]:
    """As `parting_state`, but by names, which stay the same when the file is loaded again."""
    names = {f"{obj.session_uid} {obj.type}": obj.name for obj in partings_of(hair)}
    return tuple(
        names[part] if isinstance(part, str) else part.astype(np.float64)
        for part in parting_state(hair)
    )


def frame_rate(scene: bpy.types.Scene) -> float:
    """[1/s]"""
    return float(scene.render.fps) / float(scene.render.fps_base)


def _paint(
    hair: bpy.types.Object, head: bpy.types.Object | None, *names: str
) -> tuple[Floats | str, ...]:
    """The values of masks, see `masks.MaskReader`; only the name of one that modifiers make."""

    def values(name: str) -> Floats | str:
        if head is not None and head.type == "MESH" and name in weight_names(head):
            return weights_on(head, head.data, name)[0]
        of_curves = painted_attribute(hair.data, name)
        if of_curves is not None:
            return of_curves[0]
        image = bpy.data.images.get(name)
        return name if image is None else image_values(image)

    return tuple(map(values, names))


def _curves_parts(hair: bpy.types.Object) -> tuple[Floats | Ints | str, ...]:
    curves = hair.data
    modifiers = [(each.type, each.name) for each in hair.modifiers if each.show_viewport]
    parts: list[Floats | Ints | str] = [curve_points(curves), curve_offsets(curves)]
    parts.append(repr(modifiers))
    for name in GROUP_ATTRIBUTES:
        attribute = curves.attributes.get(name)
        if attribute is not None and attribute.data_type == "INT":
            group = np.empty(len(attribute.data), np.int32)
            attribute.data.foreach_get("value", group)
            parts.append(group)
    for name, size in VALUE_ATTRIBUTES:
        for domain in ("POINT", "CURVE"):
            values = read_attribute(curves, name, domain, size)
            if values is not None:
                parts.append(values)
    for name, domain, size in SHAPE_ATTRIBUTES:
        values = read_attribute(curves, name, domain, size)
        if values is not None:
            parts.append(values)
    return tuple(parts)


def mesh_parts(obj: bpy.types.Object) -> tuple[Floats | Ints, ...]:
    """Vertices (vertex_count, 3) in object space, and the vertex of each polygon corner."""
    return vertex_positions(obj.data), corner_vertices(obj.data)
