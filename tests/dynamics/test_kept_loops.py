"""A run of a compiled loop is kept with its plant for the next loop of the same form: the result is
that of a new run to the last bit, and results that were returned before do not change."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from control_plants import LIFT, SPLIT, assert_identical

from airmuscle.control import PID, OnOffController
from airmuscle.engine import (
    PWM,
    ControlLoop,
    Problem,
    RungeKutta4,
    SampledSignal,
    Schedule,
    SolenoidDriver,
    solve,
)
from airmuscle.engine.run import prepare_loop
from airmuscle.engine.run.run import form_of

STEPS = Schedule({"pressure": ((0, 1e5), (0.5, 3e5), (0.703, 2e5))})
SOLENOID = SolenoidDriver(2e-3, 1.5e-3, 1e-3, 1.2e-3)
DRIVERS = {
    "held": {},
    "pulsed and delayed": {"fill": (PWM(50.0, 1e-3), SOLENOID), "discharge": (PWM(31.0), SOLENOID)},
}
ON_OFF = OnOffController("pressure", SPLIT, hysteresis=1e4)
SLOW = PID("pressure", SPLIT, gain=4e-6, integral_time=0.4)
QUICK = PID("pressure", SPLIT, gain=2e-5, integral_time=0.2, initial_output=0.1)


def fresh(problem: Problem):
    """The solution with a plant that nothing is kept with."""
    return solve(dataclasses.replace(problem, system=dataclasses.replace(problem.system)))


@pytest.fixture
def prepared(monkeypatch):
    """The loops that were prepared anew."""
    loops = []
    preparing = lambda *given: loops.append(1) or prepare_loop(*given)  # noqa: E731
    monkeypatch.setattr("airmuscle.engine.run.run.prepare_loop", preparing)
    return loops


@pytest.mark.parametrize("drivers", ["held", "pulsed and delayed"])
def test_loops_of_other_gains_run_in_the_same_arrays_with_the_results_of_new_runs(
    drivers, prepared
):
    plant = dataclasses.replace(LIFT)
    loop = ControlLoop(SLOW, 0.0125, STEPS, drivers=DRIVERS[drivers])
    first = Problem(plant, loop, 1.0)
    higher = plant.state_at(pressure=5e4)
    problems = [
        first,
        dataclasses.replace(first, input=dataclasses.replace(loop, controller=QUICK)),
        dataclasses.replace(first, initial_state=higher),
        first,
    ]
    solutions = [solve(problem) for problem in problems]
    assert len(prepared) == 1
    for problem, solution in zip(problems, solutions, strict=True):
        assert_identical(solution, fresh(problem), notes=True)
    assert not np.array_equal(
        solutions[0].recording["pressure"], solutions[1].recording["pressure"]
    )
    assert "initial_output=0.1" in solutions[1].diagnostics[0].text


def test_loops_of_another_form_are_prepared_anew():
    plant = dataclasses.replace(LIFT)
    loop = ControlLoop(SLOW, 0.0125, STEPS)
    first = Problem(plant, loop, 1.0)
    for change in (
        {"input": dataclasses.replace(loop, sample_time=0.025)},
        {"input": dataclasses.replace(loop, setpoint=Schedule({"pressure": ((0.0, 2e5),)}))},
        {"input": dataclasses.replace(loop, drivers={"discharge": SOLENOID})},
        {"input": dataclasses.replace(loop, controller=ON_OFF)},
        {
            "input": dataclasses.replace(
                loop, controller=dataclasses.replace(SLOW, commanded="fill")
            )
        },
        {"duration": 0.7},
        {"output_times": 0.04},
        {"output_times": np.linspace(0.0, 1.0, 7)},
        {"integrator": RungeKutta4(1e-3)},
    ):
        solve(first)
        other = dataclasses.replace(first, **change)
        assert_identical(solve(other), fresh(other), notes=True)


def test_a_run_that_is_continued_is_the_run_in_one_also_after_other_runs_of_its_form():
    plant = dataclasses.replace(LIFT)
    loop = ControlLoop(QUICK, 0.0125, STEPS)
    whole = solve(Problem(plant, loop, 1.0))
    half = solve(Problem(plant, loop, 0.5))
    solve(Problem(plant, dataclasses.replace(loop, controller=SLOW), 0.5))
    assert solve(half.continuation(0.5)).final_state == whole.final_state


def test_a_loop_whose_signals_may_change_is_not_kept():
    loop = ControlLoop(SLOW, 0.0125, SampledSignal({"pressure": ((0.0, 1e5), (1.0, 2e5))}))
    assert form_of(Problem(LIFT, loop, 1.0)) is None
    assert form_of(Problem(LIFT, dataclasses.replace(loop, setpoint=STEPS), 1.0)) is not None


def test_few_forms_are_kept_with_a_plant():
    plant = dataclasses.replace(LIFT)
    problems = [Problem(plant, ControlLoop(ON_OFF, 0.05, STEPS), 0.1 * i) for i in range(1, 7)]
    for problem in problems:
        solve(problem)
        assert 1 <= len(problem.compiled.description.cache.loops) <= 4


class Emptied(list):
    """What another thread takes the last item from after it was seen to hold one."""

    def pop(self):
        raise IndexError


def test_what_another_thread_takes_first_is_made_anew():
    plant = dataclasses.replace(LIFT)
    loop = Problem(plant, ControlLoop(ON_OFF, 0.05, STEPS), 0.3)
    command = Problem(plant, Schedule({}), 0.3)
    alone = [solve(loop), solve(command)]
    cache = loop.compiled.description.cache
    for pool in (cache.loops, cache.integrators, cache.recorders):
        pool._idle = {key: Emptied(idle) for key, idle in pool._idle.items()}
    for problem, before in zip((loop, command), alone, strict=True):
        assert_identical(solve(problem), before, notes=True)
