"""Force fields as Blender's particles feel them: mass 1, no gravity, one frame by Euler's rule."""

from __future__ import annotations

import bpy
import numpy as np

from hairloom.addon.blender.scene.forces import force_fields_of
from hairloom.addon.dynamics.force_fields import field_effect

VELOCITY = np.array([0.7, -0.4, 0.9])
PLACE, TURN = (0.3, -0.2, 0.1), (0.5, 0.3, -0.4)
#: Each kind, and each shape and falloff of those that have one.
CASES = {
    "force": ("FORCE", {"strength": 3.0}),
    "force, square": ("FORCE", {"strength": 2.0, "use_gravity_falloff": True, "flow": 0.7}),
    "force, power": (
        "FORCE",
        {
            "falloff_power": 1.7,
            "use_min_distance": True,
            "distance_min": 0.4,
            "use_max_distance": True,
            "distance_max": 1.4,
        },
    ),
    "force, above": ("FORCE", {"z_direction": "POSITIVE", "falloff_power": 2.0}),
    "force, below": ("FORCE", {"z_direction": "NEGATIVE", "shape": "PLANE"}),
    "force, line": ("FORCE", {"shape": "LINE", "falloff_power": 1.0}),
    "force, points": ("FORCE", {"shape": "POINTS", "falloff_power": 2.0}),
    "wind": ("WIND", {"strength": 12.0}),
    "wind, tube": (
        "WIND",
        {
            "strength": 5.0,
            "falloff_type": "TUBE",
            "falloff_power": 0.5,
            "radial_falloff": 1.5,
            "use_radial_min": True,
            "radial_min": 0.3,
            "use_radial_max": True,
            "radial_max": 1.0,
        },
    ),
    "wind, cone": (
        "WIND",
        {
            "strength": 5.0,
            "shape": "POINT",
            "falloff_type": "CONE",
            "radial_falloff": 0.4,
            "use_radial_min": True,
            "radial_min": 20.0,
            "use_radial_max": True,
            "radial_max": 110.0,
        },
    ),
    "wind, backwards": ("WIND", {"strength": -4.0, "shape": "POINTS", "flow": 0.0}),
    "vortex": ("VORTEX", {"strength": 2.0, "falloff_power": 1.0}),
    "vortex, point": ("VORTEX", {"strength": 2.0, "shape": "POINT", "flow": 0.5}),
    "magnet": ("MAGNET", {"strength": 2.5, "falloff_power": 0.5}),
    "magnet, plane": ("MAGNET", {"strength": 2.5, "shape": "PLANE"}),
    "harmonic": ("HARMONIC", {"strength": 4.0, "harmonic_damping": 0.3}),
    "harmonic, rest": ("HARMONIC", {"strength": 4.0, "rest_length": 0.5, "shape": "LINE"}),
    "turbulence": ("TURBULENCE", {"strength": 6.0, "size": 0.4}),
    "turbulence, global": (
        "TURBULENCE",
        {"strength": 6.0, "size": 0.0, "use_global_coords": True, "flow": 1.0},
    ),
    "drag": ("DRAG", {"linear_drag": 0.8, "quadratic_drag": 0.6, "falloff_power": 1.0}),
}


def field_error(points: np.ndarray) -> dict[str, float]:
    """The largest error of acceleration in each case, over the largest acceleration."""
    return {name: error_of(kind, values, points) for name, (kind, values) in CASES.items()}


def error_of(kind: str, values: dict[str, object], points: np.ndarray) -> float:
    """The error of one case, see `field_error`.

    Args:
        points: (n, 3) world [m].
    """
    source = field_object(kind, values)
    particles = particles_at(points)
    try:
        theirs = acceleration_of(particles)
        owner = bpy.data.objects.new("Nobody", None)
        fields, notes = force_fields_of(owner, bpy.context.evaluated_depsgraph_get())
        assert not notes, notes
        rows = np.ascontiguousarray(points.T, np.float32)
        velocity = np.repeat(VELOCITY.astype(np.float32)[:, None], rows.shape[1], axis=1)
        ours = field_effect(fields, rows, velocity).acceleration(velocity).T
    finally:
        for obj in (source, particles):
            bpy.data.objects.remove(obj)
    largest = float(np.linalg.norm(theirs, axis=1).max())
    assert largest > 0.01, f"{kind} {values} does nothing"
    return float(np.linalg.norm(ours - theirs, axis=1).max()) / largest


def field_object(kind: str, values: dict[str, object]) -> bpy.types.Object:
    bpy.ops.object.effector_add(type=kind, location=PLACE, rotation=TURN)
    source = bpy.context.object
    if values.get("shape") == "POINTS":
        bpy.data.objects.remove(source)
        bpy.ops.mesh.primitive_cone_add(vertices=5, radius1=0.3, location=PLACE, rotation=TURN)
        source = bpy.context.object
        bpy.ops.object.forcefield_toggle()
        source.field.type = kind
    for name, value in values.items():
        setattr(source.field, name, value)
    return source


def particles_at(points: np.ndarray) -> bpy.types.Object:
    """A mesh of these points, each of which emits a particle in the first frame."""
    mesh = bpy.data.meshes.new("Points")
    mesh.from_pydata(points.tolist(), [], [])
    obj = bpy.data.objects.new("Points", mesh)
    bpy.context.scene.collection.objects.link(obj)
    bpy.context.view_layer.objects.active = obj
    obj.modifiers.new("Particles", "PARTICLE_SYSTEM")
    settings = obj.particle_systems[0].settings
    settings.count = len(points)
    settings.frame_start = settings.frame_end = 1.0
    settings.lifetime = 100.0
    settings.emit_from, settings.use_emit_random = "VERT", False
    settings.physics_type, settings.integrator, settings.mass = "NEWTON", "EULER", 1.0
    settings.normal_factor = 0.0
    settings.object_align_factor = VELOCITY
    settings.effector_weights.gravity = 0.0
    return obj


def acceleration_of(obj: bpy.types.Object) -> np.ndarray:
    """The acceleration of each particle in the first frame, (n, 3) [m/s^2]."""
    scene, velocity = bpy.context.scene, []
    for frame in (1, 2):
        scene.frame_set(frame)
        evaluated = obj.evaluated_get(bpy.context.evaluated_depsgraph_get())
        system = evaluated.particle_systems[0]
        assert len(system.particles) == len(obj.data.vertices)
        velocity.append(np.array([one.velocity for one in system.particles]))
    return (velocity[1] - velocity[0]) / system.settings.timestep
