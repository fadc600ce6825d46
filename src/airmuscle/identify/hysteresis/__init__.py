"""Friction and creep from loops, with a verdict whether the data justify them."""

from .creep import Creep, fit_creep
from .fit import Given, OnContraction, OnPressure, PolynomialCurve, candidates, fit_hysteresis
from .holds import Hold, find_holds
from .loops import HysteresisLoop, LoopFit, find_loops, fit_loop
from .result import HysteresisFit

__all__ = [
    "Creep",
    "Given",
    "Hold",
    "HysteresisFit",
    "HysteresisLoop",
    "LoopFit",
    "OnContraction",
    "OnPressure",
    "PolynomialCurve",
    "candidates",
    "find_holds",
    "find_loops",
    "fit_creep",
    "fit_hysteresis",
    "fit_loop",
]
