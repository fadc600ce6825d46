"""Plausibility of recordings, consistency of units across the files of a bench, several columns of
one quantity.

Two files with similar numbers under different units contradict each other: at least one of the
units is wrong.
"""

import itertools
import operator
import re
import warnings
from collections.abc import Mapping, Sequence

import numpy as np

from ...core import (
    AirmuscleWarning,
    Array,
    ColumnError,
    Hint,
    HintedText,
    UnitError,
    conversion,
    listed,
)
from ...recording.columns import Heading, quantity_of
from ...recording.recording import Recording
from .missing_codes import code_of
from .tables import (
    AS_RECORDED,
    MAP_TIME,
    UNIFORM,
    WITHOUT_TIME,
    Cells,
    DropMissing,
    Mask,
    RawTable,
    file_conversion,
)

CONTRACTION_RANGE = (-0.5, 1.0)
"""Plausible contractions (chosen): a contraction of 1 is impossible, as is a stretch by half of the
length.
"""

MAX_MAGNITUDE = 1e15
"""Maximum magnitude of a measured value in SI units (chosen: no measurement, but its powers do not
overflow).
"""


def check_plausible(
    table: RawTable,
    columns: Mapping[str, Array],
    resting_length: float | None,
    ambient: float,
    *,
    ordered: bool = True,
) -> None:
    """Raise ColumnError, with row and value, at the first value that cannot be a measurement."""
    for name, values in columns.items():
        limit = f"no measurement exceeds {MAX_MAGNITUDE:g}. Correct the value, or delete the row."
        _refuse(
            table, values, np.abs(values) > MAX_MAGNITUDE, f"{name} is {{}} in SI units; {limit}"
        )
        quantity = name.rpartition(".")[2]
        if quantity == "time" and ordered:
            steps = np.diff(values)
            row = int(np.argmax(steps <= 0)) + 1 if (steps <= 0).any() else 0
            if row:
                hints = (
                    (WITHOUT_TIME,) if (steps < 0).any() else (UNIFORM, AS_RECORDED, WITHOUT_TIME)
                )
                relation = "is less than" if steps[row - 1] < 0 else "repeats"
                message = (
                    f"{table.location(row)}: time {values[row]:.9g} s {relation} the time of the"
                    f" previous row ({values[row - 1]:.9g} s). Time must increase: sort the rows,"
                    " delete the repeated one, or write two runs to two files."
                )
                raise ColumnError(HintedText(message, *hints))
        elif quantity == "pressure":
            text = (
                f"a gauge pressure of {{}} kPa is not above absolute vacuum ({-ambient / 1e3:.4g}"
                " kPa gauge). Check the unit, and whether the pressure is gauge or absolute."
            )
            _refuse(table, values, ~(values + ambient > 0), text, unit=1e3)
        elif quantity == "contraction":
            remedy = "For values in percent, rename the column header to 'contraction [%]'."
            _check_contraction(table, values, quantity, remedy)
        elif quantity == "length":
            _refuse(table, values, ~(values > 0), "length is {} m; it must be positive.")
            if resting_length is not None:
                label = f"with a resting length of {resting_length:.4g} m, the contraction"
                remedy = "Check the units of the length and of the resting length."
                _check_contraction(table, (resting_length - values) / resting_length, label, remedy)


def _check_contraction(table: RawTable, contraction: Array, label: str, remedy: str) -> None:
    low, high = CONTRACTION_RANGE
    outside = ~((contraction > low) & (contraction < high))
    text = f"{label} {{}} is outside the plausible range {low:g} to {high:g}. {remedy}"
    _refuse(table, contraction, outside, text, may_be_code=False)


def _refuse(
    table: RawTable,
    values: Array,
    wrong: Mask,
    text: str,
    *,
    unit: float = 1.0,
    may_be_code: bool = True,
) -> None:
    """Raise ColumnError at the first wrong value, which stands for `{}` in the text, in this
    unit.
    """
    if wrong.any():
        row = int(np.argmax(wrong))
        code = code_of(float(values[row])) if may_be_code else None
        purpose = f"If {code or 0:g} is a code for a missing value"
        hint = (
            Hint(purpose, "missing", DropMissing((code,)), "ColumnMapping")
            if code is not None
            else None
        )
        raise ColumnError(
            f"{table.location(row)}: {text.replace('{}', f'{values[row] / unit:.4g}')}", hint=hint
        )


