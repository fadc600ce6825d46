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
from ..report.claims import Claim, Equal, claims_of
from ..report.formatting import format_unit
from . import hosovsky_effects as causing
from .hosovsky_effects import Effect, SuspectedCauses, effect_of, substitutions
from .hosovsky_fill_and_release import FillRun, end_of_choked_flow
from .hosovsky_plant import FILLING, PAPER, SUPPLY_PRESSURE, UnpublishedParameters, surface
from .run import claim_row, titled

STRONGER = 1.2
"""Ratio above which filling is affected more than discharging, by at least a fifth (chosen)."""
SMALLEST_EFFECT = 100.0
"""Pressure change [Pa] below which a ratio has no meaning (chosen)."""


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
STEP = {"step absolute": (SUPPLY_PRESSURE / 1e6,), "step gauge": (0.65,)}
"""Readings of the step of 650 kPa as gauge pressures [MPa]."""
MEASUREMENT = (claim_row(PAPER, "sensor", lambda step: step, STEP), claim_row(PAPER, "hysteresis"))
GAS = {name: claim_row(PAPER, name, lambda change: change) for name in ("second virial", "volume flow")}
"""Claims on a substitution, by the beginning of its name."""


def fill_claims(fill: FillRun, explanation: str = "") -> tuple[Claim, ...]:
    """Return the claims on valve, solver and fill; `explanation` describes the causes of the deviations."""
    choke_end, step = end_of_choked_flow(fill.plant)
    choked = claim_row(PAPER, "choked flow", printed=Equal(0.433 * 650.0, 2e-3 * step, derived=True))
    valve = claim_row(PAPER, "conductance", lambda fill: fill.plant.circuits[0].fill.conductance * 1e5 * 60e3)
    return (
        valve.claim(PAPER, "", fill),
        choked.claim(PAPER, "", choke_end / 1e3, ""),
        *claims_of(FILL, PAPER, fill),
        claim_row(PAPER, "deviations").claim(PAPER, "", None, explanation),
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
