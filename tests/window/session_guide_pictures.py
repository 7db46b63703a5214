"""The pictures of docs/user_guide.md: every open panel of ours, and the options of every file.

They are saved beside the screenshots, as guide_pictures-BACKEND-panel_NAME.png.
"""

import sys
from pathlib import Path

import bpy
import numpy as np
from bpy_extras.view3d_utils import location_3d_to_region_2d
from mathutils import Euler

sys.path.append(str(Path(__file__).parent))
import driver
from artist import (
    file_browser,
    look_from_front,
    open_our_sidebar,
    press,
    region,
    viewport,
    wait_for_still_picture,
)
from cropping import changed_box, crop, save_pictures, saved_names
from driver import wait_until
from guide_panels import OTHER_PICTURES, PICTURES, SIDEBAR_TWINS
from open_panels import (
    OUR_PREFIX,
    SIDEBAR,
    all_panels,
    drawn_panels,
    hairloom_module,
    only_our_panels,
    our_panels,
    show_panels,
    visible_panels,
)

EXPORTS = ("export_cards", "export_alembic", "export_usd", "export_tressfx", "export_hair")
#: number of equal redraws in a row after which panels have slid to their places
STILL = 6
#: [pixels] width of the Properties editor
COLUMN = 340
#: [m] distance at which hair is drawn fast
FAR = 4.0
#: [pixels] width and height of a picture of handles
HANDLES = (380, 320)
#: fraction of the window's height in pictures
USED = 0.8
#: [pixels] height of Blender's lines above an add-on's preferences, one with a local folder
BLENDERS = 228


def steps():
    yield from press("ESC")
    driver.enable_extension()
    bpy.context.preferences.view.filebrowser_display_type = "SCREEN"
    yield from nothing_yet()
    yield from the_sample_scene()
    save_pictures("window", [as_far_as_used((yield from whole_screen("window")))])
    bpy.ops.wm.read_homefile()  # panels that were drawn before stay closed
    yield
    only_our_panels()
    yield from set_the_scene(distance=FAR)
    yield from handles()
    yield from the_sidebar()
    yield from of_meshes_in_the_sidebar()
    yield from popups()
    yield from of_hair()
    yield from of_a_mesh()
    yield from of_the_engine()
    yield from options_of_files()
    yield from the_preferences()
    missing = {each.__name__ for each in our_panels()} - drawn_panels
    assert not missing, f"never opened: {missing}"
    assert saved_names == {*PICTURES, *OTHER_PICTURES}, (
        f"not the pictures that are wanted: {saved_names}"
    )


def nothing_yet():
    yield from clear()
    yield from whole_screen("start")
    save_pictures("start", [crop("start", *sidebar())])


def the_sample_scene():
    """The sample scene at rest in the default window, without the lines of its lights."""
    show_panels([SIDEBAR])
    viewport().spaces.active.overlay.show_extras = False
    with bpy.context.temp_override(area=viewport(), region=region("WINDOW")):
        bpy.ops.hairloom.sample_scene("EXEC_DEFAULT", plays=False)
    yield from wait_until(
        lambda: not hairloom_module("long_work").running_label(), "the scene does not come"
    )
    yield from wait_until(lambda: is_drawn(bpy.context.object), "the hair is not drawn")
    yield from panels_beside_it()


def set_the_scene(distance):
    """Hair on a ball, seen from this distance [m], in the default window."""
    show_panels([SIDEBAR])
    yield from clear()
    bpy.ops.mesh.primitive_uv_sphere_add(radius=0.1)
    bpy.ops.object.shade_smooth()
    bpy.context.object.name = "Head"
    bpy.ops.hairloom.grow(strand_count=4000, length=0.12)
    hair = bpy.context.object
    hair.name = "Hair"
    look_from_front(distance)
    for name in ("looks/brown", "cards/crowd", "dynamics/breeze"):
        bpy.ops.hairloom.apply_preset(name=name)
    hair.data.hairloom.children.method = "multi"
    hair.data.hairloom.shafts.use_shafts = True
    bpy.ops.hairloom.preview()
    yield from wait_until(lambda: is_drawn(hair), "the hair is not drawn")
    yield from panels_beside_it()


def panels_beside_it():
    yield
    region("UI").tag_redraw()
    properties = next(a for a in bpy.context.screen.areas if a.type == "PROPERTIES")
    properties.spaces.active.context = "DATA"
    yield


def clear():
    """Remove all objects, and overlays behind the transparent sidebar."""
    for obj in list(bpy.data.objects):
        bpy.data.objects.remove(obj)
    overlay = viewport().spaces.active.overlay
    overlay.show_floor = overlay.show_axis_x = overlay.show_axis_y = overlay.show_cursor = False
    yield from open_our_sidebar()


def is_drawn(hair, at_least=50):
    """Whether hair is drawn with its children, after the placeholder of fewer strands."""
    drawn = hairloom_module("overlay").statistics_of(hair.session_uid)
    return drawn.strands >= at_least


def as_far_as_used(screen):
    """The upper part of the window, without the empty part of the Properties editor."""
    window = bpy.context.window
    return screen[: int(USED * window.height), : window.width]


