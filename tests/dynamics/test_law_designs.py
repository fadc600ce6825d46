"""A control law that is designed from weights runs as its designed law, compiled with the plant, in
single runs and in batches; a search for the weights designs it anew for each set.
"""

from __future__ import annotations

import functools
from dataclasses import replace

import numpy as np
import pytest
from control_plants import LIFT

import airmuscle as am
from airmuscle.control import PID, WithFeedForward, WithSetpointDelay
from airmuscle.core import model, parameter
from airmuscle.design import LoopCase, tune
from airmuscle.engine import (
    ControlLaw,
    ControlLoop,
    LawDesign,
    RungeKutta4,
    SplitRange,
    simulate,
    simulate_batch,
)
from airmuscle.engine.loop import designed_loop, with_designed_laws
from airmuscle.errors import ParameterError

H = 0.01
BAR = 1e5
VALVES = SplitRange("fill", "discharge")


@model
class Placement(LawDesign):
    """A proportional gain from a wanted time constant, by a function that cannot be traced."""

    time_constant: float = parameter("s", "T", "wanted time constant", bounds=(1e-3, 10.0))

    @functools.cached_property
    def law(self) -> ControlLaw:
        return PID("pressure", VALVES, gain=float(f"{0.05 / BAR / self.time_constant:.6e}"))


WANTED = am.Schedule({"pressure": ((0.0, 1 * BAR), (0.1, 2.5 * BAR))})
START = am.find_equilibrium(LIFT, pressure=1 * BAR)


def loop(law: ControlLaw) -> ControlLoop:
    return ControlLoop(law, H, WANTED)


def run(law: ControlLaw, **options: object) -> am.Recording:
    return simulate(LIFT, loop(law), duration=0.4, initial_state=START, output_times=H, **options)


@pytest.mark.parametrize("enclosed", [False, True])
def test_a_design_runs_as_its_designed_law_compiled_with_the_plant(enclosed: bool):
    design = Placement(0.1)

    def around(law: ControlLaw) -> ControlLaw:
        return (
            WithSetpointDelay(WithFeedForward(PID("pressure", VALVES, gain=1e-6), law), 1)
            if enclosed
            else law
        )

    ours = run(around(design))
    theirs = run(around(design.law))
    assert np.array_equal(ours["pressure"], theirs["pressure"])
    assert any("compiled with the plant" in note for note in ours.notes)
    assert np.ptp(ours["pressure"]) > 0.5 * BAR


@pytest.mark.parametrize("integrator", [None, RungeKutta4(1e-3)], ids=["one by one", "in lanes"])
def test_a_batch_takes_designs_with_different_weights(integrator: RungeKutta4 | None):
    times = (0.05, 0.1, 0.2)
    batch = simulate_batch(
        LIFT,
        {},
        [loop(Placement(time)) for time in times],
        duration=0.4,
        output_times=H,
        initial_states={name: np.full(3, value) for name, value in START.items()},
        integrator=integrator,
    )
    for row, time in zip(batch["pressure"], times, strict=True):
        alone = run(Placement(time).law, integrator=integrator)
        np.testing.assert_allclose(row, alone["pressure"], rtol=1e-9)


def test_the_weights_of_a_design_are_tuned():
    case = LoopCase("lift", LIFT, loop(Placement(1.0)), START)
    tuning = tune([case], {"time_constant": (0.01, 2.0)}, duration=0.4, simulations=40, seed=1)
    assert tuning.objective < 0.7 * tuning.present_objective
    assert isinstance(tuning.loop.controller, Placement)
    assert tuning.loop.controller.time_constant == tuning.gains["time_constant"]


def test_a_loop_without_designs_remains_the_same_object():
    plain = loop(WithSetpointDelay(PID("pressure", VALVES, gain=1e-6), 2))
    assert designed_loop(plain, LIFT) is plain
    nested = WithSetpointDelay(Placement(0.2), 2)
    assert with_designed_laws(nested) == replace(nested, law=Placement(0.2).law)


def test_a_weight_cannot_be_varied_without_a_new_design():
    with pytest.raises(ParameterError, match="time_constant"):
        simulate_batch(
            LIFT, {"controller.time_constant": [0.1, 0.2]}, loop(Placement(0.1)), duration=0.1
        )
