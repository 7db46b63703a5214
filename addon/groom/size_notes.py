"""Notes on grooms and heads of files whose sizes cannot be in metres."""

from __future__ import annotations

from ..arrays import Floats

#: Hair, a head or a body larger than this is in another unit [m]: a horse is 3 m, a man of
#: MakeHuman's 17 dm.
MAX_EXTENT = 12.0
#: Hair smaller than this is in another unit [m].
MIN_EXTENT = 0.005
#: Beside something too large, the other is in metres if it is smaller than this [m], or this many
#: times smaller.
_IN_METRES, _TIMES_SMALLER = 1.0, 50.0


def size_note(hair: tuple[str, Floats] | None, head: tuple[str, Floats] | None) -> str:
    """A note on files whose numbers cannot be metres; "" where they may be.

    Args:
        hair, head: name and points (n, 3) [m] as they were read; None is not from a file.
    """
    found = {"--groom-scale": hair, "--head-scale": head}
    sizes = {
        option: (what[0], float((what[1].max(axis=0) - what[1].min(axis=0)).max()))
        for option, what in found.items()
        if what is not None and len(what[1])
    }
    large = " and ".join(f"{name} is {length_text(size)} large" for name, size in sizes.values())
    largest = max((size for _, size in sizes.values()), default=0.0)
    if largest > MAX_EXTENT:
        least = max(_IN_METRES, largest / _TIMES_SMALLER)
        wrong = [option for option, (_, size) in sizes.items() if size > least]
        options = " ".join(f"{option} 0.01" for option in wrong)
        each = "both" if len(wrong) > 1 else sizes[wrong[0]][0]
        return (
            f"{large}, as if in centimetres or decimetres. Scale {each} by 0.01 ({options}) "
            "or by 0.1."
        )
    if "--groom-scale" in sizes and sizes["--groom-scale"][1] < MIN_EXTENT:
        return f"{large}. Import hair with another scale (--groom-scale)."
    return ""


def object_size_note(name: str, points: Floats) -> str:
    """As `size_note`, for hair of a scene: its scale is that of its object, not an option.

    Args:
        points: (n, 3) [m], world space.
    """
    if not len(points):
        return ""
    size = float((points.max(axis=0) - points.min(axis=0)).max())
    if size > MAX_EXTENT:
        return (
            f"{name} is {length_text(size)} large, as if in centimetres or decimetres. Scale the "
            "hair and its head in the scene by 0.01 or by 0.1."
        )
    if size < MIN_EXTENT:
        return f"{name} is {length_text(size)} large. Scale the hair and its head in the scene."
    return ""


def length_text(length: float) -> str:
    """Such as "264 m" or "1.3 mm"."""
    if length < 0.9995:
        return f"{1e3 * length:.3g} mm"
    return f"{length:.3g} m" if length < 999.5 else f"{length:,.0f} m"
