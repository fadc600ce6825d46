"""What brings air into a muscle and lets it out: supplies, valves, tubes, circuits."""

from .circuit import Circuit as Circuit
from .circuit import Response as Response
from .fill_discharge import ClosedChamber as ClosedChamber
from .fill_discharge import FillDischarge as FillDischarge
from .fill_discharge import ThreePosition as ThreePosition
from .line import Line as Line
from .line import Tube as Tube
from .manifold import Leaking as Leaking
from .manifold import Manifold as Manifold
from .proportional import Follower as Follower
from .proportional import ProportionalRegulator as ProportionalRegulator
from .proportional import ProportionalValve as ProportionalValve
from .supply import RegulatedSupply as RegulatedSupply
from .supply import Shared as Shared
from .supply import Source as Source
from .supply import Supply as Supply
from .supply import Tank as Tank
from .valve import Valve as Valve