RATES = (
    "speed",
    "acceleration",
    "angular_speed",
    "angular_acceleration",
    "shortening_speed",
    "mass_flow",
)
"""Quantities that a steady state does not have."""
_RATE_WORD = re.compile(r"(?<![a-z])(speed|vel|velocity|rate|omega|dq|qd)(?![a-z])", re.IGNORECASE)


def warn_of_rates_without_time(recordings: Sequence[Recording]) -> None:
    """Warn (AirmuscleWarning) of a recording that has rates but no time: it is a motion, and its
    rows would be taken as steady states.
    """
    for recording in recordings:
        rates = [
            name
            for name, values in recording.columns.items()
            if (name.rpartition(".")[2] in RATES or _RATE_WORD.search(name.replace("_", " ")))
            and np.ptp(values) > 0.0
        ]
        if "time" in recording.columns or not rates:
            continue
        text = (
            f"{recording.origin}: there is no time, but {listed(rates)} vary, so the rows are no"
            " steady states as which they are taken."
        )
        message = HintedText(text, MAP_TIME, WITHOUT_TIME)
        warnings.warn(AirmuscleWarning(message), stacklevel=2)


SAME_MAGNITUDE = 1.5
DIFFERENT_UNIT = 5.0
"""Maximum ratio of numbers of one magnitude, minimum ratio of contradicting units (chosen: psi to
kPa is 6.9).
"""
SUSPICIOUS_RATIO = 50.0
"""Minimum ratio of pressures or lengths in the same unit that causes a warning (chosen).

Forces are excluded: the force of a slack muscle is legitimately much smaller than that of a loaded
one."""


def check_unit_consistency(recordings: Sequence[Recording]) -> None:
    """Check that files with the same column agree on its unit.

    Raises UnitError if two files contain similar numbers under different units, and warns
    (AirmuscleWarning) if the units are merely suspicious. Each message names both files and the
    column.
    """
    for name in dict.fromkeys(name for recording in recordings for name in recording.units):
        quantity = quantity_of(name)
        by_unit: dict[str, list[tuple[Recording, float]]] = {}
        for recording in recordings:
            if name in recording.units and len(recording) and quantity:
                offset = (
                    conversion(recording.units[name], "Pa").offset
                    if name.rpartition(".")[2] == "pressure"
                    else 0.0
                )
                magnitude = float(
                    np.quantile(np.abs(recording.columns[name] - offset), 0.95)
                )  # [SI], absolute as written
                by_unit.setdefault(recording.units[name], []).append((recording, magnitude))
        size = operator.itemgetter(1)
        groups = [sorted(group, key=size) for group in by_unit.values()]
        ends = ((group[0], group[-1]) for group in groups if len(group) > 1)
        largest = [max(group, key=size) for group in by_unit.values()]
        for first, second in (*itertools.combinations(largest, 2), *ends):
            if quantity and size(first) > 0 and size(second) > 0:
                _compare(name, quantity.unit, first, second)


