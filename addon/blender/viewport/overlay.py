"""Strands in the 3D viewport, and their counts: drawn for all grooms, from snapshots only.

`read_drawing` reads what is drawn of a groom, and in which views, by the visibility of hair and
head in Blender. Drawing itself never reads a data-block: it only uses the context of the view.
"""

from __future__ import annotations

import traceback
from collections.abc import Callable, Hashable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import chain
from typing import Any

import bpy
import gpu
import numpy as np

from ...render import gpu_memory
from ...render.body_shadow import BodyShadow
from ...render.cached_picture import CachedPicture
from ...render.camera import Camera
from ...render.capabilities import capabilities
from ...render.display import Display
from ...render.groom_pass import GroomPass
from ...render.opacity_maps import OpacityMaps
from ...render.own_depth import OwnDepth
from ...render.scene_pass import DRAW_LOCK
from ...render.scene_snapshot import SceneSnapshot
from ...render.snapshot import Snapshot
from ...render.strand_pass import Statistics, ViewState, drawn_transparency
from ...shading.environment import Environment, world_suns
from ...shading.lights import Light, brightest_lights, three_point_lights
from ...strands import Surface
from ..base.objects import LayerKey, is_solid, layer_key, layers_showing, spaces_hiding
from ..base.redraw import redraw_panels, redraw_views, show_status
from ..cards.show import as_shown, without_strands
from ..scene.lights import uses_scene_light
from ..scene.mesh_materials import may_be_transparent
from ..scene.world import studio_environment
from ..sessions.measures import FrameTimes
from ..sessions.session import Session
from ..sessions.snapshots import with_all_strands
from . import softening, view_transform
from .debug_lines import Lines, debug_lines_of, draw_lines
from .overlay_text import card_counts_line, counts_line, draw_graphs, write_lines
from .views import (
    STEADY_VIEW_TYPES,
    View,
    forget_closed_views,
    forget_views,
    record_drawn,
    record_reshown,
    view_key,
    view_of,
)


@dataclass(frozen=True)
class GroomDrawing:
    """One groom as it is to be drawn.

    is_made: whether its hair is made.
    visible_layers: the view layers that show it; None: all.
    hiding_views: addresses of the 3D views that do not show it.
    head: world space; None if it is not drawn as a solid.
    headless_views: of the 3D views that do not show its head, so that it hides nothing there.
    card_counts: cards, triangles and vertices, if it is shown as cards.
    counts_name: the name under which its counts are written; empty: they are not.
    note: text that is written even without overlays.
    lines: its overlays.
    times: of its frames.
    """

    snapshot: Snapshot
    is_visible: bool = True
    is_made: bool = True
    visible_layers: frozenset[LayerKey] | None = None
    hiding_views: frozenset[int] = frozenset()
    head: Surface | None = None
    headless_views: frozenset[int] = frozenset()
    guide_count: int = 0
    card_counts: tuple[int, ...] = ()
    counts_name: str = ""
    note: str = ""
    lines: tuple[Lines, ...] = ()
    times: FrameTimes = field(default_factory=FrameTimes)


#: identifier of our render engine
ENGINE = "HAIRLOOM"


@dataclass(eq=False)
class DrawnGroom:
    """One groom that is drawn, with its passes; uses the GPU from the first draw on."""

    drawing: GroomDrawing
    hair: GroomPass = field(default_factory=GroomPass)
    shadow: BodyShadow = field(default_factory=BodyShadow)


class _Overlay:
    """The state of the overlay.

    drawn: the grooms, by session number of the hair. depth: of heads, for views in which Blender
        draws no depth.
    handles: of the draw handlers, while there are any.
    failure: why drawing has stopped; empty while all is well.
    layers: the view layers in windows when a view was last drawn.
    """

    def __init__(self) -> None:
        self.drawn: dict[int, DrawnGroom] = {}
        self.depth = OwnDepth()
        self.handles: tuple[Any, ...] = ()
        self.failure = ""
        self.layers: frozenset[LayerKey] = frozenset()


_overlay = _Overlay()


