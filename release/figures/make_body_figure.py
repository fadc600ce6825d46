"""Figure docs/images/body.png: routes of a leg. Run python release/figures/make_body_figure.py"""

from __future__ import annotations

from pathlib import Path

from airmuscle.core.plotting import save
from airmuscle.design import read_body, study_body

ROOT = Path(__file__).resolve().parents[2]
BODY = ROOT / "examples" / "air_leg.xml"
PICTURE = ROOT / "docs" / "images" / "body.png"


def main() -> None:
    """Write the figure."""
    study = study_body(read_body(BODY))
    plots = {plot.name: plot for plot in study.chapter().plots}
    save(plots["body"].draw(), PICTURE)
    print(f"wrote {PICTURE}")


if __name__ == "__main__":
    main()
