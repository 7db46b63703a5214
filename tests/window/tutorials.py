"""A page of docs/tutorials, played as a person would: each step is done with mouse and keys.

Clicked things are named by words of the step, and found where the window shows these words.
"""

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import bpy
import driver
import numpy as np
import screen
from artist import file_browser, press, redraw, region, wait_for_hair
from driver import hairloom_module, wait_until
from reading import Box, box_of, find_words, wait_for_words, whole_window, width_of

PAGES = Path(__file__).resolve().parents[2] / "docs" / "tutorials"
#: [pixels] around words in which an opening menu has changed the screen
CHANGED_MARGIN = 20
#: [pixels] by which the Properties editor is widened
PROPERTIES_EXTRA_WIDTH = 160
#: places of fields, and of a preset's picture, as fractions of a panel's width
FIELD_X, PICTURE_X = 0.7, 0.15
#: [pixels] from *Save* up to the middle of that picture
ABOVE_SAVE = 20
#: Blender's names of keys
_DIGITS = ("ZERO", "ONE", "TWO", "THREE", "FOUR", "FIVE", "SIX", "SEVEN", "EIGHT", "NINE")
KEYS = {str(number): name for number, name in enumerate(_DIGITS)} | {".": "PERIOD", "_": "MINUS"}
#: [pixels] from the checkbox of a panel to its name
CHECKBOX_OFFSET = 11
#: [levels of 255] redraws of the same differ by less
MAX_REDRAW_DIFFERENCE = 8


