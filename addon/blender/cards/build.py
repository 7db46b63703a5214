"""From a groom's settings to its cards and their maps, for the viewport, files and mesh objects.

Cards can be built in any thread. Only the main thread may use the GPU, to draw an atlas and to
upload textures, so a build in another thread waits until the main thread takes these steps.
"""

from __future__ import annotations

from collections.abc import Callable, Generator, Hashable, Mapping
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass, field, replace
from typing import Any

import bpy
import gpu
import numpy as np

from ...arrays import Floats
from ...card_flow import bound_cards, card_build_steps, card_groom, cards_at
from ...cards.atlas import AtlasPlan
from ...cards.atlas_depth import relative_depths
from ...cards.atlas_maps import AtlasMaps, dilated
from ...cards.atlas_settings import AtlasSettings
from ...cards.bake import sample_maps
from ...cards.bake_strands import FlatStrands, flat_strands
from ...cards.build import CardBuild
from ...cards.drawing_settings import CardDrawingSettings
from ...cards.edits import CardEdits
from ...cards.follow import CardBinding
from ...cards.occlusion_settings import CardOcclusionSettings
from ...cards.settings import CardSettings
from ...cards.shell_plan import ShellPlan, shell_strands
from ...cards.steps import NamedSteps, Step, map_progress, result_of
from ...errors import HairloomError
from ...exchange.textures.card_textures import resized_to_largest
from ...light_flow import light_along_axes
from ...paint_flow import with_painted_colors
from ...params import SettingsMap
from ...render.atlas_pass import baked_maps, baking
from ...render.card_snapshot import CardSnapshot
from ...render.card_textures import CardTextures, packed_textures
from ...rig_flow import Pose, Rig
from ...shading.ambient_settings import AmbientSettings
from ...shading.card_look import plain_albedo
from ...shading.drawn_strands import (
    brightest_look,
    card_color,
    drawn_color,
    in_color,
    mean_look,
    strand_variation,
)
from ...shading.settings import ShadingSettings, StrandSettings
from ...shading.texture_settings import TextureSettings
from ...shading.textures import TEXTURES, HairTextures, hair_textures
from ...shading.volume.card_opacity import VISIBLE_UPRIGHT, StrandArea, card_shadow_area
from ..base.gpu_context import ensure_gpu
from ..base.objects import head_of
from ..base.outcome import notes_of
from ..base.thread_work import ThreadWork
from ..colliders.rigs import CachedRig
from ..properties.groom_settings import GroomSettings
from ..scene.painted_colors import read_colors
from ..scene.source import read_source
from .edits import read_edits
from .occluders import Occluders, read_occluders
from .textures import chosen_pictures

#: Draws flat strands into an atlas of this size [pixels].
type AtlasDraw = Callable[[FlatStrands, int], AtlasMaps]
#: Makes a context manager that times a named stage.
type Stage = Callable[[str], AbstractContextManager[None]]


def untimed(_name: str) -> AbstractContextManager[None]:
    return nullcontext()


@dataclass(frozen=True, eq=False)
class CardInputs:
    """The inputs of a build of cards.

    pictures: used instead of generated textures, see `textures.picture_as`.
    occluders: hair of other grooms that occludes these cards, placed as if all were at rest.
    edits: the artist's changes to the cards in the scene, or None.
    """

    rig: Rig
    settings: SettingsMap = field(default_factory=SettingsMap)
    pictures: Mapping[str, Floats] = field(default_factory=dict)
    occluders: Occluders = field(default_factory=Occluders)
    edits: CardEdits | None = None


