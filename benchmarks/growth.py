"""Computation time per simulated second over tolerance, number of muscles and PWM frequency."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping

import numpy as np
from filling import DURATION, SPACING, Array, Run, lifting_run, runs
from measure import Section, format_time, print_section, time_variants
from new_plant import compile_anew

import airmuscle as am
from airmuscle.engine.compile.program import compile_system

TOLERANCES = tuple(10.0**-k for k in range(3, 11))
MUSCLES = (1, 2, 4, 6, 12, 24)
FREQUENCIES = (10.0, 20.0, 50.0, 100.0, 200.0)
PULSED = 5.0
"""Simulated time with pulse-width modulation [s]."""
REFERENCE = 1e-12
HEADER = (
    *(
        "varied",
        "plant",
        "value",
        "time per simulated second",
        "steps per simulated second",
        "one step",
    ),
    *("maximum error [m]", "preparation"),
)
TEXT = (
    "The kernel of Rodas4 alone, output every 10 ms; the reference is Rodas4 at rtol 1e-12."
    " Parallel muscles on one mass are filled one after the other, so that more muscles also mean"
    " more restarts. With PWM both valves of every muscle are driven by pulses, whose switching"
    " times are met exactly. Preparation: the time to trace, generate and compile a new plant; with"
    " PWM, the time to generate the pulses of one simulated second."
)
Row = tuple[str, ...]


@dataclasses.dataclass(frozen=True, eq=False)
class Case:
    """One row of the table: a run with its duration and tolerance."""

    varied: str
    plant: str
    value: str
    run: Run
    segments: am.engine.PiecewiseLinear
    duration: float
    rtol: float = 1e-6

    def kernel(self, rtol: float | None = None) -> Callable[[], Array]:
        """A call of the kernel, with another tolerance for the reference."""
        bound = am.Rodas4(rtol or self.rtol).bind(compile_system(self.run.system))
        state = self.run.vector
        times = np.linspace(0.0, self.duration, round(self.duration / SPACING) + 1)
        return lambda: bound.run(self.segments, 0.0, state, times)


def measure_cases(cases: list[Case], rounds: int, preparation: Mapping[str, float]) -> list[Row]:
    """The rows of the cases, timed in turn; `preparation` [s] by `plant` and `value` is the last
    column.
    """
    times = time_variants({f"{c.plant}{c.value}": c.kernel() for c in cases}, rounds)
    rows = []
    references = {}
    for case, time in zip(cases, times.values(), strict=True):
        key = (id(case.run), id(case.segments))
        if key not in references:
            references[key] = case.kernel(REFERENCE)().rows
        solution = case.kernel()()
        error = case.run.error(solution.rows, references[key])
        second = time.median / case.duration
        prepared = preparation.get(f"{case.plant}{case.value}")
        cells = (
            format_time(second),
            f"{solution.steps / case.duration:.3g}",
            format_time(time.median / solution.steps),
        )
        rows.append(
            (
                case.varied,
                case.plant,
                case.value,
                *cells,
                f"{error:.1e}",
                format_time(prepared) if prepared else "",
            )
        )
    return rows


def by_tolerance(rounds: int) -> list[Row]:
    """Rows for one, two and six muscles over the tolerance."""
    rows = []
    for states, plant in (
        (3, "1 muscle, 3 states"),
        (10, "2 muscles, 10 states"),
        (8, "6 muscles, 8 states"),
    ):
        run = runs()[states]
        segments = run.segments
        cases = [
            Case("tolerance", plant, f"{rtol:.0e}", run, segments, DURATION, rtol)
            for rtol in TOLERANCES
        ]
        rows += measure_cases(cases, rounds, {})
    return rows


def by_muscles(rounds: int) -> list[Row]:
    """Rows over the number of muscles in one plant."""
    each = {k: lifting_run(k) for k in MUSCLES}
    cases = [
        Case("muscles", "on one mass", str(k), run, run.segments, DURATION)
        for k, run in each.items()
    ]
    compiling = time_variants(
        {f"on one mass{k}": lambda s=run.system: compile_anew(s) for k, run in each.items()}, 1
    )
    return measure_cases(cases, rounds, {name: time.minimum for name, time in compiling.items()})


def pwm_command(plant: am.Plant, frequency: float) -> am.engine.WithDrivers:
    """Duty ratios 0.3 of filling and 0.1 of discharge for every muscle; interchanged in the second
    half of the run.
    """
    large = ((0.0, 0.3), (PULSED / 2, 0.1))
    small = ((0.0, 0.1), (PULSED / 2, 0.3))
    duties = {
        f"{p}{name}": duty
        for p in plant.prefixes
        for name, duty in (("fill", large), ("discharge", small))
    }
    return am.engine.WithDrivers(
        am.Schedule(duties), {name: am.engine.PWM(frequency) for name in duties}
    )


def by_frequency(rounds: int) -> list[Row]:
    """Rows for one and six muscles over the PWM frequency."""
    rows = []
    for muscles, label in ((1, "1 muscle"), (6, "6 muscles")):
        run = lifting_run(muscles)

        def driven(frequency: float, run: Run = run) -> am.engine.PiecewiseLinear:
            return pwm_command(run.system, frequency).segments(run.system.inputs, 0.0, PULSED)

        cases = [
            Case("PWM frequency", label, f"{f:g} Hz", run, driven(f), PULSED) for f in FREQUENCIES
        ]
        making = time_variants(
            {f"{label}{f:g} Hz": lambda f=f: driven(f) for f in FREQUENCIES}, rounds
        )
        rows += measure_cases(
            cases, rounds, {name: time.minimum / PULSED for name, time in making.items()}
        )
    return rows


def section(rounds: int = 7) -> Section:
    """The complete benchmark."""
    rows = by_tolerance(rounds) + by_muscles(rounds) + by_frequency(rounds)
    return Section("Computation time per simulated second", TEXT, HEADER, tuple(rows))


if __name__ == "__main__":
    print_section(section())
