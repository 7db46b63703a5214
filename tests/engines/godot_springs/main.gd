extends Node3D
## Moves asset/hair.glb by the matrices of poses.json (column by column), one per frame, and writes the
## world positions of all joints of its springs into the file named by the command line.

const Cards := preload("res://addons/hairloom/hairloom_cards.gd")

var hair: Node3D
var skeleton: Skeleton3D
var matrices: Array
var frames: Array = []


func _ready() -> void:
	matrices = JSON.parse_string(FileAccess.get_file_as_string("res://poses.json"))["matrices"]
	hair = Cards.load_cards("res://asset/hair.glb", 0)
	hair.transform = _transform(matrices[0])
	add_child(hair)
	skeleton = hair.find_children("*", "Skeleton3D", true, false)[0]
	skeleton.skeleton_updated.connect(_remember)


func _process(_delta: float) -> void:
	if frames.size() < matrices.size():
		hair.transform = _transform(matrices[frames.size()])
		return
	set_process(false)
	var file := FileAccess.open(OS.get_cmdline_user_args()[0], FileAccess.WRITE)
	var simulator: SpringBoneSimulator3D = skeleton.find_children("*", "SpringBoneSimulator3D", true, false)[0]
	file.store_string(JSON.stringify({
		"frames": frames,
		"springs": simulator.setting_count,
		"collisions": simulator.get_child_count(),
	}))
	file.close()
	get_tree().quit()


func _remember() -> void:
	var places := {}
	for bone in skeleton.get_bone_count():
		var place := skeleton.global_transform * skeleton.get_bone_global_pose(bone).origin
		places[skeleton.get_bone_name(bone)] = [place.x, place.y, place.z]
	frames.append(places)


func _transform(matrix: Array) -> Transform3D:
	var column := func(first: int) -> Vector3:
		return Vector3(matrix[first], matrix[first + 1], matrix[first + 2])
	return Transform3D(column.call(0), column.call(4), column.call(8), column.call(12))
