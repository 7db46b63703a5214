"""Reads the tree: imports between rooms, import circles, names that change, unused names.

tests/pure/test_house.py checks the rules; bench/house.py prints the figures.
"""

from __future__ import annotations

import ast
import graphlib
import re
import sys
from collections import Counter
from collections.abc import Iterator
from functools import cache
from pathlib import Path

REPOSITORY = Path(__file__).resolve().parents[1]
ADDON = REPOSITORY / "addon"
BLENDER_MODULES = {
    "bpy",
    "bmesh",
    "bpy_extras",
    "rna_keymap_ui",
    "addon_utils",
    "blf",
    "imbuf",
    "mathutils",
}

#: modules that every room may import; the pure rooms; and the modules over them
COMMON_MODULES = {"errors", "arrays"}
PURE = {"params", "strands", "groom", "dynamics", "refine", "shading", "cards", "exchange"}
FLOWS = {
    "rig_flow",
    "motion_flow",
    "card_flow",
    "comb_flow",
    "light_flow",
    "paint_flow",
    "settle_flow",
    "style_flow",
    "wet_flow",
    "parameters",
}

#: The rooms of blender/, in the order of the data flow: properties determine what is read from the
#: scene with its colliders and bakes; cards and strands export it; a session simulates it, the
#: viewport shows it, the preview keeps both in step with Blender; pictures and the engine draw it;
#: setup creates it, and the command line calls all of them.
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

#: room -> what it may import, beside itself, COMMON_MODULES, the standard library and numpy
MAY_IMPORT: dict[str, set[str]] = {
    "errors": set(),
    "arrays": set(),
    "params": set(),
    "strands": {"params"},
    "groom": {"params", "strands"},
    "dynamics": {"params", "strands"},
    "refine": {"params", "strands", "dynamics"},
    "shading": {"params", "strands"},
    "cards": {"params", "strands", "dynamics", "refine"},
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
    "rig_flow": PURE,
    "motion_flow": PURE | {"rig_flow"},
    "card_flow": PURE | {"rig_flow", "motion_flow", "light_flow"},
    "settle_flow": PURE | {"rig_flow", "motion_flow"},
    "comb_flow": PURE | {"rig_flow"},
    "light_flow": PURE | {"rig_flow"},
    "paint_flow": PURE | {"rig_flow", "comb_flow"},
    "style_flow": PURE | {"rig_flow", "motion_flow", "comb_flow"},
    "wet_flow": PURE,
    "parameters": PURE,
    "render": PURE | {"gpu"},
    **{
        f"blender.{room}": PURE | FLOWS | {"render", "gpu"} | BLENDER_MODULES
        for room in BLENDER_ROOMS
    },
    "ui": {"params", "parameters", "strands", "blender"}
    | BLENDER_MODULES,  # and declarations, see below
    "registration": {"blender", "ui"} | BLENDER_MODULES,
    "__init__": {"registration"},
}


def module_name(file: Path, addon: Path = ADDON) -> str:
    return ".".join(file.relative_to(addon).with_suffix("").parts)


def room_of(name: str) -> str:
    """The first part of a dotted name, in blender/ the first two."""
    first, *rest = name.lstrip(".").split(".")
    return f"blender.{rest[0]}" if first == "blender" and rest and rest[0] else first


def reversed_import(room: str, target: str) -> str:
    """Why a room of blender/ may not import another; empty if it may, or if one is no such room."""
    importer, imported = (name.removeprefix("blender.") for name in (room, target))
    if not (room.startswith("blender.") and target.startswith("blender.")):
        return ""
    if BLENDER_ROOMS.index(imported) <= BLENDER_ROOMS.index(importer):
        return ""
    return f"{imported} stands after {importer} in the order of the rooms: move what both need down"


