"""Tuning rules give the published settings, and identification recovers the model from its own step
response.

SIMC with a closed-loop time constant equal to the dead time has a gain margin of pi, a phase margin
of 61.4 degrees and a maximum sensitivity of 1.59 on every first-order plant whose integral time is
its time constant (Skogestad 2003).
"""

from __future__ import annotations

import math

import numpy as np
import pytest
from control_plants import LIFT, PRESSURE

import airmuscle as am
from airmuscle.control import OnOffController
from airmuscle.design import (
    FirstOrderDeadTime,
    IntegratorDeadTime,
    LoopCase,
    UltimatePoint,
    amigo_pi,
    amigo_pid,
    first_order_of_step,
    integrator_of_step,
    rule_settings,
    rule_starts,
    simc,
    step_experiment,
    ultimate_point,
)
from airmuscle.engine import ControlLoop, Schedule, SplitRange
from airmuscle.errors import ParameterError

PLANT = FirstOrderDeadTime(gain=2.0, time_constant=10.0, dead_time=1.0)
LEVEL = IntegratorDeadTime(rate=0.5, dead_time=2.0)


def loop_gain(model, settings, frequency):
    """The open-loop frequency response with a PI or an ideal PID controller."""
    s = 1j * frequency
    if isinstance(model, FirstOrderDeadTime):
        plant = model.gain / (model.time_constant * s + 1) * np.exp(-model.dead_time * s)
    else:
        plant = model.rate / s * np.exp(-model.dead_time * s)
    return (
        plant
        * settings.gain
        * (1 + 1 / (settings.integral_time * s) + settings.derivative_time * s)
    )


def maximum_sensitivity(model, settings):
    frequency = np.geomspace(1e-3, 20 / model.dead_time, 200_000)
    return float((1 / np.abs(1 + loop_gain(model, settings, frequency))).max())


def test_simc_settings_are_those_of_the_rule():
    settings = simc(PLANT)
    assert settings.gain == pytest.approx(10 / (2 * 2))
    assert settings.integral_time == pytest.approx(8.0)  # 4 (1 + 1), below the time constant
    slow = simc(PLANT, closed_loop_time=3.0)
    assert (slow.gain, slow.integral_time) == (pytest.approx(1.25), pytest.approx(10.0))
    level = simc(LEVEL)
    assert (level.gain, level.integral_time) == (pytest.approx(0.5), pytest.approx(16.0))


@pytest.mark.parametrize("constant", [0.5, 2.0, 8.0])
def test_simc_has_its_published_margins(constant):
    model = FirstOrderDeadTime(-3.0, constant, 1.0)
    settings = simc(model)
    assert maximum_sensitivity(model, settings) == pytest.approx(1.59, abs=0.005)
    crossover = 0.5
    phase = math.degrees(np.angle(loop_gain(model, settings, crossover)))
    assert abs(loop_gain(model, settings, crossover)) == pytest.approx(1.0)
    assert 180 + phase == pytest.approx(61.4, abs=0.05)
    assert 1 / abs(loop_gain(model, settings, math.pi / 2)) == pytest.approx(math.pi)


def test_amigo_settings_are_those_of_the_rule():
    pi = amigo_pi(PLANT)
    pid = amigo_pid(PLANT)
    assert pi.gain == pytest.approx(0.075 + (0.35 - 10 / 121) * 5)
    assert pi.integral_time == pytest.approx(0.35 + 1300 / 227)
    assert pid.gain == pytest.approx(4.7 / 2)
    assert (pid.integral_time, pid.derivative_time) == (
        pytest.approx(8.4 / 2),
        pytest.approx(5 / 10.3),
    )
    assert (pid.setpoint_weight, amigo_pid(FirstOrderDeadTime(1.0, 1.0, 2.0)).setpoint_weight) == (
        0.0,
        1.0,
    )
    assert (amigo_pi(LEVEL).gain, amigo_pi(LEVEL).integral_time) == (
        pytest.approx(0.35),
        pytest.approx(26.8),
    )
    level = amigo_pid(LEVEL)
    assert (level.gain, level.integral_time, level.derivative_time) == pytest.approx(
        (0.45, 16.0, 1.0)
    )


