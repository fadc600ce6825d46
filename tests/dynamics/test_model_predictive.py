"""Linear model predictive control: the plan is the minimum of the stated quadratic program, by its
optimality conditions and by an exhaustive search of the active limits; without active limits the
command is that of the linear-quadratic regulator; there is no offset at rest; a limit of a column
is kept, and a program without solution is stated.
"""

from __future__ import annotations

import dataclasses
import itertools
import pickle
from dataclasses import replace

import numpy as np
import pytest

import airmuscle as am
from airmuscle.control import design_lqg, design_predictive, linearise_loop
from airmuscle.control.estimation.lqg_and_adrc import regulator
from airmuscle.engine import ControlLoop, Measurement, Problem, Schedule, solve
from airmuscle.errors import ParameterError
from airmuscle.physics import linearise

H = 0.01
REGULATED = replace(am.load("joint-dmsp-20-regulators").plant, gas=am.Polytropic(1.2))
REST = am.find_equilibrium(REGULATED, pressure=2.5e5)
SETPOINT = 2.5e5
AT = linearise(REGULATED, {**REST}, {"left.setpoint": SETPOINT, "right.setpoint": SETPOINT})
MEASURED = ("left.pressure", "right.pressure", "angle")
GIVEN = {
    "measured": MEASURED,
    "controlled": ("angle",),
    "disturbed": ("left.air_mass", "right.air_mass", "angular_speed"),
    "permitted": {"angle": 0.02, "angular_speed": 1.0, "left.setpoint": 1e5, "right.setpoint": 1e5},
    "process_noise": {
        "left.air_mass": 1e-6,
        "right.air_mass": 1e-6,
        "angular_speed": 0.1,
        "left.air_mass.disturbance": 1e-5,
        "right.air_mass.disturbance": 1e-5,
        "angular_speed.disturbance": 5.0,
        "left.lagged_setpoint_rate": 1e3,
        "right.lagged_setpoint_rate": 1e3,
    },
    "measurement_noise": {"left.pressure": 300.0, "right.pressure": 300.0, "angle": 1e-4},
}


def law(**changes):
    return design_predictive(AT, H, **{**GIVEN, **changes})


def measurement(angle, setpoint, low=0.0, high=6e5, pressures=(2.5e5, 2.5e5)):
    columns = dict(zip(MEASURED, (*pressures, angle), strict=True))
    return Measurement(
        columns,
        {"angle": setpoint},
        dict.fromkeys(GIVEN["permitted"].keys() - {"angle", "angular_speed"}, (low, high)),
    )


def bounds(judged, error, steady, low, high):
    """The limits of z as stated in CondensedProblem, written down once more."""
    problem = judged.problem
    target = judged.model
    n = len(error)
    rows = problem.rows
    shift = (target.columns @ steady[:n])[problem.limited] + problem.rows_by_state @ error
    top, bottom = (limit[problem.limited] - shift for limit in (target.upper, target.lower))
    lower = [*(list(low - steady[n:]) * problem.horizon), *[0.0] * problem.slacks]
    upper = [*(list(high - steady[n:]) * problem.horizon), *[np.inf] * problem.slacks]
    matrix = np.vstack(
        [np.eye(rows.shape[1]), -np.eye(rows.shape[1]), rows[problem.upper], -rows[~problem.upper]]
    )
    limit = np.concatenate(
        [upper, [-x for x in lower], top[problem.upper], -bottom[~problem.upper]]
    )
    return matrix[np.isfinite(limit)], limit[np.isfinite(limit)]


def target_of(judged, estimate, setpoint):
    """Deviation (n,) of the state from its target, and the target (n + m,) of state and inputs."""
    n = judged.problem.gradient.shape[1]
    steady = judged.model.by_disturbance @ estimate[n:] + judged.model.by_setpoint @ setpoint
    return estimate[:n] - steady[:n], steady


def test_the_target_is_at_rest_and_has_the_set_point():
    judged = law()
    rng = np.random.default_rng(6)
    model = judged.model
    n = judged.problem.gradient.shape[1]
    estimate = rng.normal(size=n + 3)
    setpoint = np.array([0.1])
    _, steady = target_of(judged, estimate, setpoint)
    state = np.concatenate([steady[:n], estimate[n:]])
    assert model.transition @ state + model.input_matrix @ steady[n:] == pytest.approx(
        state, abs=1e-9
    )
    assert (model.output_matrix @ state)[2] == pytest.approx(0.1, abs=1e-10)


