"""Each control law is compiled with the plant, and the run equals the one that calls it at each
sample.

What a law achieves at the plant: the feed-forward meets the wanted position of a perfect model, the
joint its angle and stiffness, the state feedback removes a constant disturbance.
"""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from called_controller import Called
from control_plants import CIRCUIT, INVERSE, JOINT, LIFT, PRESSURE, PRESSURES, SPLIT

import airmuscle as am
from airmuscle.control import (
    PID,
    AngleAndStiffness,
    Cascade,
    DeadZoneController,
    GainSchedule,
    SetpointCommand,
    SlidingMode,
    StaticFeedForward,
    StaticInverse,
    SuperTwisting,
    WithFeedForward,
    design_lqg,
)
from airmuscle.core import DiagnosticCode
from airmuscle.engine import (
    ColumnSensor,
    ControlLoop,
    Problem,
    RungeKutta4,
    SampledSignal,
    Schedule,
    SigmaDelta,
    WithSensors,
    simulate_batch,
    solve,
)
from airmuscle.errors import ParameterError
from airmuscle.physics import FillDischarge, HangingMass, Supply, Valve, linearise

WEIGHT = 2.0 * 9.80665
FORWARD = StaticFeedForward(
    StaticInverse(LIFT.muscles[0], max_pressure=5e5),
    "pressure",
    LIFT.muscles[0].geometry.resting_length,
    load=WEIGHT,
)
OUTER = PID("position", "pressure", gain=4e6, integral_time=0.4)
TWO_DEGREES = AngleAndStiffness(
    INVERSE,
    ("left.pressure", "right.pressure"),
    gain=3.0,
    integral_time=0.2,
    speed_gain=0.1,
    speed_column="angular_speed",
)
POSITION = Schedule({"position": ((0.0, 0.004), (0.3, 0.01))})
SINE = SampledSignal(
    {"position": tuple((t, 0.008 + 0.003 * np.sin(6.0 * t)) for t in np.linspace(0.0, 1.0, 101))}
)


def in_cascade(outer):
    return Cascade(outer, PRESSURE, (0.0,), (5e5,))


def lqg():
    start = am.find_equilibrium(LIFT, pressure=2e5)
    model = linearise(LIFT, start, {"fill": 0.05, "discharge": 0.05})
    return design_lqg(
        model,
        0.01,
        measured=("pressure", "position"),
        controlled=("position",),
        permitted={"position": 5e-4, "fill": 0.5, "discharge": 0.5},
        permitted_integral={"position": 1e-4},
        process_noise={"air_mass": 1e-5, "speed": 0.1},
        measurement_noise={"pressure": 500.0, "position": 1e-5},
    )


SENSED = (
    ColumnSensor("position", resolution=5e-5, delay=2, lag=3e-3),
    ColumnSensor("pressure", resolution=100.0, noise=500.0, delay=1),
)
LAWS = {
    "feed-forward": (in_cascade(FORWARD), SINE),
    "feed-forward and feedback": (in_cascade(WithFeedForward(FORWARD, OUTER)), SINE),
    "cascade": (in_cascade(OUTER), POSITION),
    "gain schedule": (
        in_cascade(GainSchedule(OUTER, "gain", "pressure", (0.0, 3e5), (6e6, 2e6))),
        POSITION,
    ),
    "sliding mode": (SlidingMode("position", SPLIT, 1.0, 0.05, 1e-3, 5e-3), POSITION),
    "super-twisting": (SuperTwisting("position", SPLIT, 10.0, 1.0, 0.05, 5e-3), POSITION),
    "dead zone": (
        DeadZoneController("position", SPLIT, 3e-4, lead_time=0.04, filter_time=5e-3),
        POSITION,
    ),
    "sigma-delta": (SigmaDelta(in_cascade(OUTER), 0.05), POSITION),
    "sensors": (WithSensors(in_cascade(OUTER), SENSED, 7.0), POSITION),
    "set point": (SetpointCommand(("fill",), ("position",)), POSITION),
}


def both(plant, loop, duration=1.0, **further):
    """The recordings of a loop that is compiled, and of one whose law is called at each sample."""
    solutions = []
    for controller in (loop.controller, Called(loop.controller)):
        problem = Problem(
            plant, dataclasses.replace(loop, controller=controller), duration, **further
        )
        solutions.append(solve(problem))
    texts = [
        d.text for s in solutions for d in s.diagnostics if d.code == DiagnosticCode.CONTROLLER
    ]
    assert ["compiled" in text for text in texts] == [True, False], texts
    return [s.recording for s in solutions]


def assert_equal(one, other):
    np.testing.assert_array_equal(one["time"], other["time"])
    for name in one:
        scale = max(np.abs(other[name]).max(), 1e-12)
        assert np.abs(one[name] - other[name]).max() <= 1e-6 * scale, name


@pytest.mark.parametrize("name", LAWS)
def test_a_compiled_law_is_the_law_that_is_called(name):
    law, setpoint = LAWS[name]
    loop = ControlLoop(law, 0.01, setpoint)
    assert_equal(*both(LIFT, loop, integrator=RungeKutta4(1e-3), output_times=0.01))


