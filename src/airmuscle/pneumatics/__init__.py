"""What brings air into a muscle and lets it out: supplies, valves, tubes, circuits."""

from .check_valve import CheckValve
from .circuit import Circuit, CircuitFlows
from .combination import in_parallel, in_series
from .distributed_tube import DistributedTube
from .fill_discharge import ClosedChamber, FillDischarge, ThreePosition
from .gas import Air, Ambient, EnergyBalance, Flow, Gas, Isothermal, Polytropic, absolute, gauge
from .indexed_valve import IndexedValve
from .manifold import Manifold, WithLeak
from .orifice import Orifice
from .proportional import ProportionalRegulator, ProportionalValve, SecondOrderLag
from .supply import AirSource, RegulatedSupply, SharedSupply, Supply, Tank
from .tube import Tube, TubeOrifice
from .tube_model import TubeModel
from .valve import Valve
from .with_tubes import WithTubes

__all__ = [
    "Air",
    "AirSource",
    "Ambient",
    "CheckValve",
    "Circuit",
    "CircuitFlows",
    "ClosedChamber",
    "DistributedTube",
    "EnergyBalance",
    "FillDischarge",
    "Flow",
    "Gas",
    "IndexedValve",
    "Isothermal",
    "Manifold",
    "Orifice",
    "Polytropic",
    "ProportionalRegulator",
    "ProportionalValve",
    "RegulatedSupply",
    "SecondOrderLag",
    "SharedSupply",
    "Supply",
    "Tank",
    "ThreePosition",
    "Tube",
    "TubeModel",
    "TubeOrifice",
    "Valve",
    "WithLeak",
    "WithTubes",
    "absolute",
    "gauge",
    "in_parallel",
    "in_series",
]
