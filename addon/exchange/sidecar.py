"""NAME.hairloom.json beside a GLB: what a glTF file cannot say about how its hair is to be drawn.

For the engine programmer who writes the hair material. Plain data; all vectors in the GLB's axes.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from ..cards.card_mesh import CardMesh
from .atomic import write_text_atomic
from .axes import from_z_up

SIDECAR_VERSION = 1

#: From this alpha on a pixel counts as opaque: nearly 1, for textures that were compressed.
OPAQUE_ALPHA = 0.99
#: Below it a pixel cannot be seen in 8 bits, and must not hide what is drawn after it.
LEAST_ALPHA = 0.004


@dataclass(frozen=True)
class DrawPass:
    """One of the passes in which cards are drawn; tests and culling in the words of the GPU.

    pixels: which of them; "all" needs no test of alpha.
    """

    name: str
    pixels: str
    color_write: bool
    depth_write: bool
    depth_test: str
    cull: str

    @property
    def is_blended(self) -> bool:
        return "transparent" in self.name

    def as_dict(self) -> dict[str, Any]:
        blend = "source alpha, one minus source alpha" if self.is_blended else "off"
        return {**asdict(self), "blend": blend}


_OPAQUE = "alpha >= opaque_alpha"
_REST = "alpha < opaque_alpha"
_VISIBLE = "alpha >= least_alpha"
#: Scheuermann 2004, where the first pass alone tests alpha, so that the others keep early depth
#: tests. The last one, which writes depth, tests it here too: else a card's clear pixels hide what
#: is drawn after it, which doubles the difference to hair that is sorted for each view.
FOUR_PASSES = (
    DrawPass("prime depth", _OPAQUE, False, True, "less", "none"),
    DrawPass("opaque", "all", True, False, "equal", "none"),
    DrawPass("transparent back faces", "all", True, False, "less", "front"),
    DrawPass("transparent front faces", _VISIBLE, True, True, "less", "back"),
)
#: The simpler scheme of the same author, with an alpha test in every pass.
THREE_PASSES = (
    DrawPass("opaque", _OPAQUE, True, True, "less", "none"),
    DrawPass("transparent back faces", _REST, True, False, "less", "front"),
    DrawPass("transparent front faces", f"{_VISIBLE} and {_REST}", True, True, "less", "back"),
)


def write_sidecar(
    glb_path: Path,
    mesh: CardMesh,
    *,
    portable: bool = True,
    textures: Mapping[str, str] | None = None,
    highlights: str = "shift",
) -> Path:
    """Write the description of the cards in `glb_path` beside it; its path is returned.

    Args:
        mesh: the cards as they were written, world space, Z up.
        portable: whether ambient occlusion is in TEXCOORD_1 only.
        textures: name -> file of those of the five hair textures that lie beside it.
        highlights: which of them breaks up the highlights, "shift" or "tangent".

    Raises:
        HairloomError: nothing can be written there.
    """
    path = glb_path.with_suffix(".hairloom.json")
    content = {"file": glb_path.name, **description(mesh, portable=portable)}
    if textures:
        files = {name: {"file": file, **_TEXTURES[name]} for name, file in textures.items()}
        content["textures"] = {**_TEXTURES_ARE, "highlights_by": highlights, **files}
    write_text_atomic(path, json.dumps(content, indent=2) + "\n")
    return path


def description(mesh: CardMesh, *, portable: bool = True) -> dict[str, Any]:
    """The sidecar's content but for the files."""
    return {
        "hairloom_sidecar": SIDECAR_VERSION,
        "generator": "Hairloom",
        "axes": "right-handed, +Y up, metres, triangles counter-clockwise seen from outside",
        "counts": {
            "cards": mesh.card_count,
            "triangles": len(mesh.triangles),
            "vertices": len(mesh.positions),
        },
        "bounds": _bounds(mesh),
        "attributes": _ATTRIBUTES | ({} if portable else {"_AO": _OCCLUSION}),
        "texture": {"columns": mesh.atlas.columns, **_TEXTURE},
        "draw_order": _DRAW_ORDER,
        "opaque_alpha": OPAQUE_ALPHA,
        "least_alpha": LEAST_ALPHA,
        "passes": [each.as_dict() for each in FOUR_PASSES],
        "passes_fallback": [each.as_dict() for each in THREE_PASSES],
        "shading": _SHADING,
        "engines": _ENGINES,
    }


