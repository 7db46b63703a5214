"""The hair's look as the sidecar has it: values of the shading model, and Marschner's tables."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from ...params import Settings
from ...shading.kajiya_kay_settings import KajiyaKaySettings
from ...shading.marschner.look import fibre_of, pack_fibre
from ...shading.marschner.settings import MarschnerSettings
from ...shading.settings import ShadingSettings, SharedSettings

_UNITS = {
    "length": "m",
    "angle": "rad",
    "time": "s",
    "rate": "1/s",
    "speed": "m/s",
    "factor": "0 to 1",
    "acceleration": "m/s^2",
    "pixels": "px",
    "none": "1",
}
_OF_KIND = {"color": "scene-linear Rec. 709", "choice": "name", "toggle": "true or false"}


def material_of(shading: ShadingSettings, tables: Mapping[str, str]) -> dict[str, Any]:
    """What the sidecar says of the material.

    Args:
        tables: name -> file of the tables that lie beside it, see `write_tables`.
    """
    own: type[Settings] = KajiyaKaySettings if shading.model == "kajiya_kay" else MarschnerSettings
    parameters = [
        each for each in (*SharedSettings.parameters(), *own.parameters()) if each.name != "model"
    ]
    content: dict[str, Any] = {
        "model": shading.model,
        "values": {each.name: getattr(shading, each.name) for each in parameters},
        "units": {each.name: _OF_KIND.get(each.kind, _UNITS[each.unit]) for each in parameters},
        "meanings": {each.name: each.description for each in parameters},
        "fibre": {},
        "tables": {name: {"file": file} for name, file in tables.items()},
    }
    if shading.model == "marschner":
        packed = pack_fibre(shading).tolist()
        strengths = list(fibre_of(shading).strengths)
        content["fibre"] = {"root": packed[:4], "tip": packed[4:8], "strengths": strengths}
    return content
