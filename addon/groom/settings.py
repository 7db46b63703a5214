"""Settings of growing a groom and of choosing its guides."""

from __future__ import annotations

from dataclasses import dataclass

from ..params import Settings, both, choice, either, integer, number, toggle, when

_NALU = "Nguyen and Donnelly 2005, GPU Gems 2, chapter 23"
_HAS_THRESHOLD = both(when("grow.method", "normals"), when("grow.per_vertex"))
_HAS_RIGHT = both(when("grow.method", "combed"), when("grow.each_side"))
_HAS_COUNT = either(when("grow.method", "combed"), when("grow.per_vertex", False))


@dataclass(frozen=True, kw_only=True)
class GrowSettings(Settings):
    """Hair grown from a mesh: where it leaves the scalp, how it is combed and how it falls."""

    section = "grow"
    title = "Grow"
    help_page = "styling#grow"
    owner = "groom"
    is_animatable = False

    method: str = choice(
        "combed",
        (
            ("combed", "Combed", "Hair on an upright head, combed and falling around it"),
            (
                "normals",
                "Along Normals",
                "Straight out of any mesh: fur, or guides to style by hand",
            ),
        ),
        label="Method",
        description="Direction in which hair grows from the mesh",
        source=_NALU,
    )
    per_vertex: bool = toggle(
        False,
        label="One per Vertex",
        description="Grow one strand from each vertex instead of a given number of strands",
        source=_NALU,
        shown_when=when("grow.method", "normals"),
    )
    threshold: float = number(
        0.5,
        label="Threshold",
        description="Density above which a vertex grows a strand",
        unit="factor",
        soft=(0.0, 1.0),
        hard=(0.0, 1.0),
        shown_when=_HAS_THRESHOLD,
    )
    strand_count: int = integer(
        4_000,
        label="Strands",
        description="Number of strands to grow",
        soft=(100, 20_000),
        hard=(0, 500_000),
        source=_NALU,
        shown_when=_HAS_COUNT,
    )
    cv_count: int = integer(
        16,
        label="Points",
        description="Number of points per strand",
        soft=(8, 32),
        hard=(4, 64),
        source=_NALU,
    )
    length: float = number(
        0.25,
        label="Length",
        description="Length of the longest strands",
        unit="length",
        soft=(0.01, 0.6),
        hard=(0.0001, 100.0),
    )
    length_variation: float = number(
        0.25,
        label="Length Variation",
        description="Maximum fraction by which a strand is shorter than the longest",
        unit="factor",
        soft=(0.0, 0.9),
        hard=(0.0, 0.99),
    )
    segment_ratio: float = number(
        1.06,
        label="Segment Ratio",
        description="Length of each segment relative to the previous one, from root to tip",
        soft=(1.0, 1.3),
        hard=(0.5, 2.0),
        source=_NALU,
    )
    lift: float = number(
        0.15,
        label="Lift",
        description="Angle at which hair leaves the surface: 0 lies flat, 1 stands up; hair along "
        "normals is straight at 1",
        unit="factor",
        soft=(0.0, 1.0),
        hard=(0.0, 1.0),
        shown_when=_HAS_COUNT,
    )
    whorl: float = number(
        1.0,
        label="Whorl",
        description="Amount by which hair that is too short to comb turns around a whorl at the "
        "crown",
        unit="factor",
        soft=(0.0, 1.0),
        hard=(0.0, 1.0),
        shown_when=when("grow.method", "combed"),
    )
    comb_back: float = number(
        0.65,
        label="Comb Back",
        description="Amount of combing to the back of the head (world +Y) instead of to the "
        "sides; negative values comb forward, over the face",
        unit="factor",
        soft=(-1.0, 1.0),
        hard=(-1.0, 1.0),
        shown_when=when("grow.method", "combed"),
    )
    comb_aside: float = number(
        1.0,
        label="Comb Aside",
        description="Amount of combing away from the middle of the head, for hair not combed back "
        "or forward; negative values comb across the middle to the other side",
        unit="factor",
        soft=(-1.0, 1.0),
        hard=(-1.0, 1.0),
        shown_when=when("grow.method", "combed"),
    )
    each_side: bool = toggle(
        False,
        label="Each Side",
        description="Use separate values for the right side of the head (world -X)",
        shown_when=when("grow.method", "combed"),
    )
    right_back: float = number(
        0.65,
        label="Right Back",
        description="Comb Back for the right side",
        unit="factor",
        soft=(-1.0, 1.0),
        hard=(-1.0, 1.0),
        shown_when=_HAS_RIGHT,
    )
    right_aside: float = number(
        1.0,
        label="Right Aside",
        description="Comb Aside for the right side; at -1 hair is swept across to the left",
        unit="factor",
        soft=(-1.0, 1.0),
        hard=(-1.0, 1.0),
        shown_when=_HAS_RIGHT,
    )
    comb_fraction: float = number(
        0.45,
        label="Comb Fraction",
        description="Fraction of the strand, from the root, that follows the comb before it falls",
        unit="factor",
        soft=(0.0, 1.0),
        hard=(0.0, 1.0),
        shown_when=when("grow.method", "combed"),
    )
    droop: float = number(
        0.45,
        label="Droop",
        description="Fraction by which hair turns towards its falling direction over each 2 cm",
        unit="factor",
        soft=(0.0, 0.9),
        hard=(0.0, 1.0),
        shown_when=when("grow.method", "combed"),
    )
    clump: float = number(
        0.3,
        label="Clump",
        description="Amount by which the tips of a clump are pulled together",
        unit="factor",
        soft=(0.0, 1.0),
        hard=(0.0, 1.0),
        shown_when=when("grow.method", "combed"),
    )
    clump_size: int = integer(
        30,
        label="Clump Size",
        description="Average number of strands in a clump",
        soft=(1, 100),
        hard=(1, 100_000),
        shown_when=when("grow.method", "combed"),
    )
    wave: float = number(
        0.006,
        label="Wave",
        description="Amplitude of the waves in each clump",
        unit="length",
        soft=(0.0, 0.02),
        hard=(0.0, 1.0),
        shown_when=when("grow.method", "combed"),
    )
    wave_length: float = number(
        0.1,
        label="Wave Length",
        description="Distance along the hair from one wave crest to the next",
        unit="length",
        soft=(0.01, 0.3),
        hard=(0.001, 100.0),
        shown_when=when("grow.method", "combed"),
    )
    frizz: float = number(
        0.0015,
        label="Frizz",
        description="Distance by which single strands stray from their clump",
        unit="length",
        soft=(0.0, 0.01),
        hard=(0.0, 1.0),
        shown_when=when("grow.method", "combed"),
    )
    clearance: float = number(
        0.002,
        label="Clearance",
        description="Minimum distance of the hair from the surface, away from its roots",
        unit="length",
        soft=(0.0, 0.02),
        hard=(0.0, 1.0),
        shown_when=when("grow.method", "combed"),
    )
    volume: float = number(
        0.03,
        label="Volume",
        description="Thickness of the layer of hair on the head",
        unit="length",
        soft=(0.0, 0.05),
        hard=(0.0, 10.0),
        shown_when=when("grow.method", "combed"),
    )
    seed: int = integer(
        1,
        label="Seed",
        description="Random seed of the groom",
        soft=(0, 100),
        hard=(0, 2**31 - 1),
    )


@dataclass(frozen=True, kw_only=True)
class GuideSettings(Settings):
    """Which strands are simulated, so that all others can follow them."""

    section = "guides"
    title = "Guides"
    help_page = "user_guide#strands-and-children"
    owner = "groom"
    is_animatable = False
    panel_after = "strands"
    panels = ("Ties",)

    guide_count: int = integer(
        762,
        label="Guides",
        description="Number of strands to simulate; every group of strands gets at least one",
        soft=(50, 4000),
        hard=(1, 100_000),
        source=_NALU,
    )
    cv_count: int = integer(
        16,
        label="Points",
        description="Number of simulated points per guide; strands keep as many points as they "
        "need",
        soft=(8, 32),
        hard=(4, 64),
        source=_NALU,
    )
    seed: int = integer(
        1,
        label="Seed",
        description="Random seed for the choice of guides",
        soft=(0, 100),
        hard=(0, 2**31 - 1),
    )
    tip_distance: float = number(
        0.02,
        label="Tip Distance",
        description="Maximum distance at which the Held Tips mesh holds a tip, as a fraction of "
        "the hair's length",
        soft=(0.0, 0.1),
        hard=(0.0, 1.0),
        source="Hairloom",
        panel="Ties",
    )