def read_inputs(
    hair: bpy.types.Object,
    depsgraph: bpy.types.Depsgraph,
    rig: Rig | None = None,
    keep_edits: bool = True,
    cached_rigs: tuple[CachedRig, ...] = (),
) -> tuple[CardInputs, tuple[str, ...], dict[str, int]]:
    """A groom with its own settings; notes for the artist; counts of dropped strands by reason.

    Args:
        rig: that of the groom's bake; None: made from its curves.
        keep_edits: whether to keep the artist's changes to cards in the scene.
        cached_rigs: see `CachedRig.of`.

    Raises:
        HairloomError: no hair that can be used, or edited cards that cannot be read.
    """
    settings = GroomSettings.of(hair).sections
    notes: tuple[str, ...] = ()
    dropped: dict[str, int] = {}
    if rig is None:
        read = read_source(hair, depsgraph)
        source = read.at_rest
        rig, colors = CachedRig.of(hair, source, cached_rigs).rig, source.colors
        notes, dropped = source.warnings, source.dropped
        if read.rest is not None:
            frame, head = depsgraph.scene.frame_current, head_of(hair)
            assert head is not None
            notes += (
                f"{hair.name}: {head.name} is posed in frame {frame}. The cards are made in the "
                "rest pose, in which engines bind skeletons.",
            )
    else:
        triangle_count = None if rig.head is None else len(rig.head.triangles)
        colors, notes = read_colors(hair, depsgraph, triangle_count)
    rig = with_painted_colors(rig, colors, settings[ShadingSettings])
    pictures, problems = chosen_pictures(hair.data.hairloom.card_images)
    occluders = read_occluders(settings[CardOcclusionSettings], hair)
    edits, doubts = read_edits(hair, depsgraph) if keep_edits else (None, ())
    inputs = CardInputs(rig, settings, pictures, occluders, edits)
    return inputs, (*notes, *notes_of(hair.name, rig), *problems, *doubts), dropped


def cards_key(groom: GroomSettings) -> Hashable:
    """A key that is equal for settings that give the same cards.

    The hair colour itself is no part of it: the atlas holds how strands differ from their mean,
    which the colour hardly changes.
    """
    kinds = CardSettings, AtlasSettings, CardOcclusionSettings, TextureSettings
    look = groom[ShadingSettings]
    return (
        groom.sections.only(*kinds, StrandSettings, AmbientSettings),
        (look.model, look.color_source, look.color_variation, look.grey_fraction, look.color_map),
        (look.brow_source, look.brow_color),
        groom.card_pictures,
    )


@dataclass(frozen=True)
class CardMaps:
    """The maps of cards, for files and for drawing.

    by_name: the maps that are written, see exchange.texture_packing.MAP_MEANINGS.
    textures: the maps that Hairloom draws with; their base includes the gain.
    highlights: the map that breaks highlights up, "shift" or "tangent", see TextureSettings; with
        an atlas "tangent", as it holds the directions of its strands.
    base_gain: the factor for the written base.
    is_view_compensated: whether the alpha is that of baked strands, see CardSnapshot.
    base_color: see CardSnapshot.
    """

    by_name: dict[str, Floats]
    textures: HairTextures
    highlights: str
    base_gain: float = 1.0
    is_view_compensated: bool = False
    base_color: tuple[float, float, float] | None = None

    @property
    def has_tangent_map(self) -> bool:
        return self.highlights == "tangent"

    def plain_card(self, shading: ShadingSettings) -> Floats:
        """The picture for a plain material: albedo of the strands for any shading model, and alpha,
        (height, width, 4) linear."""
        look = shading if self.base_color is None else in_color(self.base_color, shading)
        base = self.textures.base
        if "along" in self.by_name:
            sized = resized_to_largest({"base": base, "along": self.by_name["along"]})
            base, along = sized["base"], sized["along"]
        else:  # one row of tiles, each from root to tip
            along = np.linspace(0.0, 1.0, len(base))[:, None]
        color = plain_albedo(np.clip(base * card_color(along, look), 0.0, 1.0))
        return replace(self.textures, base=color.astype(np.float32)).card


@dataclass(frozen=True)
class MappedCards:
    """Cards at rest, and their maps. notes: for the artist."""

    build: CardBuild
    maps: CardMaps
    notes: tuple[str, ...] = ()


def build_steps(
    inputs: CardInputs, draw: AtlasDraw | None = None, stage: Stage = untimed
) -> NamedSteps[MappedCards]:
    """Build cards with their maps; each step yields what is being made.

    Args:
        draw: draws the atlas; all other work can run in any thread. None: draw in this thread.

    Raises:
        HairloomError: the atlas is too small for its tiles, or there is nothing to bake into it.
    """
    made: list[CardMaps] = []

    def make_alpha(build: CardBuild) -> Floats:
        with stage("card texture"):
            made.append(card_maps(inputs, build, draw or draw_maps))
        return made[-1].textures.alpha

    yield Step("Other hair")
    other_occluders, notes = inputs.occluders.cards()
    build = yield from card_build_steps(
        inputs.rig, inputs.settings, make_alpha, other_occluders, inputs.edits
    )
    return MappedCards(build, made[-1], (*build.notes, *notes))


