"""Reader of laboratory files: one file, several files, a glob pattern or a folder; the extension gives the format."""

from __future__ import annotations

import dataclasses
import glob
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path

from ...core.annotation import abridged
from ...core.errors import FileError, printable
from ...recording.recording import Recording
from ..checks import warn_of_suspicious_values
from ..segment.outliers import without_outliers
from .downsampling import Decimation, Downsampling, downsample
from .file_kind import check_text_file
from .interpret import interpret
from .large_csv import Progress, is_large_file, read_large_csv
from .mapping import ColumnMapping, apply_mapping, read_mapping
from .missing_values import MissingValues
from .raw_columnar import read_hdf5_tables, read_parquet_tables
from .raw_csv import read_csv_table
from .raw_mat import read_mat_tables
from .raw_mdf import read_mdf_tables
from .raw_rosbag import read_rosbag_tables
from .raw_tdms import read_tdms_tables
from .raw_workbook import read_workbook_tables
from .specimens import split_specimens
from .table import RawTable
from .time_base import RecordedTime, TimeBase
from .unit_consistency import check_unit_consistency

Source = str | Path | Iterable[str | Path]
Tables = tuple[RawTable, ...]

WORKBOOKS = (".xlsx", ".xlsm", ".xls", ".ods")
TEXT_EXTENSIONS = (".csv", ".txt", ".tsv", ".dat", ".asc", ".prn")
_BINARY_READERS: Mapping[str, Callable[[Path, ColumnMapping, Downsampling], Tables]] = {
    **dict.fromkeys(WORKBOOKS, lambda path, m, d: read_workbook_tables(path, m.sheet, m.text_format)),
    ".parquet": lambda path, m, d: read_parquet_tables(path, m.group),
    ".h5": lambda path, m, d: read_hdf5_tables(path, m.group, d),
    ".hdf5": lambda path, m, d: read_hdf5_tables(path, m.group, d),
    ".mat": lambda path, m, d: read_mat_tables(path, m.group, tuple(m.columns), d),
    ".tdms": lambda path, m, d: read_tdms_tables(path, m.group),
    ".mf4": lambda path, m, d: read_mdf_tables(path, m.group, d),
    ".mdf": lambda path, m, d: read_mdf_tables(path, m.group, d),
    ".bag": lambda path, m, d: read_rosbag_tables(path, m.group),
    ".db3": lambda path, m, d: read_rosbag_tables(path, m.group),
    ".mcap": lambda path, m, d: read_rosbag_tables(path, m.group),
}
EXTENSIONS = (*TEXT_EXTENSIONS, *_BINARY_READERS)
"""Extensions of the supported files."""


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
    constants: Mapping[str, float | str] | None = None,
    file_name: str | None = None,
    downsampling: Downsampling = Decimation(),
    ordered: bool = True,
    time_base: TimeBase | None = None,
    displacement_zero: float | str | None = None,
    skip_rows: int | None = None,
    missing: MissingValues | None = None,
    drop_outliers: bool | None = None,
    progress: Progress | None = None,
) -> tuple[Recording, ...]:
    """Read the recordings in a file, several files, a glob pattern (`runs/*.csv`) or a folder, in SI units.

    mapping       a TOML file or a ColumnMapping with what the files do not state; keyword arguments override it
    columns       headings by heading or number: {"Channel 1": "pressure [bara]", 3: "length [mm]"}
    units         units by quantity or heading: {"pressure": "kPa(a)"}
    resting_length, ambient, specimen  constants of the runs; lengths [m] and pressures [Pa], or texts with a unit
    delimiter, decimal, sheet, group   as in ColumnMapping
    downsampling  reduction of very long files, which a note reports
    constants     further constants of the runs; a quantity, {"length": "7.3 cm"}, was held and becomes a column
    file_name     pattern of values in the names of the files: "cut{specimen}_held{length [cm]}cm"
    ordered       whether the recorded time must increase
    time_base     RecordedTime(), UniformTime() for stamps that the logger rounded, or NoTime(); by default that of the
                  mapping, or the recorded time
    displacement_zero  reading of a displacement at the resting length [m], or a text with a unit
    skip_rows     number of lines above the headings of text files and worksheets; by default they are detected, or
                  found by the headings that `columns` names
    missing       RefuseMissing(), DropMissing(codes) or InterpolateMissing(codes); by default that of the mapping, or
                  an error that lists the missing values
    drop_outliers whether the rows of suspected outliers are left out; by default as in the mapping, or kept
    progress      called with the name of a file and the fraction that has been read

    The extension gives the format: text (CSV), Excel, OpenDocument, MAT, TDMS, MDF, Parquet or HDF5. A load in kg
    becomes a force with standard gravity. Files whose units contradict each other are rejected.

    Raises FileError, ColumnError, UnitError or ParameterError; the message names file, row, value and remedy.
    """
    base = mapping if isinstance(mapping, ColumnMapping) else read_mapping(mapping) if mapping else ColumnMapping()
    column_mapping = base.with_overrides(
        columns=columns, resting_length=resting_length, ambient=ambient, specimen=specimen, delimiter=delimiter,
        decimal=decimal, sheet=sheet, group=group, constants=constants or {}, file_name=file_name,
        displacement_zero=displacement_zero, skip_rows=skip_rows,
        outliers=None if drop_outliers is None else "drop" if drop_outliers else "keep",
    )  # fmt: skip
    chosen = time_base or (column_mapping.time_base if column_mapping.time else RecordedTime(ordered))
    recordings = [
        recording
        for path in find_files(source)
        for recording in read_file(path, column_mapping, units or {}, downsampling, chosen, progress, missing)
    ]
    return tuple(complete_bench(recordings, column_mapping))


