"""Hair cards on screen: built in the background and shown instead of strands, moved, rendered, made
into objects, sorted, exported; and interrupted at every stage."""

import json
import sys
import time
from pathlib import Path

import addon_utils
import bpy
import numpy as np

sys.path.append(str(Path(__file__).parent))
import driver
from artist import (
    changed_fraction,
    click,
    look_from_front,
    open_our_sidebar,
    pixels,
    press,
    redrawn_pixels,
    region,
    sidebar_button,
    still_pixels,
    viewport,
    wait_for_hair,
)
from driver import hairloom_module, wait_until

STRANDS, CARDS = 400, 60
FOLDER = Path(bpy.app.tempdir) / "cards"
BLEND = str(FOLDER / "cards.blend")

failures: list[str] = []


def live():
    return hairloom_module("previews")


def session():
    (one,) = live().sessions()
    return one


def hair():
    return bpy.data.objects["Hair"]


def settings(section):
    return getattr(hair().data.hairloom, section)


class Stillness:
    """The longest time for which the window was blocked."""

    def __init__(self):
        self.longest, self.last = 0.0, time.perf_counter()
        bpy.app.timers.register(self.tick, first_interval=0.0, persistent=True)

    def tick(self):
        now = time.perf_counter()
        self.longest, self.last = max(self.longest, now - self.last), now
        return 0.005

    def since(self):
        """The longest time since the last call [s]."""
        longest, self.longest = self.longest, 0.0
        return longest


def steps():
    yield from press("ESC")  # the splash screen takes the first event
    sys.excepthook = lambda kind, error, _: failures.append(f"{kind.__name__}: {error}")
    driver.enable_extension()
    yield from set_the_scene()
    yield from cards_in_place_of_strands()
    yield from a_slider_is_dragged()
    yield from hair_plays_as_cards()
    yield from a_look_is_chosen()
    yield from strands_again_and_undo()
    yield from rendered_as_cards()
    yield from making_is_cancelled()
    yield from cards_are_made()
    yield from a_copy_is_sorted()
    yield from they_are_exported()
    yield from another_file_in_mid_build()
    yield from disabled_in_mid_build()
    assert failures == [], failures


def set_the_scene():
    FOLDER.mkdir()
    bpy.data.batch_remove(bpy.data.objects)
    bpy.ops.mesh.primitive_uv_sphere_add(radius=0.1)
    bpy.context.object.name = "Head"
    bpy.ops.hairloom.grow(strand_count=STRANDS, length=0.12)
    bpy.context.object.name = "Hair"
    cards = settings("cards")
    cards.source, cards.card_count, cards.levels = "clusters", CARDS, 2
    settings("atlas").size, settings("card_occlusion").rays = "512", 8
    settings("strands").fullness = 6.0  # makes few strands visible
    overlays = viewport().spaces.active.overlay
    overlays.show_floor = overlays.show_cursor = overlays.show_object_origins = False
    look_from_front(0.9)
    yield from open_our_sidebar()
    yield from click(*sidebar_button("hairloom.preview"))
    yield from wait_for_hair()
    yield


def are_shown():
    drawing = hairloom_module("overlay").drawing_of(session().uid)
    return drawing.snapshot.cards is not None and not session().cards.is_pending


def cards_in_place_of_strands():
    """Strands are shown until cards are built, and the window stays responsive."""
    strands = yield from still_pixels("strands")
    watch = Stillness()
    yield 1
    watch.since()
    settings("card_drawing").shown_as = "cards"
    assert session().cards.is_pending and session().snapshot.strand_count == STRANDS
    yield from wait_until(are_shown, "no cards are shown")
    print(f"first cards: the window stood still for {watch.since():.2f} s", flush=True)
    cards = yield from redrawn_pixels("cards")
    assert session().cards.counts[0] >= CARDS
    assert changed_fraction(strands, cards) > 0.005, "cards look as strands to the pixel"
    # both are hair of one colour over the same part of the view
    empty = strands[2, 2]
    cover = [np.abs(each - empty).max(axis=2) > 0.05 for each in (strands, cards)]
    print(f"covered by strands, by cards: {cover[0].mean():.3f}, {cover[1].mean():.3f}")
    assert 0.7 < cover[1].mean() / cover[0].mean() < 1.4


