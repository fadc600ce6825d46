"""Section of a fit report: the equation of the fitted law, its symbols with values, and its text for other programs."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import Any

from ...core.reference import Reference
from ...physics.muscle.characteristic import PooledLengthLaw
from ...report.chapter import DisplayedEquation, Table
from ...report.equation import LawEquation, law_equation
from ...report.equation.source_code import REMARKS, displayed_lines, source_codes
from ...report.formatting import format_number, format_unit
from . import Fit


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
        titled = dataclasses.replace(
            equations[-1], title=f"Effect of specimen {name}, added to the law of the population {_share(law)}".rstrip()
        )
        shown.append(_displayed(titled, f"effect-{i}", validity))
    surface: Any = law.effects[0]
    columns: dict[str, list[Any]] = {"term": list(surface.term_labels)}
    for name, values, errors in zip(law.specimens, effects.coefficients, effects.standard_errors, strict=True):
        columns |= {f"{name} [N]": list(values), f"{name}, standard error [N]": list(errors)}
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
    columns: dict[str, list[Any]] = {
        "symbol": [each.name for each in equation.parameters],
        "value (SI)": [each.value for each in equation.parameters],
        "unit": [format_unit(each.unit) for each in equation.parameters],
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
