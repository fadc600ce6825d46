"""Figure docs/images/joint.png: reachable region of a joint of the library. Run python
release/figures/make_joint_figure.py
"""

from __future__ import annotations

from pathlib import Path

import airmuscle as am
from airmuscle.core.plotting import save
from airmuscle.physics import joint_statics, plot_reachable_region

PICTURE = Path(__file__).parents[2] / "docs" / "images" / "joint.png"


def main() -> None:
    """Write the figure."""
    entry = am.load("joint-dmsp-20-regulators")
    save(plot_reachable_region(joint_statics(entry.plant), load=1.0), PICTURE)
    print(f"wrote {PICTURE}")


if __name__ == "__main__":
    main()