@pytest.mark.parametrize("ratio", [0.3, 1.0, 3.0, 10.0])
def test_amigo_pi_is_about_as_robust_as_it_was_designed_for(ratio):
    """The rule is an approximation of designs with a maximum sensitivity of 1.4."""
    model = FirstOrderDeadTime(1.0, ratio, 1.0)
    assert 1.15 < maximum_sensitivity(model, amigo_pi(model)) < 1.5


def test_rules_need_a_dead_time():
    ideal = FirstOrderDeadTime(1.0, 1.0, 0.0)
    for rule in (simc, amigo_pi, amigo_pid):
        with pytest.raises(ParameterError, match="dead time"):
            rule(ideal)
    assert simc(ideal, closed_loop_time=0.5).gain == pytest.approx(2.0)
    with pytest.raises(ParameterError, match="must be positive"):
        simc(PLANT, closed_loop_time=-1.0)


def test_a_first_order_step_response_is_recovered():
    time = np.linspace(0.0, 80.0, 4001)
    found = first_order_of_step(time, 5.0 - 3.0 * PLANT.step_response(time), step=-3.0)
    assert found.gain == pytest.approx(2.0, rel=1e-3)
    assert found.time_constant == pytest.approx(10.0, rel=2e-3)
    assert found.dead_time == pytest.approx(1.0, abs=0.02)


@pytest.mark.parametrize("zero", [0.0, 5.0, 1.7e6])
def test_noise_changes_a_recovered_step_response_by_little(zero):
    time = np.linspace(-20.0, 80.0, 5001)
    noise = np.random.default_rng(2).normal(0.0, 0.03, time.size)
    noise[(time >= 0.0) & (time < 0.01)] = (
        0.3  # the row of the step alone is far from the mean of the rows before it
    )
    output = 5.0 - 3.0 * PLANT.step_response(np.maximum(time, 0.0)) + noise
    found = first_order_of_step(time + zero, output, step=-3.0, step_time=zero)
    assert found.gain == pytest.approx(2.0, rel=3e-3)
    assert found.time_constant == pytest.approx(10.0, rel=0.02)
    assert found.dead_time == pytest.approx(1.0, abs=0.1)


def test_a_swing_below_a_level_after_an_overshoot_does_not_delay_the_level():
    time = np.linspace(0.0, 40.0, 2001)
    swinging = 1.0 - np.exp(-0.1 * time) * np.cos(2.0 * time)
    found = first_order_of_step(time, swinging, step=1.0)
    assert found.time_constant + found.dead_time == pytest.approx(
        time[np.argmax(swinging >= 1 - np.exp(-1))], abs=0.02
    )


def test_an_integrating_step_response_is_recovered():
    time = np.linspace(0.0, 20.0, 201)
    found = integrator_of_step(time, 1.0 + 4.0 * LEVEL.step_response(time), step=4.0)
    assert (found.rate, found.dead_time) == (pytest.approx(0.5), pytest.approx(2.0))


def test_the_line_of_an_integrating_step_response_is_that_of_the_second_half_of_the_rows():
    time = np.linspace(0.0, 20.0, 201)
    output = 1.0 + 4.0 * LEVEL.step_response(time) + np.where((time > 0.0) & (time < 9.9), 3.0, 0.0)
    found = integrator_of_step(time, output, step=4.0)
    assert (found.rate, found.dead_time) == (pytest.approx(0.5), pytest.approx(2.0))


def test_the_initial_value_of_an_integrating_step_response_is_the_mean_of_the_rows_until_the_step():
    time = np.linspace(-5.0, 20.0, 251)
    output = 1.0 + 4.0 * LEVEL.step_response(np.maximum(time, 0.0))
    output[time <= 0.0] += np.where(np.arange(51) % 2, 0.5, -0.5)
    output[50] += 0.5  # so that the mean of the 51 rows is 1
    found = integrator_of_step(time, output, step=4.0, step_time=0.0)
    assert (found.rate, found.dead_time) == (pytest.approx(0.5), pytest.approx(2.0))


