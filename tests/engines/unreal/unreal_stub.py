"""A stub of the module `unreal`, with what hairloom_import.py uses, as Epic documents it.

Names, properties and arguments are those of the pages below; all others raise, as in Unreal.
Each class has a page https://dev.epicgames.com/documentation/en-us/unreal-engine/python-api/class/NAME,
such as .../class/MaterialEditingLibrary, StaticMeshEditorSubsystem, FbxStaticMeshImportData,
MeshBuildSettings, GroomAsset, HairGroupsCardsSourceDescription, HairLODSettings, GroomLibrary,
AssetImportTask, EditorAssetLibrary. The pins that the hair shading model renames are in Unreal's
MaterialAttributeDefinitionMap.cpp, the ordering of triangles while meshes are built is in
StaticMeshBuilder.cpp.

The stub reads no files: the test fills `levels_of`, which reads the FBX.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

PAGE = "https://dev.epicgames.com/documentation/en-us/unreal-engine/python-api/class/"

#: path in the content folder -> asset
assets: dict[str, Any] = {}
log_lines: list[tuple[str, str]] = []
console_variables = {"r.TriangleOrderOptimization": 1}
saved: list[str] = []
#: whether assets can be saved
can_save = True
#: a function that finds the number of triangles of each level in an FBX file
levels_of: list[Callable[[str], list[int]]] = []


def reset() -> None:
    global can_save
    assets.clear()
    log_lines.clear()
    saved.clear()
    console_variables["r.TriangleOrderOptimization"] = 1
    can_save = True


# Members of every object


class Documented:
    """An object with the editor properties of its documentation page."""

    editor_properties: tuple[str, ...] = ()

    def __init__(self) -> None:
        self.values: dict[str, Any] = {}

    def set_editor_property(self, name: str, value: Any) -> None:
        self._check(name)
        self.values[name] = value

    def get_editor_property(self, name: str) -> Any:
        self._check(name)
        return self.values.get(name)

    def _check(self, name: str) -> None:
        if name not in self.editor_properties:
            page = PAGE + type(self).__name__
            raise Exception(f"Failed to find property '{name}' on '{type(self).__name__}': {page}")


class Object(Documented):
    path = ""

    def __init__(self) -> None:
        super().__init__()
        self.tags: dict[str, str] = {}

    def get_name(self) -> str:
        return self.path.rsplit("/", 1)[-1]

    def get_path_name(self) -> str:
        return f"{self.path}.{self.get_name()}"


def _class(name: str, properties: str, base: type = Object) -> type:
    made = type(name, (base,), {"editor_properties": tuple(properties.split())})
    setattr(sys.modules[__name__], name, made)
    return made


def _enumeration(name: str, members: str) -> None:
    made = type(name, (), {member: f"{name}.{member}" for member in members.split()})
    setattr(sys.modules[__name__], name, made)


_enumeration("MaterialShadingModel", "MSM_DEFAULT_LIT MSM_HAIR")
_enumeration("BlendMode", "BLEND_OPAQUE BLEND_MASKED BLEND_TRANSLUCENT")
_enumeration("MaterialUsage", "MATUSAGE_SKELETAL_MESH MATUSAGE_HAIR_STRANDS")
_enumeration(
    "MaterialProperty",
    "MP_EMISSIVE_COLOR MP_OPACITY MP_OPACITY_MASK MP_BASE_COLOR MP_METALLIC MP_SPECULAR "
    "MP_ROUGHNESS MP_NORMAL MP_TANGENT MP_AMBIENT_OCCLUSION MP_MATERIAL_ATTRIBUTES",
)
_enumeration(
    "MaterialSamplerType",
    "SAMPLERTYPE_COLOR SAMPLERTYPE_GRAYSCALE SAMPLERTYPE_MASKS SAMPLERTYPE_LINEAR_COLOR",
)
_enumeration(
    "TextureCompressionSettings", "TC_DEFAULT TC_NORMALMAP TC_MASKS TC_VECTOR_DISPLACEMENTMAP"
)
_enumeration("TextureAddress", "TA_WRAP TA_CLAMP TA_MIRROR")
_enumeration("CustomMaterialOutputType", "CMOT_FLOAT1 CMOT_FLOAT2 CMOT_FLOAT3 CMOT_FLOAT4")
_enumeration("WorldPositionIncludedOffsets", "WPT_DEFAULT WPT_CAMERA_RELATIVE")
_enumeration("FBXImportType", "FBXIT_STATIC_MESH FBXIT_SKELETAL_MESH")
_enumeration("FBXNormalImportMethod", "FBXNIM_COMPUTE_NORMALS FBXNIM_IMPORT_NORMALS")
_enumeration("FBXNormalGenerationMethod", "BUILT_IN MIKK_T_SPACE")
_enumeration("HairTextureLayout", "LAYOUT0 LAYOUT1 LAYOUT2 LAYOUT3")
_enumeration("GroomGeometryType", "STRANDS CARDS MESHES")

#: (compression, sRGB) of a texture -> the sampler type that a material needs for it
SAMPLERS = {
    ("TextureCompressionSettings.TC_DEFAULT", True): "SAMPLERTYPE_COLOR",
    ("TextureCompressionSettings.TC_MASKS", False): "SAMPLERTYPE_MASKS",
    ("TextureCompressionSettings.TC_VECTOR_DISPLACEMENTMAP", False): "SAMPLERTYPE_LINEAR_COLOR",
}

Texture2D = _class("Texture2D", "srgb compression_settings address_x address_y filter")
TextureFactory = _class("TextureFactory", "")
Material = _class(
    "Material",
    "shading_model blend_mode two_sided dither_opacity_mask dithered_lod_transition "
    "opacity_mask_clip_value tangent_space_normal use_material_attributes",
)
MaterialFactoryNew = _class("MaterialFactoryNew", "")
FbxFactory = _class("FbxFactory", "")
HairStrandsFactory = _class("HairStrandsFactory", "")
SkeletalMesh = _class("SkeletalMesh", "")
GroomBindingAsset = _class("GroomBindingAsset", "groom target_skeletal_mesh")
AssetImportTask = _class(
    "AssetImportTask",
    "async_ automated destination_name destination_path factory filename imported_object_paths "
    "options replace_existing replace_existing_settings result save",
)
FbxStaticMeshImportData = _class(
    "FbxStaticMeshImportData",
    "auto_generate_collision bake_pivot_in_vertex build_nanite build_reversed_index_buffer "
    "combine_meshes compute_weighted_normals convert_scene convert_scene_unit force_front_x_axis "
    "generate_lightmap_u_vs import_mesh_lo_ds import_rotation import_translation "
    "import_uniform_scale normal_generation_method normal_import_method remove_degenerates "
    "reorder_material_to_fbx_order static_mesh_lod_group transform_vertex_to_absolute",
)
MeshBuildSettings = _class(
    "MeshBuildSettings",
    "compute_weighted_normals generate_lightmap_u_vs recompute_normals recompute_tangents "
    "remove_degenerates use_full_precision_u_vs use_high_precision_tangent_basis use_mikk_t_space",
    Documented,
)
GroomImportOptions = _class("GroomImportOptions", "conversion_settings interpolation_settings")
GroomAsset = _class(
    "GroomAsset",
    "enable_global_interpolation hair_groups_cards hair_groups_info hair_groups_interpolation "
    "hair_groups_lod hair_groups_materials hair_groups_meshes hair_groups_physics "
    "hair_groups_rendering lod_mode",
)
HairGroupsMaterial = _class("HairGroupsMaterial", "material slot_name", Documented)
HairGroupCardsTextures = _class("HairGroupCardsTextures", "layout textures", Documented)
HairGroupsCardsSourceDescription = _class(
    "HairGroupsCardsSourceDescription",
    "cards_info group_index guide_type imported_mesh lod_index textures",
    Documented,
)
HairLODSettings = _class(
    "HairLODSettings",
    "angular_threshold binding_type curve_decimation geometry_type global_interpolation "
    "screen_size simulation thickness_scale vertex_decimation visible",
    Documented,
)
HairGroupsLOD = _class("HairGroupsLOD", "lo_ds", Documented)
HairGroupsPhysics = _class(
    "HairGroupsPhysics",
    "external_forces material_constraints solver_settings strands_parameters",
    Documented,
)
HairSolverSettings = _class(
    "HairSolverSettings",
    "enable_simulation gravity_preloading iteration_count sub_steps",
    Documented,
)
CustomInput = _class("CustomInput", "input_name", Documented)


class FbxImportUI(Object):
    editor_properties = (
        "auto_compute_lod_distances",
        "automated_import_should_detect_type",
        "import_animations",
        "import_as_skeletal",
        "import_materials",
        "import_mesh",
        "import_textures",
        "lod_number",
        "mesh_type_to_import",
        "static_mesh_import_data",
    )

    def __init__(self) -> None:
        super().__init__()
        self.values["static_mesh_import_data"] = FbxStaticMeshImportData()


class LinearColor:
    def __init__(self, r: float = 0.0, g: float = 0.0, b: float = 0.0, a: float = 0.0) -> None:
        self.r, self.g, self.b, self.a = r, g, b, a


class Vector:
    def __init__(self, x: float = 0.0, y: float = 0.0, z: float = 0.0) -> None:
        self.x, self.y, self.z = x, y, z


class GroomConversionSettings:
    def __init__(self, rotation: Vector, scale: Vector) -> None:
        self.rotation, self.scale = rotation, scale


class BoxSphereBounds:
    sphere_radius = 15.0


class StaticMesh(Object):
    editor_properties = ("static_materials",)

    def __init__(self) -> None:
        super().__init__()
        self.values["static_materials"] = ["slot"]
        self.triangles: list[int] = []
        self.materials: dict[int, Any] = {}
        self.build: dict[int, Any] = {}
        self.screen_sizes: list[float] = []
        self.order = -1

    def get_num_lods(self) -> int:
        return len(self.triangles)

    def get_num_triangles(self, lod_index: int) -> int:
        return self.triangles[lod_index]

    def get_bounds(self) -> BoxSphereBounds:
        return BoxSphereBounds()

    def set_material(self, material_index: int, new_material: Any) -> None:
        self.materials[material_index] = new_material


# Expressions: properties, input pins and output pins


class MaterialExpression(Object):
    takes: tuple[str, ...] = ()
    gives: tuple[str, ...] = ("",)

    def __init__(self) -> None:
        super().__init__()
        self.inputs: dict[str, tuple[MaterialExpression, str]] = {}


def _expression(name: str, properties: str, takes: str = "", gives: str = "") -> None:
    made = _class(f"MaterialExpression{name}", f"desc {properties}", MaterialExpression)
    made.takes = tuple(takes.split())  # type: ignore[attr-defined]
    made.gives = ("", *gives.split())  # type: ignore[attr-defined]


_expression("ScalarParameter", "parameter_name default_value group slider_min slider_max")
_expression("VectorParameter", "parameter_name default_value group", gives="R G B A")
_expression(
    "TextureSampleParameter2D",
    "parameter_name texture sampler_type sampler_source mip_value_mode group",
    takes="UVs",
    gives="RGB R G B A RGBA",
)
_expression("TextureCoordinate", "coordinate_index u_tiling v_tiling")
_expression("WorldPosition", "world_position_shader_offset", gives="XY Z")
_expression("VertexNormalWS", "")
_expression("VertexTangentWS", "")
_expression("CameraVectorWS", "")
_expression("HairAttributes", "use_tangent_space", gives="U V Length Radius Seed Tangent BaseColor")
_expression(
    "Custom",
    "additional_defines additional_outputs code description include_file_paths inputs output_type",
)
_expression(
    "MakeMaterialAttributes",
    "",
    takes="BaseColor Metallic Specular Roughness Anisotropy EmissiveColor Opacity OpacityMask "
    "Normal Tangent WorldPositionOffset SubsurfaceColor ClearCoat ClearCoatRoughness "
    "AmbientOcclusion Refraction",
)
_class("MaterialExpressionComponentMask", "desc r g b a", MaterialExpression)


class MaterialEditingLibrary:
    @staticmethod
    def create_material_expression(
        material: Any, expression_class: type, node_pos_x: int = 0, node_pos_y: int = 0
    ) -> MaterialExpression:
        made: MaterialExpression = expression_class()
        material.values.setdefault("", []).append(made)
        return made

    @staticmethod
    def delete_all_material_expressions(material: Any) -> None:
        material.values[""] = []

    @staticmethod
    def connect_material_expressions(
        from_expression: MaterialExpression,
        from_output_name: str,
        to_expression: MaterialExpression,
        to_input_name: str,
    ) -> bool:
        """Connect two pins; False, as in Unreal, if one of the expressions has no such pin."""
        takes = to_expression.takes or ("",)
        if isinstance(to_expression, sys.modules[__name__].MaterialExpressionCustom):
            pins = to_expression.values["inputs"]
            takes = tuple(pin.get_editor_property("input_name") for pin in pins)
        if from_output_name not in from_expression.gives or to_input_name not in takes:
            return False
        to_expression.inputs[to_input_name] = (from_expression, from_output_name)
        return True

    @staticmethod
    def connect_material_property(
        from_expression: MaterialExpression, from_output_name: str, property_: str
    ) -> bool:
        from_expression.inputs["the material"] = (from_expression, property_)
        return from_output_name in from_expression.gives

    @staticmethod
    def set_material_usage(material: Any, usage: str) -> bool:
        return True

    @staticmethod
    def layout_material_expressions(material: Any) -> None: ...

    @staticmethod
    def recompile_material(material: Any) -> None:
        """Assert, where Unreal would report an error, that samplers match their textures."""
        for each in material.values[""]:
            texture = each.values.get("texture")
            if texture is not None:
                how = (texture.values["compression_settings"], texture.values["srgb"])
                assert each.values["sampler_type"].endswith("." + SAMPLERS[how]), texture.path


class StaticMeshEditorSubsystem:
    @staticmethod
    def get_lod_build_settings(static_mesh: StaticMesh, lod_index: int) -> Any:
        return MeshBuildSettings()

    @staticmethod
    def set_lod_build_settings(static_mesh: StaticMesh, lod_index: int, build_options: Any) -> None:
        static_mesh.build[lod_index] = build_options.values
        static_mesh.order = console_variables["r.TriangleOrderOptimization"]

    @staticmethod
    def set_lod_screen_sizes(static_mesh: StaticMesh, screen_sizes: Sequence[float]) -> bool:
        static_mesh.screen_sizes = list(screen_sizes)
        return True


def get_editor_subsystem(subsystem: type) -> Any:
    return subsystem()


class SystemLibrary:
    @staticmethod
    def execute_console_command(world_context_object: Any, command: str) -> None:
        name, value = command.split()
        console_variables[name] = int(value)

    @staticmethod
    def get_console_variable_int_value(variable_name: str) -> int:
        return console_variables[variable_name]


class _AssetTools:
    @staticmethod
    def import_asset_tasks(import_tasks: Sequence[Any]) -> None:
        for task in import_tasks:
            values = task.values
            made = _made_by(values["factory"], values["filename"])
            if made is not None:
                _put(made, f"{values['destination_path']}/{values['destination_name']}")

    @staticmethod
    def create_asset(asset_name: str, package_path: str, asset_class: type, factory: Any) -> Any:
        return _put(asset_class(), f"{package_path}/{asset_name}")


def _made_by(factory: Any, file: str) -> Any:
    if not Path(file).is_file():
        return None
    if isinstance(factory, TextureFactory):
        return Texture2D()
    if isinstance(factory, FbxFactory):
        mesh = StaticMesh()
        mesh.triangles = levels_of[0](file)
        return mesh if mesh.triangles else None
    groom = GroomAsset()
    physics = [HairGroupsPhysics(), HairGroupsPhysics()]
    for group in physics:
        group.set_editor_property("solver_settings", HairSolverSettings())
    groom.values |= {"hair_groups_info": [None, None], "hair_groups_physics": physics}
    return groom


def _put(asset: Any, path: str) -> Any:
    assert path.isascii() and path.startswith("/Game/"), path
    asset.path = path
    assets[path] = asset
    return asset


class AssetToolsHelpers:
    @staticmethod
    def get_asset_tools() -> type[_AssetTools]:
        return _AssetTools


class EditorAssetLibrary:
    @staticmethod
    def does_asset_exist(asset_path: str) -> bool:
        return asset_path in assets

    @staticmethod
    def load_asset(asset_path: str) -> Any:
        return assets.get(asset_path)

    @staticmethod
    def delete_asset(asset_path_to_delete: str) -> bool:
        return assets.pop(asset_path_to_delete, None) is not None

    @staticmethod
    def get_metadata_tag(object_: Any, tag: str) -> str:
        return str(object_.tags.get(tag, ""))

    @staticmethod
    def set_metadata_tag(object_: Any, tag: str, value: str) -> None:
        object_.tags[tag] = value

    @staticmethod
    def save_loaded_asset(asset_to_save: Any, only_if_is_dirty: bool = True) -> bool:
        saved.append(asset_to_save.path)
        return can_save


class GroomLibrary:
    @staticmethod
    def create_new_groom_binding_asset_with_path(
        desired_package_path: str,
        groom_asset: Any,
        skeletal_mesh: Any,
        num_interpolation_points: int = 100,
        source_skeletal_mesh_for_transfer: Any = None,
        matching_section: int = 0,
    ) -> Any:
        binding = _put(GroomBindingAsset(), desired_package_path)
        binding.values |= {"groom": groom_asset, "target_skeletal_mesh": skeletal_mesh}
        return binding


def log(arg: str) -> None:
    log_lines.append(("log", arg))


def log_warning(arg: str) -> None:
    log_lines.append(("warning", arg))


def log_error(arg: str) -> None:
    log_lines.append(("error", arg))
