"""A control loop at a working point is linear: its open loop, poles and margins are those of
python-control.

L(z) = C(z) z^-d (1 - a) z/(z - a) Z{G(s) (1 - exp(-s h))/s},   a = exp(-h/T): PID C, delay d and
    lag T of the sensor.
"""

from __future__ import annotations

import dataclasses

import control
import numpy as np
import pytest
from joints import chosen_muscle
from scipy.optimize import brentq

from airmuscle.control import PID, Cascade, OnOffController, linearise_loop
from airmuscle.engine import (
    ColumnSensor,
    ControlLoop,
    Problem,
    Rodas4,
    Schedule,
    SplitRange,
    WithSensors,
    simulate,
    solve,
)
from airmuscle.errors import ParameterError
from airmuscle.physics import (
    FillDischarge,
    HangingMass,
    Plant,
    Polytropic,
    SpringLoad,
    Supply,
    Valve,
    find_equilibrium,
    linearise,
)

VALVE = Valve(2.6e-9, 0.433)
EDGES = FillDischarge(Supply(6e5), VALVE, VALVE)
PLANT = Plant(chosen_muscle(), EDGES, SpringLoad(5.0, 2e3, 10.0, 40.0), Polytropic(1.2))
LIFT = Plant(chosen_muscle(), EDGES, HangingMass(10.0), Polytropic(1.2))
BLEED = Schedule({"discharge": ((0, 0.2),)})
H = 5e-3
LAG = 8e-3
DELAY = 2
GAINS = {"gain": 20.0, "integral_time": 0.2, "derivative_time": 0.02}


def rest(pressure=3e5):
    """An equilibrium with air flowing through: neither valve is at its kink."""
    state = find_equilibrium(PLANT, pressure=pressure)
    flows = [flow_of(PLANT, state, fill, discharge) for fill, discharge in ((0.0, 0.2), (1.0, 0.0))]
    return state, {"fill": -flows[0] / flows[1], "discharge": 0.2}


def flow_of(plant, state, fill, discharge):
    return plant.outputs(state, {"fill": fill, "discharge": discharge})["mass_flow"]


def loop_of(law, state):
    sensed = WithSensors(
        law, (ColumnSensor("position", resolution=1e-5, noise=1e-6, lag=LAG, delay=DELAY),)
    )
    return ControlLoop(sensed, H, Schedule({"position": ((0, state["position"]),)}), BLEED)


def our_loop(**changes):
    state, inputs = rest()
    return linearise_loop(
        PLANT, loop_of(PID("position", "fill", **{**GAINS, **changes}), state), state, inputs
    )


def theirs(gain, integral_time, derivative_time, filter_gain=10.0):
    """The open loop by transfer functions of python-control."""
    state, inputs = rest()
    plant = linearise(PLANT, state, inputs).select(["fill"], ["position"]).to_control()
    z = control.tf([1, 0], [1], H)
    a = np.exp(-H / LAG)
    pole = derivative_time / (derivative_time + filter_gain * H)
    pid = gain * (1 + H / integral_time / (z - 1) + filter_gain * pole * (z - 1) / (z - pole))
    sensor = (1 - a) * z / (z - a) / z**DELAY
    return control.ss(pid) * control.ss(sensor) * control.c2d(plant, H, "zoh")


def test_the_open_loop_and_the_poles_are_those_of_python_control():
    ours = our_loop()
    reference = theirs(**GAINS)
    f = np.geomspace(0.01, 100.0, 50)
    expected = reference(np.exp(2j * np.pi * f * H))
    assert ours.open_loop().frequency_response(f)[:, 0, 0] == pytest.approx(expected, rel=1e-9)
    poles = ours.poles
    others = control.feedback(reference, 1).poles()
    assert max(np.abs(others - p).min() for p in poles if abs(p) > 0.05) < 1e-7


