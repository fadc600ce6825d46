"""Friction and creep from loops, with a verdict whether the data justify them."""

from .creep import Creep as Creep
from .creep import fit_creep as fit_creep
from .fit import Given as Given
from .fit import OnContraction as OnContraction
from .fit import OnPressure as OnPressure
from .fit import PolynomialCurve as PolynomialCurve
from .fit import candidates as candidates
from .fit import fit_hysteresis as fit_hysteresis
from .holds import Hold as Hold
from .holds import holds as holds
from .loops import Loop as Loop
from .loops import LoopFit as LoopFit
from .loops import find_loops as find_loops
from .loops import fit_loop as fit_loop
from .result import HysteresisFit as HysteresisFit
