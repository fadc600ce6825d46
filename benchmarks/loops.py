"""Control loops in a batch, as they are simulated for the tuning of gains: a lifted load and an
antagonistic joint.
"""

from __future__ import annotations

import dataclasses
import time

import numpy as np
from joints import chosen_muscle
from measure import Section, Target, format_time, print_section

import airmuscle as am
from airmuscle.engine import BatchSolution
from airmuscle.engine.processes import available_cores

COUNT = 10_000
DURATION = 5.0
SAMPLE_TIME = 5e-3
SIMULATED = 400
"""Number of loops that are simulated; times are scaled to COUNT, because all loops cost about the
same.
"""
HEADER = (
    *("plant", "integrator", "CPU time of a loop", "of a sample", f"{COUNT} loops, wall time"),
    *("maximum error", "error of the rms tracking error"),
)
REFERENCE = am.Rodas4(1e-10)
TEXT = (
    f"Loops of {DURATION:g} s with a sample time of {1e3 * SAMPLE_TIME:g} ms and different gains,"
    f" with the columns from which the tuning computes its metrics. {SIMULATED} loops are simulated"
    f" and the wall time is scaled to {COUNT}. The lifted load has three states and a cascade of"
    " two PID; the joint has four states, feed-forward, and three PID. Maximum error: greatest"
    f" difference of the controlled column to {REFERENCE}. Error of the rms tracking error:"
    " greatest relative difference of this metric among the loops. Loops with RungeKutta4 run in"
    " vector lanes, the others one by one; `tune` uses the default integrator, Rodas4(1e-6),"
    " unless another is given. All numbers of the plants are chosen."
)
REASON = (
    "loops with an adaptive step run one by one, those of RungeKutta4 in vector lanes; with a step"
    " of 0.625 ms their rms tracking error differs by less than 1e-6 of it from the exact one, see"
    " the table"
)


@dataclasses.dataclass(frozen=True)
class LoopVariant:
    """A plant with its loop, initial state, the path of the varied gain with its values, and its
    columns.
    """

    name: str
    plant: am.Plant
    loop: am.ControlLoop
    start: dict[str, float]
    gain: str
    gains: tuple[float, float]
    columns: tuple[str, ...]

    def simulate(
        self, count: int, duration: float, integrator: am.engine.Integrator
    ) -> BatchSolution:
        """So many loops with gains between both values."""
        gains = np.geomspace(*self.gains, count)
        return am.simulate_batch(
            self.plant,
            {f"controller.{self.gain}": gains},
            self.loop,
            duration=duration,
            initial_states=self.start,
            output_times=SAMPLE_TIME,
            integrator=integrator,
            keep=self.columns,
        )


def lifted_load() -> LoopVariant:
    """A cascade of position and pressure control."""
    valve = am.Valve(2.6e-9, 0.4)
    plant = am.Plant(
        chosen_muscle(), am.FillDischarge(am.Supply(5.5e5), valve, valve), am.HangingMass(2.0)
    )
    inner = am.PID("pressure", am.engine.SplitRange("fill", "discharge"), gain=5e-5)
    law = am.control.Cascade(
        am.PID("position", "pressure", 4e6, 0.3, initial_output=1e5), inner, (0.0,), (5e5,)
    )
    loop = am.ControlLoop(
        law, SAMPLE_TIME, am.Schedule({"position": ((0, 0.01), (1, 0.02), (3, 0.01))})
    )
    columns = ("position", "setpoint.position", "command.fill", "command.discharge", "air_mass")
    start = am.find_equilibrium(plant, pressure=1e5)
    return LoopVariant("lifted load", plant, loop, start, "outer.gain", (1e6, 8e6), columns)


