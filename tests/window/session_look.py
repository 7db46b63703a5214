"""The look on screen: hair shows a radiance as Blender does, in each shading mode and with each
view transform; a scene without light; a slider that is refined; the panels of both models."""

import sys
from dataclasses import replace
from pathlib import Path

import bpy
import numpy as np
from bpy_extras.view3d_utils import location_3d_to_region_2d
from mathutils import Vector

sys.path.append(str(Path(__file__).parent))
import driver
from artist import (
    _rectangle,
    click,
    look_from_front,
    open_our_sidebar,
    press,
    region,
    sidebar_button,
    viewport,
    wait_for_hair,
)
from driver import hairloom_module, wait_until

#: places of Blender's picture of a radiance, and of ours, for the hair's root and tip
PLANES = ((-0.25, 0.0, -0.12), (-0.25, 0.0, 0.12))
HAIR = ((0.25, 0.0, -0.12), (0.25, 0.0, 0.12))
#: radiance of the world, colour of the root, colour of the tip
LIT = ((0.5, (1.0, 0.4, 0.1), (0.04, 0.024, 0.012)), (2.0, (0.8, 0.45, 0.25), (0.09, 0.09, 0.09)))
#: [code values] for the error of the table, and rounding of both to 8 bits
TOLERANCE = 2.0
NO_LIGHT = 0.0
#: shading of the viewport, and whether the scene's lights and its world are used. A commit tests
#: the first four.
MODES = (
    ("SOLID", True, True),
    ("RENDERED", True, False),
    ("RENDERED", False, False),
    ("MATERIAL", False, False),
    ("RENDERED", False, True),
    ("MATERIAL", True, False),
)
#: difference of a popup's pixels, their minimum number, and distance [pixels] of the first picture
#: from the popup's corner
SEEN, POPUP_PIXELS, IN_CORNER = 8, 20_000, 40
#: maximum of the popup's colour in any channel
DARK = 36
#: minimum number of pink pixels in a picture of the look Dyed
PINK_PIXELS = 20


def session():
    (one,) = hairloom_module("previews").sessions()
    return one


def shading():
    return viewport().spaces.active.shading


def color_at(picture, place, reach=6):
    """The screen's colour at a place in the scene, in code values 0 to 255."""
    view = region("WINDOW")
    x, y = location_3d_to_region_2d(view, viewport().spaces.active.region_3d, Vector(place))
    x, y = int(x) + view.x, int(y) + view.y
    return 255.0 * np.median(
        _rectangle(picture, x - reach, x + reach, y - reach, y + reach), (0, 1)
    )


def apart(label):
    """The largest difference between hair and planes, Blender's colours of the planes, and those of
    the hair."""
    picture = driver.screenshot(label)
    theirs = np.array([color_at(picture, place) for place in PLANES])
    ours = np.array([color_at(picture, place) for place in HAIR])
    difference = np.abs(theirs - ours).max()
    print(f"{label}: {difference:.1f}; Blender {theirs.tolist()} hair {ours.tolist()}", flush=True)
    return difference, theirs, ours


def agree(label, tolerance=TOLERANCE):
    """Wait, while EEVEE compiles and draws, until hair and planes show the same colours, which are
    also those that Blender saves for these radiances."""
    yield
    shown = []

    def is_so():
        difference, theirs, _ = apart(label)
        shown.append(theirs)
        return max(difference, np.abs(theirs - saved()).max()) <= tolerance

    yield from wait_until(is_so, f"{label}: the hair is of another colour than the planes")
    return shown[-1]


def saved():
    """Code values of the planes' radiances in a picture saved by Blender, for this view's mode."""
    transform = hairloom_module("view_transform")
    view, gain, gamma = transform.view_of(shading(), bpy.context.scene)
    nodes = [material.node_tree.nodes["Emission"] for material in bpy.data.materials]
    radiances = np.float32([node.inputs["Color"].default_value[:3] for node in nodes])
    return 255.0 * transform.apply_view_transform(view, gain * radiances) ** (1.0 / gamma)


