"""Options of every command that reads measurement files: resting length, units, columns, constants and time base."""

from __future__ import annotations

import dataclasses
import functools
import inspect
from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any, TypeVar, get_type_hints

import typer

from ..recording import ColumnMapping
from ..recording.mapping import read_mapping

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

    @property
    def units(self) -> dict[str, str]:
        """The unit of each column that `--unit` names. Raises BadParameter."""
        return parse_pairs("--unit", self.unit)

    def column_mapping(self, **more: Any) -> ColumnMapping:
        """The mapping of the file, if any; the options, and `more` fields of the mapping, take precedence.

        Raises BadParameter for an option that is not NAME=TEXT, FileError and ParameterError for a mapping file that is
        invalid, and ColumnError for contradictory columns.
        """
        base = read_mapping(self.mapping) if self.mapping else ColumnMapping()
        return base.with_overrides(
            columns=parse_pairs("--column", self.column),
            constants=parse_pairs("--constant", self.constant),
            file_name=self.file_name,
            time=self.time,
            resting_length=self.resting_length,
            ambient=self.ambient,
            **more,
        )


NO_OPTIONS = ReadingOptions()
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
