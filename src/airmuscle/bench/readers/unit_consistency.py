"""Consistency of units across the files of one test bench.

Two files with similar numbers under different units contradict each other: at least one of the units is wrong.
"""

from __future__ import annotations

import itertools
import warnings
from collections.abc import Iterator, Sequence

import numpy as np

from ...core.errors import AirmuscleWarning, Hint, UnitError
from ...core.units import STANDARD_GRAVITY, conversion
from ...recording.columns import quantity_of
from ...recording.recording import Recording

SAME_MAGNITUDE = 1.5
"""Maximum ratio at which the numbers of two files have the same magnitude (chosen)."""
DIFFERENT_UNIT = 5.0
"""Minimum ratio of two units that contradict each other (chosen: psi and kPa differ by a factor of 6.9)."""
SUSPICIOUS_RATIO = 50.0
"""Minimum ratio of pressures or lengths in the same unit that causes a warning (chosen).

Forces are excluded: the force of a slack muscle is legitimately much smaller than that of a loaded one."""


def check_unit_consistency(recordings: Sequence[Recording]) -> None:
    """Check that files with the same column agree on its unit.

    Raises UnitError if two files contain similar numbers under different units, and warns (AirmuscleWarning) if the
    units are merely suspicious. Each message names both files and the column.
    """
    for name in dict.fromkeys(name for recording in recordings for name in recording.units):
        candidates = [r for r in recordings if name in r.units and len(r) and quantity_of(name)]
        for first, second in _pairs_to_compare(name, candidates):
            _compare(name, first, second)


def _pairs_to_compare(name: str, recordings: Sequence[Recording]) -> Iterator[tuple[Recording, Recording]]:
    """The largest recordings of every two units, then the smallest and the largest recording of each unit."""
    by_unit: dict[str, list[Recording]] = {}
    for recording in recordings:
        by_unit.setdefault(recording.units[name], []).append(recording)
    for group, other_group in itertools.combinations(by_unit.values(), 2):
        yield max(group, key=lambda r: _magnitude(r, name)), max(other_group, key=lambda r: _magnitude(r, name))
    for group in by_unit.values():
        ordered = sorted(group, key=lambda r: _magnitude(r, name))
        if len(ordered) > 1:
            yield ordered[0], ordered[-1]


def _compare(name: str, first: Recording, second: Recording) -> None:
    unit, other_unit = first.units[name], second.units[name]
    size, other_size = _magnitude(first, name), _magnitude(second, name)
    if not (size > 0 and other_size > 0):
        return
    factor, other_factor = _unit_factor(name, unit), _unit_factor(name, other_unit)
    written, other_written = size / factor, other_size / other_factor
    if _ratio(factor, other_factor) >= DIFFERENT_UNIT and _ratio(written, other_written) <= SAME_MAGNITUDE:
        raise UnitError(
            f"{first.origin} states the {name} in {unit} and {second.origin} in {other_unit}, but the numbers have the "
            f"same magnitude (up to {written:.4g} and {other_written:.4g}): one of the two units is wrong. Correct it "
            "in the file.",
            hint=Hint("To state the unit", "units", {name: ...}, "ColumnMapping"),
        )
    both = f"{first.origin} (up to {written:.4g} {unit}) and {second.origin} (up to {other_written:.4g} {other_unit})"
    comparable = name.rpartition(".")[2] in ("pressure", "length")
    if unit == other_unit and comparable and _ratio(size, other_size) >= SUSPICIOUS_RATIO:
        _warn(f"the {name} of {both} differs by a factor of {_ratio(size, other_size):.0f}. Check the units.")
    quantity = quantity_of(name)
    is_pressure = quantity is not None and quantity.unit == "Pa"
    references = {_pressure_reference(each) for each in (unit, other_unit) if is_pressure}
    if len(references) > 1 and "unspecified" in references:
        _warn(f"of {both}, only one states whether its {name} is gauge or absolute; the other is read as gauge.")


def _warn(message: str) -> None:
    warnings.warn(message, AirmuscleWarning, stacklevel=2)


def _magnitude(recording: Recording, name: str) -> float:
    """The 95th percentile of the absolute values of a column [SI]; absolute pressures are compared as written."""
    offset = 0.0 if quantity_of(name) is None else _unit_offset(name, recording.units[name])
    return float(np.quantile(np.abs(recording.columns[name] - offset), 0.95))


def _unit_factor(name: str, unit: str) -> float:
    quantity = quantity_of(name)
    try:
        return conversion(unit, quantity.unit if quantity else "1").factor
    except UnitError:
        return conversion(unit, "kg").factor * STANDARD_GRAVITY  # a load stated as a mass


def _unit_offset(name: str, unit: str) -> float:
    return conversion(unit, "Pa").offset if name.rpartition(".")[2] == "pressure" else 0.0


def _pressure_reference(unit: str) -> str:
    """Whether a unit of pressure is gauge, absolute or unspecified."""
    change = conversion(unit, "Pa")
    return "unspecified" if change.assumed_gauge else "absolute" if change.offset else "gauge"


def _ratio(first: float, second: float) -> float:
    return max(first, second) / min(first, second)
