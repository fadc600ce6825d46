"""Conversion of a raw table, from any file format, into a Recording in SI units.

Units are converted, absolute pressures become gauge pressures, and implausible values are rejected.
"""

import contextlib
import dataclasses
import datetime
import difflib
import warnings
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ...core import (
    AirmuscleWarning,
    Array,
    ColumnError,
    Hint,
    HintedText,
    UnitError,
    listed,
    suggestion,
)
from ...core.units import AMBIENT_PRESSURE, STANDARD_GRAVITY, UnitConversion, conversion
from ...recording import columns as headed
from ...recording.columns import (
    QUANTITIES,
    UNIT_SPELLINGS,
    Heading,
    parse_heading,
)
from ...recording.recording import Recording
from ...recording.vocabulary import read_heading
from .column_names import ReadColumn, quantities_of_units, read_columns
from .mapping import ColumnMapping, contradicts
from .plausibility import check_plausible, check_unique, check_width, without_repeated_columns
from .tables import (
    MAX_QUOTED,
    SAMPLE_RATE,
    Cells,
    RawTable,
    constant_from_column,
    epoch_unit,
    guessed_time_unit,
    is_clock,
    is_number,
    parse_constant_name,
    parse_rate,
    resampled,
    seconds_from_clock,
    time_of_rows,
)
from .tables import constants as fixed

MAX_LABELS = 8
MIN_LABEL_ROWS = 3
"""Maximum number of different texts of a column that is kept, and minimum number of rows of each
(chosen).
"""


def interpret(
    table: RawTable, mapping: ColumnMapping, constants: Mapping[str, float | str] | None = None
) -> Recording:
    """Convert a table with the headings of a mapping to a Recording; what the mapping states
    overrides the file.

    constants  constants of this table, by default those of the mapping; the name of a quantity,
               `length`, gives a column with this value in every row

    Raises ColumnError or UnitError; the message names file, row, value and remedy.
    """
    constants = mapping.constants_of() if constants is None else constants
    check_width(table)
    table = without_repeated_columns(table)
    held_constants = {n: value for n, value in constants.items() if _is_held_quantity(n)}
    stated = {n: value for n, value in constants.items() if n not in held_constants}
    run_constants = fixed.collect_constants(table.origin, {**table.constants, **stated})
    headings = resolve_headings(table, mapping.units)
    table = mapping.missing.treat(table, headings)
    # what is stated precedes what a constant column contains
    run_constants = {**_constants_in_columns(table, headings), **run_constants}
    fixed.check_constants(table.origin, run_constants)
    ambient = float(run_constants.get("ambient", AMBIENT_PRESSURE))
    columns, notes = _converted_columns(table, headings, ambient, "ambient" in run_constants)
    for text, value in held_constants.items():
        notes.append(_hold_quantity(table, text, value, ambient, columns))
    columns, displaced = headed.displacement_columns(columns, run_constants)
    notes += displaced
    columns, timed = _with_rate(table, columns, run_constants, mapping)
    notes += timed
    if "time" in columns:
        time, note = mapping.time.apply(table, columns["time"])
        if time is None:
            columns = {name: values for name, values in columns.items() if name != "time"}
        else:
            columns = {**columns, "time": time}
        notes += [note] if note else []
    check_plausible(
        table, columns, run_constants.get("resting_length"), ambient, ordered=mapping.time.ordered
    )
    written = {h.name: h.unit for h in headings if h.known and h.unit and h.name in columns}
    own_names = {h.name: h.text for h in headings if h.evidence and h.name in columns}
    return Recording(
        columns, table.origin, run_constants, tuple(notes), written, headings=own_names
    )


