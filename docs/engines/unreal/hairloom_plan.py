"""What `hairloom_import.py` makes of an export: settings, the graph of the material, messages.

Plain Python, which knows nothing of Unreal: it reads the sidecar, NAME.hairloom.json.
"""

from __future__ import annotations

import json
import math
import re
import unicodedata
import zlib
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

ENDING = ".hairloom.json"
VERSION = 2
SHADING = Path(__file__).with_name("HairShading.ush")

#: a level gives way to the next where that one is off by one pixel of a screen of this height
SCREEN_HEIGHT = 1080.0
#: from one level to the next, where the sidecar does not know how far it is off
STEP = 0.5

#: textures that hold directions: block compression shows on highlights
DIRECTIONS = ("tangent", "normal")
REPEATED = ("shift", "noise")
#: what the material reads of the sidecar's textures
USED = ("base", "alpha", "tangent", "shift")
#: files of the packing "unreal" in the order of the slots of Unreal's card layout Default
CARD_SLOTS = ("_Depth", "_Coverage", "_Tangent", "_Attributes", "_Material", "_Auxiliary")


class CardFileError(Exception):
    """What cannot be read, where, and what to do."""


class Choice(NamedTuple):
    """One value of an enumeration of Unreal."""

    enumeration: str
    member: str


class Color(NamedTuple):
    r: float
    g: float
    b: float
    a: float = 1.0


class Texture(NamedTuple):
    """The texture asset that was made of a file."""

    asset: str


@dataclass(frozen=True)
class Picture:
    """A texture file, the name of its asset, and how Unreal is to store it."""

    file: Path
    asset: str
    is_color: bool
    compression: str
    sampler: str
    address: str


@dataclass(frozen=True)
class Node:
    """An expression of the material: its class without "MaterialExpression", what it is set to, and
    for each of its pins the node and the output that go there."""

    kind: str
    properties: dict[str, Any] = field(default_factory=dict)
    inputs: dict[str, tuple[str, str]] = field(default_factory=dict)


@dataclass(frozen=True)
class Graph:
    """A material of the hair shading model. attributes: pin of the material -> node and output."""

    nodes: dict[str, Node]
    attributes: dict[str, tuple[str, str]]


@dataclass(frozen=True)
class Plan:
    """Everything that is to be imported.

    fractions: of each level, how much of a screen's height the hair takes up where it begins to be
        shown; height: of the hair [cm], the longest side of its bounds.
    triangles: of each level.
    strands: the material of a groom; card_textures: of its cards, empty where they are not packed
        for it.
    warnings: sentences about what is missing.
    """

    mesh: Path
    name: str
    pictures: tuple[Picture, ...]
    cards: Graph
    strands: Graph
    fractions: tuple[float, ...]
    height: float
    triangles: tuple[int, ...]
    card_textures: tuple[str, ...]
    warnings: tuple[str, ...]

    def screen_sizes(self, sphere_radius: float) -> list[float]:
        """Unreal's screen size is the diameter of the bounding sphere by the height of the screen.

        sphere_radius: of the mesh, as Unreal has it [cm].
        """
        return [fraction * 2.0 * sphere_radius / self.height for fraction in self.fractions]


def asset_name(name: str) -> str:
    """A name that content folders take on every system: letters without accents, digits and
    underscores. One that has lost something by that gets a number: two such names stay apart."""
    plain = unicodedata.normalize("NFKD", name).encode("ascii", "ignore").decode("ascii")
    kept = re.sub(r"[^A-Za-z0-9]+", "_", plain).strip("_")
    return kept if kept == name else f"{kept or 'Hair'}_{zlib.crc32(name.encode('utf-8')):08x}"


