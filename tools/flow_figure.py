"""The figure of docs/dev/architecture.md: who calls whom in the three flows, floor by floor.

Each flow is a tree of calls: a line is a file of addon/ and a function or class in it, indented
under its caller. `tests/pure/test_flow_figure.py` checks every line against the source: the
function exists, and the caller's file imports and names it. `make docs` draws the figure.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

REPOSITORY = Path(__file__).resolve().parents[1]
FIGURE = REPOSITORY / "docs" / "images" / "flows.svg"

#: Floors from top to bottom: calls go down, data comes back up by value.
_FLOORS = """
    ui
    blender/command_line blender/setup blender/engine blender/pictures blender/preview
    blender/viewport blender/sessions blender/strands blender/cards blender/bakes
    blender/colliders blender/scene blender/properties blender/base
    render
    card_flow motion_flow rig_flow
    exchange cards shading refine dynamics groom strands params
"""
FLOORS = tuple(_FLOORS.split())

FLOWS = {
    "1. Curves to picture": """
ui/operators_preview.py start_preview
  blender/preview/previews.py start
    blender/sessions/session.py Session
      blender/sessions/groom_source.py GroomSource
        blender/scene/source.py read_source
      blender/sessions/prepared_groom.py build_groom
        rig_flow.py prepare
          groom/guides.py choose_guides
          groom/weights.py guide_weights
    blender/viewport/overlay.py show
      render/groom_pass.py GroomPass
        render/strand_pass.py StrandPass
""",
    "2. Curves to cards file": """
ui/operators_card_export.py HAIRLOOM_OT_export_cards
  blender/cards/files.py CardExport
    blender/cards/build.py CardInputs
      blender/scene/source.py read_source
    blender/cards/build.py build_steps
      card_flow.py card_build_steps
        cards/build.py card_steps
      render/atlas_pass.py baked_maps
    blender/cards/textures.py write_textures
      exchange/textures/card_textures.py write_card_textures
    blender/cards/exporters.py write_card_mesh
    exchange/cards/sidecar.py sidecar_text
""",
    "3. Timeline frame to moving hair": """
blender/preview/handlers.py register
  blender/preview/scene_events.py frame_changed
    blender/preview/preview.py Preview
      blender/preview/phases.py next_phase
      blender/sessions/session.py advance
        blender/colliders/scene_colliders.py SceneColliders
        blender/sessions/solvers.py make_solver
          blender/sessions/compute_solver.py ComputeSolver
            render/dynamics_pass.py DynamicsPass
          blender/sessions/numpy_solver.py NumpySolver
            motion_flow.py steps
              dynamics/step.py advance_in_steps
    blender/preview/previews.py attempt
      blender/viewport/overlay.py show
        render/groom_pass.py GroomPass
          render/strand_pass.py StrandPass
""",
}
#: colours of floors: the window, Blender, the GPU, pure Python
_FLOOR_COLORS = {"ui": "#d6e6fa", "blender": "#fae8c8", "render": "#d8f0d4"}
_PURE_COLOR = "#e6e2f2"
_BOX, _GAP, _ROW, _LEFT, _TITLE = (150, 36), 10, 56, 118, 40


@dataclass
class Step:
    """A function or class `name` of `file`, and what it calls.

    column: from 0, one for each leaf. row: from 0, within the floor.
    """

    file: str
    name: str
    calls: list[Step] = field(default_factory=list)
    column: int = 0
    row: int = 0

    @property
    def floor(self) -> str:
        parts = Path(self.file).with_suffix("").parts
        return "/".join(parts[:2]) if parts[0] == "blender" else parts[0]


def steps_of(flow: str) -> list[Step]:
    """The steps at the top of a flow's tree; raises ValueError where an indentation is skipped."""
    roots: list[Step] = []
    path: list[Step] = []
    for line in flow.strip("\n").splitlines():
        depth, step = (len(line) - len(line.lstrip())) // 2, Step(*line.split())
        if depth > len(path):
            raise ValueError(f"{line}: indented by more than one step")
        del path[depth:]
        (path[-1].calls if path else roots).append(step)
        path.append(step)
    return roots


