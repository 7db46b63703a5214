"""What the preview asks of the GPU, frame by frame."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import bpy
import gpu
import numpy as np
from _gpu_calls import gpu_calls
from _report import start, tell
from _suzanne import suzanne
from shaken import GRAVITY, shaken_poses

from hairloom.addon import pipeline
from hairloom.addon.blender.sessions.compute_solver import ComputeSolver
from hairloom.addon.dynamics.settings import DynamicsSettings
from hairloom.addon.groom.grow import grow, scalp_density
from hairloom.addon.groom.settings import GrowSettings, GuideSettings
from hairloom.addon.render.camera import frame_camera
from hairloom.addon.render.snapshot import Caster, Snapshot
from hairloom.addon.render.strand_pass import StrandPass
from hairloom.addon.render.textures import drawing_into
from hairloom.addon.shading.lights import three_point_lights

STRANDS, WIDTH, HEIGHT = 11_400, 960, 720


def main():
    start()
    head = suzanne()
    strands = grow(head, GrowSettings(strand_count=STRANDS), scalp_density(head))
    rig = pipeline.prepare(strands, head, GuideSettings(), place="bench")
    poses = shaken_poses(rig, 40, 60.0)
    radius = rig.strands.radius.reshape(STRANDS, -1)
    shape = rig.strands.grid.shape
    solver = ComputeSolver(rig)
    color = gpu.types.GPUTexture((WIDTH, HEIGHT), format="RGBA16F")
    depth = gpu.types.GPUTexture((WIDTH, HEIGHT), format="DEPTH_COMPONENT32F")
    target = gpu.types.GPUFrameBuffer(depth_slot=depth, color_slots=(color,))
    base = Snapshot(points=rig.strands.points.reshape(shape), radius=radius)
    solver.advance(poses[1], (), DynamicsSettings(), GRAVITY, 1 / 60)
    hair = solver.shown(base)

    def cam(a, d=0.5):
        return frame_camera(rig.strands.bounds(), (np.sin(a), -np.cos(a), 0.2), d, WIDTH / HEIGHT)

    p = StrandPass()

    def draw(s, c):
        with drawing_into(target):
            target.clear(color=(0, 0, 0, 0), depth=1.0)
            p.draw(
                replace(s, lights=three_point_lights(c.view)), c, WIDTH, HEIGHT, output="viewport"
            )

    def timed(f):
        b = time.perf_counter()
        c = gpu_calls(f)
        color.read()
        return round((time.perf_counter() - b) * 1000), dict(c)

    i = [1]

    def play():
        i[0] += 1
        solver.advance(poses[i[0]], (), DynamicsSettings(), GRAVITY, 1 / 60)
        draw(solver.shown(base), cam(0.5))

    ang = [0.5]

    def orbit():
        ang[0] += 0.03
        draw(hair, cam(ang[0]))

    t = [0]

    def two():
        t[0] += 1
        draw(hair, cam(0.5))
        draw(hair, cam(2.0))

    lights = three_point_lights(cam(0.5).view)

    def orbit_scene():
        ang[0] += 0.03
        c = cam(ang[0])
        with drawing_into(target):
            target.clear(color=(0, 0, 0, 0), depth=1.0)
            p.draw(replace(hair, lights=lights), c, WIDTH, HEIGHT, output="viewport")

    for name, f in dict(
        first=lambda: draw(hair, cam(0.5)),
        still=lambda: draw(hair, cam(0.5)),
        play=play,
        orbit=orbit,
        two=two,
        orbit_scene=orbit_scene,
    ).items():
        for _ in range(4):
            print(name, timed(f))
    print(
        p.statistics,
        [(c.capacity, c.count) for c in p._detail._order.classes][:30],
        len(p._detail._order.classes),
    )


main()
