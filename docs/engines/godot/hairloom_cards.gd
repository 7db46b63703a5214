## Hair cards that Hairloom exported, in Godot 4.4 or later, as Hairloom draws them.
##
##     add_child(HairloomCards.load_cards("res://assets/hair.glb"))
##
## In a game this is the scene that the add-on (plugin.gd) has imported. Files that lie elsewhere, such
## as under user://, are read as they are: NAME.glb, NAME.hairloom.json and the textures beside them.
class_name HairloomCards

const HairMaterial := preload("hairloom_material.gd")
const Import := preload("hairloom_import.gd")


## The cards, or null with an error in the log. Without a sidecar that fits they come in the plain
## material of the file; the log says why.
##
## level: shows this one alone, 0 the finest, or the coarsest that there is; -1: all, each from the distance at which it takes over.
static func load_cards(path: String, level := -1) -> Node3D:
	var scene := _imported(path)
	if scene == null:
		scene = _read(path)
	if scene == null or level < 0 or not scene.has_meta(Import.KEY):
		return scene
	scene.get_node(Import.Levels.NAME).free()
	var names: Array = scene.get_meta(Import.KEY)
	for number in names.size():
		var hair: MeshInstance3D = scene.find_child(names[number], true, false)
		hair.visible = number == mini(level, names.size() - 1)
		hair.visibility_range_begin = 0.0
		hair.visibility_range_end = 0.0
		hair.material_override = HairMaterial.with_values(hair.material_override, {
			"fade_in": Vector2.ZERO,
			"fade_out": Vector2.ZERO,
		})
	return scene


static func _imported(path: String) -> Node3D:
	if not ResourceLoader.exists(path, "PackedScene"):
		return null
	var scene: Node3D = load(path).instantiate()
	if scene.has_meta(Import.KEY):
		return scene
	if FileAccess.file_exists(path):
		scene.free()
		return null
	push_warning("%s: Godot has imported it by itself. Enable the add-on Hairloom in the project's " % path
			+ "settings, and import the file again")
	return scene


static func _read(path: String) -> Node3D:
	if not FileAccess.file_exists(path):
		push_error("%s: there is no such file" % path)
		return null
	var import := Import.new()
	var document := GLTFDocument.new()
	var state := GLTFState.new()
	GLTFDocument.register_gltf_document_extension(import)
	var scene: Node3D = null
	if document.append_from_file(path, state) == OK:
		scene = document.generate_scene(state)
	GLTFDocument.unregister_gltf_document_extension(import)
	if scene == null:
		push_error("%s: it cannot be read; %s" % [path, Import.REMEDY])
	elif not FileAccess.file_exists(HairMaterial.beside(path)):
		push_warning("%s: no sidecar, NAME.hairloom.json, lies beside it; copy all files of the export" % path)
	return scene
