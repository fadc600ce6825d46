"""Report chapter: volume law of a muscle, its standard deviation and its consistency with the force (Maxwell)."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np

from ...core import plotting
from ...core.reference import cite
from ...physics.muscle.characteristic import Characteristic, ValidityRange
from ...physics.muscle.characteristic.energy_defect import EnergyDefect
from ...report.chapter import Chapter, NamedValue, Plot, Table, TableColumn
from ...report.parameters import parameter_table
from .volume_fit import VolumeFit

LEVELS, VOLUMES = 3, 11
"""Pressures at which the reciprocity is drawn, and contractions of the table of volumes (chosen)."""


def volume_chapter(
    fit: VolumeFit, title: str, law: Characteristic | None = None, validity_range: ValidityRange | None = None,
    defect: EnergyDefect | None = None,
) -> Chapter:  # fmt: skip
    """Return the chapter of a volume fit; with a force law also dF/dp against -dV/dL and the Maxwell defect."""
    plots = [
        Plot("volume", "Measured volumes, and the law with two standard deviations.", partial(_volume_figure, fit))
    ]
    if law is not None and validity_range is not None:
        caption = (
            "Reciprocity: dF/dp of the force law (lines, at several pressures) and -dV/dL of the volume law (thick). "
            "They are equal if force and volume derive from one potential."
        )
        plots.append(Plot("reciprocity", caption, partial(_reciprocity_figure, fit, law, validity_range)))
    model = type(fit.geometry).__name__
    return Chapter(
        name="volume",
        title=title,
        summary=f"{volume_summary(fit)}.",
        values=(
            NamedValue("law", model, brief=False),
            NamedValue("points", len(fit.points.contraction), brief=False),
            NamedValue("fills", fit.points.fills, brief=False),
            NamedValue("rms residual", fit.rmse, "m3", "cm3", brief=False),
            NamedValue("maximum standard deviation", _largest_deviation(fit), "m3", "cm3", brief=False),
            *([] if defect is None else defect_values(defect)),
        ),
        tables=(_volumes(fit), _compared(fit),
                parameter_table(fit.geometry, "volume-parameters", f"Parameters of {model}")),
        plots=tuple(plots),
        references=tuple(cite(fit.geometry)),
    )  # fmt: skip


def defect_values(defect: EnergyDefect) -> list[NamedValue]:
    """The Maxwell defect and its place; it is zero where force and volume derive from one potential."""
    return [
        NamedValue("Maxwell defect", defect.worst, defect.unit, remark=f"|dF/dp + dV/dL| {defect.place}"),
        NamedValue("relative Maxwell defect", defect.relative, "1", "%", remark="of the maximum of -dV/dL"),
    ]


def volume_summary(fit: VolumeFit) -> str:
    """The law with its residual and its standard deviation."""
    return (
        f"{type(fit.geometry).__name__}, rms residual {1e6 * fit.rmse:.4g} cm3, standard deviation of the volume at "
        f"most {1e6 * _largest_deviation(fit):.4g} cm3"
    )


def _largest_deviation(fit: VolumeFit) -> float:
    return float(fit.standard_deviation(fit.points.contraction).max())


def _volumes(fit: VolumeFit) -> Table:
    contraction = np.linspace(fit.points.contraction.min(), fit.points.contraction.max(), VOLUMES)
    columns = {
        "contraction": TableColumn(contraction, "1", "%"),
        "volume": TableColumn(np.asarray(fit.geometry.volume(contraction)), "m3", "cm3"),
        "standard deviation": TableColumn(fit.standard_deviation(contraction), "m3", "cm3", digits=2),
    }
    return Table("volume", "Volume of the muscle", columns, brief=(0, VOLUMES // 2, VOLUMES - 1))


def _compared(fit: VolumeFit) -> Table:
    ranked = sorted(fit.aicc.items(), key=lambda item: item[1])
    columns = {
        "law": [name for name, _ in ranked],
        "AICc above the best": [value - ranked[0][1] for _, value in ranked],
    }
    return Table("volume-laws", "Volume laws", columns)


def _volume_figure(fit: VolumeFit) -> Any:
    figure, axes = plotting.new_figure()
    contraction = np.linspace(fit.points.contraction.min(), fit.points.contraction.max(), 201)
    volume, error = np.asarray(fit.geometry.volume(contraction)), 2 * fit.standard_deviation(contraction)
    axes.plot(100 * contraction, 1e6 * volume, color=plotting.LINES[0], label=type(fit.geometry).__name__)
    axes.fill_between(100 * contraction, 1e6 * (volume - error), 1e6 * (volume + error), color=plotting.LINES[0],
                      alpha=0.25, linewidth=0)  # fmt: skip
    axes.plot(100 * fit.points.contraction, 1e6 * fit.points.volume, ".", color=plotting.BLACK, label="measured")
    axes.set(xlabel="contraction [%]", ylabel="volume [cm³]")
    axes.legend()
    return figure


def _reciprocity_figure(fit: VolumeFit, law: Characteristic, validity_range: ValidityRange) -> Any:
    figure, axes = plotting.new_figure()
    low, high = validity_range.contraction
    contraction = np.linspace(
        max(low, float(fit.points.contraction.min())), min(high, float(fit.points.contraction.max())), 121
    )
    for i, pressure in enumerate(np.linspace(*validity_range.pressure, LEVELS + 2)[1:-1]):
        pressures = np.full(contraction.size, pressure)
        taut = np.asarray(law.force(pressures, contraction)) > 0
        slope = np.where(taut, law.slopes(pressures, contraction).by_pressure, np.nan)
        axes.plot(100 * contraction, 1e4 * slope, color=plotting.LINES[i + 1], label=f"dF/dp, {pressure / 1e3:.4g} kPa")
    geometry = fit.geometry
    area = np.asarray(geometry.volume_derivative(contraction)) / geometry.resting_length
    axes.plot(100 * contraction, 1e4 * area, color=plotting.BLACK, linewidth=2, label="-dV/dL")
    axes.set(xlabel="contraction [%]", ylabel="area [cm²]")
    axes.legend()
    return figure