@pytest.mark.parametrize("step_time", [-1.0, 19.5])
def test_a_step_before_the_first_row_or_near_the_last_is_refused(step_time):
    time = np.linspace(0.0, 20.0, 201)
    with pytest.raises(
        ParameterError, match=rf"the step is at {step_time:g} s; one row or more must be until then"
    ):
        first_order_of_step(time, 1.0 - np.exp(-time), 1.0, step_time=step_time)


def exact_ultimate_point(model):
    low = 1e-6
    high = math.pi / model.dead_time
    for _ in range(200):
        middle = (low + high) / 2
        phase = math.atan(middle * model.time_constant) + middle * model.dead_time
        low, high = (middle, high) if phase < math.pi else (low, middle)
    return UltimatePoint(math.hypot(1, low * model.time_constant) / model.gain, 2 * math.pi / low)


def test_noise_about_the_middle_of_an_oscillation_does_not_shorten_its_period():
    time = 0.01 * np.arange(2000)
    noise = np.random.default_rng(1).normal(0.0, 0.05, time.size)
    assert ultimate_point(
        time, np.sin(2 * np.pi * time) + noise, amplitude=1.0
    ).period == pytest.approx(1.0, rel=5e-3)


@pytest.mark.parametrize("noise", [0.0, 0.05, 0.1])
@pytest.mark.parametrize("hysteresis", [0.0, 0.6])
def test_noise_does_not_enlarge_the_amplitude_of_an_oscillation(noise, hysteresis):
    time = 0.01 * np.arange(2000)
    output = np.sin(2 * np.pi * time) + np.random.default_rng(1).normal(0.0, noise, time.size)
    found = ultimate_point(time, output, amplitude=1.0, hysteresis=hysteresis)
    assert found.gain == pytest.approx(
        4 / math.pi / math.sqrt(1 - hysteresis**2), rel=max(0.3 * noise, 1e-6)
    )


@pytest.mark.parametrize("rows", [7, 20, 80])
def test_the_amplitude_of_a_triangular_oscillation_is_half_its_range(rows):
    time = np.arange(40 * rows + 1) / rows
    triangle = 2 / np.pi * np.arcsin(np.sin(2 * np.pi * time + 0.3))
    assert ultimate_point(time, triangle, amplitude=1.0).gain == pytest.approx(
        4 / math.pi, rel=0.03 if rows > 50 else 0.2
    )


@pytest.mark.parametrize("rows", [60, 200])
@pytest.mark.parametrize("dead_time", [0.1, 0.3, 1.0])
def test_the_amplitude_of_a_relay_oscillation_is_that_of_its_corners(dead_time, rows):
    """First order with gain 2 and T = 1: a = 2 (1 - exp(-L)), half a period L + ln(2 - exp(-L)),
    exponential arcs.
    """
    amplitude = 2 * (1 - math.exp(-dead_time))
    half = dead_time + math.log(2 - math.exp(-dead_time))
    time = 2 * half / (rows + 0.37) * np.arange(20 * rows)
    part, rising = np.modf(time / half + 0.2)
    arc = 2.0 - (2.0 + amplitude) * np.exp(-part * half)
    found = ultimate_point(time, np.where(rising % 2 == 0, arc, -arc), amplitude=1.0)
    assert found.gain == pytest.approx(4 / (math.pi * amplitude), rel=2e-3)
    assert found.period == pytest.approx(2 * half, rel=1e-4)
    exact = exact_ultimate_point(FirstOrderDeadTime(2.0, 1.0, dead_time)).gain
    assert found.gain / exact - 1 == pytest.approx(
        {0.1: -0.182, 0.3: -0.166, 1.0: -0.109}[dead_time], abs=0.004
    )
    assert "-19 % to +27 %" in found.note


