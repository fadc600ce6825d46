"""Laws with a sampling, delays and limits of their own, and what they do not wind up; rules from
the ultimate point.
"""

from __future__ import annotations

from dataclasses import replace

import control
import numpy as np
import pytest
from control_plants import INVERSE, JOINT, LIFT, PRESSURES, SPLIT

import airmuscle as am
from airmuscle.control import (
    PID,
    AngleAndStiffness,
    Cascade,
    CoContraction,
    LinearLaw,
    LinearLoop,
    Multirate,
    ProportionalFeedback,
    RepetitiveControl,
    SmithPredictor,
    WithCommandDelay,
    WithFilter,
    WithManual,
    WithRateLimit,
    design_adrc,
)
from airmuscle.design import UltimatePoint, tyreus_luyben, ziegler_nichols
from airmuscle.engine import ControlLoop, Measurement, Rodas4, Schedule, SplitRange, simulate
from airmuscle.errors import ParameterError, UnitError
from airmuscle.physics import LinearModel

H = 0.01
INNER = PID("pressure", "fill", 0.02, integral_time=0.3)


def stepped(law, values, setpoint=1.0, further=None, ranges=None):
    """The commands of a law for measured pressures, sample by sample, and its last memory."""
    memory = law.init()
    told = []
    for k, value in enumerate(values):
        setpoints = {"pressure": setpoint, **({} if further is None else further(k))}
        measurement = Measurement({"pressure": value}, setpoints, ranges or {"fill": (-1.0, 1.0)})
        commands, memory = law.step(memory, measurement, H)
        told.append(commands["fill"])
    return np.array(told), memory


def test_a_slower_law_in_a_fast_loop_is_the_loop_with_its_sample_time():
    state = am.find_equilibrium(LIFT, pressure=1e5)
    law = PID("pressure", SPLIT, 5e-6, integral_time=0.4)
    motion = Schedule({"pressure": ((0, 1e5), (0.2, 2e5))})
    runs = [
        simulate(
            LIFT,
            ControlLoop(each, h, motion),
            duration=1.0,
            initial_state=state,
            output_times=0.02,
            integrator=Rodas4(1e-10),
        )
        for each, h in ((law, 0.02), (Multirate(law, 5), 0.004))
    ]
    rows = [np.searchsorted(run["time"], np.arange(50) * 0.02 + 1e-9) - 1 for run in runs]
    for name in ("pressure", "position"):
        first, second = (run[name][at] for run, at in zip(runs, rows, strict=True))
        assert second == pytest.approx(first, rel=1e-6)


def test_two_rates_of_a_cascade_hold_the_outer_command():
    outer = Multirate(PID("position", "pressure", 1e7), 4)
    law = Cascade(outer, PID("pressure", "fill", 1e-6), (0.0,), (5e5,))
    memory = law.init()
    held = []
    for k in range(12):
        columns = {"position": 0.001 * k, "pressure": 0.0}
        _, memory = law.step(
            memory, Measurement(columns, {"position": 0.02}, {"fill": (0.0, 1.0)}), H
        )
        held.append(memory["outer.held.pressure"])
    assert held == pytest.approx(np.repeat([2e5, 1.6e5, 1.2e5], 4))


def test_commands_arrive_later_by_whole_samples_of_the_loop():
    values = np.linspace(0.0, 0.8, 30)
    plain, _ = stepped(INNER, values)
    late, _ = stepped(WithCommandDelay(INNER, 3), values)
    assert late.tolist() == [0.0, 0.0, 0.0, *plain[:-3].tolist()]
    same, _ = stepped(WithCommandDelay(INNER, 0), values)
    assert same.tolist() == plain.tolist()


def test_the_age_of_a_command_is_uniform_and_the_stated_part_is_lost():
    values = np.arange(4000) * 1e-4
    law = PID("pressure", "fill", 1.0)
    plain, _ = stepped(law, values, ranges={"fill": (-9.0, 9.0)})
    late, _ = stepped(WithCommandDelay(law, 2, 3, seed=4), values, ranges={"fill": (-9.0, 9.0)})
    ages = np.round((late - plain)[10:] / 1e-4).astype(int)
    counts = np.bincount(ages, minlength=6) / ages.size
    assert counts[:2].tolist() == [0.0, 0.0]
    assert counts[2:6] == pytest.approx(0.25, abs=0.03)
    lost, _ = stepped(
        WithCommandDelay(law, 0, lost=0.3, seed=5), values, ranges={"fill": (-9.0, 9.0)}
    )
    assert np.mean(np.diff(lost) == 0) == pytest.approx(0.3, abs=0.03)