def read_drawing(
    session: Session, hair: bpy.types.Object, depsgraph: bpy.types.Depsgraph, note: str = ""
) -> GroomDrawing:
    """The drawing of this groom at the moment.

    Args:
        note: text to write into the views.
    """
    snapshot, head = as_shown(session.snapshot), None
    if not session.is_made:
        snapshot = without_strands(snapshot)
    if session.head is not None:
        head = session.head.handle.find()
    is_drawn = head is not None and is_solid(head)
    if head is None or not is_drawn or may_be_transparent(head):
        snapshot = with_all_strands(snapshot)
    if snapshot.debug_view == "stretch" and len(snapshot.points):
        snapshot = replace(snapshot, rest=session.rig.strands.points)
    elif snapshot.debug_view == "depth":
        snapshot = replace(snapshot, solids=session.solids(depsgraph))
    seen_in = layers_showing(hair)
    return GroomDrawing(
        snapshot,
        is_visible=bool(seen_in),
        is_made=session.is_made,
        visible_layers=seen_in,
        hiding_views=spaces_hiding(hair),
        head=session.posed_head if is_drawn else None,
        headless_views=frozenset() if head is None else spaces_hiding(head),
        guide_count=len(session.rig.guides),
        card_counts=session.cards.counts if snapshot.cards is not None else (),
        counts_name=hair.name if hair.hairloom.show_counts or snapshot.debug_view != "none" else "",
        note=note,
        lines=debug_lines_of(session, hair, depsgraph),
        times=session.times,
    )


def show(uid: int, drawing: GroomDrawing) -> None:
    """Draw this groom from now on; replaces its earlier drawing."""
    known = _overlay.drawn.get(uid)
    if known is None:
        _overlay.drawn[uid] = DrawnGroom(drawing)
    else:
        known.drawing = drawing
    if not _overlay.handles and not _overlay.failure and not bpy.app.background:
        add = bpy.types.SpaceView3D.draw_handler_add
        _overlay.handles = tuple(
            add(_draw, (draw,), "WINDOW", kind)
            for draw, kind in (
                (_draw_strands, "POST_VIEW"),
                (_draw_debug_lines, "POST_VIEW"),
                (_draw_counts, "POST_PIXEL"),
            )
        )
        view_transform.prepare()
    redraw_views()


def hide(uid: int) -> None:
    """Hide this groom until it is shown again."""
    drawing = drawing_of(uid)
    if drawing is not None and drawing.is_visible:
        show(uid, replace(drawing, is_visible=False))


def stop_drawing(uid: int) -> None:
    """No longer draw this groom; with the last one, the draw handlers and the report of a failure
    are removed."""
    _overlay.drawn.pop(uid, None)
    if not _overlay.drawn:
        _remove_handlers()
        retry()
    redraw_views()


def drawing_of(uid: int) -> GroomDrawing | None:
    """The drawing of a groom, if it is drawn."""
    drawn = _overlay.drawn.get(uid)
    return None if drawn is None else drawn.drawing


def failure() -> str:
    """Why the overlay has stopped drawing; empty while all is well."""
    return _overlay.failure


def retry() -> None:
    """Draw again after a failure."""
    if _overlay.failure:
        _overlay.failure = ""
        show_status(None)


def _draw(what: Callable[[Any], None]) -> None:
    """Called by Blender for each 3D view; an error is reported once, not at every redraw."""
    if _overlay.failure or is_rendered_by_us(bpy.context):
        return
    try:
        what(bpy.context)
    except Exception as error:
        _fail(error)


