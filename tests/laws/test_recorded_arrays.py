"""Recorded laws at arrays of points: values and slopes are those of each point by itself.

Law: whether a condition holds at all points, at none or at some of them changes no value. Opponent:
the same law, point by point, as numbers.
"""

from __future__ import annotations

import numpy as np
import pytest
from plants import EXAMPLES

from airmuscle.core import autodiff

NAMES = (
    "chou-hannaford",
    "dmsp-20-300",
    "serres2009",
    "tondu-lopez",
    "sarosi",
    "surface",
    "circle",
)
INSIDE = np.linspace(0.02, 0.1, 5)
BEYOND = np.array([-0.04, -0.02, 0.5, 0.6])
"""Contractions beyond the range of most laws, which have other branches there."""
CASES = {
    "all inside": INSIDE,
    "all beyond": BEYOND,
    "some of each": np.concatenate([INSIDE[:2], BEYOND, INSIDE[2:]]),
}
ROUNDING = 1e-14
"""Relative to the largest value: functions of NumPy and of the C library differ in the last
digit."""


@pytest.mark.parametrize("case", CASES)
@pytest.mark.parametrize("name", NAMES)
def test_an_array_of_points_has_the_values_of_its_points(name, case):
    law = EXAMPLES[name].muscles[0].contractile
    contraction = CASES[case]
    pressure = np.linspace(5e4, 4e5, contraction.size)
    method = autodiff.RecordedMethod(law, "force", 2).value_and_slopes()
    parameters = [float(leaf.value) for leaf in autodiff.tree.leaves(law)]
    at_once = method.at_points([pressure, contraction], parameters)
    each = [
        method.at_numbers([p, k], parameters) for p, k in zip(pressure, contraction, strict=True)
    ]
    for number, vector in enumerate(at_once):
        expected = np.array([results[number] for results in each])
        values = np.stack([np.broadcast_to(x, contraction.shape) for x in vector], axis=1)
        size = np.abs(np.where(np.isfinite(expected), expected, 0.0)).max(axis=0)
        assert np.array_equal(np.isfinite(values), np.isfinite(expected))
        with np.errstate(invalid="ignore"):
            assert not (np.abs(values - expected) > ROUNDING * size).any()
