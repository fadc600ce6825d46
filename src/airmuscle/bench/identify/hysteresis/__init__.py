"""Identification of friction and creep from hysteresis loops, with tests whether the data justify them."""

from .agreement import RunAgreement
from .creep import Creep, fit_creep
from .creep_conversion import creep_elements
from .fit import (
    ContractionPath,
    FixedCharacteristic,
    PolynomialCurve,
    PressurePath,
    fit_hysteresis,
    initial_friction_laws,
)
from .holds import Hold, find_holds
from .joint import fit_jointly, identified_friction, loops_not_joined
from .joint_result import JointFit
from .loops import HysteresisLoop, LoopFit, find_loops, fit_loop
from .preference import preferred_fit
from .result import HysteresisFit

__all__ = [
    "ContractionPath",
    "Creep",
    "FixedCharacteristic",
    "Hold",
    "HysteresisFit",
    "HysteresisLoop",
    "JointFit",
    "LoopFit",
    "PolynomialCurve",
    "PressurePath",
    "RunAgreement",
    "creep_elements",
    "find_holds",
    "find_loops",
    "fit_creep",
    "fit_hysteresis",
    "fit_jointly",
    "fit_loop",
    "identified_friction",
    "initial_friction_laws",
    "loops_not_joined",
    "preferred_fit",
]
