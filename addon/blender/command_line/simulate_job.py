"""The verb `simulate`: bakes hair of files or of the scene, moved by a shake or by the scene.

For a shake, the hair goes into a separate scene, which is baked as the button Bake does.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import bpy
import numpy as np

from ...arrays import Floats
from ...dynamics.settings import DynamicsSettings
from ...errors import HairloomError
from ...groom.children_settings import ChildrenSettings
from ...groom.masks import Mask, StrandMask, SurfaceMask, mask_names
from ...strands import StrandSet, Surface
from ...strands.affine import rotation_about
from ..bakes.guide_motion import BakedGuides
from ..base.attributes import set_attribute
from ..colliders.copies import StaticCopies, copy_colliders, copy_holders
from ..preview.bake import Bake
from ..scene.curves import write_curves
from ..scene.partings import copy_partings
from ..strands.import_groom import animate_from_file, cut_motion_notes
from .bake_job import write_bake
from .inputs import Inputs
from .job_options import add_motion_options
from .job_steps import Job, finish, read_hair, read_job_masks, report_notes
from .object_settings import write_settings
from .verb import Verb

#: amplitudes and rate of the head's shake
SHAKE_ANGLE = np.radians(25.0)
SHAKE_SWAY = 0.03  # [m]
SHAKE_RATE = 1.0  # [1/s]
_DENSITY = "children_density"


def simulate(job: Job) -> None:
    """Simulate the hair and write its motion as a bake."""
    with scene_at_first_frame(job):
        simulate_hair(job, read_hair(job), job.output)
    finish(job, job.output)


def simulate_hair(job: Job, inputs: Inputs, folder: Path) -> BakedGuides:
    """Bake the hair under the scene's animation or the shake; call it inside `at_rest`."""
    with _hair_to_simulate(job, inputs) as hair:
        write_settings(hair, job.stored_settings)
        widths = hair.data.hairloom.widths
        if widths.method == "auto" and not inputs.strands.has_widths:
            # `write_curves` has stored found widths, which "auto" would take for the groom's own
            widths.method = "found"
        scene = bpy.context.scene
        frames = range(scene.frame_start, scene.frame_end + 1)
        plan = Bake.of([hair], scene, frames=frames, folder=folder.resolve())
        try:
            write_bake(plan, job.report, "simulating", "simulate frame")
        except HairloomError as error:
            if error.place != hair.name:
                raise
            raise error.at(inputs.groom_name) from error
    motion = BakedGuides.in_folder(folder.resolve())
    facts = motion.cache.facts
    assert facts.figures is not None, "it was measured while it was baked"
    job.report.facts.update(
        frames=facts.frame_count, frame_rate=facts.frame_rate, **facts.figures.as_dict()
    )
    return motion


@contextmanager
def scene_at_first_frame(job: Job) -> Iterator[None]:
    """With --animated, set the scene to its first frame, which is rest, inside the block."""
    scene, frame_before = bpy.context.scene, bpy.context.scene.frame_current
    try:
        if job.options.animated:
            scene.frame_set(scene.frame_start)
        yield
    finally:
        scene.frame_set(frame_before)


@contextmanager
def _hair_to_simulate(job: Job, inputs: Inputs) -> Iterator[bpy.types.Object]:
    """The hair object, in the open scene or in a temporary scene whose head is shaken."""
    if job.options.animated:
        yield _hair_of_open_scene(job, inputs)
        return
    scene_hair, depsgraph = job.hair, bpy.context.evaluated_depsgraph_get()
    window = bpy.context.window_manager.windows[0]
    scene_before, scene = window.scene, bpy.data.scenes.new("Hairloom Simulation")
    window.scene = scene
    try:
        assert inputs.head is not None, "simulate and demo refuse hair without a head"
        head = mesh_object("Head", inputs.head, scene)
        hair = write_curves("Hair", inputs.strands, head, scene.collection)
        if scene_hair is not None:
            copies = StaticCopies(head, scene, depsgraph)
            copy_holders(scene_hair, hair, copies)
            copy_colliders(
                scene_hair, bpy.data.objects.get(inputs.head_object_name or ""), hair, copies
            )
            copy_partings(scene_hair, hair, head, scene, depsgraph)
        if job.sources.collider is not None and inputs.collider is not None:
            collider = mesh_object("Collider", inputs.collider, scene)
            collider.parent = head
            hair.hairloom.collider = collider
        if inputs.density is not None:
            set_attribute(head.data, _DENSITY, "POINT", inputs.density)
            hair.hairloom.children_density = _DENSITY
        for kind in (ChildrenSettings, DynamicsSettings):
            names = mask_names(job.settings[kind])
            for parameter, mask in read_job_masks(job, inputs, kind).items():
                _put_mask(mask, names[parameter], hair, inputs.strands)
        low, high = inputs.head.bounds()
        rate = float(job.options.frame_rate)
        shake(head, (low + high) / 2.0, round(job.options.seconds * rate), rate)
        yield hair
    finally:
        window.scene = scene_before
        for obj in list(scene.collection.objects):
            bpy.data.objects.remove(obj)
        bpy.data.scenes.remove(scene)
        bpy.data.orphans_purge(do_local_ids=True, do_linked_ids=False, do_recursive=False)