def _with_rate(
    table: RawTable,
    columns: dict[str, Array],
    constants: Mapping[str, float | str],
    mapping: ColumnMapping,
) -> tuple[dict[str, Array], list[str]]:
    """The columns with a time by the sample rate that the user or the file states, or interpolated
    to that of the user; notes on each.
    """
    if mapping.sample_rate is not None:
        rate = parse_rate(mapping.sample_rate, table.origin)
        if "time" in columns:
            uniform, note = resampled(columns, rate)
            return uniform, [note]
        time, note = time_of_rows(columns, len(table.rows), rate, "as specified by the user")
        return {"time": time, **columns}, [note]
    stated = constants.get(SAMPLE_RATE)
    if stated is None or "time" in columns:
        return columns, []
    rate = parse_rate(stated, table.origin)
    time, note = time_of_rows(columns, len(table.rows), rate, "as the file states")
    return {"time": time, **columns}, [note]


def _is_held_quantity(name: str) -> bool:
    """Whether a constant is a quantity that was held, such as `length`."""
    return parse_constant_name(name) is None and parse_heading(name).known


def _constants_in_columns(table: RawTable, headings: Sequence[Heading]) -> dict[str, float | str]:
    """The constants of a run that unknown columns of numbers state, the last column first."""
    constants = dict[str, float | str]()
    for heading, cells in zip(headings, table.columns, strict=True):
        if heading.known or isinstance(cells, list):
            continue
        constant = constant_from_column(table, heading.text, heading.unit, cells)
        if constant:
            name, value = constant
            constants = {name: value, **constants}
    return constants


def _hold_quantity(
    table: RawTable, text: str, value: float | str, ambient: float, columns: dict[str, Array]
) -> str:
    """Add the column of a quantity that was held; its note. Raises ColumnError where a column
    contains the quantity.
    """
    heading = parse_heading(text)
    where = f"{table.origin}: {heading.name}"
    if heading.name in columns:
        raise ColumnError(
            f"{where} is stated as a constant, but a column contains it. Omit one of them."
        )
    si = fixed.held_value(heading, value, ambient, where)
    columns[heading.name] = np.full(len(table.rows), si)
    unit = "" if heading.target == "1" else f" {heading.target}"
    return f"The {heading.name} is {si:.6g}{unit} in every row, as specified by the user."


def _converted_columns(
    table: RawTable, headings: list[Heading], ambient: float, is_stated: bool
) -> tuple[dict[str, Array], list[str]]:
    """The columns in SI units, and notes on overridden and assumed units, on unknown columns, and
    on the ambient pressure of absolute pressures where it is not stated."""
    columns: dict[str, Array] = {}
    notes = [*table.notes, *_overridden_units(table, headings), *_read_by_words(headings)]
    unknown = list[str]()
    for heading, cells in zip(headings, table.columns, strict=True):
        if heading.known:
            columns[heading.name], note = _convert_column(table, heading, cells, ambient)
        else:
            note = _keep_unknown_column(table, heading, cells, columns, unknown)
        if note and note not in notes:
            notes.append(note)
    if len(unknown) == 1:
        notes.append(
            f"Column {listed(unknown)} is not a known quantity and is kept without conversion."
        )
    elif unknown:
        notes.append(
            f"Columns {listed(unknown)} are not known quantities and are kept without conversion."
        )
    absolute = [
        h.name for h in headings if h.target == "Pa" and unit_conversion(table, h, ambient).offset
    ]
    if absolute and not is_stated:
        notes.append(
            f"The {' and '.join(absolute)} is absolute, and the ambient pressure is not stated: it"
            f" is converted to gauge with the standard atmosphere, {AMBIENT_PRESSURE / 1e3:.4g}"
            " kPa."
        )
    return columns, notes


def _read_by_words(headings: Sequence[Heading]) -> list[str]:
    """Notes on the columns whose quantity or unit is not stated by the name of a quantity."""
    columns: dict[str, list[str]] = {}
    for heading in headings:
        if heading.known and heading.evidence:
            unit = f" [{heading.unit}]" if heading.unit else ""
            columns.setdefault(heading.evidence, []).append(
                f"'{heading.text}' as {heading.name}{unit}"
            )
    proposals = dict.fromkeys(
        headed.proposal(heading.text) for heading in headings if heading.known and heading.evidence
    )
    return [
        f"Read {evidence}: {listed(texts, 4 * MAX_QUOTED, MAX_QUOTED)}.{''.join(proposals)}"
        for evidence, texts in columns.items()
    ]