def test_a_rate_limit_is_kept_and_known_to_the_law():
    """The integral of a law that does not know the limit has run ahead of the command, which then
    turns later.
    """
    law = PID("pressure", "fill", 0.1, integral_time=0.02)
    values = np.where(np.arange(200) < 100, 0.0, 2.0)
    limited, _ = stepped(WithRateLimit(law, (0.5,)), values)
    assert np.abs(np.diff(limited)).max() <= 0.5 * H * (1 + 1e-12)
    assert np.argmax(np.diff(limited) < 0) <= 100
    unknown = stepped(law, values)[0]
    command = [0.0]
    for wanted in unknown:
        command.append(command[-1] + np.clip(wanted - command[-1], -0.5 * H, 0.5 * H))
    assert np.argmax(np.diff(command) < 0) > 100


def test_a_change_from_manual_to_automatic_has_no_bump_and_fades():
    law = PID("pressure", "fill", 0.4)
    by_hand = {"manual.fill": 0.35}
    told, _ = stepped(
        WithManual(law, 0.1),
        np.full(300, 0.7),
        further=lambda k: {**by_hand, "manual": float(k < 150)},
    )
    assert told[:151] == pytest.approx(0.35, abs=1e-15)
    fading = 0.12 + (0.35 - 0.12) * np.exp(-H * np.arange(150) / 0.1)
    assert told[150:] == pytest.approx(fading, rel=1e-12)
    plain, _ = stepped(law, np.full(300, 0.7))
    assert told[-1] == pytest.approx(plain[-1], abs=1e-6)


def test_the_integral_does_not_grow_by_hand():
    """By hand for 20 s with a constant error: the integral is that of the commands, not 20 s of the
    error.
    """
    law = PID("pressure", "fill", 0.4, integral_time=0.1)
    by_hand = {"manual.fill": 0.35, "manual": 1.0}
    _, memory = stepped(WithManual(law), np.full(2000, 0.7), further=lambda k: by_hand)
    assert memory["law.integral"] == pytest.approx(0.35, abs=1e-6)


def returned(law, plant, column, motion, wanted, band, begin, **options):
    """The time after `begin` until a column stays within a band around the wanted value."""
    run = simulate(
        plant, ControlLoop(law, 2e-3, motion), duration=begin + 4.0, output_times=5e-3, **options
    )
    outside = run["time"][np.abs(run[column] - wanted) > band]
    return outside[-1] - begin


def test_the_saturation_of_an_inner_law_reaches_the_outer_one():
    """The supply does not reach the pressure that the outer law asks for; back to what is within
    reach.
    """
    state = am.find_equilibrium(LIFT, pressure=1e5)
    far = state["position"] + 0.08
    near = state["position"] + 0.01
    times = []
    for tracking in (False, True):
        outer = PID("position", "pressure", 5e6, integral_time=0.2, initial_output=1e5)
        law = Cascade(outer, PID("pressure", SPLIT, 5e-5), (0.0,), (12e5,), tracking)
        motion = Schedule({"position": ((0, far), (2.0, near))})
        times.append(returned(law, LIFT, "position", motion, near, 1e-3, 2.0, initial_state=state))
    assert times[1] < 0.7 * times[0]


def test_without_saturation_tracking_changes_nothing():
    state = am.find_equilibrium(LIFT, pressure=1e5)
    motion = Schedule({"position": ((0, state["position"]), (0.1, state["position"] + 2e-4))})
    runs = []
    for tracking in (False, True):
        outer = PID("position", "pressure", 5e5, integral_time=0.5, initial_output=1e5)
        law = Cascade(outer, PID("pressure", SPLIT, 2e-6), (0.0,), (5e5,), tracking)
        runs.append(
            simulate(LIFT, ControlLoop(law, 5e-3, motion), duration=0.5, initial_state=state)[
                "position"
            ]
        )
    assert runs[0].tolist() == runs[1].tolist()


def test_pressures_and_their_difference_that_are_attained_while_valves_are_open():
    """K = 2/bar opens a valve fully at 0.5 bar: from 1 bar the left pressure attains 1.5, the right
    one all of its.
    """
    names = ("left.pressure", "right.pressure")
    inner = ProportionalFeedback(
        names, tuple(SplitRange(f"{n}.fill", f"{n}.vent") for n in ("left", "right")), 2e-5
    )
    wanted = dict(zip(names, (3e5, 1.2e5), strict=True))
    measured = dict.fromkeys(names, 1e5)
    given = Measurement(measured, wanted, dict.fromkeys(inner.inputs, (0.0, 1.0)))
    attained = inner.attained(given, inner.step({}, given, H)[0])
    assert attained == pytest.approx({"left.pressure": 1.5e5, "right.pressure": 1.2e5})
    pair = CoContraction(names, 2.1e5)
    both = Measurement(
        {}, {"difference": 0.9e5}, {name: (value, value) for name, value in attained.items()}
    )
    commands = pair.command(both.setpoints)
    assert commands == pytest.approx(wanted)
    assert pair.attained(both, commands)["difference"] == pytest.approx(0.5 * (1.5e5 - 1.2e5))


