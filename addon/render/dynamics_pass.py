"""Dynamics on the GPU: `dynamics.step.advance` as a compute shader, one invocation per guide.

The guides stay on the GPU from frame to frame, in textures in the layout of
strand_layout.strand_rows:

    positions      RGBA32F: xyz world [m], w the z of a substep earlier
    previous_positions   RG32F, on Metal RGBA32F: x and y of a substep earlier; with software
                   drivers each number that is written costs time
    pushes         RGBA32F: xyz [m] displacement by other hair in a substep, see state.DynamicsState
    bridged        RGBA32F: xyz world [m], at the exact end of the frame (step.grid_at_frame_end)
    styles_earlier, styles_before, styles_now   RGBA32F: xyz world [m], see frame.Drive
    rest_shapes    RGBA32F: for CV i xyz curvature [m] and w turning fraction (style.LocalShape);
                   for CV 0 x its twist CV
    rest_lengths   R32F: [m] to the next CV
    curl_slacks    R32F: of the segment to the next CV, see Rest.curl_slack; only where curls
                   stretch
    held_cvs       R32F: 1 where a CV is held (held.HeldCvs), else 0
    force_fields   RGBA32F: see force_fields.ForceFields.table; only where any act
    clearances     RGBA32F: for each CV, see clearance.GuideClearance; only with colliders
    held_displacements   RGBA32F: xyz [m], see step.remaining_displacement; this and held_cvs only
                   where CVs are held
    painted_bands  RGBA32F: for each CV near and far factor, inverse pivot, global stiffness
                   (style.StyleSystem)
    painted_numbers   RGBA32F: for a guide's first CV x fraction of the speed that damping leaves, y
                   fraction of the air's speed, z and w factors on the style's motion and gravity;
                   for all others x local stiffness; this and painted_bands only where something is
                   painted
    transforms     RGBA32F: four texels for each rigid motion, see
                   rigid_path.RigidTransform.texels. Row n: the motion of all roots to the end of
                   substep n; the motion that hair inherits in it. In the last row: the same to the
                   begin of the first substep, with s of that moment in w of the origin; the same in
                   the substep before, with s (s - 1) in w as in the table of substeps; back from
                   the frame's end, with w the fraction of its motion that a style on an arc gives;
                   back from one frame earlier; to the middle of the frame, with w as s (s - 1)
    fractions      R32F: for a guide's first CV the simulated fraction, see blend.blended; only
                   where some guides are not fully simulated

Limitations: a CV keeps the two most pressing contacts, where numpy keeps one for each collider. All
balls of a set are tested, in numpy only near ones. GPU and CPU round differently, and in limp hair
such differences grow until results drift apart. Beyond 34 CVs Mesa's software driver is seven times
slower for each CV, since it does not unroll loops of that length.
"""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache, partial
from typing import Any

import numpy as np

from ..arrays import Floats
from ..dynamics.clearance import GuideClearance, max_clearance
from ..dynamics.constraints import PINNED_COUNT
from ..dynamics.contacts import CONTACT_MARGIN
from ..dynamics.frame import Drive, Frame, check_drive, root_places_after
from ..dynamics.held import HeldCvs
from ..dynamics.neighbours import FrameSteps, run_alone
from ..dynamics.painted import PaintedFrame
from ..dynamics.schedule import due_substeps
from ..dynamics.settings import DynamicsSettings
from ..dynamics.state import DynamicsState, Rest, as_rows
from ..dynamics.step import remaining_displacement, remaining_rotation
from .capabilities import pair_format
from .collider_textures import UNLIMITED_PATH, UploadedColliders
from .dynamics_block import (
    bands_of,
    block_of,
    painted_texels,
    spans_of,
    substep_table_of,
    transforms_of,
)
from .hair_grid_pass import HairGridPass
from .shader_program import ShaderRecipe, program, released_with_shaders
from .strand_layout import from_strand_rows, strand_rows
from .textures import UniformBlock, texture_from, texture_to_array

