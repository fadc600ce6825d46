"""One run, measured or simulated: the same type, so that the two always compare."""

from .columns import QUANTITIES, Quantity
from .mapping import ColumnMapping
from .read import read
from .read_csv import read_csv
from .recording import Recording
from .thinning import BlockMeans, Decimation
from .write_csv import write_csv

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