def test_an_observer_behind_a_pressure_control_predicts_with_the_attained_difference():
    """Its memory is that of the law which could command no more; without tracking it is that of the
    whole command.
    """
    names = ("left.pressure", "right.pressure")
    law = design_adrc(
        "angle", "difference", H, order=2, gain=2e-3, bandwidth=20.0, observer_bandwidth=60.0
    )
    inner = ProportionalFeedback(
        names, tuple(SplitRange(f"{n}.fill", f"{n}.vent") for n in ("left", "right")), 2e-5
    )
    columns = {"angle": 0.0, **dict.fromkeys(names, 2e5)}
    wanted = {"angle": 0.35}
    memories = []
    for tracking in (True, False):
        outer = Cascade(law, CoContraction(names, 2e5), (-2e5,), (2e5,), tracking)
        whole = Cascade(outer, inner, (0.0, 0.0), (5e5, 5e5), tracking)
        given = Measurement(columns, wanted, dict.fromkeys(whole.inputs, (0.0, 1.0)))
        commands, memory = whole.step(whole.init(), given, H)
        assert commands["left.fill"] == commands["right.vent"] == 1.0
        memories.append(
            [value for name, value in memory.items() if name.startswith("outer.outer.")]
        )
    free, limited = (
        list(
            law.step(law.init(), Measurement(columns, wanted, {"difference": (-end, end)}), H)[
                1
            ].values()
        )
        for end in (2e5, 0.5e5)
    )
    assert memories == [pytest.approx(limited), pytest.approx(free)]
    assert free != pytest.approx(limited, rel=1e-3)


def test_the_integral_of_angle_and_stiffness_stops_where_the_pressures_end():
    """1.5 bar reach 0.91 rad; after 3 s of a set point of 1.3 rad the return takes as long as that
    from 0.6 rad.
    """
    state = am.find_equilibrium(JOINT, pressure=8e4)
    times = []
    inverse = replace(INVERSE, max_pressure=1.5e5)
    law = AngleAndStiffness(
        inverse, ("left.pressure", "right.pressure"), 3.0, 0.2, 0.1, speed_column="angular_speed"
    )
    for far in (0.6, 1.3):
        motion = Schedule({"angle": ((0, far), (3.0, 0.1)), "stiffness": ((0, 7.0),)})
        limited = Cascade(law, PRESSURES, (0.0, 0.0), (1.5e5, 1.5e5))
        times.append(returned(limited, JOINT, "angle", motion, 0.1, 0.02, 3.0, initial_state=state))
    assert times[1] < 1.5 * times[0]


@pytest.mark.parametrize("kind", ["notch", "lead-lag"])
def test_a_filter_is_that_of_python_control(kind):
    """Tustin's rule, prewarped at the notch; it starts in the steady state of the first value."""
    law = PID("pressure", "fill", -1.0)
    w = 2 * np.pi * 7.0
    if kind == "notch":
        filtered = WithFilter.notch(law, "pressure", 7.0, depth=0.2, damping=0.4)
        continuous = control.tf([1 / w**2, 0.2 * 0.8 / w, 1], [1 / w**2, 0.8 / w, 1])
        warp = w
    else:
        filtered = WithFilter.lead_lag(law, "pressure", 0.05, 0.01)
        warp = None
        continuous = control.tf([0.05, 1], [0.01, 1])
    values = 0.3 + np.random.default_rng(2).normal(size=80) * (np.arange(80) > 0)
    told, _ = stepped(filtered, values, setpoint=0.0, ranges={"fill": (-99.0, 99.0)})
    discrete = control.c2d(continuous, H, "tustin", prewarp_frequency=warp)
    _, expected = control.forced_response(discrete, np.arange(80) * H, values - 0.3)
    assert told == pytest.approx(0.3 + expected, rel=1e-9, abs=1e-9)


