"""Every public object can be copied and sent to another process: compiled code belongs to a
process, not to an object.
"""

from __future__ import annotations

import concurrent.futures
import copy
import dataclasses
import enum
import functools
import inspect
import multiprocessing
import pickle
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import control_plants
import numpy as np
import pytest
from contender_set import standard_contenders
from joint_models import on_off_joint
from plants import EXAMPLES

import airmuscle as am
from airmuscle import bench, control, design, engine, files, outlets, physics
from airmuscle.outlets.environments import PlantEnv, PlantVectorEnv, arm_task, joint_task, lift_task
from airmuscle.units import bar

EXAMPLE_FILES = Path(__file__).parents[2] / "examples"
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


MADE_BY_AN_EXPORT = {outlets.MuscleActuator}
HOLD_A_LINE = {
    outlets.Rig,
    outlets.SerialRig,
    outlets.Ros2Rig,
    outlets.SerialDevice,
    outlets.SimulatedRig,
}
"""Rigs, which hold an open line or a running plant, of which there is one."""
"""Classes of which an object is made together with files."""


def predictive() -> Any:
    permitted = {"position": 1e-3, "speed": 0.1, "fill": 0.1, "discharge": 0.1}
    noises = {
        "process_noise": {"air_mass": 1e-6, "speed": 0.1, "air_mass.disturbance": 1e-5},
        "measurement_noise": {"position": 1e-4},
    }
    one = ("position",)
    return control.design_predictive(
        linear_model(),
        0.01,
        measured=one,
        controlled=one,
        disturbed=("air_mass",),
        permitted=permitted,
        **noises,
    )


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
    "an environment with sensors": lambda: outlets.MeasuredObservations(
        environment(), noise=0.01, delay=2
    ),
    "a vector environment": vector,
    "contenders and tasks of the benchmark": lambda: (
        *standard_contenders(on_off_joint()),
        *design.STANDARD_TASKS,
    ),
    "a loop with sensitivities": lambda: engine.differentiate_loop(
        LIFT, LOOP, ("controller.gain",), (2e-5,)
    ),
    "targets of an export": lambda: (outlets.C99(), outlets.JavaScript(), outlets.Octave()),
    "an inspection": lambda: bench.inspect(BENCH),
    "an unscented Kalman filter": lambda: control.UnscentedKalmanFilter(
        LIFT, ("pressure",), 0.01, {}, {"pressure": 500.0}
    ),
    "an entry of the library": lambda: am.load("dmsp-20-300"),
    "chapters of a muscle, a valve and a working point": lambda: (
        PRODUCT.chapter(),
        am.load("matrix-821").chapter(),
        files.library.evaluate(PRODUCT, {"pressure": 3e5, "contraction": 0.1}).chapter(),
    ),
    "a scenario of the library": lambda: files.load_scenario(EXAMPLE_FILES / "pressure_loop.toml"),
    "a study": lambda: design.load_study(EXAMPLE_FILES / "valve_study.toml"),
    "a learning law": lambda: control.IterativeLearning(0.01, (1.0, 0.5)),
    "a predictive law": predictive,
    "predictive control of a file": (
        lambda: files.load_scenario(EXAMPLE_FILES / "predictive_lift.toml").problem.input
    ),
    "tasks of an arm and of a lift": lambda: (*arm_task(), *lift_task()),
    "a plant along measured pressures": lambda: physics.PressureDriven(
        control_plants.JOINT.muscles, control_plants.JOINT.mechanism, (0.02, 0.02)
    ),
    "a reader of rows": lambda: bench.RowReader("log"),
    "tables of forces and of volumes": lambda: (
        physics.Tabulated((1e5, 1e5, 2e5, 2e5), (0.0, 0.1, 0.0, 0.1), (50.0, 20.0, 90.0, 40.0)),
        physics.TabulatedGeometry((0.0, 0.1), (1e-4, 2e-4), 0.2),
    ),
}


@pytest.mark.parametrize("way", COPIES)
@pytest.mark.parametrize("name", RESULTS)
def test_results_can_be_copied(name, way):
    thing = RESULTS[name]()
    assert type(COPIES[way](thing)) is type(thing)


def parts(thing: Any, seen: set[int]) -> Iterator[Any]:
    """An object and the objects of this package inside it."""
    if id(thing) in seen:
        return
    seen.add(id(thing))
    yield thing
    inner = (
        thing.values()
        if isinstance(thing, dict)
        else thing
        if isinstance(thing, tuple | list)
        else ()
    )
    if type(thing).__module__.startswith("airmuscle"):
        inner = [*inner, *vars(thing).values()] if hasattr(thing, "__dict__") else inner
    for each in inner:
        yield from parts(each, seen)


def test_every_public_class_that_stores_more_than_its_fields_is_among_the_results():
    """A class that is no plain data, or that stores what it has computed, can fail to be copied;
    others cannot.
    """
    made = [make() for make in RESULTS.values()]
    known = {
        cls for thing in parts((made, *EXAMPLES.values()), set()) for cls in type(thing).__mro__
    }
    faces = (am, bench, control, design, engine, files, outlets, physics)
    public = {
        f"{face.__name__}.{name}": getattr(face, name) for face in faces for name in face.__all__
    }
    missing = {
        name
        for name, cls in public.items()
        if inspect.isclass(cls)
        and not inspect.isabstract(cls)
        and not issubclass(cls, BaseException)
        if cls not in known and cls not in MADE_BY_AN_EXPORT | HOLD_A_LINE
        if not (dataclasses.is_dataclass(cls) or issubclass(cls, tuple | enum.Enum))
        or stores_results(cls)
    }
    assert missing == set()


def stores_results(cls: type) -> bool:
    return any(
        isinstance(each, functools.cached_property)
        for base in cls.__mro__
        for each in vars(base).values()
    )


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
    assert (
        am.solve(again.continuation(0.2)).final_state
        == am.solve(solution.continuation(0.2)).final_state
    )


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
    env = environment()
    envs = vector()
    action = [0.2, 0.3]
    actions = np.full((3, 2), -0.3)
    again = COPIES[way](env)
    others = COPIES[way](envs)
    for one, other, given in ((env, again, action), (envs, others, actions)):
        for _ in range(3):
            expected = [np.array(part) for part in one.step(given)[:3]]
            for part, value in zip(other.step(given)[:3], expected, strict=True):
                np.testing.assert_array_equal(part, value)
        np.testing.assert_array_equal(one.reset()[0], other.reset()[0])
