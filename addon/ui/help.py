"""Help: the page of the documentation about a panel, a setting or a button.

The pages come with the extension. For F1, and for *Online Manual* in the context menu, Blender
searches the manual map for a name such as `bpy.types.HAIRLOOM_PG_dynamics.gravity`, in lower case.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import bpy
from bpy.props import StringProperty

from ..errors import HairloomError
from ..parameters import ALL_SETTINGS
from .reports import reporting

_ROOT = Path(__file__).resolve().parents[2]
#: pages built into the extension's zip; a clone only has their sources
HELP, _SOURCES = _ROOT / "help", _ROOT / "docs"

#: section of the panels or of the settings -> page of docs, with the heading on it
PAGES = {section: settings.help_page for section, settings in ALL_SETTINGS.items()} | {
    "": "user_guide#the-sidebar",
    "look": "shading#look-settings",
    "shadows": "shading#shadows",
    "partings": "styling#partings",
    "trim": "styling#trim",
    "style": "dynamics#style-and-lengths",
    "medium": "dynamics#forces",
    "lengths": "dynamics#style-and-lengths",
    "shot": "dynamics#shots",
    "collisions": "dynamics#collisions",
    "ties": "dynamics#ties-and-held-tips",
    "bake": "dynamics#bakes",
    "show": "user_guide#show-and-export",
    "card_strips": "cards#from-strands-to-cards",
    "card_images": "card_textures",
    "card_object": "cards#cards-in-the-scene",
    "mesh_cards": "cards#sort-your-own-cards",
    "export": "user_guide#export-and-import",
    "hair_scene": "engine#hair-over-eevee-and-cycles",
    "passes": "engine#passes",
}
#: part of an operator's name -> page; the first that matches counts
_OPERATOR_PAGES = (
    ("export_cards", "cards_export"),
    ("export_", "strands_export"),
    ("import_", "strands_import"),
    ("hairstyle", "hairstyles"),
    ("landmarks", "hairstyles#on-your-own-head"),
    ("fit_again", "hairstyles#on-your-own-head"),
    ("grow", "styling#grow"),
    ("settle", "styling#settle"),
    ("revert_settle", "styling#settle"),
    ("parting", "styling#partings"),
    ("stroke", "styling#flow"),
    ("flow", "styling#flow"),
    ("trim", "styling#trim"),
    ("mirror", "styling#mirror"),
    ("make_cards", "cards#cards-in-the-scene"),
    ("card_", "cards#cards-by-hand"),
    ("sort_cards", "cards#sort-your-own-cards"),
    ("bake", "dynamics#bakes"),
    ("measure", "dynamics#measuring"),
    ("tie", "dynamics#ties-and-held-tips"),
    ("spheres", "dynamics#collisions"),
    ("fin_", "dynamics#cloth"),
    ("look_", "shading#from-blender-s-principled-hair"),
    ("preset", "shading#looks"),
    ("", "user_guide#the-sidebar"),
)
_FALLBACK = "user_guide"


def page_url(page: str) -> str:
    """The URL of a page such as "cards#limits"; in a clone, that of its source."""
    name, _, heading = page.partition("#")
    if not HELP.is_dir():
        return (_SOURCES / f"{name}.md").as_uri()
    url = (HELP / "docs" / f"{name}.html").as_uri()
    return f"{url}#{heading}" if heading else url


def page_of(section: str) -> str:
    """The page about a section of the panels, or else that of the first word of its name."""
    return PAGES.get(section) or PAGES.get(section.partition("_")[0], _FALLBACK)


def manual_map() -> tuple[str, tuple[tuple[str, str], ...]]:
    """The result for `bpy.utils.register_manual_map`."""
    groups = (
        (f"bpy.types.hairloom_pg_{section}.*", page_url(page))
        for section, page in PAGES.items()
        if section
    )
    operators = ((f"bpy.ops.hairloom.*{part}*", page_url(page)) for part, page in _OPERATOR_PAGES)
    return "", (*groups, *operators, ("bpy.types.hairloom_*", page_url(_FALLBACK)))


class HAIRLOOM_OT_help(bpy.types.Operator):
    """Open the documentation of this panel in the web browser; no network is needed. Press F1 over
    a setting or button for its own page"""

    bl_idname = "hairloom.help"
    bl_label = "Help"

    page: StringProperty(
        name="Page",
        description="Page and heading, such as cards#limits",
        default=_FALLBACK,
        options={"SKIP_SAVE"},
    )

    @reporting
    def execute(self, _context: bpy.types.Context) -> set[str]:
        pages = {*PAGES.values(), *(page for _, page in _OPERATOR_PAGES), _FALLBACK}
        if self.page not in pages:
            raise HairloomError(
                "there is no such page", place=self.page, remedy=f"Use {_FALLBACK}, for example"
            )
        bpy.ops.wm.url_open(url=page_url(self.page))
        return {"FINISHED"}


def draw_help(layout: bpy.types.UILayout, section: str) -> None:
    """A question mark, for the header of a panel."""
    button: Any = layout.operator("hairloom.help", text="", icon="QUESTION", emboss=False)
    button.page = page_of(section)


class WithHelp:
    """Base of a panel with a question mark in its header, before bpy.types.Panel.

    help_section: the section whose page it opens.
    """

    help_section = ""

    def draw_header_preset(self: Any, _context: bpy.types.Context) -> None:
        draw_help(self.layout, self.help_section)


CLASSES = (HAIRLOOM_OT_help,)


def register() -> None:
    bpy.utils.register_manual_map(manual_map)


def unregister() -> None:
    bpy.utils.unregister_manual_map(manual_map)
