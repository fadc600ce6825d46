"""Plants and loops of the tests of control laws: a lifted load, and an antagonistic joint; all
numbers are chosen.
"""

from __future__ import annotations

import dataclasses

import numpy as np
from plants import chosen_muscle

from airmuscle.control import PID, AntagonisticInverse, Decentralised
from airmuscle.engine import Solution, SplitRange
from airmuscle.physics import (
    AntagonisticJoint,
    FillDischarge,
    HangingMass,
    Plant,
    Polytropic,
    Supply,
    Valve,
)

VALVE = Valve(2.6e-9, 0.4)
LARGE = Valve(1e-8, 0.4)
SPLIT = SplitRange("fill", "discharge")
LIFT = Plant(
    chosen_muscle(), FillDischarge(Supply(5.5e5), VALVE, VALVE), HangingMass(2.0), Polytropic(1.2)
)
MUSCLES = tuple(dataclasses.replace(chosen_muscle(), name=name) for name in ("left", "right"))
MECHANISM = AntagonisticJoint(
    radius=0.02, inertia=0.02, damping=0.05, weight_torque=0.5, offset=0.08
)
CIRCUIT = FillDischarge(Supply(5.5e5), LARGE, LARGE)
JOINT = Plant(MUSCLES, (CIRCUIT, CIRCUIT), MECHANISM, Polytropic(1.2))
PRESSURES = Decentralised(
    tuple(
        PID(f"{name}.pressure", SplitRange(f"{name}.fill", f"{name}.discharge"), gain=2e-5)
        for name in ("left", "right")
    )
)
PRESSURE = PID("pressure", SPLIT, gain=2e-5, integral_time=0.5)
INVERSE = AntagonisticInverse(MUSCLES, MECHANISM, 0.2e5, 5e5)


def assert_identical(one: Solution, other: Solution, notes: bool = False) -> None:
    """Two solutions are the same to the last bit; with `notes`, so are the notes of their
    recordings.
    """
    assert one.status == other.status
    assert list(one.recording) == list(other.recording)
    for name in one.recording:
        np.testing.assert_array_equal(
            one.recording[name], other.recording[name], err_msg=name, strict=True
        )
    assert (one.final_time, one.final_state) == (other.final_time, other.final_state)
    assert (one.control_state, one.statistics) == (other.control_state, other.statistics)
    assert not notes or one.recording.notes == other.recording.notes
