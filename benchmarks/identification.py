"""Identification of eight parameters from one record with 100 initial guesses: fit_dynamic and
SciPy.
"""

from __future__ import annotations

import time
from typing import Any, NamedTuple

import numpy as np
from filling import Array, stretch_factor
from measure import Section, Target, Times, format_time, print_section
from scalar_rates import hill
from sensitivities import DURATION, FREE, SENSORS, case

import airmuscle as am
from airmuscle.bench import fit_dynamic
from airmuscle.bench.dynamics.fit import initial_guesses
from airmuscle.core import tree

STARTS = 100
HEADER = ("variant", "time for 100 starts", "evaluations per start", "starts at the best optimum")
TEXT = (
    "The record of the previous section; the true values and 99 initial guesses within a factor of"
    " three. The library is `fit_dynamic` with Rodas4(1e-6), including the standard errors; a start"
    " is abandoned if its sum of squares after 20 runs is a thousand times that of the best."
    " SciPy's `least_squares` (trf, the same bounds, scaled by its Jacobian) uses finite"
    " differences of `solve_ivp` with LSODA and hand-written Python rates; the initial equilibrium"
    " is also computed by hand-written code. It is run with SciPy's default difference step, and"
    " with a step adapted to the tolerance of the runs, from one start per round. Its time is"
    " scaled to the number of starts that can be simulated: without an initial equilibrium both"
    " stop at once. A start counts as converged within 0.1 % of the minimum sum of squares."
)


class ScipySettings(NamedTuple):
    """Tolerance of the runs and relative step of the finite differences (None: SciPy's default)."""

    rtol: float
    step: float | None

    def __str__(self) -> str:
        return (
            f"SciPy, LSODA {self.rtol:g},"
            f" {'default difference step' if self.step is None else f'step {self.step:g}'}"
        )


SCIPY_SETTINGS = (ScipySettings(1e-6, 1e-4), ScipySettings(1e-8, 1e-5), ScipySettings(1e-8, None))


def find_rest(plant: am.Plant, rates: Any) -> Array:
    """Air mass, position and speed at equilibrium at ambient pressure, by root finding on the
    rates.
    """
    from scipy.optimize import brentq

    geometry = plant.muscles[0].geometry
    air = plant.ambient
    k, c = stretch_factor(geometry)

    def state(position: float) -> Array:
        s = 1.0 - position / geometry.resting_length
        volume = k * s * (1.0 - c * c * s * s)
        return np.array(
            [air.pressure * volume / (am.physics.GAS_CONSTANT * air.temperature), position, 0.0]
        )

    return state(brentq(lambda position: rates(0.0, state(position))[2], -0.1, 0.1, xtol=1e-12))


def simulate_scipy(plant: am.Plant, settings: ScipySettings) -> Array:
    """Simulated pressure and position at the rows of the record."""
    from scipy.integrate import solve_ivp

    times = case().experiment.recording["time"]
    segments = case().segments
    under = hill(plant)
    nominal = np.array([s.nominal for s in case().plant.states])
    y = find_rest(plant, under([0.0, 0.0]))
    begin = 0.0
    parts = []
    for end, openings in zip(segments.ends, segments.values, strict=True):
        rows = times[(times >= begin) & ((times < end) | (end >= DURATION))]
        at = np.append(rows, end) if end < DURATION else rows
        solution = solve_ivp(
            under(openings.tolist()),
            (begin, end),
            y,
            "LSODA",
            at,
            rtol=settings.rtol,
            atol=settings.rtol * nominal,
        )
        parts.append(solution.y.T[: rows.size])
        y = solution.y[:, -1]
        begin = end
    rows = np.concatenate(parts)
    k, c = stretch_factor(plant.muscles[0].geometry)
    s = 1.0 - rows[:, 1] / plant.muscles[0].geometry.resting_length
    inside = (
        rows[:, 0]
        * am.physics.GAS_CONSTANT
        * plant.ambient.temperature
        / (k * s * (1.0 - c * c * s * s))
    )
    return np.column_stack([inside - plant.ambient.pressure, rows[:, 1]])


def fit_scipy(settings: ScipySettings, start: Array) -> tuple[float, float, int]:
    """Time [s], sum of squares and number of evaluations from one start [SI]; SciPy searches in
    units of the true values.
    """
    from scipy.optimize import least_squares

    plant, recording = case().plant, case().experiment.recording
    leaves, problem = list(tree.leaves(plant)), case().problem(am.Rodas4())
    indices = [[leaf.path for leaf in leaves].index(path) for path in FREE]
    measured = np.column_stack([recording[name] for name in SENSORS])
    count = 0

    def residual(scaled: Array) -> Array:
        nonlocal count
        count += 1
        numbers = [leaf.value for leaf in leaves]
        for index, value in zip(indices, problem.coordinates.values(scaled), strict=True):
            numbers[index] = float(value)
        return (
            (simulate_scipy(tree.unflatten(plant, numbers), settings) - measured)
            / list(SENSORS.values())
        ).ravel()

    begin = time.perf_counter()
    bounds = tuple(problem.coordinates.of(bound) for bound in problem.bounds)
    result = least_squares(
        residual,
        problem.coordinates.of(start),
        "2-point",
        bounds,
        x_scale="jac",
        diff_step=settings.step,
    )
    return time.perf_counter() - begin, 2 * float(result.cost), count


def section(rounds: int) -> Section:
    """The complete benchmark."""
    problem, record = case().problem(am.Rodas4()), case()
    starts = [
        z for z in initial_guesses(problem, STARTS, 0)[1:] if np.isfinite(problem.solve(z)[1])
    ]
    times: list[float] = []
    results: dict[ScipySettings, list[tuple[float, float, int]]] = {
        settings: [] for settings in SCIPY_SETTINGS
    }
    fit_dynamic(record.plant, [record.experiment], free=FREE, observed=SENSORS)
    for start in starts[:rounds]:
        begin = time.perf_counter()
        fit = fit_dynamic(
            record.plant, [record.experiment], free=FREE, observed=SENSORS, starts=STARTS
        )
        times.append(time.perf_counter() - begin)
        for settings, fits in results.items():
            fits.append(fit_scipy(settings, start))
    runnable = int(np.isfinite(fit.costs).sum())
    rows = [
        (
            "`fit_dynamic`",
            format_time(Times(tuple(times)).median),
            "",
            f"{fit.starts_at_optimum} of {runnable} that can be simulated",
        )
    ]
    ratios = []
    for settings, fits in results.items():
        seconds = Times(tuple(duration * runnable for duration, _, _ in fits))
        ratios.append(float(np.mean(seconds.rounds)) / Times(tuple(times)).median)
        reached = sum(cost <= 1.001 * fit.costs[0] for _, cost, _ in fits)
        mean = np.mean([count for _, _, count in fits])
        total = format_time(float(np.mean(seconds.rounds)))
        rows.append(
            (
                str(settings),
                f"{total}, ratio {ratios[-1]:.3g}",
                f"{mean:.0f}",
                f"{reached} of {len(fits)}",
            )
        )
    target = Target(
        "identification, 100 starts: fastest SciPy variant / library",
        min(ratios),
        150.0,
        "x",
        at_least=True,
    )
    return Section(
        "Eight parameters from one record, 100 starts", TEXT, HEADER, tuple(rows), (target,)
    )


if __name__ == "__main__":
    print_section(section(3))
