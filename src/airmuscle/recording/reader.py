"""Reading whatever a laboratory has: one file, several, a folder; the ending of a file says what it is."""

from __future__ import annotations

import glob
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path

from ..core.errors import FileError
from .unit_consistency import check_unit_consistency
from .interpret import interpret
from .large_csv import Progress, is_large_file, read_large_csv
from .mapping import ColumnMapping, apply_mapping, read_mapping
from .raw_csv import read_csv_table
from .raw_excel import read_excel_tables
from .raw_mat import read_mat_tables
from .raw_mdf import read_mdf_tables
from .raw_tdms import read_tdms_tables
from .recording import Recording
from .table import RawTable
from .downsampling import Decimation, Downsampling, downsample

Source = str | Path | Iterable[str | Path]
Tables = tuple[RawTable, ...]

TEXT_EXTENSIONS = (".csv", ".txt", ".tsv", ".dat", ".asc", ".prn")
_BINARY_READERS: Mapping[str, Callable[[Path, ColumnMapping], Tables]] = {
    ".xlsx": lambda path, m: read_excel_tables(path, m.sheet, headless=m.text_format.headerless),
    ".xlsm": lambda path, m: read_excel_tables(path, m.sheet, headless=m.text_format.headerless),
    ".mat": lambda path, m: read_mat_tables(path, m.group),
    ".tdms": lambda path, m: read_tdms_tables(path, m.group),
    ".mf4": lambda path, m: read_mdf_tables(path, m.group),
    ".mdf": lambda path, m: read_mdf_tables(path, m.group),
}
EXTENSIONS = (*TEXT_EXTENSIONS, *_BINARY_READERS)
"""Endings of the files that are read."""


def read(
    source: Source,
    *,
    mapping: str | Path | ColumnMapping | None = None,
    columns: Mapping[str | int, str] | None = None,
    units: Mapping[str, str] | None = None,
    resting_length: float | str | None = None,
    ambient: float | str | None = None,
    specimen: str | None = None,
    delimiter: str | None = None,
    decimal: str | None = None,
    sheet: str | None = None,
    group: str | None = None,
    thinning: Downsampling = Decimation(),
    ordered: bool = True,
    progress: Progress | None = None,
) -> tuple[Recording, ...]:
    """The recordings in a file, several files, a glob (`runs/*.csv`) or a folder, in SI units.

    Text (CSV), Excel, MAT, TDMS and MDF are told by the ending. `mapping` is a TOML file, or a ColumnMapping, with
    what files do not say of themselves; what is given by keyword goes before it. `columns` names columns by heading
    or number: {"Channel 1": "pressure [bara]", 3: "length [mm]"}. A load in kg becomes a force by standard gravity.
    Files that contradict each other's units are refused, and time that does not increase unless `ordered` is false.
    Very long files are thinned, which a note says; `progress` is called with a file's name and the part of it read.

    Raises FileError, ColumnError, UnitError or ParameterError with file, row, value and remedy.
    """
    base = mapping if isinstance(mapping, ColumnMapping) else read_mapping(mapping) if mapping else ColumnMapping()
    told = base.with_overrides(
        columns=columns, resting_length=resting_length, ambient=ambient, specimen=specimen, delimiter=delimiter,
        decimal=decimal, sheet=sheet, group=group,
    )  # fmt: skip
    found = [
        interpret(apply_mapping(table, told), units=units or {}, constants=told.constants, ordered=ordered)
        for path in find_files(source)
        for table in read_tables(path, told, thinning, progress)
    ]
    check_unit_consistency(found)
    return tuple(found)


def find_files(source: Source) -> list[Path]:
    """The files meant by a path, a glob, a folder or several of these, in the order of their names."""
    if not isinstance(source, str | Path):
        if not isinstance(source, Iterable):
            raise FileError(f"read: {source!r} is no path; name a file, a folder, a glob, or several of them.")
        return [path for each in source for path in find_files(each)]
    path = Path(source)
    if path.is_dir():
        found = sorted(p for p in path.iterdir() if p.suffix.lower() in EXTENSIONS and not p.name.startswith("."))
        if not found:
            raise FileError(f"{path}: the folder holds no file that can be read; those end in {', '.join(EXTENSIONS)}.")
        return found
    if glob.has_magic(str(path)) and not path.exists():
        found = sorted(Path(p) for p in glob.glob(str(path), recursive=True))
        if not found:
            raise FileError(f"{path}: no file is called so. Check the pattern and the folder.")
        return found
    return [path]


def read_tables(path: Path, told: ColumnMapping, thinning: Downsampling, progress: Progress | None = None) -> Tables:
    """The tables of one file, as yet uninterpreted. Raises FileError or ColumnError."""
    suffix = path.suffix.lower()
    if suffix in _BINARY_READERS:
        return tuple(downsample(table, thinning) for table in _BINARY_READERS[suffix](path, told))
    if suffix in (".xls", ".ods"):
        raise FileError(f"{path.name}: {suffix} is not read. Save it as .xlsx or .csv.")
    if suffix not in TEXT_EXTENSIONS and _is_binary(path):
        raise FileError(
            f"{path.name}: this is no text, and its ending tells no format; read are {', '.join(EXTENSIONS)}."
        )
    if is_large_file(path):
        return (read_large_csv(path, told.text_format, thinning, progress),)
    return (downsample(read_csv_table(path, told.text_format), thinning),)


def _is_binary(path: Path) -> bool:
    if not path.is_file():
        return False
    with path.open("rb") as file:
        beginning = file.read(4096)
    return b"\0" in beginning and beginning[:2] not in (b"\xff\xfe", b"\xfe\xff")
