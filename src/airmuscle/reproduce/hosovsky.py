"""The third paper: dynamics after Hill's muscle model, with valves by ISO 6358 and the gas equation."""

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
from ..identify.censored_least_squares import measured_rank
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

SUMMARY = """The muscle of Hosovsky et al. has a contractile element given by a polynomial of total degree five in
contraction and pressure (21 coefficients, clamped to 0..1200 N), a parallel spring and a damper; two on/off valves
by ISO 6358 fill and discharge it. The paper prints neither the coefficients nor mass, spring, damper and geometry.
The surface is therefore fitted to the measured map of a DMSP-20-300, and second to Festo's tool table; valves,
supply, schedule, released mass and solver are as printed; every other number is listed below with its source, and
each verdict on the quick release says whether it survives the whole range of every chosen number."""


def surface_claims(found: Fit) -> tuple[Claim, ...]:
    """The form of the contractile surface, counted and measured."""
    law = surface()
    measured = measured_rank(found.problem, found.problem.slopes(found.values))
    force = law.force(np.linspace(0, 1e6, 51)[:, None], np.linspace(-0.05, 0.4, 46)[None, :])
    return (
        Claim(PAPER, "coefficients of a polynomial of total degree five", Equal(21, 0), len(exponents(5)), "1"),
        Claim(PAPER, "coefficients that the rows of the map that pull determine", Equal(21, 0), measured, "1",
              f"condition {found.condition:.3g}, scaled; rms {found.rmse:.3g} N. " + " ".join(found.notes)),
        Claim(PAPER, "force compensator: greatest force of the surface", Equal(1200.0, 0.0), float(force.max()), "N"),
        Claim(PAPER, "force compensator: least force of the surface", Equal(0.0, 0.0), float(force.min()), "N"),
    )  # fmt: skip


def surface_figure() -> Plot:
    """The surface's isobars through the measured points, as the paper's Fig. 2 shows its surface."""
    law, data = surface(), catalogue.load_data(FORCE_MAPS[0])
    figure, axes = new_figure()
    contraction = np.linspace(0.0, 0.26, 200)
    for i, pressure in enumerate((675e3, 525e3, 375e3, 250e3, 135e3)):
        here = np.isclose(data["pressure"], pressure)
        axes.plot(contraction * 100, law.force(pressure, contraction), color=LINES[i], label=f"{pressure / 1e3:g} kPa")
        axes.plot(data["contraction"][here] * 100, data["force"][here], "o", color=LINES[i])
    axes.axhline(1200.0, color="0.4", linewidth=0.8, linestyle=":")
    axes.set(xlabel="contraction [%]", ylabel="force [N]", xlim=(0, 27), ylim=(-30, 1700))
    legend_outside(axes, title="gauge pressure")
    caption = "Contractile surface (lines) fitted to a measured DMSP-20-300 (points), clamped to 0..1200 N (dotted)."
    return Plot("hosovsky_surface", caption, figure)


def coefficient_table() -> Table:
    """The fitted coefficients in plain units, p in bar: what the paper leaves out, for this muscle."""
    plain = {name: surface(name).plain_coefficients(1e5) for name in FORCE_MAPS}
    powers = exponents(5)
    columns: dict[str, list[float] | list[int]] = {
        "power of contraction": [i for i, _ in powers],
        "power of pressure": [j for _, j in powers],
    }
    for name in FORCE_MAPS:
        columns[f"{name} [N/bar^j]"] = [plain[name][power] for power in powers]
    note = "F = Sum a_ij eps^i p^j with eps as a ratio and p gauge in bar; inside the validity range of its data only"
    return Table("hosovsky_coefficients", "The 21 coefficients in plain units", columns, note)


def chapter(numbers: UnpublishedParameters | None = None, suspected: causing.SuspectedCauses | None = None) -> Chapter:
    """The chapter of the report; `numbers` and those of the suspected causes are what the paper does not print."""
    numbers, suspected = numbers or UnpublishedParameters(), suspected or causing.SuspectedCauses()
    fill = filling.run_fill(numbers)
    effects = causing.compute_effects(numbers, suspected)
    low, high = releasing.release_pair(numbers)
    ranges = releasing.range_table(numbers)
    return Chapter(
        PAPER,
        "Hosovsky et al.: muscle dynamics after Hill",
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
            maxwell_table(numbers),
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
        references=(*cite(fill.plant), MATRIX_CATALOGUE, *cite(catalogue.load(FORCE_MAPS[0]))),
        chosen=(*numbers.as_rows(), *suspected.as_rows()),
    )


def maxwell_table(numbers: UnpublishedParameters) -> Table:
    """How far muscle force and volume are from one potential, for the fitted surfaces and the measured muscles' law."""
    shape = muscle(numbers).geometry
    laws: dict[str, tuple[Characteristic, Geometry]]
    laws = {f"surface fitted to {name}, before the clamp": (surface_fit(name).model, shape) for name in FORCE_MAPS}
    for name in ("dmsp-20-300", "dmsp-10-250"):
        entry = catalogue.load(name)
        laws[f"Martens-Boblan 2017, {name}"] = (entry.characteristic, entry.muscle.geometry)
    validity_ranges = [
        surface(FORCE_MAPS[0]).validity_range,
        surface(FORCE_MAPS[1]).validity_range,
        *(catalogue.load(n).validity_range for n in ("dmsp-20-300", "dmsp-10-250")),
    ]
    found = [
        maxwell_defect(law, volume, validity_range)
        for (law, volume), validity_range in zip(laws.values(), validity_ranges, strict=True)
        if validity_range
    ]
    columns: dict[str, list[Any]] = {
        "muscle": list(laws),
        "greatest |dF/dp + dV/dL| [mm2]": [d.worst * 1e6 for d in found],
        "relative to the greatest dV/dL [%]": [d.relative * 100 for d in found],
        "at pressure [kPa]": [d.pressure / 1e3 for d in found],
        "at contraction [%]": [d.contraction * 100 for d in found],
    }
    note = "where the muscle pulls, over the validity range of its data; the defect times an area of pressure and length is energy"
    return Table("hosovsky_maxwell", "Maxwell defect of fitted muscles over their validity range", columns, note)


def _extrapolation_table(fill: filling.FillRun, low: releasing.Release, high: releasing.Release) -> Table:
    """When and how far the runs left the validity range in which the surface has data."""
    runs = {"fill and discharge": fill.adaptive, f"release from {low.pressure / 1e3:g} kPa": low.run}
    runs[f"release from {high.pressure / 1e3:g} kPa"] = high.run
    left = [(name, note) for name, run in runs.items() for note in run.notes if "outside the validity range" in note]
    columns = {"run": [name for name, _ in left], "what": [note for _, note in left]}
    return Table("hosovsky_boxes", "Where the runs left the data of the contractile surface", columns)


def _time_series(fill: filling.FillRun, low: releasing.Release, high: releasing.Release) -> tuple[Table, ...]:
    """The runs behind Figs. 3 and 4, for the data folder."""
    runs = {"hosovsky_fill": fill.adaptive, "hosovsky_release_low": low.run, "hosovsky_release_high": high.run}
    names = (("time", "s"), ("pressure", "Pa"), ("contraction", "1"), ("position", "m"), ("force", "N"))
    return tuple(
        Table(key, key.replace("_", " "), {f"{n} [{unit}]": run[n] for n, unit in names}, shown=False)
        for key, run in runs.items()
    )