def build_in_thread(work: ThreadWork[Any], inputs: CardInputs) -> MappedCards:
    """The cards, built in the thread of this work; the main thread draws the atlas.

    Raises:
        HairloomError: no cards can be made.
        WorkCancelledError: the work was cancelled.
    """

    def draw(flat: FlatStrands, size: int) -> AtlasMaps:
        return work.on_main_thread(draw_maps_steps(flat, size))

    return result_of(map_progress(build_steps(inputs, draw), lambda step: work.report(step.text)))


def counts_line(cards: int, triangles: int, shell_layers: int) -> str:
    """A line such as "800 cards, 15,296 triangles"."""
    things = f"{shell_layers} layers of shells" if shell_layers else f"{cards:,} cards"
    return f"{things}, {triangles:,} triangles"


def order_line(wrong_fraction: float) -> str:
    """A line such as "18 % of pixels blend in the wrong order"."""
    return f"{100.0 * wrong_fraction:.0f} % of pixels blend in the wrong order"


def card_maps(inputs: CardInputs, build: CardBuild, draw: AtlasDraw) -> CardMaps:
    """The maps of these cards: baked from strands or generated, some replaced by the artist's own.

    Shift and noise, which vary highlights between strands, are always generated at random.
    """
    settings, pictures = inputs.settings, inputs.pictures
    texture, color = settings[TextureSettings], inputs.rig.strands.color
    look, strands = settings[ShadingSettings], settings[StrandSettings]
    colored = "base" not in pictures and drawn_color(color, look) is not None
    if build.plan is None:
        made = hair_textures(texture, build.finest.atlas.columns)
        textures = made.with_pictures(pictures)
        by_name = {name: getattr(textures, name) for name in TEXTURES}
        mean = mean_look(color, look).base_color if colored else None
        return CardMaps(by_name, textures, texture.highlights, base_color=mean)
    maps = baked_atlas(inputs.rig, build.plan, look, strands, draw)
    # one strip for each row of the atlas, with no more texels than the atlas
    size, grid = build.plan.size, build.plan.grid
    across, along = (max(size // count, 8) for count in (grid.columns, grid.rows))
    fitting = replace(
        texture,
        variant_width=min(texture.variant_width, across),
        height=min(texture.height, along),
    )
    made, rows = hair_textures(fitting, grid.columns), (grid.rows, 1)
    noises = {"shift": np.tile(made.shift, rows), "noise": np.tile(made.noise, rows)}
    by_name = {**maps.by_name, **noises, **pictures}
    gain = 1.0 if "base" in pictures else maps.base_gain
    names = ("alpha", "shift", "noise", "tangent", "normal")
    shown = {name: by_name[name] for name in names}
    textures = HairTextures(base=by_name["base"] * gain, **shown, place=maps.relative_depth)
    return CardMaps(
        by_name,
        textures,
        "tangent",
        gain,
        is_view_compensated="alpha" not in pictures and _is_in_card_plane(build.plan),
        base_color=brightest_look(_card_color(inputs.rig), look).base_color if colored else None,
    )


def _is_in_card_plane(plan: AtlasPlan | ShellPlan) -> bool:
    """Whether the strands in the tiles lie in the plane of the geometry that shows them."""
    return not isinstance(plan, ShellPlan) or plan.is_flat


def _card_color(rig: Rig) -> Floats | None:
    """The colours that the atlas is baked from, (point_count, 3)."""
    return card_groom(rig).strands.color


def draw_maps(flat: FlatStrands, size: int) -> AtlasMaps:
    """The maps of flat strands, drawn on the GPU if there is one; for the main thread."""
    return baked_maps(flat, size) if has_gpu() else sample_maps(flat, size)


def draw_maps_steps(flat: FlatStrands, size: int) -> Generator[None, None, AtlasMaps]:
    """As `draw_maps`, in steps."""
    if not has_gpu():
        return sample_maps(flat, size)
    return (yield from baking(flat, size))


def baked_atlas(
    rig: Rig,
    plan: AtlasPlan | ShellPlan,
    shading: ShadingSettings,
    drawn: StrandSettings,
    draw: AtlasDraw = draw_maps,
) -> AtlasMaps:
    """The maps of all tiles: strands are laid flat and drawn, and colours are dilated to where
    there is no hair.

    Args:
        drawn: for the width of strands.
    """
    groom = card_groom(rig, drawn)
    strands, grid = groom.strands, groom.strands.grid
    colors = strand_variation(
        groom.strand_numbers, grid.shape[1], shading, strands.color_grid, strands.group
    )
    if isinstance(plan, ShellPlan):
        flat = shell_strands(plan, grid, groom.radius, VISIBLE_UPRIGHT, colors)
        return dilated(draw(flat, plan.size), plan.grid)
    flat = flat_strands(plan, grid, groom.radius, colors)
    maps = dilated(draw(flat, plan.size), plan.grid)
    return replace(maps, relative_depth=relative_depths(maps, flat, plan))


def has_gpu() -> bool:
    """Whether there is a GPU context; in background mode, one is created if possible."""
    try:
        ensure_gpu()
        gpu.platform.backend_type_get()
    except (HairloomError, SystemError, RuntimeError):
        return False
    return True


@dataclass(frozen=True, eq=False)
class BuiltCards:
    """Cards at rest, bound to the guides of their rig, with everything that drawing needs.

    shell_layers, wrong_fraction: see cards.build.CardBuild.
    notes: for the artist.
    """

    rig: Rig
    binding: CardBinding
    rest: CardSnapshot
    strand_area: StrandArea
    card_shadow_area: float
    shell_layers: int
    wrong_fraction: float
    notes: tuple[str, ...]

    @classmethod
    def of(cls, rig: Rig, cards: MappedCards) -> BuiltCards:
        build, maps = cards.build, cards.maps
        mesh, strands, textures = build.finest, rig.strands, maps.textures
        light = None if build.light is None else light_along_axes(mesh.axes, build.light)
        openness, skin_seen = light or (None, None)
        if build.shell_layers:  # their vertices stand above the hair that they show
            openness = None
        rest = CardSnapshot(
            mesh,
            textures,
            maps.has_tangent_map,
            build.back_triangles[0],
            is_view_compensated=maps.is_view_compensated or build.shell_layers > 0,
            is_layered=build.shell_layers > 0,
            base_color=maps.base_color,
            openness=openness,
            skin_seen=skin_seen,
            depth=build.depth,
        )
        alpha, level = textures.alpha, rest.lit_level
        return cls(
            rig,
            bound_cards(rig, mesh),
            rest,
            StrandArea.of(strands),
            card_shadow_area(mesh.positions, mesh.triangles, mesh.uv, alpha, level),
            build.shell_layers,
            build.wrong_fraction,
            cards.notes,
        )

    @classmethod
    def build(cls, inputs: CardInputs) -> BuiltCards:
        """Build the cards in this thread.

        Raises:
            HairloomError: no cards can be made.
        """
        return cls.of(inputs.rig, result_of(build_steps(inputs)))

    @classmethod
    def build_in_thread(cls, work: ThreadWork[BuiltCards], inputs: CardInputs) -> BuiltCards:
        """Build the cards in the thread of this work, with their textures on the GPU.

        Raises:
            HairloomError: no cards can be made.
            WorkCancelledError: the work was cancelled.
        """
        built = cls.of(inputs.rig, build_in_thread(work, inputs))
        work.report("Textures")
        return replace(built, rest=replace(built.rest, device=_upload_textures(work, built.rest)))

    def at(self, pose: Pose, guides: Floats, settings: SettingsMap) -> CardSnapshot:
        """The cards riding on guides (guide_count, cv_count, 3) [m, world]."""
        mesh = cards_at(self.rig, self.binding, pose, guides)
        return self.with_drawing_settings(replace(self.rest, mesh=mesh), settings)

    def with_drawing_settings(self, cards: CardSnapshot, settings: SettingsMap) -> CardSnapshot:
        """The same cards with the drawing settings and the shadow density of these settings."""
        shadow = self.strand_area.shadow_area(settings[StrandSettings])
        thickness = shadow / max(self.card_shadow_area, 1.0e-12)
        return replace(cards, drawing=settings[CardDrawingSettings], thickness=thickness)


def _upload_textures(work: ThreadWork[Any], cards: CardSnapshot) -> CardTextures | None:
    """In the thread: upload textures, so that no draw has to; None without a GPU.

    Raises:
        WorkCancelledError: the work was cancelled.
    """
    packed = list(packed_textures(cards.textures, cards.mesh.atlas))

    def uploading() -> Generator[None, None, CardTextures | None]:
        if not has_gpu():
            return None
        device = CardTextures()
        yield from device.uploading(cards.textures, cards.mesh.atlas, packed)
        return device

    return work.on_main_thread(uploading())
