"""Draws strands as ribbons that face the eye, shaded per pixel, into the bound framebuffer.

Textures with a texel per point, in the layout of strand_layout.StrandLayout:
    cv_points RGBA32F: xyz position [m, world], w radius [m]     uploaded with every new pose,
                                                                 unless it is on the GPU already
    cv_attributes  RG32F:   x ambient occlusion, y fraction of the    constant
                       strand's length, where UNEVEN
    cv_colors RGBA16F: xyz own colour, w 0 where there is none   constant; only of coloured hair
    rest_lengths R32F: length at rest of the segment that begins at the point [m]
And with a texel per strand, in the layout of strand_layout.strand_rows:
    strand_spans  RGBA32F: its points, see lib_strand_texel.glsl
    strand_seeds  R32F:    the seed of its noise
    debug_numbers R32F:    the guide or the group for a debug view
And solids, rounds, fields: colliders, see collider_textures.py

The number of pieces of each segment comes from detail_pass.py, unless all have the same number.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterator, Sequence, Set
from dataclasses import dataclass, field
from functools import partial
from typing import Any

import numpy as np

from ..arrays import Floats
from ..params.glsl import struct_values
from ..shading.drawn_strands import drawn_color, natural_strands, own_colors
from ..shading.lights import Light, packed_lights
from ..shading.settings import StrandSettings
from ..shading.strand_noise import SEED_LIMIT
from ..shading.volume.light_frame import Ball
from .cached_picture import CachedPicture
from .camera import Camera
from .capabilities import NOISE_FREE_SAMPLES, capabilities
from .collider_textures import UploadedColliders
from .detail_pass import DetailOrder, DetailPass
from .display import Display
from .feature_programs import UniformBlocks
from .hair_ball import HairBall
from .hashed_strands import HASHED_STRANDS
from .inter_groom_shadow import NO_GROOM, InterGroomShadow
from .marschner_textures import marschner_feature, scattering_feature
from .opacity_maps import OpacityMaps
from .opacity_pass import OpacityPass
from .pixel_parts import expected_depths
from .ribbons import Ribbons
from .shader_feature import ShaderFeature
from .shader_program import released_with_shaders
from .shader_source import DEBUG_VIEWS, FULL_COLOR_DEPTH, ShaderError, output_index
from .snapshot import Snapshot
from .strand_curves import curves_feature, spans_texture
from .strand_drawing import StrandDrawing
from .strand_layers import LAYERS_OF_PIXELS, LayerStatistics
from .strand_layout import StrandLayout, strand_rows
from .textures import drawing_state, texture_from
from .view_block import lights_feature, view_feature

#: little below the largest half float
_MAX_HALF_FLOAT = 6.0e4
#: smallest depth shown in full colour, for hair without size [m]
_MIN_RADIUS = 1.0e-9
#: what a draw writes: radiance; unit tangents from root to tip, in world space; or, for opaque
#: strands only, the number of the nearest strand and the place along its points
CONTENTS = ("light", "tangents", "places")
#: debug views that show a number for each strand
NUMBERED_VIEWS = ("guide", "group")


@dataclass(frozen=True, eq=False)
class ViewState:
    """The state of a view that is drawn repeatedly.

    name: identifies the view; data that depends on a view is kept by name.
    is_turning: the lights are attached to the view, which moves, see OpacityDrawing.maps.
    is_moving: the content changes from draw to draw. Results for which the GPU would have to be
        waited for are taken from earlier draws, see StrandPass.needs_redraw.
    picture: also gets what is drawn, so that it can be shown again.
    is_sample: only the picture gets colours, scene-linear, as one of many samples to be summed; the
        bound framebuffer gets depths.
    """

    name: Hashable = None
    is_turning: bool = False
    is_moving: bool = False
    picture: CachedPicture | None = None
    is_sample: bool = False


#: For draws into a single picture.
UNNAMED_VIEW = ViewState()


@dataclass(frozen=True)
class Statistics:
    """Numbers of a draw: strands, their straight pieces, and the vertices of all instances.

    layers: results of drawing as layers. maps_note: note of OpacityMaps.
    """

    strands: int = 0
    pieces: int = 0
    vertices: int = 0
    layers: LayerStatistics = field(default_factory=LayerStatistics)
    maps_note: str = ""

    @property
    def notes(self) -> tuple[str, ...]:
        """Notes to the artist on the draw, each with its remedy."""
        found = [self.maps_note] if self.maps_note else []
        if self.layers.missing:
            found.append(
                f"Strands: {self.layers.missing:,} fragments of hair are missing, because too "
                "many lie in one point of the picture. Remove overlapping strands, or set "
                "Transparency to Hashed."
            )
        return tuple(found)


@dataclass(eq=False)
class _Shadows:
    """The shadows for one set of lights. lights: these; None before the first draw.

    inter_groom_shadow: the optical depth of other grooms for them.
    """

    lights: tuple[Light, ...] | None = None
    opacity: OpacityPass = field(default_factory=OpacityPass)
    inter_groom_shadow: InterGroomShadow = field(default_factory=InterGroomShadow)


@dataclass(eq=False)
class _View:
    """The data kept for one view.

    shadows: for its lights, possibly shared with other views. last_lights: lights of its last draw.
    part_count: number of parts in which its strands were last drawn at rest. is_moving: the last
        draw was not at rest.
    """

    detail: DetailPass = field(default_factory=DetailPass)
    shadows: _Shadows = field(default_factory=_Shadows)
    last_lights: tuple[Light, ...] | None = None
    part_count: int = 0
    is_moving: bool = False


class StrandPass:
    """The strands of one groom on the GPU, kept from draw to draw.

    Creating one does not touch the GPU; the first draw does. Arrays of a snapshot are uploaded only
    if they are other objects than in the draw before.

    Views are identified by names; data that depends on a view is kept for each. Draws into a single
    picture need no name.

    statistics: of the last draw.
    """

    def __init__(self) -> None:
        self._points_serial = 0
        self._views: dict[Hashable, _View] = {}
        self.statistics = Statistics()
        self.release()
        released_with_shaders(self)

    def draw(
        self,
        snapshot: Snapshot,
        camera: Camera,
        width: int,
        height: int,
        *,
        content: str = "light",
        output: str = "scene_linear",
        display: Display | None = None,
        samples: int = 1,
        other_maps: Sequence[OpacityMaps] = (),
        view: ViewState = UNNAMED_VIEW,
    ) -> None:
        """Draw all strands into the bound framebuffer, depth-tested against what is in it.

        Args:
            width, height: of the target [pixels].
            content: one of CONTENTS.
            output: "scene_linear" for a picture of ours; "viewport" for a POST_VIEW handler in
                Blender's viewport.
            display: for "viewport", the view transform; None: the plain "Standard".
            samples: pixels of the target across one pixel of the final picture; the minimum width
                and the settings of detail are in pixels of the latter.
            other_maps: maps of other hair that may cast shadows. Only used if this hair has maps
                too, see `opacity`.

        Raises:
            ShaderError: the shader does not compile here, or points on the GPU were released.
        """
        if content not in CONTENTS:
            raise ValueError(f"content {content!r} is none of {', '.join(CONTENTS)}")
        view_data = self._views.setdefault(view.name, _View())
        view_data.is_moving = False
        self.statistics = Statistics()
        if not snapshot.strand_count:
            return
        self._upload(snapshot)
        is_debug = content == "light" and snapshot.debug_view != "none"
        transparency = "none" if is_debug else drawn_transparency(snapshot.strand_settings)
        is_layered = transparency == "layers"
        size = width // samples, height // samples
        order = self._order(snapshot, camera, size, view, is_layered=is_layered)
        if not order.classes:
            return
        maps = None
        if content == "light" and not is_debug:
            maps = self.opacity(snapshot, view=view.name, is_turning=view.is_turning)
        drawing = StrandDrawing(
            order=order,
            ribbon=self._ribbons.strip,
            blocks=self._blocks,
            points=(
                view_feature(camera, width, height),
                self._strands_feature(snapshot),
                self._curves(snapshot),
            ),
            shading=(
                self._light(snapshot, view_data, maps, other_maps)
                if content == "light"
                else (self._tangents(snapshot),)
            ),
            display_features=(
                *(() if display is None or view.is_sample else (display.feature,)),
                *((self._debug_feature(snapshot),) if is_debug else ()),
            ),
            output_encoding=output_index("scene_linear" if view.is_sample else output),
            samples_across=samples,
            expected_depths=lambda: expected_depths(self._ball.ball(snapshot), camera),
        )
        layers = LayerStatistics()
        if is_layered:
            layers = self._draw_layers(drawing, view, is_own_target=output == "scene_linear")
        elif transparency == "hashed":
            HASHED_STRANDS.draw(drawing)
        else:
            with drawing_state():
                (drawing.draw_places if content == "places" else drawing.draw)()
        self.statistics = Statistics(
            strands=order.strands,
            pieces=order.pieces,
            vertices=sum(drawn.vertex_count for drawn in order.classes),
            layers=layers,
            maps_note="" if maps is None else maps.note,
        )

    def _order(
        self,
        snapshot: Snapshot,
        camera: Camera,
        size: tuple[int, int],
        view: ViewState,
        *,
        is_layered: bool,
    ) -> DetailOrder:
        """The strands to draw and their pieces; size: of the final picture [pixels]."""
        view_data = self._views[view.name]
        detail = view_data.detail
        view_data.is_moving = view.is_moving and is_layered and detail.has_rest_counts(snapshot)
        return detail.order(
            *(snapshot, self._textures, self._points_serial, camera, size),
            by_depth=not is_layered,
            counted=is_layered and view.name is not None,
            reserve_fragments=LAYERS_OF_PIXELS.reserve if view_data.is_moving else None,
        )

    def _light(
        self,
        snapshot: Snapshot,
        view_data: _View,
        maps: OpacityMaps | None,
        other_maps: Sequence[OpacityMaps],
    ) -> tuple[ShaderFeature, ...]:
        """The features of programs that write light."""
        inter_groom_shadow = view_data.shadows.inter_groom_shadow
        if not other_maps:  # else it keeps maps of grooms that are gone
            inter_groom_shadow.release()
        return tuple(self._shading(snapshot, maps, inter_groom_shadow, other_maps))

    def _draw_layers(
        self, drawing: StrandDrawing, view: ViewState, *, is_own_target: bool
    ) -> LayerStatistics:
        view_data = self._views[view.name]
        layers = LAYERS_OF_PIXELS.draw(
            drawing,
            is_own_target=is_own_target,
            in_parts=view_data.part_count > 1,
            is_moving=view_data.is_moving,
            is_turning=view.is_turning,
            picture=view.picture,
            is_sample=view.is_sample,
        )
        if not view_data.is_moving:
            view_data.part_count = layers.parts
        return layers

    def opacity(
        self, snapshot: Snapshot, *, view: Hashable = None, is_turning: bool = False
    ) -> OpacityMaps | None:
        """The opacity maps of the hair; None if it casts no shadow.

        Drawn into separate textures, only when something has changed. Views with the same lights
        share them.

        Args:
            view: name of the view; is_turning: see ViewState.

        Raises:
            ShaderError: as `draw`.
        """
        if snapshot.volume.shadows == "none" or not snapshot.strand_count:
            return None
        self._upload(snapshot)
        return self._opacity_pass(snapshot, view).maps(
            self._textures["cv_points"],
            self._points_serial,
            snapshot.layout,
            self._ball.ball(snapshot),
            packed_lights(snapshot.lights),
            snapshot.volume,
            snapshot.strand_settings,
            snapshot.all_casters,
            snapshot.spacing,
            None if snapshot.along is None else self._textures["cv_attributes"],
            snapshot.rank,
            is_turning=is_turning,
        )

    def _opacity_pass(self, snapshot: Snapshot, view: Hashable) -> OpacityPass:
        """The pass for the maps of these lights: that of any view with these lights, or the
        view's own."""
        lights, view_data = snapshot.lights, self._views.setdefault(view, _View())
        shadows = next(
            (each.shadows for each in self._views.values() if each.shadows.lights == lights),
            view_data.shadows,
        )
        if shadows.lights not in (lights, None) and view_data.last_lights == lights:
            shadows = _Shadows()  # another view, which shared these lights, has turned
        shadows.lights = view_data.last_lights = lights
        view_data.shadows = shadows
        return shadows.opacity

    def needs_redraw(self, view: Hashable) -> bool:
        """Whether a view must be drawn again once it is at rest, because its shadows lag behind its
        lights, or because it was drawn without waiting for the GPU.
        """
        view_data = self._views.get(view)
        return view_data is not None and (
            view_data.is_moving or view_data.shadows.opacity.has_stale_maps
        )

    def forget_views(self, visible_names: Set[Hashable]) -> None:
        """Release the data of all views except these."""
        self._views = {
            view: view_data for view, view_data in self._views.items() if view in visible_names
        }

    def forget_view(self, view: Hashable) -> None:
        """Release the data of this view."""
        self._views.pop(view, None)

    def ball(self, snapshot: Snapshot) -> Ball:
        """A sphere around all its strands."""
        return self._ball.ball(snapshot)

    def release(self) -> None:
        """Release everything on the GPU; the next draw uploads again."""
        self._blocks = UniformBlocks()
        self._views = {}
        self._ball = HairBall()
        self._colliders = UploadedColliders()
        self._textures: dict[str, Any] = {}
        self._uploaded: dict[str, tuple[Any, ...]] = {}
        self._ribbons = Ribbons()

    def _strands_feature(self, snapshot: Snapshot) -> ShaderFeature:
        """The feature of programs that need the width of strands."""
        values = struct_values(snapshot.strand_settings.as_drawn)
        return ShaderFeature(blocks={"strands": ("StrandSettings", values)})

    def _curves(self, snapshot: Snapshot) -> ShaderFeature:
        """The feature of programs that need the points of strands."""
        textures = self._textures
        attributes = None if snapshot.along is None else textures["cv_attributes"]
        return curves_feature(textures["cv_points"], textures["strand_spans"], attributes)

    def _tangents(self, snapshot: Snapshot) -> ShaderFeature:
        """The feature of programs that write tangents, instead of those for shading."""
        return ShaderFeature(
            name="tangents", textures=self._attributes(snapshot), defines={"TANGENTS": 1}
        )

    def _attributes(self, snapshot: Snapshot) -> dict[str, tuple[str, Any]]:
        """Textures for shading; cv_attributes only for evenly spaced points, else it is in
        `_curves`."""
        names = ("strand_seeds", *(("cv_attributes",) if snapshot.along is None else ()))
        return {name: ("FLOAT_2D", self._textures[name]) for name in names}

    def _shading(
        self,
        snapshot: Snapshot,
        maps: OpacityMaps | None,
        inter_groom_shadow: InterGroomShadow,
        other_maps: Sequence[OpacityMaps],
    ) -> Iterator[ShaderFeature]:
        """The features of all programs that shade these strands.

        Debug views do not depend on the shading model.
        """
        yield ShaderFeature(
            textures=self._attributes(snapshot),
            blocks={"shading": ("ShadingSettings", struct_values(snapshot.shading))},
            numbers={"volume_center": ("VEC3", snapshot.center.tolist())},
        )
        yield lights_feature(snapshot)
        if snapshot.debug_view != "none":
            return
        if "cv_colors" in self._textures:
            yield self._color_feature()
        is_marschner = snapshot.shading.model == "marschner"
        if is_marschner:
            yield marschner_feature(snapshot)
        if "cv_openness" in self._textures:
            yield self._openness_feature()
        if maps is None:
            return
        yield maps.feature
        if is_marschner and snapshot.volume.scattering:
            yield scattering_feature(snapshot)
            if "cv_received" in self._textures:
                yield self._skin_feature()
        if other_maps:
            yield self._inter_groom_feature(inter_groom_shadow, other_maps, len(snapshot.lights))

    def _inter_groom_feature(
        self,
        inter_groom_shadow: InterGroomShadow,
        other_maps: Sequence[OpacityMaps],
        light_count: int,
    ) -> ShaderFeature:
        """The feature of programs that read the optical depth of other hair per CV."""
        points, grooms = self._textures["cv_points"], [(NO_GROOM, other) for other in other_maps]
        found = inter_groom_shadow.other_tau(points, self._points_serial, grooms, light_count)
        return ShaderFeature(
            name="others",
            textures={"cv_other_tau": ("FLOAT_2D", found)},
            varyings=(("smooth", "VEC4", "strand_other_tau"),),
            defines={"OTHER_TAU": 1},
        )

    def _color_feature(self) -> ShaderFeature:
        """The feature of programs that shade strands in their own colours."""
        return ShaderFeature(
            name="colored",
            textures={"cv_colors": ("FLOAT_2D", self._textures["cv_colors"])},
            varyings=(("smooth", "VEC4", "strand_own_color"),),
            defines={"OWN_COLOR": 1},
        )

    def _openness_feature(self) -> ShaderFeature:
        """The feature of programs that read the openness of strands to the world's light."""
        return ShaderFeature(
            name="open",
            textures={"cv_openness": ("FLOAT_2D", self._textures["cv_openness"])},
            varyings=(("smooth", "VEC4", "strand_openness"),),
            defines={"OPENNESS": 1},
        )

    def _skin_feature(self) -> ShaderFeature:
        """The feature of programs that read the skin that strands see."""
        names = "received", "beneath"
        return ShaderFeature(
            name="skin",
            textures={f"cv_{name}": ("FLOAT_2D", self._textures[f"cv_{name}"]) for name in names},
            varyings=tuple(("smooth", "VEC4", f"strand_{name}") for name in names),
            defines={"SKIN_SEEN": 1},
        )

    def _debug_feature(self, snapshot: Snapshot) -> ShaderFeature:
        """The feature of programs that show a debug view."""
        names: tuple[str, ...] = ()
        integers: dict[str, int] = {}
        numbers: dict[str, tuple[str, float]] = {}
        defines = {"DEBUG": DEBUG_VIEWS.index(snapshot.debug_view)}
        if snapshot.debug_view in NUMBERED_VIEWS:
            names = ("debug_numbers",)
        elif snapshot.debug_view == "stretch":
            names = ("rest_lengths",)
        elif snapshot.debug_view == "depth" and snapshot.solids:
            kinds = self._colliders.textures_of(snapshot.solids).kinds
            names, defines = kinds.textures, defines | dict(kinds.defines) | {"HAS_SOLIDS": 1}
            integers = dict.fromkeys(kinds.integers, len(snapshot.solids))
            shown = FULL_COLOR_DEPTH * self._ball.ball(snapshot).radius
            numbers = {"full_color_depth": ("FLOAT", max(shown, _MIN_RADIUS))}
        return ShaderFeature(
            name=snapshot.debug_view,
            textures={name: ("FLOAT_2D", self._textures[name]) for name in names},
            integers=integers,
            numbers=numbers,
            varyings=(("flat", "INT", "strand_index"), ("smooth", "FLOAT", "strand_place")),
            defines=defines,
        )

    def _upload(self, snapshot: Snapshot) -> None:
        layout, device = snapshot.layout, snapshot.device_points
        points: tuple[Any, ...] = (snapshot.points, snapshot.radius)
        if device is not None:
            if device.texture is None:
                raise ShaderError("strand: what the GPU has computed was released")
            points = (device, (device.serial,))
        points = (*points, layout, snapshot.along)
        if self._update_texture("cv_points", points, lambda: _points_texture(snapshot)):
            self._points_serial += 1
        self._update_texture("strand_spans", (layout,), lambda: spans_texture(layout))
        attributes = (snapshot.occlusion, snapshot.along, layout)
        self._update_texture("cv_attributes", attributes, lambda: _attributes_texture(snapshot))
        self._update_texture(
            "strand_seeds", (snapshot.seed, layout), lambda: _seeds_texture(snapshot)
        )
        look = snapshot.shading
        if not _has_own_colors(snapshot):
            self._release_texture("cv_colors")
        else:
            chosen = (look.color_source, look.brow_source, look.brow_color)
            sources = (snapshot.color, snapshot.group, layout, chosen)
            self._update_texture("cv_colors", sources, partial(_colors_texture, snapshot))
        openness = snapshot.openness
        # Kajiya-Kay's model shadows the world's light by ambient occlusion alone
        if not snapshot.has_world or look.model != "marschner" or openness is None:
            self._release_texture("cv_openness")
        else:
            make = partial(_half_texture, layout, openness)
            self._update_texture("cv_openness", (openness, layout), make)
        self._upload_skin(snapshot)
        self._upload_debug(snapshot)

    def _upload_debug(self, snapshot: Snapshot) -> None:
        layout = snapshot.layout
        if snapshot.debug_view in NUMBERED_VIEWS:
            numbers = getattr(snapshot, snapshot.debug_view)
            self._update_texture(
                "debug_numbers", (numbers, layout), lambda: _numbers_texture(snapshot)
            )
        elif snapshot.debug_view == "stretch":
            make = partial(_lengths_texture, snapshot)
            self._update_texture("rest_lengths", (snapshot.rest, layout), make)
        elif snapshot.debug_view == "depth" and snapshot.solids:
            solids = self._colliders.textures_of(snapshot.solids)
            self._update_texture("rounds", (solids,), lambda: solids.rounds)
            self._update_texture("fields", (solids,), lambda: solids.fields)
            self._update_texture(
                "solids", (snapshot.solids,), lambda: solids.solids(snapshot.solids)
            )

    def _upload_skin(self, snapshot: Snapshot) -> None:
        """Upload the skin that strands see, which only light from strand to strand needs."""
        seen, layout = snapshot.skin_seen, snapshot.layout
        is_wanted = snapshot.shading.model == "marschner" and snapshot.volume.scattering
        for name, part in (("cv_received", slice(4)), ("cv_beneath", slice(4, 8))):
            if seen is None or not is_wanted:
                self._release_texture(name)
            else:
                make = partial(_half_texture, layout, seen[:, part])
                self._update_texture(name, (seen, layout), make)

    def _update_texture(self, name: str, sources: tuple[Any, ...], make: Callable[[], Any]) -> bool:
        """Make a texture again if a source is a new object; tuples are compared by value."""
        before = self._uploaded.get(name, ())
        if len(before) == len(sources) and all(
            old is new or (isinstance(old, tuple) and old == new)
            for old, new in zip(before, sources, strict=True)
        ):
            return False
        self._textures[name] = make()
        self._uploaded[name] = sources
        return True

    def _release_texture(self, name: str) -> None:
        """Release a texture that is no longer needed."""
        self._textures.pop(name, None)
        self._uploaded.pop(name, None)


