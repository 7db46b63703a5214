"""Closing the file while a job runs: File > New, Open, Revert and quitting end it. Nothing
half-written is left, and nothing goes on in the new file."""

import atexit
import os
import sys
import threading
import traceback
from pathlib import Path

import bpy
import numpy as np

sys.path.append(str(Path(__file__).parent))
import driver
import traces
from artist import confirm_file_browser, look_from_front, new_head, press, region, viewport
from driver import hairloom_module, wait_until

FOLDER = Path(os.environ["HAIRLOOM_SCREENSHOTS"]) / os.environ["HAIRLOOM_SESSION"]
FILE = str(FOLDER / "closed.blend")
#: what an earlier job has written, and what the export would replace
KEPT = {"hair.abc": b"old", "Hair/Hair.glb": b"old"}
SMALL = {"size": 64, "samples": 1}
#: enough frames, pictures and strands that no job ends by itself
MANY = 4000
STRANDS = 60_000

log = traces.Log()


def steps():
    yield from press("ESC")  # the splash screen takes the first event
    driver.enable_extension()
    bpy.context.preferences.view.filebrowser_display_type = "SCREEN"
    FOLDER.mkdir()
    (FOLDER / "Hair").mkdir()
    for name, content in KEPT.items():
        (FOLDER / name).write_bytes(content)
    yield from save_the_scene()
    at_rest = None
    for begin, end in closings():
        bpy.ops.wm.open_mainfile(filepath=FILE)
        yield from opened()
        at_rest = at_rest or state()
        assert state() == at_rest, f"the file has changed before {begin.__name__}"
        yield from begin()
        print(f"{begin.__name__} is ended by {end.__name__}", flush=True)
        end()
        yield from opened()
        yield from nothing_goes_on(f"{begin.__name__}, {end.__name__}")
        if end is not new_file:
            assert state() == at_rest, f"{begin.__name__}, {end.__name__}"
    bpy.ops.wm.open_mainfile(filepath=FILE)
    yield from opened()
    atexit.register(after_quitting)
    yield from exporting_motion()


def save_the_scene():
    """A groom on a head that moves."""
    head = new_head()
    assert bpy.ops.hairloom.grow(strand_count=1000, length=0.12) == {"FINISHED"}
    hair = bpy.context.object
    hair.name = "Hair"
    hair.hairloom.bake.folder = str(FOLDER / "bake")
    groom = hair.data.hairloom
    hair.hairloom.dynamics.device, hair.hairloom.dynamics.collider_resolution = "numpy", 8
    groom.cards.source, groom.cards.card_count, groom.cards.levels = "clusters", 300, 1
    for frame, x in ((1, 0.0), (MANY, 1.0)):
        head.location.x = x
        head.keyframe_insert("location", frame=frame)
    scene = bpy.context.scene
    scene.frame_end = MANY
    scene.frame_set(1)
    bpy.ops.object.camera_add(location=(0.0, -1.0, 0.0), rotation=(1.57, 0.0, 0.0))
    scene.camera = bpy.context.object
    choose(hair)
    look_from_front(0.9)
    viewport().spaces.active.shading.type = "WIREFRAME"  # drawn quickly
    yield
    bpy.ops.wm.save_as_mainfile(filepath=FILE)


def new_file():
    bpy.ops.wm.read_homefile(use_factory_startup=False)


def open_file():
    bpy.ops.wm.open_mainfile(filepath=FILE)


def revert():
    bpy.ops.wm.revert_mainfile()


def closings():
    """Each job, and how it ends."""
    ends = new_file, open_file, revert
    jobs = (
        exporting_motion,
        exporting_cards,
        baking,
        making_cards,
        growing,
        growing_again,
        following_its_settings,
        adding_a_hairstyle,
        adding_the_sample_scene,
        making_real,
        settling,
        checking,
        turning,
        rendering,
        previewing,
        choosing_a_file,
    )
    return [(job, ends[number % 3]) for number, job in enumerate(jobs)] + [
        (exporting_cards, new_file),
        (making_cards, new_file),
        (growing_again, open_file),
    ]


def opened():
    """Wait until the file is open, and what its opening has deferred is done."""
    yield 1
    yield from wait_until(lambda: bpy.context.window is not None, "there is no window")
    yield from wait_until(lambda: not driver.timers.pending(), "something goes on in the new file")


def state():
    """What the open file and Blender hold."""
    names = sorted(f"{each.id_type} {each.name}" for each in bpy.data.user_map())
    return traces.blender_traces()["handlers"], [each for each in names if "IMAGE" not in each]


def threads():
    return [each.name for each in threading.enumerate() if each.name.startswith("Hairloom")]


