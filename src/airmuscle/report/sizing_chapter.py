"""Report chapter: choices of muscles for a lift or a joint, with the chart of the best one."""

from __future__ import annotations

from typing import Any

from ..core.reference import cite
from ..sizing import JointRequirement, MuscleChoice, SizingResult
from .chapter import Chapter, Table
from .sizing_plot import sizing_plot


def sizing_chapter(result: SizingResult, scenario: str = "") -> Chapter:
    """The chapter of a sizing with at least one choice; `scenario` is a sentence on the scenario that was written."""
    best = result.best
    return Chapter(
        paper="sizing",
        title=f"Muscles for {result.requirement.describe()}",
        summary=_summary(best, scenario),
        tables=(choice_table(result), unsuitable_table(result)),
        plots=(sizing_plot(best),),
        references=tuple(best.entry.references) + tuple(cite((best.entry.characteristic, best.conditions.ambient))),
        chosen=_settings(result),
    )


def choice_row(choice: MuscleChoice) -> dict[str, Any]:
    """A choice by header with unit; None where a value is not known."""
    first, last = choice.design.extended, choice.design.contracted
    row: dict[str, Any] = {
        "muscle": choice.entry.name,
        "number": choice.total_count,
        "length [mm]": 1e3 * choice.length,
        "pressure, long [bar]": first.pressure / 1e5,
        "pressure, short [bar]": last.pressure / 1e5,
        "contraction, long [%]": 100 * first.contraction,
        "contraction, short [%]": 100 * last.contraction,
        "force, long [N]": round(first.force, 9) + 0.0,  # slack to rounding
        "force, short [N]": last.force,
        "reserve [%]": 100 * choice.design.reserve,
        "air a cycle [l (ANR)]": _scaled(choice.reference_volume, 1e3),
        "energy of the air [J]": choice.air_energy,
        "efficiency [%]": _scaled(choice.efficiency, 100.0),
        "diameter [mm]": _scaled(choice.diameter, 1e3),
    }
    if choice.design.radius is not None and choice.design.radii is not None:
        low, high = choice.design.radii
        row |= {
            "radius [mm]": 1e3 * choice.design.radius,
            "least radius at 1.1 L [mm]": 1e3 * low,
            "greatest radius at 1.1 L [mm]": 1e3 * high,
        }
    return row


def _scaled(value: float | None, factor: float) -> float | None:
    return None if value is None else factor * value


def choice_table(result: SizingResult) -> Table:
    """All choices, best first."""
    rows = [choice_row(choice) for choice in result.choices]
    columns = {header: [row[header] for row in rows] for header in rows[0]}
    note = (
        "Long and short: the end points of each muscle. Reserve: force beyond the load at the greatest working "
        "pressure. Air: at the reference atmosphere of ISO 8778, without tubes; – where the law has no geometry."
    )
    return Table("choices", "Choices, best first", columns, note)


def unsuitable_table(result: SizingResult) -> Table:
    """The muscles that do not meet the requirement, with the reason."""
    columns: dict[str, list[Any]] = {
        "muscle": [item.name for item in result.unsuitable],
        "greatest number tried": [item.count or None for item in result.unsuitable],
        "reason": [item.reason for item in result.unsuitable],
    }
    return Table("unsuitable", "Muscles that do not meet the requirement", columns)


def _summary(best: MuscleChoice, scenario: str) -> str:
    side = " (half of them on each side)" if isinstance(best.requirement, JointRequirement) else ""
    text = (
        f"The best choice for {best.requirement.describe()} is {best.total_count} x {best.entry.title}{side}, with a "
        f"nominal length of {1e3 * best.length:.4g} mm. This is the shortest length that reaches both end points."
    )
    return f"{text}\n\n{scenario}" if scenario else text


def _settings(result: SizingResult) -> tuple[tuple[str, str, str], ...]:
    conditions = result.conditions
    return (
        ("supply pressure", f"{conditions.supply / 1e5:.4g} bar", "given"),
        ("safety factor on the load", f"{conditions.safety_factor:.4g}", "given, or chosen: 1.5"),
        ("cycle time", f"{conditions.cycle_time:.4g} s", "given, or chosen: 2 s"),
        ("least working pressure", f"{conditions.min_pressure / 1e5:.4g} bar", "chosen"),
        ("greatest number in parallel", str(conditions.max_count), "given, or chosen: 3"),
    )