def read_sidecar(mesh: Path) -> tuple[dict[str, Any], list[str]]:
    """The sidecar of a mesh, and sentences about what is odd but does no harm.

    Raises:
        CardFileError: without one there is nothing to go by.
    """
    path = mesh.with_name(mesh.stem + ENDING)
    if not mesh.is_file():
        raise CardFileError(f"{mesh}: there is no such file; name the mesh of an export")
    if mesh.suffix.lower() != ".fbx":
        raise CardFileError(f"{mesh}: Unreal takes cards as FBX; export the cards as .fbx")
    if not path.is_file():
        raise CardFileError(f"{path}: it is missing; export the cards again, and copy all files")
    try:
        sidecar = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise CardFileError(
            f"{path}: it cannot be read ({error}); export the cards again"
        ) from error
    if not isinstance(sidecar, dict) or not sidecar.get("levels"):
        raise CardFileError(f"{path}: it is no sidecar of Hairloom; export the cards again")
    if sidecar.get("hairloom_sidecar", 0) > VERSION:
        raise CardFileError(f"{path}: a newer Hairloom wrote it; take the newer importer")
    warnings = []
    if sidecar.get("file") != mesh.name:
        warnings.append(
            f"{path}: it names {sidecar.get('file')}, not {mesh.name}; rename both files back if "
            "the hair looks wrong"
        )
    return sidecar, warnings


def plan_of(mesh: Path) -> Plan:
    """What is to be imported of a mesh and its sidecar.

    Raises:
        CardFileError: as `read_sidecar` does, and for a sidecar that is damaged or names files in
            other folders.
    """
    sidecar, warnings = read_sidecar(mesh)
    try:
        return _plan(mesh, sidecar, warnings)
    except (AttributeError, IndexError, KeyError, TypeError, ValueError) as error:
        path = mesh.with_name(mesh.stem + ENDING)
        message = f"{path}: it is damaged ({error!r}); export the cards again"
        raise CardFileError(message) from error


def _plan(mesh: Path, sidecar: dict[str, Any], warnings: list[str]) -> Plan:
    name = asset_name(mesh.stem)
    roles = {role: entry for role, entry in sidecar["textures"].items() if _is_texture(entry)}
    there = {}
    for file in sorted({*(entry["file"] for entry in roles.values()), *sidecar["texture_files"]}):
        if Path(file).name != file:
            raise CardFileError(f"{mesh}: {file} lies elsewhere; export the cards again")
        if (mesh.parent / file).is_file():
            there[file] = _picture(mesh, file, sidecar, roles)
        else:
            warnings.append(f"{mesh.parent / file}: it is missing; copy all files of the export")
    found = {role: entry for role, entry in roles.items() if entry["file"] in there}
    slots = [mesh.stem + suffix for suffix in CARD_SLOTS]
    by_stem = {Path(file).stem: picture.asset for file, picture in there.items()}
    packed = tuple(by_stem[slot] for slot in slots if slot in by_stem)
    low, high = (sidecar["levels"][0]["bounds"][corner] for corner in ("minimum", "maximum"))
    size = max(end - begin for begin, end in zip(low, high, strict=True))
    return Plan(
        mesh,
        name,
        tuple(there.values()),
        _cards(sidecar, found, there),
        _strands(sidecar),
        _fractions(sidecar["levels"], size),
        size * 100.0 * sidecar["space"]["metres_per_unit"],
        tuple(level["triangles"] for level in sidecar["levels"]),
        packed if len(packed) == len(slots) else (),
        tuple(warnings),
    )


def found_triangles(plan: Plan, found: list[int]) -> str | None:
    """A sentence where the mesh that Unreal has is not the one that Hairloom wrote."""
    if tuple(found) == plan.triangles:
        return None
    if tuple(found) == plan.triangles[: len(found)]:
        return f"{plan.mesh}: Unreal has taken {len(found)} of its {len(plan.triangles)} levels"
    theirs, ours = (", ".join(map(str, counts)) for counts in (found, plan.triangles))
    return (
        f"{plan.mesh}: its levels have {theirs} triangles and those of its sidecar {ours}; another "
        "program has changed one of them, so export the cards again"
    )


