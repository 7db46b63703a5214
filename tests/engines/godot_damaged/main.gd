extends Node3D
## Loads and draws the file of each folder of cases.json, and writes to seen.json the number of meshes with
## hair's own material and the fraction of the picture that they fill, or null if it cannot be read. Prints the
## name of each case first.

const Cards := preload("res://addons/hairloom/hairloom_cards.gd")


func _ready() -> void:
	var cases: Dictionary = JSON.parse_string(FileAccess.get_file_as_string("res://cases.json"))
	var camera := Camera3D.new()
	add_child(camera)
	camera.fov = 30.0
	camera.look_at_from_position(Vector3(0.25, 0.1, 0.45), Vector3(0.0, -0.01, 0.0))
	var sun := DirectionalLight3D.new()
	add_child(sun)
	sun.look_at_from_position(Vector3(0.5, 0.5, 0.7), Vector3.ZERO)
	sun.light_energy = 1.5
	var surroundings := WorldEnvironment.new()
	add_child(surroundings)
	surroundings.environment = Environment.new()
	surroundings.environment.background_mode = Environment.BG_COLOR
	surroundings.environment.background_color = Color.BLACK
	surroundings.environment.ambient_light_source = Environment.AMBIENT_SOURCE_COLOR
	surroundings.environment.ambient_light_color = Color.WHITE
	surroundings.environment.ambient_light_energy = 0.3
	var seen := {}
	for name in cases:
		printerr("CASE ", name)  # where warnings go too
		var hair := Cards.load_cards("res://%s/%s" % [name, cases[name]], 0)
		if hair == null:
			seen[name] = null
			continue
		add_child(hair)
		await RenderingServer.frame_post_draw
		await RenderingServer.frame_post_draw
		seen[name] = _seen(hair)
		hair.free()
	var file := FileAccess.open(OS.get_cmdline_user_args()[0].path_join("seen.json"), FileAccess.WRITE)
	file.store_string(JSON.stringify(seen))
	file.close()
	get_tree().quit()


func _seen(hair: Node3D) -> Dictionary:
	var picture := get_viewport().get_texture().get_image()
	picture.resize(160, 160, Image.INTERPOLATE_NEAREST)
	var filled := 0
	for y in 160:
		for x in 160:
			var color := picture.get_pixel(x, y)
			filled += 1 if maxf(color.r, maxf(color.g, color.b)) > 0.03 else 0
	var meshes := hair.find_children("*", "MeshInstance3D", true, false)
	var own := meshes.filter(func(mesh): return mesh.material_override is ShaderMaterial)
	return {"own": own.size(), "filled": filled / 25600.0}
