@tool
extends GLTFDocumentExtension
## Reads a GLB of Hairloom as hair: with all of its levels, the order of the file and the material of
## its sidecar. Godot's own import would sort the triangles of each mesh for the vertex cache, as long
## as it is an ImporterMesh; here it becomes a finished one.

const HairMaterial := preload("hairloom_material.gd")
const Levels := preload("hairloom_levels.gd")
## Settings of a project, and their values if it has none: the camera's field of view, which Godot states
## for the height; how wide the bands around the distances are in which two levels are drawn, each in its
## own pixels, as a fraction of the distance, 0: levels change at once.
const SETTINGS := {"hairloom/field_of_view": 75.0, "hairloom/cross_fade": 0.1}
## of a distance: how narrow such a band may be
const LEAST := 1e-5
## of a distance: Godot measures from the middle of each level; this much farther it draws both, and the
## shader knows which has a pixel
const MARGIN := 0.05
const KEY := &"hairloom"
const REMEDY := "use the file that Hairloom wrote"


## The file's scene holds the finest level alone (MSFT_lod); here the others stand beside it.
func _import_preflight(state: GLTFState, _extensions: PackedStringArray) -> Error:
	if state.has_meta(KEY):
		return ERR_SKIP
	var path := _path(state)
	var sidecar = HairMaterial.sidecar_of(path)
	if sidecar == null:
		return ERR_SKIP
	var nodes: Array = state.json.get("nodes", [])
	var there := nodes.map(func(node): return node.get("name", ""))
	if not sidecar["levels"].all(func(level): return level["node"] in there):
		push_error("%s: its levels are not those of its sidecar; %s" % [path, REMEDY])
		return ERR_SKIP
	state.set_meta(KEY, sidecar)
	for number in nodes.size():
		var lod: Dictionary = nodes[number].get("extensions", {}).get("MSFT_lod", {})
		for holder in nodes + state.json.get("scenes", []):
			for key in ["children", "nodes"]:
				if float(number) in holder.get(key, []):
					holder[key].append_array(lod.get("ids", []))
	return OK


func _import_post(state: GLTFState, root: Node) -> Error:
	var sidecar: Dictionary = state.get_meta(KEY)
	var material := HairMaterial.of(sidecar, state.base_path)
	var names: Array = sidecar["levels"].map(func(level): return level["node"])
	var ends := _distances(state, sidecar)
	var half := 0.5 * maxf(_setting("hairloom/cross_fade"), LEAST)
	var band := Vector2(1.0 - half, 1.0 + half)
	var levels := Levels.new()
	levels.name = Levels.NAME
	root.add_child(levels)
	levels.owner = root
	var is_as_written := true
	for node in root.find_children("*", "Node3D", true, false):
		var level := names.find(String(node.name))
		if level < 0:
			continue
		var hair := _finished(node)
		var begin := ends[level - 1] if level > 0 else 0.0
		var end := ends[level]
		var size := Levels.size_of(hair.transform.basis)
		hair.material_override = HairMaterial.with_values(material, {
			"fade_in": begin / size * band,
			"fade_out": end / size * band,
			"fade_center": hair.transform.affine_inverse() * _center(sidecar),
		})
		hair.visibility_range_begin = begin * band.x * (1.0 - MARGIN)
		hair.visibility_range_end = end * band.y * (1.0 + MARGIN)
		levels.names.append(hair.name)
		levels.ranges.append(Vector2(hair.visibility_range_begin, hair.visibility_range_end))
		is_as_written = _is_written(hair, sidecar["levels"][level]) and is_as_written
	if not is_as_written:
		push_warning("%s: another program has changed it, so hair may show holes; %s"
				% [_path(state), REMEDY])
	var motion: Dictionary = sidecar.get("motion", {})
	if motion.get("kind", "") == "springs":
		for skeleton in root.find_children("*", "Skeleton3D", true, false):
			_add_springs(skeleton, motion, root)
	root.set_meta(KEY, names)
	return OK


## A spring for each chain of joints; its algorithm is the one that the numbers were fitted for.
static func _add_springs(skeleton: Skeleton3D, motion: Dictionary, root: Node) -> void:
	var simulator := SpringBoneSimulator3D.new()
	simulator.name = "HairSprings"
	skeleton.add_child(simulator)
	simulator.owner = root
	var shapes: Array[Node] = []
	for collider in motion["colliders"]:
		var shape := _collision(collider)
		shape.bone_name = motion["root_joint"]
		# saved scenes keep the offset of what has a bone's number, too
		shape.bone = skeleton.find_bone(motion["root_joint"])
		simulator.add_child(shape, true)
		shape.owner = root
		shapes.append(shape)
	var springs: Array = motion["springs"]
	simulator.setting_count = springs.size()
	for number in springs.size():
		var spring: Dictionary = springs[number]
		simulator.set_root_bone_name(number, spring["joints"][0])
		simulator.set_root_bone(number, skeleton.find_bone(spring["joints"][0]))
		simulator.set_end_bone_name(number, spring["joints"][-1])
		simulator.set_end_bone(number, skeleton.find_bone(spring["joints"][-1]))
		simulator.set_individual_config(number, true)
		# Godot finds a chain's joints in the tree only; here they are set as a saved scene sets them
		simulator.set("settings/%d/joint_count" % number, spring["joints"].size())
		for joint in spring["joints"].size():
			var bone: String = spring["joints"][joint]
			simulator.set("settings/%d/joints/%d/bone_name" % [number, joint], bone)
			simulator.set("settings/%d/joints/%d/bone" % [number, joint], skeleton.find_bone(bone))
		for joint in spring["stiffness"].size():
			simulator.set_joint_stiffness(number, joint, spring["stiffness"][joint])
			simulator.set_joint_drag(number, joint, spring["drag"][joint])
			simulator.set_joint_gravity(number, joint, spring["gravity"][joint])
			simulator.set_joint_gravity_direction(number, joint, _vector(motion["gravity_direction"]))
			simulator.set_joint_radius(number, joint, spring["hit_radius"][joint])
		simulator.set_enable_all_child_collisions(number, false)
		simulator.set_collision_count(number, spring["colliders"].size())
		for place in spring["colliders"].size():
			var shape := shapes[int(spring["colliders"][place])]
			simulator.set_collision_path(number, place, NodePath(String(shape.name)))


