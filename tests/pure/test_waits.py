"""Every loop that waits has an end, which tools/waits.py states."""

from __future__ import annotations

from pathlib import Path

from waits import KNOWN_WAITS, endless_waits, waits


def test_every_loop_that_waits_is_known_to_end() -> None:
    assert endless_waits() == [], "say in tools/waits.py why it ends"
    assert set(KNOWN_WAITS) == set(waits()), "the table names loops that are there"


def test_a_loop_that_waits_is_seen(tmp_path: Path) -> None:
    (tmp_path / "one.py").write_text(
        "def a():\n    while x:\n        time.sleep(1)\n"
        "def b():\n    while x:\n        x -= 1\n"
        "def c(work):\n    while not work.run_main_thread_steps():\n        pass\n"
    )
    assert waits(tmp_path) == ["one.py:a", "one.py:c"]
