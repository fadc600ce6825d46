"""Column mapping: quantities, units and constants that a file does not state itself.

A mapping file (TOML; all keys are optional):

resting_length = "300 mm"
decimal = ","
skip_rows = 7
missing = "drop"
missing_codes = [-999]
outliers = "drop"

file_name = "cut{specimen}_held{length [cm]}cm"
time = "uniform"

[constants]
temperature = "20 °C"

[columns]
"Channel 1" = "pressure [bara]"
"Channel 2" = { quantity = "force", unit = "kg" }
3 = "length [mm]"
spare = ""
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from ...core.annotation import abridged, check_field_types
from ...core.errors import AirmuscleError, ColumnError, ParameterError, suggestion
from ...recording.columns import QUANTITIES
from ...recording.heading import parse_heading
from .constants import parse_constant_name
from .file_kind import read_toml
from .file_name import FileNamePattern
from .header import bare_heading
from .missing_values import MISSING_VALUES, MissingValues
from .specimens import SPECIMEN
from .table import RawTable
from .text_format import TextFormat
from .time_base import TIME_BASES, TimeBase

CONSTANT_NAMES = ("resting_length", "ambient", "ambient_temperature", "displacement_zero", "specimen", "run")
"""Constants of a run that a mapping may state."""
OUTLIERS = ("keep", "drop")
"""Treatments of suspected outliers."""
_TEXTS = ("delimiter", "decimal", "sheet", "group", "file_name", "time", "missing", "outliers")


@dataclasses.dataclass(frozen=True)
class ColumnMapping:
    """Interpretation of files of one kind. Information that the mapping does not state is read from the file.

    columns    by heading, or by number from 1, a heading with quantity and unit, `pressure [bara]`; `specimen` for
               the names of the specimens, each of which is a recording; an empty text excludes the column
    constants  constants of the run, such as resting_length
    delimiter, decimal  of text files
    sheet      worksheet of an Excel file
    group      group of a TDMS or MDF file, struct of a MAT file
    file_name  pattern of values in the names of the files, `held{length [cm]}cm`, as in FileNamePattern
    time       time base: recorded, uniform (for rounded stamps), unordered or none
    skip_rows  number of lines above the headings of a text file or worksheet; by default they are detected
    missing    missing values: error, drop (leave out the rows) or interpolate (short gaps in time)
    missing_codes  numbers and texts that stand for missing values, such as -999
    outliers   suspected outliers: keep or drop (leave out the rows)
    """

    columns: Mapping[str, str] = dataclasses.field(default_factory=dict)
    constants: Mapping[str, float | str] = dataclasses.field(default_factory=dict)
    delimiter: str | None = None
    decimal: str | None = None
    sheet: str | None = None
    group: str | None = None
    file_name: str | None = None
    time: str | None = None
    skip_rows: int | None = None
    missing: str | None = None
    missing_codes: tuple[float | str, ...] = ()
    outliers: str | None = None

    def __post_init__(self) -> None:
        check_field_types(self)
        for key, allowed in (("time", TIME_BASES), ("missing", MISSING_VALUES), ("outliers", OUTLIERS)):
            value = getattr(self, key)
            if value is not None and value not in allowed:
                raise ColumnError(f"mapping: {key} is '{value}'; allowed range: {', '.join(allowed)}.")
        if self.skip_rows is not None and self.skip_rows < 0:
            raise ColumnError(f"mapping: skip_rows is {self.skip_rows}; it must be 0 or more.")
        for name in self.constants:
            if name not in CONSTANT_NAMES and not (parse_constant_name(name) or parse_heading(name).known):
                raise ColumnError(
                    f"mapping: '{name}' is no constant of a run; allowed range: {', '.join(CONSTANT_NAMES)}, or a "
                    f"quantity that was held, such as length.{suggestion(name, (*CONSTANT_NAMES, *QUANTITIES))}"
                )
        if self.file_name is not None:
            FileNamePattern(self.file_name)  # raises for placeholders that are no quantity
        for column, heading in self.columns.items():
            if heading and not (parse_heading(heading).known or parse_constant_name(heading) or heading == SPECIMEN):
                name = heading.partition("[")[0].strip()
                raise ColumnError(
                    f"mapping: column '{column}' is mapped to '{heading}', which is not a known quantity; known "
                    f"quantities are {', '.join(QUANTITIES)}, resting_length, specimen.{suggestion(name, QUANTITIES)}"
                )

    @property
    def text_format(self) -> TextFormat:
        """The part of the mapping that applies to text files."""
        names = tuple(name for name in self.columns if not name.isdecimal())
        return TextFormat(self.delimiter, self.decimal, len(names) < len(self.columns), names, self.skip_rows)

    @property
    def time_base(self) -> TimeBase:
        """The time base of the files."""
        return TIME_BASES[self.time or "recorded"]

    @property
    def missing_values(self) -> MissingValues:
        """The treatment of missing values."""
        return MISSING_VALUES[self.missing or "error"](self.missing_codes)

    def constants_of(self, path: Path) -> dict[str, float | str]:
        """The constants of one file: those in its name take precedence over those of all files."""
        values = FileNamePattern(self.file_name).values(path) if self.file_name else {}
        return {**self.constants, **values}

    def with_overrides(self, **values: Any) -> ColumnMapping:
        """A copy in which all values other than None replace those of the mapping; columns and constants are merged."""
        stated = {name: value for name, value in values.items() if value is not None}
        columns = {**self.columns, **{str(k): v for k, v in stated.pop("columns", {}).items()}}
        constants = {
            **self.constants,
            **stated.pop("constants", {}),
            **{name: stated.pop(name) for name in CONSTANT_NAMES if name in stated},
        }
        return dataclasses.replace(self, columns=columns, constants=constants, **stated)


def read_mapping(path: str | Path) -> ColumnMapping:
    """Read a mapping from a TOML file. Raises FileError, ParameterError or ColumnError."""
    path = Path(path)
    return mapping_of_tables(read_toml(path), path.name)


def mapping_of_tables(content: Mapping[str, Any], where: str) -> ColumnMapping:
    """The mapping that the keys of a TOML table describe; `where` begins the messages. Raises as `read_mapping`."""
    content = dict(content)
    known = ("columns", "constants", *CONSTANT_NAMES, *_TEXTS, "skip_rows", "missing_codes")
    for key, value in content.items():
        if key not in known:
            raise ParameterError(
                f"{where}: unknown key '{key}'; allowed range: {', '.join(known)}.{suggestion(key, known)}"
            )
        if key in _TEXTS and not isinstance(value, str):
            raise ParameterError(f"{where}: {key} = {abridged(value)}; it must be a quoted text.")
    _check_numbers(content, where)
    columns = content.pop("columns", {})
    if not isinstance(columns, dict):
        raise ParameterError(f"{where}: columns must be a table: [columns], followed by one line per column.")
    if not isinstance(content.get("constants", {}), dict):
        raise ParameterError(f"{where}: constants must be a table: [constants], followed by one line per constant.")
    headings = {name: _parse_entry(where, name, value) for name, value in columns.items()}
    try:
        return ColumnMapping().with_overrides(columns=headings, **content)
    except AirmuscleError as error:
        raise error.located(where) from None


def _check_numbers(content: dict[str, Any], where: str) -> None:
    """Check `skip_rows` and `missing_codes`, which becomes a tuple. Raises ParameterError."""
    skip, codes = content.get("skip_rows", 0), content.get("missing_codes", [])
    if not isinstance(skip, int) or isinstance(skip, bool):
        raise ParameterError(f"{where}: skip_rows = {abridged(skip)}; it must be a number of lines, such as 7.")
    if not isinstance(codes, list) or not all(isinstance(c, float | int | str) and c is not True for c in codes):
        raise ParameterError(f'{where}: missing_codes = {abridged(codes)}; it must be a list, such as [-999, "OL"].')
    if codes:
        content["missing_codes"] = tuple(code if isinstance(code, str) else float(code) for code in codes)


def _parse_entry(where: str, column: str, value: Any) -> str:
    """`pressure [bara]`, from this text or from `{quantity = "pressure", unit = "bara"}`."""
    if isinstance(value, str):
        return value
    if isinstance(value, dict) and isinstance(value.get("quantity"), str) and set(value) <= {"quantity", "unit"}:
        return f"{value['quantity']} [{value['unit']}]" if value.get("unit") else value["quantity"]
    raise ParameterError(
        f"{where}: column '{column}' is mapped to {abridged(value)}; write 'pressure [bara]' or "
        '{ quantity = "pressure", unit = "bara" }.'
    )


def apply_mapping(table: RawTable, mapping: ColumnMapping) -> RawTable:
    """The table with the headings of a mapping, and a note for each mapped column.

    Raises ColumnError if the mapping names a column that does not exist.
    """
    mapped = {_column_index(table, column): heading for column, heading in mapping.columns.items()}
    headings, units = list(table.headings), list(table.units or ("",) * len(table.headings))
    notes = list(table.notes)
    for index, heading in mapped.items():
        action = f"read as {heading}" if heading else "ignored"
        notes.append(f"Column '{table.headings[index]}' is {action}, according to the mapping.")
        headings[index] = heading
        units[index] = "" if _has_unit(heading) else units[index]
    kept = [i for i in range(len(headings)) if mapped.get(i, "kept")]
    return dataclasses.replace(
        table,
        headings=tuple(headings[i] for i in kept),
        units=tuple(units[i] for i in kept if i < len(units)) if table.units else None,
        columns=tuple(table.columns[i] for i in kept),
        notes=tuple(notes),
    )


def _has_unit(heading: str) -> bool:
    constant = parse_constant_name(heading)
    return bool(constant[1]) if constant else parse_heading(heading).unit is not None


def _column_index(table: RawTable, column: str) -> int:
    """The index of a column, by its heading, by its heading without unit, or by its number from 1."""
    bare = list(map(bare_heading, table.headings))
    for names in (list(table.headings), bare):
        if names.count(column) == 1:
            return names.index(column)
    if column.isdecimal() and 1 <= int(column) <= len(table.headings):
        return int(column) - 1
    raise ColumnError(
        f"{table.origin}: the mapping names column '{column}', but the columns are {', '.join(table.headings)}."
        f"{suggestion(column, table.headings)}"
    )
