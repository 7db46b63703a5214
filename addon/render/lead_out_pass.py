"""Strands that ride, led out of colliders on the GPU: `refine.lead_out` behind RidePass, over
textures in the layouts of `strand_layout`.

    strand_spans  RGBA32F: where the points of each strand lie, see strand_layout.StrandLayout
    solids, rounds, fields: the colliders, see collider_textures.py
    rest_points, root_motions: where roots carry points, see ride_pass.py
    clearances    R32F: how far from colliders each point stays where its root carries it [m]
    wanted        R32F: how far it stays where it is [m]
    states        RGBA32F: of each strand x whether it is led out, see lead_out.comp.glsl
    led_points    RGBA32F: xyz where points are led to [m, world]
    led_texels    RG32F: the texels of points that were led earlier
    cv_points     RGBA32F: xyz position now [m, world], changed in place
"""

from __future__ import annotations

from typing import Any

import gpu
import numpy as np

from ..arrays import Ints
from ..dynamics.colliders import PosedCollider
from ..refine.lead_out import ATTEMPTS, HALVINGS, SWEEPS, TRIES, Clearance, LedOut
from . import gpu_objects
from .collider_textures import ColliderTextures, UploadedColliders
from .shader_program import ShaderRecipe, program
from .strand_layout import StrandLayout, from_strand_rows, strand_rows, strand_rows_size
from .textures import texture_from, texture_to_array

_GROUP = (64, 1)
#: what a clearance of -inf is on the GPU [m]
_NONE = -1.0e30
#: Software drivers end a shader after about this many rounds of all its loops.
_ROUNDS = 60_000
#: step -> its images
_STEPS = {
    "BEGIN": (("cv_points", "READ"), ("clearances", "WRITE")),
    "NEAR": (("cv_points", "READ"), ("states", "READ_WRITE"), ("wanted", "WRITE")),
    "LED": (("cv_points", "READ"), ("states", "READ_WRITE"), ("led_points", "READ_WRITE")),
    "PUT": (("cv_points", "READ_WRITE"),),
}
_INTEGERS = {
    "BEGIN": ("solid_count",),
    "NEAR": ("solid_count", "mover_count"),
    "LED": ("solid_count", "attempt"),
    "PUT": (),
}
_TEXTURES = {
    "BEGIN": (),
    "NEAR": ("clearances", "rest_points", "root_motions"),
    "LED": ("wanted",),
}
PUT_RECIPE = ShaderRecipe(
    name="put_points",
    compute="put_points.comp.glsl",
    textures=(("FLOAT_2D", "led_points"), ("FLOAT_2D", "led_texels")),
    images=(("RGBA32F", "cv_points", "READ_WRITE"),),
    integers=("point_count",),
    group_size=_GROUP,
)


def lead_out_recipe(step: str, *, rounds: bool = False, fields: bool = False) -> ShaderRecipe:
    """The program of one step, for these kinds of colliders.

    Args:
        step: "BEGIN", "NEAR", "LED" or "PUT", see lead_out.comp.glsl.
    """
    flags = {f"IS_{step}": True, "HAS_ROUNDS": rounds, "HAS_FIELDS": fields}
    names = ["strand_spans"]
    if step == "PUT":
        names += ["states", "led_points"]
    else:
        names += ["solids", *_TEXTURES[step]]
        names += [name for name, is_there in (("rounds", rounds), ("fields", fields)) if is_there]
    formats = {"clearances": "R32F", "wanted": "R32F"}
    return ShaderRecipe(
        name=f"lead_out_{step.lower()}",
        compute="lead_out.comp.glsl",
        textures=tuple(("FLOAT_2D", name) for name in names),
        images=tuple((formats.get(name, "RGBA32F"), name, access) for name, access in _STEPS[step]),
        integers=("strand_count", "first_point", "point_end", *_INTEGERS[step]),
        numbers=() if step == "PUT" else (("FLOAT", "kept"),),
        group_size=_GROUP,
        defines=tuple((name, 1) for name, is_set in flags.items() if is_set),
    )


