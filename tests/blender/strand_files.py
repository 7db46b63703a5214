"""Strands for tests of exports; readers of their files: Alembic's low-level API, usd-core."""

from __future__ import annotations

import importlib.util
from pathlib import Path
from typing import Any

import bpy
import numpy as np
import pytest

from hairloom.addon.strands import StrandSet

pytest.importorskip("alembic3d", reason="it is missing: `make setup` installs it")
from alembic3d import Abc, AbcGeom


def straight_strands(place: tuple[float, float, float] = (1.0, 2.0, 3.0)) -> StrandSet:
    """Two straight vertical strands, 1 m long; the root of the first is at `place`."""
    points = np.array(place) + np.linspace([0, 0, 0], [0, 0, 1], 5)
    both = np.concatenate([points, points + (0.1, 0.0, 0.0)])
    return StrandSet(both, [0, 5, 10], np.full(10, 4e-5), [0, 0])


def read_alembic_curves(path: Path) -> dict[str, dict[str, Any]]:
    """The Curves objects of an Alembic file by name: points of all samples, times, attributes."""
    archive = Abc.IArchive(str(path))
    (above,) = list(archive.getTop().children)
    found = {}
    for each in above.children:
        schema = AbcGeom.ICurves(above, each.getName()).getSchema()
        sampling = schema.getTimeSampling()
        times = [sampling.getSampleTime(i) for i in range(schema.getNumSamples())]
        samples = [schema.getValue(Abc.ISampleSelector(time)) for time in times]
        geometry = Abc.ICompoundProperty(each.getProperties(), ".geom")
        extra = Abc.ICompoundProperty(geometry, ".arbGeomParams")
        values = {
            name: np.array(Abc.IArrayProperty(extra, name).getValue())
            for name in (
                extra.getPropertyHeader(i).getName() for i in range(extra.getNumProperties())
            )
            if name != "groom_group_name"
        }
        found[each.getName()] = {
            "points": [np.array(sample.getPositions()) for sample in samples],
            "times": times,
            "counts": np.array(samples[0].getCurvesNumVertices()),
            **values,
        }
    return found


#: skips tests that read or write USD where usd-core is missing
needs_usd = pytest.mark.skipif(
    importlib.util.find_spec("pxr") is None, reason="this Python has no OpenUSD"
)


def read_usd_curves(path: Path) -> tuple[Any, Any]:
    """The stage, and its only BasisCurves prim."""
    usd = pytest.importorskip("pxr.Usd", reason="usd-core is missing: `make setup` installs it")
    from pxr import UsdGeom

    stage = usd.Stage.Open(str(path))
    (prim,) = (prim for prim in stage.Traverse() if prim.IsA(UsdGeom.BasisCurves))
    return stage, UsdGeom.BasisCurves(prim)


def to_unreal(points: np.ndarray) -> np.ndarray:
    """Points in Unreal's coordinates by Epic: centimetres, with y negated."""
    return np.asarray(points) * [100.0, -100.0, 100.0]


def push_up(hair: Any, amount: float, *, frame_driven: bool = False) -> Any:
    """Add a geometry nodes modifier that moves all points up, by metres or metres per frame."""
    tree = bpy.data.node_groups.new("Push", "GeometryNodeTree")
    tree.interface.new_socket("Geometry", in_out="INPUT", socket_type="NodeSocketGeometry")
    tree.interface.new_socket("Geometry", in_out="OUTPUT", socket_type="NodeSocketGeometry")
    begin, end = tree.nodes.new("NodeGroupInput"), tree.nodes.new("NodeGroupOutput")
    move = tree.nodes.new("GeometryNodeSetPosition")
    scale = tree.nodes.new("ShaderNodeVectorMath")
    scale.operation = "SCALE"
    scale.inputs[0].default_value = (0.0, 0.0, 1.0)
    scale.inputs["Scale"].default_value = amount
    if frame_driven:
        clock = tree.nodes.new("GeometryNodeInputSceneTime")
        times = tree.nodes.new("ShaderNodeMath")
        times.operation = "MULTIPLY"
        times.inputs[1].default_value = amount
        tree.links.new(clock.outputs["Frame"], times.inputs[0])
        tree.links.new(times.outputs[0], scale.inputs["Scale"])
    tree.links.new(scale.outputs[0], move.inputs["Offset"])
    tree.links.new(begin.outputs[0], move.inputs["Geometry"])
    tree.links.new(move.outputs[0], end.inputs[0])
    modifier = hair.modifiers.new("Push", "NODES")
    modifier.node_group = tree
    return modifier