def steps():
    yield from press("ESC")  # the splash screen takes the first event
    driver.enable_extension()
    yield from set_the_scene()
    yield from radiance_by_view_transforms()
    yield from every_mode_has_its_transform()
    yield from a_scene_without_light()
    yield from a_slider_is_refined()
    yield from own_presets()
    yield from the_panels_of_both_models()
    assert hairloom_module("overlay").failure() == ""
    assert hairloom_module("view_transform").problem() == ""


def set_the_scene():
    """Planes that emit a radiance, and a ribbon of hair that has the same radiance in the world's
    light."""
    bpy.data.batch_remove([*bpy.data.objects, *bpy.data.materials])
    for place in PLANES:
        bpy.ops.mesh.primitive_plane_add(size=0.2, location=place, rotation=(np.pi / 2.0, 0.0, 0.0))
        material = bpy.data.materials.new("Emission")
        tree = material.node_tree
        tree.nodes.clear()
        emission = tree.nodes.new("ShaderNodeEmission")
        output = tree.nodes.new("ShaderNodeOutputMaterial")
        tree.links.new(emission.outputs[0], output.inputs["Surface"])
        bpy.context.object.data.materials.append(material)
        bpy.context.object.select_set(False)
    scene = bpy.context.scene
    scene.render.preview_pixel_size, scene.eevee.taa_samples = "8", 1  # no more than is needed
    curves = bpy.data.hair_curves.new("Hair")
    curves.add_curves([2])
    curves.position_data.foreach_set("vector", np.float32([0.25, 0, -0.2, 0.25, 0, 0.2]))
    radius = curves.attributes.new("radius", "FLOAT", "POINT")
    radius.data.foreach_set("value", np.float32([0.1, 0.1]))
    hair = bpy.data.objects.new("Hair", curves)
    bpy.context.collection.objects.link(hair)
    hair.select_set(True)
    bpy.context.view_layer.objects.active = hair
    look, curves.hairloom.widths.method = curves.hairloom.shading, "own"
    look.model = "kajiya_kay"
    look.color_variation, look.tip_tint, look.tint_start, look.tint_end = 0.0, 1.0, 0.5, 0.5
    curves.hairloom.ambient.strength = 0.0
    overlays = viewport().spaces.active.overlay
    overlays.show_floor = overlays.show_cursor = overlays.show_object_origins = False
    look_from_front(1.2)
    yield from open_our_sidebar()
    yield from click(*sidebar_button("hairloom.preview"))
    yield from wait_for_hair()
    yield
    hair.select_set(False)  # no outline
    assert session().snapshot.lights == ()


def shine(world, *colors):
    """Set the world's radiance and the hair's colours, and the same radiances for the planes."""
    look = bpy.data.objects["Hair"].data.hairloom.shading
    look.base_color, look.tip_color = colors
    for material, color in zip(bpy.data.materials, colors, strict=True):
        emission = material.node_tree.nodes["Emission"]
        emission.inputs["Color"].default_value = (*(world * np.array(color)), 1.0)
    background = next(n for n in bpy.context.scene.world.node_tree.nodes if n.type == "BACKGROUND")
    background.inputs["Color"].default_value = (world, world, world, 1.0)


def radiance_by_view_transforms():
    shading().type = "RENDERED"
    settings = bpy.context.scene.view_settings
    for transform in ("Standard", "AgX"):
        settings.view_transform = transform
        own = float(transform == "AgX")
        for exposure in (own,) if driver.IS_COMMIT else (0.0, 1.0):
            settings.exposure = exposure
            shine(*LIT[int(exposure) if transform == "Standard" else 1 - int(exposure)])
            yield from agree(f"{transform}-{exposure:+.0f}".lower())
    settings.look, settings.gamma, settings.use_white_balance = "AgX - Punchy", 1.3, True
    settings.white_balance_temperature = 5000.0
    yield from agree("gamma-and-white-balance", TOLERANCE + 1.0)
    settings.look, settings.use_white_balance = "None", False
    settings.gamma, settings.exposure = 1.0, 0.0


