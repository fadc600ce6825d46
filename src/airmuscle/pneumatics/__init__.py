"""What brings air into a muscle and lets it out: supplies, valves, tubes, circuits."""

from .check_valve import CheckValve
from .circuit import Circuit, Response
from .combination import in_parallel, in_series
from .conduit import Conduit
from .distributed_tube import DistributedTube
from .fill_discharge import ClosedChamber, FillDischarge, ThreePosition
from .indexed_valve import IndexedValve
from .line import Line
from .manifold import Leaking, Manifold
from .orifice import Orifice
from .proportional import Follower, ProportionalRegulator, ProportionalValve
from .supply import RegulatedSupply, Shared, Source, Supply, Tank
from .tube import Tube, TubeOrifice
from .valve import Valve

__all__ = [
    "CheckValve",
    "Circuit",
    "ClosedChamber",
    "Conduit",
    "DistributedTube",
    "FillDischarge",
    "Follower",
    "IndexedValve",
    "Leaking",
    "Line",
    "Manifold",
    "Orifice",
    "ProportionalRegulator",
    "ProportionalValve",
    "RegulatedSupply",
    "Response",
    "Shared",
    "Source",
    "Supply",
    "Tank",
    "ThreePosition",
    "Tube",
    "TubeOrifice",
    "Valve",
    "in_parallel",
    "in_series",
]