def _compare(
    name: str,
    target: str,
    first_column: tuple[Recording, float],
    second_column: tuple[Recording, float],
) -> None:
    """Compare the units of a column in two recordings, each with its magnitude [SI]."""
    first, size = first_column
    second, other_size = second_column
    unit = first.units[name]
    other_unit = second.units[name]
    factor, other_factor = (
        file_conversion(stated_unit, target).factor for stated_unit in (unit, other_unit)
    )
    written = size / factor
    other_written = other_size / other_factor
    if (
        _ratio(factor, other_factor) >= DIFFERENT_UNIT
        and _ratio(written, other_written) <= SAME_MAGNITUDE
    ):
        raise UnitError(
            f"{first.origin} states the {name} in {unit} and {second.origin} in {other_unit}, but"
            f" the numbers have the same magnitude (up to {written:.4g} and {other_written:.4g}):"
            " one of the two units is wrong. Correct it in the file.",
            hint=Hint("To state the unit", "units", {name: ...}, "ColumnMapping"),
        )
    both = (
        f"{first.origin} (up to {written:.4g} {unit}) and {second.origin} (up to"
        f" {other_written:.4g} {other_unit})"
    )
    comparable = name.rpartition(".")[2] in ("pressure", "length")
    if unit == other_unit and comparable and _ratio(size, other_size) >= SUSPICIOUS_RATIO:
        text = (
            f"the {name} of {both} differs by a factor of {_ratio(size, other_size):.0f}. Check the"
            " units."
        )
        warnings.warn(text, AirmuscleWarning, stacklevel=2)
    changes = [
        conversion(stated_unit, "Pa") for stated_unit in (unit, other_unit) if target == "Pa"
    ]
    stated = {
        "none" if change.assumed_gauge else "absolute" if change.offset else "gauge"
        for change in changes
    }
    if len(stated) > 1 and "none" in stated:
        text = (
            f"of {both}, only one states whether its {name} is gauge or absolute; the other is read"
            " as gauge."
        )
        warnings.warn(text, AirmuscleWarning, stacklevel=2)


def _ratio(first: float, second: float) -> float:
    return max(first, second) / min(first, second)


MAX_COLUMNS = 5000
"""Maximum number of columns of a table (chosen)."""


def without_repeated_columns(table: RawTable) -> RawTable:
    """The table without the columns that repeat heading, unit and cells of a column before; a note
    names them.
    """
    units = table.units or ("",) * len(table.headings)
    distinct = list[int]()
    repeated = list[str]()
    same: dict[tuple[str, str], list[int]] = {}

    def equal(earlier: Cells, cells: Cells) -> bool:
        if isinstance(earlier, list) or isinstance(cells, list):
            return type(earlier) is type(cells) and earlier == cells
        return np.array_equal(earlier, cells, equal_nan=True)

    for i, pair in enumerate(zip(table.headings, units, strict=True)):
        before = same.setdefault(pair, [])
        if pair[0] and any(equal(table.columns[k], table.columns[i]) for k in before):
            repeated.append(pair[0])
        else:
            distinct.append(i)
            before.append(i)
    if not repeated:
        return table
    names = ", ".join(f"'{name}'" for name in dict.fromkeys(repeated))
    note = f"Columns that repeat the values of an equally named column are read once: {names}."
    return table.of_columns(distinct).noted(note)


def check_width(table: RawTable) -> None:
    """Raise ColumnError for a table of more columns than any test rig has, whose inspection would
    take minutes.
    """
    if len(table.headings) > MAX_COLUMNS:
        raise ColumnError(
            f"{table.origin}: the table has {len(table.headings)} columns; at most {MAX_COLUMNS}"
            " are read. Export the needed columns alone."
        )


def check_unique(table: RawTable, headings: Sequence[Heading]) -> None:
    """Raise ColumnError where several columns contain one quantity, as two tables side by side
    do.
    """
    indices: dict[str, list[int]] = {}
    for i, heading in enumerate(headings):
        if heading.text:
            indices.setdefault(heading.name, []).append(i)
    several = {name: columns for name, columns in indices.items() if len(columns) > 1}
    if len(several) > 1:
        places = "; ".join(
            f"{name}: columns {' and '.join(str(table.number(i)) for i in columns)}"
            for name, columns in several.items()
        )
        raise ColumnError(
            f"{table.origin}: {len(several)} quantities are in several columns ({places}), as in"
            " two tables side by side. Write each table to a sheet or a file of its own; for"
            " several muscles, write 'left.pressure' and 'right.pressure'."
        )
    for name, columns in several.items():
        first, second = (headings[i].text for i in columns[:2])
        number, further = (table.number(i) for i in columns[:2])
        raise ColumnError(
            f"{table.origin}: columns '{first}' and '{second}' (numbers {number} and {further})"
            f" both contain the {name}. Rename or delete one of them; for several muscles, write"
            f" 'left.{name}' and 'right.{name}'."
        )
