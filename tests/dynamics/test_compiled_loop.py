"""A loop of a control law is one program, and it is the loop that calls the law at each sample: bit
by bit where the law does not round (on-off control, held and pulsed inputs, delays, ramps), and to
rounding errors for a PID controller. The drivers of the kernel are those of Python, whichever way
the controller is called.

A controller that is no control law is called from Python; the notes say which of the two it was.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import Any

import numpy as np
import pytest
from called_controller import Called
from control_plants import LIFT, SPLIT, assert_identical
from hypothesis import given
from hypothesis import strategies as st

from airmuscle import Status
from airmuscle.control import PID, OnOffController
from airmuscle.core import DiagnosticCode, model, ops, parameter
from airmuscle.engine import (
    PWM,
    ControlLaw,
    ControlLoop,
    DormandPrince8,
    Problem,
    Rodas4,
    RungeKutta4,
    SampledSignal,
    Schedule,
    SolenoidDriver,
    solve,
)
from airmuscle.engine.run import compiled_loop
from airmuscle.errors import ParameterError, TraceError
from airmuscle.physics import Isometric

ON_OFF = OnOffController("pressure", SPLIT, hysteresis=1e4)
STEPS = Schedule({"pressure": ((0, 1e5), (0.5, 3e5), (1.005, 2e5))})
PULSES = PWM(50.0, 1e-3)
SOLENOID = SolenoidDriver(2e-3, 1.5e-3, 1e-3, 1.2e-3)
DRIVERS = {
    "held": {},
    "pulsed": {"fill": PULSES, "discharge": PULSES},
    "delayed": {"fill": SOLENOID, "discharge": SolenoidDriver(3e-3)},
    "pulsed and delayed": {"fill": (PULSES, SOLENOID), "discharge": (PWM(31.0), SOLENOID)},
    "one of two": {"discharge": (PULSES, SOLENOID)},
}


def both(problem: Problem):
    """The solutions of a problem by one program, and by calls of the controller; with drivers
    called from Python too, the second is the same to the last bit."""
    loop = problem.input
    called = dataclasses.replace(
        problem, input=dataclasses.replace(loop, controller=Called(loop.controller))
    )
    by_program = solve(problem)
    by_calls = solve(called)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(compiled_loop, "are_called", lambda prepared: True)
        assert_identical(by_calls, solve(called))
    texts = [
        d.text
        for s in (by_program, by_calls)
        for d in s.diagnostics
        if d.code == DiagnosticCode.CONTROLLER
    ]
    assert ["compiled" in text for text in texts] == [True, False], texts
    return by_program, by_calls


@pytest.mark.parametrize(
    "integrator",
    [Rodas4(), RungeKutta4(1e-3), DormandPrince8(2e-3)],
    ids=lambda i: type(i).__name__,
)
@pytest.mark.parametrize("drivers", DRIVERS.values(), ids=DRIVERS)
def test_an_on_off_loop_is_the_same_to_the_last_bit(drivers, integrator):
    loop = ControlLoop(ON_OFF, 0.0125, STEPS, drivers=drivers)
    assert_identical(*both(Problem(LIFT, loop, 1.5, integrator=integrator)))


@pytest.mark.parametrize("drivers", DRIVERS.values(), ids=DRIVERS)
def test_a_pid_loop_is_the_same_to_rounding_errors(drivers):
    pid = PID("pressure", SPLIT, gain=8e-6, integral_time=0.3, derivative_time=0.02)
    loop = ControlLoop(pid, 0.01, STEPS, drivers=drivers)
    one, other = both(Problem(LIFT, loop, 1.5, output_times=0.01, integrator=RungeKutta4(5e-4)))
    times = np.intersect1d(one.recording["time"], other.recording["time"])
    assert times.size > 140
    for name in ("pressure", "position", "command.fill", "measured.pressure"):
        a, b = (
            s.recording[name][np.searchsorted(s.recording["time"], times)] for s in (one, other)
        )
        assert np.abs(a - b).max() <= 1e-9 * np.abs(b).max(), name


def test_a_run_in_two_parts_is_the_run_in_one():
    loop = ControlLoop(ON_OFF, 0.0125, STEPS, drivers=DRIVERS["pulsed and delayed"])
    whole = solve(Problem(LIFT, loop, 1.25))
    for middle in (0.625, 0.63):  # at a sampling instant, and between two
        first = solve(Problem(LIFT, loop, middle))
        problem = Problem(
            LIFT,
            loop,
            1.25 - middle,
            first.final_state,
            first.final_time,
            control_state=first.control_state,
        )
        second, called = both(problem)
        assert_identical(second, called)
        assert second.final_state["position"] == pytest.approx(
            whole.final_state["position"], rel=1e-6
        )
        assert second.control_state.sample_count == whole.control_state.sample_count == 100


def test_other_inputs_with_ramps_pass_through_drivers():
    other = SampledSignal({"discharge": ((0.0, 0.0), (0.3, 0.9), (0.9, 0.1), (1.0, 0.6))})
    on = OnOffController("pressure", "fill", hysteresis=1e4)
    for driver in (PWM(40.0, 1e-3), SOLENOID, (PWM(40.0), SOLENOID)):
        loop = ControlLoop(on, 0.01, STEPS, other, {"discharge": driver})
        assert_identical(*both(Problem(LIFT, loop, 1.0)))


def test_a_measured_output_is_measured_before_the_command():
    on = OnOffController("force", SPLIT, hysteresis=5.0)
    loop = ControlLoop(on, 0.01, Schedule({"force": ((0, 20.0), (0.5, 60.0))}))
    assert_identical(
        *both(Problem(dataclasses.replace(LIFT, mechanism=Isometric(0.02)), loop, 1.0))
    )


drivers = st.one_of(
    st.builds(PWM, st.floats(5.0, 300.0), st.floats(0.0, 1e-3)),
    st.builds(
        SolenoidDriver, *[st.sampled_from([0.0, 1e-3, 2e-3, 1e-2]) | st.floats(0.0, 0.03)] * 4
    ),
)


@given(
    st.lists(drivers, min_size=1, max_size=2),
    st.lists(st.floats(0.0, 1.0), min_size=1, max_size=12),
    st.floats(2e-3, 0.05),
)
def test_any_driver_is_the_same_to_the_last_bit(chain, commands, sample_time):
    """The set point is the command: what drivers make of it does not depend on the plant."""
    knots = tuple((i * 3 * sample_time, value) for i, value in enumerate(commands))
    loop = ControlLoop(
        Direct(), sample_time, Schedule({"fill": knots}), drivers={"fill": tuple(chain)}
    )
    duration = 3.4 * len(commands) * sample_time
    assert_identical(*both(Problem(LIFT, loop, duration, integrator=RungeKutta4(sample_time))))


@model
class Direct(ControlLaw):
    """The command is the set point."""

    measured_columns = property(lambda self: ())
    setpoints = property(lambda self: ("fill",))
    inputs = property(lambda self: ("fill",))
    initial_memory = property(lambda self: {})

    def step(
        self, memory: Mapping[str, Any], measurement: Any, dt: Any
    ) -> tuple[dict[str, Any], dict[str, Any]]:
        return {"fill": measurement.setpoints["fill"]}, {}


@pytest.mark.parametrize(
    "drivers", [DRIVERS["held"], DRIVERS["pulsed and delayed"]], ids=["held", "driven"]
)
def test_pauses_and_short_buffers_change_nothing(drivers, monkeypatch):
    loop = ControlLoop(ON_OFF, 0.0125, STEPS, drivers=drivers)
    problem = Problem(LIFT, loop, 1.0)
    whole = solve(problem)
    monkeypatch.setattr(compiled_loop, "INTERRUPT_CHECK_STEPS", 3)
    monkeypatch.setattr(compiled_loop, "FIRST_SEGMENTS", 1)
    monkeypatch.setattr("airmuscle.engine.run.integrators.INTERRUPT_CHECK_STEPS", 1)
    assert_identical(solve(dataclasses.replace(problem)), whole)


def test_an_interruption_keeps_complete_intervals_and_the_run_goes_on_from_there(monkeypatch):
    loop = ControlLoop(ON_OFF, 0.0125, STEPS, drivers=DRIVERS["pulsed"])
    problem = Problem(LIFT, loop, 1.0)
    whole = solve(problem)
    monkeypatch.setattr(compiled_loop, "INTERRUPT_CHECK_STEPS", 40)
    calls = []

    def interrupt(run):
        calls.append(run)
        if len(calls) == 3:
            raise KeyboardInterrupt
        return False

    monkeypatch.setattr(compiled_loop.CompiledRun, "_takes_too_many_steps", interrupt)
    stopped = solve(problem)
    assert stopped.status == Status.INTERRUPTED
    assert 0.0 < stopped.final_time < 1.0
    monkeypatch.undo()
    rest = Problem(
        LIFT,
        loop,
        1.0 - stopped.final_time,
        stopped.final_state,
        stopped.final_time,
        control_state=stopped.control_state,
    )
    assert solve(rest).final_state == whole.final_state


@model
class Root(ControlLaw):
    """A law whose command is not a number after a while."""

    limit: float = parameter("s", "t", "time until the command is not a number", default=0.1)

    measured_columns = property(lambda self: ("pressure",))
    setpoints = property(lambda self: ())
    inputs = property(lambda self: ("fill",))
    initial_memory = property(lambda self: {"time": 0.0})

    def step(
        self, memory: Mapping[str, Any], measurement: Any, dt: Any
    ) -> tuple[dict[str, Any], dict[str, Any]]:
        return {"fill": ops.sqrt(self.limit - memory["time"])}, {"time": memory["time"] + dt}


@pytest.mark.filterwarnings("error")  # of NumPy, which a user could not place
def test_a_command_that_is_not_a_number_ends_the_run():
    one, other = both(Problem(LIFT, ControlLoop(Root(), 0.03125, Schedule({})), 1.0))
    assert one.status == Status.NON_FINITE_COMMAND
    assert_identical(one, other)
    assert one.control_state.controller == {"time": 0.125}


def test_a_run_that_fails_within_an_interval_returns_what_it_has():
    """A fixed step that is far too long for the valves."""
    loop = ControlLoop(ON_OFF, 0.4, STEPS)
    one, other = both(Problem(LIFT, loop, 4.0, integrator=RungeKutta4(0.2)))
    assert one.status in (Status.NOT_FINITE, Status.NEGATIVE_AIR_MASS, Status.NON_POSITIVE_VOLUME)
    assert 0 < len(one.recording) < 200
    assert_identical(one, other)


@model
class Branching(ControlLaw):
    """A law with an `if` on a measurement, which a symbol cannot answer."""

    measured_columns = property(lambda self: ("pressure",))
    setpoints = property(lambda self: ())
    inputs = property(lambda self: ("fill",))
    initial_memory = property(lambda self: {})

    def step(self, memory: Any, measurement: Any, dt: Any) -> Any:
        return {"fill": 1.0 if measurement.columns["pressure"] < 1e5 else 0.0}, {}


@model
class Forgetful(Root):
    """A law that does not return its memory."""

    def step(self, memory: Any, measurement: Any, dt: Any) -> Any:
        return {"fill": 0.0}, {}


def test_a_law_that_cannot_be_compiled_is_named_with_what_to_do():
    with pytest.raises(
        TraceError,
        match=r"Branching.step cannot be compiled .*ops.*derive the controller from Controller",
    ):
        solve(Problem(LIFT, ControlLoop(Branching(), 0.1, Schedule({})), 1.0))
    with pytest.raises(TraceError, match=r"Forgetful.step does not return 'time'"):
        solve(Problem(LIFT, ControlLoop(Forgetful(), 0.1, Schedule({})), 1.0))


def test_the_parameters_of_a_law_are_numbers_of_one_program():
    runs = [
        solve(Problem(LIFT, ControlLoop(OnOffController("pressure", SPLIT, h), 0.0125, STEPS), 1.0))
        for h in (1e4, 8e4)
    ]
    assert runs[0].final_state != runs[1].final_state


def test_a_pulse_train_of_too_many_periods_is_an_error():
    loop = ControlLoop(ON_OFF, 10.0, STEPS, drivers={"fill": PWM(1e6)})
    with pytest.raises(ParameterError, match="periods in"):
        solve(Problem(LIFT, loop, 20.0))
