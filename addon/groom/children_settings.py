"""Settings of children: strands that are grown between guides."""

from __future__ import annotations

import math
from dataclasses import dataclass

from ..params import Settings, choice, curve, either, integer, number, when

_NALU = "Nguyen and Donnelly 2005, GPU Gems 2, chapter 23"
_TARIQ = "Tariq 2008, Real-time hair rendering on the GPU"
_HAS_CLUMPS = when("children.clump", unmet_reason="needs Clump")
_HAS_FRIZZ = when("children.frizz", unmet_reason="needs Frizz")
_HAS_CURL = when("children.curl", unmet_reason="needs Curl")
_PARTS = either(_HAS_CLUMPS, when("children.method", "multi", "auto"))


@dataclass(frozen=True, kw_only=True)
class ChildrenSettings(Settings):
    """Strands between the artist's own, of which all or some are guides."""

    section = "children"
    title = "Children"
    help_page = "refinement#children"
    owner = "groom"
    is_animatable = False

    method: str = choice(
        "auto",
        (
            ("none", "None", "Add no children: the curves are all of the hair"),
            ("multi", "Between Guides", "Blend the three guides around each child"),
            ("single", "Around a Guide", "Place each child beside one guide"),
            (
                "auto",
                "Automatic",
                ("Add as many children as full hair needs; none if the curves already suffice"),
            ),
        ),
        label="Method",
        description="How children are interpolated from guides",
        source=_TARIQ,
    )
    strand_count: int = integer(
        4095,
        label="Strands",
        description="Number of children; raising it adds children without moving the others",
        soft=(100, 20_000),
        hard=(0, 500_000),
        source=_NALU,
        shown_when=when("children.method", "multi", "single"),
    )
    parting: float = number(
        math.radians(60.0),
        label="Parting",
        description="Maximum angle between guides that are blended; guides that diverge more form "
        "a parting",
        unit="angle",
        soft=(math.radians(10.0), math.radians(90.0)),
        hard=(0.0, math.pi),
        shown_when=when("children.method", "multi", "single", "auto"),
        active_when=_PARTS,
    )
    scatter: float = number(
        0.0,
        label="Scatter",
        description="Random distance from which each child takes its shape, in multiples of the "
        "spacing of guides. Use it for fur, whose hairs differ from their neighbours",
        soft=(0.0, 2.0),
        hard=(0.0, 100.0),
        shown_when=when("children.method", "multi"),
        is_painted=True,
    )
    length: float = number(
        1.0,
        label="Length",
        description="Length of children relative to their guides",
        unit="factor",
        soft=(0.1, 1.0),
        hard=(0.001, 1.0),
        shown_when=when("children.method", "multi", "single", "auto"),
        is_painted=True,
    )
    length_variation: float = number(
        0.2,
        label="Length Variation",
        description="Maximum fraction by which a child is shorter than its guides",
        unit="factor",
        soft=(0.0, 0.9),
        hard=(0.0, 0.99),
        shown_when=when("children.method", "multi", "single"),
    )
    clump: float = number(
        0.5,
        label="Clump",
        description="Amount by which the children of a clump are pulled together",
        unit="factor",
        soft=(0.0, 1.0),
        hard=(0.0, 1.0),
        shown_when=when("children.method", "multi", "single"),
        is_painted=True,
    )
    clump_along: tuple[float, float, float, float, float] = curve(
        (0.0, 0.25, 0.5, 0.75, 1.0),
        label="Clump Along",
        description="Factor on Clump along the strand, from root to tip",
        hard=(0.0, 1.0),
        shown_when=when("children.method", "multi", "single"),
        active_when=_HAS_CLUMPS,
    )
    clump_size: int = integer(
        12,
        label="Clump Size",
        description="Average number of children in a clump; 1 turns clumps off",
        soft=(1, 100),
        hard=(1, 100_000),
        shown_when=when("children.method", "multi", "single"),
        active_when=_HAS_CLUMPS,
    )
    frizz: float = number(
        0.004,
        label="Frizz",
        description="Distance by which single children stray from their path, as a fraction of "
        "the hair's length",
        soft=(0.0, 0.05),
        hard=(0.0, 1.0),
        shown_when=when("children.method", "multi", "single"),
        is_painted=True,
    )
    frizz_along: tuple[float, float, float, float, float] = curve(
        (0.0, 0.4, 0.7, 0.9, 1.0),
        label="Frizz Along",
        description="Factor on Frizz along the strand, from root to tip",
        hard=(0.0, 1.0),
        shown_when=when("children.method", "multi", "single"),
        active_when=_HAS_FRIZZ,
    )
    frizz_length: float = number(
        0.12,
        label="Frizz Length",
        description="Distance along the hair from one bend of the frizz to the next, as a "
        "fraction of the hair's length",
        soft=(0.02, 1.0),
        hard=(0.001, 100.0),
        shown_when=when("children.method", "multi", "single"),
        active_when=_HAS_FRIZZ,
    )
    fly_aways: float = number(
        0.0,
        label="Fly-Aways",
        description="Fraction of the children that leave their clump, increasingly towards their "
        "tips",
        unit="factor",
        soft=(0.0, 0.2),
        hard=(0.0, 1.0),
        shown_when=when("children.method", "multi", "single"),
        is_painted=True,
    )
    baby_hair: float = number(
        0.8,
        label="Baby Hair",
        description="Fraction of the children at the hairline that are short and fine; it "
        "decreases away from the hairline",
        unit="factor",
        soft=(0.0, 1.0),
        hard=(0.0, 1.0),
        shown_when=when("children.method", "multi", "single", "auto"),
    )
    curl: float = number(
        0.0,
        label="Curl",
        description="Radius of the curls that children wind around their path, as a fraction of "
        "the hair's length",
        soft=(0.0, 0.05),
        hard=(0.0, 1.0),
        shown_when=when("children.method", "multi", "single"),
        is_painted=True,
    )
    curl_length: float = number(
        0.12,
        label="Curl Length",
        description="Distance along the path from one turn of a curl to the next, as a fraction "
        "of the hair's length",
        soft=(0.02, 1.0),
        hard=(0.001, 100.0),
        shown_when=when("children.method", "multi", "single"),
        active_when=_HAS_CURL,
    )
    curl_along: tuple[float, float, float, float, float] = curve(
        (0.0, 0.5, 0.9, 1.0, 1.0),
        label="Curl Along",
        description="Factor on Curl along the strand, from root to tip",
        hard=(0.0, 1.0),
        shown_when=when("children.method", "multi", "single"),
        active_when=_HAS_CURL,
    )
    width: float = number(
        1.0,
        label="Width",
        description="Width of children relative to their guides",
        soft=(0.1, 4.0),
        hard=(0.001, 1000.0),
        shown_when=when("children.method", "multi", "single", "auto"),
        is_painted=True,
    )
    seed: int = integer(
        1,
        label="Seed",
        description="Random seed of the children",
        soft=(0, 100),
        hard=(0, 2**31 - 1),
        shown_when=when("children.method", "multi", "single", "auto"),
    )
