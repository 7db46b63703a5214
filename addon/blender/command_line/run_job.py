"""The verb `run`: runs one of the operators behind the artist's buttons on a scene."""

from __future__ import annotations

import argparse
from dataclasses import dataclass
from difflib import get_close_matches
from typing import Any

import bpy

from ...errors import HairloomError
from ..base.objects import check_editable
from ..base.outcome import Reports, collected_reports
from .job_options import add_object_option, add_save_option
from .job_steps import Job, report_notes
from .object_settings import change_settings, check_sections, named_objects
from .overrides import plain_value
from .scene_files import check_scene_output, save_scene
from .verb import SCENE_OUTPUT, Verb

#: operators that change a scene
_SCENE_OPERATORS = (
    "use_groom",
    "convert_particles",
    "set_surface",
    "unwrap_surface",
    "snap_roots",
    "apply_scale",
    "show_in_renders",
    "mute_hair_dynamics",
    "apply_preset",
    "add_preset",
    "grow_again",
    "look_from_material",
    "look_to_material",
    "make_real",
    "fin_add",
    "fin_remove",
    "add_hair_tie",
    "remove_hair_tie",
    "add_parting",
    "remove_parting",
    "comb_parting",
    "add_stroke",
    "remove_stroke",
    "comb_flow",
    "revert_flow",
    "trim_to_shape",
    "remove_trim_shape",
    "revert_trim",
    "mirror_hair",
    "settle",
    "revert_settle",
    "fit_spheres",
    "remove_spheres",
    "make_cards",
    "discard_card_edits",
    "add_card_along_curve",
    "sort_cards",
    "add_hairstyle",
    "place_landmarks",
    "fit_again",
    "sample_scene",
)
#: operators that change the artist's own presets instead
_PRESET_OPERATORS = ("save_preset", "delete_preset")
OPERATORS = (*_SCENE_OPERATORS, *_PRESET_OPERATORS)


def run_operator(job: Job) -> None:
    """Run one of Hairloom's operators on objects of a scene, or only change their settings.

    Each works as its button does. --preset and --set SECTION.NAME=VALUE change the settings of the
    objects first, --set NAME=VALUE is a property of the operator.
    """
    options = job.options
    if not (options.operator or options.set or options.preset):
        _check_nothing_requested(options)
        _list_operators()
        return
    changes_scene = options.operator not in _PRESET_OPERATORS
    if changes_scene:
        check_scene_output(options.output, overwrites=options.save)
    operator = _Operator.named(options.operator) if options.operator else None
    own = [each for each in options.set if "." not in each.partition("=")[0]]
    values = operator.values(own) if operator is not None else _refuse_properties(own)
    _select(named_objects(options.object, lambda _: True, "an object"))
    settings = [each for each in options.set if each not in own]
    if options.preset or settings:
        _change_settings(job, settings)
    if operator is not None:
        with job.report.stage(operator.name):
            reports = operator.run(values)
        job.report.facts["operator"] = operator.name
        job.report.facts["messages"] = reports.messages
        for message in reports.messages:
            print(message, flush=True)
        report_notes(reports.warnings, job.report)
    if changes_scene:
        with job.report.stage("save scene"):
            saved = save_scene(options.output)
        job.report.add_output(saved)
        print(f"Wrote {saved}")


def _check_nothing_requested(options: argparse.Namespace) -> None:
    """Raises:
    HairloomError: an option for a changed scene is given, so the operator was forgotten.
    """
    if options.output or options.save or options.object:
        raise HairloomError(
            "there is nothing to do",
            place="run",
            remedy="Name an operator (`run` alone lists them), or give --preset or --set",
        )


@dataclass(frozen=True)
class _Operator:
    """An operator that can run without a window, and its registered class."""

    name: str
    kind: type[Any]

    @classmethod
    def named(cls, name: str) -> _Operator:
        """Raises:
        HairloomError: no operator of this name runs without a window.
        """
        if name not in OPERATORS:
            raise _unknown(f"no operator '{name}' changes a scene", name, OPERATORS)
        return cls(name, getattr(bpy.types, f"HAIRLOOM_OT_{name}"))

    @property
    def rna(self) -> Any:
        return getattr(bpy.ops.hairloom, self.name).get_rna_type()

    @property
    def properties(self) -> dict[str, bpy.types.Property]:
        properties = self.rna.properties
        return {
            each.identifier: each
            for each in properties
            if each.identifier != "rna_type" and not each.is_hidden
        }

    def values(self, assignments: list[str]) -> dict[str, Any]:
        """The properties from NAME=VALUE arguments.

        Raises:
            HairloomError: there is no such property, or the value cannot be used.
        """
        known, values = self.properties, dict[str, Any]()
        for assignment in assignments:
            name, equals, text = assignment.partition("=")
            if name not in known or not equals:
                raise _unknown(f"{self.name} has no property '{name}'", "--set", known)
            values[name] = _value(known[name], text)
        return values

    def run(self, values: dict[str, Any]) -> Reports:
        """Run the operator.

        Raises:
            HairloomError: its button would be grey, or it has failed.
        """
        reason = self._disabled_reason()
        if reason:
            raise HairloomError(
                reason.rstrip("."), place=self.name, remedy="Name what it needs with --object"
            )
        with collected_reports() as reports:
            result = getattr(bpy.ops.hairloom, self.name)(**values)
        if reports.error is not None:
            raise reports.error
        assert result == {"FINISHED"}, f"{self.name} has not finished and does not say why"
        return reports

    def _disabled_reason(self) -> str:
        """Why the button would be grey, as its tooltip says; empty if it would not be."""
        messages: list[str] = []

        class PollProbe(self.kind):  # type: ignore[name-defined]
            poll_message_set = classmethod(lambda _cls, message: messages.append(message))

        if not hasattr(PollProbe, "poll") or PollProbe.poll(bpy.context):
            return ""
        return messages[-1] if messages else "it cannot run here"


