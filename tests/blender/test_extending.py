"""Each recipe of docs/dev/extending.md is applied literally, and its result is used."""

from __future__ import annotations

import io
import json
import re
import subprocess
import sys
import tokenize
from pathlib import Path
from typing import Any

import bpy
import pytest
from recipes import REPOSITORY, copy_with_recipes, listed_files, recipes

#: spring bones of engines have their own drag and capsules
SPRINGS = {"addon/exchange/cards/glb_springs.py"}
#: for each recipe: code that uses its result, run in a copy where all recipes are applied
USES = {
    "A collider shape": """
import numpy as np
from hairloom.addon.dynamics.colliders import PosedCollider
from hairloom.addon.dynamics.colliders.box import BoxCollider
from hairloom.addon.dynamics.reference.step import advance_reference
from hairloom.addon.dynamics.settings import DynamicsSettings
from hairloom.addon.dynamics.state import start
from hairloom.addon.dynamics.frame import Drive
from hairloom.addon.dynamics.step import advance

box = BoxCollider(np.array([0.1, 0.1, 0.05], np.float32))
along = np.linspace(0.0, 0.1, 8)[:, None]
guides = np.stack([[0.06, y, 0.1] + along * [1.0, 0.0, 0.0] for y in (-0.02, 0.02)])
guides = guides.astype(np.float32)
settings = DynamicsSettings(style_root=0.0, style_tip=0.0, bend=0.0, sag_compensation=0.0)
colliders = (PosedCollider(box, np.eye(4), np.eye(4)),)
drive = Drive(guides, guides, gravity=np.array([0.0, 0.0, -9.81]), colliders=colliders)
fast = slow = start(guides)
for _ in range(10):
    fast = advance(fast, drive, settings, 1.0 / 24.0)
    slow = advance_reference(slow, drive, settings, 1.0 / 24.0)
points = fast.grid.reshape(-1, 3).T
facts["fell"] = float(guides[:, -1, 2].mean() - fast.grid[:, -1, 2].mean())
facts["depth"] = float(-box.distance(points)[0].min())
facts["difference"] = float(np.abs(fast.position - slow.position).max())
""",
    "A look parameter": """
from hairloom.addon.parameters import ALL_SETTINGS
from hairloom.addon.params.docs import parameter_table
from hairloom.addon.params.glsl import struct_source

shading = ALL_SETTINGS["shading"]
facts["glsl"] = struct_source(shading, "ShadingSettings")
facts["page"] = parameter_table(shading)
facts["halo"] = shading.from_dict({"halo": 0.5}, "test").halo
facts["is_property"] = "halo" in bpy.data.hair_curves.new("Hair").hairloom.shading.bl_rna.properties
(row,) = (each for each in shading.parameters() if each.name == "halo")
facts["panel"] = row.panel
""",
    "A settings section": """
from hairloom.addon.blender.properties.groom_settings import GroomSettings
from hairloom.addon.errors import HairloomError
from hairloom.addon.shading.glitter_settings import GlitterSettings

data = bpy.data.hair_curves.new("Hair")
hair = bpy.data.objects.new("Hair", data)
bpy.context.collection.objects.link(hair)
data.hairloom.glitter.amount = 0.25
settings = GroomSettings.of(hair, bpy.context.evaluated_depsgraph_get())
facts["amount"] = settings[GlitterSettings].amount
facts["glsl"] = struct_source(GlitterSettings, "GlitterSettings")
facts["page"] = parameter_table(GlitterSettings)
facts["panels"] = [name for name in dir(bpy.types) if "glitter" in name.lower()]
try:
    GlitterSettings.from_dict({"amount": 2.0}, "a preset")
except HairloomError as error:
    facts["refused"] = str(error)
""",
    "A strand format": """
from pathlib import Path
from hairloom.addon.blender.command_line import command_line
from hairloom.addon.blender.strands.import_groom import FILE_KINDS
from hairloom.addon.exchange.strand_reading import read_strands
from hairloom.addon.exchange.strand_writing import write_strands
from hairloom.addon.exchange.strand_export_settings import StrandExportSettings

one, other = Path("one.strands"), Path("other.strands")
facts["code"] = command_line.run(
    ["export", "--set", "children.method=none", "--set", "grow.strand_count=40"]
    + ["--output", str(one)]
)
read = read_strands(one)
write_strands(other, read.groom, StrandExportSettings())
facts["strands"] = read.strands.strand_count
facts["is_same"] = one.read_text() == other.read_text()
facts["kinds"] = [title for title, _ in FILE_KINDS]
facts["is_in_menu"] = hasattr(bpy.types, "HAIRLOOM_OT_export_plain")
""",
    "A card format": """
facts["code"] = command_line.run(
    ["cards", "--set", "children.method=none", "--set", "grow.strand_count=60"]
    + ["--set", "cards.card_count=8", "--output", "cards.ply"]
)
facts["head"] = Path("cards.ply").read_bytes()[:3].decode()
facts["sidecars"] = len(list(Path().glob("cards*.json")))
""",
    "A verb": """
from hairloom.addon.blender.command_line import verb_docs

report = "count.json"
facts["code"] = command_line.run(["count", "--set", "grow.strand_count=50", "--report", report])
facts["report"] = json.loads(open(report).read())
facts["page"] = verb_docs.page(command_line.VERBS)
""",
}


