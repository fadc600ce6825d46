"""Reading of uploaded files: recordings, and every problem in the words of the field of the page
that it concerns.
"""

import dataclasses
import os
import warnings
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

import airmuscle as am

from ...bench.diagnosis import DataUse, support_of
from ...bench.diagnosis.checked_reading import check_bench
from ...bench.inspection import Outlier, check_contents, find_bench_outliers
from ...bench.readers.interpret import interpret, resolve_headings, unit_conversion
from ...bench.readers.mapping import apply_mapping
from ...bench.readers.reader import read_tables
from ...bench.readers.tables.channels import RawTable
from ...bench.readers.tables.constants import parse_constant_name, split_specimens
from ...core import AMBIENT_PRESSURE, AirmuscleError, AirmuscleWarning, ColumnError, Hint, quantity
from ...recording.columns import parse_heading
from ..requests.declaration import Instruction, RequestError, reworded
from .fit_settings import FitSettings
from .fit_uploads import FILES

MAX_ROWS = 200_000
MAX_COLUMNS = 400
"""Maximum number of rows of a file that are used, of more every n-th, and of columns that are shown
(chosen).
"""
NEEDED = ("pressure", "contraction", "force")
"""Quantities of a static fit."""


@dataclasses.dataclass(frozen=True)
class FileColumn:
    """A column of a file with its interpretation.

    key      the heading, or the number of a column whose heading occurs several times
    known    whether the quantity is a known one; the name is the whole heading otherwise
    stated   unit in the file
    """

    key: str
    heading: str
    name: str
    unit: str
    stated: str
    known: bool
    used: bool


@dataclasses.dataclass(eq=False)
class ReadSet:
    """The recordings of all files, complete and with the selected rows, the columns, and the
    problems.
    """

    columns: dict[str, list[FileColumn]] = dataclasses.field(default_factory=dict)
    """Columns by the name of the file."""
    recordings: list[am.Recording] = dataclasses.field(default_factory=list)
    files: list[str] = dataclasses.field(default_factory=list)
    """The name of the file of each recording."""
    problems: list[RequestError] = dataclasses.field(default_factory=list)
    remarks: list[str] = dataclasses.field(default_factory=list)
    outliers: Sequence[Sequence[Outlier]] = ()
    """The suspected outliers of each recording that are left out."""

    def complain(self, error: AirmuscleError, field: str = "") -> None:
        """Add a problem, once."""
        problem = as_field_error(error, field)
        if all(
            (problem.message, problem.field) != (known.message, known.field)
            for known in self.problems
        ):
            self.problems.append(problem)


def read_set(folder: Path, settings: FitSettings) -> ReadSet:
    """The recordings of the files of a set, as `recording.read` reads them with the same
    mapping.
    """
    read = ReadSet()
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", AirmuscleWarning)
        for path in sorted((folder / FILES).iterdir()):
            _read_file(path, settings, read)
        try:
            check_bench(read.recordings)
        except AirmuscleError as error:
            read.complain(error, "columns")
    read.remarks += dict.fromkeys(
        in_page_words(warning.message.args[0])
        for warning in caught
        if isinstance(warning.message, Warning)
    )
    dropped = settings.texts["outliers"] == "drop"
    read.outliers = find_bench_outliers(read.recordings) if dropped else [()] * len(read.recordings)
    for recording, file in zip(read.recordings, read.files, strict=True):
        _check_needed(recording, file, read)
    if not read.problems and read.recordings:
        try:
            check_contents(read.recordings)
            support_of(read.recordings).check(DataUse.FIT)
        except AirmuscleError as error:
            read.complain(error, "files")
    return read


