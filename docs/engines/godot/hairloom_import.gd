@tool
extends GLTFDocumentExtension
## Reads a GLB of Hairloom as hair: with all of its levels, the order of the file and the material of
## its sidecar. Godot's own import would sort the triangles of each mesh for the vertex cache, as long
## as it is an ImporterMesh; here it becomes a finished one.

const HairMaterial := preload("hairloom_material.gd")
## of the camera's field of view, which Godot states for the height
const FIELD_OF_VIEW := 75.0
## of a distance: nothing flickers where a level takes over
const MARGIN := 0.05
const KEY := &"hairloom"


## The file's scene holds the finest level alone (MSFT_lod); here the others stand beside it.
func _import_preflight(state: GLTFState, _extensions: PackedStringArray) -> Error:
	var sidecar = HairMaterial.sidecar_of(state.base_path.path_join(state.filename))
	if sidecar == null or state.has_meta(KEY):
		return ERR_SKIP
	state.set_meta(KEY, sidecar)
	var nodes: Array = state.json.get("nodes", [])
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
	for node in root.find_children("*", "Node3D", true, false):
		var level := names.find(String(node.name))
		if level < 0:
			continue
		var hair := _finished(node)
		hair.material_override = material
		hair.visibility_range_begin = ends[level - 1] if level > 0 else 0.0
		hair.visibility_range_begin_margin = MARGIN * hair.visibility_range_begin
		hair.visibility_range_end = ends[level]
		hair.visibility_range_end_margin = MARGIN * ends[level]
	root.set_meta(KEY, names)
	return OK


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
		var slope := 2.0 * tan(0.5 * deg_to_rad(FIELD_OF_VIEW))
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
