"""Colliders on the GPU: their solids, uploaded once, and their pose in each substep.

rounds RGBA32F: two texels for each round solid: xyz start [m], w radius; xyz axis to the end, w one
                over its squared length, 0 for a ball. A set of balls is several solids.
fields RGBA32F: one texel for each node of a distance field [m]: its value and those of its
                neighbours along z, along y, and along both. x varies fastest, then y, so that the
                two texels that a look-up reads are adjacent; each field begins a row.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from ..arrays import Floats
from ..dynamics.colliders import (
    CapsuleCollider,
    Collider,
    DistanceField,
    PosedCollider,
    SphereCollider,
    SphereSetCollider,
)
from ..dynamics.colliders.posed import inverse_or_fallback, travels
from ..dynamics.contacts import max_untraced_squared, spacing_of
from ..errors import HairloomError
from .shader_source import COLLIDER_TEXELS, FIELD_ROW, ROUNDS_ACROSS, STRAND_ROWS
from .textures import texture_from

#: Squared length up to which paths need not be followed, where none need to be.
UNLIMITED_PATH = 1.0e30


@dataclass(frozen=True)
class SolidKinds:
    """The kinds of colliders that a program with lib_signed_distance.glsl supports.

    has_rounds, has_fields: whether there are round solids, and fields. has_several: whether there
    may be more than one collider.
    """

    has_rounds: bool
    has_fields: bool
    has_several: bool

    @property
    def textures(self) -> tuple[str, ...]:
        return ("solids", *("rounds",) * self.has_rounds, *("fields",) * self.has_fields)

    @property
    def integers(self) -> tuple[str, ...]:
        return ("solid_count",) * self.has_several

    @property
    def defines(self) -> tuple[tuple[str, int], ...]:
        flags = {
            "HAS_ROUNDS": self.has_rounds,
            "HAS_FIELDS": self.has_fields,
            "HAS_SEVERAL": self.has_several,
        }
        return tuple((name, 1) for name, is_set in flags.items() if is_set)


@dataclass(frozen=True)
class ColliderTextures:
    """The solids of some colliders in textures.

    colliders: those in the textures, in order.
    shape_texels: (collider_count, 2, 4) two texels of each in the table of substeps. For a field:
        nodes along x, y and z, and its first row; low and cell. For others: first round solid,
        number of solids, 0, -1; zeros.
    bounds: center and radius [m] of a sphere around each.
    rounds, fields: see above; None where there are none.
    """

    colliders: tuple[Collider, ...]
    shape_texels: Floats
    bounds: tuple[tuple[Floats, float], ...]
    rounds: Any
    fields: Any

    @classmethod
    def of(cls, colliders: tuple[Collider, ...]) -> ColliderTextures:
        """Upload the solids.

        Raises:
            HairloomError: more of them than a texture holds.
        """
        rounds: list[Floats] = []
        fields: list[Floats] = []
        shape_texels = np.zeros((len(colliders), 2, 4), np.float32)
        row = 0
        for place, collider in enumerate(colliders):
            if isinstance(collider, DistanceField):
                shape_texels[place] = (*collider.values.shape, row), (*collider.low, collider.cell)
                fields.append(field_texels(collider.values))
                row += len(fields[-1]) // FIELD_ROW
            else:
                solids = round_texels(collider)
                shape_texels[place, 0] = sum(map(len, rounds)), len(solids), 0.0, -1.0
                rounds.append(solids)
        bounds = tuple(collider.bounds for collider in colliders)
        textures = _texture(rounds, ROUNDS_ACROSS), _texture(fields, FIELD_ROW)
        return cls(colliders, shape_texels, bounds, *textures)

    def match(self, posed: tuple[PosedCollider, ...]) -> bool:
        """Whether these are the colliders in the textures."""
        return len(posed) == len(self.colliders) and all(
            one.collider is other for one, other in zip(posed, self.colliders, strict=True)
        )

    @cached_property
    def distance_iterations(self) -> int:
        """Loop iterations for the distance of one point to all colliders."""
        is_round = self.shape_texels[:, 0, 3] < 0.0
        if len(self.shape_texels) == 1 and not is_round.any():
            return 0  # a single field is looked up without a loop
        return len(self.shape_texels) + int(self.shape_texels[is_round, 0, 1].sum())

    @property
    def kinds(self) -> SolidKinds:
        return SolidKinds(self.rounds is not None, self.fields is not None, len(self.colliders) > 1)

    def solids(self, posed: tuple[PosedCollider, ...]) -> Any:
        """The texture `solids` of lib_signed_distance.glsl: all colliders at the frame's end.

        RGBA32F, with COLLIDER_TEXELS texels for each collider in one row, as in `pose_texels`;
        those for the motion are 0.
        """
        table = np.zeros((1, len(posed), COLLIDER_TEXELS, 4), np.float32)
        for place, one in enumerate(posed):
            self._write_pose(table, place, one.matrix_now[None])
        return texture_from(table.reshape(1, -1, 4), "RGBA32F")

    def pose_texels(
        self,
        posed: tuple[PosedCollider, ...],
        spans: Floats,
        reach: float,
        size: float,
        cv_count: int,
    ) -> Floats:
        """Rows of the table of substeps, (substep_count, collider_count * COLLIDER_TEXELS, 4).

        A collider's texels: three rows of its inverse matrix at the substep's end; three rows of
        the change of its matrix in the substep; those of `shape_texels`; a sphere around all points
        within `reach` of it during the substep; three rows of its inverse matrix at the substep's
        begin; x the squared length up to which paths need not be followed (see
        `contacts.max_untraced_squared`), y 1 where segments collide, z its smallest scale, w its
        deformation.

        Args:
            spans: (substep_count, 2) begin and end of each substep as fractions of the frame.
            reach: largest distance of a contact from a collider [m].
            size: [m] of the hair. cv_count: of a guide.
        """
        table = np.zeros((len(spans), len(posed), COLLIDER_TEXELS, 4), np.float32)
        times: Any = spans.T[..., None, None]  # in matrix_at an array does for a number
        for place, one in enumerate(posed):
            before, now = one.matrix_at(times)
            self._write_pose(table, place, now)
            table[:, place, 3:6] = (now - before)[:, :3]
            travel = travels(now - before, *self.bounds[place])
            table[:, place, 8, 3] += reach + travel
            scales = np.linalg.svd(now[:, :3, :3], compute_uv=False)
            table[:, place, 9:12] = [
                inverse_or_fallback(*pair)[:3] for pair in zip(before, now, strict=True)
            ]
            limit = scales[:, -1] * max_untraced_squared(one.collider.curve_radius, size)
            sharp = spacing_of(size, cv_count) ** 2 > limit
            table[:, place, 12, 0] = np.where(
                sharp | (travel * travel > limit), limit, UNLIMITED_PATH
            )
            table[:, place, 12, 1] = sharp
            table[:, place, 12, 2] = scales[:, -1]
            table[:, place, 12, 3] = one.deformation
        return table.reshape(len(spans), -1, 4)

    def _write_pose(self, table: Floats, place: int, now: Floats) -> None:
        """Write the pose of a collider, (n, 4, 4) object to world, its shape and its bounding
        sphere into rows of a table of substeps."""
        table[:, place, 0:3] = np.linalg.inv(now)[:, :3]
        table[:, place, 6:8] = self.shape_texels[place]
        turned, (center, radius) = now[:, :3, :3], self.bounds[place]
        stretch = np.sqrt(np.einsum("nij,nij->n", turned, turned))  # an upper bound of the scale
        table[:, place, 8, :3] = turned @ center + now[:, :3, 3]
        table[:, place, 8, 3] = radius * stretch


class UploadedColliders:
    """The textures of the last requested colliders; the passes of one groom share them."""

    def __init__(self) -> None:
        self._textures: ColliderTextures | None = None

    def textures_of(self, posed: tuple[PosedCollider, ...]) -> ColliderTextures:
        """The textures of these colliders, uploaded if they are not the last ones.

        Raises:
            HairloomError: more of them than a texture holds.
        """
        if self._textures is None or not self._textures.match(posed):
            self._textures = ColliderTextures.of(tuple(one.collider for one in posed))
        return self._textures

    def release(self) -> None:
        """Release everything on the GPU."""
        self._textures = None


def round_texels(collider: Collider) -> Floats:
    """Two texels for each round solid of a collider, (n, 2, 4) float32.

    Raises:
        HairloomError: it is no ball, capsule or set of balls.
    """
    if isinstance(collider, SphereSetCollider):
        solids = np.zeros((len(collider.radii), 2, 4), np.float32)
        solids[:, 0, :3], solids[:, 0, 3] = collider.centers, collider.radii
        return solids
    solids = np.zeros((1, 2, 4), np.float32)
    if isinstance(collider, SphereCollider):
        solids[0, 0] = *collider.center, collider.radius
    elif isinstance(collider, CapsuleCollider):
        axis = collider.end - collider.start
        square = float((axis * axis).sum())
        solids[0, 0] = *collider.start, collider.radius
        solids[0, 1] = *axis, 1.0 / square if square > 1.0e-18 else 0.0
    else:
        raise HairloomError(
            f"a {type(collider).__name__} cannot be computed on the GPU",
            place="collider",
            remedy="Compute dynamics on the CPU",
        )
    return solids


def field_texels(values: Floats) -> Floats:
    """A field (nx, ny, nz) as full rows of texels, (n * FIELD_ROW, 4)."""
    padded = np.pad(values, ((0, 0), (0, 1), (0, 1)), mode="edge")
    corners = padded[:, :-1, :-1], padded[:, :-1, 1:], padded[:, 1:, :-1], padded[:, 1:, 1:]
    nodes = np.zeros((-(-values.size // FIELD_ROW) * FIELD_ROW, 4), np.float32)
    nodes[: values.size] = np.stack([corner.T for corner in corners], axis=-1).reshape(-1, 4)
    return nodes


def _texture(parts: list[Floats], across: int) -> Any:
    if not parts:
        return None
    texels = np.concatenate(parts)
    texels = texels.reshape(len(texels), -1)
    height = -(-len(texels) // across)
    if height > STRAND_ROWS:
        raise HairloomError(
            f"colliders of {len(texels)} parts do not fit into the GPU's textures",
            place="collider",
            remedy="Use fewer colliders, or a lower collider resolution",
        )
    rows = np.zeros((height * across, texels.shape[1]), np.float32)
    rows[: len(texels)] = texels
    return texture_from(rows.reshape(height, -1, 4), "RGBA32F")
