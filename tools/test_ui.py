"""Tests Hairloom in a Blender that has a window, on OpenGL and on Vulkan.

python tools/test_ui.py                 the checks for a commit
python tools/test_ui.py --all           everything, on both backends
python tools/test_ui.py SESSION ...     only these window sessions, on both backends

First the extension's zip is installed as by an artist, then tests run in that Blender in the
background, and their pictures on both backends are compared; then each
tests/window/session_*.py plays with a real window under Xvfb. Logs and
screenshots go to out/window/. The last line is `N passed, N failed`.
"""

import os
import shutil
import signal
import subprocess
import sys
import threading
import time
import xml.etree.ElementTree as ElementTree
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import flip_evaluator
import numpy as np
from random_parts import random_parts

REPOSITORY = Path(__file__).resolve().parents[1]
OUTPUT = REPOSITORY / "out" / "window"
INSTALLED = OUTPUT / "installed"
#: Compiled shaders, which all sessions need: compiling them takes a third of a short session. They
#: are kept for the next run: the driver identifies each by its text and the driver's version.
CACHE = REPOSITORY / "out" / "shaders"
BACKENDS = ("opengl", "vulkan")
#: Tests that run in this Blender's own Python. `make test` runs the others on OpenGL, with Blender
#: as a module: each test runs on every backend that it depends on, and in both Blenders.
ALL_TESTS = {"opengl": ("tests/pure", "tests/gpu"), "vulkan": ("tests/gpu", "tests/blender")}
#: For a commit: what may depend on Python and numpy, and what may be drawn differently on Vulkan.
COMMIT_TESTS = {
    "opengl": ("-m", "portable and not slow", "tests/pure", "tests/gpu", "tests/blender"),
    "vulkan": ("-m", "draws and not slow", "tests/gpu", "tests/blender"),
}
#: All tests of a backend take an hour, one after another.
TESTS_LIMIT_S = 3 * 3600
SESSION_LIMIT_S = float(os.environ.get("HAIRLOOM_SESSION_LIMIT", "1800"))
#: For a commit each session plays on one backend: these on Vulkan, as they check what is drawn.
ON_VULKAN = ("cards", "engine", "look", "shadows", "random", "still_views")
#: The tutorials, each on one backend only: other sessions check what may differ between both. They
#: take minutes, as a person does; for a commit, test_tutorials runs their steps as Python.
TUTORIALS = {
    "tutorial_first_hair": "opengl",
    "tutorial_comb_and_play": "opengl",
    "tutorial_cards_into_godot": "vulkan",
    "tutorial_look_like_cycles": "opengl",
    "tutorial_eevee_shot": "opengl",
}
#: Sessions that are left out for a commit, beside the tutorials. One makes pictures of the
#: documentation, one waits for minutes, and nine draw for minutes what other sessions check too:
#: `engine` and `shadows` check light and shadows, `random` and `everyday` what interrupts Play,
#: `long_work` cancelled work and Esc in a turntable, `layers` hair from near and far, `import` the
#: options in a file browser, `combing` and `growing` edits by hand and their undo.
NOT_IN_COMMITS = (
    *TUTORIALS,
    "guide_pictures",
    "autosave",
    "body_shadow",
    "closing",
    "first_light",
    "jobs",
    "midplay",
    "refinement",
    "show",
    "strand_export",
    "ties",
)
#: Most of a session's time goes into drawing the window, in proportion to its pixels. Sessions for
#: a commit have a small screen if that is enough. Some need a large one: to picture long panels
#: uncut, or to make Blender's own texts and gizmos a small part of compared pictures.
_LARGE, _SMALL = "1600x1000x24", "1024x700x24"
_SMALL_SCREEN_SESSIONS = (
    *("cards", "combing", "first_minutes", "hair_scene", "import", "layers", "soft_shadows"),
    *("long_work", "look", "motion", "selection", "shadows", "views"),
)
SCREENS = {f"session_{name}": _SMALL for name in _SMALL_SCREEN_SESSIONS} | {
    **{f"session_{name}": "1024x900x24" for name in TUTORIALS},
    "session_closing": "800x600x24",
    "session_engine": _LARGE,
    "session_everyday": _LARGE,
    "session_guide_pictures": "1600x1500x24",
    "session_midplay": "1600x1500x24",  # the open Dynamics panel is long
    "session_random": "800x600x24",
    "session_refinement": _LARGE,
    "session_still_views": "800x600x24",
    "session_strand_export": _LARGE,
}
#: seeds of random actions, and the number of actions of each
SEEDS = os.environ.get("HAIRLOOM_SEEDS", "1 2 3 4 5").split()
ACTIONS = int(os.environ.get("HAIRLOOM_ACTIONS", "80"))
COMMIT_ACTIONS = 40
CLOSING_LINE = "SESSION PASSED"
PROBLEM_LINES = 30
#: beginning of the first line of Python's traceback when Blender crashes
CRASH_LINE = "Fatal Python error"
#: limit of the mean FLIP of the same picture on both backends
MAX_FLIP = 0.02

