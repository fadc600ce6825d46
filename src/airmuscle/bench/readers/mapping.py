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

[units]
pressure = "bara"

[constants]
temperature = "20 °C"

[columns]
"Channel 1" = "pressure [bara]"
"Channel 2" = { quantity = "force", unit = "kg" }
3 = "length [mm]"
spare = ""
"""

import dataclasses
import fnmatch
import warnings
from collections.abc import Collection, Mapping, Sequence
from pathlib import Path
from types import UnionType
from typing import Any

from ...core import (
    AirmuscleError,
    AirmuscleWarning,
    ColumnError,
    Hint,
    ParameterError,
    UnitError,
    abridged,
    check_field_types,
    listed,
    suggestion,
)
from ...core.errors import check_known
from ...core.units import AMBIENT_PRESSURE
from ...recording.columns import (
    QUANTITIES,
    UNIT_SPELLINGS,
    Heading,
    parse_heading,
    split_unit,
)
from .tables import (
    MISSING_VALUES,
    SPECIMEN,
    TIME_BASES,
    Decimation,
    Downsampling,
    FileNamePattern,
    MissingValues,
    RawTable,
    RecordedTime,
    RefuseMissing,
    Selection,
    TextFormat,
    TimeBase,
    bare_heading,
    check_constants,
    collect_constants,
    file_conversion,
    held_value,
    parse_code,
    parse_constant_name,
    read_toml,
)

STATED = ("resting_length", "ambient", "displacement_zero", "specimen")
"""Constants of a run that are fields of a mapping."""
OTHERS = ("ambient_temperature", "run")
"""Further constants of a run, beside the quantities that were held."""
CONSTANT_NAMES = (*STATED, *OTHERS)
OUTLIERS = {"keep": False, "drop": True}
"""Whether suspected outliers are left out, by the words of mapping files and of the command
line.
"""
QUESTION = "?"
"""Stands in a mapping for what its user must answer, `pressure [?]`."""
_TEXTS = ("delimiter", "decimal", "sheet", "group", "file_name", "grid")
_WORDS: Mapping[str, Mapping[str, Any]] = {
    "time": TIME_BASES,
    "missing": MISSING_VALUES,
    "outliers": OUTLIERS,
}
_TABLES = ("columns", "units", "constants")
_KEYS = (
    *_TABLES,
    *CONSTANT_NAMES,
    *_TEXTS,
    *_WORDS,
    "skip_rows",
    "missing_codes",
    "sample_rate",
)


@dataclasses.dataclass(frozen=True)
class ColumnMapping:
    """Interpretation of files of one kind. Information that the mapping does not state is read from
    the file.

    columns    by heading, or by number from 1, a heading with quantity and unit, `pressure [bara]`;
               `specimen` for the names of the specimens, each of which is a recording; an empty
               text excludes the column
    units      units by quantity or heading: {"pressure": "kPa(a)"}
    resting_length, ambient, displacement_zero  constants of the runs, lengths [m] and a pressure
                                                [Pa], or texts with a unit: the length L0 without
                                                pressure and load, which allows conversion between
                                                length and contraction; the ambient pressure, which
                                                is subtracted from absolute pressures; and the
                                                reading of a displacement at the resting length
    specimen   name of the specimen
    constants  further constants of the runs; a quantity, {"length": "7.3 cm"}, was held and becomes
               a column
    file_name  pattern of values in the names of the files, `held{length [cm]}cm`, as in
               FileNamePattern
    delimiter, decimal  of text files
    skip_rows  number of lines above the headings of a text file or worksheet; by default they are
               detected, or found by the headings that `columns` names
    sheet      worksheet of an Excel file
    group      groups of a TDMS, MDF or HDF5 file, structs of a MAT file, topics of a bag, by their
    names; several are separated by commas
    time       RecordedTime(ordered=True), UniformTime() for stamps that the logger rounded, or
               NoTime()
    missing    RefuseMissing(codes), DropMissing(codes) or InterpolateMissing(codes), with the
               numbers and texts that stand for missing values, such as -999
    drop_outliers  whether the rows of suspected outliers are left out
    sample_rate  [Hz] or a text, "500 Hz" or "2 ms": the time of rows without time, by a counter of
               samples if there is one; rows with time are interpolated to it
    grid       quantities of a grid, "force [N] over contraction [%], pressure [kPa]": of the cells,
               the first column and the headings
    sections   further keys for the files of a pattern: {"*.tdms": {"columns": {"AI 0": "force
               [N]"}}}
    """

    columns: Mapping[str | int, str] = dataclasses.field(default_factory=dict)
    units: Mapping[str, str] = dataclasses.field(default_factory=dict)
    resting_length: float | str | None = None
    ambient: float | str | None = None
    displacement_zero: float | str | None = None
    specimen: str | None = None
    constants: Mapping[str, float | str] = dataclasses.field(default_factory=dict)
    file_name: str | None = None
    delimiter: str | None = None
    decimal: str | None = None
    skip_rows: int | None = None
    sheet: str | None = None
    group: str | None = None
    time: TimeBase = RecordedTime()
    missing: MissingValues = RefuseMissing()
    drop_outliers: bool = False
    sample_rate: float | str | None = None
    grid: str | None = None
    sections: Mapping[str, Mapping[str, Any]] = dataclasses.field(default_factory=dict)

    def of_file(self, path: Path) -> "ColumnMapping":
        """The mapping for one file: completed by each section whose pattern its name matches, or
        its path from a folder on, `specimen_a/*`. Raises as `read_mapping`.
        """
        mapping = dataclasses.replace(self, sections={})
        for pattern, content in self.sections.items():
            if path.match(pattern) or fnmatch.fnmatch(path.name, pattern):
                mapping = mapping_of_tables(content, f"section '{pattern}'", mapping)
        return mapping

    def with_fields(self, fields: Mapping[str, Any]) -> "ColumnMapping":
        """This mapping with other values of the named fields. Raises ParameterError for a name that
        is no field.
        """
        names = [field.name for field in dataclasses.fields(self)]
        check_known("ColumnMapping has no field", fields, names, "it has")
        return dataclasses.replace(self, **fields)

    def __post_init__(self) -> None:
        check_field_types(self)
        for name in set(STATED) & set(self.constants):
            object.__setattr__(self, name, self.constants[name])
        further_constants = {
            name: value for name, value in self.constants.items() if name not in STATED
        }
        object.__setattr__(self, "constants", further_constants)
        _ = self.text_format  # checks delimiter and decimal mark
        if self.skip_rows is not None and self.skip_rows < 0:
            raise ColumnError(f"mapping: skip_rows is {self.skip_rows}; it must be 0 or more.")
        for name in further_constants:
            if name not in CONSTANT_NAMES and not (
                parse_constant_name(name) or parse_heading(name).known
            ):
                raise ColumnError(
                    f"mapping: '{name}' is no constant of a run; allowed range:"
                    f" {', '.join(CONSTANT_NAMES)}, or a quantity that was held, such as"
                    f" length.{suggestion(name, (*CONSTANT_NAMES, *QUANTITIES))}"
                )
        if self.file_name is not None:
            FileNamePattern(self.file_name)  # raises for placeholders that are no quantity
        for column, heading in self.columns.items():
            if (
                heading
                and QUESTION not in heading
                and not (
                    parse_heading(heading).known
                    or parse_constant_name(heading)
                    or heading == SPECIMEN
                )
            ):
                name = heading.partition("[")[0].strip()
                raise ColumnError(
                    f"mapping: column '{column}' is mapped to '{heading}', which is not a known"
                    f" quantity; known quantities are {', '.join(QUANTITIES)}, resting_length,"
                    f" specimen.{suggestion(name, QUANTITIES)}"
                )

    @property
    def text_format(self) -> TextFormat:
        """The part of the mapping that applies to text files."""
        names = tuple(name for name in map(str, self.columns) if not name.isdecimal())
        return TextFormat(
            self.delimiter, self.decimal, len(names) < len(self.columns), names, self.skip_rows
        )

    def selection(self, downsampling: Downsampling = Decimation()) -> Selection:
        """What is read from a file, and in which reduction."""
        columns = tuple(map(str, self.columns))
        return Selection(self.group, self.sheet, columns, self.text_format, downsampling)

    def constants_of(self, path: Path | None = None) -> dict[str, float | str]:
        """The constants of one file: those in its name take precedence over those of all files."""
        stated = {name: value for name in STATED if (value := getattr(self, name)) is not None}
        values = FileNamePattern(self.file_name).values(path) if self.file_name and path else {}
        return {**self.constants, **stated, **values}


def read_mapping(path: str | Path, base: ColumnMapping = ColumnMapping()) -> ColumnMapping:
    """Read a mapping from a TOML file, which completes `base`. Raises FileError, ParameterError or
    ColumnError.
    """
    path = Path(path)
    return mapping_of_tables(read_toml(path), path.name, base)


def mapping_of_tables(
    content: Mapping[str, Any], where: str, base: ColumnMapping = ColumnMapping()
) -> ColumnMapping:
    """The mapping `base` with what the keys of a TOML table state; tables are merged, and None
    states nothing. `where` begins the messages. Raises as `read_mapping`."""
    entries = {key: value for key, value in content.items() if value is not None}
    sections = _sections(entries, where, base)
    for key, value in entries.items():
        _check_entry(key, value, where)
    columns = {
        name: _parse_entry(where, name, value) for name, value in entries.pop("columns", {}).items()
    }
    codes = tuple(parse_code(code) for code in entries.pop("missing_codes", base.missing.codes))
    treatment = MISSING_VALUES.get(entries.pop("missing", ""))
    values = {
        "sections": sections,
        "columns": {**{str(key): heading for key, heading in base.columns.items()}, **columns},
        "units": {**base.units, **entries.pop("units", {})},
        "constants": (
            base.constants
            | entries.pop("constants", {})
            | {n: entries.pop(n) for n in OTHERS if n in entries}
        ),
        "time": TIME_BASES.get(entries.pop("time", ""), base.time),
        "missing": (
            treatment(codes) if treatment else dataclasses.replace(base.missing, codes=codes)
        ),
        "drop_outliers": OUTLIERS.get(entries.pop("outliers", ""), base.drop_outliers),
    }
    values["columns"], values["units"] = _answered(values["columns"], values["units"])
    try:
        mapping = dataclasses.replace(base, **values, **entries)
    except AirmuscleError as error:
        raise error.located(where) from None
    named = {**content, **(content.get("constants") or {})}
    stated = {name: value for name, value in mapping.constants_of().items() if name in named}
    check_constants(where, collect_constants(where, stated))
    for name, value in stated.items():
        if not parse_constant_name(name) and (heading := parse_heading(name)).known:
            held_value(heading, value, AMBIENT_PRESSURE, f"{where}: {name}")  # checks it
    return mapping


PATTERN_SIGNS = ("*", "?", "[", "/", ".")
"""Signs of a pattern of names of files, in contrast to a key of a mapping."""


def _sections(
    entries: dict[str, Any], where: str, base: ColumnMapping
) -> dict[str, dict[str, Any]]:
    """The sections of a mapping by pattern, which are taken out of `entries`; what remains there
    has precedence over the sections of `base`, as options have over a file. Raises as
    `read_mapping` for a section.
    """
    patterns = [
        key
        for key, value in entries.items()
        if isinstance(value, Mapping) and any(sign in key for sign in PATTERN_SIGNS)
    ]
    sections: dict[str, dict[str, Any]] = {pattern: entries.pop(pattern) for pattern in patterns}
    for pattern, content in sections.items():
        mapping_of_tables(content, f"{where}, section '{pattern}'")
    completed = {pattern: _merged(content, entries) for pattern, content in base.sections.items()}
    return {**completed, **sections}


def _merged(content: Mapping[str, Any], entries: Mapping[str, Any]) -> dict[str, Any]:
    """Keys of a mapping with further ones, which have precedence; tables are merged."""
    merged = dict(content)
    for key, value in entries.items():
        before = merged.get(key)
        if isinstance(before, Mapping) and isinstance(value, Mapping):
            merged[key] = {**before, **value}
        else:
            merged[key] = value
    return merged


def _answered(
    columns: Mapping[str, str], units: Mapping[str, str]
) -> tuple[dict[str, str], dict[str, str]]:
    """The columns and units in which a unit that is stated for a column, or for its quantity,
    stands in place of its question mark.
    """
    remaining = dict(units)
    answered = dict(columns)
    for column, heading in columns.items():
        name = bare_heading(heading)
        if f"[{QUESTION}]" not in heading:
            continue
        quantity = name.rpartition(".")[2]
        unit = units.get(column, units.get(name, units.get(quantity)))
        if unit is not None:
            answered[column] = f"{name} [{unit}]"
            remaining.pop(column, None)
    return answered, remaining


def check_answered(mapping: ColumnMapping, where: str) -> None:
    """Raise ColumnError where a mapping contains open questions, with all of them."""
    open_columns = {
        str(column): heading for column, heading in mapping.columns.items() if QUESTION in heading
    }
    if not open_columns:
        return
    texts = [f"'{column}' = '{heading}'" for column, heading in open_columns.items()]
    raise ColumnError(
        f"{where}: the mapping has {len(open_columns)} open questions ({listed(texts)}). Write the"
        f" unit, or quantity and unit, in place of each {QUESTION}.",
        hint=Hint(
            "To answer here",
            "columns",
            {column: heading.replace(QUESTION, "...") for column, heading in open_columns.items()},
            "ColumnMapping",
        ),
    )


def _required_kind(key: str, value: Any) -> str:
    """The kind of value that a key requires, as a phrase; empty where the value is of this kind."""
    if key == "sample_rate" and not _is_of(value, float | int | str):
        return 'a number [Hz] or a text, such as "500 Hz"'
    if key in (*_TEXTS, *_WORDS) and not isinstance(value, str):
        return "a quoted text"
    if key == "skip_rows" and not _is_of(value, int):
        return "a number of lines, such as 7"
    if key == "missing_codes":
        is_list = isinstance(value, list | tuple)
        if not is_list or not all(_is_of(code, float | int | str) for code in value):
            return 'a list, such as [-999, "OL"]'
    return ""


def _is_of(value: Any, kind: type | UnionType) -> bool:
    """Whether a value is of this kind; true and false are no numbers."""
    return isinstance(value, kind) and not isinstance(value, bool)


def _check_entry(key: str, value: Any, where: str) -> None:
    """Raise ParameterError or ColumnError for an unknown key of a mapping file, or a value of the
    wrong kind.
    """
    check_known(f"{where}: unknown key", key, _KEYS, "allowed are")
    required = _required_kind(key, value)
    if required:
        raise ParameterError(f"{where}: {key} = {abridged(value)}; it must be {required}.")
    if key in _WORDS and value not in _WORDS[key]:
        raise ColumnError(
            f"{where}: {key} is {abridged(value)}; allowed range: {', '.join(_WORDS[key])}."
        )
    if key in _TABLES and not isinstance(value, Mapping):
        line = key.removesuffix("s")
        raise ParameterError(
            f"{where}: {key} must be a table: [{key}], followed by one line per {line}."
        )


def _parse_entry(where: str, column: str, value: Any) -> str:
    """`pressure [bara]`, from this text or from `{quantity = "pressure", unit = "bara"}`."""
    if isinstance(value, str):
        return value
    texts = isinstance(value, dict) and all(isinstance(part, str) for part in value.values())
    if texts and set(value) <= {"quantity", "unit"}:
        return (
            f"{value.get('quantity', '')} [{value['unit']}]"
            if value.get("unit")
            else value["quantity"]
        )
    raise ParameterError(
        f"{where}: column '{column}' is mapped to {abridged(value)}; write 'pressure [bara]' or "
        '{ quantity = "pressure", unit = "bara" }.'
    )


def apply_mapping(table: RawTable, mapping: ColumnMapping) -> RawTable:
    """The table with the headings of a mapping, and a note for each mapped column. Raises
    ColumnError if the mapping names a column that does not exist."""
    check_answered(mapping, table.origin)
    present = mapped_columns(table, mapping)
    mapped = {
        index: heading
        for column, heading in mapping.columns.items()
        if (index := _column_index(table, str(column))) is not None
    }
    absent = [f"'{column}'" for column in map(str, mapping.columns) if column not in present]
    headings = list(table.headings)
    units = list(table.units or ("",) * len(table.headings))
    notes = list(table.notes)
    for index, heading in mapped.items():
        _warn_of_contradiction(table, index, heading)
        action = f"read as {heading}" if heading else "ignored"
        notes.append(f"Column '{table.headings[index]}' is {action}, according to the mapping.")
        headings[index] = heading
        constant = parse_constant_name(heading)
        if constant[1] if constant else parse_heading(heading).unit is not None:
            units[index] = ""
    if absent:
        notes.append(f"Columns of the mapping that are not here: {', '.join(absent)}.")
    changed = dataclasses.replace(
        table, headings=tuple(headings), units=tuple(units) if table.units else None
    )
    return changed.of_columns(
        [i for i in range(len(headings)) if mapped.get(i, "kept")], notes=tuple(notes)
    )


_USUAL_UNITS = {
    unit for spellings in UNIT_SPELLINGS.values() for unit in spellings if unit not in ("1", "-")
}


def _warn_of_contradiction(table: RawTable, index: int, heading: str) -> None:
    """Warn where a mapping reads a column as another quantity, or in another unit, than its heading
    or the row of units states.
    """
    written = parse_heading(table.headings[index])
    read_as = parse_heading(heading)
    if not heading or not read_as.known:
        return
    row = table.units[index] if table.units else ""
    unit = row or written.unit or split_unit(table.headings[index])[1] or ""
    another = written.known and written.target != read_as.target
    if not another and not contradicts(unit, read_as):
        return
    warnings.warn(
        f"{table.origin}: column {table.number(index)}, '{table.headings[index]}',"
        f"{f' in {row},' if row else ''} is read as '{heading}' according to the mapping, which"
        " contradicts its heading. Check the name or the number of the column in the mapping.",
        AirmuscleWarning,
        stacklevel=2,
    )


def contradicts(unit: str, read_as: Heading) -> bool:
    """Whether a unit of a file is another one than that of the heading of a mapping or of the user,
    if that states one.
    """
    target = read_as.target or "1"
    if unit not in _USUAL_UNITS:
        return False
    try:
        of_file = file_conversion(unit, target)
    except UnitError:  # of another quantity
        return True
    stated = None if read_as.unit is None else file_conversion(read_as.unit, target)
    if stated is None:
        return False
    known = not (of_file.assumed_gauge or stated.assumed_gauge)
    return of_file.factor != stated.factor or (known and of_file.offset != stated.offset)


def _column_index(table: RawTable, column: str) -> int | None:
    """The index of a column, by its heading, by its heading without unit, or by its number from
    1; None if the table lacks it.
    """
    for names in (table.headings, tuple(map(bare_heading, table.headings))):
        if names.count(column) == 1:
            return names.index(column)
    numbers = [str(table.number(index)) for index in range(len(table.headings))]
    return numbers.index(column) if column in numbers else None


def mapped_columns(table: RawTable, mapping: ColumnMapping) -> set[str]:
    """The columns of a mapping that a table has."""
    return {
        str(column) for column in mapping.columns if _column_index(table, str(column)) is not None
    }


def _absent(column: str, origin: str, headings: Sequence[str]) -> str:
    return (
        f"{origin}: the mapping names column '{column}', but the columns are"
        f" {listed(headings)}.{suggestion(column, headings)}"
    )


def check_mapped_columns(mapping: ColumnMapping, present: Collection[str], table: RawTable) -> None:
    """Raise ColumnError for a column of a mapping that no file has, as a misspelt one; `present`
    are those that files have, `table` is one of a file.
    """
    for column in map(str, mapping.columns):
        if column not in present:
            raise ColumnError(_absent(column, table.origin, table.headings))
