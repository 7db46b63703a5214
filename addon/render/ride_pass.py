"""Strands that ride on guides, computed on the GPU, where StrandPass draws them without an upload.

Equivalent to motion_flow.strands_and_led, as dispatches on textures in the layout of
strand_layout.strand_rows:

    vertices ------> ride_roots ------> root_motions                    one invocation per strand
    guides_now ----> ride_guides -----> guide_turns                     one per guide
                     ride ------------> cv_points                       one per strand
                     lead_out, hold: change cv_points in place

Uploaded with every frame are the guides, and the head's vertices that hold a root, or a matrix.

    root_holds    RGBA32F: first texel xyz the triangle's vertices, second xy weights of b and c
    rest_frames   RGBA32F: xyz of four texels origin, tangent, bitangent, normal at rest
    rest_points   RGBA32F: xyz position at rest [m, world], w radius [m]
    guide_points  RGBA32F: xyz CVs of the guides at rest [m, world], w whether the segment that
                           begins there may stretch
    guide_strands R32F:    the strand of each guide
    guide_turns   RGBA32F: the rotation of each segment of the guides since rest, a quaternion, and
                           last xyz the guide's displacement from its root [m]
    rest_turns    RGBA32F: the same for guides at rest
    guide_axes    RGBA32F: for each segment of the guides, where curls may stretch: xyz direction as
                           carried by the root, w extension as a fraction
    guide_weights RGBA32F: xyz of three texels the guides, their weights, their segments per metre
    strand_spans  RGBA32F: the points of each strand, see strand_layout.StrandLayout
    cv_points     RGBA32F: xyz position now [m, world], w radius [m]

Whole numbers are stored as floats, exact below 2^24.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import Any, Self

import numpy as np

from ..arrays import Floats, Ints
from ..dynamics.colliders import PosedCollider
from ..groom.holds import Holds
from ..groom.roots import RootHolds
from ..refine.lead_out import NO_LED_OUT, LedOut
from ..refine.ride import Riders
from ..strands import StrandSet
from .collider_textures import SolidKinds, UploadedColliders
from .hold_pass import HoldPass
from .lead_out_pass import LeadOutPass
from .shader_program import ShaderRecipe, program, released_with_shaders
from .snapshot import DevicePoints
from .strand_layout import StrandLayout, strand_rows, strand_rows_size
from .textures import cleared_texture, texture_from, texture_to_array

ROOTS_RECIPE = ShaderRecipe(
    name="ride_roots",
    compute="ride_roots.comp.glsl",
    textures=(("FLOAT_2D", "vertices"), ("FLOAT_2D", "root_holds"), ("FLOAT_2D", "rest_frames")),
    images=(("RGBA32F", "frames"), ("RGBA32F", "root_motions")),
    integers=("strand_count",),
    group_size=(64, 1),
)


def _guides_recipe(*, curls: bool) -> ShaderRecipe:
    return ShaderRecipe(
        name="ride_guides",
        compute="ride_guides.comp.glsl",
        textures=(
            ("FLOAT_2D", "guides_now"),
            ("FLOAT_2D", "guide_strands"),
            ("FLOAT_2D", "root_motions"),
            ("FLOAT_2D", "guide_points"),
        ),
        images=(("RGBA32F", "guide_turns"), *[("RGBA32F", "guide_axes")] * curls),
        integers=("segment_count", "guide_count", "root_motion_count"),
        group_size=(64, 1),
        defines=(("HAS_CURLS", 1),) if curls else (),
    )


@cache
def _ride_recipe(*, curls: bool, solids: SolidKinds | None = None) -> ShaderRecipe:
    """The program that moves strands; with `solids` it also finds those too near to colliders."""
    names = ["root_motions", "guide_weights", "strand_spans"]
    # images, since software drivers compute a level of detail for each fetch from a texture
    images: tuple[tuple[str, ...], ...] = (
        ("RGBA32F", "cv_points"),
        ("RGBA32F", "rest_points", "READ"),
        ("RGBA32F", "guide_turns", "READ"),
        *[("RGBA32F", "guide_axes", "READ")] * curls,
    )
    defines: tuple[tuple[str, int], ...] = (("HAS_CURLS", 1),) if curls else ()
    integers = ["segment_count", "strand_count", "root_motion_count"]
    if solids is not None:
        names += solids.textures
        images += ("RGBA32F", "states", "READ_WRITE"), ("R32F", "clearances", "READ")
        defines += ("HAS_CLEARANCE", 1), *solids.defines
        integers += solids.integers
    return ShaderRecipe(
        name="ride",
        compute="ride.comp.glsl",
        textures=tuple(("FLOAT_2D", name) for name in names),
        images=images,
        integers=tuple(integers),
        numbers=() if solids is None else (("FLOAT", "max_clearance"), ("FLOAT", "return_angle")),
        group_size=(64, 1),
        defines=defines,
    )


GUIDES_RECIPE, CURLED_GUIDES_RECIPE = _guides_recipe(curls=False), _guides_recipe(curls=True)
#: Loop iterations of ride.comp.glsl per point, without those for colliders.
_ITERATIONS_PER_POINT = 8


@dataclass(frozen=True, eq=False)
class RideTexels:
    """The data of all strands in the layout of its textures. It can be made in a thread, so that
    the window does not wait for it.

    rest_points, guide_weights, strand_spans, root_holds: as above; root_holds is None without a
    head.
    """

    layout: StrandLayout
    rest_points: Floats
    guide_weights: Floats
    strand_spans: Floats
    root_holds: Floats | None

    @classmethod
    def of(cls, strands: StrandSet, root_holds: RootHolds | None, riders: Riders) -> Self:
        """Args: as of RidePass."""
        layout, held = StrandLayout(strands.offsets), None
        if root_holds is not None:
            held = np.zeros((strands.strand_count, 2, 4), np.float32)
            held[:, 0, :3] = root_holds.corners
            held[:, 1, :2] = root_holds.barycentric[:, 1:]
            held = strand_rows(held)
        spans = strand_rows(layout.spans[:, None])
        return cls(layout, _rest_texels(layout, strands), _weight_texels(riders), spans, held)


def _rest_texels(layout: StrandLayout, strands: StrandSet) -> Floats:
    return layout.pixels(np.column_stack([strands.points, strands.radius]))


def _weight_texels(riders: Riders) -> Floats:
    weights = riders.weights
    per_meter = riders.segments_per_meter[weights.guide] * riders.reach[:, None]
    return strand_rows(_padded(np.stack([weights.guide, weights.weight, per_meter], axis=1)))


class RidePass:
    """The strands of one groom on the GPU. Creating one does not touch the GPU; `carry` and `ride`
    do.

    Args:
        strands: world space at rest; bound if there is a head.
        root_holds: how a head holds them; None for hair that one matrix carries.
        guides: (guide_count,) indices of the strands that are simulated.
        guide_grid: (guide_count, cv_count, 3) [m], the simulated lines at rest.
        riders: how the strands ride on the guides.
        holds: where strands are held by ties or by a surface; None: nowhere.
        colliders: uploads shared with other passes; None: its own.
        texels: of these strands, if already made.

    lead_out: the pass that leads strands out of colliders.
    """

    def __init__(
        self,
        strands: StrandSet,
        root_holds: RootHolds | None,
        guides: Ints,
        guide_grid: Floats,
        riders: Riders,
        holds: Holds | None = None,
        colliders: UploadedColliders | None = None,
        texels: RideTexels | None = None,
    ) -> None:
        self._strands, self._texels = strands, texels
        self._guides, self._guide_grid = guides, guide_grid
        self._riders = riders
        self._root_holds = root_holds
        self._root_mean = strands.roots.mean(axis=0, dtype=np.float64)
        layout = StrandLayout(strands.offsets) if texels is None else texels.layout
        self.points = DevicePoints(layout)
        self._hold_pass = None if holds is None else HoldPass(holds, self.points.layout)
        self.lead_out = LeadOutPass(self.points.layout, colliders or UploadedColliders())
        self.release()
        released_with_shaders(self)
        released_with_shaders(self.points)  # a snapshot may outlive this pass

    def take_style(self, strands: StrandSet, guide_grid: Floats, riders: Riders) -> None:
        """Use other rest shapes of the same strands and guides from the next frame on."""
        self._strands, self._guide_grid, self._riders = strands, guide_grid, riders
        self._root_mean = strands.roots.mean(axis=0, dtype=np.float64)
        self._texels = None
        if self._textures:
            rest_points = _rest_texels(self.points.layout, strands)
            self._upload_style(rest_points, _weight_texels(riders))

    def carry(
        self, head_positions: Floats | None, matrix: Floats, anchors: Floats | None = None
    ) -> None:
        """Set every strand to its rest shape, carried rigidly by its root, and to its holds.

        Args:
            head_positions: (vertex_count, 3) [m], world space; None for hair without a head.
            matrix: (4, 4) from world space at rest to now; carries hair without a head.
            anchors: of the holds, see `groom.holds.anchors_of`; None: nothing is held.

        Raises:
            ShaderError: a shader does not compile here.
        """
        self._take_pose(head_positions, matrix)
        self._run_ride("rest_turns", anchors)

    def ride(
        self,
        head_positions: Floats | None,
        matrix: Floats,
        guides_now: Any,
        anchors: Floats | None = None,
        colliders: tuple[PosedCollider, ...] = (),
        led: LedOut = NO_LED_OUT,
        elapsed: float = np.inf,
    ) -> None:
        """Set every strand to where its root carries it and its guides move it.

        Args:
            head_positions, matrix, anchors: as in `carry`.
            guides_now: (guide_count, cv_count, 3) [m], world space, or a texture RGBA32F that
                holds them in the layout of strand_layout.strand_rows.
            colliders: out of which strands are led, once `lead_out` has their clearance.
            led: strands that were led out of colliders earlier.
            elapsed: time since the last frame [s], if this one continues it; else infinite.

        Raises:
            HairloomError: a collider that the GPU does not support.
            ShaderError: a shader does not compile here.
            ValueError: guides of another shape.
        """
        self._take_pose(head_positions, matrix)
        if isinstance(guides_now, np.ndarray):
            if guides_now.shape != self._guide_grid.shape:
                wanted = self._guide_grid.shape
                raise ValueError(f"guides have shape {guides_now.shape}, not {wanted}")
            guides_now = texture_from(strand_rows(_padded(guides_now)), "RGBA32F")
        self._run_guides(guides_now)
        self._run_ride("guide_turns", anchors, colliders, led, elapsed)

    def read(self) -> Floats:
        """The current points of the strands, (point_count, 3) float32 [m], world space."""
        assert self.points.texture is not None, "nothing is shown yet"
        pixels = texture_to_array(self.points.texture)
        return np.ascontiguousarray(self.points.layout.values(pixels)[:, :3])

    def read_led(self) -> LedOut:
        """The strands that were led out of colliders, read back."""
        led = self.lead_out.led_strands()
        if not len(led):
            return NO_LED_OUT
        return LedOut.of(led, self.read(), self._strands.offsets)

    def release(self) -> None:
        """Release everything on the GPU; the next frame uploads it again."""
        self._textures: dict[str, Any] = {}
        self.points.release()
        self.lead_out.release()
        if self._hold_pass is not None:
            self._hold_pass.release()

    @property
    def _segment_count(self) -> int:
        """Segments of each guide."""
        return int(self._guide_grid.shape[1]) - 1

    @property
    def _root_motion_count(self) -> int:
        """Number of root motions: one for each strand, or one for all."""
        return 1 if self._root_holds is None else self._strands.strand_count

    def _take_pose(self, head_positions: Floats | None, matrix: Floats) -> None:
        """Compute root_motions, and the middle of all roots."""
        if not self._textures:
            self._upload()
        if self._root_holds is None or head_positions is None:
            self._textures["root_motions"] = texture_from(matrix_motion(matrix), "RGBA32F")
            middle = matrix[:3, :3] @ self._root_mean + matrix[:3, 3]
            self.points.center = middle.astype(np.float32)
            return
        self.points.center = self._root_holds.center(head_positions)
        self._run_roots(head_positions)

    def _upload(self) -> None:
        """Upload constant data, and make the textures that the shaders write."""
        strands, textures = self._strands, self._textures
        count, texels = strands.strand_count, self._texels
        if texels is None:
            texels = RideTexels.of(strands, self._root_holds, self._riders)
        self._texels = None  # they lie on the GPU from now on
        self._upload_style(texels.rest_points, texels.guide_weights)
        textures["strand_spans"] = texture_from(texels.strand_spans, "RGBA32F")
        guide_strands = self._guides[:, None, None].astype(np.float32)
        textures["guide_strands"] = texture_from(strand_rows(guide_strands), "R32F")
        textures["guide_turns"] = _cleared_rows(*self._guide_grid.shape[:2])
        at_rest = np.zeros((*self._guide_grid.shape[:2], 4))
        at_rest[:, :-1, 3] = 1.0
        textures["rest_turns"] = texture_from(strand_rows(at_rest), "RGBA32F")
        self.points.texture = cleared_texture(self.points.layout.size)
        if self._root_holds is not None and texels.root_holds is not None:
            textures["root_holds"] = texture_from(texels.root_holds, "RGBA32F")
            textures["root_motions"] = _cleared_rows(count, 4)
            textures["frames"] = _cleared_rows(count, 4)
            textures["rest_frames"] = _cleared_rows(count, 4)
            self._run_roots(self._root_holds.rest_positions)
            rest_frames = textures.pop("frames")
            textures |= {"frames": textures["rest_frames"], "rest_frames": rest_frames}

    def _upload_style(self, rest_points: Floats, guide_weights: Floats) -> None:
        """Upload what depends on the shapes at rest.

        Args:
            rest_points, guide_weights: texels of all strands.
        """
        textures = self._textures
        textures["rest_points"] = texture_from(rest_points, "RGBA32F")
        points = _padded(self._guide_grid)
        if self._riders.can_extend is not None:
            points[:, :-1, 3] = self._riders.can_extend
            textures["guide_axes"] = _cleared_rows(*self._guide_grid.shape[:2])
        textures["guide_points"] = texture_from(strand_rows(points), "RGBA32F")
        textures["guide_weights"] = texture_from(guide_weights, "RGBA32F")

    def _run_roots(self, head_positions: Floats) -> None:
        assert self._root_holds is not None
        taken = head_positions[self._root_holds.vertices][:, None]
        vertices = texture_from(strand_rows(_padded(taken)), "RGBA32F")
        textures, count = self._textures, self._strands.strand_count
        shader = program(ROOTS_RECIPE)
        shader.bind(
            textures={"vertices": vertices, **_named(textures, "root_holds", "rest_frames")},
            images=_named(textures, "frames", "root_motions"),
            integers={"strand_count": count},
        )
        shader.dispatch(count)

    def _run_guides(self, guides_now: Any) -> None:
        textures, count = self._textures, len(self._guides)
        recipe = GUIDES_RECIPE if self._riders.can_extend is None else CURLED_GUIDES_RECIPE
        shader = program(recipe)
        shader.bind(
            textures={
                "guides_now": guides_now,
                **_named(textures, "guide_strands", "root_motions", "guide_points"),
            },
            images={name: textures[name] for _, name, *_ in recipe.images},
            integers={
                "segment_count": self._segment_count,
                "guide_count": count,
                "root_motion_count": self._root_motion_count,
            },
        )
        shader.dispatch(count)

    def _run_ride(
        self,
        turns: str,
        anchors: Floats | None,
        colliders: tuple[PosedCollider, ...] = (),
        led: LedOut = NO_LED_OUT,
        elapsed: float = np.inf,
    ) -> None:
        textures, count = self._textures, self._strands.strand_count
        is_curled = self._riders.can_extend is not None and turns == "guide_turns"
        inputs = self.lead_out.begin_frame(colliders, _ITERATIONS_PER_POINT, elapsed)
        ride_textures = _named(textures, "root_motions", "guide_weights", "strand_spans")
        images = {"cv_points": self.points.texture, **_named(textures, "rest_points")}
        images |= {"guide_turns": textures[turns]}
        images |= _named(textures, "guide_axes") if is_curled else {}
        solids = None
        integers = {
            "segment_count": self._segment_count,
            "strand_count": count,
            "root_motion_count": self._root_motion_count,
        }
        numbers = {}
        if inputs is not None and inputs.finds_near_while_riding:
            solids = inputs.kinds
            ride_textures |= inputs.textures
            images |= {"states": inputs.states, "clearances": ride_textures.pop("clearances")}
            integers = integers | inputs.integers
            numbers = {
                "max_clearance": inputs.max_clearance,
                "return_angle": inputs.return_angle,
            }
        shader = program(_ride_recipe(curls=is_curled, solids=solids))
        shader.bind(textures=ride_textures, images=images, integers=integers, numbers=numbers)
        shader.dispatch(count)
        if inputs is not None:
            carry_textures = _named(textures, "rest_points", "root_motions")
            self.lead_out.lead(self.points.texture, inputs, carry_textures, self._root_motion_count)
        if self._hold_pass is not None:
            self._hold_pass.hold(self.points.texture, textures["rest_points"], anchors)
        self.lead_out.put(self.points.texture, led)
        self.points.serial += 1


def _padded(values: Floats) -> Floats:
    """Three channels (n, m, 3) padded to four with 0, float32: no texture has three channels."""
    padded = np.zeros((*values.shape[:2], 4), np.float32)
    padded[..., :3] = values
    return padded


def _cleared_rows(strand_count: int, column_count: int) -> Any:
    """An RGBA32F texture in the layout of strand_rows, cleared to 0."""
    return cleared_texture(strand_rows_size(strand_count, column_count))


def _named(textures: dict[str, Any], *names: str) -> dict[str, Any]:
    return {name: textures[name] for name in names}


def matrix_motion(matrix: Floats) -> Floats:
    """An affine (4, 4) motion of the world as the one root motion of all strands, (1, 4, 4).

    In the layout of ride_roots.comp.glsl: three texels with a column of the turn in xyz and a
    coordinate of the shift in w, then xyz the rest origin.
    """
    motion = np.zeros((1, 4, 4))
    motion[0, :3, :3] = (matrix[:3, :3] - np.eye(3)).T
    motion[0, :3, 3] = matrix[:3, 3]
    return motion