def every_mode_has_its_transform():
    """The light on hair is fixed here, so that modes with other lights are comparable."""
    overlay, view, scene = hairloom_module("overlay"), shading(), bpy.context.scene
    lit, settings, (world, color, _) = overlay.with_view_lights, scene.view_settings, LIT[0]
    overlay.with_view_lights = lambda snapshot, *_: replace(
        snapshot, lights=(), ambient=(world,) * 3
    )
    shine(world, color, color)
    for each in (view, scene.display.shading):
        each.light, each.color_type = "FLAT", "SINGLE"
        each.single_color = world * np.array(color)
    settings.view_transform, settings.look = "AgX", "AgX - Medium High Contrast"
    settings.exposure, settings.gamma = 1.0, 1.2
    shown = {}
    for kind, lights, uses_world in MODES[: 4 if driver.IS_COMMIT else None]:
        view.type = kind
        view.use_scene_lights_render = view.use_scene_lights = lights
        view.use_scene_world_render = view.use_scene_world = uses_world
        label = f"{kind}{'-lights' * lights}{'-world' * uses_world}".lower()
        shown[label] = yield from agree(label)
    assert np.abs(shown["rendered"] - shown["rendered-lights"]).max() > 20.0
    assert np.abs(shown["rendered"] - shown["solid-lights-world"]).max() > 3.0
    engine, scene.render.engine, view.type = scene.render.engine, "BLENDER_WORKBENCH", "RENDERED"
    yield from agree("workbench")
    scene.render.engine = engine
    view.use_scene_lights_render = view.use_scene_world_render = True
    settings.look, settings.exposure, settings.gamma = "None", 0.0, 1.0
    overlay.with_view_lights = lit


def a_scene_without_light():
    """Then studio lights are used and the artist is informed; an added light replaces them."""
    shading().type = "RENDERED"
    shine(NO_LIGHT, *LIT[1][1:])
    yield

    def is_lit_by_a_studio():
        _, theirs, ours = apart("no-light")
        return theirs.max() < 5.0 and ours.max() > 40.0

    yield from wait_until(is_lit_by_a_studio, "hair is black")
    assert any("no light" in warning for warning in session().warnings)
    bpy.ops.object.light_add(type="SUN", rotation=(np.pi / 2.0, 0.0, 0.0))
    bpy.context.object.data.energy = 1.0
    yield
    assert not any("no light" in warning for warning in session().warnings)
    bpy.data.objects.remove(bpy.context.object)
    yield
    assert any("no light" in warning for warning in session().warnings), "it shines on"


def a_slider_is_refined():
    tables = hairloom_module("tables")
    look = bpy.data.objects["Hair"].data.hairloom.shading
    bpy.ops.object.light_add(type="SUN", rotation=(np.pi / 2.0, 0.0, 0.0))
    bpy.context.object.data.energy = 10.0
    look.model, look.base_color, look.tip_tint = "marschner", (0.25, 0.13, 0.06), 0.0
    look.volume_shadow = 0.0  # one strand has no side that faces away
    yield
    for width in (0.12, 0.14):
        look.width_r = width
        assert session().snapshot.table_size == tables.PREVIEW_SIZE
        yield 1
    driver.screenshot("coarse")
    yield
    assert session().snapshot.table_size == tables.DEFAULT_SIZE
    assert color_at(driver.screenshot("refined"), HAIR[0]).max() > 40.0


def own_presets():
    """Saved in the extension's user folder, shown with a picture, deleted."""
    presets = hairloom_module("presets")
    folder = presets.own_folder()
    assert "extensions" in folder.parts and presets.own_presets("shading") == ((), ())
    assert bpy.ops.hairloom.save_preset(title="Mine") == {"FINISHED"}
    (folder / "broken.json").write_text("{")
    image = bpy.data.images.new("Picture", 128, 128, float_buffer=True)
    image.pixels.foreach_set(np.tile(np.float32([0.6, 0.3, 0.1, 1.0]), 128 * 128))
    image.file_format = "PNG"
    image.save(filepath=str(folder / "mine.png"))
    (entry,), (warning,) = presets.own_presets("shading")
    assert entry.icon > 0 and warning.startswith("broken.json")
    chosen = bpy.context.window_manager.hairloom_presets
    assert chosen.shading == entry.name
    yield from open_our_sidebar()
    driver.screenshot("presets")
    assert bpy.ops.hairloom.delete_preset(name=entry.name) == {"FINISHED"}
    (folder / "broken.json").unlink()
    assert list(folder.iterdir()) == []


