"""Report chapter: a static fit."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

from ...core.errors import AirmuscleError
from ...core.reference import cite
from ...physics.muscle.characteristic.energy_defect import maxwell_defect
from ...physics.muscle.characteristic.validity_range import ValidityRange
from ...physics.muscle.geometry import Geometry
from ...physics.muscle.isobar_plot import isobar_plot
from ...physics.muscle.isobars import compute_isobars
from ...report.chapter import Chapter, Plot, Table
from . import Fit
from .band_plot import band_plot
from .equation_section import equation_section
from .levels import is_pressure_ramp, levels_of
from .ramp_plot import ramp_plot
from .shape_chapter import violation_table
from .surface.shape import shape_violations_of_fit

MAX_CURVES = 8


class MuscleDescription(Protocol):
    """What a chapter states of a fitted muscle beside its law; a library Entry has it."""

    @property
    def title(self) -> str: ...
    @property
    def note(self) -> str: ...
    @property
    def geometry(self) -> Geometry | None: ...
    @property
    def validity_range(self) -> ValidityRange | None: ...


def fit_chapter(fit: Fit, entry: MuscleDescription, notes: Sequence[str] = ()) -> Chapter:
    """Return the chapter of a fit: equation, goodness of fit, parameters, isobars with measured points, residuals."""
    remarks = "\n\n".join((*fit.notes, *notes))
    equations, symbols = equation_section(fit)
    errors = Plot("errors", "Modelled against measured values, and residuals.", fit.plot())
    return Chapter(
        paper="fit",
        title=entry.title,
        summary=f"{entry.note}\n\n{remarks}",
        equations=equations,
        tables=(
            _goodness_of_fit(fit),
            *_energy_consistency(fit, entry),
            *symbols,
            _parameters(fit),
            *_violations(fit),
            _correlations(fit),
            _rows(fit),
        ),
        plots=tuple(
            plot for plot in (ramp_plot(fit), _isobars(fit, entry), errors, band_plot(fit)) if plot is not None
        ),
        references=tuple(cite(entry)),
    )


def _goodness_of_fit(fit: Fit) -> Table:
    names, texts = zip(*fit.summary(), strict=True)
    return Table("figures", "Goodness of fit", {"quantity": list(names), "value": list(texts)})


def _energy_consistency(fit: Fit, entry: MuscleDescription) -> list[Table]:
    """Return a table of the Maxwell defect of the law with the volume of the muscle, if it has one."""
    if entry.geometry is None or entry.validity_range is None:
        return []
    try:
        defect = maxwell_defect(fit.model, entry.geometry, entry.validity_range)
    except AirmuscleError:  # slack everywhere, or contractions outside the geometry
        return []
    title = "Energy consistency of force and volume"
    note = "The law and the volume derive from one potential where dF/dp + dV/dL is zero."
    return [Table("energy", title, {"quantity": ["Maxwell defect |dF/dp + dV/dL|"], "value": [str(defect)]}, note)]


def _parameters(fit: Fit) -> Table:
    return Table(
        "parameters",
        "Parameters",
        {
            "parameter": [e.name for e in fit.estimates],
            "symbol": [e.label for e in fit.estimates],
            "value (SI)": [e.value for e in fit.estimates],
            "standard error (SI)": [e.stderr for e in fit.estimates],
            "unit": ["" if e.unit == "1" else e.unit for e in fit.estimates],
            "meaning": [e.meaning for e in fit.estimates],
        },
    )


def _correlations(fit: Fit) -> Table:
    columns = {name: fit.correlations[:, i] for i, name in enumerate(fit.names)}
    return Table("correlations", "Correlations", {"parameter": list(fit.names), **columns}, shown=False)


def _rows(fit: Fit) -> Table:
    unit = fit.fitted_quantity.unit
    return Table(
        "rows",
        "Measured and modelled values",
        {
            "pressure [Pa]": fit.recording["pressure"],
            "contraction [1]": fit.recording["contraction"],
            "force [N]": fit.recording["force"],
            f"modelled {fit.fitted_quantity.name} [{unit}]": fit.modelled,
            f"residual [{unit}]": fit.residuals,
            "censored": (fit.censoring != 0).astype(int),
        },
        shown=False,
    )


def _isobars(fit: Fit, entry: MuscleDescription) -> Plot:
    """Return the isobars of the fitted law at measured pressures, with the measured points.

    The pressures are round if the pressure was swept.
    """
    ramp = is_pressure_ramp(fit.recording["pressure"], fit.recording["contraction"])
    pressures = None if ramp else levels_of(fit.recording["pressure"], MAX_CURVES)
    curves = compute_isobars(fit.model, entry.validity_range, pressures=pressures)
    return isobar_plot(fit.model, entry.title, curves, entry.validity_range, measured=fit.recording)


def _violations(fit: Fit) -> list[Table]:
    """Return a table of the regions in which the fitted law is not monotonic, if there are any."""
    broken = shape_violations_of_fit(fit)
    return [violation_table(broken, "shape", "Monotonicity violations of the fitted law")] if broken else []
