"""Margins, multi-rate loops and filters, beside python-control, own loops with SciPy, and own
NumPy.

python benchmarks/control_tools.py
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from environments import is_installed
from joints import chosen_muscle
from measure import Section, Target, format_time, print_section, time_variants

import airmuscle as am
from airmuscle.control import (
    PID,
    Cascade,
    ExtendedKalmanFilter,
    Margins,
    MovingHorizonEstimator,
    Multirate,
    linearise_loop,
)
from airmuscle.engine import ControlLoop, Measurement, Rodas4, Schedule, SplitRange
from airmuscle.physics import FillDischarge, HangingMass, Plant, Polytropic, Supply, Valve

VALVE = Valve(2.6e-9, 0.4)
LIFT = Plant(
    chosen_muscle(), FillDischarge(Supply(5.5e5), VALVE, VALVE), HangingMass(2.0), Polytropic(1.2)
)
SPLIT = SplitRange("fill", "discharge")
INNER = PID("pressure", SPLIT, 2e-5)
OUTER = PID("position", "pressure", 4e6, integral_time=0.5)
H = 1e-3
DURATION = 2.0
ROWS = 400
HORIZON = 10
HEADER = ("what", "median", "minimum", "times the library", "difference")
TEXT = (
    "A lifted load of 2 kg with a cascade; all numbers are chosen. Margins: gain, phase and delay"
    " margin and the sensitivity peak of the sampled loop, with the linearisation, and of a"
    " `LinearLoop`; python-control takes the same system, and gives neither a delay margin nor a"
    f" gain margin at the Nyquist frequency, where it is here. Multi-rate: {DURATION:g} s with the"
    " pressure at 1 kHz and the position at 100 Hz, whole; own loop: `solve_ivp` (LSODA, rtol"
    f" 1e-8), timed once, from sample to sample with plant and law in Python. Filters: {ROWS} rows"
    " of pressure and position; own filter: the algebra in NumPy, with the step and the"
    f" derivatives of the library; the moving horizon has {HORIZON} samples and no bounds."
    " Difference: of phase margin and peak relative to the same model in extended precision (80"
    " bits), of columns in parts of their range. python-control finds the frequencies as roots of"
    " polynomials, whose coefficients lose digits."
)


def extended_gain(opened: Any, frequency: Any) -> Any:
    """The open loop at a frequency [Hz] in extended precision, by elimination with pivots."""
    a, b, c, d = (
        np.asarray(matrix, np.longdouble) for matrix in (opened.A, opened.B, opened.C, opened.D)
    )
    pi = 4 * np.arctan(np.longdouble(1))
    angle = 2 * pi * np.longdouble(frequency) * np.longdouble(opened.dt)
    z = np.cos(angle) + np.clongdouble(1j) * np.sin(angle)
    table = np.hstack([z * np.eye(len(a), dtype=np.longdouble) - a, b[:, :1]])
    for k in range(len(a)):
        pivot = k + int(np.argmax(np.abs(table[k:, k])))
        table[[k, pivot]] = table[[pivot, k]]
        table[k] /= table[k, k]
        others = np.arange(len(a)) != k
        table[others] -= table[others, k : k + 1] * table[k]
    return c[0] @ table[:, -1] + d[0, 0]


def extended_margins(opened: Any, margins: Margins) -> tuple[float, float]:
    """Phase margin [rad] and sensitivity peak in extended precision, near those of the library."""
    low, high = (np.longdouble(margins.phase_frequency * factor) for factor in (0.999, 1.001))
    falls = abs(extended_gain(opened, low)) > 1
    for _ in range(60):
        middle = (low + high) / 2
        if (abs(extended_gain(opened, middle)) > 1) == falls:
            low = middle
        else:
            high = middle
    gain = -extended_gain(opened, low)
    phase = abs(np.arctan2(gain.imag, gain.real))
    return float(phase), float(1 / abs(1 + extended_gain(opened, margins.peak_frequency)))


def margin_variants() -> tuple[dict[str, Callable[[], Any]], dict[str, float]]:
    """The margins of the library and of python-control, and their greatest relative difference from
    extended precision.
    """
    state = am.find_equilibrium(LIFT, pressure=2e5)
    loop = ControlLoop(INNER, 5e-3, Schedule({"pressure": ((0.0, 2e5),)}))
    linear = linearise_loop(LIFT, loop, state, {"fill": 0.01})
    runs: dict[str, Callable[[], Any]] = {
        "margins, linearise_loop and margins": (
            lambda: linearise_loop(LIFT, loop, state, {"fill": 0.01}).margins()
        ),
        "margins of a LinearLoop": linear.margins,
    }
    if not is_installed("control"):
        return runs, {}
    import control

    opened = linear.open_loop().to_control()
    runs["margins, python-control"] = lambda: control.stability_margins(opened)
    _, phase, distance, *_ = control.stability_margins(opened)
    margins = linear.margins()
    exact = extended_margins(opened, margins)

    def difference(*values: float) -> float:
        return max(abs(value / other - 1) for value, other in zip(values, exact, strict=True))

    return runs, {
        "margins of a LinearLoop": difference(margins.phase, margins.peak),
        "margins, python-control": difference(np.radians(phase), 1 / distance),
    }


def own_loop(law: Any, start: dict[str, float], setpoint: float) -> np.ndarray:
    """The position (K,) at the samples of a loop that SciPy integrates from sample to sample."""
    from scipy.integrate import solve_ivp

    names, memory, state, told = (
        [s.name for s in LIFT.states],
        law.init(),
        np.array(list(start.values())),
        [],
    )
    ranges = {"fill": (0.0, 1.0), "discharge": (0.0, 1.0)}
    commands = dict.fromkeys(ranges, 0.0)

    def rates(t: float, x: np.ndarray) -> list[float]:
        found = LIFT.rates(dict(zip(names, x.tolist(), strict=True)), commands)
        return [float(found[name]) for name in names]

    for _ in range(round(DURATION / H)):
        known = dict(zip(names, state.tolist(), strict=True))
        columns = {**LIFT.outputs(known, commands), **known}
        told.append(known["position"])
        wanted, memory = law.step(memory, Measurement(columns, {"position": setpoint}, ranges), H)
        commands = {name: min(max(float(value), 0.0), 1.0) for name, value in wanted.items()}
        state = solve_ivp(rates, (0.0, H), state, method="LSODA", rtol=1e-8, atol=1e-12).y[:, -1]
    return np.array(told)


def loop_variants() -> tuple[dict[str, Callable[[], Any]], float]:
    """A multi-rate loop by the library and by SciPy, and the difference of the positions."""
    law = Cascade(Multirate(OUTER, 10), INNER, (0.0,), (5e5,))
    start = am.find_equilibrium(LIFT, pressure=1e5)
    setpoint = 0.015
    loop = ControlLoop(law, H, Schedule({"position": ((0.0, setpoint),)}))

    def library(integrator: Any = None) -> Any:
        return am.simulate(
            LIFT,
            loop,
            duration=DURATION,
            initial_state=start,
            output_times=H,
            integrator=integrator,
        )

    exact = library(Rodas4(1e-9))
    theirs = own_loop(law, start, setpoint)
    ours = np.interp(H * np.arange(theirs.size), exact["time"], exact["position"])
    difference = float(np.abs(ours - theirs).max() / np.ptp(theirs))
    return {
        "multi-rate loop, simulate": library,
        "multi-rate loop, solve_ivp": lambda: own_loop(law, start, setpoint),
    }, difference


def own_filter(judged: ExtendedKalmanFilter, record: Any, first: Any) -> np.ndarray:
    """The means (K, n) of an extended Kalman filter whose algebra is NumPy."""
    mean = first.mean
    covariance = first.covariance
    told = []
    values = np.column_stack([record[name] for name in judged.measured])
    inputs = np.column_stack([record[name] for name in LIFT.inputs])
    for k, value in enumerate(values):
        held = inputs[max(k - 1, 0)].tolist()
        if k:
            mean, f = judged.transition(mean, held)
            covariance = f @ covariance @ f.T + judged.noise
        predicted, c = judged.observation(mean, held)
        gain = covariance @ c.T @ np.linalg.inv(c @ covariance @ c.T + np.diag(judged.variances))
        mean, rest = mean + gain @ (value - predicted), np.eye(len(mean)) - gain @ c
        covariance = rest @ covariance @ rest.T + gain * judged.variances @ gain.T
        told.append(mean)
    return np.array(told)


def filter_variants() -> tuple[dict[str, Callable[[], Any]], dict[str, float]]:
    """The filters on one record, and their differences from the extended filter of the library."""
    start = am.find_equilibrium(LIFT, pressure=2e5)
    h = 5e-3
    command = Schedule({"fill": ((0.2, 0.4), (0.5, 0.0)), "discharge": ((1.2, 0.3), (1.5, 0.0))})
    run = am.simulate(LIFT, command, duration=h * (ROWS - 1), initial_state=start, output_times=h)
    kept = np.searchsorted(run["time"], h * np.arange(ROWS) - 1e-9)
    random = np.random.default_rng(3)
    noise = {"pressure": 500.0, "position": 2e-5}
    columns = {
        name: run[name][kept] + random.normal(scale=s, size=ROWS) for name, s in noise.items()
    }
    record = am.Recording(
        {"time": h * np.arange(ROWS), **{n: run[n][kept] for n in LIFT.inputs}, **columns}, "noise"
    )
    judged = ExtendedKalmanFilter(LIFT, tuple(noise), h, {"air_mass": 2e-6, "speed": 0.02}, noise)
    first = judged.start(start, {"air_mass": 2e-6, "position": 1e-3, "speed": 5e-3})
    horizon = MovingHorizonEstimator(judged, HORIZON)
    ours = judged.estimate(record, first)
    table = np.column_stack([ours[name] for name in judged.states])
    ranges = np.ptp(table, axis=0)
    window = horizon.estimate(record, first)
    theirs = np.column_stack([window[name] for name in judged.states])
    differences = {
        "extended Kalman filter, NumPy": float(
            (np.abs(own_filter(judged, record, first) - table) / ranges).max()
        ),
        "moving horizon, estimate": float((np.abs(theirs - table) / ranges).max()),
    }
    return {
        "extended Kalman filter, estimate": lambda: judged.estimate(record, first),
        "extended Kalman filter, NumPy": lambda: own_filter(judged, record, first),
        "smoother, smooth": lambda: judged.smooth(record, first),
        "moving horizon, estimate": lambda: horizon.estimate(record, first),
    }, differences


def section(rounds: int = 5) -> Section:
    """The complete benchmark."""
    margins, of_margins = margin_variants()
    loops, of_loops = loop_variants()
    filters, of_filters = filter_variants()
    differences = {
        **of_margins,
        "multi-rate loop, solve_ivp": of_loops,
        **of_filters,
    }
    rows = []
    ratios = {}
    for runs in (margins, loops, filters):
        times = time_variants(runs, 1 if runs is loops else rounds)
        ours = next(iter(times.values()))
        for name, timed in times.items():
            ratios[name] = timed.ratio_to(ours)
            difference = f"{differences[name]:.1g}" if name in differences else ""
            ratio = f"{ratios[name]:.3g}"
            rows.append(
                (name, format_time(timed.median), format_time(timed.minimum), ratio, difference)
            )
    targets = [
        Target(
            "multi-rate loop: solve_ivp / simulate",
            ratios["multi-rate loop, solve_ivp"],
            100,
            "x",
            at_least=True,
        ),
        Target("multi-rate loop: difference of the position", of_loops, 1e-6, ""),
        Target(
            "filter: NumPy / estimate",
            ratios["extended Kalman filter, NumPy"],
            1,
            "x",
            at_least=True,
        ),
        Target("filter: difference", of_filters["extended Kalman filter, NumPy"], 1e-9, ""),
    ]
    if is_installed("control"):
        ours_to_exact = of_margins["margins of a LinearLoop"]
        targets.append(
            Target("margins: difference from extended precision", ours_to_exact, 1e-9, "")
        )
    return Section(
        "Margins, multi-rate loops and filters", TEXT, HEADER, tuple(rows), tuple(targets)
    )


if __name__ == "__main__":
    print_section(section())