#: Most substeps per dispatch: operating systems reset a GPU that does not respond for seconds.
SUBSTEPS_AT_ONCE = 64
#: Most contacts of a CV at once.
CONTACT_SLOTS = 2
GROUP_SIZE = 32
#: Names in the bridge's shader of the rows of the rotation about roots.
TURN_ROWS = ("turn_x", "turn_y", "turn_z")


@lru_cache(maxsize=4)
def bridge_recipe(*, held: bool, blended: bool, turned: bool = False) -> ShaderRecipe:
    """The program that moves guides from the last substep to the exact end of the frame."""
    names = ["positions", "styles_now", *["held_displacements"] * held, *["fractions"] * blended]
    return ShaderRecipe(
        name="dynamics_bridge",
        compute="dynamics_bridge.comp.glsl",
        textures=tuple(("FLOAT_2D", name) for name in names),
        images=(("RGBA32F", "bridged"),),
        integers=("cv_count", "guide_count"),
        numbers=tuple(("VEC3", name) for name in TURN_ROWS) if turned else (),
        group_size=(16, 4),
        defines=(
            *[("HAS_HELD", 1)] * held,
            *[("IS_TURNED", 1)] * turned,
            *[("IS_BLENDED", 1)] * blended,
        ),
    )


@lru_cache(maxsize=32)
def dynamics_recipe(
    cv_count: int,
    *,
    relaxation: bool = False,
    held: bool = False,
    springs: bool = False,
    pushed: bool = False,
    air: bool = False,
    force_fields: bool = False,
    collider_count: int = 0,
    rounds: bool = False,
    fields: bool = False,
    traced: bool = False,
    sharp: bool = False,
    clearance: bool = False,
    painted: bool = False,
    inherits_motion: bool = False,
    pairs: str = "RG32F",
) -> ShaderRecipe:
    """The program for guides with this many CVs, with only the parts that the scene needs.

    Args:
        pairs: see capabilities.pair_format.
    """
    flags = {
        "RELAXATION": relaxation,
        "HAS_HELD": held,
        "HAS_SPRINGS": springs,
        "HAS_PUSHES": pushed,
        "HAS_AIR": air,
        "HAS_FORCE_FIELDS": force_fields and cv_count > PINNED_COUNT,
        "HAS_ROUNDS": rounds,
        "HAS_FIELDS": fields,
        "HAS_TRACING": traced and cv_count > PINNED_COUNT,
        "HAS_SHARP": sharp and cv_count > PINNED_COUNT,
        "HAS_CLEARANCE": clearance,
        "IS_PAINTED": painted,
        "INHERITS_MOTION": inherits_motion,
    }
    textures = ["styles_earlier", "styles_before", "styles_now", "rest_shapes", "rest_lengths"]
    textures += ["substep_table", "transforms"] + ["held_cvs"] * held + ["curl_slacks"] * springs
    textures += ["pushes"] * pushed + ["force_fields"] * (force_fields and cv_count > PINNED_COUNT)
    textures += ["painted_bands", "painted_numbers"] * painted
    textures += ["rounds"] * rounds + ["fields"] * fields + ["clearances"] * clearance
    return ShaderRecipe(
        name="dynamics",
        compute="dynamics.comp.glsl",
        structs=("struct_dynamics.glsl",),
        blocks=(("Dynamics", "frame"),),
        textures=tuple(("FLOAT_2D", name) for name in textures),
        images=(
            ("RGBA32F", "positions", "READ_WRITE"),
            (pairs, "previous_positions", "READ_WRITE"),
        ),
        group_size=(GROUP_SIZE,),
        defines=(
            ("CV_COUNT", cv_count),
            ("CONTACT_SLOTS", min(collider_count, CONTACT_SLOTS) if cv_count > PINNED_COUNT else 0),
            *((name, 1) for name, is_set in flags.items() if is_set),
        ),
    )


