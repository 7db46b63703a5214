"""The cost of a whole frame with shadows, beside EEVEE's fastest, and of deep layers beside slices.

4,095 strands of 30 points on a ball, under one sun that throws shadows, at 800 x 600. The hair
moves in every frame, so that every frame uploads its points and draws its maps again. All take
turns, so that load on the machine affects them alike.
"""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable
from typing import Any

import bpy
import gpu
import numpy as np
from hair_ball import ball_mesh, combed_strands
from mathutils import Vector

from hairloom.addon.render.camera import Camera, look_at, perspective
from hairloom.addon.render.mesh_pass import MeshPass
from hairloom.addon.render.snapshot import MeshSnapshot, Snapshot
from hairloom.addon.render.strand_pass import StrandPass
from hairloom.addon.render.textures import drawing_into
from hairloom.addon.shading.lights import Light
from hairloom.addon.shading.settings import ShadingSettings
from hairloom.addon.shading.volume.settings import VolumeSettings
from hairloom.addon.strands import Surface

STRANDS, POINTS, RADIUS = 4_095, 30, 0.001
WIDTH, HEIGHT, FIELD_OF_VIEW = 800, 600, np.radians(30.0)
EYE, SUN, STRENGTH = (0.0, 0.0, 5.0), (-0.45, -0.5, -0.8), 3.0
#: rounds of ours and of EEVEE
ROUNDS, EEVEE_ROUNDS = 24, 4
VOLUMES = {
    "none": VolumeSettings(shadows="none"),
    "slices": VolumeSettings(shadows="slices", slices=16),
    "deep": VolumeSettings(shadows="deep", layers=4),
    "deep16": VolumeSettings(shadows="deep", layers=16),
}


