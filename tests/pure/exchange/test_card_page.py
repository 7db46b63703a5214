"""A web page that shows an asset: one self-contained file, whatever texts it contains."""

from __future__ import annotations

import base64
import gzip
import hashlib
import json
import re
from html.parser import HTMLParser

import numpy as np
import pytest
from make_viewer import BUNDLE, ESBUILD, bundle

from hairloom.addon.cards.atlas_grid import AtlasGrid
from hairloom.addon.exchange.cards.card_page import CardPage, page_text
from hairloom.addon.exchange.cards.glb_file import GlbFile
from hairloom.addon.exchange.cards.page_asset import small_glb, small_maps

#: text that would end an element, begin a comment or fill a field of the template; not ASCII
HOSTILE = "</script><script>alert(1)</script> \"Zöpfe\" 'ü' <!-- & {{script}} 头发 </title>"


class Reader(HTMLParser):
    """The elements of a page with their attributes, and the texts of each kind."""

    def __init__(self) -> None:
        super().__init__()
        self.elements: list[tuple[str, dict[str, str | None]]] = []
        self.texts: dict[str, list[str]] = {}
        self._open = ""

    def handle_starttag(self, tag: str, attributes: list[tuple[str, str | None]]) -> None:
        self.elements.append((tag, dict(attributes)))
        self._open = tag

    def handle_data(self, data: str) -> None:
        if data.strip():
            self.texts.setdefault(self._open, []).append(data)


def page(name: str = "Hair") -> CardPage:
    return CardPage(
        name,
        "0.1.0",
        f"{name}.glb",
        {f"{name}.glb": bytes(range(256)), "base.png": b"picture"},
        [{"triangles": 8, "cards": 2}],
        [],
        [[0.0, 0.0, 0.0], [1.0, 1.0, 1.0]],
        [{"title": name, "file": "base.png", "meaning": name}],
        [("Cards", name)],
    )


def read(text: str) -> Reader:
    reader = Reader()
    reader.feed(text)
    reader.close()
    return reader


def asset_of(text: str) -> dict:
    (content,) = re.findall(r'id="asset">(.*?)</script>', text, re.S)
    return json.loads(content)


@pytest.mark.parametrize("name", ["Hair", HOSTILE])
def test_a_page_has_the_same_elements_whatever_the_hair_is_called(name: str) -> None:
    text = page_text(page(name))
    reader = read(text)
    assert [tag for tag, _ in reader.elements] == [
        tag for tag, _ in read(page_text(page())).elements
    ]
    assert len([tag for tag, _ in reader.elements if tag == "script"]) == 2
    assert reader.texts["title"] == reader.texts["h1"] == [name]
    asset = asset_of(text)
    assert asset["mesh"] == f"{name}.glb" and asset["maps"][0]["meaning"] == name
    packed = asset["files"][f"{name}.glb"]
    assert gzip.decompress(base64.b64decode(packed["data"])) == bytes(range(256))
    assert base64.b64decode(asset["files"]["base.png"]["data"]) == b"picture"


def test_a_page_refers_to_nothing_outside_of_it() -> None:
    """No address in an element, and a policy that allows neither a network nor eval."""
    reader = read(page_text(page()))
    addresses = [
        value
        for _, attributes in reader.elements
        for name, value in attributes.items()
        if name in ("src", "href", "action", "data", "srcset")
    ]
    assert addresses == ["data:,"]
    (policy,) = (
        each["content"]
        for tag, each in reader.elements
        if each.get("http-equiv") == "Content-Security-Policy"
    )
    assert policy is not None
    rules = {name: set(values) for name, *values in map(str.split, policy.split(";"))}
    assert rules["default-src"] == {"'none'"}
    assert rules["img-src"] | rules["connect-src"] == {"blob:", "data:"}
    (script,) = (each for each in reader.texts["script"] if not each.startswith("{"))
    digest = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()
    assert rules["script-src"] == {f"'sha256-{digest}'"}
    style = base64.b64encode(hashlib.sha256(reader.texts["style"][0].encode()).digest()).decode()
    assert rules["style-src"] == {f"'sha256-{style}'"}
    assert "url(" not in reader.texts["style"][0] and "@import" not in reader.texts["style"][0]


def test_a_page_is_the_same_each_time_and_has_the_licence_of_three_js() -> None:
    text = page_text(page())
    assert text == page_text(page()) and "\r" not in text
    assert "Copyright © 2010-2026 three.js authors" in text
    assert "THE SOFTWARE IS PROVIDED" in text


def test_the_viewer_is_made_of_its_sources() -> None:
    if not ESBUILD.exists():
        pytest.skip("esbuild is missing: `make setup` installs it")
    assert BUNDLE.read_bytes() == bundle(), "run tools/make_viewer.py"