def _draw_strands(context: Any) -> None:
    watch_view_layers()
    view, camera = view_of(context.region_data), _camera(context.region_data)
    shown = list(_shown_grooms(context, camera, has_turned=view.has_new_camera(camera)))
    if not shown:
        view.picture.release()
        softening.discard_samples(view)
        return
    samples = context.scene.hairloom.picture.viewport_samples
    key = (
        *view_key(context, camera),
        samples,
        *(part for each in shown for part in each.key),
    )
    with DRAW_LOCK, gpu_memory.shared_by(len(shown)):
        if has_no_scene_depth(context):
            _draw_depth(context.space_data.as_pointer(), camera, shown)
        if not view.picture.matches(key):
            softening.discard_samples(view)
            _draw_body_shadows(camera, shown)
            _draw_hair(view, camera, shown, key)
            record_drawn(view)
            if view.picture.key and softening.can_soften(shown[0].snapshot.lights, samples):
                softening.schedule_samples(view)
            return
        is_sampled = softening.takes_sample(view)
        if is_sampled:
            _add_sample(view, camera, shown, samples)
        elif not view.is_soft:
            _draw_body_shadows(camera, shown)
        view.picture.show()
        for uid, counted in view.statistics_by_uid.items():
            _overlay.drawn[uid].hair.strands.statistics = counted
        if not is_sampled:
            record_reshown(view, context.space_data.shading)
            softening.resume_timer(view)


def _draw_body_shadows(camera: Camera, shown: Sequence[_ShownGroom], sample: Any = None) -> None:
    """Draw the shadows on heads, before all hair, onto what Blender has drawn.

    Args:
        sample: as in BodyShadow.draw.
    """
    for each in shown:
        each.draw_body_shadow(camera, sample)


def _add_sample(view: View, camera: Camera, shown: Sequence[_ShownGroom], samples: int) -> None:
    """Add a sample of soft shadows, before the view shows its picture."""
    centers = [each.snapshot.center for each in shown]
    lights = softening.lights_of_sample(shown[0].snapshot.lights, centers)
    name = softening.sample_key(view)
    lit = [
        replace(each, snapshot=replace(each.snapshot, lights=lights), view=name) for each in shown
    ]
    is_shown, sums = softening.is_next_shown(view, samples), softening.sample_picture()
    if not view.is_soft and not is_shown:
        _draw_body_shadows(camera, shown)

    def draw_hair(picture: CachedPicture) -> None:
        maps: dict[Hashable, OpacityMaps | None] = {}
        if len(lit) > 1:
            maps = {each.uid: each.maps() for each in lit}
        for each in lit:
            each.draw(camera, maps, picture, is_moving=False, is_sample=True)

    sums.add(lambda texture: _draw_body_shadows(camera, lit, texture), draw_hair)
    if is_shown:
        sums.show_in(view.picture, shown[0].display)
        view.is_soft = True
    passes = [each.drawn.hair.strands for each in shown]
    fragments = tuple(each.statistics.layers.fragments for each in passes)
    softening.was_sampled(view, samples, passes, fragments)


def _draw_depth(address: int, camera: Camera, shown: Sequence[_ShownGroom]) -> None:
    """Draw the depth of what hides hair: the heads that it grows on, if they are shown."""
    _, _, width, height = gpu.state.viewport_get()
    drawings = [each.drawing for each in shown if address not in each.drawing.headless_views]
    heads = [each.head for each in drawings if each.head is not None]
    _overlay.depth.draw(heads, camera, width, height)


def _draw_hair(view: View, camera: Camera, shown: list[_ShownGroom], key: tuple[Any, ...]) -> None:
    """Draw all grooms into the current view, and into its picture if that can be kept."""
    forget_closed_views(each.hair.strands for each in _overlay.drawn.values())
    can_be_kept = all(each.can_be_kept for each in shown) and not gpu_memory.exceeds_budget()
    picture = view.picture if can_be_kept else None
    if picture is None:
        view.picture.release()
    else:
        picture.begin()
    is_moving = view.has_new_key(key)
    maps: dict[Hashable, OpacityMaps | None] = {}
    if len(shown) > 1:  # a single groom makes its maps when it is drawn
        for each in shown:
            with each.drawing.times.measured("drawing"):
                maps[each.uid] = each.maps()
    for each in shown:
        with each.drawing.times.measured("drawing", goes_on=bool(maps)):
            each.draw(camera, maps, picture, is_moving=is_moving)
    view.is_outdated = any(each.drawn.hair.strands.needs_redraw(view.address) for each in shown)
    view.statistics_by_uid = {each.uid: each.drawn.hair.strands.statistics for each in shown}
    if picture is not None and not view.is_outdated:
        picture.key = key


