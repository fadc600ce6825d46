"""Figures docs/images/body.png and fit-out.png: routes of a leg, and muscles for them.

Run python release/figures/make_body_figure.py
"""

from __future__ import annotations

from pathlib import Path

from airmuscle.core.plotting import save
from airmuscle.design import SizingConditions, fit_out, read_body, study_body

ROOT = Path(__file__).resolve().parents[2]
BODY = ROOT / "examples" / "air_leg.xml"
IMAGES = ROOT / "docs" / "images"


def main() -> None:
    """Write the figures."""
    study = study_body(read_body(BODY))
    results = {"body": study, "fit-out": fit_out(study, SizingConditions(supply="6 bar"))}
    for name, result in results.items():
        plots = {plot.name: plot for plot in result.chapter().plots}
        save(plots["body"].draw(), IMAGES / f"{name}.png")
        print(f"wrote {IMAGES / name}.png")


if __name__ == "__main__":
    main()
