"""Claims about the kernels: SciPy's answer at every size, the order of each method, instants met
exactly, a solution that does not depend on where it is looked at, and failures that return what
there is."""

from __future__ import annotations

import numpy as np
import pytest
from joints import chosen_muscle, joint, joint_start
from scipy.integrate import solve_ivp

from airmuscle.core import StateVariable, System, model, ops, parameter
from airmuscle.engine import (
    ZERO_INPUT,
    DormandPrince8,
    Rodas4,
    RungeKutta4,
    SampledSignal,
    Schedule,
    advance,
    simulate,
)
from airmuscle.engine.compile import compile_system
from airmuscle.errors import SimulationError
from airmuscle.physics import FillDischarge, HangingMass, Plant, Polytropic, Supply, Valve


def hanging() -> Plant:
    valve = Valve(5e-9, 0.433)
    return Plant(
        chosen_muscle(),
        FillDischarge(Supply(6e5), valve, valve),
        HangingMass(10.0),
        Polytropic(1.2),
    )


CASES = {
    3: (
        hanging(),
        hanging().state_at(pressure=1e5, position=0.002),
        Schedule({"fill": ((0.2, 1), (1.0, 0)), "discharge": ((1.5, 1), (1.8, 0))}),
        2.5,
    ),
    6: (
        joint(),
        joint_start(joint()),
        Schedule({"left.fill": ((0.2, 1), (0.25, 0)), "right.discharge": ((0.2, 1), (0.25, 0))}),
        1.0,
    ),
    10: (
        joint(heat=True),
        joint_start(joint(heat=True)),
        Schedule({"left.fill": ((0.2, 1), (0.25, 0)), "right.discharge": ((0.2, 1), (0.25, 0))}),
        1.0,
    ),
}


def scipy_solution(plant, start, command, duration, rtol=1e-10):
    """The same equations, called as plain Python over floats, through SciPy's LSODA, segment by
    segment.
    """
    names = [s.name for s in plant.states]
    nominal = np.array([s.nominal for s in plant.states])
    segments = command.segments(plant.inputs, 0.0, duration)
    y = np.array([start[n] for n in names])
    begin = 0.0
    times = []
    rows = []

    ready = compile_system(
        plant
    )  # the compiled rates, which a test below compares with the plant's own

    def rates(t, scaled, u):
        return ready.rates(scaled * nominal, u) / nominal

    for end, values in zip(segments.ends, segments.values, strict=True):
        grid = np.linspace(begin, end, 6)
        run = solve_ivp(
            rates, (begin, end), y / nominal, "LSODA", grid, args=(values,), rtol=rtol, atol=rtol
        )
        y = run.y[:, -1] * nominal
        begin = end
        times.append(grid[1:])
        rows.append(run.y.T[1:] * nominal)
    return np.concatenate(times), np.concatenate(rows)


@pytest.mark.parametrize("size", [3, 6, pytest.param(10, marks=pytest.mark.slow)])
def test_plants_of_every_size_agree_with_scipy(size):
    plant, start, command, duration = CASES[size]
    assert len(plant.states) == size
    times, expected = scipy_solution(plant, start, command, duration)
    run = simulate(
        plant,
        command,
        duration=duration,
        initial_state=start,
        integrator=Rodas4(1e-10),
        output_times=times,
    )
    rows = np.isin(run["time"], times)
    for i, state in enumerate(plant.states):
        size_of = max(np.abs(expected[:, i]).max(), state.nominal)
        np.testing.assert_allclose(
            run[state.name][rows], expected[:, i], atol=2e-8 * size_of, rtol=0
        )


@pytest.mark.parametrize("size", CASES)
def test_the_printed_rates_are_the_rates(size):
    plant, start, _, _ = CASES[size]
    ready, rng = compile_system(plant), np.random.default_rng(size)
    for _ in range(20):
        state = {
            n: v * (1 + 0.05 * rng.standard_normal()) + 1e-3 * (v == 0) for n, v in start.items()
        }
        inputs = dict(zip(plant.inputs, rng.uniform(0, 1, len(plant.inputs)), strict=True))
        expected = plant.rates(state, inputs)
        found = ready.rates([state[s.name] for s in plant.states], list(inputs.values()))
        for value, s in zip(found, plant.states, strict=True):
            assert value == pytest.approx(float(expected[s.name]), rel=1e-11, abs=1e-11 * s.nominal)


@model
class Pendulum(System):
    """A smooth system with a moving input, stiff in one state; no kinks."""

    stiffness: float = parameter("1", "k", "of the restoring sine", default=4.0)
    lag: float = parameter("1/s", "a", "rate of the third state", default=1.0)
    inputs = ("push",)

    @property
    def states(self):
        return tuple(StateVariable(n, "1", 1.0) for n in ("angle", "speed", "filtered"))

    def rates(self, state, inputs):
        swing = inputs["push"] - self.stiffness * ops.sin(state["angle"]) - 0.1 * state["speed"]
        return {
            "angle": state["speed"],
            "speed": swing,
            "filtered": self.lag * (state["angle"] - state["filtered"]),
        }

    def outputs(self, state, inputs):
        return {"energy": state["speed"] ** 2 / 2 - self.stiffness * ops.cos(state["angle"])}


START = {"angle": 1.0, "speed": 0.0, "filtered": 0.5}
PUSH = SampledSignal({"push": ((0.0, 0.0), (1.0, 1.0), (2.0, -0.5))})


def end_error(method, exact, command=PUSH):
    run = simulate(
        Pendulum(), command, duration=2.0, initial_state=START, integrator=method, output_times=1.0
    )
    return max(abs(run[n][-1] - exact[n]) for n in START)


