"""Figure docs/images/cam.png: a cam with its cable in three positions.

Run python release/figures/make_cam_figure.py
"""

from __future__ import annotations

import math
from pathlib import Path

from airmuscle.core.plotting import save
from airmuscle.design import design_cam, linear_curve
from airmuscle.files import load_law

IMAGES = Path(__file__).resolve().parents[2] / "docs" / "images"


def main() -> None:
    """Write the figure."""
    curve = linear_curve(0.0, math.radians(90.0), 10.0, 4.0)
    cam = design_cam(curve, load_law("dmsp-20-300"), 4e5, distance=0.3)
    plots = {plot.name: plot for plot in cam.chapter().plots}
    save(plots["cam"].draw(), IMAGES / "cam.png")
    print(f"wrote {IMAGES / 'cam'}.png")


if __name__ == "__main__":
    main()