def test_margins_are_those_of_python_control():
    ours = our_loop().margins()
    reference = theirs(**GAINS)
    gain, phase, _, gain_at, phase_at, _ = control.stability_margins(reference)
    # to the digits of its polynomials, then to rounding by its own response
    assert (ours.gain, ours.gain_frequency) == pytest.approx((gain, gain_at / 2 / np.pi), rel=1e-5)
    assert (np.degrees(ours.phase), ours.phase_frequency) == pytest.approx(
        (phase, phase_at / 2 / np.pi), rel=1e-5
    )

    def at(f):
        return complex(reference(np.exp(2j * np.pi * f * H)))

    turned = brentq(
        lambda f: at(f).imag, 0.99 * ours.gain_frequency, 1.01 * ours.gain_frequency, xtol=1e-13
    )
    crossed = brentq(
        lambda f: abs(at(f)) - 1,
        0.99 * ours.phase_frequency,
        1.01 * ours.phase_frequency,
        xtol=1e-13,
    )
    angle = np.angle(-at(crossed))
    assert (ours.gain, ours.gain_frequency) == pytest.approx(
        (1 / abs(at(turned)), turned), rel=1e-9
    )
    assert (ours.phase, ours.phase_frequency) == pytest.approx((abs(angle), crossed), rel=1e-9)
    assert ours.delay == pytest.approx(angle / (2 * np.pi * crossed), rel=1e-9)
    sensitivity = control.feedback(1, reference)
    f = np.linspace(0.9, 1.1, 2001) * ours.peak_frequency
    assert ours.peak == pytest.approx(
        np.abs(sensitivity(np.exp(2j * np.pi * f * H))).max(), rel=1e-6
    )
    assert ours.peak >= np.abs(
        sensitivity(np.exp(2j * np.pi * np.geomspace(0.01, 100, 3000) * H))
    ).max() * (1 - 1e-12)


def test_margins_do_not_depend_on_how_the_grid_is_scanned(monkeypatch):
    """Back substitution finds the brackets that a linear solution at each frequency finds, from a
    slow pole on.
    """
    loops = [our_loop(), our_loop(integral_time=5.0, derivative_time=0.0), our_loop(gain=60.0)]
    found = [loop.margins() for loop in loops]
    monkeypatch.setattr(
        "airmuscle.control.laws.linear_loop._scanned",
        lambda model, f: model.frequency_response(f)[:, 0, 0],
    )
    for loop, ours in zip(loops, found, strict=True):
        assert dataclasses.astuple(ours) == pytest.approx(
            dataclasses.astuple(loop.margins()), rel=1e-9, nan_ok=True
        )


def test_the_chapter_of_margins_has_them_in_si_units_with_their_frequencies():
    found = our_loop().margins()
    stated = {each.name: each for each in found.chapter().values}
    assert [each.value for each in stated.values()] == [
        found.gain,
        found.phase,
        found.delay,
        found.peak,
    ]
    assert stated["phase margin"].remark == f"at {found.phase_frequency:.4g} Hz"
    without = dataclasses.replace(found, gain=np.inf, gain_frequency=np.nan)
    assert without.chapter().values[0].remark == ""


def test_a_loop_is_stable_up_to_its_margins():
    """A gain raised by the gain margin, and a delay by the delay margin, put a pole on the unit
    circle.
    """
    margins = our_loop().margins()
    for factor, stable in ((0.9999, True), (1.0001, False)):
        assert our_loop(gain=GAINS["gain"] * margins.gain * factor).is_stable is stable
    state, inputs = rest()
    loop = loop_of(PID("position", "fill", **GAINS), state)
    # the law of a longer dead time is that of the continuous delay but for its part of a sample
    for factor, stable in ((0.99, True), (1.01, False)):
        assert (
            linearise_loop(PLANT, loop, state, inputs, delay=factor * margins.delay).is_stable
            is stable
        )


def test_the_simulated_loop_has_the_stability_limit_of_the_margins():
    state, inputs = rest()
    limit = GAINS["gain"] * our_loop().margins().gain
    growth = []
    for factor in (0.995, 1.005):
        law = PID(
            "position", "fill", **{**GAINS, "gain": factor * limit}, initial_output=inputs["fill"]
        )
        sensed = WithSensors(law, (ColumnSensor("position", lag=LAG, delay=DELAY),))
        moved = Schedule({"position": ((0, state["position"]), (0.05, state["position"] + 1e-8))})
        loop = ControlLoop(sensed, H, moved, BLEED)
        run = simulate(PLANT, loop, duration=12.0, initial_state=state, integrator=Rodas4(1e-10))
        swing = np.abs(run["position"] - state["position"] - 1e-8)
        early, late = (swing[(run["time"] > t) & (run["time"] < t + 2)].max() for t in (5.0, 10.0))
        growth.append(late / early)
    assert growth[0] < 0.97
    assert growth[1] > 1.03


def test_the_response_to_a_small_step_is_that_of_the_simulated_loop():
    state, inputs = rest()
    law = PID("position", "fill", **GAINS, initial_output=inputs["fill"])
    sensed = WithSensors(law, (ColumnSensor("position", lag=LAG, delay=DELAY),))
    size = 1e-6
    moved = Schedule({"position": ((0, state["position"]), (H, state["position"] + size))})
    loop = ControlLoop(sensed, H, moved, BLEED)
    run = simulate(
        PLANT, loop, duration=1.0, initial_state=state, output_times=H, integrator=Rodas4(1e-11)
    )
    linear = linearise_loop(PLANT, loop, state, inputs).step_response("position", 1.0 - H, size)
    assert run["position"][1:] - state["position"] == pytest.approx(
        linear["position"], abs=2e-3 * size
    )


