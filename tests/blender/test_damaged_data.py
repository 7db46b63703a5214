"""Reading the files beside scenes, bakes and takes, whatever they contain."""

import json

import numpy as np
import pytest

from hairloom.addon.blender.bakes import cache
from hairloom.addon.blender.bakes.cache import Cache, CacheWriter, Facts
from hairloom.addon.errors import HairloomError


@pytest.fixture
def bake(tmp_path):
    """The folder of a bake of two frames."""
    folder = tmp_path / "bake"
    writer = CacheWriter(folder)
    writer.add_constants({"offsets": np.arange(3)})
    for frame in (1, 2):
        writer.add(frame, {"points": np.full((2, 3), frame, np.float32)}, "hair=00")
    writer.finish(Facts("Hair", 1, 2, 24.0, "numpy", "hair=00", "0.1.0"))
    writer.publish()
    return folder


@pytest.mark.parametrize(
    "change",
    [
        {"frame_rate": 10**400},
        {"frame_rate": "24"},
        {"frame_rate": float("nan")},
        {"first": 1.5, "last": 2.5},
        {"first": None},
        {"last": 10**30},
        {"owner": ["Hair"]},
        {"frame_hashes": [1, 2]},
        {"frame_hashes": "ab"[:1]},
        {"layout": {"points": 3}},
        {"layout": []},
        {"version": "1"},
        {"frames": "../elsewhere"},
        {"frames": "/"},
        {"frames": None},
    ],
)
def test_impossible_facts_are_reported(bake, change):
    facts = json.loads((bake / "cache.json").read_text())
    Cache(bake)
    (bake / "cache.json").write_text(json.dumps(facts | change))
    with pytest.raises(HairloomError, match="Bake again"):
        Cache(bake)


@pytest.mark.parametrize(
    ("change", "message"), [(1, "a newer Hairloom.*Update"), (-1, "an older Hairloom.*Bake again")]
)
def test_a_bake_of_another_version_is_not_called_damaged(bake, change, message):
    facts = json.loads((bake / "cache.json").read_text())
    (bake / "cache.json").write_text(json.dumps(facts | {"version": facts["version"] + change}))
    with pytest.raises(HairloomError, match=message) as raised:
        Cache(bake)
    assert "damaged" not in str(raised.value)


def test_endlessly_nested_facts_are_reported(bake):
    (bake / "cache.json").write_text('{"version": ' + "[" * 200_000)
    with pytest.raises(HairloomError, match=r"damaged .*Bake again"):
        Cache(bake)


def test_facts_of_any_size_are_refused_before_they_are_read(bake, monkeypatch):
    monkeypatch.setattr(cache, "_MAX_FACTS_BYTES", 100)
    with pytest.raises(HairloomError, match="more than 100 bytes"):
        Cache(bake)


def test_random_bytes_in_a_bake_are_reported_or_read(bake):
    random = np.random.default_rng(2)
    whole = {path: path.read_bytes() for path in bake.rglob("*") if path.is_file()}
    error_count = 0
    for _ in range(300):
        path = list(whole)[int(random.integers(len(whole)))]
        content = bytearray(whole[path])
        for place in random.integers(len(content), size=3):
            content[place] = int(random.integers(256))
        path.write_bytes(content)
        try:
            read = Cache(bake)
            read.constants()
            for frame in (1, 2):
                assert read.frame(frame)["points"].shape == (2, 3)
        except HairloomError as error:
            error_count += 1
            assert error.remedy and str(bake) in error.place
        path.write_bytes(whole[path])
    assert 150 < error_count < 300
