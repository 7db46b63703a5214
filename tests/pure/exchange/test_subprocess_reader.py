"""A script that reads a file in another process: however it fails, the result is a message."""

from __future__ import annotations

import contextvars
import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from pathlib import Path
from typing import Any
from unittest import mock

import pytest

from hairloom.addon.errors import HairloomError
from hairloom.addon.exchange.files import child_process, subprocess_reader
from hairloom.addon.exchange.files.subprocess_reader import run_reader

pytestmark = pytest.mark.portable


@pytest.fixture
def path(tmp_path: Path) -> Path:
    file = tmp_path / "groom.abc"
    file.write_bytes(b"content")
    return file


def run(path: Path, script: str, **options: object) -> None:
    file = path.with_name("script.py")
    file.write_text(script)
    run_reader(file, path, [path.with_name("result")], library="Alembic", **options)  # type: ignore


@contextmanager
def started_processes() -> Iterator[list[subprocess.Popen[bytes]]]:
    """The processes that are started within this context."""
    before, begun = subprocess.Popen, []

    def popen(*arguments: Any, **options: Any) -> subprocess.Popen[bytes]:
        begun.append(before(*arguments, **options))
        return begun[-1]

    with mock.patch.object(child_process.subprocess, "Popen", popen):
        yield begun


def test_a_script_has_the_file_the_result_and_all_packages(path: Path) -> None:
    run(
        path,
        "import os, sys, numpy\n"
        "open(sys.argv[-1], 'w').write(open(sys.argv[-2]).read() + os.environ['MORE'])\n",
        environment={"MORE": " and more"},
    )
    assert path.with_name("result").read_text() == "content and more"


@pytest.mark.parametrize(
    ("script", "message"),
    [
        ("import sys; print('it is broken.', file=sys.stderr); sys.exit(3)", "says: it is broken"),
        ("import sys; sys.exit(3)", "says: no reason"),
        ("import sys; sys.exit(7)", "failed on it, code 7"),
        (f"import os; os.kill(os.getpid(), {int(signal.SIGSEGV)})", "failed on it, code -11"),
        ("raise SystemError", "failed on it, code 1"),
    ],
)
def test_every_bad_end_is_a_message(path: Path, script: str, message: str) -> None:
    with pytest.raises(HairloomError, match=f"Alembic's library .*{message}") as caught:
        run(path, script)
    assert caught.value.place == str(path) and "export it again" in caught.value.remedy


def test_a_script_without_an_end_is_ended(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Also if it starts slowly."""
    monkeypatch.setattr(subprocess_reader, "_MIN_SECONDS", 1.0)
    with (
        started_processes() as begun,
        pytest.raises(HairloomError, match="could not read it within 1 s"),
    ):
        run(path, "while True: pass")
    assert [each.returncode for each in begun] == [-signal.SIGKILL]


def test_a_child_of_cancelled_work_is_killed(path: Path) -> None:
    """Whoever no longer waits for it ends it, amid its work or right after its start."""
    number = path.with_name("number")
    endless = f"import os\nopen({str(number)!r}, 'w').write(str(os.getpid()))\nwhile True: pass"
    path.with_name("script.py").write_text(endless)
    command = [sys.executable, str(path.with_name("script.py"))]

    @contextmanager
    def soon(end: Callable[[], None]) -> Iterator[None]:
        def end_it() -> None:
            while not (number.is_file() and number.read_text()):
                time.sleep(0.01)
            end()

        thread = threading.Thread(target=end_it)
        thread.start()
        yield
        thread.join()

    def run_it() -> int:
        child_process.kill_context.set(soon)
        return child_process.run_child(command, seconds=60.0).returncode

    assert contextvars.Context().run(run_it) == -signal.SIGKILL

    def at_once(_end: Callable[[], None]) -> AbstractContextManager[None]:
        raise InterruptedError

    def begin_it() -> None:
        child_process.kill_context.set(at_once)
        child_process.run_child(command, seconds=60.0)

    with started_processes() as begun, pytest.raises(InterruptedError):
        contextvars.Context().run(begin_it)
    assert [each.returncode for each in begun] == [-signal.SIGKILL]


def test_a_missing_python_is_reported(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(HairloomError, match=r"no Python can be started .*Use another format"):
        run(path, "", python=[str(path.with_name("none"))])
    monkeypatch.setattr(sys, "executable", "/opt/blender/blender")
    with pytest.raises(HairloomError, match=r"no Python can be started .*/opt/blender/blender"):
        run(path, "")


PLANTED = "import pathlib; pathlib.Path(__file__).with_name('it_ran').touch()"


def test_no_code_of_the_current_folder_or_the_environment_is_run(
    path: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Such code could come with a downloaded project, or from a variable that a program sets."""
    planted = tmp_path / "planted"
    planted.mkdir()
    for module in ("ctypes", "numpy", "sitecustomize", "usercustomize", "json"):
        (planted / f"{module}.py").write_text(PLANTED)
    monkeypatch.chdir(planted)
    monkeypatch.setattr(sys, "path", ["", ".", *sys.path])
    for name in ("PYTHONPATH", "PYTHONHOME", "PYTHONUSERBASE"):
        monkeypatch.setenv(name, str(planted))
    monkeypatch.setenv("PYTHONSTARTUP", str(planted / "json.py"))
    monkeypatch.setenv("PYTHONINSPECT", "1")
    run(path, "import ctypes, numpy, json, sys; open(sys.argv[-1], 'w').write('read')")
    assert path.with_name("result").read_text() == "read"
    assert not (planted / "it_ran").exists()
    monkeypatch.delenv("PYTHONHOME")  # with it Python would not start at all
    environment = dict(os.environ)
    subprocess.run([sys.executable, "-c", "import numpy"], env=environment, capture_output=True)
    assert (planted / "it_ran").exists(), "the trap works"