def cascade(memory_of_a_run=True):
    state = find_equilibrium(LIFT, pressure=2e5)
    inner = PID("pressure", SplitRange("fill", "discharge"), 1e-5)
    law = Cascade(
        PID("position", "pressure", 2e6, integral_time=0.5, initial_output=2e5),
        inner,
        (0.0,),
        (5e5,),
    )
    loop = ControlLoop(law, H, Schedule({"position": ((0, state["position"]),)}))
    end = solve(Problem(LIFT, loop, duration=0.5, initial_state=state))
    return loop, end


def test_each_loop_of_a_cascade_is_opened_at_its_column_and_a_side_is_chosen_by_the_inputs():
    loop, end = cascade()
    sides = [
        linearise_loop(LIFT, loop, end.final_state, inputs, control_state=end.control_state)
        for inputs in ({"fill": 0.01, "discharge": 0.0}, {"fill": 0.0, "discharge": 0.01})
    ]
    for side in sides:
        assert side.margins("position").gain_frequency < side.margins("pressure").gain_frequency
    fast, slow = (
        abs(side.open_loop("pressure").frequency_response(80.0)[0, 0, 0]) for side in sides
    )
    flows = [
        abs(flow_of(LIFT, end.final_state, *openings)) for openings in ((0.01, 0.0), (0.0, 0.01))
    ]
    # above the dynamics of the load the loop gain is the flow of the valve
    assert fast / slow == pytest.approx(flows[0] / flows[1], rel=0.02)


def test_a_working_point_at_a_kink_is_refused():
    loop, end = cascade()
    with pytest.raises(ParameterError, match="differ on both sides of this working point"):
        linearise_loop(
            LIFT,
            loop,
            end.final_state,
            {"fill": 0.0, "discharge": 0.0},
            control_state=end.control_state,
        )


@pytest.mark.parametrize(
    ("make", "text"),
    [
        (
            lambda s, u: linearise_loop(
                PLANT, loop_of(PID("position", "fill", 1e6), s), s, {"fill": 9.0}
            ),
            "fill",
        ),
        (
            lambda s, u: our_loop().open_loop("angle"),
            "the law does not measure 'angle'; it measures position",
        ),
        (
            lambda s, u: our_loop().step_response("angle", 1.0),
            "no set point 'angle'; there are position",
        ),
        (lambda s, u: our_loop(gain=1e5).margins(), "the closed loop is not stable"),
        (
            lambda s, u: our_loop(gain=1e-15).margins(),
            "opened at 'position' has no gain at this working point",
        ),
        (lambda s, u: our_loop(gain=1e-15).bode(), "is a valve that is closed"),
        (lambda s, u: linearise(PLANT, s, u).with_delay(-1.0), "must be finite and not negative"),
        (lambda s, u: linearise(PLANT, s, u).with_delay({"x": 1.0}), "no input 'x'"),
        (lambda s, u: linearise(PLANT, s, u).pade(11), "allowed range: 1 to 10"),
        (lambda s, u: linearise(PLANT, s, u).sampled(0.0), "must be positive and finite"),
        (lambda s, u: linearise(PLANT, s, u).bode([1.0]), "Choose them with model.select"),
    ],
)
def test_errors_say_what_is_wrong(make, text):
    with pytest.raises(ParameterError, match=text):
        make(*rest())


def small():
    state, inputs = rest()
    return linearise(PLANT, state, inputs).select(["fill"], ["position"])


@pytest.mark.parametrize("delay", [0.0, 3e-3, 10e-3, 23.7e-3])
def test_a_sampled_model_with_a_delay_is_the_plant_fed_late(delay):
    """A held input of every sample acts after the delay: the exact response by pieces of the matrix
    exponential.
    """
    from scipy.linalg import expm

    model, random = small(), np.random.default_rng(1)
    inputs = random.normal(size=40) * 1e4
    edges = np.unique(np.concatenate([np.arange(41) * H, np.arange(41) * H + delay]).round(9))
    state = np.zeros(len(model.states))
    expected = []
    for begin, end in zip(edges, np.append(edges[1:], edges[-1]), strict=True):
        k = round(begin / H)
        if abs(begin - k * H) < 1e-12 and k < 40:
            expected.append(float(model.C[0] @ state))
        before = int(np.floor((begin - delay) / H + 1e-9))
        u = inputs[before] if 0 <= before < 40 else 0.0
        n = len(state)
        moved = expm(np.block([[model.A, model.B * u], [np.zeros((1, n + 1))]]) * (end - begin))
        state = (moved @ np.append(state, 1.0))[:n]
    found = model.with_delay(delay).sampled(H).response(inputs[:, None])[:, 0]
    assert found == pytest.approx(np.array(expected), rel=1e-9, abs=1e-12)


