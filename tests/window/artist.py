"""An artist's hands and eyes in a window session: mouse and keys, and the content of the screen.

Events are sent one per tick, as Blender needs them; call generators with `yield from`. Screens are
pictures from `driver.screenshot`.
"""

import subprocess
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import bpy
import driver
import numpy as np
from bpy_extras.view3d_utils import location_3d_to_region_2d
from driver import hairloom_module, wait_until
from mathutils import Euler, Vector

#: Buttons of our panel, the first of its tab: x from the sidebar's left edge as a fraction of its
#: width, y from its top in pixels at UI scale 1.
SIDEBAR_BUTTONS = {
    "hairloom.preview": (0.45, 46),
    "hairloom.play": (0.2, 72),
    "hairloom.pause": (0.5, 72),
    "hairloom.reset": (0.8, 72),
}


def viewport() -> Any:
    """The area of the 3D viewport."""
    return next(area for area in bpy.context.window.screen.areas if area.type == "VIEW_3D")


def region(kind: str) -> Any:
    return next(each for each in viewport().regions if each.type == kind)


def press(key: str, x: int = 0, y: int = 0) -> Iterator[int]:
    """Press a key with the mouse at a pixel of the window, counted from its lower left corner."""
    window = bpy.context.window
    for value in ("PRESS", "RELEASE"):
        window.event_simulate(key, value, x=x, y=y)
        yield 1


def click(x: int, y: int) -> Iterator[int]:
    """Click the left mouse button at a pixel of the window, counted from its lower left corner."""
    window = bpy.context.window
    window.event_simulate("MOUSEMOVE", "NOTHING", x=x, y=y)
    yield 1
    yield 1  # Blender must have drawn the button as hovered
    for value in ("PRESS", "RELEASE"):
        window.event_simulate("LEFTMOUSE", value, x=x, y=y)
        yield 1
    yield 1  # the button acts after its event


def open_our_sidebar() -> Iterator[int]:
    viewport().spaces.active.show_region_ui = True
    yield
    region("UI").active_panel_category = "Hairloom"
    yield


def sidebar_button(operator: str) -> tuple[int, int]:
    """The place of a button of our panel in the window."""
    sidebar, (x_fraction, offset) = region("UI"), SIDEBAR_BUTTONS[operator]
    scale = bpy.context.preferences.system.ui_scale
    top = sidebar.y + sidebar.height
    return int(sidebar.x + x_fraction * sidebar.width), int(top - offset * scale)


def find_field(
    area: Any,
    kind: str,
    path: str,
    x_fraction: float = 0.7,
    expected: tuple[int, int] | None = None,
) -> Iterator[int]:
    """Move the mouse over a region of an area until it is on the field of a property.

    Args:
        path: the end of the property's data path.
        across: the fraction of the region's width at which the mouse moves down.
        expected: the place in the window to try first.

    Returns:
        the field's place in the window.
    """
    target_region = next(each for each in area.regions if each.type == kind)
    x = target_region.x + int(x_fraction * target_region.width)
    rows = [
        (x, y) for y in range(target_region.y + target_region.height - 5, target_region.y + 5, -12)
    ]
    # Blender notices a jump of the mouse later than a move by a row
    for x, y in ([expected] * 4 if expected else []) + rows:
        bpy.context.window.event_simulate("MOUSEMOVE", "NOTHING", x=x, y=y)
        yield 1
        with bpy.context.temp_override(area=area, region=target_region):
            found = bpy.context.property
        if found is not None and found[1].endswith(path):
            return x, y
    raise AssertionError(f"no field of {path}")


def new_head(*, keeps_light: bool = False, **shape: int) -> Any:
    """A ball of radius 0.1 m named Head, alone or with the camera and the light of a new file.

    Args:
        shape: `segments` and `ring_count` of the operator that adds it.
    """
    for obj in list(bpy.data.objects):
        if obj.type == "MESH" or not keeps_light:
            bpy.data.objects.remove(obj)
    bpy.ops.mesh.primitive_uv_sphere_add(radius=0.1, **shape)
    head = bpy.context.object
    head.name = "Head"
    return head


def new_fringe(strand_count: int) -> tuple[Any, Any, Any]:
    """A fringe above a ball, with a sun from above the eye: head, hair and sun."""
    head = new_head(segments=48, ring_count=24)
    bpy.ops.object.shade_smooth()
    group = head.vertex_groups.new(name="Crown")
    crown = [each.index for each in head.data.vertices if each.co.z > 0.075]
    group.add(crown, 1.0, "REPLACE")
    bpy.ops.hairloom.grow(
        method="normals", lift=1.0, strand_count=strand_count, length=0.08, density_group="Crown"
    )
    hair = bpy.context.object
    hair.name = "Hair"
    hair.data.hairloom.children.method = "none"
    hair.data.hairloom.strands.fullness = 3.0
    bpy.ops.object.light_add(type="SUN", rotation=(np.radians(25.0), 0.0, 0.0))
    sun = bpy.context.object
    sun.name, sun.data.energy = "Sun", 4.0
    bpy.ops.object.select_all(action="DESELECT")
    bpy.context.view_layer.objects.active = hair
    return head, hair, sun


def hide_floor() -> None:
    """Hide the floor and other overlays that Blender draws over hair and head."""
    overlays = viewport().spaces.active.overlay
    overlays.show_floor = overlays.show_cursor = overlays.show_object_origins = False


def look_from_front(distance: float) -> None:
    """Look at the origin along +Y from this distance [m]."""
    view = viewport().spaces.active.region_3d
    view.view_perspective = "PERSP"
    view.view_location = (0.0, 0.0, 0.0)
    view.view_rotation = Euler((np.pi / 2.0, 0.0, 0.0)).to_quaternion()
    view.view_distance = distance


