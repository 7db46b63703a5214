"""Shader sources: includes and constants resolved, with every line traceable to its file.

Two extensions to GLSL:
    #include "lib_x.glsl"   inserts a file of gpu_shaders/, once per shader
    {{name}}                a constant that is declared in Python, see CONSTANTS
An unknown file or name raises an error with file and line, before any driver compiles it.
Importable and testable without gpu.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from types import MappingProxyType

from ..cards.bake import SAMPLES, SPARSE_RANGE, SPARSE_STEPS
from ..dynamics import blend, hair_grid, springs
from ..dynamics.colliders.signed_distance import MIN_GRADIENT
from ..dynamics.constraints import CONTACT_WEIGHT, HELD_SWEEPS, HELD_WEIGHT, PINNED_COUNT
from ..dynamics.contacts import (
    ALLOWED_DEPTH,
    CONTACT_MARGIN,
    FAST_SEGMENTS,
    MAX_EXTRA_ROUNDS,
    MAX_SEGMENT_WEIGHT,
    MAX_TRACE_STEPS,
    PART_COUNT,
    PART_PASS_FACTOR,
    SEGMENT_POINTS,
    SEGMENT_RADIUS,
    TOUCH_DISTANCE,
)
from ..dynamics.force_fields import KINDS, SHAPES
from ..dynamics.wind import MODES
from ..refine import curls, detail, lead_out, ride
from ..refine.hold import MIN_HOLD_ERROR, SWEEPS
from ..refine.settings import DetailSettings
from ..shading.card_look import DARKEST, MEAN_FACING
from ..shading.card_texture import LEVELS, SLACK
from ..shading.lights import HARMONIC_COUNT, LIGHT_CAPACITY
from ..shading.microfacet import MIN_ROUGHNESS
from ..shading.skin.diffusion import KERNEL_REACH, KERNEL_TAPS, SKIN_LIGHTS
from ..shading.skin.layout import CLOSING
from ..shading.skin_seen import ABSORBED_FRACTION, CLUMPING
from ..shading.volume.card_opacity import (
    MAX_ALPHA,
    MAX_EYE_TAU,
    MEAN_TURN,
    MIN_DEPTH,
    MIN_EYE_TAU,
    MIN_FACING,
    MIN_TAU_DIFFERENCE,
    SIDEDNESS,
    VISIBLE_UPRIGHT,
)
from ..shading.volume.dual import DEFAULT_TAU_BEYOND, MIDPOINT
from ..shading.volume.map_size import START_TEXELS
from ..shading.volume.mesh_frames import MESH_FRAME_CAPACITY
from ..shading.volume.mesh_light import (
    MAX_SLOPE,
    MESH_BIAS,
    MESH_BLUR,
    MESH_TAPS,
    MIN_COSINE,
)
from ..shading.volume.opacity import MAP_BORDER, MIN_MESH_BIAS, MIN_THICKNESS
from ..shading.volume.transparency import UNSEEN_FRACTION
from ..strands.vectors import GOLDEN_ANGLE
from .pixel_parts import DEPTH_END

SHADER_FOLDER = Path(__file__).resolve().parents[2] / "gpu_shaders"

#: Largest texture side that every GPU supported by Blender has [texels].
STRAND_ROWS = 16384
#: Texels of a row of the dynamics' `substep_table`: for the substep itself, and for each collider.
SUBSTEP_TEXELS, COLLIDER_TEXELS = 1 + -(-MODES // 4), 13
#: Strands per block in which those to be led out of colliders are counted.
LEAD_BLOCK = 128
#: Round solids, and nodes of distance fields, in one row of their textures.
ROUNDS_ACROSS, FIELD_ROW = 512, 4096
#: Most regions behind the head for culling; a strand's regions are bits of one integer.
HIDDEN_REGION_CAPACITY = 16
#: Most texels, of four layers each, of an opacity map: three passes of six slots, for 64 slices.
LAYER_TEXEL_CAPACITY = 18
#: Scale of depths as integers in `starts` of opacity maps.
START_SCALE = float(1 << 24)
#: Fragments of strands per row of the texture with the lists of all pixels.
LAYER_ROW = 4096
#: half width to which a strand may be widened to replace others that are not drawn [pixels]
THIN_STRAND = 1.5
#: binary digits of the largest number of layers of a pixel
LIST_DIGITS = 26
#: Triangles, seams and copies of seams' ends in one row of the textures of skin.
SKIN_TRIANGLES_ACROSS, SKIN_SEAMS_ACROSS, SKIN_COPIES_ACROSS = 1024, 1024, 4096
#: Pixels between the tiles that show the layers of a map.
TILE_GAP = 2
#: masks hold objects that cover more of a pixel than this, as in Cycles
MIN_COVERING_ALPHA = 0.5
#: added to brightness on the screen before dividing by it
NO_LIGHT = 1.0e-4
#: number of lights, the strongest, for which grooms shade each other: a texture channel each
OTHER_TAU_LIGHTS = 4
#: encodings of a pass's colour; see output_encoded() in lib_output.glsl
OUTPUTS = ("scene_linear", "viewport")
#: colours of strands instead of their shading, see lib_debug_color.glsl
DEBUG_VIEWS = ("none", "detail", "guide", "group", "occlusion", "stretch", "depth")
#: a relative change of length, and a depth as a fraction of the hair's radius, shown in full colour
FULL_COLOR_STRETCH, FULL_COLOR_DEPTH = 0.01, 0.02
#: the choices of DetailSettings; shaders use their indices
DETAIL_CHOICES = {
    parameter.name: tuple(name for name, _, _ in parameter.choices)
    for parameter in DetailSettings.parameters()
    if parameter.kind == "choice"
}

CONSTANTS: Mapping[str, str] = MappingProxyType(
    {
        "light_capacity": str(LIGHT_CAPACITY),
        "harmonic_count": str(HARMONIC_COUNT),
        "min_roughness": repr(MIN_ROUGHNESS),
        "strand_rows": str(STRAND_ROWS),
        "pinned_count": str(PINNED_COUNT),
        "contact_weight": repr(float(CONTACT_WEIGHT)),
        "held_weight": repr(float(HELD_WEIGHT)),
        "max_linearised": repr(float(springs.MAX_LINEARISED)),
        "hair_grid_max_motion": repr(float(hair_grid.MAX_MOTION * hair_grid.MOTION_UNITS)),
        "hair_grid_density_tolerance": repr(hair_grid.DENSITY_TOLERANCE),
        "hair_grid_max_shift": repr(hair_grid.MAX_SHIFT),
        "hair_grid_pressed_friction": repr(hair_grid.PRESSED_FRICTION),
        "hair_grid_min_density": repr(hair_grid.MIN_DENSITY),
        "min_blend_direction": repr(float(blend.MIN_DIRECTION)),
        "held_sweeps": str(HELD_SWEEPS),
        "hold_sweeps": str(SWEEPS),
        "min_hold_error": repr(MIN_HOLD_ERROR),
        "min_gradient": repr(MIN_GRADIENT),
        "lead_sweeps": str(lead_out.SWEEPS),
        "lead_tolerance": repr(lead_out.TOLERANCE),
        "lead_min_deflection": repr(lead_out.MIN_DEFLECTION),
        "lead_directions": str(lead_out.DIRECTION_COUNT),
        "lead_bisections": str(lead_out.BISECTIONS),
        "lead_extra_distance": repr(lead_out.EXTRA_DISTANCE),
        "lead_block": str(LEAD_BLOCK),
        "lead_max_straight_move": repr(lead_out.MAX_STRAIGHT_MOVE),
        "lead_min_squared_sine": repr(lead_out.MIN_SQUARED_SINE),
        "touch_distance_over_margin": repr(TOUCH_DISTANCE / CONTACT_MARGIN),
        "min_segment_length": repr(ride.MIN_SEGMENT_LENGTH),
        "extension_tolerance": repr(curls.EXTENSION_TOLERANCE),
        "extension_gain": repr(curls.EXTENSION_GAIN),
        "max_widening": repr(curls.MAX_WIDENING),
        "min_axis_length": repr(curls.MIN_AXIS_LENGTH),
        "reversal_limit": repr(ride.REVERSAL_LIMIT),
        "segment_point_count": str(len(SEGMENT_POINTS)),
        "segment_radius": repr(float(SEGMENT_RADIUS)),
        "max_trace_steps": str(MAX_TRACE_STEPS),
        "allowed_depth": repr(float(ALLOWED_DEPTH)),
        "max_extra_rounds": str(MAX_EXTRA_ROUNDS),
        "fast_segments_over_margin": repr(FAST_SEGMENTS / CONTACT_MARGIN),
        "part_count": str(PART_COUNT),
        "part_pass_factor": str(PART_PASS_FACTOR),
        "max_segment_weight": repr(float(MAX_SEGMENT_WEIGHT)),
        "wind_modes": str(MODES),
        **{f"field_{name}": str(number) for number, name in enumerate(KINDS)},
        **{f"shape_{name}": str(number) for number, name in enumerate(SHAPES)},
        "substep_texels": str(SUBSTEP_TEXELS),
        "collider_texels": str(COLLIDER_TEXELS),
        "rounds_across": str(ROUNDS_ACROSS),
        "field_row": str(FIELD_ROW),
        "hidden_region_capacity": str(HIDDEN_REGION_CAPACITY),
        "layer_texel_capacity": str(LAYER_TEXEL_CAPACITY),
        "map_border": repr(MAP_BORDER),
        "min_mesh_bias": repr(MIN_MESH_BIAS),
        "mesh_frame_capacity": str(MESH_FRAME_CAPACITY),
        "min_covering_alpha": repr(MIN_COVERING_ALPHA),
        "no_light": repr(NO_LIGHT),
        "other_tau_lights": str(OTHER_TAU_LIGHTS),
        "mesh_bias": repr(MESH_BIAS),
        "mesh_blur": repr(MESH_BLUR),
        "mesh_taps": str(MESH_TAPS),
        "golden_angle": repr(GOLDEN_ANGLE),
        "max_mesh_slope": repr(MAX_SLOPE),
        "min_mesh_cosine": repr(MIN_COSINE),
        "start_texels": str(START_TEXELS),
        "tile_gap": str(TILE_GAP),
        "midpoint_absorption": repr(MIDPOINT),
        "clumping": repr(CLUMPING),
        "absorbed_fraction": repr(ABSORBED_FRACTION),
        "max_alpha": repr(MAX_ALPHA),
        "default_tau_beyond": repr(DEFAULT_TAU_BEYOND),
        "start_scale": repr(START_SCALE),
        "min_thickness": repr(MIN_THICKNESS),
        "layer_row": str(LAYER_ROW),
        "unseen_fraction": repr(UNSEEN_FRACTION),
        "list_digits": str(LIST_DIGITS),
        "depth_end": str(DEPTH_END),
        "thin_strand": repr(THIN_STRAND),
        "skin_triangles_across": str(SKIN_TRIANGLES_ACROSS),
        "skin_seams_across": str(SKIN_SEAMS_ACROSS),
        "skin_copies_across": str(SKIN_COPIES_ACROSS),
        "skin_lights": str(SKIN_LIGHTS),
        "skin_kernel_reach": repr(float(KERNEL_REACH)),
        "skin_kernel_taps": str(KERNEL_TAPS),
        "skin_closing": repr(float(CLOSING)),
        "atlas_samples": str(SAMPLES),
        "mean_facing": repr(MEAN_FACING),
        "darkest": repr(DARKEST),
        "min_facing": repr(MIN_FACING),
        "mean_turn": repr(MEAN_TURN),
        "min_eye_tau": repr(MIN_EYE_TAU),
        "max_eye_tau": repr(MAX_EYE_TAU),
        "min_tau_difference": repr(MIN_TAU_DIFFERENCE),
        "min_depth": repr(MIN_DEPTH),
        "sidedness": repr(SIDEDNESS),
        "visible_upright": repr(VISIBLE_UPRIGHT),
        "card_texture_levels": str(LEVELS),
        "card_texture_slack": str(SLACK),
        "sparse_mask": str(SPARSE_RANGE - 1),
        **{f"sparse_step_{axis}": str(s) for axis, s in zip("xyz", SPARSE_STEPS, strict=True)},
        "detail_nearest": repr(float(detail.NEAREST)),
        "detail_margin": repr(float(detail.MARGIN)),
        **{
            f"{choice}_{name}": str(index)
            for choice, names in DETAIL_CHOICES.items()
            for index, name in enumerate(names)
        },
        "full_color_stretch": repr(FULL_COLOR_STRETCH),
        **{f"debug_{name}": str(index) for index, name in enumerate(DEBUG_VIEWS)},
        **{f"output_{name}": str(index) for index, name in enumerate(OUTPUTS)},
    }
)

_INCLUDE = re.compile(r'^\s*#\s*include\s+"([^"]*)"\s*$')
_NAME = re.compile(r"\{\{\s*([^{}]*?)\s*\}\}")
_COMPILER_LINE = re.compile(r"python_shader\.glsl:(\d+)")


class ShaderError(RuntimeError):
    """A shader that cannot be composed, compiled or bound; the message has place and log."""


def output_index(output: str) -> int:
    """The index of an output in shaders.

    Raises:
        ValueError: there is no such output.
    """
    if output not in OUTPUTS:
        raise ValueError(f"output {output!r} is none of {', '.join(OUTPUTS)}")
    return OUTPUTS.index(output)


@dataclass(frozen=True)
class ShaderText:
    """One composed shader stage.

    origins: (file name, line number from 1) of every line of `source`.
    """

    source: str
    origins: tuple[tuple[str, int], ...]

    def place(self, line: int) -> str:
        """`file:line` of a line of the composed source, counted from 1."""
        if not 1 <= line <= len(self.origins):
            return f"composed line {line}"
        file, number = self.origins[line - 1]
        return f"{file}:{number}"

    def mapped(self, log: str) -> str:
        """A compiler log with line numbers replaced by places in our files."""
        return _COMPILER_LINE.sub(lambda found: self.place(int(found.group(1))), log)


def compose(name: str, folders: Sequence[Path] = (SHADER_FOLDER,)) -> ShaderText:
    """The file of this name with all included files, each once, before the first that needs it.

    Args:
        folders: searched in order; tests put their own before SHADER_FOLDER.

    Raises:
        ShaderError: an unknown file or name, with the file and line that refers to it.
    """
    lines: list[str] = []
    origins: list[tuple[str, int]] = []
    _append(name, "shader", tuple(folders), set(), lines, origins)
    return ShaderText("\n".join(lines) + "\n", tuple(origins))


def _append(
    name: str,
    included_from: str,
    folders: tuple[Path, ...],
    done: set[str],
    lines: list[str],
    origins: list[tuple[str, int]],
) -> None:
    """Append one file to `lines`, with each included file inserted in place of its include."""
    if name in done:
        return
    done.add(name)
    for number, (line, included) in enumerate(_read(name, included_from, folders), start=1):
        if included:
            _append(included, f"{name}:{number}", folders, done, lines, origins)
            continue
        lines.append(line)
        origins.append((name, number))


def _read(name: str, included_from: str, folders: tuple[Path, ...]) -> tuple[tuple[str, str], ...]:
    """The lines of a file, each with the name of the file that it includes, "" for none."""
    for folder in folders:
        file = folder / name
        if file.is_file():
            return _lines(file, file.stat().st_mtime_ns)
    raise ShaderError(f"{included_from}: there is no shader file '{name}'")


@cache
def _lines(file: Path, _written: int) -> tuple[tuple[str, str], ...]:
    """As `_read`, cached, since many programs include the same files."""
    lines = []
    for number, line in enumerate(file.read_text(encoding="utf-8").splitlines(), start=1):
        include = _INCLUDE.match(line)
        own = "" if include else _with_constants(line, f"{file.name}:{number}")
        lines.append((own, include.group(1) if include else ""))
    return tuple(lines)


def _with_constants(line: str, place: str) -> str:
    def value(found: re.Match[str]) -> str:
        if found.group(1) not in CONSTANTS:
            known = ", ".join(sorted(CONSTANTS))
            raise ShaderError(f"{place}: unknown name '{found.group(1)}'; known are {known}")
        return CONSTANTS[found.group(1)]

    return _NAME.sub(value, line)
