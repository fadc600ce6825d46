"""Claims about the way from a call to its kernel: what is quick for few numbers gives, to the last
bit, what the way for many gives; what is kept with a plant is checked again where it changes."""

from __future__ import annotations

import warnings

import numpy as np
import pytest
from called_controller import Called
from hypothesis import given
from hypothesis import strategies as st
from joints import chosen_muscle

from airmuscle.control import PID
from airmuscle.core import Input, StateVariable, System, arrays
from airmuscle.engine import (
    PWM,
    ControlLoop,
    Driver,
    InputSignal,
    PiecewiseLinear,
    Problem,
    SampledSignal,
    Schedule,
    advance,
    simulate,
    simulate_batch,
    solve,
)
from airmuscle.engine.compile import compile_system
from airmuscle.engine.compile.cache.kernel import record
from airmuscle.engine.loop import PwmState, merge_columns
from airmuscle.engine.run import problem
from airmuscle.engine.run.problem import merge_output_times
from airmuscle.engine.run.solution import RowRecorder
from airmuscle.errors import AirmuscleWarning, GeometryLimitError, ParameterError
from airmuscle.physics import FillDischarge, HangingMass, Plant, Polytropic, Supply, Valve

TICKS = st.integers(0, 400).map(lambda i: i / 64)


def lifting() -> Plant:
    valve = Valve(5e-9, 0.433)
    return Plant(
        chosen_muscle(),
        FillDischarge(Supply(6e5), valve, valve),
        HangingMass(10.0),
        Polytropic(1.2),
    )


# Rows


