"""Random actions of an artist with Blender while hair is previewed."""

from pathlib import Path

import bpy
from dice import MAX_OBJECTS, action, call, press, press_button, push_undo_step, select, views


def wait_for_notifiers():
    """Wait before other areas are shown: with several windows, Blender notifies areas of an object
    that became active in the same tick, and crashes if they are no longer in any window."""
    yield 0.2


@action(14)
def undo_or_redo_by_keys(dice):
    shift = dice.happens(0.45)
    dice.note("Ctrl-Shift-Z" if shift else "Ctrl-Z")
    yield from press("Z", ctrl=True, shift=shift)


@action(8)
def undo_or_redo(dice):
    call(dice, dice.pick(["ed.undo", "ed.redo"]))


@action(4)
def press_escape(dice):
    yield from press("ESC")


@action(8)
def move_something(dice):
    obj = dice.object()
    attribute = dice.pick(["location", "rotation_euler", "scale"])
    middle, width = (1.0, 0.2) if attribute == "scale" else (0.0, 0.3)
    value = [dice.random.uniform(middle - width, middle + width) for _ in range(3)]
    dice.note(f"{obj.name}.{attribute} = {value}")
    setattr(obj, attribute, value)
    if dice.happens(0.3):
        obj.keyframe_insert(attribute, frame=dice.random.randint(1, 20))
    push_undo_step("move")


@action(5)
def select_something(dice):
    obj = dice.object()
    dice.note(obj.name)
    select(obj)
    dice.object().select_set(True)


@action(3)
def delete_something(dice):
    obj = dice.object("MESH", "CURVES", "CURVE", "EMPTY")
    dice.note(obj.name)
    if dice.happens(0.5):
        bpy.data.objects.remove(obj)
        push_undo_step("removed")
    else:
        select(obj)
        press_button(dice, "object.delete", confirm=False)


@action(1)
def delete_data(dice):
    data = dice.pick([*bpy.data.hair_curves, *bpy.data.meshes])
    dice.note(repr(data))
    (bpy.data.hair_curves if data in list(bpy.data.hair_curves) else bpy.data.meshes).remove(data)
    push_undo_step("data")


@action(3)
def duplicate(dice):
    if len(bpy.data.objects) < MAX_OBJECTS:
        select(dice.object("MESH", "CURVES"))
        call(dice, "object.duplicate", "EXEC_DEFAULT", True, linked=dice.happens(0.5))


@action(2)
def rename(dice):
    obj = dice.object()
    name = dice.pick(["Hair", "Head", "Hairöß", "x" * 63, "a/b:c"])
    dice.note(f"{obj.name} -> {name}")
    for each in filter(None, (obj, obj.data)):
        if each.is_editable:  # not linked
            each.name = name
    push_undo_step("rename")


@action(5)
def hide_or_show(dice):
    obj = dice.object()
    dice.note(obj.name)
    if dice.happens(0.5):
        obj.hide_set(not obj.hide_get())
    else:
        obj.hide_viewport = not obj.hide_viewport
    push_undo_step("hide")


@action(1)
def exclude_a_collection(dice):
    layer = dice.pick(bpy.context.view_layer.layer_collection.children)
    layer.exclude = not layer.exclude
    push_undo_step("exclude")


@action(3)
def local_view(dice):
    call(dice, "view3d.localview", frame_selected=False)


@action(6)
def switch_mode(dice):
    active = bpy.context.active_object
    sculpt = "SCULPT" if active is not None and active.type == "MESH" else "SCULPT_CURVES"
    modes = [sculpt, "EDIT", "OBJECT", "OBJECT"]
    try:
        call(dice, "object.mode_set", "EXEC_DEFAULT", True, mode=dice.pick(modes))
    except TypeError:
        dice.note("what is active has no such mode")


@action(4)
def go_to_a_frame(dice):
    frame = dice.random.randint(-2, 30)
    dice.note(str(frame))
    bpy.context.scene.frame_set(frame)


@action(4)
def play_the_animation(dice):
    call(dice, "screen.animation_play")
    yield dice.pick([0.2, 1])


@action(2)
def save_and_load(dice):
    path = str(dice.folder / "saved.blend")
    call(dice, "wm.save_as_mainfile", filepath=path, copy=dice.happens(0.5))
    if dice.happens(0.5):
        call(dice, "wm.open_mainfile", filepath=path)
        yield 1


@action(1)
def append_or_link(dice):
    path = str(dice.folder / "saved.blend")
    if not Path(path).is_file() or bpy.data.filepath == path:  # no file links itself
        return
    is_linked = dice.happens(0.5)
    with bpy.data.libraries.load(path, link=is_linked) as (there, here):
        here.objects = there.objects[:2]
    dice.note(f"{'linked' if is_linked else 'appended'} {here.objects}")
    for obj in filter(None, here.objects):
        if obj.name not in bpy.context.scene.objects:
            bpy.context.scene.collection.objects.link(obj)
            if is_linked and dice.happens(0.5):
                obj.override_create(remap_local_usages=True)
    push_undo_step("appended")


@action(1)
def new_file(dice):
    call(dice, "wm.read_homefile", use_factory_startup=False)
    yield 1


@action(6)
def switch_shading(dice):
    for area in views():
        shading = area.spaces.active.shading
        kinds, engine = ["SOLID", "WIREFRAME"], bpy.context.scene.render.engine
        if engine != "CYCLES":
            kinds.append("RENDERED")
        if engine not in ("HAIRLOOM", "BLENDER_WORKBENCH"):  # they have no Material Preview
            kinds.append("MATERIAL")
        shading.type = dice.pick(kinds)
        shading.show_xray = dice.happens(0.3)
        dice.note(f"{shading.type} {shading.show_xray}")


@action(2)
def switch_scene(dice):
    if dice.happens(0.3) and len(bpy.data.scenes) < 3:
        call(dice, "scene.new", type=dice.pick(["NEW", "LINK_COPY"]))
    elif dice.happens(0.2):
        call(dice, "scene.delete")
    else:
        bpy.context.window.scene = dice.pick(bpy.data.scenes)
        dice.note(bpy.context.window.scene.name)


@action(1)
def switch_workspace(dice):
    yield from wait_for_notifiers()
    names = ["Layout", "Sculpting", "Modeling", "Scripting"]
    bpy.context.window.workspace = dice.pick(w for w in bpy.data.workspaces if w.name in names)
    dice.note(bpy.context.window.workspace.name)
    yield 1


@action(2)
def resize(dice):
    yield from wait_for_notifiers()
    if dice.happens(0.5):
        call(dice, "screen.screen_full_area")
    else:
        for area in views():
            area.spaces.active.show_region_ui = not area.spaces.active.show_region_ui
            area.spaces.active.overlay.show_overlays = dice.happens(0.7)
    yield 1


@action(1)
def open_or_close_a_window(dice):
    yield from wait_for_notifiers()
    windows = bpy.context.window_manager.windows
    if len(windows) > 1:
        with bpy.context.temp_override(window=windows[-1]):
            bpy.ops.wm.window_close()
    else:
        call(dice, "wm.window_new")
    yield 1


@action(3)
def look_at_a_tab(dice):
    for area in bpy.context.window.screen.areas:
        if area.type == "PROPERTIES":
            tab = dice.pick(["DATA", "OBJECT", "SCENE", "RENDER"])
            try:
                area.spaces.active.context = tab
            except TypeError:
                dice.note(f"what is active has no {tab}")
