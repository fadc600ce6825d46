"""A controller looks at a plant at t_0 + k h, each instant met exactly, and its command is held
between two.

So a loop at a linear system is its discretisation by zero-order hold, to the tolerance of the
method, and for small steps a loop at a plant is that of its linearisation. Rows do not change the
solution, nor does cutting a run; a loop that fails or is interrupted returns what it has, and can
be taken up where it stood.
"""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Mapping
from typing import Any

import numpy as np
import pytest
from plants import chosen_muscle
from scipy.linalg import expm

from airmuscle import Status
from airmuscle.control import PID, OnOffController
from airmuscle.core import StateVariable, System, cite, model, parameter
from airmuscle.engine import (
    PWM,
    Controller,
    ControlLoop,
    DormandPrince8,
    Periodic,
    Problem,
    Rodas4,
    RungeKutta4,
    SampledSignal,
    Schedule,
    SolenoidDriver,
    SplitRange,
    simulate,
    simulate_batch,
    solve,
)
from airmuscle.engine.compile.program import Description
from airmuscle.engine.run import BoundIntegrator, compiled_loop
from airmuscle.errors import ParameterError, SimulationError
from airmuscle.physics import (
    FillDischarge,
    HangingMass,
    Isometric,
    Isothermal,
    Plant,
    Polytropic,
    ProportionalRegulator,
    ProportionalValve,
    SecondOrderLag,
    Supply,
    Valve,
    WithLatch,
    linearise,
)

VALVE = Valve(2.6e-9, 0.4)
TICK = 2.0**-6
"""A period whose multiples are exact."""
FINE = Rodas4(1e-11)


@model
class Lag(System):
    """x' = (u + w - x)/tau, with y = 2 x + u as an output: what jumps with its input."""

    time_constant: float = parameter("s", "tau", "time constant", default=0.3)

    @property
    def states(self) -> tuple[StateVariable, ...]:
        return (StateVariable("x", "1", 1.0),)

    @property
    def inputs(self) -> tuple[str, ...]:
        return ("u", "w")

    def rates(self, state: Mapping[str, Any], inputs: Mapping[str, Any]) -> dict[str, Any]:
        return {"x": (inputs["u"] + inputs["w"] - state["x"]) / self.time_constant}

    def outputs(self, state: Mapping[str, Any], inputs: Mapping[str, Any]) -> dict[str, Any]:
        return {"y": 2.0 * state["x"] + inputs["u"]}


LAG_PI = PID("x", "u", gain=1.5, integral_time=0.2, setpoint_weight=0.6)
STEP = Schedule({"x": ((0.0, 0.0), (0.5, 1.0))})


def solution(plant, loop, *, duration, complete=True, **problem):
    """The solution of a problem; a run that ends early raises unless it need not be complete."""
    solved = solve(Problem(plant, loop, duration, **problem))
    return solved.raise_if_incomplete() if complete else solved


def lifting(circuit=None, mass=5.0):
    return Plant(
        chosen_muscle(), circuit or FillDischarge(Supply(5e5), VALVE, VALVE), HangingMass(mass)
    )


PRESSURE = Schedule({"pressure": ((0.0, 1e5), (0.3, 3e5), (0.7, 1.5e5))})
VALVES = PID(
    "pressure",
    SplitRange("fill", "discharge"),
    gain=1.5e-5,
    integral_time=0.4,
    derivative_time=0.02,
)


# What a loop is


def test_a_loop_at_a_linear_system_is_its_discretisation():
    """x_(k+1) = a x_k + (1 - a) u_k with a = exp(-h/tau), u = K (b r - x) + I, I_(k+1) = I + K
    h/T_i (r - x).
    """
    h = 0.05
    a = np.exp(-0.05 / 0.3)
    k = 1.5
    run = simulate(
        Lag(), ControlLoop(LAG_PI, h, STEP), duration=3.0, initial_state={"x": 0.2}, integrator=FINE
    )
    x = 0.2
    integral = k * 0.2
    expected = []
    for i in range(60):
        r = 1.0 if i >= 10 else 0.0
        expected.append(x)
        u = k * (0.6 * r - x) + integral
        x, integral = a * x + (1 - a) * u, integral + k * h / 0.2 * (r - x)
    found = run["x"][np.searchsorted(run["time"], h * np.arange(60) - 1e-9)]
    assert found == pytest.approx(expected, abs=1e-9)
    assert run["x"][-1] == pytest.approx(x, abs=1e-9)


