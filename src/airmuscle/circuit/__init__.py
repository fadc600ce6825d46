"""What brings air into a muscle and lets it out: supplies, valves, circuits."""

from .circuit import Circuit as Circuit
from .circuit import ClosedChamber as ClosedChamber
from .circuit import FillDischarge as FillDischarge
from .circuit import Supply as Supply
from .valve import Valve as Valve
