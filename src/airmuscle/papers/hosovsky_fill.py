"""Fill and discharge, Fig. 3 of Hošovský et al."""

from __future__ import annotations

import dataclasses
import re

import numpy as np

import airmuscle as am

from ..core.plotting import BLACK, LINES, new_figure
from ..report.chapter import AtMost, Claim, Equal, Kind, Plot
from .hosovsky_plant import MATRIX, PAPER, UnpublishedParameters, hanging_load, plant
from .hosovsky_schedule import DISCHARGING, DURATION, FILLING, SCHEDULE


@dataclasses.dataclass(frozen=True, eq=False)
class FillRun:
    """The simulation of Fig. 3 with the printed and with an adaptive integrator."""

    plant: am.Plant
    printed_method: am.Recording
    adaptive: am.Recording


def run_fill(parameters: UnpublishedParameters, valve: am.Valve = MATRIX) -> FillRun:
    """Simulate 25 s with ode8 at 1e-4 s, as printed, and with Rodas4 at rtol = 1e-8."""
    system = plant(parameters, hanging_load(parameters), valve=valve)
    return FillRun(system, _run(system, am.DormandPrince8(1e-4)), _run(system, am.Rodas4(1e-8)))


def _run(system: am.Plant, method: am.engine.Integrator) -> am.Recording:
    return am.simulate(system, SCHEDULE, duration=DURATION, integrator=method)


def figure_3(fill: FillRun) -> Plot:
    """Return Fig. 3: muscle pressure and displacement over time; the paper gives no values of its curve."""
    run = fill.adaptive
    figure, axes = new_figure(2, 1, height=4.6, sharex=True)
    axes[0].plot(run["time"], (run["pressure"] + fill.plant.ambient.pressure) / 1e3, color=LINES[0])
    axes[0].axhline(650.0, color=BLACK, linewidth=0.8, linestyle=":")
    axes[0].annotate("supply", (0.1, 650.0), xytext=(0, -10), textcoords="offset points")
    axes[0].set_ylabel("absolute pressure [kPa]")
    axes[1].plot(run["time"], run["position"] * 1e3, color=LINES[1])
    axes[1].set(ylabel="displacement [mm]", xlabel="time [s]")
    for axis in axes:
        for begin, end in (FILLING, DISCHARGING):
            axis.axvspan(begin, end, color="0.93", zorder=0)
    return Plot(
        "hosovsky_fig3", "Fill (5 to 15 s) and discharge (19 to 25 s), as in Fig. 3; shaded: one valve is open.", figure
    )


def valve_figure(valve: am.Valve, temperature: float) -> Plot:
    """Return the mass flow of the valve over the pressure ratio: choked, subsonic, laminar."""
    upstream = 650e3
    ratio = np.linspace(0.0, 1.0, 2001)
    flow = valve.mass_flow(upstream, ratio * upstream, 1.0, temperature)
    figure, axes = new_figure()
    axes.plot(ratio, np.asarray(flow) * 1e3, color=LINES[0])
    axes.axvline(valve.critical_ratio, color=BLACK, linewidth=0.8, linestyle=":")
    axes.annotate("choked", (valve.critical_ratio / 2, 0.35), ha="center")
    axes.annotate("subsonic", ((1 + valve.critical_ratio) / 2, 0.35), ha="center")
    axes.set(xlabel="pressure ratio $p_2/p_1$", ylabel="mass flow [g/s]", ylim=(0, None), xlim=(0, 1))
    return Plot(
        "hosovsky_valve",
        r"Mass flow of the MATRIX valve by ISO 6358 for an absolute upstream pressure of 650 kPa, \(b = 0.433\); "
        "laminar above 0.999.",
        figure,
    )


def end_of_choked_flow(plant: am.Plant) -> tuple[float, float]:
    """Return the absolute muscle pressure [Pa] at which the choked flow ends, and the pressure step of a row [Pa]."""
    instants = np.append(np.arange(FILLING[0], FILLING[0] + 1.0, 1e-4), DURATION)
    run = am.simulate(plant, SCHEDULE, duration=DURATION, integrator=am.Rodas4(1e-8), output_times=instants)
    filling = (run["time"] >= FILLING[0]) & (run["time"] < FILLING[0] + 1.0)
    flow, pressure = run["mass_flow"][filling], run["pressure"][filling] + plant.ambient.pressure
    subsonic = int(np.argmax(flow < flow.max() * (1 - 1e-9)))
    return float(pressure[subsonic]), float(np.diff(pressure).max())


def claims(fill: FillRun, explanation: str = "") -> tuple[Claim, ...]:
    """Return the claims on valve, solver and fill; `explanation` describes the causes of the deviations."""
    deviations = "model and muscle agree well during discharge, with larger deviations during filling"
    note = f"The measured curve of Fig. 3 gives no values. {explanation}".strip()
    return (
        *_valve_claims(fill),
        *_integrator_claims(fill),
        Claim(PAPER, deviations, None, None, "kPa", note, untestable=True),
    )


def _valve_claims(fill: FillRun) -> tuple[Claim, ...]:
    valve = fill.plant.circuits[0].fill  # type: ignore[attr-defined]
    filled = fill.adaptive["pressure"][np.searchsorted(fill.adaptive["time"], FILLING[1])] + fill.plant.ambient.pressure
    choke_end, row = end_of_choked_flow(fill.plant)
    return (
        Claim(
            PAPER,
            "sonic conductance of the MATRIX valve in customary units",
            Equal(15.70, 0.005, derived=True),
            valve.conductance * 1e5 * 60e3,
            "NL/(min bar)",
            r"The exponent of \(C\) is lost in our copy; only 10⁻⁹ gives the right order of magnitude.",
            kind=Kind.CHECK,
        ),
        Claim(
            PAPER,
            r"the flow is choked until \(p_2/p_1 = b\): muscle pressure at which the mass flow begins to decrease",
            Equal(0.433 * 650.0, 2e-3 * row, derived=True),
            choke_end / 1e3,
            "kPa abs",
            "From the simulation with an output step of 0.1 ms; the tolerance is two steps.",
            kind=Kind.CHECK,
        ),
        Claim(
            PAPER,
            "fill with a step of 650 kPa: pressure when the fill valve closes",
            Equal(650.0, 0.1),
            float(filled) / 1e3,
            "kPa abs",
            "650 kPa is the supply pressure that is put in, assumed to be absolute (inferred).",
            kind=Kind.CHECK,
        ),
    )


def _integrator_claims(fill: FillRun) -> tuple[Claim, ...]:
    steps = int(next(filter(None, (re.search(r"(\d+) steps", note) for note in fill.printed_method.notes)))[1])
    position_error, pressure_error = (
        float(np.abs(fill.printed_method[name] - fill.adaptive[name]).max()) for name in ("position", "pressure")
    )
    accurate = "ode8 with a step of 0.1 ms is accurate: maximum difference in {} from Rodas4"
    note = "The bound is chosen; Rodas4 with a relative tolerance of 10⁻⁸."
    return (
        Claim(
            PAPER,
            "fixed step of 0.1 ms over 25 s: number of steps",
            Equal(250_000, 0, derived=True),
            steps,
            "1",
            "Integrator ode8.",
            kind=Kind.CHECK,
        ),
        Claim(
            PAPER, accurate.format("position"), AtMost(1e-7, chosen=True), position_error, "m", note, kind=Kind.CHECK
        ),
        Claim(
            PAPER, accurate.format("pressure"), AtMost(1.0, chosen=True), pressure_error, "Pa", note, kind=Kind.CHECK
        ),
    )
