"""Control: input signals in time, drivers between command and valve, sampled controllers and their loop."""

from .angle_and_stiffness import AngleAndStiffness
from .antagonistic_inverse import AntagonisticInverse
from .cascade import Cascade
from .co_contraction import CoContraction
from .computed_torque import ComputedTorque
from .control_law import ControlLaw
from .control_loop import ControlLoop, ControlLoopState
from .controller import Controller, Measurement
from .dead_zone import DeadZoneController
from .decentralised import Decentralised
from .driver import PWM, Driver, SolenoidDriver
from .feed_forward import StaticFeedForward
from .friction_feed_forward import FrictionFeedForward
from .gain_schedule import GainSchedule
from .hysteresis_compensation import HysteresisCompensation
from .hysteresis_operator import HysteresisOperator, InverseHysteresisOperator
from .inputs import ZERO_INPUT, InputSignal, Periodic, SampledSignal, Schedule
from .iterative_learning import IterativeLearning
from .law_design import LawDesign
from .linear_model_predictive import LinearModelPredictive
from .motion_feed_forward import MotionFeedForward
from .on_off import OnOffController
from .open_loop_law import OpenLoopLaw
from .pid import PID
from .piecewise_linear import PiecewiseLinear
from .proportional_feedback import ProportionalFeedback
from .sensors import ColumnSensor, WithSensors
from .setpoint_command import SetpointCommand
from .setpoint_delay import WithSetpointDelay
from .setpoint_lead import SetpointLead
from .sigma_delta import SigmaDelta
from .siso import SisoController
from .sliding_mode import SlidingMode
from .split_range import SplitRange
from .state_feedback import StateFeedback
from .static_inverse import StaticInverse
from .stuck_valve import WithStuckValve
from .super_twisting import SuperTwisting
from .trajectory import Trajectory, spline_trajectory
from .with_drivers import WithDrivers
from .with_feed_forward import WithFeedForward

__all__ = [
    "PID",
    "PWM",
    "ZERO_INPUT",
    "AngleAndStiffness",
    "AntagonisticInverse",
    "Cascade",
    "CoContraction",
    "ColumnSensor",
    "ComputedTorque",
    "ControlLaw",
    "ControlLoop",
    "ControlLoopState",
    "Controller",
    "DeadZoneController",
    "Decentralised",
    "Driver",
    "FrictionFeedForward",
    "GainSchedule",
    "HysteresisCompensation",
    "HysteresisOperator",
    "InputSignal",
    "InverseHysteresisOperator",
    "IterativeLearning",
    "LawDesign",
    "LinearModelPredictive",
    "Measurement",
    "MotionFeedForward",
    "OnOffController",
    "OpenLoopLaw",
    "Periodic",
    "PiecewiseLinear",
    "ProportionalFeedback",
    "SampledSignal",
    "Schedule",
    "SetpointCommand",
    "SetpointLead",
    "SigmaDelta",
    "SisoController",
    "SlidingMode",
    "SolenoidDriver",
    "SplitRange",
    "StateFeedback",
    "StaticFeedForward",
    "StaticInverse",
    "SuperTwisting",
    "Trajectory",
    "WithDrivers",
    "WithFeedForward",
    "WithSensors",
    "WithSetpointDelay",
    "WithStuckValve",
    "spline_trajectory",
]
