"""Pneumatic circuits: air supplies, valves and tubes between supply and muscle."""

from . import conversion
from .circuit import Circuit, CircuitFlows
from .combination import in_parallel, in_series
from .distributed_tube import DistributedTube
from .fill_discharge import ClosedChamber, FillDischarge, ThreePositionValve, ambient_air
from .gas import (
    GAS_CONSTANT,
    HEAT_CAPACITY_RATIO,
    NO_FLOW,
    REFERENCE_DENSITY,
    REFERENCE_TEMPERATURE,
    SPECIFIC_HEAT_CONSTANT_PRESSURE,
    SPECIFIC_HEAT_CONSTANT_VOLUME,
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
from .pressure_regulator import PressureRegulator
from .proportional import ProportionalRegulator, ProportionalValve, SecondOrderLag
from .supply import AirSource, RegulatedSupply, SharedSupply, Supply, Tank
from .tube import Tube, TubeModel, TubeOrifice, WithTubes
from .valve import CheckValve, Orifice, SubsonicIndexValve, Valve, orifice_flow
from .virial_gas import DEFAULT_GAS, VirialGas, WallHeatTransfer, virial_coefficient_of_air

__all__ = [
    "DEFAULT_GAS",
    "GAS_CONSTANT",
    "HEAT_CAPACITY_RATIO",
    "NO_FLOW",
    "REFERENCE_DENSITY",
    "REFERENCE_TEMPERATURE",
    "SPECIFIC_HEAT_CONSTANT_PRESSURE",
    "SPECIFIC_HEAT_CONSTANT_VOLUME",
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