def _overridden_units(table: RawTable, headings: Sequence[Heading]) -> list[str]:
    """A note on each unit of the file, in its unit row or its heading, that the user overrides, and
    a warning of another unit than that of the file.
    """
    notes = []
    unit_row = [*(table.units or ()), *[""] * len(headings)]
    for heading, below in zip(headings, unit_row, strict=False):
        unit = below or parse_heading(heading.text).unit
        if not unit or not heading.unit or unit == heading.unit:
            continue
        note = (
            f"The {heading.name} is read in {heading.unit}, as specified by the user; the file"
            f" states {unit}."
        )
        notes.append(note)
        if contradicts(unit, heading):
            warnings.warn(
                f"{table.origin}: {note} Omit the unit if that of the file is right.",
                AirmuscleWarning,
                stacklevel=2,
            )
    return notes


def resolve_headings(table: RawTable, units: Mapping[str, str]) -> list[Heading]:
    """The headings with their units, from the user, the unit row or the heading itself, in this
    order of precedence, and quantities by their whole names or by the words in them.
    """
    user_units = quantities_of_units(units)
    columns = read_columns(table, user_units)
    _check_user_units(table, columns, user_units)
    headings = []
    below_all = [*(table.units or ()), *[""] * len(columns)]
    for column, below, cells in zip(columns, below_all, table.columns, strict=False):
        heading = column.heading
        is_stated = heading.name in user_units or heading.text in user_units
        if heading.name == "time" and not heading.unit:
            heading = dataclasses.replace(heading, unit=epoch_unit(cells))
            guess = guessed_time_unit(cells) if heading.unit is None else None
            if guess is not None:
                heading = dataclasses.replace(heading, unit=guess.unit, evidence=guess.reason)
        if not is_stated and heading.known and not heading.evidence:
            _check_unit_row(table, parse_heading(heading.text), below)
        headings.append(heading)
    check_unique(table, headings)
    _check_any_known(table, headings)
    _check_units(table, headings, columns)
    return headings


def _check_units(
    table: RawTable, headings: Sequence[Heading], columns: Sequence[ReadColumn]
) -> None:
    """Raise UnitError where units are not stated, with all of them at once."""
    lacking = [
        heading
        for heading, cells in zip(headings, table.columns, strict=True)
        if heading.known
        and heading.unit is None
        and heading.target != "1"
        and not (heading.name == "time" and is_clock(cells))
    ]
    if len(lacking) < 2:
        return
    open_columns = [
        column.heading.text
        for column in columns
        if column.is_open and column.reading and column.reading.unit is None
    ]
    named = [heading.text for heading in lacking]
    usual = "; ".join(
        f"{heading.name}: {', '.join(UNIT_SPELLINGS[heading.target or '1'][:5])}"
        for heading in lacking
    )
    values: dict[str, Any] = {
        **{heading.name: ... for heading in lacking},
        **dict.fromkeys(open_columns, ...),
    }
    raise UnitError(
        f"{table.origin}: no unit is stated for {len(lacking)} columns"
        f" ({listed(named, MAX_QUOTED)}). State those of the values in the headings; usual units"
        f" are {usual}.",
        hint=Hint("To state the units", "units", values, "ColumnMapping"),
    )


def _check_user_units(
    table: RawTable, columns: Sequence[ReadColumn], user_units: Mapping[str, str]
) -> None:
    """Raise ColumnError where the user states the unit of a column that the table lacks."""
    names = [column.heading.name for column in columns]
    texts = [column.heading.text for column in columns]
    words = [column.reading.quantity for column in columns if column.reading]
    for key in user_units:
        if key not in names and key not in texts and key not in words:
            raise ColumnError(
                f"{table.origin}: a unit is given for '{key}', but the columns are"
                f" {listed(names)}.{suggestion(key, names)}"
            )