@dataclass(frozen=True, eq=False)
class _ShownGroom:
    """One groom in the current view.

    snapshot: as it is seen and lit there. view: the name under which passes keep its data.
    shades_body: whether its shadow is drawn on the head.
    is_turning: whether its lights are attached to the view, and the view moves.
    shows_all_strands: whether strands behind heads are drawn too.
    """

    uid: int
    drawn: DrawnGroom
    drawing: GroomDrawing
    snapshot: Snapshot
    display: Display | None
    view: Hashable
    shades_body: bool
    is_turning: bool
    shows_all_strands: bool

    @property
    def key(self) -> tuple[Any, ...]:
        """Everything that its picture depends on, beside the view."""
        snapshot = self.snapshot
        points, harmonics, display = snapshot.device_points, snapshot.harmonics, self.display
        return (
            *(self.uid, self.drawing.snapshot, 0 if points is None else points.serial),
            *(snapshot.lights, snapshot.ambient, b"" if harmonics is None else harmonics.tobytes()),
            *(() if display is None else (display.table, display.gain, display.gamma)),
            *(self.shows_all_strands, capabilities().image_atomics),
        )

    @property
    def can_be_kept(self) -> bool:
        """Whether its picture can be kept: not with cards, which are drawn among strands, nor with
        debug views and transparency methods that write depth."""
        snapshot = self.snapshot
        is_plain = snapshot.cards is None and snapshot.debug_view == "none"
        return is_plain and drawn_transparency(snapshot.strand_settings) == "layers"

    def maps(self) -> OpacityMaps | None:
        """See `GroomPass.maps`."""
        hair, snapshot = self.drawn.hair, self.snapshot
        return hair.maps(snapshot, view=self.view, is_turning=self.is_turning)

    def draw_body_shadow(self, camera: Camera, sample: Any = None) -> None:
        """As `_draw_body_shadows`."""
        if not self.shades_body:
            return
        maps = self.maps()
        if maps is not None:
            _, _, width, height = gpu.state.viewport_get()
            size = width, height
            shadow = self.drawn.shadow
            shadow.draw(self.snapshot, maps, camera, *size, display=self.display, sample=sample)

    def draw(
        self,
        camera: Camera,
        maps: Mapping[Hashable, OpacityMaps | None],
        picture: CachedPicture | None,
        *,
        is_moving: bool,
        is_sample: bool = False,
    ) -> None:
        """Draw its hair; strands are drawn into the picture as well.

        Args:
            maps: of all hair in the view, by session number.
            picture, is_moving, is_sample: see ViewState.
        """
        _, _, width, height = gpu.state.viewport_get()
        snapshot, display, hair = self.snapshot, self.display, self.drawn.hair
        hair.strands.draw(
            snapshot,
            camera,
            width,
            height,
            output="viewport",
            display=display,
            other_maps=hair.other_maps(self.uid, snapshot, maps),
            view=ViewState(self.view, self.is_turning, is_moving, picture, is_sample),
        )
        if is_sample:
            return
        hair.cards.draw(
            snapshot,
            camera,
            width,
            height,
            opacity=hair.cards.opacity(snapshot),
            output="viewport",
            display=display,
        )


def _shown_grooms(context: Any, camera: Camera, *, has_turned: bool) -> Iterator[_ShownGroom]:
    """All grooms in the current view; cards last, as they are blended."""
    space = context.space_data
    address, studio = space.as_pointer(), three_point_lights(camera.view)
    display = view_transform.display_of(space.shading, context.scene)
    found = sorted(shown_in(context), key=lambda each: each[1].snapshot.cards is not None)
    snapshots = _with_shared_lights(
        [with_view_lights(each.snapshot, space.shading, studio) for _, each in found]
    )
    for (uid, drawing), snapshot in zip(found, snapshots, strict=True):
        # a clipping region may have cut away the part of the head that hides hair
        is_open = is_x_ray(space.shading) or context.region_data.use_clip_planes
        sees_all = is_open or address in drawing.headless_views
        if sees_all:
            snapshot = with_all_strands(snapshot)
        yield _ShownGroom(
            uid,
            _overlay.drawn[uid],
            drawing,
            snapshot,
            # colours of debug views stand for numbers, so no view transform applies to them
            display if snapshot.debug_view == "none" else None,
            context.region_data.as_pointer(),
            shades_body=_shades_body(snapshot, space) and address not in drawing.headless_views,
            is_turning=has_turned and snapshot.lights is studio,
            shows_all_strands=sees_all,
        )


