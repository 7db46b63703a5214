"""Notes on files whose numbers are not metres, and none on others."""

from __future__ import annotations

import numpy as np
import pytest

from hairloom.addon.groom.size_notes import length_text, object_size_note, size_note


def thing(name: str, size: float) -> tuple[str, np.ndarray]:
    return name, np.array([[1.0, 1.0, 1.0], [1.0 + size, 1.0, 1.0]], np.float32)


@pytest.mark.parametrize("hair", [None, 0.05, 0.3, 2.6])
@pytest.mark.parametrize("head", [None, 0.25, 1.8, 9.0])
def test_what_may_be_metres_is_left_in_peace(hair: float | None, head: float | None) -> None:
    assert not size_note(hair and thing("a.tfx", hair), head and thing("b.obj", head))


@pytest.mark.parametrize(
    ("hair", "head", "options"),
    [
        (264.0, 199.0, "both by 0.01 (--groom-scale 0.01 --head-scale 0.01)"),
        (30.0, None, "a.tfx by 0.01 (--groom-scale 0.01)"),
        (None, 17.0, "b.obj by 0.01 (--head-scale 0.01)"),
        (6.0, 170.0, "both by 0.01 (--groom-scale 0.01 --head-scale 0.01)"),  # a beard
        (0.46, 16.9, "b.obj by 0.01 (--head-scale 0.01)"),
        (1.99, 199.0, "b.obj by 0.01 (--head-scale 0.01)"),
    ],
)
def test_centimetres_are_named_with_what_scales_them(
    hair: float | None, head: float | None, options: str
) -> None:
    note = size_note(hair and thing("a.tfx", hair), head and thing("b.obj", head))
    assert options in note and "centimetres" in note
    assert ("a.tfx is" in note) == (hair is not None)
    assert ("b.obj is" in note) == (head is not None)


def test_hair_of_nothing_is_named() -> None:
    assert size_note(thing("a.tfx", 0.003), None).startswith("a.tfx is 3 mm large.")


@pytest.mark.parametrize(("size", "says"), [(92.0, "92 m large"), (0.003, "3 mm large"), (3.0, "")])
def test_hair_of_a_scene_is_scaled_there(size: float, says: str) -> None:
    note = object_size_note(*thing("Mane", size))
    assert note == "" if not says else note.startswith(f"Mane is {says}")
    assert "--" not in note
    assert object_size_note("None", np.zeros((0, 3), np.float32)) == ""


def test_a_length_is_written_in_the_unit_that_suits_it() -> None:
    assert [length_text(each) for each in (0.15, 0.9994, 11016.0)] == [
        "150 mm",
        "999 mm",
        "11,016 m",
    ]