def test_a_compiled_law_of_a_joint_is_the_law_that_is_called():
    law = Cascade(TWO_DEGREES, PRESSURES, (0.2e5,) * 2, (5e5,) * 2)
    wanted = Schedule({"angle": ((0.0, 0.0), (0.2, 0.3)), "stiffness": ((0.0, 6.0), (0.6, 10.0))})
    loop = ControlLoop(law, 0.02, wanted)
    start = am.find_equilibrium(JOINT, pressure=2e5)
    one, other = both(
        JOINT, loop, 0.8, integrator=RungeKutta4(5e-4), output_times=0.02, initial_state=start
    )
    assert_equal(one, other)


def test_angle_and_stiffness_are_both_within_5_per_cent():
    law = Cascade(TWO_DEGREES, PRESSURES, (0.2e5,) * 2, (5e5,) * 2)
    for stiffness in (6.0, 10.0):
        wanted = Schedule({"angle": ((0.0, 0.3),), "stiffness": ((0.0, stiffness),)})
        start = am.find_equilibrium(JOINT, pressure=2e5)
        run = am.simulate(JOINT, ControlLoop(law, 2e-3, wanted), duration=3.0, initial_state=start)
        angle, left, right = (
            float(run[name][-1]) for name in ("angle", "left.pressure", "right.pressure")
        )
        assert angle == pytest.approx(0.3, rel=0.05)
        assert INVERSE.stiffness(left, right, angle) == pytest.approx(stiffness, rel=0.05)


def test_the_feed_forward_of_a_perfect_model_meets_position_and_changed_load():
    forward = dataclasses.replace(FORWARD, load_setpoint="load")
    for mass in (1.0, 4.0):
        plant = dataclasses.replace(LIFT, mechanism=HangingMass(mass))
        wanted = Schedule({"position": ((0.0, 0.01),), "load": ((0.0, mass * 9.80665),)})
        run = am.simulate(plant, ControlLoop(in_cascade(forward), 5e-3, wanted), duration=4.0)
        assert run["position"][-1] == pytest.approx(0.01, rel=2e-3)


def tracking_error(law, plant):
    wanted = SampledSignal(
        {"position": tuple((t, 0.008 + 0.003 * np.sin(6.0 * t)) for t in np.linspace(0, 3, 301))}
    )
    run = am.simulate(plant, ControlLoop(law, 5e-3, wanted), duration=3.0, output_times=5e-3)
    late = run["time"] > 1.0
    return float(np.sqrt(np.mean((run["position"] - run["setpoint.position"])[late] ** 2)))


def test_feed_forward_beside_feedback_tracks_better_than_either_although_the_model_is_wrong():
    """The truth has 20 % more load than the feed-forward assumes."""
    plant = dataclasses.replace(LIFT, mechanism=HangingMass(2.4), circuit=CIRCUIT)
    fast = PID("pressure", SPLIT, gain=1e-4)
    outer = dataclasses.replace(OUTER, integral_time=0.1)
    alone, ahead, both_laws = (
        tracking_error(Cascade(law, fast, (0.0,), (5e5,)), plant)
        for law in (outer, FORWARD, WithFeedForward(FORWARD, outer))
    )
    assert both_laws < 0.5 * min(alone, ahead)


def test_lqg_removes_a_constant_disturbance_and_runs_compiled():
    law = lqg()
    start = am.find_equilibrium(LIFT, pressure=2e5)
    heavier = dataclasses.replace(LIFT, mechanism=HangingMass(2.2))
    loop = ControlLoop(
        law,
        0.01,
        Schedule({"position": ((0.0, start["position"]), (0.2, start["position"] + 5e-4))}),
    )
    one, other = both(
        heavier, loop, 4.0, initial_state=start, integrator=RungeKutta4(1e-3), output_times=0.01
    )
    assert_equal(one, other)
    assert one["position"][-1] == pytest.approx(start["position"] + 5e-4, abs=2e-6)