def _is_texture(entry: Any) -> bool:
    return isinstance(entry, dict) and "file" in entry


def _picture(mesh: Path, file: str, sidecar: dict[str, Any], roles: dict[str, Any]) -> Picture:
    own = [role for role, entry in roles.items() if entry["file"] == file]
    is_color = sidecar["texture_files"][file]["color_space"] == "sRGB"  # alpha beside it is linear
    is_direction = any(role in DIRECTIONS for role in own)
    if is_color:
        how = ("TC_DEFAULT", "SAMPLERTYPE_COLOR")
    elif is_direction:
        how = ("TC_VECTOR_DISPLACEMENTMAP", "SAMPLERTYPE_LINEAR_COLOR")
    else:
        how = ("TC_MASKS", "SAMPLERTYPE_MASKS")
    stem = Path(file).stem
    if not stem.startswith(mesh.stem):  # files of other hair may have these names
        stem = f"{mesh.stem}_{stem}"
    address = "TA_WRAP" if own and all(role in REPEATED for role in own) else "TA_CLAMP"
    return Picture(mesh.parent / file, "T_" + asset_name(stem), is_color, *how, address)


def _fractions(levels: list[dict[str, Any]], height: float) -> tuple[float, ...]:
    """Where each level begins. One that is off by less than a pixel begins above 1, where the hair
    is larger than the screen; the first is shown at any size that is above all others."""
    begins: list[float] = []
    for level in levels[1:]:
        error = level.get("error", 0.0)
        last = begins[-1] if begins else 1.0
        own = height / (error * SCREEN_HEIGHT) if error > 0.0 else STEP * last
        begins.append(min(own, last) if begins else own)
    return (max([1.0, *begins]), *begins)


# The materials


def custom(about: str, size: int, code: str, **inputs: tuple[str, str]) -> Node:
    """A Custom node: a body of a function in HLSL."""
    return Node(
        "Custom",
        {
            "description": about,
            "output_type": Choice("CustomMaterialOutputType", f"CMOT_FLOAT{size}"),
            "inputs": tuple(inputs),
            "code": SHADING.read_text(encoding="utf-8") + code,
        },
        inputs,
    )


def _cards(sidecar: dict[str, Any], roles: dict[str, Any], there: dict[str, Picture]) -> Graph:
    """Hair cards: Unreal's hair shading model, masked and dithered."""
    nodes = _shared(sidecar)
    nodes["Card"] = Node("TextureCoordinate", {"coordinate_index": 1})
    for role in USED:
        if role in roles:
            picture = there[roles[role]["file"]]
            nodes[picture.asset] = Node(
                "TextureSampleParameter2D",
                {
                    "parameter_name": picture.asset,
                    "texture": Texture(picture.asset),
                    "sampler_type": Choice("MaterialSamplerType", picture.sampler),
                },
            )

    def read(role: str) -> tuple[str, str]:
        return there[roles[role]["file"]].asset, _output(roles[role])

    # FBX counts v from below and Unreal from above, so the second component runs from tip to root
    base = {"Base": read("base")} if "base" in roles else {}
    gain = roles.get("base", {}).get("gain", 1.0)
    texel = f"{gain:.6g} * {_texel('Base', roles['base'])}" if base else "float3(1.0, 1.0, 1.0)"
    nodes["Hair Color"] = _hair_color(sidecar, "1.0 - Card.y", texel, Card=("Card", ""), **base)
    nodes["Occlusion"] = Node(
        "ComponentMask", {"r": True, "g": False, "b": False, "a": False}, {"": ("Card", "")}
    )
    nodes["Strand Direction"] = _direction(sidecar, roles, read)
    attributes = _attributes()
    attributes["AmbientOcclusion"] = ("Occlusion", "")
    attributes["Normal"] = ("Strand Direction", "")
    if "alpha" in roles:
        nodes["Coverage"] = _coverage(sidecar, roles["alpha"], read("alpha"), nodes)
        attributes["OpacityMask"] = ("Coverage", "")
    return Graph(nodes, attributes)