def _with_shared_lights(snapshots: Sequence[Snapshot]) -> list[Snapshot]:
    """Snapshots with the same lights in the same order, since grooms look up each other's maps by
    the number of a light. Before, each groom may have other lights, the brightest at its own hair.
    """
    if all(each.lights == snapshots[0].lights for each in snapshots):
        return list(snapshots)
    known = dict.fromkeys(chain.from_iterable(each.lights for each in snapshots))
    lights = brightest_lights(known, np.mean([each.center for each in snapshots], axis=0))
    return [replace(each, lights=lights) for each in snapshots]


def _camera(view: Any) -> Camera:
    return Camera(np.array(view.view_matrix), np.array(view.window_matrix))


def _draw_debug_lines(context: Any) -> None:
    """Draw overlays in front of everything, as Blender draws its gizmos."""
    if context.space_data.overlay.show_overlays:
        eye = _camera(context.region_data).eye
        for _, drawing in shown_in(context):
            for lines in drawing.lines:
                draw_lines(lines.seen_from(eye))


def _draw_counts(context: Any) -> None:
    """Write the counts of what was just drawn of each groom in the same view."""
    notes = [drawing.note for _, drawing in shown_in(context) if drawing.note]
    if not context.space_data.overlay.show_overlays:
        write_lines(context, notes)
        return
    lines = [
        "   ".join(filter(None, (_counts_of(_overlay.drawn[uid]), drawing.times.text)))
        for uid, drawing in shown_in(context)
        if drawing.counts_name
    ]
    write_lines(context, lines + notes)
    graphs = [drawing.times for _, drawing in shown_in(context) if drawing.counts_name]
    draw_graphs(context, graphs, len(lines + notes))


def _counts_of(drawn: DrawnGroom) -> str:
    drawing = drawn.drawing
    if drawing.card_counts:
        return card_counts_line(drawing.counts_name, drawing.guide_count, drawing.card_counts)
    strand_count, drawn_now = drawing.snapshot.strand_count, drawn.hair.strands.statistics
    return counts_line(drawing.counts_name, drawing.guide_count, strand_count, drawn_now)


def statistics_of(uid: int) -> Statistics:
    """The counts of what was drawn of a groom in the last view; zeros before the first."""
    drawn = _overlay.drawn.get(uid)
    return Statistics() if drawn is None else drawn.hair.strands.statistics


def notes_of(uid: int) -> tuple[str, ...]:
    """Notes for the artist on how a groom was drawn in the last view."""
    drawn = _overlay.drawn.get(uid)
    return () if drawn is None else drawn.hair.notes


def drawn_uids() -> frozenset[int]:
    """Session numbers of the grooms that are drawn here instead of by Blender."""
    return frozenset(uid for uid, each in _overlay.drawn.items() if each.drawing.is_made)


def pending_uids() -> frozenset[int]:
    """Session numbers of the grooms that will be drawn here once they are made."""
    return frozenset(_overlay.drawn) - drawn_uids()


def is_rendered_by_us(context: Any) -> bool:
    """Whether our render engine draws this 3D view, and the hair with it."""
    is_ours = context.scene.render.engine == ENGINE
    return is_ours and context.space_data.shading.type == "RENDERED"


def shown_in(context: Any) -> list[tuple[int, GroomDrawing]]:
    """The grooms that the 3D view of this context shows."""
    address = context.space_data.as_pointer()
    layer = layer_key(context.scene, context.view_layer)
    return [
        (uid, drawing)
        for uid, drawing in ((uid, each.drawing) for uid, each in _overlay.drawn.items())
        if drawing.is_visible
        and address not in drawing.hiding_views
        and (drawing.visible_layers is None or layer in drawing.visible_layers)
    ]


