"""The chapter of a report that a fit fills."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from ..core.reference import cite
from .band_plot import band_plot
from .chapter import Chapter, Plot, Table
from .chart import chart, isobars
from .levels import levels_of
from .shape_chapter import breaks_table

if TYPE_CHECKING:
    from ..identify.result import Fit
    from ..library.entry import Entry

MOST_CURVES = 8


def fit_chapter(fit: Fit, entry: Entry, notes: Sequence[str] = ()) -> Chapter:
    """A fit's figures of merit, parameters, isobars with the measured points, and errors, row by row."""
    said = "\n\n".join((*fit.notes, *notes))
    errors = Plot("errors", "Model against measurement, and the errors.", fit.plot())
    return Chapter(
        paper="fit",
        title=entry.title,
        summary=f"{entry.note}\n\n{said}",
        tables=(_figures(fit), _parameters(fit), *_shape(fit), _correlations(fit), _rows(fit)),
        plots=tuple(plot for plot in (_isobars(fit, entry), errors, band_plot(fit)) if plot is not None),
        references=tuple(cite(entry)),
    )


def _figures(fit: Fit) -> Table:
    names, texts = zip(*fit.summary(), strict=True)
    return Table("figures", "Figures of the fit", {"figure": list(names), "value": list(texts)})


def _parameters(fit: Fit) -> Table:
    return Table(
        "parameters",
        "Parameters",
        {
            "parameter": [e.name for e in fit.estimates],
            "symbol": [e.label for e in fit.estimates],
            "value (SI)": [e.value for e in fit.estimates],
            "standard deviation (SI)": [e.stderr for e in fit.estimates],
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
        "Measured and modelled",
        {
            "pressure [Pa]": fit.recording["pressure"],
            "contraction [1]": fit.recording["contraction"],
            "force [N]": fit.recording["force"],
            f"modelled {fit.fitted_quantity.name} [{unit}]": fit.modelled,
            f"error [{unit}]": fit.residuals,
            "cut off": (fit.censoring != 0).astype(int),
        },
        shown=False,
    )


def _isobars(fit: Fit, entry: Entry) -> Plot:
    """The isobars of the fitted law at pressures that were measured, with their points."""
    curves = isobars(fit.model, entry.validity_range, pressures=levels_of(fit.recording["pressure"], MOST_CURVES))
    return chart(fit.model, entry.title, curves, entry.validity_range, measured=fit.recording)


def _shape(fit: Fit) -> list[Table]:
    """Where the fitted law breaks what every muscle keeps, if it does anywhere."""
    from ..identify.surface.shape import shape_violations_of_fit

    found = shape_violations_of_fit(fit)
    return [breaks_table(found, "shape", "Where the law behaves as no muscle does")] if found else []