@pytest.fixture(scope="module")
def facts(tmp_path_factory: pytest.TempPathFactory) -> dict[str, dict[str, Any]]:
    """The facts that the uses above have computed, by recipe."""
    if not bpy.app.module:
        pytest.skip("starts another Python that has bpy")
    tree = tmp_path_factory.mktemp("extended")
    copy_with_recipes(tree)
    lines = [
        "import json, sys",
        f"sys.path.insert(0, {str(tree / 'tools')!r})",
        "import bpy",
        "from extension_loader import load_package",
        "load_package().register()",
        "found = {}",
    ]
    for recipe, use in USES.items():
        lines += [f"facts = found[{recipe!r}] = {{}}", use]
    lines.append("print('FOUND ' + json.dumps(found))")
    done = subprocess.run(
        [sys.executable, "-c", "\n".join(lines)], capture_output=True, text=True, cwd=tree
    )
    assert done.returncode == 0, done.stderr
    found: dict[str, dict[str, Any]] = json.loads(done.stdout.rpartition("FOUND ")[2])
    return found


def files_with(part: str) -> set[str]:
    """Sources in which a name contains this word, or a string is this word."""
    found = set()
    for folder, kind in (("addon", "*.py"), ("gpu_shaders", "*.glsl")):
        for path in (REPOSITORY / folder).rglob(kind):
            if re.search(rf"(?<![a-z]){part}(?![a-z])", _names(path), re.IGNORECASE):
                found.add(path.relative_to(REPOSITORY).as_posix())
    return found


def _names(path: Path) -> str:
    """All names and short strings of a file in snake_case, one per line."""
    text = path.read_text(encoding="utf-8")
    if path.suffix == ".py":
        kinds = (tokenize.NAME, tokenize.STRING)
        tokens = tokenize.generate_tokens(io.StringIO(text).readline)
        words = [
            token.string for token in tokens if token.type in kinds and " " not in token.string
        ]
    else:
        words = re.findall(r"\w+", re.sub(r"//[^\n]*", "", text))
    return "\n".join(re.sub(r"([a-z])([A-Z])", r"\1_\2", word) for word in words)


def test_every_recipe_is_walked() -> None:
    assert set(recipes()) == {*USES, "A force or constraint", "A translation"}


def test_every_block_fits_the_sources(tmp_path: Path) -> None:
    copy_with_recipes(tmp_path)


def test_the_places_of_a_force_are_complete() -> None:
    others = {"addon/dynamics/constraints.py", "addon/dynamics/settings.py"}
    # Blender's force fields
    others |= {"addon/dynamics/force_fields.py", "addon/blender/scene/forces.py"}
    others |= {"gpu_shaders/lib_force_fields.glsl", "addon/wet_flow.py"}
    others |= {"addon/dynamics/settle_settings.py"}  # it sets drag to 0
    others |= SPRINGS | {"addon/cards/spring_bones.py", "addon/cards/spring_fit.py"}
    assert listed_files("A force or constraint") - others == files_with("drag") - others


def test_the_places_of_a_collider_shape_are_complete() -> None:
    others = SPRINGS | {
        "gpu_shaders/lib_collider.glsl",
        "addon/blender/colliders/scene_colliders.py",
    }
    assert listed_files("A collider shape") - others == files_with("capsule") - others


@pytest.mark.slow
def test_a_collider_shape(facts: dict[str, dict[str, Any]]) -> None:
    found = facts["A collider shape"]
    assert found["fell"] > 0.02  # it falls over the edge of the box
    assert found["depth"] < 2.0e-4
    assert found["difference"] < 1.0e-3


@pytest.mark.slow
def test_a_verb(facts: dict[str, dict[str, Any]]) -> None:
    found = facts["A verb"]
    assert found["code"] == 0
    assert found["report"]["counted"] == found["report"]["strands"] > 0
    assert "Count the strands and guides of a groom." in found["page"]


@pytest.mark.slow
def test_a_look_parameter(facts: dict[str, dict[str, Any]]) -> None:
    found = facts["A look parameter"]
    assert "float halo;" in found["glsl"]
    assert "Light around the silhouette" in found["page"]
    assert found["halo"] == 0.5
    assert found["is_property"]
    assert found["panel"] == "Second Highlight"


@pytest.mark.slow
def test_a_settings_section(facts: dict[str, dict[str, Any]]) -> None:
    found = facts["A settings section"]
    assert found["amount"] == 0.25
    assert "struct GlitterSettings" in found["glsl"]
    assert "Fraction of the strands with a flake" in found["page"]
    assert found["panels"]
    assert "amount" in found["refused"]


@pytest.mark.slow
def test_a_strand_format(facts: dict[str, dict[str, Any]]) -> None:
    found = facts["A strand format"]
    assert (found["code"], found["is_same"]) == (0, True)
    assert found["strands"] > 0
    assert "Plain Text" in found["kinds"] and found["is_in_menu"]


@pytest.mark.slow
def test_a_card_format(facts: dict[str, dict[str, Any]]) -> None:
    assert facts["A card format"] == {"code": 0, "head": "ply", "sidecars": 1}