def _check_any_known(table: RawTable, headings: Sequence[Heading]) -> None:
    """Raise ColumnError where no column is a known quantity."""
    if any(heading.known for heading in headings):
        return
    texts = [heading.text for heading in headings]
    near = list(filter(None, map(_misspelt, texts)))
    hint = f" Did you mean '{near[0]}'?" if near else ""
    raise ColumnError(
        f"{table.origin}: no column is a known quantity ({listed(texts, MAX_QUOTED)}); known"
        f" quantities are {', '.join(QUANTITIES)}.{hint}",
        hint=Hint(
            "To state the number of lines above the headings", "skip_rows", 1, "ColumnMapping"
        ),
    )


def _check_unit_row(table: RawTable, heading: Heading, below: str) -> None:
    """Raise ColumnError where the unit in the row below a heading contradicts that in the
    heading.
    """
    if not below or heading.unit is None or below == heading.unit:
        return
    with contextlib.suppress(UnitError):  # of a unit that is none; its conversion states the reason
        in_heading, in_row = (
            conversion(unit, heading.target or "1") for unit in (heading.unit, below)
        )
        reference_differs = in_heading.offset != in_row.offset and not (
            in_heading.assumed_gauge or in_row.assumed_gauge
        )
        if in_heading.factor != in_row.factor or reference_differs:
            raise ColumnError(
                f"{table.origin}: the heading '{heading.text}' states {heading.unit}, but the row"
                f" of units below it {below}. Correct one of them.",
                hint=Hint("To state the unit", "units", {heading.name: ...}, "ColumnMapping"),
            )


def _convert_column(
    table: RawTable, heading: Heading, cells: Cells, ambient: float
) -> tuple[Array, str]:
    """A known column in SI units, and a note on any assumption about its unit."""
    if heading.name == "time" and isinstance(cells, list):
        seconds = seconds_from_clock(cells)
        if seconds is not None:
            return (
                seconds,
                (
                    "The time column contains clock times; time is counted from the first,"
                    f" {cells[0]}."
                ),
            )
    change = unit_conversion(table, heading, ambient)
    values = np.array(cells, dtype=float)
    if heading.name == "time" and heading.unit == epoch_unit(cells):
        began = datetime.datetime.fromtimestamp(change(values[0]), datetime.UTC)
        seconds = change(values - values[0])
        return seconds, (
            f"The time is in {heading.unit} from 1970; it is counted from the first row,"
            f" {began:%Y-%m-%d %H:%M:%S} UTC."
        )
    if change.assumed_gauge:
        reason = (
            f"the unit '{heading.unit}' does not state it. Write bara or kPa(a) for an absolute"
            " pressure."
        )
        return change(values), f"The {heading.name} is read as gauge: {reason}"
    if heading.unit is None:
        return values, f"The {heading.name} has no unit and is read as a ratio."
    if heading.target == "N" and fixed.is_mass(heading.unit):
        assumption = (
            f"stated in {heading.unit} and converted with standard gravity, {STANDARD_GRAVITY}"
            " m/s2."
        )
        return change(values), f"The {heading.name} is {assumption}"
    return change(values), ""


def unit_conversion(table: RawTable, heading: Heading, ambient: float) -> UnitConversion:
    target = heading.target or "1"
    where = f"{table.origin}, column '{heading.text}'"
    usual = ", ".join(UNIT_SPELLINGS[target])
    if heading.unit is None:
        if target == "1":
            return UnitConversion(1.0)
        example = f"{heading.name} [{UNIT_SPELLINGS[target][1 % len(UNIT_SPELLINGS[target])]}]"
        raise UnitError(
            f"{where}: no unit is stated. State that of the values in the column header, for"
            f" example '{example}'; usual units are {usual}.",
            hint=Hint("To state the unit", "units", {heading.name: ...}, "ColumnMapping"),
        )
    try:
        return fixed.file_conversion(heading.unit, target, ambient=ambient, where=where)
    except UnitError as reason:
        cases = {spelling.lower(): spelling for spelling in UNIT_SPELLINGS[target]}
        near = difflib.get_close_matches(heading.unit.lower(), cases, n=1)
        hint = (
            f" Did you mean '{cases[near[0]]}'?"
            if near
            else f" Usual units of the {heading.name} are {usual}."
        )
        raise UnitError(HintedText(reason.message, hint)) from None


