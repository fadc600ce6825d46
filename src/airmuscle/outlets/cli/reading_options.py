"""Options of every command that reads measurement files: how a file is read, and what it does not state itself."""

from __future__ import annotations

import dataclasses
import functools
import inspect
from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any, TypeVar, get_type_hints

import typer

from ...bench.readers import ColumnMapping
from ...bench.readers.mapping import mapping_of_tables, read_mapping

Command = TypeVar("Command", bound=Callable[..., None])
MappingFile = Annotated[
    Path | None,
    typer.Option("--mapping", metavar="FILE", help="Column mapping (TOML) for headers without quantity or unit."),
]
Length = Annotated[
    str | None, typer.Option(metavar="QUANTITY", help="Length without pressure and load, such as '300 mm'.")
]
AmbientPressure = Annotated[
    str | None,
    typer.Option(metavar="QUANTITY", help="Ambient pressure, subtracted from absolute pressures, such as '98 kPa'."),
]
Units = Annotated[
    list[str] | None,
    typer.Option("--unit", metavar="COLUMN=UNIT", help="Unit of a column whose header states none; repeatable."),
]
Columns = Annotated[
    list[str] | None,
    typer.Option(
        "--column",
        metavar="COLUMN=HEADER",
        help="Header of a column, by name or number: 'Channel 1=pressure [bara]', '3=length [mm]'. Repeatable.",
    ),
]
Constants = Annotated[
    list[str] | None,
    typer.Option(
        "--constant",
        metavar="NAME=QUANTITY",
        help="Quantity that was held and not recorded, 'length=73.2 mm', or specimen, run. Repeatable.",
    ),
]
DisplacementZero = Annotated[
    str | None,
    typer.Option(
        metavar="QUANTITY",
        help="Reading of a displacement, shortening or elongation at the resting length, such as '12 mm'; default: 0.",
    ),
]
SkipRows = Annotated[
    int | None,
    typer.Option(
        min=0,
        metavar="N",
        help="Lines above the headings of text files and worksheets; default: detected, or found by --column.",
    ),
]
Missing = Annotated[
    str | None,
    typer.Option(
        metavar="TREATMENT",
        help="Missing values (empty, '---', NaN, '#N/A', --missing-code): error (default), drop (leave out the rows), "
        "interpolate (short gaps in time; other rows are left out).",
    ),
]
MissingCodes = Annotated[
    list[str] | None,
    typer.Option(
        "--missing-code", metavar="CODE", help="Number or text that stands for a missing value: -999. Repeatable."
    ),
]
Outliers = Annotated[
    str | None,
    typer.Option(
        metavar="TREATMENT", help="Suspected outliers, as inspect lists them: keep (default) or drop (leave out)."
    ),
]
Delimiter = Annotated[
    str | None, typer.Option(metavar="CHARACTER", help="Column delimiter of text files; default: detected.")
]
Decimal = Annotated[
    str | None, typer.Option(metavar="CHARACTER", help="Decimal mark of text files; default: detected.")
]
Sheet = Annotated[str | None, typer.Option(metavar="NAME", help="Worksheet of an Excel file; default: all.")]
Group = Annotated[
    str | None, typer.Option(metavar="NAME", help="Group of a TDMS or MDF file, or struct of a MAT file.")
]
NamePattern = Annotated[
    str | None,
    typer.Option(
        "--file-name",
        metavar="PATTERN",
        help="Values in the names of the files: 'cut{specimen}_held{length [cm]}cm'; {} is any text.",
    ),
]
TimeOption = Annotated[
    str | None,
    typer.Option(
        "--time",
        metavar="BASE",
        help="Time base: recorded, uniform (by the number of rows, for rounded stamps), unordered or none.",
    ),
]


@dataclasses.dataclass(frozen=True)
class ReadingOptions:
    """Values of the options, as given on the command line."""

    resting_length: Length = None
    ambient: AmbientPressure = None
    unit: Units = None
    mapping: MappingFile = None
    column: Columns = None
    constant: Constants = None
    file_name: NamePattern = None
    time: TimeOption = None
    displacement_zero: DisplacementZero = None
    skip_rows: SkipRows = None
    missing: Missing = None
    missing_code: MissingCodes = None
    outliers: Outliers = None
    delimiter: Delimiter = None
    decimal: Decimal = None
    sheet: Sheet = None
    group: Group = None

    def column_mapping(self, default: ColumnMapping = ColumnMapping()) -> ColumnMapping:
        """The mapping of the file, or else `default`; the options take precedence.

        Raises BadParameter for an option that is not NAME=TEXT, FileError and ParameterError for a mapping file that is
        invalid, and ColumnError for contradictory columns.
        """
        stated = {
            "columns": parse_pairs("--column", self.column),
            "units": parse_pairs("--unit", self.unit),
            "constants": parse_pairs("--constant", self.constant),
            "missing_codes": self.missing_code or None,
            **{name: getattr(self, name) for name in _SAME_IN_MAPPING},
        }
        return mapping_of_tables(stated, "mapping", read_mapping(self.mapping, default) if self.mapping else default)


NO_OPTIONS = ReadingOptions()
_SAME_IN_MAPPING = (
    "resting_length", "ambient", "displacement_zero", "file_name", "time", "skip_rows", "missing", "outliers",
    "delimiter", "decimal", "sheet", "group",
)  # fmt: skip
_FIELDS = tuple(field.name for field in dataclasses.fields(ReadingOptions))


def with_reading_options(command: Command) -> Command:
    """A command whose parameter `reading` is replaced by the options of `ReadingOptions`, for the command line."""
    hints, options = get_type_hints(command, include_extras=True), get_type_hints(ReadingOptions, include_extras=True)
    parameters = list[inspect.Parameter]()
    for parameter in inspect.signature(command).parameters.values():
        if parameter.name == "reading":
            parameters += [parameter.replace(name=name, annotation=options[name], default=None) for name in _FIELDS]
        else:
            parameters.append(parameter.replace(annotation=hints[parameter.name]))

    @functools.wraps(command)
    def expanded(**values: Any) -> None:
        reading = ReadingOptions(**{name: values.pop(name) for name in _FIELDS})
        command(**values, reading=reading)

    expanded.__signature__ = inspect.Signature(parameters)  # type: ignore[attr-defined]
    expanded.__annotations__ = {parameter.name: parameter.annotation for parameter in parameters}
    return expanded  # type: ignore[return-value]


def parse_pairs(option: str, texts: list[str] | None) -> dict[str, str]:
    """The values of a repeatable option such as --unit COLUMN=UNIT, by name. Raises BadParameter."""
    parts = [text.partition("=") for text in texts or ()]
    if not all(name.strip() and sign for name, sign, _ in parts):
        raise typer.BadParameter(f"{option} must be NAME=TEXT, not {', '.join(texts or ())}")
    return {name.strip(): value.strip() for name, _, value in parts}
