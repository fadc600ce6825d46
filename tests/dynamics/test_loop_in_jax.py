"""A control loop in JAX: its run is that of RungeKutta4, and its derivatives through the samples
are those of `differentiate_loop`."""

from __future__ import annotations

import numpy as np
import pytest
from called_controller import Called
from control_plants import LIFT, PRESSURE

import airmuscle as am
from airmuscle.control import PID, Cascade
from airmuscle.core import tree
from airmuscle.engine import (
    PWM,
    ColumnSensor,
    ControlLoop,
    RungeKutta4,
    SampledSignal,
    Schedule,
    WithSensors,
    differentiate_loop,
    loop_in_jax,
    sensitivity,
    simulate,
    tracking_sensitivity,
)
from airmuscle.errors import AirmuscleError, ParameterError

jax = pytest.importorskip("jax", reason="the package jax is not installed (extra jax)")
jax.config.update("jax_enable_x64", True)
pytestmark = pytest.mark.tool
jnp = jax.numpy
STEP = 1e-3
H = 5e-3
DURATION = 0.3
OUTER = PID("position", "pressure", 4e6, 0.3, 0.02, initial_output=1e5)
LAW = Cascade(OUTER, PRESSURE, (0.0,), (5e5,))
START = am.find_equilibrium(LIFT, pressure=1e5)
LOOP = ControlLoop(
    LAW, H, SampledSignal({"position": ((0.0, START["position"]), (0.2, START["position"] + 5e-3))})
)
GAINS = ("outer.gain", "outer.integral_time", "inner.gain")
PLANT, GIVEN = tree.flatten(LIFT), tree.flatten(LAW)
PLACES = [[leaf.path for leaf in tree.leaves(LAW)].index(name) for name in GAINS]


@pytest.fixture(scope="module")
def function():
    return loop_in_jax(LIFT, LOOP, duration=DURATION, step=STEP, initial_state=START)


@pytest.fixture(scope="module")
def derived():
    """The run with derivatives by the gains and by the mass, of `differentiate_loop`, at the
    sampling instants.
    """
    columns = (*(f"controller.{name}" for name in GAINS), "mechanism.mass")
    extended = differentiate_loop(LIFT, LOOP, columns, (1e5, 0.1, 1e-6, 1.0))
    return simulate(
        extended.system,
        extended.loop,
        duration=DURATION,
        initial_state=extended.initial_state(START),
        integrator=RungeKutta4(STEP),
        output_times=H,
    )


def test_the_run_is_that_of_the_compiled_loop(function, derived):
    found = jax.jit(function)(PLANT, GIVEN)
    assert np.asarray(found["time"]) == pytest.approx(derived["time"], abs=1e-15)
    for name in ("position", "speed", "air_mass"):
        size = np.abs(derived[name]).max()
        assert np.abs(np.asarray(found[name]) - derived[name]).max() <= 1e-10 * size, name
    for name in LAW.inputs:
        assert (
            np.abs(np.asarray(found[f"command.{name}"]) - derived[f"command.{name}"][:-1]).max()
            <= 1e-9
        ), name


def test_the_derivatives_through_the_samples_are_those_of_the_loop(function, derived):
    def varied(gains, mass):
        law = jnp.asarray(GIVEN).at[jnp.asarray(PLACES)].set(gains)
        place = [leaf.path for leaf in tree.leaves(LIFT)].index("mechanism.mass")
        return function(jnp.asarray(PLANT).at[place].set(mass), law)

    at = jnp.asarray(GIVEN)[jnp.asarray(PLACES)], jnp.asarray(LIFT.mechanism.mass)
    by = jax.jit(jax.jacfwd(varied, argnums=(0, 1)))(*at)
    for name in ("position", "speed", "air_mass"):
        for k in range(4):
            exact = derived[sensitivity(name, k)]
            by_gains, by_mass = map(np.asarray, by[name])
            ours = by_gains[:, k] if k < 3 else by_mass
            assert np.abs(exact).max() > 0.0
            assert np.abs(ours - exact).max() <= 1e-8 * np.abs(exact).max(), (name, k)


@pytest.mark.slow
def test_the_gradient_of_the_tracking_error_is_that_of_the_loop(function, derived):
    """In reverse mode, through samples and steps."""
    time = jnp.asarray(derived["time"])
    wanted = jnp.asarray(derived["setpoint.position"])

    def error(law):
        squares = (wanted - function(PLANT, law)["position"]) ** 2
        return jnp.sqrt(jnp.trapezoid(squares, time) / DURATION)

    value, gradient = jax.jit(jax.value_and_grad(error))(jnp.asarray(GIVEN))
    expected = tracking_sensitivity(derived, "position")
    assert float(value) == pytest.approx(expected.error, rel=1e-10)
    assert np.asarray(gradient)[PLACES] == pytest.approx(expected.gradient[:3], rel=1e-8)


def test_many_gains_at_once_are_each_gain(function):
    laws = np.tile(GIVEN, (3, 1))
    laws[:, PLACES[0]] *= [0.8, 1.0, 1.2]
    together = jax.jit(jax.vmap(lambda law: function(PLANT, law)["position"]))(laws)
    each = [np.asarray(jax.jit(function)(PLANT, law)["position"]) for law in laws]
    assert np.asarray(together) == pytest.approx(np.array(each), rel=1e-12)


def test_a_loop_that_cannot_be_differentiated_is_refused():
    def given(loop, step=STEP):
        return loop_in_jax(LIFT, loop, duration=DURATION, step=step, initial_state=START)

    with pytest.raises(
        ParameterError, match="loop_in_jax: Called is no ControlLaw; give a loop of a ControlLaw"
    ):
        given(ControlLoop(Called(LAW), H, LOOP.setpoint))
    with pytest.raises(ParameterError, match="loop_in_jax: the loop has drivers"):
        given(ControlLoop(LAW, H, LOOP.setpoint, drivers={"fill": PWM(200.0)}))
    for step in (0.0, -1e-3, float("nan"), float("inf")):
        with pytest.raises(
            ParameterError, match=r"loop_in_jax: step is .* s; it must be positive and finite"
        ):
            given(LOOP, step)
    single = PID("pressure", "fill", 1e-5)
    beside = Schedule({"discharge": ((0.0, 0.0), (0.0123, 0.1))})
    with pytest.raises(
        ParameterError,
        match="an input that the controller does not command changes between two samples",
    ):
        given(ControlLoop(single, H, Schedule({"pressure": ((0.0, 1e5),)}), beside))


def test_a_sensor_with_delay_and_lag_is_differentiated():
    law = WithSensors(LAW, (ColumnSensor("position", lag=4e-3, delay=2),))
    loop = ControlLoop(law, H, LOOP.setpoint)
    function = loop_in_jax(LIFT, loop, duration=0.1, step=STEP, initial_state=START)
    found = jax.jit(function)(PLANT, tree.flatten(law))
    run = simulate(
        LIFT, loop, duration=0.1, initial_state=START, integrator=RungeKutta4(STEP), output_times=H
    )
    assert np.asarray(found["position"]) == pytest.approx(run["position"], rel=1e-10)


def test_single_precision_is_refused():
    jax.config.update("jax_enable_x64", False)
    try:
        with pytest.raises(
            AirmuscleError, match=r"JAX is in single precision; write jax\.config\.update"
        ):
            loop_in_jax(LIFT, LOOP, duration=DURATION, step=STEP, initial_state=START)
    finally:
        jax.config.update("jax_enable_x64", True)