def test_between_samples_a_held_command_meets_a_driven_disturbance():
    """With w linear in time x follows the exact solution of x' = (u + w - x)/tau over every
    period.
    """
    h = 0.05
    tau = 0.3
    disturbed = ControlLoop(
        LAG_PI, h, STEP, other_inputs=SampledSignal({"w": ((0.0, 0.0), (0.5, 0.0), (1.5, 2.0))})
    )
    run = simulate(Lag(), disturbed, duration=1.5, initial_state={"x": 0.0}, integrator=FINE)
    at = np.searchsorted(run["time"], h * np.arange(31) - 1e-9)
    whole = np.array(
        [[-1 / tau, 1 / tau, 0.0], [0.0, 0.0, 1.0], [0.0, 0.0, 0.0]]
    )  # of x, u + w, its slope
    for begin, end in itertools.pairwise(at):
        slope = 2.0 if run["time"][begin] > 0.5 - 1e-9 else 0.0
        known = [run["x"][begin], run["command.u"][begin] + run["w"][begin], slope]
        assert run["x"][end] == pytest.approx((expm(whole * h) @ known)[0], abs=1e-9)


def test_for_small_steps_a_loop_is_that_of_the_linearised_plant():
    """What is left is quadratic in the step: half the step, a quarter of it."""
    from scipy.signal import cont2discrete

    valve = ProportionalValve(Supply(5e5), VALVE, VALVE, SecondOrderLag(20.0, 0.7), overlap=-0.3)
    plant = Plant(chosen_muscle(), valve, Isometric(0.05), Isothermal())
    rest = solution(
        plant,
        ControlLoop(PID("pressure", "command", 0.0), 0.5, Schedule({"pressure": ()})),
        duration=20.0,
        initial_state=plant.state_at(pressure=1e5),
        integrator=FINE,
    ).final_state
    linear = linearise(plant, rest, {"command": 0.0})
    middle = float(plant.outputs(rest, {"command": 0.0})["pressure"])
    row = linear.outputs.index("pressure")
    h = 0.02
    k = 4e-6
    t_i = 0.15
    a, b, *_ = cont2discrete((linear.A, linear.B, linear.C[[row]], linear.D[[row]]), h)
    left = []
    for step in (4000.0, 2000.0):
        loop = ControlLoop(
            PID("pressure", "command", k, t_i),
            h,
            Schedule({"pressure": ((0.0, middle), (h / 2, middle + step))}),
        )
        run = simulate(plant, loop, duration=50 * h, initial_state=rest, integrator=FINE)
        x = np.zeros(len(linear.states))
        integral = 0.0
        expected = []
        for i in range(50):
            y = float(linear.C[row] @ x)
            e = (step if i else 0.0) - y
            expected.append(y)
            x = a @ x + b[:, 0] * (k * e + integral)
            integral = integral + k * h / t_i * e
        found = run["pressure"][np.searchsorted(run["time"], h * np.arange(50) - 1e-9)] - middle
        assert found.max() > 0.9 * step, "the step is followed"
        left.append(np.abs(found - expected).max())
        assert left[-1] < 0.01 * step
    assert left[0] / left[1] == pytest.approx(4.0, rel=0.1)


@pytest.mark.parametrize("method", [Rodas4(), RungeKutta4(1e-3), DormandPrince8(1e-3)])
def test_every_sampling_instant_is_met_exactly(method):
    """No row is missing, what was measured is what the column held then, and the command changes
    nowhere else.

    Rows are computed several at once, so that they may differ from what was measured by the
    rounding of the ambient pressure.
    """
    h = 0.03
    run = simulate(
        lifting(),
        ControlLoop(VALVES, h, PRESSURE),
        duration=1.0,
        integrator=method,
        output_times=0.007,
    )
    instants = h * np.arange(34)
    assert np.isin(instants, run["time"]).all()
    at = np.searchsorted(run["time"], instants)
    assert run["measured.pressure"][at] == pytest.approx(run["pressure"][at], rel=1e-14, abs=1e-9)
    for name in ("fill", "discharge"):
        changed = np.flatnonzero(np.diff(run[f"command.{name}"]) != 0) + 1
        assert np.isin(run["time"][changed], instants).all()
        assert changed.size > 5
        assert np.array_equal(run[name], run[f"command.{name}"]), "nothing stands between"