def _read_file(path: Path, settings: FitSettings, read: ReadSet) -> None:
    field = f"file:{path.name}"
    try:
        tables = _tables(path, settings)
        constants = _constants(path, settings)
    except AirmuscleError as error:
        problem = as_field_error(error, field)
        read.complain(RequestError(without_folder(problem.message, path.parent), problem.field))
        return
    for table in tables:
        columns = _file_columns(table, settings)[:MAX_COLUMNS]
        listed = read.columns.setdefault(path.name, [])
        listed += [column for column in columns if all(column.key != entry.key for entry in listed)]
        try:
            selections = {
                key: settings.columns[key] for key in _keys(table) if key in settings.columns
            }
            mapped = apply_mapping(table, settings.mapping(selections))
        except AirmuscleError as error:
            read.complain(error, "columns")
            continue
        problems = list(_unit_problems(mapped, columns, constants))
        for problem in problems:
            read.complain(problem)
        if problems:
            continue
        try:
            parts = [
                interpret(part, settings.mapping({}), constants) for part in split_specimens(mapped)
            ]
        except AirmuscleError as error:
            read.complain(error, field)
            continue
        read.recordings += parts
        read.files += [path.name] * len(parts)


def _file_columns(table: RawTable, settings: FitSettings) -> list[FileColumn]:
    """The columns of a table, as their headings or the user name them."""
    columns = list[FileColumn]()
    units = table.units or ("",) * len(table.headings)
    for key, heading, unit_row in zip(_keys(table), table.headings, units, strict=False):
        chosen = settings.columns.get(key)
        name, stated, known = _name_and_unit(heading)
        stated = unit_row or stated
        unit = ""
        if chosen:
            name, unit, known = _name_and_unit(chosen)
        name = name if known else heading
        columns.append(FileColumn(key, heading, name, unit or stated, stated, known, chosen != ""))
    return columns


def without_folder(text: str, folder: Path) -> str:
    """The text without the path of a folder, or its beginning, which a reader of another package
    may quote.
    """
    path = str(folder)
    text = text.replace(f"{folder}{os.sep}", "")
    first_directory = folder.parents[-2] if len(folder.parents) > 1 else folder
    for length in range(len(path), len(f"{first_directory}{os.sep}"), -1):
        text = text.replace(path[:length], "…")
    return text


def _tables(path: Path, settings: FitSettings) -> tuple[RawTable, ...]:
    """The tables of a file; columns without headings are named by their numbers."""
    try:
        return read_tables(path, settings.mapping(), am.bench.Decimation(MAX_ROWS))
    except ColumnError as error:
        if error.hint is None or error.hint.argument != "columns":
            raise
        return read_tables(
            path, settings.mapping({**settings.columns, "1": ""}), am.bench.Decimation(MAX_ROWS)
        )


def _constants(path: Path, settings: FitSettings) -> dict[str, float | str]:
    """The constants of a file: those of its row precede those in its name and those of all
    files.
    """
    try:
        common = settings.mapping({}).constants_of(path)
    except AirmuscleError as error:
        raise as_field_error(error, "file_name") from None
    return {**common, **settings.facts.get(path.name, {})}


def _keys(table: RawTable) -> list[str]:
    """The key of each column: its heading if it occurs once, otherwise its number."""
    return [
        h if h and table.headings.count(h) == 1 else str(i) for i, h in enumerate(table.headings, 1)
    ]


def _name_and_unit(text: str) -> tuple[str, str, bool]:
    """The quantity or constant of a heading, its unit, and whether it is a known one."""
    constant = parse_constant_name(text)
    if constant is not None:
        return (*constant, True)
    heading = parse_heading(text)
    return heading.name, heading.unit or "", heading.known


def _unit_problems(
    table: RawTable, columns: Sequence[FileColumn], constants: dict[str, float | str]
) -> Iterator[RequestError]:
    """A problem for each column whose unit is missing or unknown, and for two columns of one
    quantity.
    """
    ambient = constants.get("ambient")
    pressure = quantity(ambient, "Pa", ambient=0.0) if ambient else AMBIENT_PRESSURE
    used = [column for column in columns if column.used]
    names = [column.name for column in used if column.known]
    double = next(
        (column for column in used if column.known and names.count(column.name) > 1), None
    )
    if double is not None:
        keys = " and ".join(f"'{column.key}'" for column in used if column.name == double.name)
        yield RequestError(
            f"{table.origin}: columns {keys} are both read as {double.name}. Select 'not used' for"
            " all but one.",
            f"column:{double.key}",
        )
        return
    try:
        headings = resolve_headings(table, {})
    except AirmuscleError as error:
        yield as_field_error(error, "columns")
        return
    for column, heading in zip(used, headings, strict=False):
        if not heading.known:
            continue
        try:
            unit_conversion(table, heading, pressure)
        except AirmuscleError as error:
            text = in_page_words(error.message).partition(": ")[2] or str(error.message)
            if heading.unit is None:
                what = f"the unit of '{column.key}' ({heading.name})"
                text = f"{what} is not stated in the file; write it into the field Unit."
            yield RequestError(text, f"column:{column.key}")


