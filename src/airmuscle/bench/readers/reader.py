"""Reader of laboratory files: one file, several files, a glob pattern or a folder; the extension
gives the format.
"""

import dataclasses
import glob
import itertools
import sys
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from ...core import AirmuscleError, FileError, ParameterError, abridged, printable
from ...recording.recording import Recording
from .formats import (
    EXTENSIONS,
    TEXT,
    Progress,
    format_of,
    read_text_stream,
)
from .interpret import interpret
from .mapping import (
    ColumnMapping,
    apply_mapping,
    check_mapped_columns,
    mapped_columns,
    read_mapping,
)
from .tables import Decimation, Downsampling, RawTable, downsample, split_specimens, unwound

Source = str | Path | Iterable[str | Path]
Tables = tuple[RawTable, ...]

STANDARD_INPUT = Path("-")


def read_csv(
    path: str | Path, mapping: str | Path | ColumnMapping = ColumnMapping(), **fields: Any
) -> Recording:
    """Read one text file, of any extension, as one Recording in SI units; `mapping` and `fields` as
    in `read`.

    Each column heading states the unit (`pressure [kPa]`, `p / bara`, `length_mm`), or a row of
    units follows the headings. Delimiter (comma, semicolon, tab), decimal comma, encoding and
    comment lines (#, %) are detected. Absolute pressures become gauge pressures with the ambient
    pressure, by default 101.325 kPa. A comment such as `# resting_length [mm] = 300` states a
    constant.

    Raises FileError, ColumnError, UnitError or ParameterError; the message names file, line, value
    and remedy.
    """
    mapping = as_mapping(mapping, fields)
    if not isinstance(path, str | Path):
        raise FileError(f"read_csv: {abridged(path)} is not a path. Pass the name of a file.")
    path = Path(path)
    mapping = mapping.of_file(path)
    table: RawTable = TEXT.call("raw_csv.read_csv_table", path, mapping.text_format)
    check_mapped_columns(mapping, mapped_columns(table, mapping), table)
    return interpret(apply_mapping(table, mapping), mapping, mapping.constants_of(path))


def as_mapping(mapping: str | Path | ColumnMapping, fields: Mapping[str, Any]) -> ColumnMapping:
    """The mapping, of a file if a path is given, with these fields. Raises ParameterError."""
    if not isinstance(mapping, str | Path | ColumnMapping):
        raise ParameterError(
            f"mapping is {abridged(mapping)}; it must be a ColumnMapping or the path of a mapping"
            ' file (TOML), such as mapping=ColumnMapping(resting_length="300 mm").'
        )
    stated = mapping if isinstance(mapping, ColumnMapping) else read_mapping(mapping)
    return stated.with_fields(fields)


def read_file(
    path: Path,
    mapping: ColumnMapping,
    downsampling: Downsampling = Decimation(),
    progress: Progress | None = None,
) -> list[Recording]:
    """The recordings in one file, as `read`; what concerns all files of a test rig is done by
    `complete_bench`.
    """
    return list(read_one(path, mapping, downsampling, progress).recordings)


@dataclasses.dataclass(frozen=True, eq=False)
class FileRecordings:
    """The recordings in one file, the mapped columns that it has, and its first table."""

    recordings: tuple[Recording, ...]
    present: frozenset[str]
    table: RawTable


def read_one(
    path: Path,
    mapping: ColumnMapping,
    downsampling: Downsampling = Decimation(),
    progress: Progress | None = None,
) -> FileRecordings:
    """The recordings in one file, with the sections of the mapping for its name; mapped columns
    that it lacks are left out.
    """
    mapping = mapping.of_file(path)
    recordings = list[Recording]()
    present = set[str]()
    tables = read_tables(path, mapping, downsampling, progress)
    is_numbered = any(str(column).isdecimal() for column in mapping.columns)
    for table in itertools.chain.from_iterable(
        (table,) if is_numbered else unwound(table, mapping.grid) for table in tables
    ):
        # figures cannot contain every name of a file
        named = dataclasses.replace(table, origin=printable(table.origin))
        present |= mapped_columns(named, mapping)
        try:
            for part in split_specimens(apply_mapping(named, mapping)):
                recordings.append(interpret(part, mapping, mapping.constants_of(path)))
        except AirmuscleError:
            # a misspelt column of the mapping is the first cause
            check_mapped_columns(mapping, mapped_columns(named, mapping), named)
            raise
    return FileRecordings(tuple(recordings), frozenset(present), tables[0])


def find_files(source: Source) -> list[Path]:
    """The files of a path, a glob pattern, a folder or several of these, each sorted by name.
    Raises FileError.
    """
    if not isinstance(source, str | Path):
        if not isinstance(source, Iterable):
            raise FileError(
                f"read: {abridged(source)} is not a path. Pass a file, a folder, a glob pattern, or"
                " a list of them."
            )
        return [path for part in source for path in find_files(part)]
    path = Path(source)
    files = [Path(source)]
    missing = ""
    if path.is_dir():
        files = sorted(
            p
            for p in path.iterdir()
            if p.suffix.lower() in EXTENSIONS and not p.name.startswith(".")
        )
        missing = (
            "the folder contains no supported file; supported extensions are"
            f" {', '.join(EXTENSIONS)}."
        )
    elif glob.has_magic(str(path)) and not path.exists():
        files = sorted(map(Path, glob.glob(str(path), recursive=True)))
        missing = "no file matches the pattern. Check the pattern and the folder."
    if not files:
        raise FileError(f"{path}: {missing}")
    return files


def read_tables(
    path: Path, mapping: ColumnMapping, downsampling: Downsampling, progress: Progress | None = None
) -> Tables:
    """The uninterpreted tables of one file. Raises FileError or ColumnError."""
    if path == STANDARD_INPUT:
        return (
            read_text_stream(sys.stdin.buffer, "standard input", mapping.text_format, downsampling),
        )
    selection = mapping.selection(downsampling)
    tables = format_of(path).read_tables(path, selection, progress)
    return tuple(downsample(table, downsampling) for table in tables)
