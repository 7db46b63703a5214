"""The contents of the panels that docs/user_guide.md pictures: texts, fields, their defaults and
whether they take keyframes. They are stored beside the pictures, so that a test finds outdated
pictures.

tools/guide_pictures.py writes them as it copies the pictures.
"""

import importlib
import json
import sys
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from types import SimpleNamespace
from typing import Any
from unittest import mock

import bpy
from extension_loader import PACKAGE, REPOSITORY, load_package

sys.path.append(str(REPOSITORY / "tests" / "window"))
from guide_panels import PICTURES

STORED_TEXTS = REPOSITORY / "docs" / "images" / "panels.json"
#: beginnings of the names of panels that are drawn for a mesh
MESH_PICTURES = ("collider", "fin", "sidebar_mesh_cards", "sidebar_fin")


class Recorder:
    """Replaces Blender's UILayout: records the contents, and changes nothing."""

    def __init__(self) -> None:
        self.texts: list[str] = []

    def __setattr__(self, name: str, value: Any) -> None:
        if name == "texts":
            object.__setattr__(self, name, value)

    def __getattr__(self, name: str) -> Callable[..., Any]:
        """Any other call of a layout: its text is recorded, and its result records too."""

        def call(*_: Any, text: str = "", heading: str = "", **__: Any) -> Any:
            self.texts += [each for each in (text, heading) if each]
            return self

        return call

    def panel(self, *_: Any, **__: Any) -> Any:
        return self, self

    def operator(self, name: str, text: str | None = None, **_: Any) -> Any:
        operator = getattr(bpy.ops.hairloom, name.partition(".")[2])
        self.texts.append(operator.get_rna_type().name if text is None else text)
        return SimpleNamespace()

    def prop(self, data: Any, name: str, text: str | None = None, **_: Any) -> None:
        self.texts.append(_field(data.bl_rna.properties[name], text))

    def prop_search(
        self, data: Any, name: str, *_: Any, text: str | None = None, **__: Any
    ) -> None:
        self.prop(data, name, text)


def _field(property_rna: Any, text: str | None) -> str:
    default = getattr(property_rna, "default", "")
    if getattr(property_rna, "is_array", False):
        default = [round(each, 4) for each in property_rna.default_array]
    elif isinstance(default, float):
        default = round(default, 4)
    dot = "" if property_rna.is_animatable else ", no keyframes"
    return f"{property_rna.name if text is None else text}: {default}{dot}"


@contextmanager
def _without_line_breaks() -> Iterator[None]:
    """Draw texts without line breaks, which depend on a panel's region: without a window there is
    none."""

    def draw(layout: Any, _context: Any, text: str, *_: Any, **__: Any) -> None:
        layout.label(text=text)

    rooms = [each for name, each in sys.modules.items() if name.startswith(f"{PACKAGE}.addon.ui.")]
    with ExitStack() as stack:
        for room in rooms:
            for name in ("draw_lines", "draw_message"):
                if hasattr(room, name):
                    stack.enter_context(mock.patch.object(room, name, draw))
        yield


def texts() -> dict[str, list[str]]:
    """Picture -> the contents of its panels, for new hair on a cloth mesh, which are added to the
    open scene."""
    bpy.ops.mesh.primitive_uv_sphere_add(radius=0.1)
    mesh = bpy.context.object
    bpy.ops.hairloom.fin_add()
    bpy.ops.hairloom.grow(strand_count=60, length=0.1, cv_count=8)
    hair = bpy.context.object
    with _without_line_breaks():
        by_picture = {name: list(_texts_of_picture(name, hair, mesh)) for name in PICTURES}
    preferences = importlib.import_module(f"{PACKAGE}.addon.ui.preferences").HAIRLOOM_AP_preferences
    declared = [each.keywords for each in preferences.__annotations__.values()]
    return by_picture | {
        "preferences": [f"{each['name']}: {each.get('default', '')}" for each in declared]
    }


def _texts_of_picture(name: str, hair: bpy.types.Object, mesh: bpy.types.Object) -> Iterator[str]:
    for panel in (each for column in PICTURES[name] for each in column):
        active = mesh if panel.startswith(MESH_PICTURES) else hair
        recorder, kind = Recorder(), getattr(bpy.types, f"HAIRLOOM_PT_{panel}")
        with bpy.context.temp_override(active_object=active, object=active):
            kind.draw(SimpleNamespace(layout=recorder), bpy.context)
        yield from (f"# {kind.bl_label}", *recorder.texts)


def stored_texts() -> dict[str, list[str]]:
    texts_by_picture: dict[str, list[str]] = json.loads(STORED_TEXTS.read_text(encoding="utf-8"))
    return texts_by_picture


def store_texts() -> None:
    """Store the present contents of the panels."""
    load_package().register()
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    STORED_TEXTS.write_text(json.dumps(texts(), indent=1) + "\n", encoding="utf-8")
