"""Formats of measurement files: one table of their extensions, first bytes and readers.

A reader gives tables, which become recordings, or the arrays of episodes; a format without arrays
gives an episode for each table. All formats are read in a separate process with limits of its time
and memory, in which links to other files are refused. Text, which has no links and which the
program parses itself, is read in this process up to a size with which its time and memory are below
these limits, because the start of a process takes longer.
"""

import dataclasses
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
    is_text,
    named_function,
)
from .raw_csv import LARGE_FILE_BYTES, Progress


@dataclasses.dataclass(frozen=True)
class Format:
    """A format of files.

    name        in messages
    extensions  of its files, in lower case
    beginnings  first bytes, by which files with the extension of a text are recognised
    package     that it needs
    tables, arrays  its readers, functions of modules of this package, which the process that reads
                imports; None if it gives episodes alone, or an episode for each table
    size_here       size [bytes] up to which a file is read in this process, not in the separate one
    """

    name: str
    extensions: tuple[str, ...]
    beginnings: tuple[bytes, ...] = ()
    package: str | None = None
    tables: str | None = None
    arrays: str | None = None
    size_here: int = 0

    def read_tables(
        self, path: Path, selection: Selection = Selection(), progress: Progress | None = None
    ) -> tuple[RawTable, ...]:
        """The uninterpreted tables of a file; a reader of text states its progress. Raises
        FileError or ColumnError.
        """
        if self.tables is None:
            raise FileError(
                f"{path.name}: {self.name} files are read as episodes of an arm alone (airmuscle"
                " fit-joint, and predict with the arm that it has written). For a recording, write"
                f" one of {', '.join(EXTENSIONS)}."
            )
        report = progress if self is TEXT else None
        tables: tuple[RawTable, ...] = self.call(self.tables, path, selection, progress=report)
        return tables

    def read_arrays(self, path: Path) -> list[Arrays]:
        """The arrays of every episode in a file. Raises FileError or ColumnError."""
        if self.arrays is None:
            return [arrays_of_table(table) for table in self.read_tables(path)]
        arrays: list[Arrays] = self.call(self.arrays, path)
        return arrays

    def call(
        self, reader: str, path: Path, *arguments: Any, progress: Progress | None = None
    ) -> Any:
        """What a function of a module of this package, `module.function`, reads in a file. Raises
        FileError or ColumnError.
        """
        if self.package is not None:
            check_installed(self.package, path)
        check_regular_file(path)
        check_is_data(path)
        name, _, function = reader.partition(".")
        module = f"{__package__}.{name}"
        if path.stat().st_size > self.size_here:
            return call_in_separate_process(module, function, path, *arguments, progress=progress)
        last = () if progress is None else (progress,)
        return named_function(module, function)(path, *arguments, *last)


TEXT = Format(
    "text",
    (".csv", ".txt", ".tsv", ".dat", ".asc", ".prn", ".lvm"),
    tables="raw_csv.read_text_tables",
    size_here=LARGE_FILE_BYTES,
)
WORKBOOK = Format(
    "workbook",
    (".xlsx", ".xlsm", ".xls", ".ods"),
    (b"PK\x03\x04", b"\xd0\xcf\x11\xe0"),
    package="python_calamine",
    tables="raw_workbook.read_workbook_tables",
)
FORMATS = (
    TEXT,
    Format("LVM", (), (b"LabVIEW Measurement",), tables="raw_lvm.read_lvm_tables"),
    WORKBOOK,
    Format(
        "Parquet",
        (".parquet",),
        (b"PAR1",),
        "pyarrow",
        "raw_parquet.read_parquet_tables",
        "raw_parquet.read_parquet_arrays",
    ),
    Format(
        "HDF5",
        (".h5", ".hdf5"),
        (b"\x89HDF\r\n\x1a\n",),
        "h5py",
        "raw_hdf5.read_hdf5_tables",
        "raw_hdf5.read_hdf5_arrays",
    ),
    Format(
        "MATLAB",
        (".mat",),
        (b"MATLAB 5.0 MAT-file", b"MATLAB 7.3 MAT-file"),
        "scipy",
        "raw_mat.read_mat_tables",
        "raw_mat.read_mat_arrays",
    ),
    Format("TDMS", (".tdms",), (b"TDSm",), "nptdms", "raw_tdms.read_tdms_tables"),
    Format("MDF", (".mf4", ".mdf"), (b"MDF  ",), "asammdf", "raw_mdf.read_mdf_tables"),
    Format(
        "ROS bag",
        (".bag", ".db3", ".mcap"),
        (b"#ROSBAG V", b"\x89MCAP0\r\n", b"SQLite format 3\0"),
        "rosbags.highlevel",
        "raw_rosbag.read_rosbag_tables",
    ),
    Format("NPZ", (".npz",), arrays="raw_npz.read_npz_arrays"),
    Format("JSON", (".json", ".jsonl"), arrays="raw_json.read_json_arrays"),
)
EXTENSIONS = tuple(name for form in FORMATS if form.tables for name in form.extensions)
"""Extensions of the files that give recordings."""
EPISODE_EXTENSIONS = tuple(name for form in FORMATS for name in form.extensions)
"""Extensions of the files that give episodes."""
BEGINNING = 4096
"""First bytes of a file by which its format is told [bytes] (chosen)."""


def format_of(path: Path) -> Format:
    """The format of a file: the first bytes decide before the extension, which tells apart those
    that begin alike; a table of text under the name of another format is text. Raises FileError for
    a path that is no regular file.
    """
    named = next((form for form in FORMATS if path.suffix.lower() in form.extensions), TEXT)
    if named is not TEXT and not path.is_file():  # its reader states what is missing
        return named
    check_regular_file(path)
    with path.open("rb") as file:
        beginning = file.read(BEGINNING)
    if named.beginnings and beginning.startswith(named.beginnings):
        return named
    by_bytes = next((form for form in FORMATS if beginning.startswith(form.beginnings)), None)
    if named is TEXT:
        return by_bytes or TEXT if by_bytes is not WORKBOOK else TEXT
    if by_bytes is not None and named.arrays is None:
        return by_bytes
    return TEXT if named.tables and named.beginnings and is_text(beginning) else named