def imports_of(file: Path, addon: Path = ADDON) -> Iterator[tuple[int, str]]:
    """(line, name) of each import; a name inside the add-on starts with a dot."""
    package = file.relative_to(addon).parent.parts
    for node in _nodes(file):
        if isinstance(node, ast.Import):
            yield from ((node.lineno, alias.name) for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.level == 0:
            yield node.lineno, node.module or ""
        elif isinstance(node, ast.ImportFrom):
            base = package[: len(package) - (node.level - 1)]
            module = [*base, *(node.module.split(".") if node.module else [])]
            yield from ((node.lineno, "." + ".".join([*module, a.name])) for a in node.names)


def is_declaration(name: str, addon: Path = ADDON) -> bool:
    """Whether a name is from a module that declares an artist's choices: settings or formats."""
    file = addon.joinpath(*name.lstrip(".").split(".")[:-1]).with_suffix(".py")
    return file.stem.endswith(("settings", "formats")) and file.is_file()


def violations(addon: Path) -> list[str]:
    """Every import that MAY_IMPORT does not allow."""
    found = []
    for file in sorted(addon.rglob("*.py")):
        room = room_of(module_name(file, addon))
        if room == "blender.__init__":
            continue  # empty
        allowed = MAY_IMPORT[room] | COMMON_MODULES | {room}
        for line, name in imports_of(file, addon):
            target = room_of(name)
            if why := reversed_import(room, target):
                found.append(f"{file.relative_to(addon)}:{line} imports {name}: {why}")
                continue
            if target.startswith("blender.") and room.startswith("blender."):
                continue
            if room == "ui" and is_declaration(name, addon):
                continue
            target = target.partition(".")[0]
            external = target in sys.stdlib_module_names or target == "numpy"
            if target not in allowed and (name.startswith(".") or not external):
                found.append(f"{file.relative_to(addon)}:{line} imports {name}")
    return found


def upward_imports(addon: Path = ADDON) -> list[str]:
    """Imports within blender/ from a room that comes later."""
    return [each for each in violations(addon) if "in the order of the rooms" in each]


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


def import_circle(addon: Path = ADDON) -> list[str]:
    """The modules of a circle of imports; empty if there is none."""
    try:
        list(graphlib.TopologicalSorter(import_graph(addon)).static_order())
    except graphlib.CycleError as error:
        return list(error.args[1])
    return []


@cache
def _nodes(file: Path) -> list[ast.AST]:
    """All syntax nodes of a module, the module itself first."""
    return list(ast.walk(ast.parse(file.read_text(encoding="utf-8"))))


#: methods that change a list, a dict or a set
_MUTATING_METHODS = {
    "append",
    "add",
    "update",
    "pop",
    "popitem",
    "clear",
    "discard",
    "remove",
    "extend",
}
_MUTATING_METHODS |= {
    "setdefault",
    "insert",
    "difference_update",
    "appendleft",
    "popleft",
    "subtract",
}


#: Upper limit of `mutable_names`.
MAX_MUTABLE = 20


def mutable_names(addon: Path = ADDON) -> list[str]:
    """Names of modules that functions rebind or whose contents are changed."""
    found = []
    for file in sorted(addon.rglob("*.py")):
        changed: set[str] = set()
        for node in _nodes(file):
            if isinstance(node, ast.Global):
                changed.update(node.names)
            elif isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute):
                if node.func.attr in _MUTATING_METHODS and isinstance(node.func.value, ast.Name):
                    changed.add(node.func.value.id)
            elif isinstance(node, ast.Subscript) and not isinstance(node.ctx, ast.Load):
                if isinstance(node.value, ast.Name):
                    changed.add(node.value.id)
            elif isinstance(node, ast.AugAssign) and isinstance(node.target, ast.Name):
                changed.add(node.target.id)
        changed &= _module_names(file) if changed else set()
        found += [f"{file.relative_to(addon)}: {name}" for name in sorted(changed)]
    return found


def _module_names(file: Path) -> set[str]:
    """Names that the module itself binds and that no function binds locally."""
    module_names: set[str] = set()
    bound_locally: set[str] = set()
    module = _nodes(file)[0]
    assert isinstance(module, ast.Module)
    for node in module.body:
        targets = node.targets if isinstance(node, ast.Assign) else [getattr(node, "target", None)]
        module_names.update(each.id for each in targets if isinstance(each, ast.Name))
    for node in _nodes(file):
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.Lambda):
            shared = {
                n for each in ast.walk(node) if isinstance(each, ast.Global) for n in each.names
            }
            arguments = node.args
            bound_locally.update(
                a.arg for a in (*arguments.posonlyargs, *arguments.args, *arguments.kwonlyargs)
            )
            bound_locally.update(
                each.id
                for each in ast.walk(node)
                if isinstance(each, ast.Name)
                and isinstance(each.ctx, ast.Store)
                and each.id not in shared
            )
    return module_names - bound_locally


