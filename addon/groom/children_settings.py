"""What the artist sets about children: the strands that are grown between guides."""

from __future__ import annotations

import math
from dataclasses import dataclass

from ..params import Settings, choice, curve, either, integer, number, when

_NALU = "Nguyen and Donnelly 2005, GPU Gems 2, chapter 23"
_TARIQ = "Tariq 2008, Real-time hair rendering on the GPU"
_PARTS = either(when("children.method", "multi"), when("children.clump"))


@dataclass(frozen=True, kw_only=True)
class ChildrenSettings(Settings):
    """Strands between the artist's own, which all become guides or are chosen from."""

    section = "children"
    title = "Children"
    owner = "groom"

    method: str = choice(
        "none",
        (
            ("none", "None", "The curves are all the hair there is"),
            ("multi", "Between Guides", "Each child is a mixture of the three guides around it"),
            ("single", "Around a Guide", "Each child runs beside one guide"),
        ),
        label="Method",
        description="How strands are made from guides",
        source=_TARIQ,
    )
    strand_count: int = integer(
        4095,
        label="Strands",
        description="How many children there are; more adds some and moves none",
        soft=(100, 20_000),
        hard=(0, 500_000),
        source=_NALU,
        shown_when=when("children.method", "multi", "single"),
    )
    parting: float = number(
        math.radians(60.0),
        label="Parting",
        description="Guides that go apart by more than this angle are not mixed",
        unit="angle",
        soft=(math.radians(10.0), math.radians(90.0)),
        hard=(0.0, math.pi),
        shown_when=when("children.method", "multi", "single"),
        active_when=_PARTS,
    )
    length_variation: float = number(
        0.2,
        label="Length Variation",
        description="How much shorter than its guides a child may be",
        unit="factor",
        soft=(0.0, 0.9),
        hard=(0.0, 0.99),
        shown_when=when("children.method", "multi", "single"),
    )
    clump: float = number(
        0.5,
        label="Clump",
        description="How far children of a lock are drawn together",
        unit="factor",
        soft=(0.0, 1.0),
        hard=(0.0, 1.0),
        shown_when=when("children.method", "multi", "single"),
    )
    clump_along: tuple[float, float, float, float, float] = curve(
        (0.0, 0.25, 0.5, 0.75, 1.0),
        label="Clump Along",
        description="Fraction of the clump from root to tip",
        hard=(0.0, 1.0),
        shown_when=when("children.method", "multi", "single"),
        active_when=when("children.clump"),
    )
    clump_size: int = integer(
        12,
        label="Strands per Clump",
        description="How many children make a lock, on average; 1 makes none",
        soft=(1, 100),
        hard=(1, 100_000),
        shown_when=when("children.method", "multi", "single"),
        active_when=when("children.clump"),
    )
    frizz: float = number(
        0.001,
        label="Frizz",
        description="How far single children stray from their way",
        unit="length",
        soft=(0.0, 0.01),
        hard=(0.0, 1.0),
        shown_when=when("children.method", "multi", "single"),
    )
    frizz_along: tuple[float, float, float, float, float] = curve(
        (0.0, 0.4, 0.7, 0.9, 1.0),
        label="Frizz Along",
        description="Fraction of the frizz from root to tip",
        hard=(0.0, 1.0),
        shown_when=when("children.method", "multi", "single"),
        active_when=when("children.frizz"),
    )
    frizz_length: float = number(
        0.03,
        label="Frizz Length",
        description="Length of hair from one stray to the next",
        unit="length",
        soft=(0.005, 0.2),
        hard=(0.0001, 100.0),
        shown_when=when("children.method", "multi", "single"),
        active_when=when("children.frizz"),
    )
    width: float = number(
        1.0,
        label="Width",
        description="Width of children as a factor of their guides' width",
        soft=(0.1, 4.0),
        hard=(0.001, 1000.0),
        shown_when=when("children.method", "multi", "single"),
    )
    seed: int = integer(
        1,
        label="Seed",
        description="Another seed gives other children of the same kind",
        soft=(0, 100),
        hard=(0, 2**31 - 1),
        shown_when=when("children.method", "multi", "single"),
    )
