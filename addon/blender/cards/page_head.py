"""The head on the web page of an export: its mesh, and how it is drawn."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ...arrays import Floats, Ints
from ...exchange.cards.card_formats import CardFormat
from ...exchange.cards.page_asset import rounded
from ...exchange.files.axes import from_z_up
from ...exchange.textures.srgb import srgb_encoded
from ...strands import Surface
from ..base.images import webp_bytes
from ..scene.built_in_head import HeadLook
from ..scene.head_look import PLAIN_SKIN
from ..scene.mesh_materials import MeshMaterial

#: longest side [pixels] and file quality of pictures
_SIDE, _QUALITY = 1024, 90


@dataclass(frozen=True)
class PageHead:
    """A head in a page.

    files: "head.triangles" (uint32); for each vertex "head.positions", "head.normals" and, if there
        are pictures, "head.uv" (float32); and the pictures.
    parts: for each material, in the order of the triangles, their number and how they are drawn;
        colours are scene-linear.
    """

    files: dict[str, bytes]
    parts: list[dict[str, Any]]

    @classmethod
    def of(
        cls, path: Path, head: Surface, look: HeadLook | None, file_format: CardFormat
    ) -> PageHead:
        """Args:
        path: of the mesh of cards; temporary pictures are written in its folder.
        look: None: plain skin.
        """
        chosen = look or ((np.arange(len(head.triangles)), PLAIN_SKIN),)
        order = np.concatenate([triangles for triangles, _ in chosen])
        is_painted = any(_color_of(material) is not None for _, material in chosen)
        has_uv = head.corner_uv is not None and is_painted
        vertex, triangles, uv = _split(head, order, has_uv=has_uv)
        positions = file_format.to_file_space(head.positions[vertex])
        normals = from_z_up(head.vertex_normals()[vertex], file_format.up)
        files = {
            "head.positions": rounded("POSITION", positions).tobytes(),
            "head.normals": rounded("NORMAL", normals).tobytes(),
            "head.triangles": triangles.astype(np.uint32).tobytes(),
        }
        if uv is not None:
            files["head.uv"] = rounded("TEXCOORD_0", uv).tobytes()
        pictures: dict[int, str] = {}
        parts = []
        for triangles_of_part, material in chosen:
            color = _color_of(material) if has_uv else None
            if color is not None and id(color) not in pictures:
                pictures[id(color)] = f"head.{len(pictures)}.webp"
                files[pictures[id(color)]] = webp_bytes(path, _coded(color), _SIDE, _QUALITY)
            parts.append(
                {
                    "triangles": len(triangles_of_part),
                    "color": list(material.color),
                    "emission": list(material.emission),
                    "roughness": material.roughness,
                    "specular": material.specular,
                    "alpha": material.alpha,
                    "transparency": material.transparency,
                    "picture": None if color is None else pictures[id(color)],
                }
            )
        return cls(files, parts)


def _color_of(material: MeshMaterial) -> Floats | None:
    return None if material.pictures is None else material.pictures.color


def _coded(color: Floats) -> Floats:
    """The colour encoded as sRGB."""
    coded = np.clip(color, 0.0, 1.0).astype(np.float32)
    coded[..., :3] = srgb_encoded(coded[..., :3])
    return coded


def _split(head: Surface, order: Ints, *, has_uv: bool) -> tuple[Ints, Ints, Floats | None]:
    """The head with vertices split at UV seams: the head's vertex that each vertex is, the
    triangles in this order, and the UV of each vertex."""
    triangles = head.triangles[order]
    if not has_uv:
        return np.arange(len(head.positions)), triangles, None
    assert head.corner_uv is not None
    uv = np.float32(head.corner_uv[order]).reshape(-1, 2)
    corner = np.column_stack([triangles.ravel(), uv.view(np.int32)])
    _, first, number = np.unique(corner, axis=0, return_index=True, return_inverse=True)
    return triangles.ravel()[first], number.reshape(-1, 3), uv[first]
