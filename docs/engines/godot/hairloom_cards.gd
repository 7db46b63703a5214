## Draws hair cards that Hairloom exported, in Godot 4.4 or later, as Hairloom draws them.
##
##     add_child(HairloomCards.load_cards("res://hair.glb"))
##
## Reads NAME.glb, NAME.hairloom.json and the textures beside them. Godot has no depth test that asks
## for equal depths, so these are the sidecar's three passes ("passes_fallback"): opaque pixels, then
## transparent back faces, then transparent front faces, each in the order of the file.
class_name HairloomCards

const TEXTURES := ["base", "alpha", "shift", "noise", "tangent", "normal"]
const TABLES := ["longitudinal", "azimuthal", "paths"]
const HERE := "res://hairloom/godot/"


## The cards of a level, 0 the finest, or null with an error in the log.
static func load_cards(path: String, level := 0, folder := HERE) -> Node3D:
	var text := FileAccess.get_file_as_string(path.trim_suffix(".glb") + ".hairloom.json")
	var sidecar = JSON.parse_string(text)
	if sidecar == null:
		push_error("%s: no Hairloom sidecar lies beside it; export the cards again" % path)
		return null
	var document := GLTFDocument.new()
	var state := GLTFState.new()
	var levels := AllLevels.new()
	GLTFDocument.register_gltf_document_extension(levels)
	var read := document.append_from_file(path, state)
	GLTFDocument.unregister_gltf_document_extension(levels)
	if read != OK:
		push_error("%s: cannot be read; export the cards again" % path)
		return null
	var scene := document.generate_scene(state)
	var material := _material(sidecar, path.get_base_dir(), folder)
	var shown: String = sidecar["levels"][level]["node"]
	for node in scene.find_children("*", "MeshInstance3D", true, false):
		node.visible = node.name == shown
		node.material_override = material
	return scene


static func _material(sidecar: Dictionary, folder: String, shaders: String) -> ShaderMaterial:
	var values := _values(sidecar, folder)
	var first: ShaderMaterial = null
	var last: ShaderMaterial = null
	for name in ["opaque", "back", "front"]:
		var material := ShaderMaterial.new()
		material.shader = load(shaders + "hairloom_%s.gdshader" % name)
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


static func _texture(entry: Dictionary, folder: String, is_table: bool) -> ImageTexture:
	var image := Image.load_from_file(folder.path_join(entry["file"]))
	if is_table:
		image.flip_y()  # the lowest row comes first
	else:
		image.generate_mipmaps()
	return ImageTexture.create_from_image(image)


## The file's scene holds the finest level alone (MSFT_lod); here the others stand beside it.
class AllLevels extends GLTFDocumentExtension:
	func _import_preflight(state: GLTFState, _extensions: PackedStringArray) -> Error:
		var nodes: Array = state.json.get("nodes", [])
		for number in nodes.size():
			var lod: Dictionary = nodes[number].get("extensions", {}).get("MSFT_lod", {})
			for holder in nodes + state.json.get("scenes", []):
				for key in ["children", "nodes"]:
					if float(number) in holder.get(key, []):
						holder[key].append_array(lod.get("ids", []))
		return OK
