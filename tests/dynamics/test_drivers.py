"""A driver turns a command into instants beforehand, and nothing of the command's future is in
them.

OnOff: the plunger follows the coil after the delay of the new direction if the coil still holds it
then, and moves at 1/ramp; a pulse no longer than the opening delay never opens. PWM: each period is
on for the part that the command is at its beginning; the mean differs by at most smallest pulse x
frequency. A run cut anywhere is the run in one.
"""

from __future__ import annotations

import time
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from airmuscle import (
    FillDischarge,
    HangingMass,
    LinearDamper,
    Muscle,
    Plant,
    Rodas4,
    Supply,
    Valve,
    advance,
    load,
    simulate,
)
from airmuscle.engine import (
    PWM,
    PiecewiseLinear,
    SampledSignal,
    Schedule,
    SolenoidDriver,
    WithDrivers,
)
from airmuscle.engine.run.problem import output_times
from airmuscle.errors import ParameterError

INPUTS = ("other", "fill")
TICK = 2.0**-10
"""Times of the properties are multiples of this, so that sums of them are exact."""
END = 400

ticks = st.integers(0, 30)
switchings = st.lists(st.integers(0, END + 20), min_size=1, max_size=40, unique=True).map(sorted)
drivers = st.builds(SolenoidDriver, *[ticks.map(lambda n: n * TICK)] * 4)
modulators = st.builds(
    PWM, st.floats(15.0, 300.0), st.one_of(st.just(0.0), st.floats(0.0, 1e-3))
)  # periods of 3 to 67 ms in a run of 390 ms
signals = st.lists(
    st.tuples(st.integers(0, END), st.floats(0.0, 1.0)),
    min_size=1,
    max_size=12,
    unique_by=lambda p: p[0],
)


def alternating(instants: list[int]) -> Schedule:
    """On at the first instant, off at the second, and so on."""
    return Schedule({"fill": tuple((n * TICK, (i + 1) % 2) for i, n in enumerate(instants))})


def polyline(points: list[tuple[int, float]]) -> SampledSignal:
    return SampledSignal({"fill": tuple((n * TICK, value) for n, value in sorted(points))})


def fill_at(segments: PiecewiseLinear, times: np.ndarray) -> np.ndarray:
    return segments.inputs_at(times, 0.0)[:, 1]


def in_order(segments: PiecewiseLinear, end: float) -> bool:
    return bool(np.all(np.diff(segments.ends, prepend=0.0) > 0) and segments.ends[-1] == end)


# On and off


def by_ticks(driver: SolenoidDriver, instants: list[int]) -> np.ndarray:
    """The opening at every tick, from the law in words: heading changes when the coil has held for
    the whole delay.
    """
    coil = np.array([np.searchsorted(instants, n, side="right") % 2 for n in range(END)])
    delays = [round(driver.closing_delay / TICK), round(driver.opening_delay / TICK)]
    ramps = [round(driver.closing_ramp / TICK), round(driver.opening_ramp / TICK)]
    heading = 0
    opening = 0.0
    found = []
    for n in range(END):
        now = int(coil[n])
        since = coil[max(n - delays[now], 0) : n + 1]
        if (since == now).all() and (now == 0 or n >= delays[now]):
            heading = now
        if ramps[heading] == 0:
            opening = float(heading)
        found.append(opening)
        way = (1 if heading else -1) / max(ramps[heading], 1)
        opening = min(max(opening + way, 0.0), 1.0)
    return np.array(found)


@given(drivers, switchings)
def test_on_off_does_what_its_law_says_tick_by_tick(driver: SolenoidDriver, instants: list[int]):
    course = WithDrivers(alternating(instants), {"fill": driver}).segments(INPUTS, 0.0, END * TICK)
    assert in_order(course, END * TICK)
    assert fill_at(course, np.arange(END) * TICK) == pytest.approx(
        by_ticks(driver, instants), abs=1e-9
    )


