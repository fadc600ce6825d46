"""One run, measured or simulated: the same type, so that the two always compare."""

from .columns import QUANTITIES as QUANTITIES
from .columns import Quantity as Quantity
from .mapping import ColumnMapping as ColumnMapping
from .read import read as read
from .read_csv import read_csv as read_csv
from .recording import Recording as Recording
from .thinning import BlockMeans as BlockMeans
from .thinning import Decimation as Decimation
from .write_csv import write_csv as write_csv
