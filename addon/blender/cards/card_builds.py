"""Building the cards that are shown, in a thread or at once, and what they hang on.

The thread does what is pure numpy. An atlas is drawn on the GPU, which is the main thread's: the
build waits there until it is served.
"""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

from ...arrays import Floats
from ...card_flow import bound_cards, cards_at
from ...cards.atlas_maps import AtlasMaps
from ...cards.bake_strands import FlatStrands
from ...cards.drawing_settings import CardDrawingSettings
from ...cards.follow import CardBinding
from ...cards.steps import result_of, retold
from ...errors import HairloomError
from ...params import SettingsMap
from ...pipeline import Pose, Rig
from ...render.card_snapshot import CardSnapshot
from ...render.card_textures import CardTextures, packed_textures
from ...shading.settings import StrandSettings
from ...shading.volume.card_opacity import StrandArea, card_shade
from ..base.thread_work import ThreadWork
from .card_atlas import drawing_maps, has_gpu
from .card_making import CardInputs, MadeCards, making_steps
from .card_maps import made_maps


@dataclass(frozen=True, eq=False)
class BuiltCards:
    """Cards at rest, tied to the guides of their rig.

    wrong_share: see cards.build.CardBuild.
    notes: what the artist should know.
    """

    rig: Rig
    binding: CardBinding
    rest: CardSnapshot
    strand_area: StrandArea
    card_shade: float
    wrong_share: float
    notes: tuple[str, ...]

    def at(self, pose: Pose, guides: Floats, settings: SettingsMap) -> CardSnapshot:
        """The cards riding on guides (guide_count, cv_count, 3) [m, world]."""
        mesh = cards_at(self.rig, self.binding, pose, guides)
        return self.drawn(replace(self.rest, mesh=mesh), settings)

    def drawn(self, cards: CardSnapshot, settings: SettingsMap) -> CardSnapshot:
        """The same cards by these settings."""
        shade = self.strand_area.shade(settings[StrandSettings])
        thickness = shade / max(self.card_shade, 1.0e-12)
        return replace(cards, drawing=settings[CardDrawingSettings], thickness=thickness)


def built_cards(rig: Rig, inputs: CardInputs) -> BuiltCards:
    """Build the cards of a rig with their textures, here and now.

    Raises:
        HairloomError: no cards can be made.
    """
    return tied_cards(rig, result_of(making_steps(rig, inputs)))


def cards_built_in_thread(work: ThreadWork[BuiltCards], rig: Rig, inputs: CardInputs) -> BuiltCards:
    """As `built_cards` in the thread of this work, with their textures on the GPU."""
    built = tied_cards(rig, made_in_thread(work, rig, inputs))
    work.report("Textures")
    device = _uploaded(work, built.rest)
    return replace(built, rest=replace(built.rest, device=device))


def _uploaded(work: ThreadWork[Any], cards: CardSnapshot) -> CardTextures | None:
    """In the thread: their textures on the GPU, so that no draw waits for them; None without one.

    Raises:
        GivenUpError: nobody waits for them.
    """
    packed = list(packed_textures(cards.textures, cards.mesh.atlas))

    def uploading() -> Generator[None, None, CardTextures | None]:
        if not has_gpu():
            return None
        device = CardTextures()
        yield from device.uploading(cards.textures, cards.mesh.atlas, packed)
        return device

    return work.on_main_thread(uploading())


def made_in_thread(work: ThreadWork[Any], rig: Rig, inputs: CardInputs) -> MadeCards:
    """Make cards in the thread of this work; the main thread draws the atlas.

    Raises:
        HairloomError: no cards can be made.
        GivenUpError: nobody waits for them.
    """

    def draw(flat: FlatStrands, size: int) -> AtlasMaps:
        return work.on_main_thread(drawing_maps(flat, size))

    maps_of = partial(made_maps, rig, settings=inputs.settings, pictures=inputs.pictures, draw=draw)
    steps = making_steps(rig, inputs, maps_of)
    return result_of(retold(steps, work.report))


def tied_cards(rig: Rig, made: MadeCards) -> BuiltCards:
    """Cards that are made, with all that drawing them needs."""
    build, textures = made.build, made.maps.textures
    mesh, strands = build.finest, rig.strands
    return BuiltCards(
        rig,
        bound_cards(rig, mesh),
        CardSnapshot(
            mesh,
            textures,
            made.maps.has_tangent_map,
            build.backs[0],
            is_even=made.maps.is_even,
        ),
        StrandArea.of(strands.grid, strands.radius.reshape(strands.strand_count, -1)),
        card_shade(mesh.positions, mesh.triangles, mesh.uv, textures.alpha),
        build.wrong_share,
        made.notes,
    )


def told(error: HairloomError) -> str:
    """Why there are no cards, for the artist."""
    return f"Strands are shown, because there are no cards. {error}"
