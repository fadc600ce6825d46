"""The one place where text becomes a class: what a library file or the command line may name as `model`.

To add a model, add a line: its class name and the module that holds it. Modules are imported when asked for.
"""

from __future__ import annotations

import importlib
from typing import Any

from ..core.errors import UnknownName, suggestion

_MODULES: dict[str, str] = {
    # the part of the surface with data
    "Box": "characteristic.box",
    # geometry
    "Braid": "geometry.braid",
    "Catenary": "geometry.catenary",
    "ChebyshevGeometry": "geometry.chebyshev",
    "CircularArc": "geometry.circular_arc",
    "EvenSpread": "geometry.fibre_sum",
    "GivenSum": "geometry.fibre_sum",
    "Parabola": "geometry.parabola",
    "PleatedTube": "geometry.pleated",
    "StraightFibre": "geometry.straight_fibre",
    "SumOverHalf": "geometry.fibre_sum",
    "SumPastHalf": "geometry.fibre_sum",
    "TabulatedGeometry": "geometry.tabulated",
    "TrueArcParabola": "geometry.parabola",
    "Vessel": "geometry.vessel",
    # elements of a muscle
    "CreepElements": "muscle.creep",
    "CubicSpring": "muscle.spring",
    "DirectionalDamper": "muscle.damper",
    "EndStop": "muscle.stop",
    "HuntCrossley": "mechanism.contact",
    "LaggingWall": "muscle.wall",
    "LinearDamper": "muscle.damper",
    "LinearSpring": "muscle.spring",
    "NoStop": "muscle.stop",
    "PressureDamper": "muscle.damper",
    "Reynolds2003Damper": "muscle.reynolds2003",
    "Reynolds2003Spring": "muscle.reynolds2003",
    "RigidSeries": "muscle.series",
    "RigidWall": "muscle.wall",
    "SeriesSpring": "muscle.series",
    "Serres2009Damper": "muscle.serres2009",
    "Serres2009Spring": "muscle.serres2009",
    "SwellingWall": "muscle.wall",
    # friction
    "BoucWen": "friction.bouc_wen",
    "Dahl": "friction.dahl",
    "LuGre": "friction.lugre",
    "MaxwellSlip": "friction.maxwell_slip",
    "NoFriction": "friction.base",
    "PrandtlIshlinskii": "friction.prandtl_ishlinskii",
    # muscles and plants
    "Muscle": "muscle.muscle",
    "Plant": "plant.plant",
    "Ambient": "pneumatics.gas",
    "EnergyBalance": "pneumatics.gas",
    "Isothermal": "pneumatics.gas",
    "Polytropic": "pneumatics.gas",
    # circuits
    "CheckValve": "pneumatics",
    "ClosedChamber": "pneumatics",
    "DistributedTube": "pneumatics",
    "FillDischarge": "pneumatics",
    "Follower": "pneumatics",
    "IndexedValve": "pneumatics",
    "Leaking": "pneumatics",
    "Line": "pneumatics",
    "Manifold": "pneumatics",
    "ProportionalRegulator": "pneumatics",
    "ProportionalValve": "pneumatics",
    "RegulatedSupply": "pneumatics",
    "Shared": "pneumatics",
    "Supply": "pneumatics",
    "Tank": "pneumatics",
    "ThreePosition": "pneumatics",
    "Tube": "pneumatics",
    "TubeOrifice": "pneumatics",
    "Valve": "pneumatics",
    # mechanisms
    "AntagonisticJoint": "mechanism",
    "HangingMass": "mechanism",
    "Held": "mechanism",
    "InSeries": "mechanism",
    "Isometric": "mechanism",
    "Isotonic": "mechanism",
    "Lever": "mechanism",
    "Mounted": "mechanism",
    "Prescribed": "mechanism",
    "Pulley": "mechanism",
    "SpringLoad": "mechanism",
    "Stopped": "mechanism",
    "StoppedJoint": "mechanism",
    # commands, controllers and methods
    "PID": "control.pid",
    "Split": "control.split",
    "TwoPoint": "control.two_point",
    "Schedule": "control.inputs",
    "Signal": "control.inputs",
    "OnOff": "control.driver",
    "PWM": "control.driver",
    "DormandPrince8": "simulation.integrators",
    "Rodas4": "simulation.integrators",
    "RungeKutta4": "simulation.integrators",
    # static characteristics
    "AlongArc": "characteristic.rubber",
    "AlongAxis": "characteristic.rubber",
    "BorzikovaDirect": "characteristic.borzikova",
    "BorzikovaExponential": "characteristic.borzikova",
    "ChouHannaford1996": "characteristic.chou_hannaford1996",
    "CircleVirtualWork": "characteristic.circle_virtual_work",
    "Clamped": "characteristic.clamped",
    "ContractileSurface": "characteristic.contractile_surface",
    "ExactMeridian": "characteristic.exact_meridian",
    "EffectiveLength": "characteristic.effective_length",
    "Hunt2017": "characteristic.hunt2017",
    "InverseLength": "characteristic.length_family",
    "LogarithmicLength": "characteristic.length_family",
    "MartensBoblan2017": "characteristic.martens_boblan2017",
    "Reynolds2003": "characteristic.reynolds2003",
    "RubberLine": "characteristic.rubber",
    "Saga2007": "characteristic.saga2007",
    "PolynomialStandIn": "characteristic.as_force_law",
    "Sarosi2012": "characteristic.sarosi2012",
    "Serres2009": "characteristic.serres2009",
    "Tabulated": "characteristic.tabulated",
    "TonduLopez2000": "characteristic.tondu_lopez2000",
    "VirtualWork": "characteristic.virtual_work",
}


def model_names() -> tuple[str, ...]:
    """Every class that a file may name, sorted."""
    return tuple(sorted(_MODULES))


def model_class(name: str, where: str) -> type[Any]:
    """The class of this name; `where` opens the message of the UnknownName raised otherwise."""
    if not isinstance(name, str):
        raise UnknownName(f'{where} is {name!r}; it must be a name in quotes, like "Braid".')
    if name not in _MODULES:
        raise UnknownName(
            f"{where}: no model '{name}'; there are {', '.join(model_names())}.{suggestion(name, _MODULES)}"
        )
    module = importlib.import_module(f"airmuscle.{_MODULES[name]}")
    found: type[Any] = getattr(module, name)
    return found
