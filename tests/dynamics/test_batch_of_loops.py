"""A batch of control loops is each loop alone: plants, gains, set points and disturbances differ
from row to row, and every row is what `solve` gives for it, to the last bit, whether its controller
is compiled or called from Python.
"""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import pytest
from called_controller import Called
from control_plants import LIFT, SPLIT

from airmuscle import Status
from airmuscle.control import PID, OnOffController
from airmuscle.engine import (
    PWM,
    ControlLoop,
    Driver,
    Periodic,
    Problem,
    Rodas4,
    RungeKutta4,
    Schedule,
    Single,
    SolenoidDriver,
    simulate_batch,
    solve,
)
from airmuscle.engine.compile.cache.kernel import loop_lanes
from airmuscle.engine.run import BoundIntegrator
from airmuscle.errors import ParameterError
from airmuscle.physics import HangingMass, Plant

PI = PID("pressure", SPLIT, gain=8e-6, integral_time=0.3)
STEPS = Schedule({"pressure": ((0, 1e5), (0.25, 3e5))})
PULSES = {name: (PWM(50.0, 1e-3), SolenoidDriver(2e-3, 1.5e-3)) for name in ("fill", "discharge")}
TIMES = np.linspace(0.0, 0.75, 31)


LANES = 1e-10
"""Difference of a loop in a lane to the same loop alone, divided by the size of the column."""


def alone(plant: Plant, loop: ControlLoop, integrator: Any = None, **options: Any):
    return solve(
        Problem(plant, loop, 0.75, output_times=TIMES, integrator=integrator or Rodas4(), **options)
    )


def assert_rows_are(batch, row: int, solution, columns, relative=0.0):
    recording = solution.recording
    at = np.searchsorted(recording["time"], TIMES - 1e-12)
    for name in columns:
        expected = recording[name][at]
        limit = relative * np.abs(expected).max()
        np.testing.assert_allclose(batch[name][row], expected, rtol=0.0, atol=limit, err_msg=name)
    for name, value in solution.final_state.items():
        assert batch.final[name][row] == pytest.approx(
            value, rel=relative, abs=0.0 if not relative else 1e-12
        )


@pytest.mark.parametrize("drivers", [{}, PULSES], ids=["held", "pulsed"])
@pytest.mark.parametrize(
    "integrator", [Rodas4(), RungeKutta4(1e-3)], ids=["implicit", "fixed step"]
)
def test_plants_and_gains_differ(drivers, integrator):
    masses = np.array([1.0, 2.0, 2.5])
    gains = np.array([4e-6, 1e-5, 2e-5])
    loop = ControlLoop(PI, 0.0125, STEPS, drivers=drivers)
    varied = {"mechanism.mass": masses, "controller.gain": gains}
    batch = simulate_batch(
        LIFT, varied, loop, duration=0.75, output_times=TIMES, integrator=integrator
    )
    names = [
        "air_mass",
        "position",
        "pressure",
        "fill",
        "setpoint.pressure",
        "measured.pressure",
        "command.discharge",
    ]
    assert set(names) <= set(batch.columns)
    assert not batch.failed.size
    for row in range(3):
        plant = dataclasses.replace(LIFT, mechanism=HangingMass(masses[row]))
        own = dataclasses.replace(loop, controller=dataclasses.replace(PI, gain=gains[row]))
        in_lanes = not drivers and isinstance(integrator, RungeKutta4)
        assert_rows_are(
            batch, row, alone(plant, own, integrator), names, LANES if in_lanes else 0.0
        )
    assert np.unique(batch["position"][:, -1]).size == 3


def test_loops_in_lanes_are_machine_code_that_is_stored():
    """Otherwise numba compiles them in each process."""
    simulate_batch(
        LIFT,
        {"mechanism.mass": np.array([1.0, 2.0])},
        ControlLoop(PI, 0.0125, STEPS),
        duration=0.1,
        integrator=RungeKutta4(1e-3),
    )
    assert loop_lanes._entries
    assert all(loop_lanes._entries.values())


def test_each_plant_may_have_its_own_loop():
    """Set points, disturbances by the other input, and controllers of several kinds."""
    loops = [
        ControlLoop(PI, 0.0125, Schedule({"pressure": ((0, 2e5),)})),
        ControlLoop(PI, 0.025, STEPS),
        ControlLoop(
            OnOffController("pressure", SPLIT, hysteresis=5e3), 0.0125, STEPS, drivers=PULSES
        ),
    ]
    batch = simulate_batch(LIFT, {}, loops, duration=0.75, output_times=TIMES)
    for row, loop in enumerate(loops):
        assert_rows_are(
            batch, row, alone(LIFT, loop), ["pressure", "command.fill", "measured.pressure"]
        )


