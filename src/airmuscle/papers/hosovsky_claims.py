"""Claims of Hošovský et al. on surface, sensor, hysteresis and gas, and the comparisons that belong to them."""

from __future__ import annotations

import numpy as np

import airmuscle as am

from ..bench.identify.censored_least_squares import uncensored_rank
from ..physics.muscle.characteristic.contractile_surface import exponents
from ..report.chapter import AtMost, Claim, Equal, Kind
from .hosovsky_effects import Effect
from .hosovsky_plant import PAPER, SUPPLY_PRESSURE, VOLUME_FLOW_RATIO, surface
from .hosovsky_schedule import FILLING

SENSOR_RANGE = 0.6
"""Upper end of the range of the pressure sensor [MPa], printed."""
NEGLIGIBLE = 5.0
"""Pressure change [kPa] that is negligible: a tenth of that by heat transfer (chosen)."""


def surface_claims(fit: am.Fit) -> tuple[Claim, ...]:
    """Return the checks of the contractile surface: number and rank of its coefficients, force limits."""
    law = surface()
    rank = uncensored_rank(fit.problem, fit.problem.jacobian(fit.values))
    force = law.force(np.linspace(0, 1e6, 51)[:, None], np.linspace(-0.05, 0.4, 46)[None, :])
    positive = "coefficients determined by the rows of the force map with a positive force"
    note = f"Condition number {fit.condition:.3g} (scaled); rms error {fit.rmse:.3g} N. "
    note += " ".join(map(_sentence, fit.notes))
    limit = "force compensator: {} force of the surface"
    check = Kind.CHECK
    return (
        Claim(
            PAPER, "coefficients of a polynomial of total degree five", Equal(21, 0), len(exponents(5)), "1", kind=check
        ),
        Claim(PAPER, positive, Equal(21, 0, derived=True), rank, "1", note, kind=check),
        Claim(PAPER, limit.format("maximum"), Equal(1200.0, 0.0), float(force.max()), "N", kind=check),
        Claim(PAPER, limit.format("minimum"), Equal(0.0, 0.0, derived=True), float(force.min()), "N", kind=check),
    )


def _sentence(note: str) -> str:
    return f"{note[:1].upper()}{note[1:].rstrip('.')}."


def measurement_claims() -> tuple[Claim, ...]:
    """Return the claims on sensor range and hysteresis, which concern the measurement."""
    text = f"the pressure sensor of 0 to {SENSOR_RANGE:g} MPa covers the step of 650 kPa: largest gauge pressure"
    inferred = "The paper does not state whether step and range are gauge or absolute; the range is taken as gauge."
    hysteresis = "No branches of a fluidic muscle and of another muscle are printed, so that they cannot be compared."
    return (
        Claim(PAPER, text, AtMost(SENSOR_RANGE), SUPPLY_PRESSURE / 1e6, "MPa", inferred, "step absolute"),
        Claim(PAPER, text, AtMost(SENSOR_RANGE), 0.65, "MPa", inferred, "step gauge"),
        Claim(
            PAPER, "the hysteresis of a fluidic muscle is less pronounced", None, None, "%", hysteresis, untestable=True
        ),
    )  # fmt: skip


def gas_findings(effects: tuple[Effect, ...]) -> tuple[Claim, ...]:
    """Return the effects of the ideal gas and of the reference density, compared with a negligible change."""
    text = "suspected cause, ideal gas: largest pressure change during filling"
    notes = {
        "second virial": "The virial coefficient is that of dry air at 20 °C after CIPM-2007.",
        "volume flow": r"Equation (11) multiplies the volume flow by \(P_0\) = 100 kPa; the mass flow by ISO 6358 has "
        rf"\(R\,T_0\,\rho_0\) = {100e3 / VOLUME_FLOW_RATIO / 1e3:.5g} kPa in its place, because the reference density "
        r"of 1.185 kg/m³ is that of humid air and \(R\) that of dry air. The mass flow is the default.",
    }
    texts = {"second virial": text, "volume flow": "reference density of (11): largest pressure change during filling"}
    bound = AtMost(NEGLIGIBLE, chosen=True)
    return tuple(
        Claim(PAPER, texts[key], bound, abs(e.largest("pressure", FILLING)) / 1e3, "kPa",
              f"{notes[key]} A tenth of the effect of heat transfer is negligible (chosen).", kind=Kind.FINDING)
        for e in effects
        for key in texts
        if e.substitution.cause == "gas law" and e.substitution.component.startswith(key)
    )  # fmt: skip