def arrows(steps: list[Step]) -> list[tuple[Step, Step]]:
    """(caller, called) of a tree, in the order of the calls."""
    pairs = []
    for step in steps:
        for called in step.calls:
            pairs += [(step, called), *arrows([called])]
    return pairs


def figure() -> str:
    """The three flows, one below the other, as SVG."""
    panels, top = [], 0
    flows = {title: steps_of(flow) for title, flow in FLOWS.items()}
    columns = max(_place_columns(tops, 0) for tops in flows.values())
    width = _LEFT + columns * (_BOX[0] + _GAP)
    for title, tops in flows.items():
        panel, height = _panel(title, tops, top, width)
        panels.append(panel)
        top += height
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{width}" height="{top}" '
        f'viewBox="0 0 {width} {top}" font-family="Helvetica, Arial, sans-serif">\n'
        '<defs><marker id="tip" viewBox="0 0 8 8" refX="7" refY="4" markerWidth="7" '
        'markerHeight="7" orient="auto"><path d="M0 0 L8 4 L0 8 z" fill="#555"/></marker></defs>\n'
        f'<rect width="{width}" height="{top}" fill="#ffffff"/>\n'
        + "\n".join(panels)
        + "\n</svg>\n"
    )


def _all_steps(steps: list[Step]) -> list[Step]:
    return [each for step in steps for each in (step, *_all_steps(step.calls))]


def _place_columns(steps: list[Step], column: int) -> int:
    """Place a leaf in each column, a caller above its first call; calls within a floor go down a
    row."""
    for step in steps:
        for called in step.calls:
            called.row = step.row + 1 if called.floor == step.floor else 0
        next_column = _place_columns(step.calls, column) if step.calls else column + 1
        step.column, column = column, next_column
    return column


def _panel(title: str, tops: list[Step], top: int, right: int) -> tuple[str, int]:
    """One flow from `top` on, and its height."""
    steps = _all_steps(tops)
    parts = [f'<text x="8" y="{top + 26}" font-size="16" font-weight="bold">{title}</text>']
    y, starts = top + _TITLE, {}
    for floor in FLOORS:
        rows = [step.row + 1 for step in steps if step.floor == floor]
        if not rows:
            continue
        starts[floor], height = y, max(rows) * _ROW
        color = _FLOOR_COLORS.get(floor.partition("/")[0], _PURE_COLOR)
        name = f"{floor}.py" if floor.endswith("_flow") else f"{floor}/"
        parts.append(
            f'<rect x="0" y="{y}" width="{right}" height="{height - 4}" fill="{color}"/>'
            f'<text x="8" y="{y + _ROW // 2 + 2}" font-size="11" fill="#444">{name}</text>'
        )
        y += height

    def corner(step: Step) -> tuple[int, int]:
        x = _LEFT + step.column * (_BOX[0] + _GAP)
        return x, starts[step.floor] + step.row * _ROW + (_ROW - 4 - _BOX[1]) // 2

    for caller, called in arrows(tops):
        (x0, y0), (x1, y1) = corner(caller), corner(called)
        if called.column == caller.column:
            path = f"M{x0 + 16} {y0 + _BOX[1]} V{y1 - 1}"
        else:
            path = f"M{x0 + _BOX[0]} {y0 + _BOX[1] // 2} H{x1 + 16} V{y1 - 1}"
        parts.append(
            f'<path d="{path}" fill="none" stroke="#555" stroke-width="1.2" '
            'marker-end="url(#tip)"/>'
        )
    for step in steps:
        x, y_box = corner(step)
        name = step.name.removeprefix("HAIRLOOM_OT_")
        parts.append(
            f'<rect x="{x}" y="{y_box}" width="{_BOX[0]}" height="{_BOX[1]}" rx="4" '
            f'fill="#ffffff" stroke="#777"/><text x="{x + 8}" y="{y_box + 15}" font-size="11.5" '
            f'font-weight="bold">{name}</text><text x="{x + 8}" y="{y_box + 28}" '
            f'font-size="9.5" fill="#555">{Path(step.file).name}</text>'
        )
    return "\n".join(parts), y - top + 16


if __name__ == "__main__":
    FIGURE.write_text(figure(), encoding="utf-8")
