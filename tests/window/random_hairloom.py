"""Random actions of an artist with Hairloom."""

from pathlib import Path

import addon_utils
import bpy
import driver
from dice import MAX_OBJECTS, action, call, objects, press, press_button, push_undo_step, select
from driver import hairloom_module, wait_until

SECTIONS = {
    bpy.types.Curves: ["shading", "strands", "volume", "detail", "guides", "children", "skin"]
    + ["shafts", "ambient", "cards", "atlas", "card_occlusion", "card_texture", "card_drawing"],
    bpy.types.Object: ["dynamics", "dynamics", "fin"],
}
MAX_GROOMS = 3
#: buttons that add lines and rings to hair, that remove them, each with the setting that names
#: them, that shape hair, and (REVERTS) that restore its shape
ADDING_BUTTONS = ("add_parting", "add_stroke", "add_hair_tie")
REMOVING_BUTTONS = {
    "remove_parting": "line",
    "remove_stroke": "stroke",
    "remove_hair_tie": "tie",
    "remove_trim_shape": "shape",
}
SHAPING_BUTTONS = (
    "settle",
    "comb_parting",
    "comb_flow",
    "trim_to_shape",
    "mirror_hair",
    "grow_again",
)
#: buttons that need a line, each with the button that adds one
BUTTONS_THAT_NEED_A_LINE = {"comb_parting": "add_parting", "comb_flow": "add_stroke"}
REVERTS = ("revert_settle", "revert_flow", "revert_trim")


def wait_for_long_work():
    """Wait for the end of long work, whose data a script could remove and a mouse cannot."""
    yield from wait_until(
        lambda: not hairloom_module("long_work").running_label(), "the work does not end"
    )


@action(6)
def add_groom(dice):
    grooms = [o for o in bpy.data.objects if o.type == "CURVES"]
    if len(grooms) >= MAX_GROOMS:
        bpy.data.objects.remove(grooms[0])
        push_undo_step("removed")
    if dice.happens(0.4) or not any(o.type == "MESH" for o in objects()):
        call(
            dice,
            "mesh.primitive_uv_sphere_add",
            "EXEC_DEFAULT",
            True,
            segments=16,
            ring_count=8,
            radius=0.1,
        )
    select(dice.object("MESH"))
    how = {"strand_count": dice.random.randint(2, 150), "method": dice.pick(["combed", "normals"])}
    press_button(dice, dice.pick(["hairloom.add_groom", "hairloom.grow"]), **how)
    yield from wait_for_long_work()


@action(12)
def press_a_button(dice):
    """Press a button without long work."""
    buttons = "preview play pause reset preview play pause use_groom set_surface snap_roots"
    buttons += " unwrap_surface apply_scale look_from_material mute_hair_dynamics show_settings"
    buttons += " convert_particles fin_add fin_preview fin_remove fin_reset remove_spheres"
    buttons += " bake_free check_export sort_cards show_skin_shadow measure look_to_material"
    press_button(dice, f"hairloom.{dice.pick(buttons.split())}")


@action(2)
def press_a_slow_button(dice):
    """Press a button whose work goes on in the window, until Esc or a later action ends it."""
    hair = dice.object("CURVES")
    select(hair)
    hair.hairloom.bake.folder = str(dice.folder / "bake")
    hair.hairloom.bake.use_own_range, hair.hairloom.bake.last = True, 4
    push_undo_step("range")
    press_button(dice, f"hairloom.{dice.pick(['bake', 'bake', 'make_cards', 'fit_spheres'])}")
    yield dice.pick([0.2, 1])
    yield from press("ESC")


@action(8)
def add_line_or_ring(dice):
    """Add a parting, a stroke or a tie: a selected line or ring, or a new one."""
    select(dice.object("CURVES"))
    if dice.happens(0.3):
        dice.object().select_set(True)
    if len(objects()) < MAX_OBJECTS:
        press_button(dice, f"hairloom.{dice.pick(ADDING_BUTTONS)}")


@action(2)
def remove_line_or_ring(dice):
    select(dice.object("CURVES"))
    button, setting = dice.pick(REMOVING_BUTTONS.items())
    press_button(dice, f"hairloom.{button}", **{setting: dice.object().name})


