"""Report chapter: Hošovský et al., muscle dynamics by Hill's model with valves by ISO 6358; Figures
1 and 2.
"""

from collections.abc import Iterator
from typing import Any

import numpy as np

from ..core import BLACK, BLUE, LINES, RED, cite, legend_outside, new_figure
from ..files.library import load_data, load_law
from ..physics.muscle.characteristic import exponents, maxwell_defect
from ..report.chapter import Chapter, Plot, Table
from ..report.claims import claims_of
from . import hosovsky_effects as causing
from . import hosovsky_fill as filling
from . import hosovsky_plant as rig
from . import hosovsky_quick_release as releasing
from .hosovsky_plant import FORCE_MAPS, surface, surface_fit
from .run import captioned, chapter_texts, titled

MAX_CONTRACTION = 0.26
"""Largest contraction of the figures of the surface [1] (chosen: the free contraction at the
largest pressure).
"""


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
    return titled("hosovsky_coefficients", columns)


def chapter() -> Chapter:
    """Return the chapter of the report, with the chosen values of what the paper does not print."""
    parameters = rig.UnpublishedParameters()
    suspected = causing.SuspectedCauses()
    fill = filling.run_fill(parameters)
    effects = causing.compute_effects(parameters, suspected)
    low, high = releasing.release_pair(parameters)
    ranges = releasing.range_table(parameters)
    joint = releasing.joint_variation(parameters)
    ratios = causing.ratio_ranges(parameters, suspected)
    explanation = f"{causing.describe_effects(effects)} {causing.describe_ranges(ratios)}"
    valve = filling.valve_figure(rig.MATRIX, fill.plant.ambient.temperature)
    shown = (hill_model(), surface_in_space(), isobars(), valve, filling.figure_3(fill))
    return Chapter(
        rig.PAPER,
        claims=(
            *claims_of(filling.SURFACE, surface_fit()),
            *filling.fill_claims(fill, explanation),
            *claims_of(filling.MEASUREMENT),
            *releasing.claims(low, high, ranges),
            *releasing.joint_claims(joint),
            *filling.gas_findings(effects),
        ),
        tables=(
            causing.effect_table(effects),
            causing.range_table(ratios),
            ranges,
            releasing.joint_table(joint),
            coefficient_table(),
            maxwell_table(parameters),
            *run_tables(fill, low, high),
        ),
        plots=(*shown, causing.effect_plot(effects), releasing.figure_4(low, high)),
        references=(*cite(fill.plant), rig.MATRIX_CATALOGUE, *cite(load_law(FORCE_MAPS[0]))),
        chosen=(*rig.chosen_rows(parameters), *rig.chosen_rows(suspected)),
        **chapter_texts(rig.PAPER),
    )


def maxwell_table(parameters: rig.UnpublishedParameters) -> Table:
    """Return the Maxwell defects of the fitted surfaces and of the law of the measured muscles."""
    shape = rig.muscle(parameters).geometry
    fitted = [
        (
            f"surface fitted to {name}, without the limits",
            surface_fit(name).model,
            shape,
            surface(name).validity_range,
        )
        for name in FORCE_MAPS
    ]
    entries = {name: load_law(name) for name in ("dmsp-20-300", "dmsp-10-250")}
    measured = [
        (
            f"Martens-Boblan 2017, {name}",
            entry.characteristic,
            entry.muscle.geometry,
            entry.validity_range,
        )
        for name, entry in entries.items()
    ]
    laws = [*fitted, *measured]
    defects = [maxwell_defect(law, volume, limits) for _, law, volume, limits in laws if limits]
    columns: dict[str, list[Any]] = {
        "muscle": [name for name, *_ in laws],
        r"largest \(\left|\frac{\partial F}{\partial p} + \frac{\text{d}V}{\text{d}L}\right|\) [mm2]": [  # noqa: E501
            d.worst * 1e6 for d in defects
        ],
        r"relative to the largest \(\frac{\text{d}V}{\text{d}L}\) [%]": [
            d.relative * 100 for d in defects
        ],
        "at pressure [kPa]": [d.pressure / 1e3 for d in defects],
        "at contraction [%]": [d.contraction * 100 for d in defects],
    }
    return titled("hosovsky_maxwell", columns)


def run_tables(
    fill: filling.FillRun, low: releasing.Release, high: releasing.Release
) -> Iterator[Table]:
    """Yield the extrapolations beyond the data of the surface, by run, and the time series, which
    only files have.
    """
    runs = {"fill and discharge": ("hosovsky_fill", fill.adaptive)}
    for key, each in (("hosovsky_release_low", low), ("hosovsky_release_high", high)):
        runs[f"release from {each.pressure / 1e3:g} kPa"] = key, each.run
    notes = [(name, note) for name, (_, run) in runs.items() for note in run.notes]
    found = [(name, note) for name, note in notes if "outside the validity range" in note]
    yield titled(
        "hosovsky_boxes",
        {"run": [name for name, _ in found], "extrapolation": [note for _, note in found]},
    )
    names = (
        ("time", "s"),
        ("pressure", "Pa"),
        ("contraction", "1"),
        ("position", "m"),
        ("force", "N"),
    )
    for key, run in runs.values():
        yield Table(
            key, key.replace("_", " "), {f"{n} [{unit}]": run[n] for n, unit in names}, shown=False
        )


