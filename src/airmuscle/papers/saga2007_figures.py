"""Figures of the chapter on Saga et al. 2007, which replace the lost figures of the paper."""

from typing import Any

import numpy as np

import airmuscle as am

from ..core import BLACK, DASHES, LINES, legend_outside, new_figure
from ..physics.muscle.characteristic.saga2007 import RUBBER_TEST_STRAIN
from ..report.chapter import Plot
from ..report.formatting import to_mathtext
from . import saga2007_muscle as values
from .run import captioned
from .saga2007_joint import feed_forward_figure
from .saga2007_muscle import (
    DEFAULT,
    INTERPRETATIONS,
    circular_meridian,
    exact_meridian,
    pressure_along,
)
from .saga2007_muscle import LINES as RUBBER
from .saga2007_pairs import errors, ideal_errors
from .saga2007_previous import previous_model_figure

CONTRACTION = np.concatenate([np.geomspace(2e-4, 0.01, 25), np.linspace(0.012, 0.4, 110)])
MPA = 1e-6


def plots() -> tuple[Plot, ...]:
    """Return all figures in the order of the report."""
    return (
        previous_model_figure(),
        outlines(),
        rubber(),
        contraction_over_pressure(),
        force_over_contraction(),
        snap_through(),
        interpretations(),
        pairs(),
        feed_forward_figure(),
    )


def outlines() -> Plot:
    """Return Fig. 2: the parabola at six contractions, and the exact outline without rubber."""
    figure, axes = new_figure(height=3.3)
    reference = exact_meridian(RUBBER["A"]).geometry
    for i, c in enumerate((0.0, *values.FIG_2)):
        for tube, dash in ((DEFAULT.geometry, "-"), (reference, ":")):
            x, r = tube.outline(c)
            label = f"{100 * c:g} %" if dash == "-" else None
            axes.plot(1e3 * x, 1e3 * r, dash, color=LINES[i % len(LINES)], label=label)
    axes.plot([], [], ":", color=BLACK, label="exact,\nwithout rubber")
    axes.set(
        xlabel="position along the axis [mm]", ylabel="radius [mm]", xlim=(-40, 40), ylim=(0, 30)
    )
    legend_outside(axes, title="contraction")
    return captioned("saga2007_outlines", figure)


def rubber() -> Plot:
    """Return Fig. 4: the two possible lines of the rubber."""
    figure, axes = new_figure(width=5.2, height=3.0)
    for i, (name, line) in enumerate(RUBBER.items()):
        for strain, dash in (
            (np.array([0.0, RUBBER_TEST_STRAIN]), "-"),
            (np.array([RUBBER_TEST_STRAIN, 4.0]), ":"),
        ):
            formula = rf"$({line.slope * MPA:g}\,\varepsilon + {line.intercept * MPA:g})$ MPa"
            label = f"line {name}: {formula}" if dash == "-" else None
            axes.plot(strain, line.stress(strain) * MPA, dash, color=LINES[i], label=label)
    axes.set(xlabel="hoop strain", ylabel="hoop stress [MPa]", xlim=(0, 4), ylim=(0, 1.4))
    axes.legend(loc="upper left")
    return captioned("saga2007_rubber", figure)


def _draw_contraction(
    axes: Any, law: am.characteristic.Saga2007, force: float, i: int, label: str
) -> None:
    """Draw contraction over pressure at one load: thin where the pressure falls with contraction
    (unstable).
    """
    required = pressure_along(law, CONTRACTION, force) * MPA
    rising = np.append(np.diff(required) > 0, True)
    stable = np.where(rising, required, np.nan)
    style = {"color": LINES[i % len(LINES)], "ls": DASHES[i % len(DASHES)]}
    axes.plot(required, 100 * CONTRACTION, lw=0.5, **style)
    axes.plot(stable, 100 * CONTRACTION, label=label, **style)


def contraction_over_pressure() -> Plot:
    """Return Fig. 8, at assumed loads."""
    figure, (left, right) = new_figure(1, 2, width=7.2, height=3.4, sharey=True)
    for i, (force, load) in enumerate(((100.0, "100 N"), (0.0, "no load"))):
        for n, rings in enumerate(("no rings", "1 ring", "2 rings")):
            _draw_contraction(
                left, values.with_rings(DEFAULT, n), force, 3 * i + n, f"{rings}, {load}"
            )
    for i, force in enumerate((0.0, 50.0, 100.0, 200.0)):
        _draw_contraction(right, DEFAULT, force, i, f"{force:g} N")
    ticks = (0.0, 0.05, 0.1, 0.15)
    left.set(
        xlabel="gauge pressure [MPa]",
        ylabel="contraction [%]",
        xlim=(0, 0.16),
        ylim=(0, 40),
        xticks=ticks,
    )
    right.set(xlabel="gauge pressure [MPa]", xlim=(0, 0.16), xticks=ticks)
    left.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=2)
    right.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=2, title="no rings")
    return captioned("saga2007_contraction", figure)


