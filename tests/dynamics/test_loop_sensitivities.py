"""Sensitivities of control loops: derivatives by gains and plant parameters pass through the
samples.

At a sample, du/dtheta = (dk/dy) dy/dtheta + (dk/dm) dm/dtheta + dk/dtheta for the commands u, and
so on for the memory m; between two samples the variational equation holds with du/dtheta held. With
a fixed step this is the derivative of the run itself, therefore central differences of runs agree
to their own rounding.
"""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from called_controller import Called
from control_plants import JOINT, LIFT, PRESSURE, PRESSURES, SPLIT

import airmuscle as am
from airmuscle.control import (
    PID,
    Cascade,
    GainSchedule,
    SlidingMode,
    StaticFeedForward,
    StaticInverse,
    SuperTwisting,
    WithFeedForward,
)
from airmuscle.core import Input, StateVariable, System, model, parameter, tree
from airmuscle.engine import (
    PWM,
    ColumnSensor,
    ControlLoop,
    LawWithSensitivities,
    Rodas4,
    RungeKutta4,
    SampledSignal,
    Schedule,
    WithSensitivities,
    WithSensors,
    differentiate_loop,
    sensitivity,
    simulate,
    simulate_batch,
    tracking_sensitivity,
)
from airmuscle.errors import ParameterError

OUTER = PID("position", "pressure", 4e6, 0.3, 0.02, initial_output=1e5)
FORWARD = StaticFeedForward(
    StaticInverse(LIFT.muscles[0], max_pressure=5e5),
    "pressure",
    LIFT.muscles[0].geometry.resting_length,
    load=20.0,
)
CASCADE = Cascade(OUTER, PRESSURE, (0.0,), (5e5,))
STEP = Schedule({"position": ((0.0, 0.01), (0.2, 0.02))})
START = am.find_equilibrium(LIFT, pressure=1e5)
FIXED = RungeKutta4(1e-3)
DURATION = 0.6
SMOOTH = {
    "cascade": (CASCADE, "outer.gain"),
    "feed-forward": (
        Cascade(WithFeedForward(FORWARD, OUTER), PRESSURE, (0.0,), (5e5,)),
        "outer.feedback.gain",
    ),
    "gain schedule": (
        Cascade(
            GainSchedule(OUTER, "gain", "pressure", (0.0, 3e5), (6e6, 2e6)),
            PRESSURE,
            (0.0,),
            (5e5,),
        ),
        "outer.scheduled_values[1]",
    ),
    "sliding mode": (SlidingMode("position", SPLIT, 0.8, 0.05, 2e-2, 5e-3), "amplitude"),
    "super-twisting": (SuperTwisting("position", SPLIT, 10.0, 1.0, 0.05, 5e-3), "integral"),
    "sensors": (
        WithSensors(CASCADE, (ColumnSensor("position", lag=5e-3, delay=2),)),
        "law.outer.gain",
    ),
}


@model
class Integrator(System):
    """x' = a u x."""

    a: float = parameter("1/s", "a", "rate", default=0.5)
    inputs = ("u",)

    @property
    def states(self):
        return (StateVariable("x", "1", 1.0),)

    def rates(self, state, inputs):
        return {"x": self.a * inputs["u"] * state["x"]}

    def outputs(self, state, inputs):
        return {"product": inputs["u"] * state["x"]}


@model
class Lag(System):
    """x' = a (u - x) with u between 0 and 1: a small plant, which compiles in no time."""

    a: float = parameter("1/s", "a", "rate", default=5.0)
    inputs = ("u",)

    @property
    def states(self):
        return (StateVariable("x", "1", 1.0),)

    @property
    def input_variables(self):
        return (Input("u", "1", 0.0, 1.0, "command"),)

    def rates(self, state, inputs):
        return {"x": self.a * (inputs["u"] - state["x"])}

    def outputs(self, state, inputs):
        return {"y": self.a * state["x"]}


