"""The rules of the house: which room may import which, and that imports never run in a circle.

The rooms within `blender/` stand in an order, and each imports only from those before it.
"""

from __future__ import annotations

import ast
import graphlib
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

ADDON = Path(__file__).parents[2] / "addon"
BLENDER = {"bpy", "bmesh", "bpy_extras", "addon_utils", "blf", "imbuf", "mathutils"}

#: modules that stand beside the rooms: the ground floor, and the flows over the pure rooms
GROUND = {"errors", "arrays"}
PURE = {"params", "strands", "groom", "dynamics", "refine", "shading", "cards", "exchange"}
FLOWS = {"pipeline", "card_flow", "parameters"}

#: The rooms of blender/, in the order of the data: properties say what is read from the scene with
#: its colliders and bakes; cards and strands leave it; a session moves it, the viewport shows it,
#: the preview keeps both in step with Blender; pictures and the engine draw it; setup begins with
#: it, and the command line calls it all.
BLENDER_ROOMS = (
    "base",
    "properties",
    "scene",
    "colliders",
    "bakes",
    "cards",
    "strands",
    "sessions",
    "viewport",
    "preview",
    "pictures",
    "engine",
    "setup",
    "command_line",
)

#: room -> what it may import, beside itself, the ground floor, the standard library and numpy
MAY_IMPORT: dict[str, set[str]] = {
    "errors": set(),
    "arrays": set(),
    "params": set(),
    "strands": {"params"},
    "groom": {"params", "strands"},
    "dynamics": {"params", "strands"},
    "refine": {"params", "strands"},
    "shading": {"params", "strands"},
    "cards": {"params", "strands"},
    "exchange": {
        "params",
        "strands",
        "cards",
        "OpenImageIO",
        "etcpak",
        "alembic3d",
        "imath",
        "pxr",
    },
    "pipeline": PURE,
    "card_flow": PURE | {"pipeline"},
    "parameters": PURE,
    "render": PURE | {"gpu"},
    **{f"blender.{room}": PURE | FLOWS | {"render", "gpu"} | BLENDER for room in BLENDER_ROOMS},
    "ui": {"params", "parameters", "strands", "blender"} | BLENDER,
    "registration": {"blender", "ui"} | BLENDER,
    "__init__": {"registration"},
}


def module_name(file: Path, addon: Path = ADDON) -> str:
    return ".".join(file.relative_to(addon).with_suffix("").parts)


def room_of(name: str) -> str:
    """The first part of a dotted name, in blender/ the first two."""
    first, *rest = name.lstrip(".").split(".")
    return f"blender.{rest[0]}" if first == "blender" and rest and rest[0] else first


def arrow_back(room: str, target: str) -> str:
    """Why a room of blender/ may not import another; empty where it may, or is none."""
    one, other = (name.removeprefix("blender.") for name in (room, target))
    if not (room.startswith("blender.") and target.startswith("blender.")):
        return ""
    if BLENDER_ROOMS.index(other) <= BLENDER_ROOMS.index(one):
        return ""
    return f"{other} stands after {one} in the order of the rooms: move what both need down"


def imports_of(file: Path, addon: Path = ADDON) -> Iterator[tuple[int, str]]:
    """(line, name) of each import; a name inside the add-on starts with a dot."""
    package = file.relative_to(addon).parent.parts
    for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from ((node.lineno, alias.name) for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.level == 0:
            yield node.lineno, node.module or ""
        elif isinstance(node, ast.ImportFrom):
            base = package[: len(package) - (node.level - 1)]
            module = [*base, *(node.module.split(".") if node.module else [])]
            yield from ((node.lineno, "." + ".".join([*module, a.name])) for a in node.names)


def violations(addon: Path) -> list[str]:
    """Every import that the table above does not allow."""
    found = []
    for file in sorted(addon.rglob("*.py")):
        room = room_of(module_name(file, addon))
        if room == "blender.__init__":
            continue  # empty
        allowed = MAY_IMPORT[room] | GROUND | {room}
        for line, name in imports_of(file, addon):
            target = room_of(name)
            if why := arrow_back(room, target):
                found.append(f"{file.relative_to(addon)}:{line} imports {name}: {why}")
                continue
            if target.startswith("blender.") and room.startswith("blender."):
                continue
            target = target.partition(".")[0]
            external = target in sys.stdlib_module_names or target == "numpy"
            if target not in allowed and (name.startswith(".") or not external):
                found.append(f"{file.relative_to(addon)}:{line} imports {name}")
    return found


def import_graph(addon: Path) -> dict[str, set[str]]:
    """Module -> modules of the add-on that it imports."""
    modules = {module_name(file, addon): file for file in addon.rglob("*.py")}
    graph: dict[str, set[str]] = {}
    for module, file in modules.items():
        names = [name.lstrip(".") for _, name in imports_of(file, addon) if name.startswith(".")]
        graph[module] = {
            candidate
            for name in names
            for candidate in (name, name.rpartition(".")[0])
            if candidate in modules and candidate != module
        }
    return graph


def test_rooms_import_only_what_they_may() -> None:
    assert violations(ADDON) == []


def test_the_order_names_every_room_of_blender() -> None:
    folders = {path.name for path in (ADDON / "blender").iterdir() if any(path.glob("*.py"))}
    assert folders == set(BLENDER_ROOMS)


def test_imports_never_run_in_a_circle() -> None:
    try:
        list(graphlib.TopologicalSorter(import_graph(ADDON)).static_order())
    except graphlib.CycleError as error:
        pytest.fail("imports run in a circle: " + " -> ".join(error.args[1]))


def test_forbidden_imports_and_circles_are_seen(tmp_path: Path) -> None:
    """The two tests above can fail."""
    files = {
        "strands/one.py": (
            "import bpy\nimport scipy\nfrom ..blender.scene import curves\nfrom .two import x\n"
        ),
        "blender/scene/source.py": (
            "import bpy\nfrom ..preview.live import x\nfrom ..base.report import y\n"
        ),
        "strands/two.py": "import numpy\nfrom ..errors import HairloomError\nfrom .one import y\n",
    }
    for name, text in files.items():
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(text)
    assert [line.split(" imports ")[1] for line in violations(tmp_path)] == [
        ".blender.preview.live.x: preview stands after scene in the order of the rooms: "
        "move what both need down",
        "bpy",
        "scipy",
        ".blender.scene.curves",
    ]
    with pytest.raises(graphlib.CycleError):
        list(graphlib.TopologicalSorter(import_graph(tmp_path)).static_order())


def test_importing_the_pure_rooms_needs_no_blender() -> None:
    """Holds at run time too: a fresh interpreter without bpy imports every pure module."""
    modules = [
        module_name(file).removesuffix(".__init__")
        for room in sorted(PURE)
        for file in sorted((ADDON / room).rglob("*.py"))
    ]
    script = (
        "import sys, importlib\n"
        "for name in ('bpy', 'gpu', 'mathutils'): sys.modules[name] = None\n"
        f"sys.path.insert(0, {str(ADDON.parent / 'tools')!r})\n"
        "from extension_loader import load_package\n"
        "load_package()\n"
        f"for name in {modules + sorted(FLOWS)!r}:\n"
        "    importlib.import_module('hairloom.addon.' + name)\n"
    )
    subprocess.run([sys.executable, "-c", script], check=True)
