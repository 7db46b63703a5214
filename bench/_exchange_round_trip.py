"""How exactly files keep strands: random ones with all attributes, and real files if present."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
from damaged_files import sample
from extension_loader import REPOSITORY

from hairloom.addon.arrays import Floats
from hairloom.addon.exchange.alembic.groom_alembic import write_groom_alembic
from hairloom.addon.exchange.alembic.groom_alembic_read import read_groom_alembic
from hairloom.addon.exchange.groom import Groom
from hairloom.addon.exchange.groom_presets import PRESETS
from hairloom.addon.exchange.hair_file import read_hair_file, write_hair_file
from hairloom.addon.exchange.tressfx import read_tfx, write_tfx
from hairloom.addon.exchange.usd.groom_usd import write_usd
from hairloom.addon.exchange.usd.groom_usd_read import read_usd

DATA = Path(os.environ.get("HAIRLOOM_DATA", REPOSITORY.parent / "shared" / "data"))
#: version 4, and version 3 with followers
REAL = ("sintel/SintelHairOriginal-sintel_hair.16points.tfx", "tressfx_ponytail/*.tfx")
STRANDS, POINTS = 5_000, 16


def round_trip_figures() -> dict[str, float]:
    """roundtrip_max_error: largest error of a coordinate in any format, as a fraction of the
    largest coordinate, of which float32 keeps 6e-8; <format>_roundtrip_error: of each format;
    roundtrip_real_files: number of real files among the grooms."""
    real = [read_tfx(path).groom for name in REAL for path in sorted(DATA.glob(name))]
    errors = dict.fromkeys(_WAYS, 0.0)
    with tempfile.TemporaryDirectory() as folder:
        for groom in (sample(STRANDS, point_count=POINTS), *real):
            for format_name, round_trip in _WAYS.items():
                path = Path(folder) / f"groom.{format_name.split('_')[0]}"
                expected = _in_order(groom, format_name)
                error = np.abs(round_trip(path, groom) - expected).max()
                errors[format_name] = max(
                    errors[format_name], float(error / np.abs(expected).max())
                )
    return {
        "roundtrip_max_error": max(errors.values()),
        **{f"{format_name}_roundtrip_error": error for format_name, error in errors.items()},
        "roundtrip_real_files": float(len(real)),
    }


def _in_order(groom: Groom, format_name: str) -> Floats:
    """The points in the file's order: Unity's Alembic has a curves object for each group."""
    group = (
        groom.strands.group if format_name == "abc_unity" else np.zeros(groom.strands.strand_count)
    )
    return groom.take(np.argsort(group, kind="stable")).strands.points


def _alembic(name: str) -> Callable[[Path, Groom], Floats]:
    def there_and_back(path: Path, groom: Groom) -> Floats:
        write_groom_alembic(path, groom, PRESETS[name])
        return read_groom_alembic(path).strands.points

    return there_and_back


def _usd(up: str, scale: float) -> Callable[[Path, Groom], Floats]:
    def there_and_back(path: Path, groom: Groom) -> Floats:
        write_usd(path, groom, up=up, scale=scale)
        return read_usd(path).strands.points

    return there_and_back


def _tfx(path: Path, groom: Groom) -> Floats:
    write_tfx(path, groom)
    return read_tfx(path).strands.points


def _hair(path: Path, groom: Groom) -> Floats:
    write_hair_file(path, groom)
    return read_hair_file(path).strands.points


_WAYS: dict[str, Callable[[Path, Groom], Floats]] = {
    **{f"abc_{name}": _alembic(name) for name in PRESETS},
    "usdc_metres": _usd("Z", 1.0),
    "usdc_centimetres": _usd("Y", 0.01),
    "tfx": _tfx,
    "hair": _hair,
}