def test_the_plan_satisfies_the_optimality_conditions():
    """Stationarity, feasibility and complementarity for 40 random states, many of them with active
    limits.
    """
    judged = law(limits={"angle": (-0.3, 0.3), "left.pressure": (1.5e5, 3.5e5)})
    rng = np.random.default_rng(1)
    count = 0
    n = judged.problem.gradient.shape[1]
    for _ in range(40):
        estimate = rng.normal(scale=0.8, size=n + 3)
        setpoint = 0.3 * rng.normal(size=1)
        error, steady = target_of(judged, estimate, setpoint)
        low = np.full(2, -2.5)
        high = np.full(2, 3.5)
        plan = judged.plan(estimate, setpoint, low, high) - steady[n:]
        matrix, limit = bounds(judged, error, steady, low, high)
        size = plan.size
        z = np.concatenate([plan.ravel(), np.zeros(judged.problem.slacks)])
        excess = (matrix[:, :size] @ z[:size] - limit)[:, None] / np.where(
            matrix[:, size:] < 0, 1.0, np.inf
        )
        excess[(matrix[:, :size] == 0.0).all(axis=1)] = -np.inf
        z[size:] = np.maximum(excess.max(axis=0), 0.0)
        slope = judged.problem.hessian @ z + judged.problem.gradient @ error
        scale = (
            np.abs(judged.problem.hessian) @ np.abs(z)
            + np.abs(judged.problem.gradient @ error)
            + 1e-3
        )
        left = limit - matrix @ z
        sizes = np.abs(matrix) @ np.abs(z) + np.abs(limit)
        assert (left >= -2e-6 * sizes).all()
        active = left <= 2e-6 * sizes
        multipliers = nonnegative_least_squares(matrix[active].T / scale[:, None], -slope / scale)
        count += int(active.sum())
        rest = (slope + matrix[active].T @ multipliers) / scale
        assert np.abs(rest).max() <= 1e-5
    assert count > 100


def nonnegative_least_squares(a, b):
    from scipy.optimize import nnls

    size = np.maximum(np.abs(a).max(axis=0), 1e-300) if a.size else np.ones(a.shape[1])
    return nnls(a / size, b, maxiter=1000)[0] / size if a.shape[1] else np.zeros(0)


def test_a_short_plan_is_that_of_an_exhaustive_search_of_the_active_limits():
    judged = law(horizon=2)
    rng = np.random.default_rng(3)
    n = judged.problem.gradient.shape[1]
    found = 0
    low = np.full(2, -0.2)
    high = np.full(2, 0.1)
    for _ in range(10):
        estimate = np.concatenate([0.3 * rng.normal(size=n), np.zeros(3)])
        error = estimate[:n]
        hessian = judged.problem.hessian
        gradient = judged.problem.gradient @ error
        best = np.inf, None
        for state in itertools.product((None, 0, 1), repeat=4):
            fixed = [i for i, s in enumerate(state) if s is not None]
            free = [i for i, s in enumerate(state) if s is None]
            z = np.array(
                [0.0 if s is None else (low[i % 2], high[i % 2])[s] for i, s in enumerate(state)]
            )
            if free:
                z[free] = np.linalg.solve(
                    hessian[np.ix_(free, free)],
                    -gradient[free] - hessian[np.ix_(free, fixed)] @ z[fixed],
                )
            if (z >= np.tile(low, 2) - 1e-9).all() and (z <= np.tile(high, 2) + 1e-9).all():
                best = min(
                    best, (0.5 * z @ hessian @ z + gradient @ z, z), key=lambda pair: pair[0]
                )
        plan = judged.plan(estimate, np.zeros(1), low, high)
        found += np.isclose(plan, 0.1).any() or np.isclose(plan, -0.2).any()
        assert plan.ravel() == pytest.approx(best[1], abs=1e-6)
    assert found > 5


def test_without_active_limits_the_plan_is_that_of_the_linear_quadratic_regulator():
    judged = law(horizon=7)
    rng = np.random.default_rng(2)
    n = judged.problem.gradient.shape[1]
    a = judged.model.transition[:n, :n]
    b = judged.model.input_matrix[:n]
    weights = np.diag([1.0 if s in GIVEN["permitted"] else 0.0 for s in AT.states])
    gain, _ = regulator("test", a, b, weights, np.eye(2))
    wide = np.full(2, 1e4)
    for _ in range(5):
        estimate = 0.1 * rng.normal(size=n + 3)
        setpoint = np.array([0.05])
        error, steady = target_of(judged, estimate, setpoint)
        plan = judged.plan(estimate, setpoint, -wide, wide)
        assert plan[0] == pytest.approx(steady[n:] - gain @ error, rel=1e-6)


