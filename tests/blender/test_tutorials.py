"""Tutorials: their steps work literally, and their pictures exist."""

from __future__ import annotations

import re
import sys
from pathlib import Path
from typing import Any

import bpy
import numpy as np
import pytest

from hairloom.addon.blender.engine import hair_scene
from hairloom.addon.blender.preview import previews
from hairloom.addon.blender.scene.curves import curve_points

REPOSITORY = Path(__file__).resolve().parents[2]
sys.path.append(str(REPOSITORY / "tools"))
from guide_steps import TUTORIALS, tutorial, tutorial_page  # noqa: E402

pytestmark = pytest.mark.usefixtures("extension")


class Walk:
    def __init__(self, name: str, folder: Path) -> None:
        self.known: dict[str, Any] = {"bpy": bpy, "folder": str(folder), "last_frame": 3}
        self.codes = iter(tutorial(name))

    def step(self) -> Any:
        exec(compile(next(self.codes), "step", "exec"), self.known)
        bpy.context.view_layer.update()
        return self.known.get("hair")

    def rest(self) -> Any:
        for code in self.codes:
            exec(compile(code, "step", "exec"), self.known)
        return self.known["hair"]


@pytest.mark.parametrize("name", TUTORIALS)
def test_a_page_has_a_step_of_python_for_each_and_its_pictures(name: str) -> None:
    page = tutorial_page(name)
    text = page.read_text(encoding="utf-8")
    numbered = re.findall(r"^\d\. ", text, flags=re.M)
    assert 4 <= len(numbered) <= 6
    # the step in an engine has no code
    assert len(numbered) - len(tutorial(name)) == (name == "cards_into_godot")
    pictures = re.findall(r"\]\((\.\./images/\S+)\)", text)
    assert pictures and all((page.parent / each).is_file() for each in pictures)
    assert f"({name}.md)" in (page.parent / "README.md").read_text(encoding="utf-8")


@pytest.mark.parametrize("name", TUTORIALS)
def test_what_a_page_names_in_italics_is_on_a_button_or_a_field(name: str) -> None:
    """Our names in paths such as *Dynamics > Bake* are texts of the extension or of a preset."""
    text = tutorial_page(name).read_text(encoding="utf-8").partition("```")[0].replace("\n", " ")
    texts = "\n".join(
        path.read_text(encoding="utf-8") for path in (REPOSITORY / "addon").rglob("*.py")
    ) + "\n".join(path.read_text(encoding="utf-8") for path in REPOSITORY.glob("presets/*/*.json"))
    named = {part for path in re.findall(r"\*([^*]+)\*", text) for part in re.split(r" +> +", path)}
    assert len(named) > 5
    missing = {each for each in named if f'"{each}"' not in texts}
    assert missing <= BLENDERS, missing - BLENDERS


#: names of buttons in Blender and engines, and of a style's own file
BLENDERS = {
    *("Add", "Curve", "Properties", "Data", "Render", "Render Animation", "Sculpt Mode", "Comb"),
    *("EEVEE", "Cycles", "Motion Blur", "Project", "Project Settings", "Plugins", "Brows"),
    *("Hairloom", "Delete", "Edit Mode", "Object Mode"),
    "Head Hair",  # named after the head of the sample scene
}


def test_first_hair_grows_on_the_scalp_and_turns_red(tmp_path: Path) -> None:
    walk = Walk("first_hair", tmp_path)
    walk.step()
    hair = walk.step()
    short = curve_points(hair.data)
    assert len(hair.data.curves) > 800 and previews.session_of(hair) is not None
    walk.step()
    # longer hair hangs lower
    assert curve_points(hair.data)[:, 2].min() < short[:, 2].min() - 0.03
    walk.step()
    look = hair.data.hairloom.shading
    assert look.base_color[0] > 4.0 * look.base_color[1] > 16.0 * look.base_color[2]


@pytest.mark.slow(instead="test_first_hair_grows_on_the_scalp_and_turns_red")
def test_parted_hair_settles_and_is_baked(tmp_path: Path) -> None:
    walk = Walk("comb_and_play", tmp_path)
    hair = walk.step()
    sample = curve_points(hair.data)
    walk.step()
    parted = curve_points(hair.data)
    assert (np.linalg.norm(parted - sample, axis=1) > 1e-3).mean() > 0.02
    walk.rest()
    assert not np.allclose(curve_points(hair.data), parted)
    assert any(tmp_path.iterdir())


@pytest.mark.slow(instead="test_first_hair_grows_on_the_scalp_and_turns_red")
def test_cards_come_into_a_folder_of_their_own(tmp_path: Path) -> None:
    Walk("cards_into_godot", tmp_path).rest()
    names = {path.name for path in (tmp_path / "hair").iterdir()}
    assert {"hair.glb", "hair.hairloom.json"} <= names and len(names) > 3


@pytest.mark.slow(instead="test_first_hair_grows_on_the_scalp_and_turns_red")
def test_a_look_goes_to_cycles_with_its_strands(tmp_path: Path) -> None:
    hair = Walk("look_like_cycles", tmp_path).rest()
    real = next(obj for obj in bpy.context.scene.objects if obj.type == "CURVES" and obj != hair)
    assert len(real.data.curves) >= len(hair.data.curves)
    assert bpy.context.scene.render.engine == "CYCLES"
    kinds = {node.type for node in hair.data.materials[0].node_tree.nodes}
    assert "BSDF_HAIR_PRINCIPLED" in kinds


@pytest.mark.slow(instead="test_first_hair_grows_on_the_scalp_and_turns_red")
def test_hairloom_may_draw_the_hair_of_the_shot(tmp_path: Path) -> None:
    walk = Walk("eevee_shot", tmp_path)
    walk.rest()
    scene = bpy.context.scene
    assert hair_scene.problem_of(scene) == "" and scene.render.use_motion_blur
    assert any(tmp_path.iterdir())