_running: set[subprocess.Popen[bytes]] = set()
_interrupted = threading.Event()


#: jobs at a time
PARALLEL_JOBS = 2


@dataclass
class Tally:
    passed: int = 0
    failed: int = 0

    def add(self, passed: int, failed: int) -> None:
        self.passed += passed
        self.failed += failed


Job = Callable[[Tally], None]


def run_blender(
    mode: str, arguments: list[str], log: Path, limit_s: float, environment: dict[str, str]
) -> int:
    """The exit code of `tools/window_blender HOW ARGUMENTS`; 124 when it ran past its limit."""
    with log.open("wb") as stream:
        process = subprocess.Popen(
            [REPOSITORY / "tools" / "window_blender", mode, *arguments],
            cwd=REPOSITORY,
            env=os.environ | {"HAIRLOOM_CACHE": str(CACHE)} | environment,
            stdout=stream,
            stderr=subprocess.STDOUT,
            start_new_session=True,
        )
        _running.add(process)
        try:
            return process.wait(limit_s)
        except subprocess.TimeoutExpired:
            stream.write(f"\ntest_ui: stopped after {limit_s:.0f} s\n".encode())
            return 124
        finally:
            stop(process)
            _running.discard(process)


def stop(process: subprocess.Popen[bytes]) -> None:
    if process.poll() is None:
        os.killpg(process.pid, signal.SIGKILL)
        process.wait()


def announce(name: str, backend: str, passed: bool, detail: str, log: Path) -> None:
    verdict = "passed" if passed else "FAILED"
    print(f"{verdict}  {name} on {backend}: {detail}", flush=True)
    if not passed:
        print(f"        from {log.relative_to(REPOSITORY)}:")
        for line in problem_lines(log.read_text(errors="replace").splitlines()):
            print(f"        | {line}")


def problem_lines(lines: list[str]) -> list[str]:
    """The end of a log; of a crash the beginning, which names the test."""
    crash = next((i for i, line in enumerate(lines) if line.startswith(CRASH_LINE)), None)
    if crash is None:
        return lines[-PROBLEM_LINES:]
    return lines[crash : crash + PROBLEM_LINES]


def install_extension(tally: Tally) -> bool:
    """Install a built zip into a fresh user folder, which each session gets a copy of: the zip for
    this Blender's Python, as Blender refuses the other one."""
    zips = sorted((REPOSITORY / "dist").glob("hairloom-*-linux_x64*.zip"))
    if not zips:
        print("dist/ has no hairloom-*-linux_x64.zip: run `make zip`")
        return False
    log = OUTPUT / "install.log"
    passed = False
    for path in zips:
        code = run_blender(
            "background",
            ["--command", "extension", "install-file", "-r", "user_default", "-e", str(path)],
            log,
            SESSION_LIMIT_S,
            {"BLENDER_USER_RESOURCES": str(INSTALLED)},
        )
        is_installed = (
            INSTALLED / "extensions/user_default/hairloom/blender_manifest.toml"
        ).is_file()
        passed = code == 0 and is_installed
        if passed:
            break
    announce(f"installing {path.name}", "either", passed, f"exit code {code}", log)
    tally.add(passed, not passed)
    return passed


