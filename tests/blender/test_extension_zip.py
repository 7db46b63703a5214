"""The extension as users get it: its manifest and its zips, and Blender installing them."""

import hashlib
import importlib
import importlib.util
import io
import json
import os
import re
import subprocess
import sys
import tomllib
import zipfile
from pathlib import Path

import bpy
import make_zips
import pytest

pytest.importorskip("sphinx", reason="zips hold the pages, which it makes")

from hairloom.addon.blender.engine import engine, hair_scene
from hairloom.addon.blender.preview.handlers import HANDLERS

REPOSITORY = Path(__file__).resolve().parents[2]
SCRIPTS = Path(bpy.utils.system_resource("SCRIPTS"))
EXTENSION_TOOL = SCRIPTS / "addons_core/bl_pkg/cli/blender_ext.py"
#: folders and files that are of no use to users of the zip
NOT_FOR_USERS = ("tests", "tools", "docs", "bench", "out", "dist", "Makefile", "pyproject.toml")


def extension_tool(*arguments):
    """Run Blender's own packager, as `blender --command extension` does."""
    done = subprocess.run(
        [sys.executable, str(EXTENSION_TOOL), *map(str, arguments)], capture_output=True, text=True
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def in_fresh_blender(script, resources):
    """Run a script in a new Blender with own user folders; returns its last JSON line and
    output."""
    wheel = [sys.executable, script]
    program = [bpy.app.binary_path, "-b", "--python-exit-code", "1", "--python", script]
    done = subprocess.run(
        list(map(str, program if bpy.app.binary_path else wheel)),
        env=os.environ | {"BLENDER_USER_RESOURCES": str(resources)},
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    answers = [line for line in done.stdout.splitlines() if line.startswith("{")]
    return json.loads(answers[-1]), done.stdout + done.stderr


@pytest.fixture(scope="module")
def wheels():
    """Names of the wheels that go into the zips; missing ones are fetched."""
    done = subprocess.run(
        [sys.executable, REPOSITORY / "tools" / "fetch_wheels.py"], capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    table = (REPOSITORY / "tools" / "wheels.sha256").read_text(encoding="utf-8")
    return [line.split()[1] for line in table.splitlines()]


@pytest.fixture(scope="module")
def zips(wheels, tmp_path_factory):
    """(system, Python) -> the zip for that build of Blender, with the wheels as fetched."""
    return made_zips(tmp_path_factory.mktemp("quick"), "--quick")


@pytest.fixture(scope="module")
def tight_zips(wheels, tmp_path_factory):
    """(system, Python) -> the zip that users get, with wheels packed tighter."""
    return made_zips(tmp_path_factory.mktemp("dist"))


def made_zips(folder, *options):
    tool = REPOSITORY / "tools" / "make_zips.py"
    done = subprocess.run([sys.executable, tool, folder, *options], capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
    end = {build: build[0].replace("-", "_") for build in make_zips.BUILDS}
    end["linux-x64", (3, 14)] += "_python314"
    found = {build: next(folder.glob(f"hairloom-*-{end[build]}.zip")) for build in make_zips.BUILDS}
    assert sorted(found.values()) == sorted(folder.iterdir())
    return found


@pytest.fixture(scope="module")
def built(zips):
    """The zip for the Blender that runs this test."""
    return zips["linux-x64", sys.version_info[:2]]


@pytest.fixture(scope="module")
def tight(tight_zips):
    return tight_zips["linux-x64", sys.version_info[:2]]


@pytest.fixture(scope="module")
def names(built):
    with zipfile.ZipFile(built) as archive:
        assert archive.testzip() is None
        return archive.namelist()


@pytest.fixture(scope="module")
def manifest():
    return tomllib.loads((REPOSITORY / "blender_manifest.toml").read_text(encoding="utf-8"))


def tracked(folder):
    """The files below a folder of the repository, except caches."""
    return {
        path.relative_to(REPOSITORY).as_posix()
        for path in (REPOSITORY / folder).rglob("*")
        if path.is_file() and "__pycache__" not in path.parts
    }


@pytest.mark.slow(instead="test_manifest_fields_that_the_validator_skips_are_valid")
def test_blender_accepts_the_repository_and_the_zips(tight_zips):
    extension_tool("validate", REPOSITORY)
    for path in tight_zips.values():
        extension_tool("validate", path)


def test_the_zips_bring_the_wheels_of_the_table_and_no_others(zips, wheels, manifest):
    check_wheels(zips, wheels, manifest)


@pytest.mark.slow(instead="test_a_wheel_that_is_packed_tighter_has_the_same_files")
def test_zips_of_artists_are_small_and_bring_the_same_wheels(tight_zips, wheels, manifest):
    check_wheels(tight_zips, wheels, manifest)
    assert all(each.stat().st_size < 20e6 for each in tight_zips.values())


def test_a_wheel_that_is_packed_tighter_has_the_same_files(tmp_path, monkeypatch):
    monkeypatch.setattr(make_zips, "PACKED", tmp_path)
    wheel = io.BytesIO()
    with zipfile.ZipFile(wheel, "w", zipfile.ZIP_DEFLATED) as archive:
        part = os.urandom(50_000)  # repeated at a distance that Deflate cannot reach
        for name, content in (("a/b.so", part * 4), ("a-1.dist-info/LICENSE", b"free")):
            entry = zipfile.ZipInfo(name)
            entry.external_attr = 0o100755 << 16
            archive.writestr(entry, content, zipfile.ZIP_DEFLATED)
    for _ in range(2):  # packed, then from the cache
        packed = make_zips.recompressed(wheel.getvalue())
        assert content_of(io.BytesIO(packed)) == content_of(wheel)
        assert len(packed) < 0.3 * len(wheel.getvalue())


def check_wheels(zips, wheels, manifest):
    """Compare wheels file by file, since they may be compressed differently."""
    import fetch_wheels

    assert manifest["wheels"] == [f"./wheels/{name}" for name in wheels]
    found = {}
    for path in zips.values():
        with zipfile.ZipFile(path) as archive:
            assert archive.testzip() is None
            for name in filter(lambda each: each.endswith(".whl"), archive.namelist()):
                found[name.removeprefix("wheels/")] = content_of(io.BytesIO(archive.read(name)))
    table = fetch_wheels.pinned_wheels()
    assert found == {name: content_of(REPOSITORY / "wheels" / name) for name in table}
    for name, digest in table.items():
        fetched = REPOSITORY / "wheels" / name
        assert hashlib.sha256(fetched.read_bytes()).hexdigest() == digest


def content_of(wheel):
    """(name, permissions, digest) of each file in a wheel."""
    with zipfile.ZipFile(wheel) as archive:
        return [
            (each.filename, each.external_attr, hashlib.sha256(archive.read(each)).digest())
            for each in archive.infolist()
        ]


@pytest.mark.parametrize("build", make_zips.BUILDS)
def test_every_build_of_blender_gets_a_zip_with_one_wheel_of_each_package(zips, manifest, build):
    """By Blender's own code: the zip has only wheels that this build accepts and installs."""
    system, python = build
    tool = make_zips.packager()
    with zipfile.ZipFile(zips[build]) as archive:
        own = tomllib.loads(archive.read("blender_manifest.toml").decode())
        carried = [n for n in archive.namelist() if n.endswith(".whl")]
    assert own["wheels"] == [f"./{name}" for name in carried]
    assert own["platforms"] == [system]
    kept = {name: value for name, value in own.items() if name not in ("wheels", "platforms")}
    assert kept == {name: value for name, value in manifest.items() if name != "wheels"}
    packages = [name.split("/")[-1].split("-")[0] for name in carried]
    assert packages == ["alembic3d", "archspec", "etcpak"]
    assert tool.paths_filter_wheels_by_platform(own["wheels"], system) == own["wheels"]
    assert python in tool.python_versions_from_wheels(own["wheels"])


def test_a_wheel_that_cannot_be_downloaded_is_named(tmp_path):
    """Without a network, or with a wrong checksum; no file is left."""
    import fetch_wheels

    name, digest = next(iter(fetch_wheels.pinned_wheels().items()))
    with pytest.raises(fetch_wheels.FetchError, match=rf"{re.escape(name)} cannot be fetched"):
        fetch_wheels.fetch(name, "0" * len(digest), tmp_path / "wheels")
    assert list((tmp_path / "wheels").iterdir()) == []


def test_manifest_fields_that_the_validator_skips_are_valid(wheels, manifest):
    """Blender's validator accepts unknown licences, schema versions, keys and websites."""
    assert manifest["schema_version"] == "1.0.0"
    assert manifest["id"] == "hairloom"
    assert manifest["type"] == "add-on"
    assert manifest["license"] == ["SPDX:GPL-3.0-or-later"]
    assert manifest["blender_version_min"] == "5.2.0"
    assert re.fullmatch(r"\d+\.\d+\.\d+", manifest["version"])
    assert "blender" not in manifest["name"].lower()
    assert len(manifest["tagline"]) <= 64 and manifest["tagline"][-1].isalnum()
    assert set(manifest["permissions"]) == used_permissions()
    assert all(reason[-1].isalnum() for reason in manifest["permissions"].values())
    known = {"schema_version", "id", "version", "name", "tagline", "maintainer", "type", "tags"}
    known |= {"blender_version_min", "license", "copyright", "permissions", "build", "website"}
    known |= {"wheels", "platforms", "blender_version_max"}
    assert set(manifest) <= known
    assert all((REPOSITORY / wheel).is_file() for wheel in manifest["wheels"])
    assert "GNU GENERAL PUBLIC LICENSE" in (REPOSITORY / "LICENSE").read_text(encoding="utf-8")


def used_permissions():
    """The permissions that the code needs, of those that Blender's extensions must declare."""
    code = "\n".join(
        path.read_text(encoding="utf-8") for path in (REPOSITORY / "addon").rglob("*.py")
    )
    network = r"socket|ssl|urllib(?!\.parse)|http|requests|ftplib|smtplib"
    uses = {
        "files": r"write_bytes|open\(",
        "clipboard": r"\.clipboard\b",
        "network": rf"^\s*(import|from) ({network})\b",
        "camera": r"^\s*(import|from) cv2\b",
        "microphone": r"^\s*(import|from) (pyaudio|sounddevice)\b",
    }
    return {name for name, pattern in uses.items() if re.search(pattern, code, re.MULTILINE)}


def test_the_bill_of_materials_names_what_the_zip_carries(wheels, names, tmp_path):
    """It is valid by CycloneDX's schema; licences are known, and wheels contain their texts."""
    validation = pytest.importorskip("cyclonedx.validation", reason="it is for development alone")
    schema = importlib.import_module("cyclonedx.schema")
    path = tmp_path / "hairloom.cdx.json"
    tool = REPOSITORY / "tools" / "bill_of_materials.py"
    done = subprocess.run([sys.executable, tool, path], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    text = path.read_text(encoding="utf-8")
    validator = validation.make_schemabased_validator(
        schema.OutputFormat.JSON, schema.SchemaVersion.V1_6
    )
    assert validator.validate_str(text) is None
    bill = json.loads(text)
    carried = {name.rpartition("/")[2] for name in names if name.endswith(".whl")}
    parts = {part["bom-ref"]: part for part in bill["components"]}
    assert carried < set(wheels) == {name for name in parts if name.endswith(".whl")}
    for name, part in parts.items():
        (license,) = part["licenses"]
        assert "id" in license.get("license", {}) or "expression" in license, (name, license)
    for name in carried:
        content = (REPOSITORY / "wheels" / name).read_bytes()
        assert parts[name]["hashes"][0]["content"] == hashlib.sha256(content).hexdigest()
        with zipfile.ZipFile(REPOSITORY / "wheels" / name) as wheel:
            assert any("license" in file.lower() for file in wheel.namelist()), name


def test_the_zip_holds_all_that_runs_and_nothing_else(names):
    for folder in ("addon", "gpu_shaders", "presets"):
        assert tracked(folder) <= set(names), folder
    assert {"__init__.py", "blender_manifest.toml", "LICENSE"} <= set(names)
    assert [n for n in names if n.split("/")[0] in NOT_FOR_USERS] == []
    assert [n for n in names if "__pycache__" in n or n.endswith((".pyc", ".blend1", ".zip"))] == []
    assert [n for n in names if any(part.startswith(".") for part in n.split("/"))] == []
    assert [n for n in names if n.endswith("/")] == [], "an empty folder"


def test_no_module_edits_sys_path_or_hard_codes_its_package_name():
    """Blender renames the package, and reports entries in sys.path as a policy violation."""
    files = list((REPOSITORY / "addon").rglob("*.py"))
    assert len(files) > 200
    for file in files:
        text = file.read_text(encoding="utf-8")
        edits = r"sys\.path(\[|\s*\+?=|\.(append|insert|extend|remove|pop|clear|sort))"
        assert not re.search(edits, text), file
        assert not re.search(r"^\s*(from|import) (hairloom|addon)\b", text, re.MULTILINE), file


INSTALL = """
import importlib, json, pathlib, sys
import bpy, addon_utils
NAME = "bl_ext.user_default.hairloom"
bpy.ops.extensions.package_install_files(
    filepath={zip!r}, repo="user_default", enable_on_install=True
)
assert all(addon_utils.check(NAME)), "not enabled after the installation"

def traces():
    handlers = [h for n in dir(bpy.app.handlers) for h in [getattr(bpy.app.handlers, n)]]
    own = [f for h in handlers if isinstance(h, list) for f in h if "hairloom" in f.__module__]
    classes = [n for n in dir(bpy.types) if "HAIRLOOM" in n]
    operators = dir(bpy.ops.hairloom)
    return [len(own), len(classes), hasattr(bpy.types.Curves, "hairloom"), len(operators)]

enabled, after = traces(), set()
for _ in range(10):
    addon_utils.disable(NAME, default_set=True)
    after.add(json.dumps(traces()))
    assert not any(addon_utils.check(NAME))
    assert addon_utils.enable(NAME, default_set=True) is not None
    assert traces() == enabled

bpy.ops.mesh.primitive_uv_sphere_add(radius=0.1)
bpy.ops.hairloom.grow(strand_count=50, length=0.1)
bpy.ops.hairloom.preview()
previews = sys.modules[NAME + ".addon.blender.preview.previews"]
registration = sys.modules[NAME + ".addon.registration"]

def module(name):
    return importlib.import_module(NAME + ".addon." + name)

groom, alembic = module("exchange.groom"), module("exchange.alembic.groom_alembic")
child = module("blender.strands.child_python")
reader = module("exchange.alembic.groom_alembic_read")
path = pathlib.Path({resources!r}) / "a.abc"
alembic.write_groom_alembic(path, groom.Groom(previews.sessions()[0].rig.strands))

def strands_read(command):
    return reader.read_groom_alembic(path, python=command).strands.strand_count

def crashes(command):
    crash = path.with_name("crash.py")
    crash.write_text("import os, signal; os.kill(os.getpid(), signal.SIGSEGV)")
    try:
        reader = module("exchange.files.subprocess_reader")
        reader.run_reader(crash, path, library="Alembic", python=command)
    except module("errors").HairloomError as error:
        return str(error)

commands = [each for each in (child.python_command(), child.blender_command()) if each]
import alembic3d, numpy
print(json.dumps(dict(
    alembic=alembic3d.__file__,
    numpy=numpy.__file__,
    read=[strands_read(command) for command in commands],
    crashes=[crashes(command) for command in commands],
    enabled=enabled,
    after=sorted(after),
    strands=previews.sessions()[0].rig.strands.strand_count,
    root=registration.ROOT_PACKAGE,
    has_compressor=importlib.util.find_spec("etcpak") is not None,
    installed=[p.parent.name for p in pathlib.Path({resources!r}).rglob("_etcpak_none*")],
    packages=sorted(p.name for p in pathlib.Path({resources!r}).rglob("site-packages/*.dist-info")),
)), flush=True)
"""


@pytest.mark.slow
def test_it_installs_from_the_zip_and_goes_on_and_off_ten_times(tight, tmp_path):
    script = tmp_path / "install.py"
    resources = str(tmp_path / "resources")
    script.write_text(INSTALL.format(zip=str(tight), resources=resources), encoding="utf-8")
    answer, output = in_fresh_blender(script, tmp_path / "resources")
    assert answer["after"] == ["[0, 0, false, 0]"]
    handlers, classes, _, operators = answer["enabled"]
    own = (HANDLERS, hair_scene.HANDLERS, engine.HANDLERS)
    assert handlers == sum(map(len, own)) and classes > 15 and operators >= 7
    assert answer["strands"] == 50
    assert answer["root"] == "bl_ext.user_default.hairloom"
    assert answer["installed"] == ["etcpak"], "the wheel of this platform, and only that"
    assert answer["has_compressor"]
    packages = ("alembic3d", "archspec", "etcpak")
    assert [each.split("-")[0] for each in answer["packages"]] == list(packages)
    if bpy.app.binary_path:  # the Blender module finds the one of our own requirements first
        assert Path(answer["alembic"]).is_relative_to(resources)
    assert not Path(answer["numpy"]).is_relative_to(resources), "Blender's own numpy stays"
    assert answer["read"] and set(answer["read"]) == {50}
    assert all("library failed on it" in message for message in answer["crashes"])
    assert "Policy" not in output
    assert not re.search(r"Traceback[\s\S]*hairloom", output), output