def _strands(sidecar: dict[str, Any]) -> Graph:
    """Strands of a groom, in the colour of the look; Unreal gives their direction itself."""
    nodes = _shared(sidecar)
    nodes["Strand"] = Node("HairAttributes")
    white = "float3(1.0, 1.0, 1.0)"
    nodes["Hair Color"] = _hair_color(sidecar, "Along", white, Along=("Strand", "U"))
    return Graph(nodes, _attributes())


def _attributes() -> dict[str, tuple[str, str]]:
    """Pins of MakeMaterialAttributes. The hair shading model takes Metallic for Scatter, Normal for
    Tangent and ClearCoat for Backlit."""
    return {
        "BaseColor": ("Hair Color", ""),
        "Metallic": ("Scatter", ""),
        "Specular": ("Specular", ""),
        "Roughness": ("Roughness", ""),
        "ClearCoat": ("Backlit", ""),
    }


def _shared(sidecar: dict[str, Any]) -> dict[str, Node]:
    material = sidecar["material"]
    values = material["values"]
    nodes = {
        "TipTint": _number("TipTint", values.get("tip_tint", 0.0)),
        "TintStart": _number("TintStart", values.get("tint_start", 0.3)),
        "TintEnd": _number("TintEnd", values.get("tint_end", 0.9)),
        "GreyFraction": _number("GreyFraction", values.get("grey_fraction", 0.0)),
        "ShiftNoise": _number("ShiftNoise", values.get("shift_noise", 0.2)),
        "Backlit": _number("Backlit", 1.0),
    }
    is_marschner = material["model"] == "marschner"
    # Scheuermann's diffuse light is that of a whole mass of hair, Marschner's a part of it
    nodes["Scatter"] = _number(
        "Scatter", values.get("fake_scattering", 1.0) if is_marschner else 1.0
    )
    # 0.5 is a highlight as strong as that of a hair's own index of refraction
    strength = material["fibre"]["strengths"][0] if is_marschner else 1.0
    nodes["Specular"] = _number("Specular", min(max(0.5 * strength, 0.0), 1.0))
    nodes["Roughness"] = _number("Roughness", roughness(material))
    if not is_marschner:
        for name in ("base_color", "tip_color"):
            nodes[_title(name)] = Node(
                "VectorParameter",
                {"parameter_name": _title(name), "default_value": Color(*values[name])},
            )
    return nodes


def roughness(material: dict[str, Any]) -> float:
    """Of Unreal's hair: its first highlight has the standard deviation roughness^2 in theta_i +
    theta_r, which is twice Marschner's theta_h. sin^n falls off like a Gaussian of 1 / sqrt(n)."""
    values = material["values"]
    if material["model"] == "marschner":
        width = values["width_r"]
    else:
        width = 1.0 / math.sqrt(max(values["primary_exponent"], 1.0))
    return min(math.sqrt(2.0 * width), 1.0)


def _title(name: str) -> str:
    return "".join(word.capitalize() for word in name.split("_"))


def _number(name: str, value: float) -> Node:
    return Node("ScalarParameter", {"parameter_name": name, "default_value": value})


def _output(entry: dict[str, Any]) -> str:
    channels = entry.get("channels", "r")
    return channels[0].upper() if len(channels) == 1 else "RGB"


def _texel(name: str, entry: dict[str, Any]) -> str:
    """The value of a pin, whose channels may be in another order, hold 1 minus the value, or be two
    of a direction, which lies in the card's plane then."""
    inverted, channels = entry.get("inverted", ""), entry.get("channels", "r")
    if len(channels) == 1:
        return f"(1.0 - {name})" if inverted else name
    parts = [f"1.0 - {name}.{each}" if each in inverted else f"{name}.{each}" for each in channels]
    return (
        name if channels == "rgb" and not inverted else f"float3({', '.join([*parts, '0.5'][:3])})"
    )


