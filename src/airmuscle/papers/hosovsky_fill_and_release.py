"""Fill and discharge, Fig. 3 of Hošovský et al., and the quick release of their load."""

import dataclasses
from typing import Any

import numpy as np
import numpy.typing as npt

import airmuscle as am

from ..core import BLACK, DASHES, LINES, legend_below, new_figure
from ..report import AtLeast, AtMost, Claim, Plot, Table
from ..report.formatting import format_unit
from . import hosovsky_plant as rig
from .hosovsky_plant import FORCE_MAPS, MATRIX, UnpublishedParameters, hanging_load, latched_load, plant
from .run import captioned, claim_row


@dataclasses.dataclass(frozen=True, eq=False)
class FillRun:
    """The simulation of Fig. 3 with the printed and with an adaptive integrator."""

    plant: am.Plant
    printed_method: am.Solution
    adaptive: am.Recording

    @property
    def filled(self) -> float:
        """Absolute pressure [Pa] when the fill valve closes."""
        row = np.searchsorted(self.adaptive["time"], rig.FILLING[1])
        return float(self.adaptive["pressure"][row]) + self.plant.ambient.pressure

    def difference(self, name: str) -> float:
        """Return the largest difference of both integrators in a quantity."""
        return float(np.abs(self.printed_method.recording[name] - self.adaptive[name]).max())


