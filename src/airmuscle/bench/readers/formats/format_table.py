"""Formats of measurement files: one table of their extensions, first bytes and readers.

A reader gives tables, which become recordings, or the arrays of episodes; a format without arrays
gives an episode for each table. All but text, which the program parses itself, are read in a
separate process with limits of its time and memory, in which links to other files are refused.
"""

import dataclasses
from collections.abc import Callable
from pathlib import Path
from typing import Any

from ....core import FileError
from ..tables import (
    Arrays,
    RawTable,
    Selection,
    arrays_of_table,
    call_in_separate_process,
    check_installed,
    check_is_data,
    check_regular_file,
)
from .raw_csv import read_text_tables
from .raw_hdf5 import read_hdf5_arrays, read_hdf5_tables
from .raw_json import read_json_arrays
from .raw_lvm import LVM_BEGINNING, read_lvm_tables
from .raw_mat import read_mat_arrays, read_mat_tables
from .raw_mdf import read_mdf_tables
from .raw_npz import read_npz_arrays
from .raw_parquet import read_parquet_arrays, read_parquet_tables
from .raw_rosbag import read_rosbag_tables
from .raw_tdms import read_tdms_tables
from .raw_workbook import read_workbook_tables

TableReader = Callable[[Path, Selection], tuple[RawTable, ...]]
ArrayReader = Callable[[Path], list[Arrays]]


@dataclasses.dataclass(frozen=True)
class Format:
    """A format of files.

    name        in messages
    extensions  of its files, in lower case
    beginnings  first bytes, by which files with the extension of a text are recognised
    package     that it needs
    tables, arrays  its readers; None if it gives episodes alone, or an episode for each table
    is_separate     whether it is read in the separate process
    """

    name: str
    extensions: tuple[str, ...]
    beginnings: tuple[bytes, ...] = ()
    package: str | None = None
    tables: TableReader | None = None
    arrays: ArrayReader | None = None
    is_separate: bool = True

    def read_tables(self, path: Path, selection: Selection = Selection()) -> tuple[RawTable, ...]:
        """The uninterpreted tables of a file. Raises FileError or ColumnError."""
        if self.tables is None:
            raise FileError(
                f"{path.name}: {self.name} files are read as episodes of an arm alone (airmuscle"
                f" fit-joint). For a recording, write one of {', '.join(EXTENSIONS)}."
            )
        tables: tuple[RawTable, ...] = self._call(self.tables, path, selection)
        return tables

    def read_arrays(self, path: Path) -> list[Arrays]:
        """The arrays of every episode in a file. Raises FileError or ColumnError."""
        if self.arrays is None:
            return [arrays_of_table(table) for table in self.read_tables(path)]
        arrays: list[Arrays] = self._call(self.arrays, path)
        return arrays

    def _call(self, reader: Callable[..., Any], path: Path, *arguments: Any) -> Any:
        if self.package is not None:
            check_installed(self.package, path)
        check_regular_file(path)
        check_is_data(path)
        if not self.is_separate:
            return reader(path, *arguments)
        return call_in_separate_process(reader.__module__, reader.__name__, path, *arguments)


TEXT = Format(
    "text",
    (".csv", ".txt", ".tsv", ".dat", ".asc", ".prn", ".lvm"),
    tables=read_text_tables,
    is_separate=False,
)
FORMATS = (
    TEXT,
    Format("LVM", (), (LVM_BEGINNING,), tables=read_lvm_tables),
    Format(
        "workbook",
        (".xlsx", ".xlsm", ".xls", ".ods"),
        package="python_calamine",
        tables=read_workbook_tables,
    ),
    Format(
        "Parquet", (".parquet",), (b"PAR1",), "pyarrow", read_parquet_tables, read_parquet_arrays
    ),
    Format(
        "HDF5",
        (".h5", ".hdf5"),
        (b"\x89HDF\r\n\x1a\n",),
        "h5py",
        read_hdf5_tables,
        read_hdf5_arrays,
    ),
    Format(
        "MATLAB",
        (".mat",),
        (b"MATLAB 5.0 MAT-file", b"MATLAB 7.3 MAT-file"),
        "scipy",
        read_mat_tables,
        read_mat_arrays,
    ),
    Format("TDMS", (".tdms",), (b"TDSm",), "nptdms", read_tdms_tables),
    Format("MDF", (".mf4", ".mdf"), (b"MDF  ",), "asammdf", read_mdf_tables),
    Format(
        "ROS bag",
        (".bag", ".db3", ".mcap"),
        (b"#ROSBAG V",),
        "rosbags.highlevel",
        read_rosbag_tables,
    ),
    Format("NPZ", (".npz",), arrays=read_npz_arrays),
    Format("JSON", (".json", ".jsonl"), arrays=read_json_arrays),
)
EXTENSIONS = tuple(name for form in FORMATS if form.tables for name in form.extensions)
"""Extensions of the files that give recordings."""
EPISODE_EXTENSIONS = tuple(name for form in FORMATS for name in form.extensions)
"""Extensions of the files that give episodes."""
_LONGEST = max(len(beginning) for form in FORMATS for beginning in form.beginnings)


def format_of(path: Path) -> Format:
    """The format of a file, by its extension; where that is one of text, or unknown, by its first
    bytes, else text. Raises FileError for a path that is no regular file.
    """
    named = next((form for form in FORMATS if path.suffix.lower() in form.extensions), TEXT)
    if named is not TEXT:
        return named
    check_regular_file(path)
    with path.open("rb") as file:
        beginning = file.read(_LONGEST)
    return next((form for form in FORMATS if beginning.startswith(form.beginnings)), TEXT)