@pytest.mark.parametrize(
    "given", ["10 ms", np.float32(0.01), np.float64(0.01), np.array(0.01), 0.01]
)
def test_the_sample_time_of_a_loop_is_a_number_of_any_kind_or_a_text(given):
    loop = ControlLoop(INNER, given, Schedule({"pressure": ((0, 1e5),)}))
    assert type(loop.sample_time) is float
    assert loop.sample_time == pytest.approx(0.01, rel=1e-7)


@pytest.mark.parametrize(
    ("make", "text"),
    [
        (
            lambda: WithFilter.notch(INNER, "angle", 1.0),
            "WithFilter: the law does not measure 'angle'",
        ),
        (lambda: WithFilter(INNER, "pressure", (1.0,), (1.0, 0.0)), "give two coefficients each"),
        (lambda: Multirate(INNER, 0), "Multirate: every is 0; allowed range: 1 to 1000"),
        (
            lambda: WithCommandDelay(INNER, -1),
            "samples and jitter are -1 and 0; allowed range: from 0",
        ),
        (
            lambda: WithRateLimit(INNER, (1.0, 2.0)),
            r"2 rates for 1 inputs \(fill\); give one for each",
        ),
    ],
)
def test_impossible_timings_and_limits_are_refused(make, text):
    with pytest.raises(ParameterError, match=text):
        make()


def test_rules_from_the_ultimate_point_are_those_of_the_literature():
    """Astrom and Hagglund (1995), Table 4.2 for 0.6 K_u, T_u/2, T_u/8; Luyben's settings for the
    rest.
    """
    point = UltimatePoint(10.0, 2.0)
    found = [
        (each.gain, each.integral_time, each.derivative_time)
        for rule in (ziegler_nichols, tyreus_luyben)
        for each in (rule(point), rule(point, derivative=False))
    ]
    expected = [
        (6.0, 1.0, 0.25),
        (4.5, 2.0 / 1.2, 0.0),
        (10 / 2.2, 4.4, 2.0 / 6.3),
        (10 / 3.2, 4.4, 0.0),
    ]
    assert found == [pytest.approx(each, rel=1e-12) for each in expected]


def test_a_text_that_is_no_time_is_no_sample_time():
    with pytest.raises(UnitError, match=r"ControlLoop\.sample_time"):
        ControlLoop(INNER, "1 m", Schedule({"pressure": ((0, 1e5),)}))


# Models of a dead time and of a period


def first_order_run(law, setpoints, delay, gain=0.5, time_constant=0.2, loss=None):
    """Columns of a sampled first-order plant with a dead time in samples, under a law of "pressure"
    by "fill".
    """
    kept = np.exp(-H / time_constant)
    memory = law.init()
    x = 0.0
    waiting = [0.0] * delay
    told = []
    for k, setpoint in enumerate(setpoints):
        waiting.append(x + (0.0 if loss is None else loss(k)))
        y = waiting.pop(0)
        told.append(y)
        measurement = Measurement(
            {"pressure": y}, {"pressure": setpoint}, {"fill": (-100.0, 100.0)}
        )
        commands, memory = law.step(memory, measurement, H)
        x = kept * x + (1.0 - kept) * gain * commands["fill"]
    return np.array(told)


def test_a_smith_predictor_gives_the_response_without_dead_time_later():
    """A gain at which the loop without it is unstable."""
    law = PID("pressure", "fill", 15.0, integral_time=0.15)
    wanted = np.ones(300)
    free = first_order_run(law, wanted, 0)
    late = first_order_run(SmithPredictor(law, "pressure", "fill", 12, 0.5, 0.2), wanted, 12)
    assert late[12:] == pytest.approx(free[:-12], abs=1e-12)
    assert late[:12] == pytest.approx(0.0, abs=1e-15)
    assert np.abs(first_order_run(law, wanted, 12)).max() > 10
    assert first_order_run(
        SmithPredictor(law, "pressure", "fill", 12, 0.4, 0.25), np.ones(900), 12
    )[-1] == pytest.approx(1)


PERIOD = 50
WAVE = np.sin(2 * np.pi * np.arange(40 * PERIOD) / PERIOD) + 0.3 * np.cos(
    6 * np.pi * np.arange(40 * PERIOD) / PERIOD
)


def repetitive(**changes):
    given = {
        "period_samples": PERIOD,
        "lead_samples": 3,
        "gain": 0.5,
        "filter_weight": 0.02,
        **changes,
    }
    return RepetitiveControl(PID("pressure", "fill", 3.0, integral_time=0.2), "pressure", **given)


def periodic_errors(law):
    """The greatest error of each period."""
    errors = WAVE - first_order_run(law, WAVE, 2)
    return np.abs(errors).reshape(-1, PERIOD).max(axis=1)