def a_slider_is_dragged():
    """The old cards are shown until the last ones are built."""
    watch, before = Stillness(), session().cards.counts
    yield 1
    watch.since()
    for count in (70, 80, 90, 120):
        settings("cards").card_count = count
        assert session().snapshot.cards is not None, "nothing is shown meanwhile"
        yield 1
    yield from wait_until(
        lambda: are_shown() and session().cards.counts[0] >= 120, "the last cards do not come"
    )
    print(f"dragged to {session().cards.counts}: stood still for {watch.since():.2f} s", flush=True)
    settings("cards").card_count = CARDS
    yield from wait_until(lambda: are_shown() and session().cards.counts == before, "not as before")


def hair_plays_as_cards():
    at_rest = session().snapshot.cards.mesh
    yield from click(*sidebar_button("hairloom.play"))
    yield from wait_until(lambda: session().is_playing, "it does not play")
    for x in (0.05, -0.05, 0.0):
        bpy.data.objects["Head"].location.x = x
        yield
        moving = session().snapshot.cards.mesh
        assert moving.triangles is at_rest.triangles, "they were built again"
        assert np.isfinite(moving.positions).all()
    driver.screenshot("playing")

    # the head is back where it was
    def moved():
        return np.abs(session().snapshot.cards.mesh.positions - at_rest.positions).max()

    assert moved() > 0.005, "the cards do not swing"
    yield from click(*sidebar_button("hairloom.reset"))
    yield from click(*sidebar_button("hairloom.play"))
    yield from wait_until(lambda: not live().is_playing(), "it plays on")
    yield
    np.testing.assert_allclose(
        session().snapshot.cards.mesh.positions, at_rest.positions, atol=1e-4
    )


def a_look_is_chosen():
    look = settings("shading")
    look.model = "kajiya_kay"
    yield from wait_until(are_shown, "cards of Kajiya-Kay do not come")
    before = yield from redrawn_pixels("look-before")
    look.base_color = (0.9, 0.1, 0.05)
    red = yield from redrawn_pixels("look-red")
    assert changed_fraction(before, red, 0.05) > 0.005
    look.model = "marschner"
    yield from wait_until(are_shown, "cards of the other model do not come")
    marschner = yield from redrawn_pixels("look-marschner")
    assert changed_fraction(red, marschner, 0.05) > 0.003
    look.model = "kajiya_kay"
    yield from wait_until(are_shown, "cards of the first model do not come")


def strands_again_and_undo():
    drawing = settings("card_drawing")
    bpy.ops.ed.undo_push(message="cards")
    drawing.shown_as = "strands"
    bpy.ops.ed.undo_push(message="strands")
    yield
    assert session().snapshot.cards is None and session().snapshot.strand_count == STRANDS
    driver.screenshot("strands-again")
    bpy.ops.ed.undo()
    assert settings("card_drawing").shown_as == "cards"
    yield from wait_until(are_shown, "undo brings no cards back")
    bpy.ops.ed.redo()
    yield from wait_until(lambda: session().snapshot.cards is None, "redo brings no strands back")
    bpy.ops.ed.undo()
    yield from wait_until(are_shown, "undo brings no cards back again")