def run(judged, plant=REGULATED, duration=3.0, setpoint=0.25, pressure=2.5e5):
    start = am.find_equilibrium(plant, pressure=pressure)
    loop = ControlLoop(judged, H, am.Schedule({"angle": ((0.0, 0.0), (0.5, setpoint))}))
    return am.simulate(plant, loop, duration=duration, initial_state=start)


def test_the_angle_has_no_offset_with_another_load_and_another_muscle():
    """The weight is 50 % heavier and one muscle has friction-free, stiffer damping; the model does
    not know it.
    """
    other = replace(
        REGULATED, mechanism=replace(REGULATED.mechanism, weight_torque=3.0, damping=0.4)
    )
    record = run(law(limits={"left.pressure": (0.5e5, 4.5e5)}), other)
    assert record["angle"][-1] == pytest.approx(0.25, abs=5e-4)
    assert "called from Python at each sample" in " ".join(record.notes)
    assert "no solution" not in " ".join(record.notes)


def test_a_limit_of_a_column_is_kept_where_the_set_point_would_leave_it():
    free = run(law())
    limited = run(law(limits={"left.pressure": (0.5e5, 3.1e5)}))
    assert free["left.pressure"].max() > 3.2e5
    assert limited["left.pressure"].max() < 3.13e5


def test_a_program_without_solution_applies_the_last_plan_and_is_stated():
    """Hard limits of the angle of +-0.1 rad are impossible while it is 0.4 rad."""
    judged = law(limits={"angle": (-0.1, 0.1)}, slack_weight=float("inf"))
    _, memory = judged.step(judged.init(), measurement(0.0, 0.0), H)
    assert memory.failures == 0
    for _ in range(30):
        command, memory = judged.step(memory, measurement(0.9, 0.05), H)
        assert all(0.0 <= value <= 6e5 for value in command.values())
    assert memory.failures > 0
    assert judged.notes(memory)[0].startswith(
        f"LinearModelPredictive: the quadratic program had no solution at {memory.failures}"
    )


def test_soft_limits_always_have_a_solution():
    judged = law(limits={"angle": (-0.1, 0.1)})
    memory = judged.init()
    for angle in (0.05, 0.9, -0.9, 0.5):
        _, memory = judged.step(memory, measurement(angle, 0.3), H)
    assert memory.failures == 0


def test_a_run_is_repeated_to_the_last_bit():
    judged = law(limits={"left.pressure": (0.5e5, 3.1e5)})
    first = run(judged, duration=1.0)
    second = run(judged, duration=1.0)
    assert (first["angle"] == second["angle"]).all()


def test_a_pickled_controller_gives_the_same_command():
    judged = law(limits={"left.pressure": (0.5e5, 3.1e5)})
    command, _ = judged.step(judged.init(), measurement(0.1, 0.3), H)
    assert (
        pickle.loads(pickle.dumps(judged)).step(judged.init(), measurement(0.1, 0.3), H)[0]
        == command
    )


def test_a_continued_run_is_the_undivided_run():
    from airmuscle.engine import Problem, solve

    judged = law(limits={"left.pressure": (0.5e5, 3.1e5)})
    loop = ControlLoop(judged, H, am.Schedule({"angle": ((0.0, 0.0), (0.2, 0.25))}))
    whole = solve(Problem(REGULATED, loop, 0.8, REST))
    part = solve(solve(Problem(REGULATED, loop, 0.4, REST)).continuation(0.4))
    assert part.final_state == whole.final_state


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"controlled": ("angel",)}, "controlled names 'angel'.*Did you mean 'angle'"),
        ({"disturbed": ("angular_speed",)}, "1 states are disturbed and 3 columns measured"),
        ({"horizon": 0}, "horizon is 0; allowed range: 1 to 200"),
        ({"limits": {"angle": (0.1, -0.1)}}, "the limits of 'angle' are 0.1 and -0.1"),
        ({"slack_weight": float("nan")}, "slack_weight is nan; it must be positive"),
        ({"permitted": {"angle": 0.02}}, "permitted has no number for 'left.setpoint'"),
        ({"controlled": MEASURED}, "cannot keep every set point at rest"),
    ],
)
def test_an_impossible_design_is_refused(changes, message):
    with pytest.raises(ParameterError, match=message):
        law(**changes)