def test_pulses_of_the_documentation():
    """5 ms to open and 10 ms of motion, 2 ms to shut and 4 ms of motion: swallowed, in part,
    whole.
    """
    driver = SolenoidDriver(
        opening_delay=5e-3, closing_delay=2e-3, opening_ramp=10e-3, closing_ramp=4e-3
    )

    def peak(length: float) -> float:
        command = Schedule({"fill": ((0.1, 1), (0.1 + length, 0))})
        course = WithDrivers(command, {"fill": driver}).segments(INPUTS, 0.0, 0.3)
        return float(fill_at(course, np.arange(0.0, 0.3, 1e-5)).max())

    assert peak(5e-3 - 1e-9) == 0.0, "no longer than the opening delay: it never opens"
    assert peak(10e-3) == pytest.approx(0.7, abs=2e-3), "in motion for 10 - 5 + 2 ms of 10"
    assert peak(13e-3) == pytest.approx(1.0, abs=1e-12)


def test_a_gap_no_longer_than_the_closing_delay_does_not_shut():
    command = Schedule({"fill": ((0.1, 1), (0.2, 0), (0.202, 1))})
    for delay, least in ((3e-3, 1.0), (1e-3, 0.0)):
        course = WithDrivers(command, {"fill": SolenoidDriver(closing_delay=delay)}).segments(
            INPUTS, 0.0, 0.3
        )
        assert fill_at(course, np.arange(0.15, 0.3, 1e-4)).min() == least


@given(switchings)
def test_without_delay_and_ramp_a_switch_comes_out_as_it_went_in(instants: list[int]):
    command = alternating(instants)
    times = np.arange(0.0, END * TICK, TICK / 2)
    told, done = (
        c.segments(INPUTS, 0.0, END * TICK)
        for c in (command, WithDrivers(command, {"fill": SolenoidDriver()}))
    )
    assert np.array_equal(fill_at(told, times), fill_at(done, times))


@given(signals)
def test_a_coil_switches_where_the_command_crosses_a_half(points: list[tuple[int, float]]):
    signal = polyline(points)
    course = WithDrivers(signal, {"fill": SolenoidDriver()}).segments(INPUTS, 0.0, END * TICK)
    times = np.arange(0.0, END * TICK, TICK / 3)
    told = fill_at(signal.segments(INPUTS, 0.0, END * TICK), times)
    clear = np.abs(told - 0.5) > 1e-9
    assert np.array_equal(fill_at(course, times)[clear], (told > 0.5)[clear])


# Pulses


@given(modulators, signals)
def test_the_mean_of_a_period_is_the_command_at_its_beginning(
    driver: PWM, points: list[tuple[int, float]]
):
    signal = polyline(points)
    period = 1 / driver.frequency
    course = WithDrivers(signal, {"fill": driver}).segments(INPUTS, 0.0, END * TICK)
    assert in_order(course, END * TICK)
    periods = int(END * TICK * driver.frequency * (1 - 1e-12))
    lengths = np.diff(course.ends, prepend=0.0)
    grown = np.append(0.0, np.cumsum(course.values[:, 1] * lengths))
    edges = period * np.arange(periods + 1)
    means = np.diff(np.interp(edges, np.append(0.0, course.ends), grown)) / period
    wanted = fill_at(signal.segments(INPUTS, 0.0, END * TICK), edges[:-1])
    assert (
        np.abs(means - wanted).max(initial=0.0) <= driver.smallest_pulse * driver.frequency + 1e-6
    )
    kept = (wanted * period >= driver.smallest_pulse) & (
        (1 - wanted) * period >= driver.smallest_pulse
    )
    assert means[kept] == pytest.approx(wanted[kept], abs=1e-6), (
        "what needs no change has the mean exactly"
    )


