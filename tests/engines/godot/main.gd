extends Node3D
## Draws asset/cards.glb as asset/view.json asks and saves it as godot.png; levels.json says which
## meshes are shown by Godot alone, and as the loader's second level.


func _ready() -> void:
	var view: Dictionary = JSON.parse_string(FileAccess.get_file_as_string("res://asset/view.json"))
	var hair: Node3D = load("res://hairloom/godot/hairloom_cards.gd").load_cards(
			"res://asset/cards.glb")
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
	add_child(surroundings)
	await RenderingServer.frame_post_draw
	await RenderingServer.frame_post_draw
	get_viewport().get_texture().get_image().save_png("res://asset/godot.png")
	var document := GLTFDocument.new()
	var state := GLTFState.new()
	document.append_from_file("res://asset/cards.glb", state)
	var shown := {"plain": _shown(document.generate_scene(state)), "second": _shown(
			load("res://hairloom/godot/hairloom_cards.gd").load_cards("res://asset/cards.glb", 1))}
	var file := FileAccess.open("res://asset/levels.json", FileAccess.WRITE)
	file.store_string(JSON.stringify(shown))
	file.close()
	get_tree().quit()


func _shown(scene: Node) -> Array:
	var meshes := scene.find_children("*", "MeshInstance3D", true, false)
	var visible := meshes.filter(func(mesh): return mesh.visible)
	var names := visible.map(func(mesh): return String(mesh.name))
	scene.free()
	return names


func _vector(values: Array) -> Vector3:
	return Vector3(values[0], values[1], values[2])