# Blocks, rates and bounded disturbances


def test_the_plan_is_that_of_an_independent_solver():
    """DAQP, for random states, with blocks, a hard limit of a column and limits of the rates."""
    daqp = pytest.importorskip("daqp", reason="the package daqp is not installed")
    rates = {"left.setpoint": 2e7, "right.setpoint": 1.5e7}
    judged = law(blocks=(1, 1, 2, 4, 7), limits={"angle": (-0.3, 0.3)}, max_rate=rates)
    problem = judged.problem
    rng = np.random.default_rng(4)
    n = judged.problem.gradient.shape[1]
    found = 0
    assert problem.moves.shape == (30, 10)
    low = np.full(2, -2.5)
    high = np.full(2, 3.5)
    before = np.array([0.3, -0.2])
    size = len(problem.hessian)
    for _ in range(60):
        estimate = rng.normal(scale=0.5, size=n + 3)
        setpoint = 0.3 * rng.normal(size=1)
        error, steady = target_of(judged, estimate, setpoint)
        shift = (judged.model.columns @ steady[:n])[problem.limited] + problem.rows_by_state @ error
        top = np.where(problem.upper, judged.model.upper[problem.limited] - shift, 1e30)
        bottom = np.where(problem.upper, -1e30, judged.model.lower[problem.limited] - shift)
        change = np.eye(10, size) - np.eye(10, size, k=-2)
        first = np.concatenate([before - steady[n:], np.zeros(8)])
        step = np.tile(np.array([2e7, 1.5e7]) * H / 1e5, 5)
        matrix = np.vstack([np.eye(size), problem.rows, change])
        upper = np.concatenate(
            [np.tile(high - steady[n:], 5), np.full(size - 10, 1e30), top, first + step]
        )
        lower = np.concatenate(
            [np.tile(low - steady[n:], 5), np.zeros(size - 10), bottom, first - step]
        )
        z, _, flag, _ = daqp.solve(
            problem.hessian,
            problem.gradient @ error,
            matrix,
            upper,
            lower,
            np.zeros(len(matrix), np.int32),
            primal_tol=1e-10,
        )
        assert flag == 1
        plan = judged.plan(estimate, setpoint, low, high, judged.init()._replace(inputs=before))
        wanted = (problem.moves @ z[:10]).reshape(15, 2) + steady[n:]
        assert plan == pytest.approx(wanted, abs=1e-6 * (1 + np.abs(wanted).max()))
        found += np.isclose(np.abs(plan[0] - before), step[:2]).any()
    assert found > 10


def test_the_commands_keep_the_rates_and_the_planned_blocks_are_constant():
    judged = law(blocks=(1, 2, 3), max_rate={"left.setpoint": 2e6})
    record = run(judged, duration=1.0)
    steps = np.abs(np.diff(record["command.left.setpoint"]))
    assert steps.max() == pytest.approx(2e6 * H, rel=1e-6)
    assert np.abs(np.diff(record["command.right.setpoint"])).max() > 1.5 * 2e6 * H
    plan = judged.plan(
        np.full(len(judged.model.transition), 0.1), np.ones(1), np.full(2, -2.0), np.full(2, 2.0)
    )
    assert (plan[1] == plan[2]).all()
    assert (plan[3:] == plan[3]).all()
    assert (plan[0] != plan[1]).any()