def whole_screen(label):
    """The screen once no panel slides any more."""
    return (yield from wait_for_still_picture(label, lambda: driver.screenshot(label), STILL))


def picture(name, place):
    """Take the columns of a picture, each with its open panels."""
    columns = []
    for number, names in enumerate(PICTURES[name]):
        full = [OUR_PREFIX + each for each in names]
        show_panels(full)
        place()
        yield
        yield from wait_until(
            lambda full=full: drawn_panels.issuperset(full), f"not drawn for {name}: {full}"
        )

        def column(label=f"{name}{number}", full=full):
            show_panels(full)
            return crop(label, *place())

        columns.append((yield from wait_for_still_picture(name, column, STILL)))
    save_pictures(name, columns)


def handles():
    """Take the picture of the view's handles: the wind, and the size of a colliding ball. Both are
    removed afterwards."""
    hair, view = bpy.data.objects["Hair"], viewport().spaces.active.region_3d
    look_from_front(0.9)
    view.view_rotation = Euler((np.radians(60.0), 0.0, 0.0)).to_quaternion()
    dynamics, hair.hairloom.shown_overlays = hair.hairloom.dynamics, {"wind"}
    own, dynamics.wind_speed = dynamics.wind_speed, 3.2
    yield
    pictures = [around((0.03, 0.0, 0.0), (yield from whole_screen("wind")))]
    dynamics.wind_speed, hair.hairloom.shown_overlays = own, set()
    ball, colliders = bpy.data.objects.new("Ball", None), bpy.data.collections.new("Colliders")
    ball.empty_display_type, ball.empty_display_size = "SPHERE", 0.06
    ball.location = (0.1, -0.12, 0.0)
    bpy.context.scene.collection.children.link(colliders)
    colliders.objects.link(ball)
    hair.hairloom.collider_collection = colliders
    choose(ball)
    yield
    pictures.append(around((0.06, -0.04, 0.0), (yield from whole_screen("ball"))))
    save_pictures("handles", pictures)
    bpy.data.objects.remove(ball)
    bpy.data.collections.remove(colliders)
    look_from_front(FAR)
    choose(hair)
    yield


def around(place, screen):
    """The part of the view centred on this place of the scene."""
    view = region("WINDOW")
    x, y = location_3d_to_region_2d(view, view.data, place)
    left = int(view.x + x) - HANDLES[0] // 2
    top = bpy.context.window.height - int(view.y + y) - HANDLES[1] // 2
    return screen[top : top + HANDLES[1], left : left + HANDLES[0]]


def sidebar():
    return viewport(), region("UI")


def the_sidebar():
    yield from picture("preview", sidebar)
    live = hairloom_module("previews")
    hair, head = bpy.data.objects["Hair"], bpy.data.objects["Head"]
    live.stop_all()
    hair.data.surface, hair.parent = None, None
    hair.scale.x = 1.4
    bpy.ops.hairloom.preview()
    yield from wait_until(lambda: is_drawn(hair), "the guides are not drawn")
    yield from picture("warnings", sidebar)
    hair.scale.x = 1.0
    live.stop_all()
    hair.data.surface = head
    bpy.ops.hairloom.preview()
    twins = [
        e.__name__
        for e in our_panels()
        if e.__name__.removeprefix(OUR_PREFIX).startswith(SIDEBAR_TWINS)
    ]
    for name in twins:  # their pictures are of Properties > Data
        show_panels([name])
        yield from wait_until(lambda name=name: name in drawn_panels, f"{name} is not drawn")
        yield
        driver.screenshot(f"twin_{name}")


def of_meshes_in_the_sidebar():
    head = bpy.data.objects["Head"]
    choose(head)
    hairloom_module("fin_modifier").add_modifier(head)
    yield from picture("meshes", sidebar)


def choose(obj):
    for each in bpy.context.selected_objects:
        each.select_set(False)
    obj.select_set(True)
    bpy.context.view_layer.objects.active = obj


def popups():
    """The check before an export, and the options of sorting cards."""
    hairloom_module("previews").stop_all()
    yield from popup("sort", "sort_cards")
    choose(bpy.data.objects["Hair"])
    yield from popup("check", "check_export")
    assert hairloom_module("export_check").hair_count() == 0, "the check goes on unseen"
    bpy.ops.hairloom.preview()
    yield from wait_until(lambda: is_drawn(bpy.data.objects["Hair"]), "the hair is not drawn")


def popup(name, operator, **settings):
    """Take the picture of a popup, by what changes on screen: scripts cannot see its region."""
    view = region("WINDOW")
    x, y = view.x + view.width // 2, view.y + view.height // 2
    bpy.context.window.event_simulate("MOUSEMOVE", "NOTHING", x=x, y=y)
    before = yield from whole_screen(f"before_{name}")
    with bpy.context.temp_override(area=viewport(), region=view):
        getattr(bpy.ops.hairloom, operator)("INVOKE_DEFAULT", **settings)
    yield from wait_until(
        lambda: not hairloom_module("long_work").running_label(), f"{operator} does not end"
    )
    yield
    screen = yield from whole_screen(f"part_{name}")
    save_pictures(name, [screen[changed_box(before, screen)]])
    yield from press("ESC")
    yield


