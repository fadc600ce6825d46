"""Identification of friction and creep from hysteresis loops, with tests whether the data justify them."""

from .creep import Creep, fit_creep
from .fit import (
    ContractionPath,
    FixedCharacteristic,
    PolynomialCurve,
    PressurePath,
    fit_hysteresis,
    initial_friction_laws,
)
from .holds import Hold, find_holds
from .loops import HysteresisLoop, LoopFit, find_loops, fit_loop
from .result import HysteresisFit

__all__ = [
    "ContractionPath",
    "Creep",
    "FixedCharacteristic",
    "Hold",
    "HysteresisFit",
    "HysteresisLoop",
    "LoopFit",
    "PolynomialCurve",
    "PressurePath",
    "find_holds",
    "find_loops",
    "fit_creep",
    "fit_hysteresis",
    "fit_loop",
    "initial_friction_laws",
]
