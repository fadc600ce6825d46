"""Readers and writers of measurement files, and the treatment of missing values."""

from .csv_reader import read_csv
from .csv_writer import write_csv
from .data_frames import from_pandas, to_xarray
from .downsampling import BlockMeans, Decimation
from .follow import RowReader, follow_lines
from .mapping import ColumnMapping
from .missing_values import DropMissing, InterpolateMissing, MissingValues, RefuseMissing
from .reader import read
from .time_base import NoTime, RecordedTime, TimeBase, UniformTime
from .writer import write

__all__ = [
    "BlockMeans",
    "ColumnMapping",
    "Decimation",
    "DropMissing",
    "InterpolateMissing",
    "MissingValues",
    "NoTime",
    "RecordedTime",
    "RefuseMissing",
    "RowReader",
    "TimeBase",
    "UniformTime",
    "follow_lines",
    "from_pandas",
    "read",
    "read_csv",
    "to_xarray",
    "write",
    "write_csv",
]
