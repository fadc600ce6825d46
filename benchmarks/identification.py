"""Eight parameters from one record by 100 starts, against SciPy with finite differences and rates written by hand."""

from __future__ import annotations

import time
from typing import Any, NamedTuple

import numpy as np
from filling import Array, stretch_factor
from measure import Bar, Section, Times, of_time, show
from scalar_rates import hill
from sensitivities import DURATION, FREE, SENSORS, case

from airmuscle.core import tree
from airmuscle.identify.dynamic import fit_dynamic
from airmuscle.identify.dynamic.fit import initial_guesses
from airmuscle.plant.plant import Plant
from airmuscle.pneumatics.gas import GAS_CONSTANT
from airmuscle.simulation.integrators import Rodas4

STARTS = 100
HEADING = ("variant", "seconds for 100 starts", "evaluations a start", "starts at the best optimum, of those measured")
TEXT = (
    "The record of the section before; the plant's own values and 99 starts a factor of three around them. The library "
    "is `fit_dynamic` with Rodas4(1e-6), its result with standard deviations included; a start that after 20 runs "
    "is a thousand times worse than the best is left. "
    "SciPy's `least_squares` (trf, the same bounds, scaled by its Jacobian) takes differences of `solve_ivp` with "
    "LSODA and rates written by hand in Python, whose start at rest is found by hand too; as SciPy has it, and with a "
    "difference step chosen for the tolerance of the runs. It is run from one start a round, none of which fails, and "
    "what it takes is scaled to the starts that can be run at all: where no rest exists both sides stop at once. A "
    "start has reached the optimum within a thousandth of the least sum of squares."
)


class Opponent(NamedTuple):
    """Tolerance of the runs, and the relative step of the differences (SciPy's own: None)."""

    rtol: float
    step: float | None

    def __str__(self) -> str:
        return (
            f"SciPy, LSODA {self.rtol:g}, {'its own difference step' if self.step is None else f'step {self.step:g}'}"
        )


OPPONENTS = (Opponent(1e-6, 1e-4), Opponent(1e-8, 1e-5), Opponent(1e-8, None))


def rest(plant: Plant, rates: Any) -> Array:
    """Air mass, position and speed at rest at ambient pressure, by a root search over the rates."""
    from scipy.optimize import brentq

    geometry, air = plant.muscles[0].geometry, plant.ambient
    k, c = stretch_factor(geometry)

    def state(position: float) -> Array:
        s = 1.0 - position / geometry.resting_length
        volume = k * s * (1.0 - c * c * s * s)
        return np.array([air.pressure * volume / (GAS_CONSTANT * air.temperature), position, 0.0])

    return state(brentq(lambda position: rates(0.0, state(position))[2], -0.1, 0.1, xtol=1e-12))


def modelled(plant: Plant, opponent: Opponent) -> Array:
    """Pressure and position at the rows of the record."""
    from scipy.integrate import solve_ivp

    times, segments = case().experiment.recording["time"], case().segments
    under, nominal = hill(plant), np.array([s.nominal for s in case().plant.states])
    y, begin, parts = rest(plant, under([0.0, 0.0])), 0.0, []
    for end, openings in zip(segments.ends, segments.values, strict=True):
        rows = times[(times >= begin) & ((times < end) | (end >= DURATION))]
        at = np.append(rows, end) if end < DURATION else rows
        found = solve_ivp(
            under(openings.tolist()), (begin, end), y, "LSODA", at, rtol=opponent.rtol, atol=opponent.rtol * nominal
        )
        parts.append(found.y.T[: rows.size])
        y, begin = found.y[:, -1], end
    rows = np.concatenate(parts)
    k, c = stretch_factor(plant.muscles[0].geometry)
    s = 1.0 - rows[:, 1] / plant.muscles[0].geometry.resting_length
    inside = rows[:, 0] * GAS_CONSTANT * plant.ambient.temperature / (k * s * (1.0 - c * c * s * s))
    return np.column_stack([inside - plant.ambient.pressure, rows[:, 1]])


def fitted(opponent: Opponent, start: Array) -> tuple[float, float, int]:
    """Seconds, sum of squares and evaluations of one start in units of the plant's own values."""
    from scipy.optimize import least_squares

    plant, recording = case().plant, case().experiment.recording
    leaves, problem = list(tree.leaves(plant)), case().problem(Rodas4())
    places = [[leaf.path for leaf in leaves].index(path) for path in FREE]
    measured = np.column_stack([recording[name] for name in SENSORS])
    count = 0

    def residual(scaled: Array) -> Array:
        nonlocal count
        count += 1
        numbers = [leaf.value for leaf in leaves]
        for place, value in zip(places, scaled * problem.scales, strict=True):
            numbers[place] = float(value)
        return ((modelled(tree.unflatten(plant, numbers), opponent) - measured) / list(SENSORS.values())).ravel()

    begun = time.perf_counter()
    found = least_squares(residual, start, "2-point", problem.bounds, x_scale="jac", diff_step=opponent.step)
    return time.perf_counter() - begun, 2 * float(found.cost), count


def section(rounds: int) -> Section:
    problem, record = case().problem(Rodas4()), case()
    starts = [z for z in initial_guesses(problem, STARTS, 0)[1:] if np.isfinite(problem.solve(z)[1])]
    own: list[float] = []
    others: dict[Opponent, list[tuple[float, float, int]]] = {opponent: [] for opponent in OPPONENTS}
    fit_dynamic(record.plant, [record.experiment], free=FREE, observed=SENSORS)
    for start in starts[:rounds]:
        begun = time.perf_counter()
        fit = fit_dynamic(record.plant, [record.experiment], free=FREE, observed=SENSORS, starts=STARTS)
        own.append(time.perf_counter() - begun)
        for opponent, found in others.items():
            found.append(fitted(opponent, start))
    runnable = int(np.isfinite(fit.costs).sum())
    rows = [
        (
            "`fit_dynamic`",
            of_time(Times(tuple(own)).median),
            "",
            f"{fit.starts_at_optimum} of {runnable} that can be run",
        )
    ]
    ratios = []
    for opponent, found in others.items():
        seconds = Times(tuple(taken * runnable for taken, _, _ in found))
        ratios.append(float(np.mean(seconds.rounds)) / Times(tuple(own)).median)
        reached = sum(cost <= 1.001 * fit.costs[0] for _, cost, _ in found)
        mean = np.mean([count for _, _, count in found])
        whole = of_time(float(np.mean(seconds.rounds)))
        rows.append((str(opponent), f"{whole}, {ratios[-1]:.3g} times", f"{mean:.0f}", f"{reached} of {len(found)}"))
    bar = Bar("identification, 100 starts: the quickest of SciPy's / library", min(ratios), 150.0, "x", at_least=True)
    return Section("Eight parameters from one record, 100 starts", TEXT, HEADING, tuple(rows), (bar,))


if __name__ == "__main__":
    show(section(3))