class DynamicsPass:
    """Simulated guides on the GPU. Creating one does not touch the GPU; the first frame does.

    Args:
        state: from which the motion starts or continues.
        colliders: uploads shared with other passes; None: its own.
    """

    def __init__(self, state: DynamicsState, colliders: UploadedColliders | None = None) -> None:
        self._state = state  # positions as last given or read back; the current clock
        self._colliders = colliders or UploadedColliders()
        self.release()
        released_with_shaders(self)

    @property
    def guides(self) -> Any:
        """Texture RGBA32F in the layout of strand_layout.strand_rows: xyz the CVs [m, world] at the
        end of the last frame, w undefined; None before the first frame."""
        return self._textures.get("bridged" if self._is_bridged else "positions")

    def advance(self, drive: Drive, settings: DynamicsSettings, duration: float) -> None:
        """Move the guides by a frame of `duration` seconds, as step.advance does.

        Raises:
            HairloomError: as step.advance; or a collider that the GPU does not support.
            ShaderError: the shader does not compile here.
        """
        run_alone(self.steps(drive, settings, duration))

    def steps(self, drive: Drive, settings: DynamicsSettings, duration: float) -> FrameSteps[None]:
        """As `advance`, in steps between which other grooms' hair is exchanged."""
        state, dt, longest = self._state, 1.0 / settings.substep_rate, settings.max_frame_time
        duration, count, left = due_substeps(state.time_left, duration, longest, dt)
        check_drive(state, drive, tuple(style for style, _ in self._styles))
        carried = state.root_places
        if state.guide_count:
            self._upload(drive)
            frame = Frame.of(state, drive, settings, duration, dt) if count else None
            carried = root_places_after(state, frame, drive, settings, count)
            if frame is not None:
                yield from self._steps(frame, count, dt / state.substep if state.substep else 1.0)
            self._is_bridged = left > 0.0 or not count or drive.simulated is not None
            if self._is_bridged:
                left_over = replace(state, time_left=left, root_places=carried)
                turn = remaining_rotation(left_over, settings)
                self._bridge(remaining_displacement(left, drive, duration), drive.simulated, turn)
        self._state = replace(
            state,
            root_places=carried,
            substep=dt if count else state.substep,
            time_left=left,
            time=state.time + count * dt,
        )

    def take_rest(self, rest: Rest) -> None:
        """Use other rest shapes and lengths from the next frame on."""
        self._state = replace(self._state, rest=rest)
        if "positions" in self._textures:
            self._upload_rest(rest)

    def read(self) -> DynamicsState:
        """The current state, read back; step.advance or another pass can continue from it."""
        if "positions" in self._textures:
            position, previous = self._read_moving(1.0)
            push = as_rows(self._grid("pushes")[..., :3]) if self._is_pushed else None
            self._state = replace(self._state, position=position, previous=previous, push=push)
        return self._state

    def _read_moving(self, speed_ratio: float) -> tuple[Floats, Floats]:
        """Positions of the CVs now and a substep earlier, in the shape of the state's.

        Args:
            speed_ratio: length of the coming substep over that of the one before it.
        """
        here, beside = (self._grid(name) for name in ("positions", "previous_positions"))
        position = as_rows(here[..., :3])
        previous = as_rows(np.concatenate([beside[..., :2], here[..., 3:]], axis=-1))
        if speed_ratio != 1.0:
            previous = position - (position - previous) * np.float32(speed_ratio)
        return position, previous

    def release(self) -> None:
        """Release everything on the GPU; the next frame continues from the last state read."""
        self._textures: dict[str, Any] = {}
        self._is_bridged = self._is_pushed = False
        self._block, self._hair_grid = UniformBlock(), HairGridPass()
        self._colliders.release()
        self._styles: list[tuple[Floats, Any]] = []  # of the last frame, with their textures
        self._held: HeldCvs | None = None
        self._clearance: GuideClearance | None = None
        self._painted: PaintedFrame | None = None

    def _upload(self, drive: Drive) -> None:
        state, textures = self._state, self._textures
        if "positions" not in textures:
            here, previous = (rows.transpose(2, 1, 0) for rows in (state.position, state.previous))
            textures["positions"] = points_texture(here, previous[..., 2])
            textures["previous_positions"] = _pairs_texture(previous[..., :2])
            textures["bridged"] = points_texture(here)
            push = np.zeros_like(here) if state.push is None else state.push.transpose(2, 1, 0)
            textures["pushes"] = points_texture(push)
            self._is_pushed = state.push is not None
            self._upload_rest(state.rest)
        self._styles = [(style, self._style_texture(style)) for style in drive.targets]
        now, before, *earlier = (texture for _, texture in self._styles)
        textures |= {"styles_now": now, "styles_before": before}
        textures["styles_earlier"] = earlier[0] if earlier else before  # then has no effect
        self._colliders.textures_of(drive.colliders)
        if drive.held is not None and drive.held is not self._held:
            held = drive.held.rows.T[..., None]
            textures["held_cvs"] = texture_from(strand_rows(held), "R32F")
        self._held = drive.held
        if drive.clearance is not None and drive.clearance is not self._clearance:
            distances = strand_rows(drive.clearance.distances)
            textures["clearances"] = texture_from(distances, "RGBA32F")
        self._clearance = drive.clearance

    def _upload_rest(self, rest: Rest) -> None:
        textures = self._textures
        textures["rest_shapes"] = texture_from(strand_rows(rest_shapes(rest)), "RGBA32F")
        lengths = segments_at_cvs(rest.length)
        textures["rest_lengths"] = texture_from(strand_rows(lengths), "R32F")
        if rest.curl_slack is not None:
            textures["curl_slacks"] = texture_from(
                strand_rows(segments_at_cvs(rest.curl_slack)), "R32F"
            )

    def _upload_painted(self, frame: Frame) -> None:
        painted, (cv_count, guide_count) = frame.painted, self._state.position.shape[1:]
        if painted is not None:
            bands = bands_of(painted.style_system, cv_count, guide_count)
            self._textures["painted_bands"] = texture_from(strand_rows(bands), "RGBA32F")
            numbers = strand_rows(painted_texels(frame, painted, cv_count))
            self._textures["painted_numbers"] = texture_from(numbers, "RGBA32F")
        self._painted = painted

    def _style_texture(self, style: Floats) -> Any:
        known = (texture for other, texture in self._styles if other is style)
        return next(known, None) or points_texture(style)

    def _steps(self, frame: Frame, count: int, speed_ratio: float) -> FrameSteps[None]:
        """All substeps of a frame; the first is `speed_ratio` times as long as the one before."""
        self._is_pushed &= frame.interaction is not None
        if frame.painted is not self._painted:
            self._upload_painted(frame)
        for numbers in frame.substep_ranges(count):
            first, end = numbers[0], numbers[-1] + 1
            if frame.interaction is not None and (
                frame.interaction.is_due(first) or not self._is_pushed
            ):
                ratio = 1.0 if first else speed_ratio
                read = partial(self._read_moving, ratio)
                interaction = frame.interaction.with_neighbours(
                    (yield frame.stop_before(self._state.rest, first, read))
                )
                self._hair_grid.update_pushes(interaction, self._textures, ratio, pair_format())
                self._is_pushed = True
            for begin in range(first, end, SUBSTEPS_AT_ONCE):
                part = min(end - begin, SUBSTEPS_AT_ONCE)
                self._dispatch(frame, begin, part, 1.0 if begin else speed_ratio)

    def _dispatch(self, frame: Frame, first: int, count: int, speed_ratio: float) -> None:
        settings, state, posed = frame.settings, self._state, frame.drive.colliders
        colliders = self._colliders.textures_of(posed)
        spans, is_traced, is_sharp = spans_of(frame, first, count), False, False
        table = substep_table_of(frame, first, spans)
        if posed:
            reach = CONTACT_MARGIN * frame.size + max_clearance(settings, frame.size)
            poses = colliders.pose_texels(posed, spans, reach, frame.size, state.cv_count)
            limit, sharp = poses.reshape(len(spans), len(posed), -1, 4)[:, :, 12, :2].T
            is_traced, is_sharp = bool((limit < UNLIMITED_PATH).any()), bool(sharp.any())
            table = np.concatenate([table, poses], axis=1)
        textures = {**self._textures, "substep_table": texture_from(table, "RGBA32F")}
        textures |= {"rounds": colliders.rounds, "fields": colliders.fields}
        if frame.force_fields is not None:
            textures["force_fields"] = texture_from(frame.force_fields.table, "RGBA32F")
        textures["transforms"] = texture_from(transforms_of(frame, first, count), "RGBA32F")
        recipe = dynamics_recipe(
            state.cv_count,
            relaxation=settings.length_solver == "relaxation",
            held=frame.drive.held is not None,
            springs=state.rest.curl_slack is not None and settings.curl_stretch > 0.0,
            pushed=frame.interaction is not None,
            air=frame.air is not None,
            force_fields=frame.force_fields is not None,
            collider_count=len(posed),
            rounds=colliders.rounds is not None,
            fields=colliders.fields is not None,
            traced=is_traced,
            sharp=is_sharp,
            clearance=bool(posed) and frame.drive.clearance is not None,
            painted=frame.painted is not None,
            inherits_motion=frame.inherits_motion,
            pairs=pair_format(),
        )
        block = block_of(frame, state.guide_count, state.cv_count, count, speed_ratio)
        shader = program(recipe)
        shader.bind(
            blocks={"frame": self._block.holding(block)},
            textures={name: textures[name] for _, name in recipe.textures},
            images={name: textures[name] for _, name, *_ in recipe.images},
        )
        shader.dispatch(state.guide_count)

    def _bridge(
        self, held_displacements: Floats | None, simulated: Floats | None, turn: Floats | None
    ) -> None:
        """Fill `bridged`."""
        state, textures = self._state, dict(self._textures)
        recipe = bridge_recipe(
            held=held_displacements is not None,
            blended=simulated is not None,
            turned=turn is not None,
        )
        rows = {} if turn is None else dict(zip(TURN_ROWS, turn.tolist(), strict=True))
        if held_displacements is not None:
            textures["held_displacements"] = points_texture(held_displacements)
        if simulated is not None:
            fractions = np.zeros((state.guide_count, state.cv_count, 1), np.float32)
            fractions[:, 0, 0] = simulated
            textures["fractions"] = texture_from(strand_rows(fractions), "R32F")
        shader = program(recipe)
        shader.bind(
            textures={name: textures[name] for _, name in recipe.textures},
            images={"bridged": self._textures["bridged"]},
            integers={"cv_count": state.cv_count, "guide_count": state.guide_count},
            numbers=rows,
        )
        shader.dispatch(state.cv_count, state.guide_count)

    def _grid(self, name: str) -> Floats:
        """A texture as (guide_count, cv_count, channels)."""
        pixels = texture_to_array(self._textures[name])
        return from_strand_rows(pixels, self._state.guide_count, self._state.cv_count)