def read_file(
    path: Path,
    mapping: ColumnMapping,
    units: Mapping[str, str],
    downsampling: Downsampling = Decimation(),
    time_base: TimeBase | None = None,
    progress: Progress | None = None,
    missing: MissingValues | None = None,
) -> list[Recording]:
    """The recordings in one file, as `read`; what concerns all files of a test rig is done by `complete_bench`."""
    chosen = time_base or (mapping.time_base if mapping.time else RecordedTime())
    return [
        interpret(
            part,
            units=units,
            constants=mapping.constants_of(path),
            time_base=chosen,
            missing=missing or mapping.missing_values,
        )
        for table in read_tables(path, mapping, downsampling, progress)
        for part in split_specimens(apply_mapping(_with_printable_origin(table), mapping))
    ]


def _with_printable_origin(table: RawTable) -> RawTable:
    """The table under a name that figures and reports can contain: a name of a file may be no text."""
    return dataclasses.replace(table, origin=printable(table.origin))


def complete_bench(recordings: Sequence[Recording], mapping: ColumnMapping) -> list[Recording]:
    """The recordings of one bench, without outliers if the mapping says so, checked as by `check_bench`."""
    complete = list(without_outliers(recordings) if mapping.outliers == "drop" else recordings)
    check_bench(complete)
    return complete


def check_bench(recordings: list[Recording]) -> None:
    """Check the recordings of one bench together: units (UnitError), and suspicious values (AirmuscleWarning)."""
    check_unit_consistency(recordings)
    warn_of_suspicious_values(recordings)


def find_files(source: Source) -> list[Path]:
    """The files of a path, a glob pattern, a folder or several of these, each sorted by name. Raises FileError."""
    if not isinstance(source, str | Path):
        if not isinstance(source, Iterable):
            raise FileError(
                f"read: {abridged(source)} is not a path. Pass a file, a folder, a glob pattern, or a list of them."
            )
        return [path for each in source for path in find_files(each)]
    path = Path(source)
    if path.is_dir():
        files = sorted(p for p in path.iterdir() if p.suffix.lower() in EXTENSIONS and not p.name.startswith("."))
        if not files:
            raise FileError(
                f"{path}: the folder contains no supported file; supported extensions are {', '.join(EXTENSIONS)}."
            )
        return files
    if glob.has_magic(str(path)) and not path.exists():
        files = sorted(Path(p) for p in glob.glob(str(path), recursive=True))
        if not files:
            raise FileError(f"{path}: no file matches the pattern. Check the pattern and the folder.")
        return files
    return [path]


def read_tables(
    path: Path, mapping: ColumnMapping, downsampling: Downsampling, progress: Progress | None = None
) -> Tables:
    """The uninterpreted tables of one file. Raises FileError or ColumnError."""
    suffix = path.suffix.lower()
    if suffix in _BINARY_READERS:
        return tuple(downsample(table, downsampling) for table in _BINARY_READERS[suffix](path, mapping, downsampling))
    check_text_file(path)
    if is_large_file(path):
        return (read_large_csv(path, mapping.text_format, downsampling, progress),)
    return (downsample(read_csv_table(path, mapping.text_format), downsampling),)
