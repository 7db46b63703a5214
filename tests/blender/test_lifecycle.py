"""Enabling and disabling the extension repeatedly leaves nothing behind."""

import bpy
import pytest

import hairloom
from hairloom.addon import registration
from hairloom.addon.blender.engine import hair_scene
from hairloom.addon.blender.preview import previews, scene_events
from hairloom.addon.blender.properties import groups
from hairloom.addon.blender.viewport import overlay
from hairloom.addon.ui import menus, operators_preview

pytestmark = pytest.mark.portable


@pytest.fixture
def commands(no_extension, monkeypatch):
    """The registered command line verbs, recorded here because Blender has no list of them."""
    known = []
    add, remove = bpy.utils.register_cli_command, bpy.utils.unregister_cli_command

    def register_cli_command(name, run):
        handle = add(name, run)
        known.append((name, handle))
        return handle

    def unregister_cli_command(handle):
        remove(handle)
        known[:] = [entry for entry in known if entry[1] is not handle]

    monkeypatch.setattr(bpy.utils, "register_cli_command", register_cli_command)
    monkeypatch.setattr(bpy.utils, "unregister_cli_command", unregister_cli_command)
    return known


def traces():
    """Everything of Hairloom that is registered in Blender."""
    handlers = {
        name: [f"{each.__module__}.{each.__qualname__}" for each in handlers]
        for name in dir(bpy.app.handlers)
        if isinstance(handlers := getattr(bpy.app.handlers, name), list)
    }
    menus = {name: len(getattr(bpy.types, name).draw._draw_funcs) for name in EXTENDED_MENUS}
    properties = {
        owner.__name__: sorted(owner.bl_rna.properties.keys())
        for owner in (
            bpy.types.Curves,
            bpy.types.Object,
            bpy.types.Scene,
            bpy.types.WindowManager,
            bpy.types.Mesh,
        )
    }
    classes = [name for name in dir(bpy.types) if "hairloom" in name.lower()]
    own_attributes = [hasattr(bpy.types.Curves, "hairloom"), hasattr(bpy.types.Object, "hairloom")]
    timer = bpy.app.timers.is_registered(scene_events._read_again)
    operators = dir(bpy.ops.hairloom)
    keymaps = bpy.context.window_manager.keyconfigs.addon.keymaps
    keys = [item.idname for keymap in keymaps for item in keymap.keymap_items]
    return handlers, menus, properties, classes, own_attributes, timer, operators, keys


EXTENDED_MENUS = (
    "TOPBAR_MT_file_import",
    "TOPBAR_MT_file_export",
    "VIEW3D_MT_curve_add",
    "VIEW3D_MT_object",
    "VIEW3D_MT_object_context_menu",
)


@pytest.fixture(autouse=True)
def menus_can_be_counted():
    """Blender turns a menu's draw function into a list when something is first appended to it."""
    for name in EXTENDED_MENUS:
        getattr(bpy.types, name).append(_nothing)
    yield
    for name in EXTENDED_MENUS:
        getattr(bpy.types, name).remove(_nothing)


def _nothing(_menu, _context):
    pass


def test_ten_times_on_and_off_leave_nothing(commands):
    before = traces()
    for _ in range(10):
        hairloom.register()
        assert traces() != before
        assert [name for name, _ in commands] == ["hairloom"]
        hairloom.unregister()
        assert traces() == before
        assert commands == []


def test_disabling_ends_previews_and_timers(new_hair, sphere, get_depsgraph):
    hair = new_hair(sphere)
    session = previews.start(hair, get_depsgraph())
    hair.data.hairloom.guides.guide_count = 5
    assert bpy.app.timers.is_registered(scene_events._read_again)
    hairloom.unregister()
    try:
        assert previews.sessions() == ()
        assert overlay.drawing_of(session.uid) is None
        assert not bpy.app.timers.is_registered(scene_events._read_again)
        assert hair.evaluated_get(get_depsgraph()).display_type == "TEXTURED"
    finally:
        hairloom.register()