def has_no_scene_depth(context: Any) -> bool:
    """Whether Blender draws no depth in a view. Except in Solid and similar views, it draws depth
    for overlays alone; without these the depth is 0 or 1 everywhere, or that of an earlier draw.
    """
    shading, is_bare = context.space_data.shading, not context.space_data.overlay.show_overlays
    kind = shading.type
    is_plain = kind == "RENDERED" and context.scene.render.engine == "BLENDER_WORKBENCH"
    return is_bare and kind not in STEADY_VIEW_TYPES and not is_plain


def is_x_ray(shading: Any) -> bool:
    """Whether a view shows objects behind heads."""
    return shading.type == "WIREFRAME" or (shading.type == "SOLID" and shading.show_xray)


def _shades_body(snapshot: Snapshot, space: Any) -> bool:
    """Whether to draw hair's shadow on the head: Blender must have drawn that in the same light."""
    uses_lights, _ = uses_scene_light(space.shading)
    is_shown = bool(snapshot.casters) and not is_x_ray(space.shading)
    return snapshot.volume.on_body and uses_lights and bool(snapshot.lights) and is_shown


def with_view_lights[Shown: (Snapshot, SceneSnapshot)](
    shown: Shown, shading: Any, studio: tuple[Light, ...]
) -> Shown:
    """The snapshot in the light that Blender uses in this view: the scene's lights, and the scene's
    world or the view's own world picture. If all of these are black or unused, hair is lit by the
    studio lights, so that it is not black.
    """
    used: tuple[bool, bool] = uses_scene_light(shading)
    scene: Snapshot | SceneSnapshot = shown
    own = Environment(scene.ambient, scene.harmonics, world_suns(scene.lights))
    world: Environment = own if used[1] else studio_environment(shading)
    known: tuple[Light, ...] = tuple(light for light in scene.lights if used[light.is_from_world])
    # suns of the view's world picture come first, so that scene lights cannot displace them
    lights = known if used[1] else (*world.suns, *known)
    if not lights and world.is_black:
        return replace(shown, lights=studio, ambient=Snapshot.ambient, harmonics=None)
    return replace(shown, lights=lights, ambient=world.ambient, harmonics=world.harmonics)


def _fail(error: Exception) -> None:
    _overlay.failure = f"Hairloom cannot draw here: {error}"
    print(_overlay.failure)
    traceback.print_exc()
    bpy.app.timers.register(_report_failure, first_interval=0.0)


def _report_failure() -> None:
    """A timer for Blender: outside of drawing, handlers may be removed and the status text set."""
    _remove_handlers()
    if _overlay.failure:
        show_status(_overlay.failure.splitlines()[0])
    bpy.context.scene.update_tag()  # so that Blender's own strands are shown again
    redraw_panels()


def _remove_handlers() -> None:
    for handle in _overlay.handles:
        bpy.types.SpaceView3D.draw_handler_remove(handle, "WINDOW")
    _overlay.handles = ()
    _overlay.depth.release()
    stop_watching_view_layers()
    softening.stop()
    forget_views()


def stop_watching_view_layers() -> None:
    """Forget the view layers of windows, when views are no longer drawn."""
    _overlay.layers = frozenset()
    if bpy.app.timers.is_registered(_evaluate_scenes):
        bpy.app.timers.unregister(_evaluate_scenes)


def watch_view_layers() -> None:
    """Called while a view is drawn: have a view layer that is new in any window evaluated soon.

    Each view layer has its own evaluated copies, and Blender has no event for a window that begins
    to show one. Our strands are drawn there at once, but Blender's own are not hidden until the
    layer is evaluated.
    """
    windows = bpy.context.window_manager.windows
    now = frozenset(layer_key(each.scene, each.view_layer) for each in windows)
    if now - _overlay.layers and not bpy.app.timers.is_registered(_evaluate_scenes):
        bpy.app.timers.register(_evaluate_scenes, first_interval=0.0)
    _overlay.layers = now


def _evaluate_scenes() -> None:
    for scene in {window.scene for window in bpy.context.window_manager.windows}:
        scene.update_tag()
