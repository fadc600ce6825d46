"""Fill and discharge, Fig. 3 of the third paper."""

from __future__ import annotations

import dataclasses

import numpy as np

from ..core.plotting import BLACK, LINES, new_figure
from ..plant.plant import Plant
from ..pneumatics import Valve
from ..recording import Recording
from ..report.chapter import AtMost, Claim, Equal, Plot
from ..simulation.integrators import DormandPrince8, Integrator, Rodas4
from ..simulation.simulate import simulate
from .hosovsky_plant import MATRIX, PAPER, UnpublishedParameters, hanging_load, plant
from .hosovsky_schedule import DISCHARGING, DURATION, FILLING, SCHEDULE


@dataclasses.dataclass(frozen=True, eq=False)
class FillRun:
    """The run of Fig. 3 by both methods."""

    plant: Plant
    printed_method: Recording
    adaptive: Recording


def run_fill(numbers: UnpublishedParameters, valve: Valve = MATRIX) -> FillRun:
    """25 s with ode8 at 1e-4 s as printed, and with Rodas4 at rtol 1e-8."""
    system = plant(numbers, hanging_load(numbers), valve=valve)
    return FillRun(system, _run(system, DormandPrince8(1e-4)), _run(system, Rodas4(1e-8)))


def _run(system: Plant, method: Integrator) -> Recording:
    return simulate(system, SCHEDULE, duration=DURATION, method=method)


def figure_3(fill: FillRun) -> Plot:
    """Muscle pressure and displacement over time, as the paper's Fig. 3, whose measured line has no numbers."""
    run = fill.adaptive
    figure, axes = new_figure(2, 1, height=4.6, sharex=True)
    axes[0].plot(run["time"], (run["pressure"] + fill.plant.ambient.pressure) / 1e3, color=LINES[0])
    axes[0].axhline(650.0, color=BLACK, linewidth=0.8, linestyle=":")
    axes[0].annotate("supply", (0.1, 650.0), xytext=(0, -10), textcoords="offset points")
    axes[0].set_ylabel("muscle pressure [kPa abs]")
    axes[1].plot(run["time"], run["position"] * 1e3, color=LINES[1])
    axes[1].set(ylabel="displacement [mm]", xlabel="time [s]")
    for axis in axes:
        for begin, end in (FILLING, DISCHARGING):
            axis.axvspan(begin, end, color="0.93", zorder=0)
    return Plot(
        "hosovsky_fig3", "Fill (5 to 15 s) and discharge (19 to 25 s), as Fig. 3; shaded: a valve is open.", figure
    )


def valve_figure(valve: Valve, temperature: float) -> Plot:
    """Mass flow of the valve over the pressure ratio: choked, subsonic, laminar."""
    upstream = 650e3
    ratio = np.linspace(0.0, 1.0, 2001)
    flow = valve.mass_flow(upstream, ratio * upstream, 1.0, temperature)
    figure, axes = new_figure()
    axes.plot(ratio, np.asarray(flow) * 1e3, color=LINES[0])
    axes.axvline(valve.critical_ratio, color=BLACK, linewidth=0.8, linestyle=":")
    axes.annotate("choked", (valve.critical_ratio / 2, 0.35), ha="center")
    axes.annotate("subsonic", ((1 + valve.critical_ratio) / 2, 0.35), ha="center")
    axes.set(xlabel="pressure ratio p2/p1 [1]", ylabel="mass flow [g/s]", ylim=(0, None), xlim=(0, 1))
    return Plot(
        "hosovsky_valve", "MATRIX valve by ISO 6358 from 650 kPa absolute, b = 0.433; laminar above 0.999.", figure
    )


def end_of_choked_flow(plant: Plant) -> tuple[float, float]:
    """The muscle's absolute pressure [Pa] at which the filling flow begins to fall, and its growth in a row [Pa]."""
    spacing = np.append(np.arange(FILLING[0], FILLING[0] + 1.0, 1e-4), DURATION)
    run = simulate(plant, SCHEDULE, duration=DURATION, method=Rodas4(1e-8), output=spacing)
    filling = (run["time"] >= FILLING[0]) & (run["time"] < FILLING[0] + 1.0)
    flow, pressure = run["mass_flow"][filling], run["pressure"][filling] + plant.ambient.pressure
    subsonic = int(np.argmax(flow < flow.max() * (1 - 1e-9)))
    return float(pressure[subsonic]), float(np.diff(pressure).max())


def claims(fill: FillRun, explained: str = "") -> tuple[Claim, ...]:
    """What the paper says of valve, solver and fill, held against the run; `explained` says what makes it deviate."""
    valve = fill.plant.circuits[0].fill  # type: ignore[attr-defined]
    per_minute = valve.conductance * 1e5 * 60e3
    steps = int(fill.printed_method.notes[0].split(": ")[1].split()[0])
    apart = float(np.abs(fill.printed_method["position"] - fill.adaptive["position"]).max())
    apart_p = float(np.abs(fill.printed_method["pressure"] - fill.adaptive["pressure"]).max())
    full = fill.adaptive["pressure"][np.searchsorted(fill.adaptive["time"], FILLING[1])] + fill.plant.ambient.pressure
    choke_end, row = end_of_choked_flow(fill.plant)
    return (
        Claim(PAPER, "sonic conductance of the MATRIX valve in usual units", Equal(15.70, 0.005), per_minute,
              "NL/(min bar)",
              "the exponent of C is lost in our copy; e-9 is the only one of the right order"),
        Claim(PAPER, "filling is choked until P2/P1 = b: muscle pressure at which the flow begins to fall",
              Equal(0.433 * 650.0, 2e-3 * row), choke_end / 1e3, "kPa abs",
              "read off the simulated run, rows every 0.1 ms; tolerance: two rows"),
        Claim(PAPER, "fill by a 650 kPa step: pressure when the fill valve shuts", Equal(650.0, 0.1), float(full) / 1e3,
              "kPa abs", "650 kPa taken as absolute (inferred)"),
        Claim(PAPER, "fixed step of 1e-4 s over 25 s: number of steps", Equal(250_000, 0), steps, "1", "ode8"),
        Claim(PAPER, "ode8 at 1e-4 s is fine enough: distance from Rodas4 in position", AtMost(1e-7, chosen=True),
              apart, "m", "the bound is chosen here; Rodas4 at rtol 1e-8"),
        Claim(PAPER, "ode8 at 1e-4 s is fine enough: distance from Rodas4 in pressure", AtMost(1.0, chosen=True),
              apart_p, "Pa", "the bound is chosen here"),
        Claim(PAPER, "model and muscle agree well in discharge, larger deviations while filling", None, None, "kPa",
              f"the measured line of Fig. 3 has no numbers. {explained}".strip()),
    )  # fmt: skip
