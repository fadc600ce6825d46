"""What brings air into a muscle and lets it out: supplies, valves, circuits."""

from .check_valve import CheckValve as CheckValve
from .circuit import Circuit as Circuit
from .circuit import ClosedChamber as ClosedChamber
from .circuit import FillDischarge as FillDischarge
from .circuit import Supply as Supply
from .combination import in_parallel as in_parallel
from .combination import in_series as in_series
from .indexed_valve import IndexedValve as IndexedValve
from .orifice import Orifice as Orifice
from .valve import Valve as Valve