LAG = Lag()
ZERO = {"x": 0.0}
PI = PID("y", "u", gain=0.3, integral_time=0.5)
PI_LOOP = ControlLoop(PI, 0.02, Schedule({"y": ((0.0, 1.0), (0.3, 6.0))}))


def moved(thing, path, value):
    """A model with another value of one parameter."""
    return tree.with_parameters(
        thing, [value if leaf.path == path else leaf.value for leaf in tree.leaves(thing)]
    )


def value_of(thing, path):
    return next(leaf.value for leaf in tree.leaves(thing) if leaf.path == path)


def run_of(plant, loop, integrator=FIXED, start=START, duration=DURATION):
    return simulate(
        plant,
        loop,
        duration=duration,
        initial_state=start,
        integrator=integrator,
        output_times=loop.sample_time,
    )


def at_paths(plant, loop, path, value):
    """A plant and a loop with another value of a parameter of one of them."""
    if path.startswith("controller."):
        law = moved(loop.controller, path.removeprefix("controller."), value)
        return plant, dataclasses.replace(loop, controller=law)
    return moved(plant, path, value), loop


def present(plant, loop, path):
    of_law = path.startswith("controller.")
    return value_of(loop.controller if of_law else plant, path.removeprefix("controller."))


def difference(plant, loop, path, column, **options):
    """Central difference of a column of a run by one parameter."""
    value = present(plant, loop, path)
    h = 1e-5 * value
    up, down = (
        run_of(*at_paths(plant, loop, path, value + side * h), **options)[column]
        for side in (1, -1)
    )
    return (up - down) / (2 * h)


@pytest.mark.parametrize("name", SMOOTH)
def test_derivatives_of_a_run_are_its_differences_whatever_the_law(name):
    law, gain = SMOOTH[name]
    loop = ControlLoop(law, 0.01, STEP)
    paths = (f"controller.{gain}", "mechanism.mass")
    both = differentiate_loop(LIFT, loop, paths, [present(LIFT, loop, path) for path in paths])
    run = run_of(both.system, both.loop, start=both.initial_state(START))
    alone = run_of(LIFT, loop)
    np.testing.assert_allclose(run["position"], alone["position"], rtol=1e-9)
    for k, path in enumerate(paths):
        expected = difference(LIFT, loop, path, "position")
        size = np.abs(expected).max()
        assert size > 0
        np.testing.assert_allclose(
            run[sensitivity("position", k)] / size, expected / size, atol=2e-6, err_msg=path
        )


@pytest.mark.parametrize("integrator", [FIXED, Rodas4(1e-8)], ids=["fixed step", "implicit"])
def test_the_gradient_of_the_tracking_error_is_its_difference(integrator):
    loop = ControlLoop(CASCADE, 0.01, STEP)
    paths = ("controller.outer.integral_time", "controller.inner.gain", "circuit.fill.conductance")
    values = [present(LIFT, loop, path) for path in paths]
    both = differentiate_loop(LIFT, loop, paths, values)
    run = run_of(both.system, both.loop, integrator, both.initial_state(START))
    found = tracking_sensitivity(run, "position", begin=0.1)

    def error(path, value):
        record = run_of(*at_paths(LIFT, loop, path, value), integrator)
        rows = record["time"] >= 0.1 - 1e-12
        square = (record["setpoint.position"] - record["position"])[rows] ** 2
        time = record["time"][rows]
        return np.sqrt(np.trapezoid(square, time) / (time[-1] - time[0]))

    for k, (path, value) in enumerate(zip(paths, values, strict=True)):
        assert found.error == pytest.approx(error(path, value), rel=1e-6)
        expected = (error(path, value * 1.0001) - error(path, value / 1.0001)) / (
            value * 1.0001 - value / 1.0001
        )
        assert found.gradient[k] == pytest.approx(expected, rel=2e-4), path