def run_command_line(tally: Tally) -> None:
    """Run the installed extension as a farm does: one job that succeeds, one that is refused."""
    output = OUTPUT / "cards.glb"
    small = ["--set", "grow.strand_count=200", "--set", "guides.guide_count=50"]
    jobs = {
        "a job": (["--output", str(output), *small], 0),
        "a missing groom": (["--groom", "missing.tfx", "--output", str(output)], 1),
    }
    for name, (arguments, expected) in jobs.items():
        log = OUTPUT / "command-line.log"
        command = ["--command", "hairloom", "cards", *arguments]
        environment = {"BLENDER_USER_RESOURCES": str(INSTALLED)}
        code = run_blender("background", command, log, SESSION_LIMIT_S, environment)
        passed = code == expected and output.is_file() == (expected == 0)
        announce(f"command line, {name}", "either", passed, f"exit code {code}", log)
        tally.add(passed, not passed)
        output.unlink(missing_ok=True)


def run_tests(backend: str, selection: tuple[str, ...], tally: Tally) -> None:
    """Run tests in Blender's own Python, in the background."""
    log, report = OUTPUT / f"tests-{backend}.log", OUTPUT / f"tests-{backend}.xml"
    arguments = ["--factory-startup", "--gpu-backend", backend, "--python-exit-code", "1"]
    arguments += ["--python", "tests/run_in_blender.py", "--", f"--junitxml={report}"]
    # as in the Makefile: rewriting all tests takes longer than most of them
    arguments += ["--assert=plain", "--showlocals"]
    arguments += selection
    environment = {"HAIRLOOM_PICTURES": str(OUTPUT)}
    for packages in INSTALLED.glob("extensions/.local/lib/python*/site-packages"):
        environment["HAIRLOOM_PACKAGES"] = str(packages)
    code = run_blender("background", arguments, log, TESTS_LIMIT_S, environment)
    if not report.is_file():
        announce("tests", backend, False, f"exit code {code} and no report", log)
        tally.add(0, 1)
        return
    suites = list(ElementTree.parse(report).iter("testsuite"))

    def count(key: str) -> int:
        return sum(int(suite.get(key, 0)) for suite in suites)

    failed, skipped = count("failures") + count("errors"), count("skipped")
    passed = max(count("tests") - failed - skipped, 0)
    failed = failed or int(code != 0)  # a crash after the last test is a failure too
    detail = f"{passed} passed, {failed} failed, {skipped} skipped, exit code {code}"
    announce("tests", backend, failed == 0, detail, log)
    tally.add(passed, failed)


def compare_backends(tally: Tally) -> None:
    """Compare the pictures of both backends that tests/gpu/test_backends_agree.py has written."""
    log, files = OUTPUT / "backends.log", [OUTPUT / f"{backend}.npz" for backend in BACKENDS]
    if missing := [file.name for file in files if not file.is_file()]:
        log.write_text(f"no {', '.join(missing)}\n")
        announce("comparing", "both", False, "pictures are missing", log)
        tally.add(0, 1)
        return
    opengl, vulkan = (np.load(file) for file in files)
    differences = {
        name: flip_evaluator.evaluate(opengl[name], vulkan[name], "LDR")[1] for name in opengl
    }
    log.write_text("".join(f"{name} {flip:.5f}\n" for name, flip in differences.items()))
    passed = max(differences.values()) <= MAX_FLIP
    detail = f"FLIP of {len(differences)} pictures at most {max(differences.values()):.4f}"
    announce("comparing", "both", passed, detail, log)
    tally.add(passed, not passed)


def copy_or_link(source: str, target: str) -> None:
    """Copy a file; link it if it is of the extension's packages: 140 MB that nothing changes."""
    if "site-packages" in Path(source).parts:
        os.link(source, target)
    else:
        shutil.copy2(source, target)


