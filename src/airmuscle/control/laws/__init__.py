"""Control laws and controllers, and what compensates friction, hysteresis, dead zones and delays."""

from .angle_and_stiffness import AngleAndStiffness
from .antagonistic_inverse import AntagonisticInverse
from .cascade import Cascade
from .co_contraction import CoContraction
from .computed_torque import ComputedTorque
from .dead_zone import DeadZoneController
from .decentralised import Decentralised
from .feed_forward import StaticFeedForward
from .friction_feed_forward import FrictionFeedForward
from .gain_schedule import GainSchedule
from .hysteresis_compensation import HysteresisCompensation
from .hysteresis_operator import HysteresisOperator, InverseHysteresisOperator
from .iterative_learning import IterativeLearning
from .linear_model_predictive import LinearModelPredictive
from .motion_feed_forward import MotionFeedForward
from .on_off import OnOffController
from .open_loop_law import OpenLoopLaw
from .pid import PID
from .proportional_feedback import ProportionalFeedback
from .setpoint_command import SetpointCommand
from .setpoint_delay import WithSetpointDelay
from .setpoint_lead import SetpointLead
from .sliding_mode import SlidingMode
from .state_feedback import StateFeedback
from .static_inverse import StaticInverse
from .stuck_valve import WithStuckValve
from .super_twisting import SuperTwisting
from .with_feed_forward import WithFeedForward

__all__ = [
    "PID",
    "AngleAndStiffness",
    "AntagonisticInverse",
    "Cascade",
    "CoContraction",
    "ComputedTorque",
    "DeadZoneController",
    "Decentralised",
    "FrictionFeedForward",
    "GainSchedule",
    "HysteresisCompensation",
    "HysteresisOperator",
    "InverseHysteresisOperator",
    "IterativeLearning",
    "LinearModelPredictive",
    "MotionFeedForward",
    "OnOffController",
    "OpenLoopLaw",
    "ProportionalFeedback",
    "SetpointCommand",
    "SetpointLead",
    "SlidingMode",
    "StateFeedback",
    "StaticFeedForward",
    "StaticInverse",
    "SuperTwisting",
    "WithFeedForward",
    "WithSetpointDelay",
    "WithStuckValve",
]