def test_a_delay_is_exact_in_the_frequency_response_and_pade_in_state_space():
    model, f, delay = small(), np.geomspace(0.05, 5.0, 20), 0.02
    late = model.with_delay(0.5 * delay).with_delay({"fill": 0.5 * delay})
    exact = model.frequency_response(f)[:, 0, 0] * np.exp(-2j * np.pi * f * delay)
    assert late.frequency_response(f)[:, 0, 0] == pytest.approx(exact, rel=1e-12)
    for order in (1, 3, 5):
        # Baker and Graves-Morris: error (pf)^(2 n + 1) (n!)^2/((2 n)! (2 n + 1)!) of the phase
        num, den = control.pade(delay, order)
        reference = model.to_control() * control.tf(num, den)
        assert late.pade(order).frequency_response(f)[:, 0, 0] == pytest.approx(
            reference(2j * np.pi * f), rel=1e-9
        )
    found = late.to_control(pade=5)
    assert found(2j * np.pi * f) == pytest.approx(exact, rel=1e-6)
    assert late.to_scipy(pade=5).freqresp(2 * np.pi * f)[1] == pytest.approx(exact, rel=1e-6)


def test_to_control_with_a_sample_time_is_the_conversion_of_python_control():
    model = small()
    ours = model.to_control(H)
    reference = control.c2d(model.to_control(), H, "zoh")
    z = np.exp(2j * np.pi * np.geomspace(0.01, 99.0, 30) * H)
    assert (ours.dt, ours.input_labels) == (H, ["fill"])
    assert ours(z) == pytest.approx(reference(z), rel=1e-9)


def test_figures_show_the_open_loop(tmp_path):
    loop = our_loop()
    gain, phase = loop.bode().axes[:2]
    f, values = gain.lines[0].get_data()
    magnitude = np.abs(loop.open_loop().frequency_response(f)[:, 0, 0])
    assert 10.0 ** (values / 20.0) == pytest.approx(magnitude, rel=1e-12)
    assert phase.get_xlabel() == "frequency [Hz]"
    circle = loop.nyquist().axes[0].lines[3].get_data()
    assert np.hypot(circle[0] + 1, circle[1]) == pytest.approx(1 / loop.margins().peak, rel=1e-12)
    assert len(small().bode([1.0, 2.0]).axes) == 2


def vertical_ends(axes, frequency: float) -> list[np.ndarray]:
    """The ends of the lines of an axes that stand at a frequency and span a part of its height."""
    return [
        line.get_ydata()
        for line in axes.lines
        if len(line.get_xdata()) == 2 and np.ptp(line.get_xdata()) == 0.0
        if line.get_xdata()[0] == frequency and line.get_marker() != "None"
    ]


def test_the_bode_plot_of_a_loop_shows_its_margins_where_the_curves_are():
    loop = our_loop()
    margins = loop.margins()
    gain, phase = loop.bode().axes[:2]
    ((level, reached),) = vertical_ends(gain, margins.gain_frequency)
    there = loop.open_loop().frequency_response([margins.gain_frequency])[0, 0, 0]
    assert level == 0.0
    assert reached == pytest.approx(20.0 * np.log10(abs(there)), rel=1e-9)
    ((level, reached),) = vertical_ends(phase, margins.phase_frequency)
    there = loop.open_loop().frequency_response([margins.phase_frequency])[0, 0, 0]
    assert np.exp(1j * np.radians(level)) == pytest.approx(-1.0, abs=1e-12)
    assert np.exp(1j * np.radians(reached)) == pytest.approx(there, rel=1e-6)
    for axes, critical in ((gain, 0.0), (phase, -180.0)):
        assert any(set(line.get_ydata()) == {critical} for line in axes.lines)
        assert axes.get_ylim()[0] < critical < axes.get_ylim()[1]


def test_the_bode_plot_of_an_unstable_loop_shows_no_margins():
    loop = our_loop(gain=50.0 * GAINS["gain"])
    assert not loop.is_stable
    gain, phase = loop.bode().axes[:2]
    assert not any(
        len(line.get_xdata()) == 2 and line.get_marker() != "None"
        for axes in (gain, phase)
        for line in axes.lines
    )


def test_a_law_that_switches_is_refused():
    state, inputs = rest()
    loop = ControlLoop(
        OnOffController("position", "fill", 1e-3), H, Schedule({"position": ((0, 0.01),)})
    )
    with pytest.raises(
        ParameterError, match="does not command these inputs at this state, but fill"
    ):
        linearise_loop(PLANT, loop, state, inputs)
