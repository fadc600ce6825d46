"""Result of a comparison for the page: ranking, exclusions, equation, parity, bands and estimates, all SI."""

from __future__ import annotations

import math
from typing import Any

import airmuscle as am

from ...bench.identify.compare_chapter import LawSelection
from ...bench.identify.curve_plots import band_curves
from ...bench.identify.static_fit_chapter import equation_section
from ...report.chapter import Chapter
from ...report.data import as_sheet, in_words
from ...report.formula import to_display_mathml
from .fit_hints import in_page_words

MAX_POINTS = 4000
"""Maximum number of points of the parity chart; of more rows every n-th one is shown (chosen)."""


def result_sheet(selection: LawSelection, fit: am.Fit) -> dict[str, Any]:
    """The selection and the recommended fit as plain data."""
    best = selection.recommended
    return {
        "recommended": best.candidate.name,
        "parameters": best.parameter_count,
        "error": best.cross_validated_rmse,
        "reason": selection.reason,
        "comparisons": [
            {"purpose": each.purpose, "group": each.leave_out.group_name, **_sheet(each.chapter())}
            for each in selection.comparisons
        ],
        "fit": _sheet(fit.chapter()),
        "equations": _equations(fit),
        "parity": _parity(fit),
        "bands": _bands(fit),
    }


def _sheet(chapter: Chapter) -> dict[str, Any]:
    return as_sheet(in_words(chapter, in_page_words))


def _equations(fit: am.Fit) -> list[dict[str, Any]]:
    shown, _ = equation_section(fit)
    return [
        {
            "title": each.title, "note": each.note, "lines": [to_display_mathml(line) for line in each.lines],
            "sources": dict(each.sources),
        }
        for each in shown
    ]  # fmt: skip


def _parity(fit: am.Fit) -> dict[str, Any]:
    quantity = fit.fitted_quantity
    step = max(1, math.ceil(fit.rows_used / MAX_POINTS))
    rows = slice(None, None, step)
    return {
        "quantity": quantity.name,
        "unit": quantity.unit,
        "step": step,
        "measured": fit.recording[quantity.name][rows],
        "modelled": fit.modelled[rows],
        "residual": fit.residuals[rows],
        "censored": (fit.censoring != 0)[rows],
        **{name: fit.recording[name][rows] for name in ("pressure", "contraction", "force")},
    }


def _bands(fit: am.Fit) -> dict[str, Any] | None:
    computed = band_curves(fit)
    if computed is None:
        return None
    axes, curves = computed
    return {
        "constant": axes.constant,
        "varying": axes.varying,
        "basis": fit.error_basis,
        "curves": [
            {
                "level": each.level, "x": each.points, "value": each.confidence.value,
                "low": each.confidence.low, "high": each.confidence.high,
                "prediction_low": each.prediction.low, "prediction_high": each.prediction.high,
            }
            for each in curves
        ],
    }  # fmt: skip