def test_lqg_gains_are_those_of_python_control():
    control = pytest.importorskip("control")
    law = lqg()
    n = len(law.state_names)
    a = np.reshape(law.transition, (n, n))
    b = np.reshape(law.input_matrix, (n, -1))
    c = np.reshape(law.output_matrix, (-1, n))
    h = 0.01
    wide = np.block([[a, np.zeros((n, 1))], [h * c[1:2], np.eye(1)]])
    weights = np.zeros((n + 1, n + 1))
    weights[law.state_names.index("position")][law.state_names.index("position")] = h / 5e-4**2
    weights[n, n] = h / 1e-4**2
    gain, _, _ = control.dlqr(wide, np.vstack([b, np.zeros((1, 2))]), weights, h * np.eye(2) / 0.25)
    assert law.feedback_gain == pytest.approx(tuple(gain[:, :n].ravel()), rel=1e-4)
    assert law.integral_gain == pytest.approx(tuple(gain[:, n:].ravel()), rel=1e-4)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"permitted": {"fill": 1.0}}, "permitted has no number for 'discharge'"),
        (
            {"measurement_noise": {"position": 1.0}},
            "measurement_noise has no number for 'pressure'",
        ),
        (
            {"process_noise": {"air_mas": 1.0}},
            "process_noise names 'air_mas'.*Did you mean 'air_mass'",
        ),
        ({"permitted_integral": {"position": -1.0}}, "'position' is -1.0; it must be positive"),
        (
            {"permitted_integral": None},
            "give either permitted_integral, for integral action, or disturbed",
        ),
        (
            {"disturbed": ("speed",)},
            "give either permitted_integral, for integral action, or disturbed",
        ),
        (
            {"disturbed": ("sped",), "permitted_integral": None},
            "disturbed names 'sped'.*Did you mean 'speed'",
        ),
        (
            {"disturbed": ("speed",), "permitted_integral": None},
            "process_noise has no number for 'speed.disturbance'",
        ),
        (
            {
                "measured": ("mass_flow", "position"),
                "measurement_noise": {"mass_flow": 1.0, "position": 1.0},
            },
            "'mass_flow' depends on inputs at once",
        ),
    ],
)
def test_an_incomplete_design_is_refused(changes, message):
    model = linearise(
        LIFT, am.find_equilibrium(LIFT, pressure=2e5), {"fill": 0.05, "discharge": 0.05}
    )
    given = {
        "measured": ("pressure", "position"),
        "controlled": ("position",),
        "permitted": {"fill": 1.0, "discharge": 1.0},
        "permitted_integral": {"position": 1.0},
        "process_noise": {"air_mass": 1.0},
        "measurement_noise": {"pressure": 1.0, "position": 1.0},
    }
    with pytest.raises(ParameterError, match=message):
        design_lqg(model, 0.01, **{**given, **changes})


def test_an_observed_disturbance_leaves_no_offset_at_any_set_point():
    """A load that the model does not know, and steps of the set point: the observer replaces
    integral action.
    """
    start = am.find_equilibrium(LIFT, pressure=2e5)
    model = linearise(LIFT, start, {"fill": 0.05, "discharge": 0.05})
    law = design_lqg(
        model,
        0.01,
        measured=("pressure", "position"),
        controlled=("position",),
        disturbed=("speed", "air_mass"),
        permitted={"position": 5e-4, "fill": 0.5, "discharge": 0.5},
        process_noise={
            "air_mass": 1e-5,
            "speed": 0.1,
            "speed.disturbance": 10.0,
            "air_mass.disturbance": 1e-4,
        },
        measurement_noise={"pressure": 500.0, "position": 1e-5},
    )
    assert law.integral_gain == ()
    assert law.state_names[-2:] == ("speed.disturbance", "air_mass.disturbance")
    heavier = dataclasses.replace(
        LIFT, mechanism=dataclasses.replace(LIFT.mechanism, mass=1.1 * LIFT.mechanism.mass)
    )
    y = start["position"]
    aims = Schedule({"position": ((0.0, y), (1.0, y + 1e-3), (3.0, y - 1e-3))})
    run = am.simulate(
        heavier, ControlLoop(law, 0.01, aims), duration=5.0, initial_state=start, output_times=0.01
    )
    for time, aim in ((2.99, y + 1e-3), (4.99, y - 1e-3)):
        assert np.interp(time, run["time"], run["position"]) == pytest.approx(aim, abs=2e-6)


def test_the_seed_of_the_noise_varies_in_a_batch_and_each_row_is_its_own_run():
    law = WithSensors(in_cascade(OUTER), SENSED, 0.0)
    loop = ControlLoop(law, 0.01, POSITION)
    batch = simulate_batch(
        LIFT, {"controller.seed": [0.0, 5.0]}, loop, duration=0.5, output_times=0.01
    )
    alone = am.simulate(
        LIFT,
        dataclasses.replace(loop, controller=dataclasses.replace(law, seed=5.0)),
        duration=0.5,
        output_times=0.01,
    )
    assert np.abs(batch["position"][0] - batch["position"][1]).max() > 1e-7
    assert batch["position"][1, -1] == pytest.approx(alone["position"][-1], rel=1e-9)


def test_at_rest_the_dead_zone_switches_no_valve_and_holds_the_position():
    small = Valve(5e-10, 0.4)
    plant = dataclasses.replace(LIFT, circuit=FillDischarge(Supply(5.5e5), small, small))
    law = DeadZoneController("position", SPLIT, 5e-4, lead_time=0.04, filter_time=5e-3)
    run = am.simulate(
        plant, ControlLoop(law, 5e-3, Schedule({"position": ((0.0, 0.01),)})), duration=3.0
    )
    late = run["time"] > 2.0
    assert not any(np.diff(run[f"command.{valve}"][late]).any() for valve in ("fill", "discharge"))
    assert np.abs(run["position"][late] - 0.01).max() <= 5e-4
