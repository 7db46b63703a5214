"""Hair curves that geometry nodes move."""

from __future__ import annotations

from typing import Any

import bpy
import numpy as np

#: how far tips move sideways, and up, in a frame [m]
SIDE, LONGER = 0.004, 0.002


def move_by_nodes(hair: Any) -> Any:
    """Add a modifier that moves tips to +X and up, farther in each frame; at frame 1 curves are
    unchanged."""
    group = bpy.data.node_groups.new("Moving", "GeometryNodeTree")
    for name, in_out in (("Geometry", "INPUT"), ("Geometry", "OUTPUT")):
        group.interface.new_socket(name, in_out=in_out, socket_type="NodeSocketGeometry")
    new, link = group.nodes.new, group.links.new
    ends = new("NodeGroupInput"), new("NodeGroupOutput")
    place, time, along = (
        new("GeometryNodeSetPosition"),
        new("GeometryNodeInputSceneTime"),
        new("GeometryNodeSplineParameter"),
    )
    since, by_along, square = (new("ShaderNodeMath") for _ in range(3))
    since.operation, by_along.operation, square.operation = "SUBTRACT", "MULTIPLY", "MULTIPLY"
    since.inputs[1].default_value = 1.0
    link(time.outputs["Frame"], since.inputs[0])
    link(along.outputs["Factor"], square.inputs[0])
    link(along.outputs["Factor"], square.inputs[1])
    link(since.outputs[0], by_along.inputs[0])
    link(square.outputs[0], by_along.inputs[1])
    offset = new("ShaderNodeVectorMath")
    offset.operation = "SCALE"
    offset.inputs[0].default_value = (SIDE, 0.0, LONGER)
    link(by_along.outputs[0], offset.inputs["Scale"])
    link(offset.outputs[0], place.inputs["Offset"])
    link(ends[0].outputs[0], place.inputs["Geometry"])
    link(place.outputs["Geometry"], ends[1].inputs[0])
    modifier = hair.modifiers.new("Moving", "NODES")
    modifier.node_group = group
    return modifier


def apart(points: Any, offsets: Any, curves: Any) -> float:
    """The largest distance of a strand's points from its curve, or of a curve's from its strand
    [m]."""
    farthest = 0.0
    for number in range(len(offsets) - 1):
        strand = points[offsets[number] : offsets[number + 1]].astype(np.float64)
        own = curves.offsets[number : number + 2]
        curve = curves.points[own[0] : own[1]].astype(np.float64)
        farthest = max(farthest, _away(strand, curve), _away(curve, strand))
    return farthest


def _away(points: Any, line: Any) -> float:
    """The distance of the point that is farthest from a polyline."""
    begin, direction = line[:-1], np.diff(line, axis=0)
    beside = points[:, None] - begin
    part = (beside * direction).sum(axis=2) / np.maximum((direction * direction).sum(axis=1), 1e-30)
    nearest = np.linalg.norm(beside - np.clip(part, 0.0, 1.0)[..., None] * direction, axis=2)
    return float(nearest.min(axis=1).max())


def lose_curves(hair: Any, frame: int) -> None:
    """Add a modifier that deletes three curves from this frame on."""
    group = bpy.data.node_groups.new("Losing", "GeometryNodeTree")
    for name, in_out in (("Geometry", "INPUT"), ("Geometry", "OUTPUT")):
        group.interface.new_socket(name, in_out=in_out, socket_type="NodeSocketGeometry")
    new, link = group.nodes.new, group.links.new
    ends = new("NodeGroupInput"), new("NodeGroupOutput")
    gone, time, index = (
        new("GeometryNodeDeleteGeometry"),
        new("GeometryNodeInputSceneTime"),
        new("GeometryNodeInputIndex"),
    )
    gone.domain = "CURVE"
    is_due, is_first, both = new("ShaderNodeMath"), new("ShaderNodeMath"), new("ShaderNodeMath")
    is_due.operation, is_first.operation, both.operation = "GREATER_THAN", "LESS_THAN", "MULTIPLY"
    is_due.inputs[1].default_value, is_first.inputs[1].default_value = frame - 0.5, 2.5
    link(time.outputs["Frame"], is_due.inputs[0])
    link(index.outputs[0], is_first.inputs[0])
    link(is_due.outputs[0], both.inputs[0])
    link(is_first.outputs[0], both.inputs[1])
    link(both.outputs[0], gone.inputs["Selection"])
    link(ends[0].outputs[0], gone.inputs["Geometry"])
    link(gone.outputs[0], ends[1].inputs[0])
    hair.modifiers.new("Losing", "NODES").node_group = group