def column():
    """The Properties editor in its own column, as high as the viewport."""
    area = max((a for a in bpy.context.screen.areas if a.type == "PROPERTIES"), key=height)
    return area, next(each for each in area.regions if each.type == "WINDOW")


def height(area):
    return area.height


def of_hair():
    viewport().spaces.active.show_region_ui = False
    share = 1.0 - COLUMN / viewport().width
    with bpy.context.temp_override(area=viewport(), region=region("WINDOW")):
        bpy.ops.screen.area_split(direction="VERTICAL", factor=share)
    yield
    views = [a for a in bpy.context.screen.areas if a.type == "VIEW_3D"]
    min(views, key=lambda each: each.width).type = "PROPERTIES"
    yield
    column()[0].spaces.active.context = "DATA"
    yield
    for name in ("data", "look", "grow", "shadows", "strands", "dynamics", "cards", "show"):
        if name == "dynamics":
            tied_and_baked()
        yield from picture(name, column)


def tied_and_baked():
    """A ring holds some hair, and a turn of the head is baked beside the file."""
    hair, head = bpy.data.objects["Hair"], bpy.data.objects["Head"]
    bpy.context.scene.cursor.location = (0.0, 0.0, 0.16)
    choose(hair)
    assert bpy.ops.hairloom.add_hair_tie() == {"FINISHED"}
    choose(hair)
    bpy.ops.wm.save_as_mainfile(filepath=str(Path(bpy.app.tempdir) / "shot.blend"))
    for frame, angle in ((1, 0.0), (6, 0.8), (12, -0.4)):
        head.rotation_euler.z = angle
        head.keyframe_insert("rotation_euler", frame=frame)
    bpy.context.scene.frame_end = 12
    assert bpy.ops.hairloom.bake() == {"FINISHED"}


def of_a_mesh():
    choose(bpy.data.objects["Head"])
    yield
    column()[0].spaces.active.context = "PHYSICS"
    yield from picture("physics", column)
    choose(bpy.data.objects["Hair"])


def of_the_engine():
    bpy.context.scene.render.engine = "HAIRLOOM"
    for each in all_panels(bpy.types.Panel):
        is_blenders = each.__name__.startswith("RENDER_PT") and each.is_registered
        if is_blenders and each.__name__ != "RENDER_PT_context":
            bpy.utils.unregister_class(each)
    yield from picture("engine", at_the_tab)
    bpy.context.scene.render.engine = "BLENDER_EEVEE"
    bpy.context.scene.hairloom.use_hair_scene = True
    yield from picture("hair_scene", at_the_tab)
    bpy.context.scene.hairloom.use_hair_scene = False


def at_the_tab():
    """The Properties editor at the tab of the shown panels of the engine."""
    area, window = column()
    area.spaces.active.context = (
        "VIEW_LAYER" if f"{OUR_PREFIX}engine_passes" in visible_panels else "RENDER"
    )
    return area, window


def options_of_files():
    """The options at the right of the file browser for each format; those of strands side by
    side."""
    hairloom_module("previews").stop_all()
    pictures = {}
    for name in (*EXPORTS, "import_strands"):
        settings = {"filepath": str(Path(bpy.app.tempdir) / "hair")} if name in EXPORTS else {}
        if name == "export_cards":
            settings["motion"] = "joints"
        with bpy.context.temp_override(area=viewport(), region=region("WINDOW")):
            getattr(bpy.ops.hairloom, name)("INVOKE_DEFAULT", **settings)
        yield from wait_until(lambda: file_browser() is not None, f"no options for {name}")
        yield from whole_screen(name)
        area = file_browser()
        pictures[name] = crop(name, area, next(r for r in area.regions if r.type == "TOOL_PROPS"))
        x, y = area.x + area.width // 3, area.y + area.height // 2
        bpy.context.window.event_simulate("MOUSEMOVE", "NOTHING", x=x, y=y)
        yield
        main = next(each for each in area.regions if each.type == "WINDOW")
        with bpy.context.temp_override(area=area, region=main):
            bpy.ops.file.cancel()
        yield from wait_until(lambda: file_browser() is None, "the file browser stays")
        yield
    save_pictures("export_cards", [pictures["export_cards"], pictures["import_strands"]])
    save_pictures("export_strands", [pictures[name] for name in EXPORTS[1:]])


def the_preferences():
    area = viewport()
    area.type = "PREFERENCES"
    bpy.context.preferences.active_section = "ADDONS"
    bpy.context.window_manager.addon_search = "hairloom"
    bpy.ops.preferences.addon_expand(module=driver.EXTENSION)
    yield
    assert bpy.ops.hairloom.self_test() == {"FINISHED"}
    bpy.context.window.event_simulate("MOUSEMOVE", "NOTHING", x=2, y=2)  # no tooltip
    yield from whole_screen("preferences")
    window = next(each for each in area.regions if each.type == "WINDOW")
    save_pictures("preferences", [crop("preferences", area, window)[BLENDERS:]])
    area.type = "VIEW_3D"
    yield


driver.play_session(steps())