def disturbed_angles(judged, size):
    """Greatest angle of the model of a design under random disturbances of the angular speed at
    their bounds [rad].
    """
    n = judged.problem.gradient.shape[1]
    rng = np.random.default_rng(8)
    model = judged.model
    state = np.zeros(judged.problem.gradient.shape[1])
    memory = judged.init()
    angles = []
    scale = 0.02
    for k in range(400):
        estimate = np.concatenate([state, np.zeros(3)])
        plan = judged.plan(estimate, np.array([0.3]), np.full(2, -2.5), np.full(2, 3.5), memory)
        assert plan is not None
        # the worst disturbances for the limit are those of one sign
        push = size * (1.0 if k // 40 % 2 else rng.choice([-1.0, 1.0]))
        state = model.transition[:n, :n] @ state + model.input_matrix[:n] @ plan[0]
        state = state + model.transition[:n, -1] * push
        angles.append(state[AT.states.index("angle")] * scale)
    return max(angles)


def test_limits_hold_for_bounded_disturbances_where_the_design_knows_them():
    """The angle is led to its hard limit of 0.2 rad, and the angular speed is disturbed by up to 20
    rad/s2.
    """
    limits = {"limits": {"angle": (-0.5, 0.2)}, "slack_weight": float("inf"), "horizon": 15}
    assert disturbed_angles(law(**limits, bounded={"angular_speed": 20.0}), 20.0) <= 0.2 + 1e-9
    free = law(**{**limits, "slack_weight": 1e6})
    calm = disturbed_angles(free, 0.0)
    moved = disturbed_angles(free, 20.0)
    assert calm <= 0.2025
    assert moved > calm + 1e-3, (calm, moved)


def test_bounded_disturbances_that_leave_no_room_are_refused():
    with pytest.raises(
        ParameterError, match=r"move 'angle' by 0\.\d+ within the horizon, which leaves no room"
    ):
        law(limits={"angle": (-0.1, 0.1)}, bounded={"angular_speed": 500.0})
    with pytest.raises(ParameterError, match="max_rate names 'left'"):
        law(max_rate={"left": 1.0})


# Margins, while no limit acts


def feedback_with_disturbances():
    """The state feedback of the same weights, with the same observer of disturbances."""
    return design_lqg(AT, H, **GIVEN)


def test_margins_of_predictive_control_are_those_of_its_state_feedback():
    """The linear law while no limit acts, against the law that is linearised by its slopes.

    Opened at the angle: of the two pressures, which one set point leaves free, both designs choose
    the smallest in other units.
    """
    setpoint = Schedule({"angle": ((0.0, 0.0),)})
    inputs = {"left.setpoint": SETPOINT, "right.setpoint": SETPOINT}
    predictive, feedback = (
        linearise_loop(REGULATED, ControlLoop(controller, H, setpoint), {**REST}, inputs)
        for controller in (law(), feedback_with_disturbances())
    )
    assert predictive.is_stable
    assert np.abs(predictive.poles).max() == pytest.approx(np.abs(feedback.poles).max(), rel=1e-6)
    ours, theirs = (loop.margins("angle") for loop in (predictive, feedback))
    assert 1.0 < ours.gain < 3.0
    assert dataclasses.astuple(ours) == pytest.approx(dataclasses.astuple(theirs), rel=1e-5)


def test_the_linear_law_is_what_predictive_control_commands_without_an_active_limit():
    """Sample by sample, from any readings that reach no limit."""
    judged = law()
    linear = judged.linear_law()
    rng = np.random.default_rng(4)
    memory = judged.init()
    state = np.zeros(len(linear.memory))
    operating = judged.model.measured
    for _ in range(20):
        reading = operating + rng.normal(size=3) * [100.0, 100.0, 1e-4]
        wanted = 1e-4 * rng.normal()
        pressures = tuple(reading[:2])
        told, memory = judged.step(memory, measurement(reading[2], wanted, -1e9, 1e9, pressures), H)
        deviation = reading - operating
        point = np.array([wanted]) - judged.model.controlled
        expected = linear.C @ state + linear.D @ deviation + linear.F @ point
        state = linear.A @ state + linear.B @ deviation + linear.E @ point
        commands = np.array(list(told.values())) - SETPOINT
        assert commands == pytest.approx(expected, abs=1e-9 * SETPOINT)


def test_where_a_limit_acts_predictive_control_is_not_linearised():
    """A run that ends with the command at its limit; without its memory the linear law is."""
    wide = Schedule({"angle": ((0.0, 20.0),)})
    loop = ControlLoop(law(), H, wide)
    solution = solve(Problem(REGULATED, loop, 0.05, REST))
    inputs = {"left.setpoint": SETPOINT, "right.setpoint": SETPOINT}
    assert np.any(solution.control_state.controller.active)
    with pytest.raises(ParameterError, match="limits of LinearModelPredictive act") as refusal:
        linearise_loop(REGULATED, loop, {**REST}, inputs, control_state=solution.control_state)
    assert "or none" in str(refusal.value)
    assert linearise_loop(REGULATED, loop, {**REST}, inputs).is_stable