def test_commands_have_derivatives_until_they_reach_a_limit():
    both = differentiate_loop(LAG, PI_LOOP, ("controller.gain",), (0.3,))
    run = run_of(both.system, both.loop, start=both.initial_state(ZERO))
    by_gain = run[f"command.{sensitivity('u', 0)}"]
    limited = run["command.u"] == 1.0
    assert limited.any()
    assert not by_gain[limited].any()
    assert by_gain[~limited].any()


def test_a_parameter_of_plant_and_controller_moves_both():
    """A rate of the plant and a gain as one column: the sum of both columns."""
    two = ("controller.gain", "a")
    both = differentiate_loop(LAG, PI_LOOP, (two, *two), (1.0, 1.0, 1.0))
    run = run_of(both.system, both.loop, start=both.initial_state(ZERO))
    joint, *parts = (run[sensitivity("y", k)] for k in range(3))
    np.testing.assert_allclose(joint, parts[0] + parts[1], atol=1e-9 * np.abs(joint).max())
    assert all(np.abs(part).max() > 0 for part in parts)


@pytest.mark.slow  # the derivatives of a joint are compiled
def test_a_joint_has_derivatives():
    law = Cascade(
        PID("angle", "left.pressure", 4e5, 0.2, initial_output=2e5),
        PRESSURES.laws[0],
        (0.2e5,),
        (5e5,),
    )
    loop = ControlLoop(law, 0.01, Schedule({"angle": ((0.0, 0.1),)}))
    start = am.find_equilibrium(JOINT, pressure=2e5)
    damping = next(leaf.path for leaf in tree.leaves(JOINT) if leaf.path.endswith("damper.damping"))
    paths = ("controller.outer.gain", "mechanism.inertia", damping)
    both = differentiate_loop(
        JOINT, loop, paths, [present(JOINT, loop, path) for path in paths], observed=("angle",)
    )
    run = run_of(both.system, both.loop, start=both.initial_state(start), duration=0.3)
    for k, path in enumerate(paths):
        expected = difference(JOINT, loop, path, "angle", start=start, duration=0.3)
        size = np.abs(expected).max()
        np.testing.assert_allclose(
            run[sensitivity("angle", k)] / size, expected / size, atol=2e-6, err_msg=path
        )


def test_a_batch_of_differentiated_loops_varies_gains():
    both = differentiate_loop(LAG, PI_LOOP, ("controller.gain",), (0.3,))
    gains = np.array([0.1, 0.2])
    batch = simulate_batch(
        both.system,
        {"controller.law.gain": gains},
        both.loop,
        duration=DURATION,
        output_times=0.02,
        initial_states=both.initial_state(ZERO),
        integrator=FIXED,
    )
    for row, gain in enumerate(gains):
        other = dataclasses.replace(PI_LOOP, controller=moved(PI, "gain", gain))
        expected = difference(LAG, other, "controller.gain", "y", start=ZERO)
        size = np.abs(expected).max()
        np.testing.assert_allclose(
            batch[sensitivity("y", 0)][row] / size, expected / size, atol=2e-6
        )


@pytest.mark.parametrize(
    "integrator", [Rodas4(1e-10), RungeKutta4(1e-2)], ids=["implicit", "fixed step"]
)
def test_an_input_that_depends_on_a_column_and_moves_has_its_closed_form(integrator):
    """u = theta t at theta = 1: x = exp(a t^2/2), dx/dtheta = a t^2/2 x, d(u x)/dtheta = t x + t
    dx/dtheta.
    """
    system = WithSensitivities(Integrator(), ((),), (1.0,), (), ("u",))
    assert system.inputs == ("u", sensitivity("u", 0))
    ramp = ((0.0, 0.0), (2.0, 2.0))
    start = {"x": 1.0, sensitivity("x", 0): 0.0}
    run = simulate(
        system,
        SampledSignal({"u": ramp, sensitivity("u", 0): ramp}),
        duration=2.0,
        initial_state=start,
        integrator=integrator,
        output_times=0.1,
    )
    t = run["time"]
    x = np.exp(0.25 * t**2)
    np.testing.assert_allclose(run[sensitivity("x", 0)], 0.25 * t**2 * x, atol=2e-8)
    np.testing.assert_allclose(run[sensitivity("product", 0)], (t + 0.25 * t**3) * x, atol=5e-8)