def _bounds(mesh: CardMesh) -> dict[str, list[float]]:
    corners = from_z_up(mesh.positions, "Y")
    if not len(corners):
        return {"minimum": [0.0] * 3, "maximum": [0.0] * 3}
    return {
        "minimum": [float(value) for value in corners.min(axis=0)],
        "maximum": [float(value) for value in corners.max(axis=0)],
    }


_OCCLUSION = "ambient occlusion per vertex, 0 shut in to 1 open"
_ATTRIBUTES = {
    "POSITION": "rest pose",
    "NORMAL": "of the card, away from the head, rounded across the card",
    "TANGENT": "xyz across the strands, along u; strands run from root to tip along "
    "cross(NORMAL, TANGENT.xyz)",
    "TEXCOORD_0": "u across the card within its column of the texture, v from 1 at the root "
    "to 0 at the tip",
    "TEXCOORD_1": f"{_OCCLUSION}, the same in both components; multiply the shaded colour with it",
}
_TEXTURE = {
    "columns_are": "variants of a strip of hair, side by side in u; each card uses one",
    "rgb": "sRGB, stretched noise: multiply by baseColorFactor, the colour of the hair",
    "alpha": "straight coverage; 0 at both sides of a column, fully opaque in its middle",
}
_TEXTURES_ARE = {
    "place": "read with TEXCOORD_0; the lowest row of a picture is the root",
    "shift_and_noise": "repeat in u and v, so that they may be scaled; base, alpha and tangent "
    "hold one strip a column",
}
_LINEAR = "linear: no sRGB decoding"
_TEXTURES = {
    "base": {
        "color_space": "sRGB",
        "rgb": "stretched noise: multiply by baseColorFactor; the same as in the GLB",
    },
    "alpha": {"color_space": _LINEAR, "r": "straight coverage; the same as in the GLB"},
    "shift": {
        "color_space": _LINEAR,
        "r": "moves both highlights: shift + shift_noise (r - 0.5)",
    },
    "noise": {
        "color_space": _LINEAR,
        "r": "breaks up the second highlight: times mix(1, r, sparkle)",
    },
    "tangent": {
        "color_space": _LINEAR,
        "rgb": "the way of a strand, d = 2 rgb - 1: x across the card along u, y from root to "
        "tip, z along NORMAL. In place of shift: T = normalize(d.x TANGENT.xyz + "
        "d.y cross(NORMAL, TANGENT.xyz) + shift_noise d.z NORMAL)",
    },
}
_DRAW_ORDER = {
    "order": "cards from the inside to the outside of the hair; draw the indices as they stand",
    "first": "all opaque meshes, the head included, before the first hair pass",
    "valid_while": "the hair keeps its place on the head; sort hanging parts at run time, by card",
    "keep": "index order; optimisers that reorder triangles for vertex caches destroy it",
}


_SHADING = {
    "model": "Scheuermann 2004; T from root to tip, N, L, V unit vectors, H = normalize(L + V)",
    "diffuse": "max(0, 0.75 dot(N, L) + 0.25)",
    "shifted_tangent": "normalize(T + shift N); positive moves the highlight to the tip",
    "specular": "smoothstep(-1, 0, dot(T, H)) pow(sqrt(1 - dot(T, H)^2), exponent)",
    "sum": "(diffuse + two speculars, shifted apart) rgb baseColorFactor occlusion",
}
_ENGINES = {
    "three.js": "draws blended double-sided materials twice, back faces first; "
    "material.forceSinglePass = true draws the file's order once",
    "Godot": "gives blended materials a depth pre-pass; set Transparency to Alpha for the file's "
    "order in one pass",
    "others": "one blended double-sided pass in index order is nearly right from every side",
}