#: what Blender itself calls, by name
_CALLED_BY_BLENDER = {
    "bake",
    "check",
    "description",
    "draw",
    "draw_header",
    "draw_header_preset",
    "execute",
}
_CALLED_BY_BLENDER |= {
    "invoke",
    "modal",
    "cancel",
    "poll",
    "poll_drop",
    "register",
    "unregister",
    "render",
}
_CALLED_BY_BLENDER |= {"update", "update_render_passes", "view_draw", "view_update", "filter_items"}
_CALLED_BY_BLENDER |= {"update_script_node", "draw_item", "setup", "draw_prepare"}


def unused_names(repository: Path = REPOSITORY) -> list[str]:
    """Functions, classes and methods that nothing in the add-on uses.

    Names that shaders have too do not count, nor do references: shaders and fast code are tested
    against them.
    """
    addon = repository / "addon"
    used: Counter[str] = Counter()
    defined: list[tuple[str, str]] = []
    for file in sorted(addon.rglob("*.py")):
        for node in _nodes(file):
            if isinstance(node, ast.FunctionDef | ast.ClassDef):
                defined.append((node.name, f"{file.relative_to(repository)}:{node.lineno}"))
            elif isinstance(node, ast.Name):
                used[node.id] += 1
            elif isinstance(node, ast.Attribute):
                used[node.attr] += 1
            elif isinstance(node, ast.alias) and node.asname:
                used[node.name] += 1
            elif isinstance(node, ast.keyword) and node.arg:
                used[node.arg] += 1
            elif isinstance(node, ast.Constant) and isinstance(node.value, str):
                used.update(re.findall(r"\w+", node.value) if len(node.value) < 200 else ())
    shaders = " ".join(file.read_text() for file in (repository / "gpu_shaders").rglob("*.glsl"))
    defined = [(name, place) for name, place in defined if "reference" not in place]
    of_shaders = set(re.findall(r"\w+", shaders)) | _CALLED_BY_BLENDER | set(KEPT_NAMES)
    return [
        f"{place} {name}"
        for name, place in defined
        if not used[name] and name.lstrip("_") not in of_shaders and not name.startswith("__")
    ]


#: unused names that stay, each for its reason
KEPT_NAMES = {
    "are_facing_away": "what culling by shaders is tested against",
    "are_hidden": "what culling by shaders is tested against",
    "detail_factors": "what the pieces drawn by shaders are tested against",
    "iter_strands": "what slow references in tests read strands with",
    "parameter_table": "what tools write docs/parameters.md with",
    "write_hairstyle": "what tools/make_styles.py writes the styles with",
    "points_at": "what the points drawn by shaders are tested against",
}


def files_that_list_sections(sections: dict[str, str], addon: Path = ADDON) -> list[str]:
    """Files that name two of five sections of settings, or their classes: lists to which most new
    ones would have to be added.

    Args:
        sections: section -> name of its class.
    """
    found = []
    for file in sorted(addon.rglob("*.py")):
        names: set[object] = set()
        for node in _nodes(file):
            if isinstance(node, ast.Constant):
                names.add(node.value)
            elif isinstance(node, ast.Attribute):
                names.add(node.attr)
            elif isinstance(node, ast.Name):
                names.add(node.id)
        count = max(len(names.intersection(each)) for each in (sections, sections.values()))
        if count >= 0.4 * len(sections):
            found.append(str(file.relative_to(addon)))
    return found


def renamed_arguments(addon: Path = ADDON) -> list[str]:
    """Names under "Args:" that are no arguments of the function."""
    found = []
    for file in sorted(addon.rglob("*.py")):
        functions = (node for node in _nodes(file) if isinstance(node, ast.FunctionDef))
        for function in functions:
            arguments = {node.arg for node in ast.walk(function.args) if isinstance(node, ast.arg)}
            text = (ast.get_docstring(function) or "").partition("\nArgs:\n")[2]
            for names in re.findall(r"^ {4}(\w+(?:, \w+)*): ", text.partition("\n\n")[0], re.M):
                unknown = sorted(set(names.split(", ")) - arguments)
                found += [f"{file.relative_to(addon)}: {function.name}: {name}" for name in unknown]
    return found


def addon_lines(addon: Path = ADDON) -> int:
    return sum(len(file.read_text(encoding="utf-8").splitlines()) for file in addon.rglob("*.py"))
