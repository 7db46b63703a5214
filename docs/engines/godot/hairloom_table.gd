@tool
extends RefCounted
## Reads the tables of the light, as Hairloom writes them: OpenEXR files of 32-bit floats without compression.
## Before 4.6, Godot's own reader of such files is part of the editor, and of no game that it exports.
##
## The OpenEXR file layout: https://openexr.com/en/latest/OpenEXRFileLayout.html

const MAGIC := 20000630
const FLOAT := 2
const LANES := "RGBA"


## Four channels, the lowest row first; null if it is no such file, or cut off.
static func read(path: String) -> Image:
	var bytes := FileAccess.get_file_as_bytes(path)
	var file := StreamPeerBuffer.new()
	file.data_array = bytes
	if bytes.size() < 8 or file.get_32() != MAGIC or file.get_32() != 2:
		return null
	var header := {}
	var name := _text(file)
	while name:
		_text(file)  # the kind of the value
		var size := file.get_32() if file.get_available_bytes() > 4 else -1
		if size < 0 or size > file.get_available_bytes():
			return null
		header[name] = file.get_data(size)[1]
		name = _text(file)
	if header.get("compression", []) != PackedByteArray([0]) or not "dataWindow" in header:
		return null
	var lanes := _lanes(header.get("channels", PackedByteArray()))
	var window: PackedInt32Array = header["dataWindow"].to_int32_array()
	var width := window[2] - window[0] + 1
	var height := window[3] - window[1] + 1
	# where each row begins; then each row: its number and its size; all values of a channel, then of the next
	var row_size := 8 + 4 * width * lanes.size()
	var first := file.get_position() + 8 * height
	if lanes.is_empty() or mini(width, height) < 1 or bytes.size() < first + row_size * height:
		return null
	var values := PackedFloat32Array()
	values.resize(4 * width * height)
	for row in height:
		var start := first + row_size * row + 8
		var numbers := bytes.slice(start, start + row_size - 8).to_float32_array()
		var target := 4 * width * (height - 1 - row)
		for number in lanes.size():
			for column in width:
				values[target + 4 * column + lanes[number]] = numbers[width * number + column]
	return Image.create_from_data(width, height, false, Image.FORMAT_RGBAF, values.to_byte_array())


static func _text(file: StreamPeerBuffer) -> String:
	var text := ""
	while file.get_available_bytes() > 0:
		var sign := file.get_u8()
		if sign == 0:
			break
		text += char(sign)
	return text


## Where each of the file's channels goes; none if they are not floats of red, green, blue and alpha.
static func _lanes(channels: PackedByteArray) -> PackedInt32Array:
	var list := StreamPeerBuffer.new()
	list.data_array = channels
	var lanes := PackedInt32Array()
	var name := _text(list)
	while name:
		var lane := LANES.find(name)
		if lane < 0 or list.get_available_bytes() < 16 or list.get_32() != FLOAT:
			return PackedInt32Array()
		lanes.append(lane)
		list.get_data(12)  # how it is seen, and that no row or column is left out
		name = _text(list)
	return lanes