class LeadOutPass:
    """The contacts of one groom's strands on the GPU. Making one touches no GPU.

    Args:
        layout: of cv_points.
        colliders: where they are uploaded to.
    """

    def __init__(self, layout: StrandLayout, colliders: UploadedColliders) -> None:
        self._layout, self._colliders = layout, colliders
        self._given: Clearance | None = None
        self._kept: float | None = None
        self.release()

    @property
    def kept(self) -> float | None:
        """`Clearance.kept` [m]; None before a motion has any colliders."""
        return self._kept

    def take(self, clearance: Clearance | None) -> None:
        """Go on with the clearance of a motion; None: it has none yet."""
        self.release()
        self._given, self._kept = clearance, None if clearance is None else clearance.kept

    def begin(self, cv_points: Any, posed: tuple[PosedCollider, ...], kept: float) -> None:
        """Find the clearance of strands that their roots carry, see `refine.lead_out.clearance_at`.

        Raises:
            HairloomError: a collider that the GPU cannot have.
            ShaderError: the shader does not compile here.
        """
        self.release()
        self._kept = kept
        if self._layout.strand_count:
            self._textures["clearances"] = _empty(self._layout.size, "R32F")
            self._run("BEGIN", cv_points, posed)

    def lead(
        self,
        cv_points: Any,
        posed: tuple[PosedCollider, ...],
        carrying: dict[str, Any],
        mover_count: int,
    ) -> None:
        """Lead strands out, see `refine.lead_out.lead_out`.

        Args:
            carrying: the textures rest_points and root_motions.
            mover_count: how many root motions there are.

        Raises:
            HairloomError, ShaderError: as `begin`.
        """
        if self._kept is None or not posed or not self._layout.strand_count:
            self._textures.pop("states", None)
            return
        if self._given is not None:
            held = np.maximum(self._given.points, np.float32(_NONE))[:, None]
            self._textures["clearances"] = texture_from(self._layout.pixels(held), "R32F")
            self._given = None
        if "states" not in self._textures:
            size = strand_rows_size(self._layout.strand_count, 1)
            self._textures["states"] = _empty(size, "RGBA32F")
            self._textures["led_points"] = _empty(self._layout.size, "RGBA32F")
            self._textures["wanted"] = _empty(self._layout.size, "R32F")
        self._run("NEAR", cv_points, posed, carrying, mover_count=mover_count)
        for attempt in range(ATTEMPTS):
            self._run("LED", cv_points, posed, attempt=attempt)
        self._run("PUT", cv_points, posed)

    def put(self, cv_points: Any, led: LedOut) -> None:
        """Put strands where they were led to earlier, see `LedOut.put`.

        Raises:
            ShaderError: the shader does not compile here.
        """
        count = len(led.points)
        if not count:
            return
        spans = self._layout.spans[led.strands]
        counts = spans[:, 2].astype(int)
        texels = np.repeat(spans[:, :2], counts, axis=0)
        texels[:, 0] += np.arange(count) - np.repeat(np.cumsum(counts) - counts, counts)
        points = np.pad(led.points, ((0, 0), (0, 1)))
        shader = program(PUT_RECIPE)
        textures = {
            "led_points": texture_from(strand_rows(points[:, None]), "RGBA32F"),
            "led_texels": texture_from(strand_rows(texels[:, None]), "RG32F"),
        }
        shader.bind(
            textures=textures, images={"cv_points": cv_points}, integers={"point_count": count}
        )
        gpu.compute.dispatch(shader.shader, -(-count // _GROUP[0]), 1, 1)
        gpu.shader.unbind()

    def led(self) -> Ints:
        """The strands that `lead` has led out last, (n,), read back."""
        states = self._textures.get("states")
        if states is None:
            return np.zeros(0, np.int32)
        flags = from_strand_rows(texture_to_array(states), self._layout.strand_count, 1)
        return np.flatnonzero(flags[:, 0, 0]).astype(np.int32)

    def read(self) -> Clearance | None:
        """The clearance, read back."""
        if self._given is not None or self._kept is None:
            return self._given
        if "clearances" not in self._textures:
            return Clearance(self._kept, np.zeros(0, np.float32))
        points = self._layout.values(texture_to_array(self._textures["clearances"]))[:, 0]
        return Clearance(self._kept, np.where(points > _NONE, points, -np.inf))

    def release(self) -> None:
        """Let go of all that lies on the GPU."""
        self._textures: dict[str, Any] = {}
        self._kept = self._given = None

    def _run(
        self,
        step: str,
        cv_points: Any,
        posed: tuple[PosedCollider, ...],
        carrying: dict[str, Any] | None = None,
        **integers: int,
    ) -> None:
        """One step over all points of all strands, as many at once as drivers bear."""
        solids = self._colliders.of(posed)
        if "strand_spans" not in self._textures:
            spans = strand_rows(self._layout.spans[:, None])
            self._textures["strand_spans"] = texture_from(spans, "RGBA32F")
        kinds = {"rounds": solids.rounds is not None, "fields": solids.fields is not None}
        recipe = lead_out_recipe(step, **({} if step == "PUT" else kinds))
        taken = {"solids": solids.solids(posed), "rounds": solids.rounds, "fields": solids.fields}
        taken |= self._textures | (carrying or {}) | {"cv_points": cv_points}
        integers["solid_count"] = len(posed)
        shader, count = program(recipe), self._layout.strand_count
        most, at_once = int(self._layout.counts.max()), _points_at_once(solids)
        for first in range(0, most, at_once):
            shader.bind(
                textures={name: taken[name] for _, name in recipe.textures},
                images={name: taken[name] for _, name, *_ in recipe.images},
                integers={
                    "strand_count": count,
                    "first_point": first,
                    "point_end": first + at_once,
                    **{name: integers[name] for name in _INTEGERS[step]},
                },
                numbers={name: self._kept for _, name in recipe.numbers},
            )
            gpu.compute.dispatch(shader.shader, -(-count // _GROUP[0]), 1, 1)
            gpu.shader.unbind()


def _points_at_once(solids: ColliderTextures) -> int:
    """How many points of a strand one dispatch may lead."""
    is_round = solids.own[:, 0, 3] < 0.0
    a_distance = len(solids.own) + int(solids.own[is_round, 0, 1].sum())
    a_point = 1 + (SWEEPS + TRIES + HALVINGS + 3) * (1 + a_distance)
    return max(_ROUNDS // a_point, 1)


def _empty(size: tuple[int, int], format_name: str) -> Any:
    texture = gpu_objects.texture(size, format=format_name)
    texture.clear(format="FLOAT", value=(0.0,) * (1 if format_name == "R32F" else 4))
    return texture
