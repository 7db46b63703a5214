"""A scene of library overrides of objects and their data."""

from pathlib import Path

import bpy


def library_overrides(folder: Path) -> list[bpy.types.Object]:
    """Save all objects of the scene in a library file, in one collection, and link them back as
    overrides, in the same order."""
    file, collection = str(folder / "library.blend"), bpy.data.collections.new("Character")
    bpy.context.scene.collection.children.link(collection)
    names = [obj.name for obj in bpy.context.scene.objects]
    for obj in bpy.context.scene.collection.objects[:]:
        collection.objects.link(obj)
        bpy.context.scene.collection.objects.unlink(obj)
    bpy.ops.wm.save_as_mainfile(filepath=file)
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    with bpy.data.libraries.load(file, link=True) as (_, data_to):
        data_to.collections = ["Character"]
    scene, layer = bpy.context.scene, bpy.context.view_layer
    bpy.data.collections["Character"].override_hierarchy_create(scene, layer)
    objects = [scene.objects[name] for name in names]
    for obj in objects:
        if obj.data is not None:
            obj.data.override_create(remap_local_usages=True)
    return objects
