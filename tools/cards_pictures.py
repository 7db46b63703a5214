"""Draws the pictures of docs/cards.md: ways to make cards, their layers, their levels, and edits.

python tools/cards_pictures.py FOLDER
"""

import importlib
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import bpy  # noqa: F401  it must come before gpu, which lives inside it
import gpu
import numpy as np
from extension_loader import PACKAGE, load_package

STRANDS, CARDS = 8000, 500
WIDTH, HEIGHT, SAMPLES = 420, 480, 2
UP = np.array([0.0, 0.0, 1.0])


def addon_module(module: str) -> Any:
    return importlib.import_module(f"{PACKAGE}.addon.{module}")


class Shots:
    """A groom on the built-in head, and pictures of it as strands and as cards."""

    def __init__(self) -> None:
        settings = addon_module("parameters").ALL_SETTINGS
        bust = addon_module("blender.scene.built_in_head").built_in_head()
        head = bust.surface
        grow, studio = addon_module("groom.grow"), addon_module("blender.pictures.studio")
        grown = settings["grow"](strand_count=STRANDS, clump=0.4)
        strands = grow.grow(head, grown, bust.weights["scalp"])
        self.settings = settings
        self.rig = addon_module("rig_flow").prepare(
            strands,
            head,
            settings["guides"](guide_count=CARDS),
            place="the built-in groom",
            widths="auto",
        )
        groom = addon_module("blender.properties.groom_settings").GroomSettings()
        ambient = settings["ambient"]()
        prepared = addon_module("blender.sessions.prepared_groom").prepare_groom(self.rig, ambient)
        self._studio = studio.Studio(prepared, groom, look=bust.look("light"))

    def strands(self) -> Any:
        rig = self.rig
        return self._studio.picture(rig.rest_pose, rig.strands.points, WIDTH, HEIGHT, SAMPLES)

    def built(
        self, method: str, levels: int = 1, count: int = CARDS, edits: Any = None
    ) -> tuple[Any, Any]:
        """Cards built by this method, and how they are drawn."""
        settings, builds = self.settings, addon_module("blender.cards.build")
        options = addon_module("params").SettingsMap(
            settings["cards"](source=method, card_count=count, levels=levels),
            settings["card_occlusion"](rays=64),
        )
        steps = builds.build_steps(builds.CardInputs(self.rig, options, edits=edits))
        cards = addon_module("cards.steps").result_of(steps)
        bound = builds.BuiltCards.of(self.rig, cards)
        return cards.build, bound.with_drawing_settings(bound.rest, options)

    def cards(self, mesh: Any, drawn: Any, back: Any = None) -> Any:
        """A picture of these cards alone of all drawn ones, with the order of their back faces."""
        shown = replace(drawn, mesh=mesh, back_triangles=back)
        if len(mesh.positions) != len(drawn.mesh.positions):  # they have one value per vertex
            shown = replace(shown, skin_seen=None, openness=None, depth=None)
        return self._studio.card_picture(shown, WIDTH, HEIGHT, SAMPLES)


def cards_of_layer(mesh: Any, layer: int) -> Any:
    """The cards of one layer alone."""
    is_in_layer = mesh.layer[mesh.card] == layer
    return replace(mesh, triangles=mesh.triangles[is_in_layer], card=mesh.card[is_in_layer])


def edits_by_hand(build: Any) -> Any:
    """Edits like an artist's: on one side the tips of long cards are flicked out and wider, on the
    other side outer ones are deleted."""
    edits, mesh = addon_module("cards.edits"), build.finest
    surface = addon_module("strands").Surface(
        mesh.positions, mesh.triangles, mesh.uv[mesh.triangles]
    )
    record = replace(build.record, prints=edits.piece_prints(surface, mesh.card))
    root, tip = build.record.places[:, 0], build.record.places[:, 3]
    is_long = tip[:, 2] < np.quantile(tip[:, 2], 0.6)
    is_right = root[:, 0] > np.median(root[:, 0])
    is_flicked, is_deleted = is_long & is_right, is_long & ~is_right & (mesh.layer > 0)
    card = addon_module("cards.sort").card_of_vertex(mesh)
    flick = np.clip((mesh.along - 0.6) / 0.4, 0.0, 1.0) * is_flicked[card]
    outwards = mesh.positions - root.mean(axis=0)
    outwards[:, 2] = 0.0
    outwards /= np.maximum(np.linalg.norm(outwards, axis=1, keepdims=True), 1e-6)
    offsets = 0.05 * flick**1.5, 0.05 * flick**2
    moved = mesh.positions + offsets[0][:, None] * outwards + offsets[1][:, None] * UP
    wider = addon_module("cards.shaping").CardVertices(moved, mesh.uv, card).widened(1.0, 1.3)
    moved[is_flicked[card]] = wider[is_flicked[card]]
    is_kept = ~is_deleted[mesh.card]
    surface = replace(
        surface,
        positions=moved,
        triangles=mesh.triangles[is_kept],
        corner_uv=mesh.uv[mesh.triangles[is_kept]],
    )
    return edits.find_edits(surface, mesh.card[is_kept], record, np.eye(4))


def main(folder: Path) -> None:
    gpu.init()
    load_package().register()
    images, shots = addon_module("blender.base.images"), Shots()

    def sheet(name: str, pictures: list[Any]) -> None:
        images.write_png(folder / name, images.contact_sheet(pictures, len(pictures)))

    guides, along = shots.built("guides")
    build, baked = shots.built("clusters", levels=5)
    sheet(
        "card_ways.png",
        [
            shots.strands(),
            shots.cards(guides.finest, along, guides.back_triangles[0]),
            shots.cards(build.finest, baked, build.back_triangles[0]),
        ],
    )
    layers = np.unique(build.finest.layer)
    sheet("card_layers.png", [shots.cards(cards_of_layer(build.finest, n), baked) for n in layers])
    sheet(
        "card_levels.png",
        [shots.cards(build.levels[n], baked, build.back_triangles[n]) for n in (0, 2, 4)],
    )
    by_hand = edits_by_hand(build)
    print(by_hand.counts.report_line)
    edited = [shots.built("clusters", count=count, edits=by_hand) for count in (CARDS, 400)]
    sheet(
        "card_edits.png",
        [
            shots.cards(build_.finest, drawn, build_.back_triangles[0])
            for build_, drawn in [(build, baked), *edited]
        ],
    )
    for mesh, error in zip(build.levels, build.errors, strict=True):
        triangles, millimetres = len(mesh.triangles), error * 1000.0
        print(f"{triangles:,} triangles, {mesh.card_count} cards, within {millimetres:.1f} mm")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