def _put_mask(mask: Mask, name: str, hair: bpy.types.Object, strands: StrandSet) -> None:
    """Copy a mask to hair of the temporary scene, on a head that `mesh_object` has made; masks by
    images need no copy, as images belong to the file."""
    if isinstance(mask, SurfaceMask):
        set_attribute(hair.data.surface.data, name, "CORNER", mask.corners.ravel())
    elif isinstance(mask, StrandMask):
        values = mask.at_points(strands).astype(np.float32)
        set_attribute(hair.data, name, "POINT", values)


def _hair_of_open_scene(job: Job, inputs: Inputs) -> bpy.types.Object:
    """The hair object that --groom names; else a new one on the head, with the strands."""
    if inputs.head_object_name is None:
        raise HairloomError(
            "only an object of the scene can be animated",
            place="--animated",
            remedy="Name the head's object with --head, or omit --animated",
        )
    head, scene = bpy.data.objects[inputs.head_object_name], bpy.context.scene
    hair = job.hair
    if hair is None:
        hair = write_curves("Hair", inputs.strands, head, scene.collection)
        if inputs.groom is not None and inputs.groom.motion is not None:
            animate_from_file(hair, inputs.groom.motion)
            cut = cut_motion_notes(inputs.groom.motion)
            report_notes([f"{inputs.groom_name}: {note}" for note in cut], job.report)
    hair.data.surface = head
    if job.sources.collider is not None and inputs.collider is not None:
        collider = bpy.data.objects.get(job.sources.collider)
        if collider is None:
            collider = mesh_object("Collider", inputs.collider, scene)
            collider.parent = head
            collider.matrix_parent_inverse = head.matrix_world.inverted_safe()
        hair.hairloom.collider = collider
    if job.sources.children_density:
        hair.hairloom.children_density = job.sources.children_density
    return hair


def mesh_object(name: str, surface: Surface, scene: bpy.types.Scene) -> bpy.types.Object:
    """An object at the origin with a surface in world space."""
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(surface.positions, [], surface.triangles)
    if surface.corner_uv is not None:
        layer = mesh.uv_layers.new(name="UVMap")
        layer.uv.foreach_set("vector", surface.corner_uv.ravel())
    obj = bpy.data.objects.new(name, mesh)
    scene.collection.objects.link(obj)
    return obj


def shake(head: bpy.types.Object, centre: Floats, last: int, rate: float) -> None:
    """Animate an object at the origin, and the scene's frames: it turns left and right and sways
    from frame 0 to `last`. The motion eases in, so that frame 0 is at rest.

    Args:
        centre: (3,) world [m], around which it turns. rate: frames in a second.
    """
    scene = bpy.context.scene
    scene.frame_start, scene.frame_end = 0, last
    scene.render.fps = max(round(rate), 1)
    scene.render.fps_base = scene.render.fps / rate
    for frame in range(last + 1):
        matrix = shake_matrix(centre, frame / rate)
        head.location = matrix[:3, 3]
        head.rotation_euler = (0.0, 0.0, np.arctan2(matrix[1, 0], matrix[0, 0]))
        head.keyframe_insert("location", frame=frame)
        head.keyframe_insert("rotation_euler", frame=frame)
    scene.frame_set(0)


def shake_matrix(centre: Floats, seconds: float) -> Floats:
    """The head's transform at a time of the shake, (4, 4)."""
    phase = 2.0 * np.pi * SHAKE_RATE * seconds
    ease = min(seconds / 0.25, 1.0)
    matrix = rotation_about(centre, ease * SHAKE_ANGLE * np.sin(phase))
    matrix[0, 3] += ease * SHAKE_SWAY * np.sin(phase)
    return matrix


SIMULATE = Verb(
    "simulate",
    simulate,
    add_motion_options,
    output="folder to write the bake into",
    writes_folder=True,
    needs_head=True,
)
