"""Sampled loops: input signals in time, drivers between command and valve, interface of controllers, sensors."""

from .control_law import ControlLaw
from .control_loop import ControlLoop, ControlLoopState
from .controller import Controller, Measurement
from .driver import PWM, Driver, SolenoidDriver
from .inputs import ZERO_INPUT, InputSignal, Periodic, SampledSignal, Schedule
from .law_design import LawDesign
from .piecewise_linear import PiecewiseLinear
from .sensors import ColumnSensor, WithSensors
from .sigma_delta import SigmaDelta
from .siso import SisoController
from .split_range import SplitRange
from .trajectory import Trajectory, spline_trajectory
from .with_drivers import WithDrivers

__all__ = [
    "PWM",
    "ZERO_INPUT",
    "ColumnSensor",
    "ControlLaw",
    "ControlLoop",
    "ControlLoopState",
    "Controller",
    "Driver",
    "InputSignal",
    "LawDesign",
    "Measurement",
    "Periodic",
    "PiecewiseLinear",
    "SampledSignal",
    "Schedule",
    "SigmaDelta",
    "SisoController",
    "SolenoidDriver",
    "SplitRange",
    "Trajectory",
    "WithDrivers",
    "WithSensors",
    "spline_trajectory",
]
