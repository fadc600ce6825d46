"""Figure docs/images/sizing.png: working points of a lift.

Run python release/figures/make_sizing_figure.py
"""

from __future__ import annotations

from pathlib import Path

import airmuscle as am
from airmuscle.core.plotting import save
from airmuscle.design import LiftRequirement, SizingConditions, choose
from airmuscle.design.sizing.tables import sizing_plot

PICTURE = Path(__file__).parents[2] / "docs" / "images" / "sizing.png"


def main() -> None:
    """Write the figure."""
    choice = choose(
        am.load("dmsp-20-300"),
        LiftRequirement(stroke="40 mm", mass="20 kg"),
        SizingConditions(supply="6 bar"),
    )
    save(sizing_plot(choice).draw(), PICTURE)
    print(f"wrote {PICTURE}")


if __name__ == "__main__":
    main()
