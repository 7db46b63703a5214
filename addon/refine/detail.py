"""How many straight pieces each segment of a strand needs in the picture: its detail factor.

Three modes (`DetailSettings.mode`):

adaptive: as few pieces as keep the drawn line within `error` pixels of the curve. If a curve b(t)
    is cut into n pieces even in t, its distance d from the chord at the same t is bounded by
    d <= 0.75 max(|D1|, |D2|) / n^2, D1 = b0 - 2 b1 + b2 and D2 = b1 - 2 b2 + b3 (Wang 1984). The
    same in pixels follows from clip coordinates, in which the curve is a cubic Bezier as well: the
    difference in xy / w between the curve l + d and the chord point l is

        (l.xy + d.xy) / (l.w + d.w) - l.xy / l.w  =  (d.xy - (l.xy / l.w) d.w) / (l.w + d.w)

    Curve and chord lie in the convex hull of the control points b_j, so l.w + d.w is no less than
    the smallest b_j.w, and l.xy / l.w is a mean of the slopes b_j.xy / b_j.w. Hence with

        M = max over j, k of |half_size (D_k.xy - (b_j.xy / b_j.w) D_k.w)| / min over j of b_j.w

    in pixels, n = ceil(sqrt(0.75 M / error)) keeps the error, for perspective and orthographic
    (w = 1) projections alike. A single piece is enough if 0.75 M <= error with the thirds
    (2 D1 + D2) / 3 and (D1 + 2 D2) / 3 in place of D1 and D2, because b(t) - l(t) is
    -t (1 - t) ((1 - t) (2 D1 + D2) + t (D1 + 2 D2)). If a control point lies at or behind the eye
    there is no such bound, and the segment gets the maximum number of pieces.
heuristic: by Rapp and Spielmann, from the segment's size in the picture and the larger angle to
    its neighbours.
fixed: the same number everywhere.

In the first two modes a segment that is certainly outside of the picture is one piece: all control
points, and so the curve and its chord, lie beyond one of the six planes. Neighbours share their end
points, whatever their factors, so there are no cracks.

Twin of gpu_shaders/lib_detail.glsl. Both work in float32, where a factor at the limit between two
numbers may be rounded either way; that makes less than 0.001 pixels of error.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..arrays import Bools, Floats, Ints
from .settings import DetailSettings

#: The side planes are moved out by this fraction of w, for the width of strands (0.1: by 5 % of the
#: picture's size).
MARGIN = 0.1
#: A control point nearer to the plane of the eye than this counts as lying in it [m].
NEAREST = 1.0e-6
#: The angle between segments from which on the heuristic no longer reduces the pieces [rad].
FULL_ANGLE = np.float32(np.pi / 4.0)
#: Strands processed at once, so that they stay in the processor's cache.
_CHUNK = 1024


@dataclass(frozen=True)
class PictureView:
    """A camera, and the size of its picture.

    view: (4, 4) world to view space. projection: (4, 4) view to clip space, OpenGL's convention.
    width, height: of the picture [pixels].
    """

    view: Floats
    projection: Floats
    width: int
    height: int

    @property
    def view_projection(self) -> Floats:
        """(4, 4) float64, world to clip space."""
        return np.asarray(self.projection, np.float64) @ np.asarray(self.view, np.float64)

    @property
    def half_size(self) -> tuple[float, float]:
        """Half the width and height of the picture [pixels]."""
        return self.width / 2.0, self.height / 2.0


def detail_factors(points: Floats, view: PictureView, settings: DetailSettings) -> Ints:
    """Pieces of each segment, (strand_count, cv_count - 1) int32: at least 1 and, unless the mode
    is "fixed", at most `max_subdivisions`.

    Args:
        points: (strand_count, cv_count, 3) [m], world space.
    """
    segment_count = points.shape[1] - 1
    if settings.mode == "fixed":
        return np.full((len(points), segment_count), settings.subdivisions, np.int32)
    factors = np.empty((len(points), segment_count), np.int32)
    with np.errstate(all="ignore"):  # points that are not finite give 1 or the maximum
        for start in range(0, len(points), _CHUNK):
            cvs = _extended(np.asarray(points[start : start + _CHUNK], np.float32))
            factors[start : start + _CHUNK] = _factors(cvs, view, settings)
    return factors


def stations(factors: Ints) -> Ints:
    """The first station of each segment and, last, the number of pieces, (strand_count, cv_count)
    int32.

    A strand of n pieces has the stations 0 to n. Station s lies in the segment i with
    stations[i] <= s < stations[i + 1], at u = (s - stations[i]) / factors[i]; station n is the tip.
    """
    starts = np.zeros((len(factors), factors.shape[1] + 1), np.int32)
    np.cumsum(factors, axis=1, out=starts[:, 1:])
    return starts


def _factors(cvs: Floats, view: PictureView, settings: DetailSettings) -> Ints:
    """The factors (n, cv_count - 1) int32 of CVs (3, n, cv_count + 2) float32, see `_extended`."""
    clip = _clip(cvs, view.view_projection.astype(np.float32))
    half_size = np.array(view.half_size, np.float32)[:, None, None]
    control = _bezier(clip)
    if settings.mode == "adaptive":
        wanted = wang_pieces(control, half_size, np.float32(settings.error))
    else:
        wanted = heuristic_pieces(cvs, clip, half_size, np.float32(settings.piece_length))
    max_pieces = np.float32(settings.max_subdivisions)
    pieces = np.where(wanted > 1.0, np.minimum(wanted, max_pieces), np.float32(1.0))
    return np.where(is_outside(control), 1, pieces).astype(np.int32)


def wang_pieces(control: tuple[Floats, ...], half_size: Floats, error: np.float32) -> Floats:
    """The smallest n that Wang's bound allows, not yet limited, (...) float32.

    Args:
        control: b0, b1, b2, b3 in clip space, (4, ...) each.
        half_size: (2, ...) [pixels].
        error: [pixels].
    """
    b0, b1, b2, b3 = control
    nearest = np.minimum(np.minimum(b0[3], b1[3]), np.minimum(b2[3], b3[3]))
    bend_from, bend_to = b0 - 2.0 * b1 + b2, b1 - 2.0 * b2 + b3
    third, scale = (bend_to - bend_from) * np.float32(1.0 / 3.0), np.float32(0.75) / error
    one = scale * _bend_size(control, bend_from + third, bend_to - third, half_size) / nearest
    many = scale * _bend_size(control, bend_from, bend_to, half_size) / nearest
    pieces = np.where(one <= 1.0, np.float32(1.0), np.ceil(np.sqrt(many)))
    return np.where(nearest >= NEAREST, pieces, np.float32(np.inf))


def _bend_size(
    control: tuple[Floats, ...], bend_from: Floats, bend_to: Floats, half_size: Floats
) -> Floats:
    """max over j, k of |half_size (D_k.xy - (b_j.xy / b_j.w) D_k.w)|, (...)."""
    largest = np.zeros_like(control[0][3])
    for b in control:
        slope = b[:2] / b[3]
        for bend in (bend_from, bend_to):
            largest = np.maximum(largest, _length(half_size * (bend[:2] - slope * bend[3])))
    return largest


def heuristic_pieces(cvs: Floats, clip: Floats, half_size: Floats, length: np.float32) -> Floats:
    """ceil(size / length * min(angle / 45 degrees, 1)), not yet limited, (n, C - 1) float32.

    Args:
        cvs: (3, n, C + 2) [m], see `_extended`. clip: the same in clip space, (4, ...).
        half_size: (2, ...) [pixels].
        length: of a piece [pixels].
    """
    step = np.diff(cvs, axis=2)
    bend = _angle(step[:, :, :-1], step[:, :, 1:])
    angle = np.maximum(bend[:, :-1], bend[:, 1:])
    seen = clip[:2] / np.maximum(clip[3], NEAREST)
    size = _length(half_size * np.diff(seen[:, :, 1:-1], axis=2))
    return np.ceil(size / length * np.minimum(angle / FULL_ANGLE, np.float32(1.0)))


def is_outside(control: tuple[Floats, ...]) -> Bools:
    """Whether all control points (4, ...), in clip space, lie beyond one plane of the frustum."""
    outside = np.zeros(control[0].shape[1:], bool)
    for axis, room in ((0, 1.0 + MARGIN), (1, 1.0 + MARGIN), (2, 1.0)):
        is_below, is_above = np.ones_like(outside), np.ones_like(outside)
        for b in control:
            edge = np.float32(room) * b[3]
            is_below &= b[axis] < -edge
            is_above &= b[axis] > edge
        outside |= is_below | is_above
    return outside


def _extended(points: Floats) -> Floats:
    """CVs (n, C, 3) as (3, n, C + 2), extrapolated straight by one at both ends."""
    cvs = np.moveaxis(points, 2, 0)
    before = 2.0 * cvs[:, :, :1] - cvs[:, :, 1:2]
    after = 2.0 * cvs[:, :, -1:] - cvs[:, :, -2:-1]
    return np.concatenate([before, cvs, after], axis=2)


def _clip(cvs: Floats, matrix: Floats) -> Floats:
    """Points (3, ...) in clip space, (4, ...)."""
    x, y, z = cvs
    return np.stack([row[0] * x + row[1] * y + row[2] * z + row[3] for row in matrix])


def _bezier(cvs: Floats) -> tuple[Floats, Floats, Floats, Floats]:
    """Control points (4, n, C - 1) of each segment from CVs (4, n, C + 2), as `smooth.bezier`."""
    p0, p1, p2, p3 = cvs[..., :-3], cvs[..., 1:-2], cvs[..., 2:-1], cvs[..., 3:]
    sixth = np.float32(1.0 / 6.0)
    return p1, p1 + (p2 - p0) * sixth, p2 - (p3 - p1) * sixth, p2


def _angle(one: Floats, two: Floats) -> Floats:
    """The angle between vectors (3, ...), in [0, pi]; 0 if one has no length (Kahan 2006)."""
    along = (one * two).sum(axis=0)
    return np.arctan2(_length(np.cross(one, two, axis=0)), along)


def _length(vectors: Floats) -> Floats:
    """The length of vectors (n, ...) along their first axis."""
    return np.sqrt((vectors * vectors).sum(axis=0))
