"""Sampled loops: input signals in time, drivers between command and valve, interface of controllers, sensors."""

from .control_law import ControlLaw, SigmaDelta, SisoController, SplitRange
from .control_loop import ControlLoop, ControlLoopState, LawDesign, designed_loop, with_designed_laws
from .controller import Controller, Measurement, relative_unit
from .driver import PWM, Driver, PwmState, SolenoidDriver, WithDrivers
from .inputs import ZERO_INPUT, InputSignal, Periodic, Schedule
from .piecewise_linear import PiecewiseLinear, merge_columns
from .sampled_signal import SampledSignal, Trajectory, spline_trajectory
from .sensors import ColumnSensor, WithSensors

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
