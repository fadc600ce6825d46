"""What brings air into a muscle and lets it out: supplies, valves, tubes, circuits."""

from .check_valve import CheckValve as CheckValve
from .circuit import Circuit as Circuit
from .circuit import Response as Response
from .combination import in_parallel as in_parallel
from .combination import in_series as in_series
from .conduit import Conduit as Conduit
from .distributed_tube import DistributedTube as DistributedTube
from .fill_discharge import ClosedChamber as ClosedChamber
from .fill_discharge import FillDischarge as FillDischarge
from .fill_discharge import ThreePosition as ThreePosition
from .indexed_valve import IndexedValve as IndexedValve
from .line import Line as Line
from .manifold import Leaking as Leaking
from .manifold import Manifold as Manifold
from .orifice import Orifice as Orifice
from .proportional import Follower as Follower
from .proportional import ProportionalRegulator as ProportionalRegulator
from .proportional import ProportionalValve as ProportionalValve
from .supply import RegulatedSupply as RegulatedSupply
from .supply import Shared as Shared
from .supply import Source as Source
from .supply import Supply as Supply
from .supply import Tank as Tank
from .tube import Tube as Tube
from .tube import TubeOrifice as TubeOrifice
from .valve import Valve as Valve