def rendered_as_cards():
    """Cards in Rendered mode and with F12 in our engine."""
    scene, shading = bpy.context.scene, viewport().spaces.active.shading
    bpy.ops.object.light_add(type="SUN", rotation=(0.9, 0.3, 0.0))
    hair().select_set(True)
    bpy.context.view_layer.objects.active = hair()
    engine, scene.render.engine = scene.render.engine, "HAIRLOOM"
    scene.hairloom.picture.samples = scene.hairloom.picture.viewport_samples = 4
    shading.type = "RENDERED"
    yield
    yield from wait_until(
        lambda: pixels("rendered").std() > 0.05, "nothing is seen in Rendered mode"
    )
    camera = bpy.data.objects.new("Viewer", bpy.data.cameras.new("Viewer"))
    bpy.context.collection.objects.link(camera)
    camera.location, camera.rotation_euler = (0.0, -0.75, 0.0), (np.pi / 2.0, 0.0, 0.0)
    camera.data.clip_start = 0.01
    scene.camera, path = camera, FOLDER / "f12.png"
    scene.render.resolution_x, scene.render.resolution_y = 200, 150
    scene.render.filepath, scene.render.image_settings.file_format = str(path), "PNG"
    bpy.context.preferences.view.render_display_type = "NONE"
    bpy.ops.render.render("INVOKE_DEFAULT", write_still=True)
    yield from wait_until(
        lambda: path.is_file() and not bpy.app.is_job_running("RENDER"),
        "F12 writes no picture",
    )
    image = bpy.data.images.load(str(path))
    picture = np.empty(len(image.pixels), np.float32)
    image.pixels.foreach_get(picture)
    bpy.data.images.remove(image)
    assert picture.std() > 0.05, "nothing is seen in the picture"
    shading.type, scene.render.engine = "SOLID", engine
    yield


def card_objects():
    return hairloom_module("card_object").card_objects(hair())


def is_making():
    return hairloom_module("long_work").running_label() == "Make Cards"


def stage():
    """The current stage of Make Cards; "" if it is not running."""
    work = hairloom_module("long_work")._running
    return "" if work is None else work.progress.text


def make_cards():
    with bpy.context.temp_override(area=viewport(), region=region("WINDOW")):
        assert bpy.ops.hairloom.make_cards("INVOKE_DEFAULT") == {"RUNNING_MODAL"}
    assert is_making() and not bpy.ops.hairloom.make_cards.poll()


def making_is_cancelled():
    """Esc leaves nothing half made, at any stage."""
    reading = "Reading the hair"
    for name, is_there in (("reading", lambda: True), ("amid", lambda: stage() != reading)):
        make_cards()
        yield from wait_until(is_there, f"it does not come past {reading}")
        assert is_making(), "it has ended before it could be cancelled"
        driver.screenshot(f"making-{name}")
        yield from press("ESC")
        yield from wait_until(lambda: not is_making(), "Esc does not cancel")
        assert card_objects() == [] and bpy.ops.hairloom.make_cards.poll()
        assert not bpy.data.images.get("Hair Cards") and not bpy.data.meshes.get("Hair Cards")


def cards_are_made():
    """Made again in place, with the artist's modifier and material kept; undone and redone."""
    watch = Stillness()
    make_cards()
    yield from wait_until(lambda: not is_making(), "Make Cards does not end")
    print(f"Make Cards: the window stood still for {watch.since():.2f} s", flush=True)
    finest, coarser = card_objects()
    assert not finest.hide_viewport and coarser.hide_viewport
    count = len(finest.data.polygons)
    live().stop(session())
    hair().hide_set(True)
    yield
    driver.screenshot("made")
    finest.modifiers.new("Thick", "SOLIDIFY").thickness = 0.002
    finest.data.materials[0] = bpy.data.materials.new("Own")
    hair().hide_set(False)
    hair().select_set(True)
    bpy.context.view_layer.objects.active = hair()
    settings("cards").card_count = 2 * CARDS
    bpy.ops.ed.undo_push(message="before the cards are made again")
    make_cards()
    yield from wait_until(lambda: not is_making(), "Make Cards does not end again")
    assert card_objects() == [finest, coarser]
    assert len(finest.data.polygons) > 1.2 * count
    assert [each.name for each in finest.modifiers] == ["Thick"]
    assert [each.name for each in finest.data.materials] == ["Own"]
    again = len(finest.data.polygons)
    bpy.ops.ed.undo()
    yield
    assert len(card_objects()[0].data.polygons) == count
    bpy.ops.ed.redo()
    yield
    assert len(card_objects()[0].data.polygons) == again
    finest = card_objects()[0]
    finest.hide_set(True)
    yield
    bpy.data.objects.remove(finest)
    yield
    make_cards()
    yield from wait_until(lambda: not is_making(), "a deleted object is not made again")
    assert [each.hairloom.card_object.level for each in card_objects()] == [0, 1]


