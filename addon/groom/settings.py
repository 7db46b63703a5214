"""What the artist sets about growing a groom and choosing its guides."""

from __future__ import annotations

from dataclasses import dataclass

from ..params import Settings, both, choice, either, integer, number, toggle, when

_NALU = "Nguyen and Donnelly 2005, GPU Gems 2, chapter 23"
_HAS_THRESHOLD = both(when("grow.method", "normals"), when("grow.per_vertex"))
_HAS_COUNT = either(when("grow.method", "combed"), when("grow.per_vertex", False))


@dataclass(frozen=True, kw_only=True)
class GrowSettings(Settings):
    """Hair grown from a mesh: where it leaves the scalp, how it is combed and how it falls."""

    section = "grow"
    title = "Grow"

    method: str = choice(
        "combed",
        (
            ("combed", "Combed", "A groom on an upright head, combed and fallen around it"),
            ("normals", "Along Normals", "Straight out of any mesh, as guides to be styled"),
        ),
        label="Method",
        description="How hair leaves the mesh",
        source=_NALU,
    )
    per_vertex: bool = toggle(
        False,
        label="One per Vertex",
        description="Along the normals: one strand from each vertex instead of a number of strands",
        source=_NALU,
        shown_when=when("grow.method", "normals"),
    )
    threshold: float = number(
        0.5,
        label="Threshold",
        description="With one strand a vertex: density above which a vertex grows it",
        unit="factor",
        soft=(0.0, 1.0),
        hard=(0.0, 1.0),
        shown_when=_HAS_THRESHOLD,
    )
    strand_count: int = integer(
        4095,
        label="Strands",
        description="How many strands grow",
        soft=(100, 20_000),
        hard=(0, 500_000),
        source=_NALU,
        shown_when=_HAS_COUNT,
    )
    cv_count: int = integer(
        16,
        label="Points",
        description="Points of each strand",
        soft=(8, 32),
        hard=(4, 64),
        source=_NALU,
    )
    length: float = number(
        0.24,
        label="Length",
        description="Length of the longest strands",
        unit="length",
        soft=(0.01, 0.6),
        hard=(0.0001, 100.0),
    )
    length_variation: float = number(
        0.25,
        label="Length Variation",
        description="How much shorter than the longest a strand may be",
        unit="factor",
        soft=(0.0, 0.9),
        hard=(0.0, 0.99),
    )
    segment_ratio: float = number(
        1.06,
        label="Segment Ratio",
        description="Length of each segment as a factor of the one before it, root to tip",
        soft=(1.0, 1.3),
        hard=(0.5, 2.0),
        source=_NALU,
    )
    lift: float = number(
        0.45,
        label="Lift",
        description="How steeply hair leaves the scalp: 0 lies flat as combed, 1 stands up",
        unit="factor",
        soft=(0.0, 1.0),
        hard=(0.0, 1.0),
        shown_when=when("grow.method", "combed"),
    )
    comb_back: float = number(
        0.7,
        label="Comb Back",
        description="Hair is combed to the back of the head (world +Y) rather than to its sides",
        unit="factor",
        soft=(0.0, 1.0),
        hard=(0.0, 1.0),
        shown_when=when("grow.method", "combed"),
    )
    comb_fraction: float = number(
        0.45,
        label="Comb Fraction",
        description="Part of the strand that follows the comb before the hair falls",
        unit="factor",
        soft=(0.0, 1.0),
        hard=(0.0, 1.0),
        shown_when=when("grow.method", "combed"),
    )
    droop: float = number(
        0.45,
        label="Droop",
        description="How much each 2 cm of hair turn towards the direction in which it falls",
        unit="factor",
        soft=(0.0, 0.9),
        hard=(0.0, 1.0),
        shown_when=when("grow.method", "combed"),
    )
    clump: float = number(
        0.85,
        label="Clump",
        description="How far the tips of a lock are drawn together",
        unit="factor",
        soft=(0.0, 1.0),
        hard=(0.0, 1.0),
        shown_when=when("grow.method", "combed"),
    )
    clump_size: int = integer(
        30,
        label="Strands per Clump",
        description="How many strands make a lock, on average",
        soft=(1, 100),
        hard=(1, 100_000),
        shown_when=when("grow.method", "combed"),
    )
    wave: float = number(
        0.007,
        label="Wave",
        description="How far the locks swing to and fro",
        unit="length",
        soft=(0.0, 0.02),
        hard=(0.0, 1.0),
        shown_when=when("grow.method", "combed"),
    )
    wave_length: float = number(
        0.075,
        label="Wave Length",
        description="Length of hair from one crest of the wave to the next",
        unit="length",
        soft=(0.01, 0.3),
        hard=(0.001, 100.0),
        shown_when=when("grow.method", "combed"),
    )
    frizz: float = number(
        0.001,
        label="Frizz",
        description="How far single strands stray from their lock",
        unit="length",
        soft=(0.0, 0.01),
        hard=(0.0, 1.0),
        shown_when=when("grow.method", "combed"),
    )
    clearance: float = number(
        0.002,
        label="Clearance",
        description="Least distance of the hair from the surface, away from its roots",
        unit="length",
        soft=(0.0, 0.02),
        hard=(0.0, 1.0),
        shown_when=when("grow.method", "combed"),
    )
    volume: float = number(
        0.018,
        label="Volume",
        description="Thickness of the layer in which hair lies on the head",
        unit="length",
        soft=(0.0, 0.05),
        hard=(0.0, 10.0),
        shown_when=when("grow.method", "combed"),
    )
    radius: float = number(
        2.0e-4,
        label="Radius",
        description="Radius of the strands; wider than a hair where few strands stand for many",
        unit="length",
        soft=(1.0e-5, 5.0e-4),
        hard=(1.0e-7, 0.1),
    )
    seed: int = integer(
        1,
        label="Seed",
        description="Another seed gives another groom of the same kind",
        soft=(0, 100),
        hard=(0, 2**31 - 1),
    )


@dataclass(frozen=True, kw_only=True)
class GuideSettings(Settings):
    """Which strands are simulated, so that all others can follow them."""

    section = "guides"
    title = "Guides"
    owner = "groom"

    guide_count: int = integer(
        762,
        label="Guides",
        description="How many strands are simulated; every group of strands gets at least one",
        soft=(50, 4000),
        hard=(1, 100_000),
        source=_NALU,
    )
    cv_count: int = integer(
        16,
        label="Points",
        description="Points of each strand in simulation and drawing",
        soft=(8, 32),
        hard=(4, 64),
        source=_NALU,
    )
    seed: int = integer(
        1,
        label="Seed",
        description="Another seed chooses other strands as guides",
        soft=(0, 100),
        hard=(0, 2**31 - 1),
    )