def points_texture(grid: Floats, lane: Floats | float = 0.0) -> Any:
    """Points (guide_count, cv_count, 3) as a texture in the layout of strand_rows.

    Args:
        lane: (guide_count, cv_count) values for w.
    """
    points = np.empty((*grid.shape[:2], 4), np.float32)
    for axis in range(3):  # one by one is three times faster than all three
        points[..., axis] = grid[..., axis]
    points[..., 3] = lane
    return texture_from(strand_rows(points), "RGBA32F")


def _pairs_texture(pairs: Floats) -> Any:
    """Pairs (guide_count, cv_count, 2) as a texture in the layout of strand_rows."""
    kept = pair_format()
    unused = {"RG32F": 0, "RGBA32F": 2}[kept]
    return texture_from(strand_rows(np.pad(pairs, ((0, 0), (0, 0), (0, unused)))), kept)


def rest_shapes(rest: Rest) -> Floats:
    """`rest_shapes`, (guide_count, cv_count, 4)."""
    shapes = np.zeros((*rest.position.shape[:0:-1], 4), np.float32)
    shapes[:, 1:-1, :3] = rest.shape.curvature.transpose(2, 1, 0)
    shapes[:, 1:-1, 3] = rest.shape.turning_fraction.T
    shapes[:, 0, 0] = rest.shape.twist_cv
    return shapes


def segments_at_cvs(values: Floats) -> Floats:
    """Values of segments (cv_count - 1, guide_count), each stored at its first CV,
    (guide_count, cv_count, 1)."""
    at_cvs = np.zeros((values.shape[1], values.shape[0] + 1, 1), np.float32)
    at_cvs[:, :-1, 0] = values.T
    return at_cvs