def test_disturbances_differ():
    loops = [
        ControlLoop(
            dataclasses.replace(PI, commanded="fill"),
            0.0125,
            STEPS,
            Schedule({"discharge": ((0, 0.0), (0.2, opening))}),
        )
        for opening in (0.0, 0.05, 0.4)
    ]
    batch = simulate_batch(LIFT, {}, loops, duration=0.75, output_times=TIMES)
    for row, loop in enumerate(loops):
        assert_rows_are(batch, row, alone(LIFT, loop), ["pressure", "discharge"])


def test_loops_in_lanes_may_differ_in_set_points_disturbances_and_gains():
    """Eighteen loops with common instants fill one block of lanes and a part of another."""
    pi = dataclasses.replace(PI, commanded="fill")
    loops = [
        ControlLoop(
            dataclasses.replace(pi, gain=gain),
            0.0125,
            Schedule({"pressure": ((0, 1e5), (0.25, 1e5 + 2e4 * i))}),
            (
                Schedule({"discharge": ((0, 0.0), (0.2, 0.02 * i))})
                if i
                else Schedule({"discharge": ((0, 0.0), (0.2, 1.0))})
            ),
        )
        for i, gain in enumerate(np.linspace(4e-6, 2e-5, 18))
    ]
    batch = simulate_batch(
        LIFT, {}, loops, duration=0.75, output_times=TIMES, integrator=RungeKutta4(1e-3)
    )
    names = ["pressure", "discharge", "setpoint.pressure", "measured.pressure", "command.fill"]
    for row in (0, 7, 17):
        assert_rows_are(batch, row, alone(LIFT, loops[row], RungeKutta4(1e-3)), names, LANES)


def test_rows_between_samples_and_measured_outputs_are_those_of_the_loop_alone():
    """The air flow jumps with the command: it is measured before it and shown after it."""
    law = PID("force", SPLIT, gain=1e-3, integral_time=0.2)
    loop = ControlLoop(law, 0.0125, Schedule({"force": ((0, 30.0), (0.3, 40.0))}))
    masses = np.array([1.0, 2.0])
    times = np.array([0.0, 0.0031, 0.0125, 0.0299, 0.03, 0.1, 0.7431, 0.75])
    fixed = RungeKutta4(1e-3)
    batch = simulate_batch(
        LIFT, {"mechanism.mass": masses}, loop, duration=0.75, output_times=times, integrator=fixed
    )
    for row, mass in enumerate(masses):
        plant = dataclasses.replace(LIFT, mechanism=HangingMass(mass))
        recording = solve(
            Problem(plant, loop, 0.75, output_times=times, integrator=fixed)
        ).recording
        at = np.searchsorted(recording["time"], times - 1e-12)
        for name in ("pressure", "speed", "force", "fill", "measured.force", "command.discharge"):
            limit = LANES * np.abs(recording[name]).max()
            np.testing.assert_allclose(
                batch[name][row], recording[name][at], rtol=0.0, atol=limit, err_msg=name
            )


def test_a_controller_that_is_called_from_python():
    loop = ControlLoop(Called(PI), 0.0125, STEPS, drivers=PULSES)
    masses = np.array([1.0, 2.0])
    batch = simulate_batch(
        LIFT, {"mechanism.mass": masses}, loop, duration=0.75, output_times=TIMES
    )
    for row, mass in enumerate(masses):
        plant = dataclasses.replace(LIFT, mechanism=HangingMass(mass))
        assert_rows_are(batch, row, alone(plant, loop), ["pressure", "command.fill"])
    with pytest.raises(
        ParameterError, match=r"'controller.gain' varies .* its controller is no ControlLaw"
    ):
        simulate_batch(LIFT, {"controller.gain": [1.0, 2.0]}, loop, duration=0.75)


@dataclasses.dataclass(frozen=True)
class Counting(Called):
    """A controller that changes its memory in place, which it should not: one pulse, then
    nothing.
    """

    def init(self) -> Any:
        return [0]

    def step(self, memory: Any, measurement: Any, dt: float) -> Any:
        memory[0] += 1
        return {"fill": float(memory[0] < 20), "discharge": 0.0}, memory


def test_a_memory_that_is_changed_in_place_does_not_reach_the_next_plant():
    loop = ControlLoop(Counting(PI), 0.0125, STEPS)
    masses = np.array([1.0, 2.0, 3.0])
    batch = simulate_batch(
        LIFT, {"mechanism.mass": masses}, loop, duration=0.75, output_times=TIMES, cores=1
    )
    commands = np.asarray(batch["command.fill"])
    assert commands[0].any()
    assert (commands == commands[0]).all()


@dataclasses.dataclass(frozen=True)
class OwnDriver(Driver):
    """A driver of another class than those that kernels implement."""

    inner: Driver

    def init(self, start: float) -> Any:
        return self.inner.init(start)

    def step(self, state: Any, command: Any, start: float) -> Any:
        return self.inner.step(state, command, start)


