"""Figure docs/images/animation.png: still of an animation of a joint. Run python
release/figures/make_animation_figure.py
"""

from __future__ import annotations

from pathlib import Path

import airmuscle as am
from airmuscle.core.plotting import save

PICTURE = Path(__file__).parents[2] / "docs" / "images" / "animation.png"


def main() -> None:
    """Write the figure."""
    plant = am.load("joint-dmsp-20-matrix").plant
    valves = am.Schedule(
        {"left.fill": ((0.2, 1.0), (0.5, 0.0)), "right.discharge": ((0.2, 1.0), (0.5, 0.0))}
    )
    run = am.simulate(plant, valves, duration=1.0, initial_state=plant.state_at(pressure=2.5e5))
    save(run.animate(plant).still(0.8), PICTURE)
    print(f"wrote {PICTURE}")


if __name__ == "__main__":
    main()
