"""The figures of the chapter on Saga et al. 2007; those of the paper are lost, so these stand in their place."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..characteristic.saga2007 import RUBBER_TEST_STRAIN, Saga2007
from ..core.plotting import BLACK, DASHES, LINES, legend_outside, new_figure
from ..report.chapter import Plot
from .saga2007_claims import FIG_2
from .saga2007_muscle import DEFAULT, INTERPRETATIONS, circular_meridian, exact_meridian, pressure_along, interpretation, with_rings
from .saga2007_muscle import LINES as RUBBER
from .saga2007_pairs import errors, ideal_errors

CONTRACTION = np.concatenate([np.geomspace(2e-4, 0.01, 25), np.linspace(0.012, 0.4, 110)])
MPA = 1e-6


def plots() -> tuple[Plot, ...]:
    """All figures, in the order of the report."""
    drawn = (outlines, rubber, contraction_over_pressure, force_over_contraction, snap_through, interpretations, pairs)
    return tuple(draw() for draw in drawn)


def outlines() -> Plot:
    """As Fig. 2: the parabola at six contractions, the exact outline without rubber beside it."""
    figure, axes = new_figure(height=3.3)
    truth = exact_meridian(RUBBER["A"]).geometry
    for i, c in enumerate((0.0, *FIG_2)):
        for tube, dash in ((DEFAULT.geometry, "-"), (truth, ":")):
            x, r = tube.outline(c)
            label = f"{c:.0%}" if dash == "-" else None
            axes.plot(1e3 * x, 1e3 * r, dash, color=LINES[i % len(LINES)], label=label)
    axes.plot([], [], ":", color=BLACK, label="exact,\nno rubber")
    axes.set(xlabel="position along the axis [mm]", ylabel="radius [mm]", xlim=(-40, 40), ylim=(0, 30))
    legend_outside(axes, title="contraction")
    return Plot(
        "saga2007_outlines",
        "Outlines as in Fig. 2 of the paper, from (2) and (3) (full lines), and the exact outline of fibres "
        "that do not stretch, without rubber (dotted). The parabola's arc falls short of the fibre, by 4.7 % "
        "at 25 %.",
        figure,
    )


def rubber() -> Plot:
    """As Fig. 4: the two lines that the numbers of the rubber may mean."""
    figure, axes = new_figure(width=5.2, height=3.0)
    for i, (name, line) in enumerate(RUBBER.items()):
        for strain, dash in ((np.array([0.0, RUBBER_TEST_STRAIN]), "-"), (np.array([RUBBER_TEST_STRAIN, 4.0]), ":")):
            label = f"line {name}: {line.slope * MPA:g} ε + {line.intercept * MPA:g} MPa" if dash == "-" else None
            axes.plot(strain, line.stress(strain) * MPA, dash, color=LINES[i], label=label)
    axes.set(xlabel="hoop strain [1]", ylabel="hoop stress [MPa]", xlim=(0, 4), ylim=(0, 1.4))
    axes.legend(loc="upper left")
    return Plot(
        "saga2007_rubber",
        "The rubber of Fig. 4 in its two readings; dotted beyond the end of the test at strain 3, which the "
        "muscle passes at 21.1 % contraction.",
        figure,
    )


def _draw_contraction(axes: Any, law: Saga2007, force: float, i: int, label: str) -> None:
    """Contraction over pressure at one load: thin where pressure falls with contraction, which is not stable."""
    needed = pressure_along(law, CONTRACTION, force) * MPA
    rising = np.append(np.diff(needed) > 0, True)
    stable = np.where(rising, needed, np.nan)
    style = {"color": LINES[i % len(LINES)], "ls": DASHES[i % len(DASHES)]}
    axes.plot(needed, 100 * CONTRACTION, lw=0.5, **style)
    axes.plot(stable, 100 * CONTRACTION, label=label, **style)


def contraction_over_pressure() -> Plot:
    """As Fig. 8, at stated loads."""
    figure, (left, right) = new_figure(1, 2, width=7.2, height=3.4, sharey=True)
    for i, (force, load) in enumerate(((100.0, "100 N"), (0.0, "no load"))):
        for n, rings in enumerate(("no ring", "1 ring", "2 rings")):
            _draw_contraction(left, with_rings(DEFAULT, n), force, 3 * i + n, f"{rings}, {load}")
    for i, force in enumerate((0.0, 50.0, 100.0, 200.0)):
        _draw_contraction(right, DEFAULT, force, i, f"{force:g} N")
    ticks = (0.0, 0.05, 0.1, 0.15)
    left.set(xlabel="gauge pressure [MPa]", ylabel="contraction [%]", xlim=(0, 0.16), ylim=(0, 40), xticks=ticks)
    right.set(xlabel="gauge pressure [MPa]", xlim=(0, 0.16), xticks=ticks)
    left.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=2)
    right.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=2, title="no ring")
    return Plot(
        "saga2007_contraction",
        "Contraction over pressure as in Fig. 8 (w 2, q 1, line B); its load is not stated and its measured "
        "points are lost. Thin: pressure falls with contraction; there the muscle snaps, and equal segments "
        "between rings do not contract alike, so that this solution is not the one a muscle takes.",
        figure,
    )


def force_over_contraction() -> Plot:
    """The second test of the paper: the load varied at held pressure."""
    figure, axes = new_figure(height=3.4)
    contraction = np.linspace(0.005, 0.4, 160)
    truth = exact_meridian(DEFAULT.rubber)
    for i, pressure in enumerate((0.08e6, 0.11e6, 0.16e6)):
        label = f"{pressure * MPA:g} MPa"
        axes.plot(100 * contraction, DEFAULT.force(pressure, contraction), color=LINES[i], label=f"{label}, (19)")
        axes.plot(
            100 * contraction,
            truth.balance_under(pressure, contraction).force,
            "--",
            color=LINES[i],
            label=f"{label}, exact",
        )
        held = circular_meridian(DEFAULT.rubber).force(pressure, contraction)
        axes.plot(100 * contraction, held, ":", color=LINES[i], label=f"{label}, circle")
    axes.set(xlabel="contraction [%]", ylabel="tension [N]", xlim=(0, 40), ylim=(0, 400))
    legend_outside(axes)
    return Plot(
        "saga2007_force",
        "Tension over contraction at held pressure, line B: the printed balances (19) with w 2, q 1, the "
        "exact meridian, and the circle with virtual work. The factor 2 of (17) is what sets (19) apart.",
        figure,
    )


def snap_through() -> Plot:
    """Pressure over contraction with line A: a balloon's fall and rise."""
    figure, (left, right) = new_figure(1, 2, width=7.2, height=3.4)
    law = interpretation(RUBBER["A"], 2.0, 1.0)
    for i, force in enumerate((0.0, 30.0, law.snapping_load, 120.0)):
        _draw_pressure(left, law, force, i, f"{force:.3g} N")
    for i, (name, law) in enumerate((n, r) for n, r in INTERPRETATIONS.items() if n.endswith("A")):
        _draw_pressure(right, law, 0.0, i, name.removesuffix(", line A"))
    left.set(xlabel="contraction [%]", ylabel="gauge pressure [MPa]", xlim=(0, 50), ylim=(0, 0.12))
    right.set(xlabel="contraction [%]", xlim=(0, 50), ylim=(0, 0.12))
    left.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=2, title="w 2, q 1")
    right.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=2, title="no load")
    return Plot(
        "saga2007_snap",
        "Line A: below the load at which the fall begins (72.4 N as printed) pressure falls as contraction "
        "starts, to a minimum (dot), and rises again: a balloon's snap-through. Only rising branches are "
        "stable.",
        figure,
    )


