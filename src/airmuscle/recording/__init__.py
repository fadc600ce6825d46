"""Recordings: measured and simulated runs in one type, and their readers and writers."""

from .columns import QUANTITIES, Quantity
from .csv_reader import read_csv
from .csv_writer import write_csv
from .data_frames import from_pandas, to_xarray
from .downsampling import BlockMeans, Decimation
from .follow import RowReader, follow_lines
from .mapping import ColumnMapping
from .missing_values import DropMissing, InterpolateMissing, MissingValues, RefuseMissing
from .reader import read
from .recording import Recording
from .time_base import NoTime, RecordedTime, TimeBase, UniformTime
from .writer import write

__all__ = [
    "QUANTITIES",
    "BlockMeans",
    "ColumnMapping",
    "Decimation",
    "DropMissing",
    "InterpolateMissing",
    "MissingValues",
    "NoTime",
    "Quantity",
    "RecordedTime",
    "Recording",
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
