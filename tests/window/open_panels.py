"""Hairloom's panels, open and shown on demand, for pictures."""

import bpy
from driver import of_hairloom

OURS, SIDEBAR = "HAIRLOOM_PT_", "HAIRLOOM_PT_sidebar"

#: panels that are shown, and those of them that draw their content
there: set[str] = set()
filled: set[str] = set()
drawn: set[str] = set()


def ours():
    return [each for each in of_hairloom("registration").CLASSES if each.__name__.startswith(OURS)]


def only_our_panels():
    """Open all our panels, to be shown on demand, and remove Blender's own in the same tabs."""
    for each in all_panels(bpy.types.Panel):
        is_here = getattr(each, "bl_context", "") in ("data", "physics")
        if is_here and each.is_registered and not each.__name__.startswith(OURS):
            bpy.utils.unregister_class(each)
    for each in reversed(ours()):
        bpy.utils.unregister_class(each)
    for each in ours():
        each.poll, each.draw = classmethod(polled(each)), noted(each)
        each.bl_options = set()
        bpy.utils.register_class(each)


def all_panels(parent):
    """All subclasses of a panel, parents last, since they cannot be unregistered before their
    subclasses."""
    found = []
    for each in parent.__subclasses__():
        found += [*all_panels(each), each]
    return dict.fromkeys(found)


def polled(panel):
    original, name = getattr(panel, "poll", lambda _context: True), panel.__name__
    return lambda _cls, context: name in there and original(context)


def noted(panel):
    """A draw function that draws nothing if the panel is only shown as a parent."""
    original, name = panel.draw, panel.__name__

    def draw(self, context):
        if name in filled:
            original(self, context)
            drawn.add(name)

    return draw


def show(names):
    """Show these panels with their content, and their parents empty."""
    parents = {each.__name__: getattr(each, "bl_parent_id", "") for each in ours()}
    filled.clear()
    filled.update(names)
    there.clear()
    there.add(SIDEBAR)  # without it, the sidebar would switch to another tab
    for name in names:
        while name.startswith(OURS):
            there.add(name)
            name = parents[name]
    for area in bpy.context.screen.areas:
        for each in area.regions:  # not the view, whose hair is slow to draw
            if each.type == ("UI" if area.type == "VIEW_3D" else "WINDOW"):
                each.tag_redraw()


def open_from_the_start(panel):
    """Register a panel and its children again as open: Blender keeps the state of drawn panels."""
    classes = of_hairloom("registration").CLASSES
    chosen = [each for each in classes if each.__name__.startswith(panel)]
    for each in reversed(chosen):
        bpy.utils.unregister_class(each)
    for each in chosen:
        each.bl_options = set() if each.__name__ == panel else each.bl_options
        bpy.utils.register_class(each)
