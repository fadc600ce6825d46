"""Control: input signals in time, drivers between command and valve, sampled controllers and their loop."""

from .control_law import ControlLaw
from .control_loop import ControlLoop, ControlLoopState
from .controller import Controller, Measurement
from .driver import PWM, Driver, SolenoidDriver
from .inputs import ZERO_INPUT, InputSignal, Periodic, SampledSignal, Schedule
from .on_off import OnOffController
from .pid import PID
from .piecewise_linear import PiecewiseLinear
from .siso import SisoController
from .split_range import SplitRange
from .trajectory import Trajectory, spline_trajectory
from .with_drivers import WithDrivers

__all__ = [
    "PID",
    "PWM",
    "ZERO_INPUT",
    "ControlLaw",
    "ControlLoop",
    "ControlLoopState",
    "Controller",
    "Driver",
    "InputSignal",
    "Measurement",
    "OnOffController",
    "Periodic",
    "PiecewiseLinear",
    "SampledSignal",
    "Schedule",
    "SisoController",
    "SolenoidDriver",
    "SplitRange",
    "Trajectory",
    "WithDrivers",
    "spline_trajectory",
]
