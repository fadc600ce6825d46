"""A user's contender of the control benchmark with the joint and the short task on which tests try
it.
"""

from __future__ import annotations

import math
from typing import ClassVar

from joint_models import proportional_joint

from airmuscle.core import model, parameter
from airmuscle.design import Contender, ControlTask, SineMotion
from airmuscle.engine import ControlLaw

JOINT = proportional_joint((11,))
"""With one truth: Sarosi2012, LuGre, nozzles, tubes, energy balance."""
SHORT = ControlTask("short sine", SineMotion(math.radians(10.0), 2.0), 1.0, begin=0.5)


@model
class AngleLaw(ControlLaw):
    """A user's law: proportional, from the angle to half the pressure difference."""

    gain: float = parameter("Pa/rad", "K", "gain", bounds=(0.0, 1e7))
    measured_columns = ("angle",)
    setpoints = ("angle",)
    inputs = ("difference",)
    initial_memory: ClassVar = {}

    def step(self, memory, measurement, dt):
        return {
            "difference": (
                self.gain * (measurement.setpoints["angle"] - measurement.columns["angle"])
            )
        }, {}


MINE = Contender("mine", AngleLaw(2e5), {"gain": (1e5, 5e5)})