def nothing_goes_on(job):
    ours = traces.preview_traces()
    assert not any(ours.values()), f"{job}: {ours}"
    assert not hairloom_module("suspension").is_suspended(), job
    assert not hairloom_module("export_check").hair_count(), job
    yield from wait_until(lambda: not threads(), lambda: f"{job}: {threads()}")
    assert found() == kept(), f"{job}: {found()}"
    assert "Traceback" not in log.new_output(), f"{job} raises"
    assert bpy.ops.hairloom.sample_scene.poll(), job


def kept():
    return {"closed.blend", *KEPT}


def found():
    """The files beside those that Blender writes itself."""
    for name, content in KEPT.items():
        assert (FOLDER / name).read_bytes() == content, f"{name} has changed"
    files = (path for path in FOLDER.rglob("*") if path.is_file())
    return {str(path.relative_to(FOLDER)) for path in files}


def running_label():
    return hairloom_module("long_work").running_label()


def choose(obj):
    for each in bpy.context.selected_objects:
        each.select_set(False)
    obj.select_set(True)
    bpy.context.view_layer.objects.active = obj


def begin(name, **settings):
    """Start an operator as a button of the panel does."""
    with bpy.context.temp_override(area=viewport(), region=region("UI")):
        getattr(bpy.ops.hairloom, name)("INVOKE_DEFAULT", True, **settings)
    yield from has_begun()


def has_begun():
    yield from wait_until(running_label, "it does not begin")
    yield 1
    assert running_label(), "it has already ended"


def is_half_written():
    """Wait until there are files of the job, not yet at their place."""
    yield from wait_until(lambda: found() != kept(), "it writes nothing")
    assert running_label(), "it has already ended"


def from_the_file_browser(name, file, **settings):
    with bpy.context.temp_override(area=viewport(), region=region("WINDOW")):
        getattr(bpy.ops.hairloom, name)("INVOKE_DEFAULT", filepath=str(FOLDER / file), **settings)
    yield from confirm_file_browser()
    yield from has_begun()


def exporting_motion():
    yield from from_the_file_browser("export_alembic", "hair.abc", frames="scene")
    yield from is_half_written()


def exporting_cards():
    yield from from_the_file_browser("export_cards", "Hair.glb")


def baking():
    yield from begin("bake")
    yield from is_half_written()


def making_cards():
    yield from begin("make_cards")


def growing():
    choose(bpy.data.objects["Head"])
    yield from begin("grow", strand_count=STRANDS)


def growing_again():
    """Hair that was combed grows only when it is asked to."""
    comb(bpy.data.objects["Hair"].data)
    bpy.data.objects["Hair"].data.hairloom.grow.strand_count = STRANDS
    yield from begin("grow_again")


def comb(curves):
    module = hairloom_module("curves")
    module.set_points(curves, module.curve_points(curves) * np.float32(1.05))


def following_its_settings():
    """Hair that was not combed grows again as soon as a setting has changed."""
    bpy.data.objects["Hair"].data.hairloom.grow.strand_count = STRANDS
    yield 1


def adding_a_hairstyle():
    yield from begin("add_hairstyle", style="bob", plays=False)


def adding_the_sample_scene():
    yield from begin("sample_scene")


def making_real():
    bpy.data.objects["Hair"].data.hairloom.children.strand_count = STRANDS
    yield from begin("make_real")


def settling():
    yield from begin("settle")


def checking():
    bpy.data.objects["Hair"].data.hairloom.children.strand_count = STRANDS
    yield from begin("check_export", engine="alembic unreal")


def turning():
    yield from begin("turntable", directory=str(FOLDER), frames=2000, **SMALL)
    yield from is_half_written()


def rendering():
    """A picture of Hairloom's engine, which Blender's own job renders."""
    scene = bpy.context.scene
    scene.render.engine, scene.render.resolution_percentage = "HAIRLOOM", 25
    bpy.ops.render.render("INVOKE_DEFAULT")
    yield 1
    yield 1


def previewing():
    """A preview whose hair is still being built."""
    bpy.data.objects["Hair"].data.hairloom.children.strand_count = STRANDS
    with bpy.context.temp_override(area=viewport(), region=region("UI")):
        assert bpy.ops.hairloom.preview("INVOKE_DEFAULT") == {"FINISHED"}
    yield 1


def choosing_a_file():
    """The dialog of an export is open, and the hair is read for it."""
    bpy.data.objects["Hair"].data.hairloom.children.strand_count = STRANDS
    with bpy.context.temp_override(area=viewport(), region=region("WINDOW")):
        bpy.ops.hairloom.export_alembic("INVOKE_DEFAULT", filepath=str(FOLDER / "hair.abc"))
    yield from wait_until(hairloom_module("export_check").hair_count, "no check opens")
    yield 1


def after_quitting():
    """Runs when Python ends, after Blender has disabled the extension."""
    try:
        assert found() == kept(), f"quitting leaves {found()}"
        assert "Traceback" not in log.new_output(), "quitting raises"
    except BaseException:
        traceback.print_exc()
        sys.stderr.flush()
        os._exit(1)


driver.play_session(steps())