def cost_figures() -> dict[str, float]:
    """The figures by name.

    frame_ratio_eevee: EEVEE's time of a frame over ours with 16 slices; frame_ratio_eevee_cpu: the
    same of processor time, which other load hardly changes.
    deep_ratio_slices: our frame with four deep layers, whose errors are below those of 16 slices,
        over that with slices; deep_ratio_slices_map: of the maps alone; deep16_ratio_slices: with
        16 deep layers, the default.
    eevee_ms, frame_ms_<shadows>, map_ms_<shadows>: medians. Strands are drawn with default
        settings, that is with transparency.
    """
    strands = moved()
    frames = {name: OurFrame(volume) for name, volume in VOLUMES.items()}
    eevee = EeveeFrame(strands)
    ours: dict[str, list[float]] = {name: [] for name in frames}
    maps: dict[str, list[float]] = {name: [] for name in frames if name != "none"}
    eevee_times: list[float] = []
    processor_seconds: dict[str, list[float]] = {"ours": [], "theirs": []}
    for turn in range(ROUNDS):
        points = moved(turn)
        for name, frame in frames.items():
            begin = time.process_time()
            ours[name].append(milliseconds(lambda f=frame, p=points: f.draw(p)))
            if name == "slices":
                processor_seconds["ours"].append(time.process_time() - begin)
        for name in maps:
            points = moved(turn + 0.5)
            maps[name].append(milliseconds(lambda f=frames[name], p=points: f.draw_maps(p)))
        if turn % (ROUNDS // EEVEE_ROUNDS) == 0:
            begin = time.process_time()
            eevee_times.append(milliseconds(lambda p=points: eevee.draw(p)))
            processor_seconds["theirs"].append(time.process_time() - begin)
    eevee.remove()
    frame_ms = {name: statistics.median(times[2:]) for name, times in ours.items()}
    map_ms = {name: statistics.median(times[2:]) for name, times in maps.items()}
    eevee_ms = statistics.median(eevee_times[1:])
    return {
        "frame_ratio_eevee": eevee_ms / frame_ms["slices"],
        "frame_ratio_eevee_cpu": (
            statistics.median(processor_seconds["theirs"][1:])
            / statistics.median(processor_seconds["ours"][2:])
        ),
        "deep_ratio_slices": frame_ms["deep"] / frame_ms["slices"],
        "deep_ratio_slices_map": map_ms["deep"] / map_ms["slices"],
        "deep16_ratio_slices": frame_ms["deep16"] / frame_ms["slices"],
        "eevee_ms": eevee_ms,
        **{f"frame_ms_{name}": found for name, found in frame_ms.items()},
        **{f"map_ms_{name}": found for name, found in map_ms.items()},
    }


def moved(turn: float = 0.0) -> np.ndarray:
    """The swaying hair at a phase [rad], (strand_count, cv_count, 3) float32."""
    strands = _AT_REST.copy()
    strands[..., 0] += 0.05 * np.sin(turn) * np.linspace(0.0, 1.0, POINTS, dtype=np.float32) ** 2
    return strands


def milliseconds(work: Callable[[], None]) -> float:
    begin = time.perf_counter()
    work()
    return (time.perf_counter() - begin) * 1000.0


def _combed() -> np.ndarray:
    """Exactly STRANDS strands, without those that would cross the lower pole."""
    return combed_strands(2 * STRANDS, POINTS)[:STRANDS]


_AT_REST = _combed()
_BODY = Surface(*ball_mesh(rings=24))


class OurFrame:
    """The viewport's draw of a frame, or of its maps alone, until the GPU is done."""

    def __init__(self, volume: VolumeSettings) -> None:
        self._volume, self._meshes = volume, (MeshSnapshot.of(_BODY),)
        self._radius = np.full(_AT_REST.shape[:2], RADIUS, np.float32)
        self._camera = Camera(
            look_at(EYE, (0.0, 0.0, 0.0), up=(0.0, 1.0, 0.0)),
            perspective(FIELD_OF_VIEW, WIDTH / HEIGHT, 0.1, 20.0),
        )
        self._mesh_pass, self._strand_pass = MeshPass(), StrandPass()
        color = gpu.types.GPUTexture((WIDTH, HEIGHT), format="RGBA16F")
        depth = gpu.types.GPUTexture((WIDTH, HEIGHT), format="DEPTH_COMPONENT32F")
        self._kept = color, depth
        self._target = gpu.types.GPUFrameBuffer(depth_slot=depth, color_slots=(color,))

    def draw(self, points: np.ndarray) -> None:
        snapshot = self._snapshot(points)
        opacity = self._strand_pass.opacity(snapshot)
        with drawing_into(self._target):
            self._target.clear(color=(0.0, 0.0, 0.0, 0.0), depth=1.0)
            self._mesh_pass.draw(snapshot, self._camera, WIDTH, HEIGHT, opacity=opacity)
            self._strand_pass.draw(snapshot, self._camera, WIDTH, HEIGHT)
            self._finish()

    def draw_maps(self, points: np.ndarray) -> None:
        self._strand_pass.opacity(self._snapshot(points))
        with drawing_into(self._target):
            self._finish()

    def _snapshot(self, points: np.ndarray) -> Snapshot:
        return Snapshot(
            points,
            self._radius,
            meshes=self._meshes,
            lights=(Light.sun(SUN, (1.0, 1.0, 1.0), STRENGTH),),
            shading=ShadingSettings(model="marschner"),
            volume=self._volume,
            volume_center=np.zeros(3, np.float32),
        )

    def _finish(self) -> None:
        """Wait until all is drawn, by reading back a pixel."""
        self._target.read_color(0, 0, 1, 1, 4, 0, "FLOAT")


class EeveeFrame:
    """The same in EEVEE at its fastest: one sample, curves of straight pieces, hair as lines."""

    def __init__(self, points: np.ndarray) -> None:
        self._scene = scene = bpy.data.scenes.new("EEVEE")
        scene.render.engine = "BLENDER_EEVEE"
        scene.eevee.taa_render_samples = 1
        scene.render.hair_type = "STRAND"
        scene.render.resolution_x, scene.render.resolution_y = WIDTH, HEIGHT
        scene.world = bpy.data.worlds.new("Dim")
        scene.camera = self._new("Camera", bpy.data.cameras.new("Camera"))
        scene.camera.data.angle = 2.0 * np.arctan(np.tan(0.5 * FIELD_OF_VIEW) * WIDTH / HEIGHT)
        scene.camera.location = EYE
        sun = self._new("Sun", bpy.data.lights.new("Sun", "SUN"))
        sun.data.energy = STRENGTH
        sun.rotation_euler = Vector(SUN).to_track_quat("-Z", "Y").to_euler()
        body = bpy.data.meshes.new("Body")
        body.from_pydata(_BODY.positions.tolist(), [], _BODY.triangles.tolist())
        self._new("Body", body)
        self._strands = curves = bpy.data.hair_curves.new("Strands")
        curves.add_curves([points.shape[1]] * points.shape[0])
        curves.set_types(type="POLY")
        width = curves.attributes.get("radius") or curves.attributes.new("radius", "FLOAT", "POINT")
        width.data.foreach_set("value", np.full(points[..., 0].size, RADIUS, np.float32))
        hair = bpy.data.materials.new("Hair")
        node = hair.node_tree.nodes.new("ShaderNodeBsdfHairPrincipled")
        surface = hair.node_tree.nodes["Material Output"].inputs["Surface"]
        hair.node_tree.links.new(node.outputs[0], surface)
        curves.materials.append(hair)
        self._new("Strands", curves)

    def draw(self, points: np.ndarray) -> None:
        positions = self._strands.attributes["position"].data
        positions.foreach_set("vector", np.ascontiguousarray(points, np.float32).ravel())
        self._strands.update_tag()
        bpy.ops.render.render(scene=self._scene.name)

    def remove(self) -> None:
        bpy.data.scenes.remove(self._scene)

    def _new(self, name: str, data: Any) -> Any:
        thing = bpy.data.objects.new(name, data)
        self._scene.collection.objects.link(thing)
        return thing
