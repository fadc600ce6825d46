"""Figure docs/images/valves.png: flow laws and equivalent valves in series. Run python
release/figures/make_valves_figure.py
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from scipy.optimize import brentq

from airmuscle.core.plotting import DASHES, LINES, new_figure, save
from airmuscle.physics import CheckValve, Orifice, SubsonicIndexValve, Valve, in_series
from airmuscle.physics.pneumatics.gas import REFERENCE_DENSITY, REFERENCE_TEMPERATURE

PICTURE = Path(__file__).parents[2] / "docs" / "images" / "valves.png"
UPSTREAM = 700e3
RATIO = np.linspace(0.0, 1.2, 1201)


def flow(law: Orifice, upstream: Any, downstream: Any) -> Any:
    """Mass flow of the open valve [kg/s]."""
    return law.mass_flow(upstream, downstream, 1.0, REFERENCE_TEMPERATURE)


def exact_series_flow(first: Valve, second: Valve, downstream: float) -> float:
    """Mass flow through two valves in series [kg/s], with the pressure between them from a root
    finder.
    """
    middle = brentq(
        lambda p: flow(first, UPSTREAM, p) - flow(second, p, downstream), downstream, UPSTREAM
    )
    return float(flow(first, UPSTREAM, middle))


def draw_laws(axes: Any) -> None:
    """Plot the fraction of the choked flow over the pressure ratio; the flow is reversed above
    1.
    """
    laws: dict[str, Orifice] = {
        "b = 0": Valve(1e-8, 0.0),
        "b = 0.3": Valve(1e-8, 0.3),
        "b = 0.3, m = 0.7": SubsonicIndexValve(1e-8, 0.3, 0.7),
        "b = 0.3, cracking pressure 0.7 bar": SubsonicIndexValve(1e-8, 0.3, cracking_pressure=70e3),
        "the same with check valve": CheckValve(
            SubsonicIndexValve(1e-8, 0.3, cracking_pressure=70e3)
        ),
    }
    choked = 1e-8 * REFERENCE_DENSITY * UPSTREAM
    for i, (label, law) in enumerate(laws.items()):
        fraction = flow(law, UPSTREAM, RATIO * UPSTREAM) / choked
        axes.plot(RATIO, fraction, color=LINES[i], linestyle=DASHES[i], label=label)
    axes.set(
        xlabel="pressure ratio downstream/upstream",
        ylabel="fraction of the choked flow",
        title="flow laws, 7 bar",
    )
    axes.legend(loc="lower left")


def draw_series(axes: Any) -> None:
    """Plot the flow through two valves in both orders: equivalent valve (lines) and exact flow
    (markers).
    """
    wide = Valve(2e-8, 0.2)
    narrow = Valve(1e-8, 0.5)
    ratios = np.linspace(0.02, 0.995, 26)
    for i, (label, pair) in enumerate(
        {"narrow first": (narrow, wide), "wide first": (wide, narrow)}.items()
    ):
        equivalent = in_series(*pair)
        line = flow(equivalent, UPSTREAM, RATIO[RATIO <= 1] * UPSTREAM)
        axes.plot(
            RATIO[RATIO <= 1],
            line * 1e3,
            color=LINES[i],
            linestyle=DASHES[i],
            label=f"{label}, equivalent",
        )
        exact = [exact_series_flow(*pair, r * UPSTREAM) * 1e3 for r in ratios]
        axes.plot(ratios, exact, "o", color=LINES[i], markersize=3, label=f"{label}, exact")
    axes.set(xlabel="pressure ratio downstream/upstream", ylabel="mass flow [g/s]")
    axes.set_title("in series: C = 1 dm3/(s bar), b = 0.5 and C = 2, b = 0.2")
    axes.set_ylim(0.0, None)
    axes.legend(loc="lower left")


def main() -> None:
    """Save both plots in one file."""
    figure, (left, right) = new_figure(1, 2, width=9.0, height=3.4)
    draw_laws(left)
    draw_series(right)
    save(figure, PICTURE)


if __name__ == "__main__":
    main()
    print(f"wrote {PICTURE}")