def _value(rna_property: Any, text: str) -> Any:
    """The value of a text for this property.

    Raises:
        HairloomError: it has another type, or is out of range.
    """
    if rna_property.type == "STRING":
        return text
    if rna_property.type == "ENUM":
        choices = [item.identifier for item in rna_property.enum_items]
        if text not in choices:
            raise _unknown(f"{rna_property.identifier} cannot be '{text}'", "--set", choices)
        return text
    value = plain_value(text)
    values = value if isinstance(value, list) else [value]
    kinds: tuple[type, ...] = {"BOOLEAN": (bool,), "INT": (int,)}.get(
        rna_property.type, (int, float)
    )
    is_number = all(
        isinstance(each, kinds) and (bool in kinds or not isinstance(each, bool)) for each in values
    )
    if not is_number or len(values) != max(rna_property.array_length, 1):
        raise HairloomError(
            f"{rna_property.identifier} cannot be '{text}'",
            place="--set",
            remedy=f"Use {_KINDS[rna_property.type]}",
        )
    if rna_property.type != "BOOLEAN" and not all(
        rna_property.hard_min <= each <= rna_property.hard_max for each in values
    ):
        raise HairloomError(
            f"{rna_property.identifier} cannot be {text}",
            place="--set",
            remedy=f"Use a value from {rna_property.hard_min:g} to {rna_property.hard_max:g}",
        )
    return value


_KINDS = {"BOOLEAN": "true or false", "INT": "a whole number", "FLOAT": "a number"}


def _refuse_properties(assignments: list[str]) -> dict[str, Any]:
    """Refuse properties, since without an operator there are none."""
    if assignments:
        raise HairloomError(
            f"'{assignments[0]}' does not name a parameter",
            place="--set",
            remedy="Write SECTION.NAME=VALUE, or name an operator that has this property",
        )
    return {}


def _select(objects: list[bpy.types.Object]) -> None:
    """Select only these, with the last one active; for none, keep the selection of the file."""
    if not objects:
        return
    for obj in bpy.context.selected_objects:
        obj.select_set(False)
    for obj in objects:
        obj.select_set(True)
        bpy.context.view_layer.objects.active = obj


def _change_settings(job: Job, assignments: list[str]) -> None:
    """Apply --preset and --set SECTION.NAME=VALUE to the selected hair and meshes."""
    chosen = [obj for obj in bpy.context.selected_objects if obj.type in {"CURVES", "MESH"}]
    if not chosen:
        raise HairloomError(
            "there is no object whose settings could be changed",
            place="--object",
            remedy="Name hair curves or a mesh of the scene",
        )
    if job.options.operator != "fin_add":  # its mesh becomes cloth, which has these settings
        check_sections(chosen, job.options.preset, assignments)
    for obj in chosen:
        check_editable(obj)
        grows_again = job.options.operator == "grow_again"
        change_settings(obj, job.options.preset, assignments, grows_again=grows_again)
    job.report.facts["objects"] = [obj.name for obj in chosen]


def _unknown(problem: str, place: str, known: Any) -> HairloomError:
    """An error whose remedy lists similar names, or all known ones."""
    wrong = problem.split("'")[1]
    suggestions = get_close_matches(wrong, known) or list(known)
    remedy = "Use one of " + ", ".join(suggestions) if suggestions else "Omit it"
    return HairloomError(problem, place=place, remedy=remedy)


def _line(text: str) -> str:
    return " ".join(text.split())


def _list_operators() -> None:
    """Print each operator with its description and properties."""
    for name in OPERATORS:
        operator = _Operator.named(name)
        print(f"{name}: {_line(operator.rna.description)}.")
        for each in operator.properties.values():
            print(f"    {each.identifier}: {each.description}")


def _add_options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "operator",
        nargs="?",
        metavar="OPERATOR",
        help=f"one of {', '.join(OPERATORS)} (default: only change settings; without settings, "
        "list the operators and their properties)",
    )
    add_save_option(parser)
    add_object_option(
        parser,
        "object to work on; can be repeated, the last one is active (default: the selection saved "
        "in the scene)",
    )
    parser.add_argument(
        "--preset",
        action="append",
        default=[],
        metavar="NAME",
        help="preset for the objects, such as looks/blond, or a preset file; can be repeated",
    )
    parser.add_argument(
        "--set",
        action="append",
        default=[],
        metavar="NAME=VALUE",
        help="property of the operator, such as sphere_count=8, or setting of the objects, such "
        "as dynamics.damping=2 (see docs/parameters.md); can be repeated",
    )


RUN = Verb(
    "run",
    run_operator,
    _add_options,
    output=SCENE_OUTPUT,
    needs_output=False,
    takes_hair=False,
    takes_settings=False,
    operators=OPERATORS,
)