@pytest.mark.parametrize("count", [0, 1, 2, 3, 4, 5, 7, 8, 250])
def test_the_range_of_a_column_with_limits_is_its_smallest_and_largest_number(count):
    plant = lifting()
    compiled = compile_system(plant)
    rng = np.random.default_rng(count)
    start = np.array([plant.state_at(pressure=1e5)[s.name] for s in plant.states])
    states = start * (1 + 1e-3 * rng.standard_normal((count, start.size)))
    states[count // 2 :: 90, 1] = np.nan
    times = np.sort(rng.random(count))
    ends = np.array([0.25, 0.5, 1.0])
    segments = PiecewiseLinear(ends, rng.random((3, 2)), rng.standard_normal((3, 2)))
    table = RowRecorder(compiled).evaluate(states, times, segments, 0.0)
    assert np.array_equal(table.inputs, segments.inputs_at(times, 0.0))
    known = compiled.description
    names = (*known.state_names, *known.output_names)
    assert set(known.ranged_names) == {
        "air_mass",
        "volume",
        *(limit.column for limit in plant.column_limits),
    }
    columns = np.hstack([states, table.outputs])[
        :, [names.index(name) for name in known.ranged_names]
    ]
    assert table.lower == np.fmin.reduce(columns, axis=0, initial=np.inf).tolist()
    assert table.upper == np.fmax.reduce(columns, axis=0, initial=-np.inf).tolist()
    unfit = np.flatnonzero(~np.isfinite(table.outputs).all(axis=1))
    assert table.first_invalid == (unfit[0] if unfit.size else count)
    assert bool(unfit.size) == (count > 0)


@pytest.mark.parametrize("value", [np.inf, -np.inf, np.nan])
def test_an_output_that_is_not_finite_is_found_in_its_row(value):
    compiled = compile_system(lifting())
    recorder = RowRecorder(compiled)
    states = np.zeros((9, 3))
    segments = PiecewiseLinear(np.ones(1), np.zeros((1, 2)), np.zeros((1, 2)))
    states[:] = list(lifting().state_at(pressure=1e5).values())
    assert recorder.evaluate(states, np.linspace(0, 1, 9), segments, 0.0).first_invalid == 9
    states[6, 0] = value
    assert recorder.evaluate(states, np.linspace(0, 1, 9), segments, 0.0).first_invalid == 6


def test_a_kept_recorder_gives_what_a_new_one_gives(monkeypatch):
    plant = lifting()
    signal = Schedule({"fill": ((0.1, 1.0), (0.3, 0.0))})
    start = plant.state_at(pressure=1e5)
    bound = []
    bind = record.bind
    monkeypatch.setattr(record, "bind", lambda **given: bound.append(1) or bind(**given))
    long = simulate(plant, signal, duration=1.0, initial_state=start)
    simulate(plant, signal, duration=0.2, initial_state=start, output_times=0.1)
    again = simulate(plant, signal, duration=1.0, initial_state=start)
    assert len(bound) == 1
    fresh = simulate(lifting(), signal, duration=1.0, initial_state=start)
    for other in (again, fresh):
        assert all(np.array_equal(other[name], long[name]) for name in long)


class Lag(System):
    """A state that follows an input of some range."""

    def __init__(self, maximum):
        self.maximum = maximum

    states = (StateVariable("y", "1", 1.0),)
    inputs = ("u",)

    @property
    def input_variables(self):
        return (Input("u", "1", 0.0, self.maximum),)

    def rates(self, state, inputs):
        return {"y": inputs["u"] - state["y"]}

    def outputs(self, state, inputs):
        return {"double": 2.0 * state["y"]}


def test_a_command_that_was_used_before_gives_the_runs_of_a_new_one():
    changes = {"fill": ((0.1, 1.0), (0.3, 0.0))}
    signal = Schedule(changes)
    plant = lifting()
    start = lifting().state_at(pressure=1e5)
    asked = [(1.0, 0.0, None)] * 2 + [
        (1.0, 0.05, None),
        (0.5, 0.0, 0.05),
        (1.0, 0.0, 0.05),
        (1.0, 0.0, None),
    ]
    for duration, begin, times in asked:
        again, new = (
            simulate(
                plant,
                s,
                duration=duration,
                initial_state=start,
                start_time=begin,
                output_times=times,
            )
            for s in (signal, Schedule(changes))
        )
        assert all(np.array_equal(again[name], new[name]) for name in new)
    other = Schedule({"fill": ((0.2, 1.0),)})
    run = simulate(plant, other, duration=1.0, initial_state=start)
    assert run["fill"].tolist() == (run["time"] >= 0.2).tolist()


def test_what_is_kept_of_a_run_for_the_next_one_cannot_be_written_to():
    problem = Problem(
        lifting(), Schedule({"fill": ((0.1, 1.0),)}), 1.0, lifting().state_at(pressure=1e5)
    )
    for kept in (
        problem.segments.ends,
        problem.segments.values,
        problem.segments.slopes,
        problem.times,
    ):
        with pytest.raises(ValueError, match="read-only"):
            kept[0] = 9.0


@pytest.mark.parametrize("writeable", ["values", "slopes"])
def test_segments_that_somebody_can_write_to_are_checked_again(writeable):
    plant = lifting()
    state = lifting().state_at(pressure=1e5)
    segments = PiecewiseLinear(np.array([0.01]), np.full((1, 2), 0.5), np.zeros((1, 2)))
    for name in {"ends", "values", "slopes"} - {writeable}:
        getattr(segments, name).setflags(write=False)
    advance(plant, state, segments, 0.01)
    getattr(segments, writeable)[0, 0] = 200.0
    with pytest.raises(ParameterError, match=r"the input 'fill' is .* allowed range: 0 to 1"):
        advance(plant, state, segments, 0.01)


def test_a_command_that_one_system_takes_is_refused_by_another_of_a_smaller_range():
    signal = Schedule({"u": ((0.0, 2.0),)})
    for _ in range(2):
        assert simulate(Lag(3.0), signal, duration=1.0, initial_state={"y": 0.0})["u"].max() == 2.0
        with pytest.raises(ParameterError, match="the input 'u' is 2"):
            simulate(Lag(1.0), signal, duration=1.0, initial_state={"y": 0.0})


# Times


@given(
    st.lists(TICKS, unique=True, max_size=30),
    st.lists(TICKS, min_size=1, max_size=8),
    st.sampled_from([0, 1e-12]),
)
def test_few_rows_and_instants_are_merged_as_many_are(grid, instants, shift):
    grid = np.sort(np.array(grid, dtype=float))
    instants = np.sort(instants) + shift
    given_few = problem.FEW_INSTANTS
    problem.FEW_INSTANTS = 0
    try:
        many = merge_output_times(grid, instants, 10.0).tolist()
    finally:
        problem.FEW_INSTANTS = given_few
    assert merge_output_times(grid, instants, 10.0).tolist() == many


# Input


@given(st.integers(1, 60), st.integers(0, 2**32 - 1))
def test_an_input_beyond_its_range_is_found_among_few_and_many_numbers(count, seed):
    rng = np.random.default_rng(seed)
    at = int(rng.integers(count))
    name = str(rng.choice(["fill", "discharge"]))
    value = float(rng.choice([-0.1, 1.1]))
    levels = {n: rng.random(count).tolist() for n in ("fill", "discharge")}
    plant = lifting()
    start = lifting().state_at(pressure=1e5)
    Problem(plant, Schedule({n: tuple(enumerate(v)) for n, v in levels.items()}), count, start)
    levels[name][at] = value
    message = rf"the input '{name}' is {value:g} before {at + 1:g} s; allowed range: 0 to 1 "
    with pytest.raises(ParameterError, match=message):
        Problem(plant, Schedule({n: tuple(enumerate(v)) for n, v in levels.items()}), count, start)


@pytest.mark.parametrize("count", [2, 4 * arrays.FEW])
@pytest.mark.parametrize("spoil", ["end", "value", "slope", "order"])
def test_segments_that_a_kernel_cannot_take_are_refused_among_few_and_many(count, spoil):
    ends = np.arange(1.0, count + 1)
    values = np.zeros((count, 1))
    slopes = np.zeros((count, 1))
    PiecewiseLinear(ends, values, slopes).check_shape(1, 0.0, count)
    if spoil == "order":
        ends[-1] = ends[-2]
    else:
        {"end": ends, "value": values, "slope": slopes}[spoil][-1] = np.nan
    with pytest.raises(ParameterError, match="segments"):
        PiecewiseLinear(ends, values, slopes).check_shape(1, 0.0, count)


class Steps(InputSignal):
    """A user's signal in integers and by columns: the valve opens after two seconds and closes
    after three.
    """

    def segments(self, inputs, start, duration):
        values = np.zeros((3, len(inputs)), dtype=np.int64, order="F")
        values[1, inputs.index("fill")] = 1
        return PiecewiseLinear(np.array([2, 3, 4]), values, np.zeros_like(values))


@pytest.mark.parametrize("loop", [False, True], ids=["open loop", "control loop"])
def test_a_signal_in_integers_is_the_signal_in_floats(loop):
    plant = lifting()
    start = lifting().state_at(pressure=1e5)
    controller = PID("pressure", "discharge", gain=-1e-6)
    pressure = Schedule({"pressure": ((0.0, 1e5),)})
    own, usual = (
        simulate(
            plant,
            ControlLoop(controller, 0.5, pressure, other_inputs=signal) if loop else signal,
            duration=4.0,
            initial_state=start,
        )
        for signal in (Steps(), Schedule({"fill": ((2.0, 1.0), (3.0, 0.0))}))
    )
    assert usual["fill"].max() == 1.0
    assert all(np.array_equal(own[name], usual[name]) for name in usual)


def test_a_batch_and_a_single_step_take_integers_as_floats():
    plant = lifting()
    signals = (Steps(), Schedule({"fill": ((2.0, 1.0), (3.0, 0.0))}))
    start = plant.state_at(pressure=1e5)
    own, usual = (
        simulate_batch(plant, {}, [each], duration=4.0, initial_states=start) for each in signals
    )
    assert all(np.array_equal(own[name], usual[name]) for name in usual.columns)
    own, usual = (
        advance(plant, start, each.segments(plant.inputs, 0.0, 4.0), 4.0) for each in signals
    )
    assert own == usual


# The initial state


def test_an_initial_state_is_checked_again_where_it_differs_from_the_last_one():
    plant = lifting()
    good = plant.state_at(pressure=1e5)
    impossible = {**good, "position": 0.29}
    for _ in range(2):
        Problem(plant, Schedule({}), 1.0, good)
        with pytest.raises(GeometryLimitError):
            Problem(plant, Schedule({}), 1.0, impossible)
    for wrong in ("0", None, np.nan, 10**400):
        with pytest.raises(ParameterError, match="initial state"):
            Problem(plant, Schedule({}), 1.0, {**good, "position": wrong})


# Drivers


@given(
    st.integers(0, 64),
    st.integers(1, 40),
    st.floats(0, 1),
    st.one_of(st.just(-np.inf), st.just(np.inf), TICKS),
)
def test_an_interval_without_a_new_period_continues_the_pulse(start, length, duty, pulse_end):
    """The rest of a pulse in one interval is what a longer interval, in which a period begins, has
    up to there.
    """
    begin = start / 64
    driver = PWM(0.5)
    state = PwmState(0.0, 1.0, pulse_end)
    end = min(begin + length / 64, 2.0)
    short, later = driver.step(state, [(end, duty, 0.0)], begin)
    long, _ = driver.step(state, [(3.0, duty, 0.0)], begin)
    assert later == state
    assert short[-1][0] == end
    edges = np.linspace(begin, end, 50)[:-1]
    assert [level_at(short, t) for t in edges] == [level_at(long, t) for t in edges]


def level_at(segments, time):
    return next(level for end, level, _ in segments if time < end)


def test_single_segments_are_merged_as_several_are():
    rng = np.random.default_rng(3)
    for _ in range(50):
        end = 1.0 + rng.random()
        values = rng.standard_normal(3)
        slopes = rng.standard_normal(3)
        columns = [[(end, v, s)] for v, s in zip(values.tolist(), slopes.tolist(), strict=True)]
        split = [[(0.5, v, s), (end, v + 0.5 * s, s)] for [(_, v, s)] in columns]
        one = merge_columns(columns, 0.0)
        both = merge_columns([*columns[:2], split[2]], 0.0)
        assert one.ends.tolist() == [end]
        assert one.values.tolist() == both.values[:1].tolist()
        assert one.slopes.tolist() == both.slopes[:1].tolist()


class Unchanged(Driver):
    """The command itself."""

    def init(self, start):
        return ()

    def step(self, state, command, start):
        return list(command), state


@pytest.mark.parametrize(
    "other", [Schedule({}), SampledSignal({"discharge": ((0.1, 0.0), (0.5, 0.3))})]
)
def test_a_loop_whose_drivers_change_nothing_is_the_loop_without_drivers(other):
    controller = Called(PID("pressure", "fill", gain=1.5e-5, integral_time=0.4))
    setpoint = Schedule({"pressure": ((0.0, 1e5), (0.51, 3e5), (0.75, 5e4))})
    plant = lifting()
    start = plant.state_at(pressure=1e4)
    held, driven = (
        solve(Problem(plant, ControlLoop(controller, 1 / 64, setpoint, other, drivers), 1.0, start))
        for drivers in ({}, {"fill": Unchanged()})
    )
    assert held.recording["fill"].max() > 0.0
    assert all(
        np.array_equal(held.recording[name], driven.recording[name]) for name in held.recording
    )
    assert (held.final_state, held.control_state[1:7]) == (
        driven.final_state,
        driven.control_state[1:7],
    )


def test_an_input_that_varies_after_the_run_only_is_named():
    """Times since 1970 in a file, a run from 0 s on: the first value would be held in silence."""
    stamps = 1.7e9 + np.linspace(0.0, 0.1, 5)
    signal = SampledSignal({"fill": tuple((t, 8.0 * (t - stamps[0])) for t in stamps.tolist())})
    plant = lifting()
    given = {"duration": 0.2, "initial_state": plant.state_at(pressure=2e5)}
    with pytest.warns(
        AirmuscleWarning,
        match=r"input 'fill' begin at 1.7e\+09 s, after the end of the run at 0.2 s",
    ):
        simulate(plant, signal, **given)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        run = simulate(plant, signal, **given, start_time=1.7e9)
        simulate(plant, SampledSignal({"fill": ((0.3, 0.5), (0.4, 0.5))}), **given)
        simulate(plant, SampledSignal({"fill": ((0.1, 0.0), (0.4, 0.5))}), **given)
    assert run["fill"].max() == pytest.approx(0.8, rel=1e-6)