def drawn_transparency(settings: StrandSettings) -> str:
    """The method by which strands are drawn: without image atomics, hashed instead of layers."""
    wanted = settings.transparency
    return "hashed" if wanted == "layers" and not capabilities().image_atomics else wanted


def noise_free_samples(settings: StrandSettings) -> int:
    """Samples per pixel that make a still free of noise where strands are hashed as a fallback for
    layers; else 1.
    """
    return NOISE_FREE_SAMPLES if drawn_transparency(settings) != settings.transparency else 1


def _half_texture(layout: StrandLayout, values: Floats) -> Any:
    """A half-float texture of four numbers per point, (point_count, 4)."""
    return texture_from(layout.pixels(values), "RGBA16F")


def _points_texture(snapshot: Snapshot) -> Any:
    if snapshot.device_points is not None:
        return snapshot.device_points.texture
    packed = np.concatenate([snapshot.points, snapshot.radius[:, None]], axis=1)
    return texture_from(snapshot.layout.pixels(packed), "RGBA32F")


def _has_own_colors(snapshot: Snapshot) -> bool:
    is_own = drawn_color(snapshot.color, snapshot.shading) is not None
    return is_own or bool(natural_strands(snapshot.group, snapshot.shading).any())


def _colors_texture(snapshot: Snapshot) -> Any:
    """The texture cv_colors; w is 1 where strands have colours, and 2 where tips do not get the
    look's tint either."""
    look, group = snapshot.shading, snapshot.group
    every_cv = None if group is None else np.repeat(group, snapshot.layout.counts)
    color = own_colors(snapshot.color, every_cv, look)
    assert color is not None, "only coloured hair has such a texture"
    is_known = ~np.isnan(color[..., :1])
    known = is_known.astype(np.float32)
    if every_cv is not None:
        known += natural_strands(every_cv, look)[..., None]
    packed = np.concatenate([np.where(is_known, color, 0.0), known], axis=-1)
    return texture_from(snapshot.layout.pixels(np.minimum(packed, _MAX_HALF_FLOAT)), "RGBA16F")


