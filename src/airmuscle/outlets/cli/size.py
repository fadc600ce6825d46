"""`airmuscle size`: muscles of the catalogue for a lift or a joint."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any

import typer

from ...core.atomic_output import atomic_folder, check_writable
from ...core.errors import AirmuscleError, UnitError
from ...core.units import quantity
from ...design.sizing import (
    SORT_KEYS,
    JointRequirement,
    LiftRequirement,
    MuscleChoice,
    SizingConditions,
    SizingResult,
    scenario_text,
    size_muscles,
)
from ...design.sizing.choice import Requirement
from ...design.sizing.sizing_chapter import choice_row, sizing_chapter
from ...files.library.entry_file import load_law
from ...report.formatting import format_number
from ...report.write import write_into
from .options import Json, OptionalFolder
from .progress import computation_progress
from .terminal import echo, print_json, print_table

SCENARIO_FILE = "scenario.toml"
FIRST = ("muscle", "number", "length [mm]", "radius [mm]")
LAST = {"reserve [%]": "reserve [%]", "air a cycle [l (ANR)]": "air [l]"}
"""Columns of the table on the terminal, before and after the ranges of the end points; the report has all."""
RANGES = {"pressure [bar]": "pressure", "contraction [%]": "contraction", "force [N]": "force"}


Supply = Annotated[str, typer.Option(metavar="QUANTITY", help="Supply pressure: '6 bar' (gauge).")]
Load = Annotated[
    str | None, typer.Option(metavar="QUANTITY", help="Lift: mass or force of the load, '20 kg' or '200 N'.")
]
Stroke = Annotated[str | None, typer.Option(metavar="QUANTITY", help="Lift: stroke, such as '40 mm'.")]
Stiffness = Annotated[
    str | None, typer.Option(metavar="QUANTITY", help="Lift: stiffness of a spring, relaxed at the start: '2 N/mm'.")
]
Torque = Annotated[
    str | None, typer.Option(metavar="QUANTITY", help="Joint: torque in either direction, such as '5 N m'.")
]
Angle = Annotated[str | None, typer.Option(metavar="QUANTITY", help="Joint: range of the angle, such as '60 deg'.")]
Inertia = Annotated[str | None, typer.Option(metavar="QUANTITY", help="Joint: inertia, such as '0.05 kg m^2'.")]
Muscles = Annotated[
    list[str] | None,
    typer.Option("--muscle", metavar="NAME", help="Muscle or file instead of the catalogue; repeatable."),
]


def size(
    supply: Supply,
    load: Load = None,
    stroke: Stroke = None,
    stiffness: Stiffness = None,
    torque: Torque = None,
    angle: Angle = None,
    inertia: Inertia = None,
    safety: Annotated[float, typer.Option(metavar="NUMBER", help="Factor on the load that is held.")] = 1.5,
    cycle_time: Annotated[str, typer.Option(metavar="QUANTITY", help="Time of a cycle, there and back.")] = "2 s",
    max_length: Annotated[str | None, typer.Option(metavar="QUANTITY", help="Maximum nominal length.")] = None,
    max_diameter: Annotated[str | None, typer.Option(metavar="QUANTITY", help="Maximum outer diameter.")] = None,
    max_count: Annotated[int, typer.Option(metavar="N", help="Maximum number of muscles in parallel.")] = 3,
    count: Annotated[int | None, typer.Option(metavar="N", help="Exact number of muscles in parallel.")] = None,
    muscle: Muscles = None,
    sort: Annotated[str, typer.Option(metavar="KEY", help=f"Criterion of ranking: {', '.join(SORT_KEYS)}.")] = "air",
    out: OptionalFolder = None,
    json: Json = False,
) -> None:
    """Size muscles of the catalogue for a lift or a joint.

    \b
    For each muscle whose law and permitted values are known: the shortest length that reaches both ends of the motion
    within ratings, validity range and supply, alone and in parallel, with pressures, reserve and air of a cycle.
    With --out, DIR/report.html shows the force-contraction chart and all choices, and DIR/scenario.toml is the best
    choice that `airmuscle simulate` can run, with valves for the cycle time.

    \b
    Examples:
      airmuscle size --load "20 kg" --stroke "40 mm" --supply "6 bar" --max-length "400 mm" --out lift
      airmuscle size --load "100 N" --stiffness "2 N/mm" --stroke "40 mm" --supply "6 bar" --sort length
      airmuscle size --torque "5 N m" --angle "60 deg" --inertia "0.05 kg m^2" --supply "6 bar" --max-count 1
    """
    if sort not in SORT_KEYS:
        raise typer.BadParameter(f"--sort must be one of {', '.join(SORT_KEYS)}, not '{sort}'")
    requirement = _requirement(load, stroke, stiffness, torque, angle, inertia)
    counts = (1, max_count) if count is None else (count, count)
    conditions = _conditions(supply, safety, cycle_time, max_length, max_diameter, counts)
    entries = None if not muscle else tuple(load_law(name) for name in muscle)
    if out is not None:
        check_writable(out)
    with computation_progress("sizing") as progress:
        result = size_muscles(requirement, conditions, entries, SORT_KEYS[sort], progress)
    result.check_reachable()
    note = _write(result, out) if out is not None else ""
    if json:
        print_json(_to_dict(result))
    else:
        _print(result)
        if note:
            echo(note)


def _conditions(
    supply: str,
    safety: float,
    cycle_time: str,
    max_length: str | None,
    max_diameter: str | None,
    counts: tuple[int, int],
) -> SizingConditions:
    """The conditions of the options. Raises UnitError or ParameterError."""
    return SizingConditions(
        _read("supply", supply, "Pa"),
        safety,
        _read("cycle-time", cycle_time, "s"),
        _read("max-length", max_length, "m") if max_length else SizingConditions.max_length,
        _read("max-diameter", max_diameter, "m") if max_diameter else SizingConditions.max_diameter,
        min_count=counts[0],
        max_count=counts[1],
    )


def _read(option: str, text: str, unit: str) -> float:
    return quantity(text, unit, where=f"--{option.replace('_', '-')}")


def _requirement(
    load: str | None, stroke: str | None, stiffness: str | None, torque: str | None, angle: str | None,
    inertia: str | None,
) -> Requirement:  # fmt: skip
    """The lift or the joint of the options. Raises BadParameter, UnitError or ParameterError."""
    lift = [text is not None for text in (load, stroke, stiffness)]
    joint = [text is not None for text in (torque, angle, inertia)]
    if any(lift) == any(joint) or (any(lift) and not all(lift[:2])) or (any(joint) and not all(joint[:2])):
        raise typer.BadParameter("give --load and --stroke for a lift, or --torque and --angle for a joint")
    if load is not None and stroke is not None:
        spring = _read("stiffness", stiffness, "N/m") if stiffness else 0.0
        return LiftRequirement(_read("stroke", stroke, "m"), stiffness=spring, **_load(load))
    assert torque is not None
    assert angle is not None
    turned = _read("inertia", inertia, "kg m^2") if inertia is not None else 0.0
    return JointRequirement(_read("angle", angle, "rad"), _read("torque", torque, "N m"), turned)


def _load(text: str) -> dict[str, float]:
    """Mass [kg] or force [N] of a load. Raises UnitError."""
    for name, unit in (("mass", "kg"), ("force", "N")):
        try:
            return {name: _read("load", text, unit)}
        except UnitError as error:
            if unit == "N":
                raise UnitError(f"{error} A load is a mass or a force: '20 kg' or '200 N'.") from None
    raise AssertionError


def _write(result: SizingResult, out: Path) -> str:
    """Write report and scenario; sentences on both."""
    text, note, simulated = _scenario(result)
    with atomic_folder(out) as folder:
        write_into(folder, [sizing_chapter(result, note, simulated)], title="Sizing")
        if text:
            (folder / SCENARIO_FILE).write_text(text, encoding="utf-8")
    return f"{note}\nreport: {out / 'report.html'}"


def _scenario(result: SizingResult) -> tuple[str, str, MuscleChoice | None]:
    """The scenario of the best choice that can be simulated, a sentence on it, and the choice; "" and None if none."""
    reasons = []
    for rank, choice in enumerate(result.choices):
        try:
            text = scenario_text(choice)
        except AirmuscleError as error:
            reasons.append(str(error))
            continue
        size = f"{choice.total_count} x {choice.entry.name}, {1e3 * choice.length:.4g} mm"
        note = f"The scenario of choice {rank + 1}, {size}, is {SCENARIO_FILE}; run airmuscle simulate with it."
        return text, note, choice
    return "", f"No scenario is written: {reasons[0]}", None


def _print(result: SizingResult) -> None:
    echo(f"{result.requirement.describe()}, supply {result.conditions.supply / 1e5:.4g} bar")
    rows = [_row(choice_row(choice)) for choice in result.choices]
    headers = list(rows[0])
    print_table(headers, [list(row.values()) for row in rows], right=headers[1:])
    echo("air: litres a cycle of all muscles at the reference atmosphere (ISO 8778), without tubes")
    if result.unsuitable:
        echo()
        table = [(item.name, item.count or "–", item.reason) for item in result.unsuitable]
        print_table(("unsuitable muscle", "number", "reason"), table, right=("number",))


def _row(row: Mapping[str, Any]) -> dict[str, str]:
    """The row of the terminal: both end points in one cell."""
    shown = {header: format_number(row[header]) for header in FIRST if header in row}
    for header, name in RANGES.items():
        ends = [value for key, value in row.items() if key.startswith(f"{name}, ")]
        shown[header] = " to ".join(dict.fromkeys(format_number(value, 3) for value in ends))
    return shown | {short: format_number(row[header], 3) for header, short in LAST.items()}


def _to_dict(result: SizingResult) -> dict[str, Any]:
    """The result as plain data, all numbers SI."""
    return {
        "requirement": result.requirement.describe(),
        "choices": [_choice_dict(choice) for choice in result.choices],
        "unsuitable": [{"name": u.name, "count": u.count, "reason": u.reason} for u in result.unsuitable],
        "units": {"length": "m", "pressure": "Pa gauge", "force": "N", "air": "kg", "reference_volume": "m3 (ANR)",
                  "air_energy": "J", "radius": "m", "diameter": "m"},
    }  # fmt: skip


def _choice_dict(choice: MuscleChoice) -> dict[str, Any]:
    return {
        "name": choice.entry.name,
        "count": choice.count,
        "total_count": choice.total_count,
        "length": choice.length,
        "extended": choice.design.extended._asdict(),
        "contracted": choice.design.contracted._asdict(),
        "reserve": choice.design.reserve,
        "radius": choice.design.radius,
        "radii_at_1.1_lengths": choice.design.radii,
        "air": choice.air,
        "reference_volume": choice.reference_volume,
        "air_energy": choice.air_energy,
        "efficiency": choice.efficiency,
        "diameter": choice.diameter,
    }