def force_over_contraction() -> Plot:
    """Return the second test of the paper: variable load at constant pressure."""
    figure, axes = new_figure(height=3.4)
    contraction = np.linspace(0.005, 0.4, 160)
    reference = exact_meridian(DEFAULT.rubber)
    for i, pressure in enumerate((0.08e6, 0.11e6, 0.16e6)):
        label = f"{pressure * MPA:g} MPa"
        for model, dash, force in (
            ("(19)", "-", DEFAULT.force(pressure, contraction)),
            ("exact", "--", reference.shape_at_pressure(pressure, contraction).force),
            ("circle", ":", circular_meridian(DEFAULT.rubber).force(pressure, contraction)),
        ):
            axes.plot(100 * contraction, force, dash, color=LINES[i], label=f"{label}, {model}")
    axes.set(xlabel="contraction [%]", ylabel="tension [N]", xlim=(0, 40), ylim=(0, 400))
    legend_outside(axes)
    return captioned("saga2007_force", figure)


def snap_through() -> Plot:
    """Return pressure over contraction with line A: snap-through."""
    figure, (left, right) = new_figure(1, 2, width=7.2, height=3.4)
    law = values.interpretation(RUBBER["A"], 2.0, 1.0)
    for i, force in enumerate((0.0, 30.0, law.snap_through_load, 120.0)):
        _draw_pressure(left, law, force, i, f"{force:.3g} N")
    for i, (name, law) in enumerate((n, r) for n, r in INTERPRETATIONS.items() if n.endswith("A")):
        _draw_pressure(right, law, 0.0, i, to_mathtext(name.removesuffix(", line A")))
    left.set(xlabel="contraction [%]", ylabel="gauge pressure [MPa]", xlim=(0, 50), ylim=(0, 0.12))
    right.set(xlabel="contraction [%]", xlim=(0, 50), ylim=(0, 0.12))
    left.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=2, title="$w = 2$, $q = 1$")
    right.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=2, title="no load")
    return captioned("saga2007_snap", figure)


def _draw_pressure(
    axes: Any, law: am.characteristic.Saga2007, force: float, i: int, label: str
) -> None:
    contraction = np.concatenate([np.geomspace(1e-5, 0.01, 40), np.linspace(0.011, 0.5, 200)])
    required = law.equilibrium_pressure(contraction, force) * MPA
    axes.plot(100 * contraction, required, ls=DASHES[i], color=LINES[i], label=label)
    lowest = int(np.argmin(required))
    if lowest > 40:
        axes.plot(100 * contraction[lowest], required[lowest], "o", color=LINES[i])


def interpretations() -> Plot:
    """Return the pressures of all interpretations and of the exact meridian at 100 N."""
    figure, panels = new_figure(1, 2, width=7.2, height=3.8, sharey=True)
    for axes, (name, line) in zip(panels, RUBBER.items(), strict=True):
        laws = [(n, r) for n, r in INTERPRETATIONS.items() if n.endswith(name)]
        for i, (full_name, law) in enumerate(laws):
            label = to_mathtext(full_name.partition(", line")[0])
            required = pressure_along(law, CONTRACTION, 100.0) * MPA
            axes.plot(100 * CONTRACTION, required, ls=DASHES[i], color=LINES[i], label=label)
        reference = pressure_along(exact_meridian(line), CONTRACTION, 100.0) * MPA
        axes.plot(100 * CONTRACTION, reference, color=BLACK, lw=2.0, label="exact meridian")
        axes.set(xlabel="contraction [%]", title=f"line {name}, 100 N", xlim=(0, 40), ylim=(0, 0.3))
    panels[0].set_ylabel("gauge pressure [MPa]")
    figure.legend(*panels[0].get_legend_handles_labels(), loc="outside lower center", ncols=3)
    return captioned("saga2007_readings", figure)


def pairs() -> Plot:
    """Return the errors of 12 pairs of assumed outline and closure, without and with rubber."""
    figure, panels = new_figure(1, 2, width=7.2, height=4.2, sharey=True)
    contraction = np.linspace(0.005, 0.4, 60)
    panel_errors = (ideal_errors(contraction), errors(RUBBER["A"], 100.0, contraction))
    closures = ("end balance", "middle balance", "virtual work")
    titles = ("tension per pressure, without rubber", "pressure, line A, 100 N")
    for axes, rows, title in zip(panels, panel_errors, titles, strict=True):
        for (outline, closure), error in rows.items():
            if outline.startswith("exact"):
                continue
            color = ("parabola (3)", "parabola, true arc", "catenary", "circle").index(outline)
            dash = (":", "--", "-")[closures.index(closure)]
            axes.plot(
                100 * contraction,
                100 * error,
                ls=dash,
                color=LINES[color],
                label=f"{outline}, {closure}",
            )
        axes.axhline(0, color=BLACK, lw=0.6)
        axes.set(xlabel="contraction [%]", title=title, xlim=(0, 40), ylim=(-60, 60))
    panels[0].set_ylabel("error relative to the exact meridian [%]")
    figure.legend(
        *panels[0].get_legend_handles_labels(), loc="outside lower center", ncols=2, fontsize=7
    )
    return captioned("saga2007_pairs", figure)
