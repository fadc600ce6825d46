"""Report chapter: Hošovský et al., muscle dynamics by Hill's model with valves by ISO 6358."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..analysis.energy_defect import maxwell_defect
from ..characteristic.base import Characteristic
from ..characteristic.contractile_surface import exponents
from ..core.plotting import LINES, legend_outside, new_figure
from ..core.reference import cite
from ..geometry.base import Geometry
from ..identify import Fit
from ..identify.censored_least_squares import uncensored_rank
from ..library import catalogue
from ..report.chapter import Chapter, Claim, Equal, Plot, Table
from . import hosovsky_effects as causing
from . import hosovsky_fill as filling
from . import hosovsky_release as releasing
from .hosovsky_plant import (
    FORCE_MAPS,
    MATRIX,
    MATRIX_CATALOGUE,
    PAPER,
    UnpublishedParameters,
    muscle,
    surface,
    surface_fit,
)

SUMMARY = r"""The equation of motion (1) is
\(m\,\ddot{y} + F_\text{TL} + F_\text{PP} = F_\text{KE} - F_\text{E}\), with the forces of the damper \(F_\text{TL}\),
the parallel spring \(F_\text{PP}\) and the contractile element \(F_\text{KE}\), and the external force \(F_\text{E}\).
\(F_\text{KE}\) is a polynomial of total degree five in contraction and pressure with 21 coefficients, limited to 0 to
1200 N. Two on/off valves by ISO 6358 fill and discharge the muscle.

