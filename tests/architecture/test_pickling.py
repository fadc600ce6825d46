"""Every public object can be copied and sent to another process: compiled code belongs to a process, not to an object."""

from __future__ import annotations

import concurrent.futures
import copy
import multiprocessing
import pickle
from collections.abc import Callable
from typing import Any

import control_plants
import numpy as np
import pytest
from plants import EXAMPLES

import airmuscle as am
from airmuscle import bench, control, design, engine, outlets, physics
from airmuscle.outlets.environments import PlantEnv, PlantVectorEnv, joint_task
from airmuscle.units import bar

COPIES: dict[str, Callable[[Any], Any]] = {
    "pickle": lambda thing: pickle.loads(pickle.dumps(thing)),
    "copy": copy.copy,
    "deepcopy": copy.deepcopy,
}
LIFT = control_plants.LIFT
RAMP = am.Schedule({"fill": ((0.1, 1.0), (0.3, 0.0))})
LOOP = am.ControlLoop(control_plants.PRESSURE, 0.01, am.Schedule({"pressure": ((0.0, 2 * bar),)}))
BENCH = am.load_data("dmsp-20-300")
PRODUCT = am.load("dmsp-20-300")
SUPPLY = design.SizingConditions(supply=6 * bar)
LIMITS = bench.BenchLimits(am.characteristic.ValidityRange(0.0, 6e5, 0.0, 0.25), 1500.0)


def open_loop() -> am.Problem:
    return am.Problem(LIFT, RAMP, 0.4)


def used(problem: am.Problem) -> am.Problem:
    am.solve(problem)
    return problem


def stepped() -> am.Stepper:
    stepper = am.Stepper(LIFT)
    stepper.step({"fill": 1.0}, 0.05)
    return stepper


def estimator() -> Any:
    return control.ExtendedKalmanFilter(LIFT, ("pressure",), 0.01, {}, {"pressure": 500.0})


def environment() -> PlantEnv:
    env = PlantEnv(*joint_task())
    env.reset(seed=3)
    env.step([0.5, -0.5])
    return env


def vector() -> PlantVectorEnv:
    envs = PlantVectorEnv(3, *joint_task())
    envs.reset(seed=3)
    envs.step(np.full((3, 2), 0.4))
    return envs


def linear_model() -> Any:
    return am.linearise(LIFT, LIFT.state_at(pressure=2 * bar, position=0.01))


RESULTS: dict[str, Callable[[], Any]] = {
    "a problem": open_loop,
    "a solved problem": lambda: used(open_loop()),
    "a problem of a control loop": lambda: used(am.Problem(LIFT, LOOP, 0.4)),
    "a solution": lambda: am.solve(open_loop()),
    "a solution of a control loop": lambda: am.solve(am.Problem(LIFT, LOOP, 0.4)),
    "a stepper": stepped,
    "equilibria": lambda: am.find_equilibrium(LIFT, pressure=2 * bar),
    "a linear model": linear_model,
    "joint statics": lambda: physics.joint_statics(control_plants.JOINT),
    "a Kalman filter": estimator,
    "a batch": lambda: am.simulate_batch(LIFT, {"mechanism.mass": [1.0, 2.0]}, RAMP, duration=0.2),
    "sensitivities": lambda: engine.WithSensitivities(LIFT, (("mechanism.mass",),), (2.0,)),
    "a recording": lambda: BENCH,
    "a fit": lambda: am.fit(am.characteristic.ContractileSurface.blank(3, max_force=1e5), BENCH),
    "a comparison of laws": lambda: bench.compare(BENCH),
    "a recursive fit": lambda: bench.RecursiveFit(LIMITS, degree=2),
    "muscles for a lift": lambda: design.size_muscles(
        design.LiftRequirement(stroke=0.04, mass=10.0), SUPPLY, [PRODUCT]
    ),
    "an environment": environment,
    "a vector environment": vector,
    "contenders and tasks of the benchmark": lambda: (
        *design.standard_contenders(design.on_off_joint()),
        *design.STANDARD_TASKS,
    ),
    "a loop with sensitivities": lambda: engine.differentiate_loop(LIFT, LOOP, ("controller.gain",), (2e-5,)),
    "targets of an export": lambda: (outlets.C99(), outlets.JavaScript(), outlets.Octave()),
    "an inspection": lambda: bench.inspect(BENCH),
    "an unscented Kalman filter": lambda: control.UnscentedKalmanFilter(
        LIFT, ("pressure",), 0.01, {}, {"pressure": 500.0}
    ),
    "an entry of the library": lambda: am.load("dmsp-20-300"),
}


@pytest.mark.parametrize("way", COPIES)
@pytest.mark.parametrize("name", RESULTS)
def test_results_can_be_copied(name, way):
    thing = RESULTS[name]()
    assert type(COPIES[way](thing)) is type(thing)


@pytest.mark.parametrize("way", COPIES)
def test_models_can_be_copied(way):
    for plant in EXAMPLES.values():
        assert COPIES[way](plant) == plant


def test_a_worker_process_solves_a_problem_that_was_sent_to_it():
    """Also one that was solved here before, whose compiled code stays here."""
    spawn = multiprocessing.get_context("spawn")
    for problem in (used(open_loop()), used(am.Problem(LIFT, LOOP, 0.4))):
        with concurrent.futures.ProcessPoolExecutor(1, spawn) as pool:
            there = pool.submit(am.solve, problem).result()
        here = am.solve(problem)
        for name in here.recording:
            np.testing.assert_array_equal(there.recording[name], here.recording[name])
        assert there.final_state == here.final_state


def test_a_copied_solution_is_continued_like_the_original():
    solution = am.solve(am.Problem(LIFT, LOOP, 0.4))
    again = COPIES["pickle"](solution)
    assert am.solve(again.continuation(0.2)).final_state == am.solve(solution.continuation(0.2)).final_state


@pytest.mark.parametrize("way", COPIES)
def test_a_copied_stepper_goes_on_by_itself(way):
    stepper = stepped()
    again = COPIES[way](stepper)
    np.testing.assert_array_equal(again.outputs, stepper.outputs)
    before = stepper.values()
    moved = again.step({"discharge": 1.0}, 0.05).copy()
    assert stepper.values() == before
    np.testing.assert_array_equal(stepper.step({"discharge": 1.0}, 0.05), moved)
    np.testing.assert_array_equal(again.reset(), stepper.reset())


@pytest.mark.parametrize("way", ["pickle", "deepcopy"])
def test_a_copied_environment_goes_on_by_itself(way):
    """With the parameters that the episode has drawn, and the same draws at its next reset."""
    env, envs = environment(), vector()
    action, actions = [0.2, 0.3], np.full((3, 2), -0.3)
    again, others = COPIES[way](env), COPIES[way](envs)
    for one, other, given in ((env, again, action), (envs, others, actions)):
        for _ in range(3):
            expected = [np.array(part) for part in one.step(given)[:3]]
            for part, value in zip(other.step(given)[:3], expected, strict=True):
                np.testing.assert_array_equal(part, value)
        np.testing.assert_array_equal(one.reset()[0], other.reset()[0])
