"""Sampled loops: input signals in time, drivers between command and valve, interface of controllers, sensors."""

from .control_law import ControlLaw
from .control_loop import ControlLoop, ControlLoopState
from .controller import Controller, Measurement, relative_unit
from .driver import PWM, Driver, PwmState, SolenoidDriver
from .inputs import ZERO_INPUT, InputSignal, Periodic, SampledSignal, Schedule
from .law_design import LawDesign, designed_loop, with_designed_laws
from .piecewise_linear import PiecewiseLinear, merge_columns
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
    "PwmState",
    "SampledSignal",
    "Schedule",
    "SigmaDelta",
    "SisoController",
    "SolenoidDriver",
    "SplitRange",
    "Trajectory",
    "WithDrivers",
    "WithSensors",
    "designed_loop",
    "merge_columns",
    "relative_unit",
    "spline_trajectory",
    "with_designed_laws",
]
