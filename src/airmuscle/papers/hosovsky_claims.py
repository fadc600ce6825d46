"""Claims of Hošovský et al. as tables, and ratios of the effects over the ranges of the suspected causes."""

import dataclasses
import math
from dataclasses import replace
from typing import Any

import numpy as np

import airmuscle as am

from ..bench.identify.variable_projection import uncensored_rank
from ..physics.muscle.characteristic.contractile_surface import exponents
from ..report.chapter import Table
from ..report.claims import AtMost, Claim, ClaimRow, Equal, Kind, claims_of
from ..report.formatting import format_unit
from . import hosovsky_effects as causing
from .hosovsky_effects import Effect, SuspectedCauses, effect_of, substitutions
from .hosovsky_fill_and_release import FillRun, end_of_choked_flow
from .hosovsky_plant import FILLING, PAPER, SUPPLY_PRESSURE, VOLUME_FLOW_RATIO, UnpublishedParameters, surface
from .run import titled

STRONGER = 1.2
"""Ratio above which filling is affected more than discharging, by at least a fifth (chosen)."""
SMALLEST_EFFECT = 100.0
"""Pressure change [Pa] below which a ratio has no meaning (chosen)."""
SENSOR_RANGE = 0.6
"""Upper end of the range of the pressure sensor [MPa], printed."""
NEGLIGIBLE = 5.0
"""Pressure change [kPa] that is negligible: a tenth of that by heat transfer (chosen)."""
CHECK = Kind.CHECK


@dataclasses.dataclass(frozen=True)
class RatioRange:
    """Ratio of filling to discharging at both ends of a parameter's range and at its chosen value; NaN if no effect."""

    meaning: str
    unit: str
    values: tuple[float, float, float]
    ratios: tuple[float, float, float]

    @property
    def stronger(self) -> bool:
        """Whether filling is affected more by at least a fifth at all three values that have an effect."""
        return all(math.isnan(ratio) or ratio > STRONGER for ratio in self.ratios)


def ratio_ranges(parameters: UnpublishedParameters, suspected: SuspectedCauses) -> tuple[RatioRange, ...]:
    """Simulate fill and discharge at the low end, the chosen value and the high end of each parameter."""
    base = causing.run_fill_of(causing.PRINTED, parameters)

    def ratio(name: str, value: float) -> float:
        varied = replace(suspected, **{name: replace(getattr(suspected, name), value=value)})
        chosen = next(s for s in substitutions(parameters, varied) if s.varied == name)
        effect = effect_of(base, chosen, causing.run_fill_of(chosen, parameters))
        small = abs(effect.largest("pressure", FILLING)) < SMALLEST_EFFECT
        return math.nan if small else causing.fill_discharge_ratio(effect)

    result = []
    for name in (s.varied for s in substitutions(parameters, suspected) if s.varied):
        item = getattr(suspected, name)
        low, middle, high = values = (item.low, item.value, item.high)
        ratios = (ratio(name, low), ratio(name, middle), ratio(name, high))
        result.append(RatioRange(item.meaning, item.unit, values, ratios))
    return tuple(result)


def range_table(ranges: tuple[RatioRange, ...]) -> Table:
    """Return the ratios of filling to discharging over the ranges of the parameters."""
    columns: dict[str, list[Any]] = {
        "parameter": [r.meaning for r in ranges],
        "unit": [format_unit(r.unit) for r in ranges],
    }
    places = ("low end", "chosen value", "high end")
    columns |= {place: [r.values[i] for r in ranges] for i, place in enumerate(places)}
    for i, place in enumerate(places):
        ratios = [None if math.isnan(r.ratios[i]) else float(f"{r.ratios[i]:.3g}") for r in ranges]
        columns[f"ratio at the {place} [1]"] = ratios
    return titled("hosovsky_effect_ranges", columns)


def describe_ranges(ranges: tuple[RatioRange, ...]) -> str:
    """Return for which parameters filling is affected more by at least a fifth over their whole range."""
    held = [r.meaning for r in ranges if r.stronger]
    failing = [
        f"{r.meaning} (ratio {r.ratios[0]:.3g}, {r.ratios[1]:.3g} and {r.ratios[2]:.3g} at {r.values[0]:g}, "
        f"{r.values[1]:g} and {r.values[2]:g} {format_unit(r.unit)})".replace(" )", ")")
        for r in ranges
        if not r.stronger
    ]
    text = f"Over the whole range of its parameter this holds for: {', '.join(held) or 'none'}."
    return text + (f" It does not hold over the range of: {', '.join(failing)}." if failing else "")


def determined_coefficients(fit: am.Fit) -> tuple[float, str]:
    """Return the rank of the fit at its positive forces [1]."""
    notes = " ".join(f"{note[:1].upper()}{note[1:].rstrip('.')}." for note in fit.notes)
    rank = uncensored_rank(fit.problem, fit.problem.jacobian(fit.values))
    return rank, f"Condition number {fit.condition:.3g} (scaled); rms error {fit.rmse:.3g} N. {notes}"


def limited_forces() -> np.ndarray:
    """Return the forces [N] of the limited surface over pressure and contraction."""
    return np.asarray(surface().force(np.linspace(0, 1e6, 51)[:, None], np.linspace(-0.05, 0.4, 46)[None, :]))


