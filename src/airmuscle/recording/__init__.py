"""One run, measured or simulated: the same type, so that the two always compare."""

from .columns import QUANTITIES as QUANTITIES
from .columns import Quantity as Quantity
from .read_csv import read_csv as read_csv
from .recording import Recording as Recording
from .write_csv import write_csv as write_csv
