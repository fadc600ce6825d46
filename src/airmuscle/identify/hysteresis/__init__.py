"""Friction and creep from loops, with a verdict whether the data justify them."""

from .creep import Creep, fit_creep
from .fit import Given, OnContraction, OnPressure, PolynomialCurve, candidates, fit_hysteresis
from .holds import Hold, holds
from .loops import Loop, LoopFit, find_loops, fit_loop
from .result import HysteresisFit

__all__ = [
    "Creep",
    "Given",
    "Hold",
    "HysteresisFit",
    "Loop",
    "LoopFit",
    "OnContraction",
    "OnPressure",
    "PolynomialCurve",
    "candidates",
    "find_loops",
    "fit_creep",
    "fit_hysteresis",
    "fit_loop",
    "holds",
]