def joint() -> LoopVariant:
    """Control of angle and stiffness, with a pressure controller for each muscle."""
    valve = am.Valve(1e-8, 0.4)
    names = ("left", "right")
    muscles = tuple(dataclasses.replace(chosen_muscle(), name=name) for name in names)
    mechanism = am.physics.AntagonisticJoint(
        radius=0.02, inertia=0.02, damping=0.05, weight_torque=0.5, offset=0.08
    )
    circuit = am.FillDischarge(am.Supply(5.5e5), valve, valve)
    plant = am.Plant(muscles, (circuit, circuit), mechanism)
    inverse = am.control.AntagonisticInverse(muscles, mechanism, 0.2e5, 5e5)
    inner = am.control.Decentralised(
        tuple(
            am.PID(f"{n}.pressure", am.engine.SplitRange(f"{n}.fill", f"{n}.discharge"), gain=2e-5)
            for n in names
        )
    )
    outer = am.control.AngleAndStiffness(
        inverse, ("left.pressure", "right.pressure"), gain=5.0, integral_time=0.5
    )
    law = am.control.Cascade(outer, inner, (0.2e5,) * 2, (5e5,) * 2)
    stiffness = float(inverse.stiffness(2e5, 2e5, 0.0))
    wanted = am.Schedule({"angle": ((0, 0.0), (1, 0.2), (3, 0.0)), "stiffness": ((0, stiffness),)})
    columns = (
        "angle",
        "setpoint.angle",
        *(f"command.{n}.{i}" for n in names for i in ("fill", "discharge")),
    )
    start = am.find_equilibrium(plant, pressure=2e5)
    return LoopVariant(
        "joint",
        plant,
        am.ControlLoop(law, SAMPLE_TIME, wanted),
        start,
        "outer.gain",
        (2.0, 10.0),
        columns,
    )


def section(rounds: int = 5, count: int = SIMULATED, duration: float = DURATION) -> Section:
    """The complete benchmark."""
    rows = []
    targets = []
    for case in (lifted_load(), joint()):
        reference = case.simulate(count, duration, REFERENCE)
        for integrator in (
            am.Rodas4(),
            am.Rodas4(1e-4),
            am.RungeKutta4(2.5e-3),
            am.RungeKutta4(6.25e-4),
        ):
            errors = _errors(case, case.simulate(count, duration, integrator), reference)
            cpu, wall = _times(case, count, duration, integrator, rounds)
            samples = duration / SAMPLE_TIME
            total = wall * COUNT
            times = format_time(cpu), format_time(cpu / samples), format_time(total)
            rows.append((case.name, str(integrator), *times, *(f"{error:.1e}" for error in errors)))
            in_lanes = integrator == am.RungeKutta4(2.5e-3)
            if in_lanes or (case.name == "lifted load" and integrator == am.Rodas4()):
                method = "RungeKutta4 in lanes" if in_lanes else "default integrator"
                name = (
                    f"{COUNT} loops of {DURATION:g} s on {available_cores()} cores, {case.name},"
                    f" {method}"
                )
                targets.append(Target(name, total * DURATION / duration, 10.0, "s", reason=REASON))
    return Section("Control loops in a batch", TEXT, HEADER, tuple(rows), tuple(targets))


def _errors(
    case: LoopVariant, batch: BatchSolution, reference: BatchSolution
) -> tuple[float, float]:
    """The greatest error of the controlled column, and of its rms tracking error, relative to the
    latter.
    """
    column = case.columns[0]
    given, exact = (np.asarray(each[column], dtype=float) for each in (batch, reference))
    wanted = np.asarray(reference[f"setpoint.{column}"], dtype=float)
    rms, exact_rms = (np.sqrt(np.mean((each - wanted) ** 2, axis=1)) for each in (given, exact))
    return float(np.abs(given - exact).max()), float(np.abs(rms / exact_rms - 1.0).max())


def _times(
    case: LoopVariant, count: int, duration: float, integrator: am.engine.Integrator, rounds: int
) -> tuple[float, float]:
    """Minimum CPU time and minimum wall time of a loop [s]."""
    cpu = []
    wall = []
    for _ in range(rounds):
        begin = time.process_time()
        started = time.perf_counter()
        case.simulate(count, duration, integrator)
        cpu.append((time.process_time() - begin) / count)
        wall.append((time.perf_counter() - started) / count)
    return min(cpu), min(wall)


if __name__ == "__main__":
    print_section(section())