def the_panels_of_both_models():
    """Properties > Data with every section of Look open shows only effective settings."""
    hair = bpy.data.objects["Hair"]
    bpy.context.view_layer.objects.active = hair
    hair.select_set(True)
    shader = bpy.data.materials.new("Hair").node_tree
    node = shader.nodes.new("ShaderNodeBsdfHairPrincipled")
    shader.links.new(node.outputs[0], shader.get_output_node("ALL").inputs["Surface"])
    hair.data.materials.append(bpy.data.materials["Hair"])
    panels = [p for p in hairloom_module("registration").CLASSES if "_PT_data" in p.__name__]
    for each in reversed(panels):
        bpy.utils.unregister_class(each)
    for each in panels:
        is_open = each.__name__.startswith(("HAIRLOOM_PT_data_look",)) or each is panels[0]
        each.bl_options = set() if is_open else {"DEFAULT_CLOSED"}
        bpy.utils.register_class(each)
    bpy.context.preferences.view.ui_scale = 0.7
    properties = next(a for a in bpy.context.screen.areas if a.type == "PROPERTIES")
    properties.spaces.active.context = "DATA"
    with bpy.context.temp_override(area=properties):
        bpy.ops.screen.screen_full_area(use_hide_panels=False)
    yield
    look = hair.data.hairloom.shading
    for model, pigment in (
        ("kajiya_kay", "color"),
        ("marschner", "color"),
        ("marschner", "melanin"),
        ("marschner", "absorption"),
    ):
        look.model, look.pigment = model, pigment
        yield
        driver.screenshot(f"panel-{model}-{pigment}")
    assert bpy.ops.hairloom.look_from_material() == {"FINISHED"}
    assert look.model == "marschner" and look.pigment == "color"
    yield from a_picture_is_a_button(hair)


def a_picture_is_a_button(hair):
    """A click on the picture of the hair's preset shows all pictures, a click on one applies it,
    and one undo restores the look."""
    presets = hairloom_module("presets")
    bpy.ops.hairloom.apply_preset("EXEC_DEFAULT", True, name="looks/dyed")
    yield from wait_until(lambda: _pink(driver.screenshot("picture")), "no picture of the look")
    before = driver.screenshot("picture")
    yield from click(*_pink(before))
    corner = yield from _steady(lambda: _changed_corner(before), "no pictures to choose from")
    yield from click(*corner)
    chosen = bpy.context.window_manager.hairloom_presets
    yield from wait_until(lambda: chosen.shading != "looks/dyed", "no picture was clicked")
    name = chosen.shading
    assert name.startswith("looks/"), name
    entry = presets.matching_preset(hair, presets.shipped_presets("shading"))
    assert entry is not None and entry.name == name
    bpy.ops.ed.undo()
    yield
    assert bpy.context.window_manager.hairloom_presets.shading == "looks/dyed"


def _steady(look, message):
    """The result of `look`, once it is the same in two successive redraws."""
    last = None

    def is_steady():
        nonlocal last
        before, last = last, look()
        return last is not None and last == before

    yield from wait_until(is_steady, message)
    return last


def _pink(screen):
    """The middle of the hair in the picture of the look Dyed, the only pink thing on screen; None
    before Blender has loaded that picture."""
    red, green, blue = np.moveaxis(screen[:, : screen.shape[1] // 4].astype(int), 2, 0)
    rows, columns = np.nonzero((red > green + 60) & (blue > green + 20))
    if len(rows) < PINK_PIXELS:
        return None
    return int(np.median(columns)), len(screen) - int(np.median(rows))


def _changed_corner(before):
    """A pixel in the lower left picture of the popup; None before it opens.

    The popup is darker than everything else. It opens above or below the button.
    """
    now = driver.screenshot("pictures").astype(int)
    is_popup = (np.abs(now - before).max(axis=2) > SEEN) & (now.max(axis=2) < DARK)
    rows, columns = np.nonzero(is_popup)
    if len(rows) < POPUP_PIXELS:
        return None
    return int(columns.min()) + IN_CORNER, len(now) - int(rows.max()) + IN_CORNER


driver.play_session(steps())
