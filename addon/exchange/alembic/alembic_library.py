"""PyAlembic from the package `alembic3d`, and its arrays from numpy's."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np

from ...arrays import Floats, Ints
from ...errors import HairloomError

#: numpy dtype, width of an item -> the array of Imath that is made from a buffer
_FROM_BUFFER = {
    ("float32", 1): "FloatArrayFromBuffer",
    ("float32", 2): "V2fArrayFromBuffer",
    ("float32", 3): "V3fArrayFromBuffer",
    ("int32", 1): "IntArrayFromBuffer",
    ("int32", 3): "V3iArrayFromBuffer",
}
#: the same -> what Alembic calls the type of such a geometry parameter
_PARAMETER = {
    ("float32", 1): "Float",
    ("float32", 2): "V2f",
    ("float32", 3): "V3f",
    ("int32", 1): "Int32",
    ("int32", 3): "V3i",
}


def alembic_library(place: str) -> Any:
    """The modules of PyAlembic as `abc`, `geom`, `core` and `imath`.

    Raises:
        HairloomError: it cannot be loaded in this Python.
    """
    try:
        import imath
        from alembic3d import Abc, AbcCoreAbstract, AbcGeom
    except ImportError as error:
        raise HairloomError(
            f"the package alembic3d, which reads and writes Alembic, cannot be loaded ({error})",
            place=place,
            remedy="Use USD instead, or install the extension again for this platform",
        ) from error
    return SimpleNamespace(abc=Abc, geom=AbcGeom, core=AbcCoreAbstract, imath=imath)


def imath_array(library: Any, values: Floats | Ints) -> Any:
    """A copy of (n,) or (n, width) float32 or int32 as an array of Imath."""
    return getattr(library.imath, _FROM_BUFFER[_kind(values)])(np.ascontiguousarray(values))


def parameter_sample(library: Any, values: Floats | Ints, scope: str) -> Any:
    """Values (n,) or (n, width) of a geometry parameter.

    Args:
        scope: "Constant", "Uniform" or "Vertex".
    """
    make = getattr(library.geom, f"O{_PARAMETER[_kind(values)]}GeomParamSample")
    return make(imath_array(library, values), geometry_scope(library, scope))


def write_parameter(
    library: Any, parent: Any, name: str, values: Floats | Ints, scope: str
) -> None:
    """A geometry parameter with one sample; vectors have the interpretation "vector"."""
    make = getattr(library.geom, f"O{_PARAMETER[_kind(values)]}GeomParam")
    make(parent, name, False, geometry_scope(library, scope), 1).set(
        parameter_sample(library, values, scope)
    )


def geometry_scope(library: Any, scope: str) -> Any:
    return getattr(library.geom.GeometryScope, f"k{scope}Scope")


def _kind(values: Floats | Ints) -> tuple[str, int]:
    return values.dtype.name, values.shape[1] if values.ndim == 2 else 1
