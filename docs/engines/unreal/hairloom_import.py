"""Imports hair of Hairloom into Unreal: cards, and with them a groom.

    py "D:/hairloom/hairloom_import.py" "D:/hair/hair.fbx" /Game/Hair
    py "D:/hairloom/hairloom_import.py" "D:/hair/hair.fbx" /Game/Hair --groom "D:/hair/hair.abc"
        --skeletal-mesh /Game/Head/SK_Head --simulate

For Unreal 5.4 and later, with the plugins Python Editor Script Plugin and, for a groom, Groom and
Alembic Groom Importer. See docs/engines/unreal.md. It has not been run in Unreal.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import unreal

sys.path.insert(0, str(Path(__file__).parent))

from hairloom_plan import (
    CARD_SLOTS,
    CardFileError,
    Choice,
    Color,
    Graph,
    Picture,
    Plan,
    Texture,
    asset_name,
    found_triangles,
    plan_of,
)

EDIT = unreal.MaterialEditingLibrary
ASSETS = unreal.EditorAssetLibrary
#: of triangles, where meshes are built; 2 leaves them in their order, 1 is Unreal's own
ORDER = "r.TriangleOrderOptimization"
KEPT = 2
#: tag of an asset: the file that it was made of
SOURCE = "HairloomSource"
#: by which a groom follows large deformations; Unreal's own number
INTERPOLATION_POINTS = 100
#: screen size below which a groom shows its cards; a choice, to be changed in the groom
CARDS_BEGIN = 0.3


def main(arguments: Sequence[str] | None = None) -> int:
    """Imports what the command line names; 0, or 1 with one sentence in the log."""
    options = _options().parse_args(arguments)
    try:
        for sentence in import_hair(
            Path(options.mesh),
            options.folder.rstrip("/"),
            Path(options.groom) if options.groom else None,
            options.skeletal_mesh,
            options.simulate,
            options.replace,
        ):
            unreal.log_warning(sentence)
    except CardFileError as error:
        unreal.log_error(str(error))
        return 1
    unreal.log(f"{options.mesh}: imported into {options.folder}")
    return 0


def _options() -> argparse.ArgumentParser:
    options = argparse.ArgumentParser(prog="hairloom_import.py", description=__doc__)
    options.add_argument("mesh", help="the FBX file of an export")
    options.add_argument("folder", help="folder of the project's content, such as /Game/Hair")
    options.add_argument("--groom", help="a groom Alembic file of the same hair")
    options.add_argument("--skeletal-mesh", help="asset of the head to which the groom is bound")
    options.add_argument("--simulate", action="store_true", help="move the groom by its guides")
    options.add_argument("--replace", action="store_true", help="replace assets of other files")
    return options


def import_hair(
    mesh: Path,
    folder: str,
    groom: Path | None = None,
    skeletal_mesh: str | None = None,
    simulate: bool = False,
    replaces_others: bool = False,
) -> list[str]:
    """Imports cards, and a groom where one is named.

    Args:
        replaces_others: assets of the same names that were made of other files, too.

    Returns:
        Sentences about what is missing or odd.

    Raises:
        CardFileError: nothing can be shown, or assets of other files would be replaced.
    """
    plan = plan_of(mesh)
    warnings = list(plan.warnings)
    if groom is not None and not groom.is_file():
        raise CardFileError(f"{groom}: there is no such file; export the strands as .abc")
    if not replaces_others:
        names = [f"M_{plan.name}", f"SM_{plan.name}", *(each.asset for each in plan.pictures)]
        if groom is not None:
            names.append(f"M_{plan.name}_Strands")
            _check_sources([_groom_name(groom)], folder, groom)
        _check_sources(names, folder, mesh)
    for picture in plan.pictures:
        _import_picture(picture, folder, mesh)
    material = _material(f"M_{plan.name}", folder, plan.cards, is_masked=True)
    cards, found = _import_cards(plan, folder, material)
    warnings += [found] if found else []
    made = {material: mesh, cards: mesh}
    if groom is not None:
        strands = _material(f"M_{plan.name}_Strands", folder, plan.strands, is_masked=False)
        asset = _import_groom(groom, folder)
        warnings += _set_up_groom(asset, plan, folder, strands, material, cards, simulate)
        made |= {strands: mesh, asset: groom}
        if skeletal_mesh is not None:
            made[_bound(asset, skeletal_mesh, folder)] = groom
    for asset, source in made.items():
        _save(asset, source)
    return warnings


def _check_sources(names: Sequence[str], folder: str, source: Path) -> None:
    for path in (f"{folder}/{name}" for name in names):
        if not ASSETS.does_asset_exist(path):
            continue
        found = ASSETS.get_metadata_tag(ASSETS.load_asset(path), SOURCE)
        if found != str(source.resolve()):
            what = f"it was made of {found}" if found else "another asset has this name"
            raise CardFileError(f"{path}: {what}; choose another folder, or add --replace")


def _save(asset: Any, source: Path) -> None:
    ASSETS.set_metadata_tag(asset, SOURCE, str(source.resolve()))
    if not ASSETS.save_loaded_asset(asset, only_if_is_dirty=False):
        raise CardFileError(
            f"{asset.get_path_name()}: it cannot be saved; make its folder writable, or free space"
        )


def _imported(file: Path, folder: str, name: str, factory: Any, options: Any = None) -> Any:
    """The asset that Unreal has made of a file. A factory of our choice keeps Interchange out."""
    task = unreal.AssetImportTask()
    values = {
        "filename": str(file),
        "destination_path": folder,
        "destination_name": name,
        "automated": True,
        "replace_existing": True,
        "save": False,
        "factory": factory,
        "options": options,
    }
    _set(task, values)
    unreal.AssetToolsHelpers.get_asset_tools().import_asset_tasks([task])
    asset = ASSETS.load_asset(f"{folder}/{name}")
    if asset is None:
        raise CardFileError(f"{file}: Unreal cannot import it; see the log above")
    return asset


def _set(target: Any, values: dict) -> None:
    for name, value in values.items():
        target.set_editor_property(name, value)


# Textures and materials


def _import_picture(picture: Picture, folder: str, mesh: Path) -> None:
    texture = _imported(picture.file, folder, picture.asset, unreal.TextureFactory())
    address = getattr(unreal.TextureAddress, picture.address)
    values = {
        "srgb": picture.is_color,
        "compression_settings": getattr(unreal.TextureCompressionSettings, picture.compression),
        "address_x": address,
        "address_y": address,
    }
    _set(texture, values)
    _save(texture, mesh)


def _material(name: str, folder: str, graph: Graph, is_masked: bool) -> Any:
    path = f"{folder}/{name}"
    if ASSETS.does_asset_exist(path):
        material = ASSETS.load_asset(path)
        EDIT.delete_all_material_expressions(material)
    else:
        tools = unreal.AssetToolsHelpers.get_asset_tools()
        material = tools.create_asset(name, folder, unreal.Material, unreal.MaterialFactoryNew())
    if not isinstance(material, unreal.Material):
        raise CardFileError(f"{path}: no material can be made there; choose another folder")
    blend = unreal.BlendMode.BLEND_MASKED if is_masked else unreal.BlendMode.BLEND_OPAQUE
    values = {
        "shading_model": unreal.MaterialShadingModel.MSM_HAIR,
        "blend_mode": blend,
        "two_sided": is_masked,
        "dither_opacity_mask": is_masked,
        "dithered_lod_transition": is_masked,
        "tangent_space_normal": True,
        "use_material_attributes": True,
    }
    _set(material, values)
    EDIT.set_material_usage(material, unreal.MaterialUsage.MATUSAGE_HAIR_STRANDS)
    if is_masked:
        EDIT.set_material_usage(material, unreal.MaterialUsage.MATUSAGE_SKELETAL_MESH)
    _build(material, graph, folder)
    EDIT.layout_material_expressions(material)
    EDIT.recompile_material(material)
    return material


def _build(material: Any, graph: Graph, folder: str) -> None:
    """All nodes, then what connects them."""
    made = {}
    for name, node in graph.nodes.items():
        kind = getattr(unreal, f"MaterialExpression{node.kind}")
        made[name] = EDIT.create_material_expression(material, kind)
        _set(
            made[name], {key: _value(value, key, folder) for key, value in node.properties.items()}
        )
    for name, node in graph.nodes.items():
        for pin, (source, output) in node.inputs.items():
            _connected(
                EDIT.connect_material_expressions(made[source], output, made[name], pin), name
            )
    # Python has no name for Backlit, which is a pin of this node
    attributes = EDIT.create_material_expression(
        material, unreal.MaterialExpressionMakeMaterialAttributes
    )
    for pin, (source, output) in graph.attributes.items():
        _connected(EDIT.connect_material_expressions(made[source], output, attributes, pin), pin)
    end = unreal.MaterialProperty.MP_MATERIAL_ATTRIBUTES
    _connected(EDIT.connect_material_property(attributes, "", end), "the material")


def _connected(is_connected: bool, name: str) -> None:
    if not is_connected:
        raise CardFileError(
            f"{name}: Unreal does not connect it; this importer does not fit this version of Unreal"
        )


def _value(value: Any, key: str, folder: str) -> Any:
    if isinstance(value, Choice):
        return getattr(getattr(unreal, value.enumeration), value.member)
    if isinstance(value, Color):
        return unreal.LinearColor(*value)
    if isinstance(value, Texture):
        return ASSETS.load_asset(f"{folder}/{value.asset}")
    if key == "inputs":
        return [_custom_input(name) for name in value]
    return value


def _custom_input(name: str) -> Any:
    pin = unreal.CustomInput()
    pin.set_editor_property("input_name", name)
    return pin


# Cards


def _import_cards(plan: Plan, folder: str, material: Any) -> tuple[Any, str | None]:
    """The static mesh with all levels, in the order of the file."""
    how = unreal.FbxImportUI()
    values = {
        "automated_import_should_detect_type": False,
        "mesh_type_to_import": unreal.FBXImportType.FBXIT_STATIC_MESH,
        "import_materials": False,
        "import_textures": False,
        "auto_compute_lod_distances": False,
    }
    _set(how, values)
    mesh_values = {
        "import_mesh_lo_ds": True,
        "combine_meshes": False,
        "auto_generate_collision": False,
        "build_nanite": False,
        "generate_lightmap_u_vs": False,
        "remove_degenerates": False,
        "normal_import_method": unreal.FBXNormalImportMethod.FBXNIM_IMPORT_NORMALS,
        "normal_generation_method": unreal.FBXNormalGenerationMethod.MIKK_T_SPACE,
    }
    _set(how.get_editor_property("static_mesh_import_data"), mesh_values)
    before = unreal.SystemLibrary.get_console_variable_int_value(ORDER)
    unreal.SystemLibrary.execute_console_command(None, f"{ORDER} {KEPT}")
    try:
        mesh = _imported(plan.mesh, folder, f"SM_{plan.name}", unreal.FbxFactory(), how)
        _set_up_levels(mesh, plan)
    finally:
        unreal.SystemLibrary.execute_console_command(None, f"{ORDER} {before}")
    for number in range(len(mesh.get_editor_property("static_materials"))):
        mesh.set_material(number, material)
    counts = [mesh.get_num_triangles(level) for level in range(mesh.get_num_lods())]
    return mesh, found_triangles(plan, counts)


def _set_up_levels(mesh: Any, plan: Plan) -> None:
    editor = unreal.get_editor_subsystem(unreal.StaticMeshEditorSubsystem)
    for level in range(mesh.get_num_lods()):
        settings = editor.get_lod_build_settings(mesh, level)
        values = {
            "recompute_normals": False,
            "recompute_tangents": True,
            "use_mikk_t_space": True,
            "remove_degenerates": False,
            "use_full_precision_u_vs": True,
            "generate_lightmap_u_vs": False,
        }
        _set(settings, values)
        editor.set_lod_build_settings(mesh, level, settings)
    sizes = plan.screen_sizes(mesh.get_bounds().sphere_radius)
    editor.set_lod_screen_sizes(mesh, sizes[: mesh.get_num_lods()])


# The groom


def _groom_name(file: Path) -> str:
    return f"G_{asset_name(file.stem)}"


def _import_groom(file: Path, folder: str) -> Any:
    """Hairloom writes grooms for Unreal in its own axes and centimetres: nothing is turned."""
    conversion = unreal.GroomConversionSettings(
        rotation=unreal.Vector(0.0, 0.0, 0.0), scale=unreal.Vector(1.0, 1.0, 1.0)
    )
    options = unreal.GroomImportOptions()
    options.set_editor_property("conversion_settings", conversion)
    return _imported(file, folder, _groom_name(file), unreal.HairStrandsFactory(), options)


def _set_up_groom(
    groom: Any, plan: Plan, folder: str, strands: Any, cards_look: Any, cards: Any, simulate: bool
) -> list[str]:
    """Strands near by, cards farther away."""
    count = len(groom.get_editor_property("hair_groups_info"))
    groom.set_editor_property(
        "hair_groups_materials",
        [
            _filled(unreal.HairGroupsMaterial(), slot_name=name, material=look)
            for name, look in (("Strands", strands), ("Cards", cards_look))
        ],
    )
    groom.set_editor_property("hair_groups_lod", [_levels(group) for group in range(count)])
    textures = unreal.HairGroupCardsTextures()
    if plan.card_textures:
        found = [ASSETS.load_asset(f"{folder}/{name}") for name in plan.card_textures]
        _filled(textures, layout=unreal.HairTextureLayout.LAYOUT0, textures=found)
    entry = _filled(
        unreal.HairGroupsCardsSourceDescription(),
        imported_mesh=cards,
        textures=textures,
        group_index=0,
        lod_index=1,
    )
    groom.set_editor_property("hair_groups_cards", [entry])
    if simulate:
        physics = list(groom.get_editor_property("hair_groups_physics"))
        for group in physics:
            solver = group.get_editor_property("solver_settings")
            solver.set_editor_property("enable_simulation", True)
            group.set_editor_property("solver_settings", solver)
        groom.set_editor_property("hair_groups_physics", physics)
    if plan.card_textures:
        return []
    return [
        f"{plan.mesh}: its textures are not packed for Unreal's groom, so its cards have none; "
        f"export the cards with the packing Unreal, which has {', '.join(CARD_SLOTS)}"
    ]


def _levels(group: int) -> Any:
    """Cards are one mesh of all groups: the first group shows it, the others nothing."""
    near = _filled(
        unreal.HairLODSettings(),
        geometry_type=unreal.GroomGeometryType.STRANDS,
        screen_size=1.0,
    )
    far = _filled(
        unreal.HairLODSettings(),
        geometry_type=unreal.GroomGeometryType.CARDS,
        screen_size=CARDS_BEGIN,
        visible=group == 0,
    )
    return _filled(unreal.HairGroupsLOD(), lo_ds=[near, far])


def _filled(struct: Any, **values: Any) -> Any:
    _set(struct, values)
    return struct


def _bound(groom: Any, path: str, folder: str) -> Any:
    head = ASSETS.load_asset(path)
    if not isinstance(head, unreal.SkeletalMesh):
        raise CardFileError(f"{path}: it is no skeletal mesh; name the asset of the head")
    name = f"{folder}/{groom.get_name()}_Binding"
    if ASSETS.does_asset_exist(name):
        ASSETS.delete_asset(name)
    binding = unreal.GroomLibrary.create_new_groom_binding_asset_with_path(
        name, groom, head, INTERPOLATION_POINTS
    )
    if binding is None:
        raise CardFileError(f"{path}: Unreal cannot bind the groom to it; see the log above")
    return binding


if __name__ == "__main__":
    main()
