"""Makes the distance field of the built-in head that ships: addon/blender/colliders/bust_field.npz.

python tools/make_bust_field.py

Run it again when the head, the resolution or the computation of fields changes; a test fails then.
"""

import importlib
import sys

import bpy  # noqa: F401  it must come before what imports it
import numpy as np
from extension_loader import PACKAGE, load_package


def main() -> int:
    load_package().register()

    def of(name: str):
        return importlib.import_module(f"{PACKAGE}.addon.{name}")

    surface = of("blender.scene.built_in_head").built_in_head().surface
    settings = of("dynamics.settings").DynamicsSettings()
    field = of("dynamics.colliders").DistanceField.from_surface(surface, settings)
    file = of("blender.colliders.bust_field").FILE
    key = of("blender.colliders.fields").field_key(surface, settings)
    np.savez_compressed(
        file, key=np.array(key), values=field.values, low=field.low, cell=np.array(field.cell)
    )
    print(f"{file.name}: {field.values.shape}, {file.stat().st_size / 1e3:.0f} kB")
    return 0


if __name__ == "__main__":
    sys.exit(main())