@action(12)
def shape_hair(dice):
    """Press a button that shapes hair, whose work Esc can end; trim shapes are selected too."""
    hair = dice.object("CURVES")
    select(hair)
    button = dice.pick(SHAPING_BUTTONS)
    if button == "trim_to_shape":
        dice.object("MESH", "EMPTY").select_set(True)
    if button in BUTTONS_THAT_NEED_A_LINE and dice.happens(0.7) and len(objects()) < MAX_OBJECTS:
        press_button(dice, f"hairloom.{BUTTONS_THAT_NEED_A_LINE[button]}")
    sides = {"side": dice.pick(["positive", "negative"])} if button == "mirror_hair" else {}
    press_button(dice, f"hairloom.{button}", **sides)
    if dice.happens(0.3):
        yield dice.pick([0.2, 1])
        yield from press("ESC")
    yield from wait_for_long_work()
    if dice.happens(0.5):
        press_button(dice, f"hairloom.{dice.pick(REVERTS)}")


@action(2)
def make_real(dice):
    if sum(obj.type == "CURVES" for obj in bpy.data.objects) < MAX_GROOMS:
        select(dice.object("CURVES"))
        press_button(dice, "hairloom.make_real")
        yield from wait_for_long_work()


@action(40)
def move_a_slider(dice):
    kind = dice.pick(SECTIONS)
    hair = dice.object("CURVES")
    owner = hair.data if kind is bpy.types.Curves else hair
    group = getattr(owner.hairloom, dice.pick(SECTIONS[kind]))
    prop = dice.pick(p for p in group.bl_rna.properties if p.identifier not in ("rna_type", "name"))
    if prop.is_readonly or prop.type not in ("BOOLEAN", "ENUM", "INT", "FLOAT"):
        return
    value = dice.value(prop)
    dice.note(f"{owner.name} {group.bl_rna.identifier}.{prop.identifier} = {value}")
    setattr(group, prop.identifier, value)
    push_undo_step("slider")


@action(6)
def set_an_object_property(dice):
    hair = dice.object("CURVES")
    ours = hair.hairloom
    name = dice.pick(["debug_view", "show_counts", "hide_original", "collider"])
    if name == "collider":
        ours.collider = dice.object("MESH")
    else:
        value = dice.value(ours.bl_rna.properties[name])
        dice.note(f"{hair.name} {name} = {value}")
        setattr(ours, name, value)
    ours.bake.follows, ours.bake.is_shown = dice.happens(0.5), dice.happens(0.5)
    push_undo_step("choice")


@action(4)
def apply_a_preset(dice):
    presets = Path(hairloom_module("presets").PRESET_FOLDER)
    path = dice.pick(sorted(presets.rglob("*.json")))
    name = path.relative_to(presets).with_suffix("").as_posix()
    press_button(dice, "hairloom.apply_preset", name=name)


@action(1)
def save_a_preset(dice):
    section = dice.pick(["shading", "dynamics", "cards"])
    call(dice, "hairloom.save_preset", section=section, title="Random")
    if dice.happens(0.5):
        call(dice, "hairloom.delete_preset", name="own/random")


@action(2)
def export_and_import(dice):
    formats = {"tressfx": "tfx", "hair": "hair", "alembic": "abc", "usd": "usda"}
    kind, suffix = dice.pick(formats.items())
    select(dice.object("CURVES"))
    path = str(dice.folder / f"strands.{suffix}")
    call(dice, f"hairloom.export_{kind}", filepath=path)
    if dice.happens(0.5):
        call(dice, "hairloom.import_strands", "EXEC_DEFAULT", True, filepath=path)


@action(3)
def disable_and_enable(dice):
    dice.note("the extension off")
    addon_utils.disable(driver.EXTENSION, default_set=True)
    yield dice.pick([0.2, 1])
    dice.note("the extension on")
    driver.enable_extension()


@action(2)
def switch_engine(dice):
    scene = bpy.context.scene
    scene.render.engine = dice.pick(["HAIRLOOM", "HAIRLOOM", "BLENDER_WORKBENCH"])
    dice.note(scene.render.engine)


@action(1)
def render_a_picture(dice):
    scene = bpy.context.scene
    if scene.camera is None:
        scene.camera = bpy.data.objects.new("Eye", bpy.data.cameras.new("Eye"))
        scene.collection.objects.link(scene.camera)
        scene.camera.location.y, scene.camera.rotation_euler.x = -1.0, 1.57
    scene.render.engine = "HAIRLOOM"
    scene.render.resolution_x, scene.render.resolution_y = 32, 24
    scene.hairloom.picture.samples, scene.hairloom.picture.motion_steps = 1, 2
    push_undo_step("camera")
    call(dice, "render.render")