static func _collision(collider: Dictionary) -> SpringBoneCollision3D:
	var shape: Dictionary = collider.values()[0]
	var offset := _vector(shape["offset"])
	var collision: SpringBoneCollision3D
	if collider.has("capsule"):
		var axis := _vector(shape["tail"]) - offset
		var capsule := SpringBoneCollisionCapsule3D.new()
		capsule.radius = shape["radius"]
		capsule.height = axis.length() + 2.0 * capsule.radius
		capsule.rotation_offset = Quaternion(Vector3.UP, axis.normalized())
		offset += 0.5 * axis
		collision = capsule
	else:
		var sphere := SpringBoneCollisionSphere3D.new()
		sphere.radius = shape["radius"]
		collision = sphere
	collision.position_offset = offset
	return collision


static func _vector(numbers: Array) -> Vector3:
	return Vector3(numbers[0], numbers[1], numbers[2])


## Of the GLB, whose suffix Godot leaves out.
static func _path(state: GLTFState) -> String:
	return state.base_path.path_join(state.filename.trim_suffix(".glb") + ".glb")


## Whether triangles and vertices are those that Hairloom wrote, in their order.
static func _is_written(hair: MeshInstance3D, level: Dictionary) -> bool:
	var arrays := hair.mesh.surface_get_arrays(0)
	if arrays[Mesh.ARRAY_TEX_UV2] == null:  # an optimiser has taken it for unused
		HairMaterial.set_all(hair.material_override, "has_openness", false)
		return false
	var indices: PackedInt32Array = arrays[Mesh.ARRAY_INDEX]
	if hair.mesh.get_surface_count() != 1 or indices.size() != int(level["indices"]):
		return false
	for first in range(0, indices.size(), 3):  # Godot has turned them over
		var second := indices[first + 1]
		indices[first + 1] = indices[first + 2]
		indices[first + 2] = second
	var sum := int(level.get("indices_adler32", -1))
	return sum < 0 or _adler32(indices.to_byte_array()) == sum


static func _adler32(bytes: PackedByteArray) -> int:
	var low := 1
	var high := 0
	for byte in bytes:
		low += byte
		high += low
		if high >= 1 << 40:  # far from the largest number
			low %= 65521
			high %= 65521
	return (high % 65521) * 65536 + low % 65521


static func _setting(name: String) -> float:
	return ProjectSettings.get_setting(name, SETTINGS[name])


## Of the finest level.
static func _center(sidecar: Dictionary) -> Vector3:
	var bounds: Dictionary = sidecar["levels"][0]["bounds"]
	return 0.5 * (_vector(bounds["minimum"]) + _vector(bounds["maximum"]))


## Where each level ends [m]; 0: nowhere.
static func _distances(state: GLTFState, sidecar: Dictionary) -> Array[float]:
	var levels: Array = sidecar["levels"]
	var coverage: Array = []
	for node in state.json.get("nodes", []):
		if node.get("name", "") == levels[0]["node"]:
			coverage = node.get("extras", {}).get("MSFT_screencoverage", [])
	var low: Array = levels[0]["bounds"]["minimum"]
	var high: Array = levels[0]["bounds"]["maximum"]
	var size := maxf(maxf(high[0] - low[0], high[1] - low[1]), high[2] - low[2])
	var ends: Array[float] = []
	for number in levels.size():
		var part: float = sqrt(coverage[number]) if number < coverage.size() else 0.0
		var slope := 2.0 * tan(0.5 * deg_to_rad(_setting("hairloom/field_of_view")))
		ends.append(size / (slope * part) if part > 0.0 else 0.0)
	return ends


## The node with a mesh that nothing reorders any more.
static func _finished(node: Node3D) -> MeshInstance3D:
	if node is MeshInstance3D:
		return node
	var hair := MeshInstance3D.new()
	hair.name = node.name
	hair.transform = node.transform
	hair.mesh = node.mesh.get_mesh()
	hair.skin = node.skin
	hair.skeleton = node.skeleton_path
	node.replace_by(hair)
	node.free()
	return hair
