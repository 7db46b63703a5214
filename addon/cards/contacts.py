"""Riding cards, led out of colliders like strands: first their spines, then the arms of their rows.

A spine is led out as a strand, and every row moves along rigidly. If a vertex of a row is still in
a collider, its arm is led out, the vector from the spine to it: a strand of two points, whose root
stays on the spine. So a card keeps its length and its width. It bends along its spine where it lies
against something round, as a clump of hair does.

A point that was in a collider when the motion began may stay as deep as it was where its root
carries it, see `refine.lead_out`. Unlike strands, cards do not depend on the frame before: those of
a bake are made in any order.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..arrays import Floats, Ints, pieces_of_rows
from ..dynamics.colliders import PosedCollider, signed_distance
from ..dynamics.colliders.signed_distance import mesh_distance, nearer_than, poses_at_end
from ..refine.lead_out import DEEP, Clearance, clearance_at, lead_out
from ..refine.ride import minimal_rotation, turn_change
from ..strands.vectors import dot_rows

#: Arms shorter than this part of the distance that is kept are not led out.
_SHORTEST_ARM = 0.5
_TINY = np.float32(1.0e-30)


@dataclass(frozen=True, eq=False)
class CardClearance:
    """Distances of cards from colliders where their roots carry them.

    spines: of all spines. vertices: of all vertices.
    """

    spines: Clearance
    vertices: Clearance

    @classmethod
    def measure(
        cls,
        spines: Floats,
        vertices: Floats,
        row: Ints,
        offsets: Ints,
        colliders: tuple[PosedCollider, ...],
        min_distance: float,
    ) -> CardClearance:
        """The clearance of a motion that begins now.

        Args:
            spines, vertices: (row_count, 3) and (vertex_count, 3) world [m], where roots carry
                them.
            row: (vertex_count,) the row of each vertex.
            offsets: (n + 1,), the spine of card c is spines[offsets[c]:offsets[c + 1]].
            min_distance: [m].
        """
        distance, _ = signed_distance(vertices, colliders, min_distance)
        inside = (distance < -DEEP * min_distance).nonzero()[0]
        # the collider's grid is thicker there than its mesh, and gives no direction out of it
        is_thicker = (
            mesh_distance(vertices[inside], colliders) > distance[inside] + DEEP * min_distance
        )
        unmeasured = inside[is_thicker]
        distance[unmeasured] = -np.inf
        of_spines = clearance_at(spines, offsets, colliders, min_distance)
        # a row turns with the segments to both rows beside it
        rows = np.minimum(
            row[unmeasured] + 1, offsets[1:][pieces_of_rows(row[unmeasured], offsets)] - 1
        )
        of_vertices = Clearance(min_distance, distance, np.zeros(len(vertices), np.int32))
        return cls(of_spines.holding(rows, offsets), of_vertices)


@dataclass(frozen=True, eq=False)
class CardContacts:
    """The colliders of one moment, and the distances that cards keep from them."""

    colliders: tuple[PosedCollider, ...]
    clearance: CardClearance

    def lead_spines(self, spines: Floats, carried: Floats, offsets: Ints) -> None:
        """Lead spines out, in place.

        Args:
            spines, carried: (row_count, 3) world [m], as they ride, and where roots carry them.
        """
        self._lead(spines, carried, offsets, self.clearance.spines)

    def lead_arms(
        self,
        positions: Floats,
        directions: tuple[Floats, ...],
        middles: Floats,
        arms: Floats,
        away: Floats,
    ) -> None:
        """Lead the vertices' arms out, in place.

        Args:
            positions: (vertex_count, 3) world [m]. directions: unit vectors at these, which turn
                with their arms.
            middles: (vertex_count, 3) of their rows.
            arms: (vertex_count, 3) from the middles, as the roots turn them.
            away: (vertex_count,) [m] distance of the middles from where roots carry them.
        """
        vertices = self.clearance.vertices
        near = nearer_than(positions, poses_at_end(self.colliders), vertices.reach)[0]
        min_length, arm = _SHORTEST_ARM * vertices.max_distance, arms[near].T
        near = near[dot_rows(arm, arm) > min_length * min_length]
        if not len(near):
            return
        # roots and tips by turns
        roots, offsets = middles[near], 2 * np.arange(len(near) + 1)
        points, carried = (
            np.stack([roots, tips], axis=1).reshape(-1, 3)
            for tips in (positions[near], roots + arms[near])
        )
        distance = np.full((len(near), 2), -np.inf, np.float32)
        # the motion of the row as a whole counts too
        distance[:, 1] = vertices.points[near] + away[near]
        clearance = Clearance(
            vertices.max_distance, distance.ravel(), np.zeros(len(near), np.int32)
        )
        led = self._lead(points, carried, offsets, clearance)
        chosen, tips = near[led], points[2 * led + 1]
        before, after = _unit(positions[chosen] - roots[led]), _unit(tips - roots[led])
        turn = minimal_rotation(before, after, np.zeros(len(led), bool))
        for vectors in directions:
            vectors[chosen] += turn_change(turn, vectors[chosen].T).T
        positions[chosen] = tips

    def _lead(self, points: Floats, carried: Floats, offsets: Ints, clearance: Clearance) -> Ints:
        def carry(index: Ints, _cards_of_rows: Ints) -> Floats:
            places: Floats = carried[index]
            return places

        return lead_out(points, carry, offsets, self.colliders, clearance)[0]


def _unit(vectors: Floats) -> Floats:
    """(n, 3) as planes of unit vectors, (3, n)."""
    rows = np.ascontiguousarray(vectors.T)
    rows /= np.maximum(np.sqrt(dot_rows(rows, rows)), _TINY)
    return rows
