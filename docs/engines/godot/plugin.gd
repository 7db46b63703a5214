@tool
extends EditorPlugin
## As long as it is enabled, a GLB beside its NAME.hairloom.json is imported as hair; see
## hairloom_import.gd.

var _import := preload("hairloom_import.gd").new()


func _enter_tree() -> void:
	for name in _import.SETTINGS:
		if not ProjectSettings.has_setting(name):
			ProjectSettings.set_setting(name, _import.SETTINGS[name])
		ProjectSettings.set_initial_value(name, _import.SETTINGS[name])
		ProjectSettings.set_as_basic(name, true)
	GLTFDocument.register_gltf_document_extension(_import)


func _exit_tree() -> void:
	GLTFDocument.unregister_gltf_document_extension(_import)
