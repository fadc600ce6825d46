"""Report chapter of a static fit with the equation of its law."""

import dataclasses
from collections.abc import Mapping, Sequence
from functools import partial
from typing import Any, Protocol

from ...core import AirmuscleError, Reference, cite
from ...physics.muscle.characteristic import PooledLengthLaw, ValidityRange
from ...physics.muscle.characteristic.energy_defect import maxwell_defect
from ...physics.muscle.geometry import Geometry
from ...physics.muscle.isobars import compute_isobars, isobar_figure
from ...report.chapter import BY_ROW, Chapter, DisplayedEquation, NamedValue, Plot, Table, TableColumn
from ...report.equation import LawEquation, law_equation
from ...report.equation.source_code import REMARKS, displayed_lines, source_codes
from ...report.formatting import format_number
from . import Fit
from .cross_validation import is_pressure_ramp, levels_of
from .curve_plots import band_plot, ramp_plot
from .surface.shape import shape_violations_of_fit
from .uncertainty_chapter import violation_table
from .volume_fit import defect_values

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


def fit_chapter(
    fit: Fit, entry: MuscleDescription, notes: Sequence[str] = (), of_recordings: Sequence[str] = ()
) -> Chapter:
    """Return the chapter of a fit with its muscle: equation, goodness of fit, parameters, isobars, residuals.

    notes          on the fit and the muscle
    of_recordings  notes on the reading of the data, for the page
    """
    chapter, (equations, symbols) = fit.chapter(), equation_section(fit)
    plots = (ramp_plot(fit), _isobars(fit, entry), *chapter.plots, band_plot(fit))
    parameters, correlations = chapter.tables
    violations, title = shape_violations_of_fit(fit), "Monotonicity violations of the fitted law"
    broken = (violation_table(violations, "shape", title),) if violations else ()
    return dataclasses.replace(
        chapter,
        title=entry.title,
        summary=(*chapter.paragraphs, entry.note, *of_recordings),
        values=(*chapter.values, *(dataclasses.replace(each, brief=False) for each in _energy_consistency(fit, entry))),
        equations=equations,
        tables=(*symbols, parameters, *broken, correlations, _rows(fit)),
        plots=tuple(plot for plot in plots if plot is not None),
        notes=(*chapter.notes, *notes),
        references=tuple(cite(entry)),
    )


def _energy_consistency(fit: Fit, entry: MuscleDescription) -> list[NamedValue]:
    """The Maxwell defect of the law with the volume of the muscle, if it has one."""
    if entry.geometry is None or entry.validity_range is None:
        return []
    try:
        defect = maxwell_defect(fit.model, entry.geometry, entry.validity_range)
    except AirmuscleError:  # slack everywhere, or contractions outside the geometry
        return []
    return defect_values(defect)


def _rows(fit: Fit) -> Table:
    recording, unit = fit.recording, fit.fitted_quantity.unit
    columns = {
        "pressure": TableColumn(recording["pressure"], "Pa"),
        "contraction": TableColumn(recording["contraction"], "1"),
        "force": TableColumn(recording["force"], "N"),
        f"modelled {fit.fitted_quantity.name}": TableColumn(fit.modelled, unit),
        "residual": TableColumn(fit.residuals, unit),
        "censored": fit.censoring != 0,
    }
    return Table("rows", "Measured and modelled values", columns, series=True)


def _isobars(fit: Fit, entry: MuscleDescription) -> Plot:
    """Return the isobars of the fitted law at measured pressures, with the measured points.

    The pressures are round if the pressure was swept.
    """
    ramp = is_pressure_ramp(fit.recording["pressure"], fit.recording["contraction"])
    pressures = None if ramp else levels_of(fit.recording["pressure"], MAX_CURVES)
    curves = compute_isobars(fit.model, entry.validity_range, pressures=pressures)
    return Plot(
        "isobars",
        f"{entry.title}: force over contraction at constant gauge pressure.",
        partial(isobar_figure, fit.model, entry.title, curves, entry.validity_range, measured=fit.recording),
    )


