"""One run, measured or simulated: the same type, so that the two always compare."""

from .columns import QUANTITIES, Quantity
from .csv_reader import read_csv
from .csv_writer import write_csv
from .mapping import ColumnMapping
from .reader import read
from .recording import Recording
from .downsampling import BlockMeans, Decimation

__all__ = [
    "QUANTITIES",
    "BlockMeans",
    "ColumnMapping",
    "Decimation",
    "Quantity",
    "Recording",
    "read",
    "read_csv",
    "write_csv",
]