def _check_needed(recording: am.Recording, file: str, read: ReadSet) -> None:
    """Complain about each quantity that a static fit needs and the recording lacks."""
    moved = next(
        (quantity for quantity in ("length", "shortening") if quantity in recording.columns), ""
    )
    for name in (name for name in NEEDED if name not in recording):
        text = f"no column is a {name}. Select its column."
        field = "columns"
        if name == "contraction" and moved:
            text = (
                f"the resting length is not known, which converts the {moved} to a contraction."
                " Write it into the "
            )
            text = f"{text}field 'Resting length', such as 300 mm."
            field = "resting_length"
        elif name == "contraction":
            text = (
                "there is neither a contraction nor a length. Select its column, which may be a"
                " shortening or an "
            )
            text += (
                "elongation, or write the length at which the muscle was held into the row of the"
                " file."
            )
            field = f"file:{file}"
        read.complain(RequestError(f"{recording.origin}: {text}", field))


# Remedies of the page: the hints of messages in the words of the fields of the tab Fit


def _missing(hint: Hint) -> str:
    """The field of a treatment of missing values, and that of its codes."""
    codes = ", ".join(map(str, hint.value.codes))
    choice = (
        "interpolate short gaps"
        if isinstance(hint.value, am.bench.InterpolateMissing)
        else "leave out the rows"
    )
    return f"select '{choice}' in the field 'Missing values'" + (
        f" and write {codes} into the field 'Codes of missing values'" if codes else ""
    )


_INSTRUCTIONS: Mapping[str, tuple[str, Instruction]] = {
    "units": (
        "columns",
        lambda hint: f"select it in the table Columns, row {', '.join(map(str, hint.value))}",
    ),
    "columns": ("columns", lambda hint: "select the quantity of each column in the table Columns"),
    "constants": ("files", lambda hint: "write it into the row of the file, in the table Files"),
    "file_name": (
        "file_name",
        lambda hint: f"write {hint.value} into the field 'Values in file names'",
    ),
    "time": ("time", lambda hint: "select another time base"),
    "decimal": ("decimal", lambda hint: "select the decimal mark"),
    "missing": ("missing", _missing),
    "drop_outliers": (
        "outliers",
        lambda hint: "select 'leave out' in the field 'Suspected outliers'",
    ),
    "skip_rows": ("skip_rows", lambda hint: "write it into the field 'Lines above the headings'"),
    "displacement_zero": (
        "displacement_zero",
        lambda hint: "write it into the field 'Displacement at the resting length'",
    ),
    "resting_length": ("resting_length", lambda hint: "write it into the field 'Resting length'"),
    **dict.fromkeys(
        ("by", "leave_out"),
        (
            "leave_out",
            lambda hint: f"select {hint.value.quantity} in the field 'Cross-validation leaves out'",
        ),
    ),
    "bench.fit_hysteresis": ("hysteresis", lambda hint: "mark 'Friction from both branches'"),
}
"""Field and instruction by the argument of a hint, or by its function."""


def in_page_words(text: str) -> str:
    """The text with hints that name fields of the page; a hint for which the page has no field is
    left out.
    """
    return reworded(text, {name: instruction for name, (_, instruction) in _INSTRUCTIONS.items()})


def as_field_error(error: AirmuscleError, field: str = "") -> RequestError:
    """The error with its field: its own, that of its hint, or else `field`."""
    hinted = [
        _INSTRUCTIONS[hint.argument][0]
        for hint in error.message.hints
        if hint.argument in _INSTRUCTIONS
    ]
    return RequestError(
        in_page_words(error.message), getattr(error, "field", "") or next(iter(hinted), field)
    )