def equation_section(fit: Fit) -> tuple[tuple[DisplayedEquation, ...], tuple[Table, ...]]:
    """Return the equations of a fitted law within the range of its data, and the table of their symbols.

    The first equation has the parameters as symbols. A polynomial in scaled quantities follows in physical quantities.
    A law without a closed form is represented by the definition in its documentation.
    """
    quantity = fit.fitted_quantity
    equations = law_equation(fit.model, quantity.name, quantity.arguments, fit.data_ranges)
    if not equations:
        return (_definition(type(fit.model)),), ()
    validity = _validity(fit.data_ranges, quantity.arguments)
    shown = tuple(_displayed(equation, f"equation-{i}", validity) for i, equation in enumerate(equations, 1))
    effects, tables = _specimen_effects(fit, validity)
    return (*shown, *effects), (_symbol_table(equations[0]), *tables)


def _specimen_effects(fit: Fit, validity: str) -> tuple[list[DisplayedEquation], list[Table]]:
    """Return the term that each specimen adds to the law of the population, and a table of the coefficients."""
    law, effects = fit.model, fit.effects
    if effects is None or not isinstance(law, PooledLengthLaw):
        return [], []
    shown, quantity = [], fit.fitted_quantity
    for i, (name, effect) in enumerate(zip(law.specimens, law.effects, strict=True), 1):
        equations = law_equation(effect, quantity.name, quantity.arguments, fit.data_ranges)
        title = f"Effect of specimen {name}, added to the law of the population {_share(law)}".rstrip()
        titled = dataclasses.replace(equations[-1], title=title)
        shown.append(_displayed(titled, f"effect-{i}", validity))
    surface: Any = law.effects[0]
    columns: dict[str, Any] = {"term": list(surface.term_labels)}
    for name, values, errors in zip(law.specimens, effects.coefficients, effects.standard_errors, strict=True):
        columns |= {name: TableColumn(values, "N"), f"{name}, standard error": TableColumn(errors, "N")}
    title = f"Specimen effects (standard deviation of the prior {format_number(effects.deviation)} N)"
    return shown, [Table("specimen-effects", title, columns)]


def _share(law: PooledLengthLaw) -> str:
    """The share of the effects where the population is slack, as a remark."""
    if not law.effect_decay:
        return ""
    return f"(below zero force of the population it decreases to zero within {format_number(1 / law.effect_decay)} N)"


def _displayed(equation: LawEquation, name: str, validity: str) -> DisplayedEquation:
    quantities = (equation.result, *equation.arguments)
    unit_of = ", ".join(f"{q.meaning} {q.name}{'' if q.unit == '1' else f' [{q.unit}]'}" for q in quantities)
    texts = {f"{language} ({REMARKS[language]})": text for language, text in source_codes(equation, validity).items()}
    note = f"{unit_of[0].upper()}{unit_of[1:]}. {validity}"
    return DisplayedEquation(name, equation.title, tuple(displayed_lines(equation)), note, texts)


def _validity(ranges: Mapping[str, tuple[float, float]], arguments: tuple[str, ...]) -> str:
    scales = {"pressure": (1e-3, " kPa"), "contraction": (1.0, ""), "force": (1.0, " N")}
    parts = [
        f"{name} {format_number(ranges[name][0] * factor)} to {format_number(ranges[name][1] * factor)}{unit}"
        for name in arguments
        for factor, unit in [scales[name]]
    ]
    return f"Valid for {' and '.join(parts)}, the range of the data; outside it the law may be continued differently."


def _symbol_table(equation: LawEquation) -> Table:
    columns: dict[str, Any] = {
        "symbol": [each.name for each in equation.parameters],
        "value": TableColumn([each.value for each in equation.parameters], BY_ROW),
        "unit": [each.unit for each in equation.parameters],
        "meaning": [each.meaning for each in equation.parameters],
    }
    return Table("equation-symbols", "Symbols of the equation", columns)


def _definition(law: type[Any]) -> DisplayedEquation:
    """Return the definition of a law whose expression has no closed form, or is too long to be shown."""
    text = " ".join((law.__doc__ or law.__name__).split("\n\n")[0].split())
    references: tuple[Reference, ...] = getattr(law, "references", ())
    sources = "; ".join(f"{each.authors} {each.year or ''}".strip() for each in references)
    note = f"{text} The law has no closed form of a length that can be shown. Source: {sources or 'none published'}."
    return DisplayedEquation("equation-1", "Definition", (), note, {})
