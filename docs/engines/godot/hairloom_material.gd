@tool
extends RefCounted
## The material of hair cards, as their sidecar, NAME.hairloom.json, has it.
##
## Godot has no depth test that asks for equal depths, so these are the sidecar's three passes
## ("passes_fallback"): opaque pixels, then transparent back faces, then transparent front faces, each
## in the order of the file.

const Table := preload("hairloom_table.gd")
const PASSES := ["opaque", "back", "front"]
const TEXTURES := ["base", "alpha", "shift", "noise", "tangent", "normal"]
const TABLES := ["longitudinal", "azimuthal", "paths"]
const VERSION := 2
const ENDING := ".hairloom.json"


## Of a GLB, or null if none lies beside it, or none that can be used: hair is then as Godot has it.
static func sidecar_of(path: String) -> Variant:
	var sidecar_path := beside(path)
	if not FileAccess.file_exists(sidecar_path):
		return null
	var json := JSON.new()  # says nothing itself
	var is_read := json.parse(FileAccess.get_file_as_string(sidecar_path)) == OK
	var sidecar = json.data if is_read else null
	if not (sidecar is Dictionary and sidecar.get("levels", []) and "hairloom_sidecar" in sidecar):
		push_error("%s: it is no sidecar of Hairloom; export the cards again" % sidecar_path)
		return null
	if sidecar["hairloom_sidecar"] > VERSION:
		push_error("%s: a newer Hairloom wrote it; update this add-on" % sidecar_path)
		return null
	if beside(sidecar.get("file", "")) != beside(path.get_file()):
		push_warning("%s: it names %s; rename both files back if the hair looks wrong"
				% [sidecar_path, sidecar.get("file", "")])
	return sidecar


## The path of the sidecar; Godot's editor leaves the suffix of a GLB out.
static func beside(path: String) -> String:
	return (path.left(-4) if path.to_lower().ends_with(".glb") else path) + ENDING


## Three passes, each with the next one.
static func of(sidecar: Dictionary, folder: String) -> ShaderMaterial:
	var values := _values(sidecar, folder)
	var first: ShaderMaterial = null
	var last: ShaderMaterial = null
	var beside_this: Script = Table
	var here := beside_this.resource_path.get_base_dir()
	for name in PASSES:
		var material := ShaderMaterial.new()
		# no constants by `preload`: with shaders as such Godot 4.6 often waits for ever when it quits
		material.shader = load(here.path_join("hairloom_%s.gdshader" % name))
		for uniform in values:
			material.set_shader_parameter(uniform, values[uniform])
		if last == null:
			first = material
		else:
			material.render_priority = last.render_priority + 1
			last.next_pass = material
		last = material
	return first


## Copies of all passes, with values of their own.
static func with_values(material: ShaderMaterial, values: Dictionary) -> ShaderMaterial:
	var copy: ShaderMaterial = material.duplicate()
	for uniform in values:
		copy.set_shader_parameter(uniform, values[uniform])
	if copy.next_pass != null:
		copy.next_pass = with_values(copy.next_pass, values)
	return copy


## Of all passes.
static func set_all(material: ShaderMaterial, uniform: String, value: Variant) -> void:
	while material != null:
		material.set_shader_parameter(uniform, value)
		material = material.next_pass


static func _values(sidecar: Dictionary, folder: String) -> Dictionary:
	var material: Dictionary = sidecar["material"]
	var values := {
		"model": 1 if material["model"] == "marschner" else 0,
		"opaque_alpha": sidecar["opaque_alpha"],
		"min_alpha": sidecar["min_alpha"],
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
	var found := {}  # a texture that is missing is as one that the export has not
	for name in TEXTURES:
		if name in sidecar["textures"]:
			var entry: Dictionary = sidecar["textures"][name]
			var texture := _texture(entry, folder)
			if texture != null:
				found[name] = entry
				values[name + "_texture"] = texture
				values[name + "_mask"] = _mask(entry)
	if "tangent" in found:
		for axis in 3:
			values["tangent_" + "xyz"[axis]] = _lanes(found["tangent"], axis)
	values["base_gain"] = found.get("base", {}).get("gain", 1.0)
	var facing: Dictionary = sidecar["textures"].get("view_compensated_alpha", {})
	values["facing_range"] = Vector2(facing.get("mean_facing", 0.0), facing.get("min_facing", 0.0))
	var by: String = sidecar["textures"].get("highlights_by", "shift")
	values["has_tangent_map"] = by == "tangent" and "tangent" in found
	values["has_normal_map"] = "normal" in found
	values["has_shift"] = "shift" in found
	for name in TABLES:
		if name in material.get("tables", {}):
			var table := _image(material["tables"][name], folder, Table.read)
			values[name] = ImageTexture.create_from_image(table) if table != null else null
	return values


## Which channel holds what is one number, such as alpha in the fourth one of another picture.
static func _mask(entry: Dictionary) -> Vector4:
	var mask := Vector4.ZERO
	mask["rgba".find(entry.get("channels", "r")[0])] = 1.0
	return mask


## What a component of a direction is made of, see hair_texel; one that the file has not is 0.
static func _lanes(entry: Dictionary, axis: int) -> Vector4:
	var channels: String = entry.get("channels", "rgb")
	if axis >= channels.length():
		return Vector4(0.0, 0.0, 0.0, 0.5)
	var is_inverted: bool = channels[axis] in entry.get("inverted", "")
	var lanes := Vector4.ZERO
	lanes["rgb".find(channels[axis])] = -1.0 if is_inverted else 1.0
	lanes.w = 1.0 if is_inverted else 0.0
	return lanes


## null, with an error in the log, where there is none.
static func _image(entry: Dictionary, folder: String, read: Callable) -> Image:
	var path := folder.path_join(entry["file"])
	var file := ProjectSettings.globalize_path(path) if Engine.is_editor_hint() else path
	if not FileAccess.file_exists(file):
		push_error("%s: this texture of the hair is missing; copy all files of the export" % path)
		return null
	var image: Image = read.call(file)
	if image == null or image.is_empty():
		push_error("%s: this texture of the hair cannot be read; export the cards again, with textures as PNG" % path)
		return null
	return image


static func _texture(entry: Dictionary, folder: String) -> Texture2D:
	var image := _image(entry, folder, Image.load_from_file)
	if image == null:
		return null
	image.generate_mipmaps()
	if not Engine.is_editor_hint():
		return ImageTexture.create_from_image(image)
	# it becomes part of the imported scene: small on disk, and every pixel as it was
	var texture := PortableCompressedTexture2D.new()
	texture.keep_compressed_buffer = true
	texture.create_from_image(image, PortableCompressedTexture2D.COMPRESSION_MODE_LOSSLESS)
	return texture
