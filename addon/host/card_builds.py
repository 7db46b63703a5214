"""Building the cards that are shown, in a thread or at once, and what they hang on.

The thread does what is pure numpy. An atlas is baked on the GPU, which is the main thread's: the
build waits there until somebody calls `Build.serve`.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace

from .. import pipeline
from ..arrays import Floats
from ..cards.atlas_settings import AtlasSettings
from ..cards.build import CardBuild
from ..cards.drawing_settings import CardDrawingSettings
from ..cards.follow import CardBinding
from ..cards.occlusion_settings import CardOcclusionSettings
from ..cards.settings import CardSettings
from ..errors import HairloomError
from ..pipeline import Pose, Rig
from ..render.card_snapshot import CardSnapshot
from ..shading.settings import ShadingSettings, StrandSettings
from ..shading.textures import HairTextures, TextureSettings
from ..shading.volume.card_opacity import StrandArea, card_shade
from .card_maps import made_maps

#: What acts on cards at once: how they are drawn, and how wide the strands are.
type CardsDrawn = tuple[CardDrawingSettings, StrandSettings]


@dataclass(frozen=True)
class CardForm:
    """All that cards hang on beside the rig.

    picture_names: (texture, picture) of those that take the place of generated textures.
    shading: of the strands in the atlas. Forms are the same that differ in it by colours alone,
        since the atlas holds how strands differ from the mean, which these hardly change.
    """

    cards: CardSettings = field(default_factory=CardSettings)
    atlas: AtlasSettings = field(default_factory=AtlasSettings)
    occlusion: CardOcclusionSettings = field(default_factory=CardOcclusionSettings)
    texture: TextureSettings = field(default_factory=TextureSettings)
    strands: StrandSettings = field(default_factory=StrandSettings)
    picture_names: tuple[tuple[str, str], ...] = ()
    shading: ShadingSettings = field(default_factory=ShadingSettings, compare=False)
    variation: tuple[str, float, float] = field(init=False)

    def __post_init__(self) -> None:
        look = self.shading
        object.__setattr__(self, "variation", (look.model, look.color_variation, look.grey_share))


@dataclass(frozen=True)
class _MapChoices:
    """See card_maps.MapChoices."""

    texture: TextureSettings
    shading: ShadingSettings
    strands: StrandSettings
    pictures: Mapping[str, Floats]


@dataclass(frozen=True, eq=False)
class BuiltCards:
    """Cards at rest, tied to the guides of their rig.

    notes: what the artist should know.
    """

    rig: Rig
    form: CardForm
    binding: CardBinding
    rest: CardSnapshot
    strand_area: StrandArea
    card_shade: float
    notes: tuple[str, ...]

    def at(self, pose: Pose, guides: Floats, drawn: CardsDrawn) -> CardSnapshot:
        """The cards riding on guides (guide_count, cv_count, 3) [m, world]."""
        mesh = pipeline.cards_at(self.rig, self.binding, pose, guides)
        return self.drawn(replace(self.rest, mesh=mesh), drawn)

    def drawn(self, cards: CardSnapshot, drawn: CardsDrawn) -> CardSnapshot:
        """The same cards by these settings."""
        drawing, strands = drawn
        thickness = self.strand_area.shade(strands) / max(self.card_shade, 1.0e-12)
        return replace(cards, drawing=drawing, thickness=thickness)


type _Maker = Callable[[CardBuild], HairTextures]


def built_cards(rig: Rig, form: CardForm, pictures: Mapping[str, Floats]) -> BuiltCards:
    """Build the cards of a rig with their textures, here and now.

    Raises:
        HairloomError: no cards can be made.
    """
    return _built(rig, form, lambda build: _textures(rig, form, build, pictures))


def _textures(
    rig: Rig, form: CardForm, build: CardBuild, pictures: Mapping[str, Floats]
) -> HairTextures:
    chosen = _MapChoices(form.texture, form.shading, form.strands, pictures)
    return made_maps(rig, build, chosen).textures


def _built(rig: Rig, form: CardForm, make: _Maker) -> BuiltCards:
    made: list[HairTextures] = []

    def alpha_of(build: CardBuild) -> Floats:
        made.append(make(build))
        return made[-1].alpha

    build = pipeline.card_build(rig, form.cards, form.atlas, form.occlusion, alpha_of)
    mesh, strands, (textures,) = build.finest, rig.strands, made
    has_map = build.plan is not None or form.texture.highlights == "tangent"
    return BuiltCards(
        rig,
        form,
        pipeline.bound_cards(rig, mesh),
        CardSnapshot(mesh, textures, has_map, build.backs[0]),
        StrandArea.of(strands.grid, strands.radius.reshape(strands.strand_count, -1)),
        card_shade(mesh.positions, mesh.triangles, mesh.uv, textures.alpha),
        build.notes,
    )


class _GivenUpError(Exception):
    """Nobody waits for these cards."""


class Build:
    """Cards on their way.

    Args:
        is_awaited: build them here, before anything goes on; else in a thread.
    """

    def __init__(
        self, rig: Rig, form: CardForm, pictures: Mapping[str, Floats], *, is_awaited: bool
    ) -> None:
        self.rig, self.form = rig, form
        self._pictures = pictures
        self._is_given_up = False
        self._asked: CardBuild | None = None
        self._answer: HairTextures | Exception | None = None
        self._is_answered = threading.Event()
        self._result: BuiltCards | None = None
        self._error: Exception | None = None
        self._is_awaited = is_awaited
        if is_awaited:
            self._run()
            self._thread = None
        else:
            # a daemon, so that Blender may quit whatever is being built
            self._thread = threading.Thread(target=self._run, daemon=True, name="hairloom cards")
            self._thread.start()

    def serve(self) -> bool:
        """Do what only the main thread may; whether the cards are done."""
        asked, self._asked = self._asked, None
        if asked is not None:
            try:
                self._answer = _textures(self.rig, self.form, asked, self._pictures)
            except Exception as error:  # it is raised where the build waits, and told of there
                self._answer = error
            self._is_answered.set()
        return self._thread is None or not self._thread.is_alive()

    def result(self) -> BuiltCards:
        """The cards, when they are done.

        Raises:
            HairloomError: no cards can be made.
        """
        if self._error is not None:
            raise self._error
        assert self._result is not None, "not done yet"
        return self._result

    def give_up(self) -> None:
        """Nobody waits for them any more."""
        self._is_given_up = True
        self._is_answered.set()

    def _run(self) -> None:
        try:
            self._result = _built(self.rig, self.form, self._made)
        except Exception as error:  # kept for whoever asks for the result
            self._error = error

    def _made(self, build: CardBuild) -> HairTextures:
        if self._is_awaited:
            return _textures(self.rig, self.form, build, self._pictures)
        self._asked = build
        self._is_answered.wait()
        if self._is_given_up or self._answer is None:
            raise _GivenUpError
        if isinstance(self._answer, Exception):
            raise self._answer
        return self._answer


def told(error: HairloomError) -> str:
    """Why there are no cards, for the artist."""
    return f"Strands are shown, because there are no cards. {error}"
