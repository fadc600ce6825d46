"""Figures docs/images/sizing.png and sizing-sheet.png: working points and sheet of a lift.

Run python release/figures/make_sizing_figure.py
"""

from __future__ import annotations

from pathlib import Path

import airmuscle as am
from airmuscle.core.plotting import rendered, save
from airmuscle.design import (
    LiftRequirement,
    SizingConditions,
    choose,
    size_muscles,
    sizing_sheet,
)
from airmuscle.design.sizing.tables import sizing_plot

PICTURE = Path(__file__).parents[2] / "docs" / "images" / "sizing.png"
SHEET = PICTURE.with_name("sizing-sheet.png")
SHEET_DENSITY = 90.0
"""Resolution of the sheet [dots per inch] (chosen)."""


def main() -> None:
    """Write the figure."""
    choice = choose(
        am.load("dmsp-20-300"),
        LiftRequirement(stroke="40 mm", mass="20 kg"),
        SizingConditions(supply="6 bar"),
    )
    save(sizing_plot(choice).draw(), PICTURE)
    print(f"wrote {PICTURE}")
    result = size_muscles(choice.requirement, choice.conditions)
    SHEET.write_bytes(rendered(sizing_sheet(result), ("png",), SHEET_DENSITY)["png"])
    print(f"wrote {SHEET}")


if __name__ == "__main__":
    main()
