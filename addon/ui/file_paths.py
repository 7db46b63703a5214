"""The path properties of operators. // at their start is the folder of the blend file; without the
option that says so, Blender warns of such a path in every call."""

from __future__ import annotations

from bpy.props import StringProperty

_RELATIVE = "PATH_SUPPORTS_BLEND_RELATIVE"

#: `filepath` of Blender's ImportHelper and ExportHelper, which lack the option
FILE_TO_READ = StringProperty(
    name="File Path",
    description="Filepath used for importing the file",
    maxlen=1024,
    subtype="FILE_PATH",
    options={"SKIP_PRESET", "HIDDEN", _RELATIVE},
)
FILE_TO_WRITE = StringProperty(
    name="File Path",
    description="Filepath used for exporting the file",
    maxlen=1024,
    subtype="FILE_PATH",
    options={_RELATIVE},
)
#: folder of the files that were chosen or dropped
FOLDER_TO_READ = StringProperty(subtype="DIR_PATH", options={"HIDDEN", "SKIP_SAVE", _RELATIVE})
FOLDER_OF_PICTURES = StringProperty(
    name="Folder",
    description="Folder for the pictures and the video",
    subtype="DIR_PATH",
    options={"SKIP_SAVE", "HIDDEN", _RELATIVE},
)
