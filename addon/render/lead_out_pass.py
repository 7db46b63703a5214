"""Strands that ride, led out of colliders on the GPU: `refine.lead_out` behind RidePass, over
textures in the layouts of `strand_layout`.

    strand_spans  RGBA32F: where the points of each strand lie, see strand_layout.StrandLayout
    solids, rounds, fields: the colliders, see collider_textures.py
    rest_points, root_motions: where roots carry points, see ride_pass.py
    clearances    RG32F: how far from colliders each point stays where its root carries it, and how
                  far it goes from there at most [m]
    wanted        R32F: how far it stays where it is [m]
    states        RGBA32F: of each strand x whether it is led out, see lead_out.comp.glsl
    led_points    RGBA32F: xyz where points are led to [m, world]
    led_texels    RG32F: the texels of points that were led earlier
    cv_points     RGBA32F: xyz position now [m, world], changed in place
"""

from __future__ import annotations

from dataclasses import dataclass
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
#: what infinity is on the GPU [m]
_ENDLESS = np.float32(1.0e30)
#: Software drivers end a shader after about this many rounds of all its loops.
_ROUNDS = 60_000
#: step -> its images
_STEPS = {
    "LEASH": (("cv_points", "READ_WRITE"), ("states", "WRITE")),
    "NEAR": (("cv_points", "READ"), ("states", "READ_WRITE"), ("wanted", "WRITE")),
    "LED": (("cv_points", "READ"), ("states", "READ_WRITE"), ("led_points", "READ_WRITE")),
    "PUT": (("cv_points", "READ_WRITE"),),
}
_TEXTURES = {
    "LEASH": ("clearances",),
    "NEAR": ("clearances", "solids"),
    "LED": ("clearances", "solids", "wanted"),
    "PUT": ("states", "led_points"),
}
_INTEGERS = {
    "LEASH": (),
    "NEAR": ("solid_count",),
    "LED": ("solid_count", "attempt"),
    "PUT": (),
}
#: steps that ask colliders
_ASKING = ("NEAR", "LED")
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
        step: "LEASH", "NEAR", "LED" or "PUT", see lead_out.comp.glsl.
    """
    flags = {f"IS_{step}": True, "HAS_ROUNDS": rounds, "HAS_FIELDS": fields}
    names = ["strand_spans", "rest_points", "root_motions", *_TEXTURES[step]]
    names += [name for name, is_there in (("rounds", rounds), ("fields", fields)) if is_there]
    formats = {"wanted": "R32F"}
    return ShaderRecipe(
        name=f"lead_out_{step.lower()}",
        compute="lead_out.comp.glsl",
        textures=tuple(("FLOAT_2D", name) for name in names),
        images=tuple((formats.get(name, "RGBA32F"), name, access) for name, access in _STEPS[step]),
        integers=("strand_count", "mover_count", "first_point", "point_end", *_INTEGERS[step]),
        numbers=() if step == "LEASH" else (("FLOAT", "kept"),),
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
        self._clearance: Clearance | None = None
        self.release()

    def take(self, clearance: Clearance | None) -> None:
        """Go on with the clearance of a motion; None: it has none yet."""
        if clearance is not self._clearance:
            self.release()
            self._clearance = clearance

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
            HairloomError: a collider that the GPU cannot have.
            ShaderError: the shader does not compile here.
        """
        if self._clearance is None or not posed or not self._layout.strand_count:
            self._textures.pop("states", None)
            return
        self._upload(self._clearance)
        colliders = self._colliders.of(posed)
        frame = _Frame(cv_points, colliders, colliders.solids(posed), carrying)
        integers = {"mover_count": mover_count, "solid_count": len(posed)}
        self._run("LEASH", frame, integers)
        self._run("NEAR", frame, integers)
        for attempt in range(ATTEMPTS):
            self._run("LED", frame, {**integers, "attempt": attempt})
        self._run("PUT", frame, integers)

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

    def release(self) -> None:
        """Let go of all that lies on the GPU; the next frame uploads it again."""
        self._textures: dict[str, Any] = {}

    def _upload(self, clearance: Clearance) -> None:
        """What is constant, and the textures that the shaders write."""
        layout, textures = self._layout, self._textures
        if "clearances" not in textures:
            values = np.stack([clearance.points, clearance.leashes], axis=1)
            values = np.clip(values, -_ENDLESS, _ENDLESS)
            textures["clearances"] = texture_from(layout.pixels(values), "RG32F")
            spans = layout.spans[:, None].copy()
            spans[:, 0, 3] = 0  # the last point that has a leash
            owner = np.searchsorted(layout.offsets, clearance.leashed, side="right") - 1
            spans[owner, 0, 3] = clearance.leashed - layout.offsets[owner]
            textures["strand_spans"] = texture_from(strand_rows(spans), "RGBA32F")
            textures["led_points"] = _empty(layout.size, "RGBA32F")
            textures["wanted"] = _empty(layout.size, "R32F")
        if "states" not in textures:
            size = strand_rows_size(layout.strand_count, 1)
            textures["states"] = _empty(size, "RGBA32F")

    def _run(self, step: str, frame: _Frame, integers: dict[str, int]) -> None:
        """One step over all points of all strands, as many at once as drivers bear."""
        solids, kinds, at_once = frame.colliders, {}, _ROUNDS
        if step in _ASKING:
            kinds = {"rounds": solids.rounds is not None, "fields": solids.fields is not None}
            at_once = _points_at_once(solids)
        recipe = lead_out_recipe(step, **kinds)
        taken = {"solids": frame.solids, "rounds": solids.rounds, "fields": solids.fields}
        taken |= self._textures | frame.carrying | {"cv_points": frame.cv_points}
        shader, count = program(recipe), self._layout.strand_count
        assert self._clearance is not None
        for first in range(0, int(self._layout.counts.max()), at_once):
            known = integers | {
                "strand_count": count,
                "first_point": first,
                "point_end": first + at_once,
            }
            shader.bind(
                textures={name: taken[name] for _, name in recipe.textures},
                images={name: taken[name] for _, name, *_ in recipe.images},
                integers={name: known[name] for name in recipe.integers},
                numbers={name: self._clearance.kept for _, name in recipe.numbers},
            )
            gpu.compute.dispatch(shader.shader, -(-count // _GROUP[0]), 1, 1)
            gpu.shader.unbind()


@dataclass(frozen=True)
class _Frame:
    """Textures and colliders of one frame, see the module."""

    cv_points: Any
    colliders: ColliderTextures
    solids: Any
    carrying: dict[str, Any]


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
