"""Recordings: measured and simulated runs in one type, and their readers and writers."""

from .columns import QUANTITIES, Quantity
from .csv_reader import read_csv
from .csv_writer import write_csv
from .downsampling import BlockMeans, Decimation
from .mapping import ColumnMapping
from .reader import read
from .recording import Recording
from .time_base import NoTime, RecordedTime, TimeBase, UniformTime

__all__ = [
    "QUANTITIES",
    "BlockMeans",
    "ColumnMapping",
    "Decimation",
    "NoTime",
    "Quantity",
    "RecordedTime",
    "Recording",
    "TimeBase",
    "UniformTime",
    "read",
    "read_csv",
    "write_csv",
]
