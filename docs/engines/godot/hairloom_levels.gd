@tool
extends Node3D
## Keeps visibility ranges of levels right for hair that is scaled: hair twice as large changes its level twice
## as far away. Godot's ranges are metres of the world, whatever the scale of a node.

const NAME := "HairloomLevels"

## The levels beside this node, and from where to where each is visible [m], for hair of its own size.
@export var names: PackedStringArray
@export var ranges: PackedVector2Array

var _size := 0.0


func _enter_tree() -> void:
	set_notify_transform(true)
	_fit()


func _notification(what: int) -> void:
	if what == NOTIFICATION_TRANSFORM_CHANGED:
		_fit()


func _fit() -> void:
	var size := size_of(global_basis)
	if is_equal_approx(size, _size) or Engine.is_editor_hint():
		return  # an editor would save the ranges as changes of the scene
	_size = size
	for number in names.size():
		var hair: MeshInstance3D = get_parent().find_child(names[number], true, false)
		if hair != null:
			hair.visibility_range_begin = ranges[number].x * size
			hair.visibility_range_end = ranges[number].y * size


## How much larger something becomes, whatever way it is stretched.
static func size_of(basis_of_node: Basis) -> float:
	return pow(absf(basis_of_node.determinant()), 1.0 / 3.0)