def hill_model() -> Plot:
    """Return Fig. 1: contractile element, damper and parallel spring side by side, nonlinear spring
    in series.
    """
    from matplotlib.patches import Rectangle

    figure, axes = new_figure(height=2.6)
    axes.set(xlim=(-0.3, 10.6), ylim=(-0.4, 4.6), aspect="equal")
    axes.axis("off")
    axes.grid(visible=False)
    line = {"color": BLACK, "linewidth": 1.4}
    axes.plot([0, 0], [0.1, 4.1], color=BLACK, linewidth=3)
    for height in (0.7, 2.1, 3.5):
        axes.plot([0, 1.4], [height] * 2, **line)
        axes.plot([4.6, 6.0], [height] * 2, **line)
    axes.plot([6.0, 6.0], [0.7, 3.5], **line)
    axes.add_patch(Rectangle((1.4, 3.1), 3.2, 0.8, facecolor=BLUE, edgecolor=BLACK, alpha=0.25))
    _spring(axes, 1.4, 4.6, 2.1, BLACK)
    _damper(axes, 1.4, 4.6, 0.7)
    axes.plot([6.0, 6.6], [2.1] * 2, **line)
    _spring(axes, 6.6, 9.0, 2.1, RED)
    axes.annotate("", (7.1, 2.85), (8.5, 1.35), arrowprops={"arrowstyle": "<-", "color": RED})
    axes.annotate("", (10.4, 2.1), (9.0, 2.1), arrowprops={"arrowstyle": "->", "color": BLACK})
    axes.text(3.0, 3.5, "contractile $F_\\mathrm{KE}(k, P)$", ha="center", va="center", fontsize=8)
    axes.text(3.0, 2.5, "parallel spring $F_\\mathrm{PP}$", ha="center", fontsize=8)
    axes.text(3.0, 1.2, "damper $F_\\mathrm{TL}$", ha="center", fontsize=8)
    axes.text(7.8, 0.75, "series spring,\nnonlinear", ha="center", fontsize=8, color=RED)
    axes.text(9.9, 2.35, "$F_\\mathrm{E}$", ha="center", fontsize=8)
    return captioned("hosovsky_fig1", figure)


def _spring(axes: Any, begin: float, end: float, height: float, colour: str) -> None:
    """Draw a spring as a zigzag line."""
    margin = 0.15 * (end - begin)
    x = np.concatenate([[begin], np.linspace(begin + margin, end - margin, 10), [end]])
    y = height + 0.28 * np.array([0, 0, 1, -1, 1, -1, 1, -1, 1, -1, 0, 0])
    axes.plot(x, y, color=colour, linewidth=1.4)


def _damper(axes: Any, begin: float, end: float, height: float) -> None:
    """Draw a damper: a cylinder that is open to the right, and a piston."""
    middle = 0.5 * (begin + end)
    half = 0.35
    line = {"color": BLACK, "linewidth": 1.4}
    axes.plot([begin, middle - 0.5], [height] * 2, **line)
    axes.plot(
        middle + np.array([0.6, -0.5, -0.5, 0.6]), height + half * np.array([1, 1, -1, -1]), **line
    )
    axes.plot([middle + 0.1] * 2, [height - 0.8 * half, height + 0.8 * half], **line)
    axes.plot([middle + 0.1, end], [height] * 2, **line)


def surface_in_space() -> Plot:
    """Return Fig. 2: force over contraction and pressure, with the measured points."""
    law = surface()
    data = load_data(FORCE_MAPS[0])
    figure, axes = new_figure(height=4.4, subplot_kw={"projection": "3d", "computed_zorder": False})
    contraction, pressure = np.meshgrid(
        np.linspace(0.0, MAX_CONTRACTION, 40), np.linspace(0.0, 675e3, 40)
    )
    force = np.asarray(law.force(pressure, contraction))
    style: dict[str, Any] = {
        "cmap": "cividis",
        "alpha": 0.85,
        "linewidth": 0.15,
        "edgecolor": BLACK,
    }
    axes.plot_surface(
        100 * contraction, pressure / 1e3, force, rstride=1, cstride=1, zorder=1, **style
    )
    points = data.rows((data["force"] > 0) & (data["force"] <= 1200) & (data["contraction"] >= 0))
    x = 100 * points["contraction"]
    y = points["pressure"] / 1e3
    axes.plot(x, y, points["force"], ".", color=RED, markersize=3, zorder=2)
    axes.set(xlabel="contraction [%]", ylabel="gauge pressure [kPa]", zlabel="force [N]")
    axes.set_box_aspect((1.3, 1.2, 0.9), zoom=0.95)
    axes.view_init(elev=24, azim=38)
    return captioned("hosovsky_fig2", figure)


def isobars() -> Plot:
    """Return the isobars of the surface and the measured points."""
    law = surface()
    data = load_data(FORCE_MAPS[0])
    figure, axes = new_figure()
    contraction = np.linspace(0.0, MAX_CONTRACTION, 200)
    for i, pressure in enumerate((675e3, 525e3, 375e3, 250e3, 135e3)):
        rows = np.isclose(data["pressure"], pressure)
        axes.plot(
            contraction * 100,
            law.force(pressure, contraction),
            color=LINES[i],
            label=f"{pressure / 1e3:g} kPa",
        )
        axes.plot(data["contraction"][rows] * 100, data["force"][rows], "o", color=LINES[i])
    axes.axhline(1200.0, color="0.4", linewidth=0.8, linestyle=":")
    axes.set(xlabel="contraction [%]", ylabel="force [N]", xlim=(0, 27), ylim=(-30, 1700))
    legend_outside(axes, title="gauge pressure")
    return captioned("hosovsky_surface", figure)