The paper prints neither the coefficients nor mass, spring, damper and geometry. The surface is fitted to the measured
force map of a DMSP-20-300, and alternatively to the table of Festo's sizing tool. Valves, supply, schedule, released
mass and integrator are as printed. All other values are listed below with their sources. Every verdict on the quick
release states whether it holds over the ranges of all chosen values."""


def surface_claims(fit: Fit) -> tuple[Claim, ...]:
    """Return the claims on the contractile surface: number and rank of its coefficients, force limits."""
    law = surface()
    rank = uncensored_rank(fit.problem, fit.problem.jacobian(fit.values))
    force = law.force(np.linspace(0, 1e6, 51)[:, None], np.linspace(-0.05, 0.4, 46)[None, :])
    positive = "coefficients determined by the rows of the force map with a positive force"
    note = f"Condition number {fit.condition:.3g} (scaled); rms error {fit.rmse:.3g} N. "
    note += " ".join(map(_sentence, fit.notes))
    limit = "force compensator: {} force of the surface"
    return (
        Claim(PAPER, "coefficients of a polynomial of total degree five", Equal(21, 0), len(exponents(5)), "1"),
        Claim(PAPER, positive, Equal(21, 0), rank, "1", note),
        Claim(PAPER, limit.format("maximum"), Equal(1200.0, 0.0), float(force.max()), "N"),
        Claim(PAPER, limit.format("minimum"), Equal(0.0, 0.0), float(force.min()), "N"),
    )


def _sentence(note: str) -> str:
    return f"{note[:1].upper()}{note[1:].rstrip('.')}."


def surface_figure() -> Plot:
    """Return the isobars of the surface and the measured points; Fig. 2 of the paper shows the surface."""
    law, data = surface(), catalogue.load_data(FORCE_MAPS[0])
    figure, axes = new_figure()
    contraction = np.linspace(0.0, 0.26, 200)
    for i, pressure in enumerate((675e3, 525e3, 375e3, 250e3, 135e3)):
        rows = np.isclose(data["pressure"], pressure)
        axes.plot(contraction * 100, law.force(pressure, contraction), color=LINES[i], label=f"{pressure / 1e3:g} kPa")
        axes.plot(data["contraction"][rows] * 100, data["force"][rows], "o", color=LINES[i])
    axes.axhline(1200.0, color="0.4", linewidth=0.8, linestyle=":")
    axes.set(xlabel="contraction [%]", ylabel="force [N]", xlim=(0, 27), ylim=(-30, 1700))
    legend_outside(axes, title="gauge pressure")
    caption = "Contractile surface (lines) fitted to a measured DMSP-20-300 (points), limited to 0 to 1200 N (dotted)."
    return Plot("hosovsky_surface", caption, figure)


def coefficient_table() -> Table:
    """Return the fitted coefficients in plain units, p in bar, which the paper does not print."""
    plain = {name: surface(name).monomial_coefficients(1e5) for name in FORCE_MAPS}
    powers = exponents(5)
    columns: dict[str, list[float] | list[int]] = {
        "power of contraction": [i for i, _ in powers],
        "power of pressure": [j for _, j in powers],
    }
    for name in FORCE_MAPS:
        columns[f"{name} [N/bar^j]"] = [plain[name][power] for power in powers]
    note = (
        r"\(F = \sum a_{ij}\,\varepsilon^i p^j\) with the contraction \(\varepsilon\) as a ratio and the gauge "
        r"pressure \(p\) in bar; only within the validity range of the data."
    )
    return Table("hosovsky_coefficients", "Fitted coefficients of the contractile surface", columns, note)


def chapter(
    parameters: UnpublishedParameters | None = None, suspected: causing.SuspectedCauses | None = None
) -> Chapter:
    """Return the chapter of the report; both arguments contain values that the paper does not print."""
    parameters, suspected = parameters or UnpublishedParameters(), suspected or causing.SuspectedCauses()
    fill = filling.run_fill(parameters)
    effects = causing.compute_effects(parameters, suspected)
    low, high = releasing.release_pair(parameters)
    ranges = releasing.range_table(parameters)
    return Chapter(
        PAPER,
        "Hošovský et al.: muscle dynamics by Hill's model",
        SUMMARY,
        claims=(
            *surface_claims(surface_fit()),
            *filling.claims(fill, causing.describe_effects(effects)),
            *releasing.claims(low, high, ranges),
        ),
        tables=(
            causing.effect_table(effects),
            ranges,
            coefficient_table(),
            maxwell_table(parameters),
            _extrapolation_table(fill, low, high),
            *_time_series(fill, low, high),
        ),
        plots=(
            surface_figure(),
            filling.valve_figure(MATRIX, fill.plant.ambient.temperature),
            filling.figure_3(fill),
            causing.effect_plot(effects),
            releasing.figure_4(low, high),
        ),
        references=(*cite(fill.plant), MATRIX_CATALOGUE, *cite(catalogue.load_law(FORCE_MAPS[0]))),
        chosen=(*parameters.as_rows(), *suspected.as_rows()),
    )


def maxwell_table(parameters: UnpublishedParameters) -> Table:
    """Return the Maxwell defects of the fitted surfaces and of the law of the measured muscles."""
    shape = muscle(parameters).geometry
    laws: dict[str, tuple[Characteristic, Geometry]]
    laws = {f"surface fitted to {name}, without the limits": (surface_fit(name).model, shape) for name in FORCE_MAPS}
    for name in ("dmsp-20-300", "dmsp-10-250"):
        entry = catalogue.load_law(name)
        laws[f"Martens-Boblan 2017, {name}"] = (entry.characteristic, entry.muscle.geometry)
    validity_ranges = [
        surface(FORCE_MAPS[0]).validity_range,
        surface(FORCE_MAPS[1]).validity_range,
        *(catalogue.load_law(n).validity_range for n in ("dmsp-20-300", "dmsp-10-250")),
    ]
    defects = [
        maxwell_defect(law, volume, validity_range)
        for (law, volume), validity_range in zip(laws.values(), validity_ranges, strict=True)
        if validity_range
    ]
    columns: dict[str, list[Any]] = {
        "muscle": list(laws),
        r"largest \(\left|\frac{\partial F}{\partial p} + \frac{\text{d}V}{\text{d}L}\right|\) [mm2]": [
            d.worst * 1e6 for d in defects
        ],
        r"relative to the largest \(\frac{\text{d}V}{\text{d}L}\) [%]": [d.relative * 100 for d in defects],
        "at pressure [kPa]": [d.pressure / 1e3 for d in defects],
        "at contraction [%]": [d.contraction * 100 for d in defects],
    }
    note = (
        "Points with a positive force within the validity range of the data. The integral of the defect over an area "
        "in the plane of pressure and length is an energy."
    )
    return Table("hosovsky_maxwell", "Maxwell defect of fitted muscles over their validity ranges", columns, note)


def _extrapolation_table(fill: filling.FillRun, low: releasing.Release, high: releasing.Release) -> Table:
    """Return the times and extents of extrapolation beyond the data of the surface, by run."""
    runs = {"fill and discharge": fill.adaptive, f"release from {low.pressure / 1e3:g} kPa": low.run}
    runs[f"release from {high.pressure / 1e3:g} kPa"] = high.run
    extrapolations = [
        (name, note) for name, run in runs.items() for note in run.notes if "outside the validity range" in note
    ]
    columns = {"run": [name for name, _ in extrapolations], "extrapolation": [note for _, note in extrapolations]}
    return Table("hosovsky_boxes", "Extrapolation beyond the data of the contractile surface", columns)


def _time_series(fill: filling.FillRun, low: releasing.Release, high: releasing.Release) -> tuple[Table, ...]:
    """Return the time series of Figs. 3 and 4; only written to files."""
    runs = {"hosovsky_fill": fill.adaptive, "hosovsky_release_low": low.run, "hosovsky_release_high": high.run}
    names = (("time", "s"), ("pressure", "Pa"), ("contraction", "1"), ("position", "m"), ("force", "N"))
    return tuple(
        Table(key, key.replace("_", " "), {f"{n} [{unit}]": run[n] for n, unit in names}, shown=False)
        for key, run in runs.items()
    )
