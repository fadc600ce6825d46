"""Whether files of one bench agree on their units; two that contradict each other cannot both be right."""

from __future__ import annotations

import itertools
import warnings
from collections.abc import Iterator, Sequence

import numpy as np

from ..core.errors import AirmuscleWarning, UnitError
from ..core.units import conversion
from .columns import quantity_of
from .recording import Recording

SAME_MAGNITUDE = 1.5
"""Greatest numbers of two files count as the same numbers within this factor (chosen)."""
DIFFERENT_UNIT = 5.0
"""Units count as contradicting each other from this factor on (chosen: psi and kPa differ by 6.9)."""
SUSPICIOUS_RATIO = 50.0
"""Pressures or lengths that are stated in one unit and differ by this factor are worth a warning (chosen).

Forces are not compared so: a slack muscle is measured like a taut one."""


def check_unit_consistency(recordings: Sequence[Recording]) -> None:
    """Raise UnitError where two files hold the same numbers under units that differ; warn where it looks like it.

    Each message names both files and the column.
    """
    for name in dict.fromkeys(name for recording in recordings for name in recording.units):
        sharing = [r for r in recordings if name in r.units and len(r) and quantity_of(name)]
        for one, other in _pairs_to_compare(name, sharing):
            _compare(name, one, other)


def _pairs_to_compare(name: str, recordings: Sequence[Recording]) -> Iterator[tuple[Recording, Recording]]:
    """One recording for each unit against those of the other units, and the extremes within one unit."""
    by_unit: dict[str, list[Recording]] = {}
    for recording in recordings:
        by_unit.setdefault(recording.units[name], []).append(recording)
    for these, those in itertools.combinations(by_unit.values(), 2):
        yield max(these, key=lambda r: _magnitude(r, name)), max(those, key=lambda r: _magnitude(r, name))
    for these in by_unit.values():
        ordered = sorted(these, key=lambda r: _magnitude(r, name))
        if len(ordered) > 1:
            yield ordered[0], ordered[-1]


def _compare(name: str, one: Recording, other: Recording) -> None:
    unit, other_unit = one.units[name], other.units[name]
    size, other_size = _magnitude(one, name), _magnitude(other, name)
    if not (size > 0 and other_size > 0):
        return
    factor, other_factor = _unit_factor(name, unit), _unit_factor(name, other_unit)
    written, other_written = size / factor, other_size / other_factor
    if _ratio(factor, other_factor) >= DIFFERENT_UNIT and _ratio(written, other_written) <= SAME_MAGNITUDE:
        raise UnitError(
            f"{one.origin} states the {name} in {unit} and {other.origin} in {other_unit}, but both hold numbers of "
            f"one size (up to {written:.4g} and {other_written:.4g}): one of the two units is wrong. Correct it in the "
            f"file, or give the true one with units={{'{name}': ...}}."
        )
    both = f"{one.origin} (up to {written:.4g} {unit}) and {other.origin} (up to {other_written:.4g} {other_unit})"
    spans_alike = name.rpartition(".")[2] in ("pressure", "length")
    if unit == other_unit and spans_alike and _ratio(size, other_size) >= SUSPICIOUS_RATIO:
        _warn(f"the {name} of {both} differs {_ratio(size, other_size):.0f}-fold: is one of them in another unit?")
    if _pressure_reference(unit) != _pressure_reference(other_unit) and "plain" in (
        _pressure_reference(unit),
        _pressure_reference(other_unit),
    ):
        _warn(f"of {both} only one says whether its {name} is gauge or absolute; the other is taken as gauge.")


def _warn(message: str) -> None:
    warnings.warn(message, AirmuscleWarning, stacklevel=2)


def _magnitude(recording: Recording, name: str) -> float:
    """The size of a column [SI] by the values that only one in twenty exceeds, absolute pressures as written."""
    offset = 0.0 if quantity_of(name) is None else _unit_offset(name, recording.units[name])
    return float(np.quantile(np.abs(recording.columns[name] - offset), 0.95))


def _unit_factor(name: str, unit: str) -> float:
    quantity = quantity_of(name)
    try:
        return conversion(unit, quantity.unit if quantity else "1").factor
    except UnitError:
        return conversion(unit, "kg").factor * 9.80665  # a load in kg


def _unit_offset(name: str, unit: str) -> float:
    return conversion(unit, "Pa").offset if name.rpartition(".")[2] == "pressure" else 0.0


def _pressure_reference(unit: str) -> str:
    """Whether a unit of pressure says absolute, gauge or neither."""
    try:
        change = conversion(unit, "Pa")
    except UnitError:
        return "no pressure"
    return "plain" if change.assumed_gauge else "absolute" if change.offset else "gauge"


def _ratio(one: float, other: float) -> float:
    return max(one, other) / min(one, other)