def _hair_color(sidecar: dict[str, Any], along: str, base: str, **inputs: tuple[str, str]) -> Node:
    """The colour of a mass of such hair, as the other engines have it."""
    material = sidecar["material"]
    names = ["tip_tint", "tint_start", "tint_end", "grey_fraction"]
    lines = ["HairMaterial hair = shading.blank();"]
    if material["model"] == "marschner":
        lines.append("hair.model = 1;")
        for name in ("root", "tip"):
            numbers = ", ".join(f"{number:.9g}" for number in material["fibre"][name])
            lines.append(f"hair.fibre_{name} = float4({numbers});")
    else:
        names += ["base_color", "tip_color"]
    lines += [f"hair.{name} = {_title(name)};" for name in names]
    lines.append(f"return shading.hair_color(hair, {along}, {base});\n")
    pins = {_title(name): (_title(name), "") for name in names}
    return custom("Hairloom: hair color", 3, "\n".join(lines), **inputs, **pins)


def _direction(sidecar: dict[str, Any], roles: dict[str, Any], read: Any) -> Node:
    """For the pin Tangent: from tip to root, in Unreal's tangent space, whose y runs down."""
    role = sidecar["textures"].get("highlights_by", "shift")
    up, out = "float3(0.0, 1.0, 0.0)", "float3(0.0, 0.0, 1.0)"
    inputs = {"ShiftNoise": ("ShiftNoise", "")}
    if role not in roles:
        code = f"float3 strand = {up};\n"
    elif role == "tangent":
        inputs["Texel"] = read(role)
        texel = _texel("Texel", roles[role])
        code = f"float3 strand = shading.hair_tangent({texel}, {up}, {out}, ShiftNoise);\n"
    else:
        inputs["Texel"] = read(role)
        shift = f"ShiftNoise * ({_texel('Texel', roles[role])} - 0.5)"
        code = f"float3 strand = shading.hair_unit(float3(0.0, 1.0, {shift}), {up});\n"
    code += "return float3(-strand.x, strand.y, -strand.z);\n"
    return custom("Hairloom: from tip to root", 3, code, **inputs)


def _coverage(
    sidecar: dict[str, Any], entry: dict[str, Any], alpha: tuple[str, str], nodes: dict[str, Node]
) -> Node:
    """Alpha; that of baked strands grows where a card is seen at a slant."""
    facing = sidecar["textures"].get("view_compensated_alpha")
    texel = _texel("Alpha", entry)
    if not facing:
        return custom("Hairloom: coverage", 1, f"return {texel};\n", Alpha=alpha)
    nodes["Position"] = Node(
        "WorldPosition",
        {
            "world_position_shader_offset": Choice(
                "WorldPositionIncludedOffsets", "WPT_CAMERA_RELATIVE"
            )
        },
    )
    nodes["Normal"] = Node("VertexNormalWS")
    nodes["Tangent"] = Node("VertexTangentWS")
    nodes["To Eye"] = Node("CameraVectorWS")
    code = (
        "float3 across = cross(ddx(Position), ddy(Position));\n"
        "float3 along = shading.hair_unit(cross(Normal, Tangent), float3(0.0, 0.0, 1.0));\n"
        f"float2 facing = float2({facing['mean_facing']:.9g}, {facing['min_facing']:.9g});\n"
        f"return shading.hair_view_compensated_alpha({texel}, across, along, ToEye, facing);\n"
    )
    return custom(
        "Hairloom: coverage at a slant",
        1,
        code,
        Alpha=alpha,
        Position=("Position", ""),
        Normal=("Normal", ""),
        Tangent=("Tangent", ""),
        ToEye=("To Eye", ""),
    )