def test_a_relay_finds_the_ultimate_point_and_the_model():
    exact = exact_ultimate_point(PLANT)
    model = exact.first_order(PLANT.gain)
    assert (model.time_constant, model.dead_time) == (pytest.approx(10.0), pytest.approx(1.0))
    step = 0.01
    delay = 100
    y = 0.0
    outputs = []
    commands = [0.0] * delay
    for _ in range(8000):
        commands.append(-1.0 if y > 0 else 1.0)
        y += step / PLANT.time_constant * (PLANT.gain * commands[-1 - delay] - y)
        outputs.append(y)
    found = ultimate_point(step * np.arange(8000), outputs, amplitude=1.0)
    assert found.period == pytest.approx(exact.period, rel=0.05)
    assert found.gain == pytest.approx(
        exact.gain, rel=0.25
    )  # the describing function is an approximation


def test_the_relay_experiment_runs_on_a_plant():
    relay = OnOffController("pressure", SplitRange("fill", "discharge"), hysteresis=2e4)
    loop = ControlLoop(relay, 2e-3, Schedule({"pressure": ((0, 2e5),)}))
    start = am.find_equilibrium(LIFT, pressure=2e5)
    run = am.simulate(LIFT, loop, duration=2.0, initial_state=start, output_times=2e-3)
    time, first = np.unique(run["time"], return_index=True)
    point = ultimate_point(time, run["pressure"][first], amplitude=1.0, hysteresis=1e4)
    assert 2 * 2e-3 < point.period < 1.0
    assert point.gain > 0


@pytest.mark.parametrize(
    ("identify", "time", "output", "message"),
    [
        (first_order_of_step, np.arange(5.0), np.arange(5.0), "at least 10 rows"),
        (first_order_of_step, np.zeros(20), np.zeros(20), "rising times"),
        (
            first_order_of_step,
            np.arange(20.0),
            np.arange(20.0),
            "until it settles, or identify an integrator",
        ),
        (first_order_of_step, np.arange(20.0), np.full(20, np.nan), "must be finite"),
        (integrator_of_step, np.arange(20.0), np.zeros(20), "does not move"),
        (ultimate_point, np.arange(20.0), np.zeros(20), "Record for longer"),
    ],
)
def test_an_experiment_without_a_response_is_refused(identify, time, output, message):
    with pytest.raises(ParameterError, match=message):
        identify(time, output, 1.0)


def test_models_and_points_that_do_not_exist_are_refused():
    with pytest.raises(ParameterError, match="time_constant is -1"):
        FirstOrderDeadTime(1.0, -1.0, 0.0)
    with pytest.raises(ParameterError, match="rate is 0"):
        IntegratorDeadTime(0.0, 1.0)
    with pytest.raises(ParameterError, match="must be above 1"):
        UltimatePoint(0.5, 1.0).first_order(1.0)


def test_a_step_experiment_gives_starts_within_the_bounds():
    loop = ControlLoop(PRESSURE, 0.01, Schedule({"pressure": ((0, 2e5),)}))
    case = LoopCase("nominal", LIFT, loop, am.find_equilibrium(LIFT, pressure=1e5))
    experiment = step_experiment(case, duration=3.0)
    rise = experiment.output - experiment.output[0]
    assert np.abs(
        0.2 * experiment.model.step_response(experiment.time) - rise
    ).max() < 0.25 * np.ptp(rise)
    assert experiment.model.dead_time >= 0.005
    starts = rule_starts(
        rule_settings(experiment.model), {"gain": (1e-6, 2e-6), "integral_time": (0.01, 100.0)}
    )
    assert [set(each) for each in starts] == [{"gain", "integral_time"}] * 3
    assert all(1e-6 <= each["gain"] <= 2e-6 for each in starts)
    other = LoopCase(
        "relay", LIFT, ControlLoop(OnOffController("pressure", "fill"), 0.01, loop.setpoint)
    )
    with pytest.raises(ParameterError, match="rules are for a PID alone"):
        step_experiment(other, duration=1.0)
