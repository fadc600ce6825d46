"""Report chapter: Hošovský et al., muscle dynamics by Hill's model with valves by ISO 6358."""

from __future__ import annotations

from typing import Any

import airmuscle as am

from ..core.reference import cite
from ..files.library import load_law
from ..physics.muscle.characteristic.contractile_surface import exponents
from ..physics.muscle.characteristic.energy_defect import maxwell_defect
from ..report.chapter import Chapter, Plot, Table
from . import hosovsky_effect_ranges as causing_over_ranges
from . import hosovsky_effects as causing
from . import hosovsky_fill as filling
from . import hosovsky_joint as joining
from . import hosovsky_release as releasing
from .hosovsky_claims import fill_claims, gas_findings, measurement_claims, surface_claims
from .hosovsky_figures import hill_model, isobars, surface_in_space
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
from .run import chapter_texts


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
    ranges, joint = releasing.range_table(parameters), joining.joint_variation(parameters)
    ratios = causing_over_ranges.ratio_ranges(parameters, suspected)
    explanation = f"{causing.describe_effects(effects)} {causing_over_ranges.describe_ranges(ratios)}"
    return Chapter(
        PAPER,
        claims=(
            *surface_claims(surface_fit()),
            *fill_claims(fill, explanation),
            *measurement_claims(),
            *releasing.claims(low, high, ranges),
            *joining.claims(joint),
            *gas_findings(effects),
        ),
        tables=(
            causing.effect_table(effects),
            causing_over_ranges.range_table(ratios),
            ranges,
            joining.joint_table(joint),
            coefficient_table(),
            maxwell_table(parameters),
            _extrapolation_table(fill, low, high),
            *_time_series(fill, low, high),
        ),
        plots=_plots(fill, effects, low, high),
        references=(*cite(fill.plant), MATRIX_CATALOGUE, *cite(load_law(FORCE_MAPS[0]))),
        chosen=(*parameters.as_rows(), *suspected.as_rows()),
        **chapter_texts(PAPER),
    )


def _plots(
    fill: filling.FillRun, effects: tuple[causing.Effect, ...], low: releasing.Release, high: releasing.Release
) -> tuple[Plot, ...]:
    """Return all figures in the order of the report."""
    return (
        hill_model(),
        surface_in_space(),
        isobars(),
        filling.valve_figure(MATRIX, fill.plant.ambient.temperature),
        filling.figure_3(fill),
        causing.effect_plot(effects),
        releasing.figure_4(low, high),
    )


def maxwell_table(parameters: UnpublishedParameters) -> Table:
    """Return the Maxwell defects of the fitted surfaces and of the law of the measured muscles."""
    shape = muscle(parameters).geometry
    laws: dict[str, tuple[am.characteristic.Characteristic, am.geometry.Geometry]]
    laws = {f"surface fitted to {name}, without the limits": (surface_fit(name).model, shape) for name in FORCE_MAPS}
    for name in ("dmsp-20-300", "dmsp-10-250"):
        entry = load_law(name)
        laws[f"Martens-Boblan 2017, {name}"] = (entry.characteristic, entry.muscle.geometry)
    validity_ranges = [
        surface(FORCE_MAPS[0]).validity_range,
        surface(FORCE_MAPS[1]).validity_range,
        *(load_law(n).validity_range for n in ("dmsp-20-300", "dmsp-10-250")),
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
