"""Mathematical functions of numbers: the value of NumPy, outside of their domain NaN or infinity without a warning."""

import math

import numpy as np
import pytest

from airmuscle.core import ops

INFINITE = math.inf
OUTSIDE = {
    "sqrt": (-1.0, -INFINITE, math.nan),
    "log": (0.0, -1.0, INFINITE, math.nan),
    "exp": (1e4, -1e4, INFINITE, math.nan),
    "sinh": (1e4, -INFINITE, math.nan),
    "cosh": (1e4, INFINITE, math.nan),
    "sin": (INFINITE, math.nan),
    "cos": (-INFINITE, math.nan),
    "tan": (INFINITE, math.nan),
    "arctan": (INFINITE, math.nan),
    "arcsinh": (-INFINITE, math.nan),
    "tanh": (INFINITE, -INFINITE, math.nan),
    "floor": (-INFINITE, math.nan),
}


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("name", OUTSIDE)
def test_a_number_outside_of_the_domain_gives_no_warning(name: str):
    for x in OUTSIDE[name]:
        with np.errstate(all="ignore"):
            expected = getattr(np, name)(x)
        value = getattr(ops, name)(x)
        assert type(value) is float
        assert np.array_equal(value, expected, equal_nan=True), x


@pytest.mark.parametrize("name", OUTSIDE)
def test_a_number_within_the_domain_has_the_value_of_numpy(name: str):
    for x in (0.3, 1e-12, 7.0, 2):
        assert getattr(ops, name)(x) == getattr(np, name)(x)
