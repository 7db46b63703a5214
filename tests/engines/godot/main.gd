extends Node3D
## Draws asset/cards.glb with the view of asset/view.json. Writes into the folder named by the command line:
## godot.png; fog.png, the same in fog that hides everything; shown.json, the meshes that the loader shows for the
## second level and for level 99, those that Godot shows alone if it finds the file, and the range of distances of
## each; order.json, the indices of the finest level.

const Cards := preload("res://addons/hairloom/hairloom_cards.gd")
const GLB := "res://asset/cards.glb"


func _ready() -> void:
	var view: Dictionary = JSON.parse_string(FileAccess.get_file_as_string("res://asset/view.json"))
	var hair := Cards.load_cards(GLB, 0)
	add_child(hair)
	var camera := Camera3D.new()
	add_child(camera)
	camera.fov = view["field_of_view"]
	camera.near = view["near"]
	camera.far = view["far"]
	camera.look_at_from_position(_vector(view["eye"]), _vector(view["target"]))
	var sun := DirectionalLight3D.new()
	add_child(sun)
	sun.look_at_from_position(_vector(view["to_sun"]), Vector3.ZERO)
	sun.light_color = Color(1.0, 1.0, 1.0)
	sun.light_energy = view["irradiance"] / PI  # Godot's light of energy 1 gives white matter 1
	var surroundings := WorldEnvironment.new()
	surroundings.environment = Environment.new()
	surroundings.environment.background_mode = Environment.BG_COLOR
	surroundings.environment.background_color = Color.BLACK
	surroundings.environment.ambient_light_source = Environment.AMBIENT_SOURCE_COLOR
	surroundings.environment.ambient_light_color = Color.WHITE
	surroundings.environment.ambient_light_energy = view["ambient"]
	add_child(surroundings)
	var output := OS.get_cmdline_user_args()[0]
	var shown := {"second": _shown(Cards.load_cards(GLB, 1)), "beyond": _shown(Cards.load_cards(GLB, 99)),
			"ranges": _ranges(Cards.load_cards(GLB))}
	if FileAccess.file_exists(GLB):
		var document := GLTFDocument.new()
		var state := GLTFState.new()
		document.append_from_file(GLB, state)
		shown["plain"] = _shown(document.generate_scene(state))
	_write(output.path_join("shown.json"), shown)
	var finest: MeshInstance3D = hair.find_child("cards_LOD0", true, false)
	_write(output.path_join("order.json"), Array(finest.mesh.surface_get_arrays(0)[Mesh.ARRAY_INDEX]))
	await _draw(output.path_join("godot.png"))
	surroundings.environment.fog_enabled = true
	surroundings.environment.fog_light_color = Color("336699")
	surroundings.environment.fog_density = 1000.0
	await _draw(output.path_join("fog.png"))
	get_tree().quit()


func _draw(path: String) -> void:
	await RenderingServer.frame_post_draw
	await RenderingServer.frame_post_draw
	get_viewport().get_texture().get_image().save_png(path)


func _write(path: String, content: Variant) -> void:
	var file := FileAccess.open(path, FileAccess.WRITE)
	file.store_string(JSON.stringify(content))
	file.close()


func _shown(scene: Node) -> Array:
	var meshes := scene.find_children("*", "MeshInstance3D", true, false)
	var visible := meshes.filter(func(mesh): return mesh.visible)
	var names := visible.map(func(mesh): return String(mesh.name))
	scene.free()
	return names


## The distances [m] at which each mesh, in order, begins and ends to be shown: the middle of its material's
## bands. The mesh must be drawn over both bands completely.
func _ranges(scene: Node) -> Array:
	var ranges := []
	for mesh in scene.find_children("*", "MeshInstance3D", true, false):
		var begin: Vector2 = mesh.material_override.get_shader_parameter("fade_in")
		var end: Vector2 = mesh.material_override.next_pass.get_shader_parameter("fade_out")
		assert(mesh.visibility_range_begin <= begin.x)
		assert(end.y == 0.0 and mesh.visibility_range_end == 0.0 or mesh.visibility_range_end > end.y)
		ranges.append([0.5 * (begin.x + begin.y), 0.5 * (end.x + end.y)])
	scene.free()
	return ranges


func _vector(values: Array) -> Vector3:
	return Vector3(values[0], values[1], values[2])