SURFACE: tuple[ClaimRow, ...] = (
    ClaimRow("coefficients of a polynomial of total degree five", Equal(21, 0), "1", lambda fit: len(exponents(5)),
        kind=CHECK),
    ClaimRow("coefficients determined by the rows of the force map with a positive force", Equal(21, 0, derived=True),
        "1", determined_coefficients, kind=CHECK),
    ClaimRow("force compensator: maximum force of the surface", Equal(1200.0), "N",
        lambda fit: float(limited_forces().max()), kind=CHECK),
    ClaimRow("force compensator: minimum force of the surface", Equal(0.0, derived=True), "N",
        lambda fit: float(limited_forces().min()), kind=CHECK),
)  # fmt: skip
CHOKED = ClaimRow(
    r"the flow is choked until \(p_2/p_1 = b\): muscle pressure at which the mass flow begins to decrease",
    None, "kPa abs", None, "From the simulation with an output step of 0.1 ms; the tolerance is two steps.", kind=CHECK,
)  # fmt: skip
VALVE = ClaimRow(
    "sonic conductance of the MATRIX valve in customary units", Equal(15.70, 0.005, derived=True), "NL/(min bar)",
    lambda fill: fill.plant.circuits[0].fill.conductance * 1e5 * 60e3,
    r"The exponent of \(C\) is lost in our copy; only 10⁻⁹ gives the right order of magnitude.", kind=CHECK,
)  # fmt: skip
ACCURATE = "ode8 with a step of 0.1 ms is accurate: maximum difference in {} from Rodas4"
ACCURATE_NOTE = "The bound is chosen; Rodas4 with a relative tolerance of 10⁻⁸."
FILL: tuple[ClaimRow, ...] = (
    ClaimRow("fill with a step of 650 kPa: pressure when the fill valve closes", Equal(650.0, 0.1), "kPa abs",
        lambda fill: fill.filled / 1e3,
        "650 kPa is the supply pressure that is put in, assumed to be absolute (inferred).", kind=CHECK),
    ClaimRow("fixed step of 0.1 ms over 25 s: number of steps", Equal(250_000, 0, derived=True), "1",
        lambda fill: fill.printed_method.statistics.steps, "Integrator ode8.", kind=CHECK),
    ClaimRow(ACCURATE.format("position"), AtMost(1e-7, chosen=True), "m", lambda fill: fill.difference("position"),
        ACCURATE_NOTE, kind=CHECK),
    ClaimRow(ACCURATE.format("pressure"), AtMost(1.0, chosen=True), "Pa", lambda fill: fill.difference("pressure"),
        ACCURATE_NOTE, kind=CHECK),
)  # fmt: skip
DEVIATIONS = ClaimRow(
    "model and muscle agree well during discharge, with larger deviations during filling", None, "kPa", None,
    "The measured curve of Fig. 3 gives no values.", untestable=True, place="Fig. 3",
)  # fmt: skip
MEASUREMENT: tuple[ClaimRow, ...] = (
    ClaimRow(f"the pressure sensor of 0 to {SENSOR_RANGE:g} MPa covers the step of 650 kPa: largest gauge pressure",
        AtMost(SENSOR_RANGE), "MPa", lambda step: step,
        "The paper does not state whether step and range are gauge or absolute; the range is taken as gauge.",
        {"step absolute": (SUPPLY_PRESSURE / 1e6,), "step gauge": (0.65,)},
        place="instruments"),
    ClaimRow("the hysteresis of a fluidic muscle is less pronounced", None, "%", None,
        "No branches of a fluidic muscle and of another muscle are printed, so that they cannot be compared.",
        untestable=True, place="text"),
)  # fmt: skip
NEGLIGIBLE_NOTE = " A tenth of the effect of heat transfer is negligible (chosen)."
GAS = {
    "second virial": ClaimRow("suspected cause, ideal gas: largest pressure change during filling",
        AtMost(NEGLIGIBLE, chosen=True), "kPa", lambda change: change,
        "The virial coefficient is that of dry air at 20 °C after CIPM-2007." + NEGLIGIBLE_NOTE, kind=Kind.FINDING),
    "volume flow": ClaimRow("reference density of (11): largest pressure change during filling",
        AtMost(NEGLIGIBLE, chosen=True), "kPa", lambda change: change,
        r"Equation (11) multiplies the volume flow by \(P_0\) = 100 kPa; the mass flow by ISO 6358 has "
        rf"\(R\,T_0\,\rho_0\) = {100e3 / VOLUME_FLOW_RATIO / 1e3:.5g} kPa in its place, because the reference density "
        r"of 1.185 kg/m³ is that of humid air and \(R\) that of dry air. The mass flow is the default."
        + NEGLIGIBLE_NOTE, kind=Kind.FINDING),
}  # fmt: skip


def fill_claims(fill: FillRun, explanation: str = "") -> tuple[Claim, ...]:
    """Return the claims on valve, solver and fill; `explanation` describes the causes of the deviations."""
    choke_end, step = end_of_choked_flow(fill.plant)
    choked = replace(CHOKED, printed=Equal(0.433 * 650.0, 2e-3 * step, derived=True))
    return (
        VALVE.claim(PAPER, "", fill),
        choked.claim(PAPER, "", choke_end / 1e3, ""),
        *claims_of(FILL, PAPER, fill),
        DEVIATIONS.claim(PAPER, "", None, explanation),
    )


def gas_findings(effects: tuple[Effect, ...]) -> tuple[Claim, ...]:
    """Return the effects of the ideal gas and of the reference density, compared with a negligible change."""
    changes = {each.substitution.component: each.largest("pressure", FILLING) for each in effects}
    return tuple(
        row.claim(PAPER, "", abs(change) / 1e3)
        for component, change in changes.items()
        for key, row in GAS.items()
        if component.startswith(key)
    )