@given(modulators, signals)
def test_no_pulse_and_no_gap_is_shorter_than_the_smallest(
    driver: PWM, points: list[tuple[int, float]]
):
    course = WithDrivers(polyline(points), {"fill": driver}).segments(("fill",), 0.0, END * TICK)
    edges = np.append(0.0, course.ends)[np.flatnonzero(np.diff(course.values[:, 0], prepend=-1.0))]
    assert np.diff(edges).min(initial=1.0) >= driver.smallest_pulse * (1 - 1e-9)


def test_a_duty_ratio_of_none_and_of_all_makes_no_pulses():
    for duty, driver in (
        (0.0, PWM(50.0)),
        (1.0, PWM(50.0)),
        (0.01, PWM(50.0, 1e-3)),
        (0.99, PWM(50.0, 1e-3)),
    ):
        course = WithDrivers(Schedule({"fill": ((0.0, duty),)}), {"fill": driver}).segments(
            ("fill",), 0.0, 1.0
        )
        assert (course.ends.tolist(), course.values.tolist()) == ([1.0], [[round(duty)]])


def test_the_carrier_begins_with_the_run():
    command = WithDrivers(SampledSignal({"fill": ((0.0, 0.25),)}), {"fill": PWM(10.0)})
    course = command.segments(("fill",), 3.21, 0.2)
    assert course.ends - 3.21 == pytest.approx([0.025, 0.1, 0.125, 0.2])
    assert course.values[:, 0].tolist() == [1.0, 0.0, 1.0, 0.0]


# All of them

chains = st.one_of(drivers, modulators, st.tuples(modulators, drivers))


@given(chains, signals, st.lists(st.integers(1, END - 1), unique=True, max_size=8).map(sorted))
def test_a_run_cut_anywhere_is_the_run_in_one(
    chain, points: list[tuple[int, float]], cuts: list[int]
):
    command, edges = (
        WithDrivers(polyline(points), {"fill": chain}),
        np.array([0, *cuts, END]) * TICK,
    )
    memory = command.init(0.0)
    found = []
    times = np.arange(0.5, 4 * END) * TICK / 4  # cuts and corners lie beside them
    for start, end in zip(edges[:-1].tolist(), edges[1:].tolist(), strict=True):
        part, memory = command.step(memory, INPUTS, start, end - start)
        within = times[(times > start) & (times < end)]
        found.append(part.inputs_at(within, start)[:, 1])
    whole, last = command.step(command.init(0.0), INPUTS, 0.0, END * TICK)
    away = np.abs(np.concatenate(found) - fill_at(whole, times))
    near = (
        np.abs(times[:, None] - whole.ends[None, :]).min(axis=1) < 1e-9
    )  # at a jump, rounding may decide
    assert away[~near].max() < 1e-6
    for mine, due in zip(memory["fill"], last["fill"], strict=True):
        assert mine == pytest.approx(due, abs=1e-9)


@given(chains, signals, signals, st.integers(1, END - 1))
def test_what_is_commanded_later_changes_nothing_before(chain, points, others, now: int):
    early = [p for p in points if p[0] <= now] or [(0, 0.3)]
    one, two = (
        [*early, (now, early_value(early)), *((n, v) for n, v in late if n > now)]
        for late in (points, others)
    )
    courses = [
        WithDrivers(polyline(list(dict(p).items())), {"fill": chain}).segments(
            INPUTS, 0.0, END * TICK
        )
        for p in (one, two)
    ]
    times = np.arange(0.0, now * TICK, TICK / 4)
    first, second = (fill_at(course, times) for course in courses)
    assert (
        np.abs(first - second).max() < 1e-14
    )  # rounding where a later command cuts a ramp into pieces


def early_value(points: list[tuple[int, float]]) -> float:
    return sorted(points)[-1][1]


@given(chains, signals)
def test_an_opening_stays_within_shut_and_open(chain, points: list[tuple[int, float]]):
    course = WithDrivers(polyline(points), {"fill": chain}).segments(INPUTS, 0.0, END * TICK)
    assert in_order(course, END * TICK)
    last = course.values + course.slopes * np.diff(course.ends, prepend=0.0)[:, None]
    for values in (course.values, last):
        assert values.min() >= -1e-9
        assert values.max() <= 1 + 1e-9
    assert np.array_equal(course.values[:, 0], np.zeros(course.ends.size)), (
        "the other input does as it is told"
    )


