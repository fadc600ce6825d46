"""Fill and discharge, Fig. 3 of Hošovský et al."""

import dataclasses

import numpy as np

import airmuscle as am

from ..core import BLACK, LINES, new_figure
from ..report.chapter import Plot
from .hosovsky_plant import DISCHARGING, DURATION, FILLING, MATRIX, SCHEDULE, UnpublishedParameters, hanging_load, plant


@dataclasses.dataclass(frozen=True, eq=False)
class FillRun:
    """The simulation of Fig. 3 with the printed and with an adaptive integrator."""

    plant: am.Plant
    printed_method: am.Solution
    adaptive: am.Recording

    @property
    def filled(self) -> float:
        """Absolute pressure [Pa] when the fill valve closes."""
        row = np.searchsorted(self.adaptive["time"], FILLING[1])
        return float(self.adaptive["pressure"][row]) + self.plant.ambient.pressure

    def difference(self, name: str) -> float:
        """Return the largest difference of both integrators in a quantity."""
        return float(np.abs(self.printed_method.recording[name] - self.adaptive[name]).max())


def run_fill(parameters: UnpublishedParameters, valve: am.Valve = MATRIX) -> FillRun:
    """Simulate 25 s with ode8 at 1e-4 s, as printed, and with Rodas4 at rtol = 1e-8."""
    system = plant(parameters, hanging_load(parameters), valve=valve)
    printed, adaptive = (
        am.solve(am.Problem(system, SCHEDULE, DURATION, integrator=method))
        for method in (am.DormandPrince8(1e-4), am.Rodas4(1e-8))
    )
    return FillRun(system, printed, adaptive.recording)


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