def test_rows_do_not_change_the_solution():
    loop = ControlLoop(
        VALVES, TICK, PRESSURE, drivers={"fill": (PWM(30.0), SolenoidDriver(3e-3, 2e-3))}
    )
    plant = lifting()
    found = []
    for output in (None, 0.5, 1e-3, [0.1, 0.15]):
        run = solution(plant, loop, duration=1.0, output_times=output)
        at = np.isin(run.recording["time"], TICK * np.arange(64))
        assert at.sum() == 64
        found.append(
            (
                run.final_state,
                run.control_state,
                *(run.recording[name][at].tolist() for name in ("pressure", "command.fill")),
            )
        )
    assert found[0] == found[1] == found[2] == found[3]


def test_the_same_run_is_the_same_twice():
    loop = ControlLoop(VALVES, TICK, PRESSURE, drivers={"fill": PWM(30.0)})
    one, two = (solution(lifting(), loop, duration=0.5) for _ in range(2))
    assert (one.final_state, one.control_state) == (two.final_state, two.control_state)
    assert all(np.array_equal(one.recording[name], two.recording[name]) for name in one.recording)


def test_what_jumps_with_its_input_is_measured_before_it_jumps():
    """u_k = K (r - y_k), y_k = 2 x_k + u_(k-1): the controller has not commanded u_k yet."""
    loop = ControlLoop(PID("y", "u", 0.5), 0.1, Schedule({"y": ((0.0, 1.0),)}))
    run = simulate(Lag(), loop, duration=1.0, initial_state={"x": 0.0}, integrator=FINE)
    a = np.exp(-0.1 / 0.3)
    x = 0.0
    u = 0.0
    for i in np.searchsorted(run["time"], 0.1 * np.arange(10) - 1e-9):
        assert run["measured.y"][i] == pytest.approx(2 * x + u, abs=1e-9)
        u = 0.5 * (1.0 - (2 * x + u))
        x = a * x + (1 - a) * u


@pytest.mark.parametrize(("period", "places"), [(0.1, 1), (0.07, 2), (0.019, 3)])
def test_a_set_point_that_changes_at_a_sampling_instant_is_seen_there(period, places):
    """3 x 0.1 is more than 0.3, and 6 x 0.019 less than 0.114: rounding must not cost a period,
    either way.
    """
    off = set()
    for k in range(1, 60):
        at = round(k * period, places)
        off.add(float(np.sign(k * period - at)))
        wanted = Schedule({"x": ((at, 1.0),)})
        beside = Schedule({"w": ((at, 1.0),)})
        loop = ControlLoop(PID("x", "u", 1.0), period, wanted, beside)
        run = simulate(
            Lag(), loop, duration=60 * period, initial_state={"x": 0.0}, output_times=60 * period
        )
        first = int(np.flatnonzero(run["command.u"])[0])
        assert run["time"][first] == pytest.approx(at, abs=1e-9)
        assert (run["w"][first - 1], run["w"][first], run["setpoint.x"][first]) == (0.0, 1.0, 1.0)
        assert np.diff(run["time"]).min() > 1e-9, "no piece of 1e-17 s"
    assert off >= ({0.0, 1.0} if period == 0.1 else {0.0, -1.0} if period == 0.019 else {0.0})


# Ranges and drivers


def test_a_command_is_cut_off_at_the_range_of_its_input():
    """A huge gain knows two commands, the least and the greatest."""
    lag = SecondOrderLag(20.0, 0.7)
    regulator = ProportionalRegulator(Supply(6e5), VALVE, VALVE, lag, max_setpoint=4e5)
    valve = ProportionalValve(Supply(5e5), VALVE, VALVE, lag)
    for circuit, name, range_of_it, drivers in (
        (regulator, "setpoint", (0.0, 4e5), {}),
        (valve, "command", (-1.0, 1.0), {}),
        (valve, "command", (0.0, 1.0), {"command": PWM(100.0)}),  # what a driver takes
    ):
        loop = ControlLoop(PID("pressure", name, 1e3), TICK, PRESSURE, drivers=drivers)
        plant = lifting(circuit)
        run = simulate(plant, loop, duration=1.0, initial_state=plant.state_at(pressure=2e5))
        assert set(run[f"command.{name}"]) == set(range_of_it)