def _numbers_texture(snapshot: Snapshot) -> Any:
    """The texture debug_numbers: exact below 2^24; 0 if the snapshot has no numbers."""
    numbers = getattr(snapshot, snapshot.debug_view)
    shown = np.zeros((snapshot.strand_count, 1, 1), np.float32)
    if numbers is not None:
        shown[:, 0, 0] = numbers
    return texture_from(strand_rows(shown), "R32F")


def _lengths_texture(snapshot: Snapshot) -> Any:
    """The texture rest_lengths; 0 everywhere if strands are at rest. Values at tips are unused."""
    length = np.zeros((snapshot.layout.point_count, 1), np.float32)
    if snapshot.rest is not None:
        length[:-1, 0] = np.linalg.norm(np.diff(snapshot.rest, axis=0), axis=1)
    return texture_from(snapshot.layout.pixels(length), "R32F")


def _attributes_texture(snapshot: Snapshot) -> Any:
    attributes = np.ones((snapshot.layout.point_count, 2), np.float32)
    for channel, values in enumerate((snapshot.occlusion, snapshot.along)):
        if values is not None:
            attributes[:, channel] = values
    return texture_from(snapshot.layout.pixels(attributes), "RG32F")


def _seeds_texture(snapshot: Snapshot) -> Any:
    """The texture strand_seeds, exact below 2^24."""
    seed = np.arange(snapshot.strand_count) if snapshot.seed is None else snapshot.seed
    seeds = np.asarray(seed % SEED_LIMIT, np.float32)
    return texture_from(strand_rows(seeds[:, None, None]), "R32F")
