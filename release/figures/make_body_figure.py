"""Figures docs/images/body.png, fit-out.png and route.png: routes of a leg, muscles for them, and
torques of a route with moved points.

Run python release/figures/make_body_figure.py
"""

from __future__ import annotations

from pathlib import Path

from airmuscle.core.plotting import save
from airmuscle.design import (
    SizingConditions,
    fit_out,
    move_routes,
    read_body,
    read_curves,
    read_moves,
    study_body,
)
from airmuscle.files import load_law

ROOT = Path(__file__).resolve().parents[2]
BODY = ROOT / "examples" / "air_leg.xml"
IMAGES = ROOT / "docs" / "images"


def main() -> None:
    """Write the figures."""
    body = read_body(BODY)
    study = study_body(body)
    supply = SizingConditions(supply="6 bar")
    curves = read_curves(body, BODY.with_name("air_leg_curves.csv"))
    moves = read_moves(BODY.with_name("air_leg_moves.toml"))
    moved = move_routes(body, curves, moves, supply, [load_law("dmsp-20-300")])
    figures = {
        "body": (study, "body"),
        "fit-out": (fit_out(study, supply), "body"),
        "route": (moved, "torque_knee_extensor"),
    }
    for name, (result, figure) in figures.items():
        plots = {plot.name: plot for plot in result.chapter().plots}
        save(plots[figure].draw(), IMAGES / f"{name}.png")
        print(f"wrote {IMAGES / name}.png")


if __name__ == "__main__":
    main()