@pytest.fixture(scope="module")
def exact():
    run = simulate(
        Pendulum(),
        PUSH,
        duration=2.0,
        initial_state=START,
        integrator=Rodas4(1e-13),
        output_times=1.0,
    )
    return {n: run[n][-1] for n in START}


@pytest.mark.parametrize(
    ("method", "coarse", "order"), [(RungeKutta4, 0.02, 4), (DormandPrince8, 0.4, 8)]
)
def test_explicit_methods_converge_at_their_order_without_kinks(method, coarse, order, exact):
    errors = [end_error(method(coarse / 2**i), exact) for i in range(3)]
    measured = np.log2(np.array(errors[:-1]) / np.array(errors[1:]))
    assert measured == pytest.approx(order, abs=0.1 + 0.1 * order)


def test_rodas4_converges_at_order_four_with_a_moving_input(exact):
    """Without the slope of the input it would be of order one. Steps are those its control
    takes.
    """
    errors = []
    steps = []
    for rtol in (1e-4, 1e-6, 1e-8):
        run = simulate(
            Pendulum(),
            PUSH,
            duration=2.0,
            initial_state=START,
            integrator=Rodas4(rtol),
            output_times=1.0,
        )
        errors.append(max(abs(run[n][-1] - exact[n]) for n in START))
        steps.append(int(run.notes[0].split(": ")[1].split()[0]))
    order = np.diff(np.log(errors)) / -np.diff(np.log(steps))
    assert (order > 3.4).all()
    assert (order < 5.5).all()


def test_the_solution_does_not_depend_on_the_output():
    plant, start, command, duration = CASES[3]
    for method in (Rodas4(1e-6), DormandPrince8(1e-4)):
        few = simulate(
            plant,
            command,
            duration=duration,
            initial_state=start,
            integrator=method,
            output_times=[0.5],
        )
        many = simulate(
            plant,
            command,
            duration=duration,
            initial_state=start,
            integrator=method,
            output_times=1e-3,
        )
        for name in ("position", "air_mass"):
            assert few[name][-1] == many[name][-1]
        assert few["position"][few["time"] == 0.5] == pytest.approx(
            many["position"][np.isclose(many["time"], 0.5)], rel=1e-12
        )


def test_rows_between_fixed_steps_are_as_exact_as_the_steps():
    run = simulate(
        Pendulum(),
        PUSH,
        duration=2.0,
        initial_state=START,
        integrator=DormandPrince8(0.05),
        output_times=0.0173,
    )
    fine = simulate(
        Pendulum(),
        PUSH,
        duration=2.0,
        initial_state=START,
        integrator=Rodas4(1e-12),
        output_times=0.0173,
    )
    np.testing.assert_allclose(run["angle"], fine["angle"], atol=1e-9)


def test_instants_are_rows_and_belong_to_what_begins_there():
    plant, start, command, duration = CASES[3]
    run = simulate(plant, command, duration=duration, initial_state=start, output_times=0.3)
    for instant, opening in ((0.2, 1.0), (1.0, 0.0)):
        row = np.flatnonzero(run["time"] == instant)
        assert row.size == 1
        assert run["fill"][row[0]] == opening


def test_advance_is_the_seam_of_simulate():
    plant, _, _, _ = CASES[3]
    start = plant.state_at(pressure=1e5, position=0.005)
    run = simulate(
        plant,
        Schedule({"fill": ((0.0, 1.0),)}),
        duration=0.05,
        initial_state=start,
        integrator=Rodas4(1e-9),
    )
    state = start
    for _ in range(5):
        state = advance(plant, state, {"fill": 1.0}, 0.01, Rodas4(1e-9))
    assert state["position"] == pytest.approx(run["position"][-1], abs=1e-9)


@model
class Explodes(System):
    """y' = y^2 leaves every number behind at t = 1."""

    inputs = ()

    @property
    def states(self):
        return (StateVariable("y", "1", 1.0),)

    def rates(self, state, inputs):
        return {"y": state["y"] ** 2}

    def outputs(self, state, inputs):
        return {}


@pytest.mark.parametrize("method", [Rodas4(1e-6), DormandPrince8(1e-3)])
def test_a_run_that_fails_returns_what_it_has(method):
    with pytest.raises(
        SimulationError,
        match=r"the run ended at (0\.99\d*|1) of 2 s because .*, after \d+ steps, at y ",
    ) as caught:
        simulate(
            Explodes(),
            ZERO_INPUT,
            duration=2.0,
            initial_state={"y": 1.0},
            integrator=method,
            output_times=0.1,
        )
    kept = caught.value.recording
    np.testing.assert_allclose(kept["y"][:10], 1 / (1 - kept["time"][:10]), rtol=1e-4)
    again = simulate(
        Explodes(),
        ZERO_INPUT,
        duration=2.0,
        initial_state={"y": 1.0},
        integrator=method,
        output_times=0.1,
        complete=False,
    )
    assert len(again) == len(kept)
    assert "the run ended" in again.notes[-1]


def test_another_parameter_set_shares_the_program():
    one = compile_system(Pendulum(stiffness=4.0))
    other = compile_system(Pendulum(stiffness=9.0))
    assert one.program is other.program
    assert one.rates([1.0, 0.0, 0.0], [0.0])[1] == pytest.approx(-4 * np.sin(1.0))
    assert other.rates([1.0, 0.0, 0.0], [0.0])[1] == pytest.approx(-9 * np.sin(1.0))
