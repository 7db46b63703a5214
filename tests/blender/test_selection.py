"""What buttons are about, in a view layer that Blender has not put in order yet."""

import bpy

from hairloom.addon.host.cloth.fins import fins_in
from hairloom.addon.ui.selection import chosen_hair


def test_an_object_that_was_just_removed_is_no_obstacle(new_hair, sphere):
    hair = new_hair(sphere)
    other = bpy.data.objects.new("Other", None)
    bpy.context.collection.objects.link(other)
    hair.select_set(False)
    sphere.select_set(True)
    bpy.context.view_layer.objects.active = sphere
    assert other.name in bpy.context.view_layer.objects
    bpy.data.objects.remove(other)
    assert None in list(bpy.context.view_layer.objects), "Blender leaves no gap any more"
    assert chosen_hair(bpy.context) == [hair]
    assert fins_in(bpy.context.view_layer) == []
