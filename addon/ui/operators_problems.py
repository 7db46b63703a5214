"""Problems: the full list of problems of the selected hair, in a popup that shifts no panel."""

from __future__ import annotations

import bpy

from ..blender.base.outcome import report
from ..blender.preview import previews
from .reports import reporting
from .selection import needs_hair, target_hair
from .state import draw_problems, problems_of
from .texts import translated

#: width of the popup, in pixels at UI scale 1
_WIDTH = 360


class HAIRLOOM_OT_show_problems(bpy.types.Operator):
    """Show the problems of the selected hair, each with a button to fix it"""

    bl_idname = "hairloom.show_problems"
    bl_label = "Problems"
    bl_options = {"INTERNAL"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return needs_hair(cls, context)

    def invoke(self, context: bpy.types.Context, _event: bpy.types.Event) -> set[str]:
        return context.window_manager.invoke_popup(self, width=_WIDTH)

    @reporting
    def execute(self, context: bpy.types.Context) -> set[str]:
        """For scripts: report all problems."""
        hair = target_hair(context)[0]
        for problem in problems_of(hair, previews.session_of(hair)):
            report(self, "WARNING", problem.text)
        return {"FINISHED"}

    def draw(self, context: bpy.types.Context) -> None:
        hair = target_hair(context)[0]
        title = translated("{name}: problems", name=hair.name)
        self.layout.label(text=title, translate=False)
        draw_problems(self.layout, context, hair, previews.session_of(hair), _WIDTH)


CLASSES = (HAIRLOOM_OT_show_problems,)