def run_session(
    script: Path, part: dict[str, str], backend: str, is_commit: bool, tally: Tally
) -> None:
    """Run a window session in its own Blender, with the extension installed, not enabled."""
    name = "-".join((script.stem.removeprefix("session_"), *part.values(), backend))
    log, resources = OUTPUT / f"{name}.log", OUTPUT / f"resources-{name}"
    shutil.copytree(INSTALLED, resources, copy_function=copy_or_link)
    arguments = ["--factory-startup", "--gpu-backend", backend, "--enable-event-simulate"]
    arguments += ["--python-exit-code", "1", "--python", str(script)]
    environment = {
        "BLENDER_USER_RESOURCES": str(resources),
        "HAIRLOOM_SCREENSHOTS": str(OUTPUT),
        "HAIRLOOM_SESSION": name,
        "HAIRLOOM_TIER": "commit" if is_commit else "all",
        **part,
    }
    if script.stem in SCREENS:
        environment["HAIRLOOM_SCREEN"] = SCREENS[script.stem]
    start = time.monotonic()
    code = run_blender("window", arguments, log, SESSION_LIMIT_S, environment)
    seconds = time.monotonic() - start
    shutil.rmtree(resources)
    closed = CLOSING_LINE in log.read_text(errors="replace").splitlines()
    passed = code == 0 and closed
    detail = f"exit code {code}, {seconds:.0f} s" + ("" if closed else f", no '{CLOSING_LINE}'")
    announce(" ".join((script.stem, *part.values())), backend, passed, detail, log)
    tally.add(passed, not passed)


def parts_of(script: Path, backend: str, is_commit: bool) -> list[dict[str, str]]:
    """The settings of each Blender that a session is played in."""
    if script.stem != "session_random":
        return [{}]
    if is_commit:
        return random_parts(SEEDS[:1], COMMIT_ACTIONS, backend)
    return random_parts(SEEDS, ACTIONS, backend)


def jobs_of(sessions: list[Path], *, is_commit: bool, with_tests: bool) -> list[Job]:
    """The jobs to run in parallel; the longest come first, so that none runs alone at the end."""
    tests = COMMIT_TESTS if is_commit else ALL_TESTS
    jobs: list[Job] = []
    if with_tests:
        jobs += [partial(run_tests, backend, tests[backend]) for backend in reversed(BACKENDS)]
    for script in sessions:
        name = script.stem.removeprefix("session_")
        backends = (TUTORIALS[name],) if name in TUTORIALS else BACKENDS
        if is_commit:
            backends = () if name in NOT_IN_COMMITS else BACKENDS[name in ON_VULKAN :][:1]
        for backend in backends:
            for part in parts_of(script, backend, is_commit):
                jobs.append(partial(run_session, script, part, backend, is_commit))
    return jobs


def run(job: Job) -> Tally:
    tally = Tally()
    if not _interrupted.is_set():
        job(tally)
    return tally


def main(arguments: list[str]) -> int:
    names = [each for each in arguments if each != "--all"]
    is_commit = not arguments
    sessions = sorted((REPOSITORY / "tests" / "window").glob("session_*.py"))
    if unknown := set(names) - {script.stem for script in sessions}:
        print(f"no such session: {', '.join(sorted(unknown))}")
        return 2
    shutil.rmtree(OUTPUT, ignore_errors=True)
    OUTPUT.mkdir(parents=True)
    CACHE.mkdir(exist_ok=True)
    tally = Tally()
    installed = install_extension(tally)
    if installed and not names:
        run_command_line(tally)
    selected = [s for s in sessions if installed and (not names or s.stem in names)]
    jobs = jobs_of(selected, is_commit=is_commit, with_tests=not names)
    # Side by side: a Blender that waits or computes leaves most of the machine to the other.
    with ThreadPoolExecutor(PARALLEL_JOBS) as pool:
        try:
            for each in pool.map(run, jobs):
                tally.add(each.passed, each.failed)
        except KeyboardInterrupt:
            _interrupted.set()
            for process in tuple(_running):
                stop(process)  # Ctrl-C must not leave a Blender behind
            raise
    if not names:
        compare_backends(tally)
    print(f"{tally.passed} passed, {tally.failed} failed")
    return int(tally.failed > 0 or tally.passed == 0)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
