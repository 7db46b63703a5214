"""Random choices for actions, and helpers that perform them.

An action may be refused (its button is grey, its input is wrong), but must not raise. It announces
its step by `dice.note`.
"""

import random
from collections.abc import Callable
from contextlib import nullcontext
from pathlib import Path
from typing import Any

import bpy

#: integers are drawn from this fraction of their slider, since many strands only take long
SLIDER_FRACTION = 0.05
#: actions add no objects to more than these
MAX_OBJECTS = 12


def action(weight: int = 1) -> Callable[..., Any]:
    """A decorator that marks an action; weight: its relative frequency."""

    def mark(function: Callable[["Dice"], Any]) -> Any:
        function.weight = weight
        return function

    return mark


def actions_in(*modules: Any) -> list[Callable[["Dice"], Any]]:
    return [each for module in modules for each in vars(module).values() if hasattr(each, "weight")]


class Dice:
    """Random choices from a seed, and the folder for files."""

    def __init__(self, seed: int, folder: Path) -> None:
        self.random, self.folder = random.Random(seed), folder

    def pick(self, things: Any) -> Any:
        """A random one of these things.

        Raises:
            RuntimeError: there is none; the same error as for a refused operator.
        """
        things = list(things)
        if not things:
            raise RuntimeError("there is none")
        return self.random.choice(things)

    def happens(self, probability: float) -> bool:
        return self.random.random() < probability

    def action(self, actions: list[Callable[["Dice"], Any]]) -> Callable[["Dice"], Any]:
        return self.random.choices(actions, [each.weight for each in actions])[0]

    def note(self, text: str) -> None:
        print(f"      {text}", flush=True)

    def object(self, *types: str) -> Any:
        return self.pick(o for o in objects() if not types or o.type in types)

    def value(self, prop: Any) -> Any:
        """A random value of a property, rarely an end of its hard range."""
        if prop.type == "BOOLEAN":
            return self.happens(0.5)
        if prop.type == "ENUM":
            names = [item.identifier for item in prop.enum_items]
            return self.pick(names[:2] if names[0].isdigit() else names)
        if prop.type == "INT":
            width = max(int((prop.soft_max - prop.soft_min) * SLIDER_FRACTION), 2)
            low = prop.hard_min if self.happens(0.1) else prop.soft_min
            return self.random.randint(low, min(prop.soft_min + width, prop.hard_max))
        ends = (prop.hard_min, prop.soft_min, prop.soft_max)
        count = prop.array_length
        values = [
            self.pick(ends) if self.happens(0.1) else self.random.uniform(*ends[1:])
            for _ in range(max(count, 1))
        ]
        return values if count else values[0]


def objects() -> list[Any]:
    """The objects of the view layer, without the gaps that it has right after a removal."""
    return [obj for obj in bpy.context.view_layer.objects if obj is not None]


def views() -> list[Any]:
    return [area for area in bpy.context.window.screen.areas if area.type == "VIEW_3D"]


def viewport_context() -> Any:
    """A context as with the pointer in the 3D view, if there is one."""
    if not views():
        return nullcontext()
    area = views()[0]
    region = next(each for each in area.regions if each.type == "WINDOW")
    return bpy.context.temp_override(area=area, region=region)


def call(dice: Dice, operator: str, *arguments: Any, **settings: Any) -> None:
    dice.note(f"{operator} {' '.join(map(str, arguments))} {settings or ''}")
    module, name = operator.split(".")
    with viewport_context():
        getattr(getattr(bpy.ops, module), name)(*arguments, **settings)


def press_button(dice: Dice, operator: str, **settings: Any) -> None:
    """Call an operator as a button does: with an undo step, and long work in the window."""
    call(dice, operator, "INVOKE_DEFAULT", True, **settings)


def select(obj: Any) -> None:
    for other in bpy.context.selected_objects:
        other.select_set(False)
    obj.select_set(True)
    bpy.context.view_layer.objects.active = obj


def push_undo_step(name: str) -> None:
    """Push an undo step for a script's changes; without one, Blender can crash when it undoes past
    them."""
    bpy.ops.ed.undo_push(message=name)


def press(key: str, **modifiers: bool) -> Any:
    window, area = bpy.context.window, views()[0] if views() else bpy.context.window.screen.areas[0]
    position = {"x": area.x + area.width // 2, "y": area.y + area.height // 2}
    window.event_simulate("MOUSEMOVE", "NOTHING", **position)
    yield 0.2
    for value in ("PRESS", "RELEASE"):
        bpy.context.window.event_simulate(key, value, **position, **modifiers)
        yield 0.2
