"""Time of the public calls, with their checks and their Recording, and the kernel beside them."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from filling import DURATION, SPACING, Run, runs
from measure import Section, Target, format_time, print_section, time_variants
from rodas4 import hand_written_rates, kernel, lsoda

import airmuscle as am
from airmuscle.engine.compile.program import compile_system

HEADER = ("call", "median", "minimum", "kernel", "call / kernel")
STEP = 1e-5
"""Duration of one `advance` [s]."""
SAMPLE_TIME = 5e-3
"""Sample time of the control loops [s]."""
LOOP_DURATION = 5.0
"""Duration of a run of a control loop [s]."""
SETPOINT = am.Schedule({"pressure": ((0.0, 1e5), (1.0, 2e5))})
ADVANCES = 200
TEXT = (
    f"One muscle lifting a mass, 3 states, Rodas4(1e-6). `simulate` runs {DURATION:g} s with a row"
    f" every {SPACING * 1e3:g} ms and returns a Recording of states, outputs and inputs; its kernel"
    f" is the integration alone. `advance` and `Stepper.step` take one step of {STEP * 1e6:g} us;"
    " the kernel beside them is the integration of such steps in one run. The rows of the"
    f" controllers give the time of a run of {LOOP_DURATION:g} s by its"
    f" {LOOP_DURATION / SAMPLE_TIME:g} samples; beside them is the same run with the recorded"
    " commands as its input signal. Where a command does not change this replay has no instant;"
    " the replay with the same instants has all those of the loop, at each of which an integration"
    " step ends."
)


@dataclasses.dataclass(frozen=True)
class Called(am.engine.Controller):
    """A controller that calls a control law from Python."""

    inner: am.PID

    @property
    def measured_columns(self) -> tuple[str, ...]:
        return self.inner.measured_columns

    @property
    def setpoints(self) -> tuple[str, ...]:
        return self.inner.setpoints

    @property
    def inputs(self) -> tuple[str, ...]:
        return self.inner.inputs

    def init(self) -> Any:
        return self.inner.init()

    def step(self, memory: Any, measurement: Any, dt: float) -> Any:
        return self.inner.step(memory, measurement, dt)


LSODA_REASON = (
    "LSODA takes the time of about 59 kernels here, so that 40 needs a call of 1.47 kernels; beside"
    " the kernel, the inputs and outputs of 2501 rows take a sixth of it, and the checks, the"
    " diagnostics and the Recording in Python a quarter, more where the machine is busy"
)
LOOP_REASON = (
    "a loop ends an integration step at each sample, with pulses also at each switching instant:"
    " 1676 steps to 1246 instants, where the replay, whose input has fewer changes, takes 966 to"
    " 493; the row of the replay with the same instants shows the loop alone"
)
CALLED_REASON = (
    "most of it is the controller in Python: `PID.step` takes 5 to 10 us, with the clock of the"
    " machine"
)


@dataclasses.dataclass(frozen=True)
class Applied(am.engine.InputSignal):
    """The inputs of a recording of held and pulsed inputs, with an instant at each row."""

    recording: am.Recording

    def segments(
        self, inputs: Sequence[str], start: float, duration: float
    ) -> am.engine.PiecewiseLinear:
        values = np.stack([self.recording[name][:-1] for name in inputs], axis=1)
        return am.engine.PiecewiseLinear(
            self.recording["time"][1:].copy(), values, np.zeros(values.shape)
        )


def with_default_state(run: Run) -> Callable[[], Any]:
    """A function that calls `simulate` without an initial state."""
    return lambda: am.simulate(run.system, run.command, duration=DURATION, output_times=SPACING)


def with_state(run: Run) -> Callable[[], Any]:
    """A function that calls `simulate` with an initial state."""
    return lambda: am.simulate(
        run.system,
        run.command,
        duration=DURATION,
        initial_state=run.initial_state,
        output_times=SPACING,
    )


def simulations(rounds: int) -> tuple[list[tuple[str, ...]], list[Target]]:
    """`simulate` with and without an initial state, the kernel, and LSODA with the same rows."""
    run = runs()[3]
    ready = compile_system(run.system)
    times = time_variants(
        {
            "kernel": kernel(run, ready),
            "simulate": with_state(run),
            "simulate, default initial state": with_default_state(run),
            "solve_ivp LSODA, hand-written rates": lambda: lsoda(run, hand_written_rates(run)),
        },
        rounds,
    )
    alone = times["kernel"]
    rows = [
        (
            name,
            *(format_time(t) for t in (time.median, time.minimum, alone.median)),
            f"{time.median / alone.median:.2f}",
        )
        for name, time in times.items()
        if name != "kernel"
    ]
    full = times["simulate"]
    default = times["simulate, default initial state"]
    peer = times["solve_ivp LSODA, hand-written rates"]
    targets = [
        Target(
            "call: simulate, beyond 1.5 x kernel",
            (full.minimum - 1.5 * alone.minimum) * 1e6,
            60,
            "us",
        ),
        Target(
            "call: the default initial state, beyond 3 x kernel",
            (default.minimum - 3 * alone.minimum) * 1e6,
            100,
            "us",
        ),
        Target(
            "call: solve_ivp LSODA, hand-written rates / simulate",
            peer.median / full.median,
            40,
            "x",
            at_least=True,
            reason=LSODA_REASON,
        ),
    ]
    return rows, targets


def steps(rounds: int) -> tuple[list[tuple[str, ...]], list[Target]]:
    """`advance` by names and a stepper, one step each."""
    run = runs()[3]
    plant, state = run.system, dict(run.initial_state)
    inputs = dict.fromkeys(plant.inputs, 0.5)
    stepper = am.Stepper(plant, state)
    start, held = stepper.state.copy(), np.full(len(plant.inputs), 0.5)

    def advance() -> None:
        for _ in range(ADVANCES):
            am.advance(plant, state, inputs, STEP)

    def step() -> None:
        stepper.state[:] = start
        for _ in range(ADVANCES):
            stepper.step(held, STEP)

    def integration() -> None:
        """The same steps inside the kernel, in one run that is interrupted at each."""
        bound.run(segments, 0.0, start, times)

    times = np.arange(1, ADVANCES + 1) * STEP
    segments = am.Schedule(
        {name: tuple((t, 0.5) for t in (0.0, *times[:-1])) for name in plant.inputs}
    ).segments(plant.inputs, 0.0, float(times[-1]))
    bound = am.Rodas4(1e-6).bind(compile_system(plant))
    measured = time_variants(
        {"advance": advance, "Stepper.step": step, "kernel": integration}, rounds
    )
    each = {
        name: (time.median / ADVANCES, time.minimum / ADVANCES) for name, time in measured.items()
    }
    alone = each["kernel"]
    rows = [
        (
            name,
            *(format_time(t) for t in (*each[name], alone[0])),
            f"{each[name][0] / alone[0]:.1f}",
        )
        for name in ("advance", "Stepper.step")
    ]
    beside = each["Stepper.step"][1] - alone[1]
    targets = [
        Target("call: advance", each["advance"][1] * 1e6, 40, "us"),
        Target("call: Stepper.step, beside the integration", beside * 1e6, 5, "us"),
    ]
    return rows, targets


def control_samples(rounds: int) -> tuple[list[tuple[str, ...]], list[Target]]:
    """One sample of a loop with a PID, compiled and called from Python: inputs held, and two pulsed
    inputs.
    """
    pid = am.PID(
        "pressure", am.engine.SplitRange("fill", "discharge"), gain=1.5e-5, integral_time=0.4
    )
    pulses = {"fill": am.engine.PWM(50.0), "discharge": am.engine.PWM(50.0)}
    rows = []
    targets = []
    for name, drivers, limits in (("held", {}, (5, 15)), ("two pulsed inputs", pulses, (10, 40))):
        law = am.ControlLoop(pid, SAMPLE_TIME, SETPOINT, drivers=drivers)
        called = am.ControlLoop(Called(pid), SAMPLE_TIME, SETPOINT, drivers=drivers)
        times = _loop_times(law, called, rounds)
        samples = LOOP_DURATION / SAMPLE_TIME
        replay = times["replay"].median / samples
        for kind, limit in (("compiled", limits[0]), ("called from Python", limits[1])):
            whole = times[kind]
            cost = whole.median / samples
            least = whole.minimum / samples
            title = f"a sample of a PID, {kind}, {name}"
            ratio = whole.median / times["replay"].median
            rows.append(
                (title, format_time(cost), format_time(least), format_time(replay), f"{ratio:.2f}")
            )
            if kind == "compiled":
                rows.append(_beside_same_instants(title, times))
                targets.append(Target(f"call: {title}", cost * 1e6, limit, "us"))
                targets.append(
                    Target(
                        f"call: loop / replay of its commands, {name}",
                        ratio,
                        2,
                        "x",
                        reason=LOOP_REASON,
                    )
                )
            else:
                beside = least - times["replay"].minimum / samples
                targets.append(
                    Target(
                        f"call: {title}, beside the integration",
                        beside * 1e6,
                        limit,
                        "us",
                        reason=CALLED_REASON,
                    )
                )
    return rows, targets


def _beside_same_instants(title: str, times: dict[str, Any]) -> tuple[str, ...]:
    """The row of a compiled loop beside the replay that has the same instants."""
    samples = LOOP_DURATION / SAMPLE_TIME
    whole = times["compiled"]
    same = times["same instants"]
    cells = (format_time(t / samples) for t in (whole.median, whole.minimum, same.median))
    return (f"{title}, replay with the same instants", *cells, f"{whole.ratio_to(same):.2f}")


def _loop_times(law: am.ControlLoop, called: am.ControlLoop, rounds: int) -> dict[str, Any]:
    """Times of a run of the loop in both ways, and of the same run with its commands, or its
    inputs, as a signal.
    """
    run = runs()[3]
    problems = {
        kind: am.Problem(
            run.system, loop, LOOP_DURATION, run.initial_state, output_times=LOOP_DURATION
        )
        for kind, loop in (("compiled", law), ("called from Python", called))
    }
    recording = am.solve(problems["compiled"]).recording
    for kind, signal in (
        ("replay", law.as_open_loop(recording)),
        ("same instants", Applied(recording)),
    ):
        problems[kind] = dataclasses.replace(problems["compiled"], input=signal)
    return time_variants(
        {kind: lambda p=problem: am.solve(p) for kind, problem in problems.items()}, rounds
    )


def section(rounds: int = 15) -> Section:
    """The complete benchmark."""
    parts = [simulations(rounds), steps(rounds), control_samples(max(3, rounds // 3))]
    rows = tuple(row for part, _ in parts for row in part)
    return Section(
        "At the call", TEXT, HEADER, rows, tuple(target for _, found in parts for target in found)
    )


if __name__ == "__main__":
    print_section(section())