def glb() -> tuple[bytes, np.ndarray, np.ndarray]:
    """A GLB with one mesh and one picture, the mesh's positions, and its indices."""
    draw = np.random.default_rng(5)
    positions = draw.uniform(-0.13, 0.21, (60, 3)).astype(np.float32)
    normals = draw.normal(size=(60, 3))
    normals = (normals / np.linalg.norm(normals, axis=1)[:, None]).astype(np.float32)
    indices = draw.permutation(60).astype(np.uint16)
    file = GlbFile({"asset": {"version": "2.0"}, "buffers": [{}]}, bytearray())
    picture = file.append("images", {"bufferView": file.add_bytes(b"x" * 1000)})
    file.append("textures", {"source": picture})
    file.append("materials", {"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}})
    attributes = {
        "POSITION": file.add(positions, "VEC3", target=34962),
        "NORMAL": file.add(normals, "VEC3", target=34962),
    }
    number = file.add(indices, "SCALAR")
    primitive = {"attributes": attributes, "indices": number, "material": 0}
    file.append("meshes", {"primitives": [primitive]})
    file.content["extensionsUsed"] = ["MSFT_lod", "KHR_materials_specular"]
    return file.data(), positions, indices


def test_a_pages_glb_has_the_same_triangles_and_no_material() -> None:
    data, positions, indices = glb()
    small = GlbFile.of(small_glb(data, "hair.glb"), "hair.glb")
    (primitive,) = small.content["meshes"][0]["primitives"]
    found = small.values(primitive["attributes"]["POSITION"])
    extent = float(np.ptp(positions, axis=0).max())
    assert 0.0 < np.abs(found - positions).max() <= extent * 2.0**-14
    np.testing.assert_array_equal(small.values(primitive["indices"]).ravel(), indices)
    assert "material" not in primitive
    assert not {"materials", "textures", "images"} & set(small.content)
    assert small.content["extensionsUsed"] == ["MSFT_lod"]
    assert len(small.binary) < 2 * positions.nbytes + indices.nbytes + 16


def test_rounded_vertices_compress_better() -> None:
    data, *_ = glb()
    small = GlbFile.of(small_glb(data, "hair.glb"), "hair.glb")
    whole = GlbFile.of(data, "hair.glb")
    assert len(gzip.compress(small.binary)) < 0.85 * (len(gzip.compress(whole.binary)) - 20)


def maps() -> dict[str, np.ndarray]:
    """Two tiles side by side: all hair on the left, none on the right."""
    draw = np.random.default_rng(2)
    alpha = np.zeros((64, 128), np.float32)
    alpha[:, :64] = draw.uniform(0.5, 1.0, (64, 64))
    noise = draw.uniform(size=(64, 128)).astype(np.float32)
    base = np.full((64, 128, 3), 0.25, np.float32)
    return {"alpha": alpha, "base": base, "noise": noise, "shift": noise[:8, :8]}


def test_a_pages_maps_are_scaled_down_and_bare_texels_hold_the_mean() -> None:
    given = maps()
    small = small_maps(given, AtlasGrid(2, 1), 32)
    assert {name: each.shape[:2] for name, each in small.items()} == {
        "alpha": (16, 32),
        "base": (16, 32),
        "noise": (16, 32),
        "shift": (8, 8),
    }
    assert small["alpha"][:, 16:].max() == 0.0
    assert small["alpha"].sum() * 16 == pytest.approx(given["alpha"].sum(), rel=0.01)
    bare, hair = small["noise"][:, 16:], small["noise"][:, :16]
    assert np.ptp(bare) == 0.0 and np.ptp(hair) > 0.0
    assert bare[0, 0] == pytest.approx(hair.mean(), abs=1.0 / 30.0)
    assert small["base"] == pytest.approx(0.25, abs=0.01)
    assert len(np.unique(small["noise"])) <= 17


def test_directions_that_are_straight_stay_straight() -> None:
    """In 8 bits 0.5 is 128; any other value would turn all strands."""
    straight = np.full((8, 8, 3), (0.5, 1.0, 0.5), np.float32)
    small = small_maps({**maps(), "tangent": straight, "normal": straight}, AtlasGrid(2, 1), 128)
    for name in ("tangent", "normal"):
        assert np.round(small[name] * 255).tolist() == np.full((8, 8, 3), (128, 255, 128)).tolist()


def test_maps_that_are_small_keep_their_size() -> None:
    assert small_maps(maps(), AtlasGrid(2, 1), 128)["alpha"].shape == (64, 128)