# In a plant


def plant() -> Plant:
    entry = load("dmsp-20-300")
    valve = Valve(conductance=3e-9, critical_ratio=0.3)
    muscle = Muscle(entry.characteristic, entry.geometry, damper=LinearDamper(200.0))
    return Plant(muscle, FillDischarge(Supply(5e5), valve, valve), HangingMass(5.0))


@pytest.mark.filterwarnings("ignore::airmuscle.core.errors.AirmuscleWarning")
def test_ten_thousand_switchings_neither_stall_nor_drift():
    """5000 pulses of either valve: bounded steps, and the pressure of the pulses is that of
    openings held in the mean.
    """
    duties = {"fill": ((0.0, 0.3),), "discharge": ((0.0, 0.4),)}
    coils = SolenoidDriver(opening_delay=1e-3, closing_delay=1e-3)
    command = WithDrivers(SampledSignal(duties), dict.fromkeys(duties, (PWM(100.0), coils)))
    run = simulate(plant(), command, duration=50.0)
    switchings = np.count_nonzero(np.diff(run["fill"])) + np.count_nonzero(
        np.diff(run["discharge"])
    )
    steps = int(run.notes[0].split(": ")[1].split(" steps")[0])
    assert switchings == pytest.approx(20_000, abs=10)
    assert steps < 3 * switchings
    assert all(np.isfinite(run[name]).all() for name in run)
    held = simulate(plant(), Schedule(duties), duration=50.0)
    assert run["pressure"][run["time"] > 45].mean() == pytest.approx(held["pressure"][-1], rel=0.02)


def test_the_cost_of_instants_grows_with_their_number_alone():
    """40 000 instants; anything quadratic would take minutes and 80 GB."""
    began = time.perf_counter()
    switched = Schedule({"fill": tuple((i * 1e-3, i % 2) for i in range(40_000))})
    command = WithDrivers(
        switched, {"fill": SolenoidDriver(opening_delay=1e-4, closing_delay=1e-4)}
    )
    course = command.segments(("fill",), 0.0, 40.0)
    times = output_times(1e-3, 0.0, 40.0, course.ends)
    assert course.ends.size == 40_000
    assert times.size == pytest.approx(80_000, abs=3)
    assert time.perf_counter() - began < 5.0


def test_rows_too_near_an_instant_give_way_to_it():
    instants = np.array([0.1, 0.25, 1.0])
    assert output_times(
        [0.0, 0.1 + 1e-11, 0.2, 0.25 - 1e-11, 0.9], 0.0, 1.0, instants
    ).tolist() == [
        0.0,
        0.1,
        0.2,
        0.25,
        0.9,
        1.0,
    ]
    assert output_times([], 0.0, 1.0, instants).tolist() == instants.tolist()
    assert output_times([0.5, 0.5, 0.0, 0.5, 0.0], 0.0, 1.0, np.array([1.0])).tolist() == [
        0.0,
        0.5,
        1.0,
    ]


# What is wrong is said


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (
            lambda: SolenoidDriver(opening_delay=-1e-3),
            r"SolenoidDriver.opening_delay .* is -0.001 s; allowed range: 0 to 10 s",
        ),
        (
            lambda: SolenoidDriver(closing_ramp=float("nan")),
            r"SolenoidDriver.closing_ramp .* must be finite",
        ),
        (lambda: PWM(0.0), r"PWM.frequency .* is 0 Hz; allowed range: 0.001 to"),
        (
            lambda: PWM(100.0, 6e-3),
            r"PWM.smallest_pulse is 0.006 s, more than half of the carrier's period of 0.01 s",
        ),
        (
            lambda: WithDrivers(Schedule({}), {"fill": 3}),
            r"the driver of 'fill' is 3; write SolenoidDriver\(\.\.\.\), PWM",
        ),
        (
            lambda: WithDrivers(Schedule({}), {"fill": (SolenoidDriver(), "PWM")}),
            r"the driver of 'fill' is 'PWM'; write SolenoidDriver",
        ),
    ],
)
def test_an_impossible_driver_is_refused(make, message: str):
    with pytest.raises(ParameterError, match=message):
        make()