def run_fill(parameters: UnpublishedParameters, valve: am.Valve = MATRIX) -> FillRun:
    """Simulate 25 s with ode8 at 1e-4 s, as printed, and with Rodas4 at rtol = 1e-8."""
    system = plant(parameters, hanging_load(parameters), valve=valve)
    printed, adaptive = (
        am.solve(am.Problem(system, rig.SCHEDULE, rig.DURATION, integrator=method))
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
        for begin, end in (rig.FILLING, rig.DISCHARGING):
            axis.axvspan(begin, end, color="0.93", zorder=0)
    return captioned("hosovsky_fig3", figure)


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
    return captioned("hosovsky_valve", figure)


def end_of_choked_flow(plant: am.Plant) -> tuple[float, float]:
    """Return the absolute muscle pressure [Pa] at which the choked flow ends, and the pressure step of a row [Pa]."""
    instants = np.append(np.arange(rig.FILLING[0], rig.FILLING[0] + 1.0, 1e-4), rig.DURATION)
    run = am.simulate(plant, rig.SCHEDULE, duration=rig.DURATION, integrator=am.Rodas4(1e-8), output_times=instants)
    filling = (run["time"] >= rig.FILLING[0]) & (run["time"] < rig.FILLING[0] + 1.0)
    flow, pressure = run["mass_flow"][filling], run["pressure"][filling] + plant.ambient.pressure
    subsonic = int(np.argmax(flow < flow.max() * (1 - 1e-9)))
    return float(pressure[subsonic]), float(np.diff(pressure).max())


RELEASED_AT, RELEASE_DURATION = 0.5, 6.0
RELEASE_SCHEDULE = am.Schedule({"latched": ((0.0, 1.0), (RELEASED_AT, 0.0))})
MAX_DAMPING_DIFFERENCE = 0.30
"""Maximum relative difference of comparable damping, as a fraction of the larger value (chosen)."""
COMPARABLE = AtMost(MAX_DAMPING_DIFFERENCE, chosen=True)
STATEMENTS = {
    **{key: claim_row(rig.PAPER, key, printed=AtLeast(0.0, derived=True)) for key in ("acceleration", "contraction")},
    **{key: claim_row(rig.PAPER, key, printed=COMPARABLE) for key in ("relative damping", "absolute damping")},
}
"""The four statements of the paper on the quick release, each with its criterion."""


def agrees(key: str, value: float) -> bool:
    """Return whether a value confirms a statement."""
    criterion = STATEMENTS[key].printed
    return criterion is not None and criterion.agrees(value)


@dataclasses.dataclass(frozen=True, eq=False)
class Release:
    """One release: the simulation and its characteristic values, SI units."""

    pressure: float
    run: am.Recording
    initial_acceleration: float
    max_contraction: float
    damping_ratio: float
    decay_rate: float


def release(
    parameters: UnpublishedParameters, pressure: float, data: str = FORCE_MAPS[0], duration: float = RELEASE_DURATION
) -> Release:
    """Simulate the release of a muscle clamped at zero contraction, at a gauge pressure [Pa], with closed valves.

    The muscle is released `RELEASED_AT` seconds after the start; `duration` [s] includes that time.
    """
    system = plant(parameters, latched_load(), data=data)
    options: dict[str, Any] = {"initial_state": system.state_at(pressure=pressure), "output_times": 1e-3}
    run = am.simulate(system, RELEASE_SCHEDULE, duration=duration, integrator=am.Rodas4(1e-9), **options)
    free = run["time"] >= RELEASED_AT
    ratio, rate = damping(run["time"][free], run["position"][free], run["speed"][free])
    return Release(pressure, run, float(run["acceleration"][free][0]), float(run["contraction"].max()), ratio, rate)


def damping(time: npt.NDArray[Any], position: npt.NDArray[Any], speed: npt.NDArray[Any]) -> tuple[float, float]:
    """Return damping ratio [1] and decay rate [1/s] from the logarithmic decrement of the first three half-cycles.

    A half-cycle is the distance between two turning points, so the equilibrium position is not needed. NaN if there
    are fewer than four turning points (overdamped).
    """
    turns = np.flatnonzero(np.sign(speed[1:-1]) * np.sign(speed[2:]) < 0) + 1
    if turns.size < 4:
        return float("nan"), float("nan")
    fraction = speed[turns] / (speed[turns] - speed[turns + 1])
    instants = time[turns] + fraction * (time[turns + 1] - time[turns])
    step = time[turns + 1] - time[turns]
    extremes = position[turns] + 0.5 * speed[turns] * fraction * step
    half_cycles = np.abs(np.diff(extremes[:4]))
    half_decrement = float(np.log(half_cycles[0] / half_cycles[2]) / 2)
    ratio = half_decrement / np.hypot(np.pi, half_decrement)
    return float(ratio), half_decrement / float(np.mean(np.diff(instants[:4])))


def release_pair(parameters: UnpublishedParameters, data: str = FORCE_MAPS[0]) -> tuple[Release, Release]:
    """Simulate the releases from both initial pressures; the lower one first."""
    low, high = (release(parameters, each.value, data) for each in (parameters.low_pressure, parameters.high_pressure))
    return low, high


def compare_releases(low: Release, high: Release) -> dict[str, float]:
    """Return the four statements as values: two differences that must be positive, two relative damping differences."""

    def relative_difference(a: float, b: float) -> float:
        return abs(a - b) / max(abs(a), abs(b))

    return {
        "acceleration": high.initial_acceleration - low.initial_acceleration,
        "contraction": (high.max_contraction - low.max_contraction) * 100,
        "relative damping": relative_difference(high.damping_ratio, low.damping_ratio),
        "absolute damping": relative_difference(high.decay_rate, low.decay_rate),
    }


def range_table(parameters: UnpublishedParameters) -> Table:
    """Return the four statements for both ends of the range of every chosen value, and for the second force map."""
    named = zip(("nominal values", "surface fitted to the tool table"), FORCE_MAPS, strict=True)
    cases = [(name, parameters, data) for name, data in named]
    for name, item in rig.chosen_values(parameters).items():
        if name != "load":  # used during fill and discharge only
            cases += [(f"{name.replace('_', ' ')} {end:g} {item.unit}", parameters.with_value(name, end), FORCE_MAPS[0])
                      for end in (item.low, item.high)]  # fmt: skip
    values = [compare_releases(*release_pair(case, data)) for _, case, data in cases]
    columns: dict[str, Any] = {"varied parameter": [name for name, _, _ in cases]}
    for key, unit in zip(STATEMENTS, ("m/s2", "% of length", "1", "1"), strict=True):
        columns[f"{key}, difference [{unit}]"] = [row[key] for row in values]
    note = (
        "Damping differences are relative to the larger value; they are comparable up to "
        f"{MAX_DAMPING_DIFFERENCE:g} (chosen)."
    )
    return Table("hosovsky_release_ranges", "Quick release over the ranges of all chosen values", columns, note)


def claims(low: Release, high: Release, ranges: Table) -> tuple[Claim, ...]:
    """Return the claims on Fig. 4 for the nominal values; the notes give their ranges, each value varied alone."""
    values, varied, result = compare_releases(low, high), ranges.columns["varied parameter"], []
    for (key, row), column in zip(STATEMENTS.items(), list(ranges.columns.values())[1:], strict=True):
        failing = [name for name, value in zip(varied, column, strict=True) if not agrees(key, value)]
        outcome = "it holds" if not failing else f"it does not hold for {', '.join(failing)}; otherwise it holds"
        note = (
            f"Initial gauge pressures {low.pressure / 1e3:g} and {high.pressure / 1e3:g} kPa (chosen). Each chosen "
            f"value varied alone over its range: {min(column):.3g} to {max(column):.3g} {format_unit(row.unit)}"
        )
        result.append(row.claim(rig.PAPER, "nominal values", values[key], f"{note.rstrip()}; {outcome}."))
    return tuple(result)


def figure_4(low: Release, high: Release) -> Plot:
    """Return Fig. 4: contraction and acceleration after the release."""
    figure, axes = new_figure(2, 1, height=4.6, sharex=True)
    for i, one in enumerate((low, high)):
        label = f"{one.pressure / 1e3:g} kPa (gauge)"
        style = {"color": LINES[i], "linestyle": DASHES[i], "label": label}
        axes[0].plot(one.run["time"] - RELEASED_AT, one.run["contraction"] * 100, **style)
        axes[1].plot(one.run["time"] - RELEASED_AT, one.run["acceleration"], **style)
    axes[0].set_ylabel("contraction [%]")
    axes[1].set(ylabel="acceleration [m/s²]", xlabel="time after the release [s]", xlim=(-0.2, 3.0))
    legend_below(figure, axes[0])
    return captioned("hosovsky_fig4", figure)