def a_copy_is_sorted():
    """Sort Hair Cards on a mesh with shuffled faces."""
    finest = card_objects()[0]
    copy = finest.copy()
    copy.data = finest.data.copy()
    copy.name = "Copy"
    bpy.context.collection.objects.link(copy)
    count = len(copy.data.polygons)
    for each in bpy.context.selected_objects:
        each.select_set(False)
    copy.select_set(True)
    bpy.context.view_layer.objects.active = copy
    yield
    driver.screenshot("own-cards")
    mode = bpy.ops.object.mode_set
    mode(mode="EDIT")
    bpy.ops.mesh.select_all(action="SELECT")
    bpy.ops.mesh.sort_elements(type="RANDOMIZE", elements={"FACE"}, seed=3)
    mode(mode="OBJECT")
    with bpy.context.temp_override(area=viewport(), region=region("WINDOW")):
        assert bpy.ops.hairloom.sort_cards(head="Head") == {"FINISHED"}
    yield
    assert len(copy.data.polygons) == count and len(finest.data.polygons) == count
    driver.screenshot("sorted")
    bpy.data.objects.remove(copy)
    hair().select_set(True)
    bpy.context.view_layer.objects.active = hair()
    yield


def they_are_exported():
    """File > Export; the JSON lists all levels, triangles and files."""
    path = FOLDER / "hair.glb"
    with bpy.context.temp_override(area=viewport(), region=region("WINDOW")):
        assert bpy.ops.hairloom.export_cards(filepath=str(path)) == {"FINISHED"}
    raw = path.read_bytes()
    length = int.from_bytes(raw[12:16], "little")
    gltf = json.loads(raw[20 : 20 + length])
    sidecar = json.loads((FOLDER / "hair.hairloom.json").read_text(encoding="utf-8"))
    assert len(gltf["meshes"]) == len(sidecar["levels"]) == 2
    for mesh in gltf["meshes"]:
        (primitive,) = mesh["primitives"]
        assert {"TEXCOORD_0", "TEXCOORD_1", "TANGENT"} <= set(primitive["attributes"])
    counts = {gltf["accessors"][m["primitives"][0]["indices"]]["count"] for m in gltf["meshes"]}
    assert counts == {3 * len(each.data.polygons) for each in card_objects()}
    for file in sidecar["texture_files"]:
        assert (FOLDER / file).is_file(), file
    yield 1


def is_building():
    return any(each.cards.is_pending for each in live().sessions())


def another_file_in_mid_build():
    """Loading another file ends unfinished builds; the new file works as any."""
    hair().select_set(True)
    yield from click(*sidebar_button("hairloom.preview"))
    yield from wait_until(is_building, "no cards are built")
    make_cards()
    yield 1
    bpy.ops.wm.save_as_mainfile(filepath=BLEND)
    bpy.ops.wm.open_mainfile(filepath=BLEND)
    yield
    assert not is_making() and live().sessions() == () and live().notice() == ""
    assert settings("card_drawing").shown_as == "cards" and len(card_objects()) == 2
    yield from click(*sidebar_button("hairloom.preview"))
    yield from wait_until(are_shown, "no cards are shown in the file that was loaded")
    driver.screenshot("reloaded")


def disabled_in_mid_build():
    settings("cards").card_count = CARDS + 7
    assert is_building()
    make_cards()
    yield 1
    addon_utils.disable(driver.EXTENSION, default_set=True)
    yield
    assert not hasattr(bpy.types.Curves, "hairloom")
    driver.enable_extension()
    yield
    yield from click(*sidebar_button("hairloom.preview"))
    yield from wait_until(are_shown, "no cards are shown after all")
    addon_utils.disable(driver.EXTENSION, default_set=True)
    yield


driver.play_session(steps())