def _draw_pressure(axes: Any, law: Saga2007, force: float, i: int, label: str) -> None:
    contraction = np.concatenate([np.geomspace(1e-5, 0.01, 40), np.linspace(0.011, 0.5, 200)])
    needed = law.balancing_pressure(contraction, force) * MPA
    axes.plot(100 * contraction, needed, ls=DASHES[i], color=LINES[i], label=label)
    lowest = int(np.argmin(needed))
    if lowest > 40:
        axes.plot(100 * contraction[lowest], needed[lowest], "o", color=LINES[i])


def interpretations() -> Plot:
    """The readings side by side against the exact meridian, at 100 N."""
    figure, panels = new_figure(1, 2, width=7.2, height=3.8, sharey=True)
    for axes, (name, line) in zip(panels, RUBBER.items(), strict=True):
        chosen = [(n, r) for n, r in INTERPRETATIONS.items() if n.endswith(name)]
        for i, (label, law) in enumerate(chosen):
            needed = pressure_along(law, CONTRACTION, 100.0) * MPA
            axes.plot(100 * CONTRACTION, needed, ls=DASHES[i], color=LINES[i], label=label.partition(", line")[0])
        truth = pressure_along(exact_meridian(line), CONTRACTION, 100.0) * MPA
        axes.plot(100 * CONTRACTION, truth, color=BLACK, lw=2.0, label="exact meridian")
        axes.set(xlabel="contraction [%]", title=f"line {name}, 100 N", xlim=(0, 40), ylim=(0, 0.3))
    panels[0].set_ylabel("gauge pressure [MPa]")
    handles, labels = panels[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=3)
    return Plot(
        "saga2007_readings",
        "Pressure that holds 100 N: the readings of (19) and the exact meridian of the same muscle.",
        figure,
    )


def pairs() -> Plot:
    """The error of 12 pairs of assumed outline and closure, without rubber and with it."""
    figure, panels = new_figure(1, 2, width=7.2, height=4.2, sharey=True)
    contraction = np.linspace(0.005, 0.4, 60)
    found = (ideal_errors(contraction), errors(RUBBER["A"], 100.0, contraction))
    closures = ("end balance", "middle balance", "virtual work")
    titles = ("tension per pressure, no rubber", "pressure, line A, 100 N")
    for axes, rows, title in zip(panels, found, titles, strict=True):
        for (outline, closure), error in rows.items():
            if outline.startswith("exact"):
                continue
            color = ("parabola (3)", "parabola, true arc", "catenary", "circle").index(outline)
            dash = (":", "--", "-")[closures.index(closure)]
            axes.plot(100 * contraction, 100 * error, ls=dash, color=LINES[color], label=f"{outline}, {closure}")
        axes.axhline(0, color=BLACK, lw=0.6)
        axes.set(xlabel="contraction [%]", title=title, xlim=(0, 40), ylim=(-60, 60))
    panels[0].set_ylabel("error against the exact meridian [%]")
    handles, labels = panels[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=2, fontsize=7)
    return Plot(
        "saga2007_pairs",
        "Every assumed outline with every closure. Virtual work forgives an outline that is nearly right; the "
        "end balance leans on its end slope. The circle with the middle balance is the previous model.",
        figure,
    )
