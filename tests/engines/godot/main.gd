extends Node3D
## Draws asset/cards.glb as asset/view.json asks and saves it as godot.png.


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
	get_tree().quit()


func _vector(values: Array) -> Vector3:
	return Vector3(values[0], values[1], values[2])