def test_a_driver_refuses_names_and_commands_it_cannot_follow():
    told = SampledSignal({"fill": ((0.0, 0.5), (1.0, 1.5))})
    command = WithDrivers(told, {"fill": PWM(10.0)})
    with pytest.raises(
        ParameterError,
        match=r"the command of the driver of 'fill' is 1.5 before 1 s; allowed range: 0 to 1",
    ):
        command.segments(INPUTS, 0.0, 1.0)
    assert command.segments(INPUTS, 0.0, 0.5).ends.size > 1, "what is not reached is not refused"
    with pytest.raises(
        ParameterError, match=r"no input 'fil'; there are other, fill. Did you mean 'fill'\?"
    ):
        replace(command, drivers={"fil": SolenoidDriver()}).segments(INPUTS, 0.0, 0.5)
    fast = WithDrivers(Schedule({}), {"fill": PWM(1e6)})
    with pytest.raises(
        ParameterError,
        match=r"carrier of 1e\+06 Hz has 1e\+08 periods in 100 s; 10000000 are allowed",
    ):
        fast.segments(INPUTS, 0.0, 100.0)


def test_the_plant_meets_every_instant_of_a_driver():
    """A ramp within a step would be smeared: the opening in the recording is the driver's, at its
    corners too.
    """
    command = WithDrivers(
        Schedule({"fill": ((0.1, 1),)}),
        {"fill": SolenoidDriver(opening_delay=5e-3, opening_ramp=2e-3)},
    )
    run = simulate(plant(), command, duration=0.3, integrator=Rodas4(1e-8), output_times=0.1)
    assert run["time"] == pytest.approx([0.0, 0.1, 0.105, 0.107, 0.2, 0.3])
    assert run["fill"] == pytest.approx([0, 0, 0, 1, 1, 1])
    assert run["pressure"][:3] == pytest.approx(0.0, abs=1e-6), "no air before the plunger moves"
    assert run["pressure"][3] > 10.0


def test_stepping_with_the_memory_of_the_drivers_is_the_whole_run():
    """What is pending when a step ends, a coil that waits for its plunger, goes on in the next."""
    muscle = replace(load("dmsp-20-300").muscle, damper=LinearDamper(200.0))
    valve = Valve(2.6167e-9, 0.433)
    plant = Plant(muscle, FillDischarge(Supply(5e5), valve, valve), HangingMass(10.0))
    command = WithDrivers(
        SampledSignal({"fill": ((0.0, 0.2), (0.3, 0.8))}),
        {"fill": (PWM(40.0), SolenoidDriver(4e-3, 6e-3, 2e-3, 1e-3))},
    )
    state = plant.state_at(pressure=1e5)
    method = Rodas4(1e-10)
    whole = simulate(
        plant, command, duration=0.3, initial_state=state, integrator=method, output_times=0.3
    )
    memory = command.init(0.0)
    dt = 0.3 / 37
    for i in range(37):
        segments, memory = command.step(memory, plant.inputs, i * dt, dt)
        state = advance(plant, state, segments, dt, method, start_time=i * dt)
    for variable in plant.states:
        assert state[variable.name] == pytest.approx(
            whole[variable.name][-1], abs=1e-8 * variable.nominal
        )
    with pytest.raises(
        ParameterError, match=r"segments end at 0\.3 s; they must end with the run, at 0\.1 s"
    ):
        advance(plant, state, segments, 0.1)