@pytest.mark.parametrize("way", ["own driver", "no machine code"])
def test_gains_differ_also_where_drivers_are_called_from_python(way, monkeypatch):
    """The kernel of a loop neither knows a driver of the user nor calls an integrator that has no
    machine code.
    """
    own = way == "own driver"
    if not own:
        monkeypatch.setattr(BoundIntegrator, "entry_address", property(lambda self: None))
    drivers = {"fill": OwnDriver(PWM(50.0)) if own else PWM(50.0)}
    switching = OnOffController("pressure", SPLIT, hysteresis=1e4)
    gains = np.array([1e4, 8e4])
    batch = simulate_batch(
        LIFT,
        {"controller.hysteresis": gains},
        ControlLoop(switching, 0.0125, STEPS, drivers=drivers),
        duration=0.75,
        output_times=TIMES,
    )
    monkeypatch.undo()
    for row, gain in enumerate(gains):
        law = dataclasses.replace(switching, hysteresis=gain)
        loop = ControlLoop(law, 0.0125, STEPS, drivers={"fill": PWM(50.0)})
        assert_rows_are(
            batch, row, alone(LIFT, loop), ["pressure", "setpoint.pressure", "command.fill"]
        )
    assert not np.array_equal(*batch["pressure"])


def test_a_driver_of_the_user_may_return_many_segments():
    """More than the signals and the buffers of a run hold at first."""
    quick = PWM(4e4)
    runs = []
    for driver in (quick, OwnDriver(quick)):
        switching = OnOffController("pressure", SPLIT, hysteresis=1e4)
        runs.append(
            alone(
                LIFT,
                ControlLoop(
                    switching, 0.0125, STEPS, drivers={"fill": (driver, SolenoidDriver(1e-3))}
                ),
            )
        )
    first, second = runs
    assert first.final_state == second.final_state
    assert dict(first.control_state.drivers) == dict(second.control_state.drivers)


def test_final_states_alone_need_no_rows():
    gains = np.array([4e-6, 2e-5])
    loop = ControlLoop(PI, 0.0125, STEPS)
    kept = simulate_batch(LIFT, {"controller.gain": gains}, loop, duration=0.75, output_times=TIMES)
    bare = simulate_batch(LIFT, {"controller.gain": gains}, loop, duration=0.75, keep=())
    for name, values in kept.final.items():
        assert bare.final[name] == pytest.approx(values, rel=1e-12)


def test_a_loop_that_fails_does_not_stop_the_others():
    loop = ControlLoop(PI, 0.4, STEPS)
    gains = np.array([1e-9, 1e-3, 1e-9, 1e-3])
    batch = simulate_batch(
        LIFT,
        {"controller.gain": gains},
        loop,
        duration=4.0,
        integrator=RungeKutta4(0.15),
        output_times=0.1,
        cores=1,
    )
    for row, gain in enumerate(gains):
        own = dataclasses.replace(loop, controller=dataclasses.replace(PI, gain=gain))
        solution = solve(Problem(LIFT, own, 4.0, integrator=RungeKutta4(0.15), output_times=0.1))
        assert Status(int(batch.status[row])) == solution.status
        if solution.status == Status.DONE:  # also in the arrays of a run that failed
            expected = solution.recording["pressure"]
            np.testing.assert_allclose(
                batch["pressure"][row], expected, rtol=0.0, atol=LANES * np.abs(expected).max()
            )
    assert batch.failed.tolist() == [0, 2]
    assert np.isnan(batch["pressure"][0, -1])
    assert np.isfinite(batch["pressure"][1]).all()


def refused(message: str, **changes: Any) -> None:
    given = {
        "plant": LIFT,
        "variations": {},
        "input": ControlLoop(PI, 0.0125, STEPS),
        "duration": 0.75,
        **changes,
    }
    with pytest.raises(ParameterError, match=message):
        simulate_batch(given.pop("plant"), given.pop("variations"), given.pop("input"), **given)


def test_bad_batches_of_loops():
    loop = ControlLoop(PI, 0.0125, STEPS)
    refused("nothing varies")
    refused("control loops and signals", input=[loop, Schedule({"fill": ((0, 1.0),)})])
    other = ControlLoop(dataclasses.replace(PI, commanded="fill"), 0.0125, STEPS)
    refused("row 1: PID measures or commands other columns", input=[loop, other])
    refused(
        "no parameter 'gian'; .* Did you mean 'gain'", variations={"controller.gian": [1.0, 2.0]}
    )
    refused("row 1: 'setpoint_weight'", variations={"controller.setpoint_weight": [0.5, 2.0]})
    refused(
        "there is one loop for each plant",
        input=[loop, loop],
        variations={"controller.gain": [1.0, 2.0]},
    )
    refused(
        "one value per plant",
        variations={"controller.gain": [1e-6, 2e-6], "mechanism.mass": [1.0, 2.0, 3.0]},
    )
    refused(
        "double precision",
        variations={"controller.gain": [1e-6, 2e-6]},
        precision=Single(),
        integrator=RungeKutta4(1e-3),
    )
    periodic = ControlLoop(PI, 2.0, Periodic(STEPS, 0.5))
    refused("longer than the run", input=periodic, variations={"controller.gain": [1e-6, 2e-6]})
