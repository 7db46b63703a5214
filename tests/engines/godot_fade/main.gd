extends Node3D
## Draws asset/cards.glb from view.json's eye: the first two levels alone, all levels at the distance where the
## first fades to the second, the same for hair three times as large and far away, and with the cross-fade turned
## off. Writes fine.png, coarse.png, both.png, scaled.png and at_once.png into the folder named by the command line.

const Cards := preload("res://tools/hair cards/hairloom_cards.gd")
const GLB := "res://asset/cards.glb"


func _ready() -> void:
	var view: Dictionary = JSON.parse_string(FileAccess.get_file_as_string("res://asset/view.json"))
	var camera := Camera3D.new()
	add_child(camera)
	camera.fov = view["field_of_view"]
	camera.near = view["near"]
	camera.far = view["far"]
	camera.look_at_from_position(_vector(view["eye"]), _vector(view["target"]))
	var sun := DirectionalLight3D.new()
	add_child(sun)
	sun.look_at_from_position(_vector(view["to_sun"]), Vector3.ZERO)
	sun.light_energy = view["irradiance"] / PI
	var surroundings := WorldEnvironment.new()
	surroundings.environment = Environment.new()
	surroundings.environment.background_mode = Environment.BG_COLOR
	surroundings.environment.background_color = Color.BLACK
	add_child(surroundings)
	ProjectSettings.set_setting("hairloom/field_of_view", view["fade_field_of_view"])
	await _draw(Cards.load_cards(GLB, 0), "fine")
	await _draw(Cards.load_cards(GLB, 1), "coarse")
	await _draw(Cards.load_cards(GLB), "both")
	var large := Cards.load_cards(GLB)
	large.scale = 3.0 * Vector3.ONE
	camera.near *= 3.0
	camera.far *= 3.0
	camera.look_at_from_position(3.0 * _vector(view["eye"]), 3.0 * _vector(view["target"]))
	await _draw(large, "scaled")
	camera.look_at_from_position(_vector(view["eye"]), _vector(view["target"]))
	camera.near /= 3.0
	camera.far /= 3.0
	ProjectSettings.set_setting("hairloom/cross_fade", 0.0)
	await _draw(Cards.load_cards(GLB), "at_once")
	get_tree().quit()


func _draw(hair: Node3D, name_of_picture: String) -> void:
	add_child(hair)
	await RenderingServer.frame_post_draw
	await RenderingServer.frame_post_draw
	var output := OS.get_cmdline_user_args()[0].path_join(name_of_picture + ".png")
	get_viewport().get_texture().get_image().save_png(output)
	remove_child(hair)
	hair.free()


func _vector(values: Array) -> Vector3:
	return Vector3(values[0], values[1], values[2])