class Wild(Controller):
    """Commands what is no command, from a sample on."""

    measured_columns = setpoints = ("pressure",)
    inputs = ("fill",)

    def __init__(self, after: int, given: Any) -> None:
        self.after = after
        self.given = given

    def init(self) -> int:
        return 0

    def step(self, memory: int, measurement: Any, dt: float) -> tuple[Any, int]:
        if memory < self.after:
            return {"fill": 5.0}, memory + 1
        if isinstance(self.given, type):
            raise self.given
        return self.given, memory + 1


def test_a_controller_that_knows_no_range_is_cut_off_too():
    run = simulate(lifting(), ControlLoop(Wild(99, None), 0.02, PRESSURE), duration=0.1)
    assert (run["command.fill"] == 1.0).all()


def test_pulses_in_step_with_the_samples_are_as_wide_as_commanded():
    """A carrier's period that begins with a sample has that sample's command, however k/50 and k x
    0.02 are rounded.
    """
    loop = ControlLoop(
        VALVES, 0.02, Periodic(PRESSURE, 1.0), drivers={"fill": PWM(50.0), "discharge": PWM(50.0)}
    )
    run = simulate(lifting(), loop, duration=20.0, output_times=20.0)
    edges = 0.02 * np.arange(1001)
    edges[-1] = 20.0
    at = np.searchsorted(run["time"], edges - 1e-9)
    for name in ("fill", "discharge"):
        wide = np.add.reduceat(np.diff(run["time"]) * run[name][:-1], at[:-1])
        assert wide == pytest.approx(0.02 * run[f"command.{name}"][at[:-1]], abs=1e-9)


def test_two_point_control_swings_about_its_set_point_by_more_than_its_hysteresis():
    loop = ControlLoop(
        OnOffController("pressure", SplitRange("fill", "discharge"), 2e4),
        2e-3,
        Schedule({"pressure": ((0.0, 2e5),)}),
    )
    run = simulate(lifting(), loop, duration=2.0)
    late = run["pressure"][run["time"] > 1.0]
    assert 2e4 < np.ptp(late) < 6e4
    assert late.mean() == pytest.approx(2e5, abs=1e4)
    assert np.count_nonzero(np.diff(run["fill"])) > 10


def test_pid_follows_with_every_kind_of_valve():
    """With integral action nothing is left of the error, whatever stands between the controller and
    the air.
    """
    lag = SecondOrderLag(20.0, 0.7)
    single = Schedule({"pressure": ((0.0, 2e5),)})
    for circuit, commanded, gain, drivers in (
        (
            FillDischarge(Supply(5e5), VALVE, VALVE),
            SplitRange("fill", "discharge"),
            1e-5,
            {"fill": PWM(200.0), "discharge": PWM(200.0)},
        ),
        (ProportionalValve(Supply(5e5), VALVE, VALVE, lag), "command", 1e-5, {}),
        (ProportionalRegulator(Supply(5e5), VALVE, VALVE, lag, 2e5), "setpoint", 0.5, {}),
    ):
        loop = ControlLoop(PID("pressure", commanded, gain, 0.3), 5e-3, single, drivers=drivers)
        run = simulate(lifting(circuit), loop, duration=6.0)
        assert run["pressure"][-1] == pytest.approx(2e5, rel=5e-3), type(circuit).__name__


def test_position_is_followed_and_what_is_beside_goes_on():
    plant = Plant(
        chosen_muscle(), FillDischarge(Supply(5e5), VALVE, VALVE), WithLatch(HangingMass(10.0))
    )
    pid = PID("position", SplitRange("fill", "discharge"), 15.0, 0.5, 0.08)
    loop = ControlLoop(
        pid,
        5e-3,
        SampledSignal({"position": ((0.0, 0.0), (2.0, 0.02))}),
        other_inputs=Schedule({"latched": ((0, 1), (0.5, 0))}),
    )
    run = simulate(plant, loop, duration=5.0, initial_state=plant.state_at(pressure=1e5))
    early = run["time"] < 0.5
    assert np.ptp(run["position"][early]) == 0.0
    assert np.array_equal(run["latched"], early.astype(float))
    assert run["position"][-1] == pytest.approx(0.02, abs=1e-3)
    assert run["setpoint.position"] == pytest.approx(np.minimum(run["time"] / 100, 0.02))


# A run in pieces