def first_order_loop(law):
    """The loop of `first_order_run` with its dead time of two samples as a LinearLoop."""
    plant = LinearModel(
        np.array([[-1 / 0.2]]),
        np.array([[0.5 / 0.2]]),
        np.eye(1),
        np.zeros((1, 1)),
        ("pressure",),
        ("fill",),
        ("pressure",),
        {},
        {"pressure": 0.0},
        {"fill": 0.0},
        np.zeros(1),
        output_values={"pressure": 0.0},
    )
    h = H
    k = law.gain
    t_i = law.integral_time
    linear = LinearLaw(
        np.eye(1),
        np.array([[-k * h / t_i]]),
        np.array([[k * h / t_i]]),
        np.eye(1),
        np.array([[-k]]),
        np.array([[k]]),
        ("integral",),
        ("pressure",),
        ("pressure",),
        ("fill",),
    )
    return LinearLoop(plant.with_delay(2 * H), (linear,), H)


def test_repetitive_control_leaves_the_error_that_its_filter_leaves():
    """(1 - Q)(1 - T)/(1 - Q (1 - k z^m T)) of the set point at both frequencies, T from the linear
    loop.
    """
    law = repetitive(lead_samples=5, gain=1.0, filter_weight=0.2)
    loop = first_order_loop(law.law)
    assert 0.7 < law.convergence_rate(loop) < 0.9
    wave = np.tile(WAVE, 3)
    errors, plain = ((wave - first_order_run(each, wave, 2))[-PERIOD:] for each in (law, law.law))
    assert np.abs(errors).max() < 0.2 * np.abs(plain).max()
    for k in (1, 3):
        z = np.exp(2j * np.pi * k / PERIOD)
        t = loop.closed.frequency_response([k / (PERIOD * H)])[0, 0, 0]
        q = 1 - 0.4 * (1 - z.real)
        left = (1 - q) * (1 - t) / (1 - q * (1 - z**5 * t))
        assert np.fft.fft(errors)[k] == pytest.approx(left * np.fft.fft(WAVE[:PERIOD])[k], rel=1e-6)


def test_repetitive_control_diverges_where_the_condition_fails_without_the_filter():
    law = repetitive(gain=1.5, lead_samples=0, filter_weight=0.0)
    assert law.convergence_rate(first_order_loop(law.law)) > 1.2
    errors = periodic_errors(law)
    assert errors[-1] > 10 * errors[0]


def test_repetitive_control_is_its_formula():
    """Written down once more with arrays for the signal and the error."""
    law = repetitive(lead_samples=2, gain=0.7, filter_weight=0.1)
    memory = law.init()
    rng = np.random.default_rng(3)
    e = np.zeros(160)
    w = np.zeros(160)
    inner = law.law.init()
    for k in range(160):
        y, r = rng.normal(size=2)
        e[k] = r - y
        past = [
            (
                w[k - n] + 0.7 * e[k - n + 2]
                if k - n >= 0
                else (0.7 * e[k - n + 2] if k - n + 2 >= 0 else 0.0)
            )
            for n in (51, 50, 49)
        ]
        w[k] = 0.1 * past[0] + 0.8 * past[1] + 0.1 * past[2]
        ranges = {"fill": (-1e3, 1e3)}
        commands, memory = law.step(
            memory, Measurement({"pressure": y}, {"pressure": r}, ranges), H
        )
        wanted, inner = law.law.step(
            inner, Measurement({"pressure": y}, {"pressure": r + w[k]}, ranges), H
        )
        assert commands["fill"] == pytest.approx(wanted["fill"], rel=1e-12)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (
            lambda: SmithPredictor(INNER, "position", "fill", 3, 1.0, 0.1),
            "does not measure 'position'; it measures pressure",
        ),
        (
            lambda: SmithPredictor(INNER, "pressure", SPLIT, 3, 1.0, 0.1),
            "has the inputs fill, discharge; the law commands fill",
        ),
        (
            lambda: SmithPredictor(INNER, "pressure", "fill", -1, 1.0, 0.1),
            "samples is -1; allowed range: 0 to 1000",
        ),
        (lambda: RepetitiveControl(INNER, "pressure", 3), "period and lead are 3 and 0 samples"),
        (lambda: RepetitiveControl(INNER, "position", 30), "does not measure 'position'"),
        (
            lambda: repetitive().convergence_rate(
                first_order_loop(replace(repetitive().law, gain=300.0))
            ),
            "is not stable",
        ),
    ],
)
def test_an_impossible_model_of_a_dead_time_or_period_is_refused(make, message):
    with pytest.raises(ParameterError, match=message):
        make()
