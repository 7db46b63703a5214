"""The bill of materials of the extension's zip, in CycloneDX.

python tools/bill_of_materials.py OUTPUT.json

It lists the wheels in the zip, from their own metadata and tools/wheels.sha256, and the third-party
data. It does not depend on when or where it is made.
"""

from __future__ import annotations

import json
import sys
import tomllib
import zipfile
from email.message import Message
from email.parser import HeaderParser
from pathlib import Path
from uuid import UUID, uuid5

from cyclonedx.contrib.license.factories import LicenseFactory
from cyclonedx.model import HashAlgorithm, HashType
from cyclonedx.model.bom import Bom
from cyclonedx.model.component import Component, ComponentType
from cyclonedx.output.json import JsonV1Dot6
from fetch_wheels import FOLDER, REPOSITORY, pinned_wheels
from packageurl import PackageURL

#: Third-party parts of the zip beside wheels: name, license, description.
DATA = (
    ("MakeHuman base mesh", "CC0-1.0", "addon/blender/scene/bust.npz is made from it"),
    ("three.js 0.187.0", "MIT", "addon/exchange/cards/page/viewer.min.js has parts of it"),
)
#: Licenses as named in a wheel's metadata -> SPDX identifiers.
_IDENTIFIERS = {"MIT License": "MIT"}
_NAMESPACE = UUID("6ba7b811-9dad-11d1-80b4-00c04fd430c8")


def main(arguments: list[str]) -> int:
    content = json.loads(JsonV1Dot6(bill_of_materials()).output_as_string())
    del content["metadata"]["timestamp"]  # it says nothing about the zip
    Path(arguments[0]).write_text(json.dumps(content, indent=2) + "\n", encoding="utf-8")
    return 0


def bill_of_materials() -> Bom:
    manifest = tomllib.loads((REPOSITORY / "blender_manifest.toml").read_text(encoding="utf-8"))
    licenses = LicenseFactory()
    spdx = manifest["license"][0].removeprefix("SPDX:")
    whole = Component(
        name=manifest["id"],
        version=manifest["version"],
        type=ComponentType.APPLICATION,
        licenses=[licenses.make_from_string(spdx)],
        bom_ref=manifest["id"],
    )
    digests = pinned_wheels()
    bill = Bom(serial_number=uuid5(_NAMESPACE, "".join(sorted(digests.values()))))
    bill.metadata.component = whole
    parts = [_wheel(name, digest, licenses) for name, digest in sorted(digests.items())]
    for name, license_name, description in DATA:
        parts.append(
            Component(
                name=name,
                type=ComponentType.DATA,
                description=description,
                licenses=[licenses.make_from_string(license_name)],
                bom_ref=name,
            )
        )
    for part in parts:
        bill.components.add(part)
    bill.register_dependency(whole, parts)
    return bill


def _wheel(name: str, digest: str, licenses: LicenseFactory) -> Component:
    package, version, *_ = name.split("-")
    with zipfile.ZipFile(FOLDER / name) as wheel:
        (path,) = (each for each in wheel.namelist() if each.endswith(".dist-info/METADATA"))
        metadata = HeaderParser().parsestr(wheel.read(path).decode("utf-8"))
    license_name = (
        metadata["License-Expression"] or metadata["License"] or _license_from_classifiers(metadata)
    )
    license_name = license_name.strip().splitlines()[0]
    return Component(
        name=package,
        version=version,
        type=ComponentType.LIBRARY,
        description=metadata["Summary"],
        licenses=[licenses.make_from_string(_IDENTIFIERS.get(license_name, license_name))],
        purl=PackageURL("pypi", None, package, version, {"file_name": name}),
        hashes=[HashType(alg=HashAlgorithm.SHA_256, content=digest)],
        bom_ref=name,
    )


def _license_from_classifiers(metadata: Message) -> str:
    """The license that PyPI's classifiers name."""
    lines = metadata.get_all("Classifier", [])
    names = [line.rpartition(" :: ")[2] for line in lines if line.startswith("License")]
    return names[0] if names else "unknown"


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
