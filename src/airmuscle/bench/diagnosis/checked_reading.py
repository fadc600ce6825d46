"""Recordings of a test rig as its files state them, checked together: units that contradict each
other, suspicious values, outliers.
"""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from ...recording import Recording
from ..inspection import without_outliers
from ..readers import (
    ColumnMapping,
    Decimation,
    Downsampling,
    NoTime,
    Progress,
    Source,
    as_mapping,
    check_mapped_columns,
    check_unit_consistency,
    find_files,
    read_one,
    warn_of_rates_without_time,
)
from .value_rules import warn_of_suspicious_values


def read(
    source: Source,
    mapping: str | Path | ColumnMapping = ColumnMapping(),
    *,
    downsampling: Downsampling = Decimation(),
    progress: Progress | None = None,
    **fields: Any,
) -> tuple[Recording, ...]:
    """Read the recordings in a file, several files, a glob pattern (`runs/*.csv`) or a folder, in
    SI units; `-` is a table of text on the standard input, which may be a pipe.

    mapping       what the files do not state: a ColumnMapping, `ColumnMapping(resting_length="300
                  mm")`, or a TOML file
    downsampling  reduction of very long files, which a note reports
    progress      called with the name of a file and the fraction that has been read
    fields        fields of the mapping, `resting_length="300 mm"`, in place of those of `mapping`

    The extension gives the format: text (CSV), LVM, Excel, OpenDocument, MAT, TDMS, MDF, Parquet or
    HDF5. A load in kg becomes a force with standard gravity. Files whose units contradict each
    other are rejected.

    Raises FileError, ColumnError, UnitError or ParameterError; the message names file, row, value
    and remedy.
    """
    stated = as_mapping(mapping, fields)
    parts = [read_one(path, stated, downsampling, progress) for path in find_files(source)]
    recordings = [recording for part in parts for recording in part.recordings]
    if len(parts) > 1 or not stated.sections:  # a dictionary of a rig names more than one file has
        present = {name for part in parts for name in part.present}
        check_mapped_columns(stated, present, parts[0].table)
    return tuple(complete_bench(recordings, stated))


def complete_bench(recordings: Sequence[Recording], mapping: ColumnMapping) -> list[Recording]:
    """The recordings of one bench, without outliers if the mapping says so, checked as by
    `check_bench`.
    """
    complete = list(without_outliers(recordings) if mapping.drop_outliers else recordings)
    check_bench(complete)
    if not isinstance(mapping.time, NoTime):
        warn_of_rates_without_time(complete)
    return complete


def check_bench(recordings: list[Recording]) -> None:
    """Check the recordings of one bench together: units (UnitError), and suspicious values
    (AirmuscleWarning).
    """
    check_unit_consistency(recordings)
    warn_of_suspicious_values(recordings)
