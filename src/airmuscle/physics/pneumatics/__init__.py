"""Pneumatic circuits: air supplies, valves and tubes between supply and muscle."""

from . import conversion
from .check_valve import CheckValve
from .circuit import Circuit, CircuitFlows
from .combination import in_parallel, in_series
from .distributed_tube import DistributedTube
from .fill_discharge import ClosedChamber, FillDischarge, ThreePositionValve, ambient_air
from .flow import orifice_flow
from .gas import (
    GAS_CONSTANT,
    NO_FLOW,
    REFERENCE_DENSITY,
    REFERENCE_TEMPERATURE,
    Air,
    Ambient,
    EnergyBalance,
    FirstLawGas,
    Flow,
    Gas,
    Isothermal,
    Polytropic,
    absolute_pressure,
    gauge_pressure,
)
from .manifold import Manifold, WithLeak
from .orifice import Orifice
from .pressure_regulator import PressureRegulator
from .proportional import ProportionalRegulator, ProportionalValve, SecondOrderLag
from .subsonic_index_valve import SubsonicIndexValve
from .supply import AirSource, RegulatedSupply, SharedSupply, Supply, Tank
from .tube import Tube, TubeOrifice
from .tube_model import TubeModel
from .valve import Valve
from .virial_gas import VirialGas, virial_coefficient_of_air
from .wall_heat_transfer import DEFAULT_GAS, WallHeatTransfer
from .with_tubes import WithTubes

__all__ = [
    "DEFAULT_GAS",
    "GAS_CONSTANT",
    "NO_FLOW",
    "REFERENCE_DENSITY",
    "REFERENCE_TEMPERATURE",
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
    "FirstLawGas",
    "Flow",
    "Gas",
    "Isothermal",
    "Manifold",
    "Orifice",
    "Polytropic",
    "PressureRegulator",
    "ProportionalRegulator",
    "ProportionalValve",
    "RegulatedSupply",
    "SecondOrderLag",
    "SharedSupply",
    "SubsonicIndexValve",
    "Supply",
    "Tank",
    "ThreePositionValve",
    "Tube",
    "TubeModel",
    "TubeOrifice",
    "Valve",
    "VirialGas",
    "WallHeatTransfer",
    "WithLeak",
    "WithTubes",
    "absolute_pressure",
    "ambient_air",
    "conversion",
    "gauge_pressure",
    "in_parallel",
    "in_series",
    "orifice_flow",
    "virial_coefficient_of_air",
]
