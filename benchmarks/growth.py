"""How the cost of a simulated second grows: with the tolerance, with muscles in a plant, with a carrier's frequency."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping

import numpy as np
from filling import DURATION, SPACING, Array, Run, lifts, runs
from measure import Section, interleaved, of_time, show
from new_plant import fresh

from airmuscle.compile.program import compile_system
from airmuscle.control.driver import PWM
from airmuscle.control.inputs import Schedule
from airmuscle.control.piecewise_linear import PiecewiseLinear
from airmuscle.control.with_drivers import WithDrivers
from airmuscle.plant.plant import Plant
from airmuscle.simulation.integrators import Rodas4

TOLERANCES = tuple(10.0**-k for k in range(3, 11))
MUSCLES = (1, 2, 4, 6, 12, 24)
FREQUENCIES = (10.0, 20.0, 50.0, 100.0, 200.0)
PULSED = 5.0
"""Seconds under a carrier."""
REFERENCE = 1e-12
HEADING = (
    *("what grows", "plant", "at", "a simulated second", "steps in it", "one step"),
    *("greatest error [m]", "beforehand"),
)
TEXT = (
    "Rodas4, its kernel alone, rows every 10 ms; the reference is Rodas4 at rtol 1e-12. Muscles side by side on one "
    "mass are filled one after the other, so that with more of them there are more instants to start anew from, too. "
    "Under a carrier both valves of every muscle are driven by pulses whose instants are met exactly. Beforehand: the "
    "time to trace, print and compile a plant that was never seen; of a carrier, what its drivers take to make the "
    "instants of a simulated second."
)
Row = tuple[str, ...]


@dataclasses.dataclass(frozen=True, eq=False)
class Case:
    """One row: a run over a time at a tolerance."""

    what: str
    plant: str
    at: str
    run: Run
    segments: PiecewiseLinear
    duration: float
    rtol: float = 1e-6

    def kernel(self, rtol: float | None = None) -> Callable[[], Array]:
        """The run; at another tolerance for the reference."""
        ready, method, state = compile_system(self.run.system), Rodas4(rtol or self.rtol), self.run.vector
        times = np.linspace(0.0, self.duration, round(self.duration / SPACING) + 1)
        return lambda: method.run(ready, self.segments, 0.0, state, times)


def rows_of(cases: list[Case], rounds: int, last: Mapping[str, float]) -> list[Row]:
    """The rows of some cases, timed in turn; `last` is the last column, by `plant` and `at`."""
    times = interleaved({f"{c.plant}{c.at}": c.kernel() for c in cases}, rounds)
    rows, references = [], {}
    for case, time in zip(cases, times.values(), strict=True):
        key = (id(case.run), id(case.segments))
        if key not in references:
            references[key] = case.kernel(REFERENCE)().rows
        course = case.kernel()()
        error = case.run.error(course.rows, references[key])
        second, extra = time.median / case.duration, last.get(f"{case.plant}{case.at}")
        cells = (of_time(second), f"{course.steps / case.duration:.3g}", of_time(time.median / course.steps))
        rows.append((case.what, case.plant, case.at, *cells, f"{error:.1e}", of_time(extra) if extra else ""))
    return rows


def by_tolerance(rounds: int) -> list[Row]:
    """One, two and six muscles at tolerances from coarse to fine."""
    found = []
    for states, plant in ((3, "1 muscle, 3 states"), (10, "2 muscles, 10 states"), (8, "6 muscles, 8 states")):
        run = runs()[states]
        segments = run.segments
        cases = [Case("tolerance", plant, f"{rtol:.0e}", run, segments, DURATION, rtol) for rtol in TOLERANCES]
        found += rows_of(cases, rounds, {})
    return found


def by_muscles(rounds: int) -> list[Row]:
    """More and more muscles in one plant."""
    each = {k: lifts(k) for k in MUSCLES}
    cases = [Case("muscles", "on one mass", str(k), run, run.segments, DURATION) for k, run in each.items()]
    compiling = interleaved({f"on one mass{k}": lambda s=run.system: fresh(s) for k, run in each.items()}, 1)
    return rows_of(cases, rounds, {name: time.least for name, time in compiling.items()})


def pulsed(plant: Plant, frequency: float) -> WithDrivers:
    """Every muscle is filled for three tenths of a period and discharged for one, after half of the run the reverse."""
    more, less = ((0.0, 0.3), (PULSED / 2, 0.1)), ((0.0, 0.1), (PULSED / 2, 0.3))
    told = {f"{p}{name}": duty for p in plant.prefixes for name, duty in (("fill", more), ("discharge", less))}
    return WithDrivers(Schedule(told), {name: PWM(frequency) for name in told})


def by_frequency(rounds: int) -> list[Row]:
    """One and six muscles under carriers from slow to quick."""
    found = []
    for muscles, words in ((1, "1 muscle"), (6, "6 muscles")):
        run = lifts(muscles)

        def driven(frequency: float, run: Run = run) -> PiecewiseLinear:
            return pulsed(run.system, frequency).segments(run.system.inputs, 0.0, PULSED)

        cases = [Case("carrier", words, f"{f:g} Hz", run, driven(f), PULSED) for f in FREQUENCIES]
        making = interleaved({f"{words}{f:g} Hz": lambda f=f: driven(f) for f in FREQUENCIES}, rounds)
        found += rows_of(cases, rounds, {name: time.least / PULSED for name, time in making.items()})
    return found


def section(rounds: int = 7) -> Section:
    """All three."""
    rows = by_tolerance(rounds) + by_muscles(rounds) + by_frequency(rounds)
    return Section("How the cost of a simulated second grows", TEXT, HEADING, tuple(rows))


if __name__ == "__main__":
    show(section())
