"""Request of reading measurement files: how a file is read, and what it does not state itself."""

from pathlib import Path
from typing import Any

from ...bench.readers import ColumnMapping, mapping_of_tables, read_mapping
from ...bench.readers.tables.missing_values import parse_code
from .declaration import many, optional, read_pair, request

Pairs = tuple[Any, ...]
"""Pairs of a name and a text."""


@request
class ReadingRequest:
    """How measurement files are read; each field has precedence over the mapping file, and this
    over the files.
    """

    resting_length: str | None = optional(
        "Length without pressure and load, such as '300 mm'.",
        metavar="QUANTITY",
        label="Resting length, without pressure and load",
        example="300 mm",
    )
    ambient: str | None = optional(
        "Ambient pressure, subtracted from absolute pressures, such as '98 kPa'.",
        metavar="QUANTITY",
        label="Ambient pressure (for absolute pressures)",
        example="98 kPa",
    )
    unit: Pairs = many(
        "Unit of a column whose header states none; repeatable.",
        metavar="COLUMN=UNIT",
        read=read_pair,
    )
    mapping: Path | None = optional(
        "Column mapping (TOML) for headers without quantity or unit.", metavar="FILE"
    )
    column: Pairs = many(
        "Header of a column, by name or number: 'Channel 1=pressure [bara]', '3=length [mm]'."
        " Repeatable.",
        metavar="COLUMN=HEADER",
        read=read_pair,
    )
    constant: Pairs = many(
        "Quantity that was held and not recorded, 'length=73.2 mm', or specimen, run. Repeatable.",
        metavar="NAME=QUANTITY",
        read=read_pair,
    )
    file_name: str | None = optional(
        "Values in the names of the files: 'cut{specimen}_held{length [cm]}cm'; {} is any text.",
        metavar="PATTERN",
        label="Values in file names",
        example="cut{specimen}_held{length [mm]}mm",
    )
    time: str | None = optional(
        "Time base: recorded, uniform (by the number of rows, for rounded stamps), unordered or"
        " none.",
        metavar="BASE",
        label="Time base",
        offered=(
            ("", "as recorded"),
            ("uniform", "uniform, for rounded stamps"),
            ("unordered", "unordered"),
            ("none", "none"),
        ),
    )
    sample_rate: str | None = optional(
        "Time of rows without time: '500 Hz' or '2 ms', by a counter of samples if there is one;"
        " rows with time are interpolated to it.",
        metavar="QUANTITY",
        label="Sample rate",
        example="500 Hz",
    )
    grid: str | None = optional(
        "Quantities of a grid: 'force [N] over contraction [%], pressure [kPa]' (cells, first"
        " column, headings).",
        metavar="QUANTITIES",
        label="Quantities of a grid",
        example="force [N] over contraction [%], pressure [kPa]",
    )
    displacement_zero: str | None = optional(
        "Reading of a displacement, shortening or elongation at the resting length, such as '12"
        " mm'; default: 0.",
        metavar="QUANTITY",
        label="Displacement at the resting length",
        example="0 mm",
    )
    skip_rows: int | None = optional(
        "Lines above the headings of text files and worksheets; default: detected, or found by"
        " --column.",
        bounds=(0, float("inf")),
        label="Lines above the headings",
        example="detected",
    )
    missing: str | None = optional(
        "Missing values (empty, '---', NaN, '#N/A', --missing-code): error (default), drop (leave"
        " out the rows), interpolate (short gaps in time; other rows are left out).",
        metavar="TREATMENT",
        label="Missing values",
        offered=(
            ("", "are an error"),
            ("drop", "leave out the rows"),
            ("interpolate", "interpolate short gaps"),
        ),
    )
    missing_code: tuple[Any, ...] = many(
        "Number or text that stands for a missing value: -999. Repeatable.",
        metavar="CODE",
        read=lambda text, where: parse_code(text),
        label="Codes of missing values",
        example="-999, OL",
    )
    outliers: str | None = optional(
        "Suspected outliers, as inspect lists them: keep (default) or drop (leave out).",
        metavar="TREATMENT",
        label="Suspected outliers",
        offered=(("", "keep"), ("drop", "leave out")),
    )
    delimiter: str | None = optional(
        "Column delimiter of text files; default: detected.",
        metavar="CHARACTER",
        label="Column delimiter of text files",
        offered=(
            ("", "detected"),
            (";", "semicolon"),
            (",", "comma"),
            ("\t", "tab"),
            (" ", "blank"),
        ),
    )
    decimal: str | None = optional(
        "Decimal mark of text files; default: detected.",
        metavar="CHARACTER",
        label="Decimal mark of text files",
        offered=(("", "detected"), (",", "comma"), (".", "point")),
    )
    sheet: str | None = optional(
        "Worksheet of an Excel file; default: all.", label="Worksheet of Excel files"
    )
    group: str | None = optional(
        "Group of a TDMS or MDF file, struct of a MAT file, segment of an LVM file.",
        label="Group, struct or segment of TDMS, MDF, HDF5, MAT and LVM files",
    )

    def column_mapping(
        self, default: ColumnMapping = ColumnMapping(), **others: Any
    ) -> ColumnMapping:
        """The mapping of the file, if any, or else `default`; the fields, and the further keys,
        have precedence.

        Raises FileError, ParameterError for an invalid mapping file, and ColumnError for
        contradictory columns.
        """
        stated = {
            "columns": dict(self.column),
            "units": dict(self.unit),
            "constants": dict(self.constant),
            "missing_codes": self.missing_code or None,
            **{name: value for name, value in vars(self).items() if name not in _TABLES},
            **others,
        }
        return mapping_of_tables(
            stated, "mapping", read_mapping(self.mapping, default) if self.mapping else default
        )


_TABLES = ("mapping", "column", "unit", "constant", "missing_code")
"""Fields that are no keys of a mapping file under this name."""