def height_in_view(obj: Any) -> float:
    """The height of an object in the viewport, as a fraction of the viewport's height."""
    view = region("WINDOW")
    corners = (obj.matrix_world @ Vector(corner) for corner in obj.bound_box)
    places = [location_3d_to_region_2d(view, view.data, corner) for corner in corners]
    heights = [place.y for place in places if place is not None]
    return float(np.ptp(heights)) / view.height if heights else 0.0


def viewport_pixels(screen: np.ndarray) -> np.ndarray:
    """The viewport between toolbar and sidebar, (height, width, 3) in 0 to 1, top row first."""
    view, header, tools, sidebar = (region(k) for k in ("WINDOW", "HEADER", "TOOLS", "UI"))
    # the header of the tool settings and the text also overlap the view, below the header
    top = header.y - 2 * header.height
    left, right = tools.x + tools.width, sidebar.x if sidebar.width > 1 else view.x + view.width
    return _rectangle(screen, left, right, view.y, top)


def pixels(label: str) -> np.ndarray:
    """The current viewport, as `viewport_pixels`; the screenshot is saved."""
    return viewport_pixels(driver.screenshot(label))


def redrawn_pixels(label: str) -> Iterator[int]:
    """As `pixels`, once the viewport shows all changes."""
    yield
    return pixels(label)


def changed_fraction(before: np.ndarray, after: np.ndarray, threshold: float = 0.1) -> float:
    """The fraction of pixels that differ by more than Blender's anti-aliasing does."""
    return float((np.abs(after - before).max(axis=2) > threshold).mean())


def still_pixels(label: str) -> Iterator[int]:
    """As `redrawn_pixels`, once Blender has drawn all samples of its anti-aliasing."""
    return (yield from wait_for_still_picture(label, lambda: pixels(label)))


def wait_for_still_picture(
    label: str, take_picture: Callable[[], np.ndarray], count: int = 3
) -> Iterator[int]:
    """A picture that has been the same for this many redraws in a row."""
    pictures: list[np.ndarray] = []
    while len(pictures) < count or not all(
        np.array_equal(each, pictures[-1]) for each in pictures[-count:]
    ):
        assert len(pictures) < 500, f"{label} does not come to rest"
        yield
        pictures.append(take_picture())
    return pictures[-1]


def wait_for_hair() -> Iterator[int]:
    """Wait until the hair of all previews is made, which happens in a thread."""
    live = hairloom_module("previews")
    yield from wait_until(lambda: all(each.is_made for each in live.sessions()), "no hair is made")


def file_browser() -> Any:
    """The file browser's area in any window, or None."""
    windows = bpy.context.window_manager.windows
    areas = [area for window in windows for area in window.screen.areas]
    return next((area for area in areas if area.type == "FILE_BROWSER"), None)


def redraw(area: Any) -> Iterator[int]:
    """Redraw an area: Blender draws tagged areas and runs ticks once per iteration of its loop."""
    area.tag_redraw()
    yield 1
    yield 1


def confirm_file_browser(folder: Path | None = None) -> Iterator[int]:
    """Confirm a file browser that fills the window, optionally in this folder."""
    yield from wait_until(lambda: file_browser() is not None, "no file browser opens")
    yield from redraw(file_browser())
    browser = file_browser()
    if folder is not None:
        browser.spaces.active.params.directory = bytes(str(folder), "utf-8")
    # Blender closes the browser under the mouse, and crashes if it was not redrawn since its
    # folder changed
    x, y = browser.x + browser.width // 2, browser.y + browser.height // 2
    bpy.context.window.event_simulate("MOUSEMOVE", "NOTHING", x=x, y=y)
    yield from redraw(browser)
    main = next(each for each in browser.regions if each.type == "WINDOW")
    with bpy.context.temp_override(area=browser, region=main):
        bpy.ops.file.execute("INVOKE_DEFAULT")
    yield from wait_until(lambda: file_browser() is None, "the file browser stays")


def viewport_middle(screen: np.ndarray, reach: int = 20) -> np.ndarray:
    """The pixels around the middle of the view, as in `viewport_pixels`."""
    view = region("WINDOW")
    x, y = view.x + view.width // 2, view.y + view.height // 2
    return _rectangle(screen, x - reach, x + reach, y - reach, y + reach)


def arrange_side_by_side() -> None:
    """Give each window its part of the screen, so that none covers another."""
    window_ids = subprocess.run(
        ["xdotool", "search", "--onlyvisible", "--class", "blender"],
        check=True,
        capture_output=True,
        text=True,
    ).stdout.split()
    screen = subprocess.run(
        ["xdotool", "getdisplaygeometry"], check=True, capture_output=True, text=True
    ).stdout.split()
    width, height = int(screen[0]) // len(window_ids), screen[1]
    for number, window in enumerate(window_ids):
        subprocess.run(["xdotool", "windowsize", window, str(width), height], check=True)
        subprocess.run(["xdotool", "windowmove", window, str(number * width), "0"], check=True)


def area_pixels(window: Any, area: Any, screen: np.ndarray) -> np.ndarray:
    """The content of a window's area, as in `viewport_pixels`."""
    part = next(each for each in area.regions if each.type == "WINDOW")
    x, y = window.x + part.x, window.y + part.y
    return _rectangle(screen, x, x + part.width, y, y + part.height)


def _rectangle(screen: np.ndarray, left: int, right: int, bottom: int, top: int) -> np.ndarray:
    """A part of the screen, with rows counted from the bottom, as values from 0 to 1."""
    return screen[len(screen) - top : len(screen) - bottom, left:right] / 255.0