def test_the_law_is_the_same_when_it_is_called():
    both = differentiate_loop(LAG, PI_LOOP, ("controller.gain", "a"), (0.3, 5.0))
    called = dataclasses.replace(both.loop, controller=Called(both.loop.controller))
    one, other = (
        run_of(both.system, loop, start=both.initial_state(ZERO)) for loop in (both.loop, called)
    )
    for name in (sensitivity("y", 0), f"command.{sensitivity('u', 1)}"):
        np.testing.assert_allclose(one[name], other[name], atol=1e-12 * np.abs(one[name]).max())


def test_what_cannot_be_differentiated_is_refused_by_name():
    loop = ControlLoop(CASCADE, 0.01, STEP)
    gain = ("controller.outer.gain",)
    with pytest.raises(
        ParameterError, match=r"the input 'fill' has a driver, .* Give a loop without drivers"
    ):
        differentiate_loop(
            LIFT, dataclasses.replace(loop, drivers={"fill": PWM(50.0)}), gain, (1.0,)
        )
    with pytest.raises(
        ParameterError, match=r"Called is no ControlLaw, its samples have no derivatives"
    ):
        differentiate_loop(
            LIFT, dataclasses.replace(loop, controller=Called(CASCADE)), gain, (1.0,)
        )
    with pytest.raises(
        ParameterError, match=r"Cascade has no parameter 'outer.gian'; .*'outer.gain'"
    ):
        differentiate_loop(LIFT, loop, ("controller.outer.gian",), (1.0,))
    with pytest.raises(ParameterError, match=r"Plant has no parameter 'mechanism.mas'"):
        differentiate_loop(LIFT, loop, ("mechanism.mas",), (1.0,))
    with pytest.raises(ParameterError, match=r"1 columns need as many scales"):
        differentiate_loop(LIFT, loop, gain, ())
    with pytest.raises(ParameterError, match=r"0 columns need as many scales"):
        differentiate_loop(LIFT, loop, (), ())
    with pytest.raises(ParameterError, match=r"LawWithSensitivities: there are no columns"):
        LawWithSensitivities(CASCADE, ())
    with pytest.raises(ParameterError, match=r"Plant has no input 'fil'"):
        WithSensitivities(LIFT, ((),), (1.0,), (), ("fil",))


def test_a_recording_without_derivatives_has_no_gradient():
    run = run_of(LAG, PI_LOOP, start=ZERO)
    with pytest.raises(
        ParameterError, match=r"no column 'd y/d 0'; simulate a loop of differentiate_loop"
    ):
        tracking_sensitivity(run, "y")
    with pytest.raises(ParameterError, match=r"no column 'setpoint.x'"):
        tracking_sensitivity(run, "x")


def test_a_gradient_needs_rows():
    both = differentiate_loop(LAG, PI_LOOP, ("controller.gain",), (0.3,))
    run = run_of(both.system, both.loop, start=both.initial_state(ZERO))
    for begin in (DURATION, np.nan, np.inf):
        with pytest.raises(
            ParameterError,
            match=r"begin is .* s; at least two rows must follow, allowed range: 0 to",
        ):
            tracking_sensitivity(run, "y", begin=begin)


def test_what_is_written_into_an_initial_memory_stays_outside_the_law():
    law = differentiate_loop(LAG, PI_LOOP, ("controller.gain",), (0.3,)).loop.controller
    law.initial_memory["integral"] = 5.0
    assert law.initial_memory["integral"] == 0.0
