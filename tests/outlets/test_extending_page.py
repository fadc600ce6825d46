"""The page on extensions is true: every block runs, and its models are fitted, linearised and cited
like built-in ones.
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

import airmuscle as am

DOCS = Path(__file__).parents[2] / "docs"
BLOCKS = re.findall(
    r"```python\n(.*?)```", (DOCS / "guides/extending.md").read_text(encoding="utf-8"), re.DOTALL
)


@pytest.fixture(scope="module")
def page():
    """The names that the blocks define, run one after another."""
    found: dict[str, object] = {"__name__": "__main__"}
    for block in BLOCKS:
        exec(compile(block, "guides/extending.md", "exec", dont_inherit=True), found)
    return found


def test_every_interface_has_a_block(page):
    assert len(BLOCKS) == 6
    bases = ("ForceLaw", "Friction", "Orifice", "am.Mechanism", "ControlLaw", "am.System")
    assert [re.search(r"class \w+\((.*?)\)", block)[1] for block in BLOCKS] == list(bases)


def test_the_law_is_inverted_fitted_and_cited(page):
    law = page["law"]
    assert law.force(4e5, law.contraction(4e5, 100.0)) == pytest.approx(100.0)
    pressure, contraction = (
        side.ravel() for side in np.meshgrid([1e5, 2e5, 4e5], [0.0, 0.05, 0.1])
    )
    columns = {
        "pressure": pressure,
        "contraction": contraction,
        "force": law.force(pressure, contraction),
    }
    fitted = am.fit(page["LinearLaw"](1e-3, 0.2, 10.0), am.Recording(columns, "page")).model
    assert fitted.area == pytest.approx(law.area, rel=1e-6)
    assert "me-2026" in {r.key for r in am.cite(page["plant"])}


def test_the_muscle_turns_the_cam_and_the_controller_moves_it(page):
    assert page["run"]["angle"][-1] > page["run"]["angle"][0] + 0.05
    assert abs(page["controlled"]["angle"][-1] - 0.6) < abs(page["controlled"]["angle"][0] - 0.6)
    assert len(am.linearise(page["plant"], page["start"]).poles) == len(page["plant"].states)


def test_the_vessels_equalise_without_losing_air(page):
    run = page["equalised"]
    assert run["pressure_difference"][-1] < 1.0
    assert run["first_mass"] + run["second_mass"] == pytest.approx(7.2e-3)