def _keep_unknown_column(
    table: RawTable, heading: Heading, cells: Cells, columns: dict[str, Array], unknown: list[str]
) -> str:
    """Keep an unknown column without conversion; its note, or if it has numbers and none, its text
    in `unknown`.
    """
    if isinstance(cells, list):
        return _keep_labels(heading, cells, columns) if any(cells) else ""
    constant = constant_from_column(table, heading.text, heading.unit, cells)
    if constant:
        return (
            f"Column '{heading.text}' is constant and states the {constant[0]}: {constant[1]:.4g}"
            " (SI)."
        )
    columns[heading.text or "unnamed"] = cells
    if heading.text in table.fields:
        return _field_note(heading)
    hint = headed.proposal(heading.text) or _proposed_reading(heading)
    if not hint:
        unknown.append(f"'{heading.text}'")
        return ""
    return f"Column '{heading.text}' is not a known quantity and is kept without conversion.{hint}"


MOST_LETTERS = 0.8
"""Share of common letters from which a name is proposed for a misspelt one (chosen)."""


def _proposed_reading(heading: Heading) -> str:
    """A sentence that proposes what a heading may mean, by its words or by most of its letters;
    empty for others.
    """
    near = _misspelt(heading.text)
    if near:
        return f" Did you mean '{near}'?"
    reading = read_heading(heading.text, heading.unit or "")
    if reading is None:
        return ""
    reason = "" if reading.unit else ", of which no unit is stated"
    return f" It may be the {reading.quantity}{reason}."


def _misspelt(text: str) -> str:
    """The quantity whose name has most of the letters of the first word of a heading; empty if none
    has.
    """
    word = text.partition(" ")[0].lower()
    near = difflib.get_close_matches(word, QUANTITIES, n=1, cutoff=MOST_LETTERS)
    return near[0] if near and not parse_heading(text).known else ""


def _keep_labels(heading: Heading, cells: list[str], columns: dict[str, Array]) -> str:
    """Keep the numbers of a few different texts that repeat; the note on a column of texts."""
    bad = [cell for cell in cells if cell.strip() and not is_number(cell)]
    if len(bad) < len(cells) / 2:
        quoted = [f"'{text}'" for text in dict.fromkeys(bad)]
        return (
            f"{len(bad)} of {len(cells)} cells of '{heading.text}' are no numbers"
            f" ({listed(quoted, MAX_QUOTED)}), so that the column is not read."
        )
    labels = fixed.label_texts(cells)
    values, numbers, counts = np.unique(labels, return_inverse=True, return_counts=True)
    is_few = 2 <= values.size <= MAX_LABELS
    if not is_few or counts.min() < MIN_LABEL_ROWS:
        return f"Column '{heading.text}' contains text and is ignored."
    columns[heading.text] = (numbers.ravel() + 1).astype(np.float64)
    named = []
    for number, value in enumerate(values.tolist(), 1):
        shown = value or "empty"
        named.append(f"{number} {shown}")
    texts = ", ".join(named)
    return f"Column '{heading.text}' contains text and is kept as numbers: {texts}."


def _field_note(heading: Heading) -> str:
    """The note on a field of a message, with the mapping to a quantity of its unit."""
    quantity = "force"
    unit = "N"
    for name, declared in QUANTITIES.items():
        if declared.unit == heading.unit:
            quantity = name
            unit = declared.unit
            break
    stated = f" in {heading.unit}" if heading.unit else ""
    return (
        f"Column '{heading.text}'{stated} is a field of a message and kept as it is; [columns]"
        f" '{heading.text}' = '{quantity} [{unit}]' maps it."
    )
