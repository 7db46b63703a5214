"""Changes to a GLB of cards that make it look right in viewers without support for Hairloom.

Only one level of detail is in its scene: MSFT_lod refers to the others, which viewers without it
ignore. The material has all maps that glTF defines, see `with_material`.

Khronos, "glTF 2.0 Specification", sections 3.9 and 5.19; vendor extension MSFT_lod; extension
KHR_materials_anisotropy.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from ...cards.card_mesh import CardMesh
from .glb_file import GlbFile

LOD, _ANISOTROPY = "MSFT_lod", "KHR_materials_anisotropy"
_SPECULAR = "KHR_materials_specular"
#: Fraction of a smooth surface's reflected light that hair reflects: measured with `bench engines`.
SPECULAR = 0.9
#: Height of a screen [pixels] on which the next level is off by one pixel where it takes over.
SCREEN_HEIGHT = 1080.0
#: A level of unknown error takes over at this fraction of the height of the last.
_DEFAULT_STEP = 0.5
_CLAMPED, _LINEAR, _MIP_MAPPED = 33071, 9729, 9987
#: the second UV map's first component is ambient occlusion, which a ramp of grey maps to itself
_OCCLUSION_UV = 1


def with_levels(file: GlbFile, nodes: Sequence[str], coverage: Sequence[float]) -> None:
    """Leave only the finest level in the scene, with references to the others.

    Args:
        nodes: of the levels, the finest first.
        coverage: see `screen_coverage`.
    """
    finest, *others = (file.node(name) for name in nodes)
    if not others:
        return
    for node in (*file.content["nodes"], *file.content["scenes"]):
        for key in ("children", "nodes"):
            if key in node:
                node[key] = [each for each in node[key] if each not in others]
    node = file.content["nodes"][finest]
    node.setdefault("extensions", {})[LOD] = {"ids": others}
    node.setdefault("extras", {})["MSFT_screencoverage"] = list(coverage)
    _declare_extension(file, LOD)


def screen_coverage(levels: Sequence[CardMesh], errors: Sequence[float]) -> list[float]:
    """The smallest fraction of the screen that the hair takes up while each level is shown; 0 for
    the last. A level is replaced by the next where that one is off by a pixel of SCREEN_HEIGHT.

    Args:
        errors: of each level [m], as CardBuild has them; empty where they are not known.
    """
    points = levels[0].positions
    height = float((points.max(axis=0) - points.min(axis=0)).max())
    fractions = [1.0]
    for number in range(1, len(levels)):
        error = errors[number] if errors else 0.0
        own = height / (error * SCREEN_HEIGHT) if error > 0.0 else _DEFAULT_STEP * fractions[-1]
        fractions.append(min(own, fractions[-1]))
    return [round(fraction * fraction, 6) for fraction in fractions[1:]] + [0.0]


def with_material(file: GlbFile, pictures: Mapping[str, bytes], ramp: bytes) -> None:
    """Give the cards' material its maps beside the colour, which Blender's exporter has written.

    Args:
        pictures: PNG files of the maps "normal" and "anisotropy", as `texture_packing` packs them
            for glTF; those that are not there are left out.
        ramp: a PNG from black at the left to white at the right.
    """
    (material,) = file.content["materials"]
    extensions = material.setdefault("extensions", {})
    extensions[_SPECULAR] = {"specularFactor": SPECULAR}
    _declare_extension(file, _SPECULAR)
    occlusion = _texture(file, ramp, "occlusion ramp", _LINEAR)
    material["occlusionTexture"] = {"index": occlusion, "texCoord": _OCCLUSION_UV}
    if "normal" in pictures:
        normal = _texture(file, pictures["normal"], "normal", _MIP_MAPPED)
        material["normalTexture"] = {"index": normal}
    if "anisotropy" in pictures:
        extension = extensions.setdefault(_ANISOTROPY, {})
        extension.pop("anisotropyRotation", None)
        texture = _texture(file, pictures["anisotropy"], "anisotropy", _MIP_MAPPED)
        extension["anisotropyTexture"] = {"index": texture}
        _declare_extension(file, _ANISOTROPY)


def _texture(file: GlbFile, picture: bytes, name: str, min_filter: int) -> int:
    view = file.add_bytes(picture)
    image = {"name": name, "mimeType": "image/png", "bufferView": view}
    sampler: dict[str, Any] = {"magFilter": _LINEAR, "minFilter": min_filter}
    sampler |= {"wrapS": _CLAMPED, "wrapT": _CLAMPED}
    texture = {
        "source": file.append("images", image),
        "sampler": file.append("samplers", sampler),
    }
    return file.append("textures", texture)


def _declare_extension(file: GlbFile, extension: str) -> None:
    used = file.content.setdefault("extensionsUsed", [])
    if extension not in used:
        used.append(extension)
