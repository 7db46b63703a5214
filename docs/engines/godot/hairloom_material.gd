@tool
extends RefCounted
## The material of hair cards, as their sidecar, NAME.hairloom.json, has it.
##
## Godot has no depth test that asks for equal depths, so these are the sidecar's three passes
## ("passes_fallback"): opaque pixels, then transparent back faces, then transparent front faces, each
## in the order of the file.

## Where this folder is in a project. Shaders are no constants by `preload`: with those Godot 4.6 often
## waits for ever when it quits.
const HERE := "res://addons/hairloom/godot/"
const PASSES := ["opaque", "back", "front"]
const TEXTURES := ["base", "alpha", "shift", "noise", "tangent", "normal"]
const TABLES := ["longitudinal", "azimuthal", "paths"]


## Of a GLB, or null if none lies beside it.
static func sidecar_of(path: String) -> Variant:
	var beside := path.trim_suffix(".glb") + ".hairloom.json"
	if not FileAccess.file_exists(beside):
		return null
	var sidecar = JSON.parse_string(FileAccess.get_file_as_string(beside))
	if sidecar is Dictionary and "hairloom_sidecar" in sidecar:
		return sidecar
	push_error("%s: it is no sidecar of Hairloom; export the cards again" % beside)
	return null


## Three passes, each with the next one.
static func of(sidecar: Dictionary, folder: String) -> ShaderMaterial:
	var values := _values(sidecar, folder)
	var first: ShaderMaterial = null
	var last: ShaderMaterial = null
	for name in PASSES:
		var material := ShaderMaterial.new()
		material.shader = load(HERE + "hairloom_%s.gdshader" % name)
		for uniform in values:
			material.set_shader_parameter(uniform, values[uniform])
		if last == null:
			first = material
		else:
			material.render_priority = last.render_priority + 1
			last.next_pass = material
		last = material
	return first


static func _values(sidecar: Dictionary, folder: String) -> Dictionary:
	var material: Dictionary = sidecar["material"]
	var values := {
		"model": 1 if material["model"] == "marschner" else 0,
		"opaque_alpha": sidecar["opaque_alpha"],
		"min_alpha": sidecar["min_alpha"],
		"has_tangent_map": sidecar["textures"]["highlights_by"] == "tangent",
	}
	for name in material["values"]:
		var value = material["values"][name]
		if value is Array:
			values[name] = Vector3(value[0], value[1], value[2])
		elif value is float:
			values[name] = value
	for name in material.get("fibre", {}):
		var lane: Array = material["fibre"][name]
		values["fibre_" + name] = Vector4(lane[0], lane[1], lane[2], lane[3])
	for name in TEXTURES:
		if name in sidecar["textures"]:
			var entry: Dictionary = sidecar["textures"][name]
			values[name + "_texture"] = _texture(entry, folder, false)
			values[name + "_mask"] = _mask(entry)
	values["base_gain"] = sidecar["textures"].get("base", {}).get("gain", 1.0)
	var facing: Dictionary = sidecar["textures"].get("view_compensated_alpha", {})
	values["facing_range"] = Vector2(facing.get("mean_facing", 0.0), facing.get("min_facing", 0.0))
	values["has_normal_map"] = "normal" in sidecar["textures"]
	values["has_shift"] = "shift" in sidecar["textures"]
	for name in TABLES:
		if name in material.get("tables", {}):
			values[name] = _texture(material["tables"][name], folder, true)
	return values


## Which channel holds what is one number, such as alpha in the fourth one of another picture.
static func _mask(entry: Dictionary) -> Vector4:
	var mask := Vector4.ZERO
	mask["rgba".find(entry.get("channels", "r")[0])] = 1.0
	return mask


static func _texture(entry: Dictionary, folder: String, is_table: bool) -> Texture2D:
	var path := folder.path_join(entry["file"])
	var file := ProjectSettings.globalize_path(path) if Engine.is_editor_hint() else path
	var image := Image.load_from_file(file)
	if image == null:
		push_error("%s: a texture of the hair is missing; export the cards again" % path)
		return null
	if is_table:
		image.flip_y()  # the lowest row comes first
		return ImageTexture.create_from_image(image)
	image.generate_mipmaps()
	if not Engine.is_editor_hint():
		return ImageTexture.create_from_image(image)
	# it becomes part of the imported scene: small on disk, and every pixel as it was
	var texture := PortableCompressedTexture2D.new()
	texture.keep_compressed_buffer = true
	texture.create_from_image(image, PortableCompressedTexture2D.COMPRESSION_MODE_LOSSLESS)
	return texture