@pytest.mark.parametrize("cuts", [(32, 16), (1, 2, 60), tuple(range(1, 64))])
def test_a_run_cut_at_its_samples_is_the_run_in_one_to_the_last_bit(cuts):
    drivers = {
        "fill": (PWM(30.0), SolenoidDriver(9e-3, 7e-3, 4e-3, 2e-3)),
        "discharge": SolenoidDriver(20e-3, 20e-3),
    }
    loop = ControlLoop(VALVES, TICK, PRESSURE, drivers=drivers)
    plant = lifting()
    whole = solution(plant, loop, duration=1.0, initial_state=plant.state_at(pressure=1e5))
    state = plant.state_at(pressure=1e5)
    memory = None
    time = 0.0
    for cut in [TICK * n for n in sorted({*cuts, 64})]:
        part = solution(
            plant,
            loop,
            duration=cut - time,
            initial_state=state,
            start_time=time,
            control_state=memory,
        )
        state = part.final_state
        memory = part.control_state
        time = part.final_time
    assert (state, memory) == (whole.final_state, whole.control_state)


@pytest.mark.parametrize("cut", [0.001, 0.5 - TICK / 3, 0.5 + TICK / 3])
def test_a_run_cut_between_two_samples_goes_on_with_what_was_commanded(cut):
    loop = ControlLoop(VALVES, TICK, PRESSURE)
    plant = lifting()
    start = lifting().state_at(pressure=1e5)
    whole = solution(plant, loop, duration=1.0, initial_state=start, integrator=FINE)
    if cut < TICK:
        with pytest.raises(ParameterError, match=r"longer than the run of 0\.001 s"):
            solution(plant, loop, duration=cut, initial_state=start)
        return
    first = solution(plant, loop, duration=cut, initial_state=start, integrator=FINE)
    short = solution(
        plant,
        loop,
        duration=1e-4,
        initial_state=first.final_state,
        start_time=first.final_time,
        control_state=first.control_state,
        integrator=FINE,
    )
    second = solution(
        plant,
        loop,
        duration=1.0 - short.final_time,
        initial_state=short.final_state,
        start_time=short.final_time,
        control_state=short.control_state,
        integrator=FINE,
    )
    assert second.recording["command.fill"][0] == first.recording["command.fill"][-1]
    assert second.recording["measured.pressure"][0] == first.recording["measured.pressure"][-1]
    assert second.control_state.sample_count == whole.control_state.sample_count == 64
    assert second.final_state == pytest.approx(whole.final_state, rel=1e-7, abs=1e-9)


def test_what_was_commanded_gives_the_same_run_without_a_controller():
    drivers = {"fill": (PWM(30.0), SolenoidDriver(9e-3, 7e-3, 4e-3, 2e-3))}
    plant = Plant(
        chosen_muscle(), FillDischarge(Supply(5e5), VALVE, VALVE), WithLatch(HangingMass(10.0))
    )
    loop = ControlLoop(VALVES, TICK, PRESSURE, Schedule({"latched": ((0, 1), (0.1, 0))}), drivers)
    start = plant.state_at(pressure=1e5)
    run = simulate(plant, loop, duration=1.0, initial_state=start, integrator=FINE)
    again = simulate(
        plant,
        loop.as_open_loop(run),
        duration=1.0,
        initial_state=start,
        integrator=FINE,
        output_times=run["time"],
    )
    at = np.isin(again["time"], run["time"])
    assert at.sum() == len(run)
    for name in ("pressure", "position", "fill", "latched"):
        assert again[name][at] == pytest.approx(run[name], rel=1e-6, abs=1e-8), name


# A loop that ends early


HUGE = FillDischarge(Supply(5e5), Valve(9e-6, 0.3), Valve(9e-6, 0.3))


@pytest.mark.parametrize(
    ("gas", "reason"),
    [(Polytropic(1.2), "not finite"), (Isothermal(), "an air mass became negative")],
)
def test_a_loop_that_fails_returns_what_it_has(gas, reason):
    """Huge valves empty the muscle within one step of a fixed method."""
    plant = Plant(chosen_muscle(), HUGE, HangingMass(10.0), gas)
    falling = Schedule({"pressure": ((0.0, 3e5), (0.1, 0.0))})
    loop = ControlLoop(PID("pressure", SplitRange("fill", "discharge"), 1.0), 0.02, falling)
    told = {
        "duration": 1.0,
        "initial_state": plant.state_at(pressure=3e5),
        "integrator": RungeKutta4(0.01),
    }
    with pytest.raises(
        SimulationError, match=rf"ended at .* because .*{reason}.*at air_mass"
    ) as caught:
        solution(plant, loop, **told)
    run = caught.value.recording
    assert 3 <= len(run) < 101
    assert all(np.isfinite(run[name]).all() for name in run)
    assert (run["pressure"] >= -101325.0).all()
    kept = solution(plant, loop, **told, complete=False)
    assert reason in kept.recording.notes[-1]
    assert kept.final_time <= kept.recording["time"][-1] + 1e-12
    assert kept.final_state["air_mass"] > 0.0, "where it can go on from"


