"""Nonlinear model predictive control: near the operating point its plan is that of the linear one,
with an error of second order; limits of columns are kept, there is no offset at rest, and a program
without solution is stated.
"""

from __future__ import annotations

import pickle
from dataclasses import replace

import numpy as np
import pytest

import airmuscle as am
from airmuscle.control import ExtendedKalmanFilter, NonlinearModelPredictive, design_predictive
from airmuscle.engine import ControlLoop, Measurement
from airmuscle.errors import ParameterError
from airmuscle.physics import find_equilibrium, linearise

H = 0.01
MUSCLE = replace(am.load("dmsp-20-300").muscle, damper=am.LinearDamper(300.0))
VALVE = am.Valve(1e-9, 0.35)
PLANT = am.Plant(
    MUSCLE, am.FillDischarge(am.Supply(6e5), VALVE, VALVE), am.HangingMass(10.0), am.Polytropic(1.2)
)
REST = find_equilibrium(PLANT, pressure=2e5)
NOISE = {"air_mass": 1e-6, "speed": 0.02, "speed.disturbance": 1.0}
SENSOR = {"position": 1e-5}
PERMITTED = {"position": 1e-3, "fill": 0.2}
STATES = tuple(state.name for state in PLANT.states)


def flow(fill: float, discharge: float) -> float:
    return PLANT.outputs(REST, {"fill": fill, "discharge": discharge})["mass_flow"]


OPEN = {"fill": -0.3 * flow(0.0, 1.0) / flow(1.0, 0.0), "discharge": 0.3}
"""Openings at which as much air enters as leaves, beside the kink of a closed valve."""
FILTER = ExtendedKalmanFilter(PLANT, ("position",), H, NOISE, SENSOR, disturbances=("speed",))
FIRST = FILTER.start(REST, {"air_mass": 1e-6, "speed.disturbance": 0.5})
LAW = NonlinearModelPredictive(FILTER, FIRST, OPEN, ("position",), ("fill",), PERMITTED, horizon=12)
BESIDE = am.Schedule({"discharge": ((0.0, OPEN["discharge"]),)})


def loop(law: NonlinearModelPredictive, step: float) -> ControlLoop:
    wanted = am.Schedule({"position": ((0.0, REST["position"]), (0.05, REST["position"] + step))})
    return ControlLoop(law, H, wanted, BESIDE)


def both_plans(size: float):
    """The planned openings (N,) of nonlinear and linear control for a deviation of this size
    [m].
    """
    model = linearise(PLANT, REST, OPEN).select(inputs=["fill"])
    linear = design_predictive(
        model,
        H,
        measured=("position",),
        controlled=("position",),
        disturbed=("speed",),
        permitted=PERMITTED,
        process_noise=NOISE,
        measurement_noise=SENSOR,
        horizon=12,
    )
    deviation = np.array([2e-5 * size, size, 0.0])
    disturbance = 200.0 * size
    wanted = -0.5 * size
    scale = np.array([NOISE["air_mass"], PERMITTED["position"], NOISE["speed"]])
    estimate = np.array([*deviation / scale, disturbance])
    limits = [np.array([(end - OPEN["fill"]) / 0.2]) for end in (0.0, 1.0)]
    theirs = linear.plan(estimate, np.array([wanted]), *limits)
    rest = np.array([REST[name] for name in STATES])
    state = np.array([*(rest + deviation), disturbance])
    ours, _ = LAW.plan(state, np.array([REST["position"] + wanted]), np.zeros(1), np.ones(1))
    return ours.ravel() - OPEN["fill"], 0.2 * theirs.ravel()


def test_near_the_operating_point_the_plan_is_that_of_linear_control():
    errors = []
    for size in (4e-4, 1e-4):
        ours, theirs = both_plans(size)
        assert np.abs(theirs).max() > 20 * size
        errors.append(np.abs(ours - theirs).max())
    assert errors[1] < 2e-3 * np.abs(theirs).max()
    assert errors[1] < errors[0] / 10  # an error of second order falls to 1/16