class Page:
    """The steps of a page, as plain words, and the current one."""

    def __init__(self, name: str) -> None:
        text = (PAGES / f"{name}.md").read_text(encoding="utf-8").partition("\nMore: ")[0]
        text = text.partition("\nNext: ")[0]
        found = re.split(r"^\d\. ", text, flags=re.M)[1:]
        self.steps = [" ".join(each.replace("*", "").split()) for each in found]
        self._number = 0

    def begin(self) -> Iterator[int]:
        """Prepare Blender as docs/tutorials/README.md requires."""
        yield from press("ESC")  # the splash screen
        driver.enable_extension()
        preferences = bpy.context.preferences.view
        preferences.filebrowser_display_type = "SCREEN"  # all in one window
        preferences.render_display_type = "AREA"
        view = middle(box_of(region("WINDOW")))
        yield from press_key("N", *view)
        yield from wait_until(lambda: region("UI").width > 1, "N does not open the sidebar")
        yield from click(
            *(yield from wait_for_words("Hairloom", box_of(region("UI")), is_turned=True))
        )
        yield from widen_properties()

    def step(self, number: int) -> None:
        assert number == self._number + 1, "steps are done in their order"
        self._number = number

    def end(self) -> None:
        assert self._number == len(self.steps), f"step {self._number + 1} is left out"

    def quote(self, words: str) -> str:
        step = self.steps[self._number - 1]
        assert words in step, f"step {self._number} does not say '{words}'"
        return words

    def click(self, words: str, box: Box | None = None, **options: Any) -> Iterator[int]:
        """Click words of this step where they are shown."""
        yield from click(*(yield from wait_for_words(self.quote(words), box, **options)))

    def menu(self, words: str, box: Box) -> Iterator[int]:
        """Choose a menu path of this step, with > between its words; the first is in `box`."""
        first, *others = self.quote(words).split(" > ")
        before = screen.pixels()
        yield from click(*(yield from wait_for_words(first, box)))
        yield from choose_entries(others, before)

    def right_click(self, words: str, x: int, y: int) -> Iterator[int]:
        """Right-click at a place, and choose a menu path there."""
        before = screen.pixels()
        yield from click(x, y, "RIGHTMOUSE")
        yield from choose_entries(self.quote(words).split(" > "), before)

    def mode(self, name: str, current: str) -> Iterator[int]:
        """Switch to a mode that this step names, by the menu that shows the current mode."""
        before = screen.pixels()
        yield from click(*(yield from wait_for_words(current, box_of(region("HEADER")))))
        yield from choose_entries([self.quote(name)], before)
        yield

    def sample_scene(self) -> Iterator[int]:
        """Add the sample scene by its menu entry; Esc stops its motion."""
        scene_before = bpy.context.window.scene
        path = "Add > Curve > Hairloom Sample Scene"
        yield from self.menu(path, box_of(region("HEADER")))
        yield from wait_until(
            lambda: bpy.context.window.scene != scene_before, "no sample scene comes"
        )
        yield from wait_until(lambda: bpy.context.screen.is_animation_playing, "nothing plays")
        yield from wait_until(lambda: bpy.context.scene.frame_current > 1, "the playhead stands")
        self.quote("Press Esc")
        yield from press_key("ESC", *empty_place_in_view())
        yield from wait_until(lambda: not bpy.context.screen.is_animation_playing, "it plays on")
        yield from wait_until_idle()

    def press(self, button: str, area: Any, kind: str = "WINDOW") -> Iterator[int]:
        """Press a button, to which the area is scrolled."""
        yield from click(*(yield from scroll_to(self.quote(button), area, kind)))

    def open(self, panel: str, area: Any, kind: str = "WINDOW") -> Iterator[int]:
        """Open a closed panel by a click on its name."""
        yield from click(*(yield from scroll_to(self.quote(panel), area, kind)))
        yield

    def enter(
        self, label: str, value: str, path: str, area: Any, kind: str = "WINDOW"
    ) -> Iterator[int]:
        """Enter a value in the field beside a label; path: the end of its property's data path."""
        x, y = yield from find_field_beside(self.quote(label), path, area, kind)
        yield from enter_value(value, x, y)
        yield

    def choose(
        self, label: str, entry: str, path: str, area: Any, kind: str = "WINDOW"
    ) -> Iterator[int]:
        """Choose an entry of the list beside a label, which the step need not name; path as in
        `enter`."""
        before = screen.pixels()
        yield from click(*(yield from find_field_beside(label, path, area, kind)))
        yield from choose_entries([self.quote(entry)], before)
        yield

    def tick(self, panel: str, area: Any) -> Iterator[int]:
        """Click the checkbox before a panel's name."""
        x, y = yield from scroll_to(self.quote(panel), area)
        yield from click(x - width_of(panel) // 2 - CHECKBOX_OFFSET, y)
        yield

    def render(self) -> Iterator[int]:
        """Press F12 and wait for the picture."""
        done: list[bool] = []
        handlers = bpy.app.handlers.render_complete
        handlers.append(lambda *_: done.append(True))
        self.quote("F12")
        yield from press_key("F12", *empty_place_in_view())
        yield from wait_until(lambda: done, "nothing is rendered")
        handlers.pop()
        yield

    def picture(self, panel: str, entry: str, area: Any, kind: str = "WINDOW") -> Iterator[int]:
        """Choose a preset's picture in the popup that opens from a panel's picture, left of
        *Save*."""
        self.quote("picture")
        yield from scroll_to(self.quote(panel), area, kind)
        part = region_of(area, kind)
        while not (save := heights_below(panel, "Save", box_of(part))):
            assert (yield from turn_wheel("WHEELDOWNMOUSE", part)), f"{panel} has no picture"
        before = screen.pixels()
        yield from click(part.x + int(PICTURE_X * part.width), max(save) + ABOVE_SAVE)
        yield from choose_entries([self.quote(entry)], before)
        yield


def middle(box: Box) -> tuple[int, int]:
    left, bottom, width, height = box
    return left + width // 2, bottom + height // 2


def move(x: int, y: int, count: int = 2) -> Iterator[int]:
    """Move the mouse to a place, with several events so that Blender notices."""
    for _ in range(count):
        bpy.context.window.event_simulate("MOUSEMOVE", "NOTHING", x=x, y=y)
        yield 1


def click(x: int, y: int, button: str = "LEFTMOUSE", **modifiers: bool) -> Iterator[int]:
    """Click a mouse button at a place."""
    yield from move(x, y)
    for value in ("PRESS", "RELEASE"):
        bpy.context.window.event_simulate(button, value, x=x, y=y, **modifiers)
        yield 1
    yield 1


def drag(start: tuple[int, int], end: tuple[int, int], count: int = 8) -> Iterator[int]:
    """Drag with the left mouse button from one place to another."""
    yield from move(*start)
    window, (x, y) = bpy.context.window, start
    window.event_simulate("LEFTMOUSE", "PRESS", x=x, y=y)
    yield 1
    for number in range(1, count + 1):
        x, y = (a + (b - a) * number // count for a, b in zip(start, end, strict=True))
        window.event_simulate("MOUSEMOVE", "NOTHING", x=x, y=y)
        yield 1
    window.event_simulate("LEFTMOUSE", "RELEASE", x=x, y=y)
    yield 1


def wait_until_idle() -> Iterator[int]:
    """Wait until no long work runs and the hair is made."""
    yield from wait_until(
        lambda: not hairloom_module("long_work").running_label(), "the work does not end"
    )
    yield from wait_for_hair()
    yield


def press_key(name: str, x: int, y: int, **modifiers: bool) -> Iterator[int]:
    """Press a key while the mouse is at a place."""
    yield from move(x, y)
    for value in ("PRESS", "RELEASE"):
        bpy.context.window.event_simulate(name, value, x=x, y=y, **modifiers)
        yield 1


def wait_for_new_words(words: str, before: np.ndarray, box: Box | None = None) -> Iterator[int]:
    """Wait for words that were not shown before, as in an opening menu; returns their place."""
    found: list[tuple[int, int]] = []

    def has_come_up() -> bool:
        now, height = screen.pixels(), len(before)
        differs = np.abs(now.astype(int) - before).max(axis=2) > MAX_REDRAW_DIFFERENCE
        for _, x, y in find_words(words, box or whole_window()):
            row = height - y
            around = differs[
                max(row - 4, 0) : row + 4, max(x - CHANGED_MARGIN, 0) : x + CHANGED_MARGIN
            ]
            if around.mean() > 0.3:
                found.append((x, y))
        return bool(found)

    yield from wait_until(has_come_up, f"'{words}' does not come up")
    return found[0]


def choose_entries(entries: list[str], before: np.ndarray) -> Iterator[int]:
    """Choose entries of nested menus; before: the screen without menus."""
    for each in entries:
        x, y = yield from wait_for_new_words(each, before)
        before = screen.pixels()
        yield from click(x, y)


def type_text(text: str, x: int, y: int) -> Iterator[int]:
    """Type letters and digits."""
    for letter in text:
        window, name = bpy.context.window, KEYS.get(letter, letter.upper())
        window.event_simulate(name, "PRESS", unicode=letter, x=x, y=y)
        yield 1
        window.event_simulate(name, "RELEASE", x=x, y=y)
        yield 1


def enter_value(text: str, x: int, y: int) -> Iterator[int]:
    """Type a value into the field at a place; the click selects the old value."""
    yield from click(x, y)
    yield from type_text(text, x, y)
    yield from press_key("RET", x, y)


def scroll_to(words: str, area: Any, kind: str = "WINDOW") -> Iterator[int]:
    """Scroll an area, first down and then up, until words are shown; returns their place."""
    part = region_of(area, kind)
    for wheel in (None, "WHEELDOWNMOUSE", "WHEELUPMOUSE"):
        for _ in range(1 if wheel is None else 100):
            if found := find_words(words, box_of(part)):
                return found[0][1:]
            if wheel is not None and not (yield from turn_wheel(wheel, part)):
                break
    raise AssertionError(f"'{words}' is nowhere in the {area.type} editor")


def heights_below(words: str, searched: str, box: Box) -> list[int]:
    """Heights of `searched` in a part of the window, below `words`."""
    heights = [y for _, _, y in find_words(words, box)]
    return [y for _, _, y in find_words(searched, box) if heights and y < max(heights)]


def turn_wheel(wheel: str, part: Any) -> Iterator[int]:
    """Turn the mouse wheel over a region; returns whether it has scrolled. This is not judged by
    its picture, which changes while hair plays."""
    before, (x, y) = part.view2d.region_to_view(0, 0), middle(box_of(part))
    yield from move(x, y)
    for _ in range(3):
        bpy.context.window.event_simulate(wheel, "PRESS", x=x, y=y)
        yield 1
    yield
    return part.view2d.region_to_view(0, 0) != before


def find_field_beside(label: str, path: str, area: Any, kind: str = "WINDOW") -> Iterator[int]:
    """The place of the property's field that has this label."""
    part = region_of(area, kind)
    x = part.x + int(FIELD_X * part.width)

    def heights() -> list[int]:
        return sorted((y for _, _, y in find_words(label, box_of(part))), reverse=True)

    tried = set()
    for wheel in (None, "WHEELDOWNMOUSE", "WHEELUPMOUSE"):
        for _ in range(1 if wheel is None else 100):
            for y in heights():
                yield from move(x, y, count=5)
                with bpy.context.temp_override(area=area, region=part):
                    found = bpy.context.property
                tried.add(found[1] if found else None)
                if found is not None and found[1].endswith(path):
                    return x, y
            if wheel is not None and not (yield from turn_wheel(wheel, part)):
                break
    raise AssertionError(f"'{label}' stands beside {tried}, not {path}")


def region_of(area: Any, kind: str) -> Any:
    return next(each for each in area.regions if each.type == kind)


def empty_place_in_view() -> tuple[int, int]:
    """A place in the viewport without hair."""
    view = region("WINDOW")
    return view.x + view.width // 4, view.y + view.height // 6


def find_button_below_name(words: str, area: Any) -> Iterator[int]:
    """The place of a button with the same name as its panel, next below the panel's name; the area
    is scrolled down to it."""
    part = region_of(area, "WINDOW")
    while len(places := find_words(words, box_of(part))) < 2:
        assert (yield from turn_wheel("WHEELDOWNMOUSE", part)), f"there is no button '{words}'"
    return sorted(((x, y) for _, x, y in places), key=lambda place: -place[1])[1]


def area_of(kind: str) -> Any:
    return next(area for area in bpy.context.window.screen.areas if area.type == kind)


def properties() -> Any:
    return area_of("PROPERTIES")


def save_the_file() -> Iterator[int]:
    """Save the file at the place and with the name that Blender proposes."""
    yield from press_key("S", *empty_place_in_view(), ctrl=True)
    yield from wait_until(lambda: file_browser() is not None, "no file browser opens")
    yield from redraw(file_browser())
    yield from press_key("RET", *middle(box_of(file_browser())))
    yield from wait_until(lambda: file_browser() is None, "the file browser stays")
    yield
    assert bpy.data.filepath, "the file is not saved"


def widen_properties() -> Iterator[int]:
    """Drag its edge into the viewport, so that no label is cut off and hair is drawn faster."""
    area = properties()
    before, y = area.width, area.y + area.height // 2
    yield from drag((area.x - 1, y), (area.x - 1 - PROPERTIES_EXTRA_WIDTH, y))
    yield
    assert properties().width > before, "the edge does not follow the mouse"


def open_tab(name: str) -> Iterator[int]:
    """Open a tab of the Properties editor; tabs have no words, so all are tried from the top."""
    area = properties()
    bar = region_of(area, "NAVIGATION_BAR")
    for y in range(bar.y + bar.height - 10, bar.y, -12):
        yield from click(bar.x + bar.width // 2, y)
        if area.spaces.active.context == name:
            yield
            return
    raise AssertionError(f"there is no tab {name}")


def enter_file_name(name: str) -> Iterator[int]:
    """Enter a file's name in a file browser, in the folder that it shows, and confirm."""
    browser = file_browser()
    part = region_of(browser, "EXECUTE")
    yield from enter_value(name, part.x + part.width // 4, part.y + part.height // 2)
    yield from press_key("RET", *middle(box_of(browser)))
    yield from wait_until(lambda: file_browser() is None, "the file browser stays")