@pytest.mark.parametrize("given", [{"fill": np.nan}, {"fill": np.inf - np.inf}])
def test_a_command_that_is_no_number_ends_the_run_there(given):
    with pytest.raises(
        SimulationError,
        match=r"ended at 0.1 of 1 s because the controller gave a command that is not",
    ) as caught:
        simulate(lifting(), ControlLoop(Wild(5, given), 0.02, PRESSURE), duration=1.0)
    assert caught.value.recording["time"][-1] == 0.1
    assert not caught.value.interrupted


def test_a_loop_that_fails_at_its_first_sample_has_no_rows_and_a_reason():
    with pytest.raises(
        SimulationError, match=r"ended at 0 of 1 s because the controller gave a command"
    ) as caught:
        simulate(lifting(), ControlLoop(Wild(0, {"fill": np.nan}), 0.02, PRESSURE), duration=1.0)
    assert len(caught.value.recording) == 0
    assert "command.fill" in caught.value.recording


@pytest.mark.parametrize("given", [{}, {"fil": 1.0}, {"fill": "open"}, None])
def test_a_controller_that_gives_no_command_is_named(given):
    with pytest.raises(
        ParameterError, match=r"Wild commands .*; it must give a number for each of fill"
    ):
        simulate(lifting(), ControlLoop(Wild(5, given), 0.02, PRESSURE), duration=1.0)


def test_a_loop_that_is_interrupted_can_be_taken_up():
    loop = ControlLoop(Wild(30, KeyboardInterrupt), TICK, PRESSURE)
    plant = lifting()
    with pytest.raises(SimulationError, match="because it was interrupted") as caught:
        simulate(plant, loop, duration=1.0)
    assert caught.value.interrupted
    assert caught.value.recording["time"][-1] == 30 * TICK
    run = solution(plant, loop, duration=1.0, complete=False)
    assert (run.final_time, run.control_state.sample_count) == (30 * TICK, 30)
    patient = dataclasses.replace(loop, controller=Wild(99, None))
    rest = solution(
        plant,
        patient,
        duration=1.0 - run.final_time,
        initial_state=run.final_state,
        start_time=run.final_time,
        control_state=run.control_state,
    )
    assert rest.final_state == solution(plant, patient, duration=1.0).final_state


def test_a_loop_that_is_interrupted_within_a_piece_goes_on_from_the_sample_before(monkeypatch):
    integrate, run = BoundIntegrator.run_part, iter(range(100))
    loop = ControlLoop(VALVES, TICK, PRESSURE, drivers={"fill": PWM(200.0)})
    plant = lifting()
    monkeypatch.setattr(compiled_loop, "are_called", lambda prepared: True)
    monkeypatch.setattr(BoundIntegrator, "entry_address", property(lambda self: None))
    whole = solution(plant, loop, duration=1.0)

    def interrupted(self):
        status = integrate(self)
        return Status.INTERRUPTED if next(run) == 20 else status

    with monkeypatch.context() as patch:
        patch.setattr(BoundIntegrator, "run_part", interrupted)
        part = solution(plant, loop, duration=1.0, complete=False)
    assert "interrupted" in part.recording.notes[-1]
    assert (part.final_time, part.control_state.time, part.control_state.sample_count) == (
        20 * TICK,
        20 * TICK,
        20,
    )
    rest = solution(
        plant,
        loop,
        duration=1.0 - part.final_time,
        initial_state=part.final_state,
        start_time=part.final_time,
        control_state=part.control_state,
    )
    assert (rest.final_state, rest.control_state) == (whole.final_state, whole.control_state)


# What is made once