def test_the_plan_is_the_best_under_the_equations_of_the_plant():
    """A change of any planned input, within its range, does not lower the cost of the plant's own
    steps.
    """
    state = np.array([*(REST[name] for name in STATES), 0.0])
    wanted = np.array([REST["position"] + 3e-3])
    plan, variables = LAW.plan(state, wanted, np.zeros(1), np.ones(1))
    program = LAW._idle[0]
    aim = variables[:4]
    step = program.step_function()

    def cost(openings):
        x = state[:3] / program.scale
        total = 0.0
        for u in openings / program.sizes:
            total += (x - aim[:3]) @ program.weights @ (x - aim[:3]) + float((u - aim[3]) ** 2)
            x = np.array(step(x, u, state[3:])).ravel()
        return total + (x - aim[:3]) @ program.terminal @ (x - aim[:3])

    best = cost(plan.ravel())
    for k in range(0, 12, 2):
        for change in (-0.02, 0.02):
            other = plan.ravel().copy()
            other[k] = np.clip(other[k] + change, 0.0, 1.0)
            assert cost(other) >= best * (1 - 1e-8)
    assert plan.max() > 2 * OPEN["fill"]


def test_a_load_that_the_model_does_not_know_leaves_no_offset():
    heavier = replace(PLANT, mechanism=am.HangingMass(10.5))
    start = find_equilibrium(heavier, pressure=2e5)
    run = am.simulate(heavier, loop(LAW, 4e-3), duration=1.0, initial_state=start)
    assert run["position"][-1] - REST["position"] == pytest.approx(4e-3, abs=3e-5)
    assert not any("no solution" in note for note in run.notes)


def test_a_limit_of_a_column_is_kept():
    free, kept = (
        am.simulate(
            PLANT, loop(replace(LAW, limits=limits), 4e-3), duration=0.35, initial_state=REST
        )["speed"].max()
        for limits in ({}, {"speed": (-0.02, 0.02)})
    )
    assert free > 0.03
    assert kept < 0.02 * 1.05


def test_a_program_without_solution_is_stated_and_the_last_input_is_held():
    impossible = {"position": (REST["position"] + 5e-3, REST["position"] + 6e-3)}
    law = replace(LAW, limits=impossible, slack_weight=float("inf"))
    memory = law.init()
    commands = []
    for _ in range(2):
        measurement = Measurement(
            {"position": REST["position"]}, {"position": REST["position"]}, {"fill": (0.0, 1.0)}
        )
        command, memory = law.step(memory, measurement, H)
        commands.append(command["fill"])
    assert commands == pytest.approx([OPEN["fill"]] * 2)
    assert law.notes(memory)[0].startswith(
        "NonlinearModelPredictive: the nonlinear program had no solution at 2 samples"
    )
    assert LAW.notes(LAW.init()) == ()


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"controlled": ("positoin",)}, "positoin"),
        ({"commanded": ("fil",)}, "fil"),
        ({"permitted": {"position": 1e-3}}, "fill"),
        ({"permitted": {"position": -1e-3, "fill": 0.2}}, "position"),
        (
            {"limits": {"speed": (0.1, -0.1)}},
            r"the limits of 'speed' are 0.1 and -0.1; the minimum must be below",
        ),
        ({"limits": {"speed": (0.0, float("nan"))}}, r"the limits of 'speed' are 0 and nan"),
        ({"horizon": 0}, r"horizon is 0; allowed range: 1 to 200"),
        ({"substeps": 0}, r"substeps is 0; allowed range: 1 to 200"),
        ({"slack_weight": 0.0}, r"slack_weight is 0.0; it must be positive"),
        (
            {"estimator": replace(FILTER, parameters=("mechanism.mass",))},
            r"has the parameters mechanism\.mass; give",
        ),
    ],
)
def test_a_controller_that_cannot_be_is_refused(changes: dict, message: str):
    with pytest.raises(ParameterError, match=message):
        replace(LAW, **changes)


def test_another_sample_time_than_that_of_the_estimator_is_refused():
    measurement = Measurement({"position": 0.02}, {"position": 0.02}, {"fill": (0.0, 1.0)})
    with pytest.raises(
        ParameterError,
        match=r"the sample time of the loop is 0\.02 s and that of the estimator 0\.01 s",
    ):
        LAW.step(LAW.init(), measurement, 0.02)


def test_a_controller_can_be_sent_to_another_process():
    """Also after it has planned, when it holds the programs of the solver."""
    wanted = np.array([REST["position"] + 1e-3])
    low = np.zeros(1)
    high = np.ones(1)
    first, _ = LAW.plan(FIRST.mean, wanted, low, high)
    again = pickle.loads(pickle.dumps(LAW))
    assert again._idle == []
    assert np.array_equal(again.plan(FIRST.mean, wanted, low, high)[0], first)
