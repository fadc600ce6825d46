"""Fill and discharge, Fig. 3 of Hošovský et al.: simulation, figures, and claims on surface, valve
and fill.
"""

import dataclasses

import numpy as np

import airmuscle as am

from ..bench.estimation.variable_projection import uncensored_rank
from ..core import BLACK, LINES, new_figure
from ..physics.muscle.characteristic.contractile_surface import exponents
from ..report.chapter import Plot
from ..report.claims import Claim, Equal, claims_of
from . import hosovsky_plant as rig
from .hosovsky_effects import Effect
from .hosovsky_plant import MATRIX, PAPER, UnpublishedParameters, hanging_load, plant, surface
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
    """Return Fig. 3: muscle pressure and displacement over time; the paper gives no values of its
    curve.
    """
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
    axes.set(
        xlabel="pressure ratio $p_2/p_1$", ylabel="mass flow [g/s]", ylim=(0, None), xlim=(0, 1)
    )
    return captioned("hosovsky_valve", figure)


def end_of_choked_flow(plant: am.Plant) -> tuple[float, float]:
    """Return the absolute muscle pressure [Pa] at which the choked flow ends, and the pressure step
    of a row [Pa].
    """
    instants = np.append(np.arange(rig.FILLING[0], rig.FILLING[0] + 1.0, 1e-4), rig.DURATION)
    run = am.simulate(
        plant,
        rig.SCHEDULE,
        duration=rig.DURATION,
        integrator=am.Rodas4(1e-8),
        output_times=instants,
    )
    filling = (run["time"] >= rig.FILLING[0]) & (run["time"] < rig.FILLING[0] + 1.0)
    flow = run["mass_flow"][filling]
    pressure = run["pressure"][filling] + plant.ambient.pressure
    subsonic = int(np.argmax(flow < flow.max() * (1 - 1e-9)))
    return float(pressure[subsonic]), float(np.diff(pressure).max())


def determined_coefficients(fit: am.Fit) -> tuple[float, str]:
    """Return the rank of the fit at its positive forces [1]."""
    notes = " ".join(f"{note[:1].upper()}{note[1:].rstrip('.')}." for note in fit.notes)
    rank = uncensored_rank(fit.problem, fit.problem.jacobian(fit.values))
    return (
        rank,
        f"Condition number {fit.condition:.3g} (scaled); rms error {fit.rmse:.3g} N. {notes}",
    )


def limited_forces() -> np.ndarray:
    """Return the forces [N] of the limited surface over pressure and contraction."""
    return np.asarray(
        surface().force(np.linspace(0, 1e6, 51)[:, None], np.linspace(-0.05, 0.4, 46)[None, :])
    )


SURFACE = (
    claim_row(PAPER, "coefficients", lambda fit: len(exponents(5))),
    claim_row(PAPER, "determined coefficients", determined_coefficients),
    claim_row(PAPER, "maximum force", lambda fit: float(limited_forces().max())),
    claim_row(PAPER, "minimum force", lambda fit: float(limited_forces().min())),
)
FILL = (
    claim_row(PAPER, "filled pressure", lambda fill: fill.filled / 1e3),
    claim_row(PAPER, "steps", lambda fill: fill.printed_method.statistics.steps),
    claim_row(PAPER, "position", lambda fill: fill.difference("position")),
    claim_row(PAPER, "pressure", lambda fill: fill.difference("pressure")),
)
STEP = {"step absolute": (rig.SUPPLY_PRESSURE / 1e6,), "step gauge": (0.65,)}
"""Readings of the step of 650 kPa as gauge pressures [MPa]."""
MEASUREMENT = (claim_row(PAPER, "sensor", lambda step: step, STEP), claim_row(PAPER, "hysteresis"))
GAS = {
    name: claim_row(PAPER, name, lambda change: change) for name in ("second virial", "volume flow")
}
"""Claims on a substitution, by the beginning of its name."""


def fill_claims(fill: FillRun, explanation: str = "") -> tuple[Claim, ...]:
    """Return the claims on valve, solver and fill; `explanation` describes the causes of the
    deviations.
    """
    choke_end, step = end_of_choked_flow(fill.plant)
    choked = claim_row(
        PAPER, "choked flow", printed=Equal(0.433 * 650.0, 2e-3 * step, derived=True)
    )
    valve = claim_row(
        PAPER, "conductance", lambda fill: fill.plant.circuits[0].fill.conductance * 1e5 * 60e3
    )
    return (
        valve.claim("", fill),
        choked.claim("", choke_end / 1e3, ""),
        *claims_of(FILL, fill),
        claim_row(PAPER, "deviations").claim("", None, explanation),
    )


def gas_findings(effects: tuple[Effect, ...]) -> tuple[Claim, ...]:
    """Return the effects of the ideal gas and of the reference density, compared with a negligible
    change.
    """
    changes = {
        each.substitution.component: each.largest("pressure", rig.FILLING) for each in effects
    }
    return tuple(
        row.claim("", abs(change) / 1e3)
        for component, change in changes.items()
        for key, row in GAS.items()
        if component.startswith(key)
    )
