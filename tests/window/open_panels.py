"""Hairloom's panels, open and shown on demand, for pictures."""

import bpy
from driver import hairloom_module

OUR_PREFIX, SIDEBAR = "HAIRLOOM_PT_", "HAIRLOOM_PT_sidebar"

#: panels that are shown, and those of them that draw their content
visible_panels: set[str] = set()
filled_panels: set[str] = set()
drawn_panels: set[str] = set()


def our_panels():
    return [
        each
        for each in hairloom_module("registration").CLASSES
        if each.__name__.startswith(OUR_PREFIX)
    ]


def only_our_panels():
    """Open all our panels, to be shown on demand, and remove Blender's own in the same tabs."""
    for each in all_panels(bpy.types.Panel):
        is_here = getattr(each, "bl_context", "") in ("data", "physics")
        if is_here and each.is_registered and not each.__name__.startswith(OUR_PREFIX):
            bpy.utils.unregister_class(each)
    for each in reversed(our_panels()):
        bpy.utils.unregister_class(each)
    for each in our_panels():
        each.poll, each.draw = classmethod(poll_if_visible(each)), draw_if_filled(each)
        each.bl_options = set()
        bpy.utils.register_class(each)


def all_panels(parent):
    """All subclasses of a panel, parents last, since they cannot be unregistered before their
    subclasses."""
    found = []
    for each in parent.__subclasses__():
        found += [*all_panels(each), each]
    return dict.fromkeys(found)


def poll_if_visible(panel):
    original, name = getattr(panel, "poll", lambda _context: True), panel.__name__
    return lambda _cls, context: name in visible_panels and original(context)


def draw_if_filled(panel):
    """A draw function that draws nothing if the panel is only shown as a parent."""
    original, name = panel.draw, panel.__name__

    def draw(self, context):
        if name in filled_panels:
            original(self, context)
            drawn_panels.add(name)

    return draw


def show_panels(names):
    """Show these panels with their content, and their parents empty."""
    parents = {each.__name__: getattr(each, "bl_parent_id", "") for each in our_panels()}
    filled_panels.clear()
    filled_panels.update(names)
    visible_panels.clear()
    visible_panels.add(SIDEBAR)  # without it, the sidebar would switch to another tab
    for name in names:
        while name.startswith(OUR_PREFIX):
            visible_panels.add(name)
            name = parents[name]
    for area in bpy.context.screen.areas:
        for each in area.regions:  # not the view, whose hair is slow to draw
            if each.type == ("UI" if area.type == "VIEW_3D" else "WINDOW"):
                each.tag_redraw()


def register_as_open(panel):
    """Register a panel and its children again as open: Blender keeps the state of drawn panels."""
    classes = hairloom_module("registration").CLASSES
    chosen = [each for each in classes if each.__name__.startswith(panel)]
    for each in reversed(chosen):
        bpy.utils.unregister_class(each)
    for each in chosen:
        each.bl_options = set() if each.__name__ == panel else each.bl_options
        bpy.utils.register_class(each)