def test_what_does_not_change_is_made_once(monkeypatch):
    """A run binds its integrator once, however long it is; a plant is described once for all its
    runs.
    """
    counted: dict[str, int] = {}

    def counting(name, function):
        def counts(*given):
            counted[name] = counted.get(name, 0) + 1
            return function(*given)

        return counts

    monkeypatch.setattr(Rodas4, "binding", counting("binding", Rodas4.binding))
    monkeypatch.setattr(Description, "__init__", counting("description", Description.__init__))
    plant = lifting()
    start = lifting().state_at(pressure=1e5)
    loop = ControlLoop(VALVES, TICK, PRESSURE)
    simulate(plant, loop, duration=0.1, initial_state=start)
    assert counted["binding"] == 1
    assert counted["description"] >= 1
    counted.clear()
    for duration in (0.5, 1.0):
        simulate(plant, loop, duration=duration, initial_state=start)
    assert counted == {"binding": 2}


# What is recorded, and what is refused


def test_the_recording_says_who_commanded_what():
    loop = ControlLoop(VALVES, TICK, PRESSURE)
    run = simulate(lifting(), loop, duration=0.5)
    assert run.notes[0].startswith(
        "controlled by PID(measured='pressure', commanded=SplitRange(positive='fill'"
    )
    assert run.notes[0].endswith(
        "sample time 15.62 ms, measured pressure [Pa], commanded fill, discharge; compiled with the"
        " plant"
    )
    heads = list(run.to_pandas())
    assert {
        "setpoint.pressure [Pa]",
        "measured.pressure [Pa]",
        "command.fill [1]",
        "command.discharge [1]",
    } <= set(heads)
    assert [r.key for r in cite(loop)] == ["astrom-hagglund-1995"]
    assert np.array_equal(run["setpoint.pressure"], np.where(run["time"] < 0.3, 1e5, 3e5))


@pytest.mark.parametrize(
    ("integrator", "key"),
    [
        (Rodas4(), "hairer-wanner-1996"),
        (DormandPrince8(1e-3), "prince-dormand-1981"),
        (RungeKutta4(1e-3), "kutta-1901"),
    ],
)
def test_a_problem_its_solution_and_its_recording_cite_plant_integrator_and_controller(
    integrator, key
):
    problem = Problem(
        lifting(), ControlLoop(VALVES, TICK, PRESSURE), duration=0.05, integrator=integrator
    )
    sources = {r.key for r in cite(problem)}
    assert sources >= {key, "astrom-hagglund-1995", *(r.key for r in cite(problem.system))}
    solution = solve(problem)
    assert sources == {r.key for r in cite(solution)} == {r.key for r in cite(solution.recording)}
    held = simulate(problem.system, Schedule({}), duration=0.05, integrator=integrator)
    assert [r.key for r in cite(held)] == sorted({key, *(r.key for r in cite(problem.system))})
    assert cite(held.rows(slice(3))) == cite(held)
    batch = simulate_batch(problem.system, {}, [Schedule({})], duration=0.05, integrator=integrator)
    assert cite(batch.recording(0)) == cite(held)


@pytest.mark.parametrize("period", [0.0, -0.1, np.nan, np.inf, True])
def test_a_period_that_cannot_be_is_refused(period):
    with pytest.raises(
        ParameterError, match=r"ControlLoop.sample_time is .*; it must be positive and finite"
    ):
        ControlLoop(VALVES, period, PRESSURE)


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"controller": 3}, "ControlLoop.controller is 3; give a PID"),
        ({"setpoint": {"pressure": 1e5}}, "the input is {'pressure'"),
        (
            {"setpoint": Schedule({"presure": ()})},
            "ControlLoop.setpoint names presure; the set points of PID are pressure",
        ),
        (
            {"setpoint": Schedule({})},
            "ControlLoop.setpoint names nothing; the set points of PID are pressure",
        ),
        ({"setpoint": Periodic(Schedule({"force": ()}), 1.0)}, "ControlLoop.setpoint names force"),
        (
            {"other_inputs": Schedule({"fill": ((0, 1),)})},
            "'fill' is commanded by the controller and by other_inputs",
        ),
        ({"drivers": {"fill": 3}}, "the driver of 'fill' is 3"),
        (
            {"controller": PID("", "fill", 1.0), "setpoint": Schedule({})},
            "ControlLoop.setpoint names nothing; the set",
        ),
    ],
)
def test_a_loop_that_cannot_be_is_refused(changed, message):
    with pytest.raises(ParameterError, match=message):
        ControlLoop(**{"controller": VALVES, "sample_time": 0.01, "setpoint": PRESSURE, **changed})


