"""Mathematical functions of numbers: the value of NumPy, outside of their domain NaN or infinity
without a warning.

Traced and compiled they have the same values to rounding.
"""

import math

import numpy as np
import pytest

import airmuscle as am
from airmuscle.core import StateVariable, System, model, ops

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
    "arcsin": (1.5, -INFINITE, math.nan),
    "arccos": (-1.5, INFINITE, math.nan),
    "expm1": (1e4, -INFINITE, math.nan),
    "log1p": (-1.0, -2.0, INFINITE, math.nan),
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
    for x in (0.3, 1e-12, *(() if name in ("arcsin", "arccos") else (7.0, 2))):
        assert getattr(ops, name)(x) == getattr(np, name)(x)


def values_of_all(x, y):
    """Every function of one or two arguments."""
    unary = {name: getattr(ops, name)(x) for name in OUTSIDE}
    both, either = (ops.where(join(x > 0.2, y > 0.2), 1.0, 0.0) for join in (ops.both, ops.either))
    binary = {"maximum": ops.maximum(x, y), "minimum": ops.minimum(x, y), "hypot": ops.hypot(x, y)}
    return {
        **unary,
        **binary,
        "both": both,
        "either": either,
        "clip": ops.clip(x, -0.1, y),
        "abs": ops.absolute_value(-x),
    }


@model
class Functions(System):
    """Two states at rest, and every function of them as an output."""

    states = (StateVariable("x", "1", 1.0), StateVariable("y", "1", 1.0))
    inputs = ()

    def rates(self, state, inputs):
        return {"x": 0.0, "y": 0.0}

    def outputs(self, state, inputs):
        return values_of_all(state["x"], state["y"])


@pytest.mark.parametrize(("x", "y"), [(0.3, 0.1), (0.1, 0.4), (0.25, 0.3), (0.05, 0.01)])
def test_compiled_and_of_arrays_a_function_has_the_value_of_numbers(x: float, y: float):
    expected = values_of_all(x, y)
    compiled = am.simulate(
        Functions(), am.Schedule({}), duration=0.1, initial_state={"x": x, "y": y}
    )
    of_arrays = values_of_all(np.array([x, x]), np.array([y, y]))
    for name, value in expected.items():
        assert compiled[name][-1] == pytest.approx(value, rel=2e-15), name
        assert of_arrays[name][0] == pytest.approx(value, rel=2e-15), name


def test_a_smooth_sign_is_that_of_a_speed_far_from_zero():
    assert ops.hypot(3.0, 4.0) == 5.0
    assert [v / ops.hypot(v, 0.01) for v in (-1.0, 0.0, 1.0)] == pytest.approx(
        [-1.0, 0.0, 1.0], abs=1e-4
    )
