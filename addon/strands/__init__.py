"""The data that flows through every room: strands, and the surface they grow from."""

from .strand_set import StrandSet
from .surface import Surface

__all__ = ["StrandSet", "Surface"]
