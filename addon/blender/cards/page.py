"""The web page beside a GLB of cards."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from ...arrays import Floats, Ints
from ...cards.export_settings import CardExportSettings
from ...errors import HairloomError
from ...exchange.cards.card_formats import GLB, CardFormat
from ...exchange.cards.card_page import PAGE_SUFFIX, CardPage, page_text
from ...exchange.cards.index_buffer import index_buffer
from ...exchange.cards.page_asset import half_floats, size_rows, small_glb, small_maps
from ...exchange.cards.sidecar import SUFFIX, CardFile, sidecar_text
from ...exchange.cards.sidecar_texts import ROLES
from ...shading.settings import ShadingSettings
from .build import CardMaps, MappedCards
from .page_head import PageHead
from .textures import look_tables, png_of

PAGE_AT_REST = (
    "The web page shows the hair at rest, since it cannot play vertex textures or springs. Choose "
    "Joints for a page with motion."
)
#: Texture -> its title, in the order on the page.
_TITLES = {
    "base": "Colour",
    "alpha": "Alpha",
    "tangent": "Direction",
    "normal": "Normal",
    "shift": "Shift",
    "noise": "Noise",
}


def check_page(settings: CardExportSettings, file_format: CardFormat, place: str) -> None:
    """Refuse a page beside another format than GLB, before any work is done.

    Raises:
        HairloomError: the page could not show the file.
    """
    if settings.page and file_format != GLB:
        raise HairloomError(
            f"a web page needs a GLB, and this is {file_format.title}",
            place=place,
            remedy="Write a .glb, or turn Web Page off",
        )


def write_page(
    path: Path,
    name: str,
    sidecar: CardFile,
    made: MappedCards,
    shading: ShadingSettings,
    backs: Sequence[Ints],
    head: PageHead | None,
    settings: CardExportSettings,
    carrier: Floats,
) -> None:
    """Write NAME.html beside the files of an export, which all exist except the sidecar.

    Args:
        path: of the GLB.
        name: of the hair.
        sidecar: of the GLB; the page holds another one for its own, smaller files.
        backs: for each level, see `index_buffer`.
        carrier: (frame_count, 4, 4): rigid motion of hair and head together, world space.
    """
    maps = small_maps(_shown(made.maps), made.build.finest.atlas, int(settings.page_texture))
    files = {
        f"{role}.png": png_of(path, values, is_color=role == "base")
        for role, values in maps.items()
    }
    tables = {f"{role}.table": half_floats(each) for role, each in look_tables(shading).items()}
    indices = index_buffer(sidecar.levels, backs).back_orders_only()
    own = replace(
        sidecar,
        textures={
            role: {"file": f"{role}.png", "channels": _channels(maps[role])} for role in maps
        },
        texture_files={},
        indices=("indices.bin", indices),
        material={
            **sidecar.material,
            "tables": {file.removesuffix(".table"): {"file": file} for file in tables},
        },
    )
    glb = path.read_bytes()
    files |= {
        path.name: small_glb(glb, str(path)),
        path.stem + SUFFIX: sidecar_text(own).encode(),
        "indices.bin": indices.content,
        **tables,
        **({} if head is None else head.files),
    }
    levels = [
        {"triangles": len(each.triangles), "cards": each.card_count} for each in sidecar.levels
    ]
    textures = {file: path.with_name(file).stat().st_size for file in sidecar.texture_files}
    page = CardPage(
        name,
        sidecar.generator,
        path.name,
        files,
        levels,
        [] if head is None else head.parts,
        _corners(sidecar, carrier),
        [
            {"title": _TITLES[role], "file": f"{role}.png", "meaning": ROLES[role][1]}
            for role in maps
        ],
        size_rows(len(glb), textures, levels),
    )
    path.with_suffix(PAGE_SUFFIX).write_bytes(page_text(page).encode())


def _shown(maps: CardMaps) -> dict[str, Floats]:
    """The maps that the viewer draws with."""
    other = {"tangent": "shift", "shift": "tangent"}[maps.highlights]
    return {role: maps.by_name[role] for role in _TITLES if role in maps.by_name and role != other}


def _channels(values: Floats) -> str:
    return "rgb" if values.ndim == 3 else "r"


def _corners(sidecar: CardFile, carrier: Floats) -> list[list[float]]:
    """The lowest and highest corner of the hair's bounds in all frames, as carried from rest."""
    rest = sidecar.levels[0].positions
    extent = zip(rest.min(axis=0), rest.max(axis=0), strict=True)
    corners = np.array(list(itertools.product(*extent)))
    carried = np.einsum("fab,cb->fca", carrier[:, :3, :3], corners) + carrier[:, None, :3, 3]
    points = sidecar.format.to_file_space(carried.reshape(-1, 3))
    return [points.min(axis=0).tolist(), points.max(axis=0).tolist()]