@pytest.mark.parametrize(
    ("loop", "message"),
    [
        (
            ControlLoop(PID("presure", "fill", 1.0), 0.01, Schedule({"presure": ()})),
            "measures 'presure'.*Did you mean 'pressure'",
        ),
        (
            ControlLoop(PID("fill", "fill", 1.0), 0.01, Schedule({"fill": ()})),
            "measures 'fill', which the plant does not have",
        ),
        (
            ControlLoop(PID("pressure", "fil", 1.0), 0.01, PRESSURE),
            "no input 'fil'; .*Did you mean 'fill'",
        ),
        (
            ControlLoop(VALVES, 0.01, PRESSURE, drivers={"vent": PWM(50.0)}),
            "no input 'vent'; there are fill, discharge",
        ),
        (ControlLoop(VALVES, 0.01, PRESSURE, Schedule({"vent": ()})), "no input 'vent'"),
        (
            ControlLoop(
                PID("pressure", "fill", 1.0),
                0.01,
                PRESSURE,
                Schedule({"discharge": ((0.05, 2.0),)}),
            ),
            "'discharge' is 2 before",
        ),
        (
            ControlLoop(VALVES, 1.5, PRESSURE),
            r"sample time of the controller is 1.5 s, longer than the run of 1 s",
        ),
        (
            ControlLoop(VALVES, 1e-8, PRESSURE),
            r"a sample time of 1e-08 s makes 1e\+08 samples; 10000000 are allowed",
        ),
    ],
)
def test_a_loop_that_does_not_fit_its_plant_is_refused(loop, message):
    with pytest.raises(ParameterError, match=message):
        simulate(lifting(), loop, duration=1.0)


@pytest.mark.parametrize("start_time", [0.0, 0.9, 1.2])
def test_a_memory_belongs_to_its_instant(start_time):
    loop = ControlLoop(VALVES, 0.1, PRESSURE)
    plant = lifting()
    run = solution(plant, loop, duration=1.0)
    with pytest.raises(
        ParameterError,
        match=r"the control_state is that of 1 s, and the run begins at .* Give the time",
    ):
        solution(
            plant,
            loop,
            duration=1.0,
            initial_state=run.final_state,
            start_time=start_time,
            control_state=run.control_state,
        )


@pytest.mark.parametrize(
    ("change", "other"),
    [
        ({"controller": OnOffController("pressure", "fill", 1e4)}, {}),
        ({"controller": dataclasses.replace(VALVES, commanded="fill")}, {}),
        ({"drivers": {"fill": PWM(30.0)}}, {}),
        ({}, {"measured": (1e5, 2e5)}),
        ({}, {"applied_inputs": (0.0,)}),
        ({}, {"controller": None}),
    ],
)
def test_a_run_goes_on_with_the_state_of_its_own_loop(change, other):
    plant = lifting()
    loop = ControlLoop(VALVES, 0.1, PRESSURE)
    state = solution(plant, loop, duration=1.0).control_state._replace(**other)
    with pytest.raises(
        ParameterError, match=r"the control_state is not that of this loop of a .*; give one that"
    ):
        solution(
            plant,
            dataclasses.replace(loop, **change),
            duration=1.0,
            start_time=1.0,
            control_state=state,
        )


def test_a_run_with_an_input_that_has_no_driver_in_its_list_goes_on():
    loop = ControlLoop(VALVES, TICK, PRESSURE, drivers={"fill": (), "discharge": PWM(30.0)})
    one = solve(Problem(lifting(), loop, 0.25))
    two = solve(one.continuation(0.25)).raise_if_incomplete()
    assert two.final_state == solve(Problem(lifting(), loop, 0.5)).final_state


def test_an_experiment_takes_the_commands_of_a_loop():
    from airmuscle.bench import Experiment, InitialConditions

    loop = ControlLoop(VALVES, 0.1, PRESSURE)
    plant = lifting()
    run = simulate(plant, loop, duration=0.2)
    with pytest.raises(ParameterError, match="the input is ControlLoop"):
        Experiment(run, loop, InitialConditions.at_rest(plant, 0.0))
    assert Experiment(
        run, loop.as_open_loop(run), InitialConditions.at_rest(plant, 0.0)
    ).command == loop.as_open_loop(run)