@pytest.mark.parametrize("failing", [0, 5, len(registration.CLASSES) - 1])
def test_registered_classes_are_rolled_back_when_a_class_fails(failing, monkeypatch, commands):
    before = traces()
    register_class = bpy.utils.register_class

    def fail_once(each):
        if each is registration.CLASSES[failing]:
            raise RuntimeError("this one fails")
        register_class(each)

    monkeypatch.setattr(bpy.utils, "register_class", fail_once)
    with pytest.raises(RuntimeError, match="this one fails"):
        hairloom.register()
    assert traces() == before
    assert commands == []


def test_a_late_failure_rolls_everything_back(monkeypatch, commands):
    before = traces()

    def fail(*_):
        raise RuntimeError("no commands today")

    monkeypatch.setattr(bpy.utils, "register_cli_command", fail)
    with pytest.raises(RuntimeError, match="no commands today"):
        hairloom.register()
    assert traces() == before


def test_disabling_survives_a_script_that_has_cleared_a_list(commands):
    before = traces()
    hairloom.register()
    for handlers, _ in registration.handlers.HANDLERS + hair_scene.HANDLERS:
        handlers[:] = [each for each in handlers if "hairloom" not in each.__module__]
    hairloom.unregister()
    assert traces() == before


def test_disabling_goes_on_after_a_step_that_fails(commands, monkeypatch):
    before = traces()
    hairloom.register()

    def fail():
        raise RuntimeError("this one fails")

    undo = registration.look_materials.unregister
    monkeypatch.setattr(registration.look_materials, "unregister", fail)
    with pytest.RaisesGroup(pytest.RaisesExc(RuntimeError, match="this one fails")):
        hairloom.unregister()
    undo()
    assert traces() == before


def test_handlers_survive_loading_a_file(extension):
    own = [handler for _, handler in registration.handlers.HANDLERS]
    assert own
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    for handlers, handler in registration.handlers.HANDLERS:
        assert handlers.count(handler) == 1


def test_every_class_has_a_name_of_ours():
    kinds = ("PG", "OT", "PT", "FH", "MT", "RE", "AP", "UL", "GGT")
    for each in registration.CLASSES:
        assert each.__name__.startswith(tuple(f"HAIRLOOM_{kind}_" for kind in kinds))
    assert {*groups.CLASSES} <= {*registration.CLASSES}


def test_the_root_package_is_the_one_that_blender_knows():
    assert registration.ROOT_PACKAGE == "hairloom"


def test_shortcuts_are_offered_without_keys(extension):
    """They are in Blender's keymap, without keys, so that artists can assign keys."""
    keymap = bpy.context.window_manager.keyconfigs.addon.keymaps["3D View"]
    offered = {operator for operator, _ in menus.SHORTCUTS}
    ours = [item for item in keymap.keymap_items if item.idname in offered]
    assert sorted(item.idname for item in ours) == sorted(offered)
    assert all(item.type == "NONE" and item.name for item in ours)
    (pie,) = (item for item in ours if item.idname == "wm.call_menu_pie")
    assert hasattr(bpy.types, pie.properties.name)


def test_the_status_text_is_cleared_in_all_workspaces(preview, get_depsgraph, monkeypatch):
    """Blender writes the text into the context's workspace, whatever workspace is addressed."""
    statuses = {}

    def status_text_set(_workspace, text):
        statuses[bpy.context.workspace.name] = text

    monkeypatch.setattr(bpy.types.WorkSpace, "status_text_set", status_text_set)
    everywhere = [workspace.name for workspace in bpy.data.workspaces]
    assert len(everywhere) > 1
    previews.play(get_depsgraph())
    operators_preview.start_ticking()
    assert statuses == dict.fromkeys(everywhere, operators_preview.STATUS)
    operators_preview.stop_ticking()
    assert statuses == dict.fromkeys(everywhere, None)
    operators_preview.start_ticking()
    with pytest.raises(RuntimeError):
        bpy.ops.wm.open_mainfile(filepath=__file__)
    assert statuses == dict.fromkeys(everywhere, None), "nothing plays any more"


def test_a_failure_to_draw_is_forgotten_with_the_last_preview(preview, monkeypatch):
    statuses = []
    monkeypatch.setattr(overlay, "show_status", statuses.append)
    overlay._fail(ValueError("a defect"))
    bpy.app.timers.unregister(overlay._report_failure)
    overlay._report_failure()
    assert "a defect" in previews.notice() and "a defect" in statuses[-1]
    previews.stop_all()
    assert previews.notice() == "" and statuses[-1] is None
