"""Operations of laws have the names and the values of NumPy: with numbers, arrays, recorded nodes,
derivatives and printed code.
"""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import printed
import pytest
from operation_points import OWN, POINTS, Operations, of_numpy, states_and_values

import airmuscle
from airmuscle.core import model, ops

CONDITIONS = {"both": "logical_and", "either": "logical_or"}
OTHERS = {"clip", "pi", "polynomial", "where", "logical_and", "logical_or", "logical_not"}
every = pytest.mark.parametrize("name", POINTS)


def test_each_operation_is_compared():
    assert set(dir(ops)) == {*POINTS, *CONDITIONS, *OTHERS}
    assert set(dir(ops)) - set(OWN) - {"polynomial"} <= set(dir(np))


@every
def test_numbers_and_arrays_have_the_value_of_numpy(name: str):
    for point in POINTS[name]:
        value = getattr(ops, name)(*point)
        assert type(value) is float
        assert value == pytest.approx(of_numpy(name)(*point), rel=1e-15)
    columns = np.array(POINTS[name]).T
    assert np.allclose(getattr(ops, name)(*columns), of_numpy(name)(*columns), rtol=1e-15)


@model
class Law:
    """An operation as the method of a model."""

    operation: str

    def value(self, *arguments):
        return getattr(ops, self.operation)(*arguments)


def slopes_of_numbers(name: str, point: tuple[float, ...]) -> list[float]:
    """Central differences of NumPy's values."""
    slopes = []
    for i in range(len(point)):
        step = 1e-6 * max(1.0, abs(point[i]))
        ends = [[x + sign * step * (k == i) for k, x in enumerate(point)] for sign in (1, -1)]
        above, below = (float(of_numpy(name)(*end)) for end in ends)
        slopes.append((above - below) / (2.0 * step))
    return slopes


@every
def test_recorded_its_values_and_slopes_are_those_of_numpy(name: str):
    law = Law(name)
    for point in POINTS[name]:
        values, _ = airmuscle.core.autodiff.jacobian(law, "value", *point)
        assert values[0] == pytest.approx(float(of_numpy(name)(*point)), rel=1e-14)
        slopes = [
            airmuscle.core.autodiff.derivative(law, "value", *point, wrt=i)
            for i in range(len(point))
        ]
        assert slopes == pytest.approx(slopes_of_numbers(name, point), rel=1e-7, abs=1e-8)


@pytest.mark.parametrize("name", [*CONDITIONS, *CONDITIONS.values()])
@pytest.mark.parametrize("x", [-1.0, 1.0])
@pytest.mark.parametrize("y", [-1.0, 1.0])
def test_conditions_are_joined_as_those_of_numpy(name: str, x: float, y: float):
    join = getattr(ops, name)
    expected = bool(getattr(np, CONDITIONS.get(name, name))(x > 0, y > 0))
    assert join(x > 0, y > 0) is expected
    assert join(np.array([x]) > 0, np.array([y]) > 0).tolist() == [expected]
    assert traced_condition(name, x, y) == expected


@pytest.mark.parametrize("x", [-1.0, 1.0])
def test_a_condition_is_negated_as_by_numpy(x: float):
    assert ops.logical_not(x > 0) is (not x > 0)
    assert ops.logical_not(np.array([x]) > 0).tolist() == [not x > 0]
    assert traced_condition("logical_not", x, 0.0) == (not x > 0)


@model
class Condition:
    """A condition of two values as the method of a model, 1 or 0."""

    operation: str

    def value(self, x, y):
        operands = (x > 0,) if self.operation == "logical_not" else (x > 0, y > 0)
        return ops.where(getattr(ops, self.operation)(*operands), 1.0, 0.0)


def traced_condition(name: str, x: float, y: float) -> bool:
    """A condition recorded with symbols, at numbers."""
    values, _ = airmuscle.core.autodiff.jacobian(Condition(name), "value", x, y)
    return bool(values[0])


def test_compiled_its_values_are_those_of_numpy():
    states, expected = states_and_values()
    compiled = printed.library_values(Operations(), states, np.zeros((len(states), 0)))
    assert np.allclose(compiled[:, : states.shape[1]], expected, rtol=1e-14, atol=0.0)


def test_an_unknown_operation_names_the_one_that_is_meant():
    meant = {"atan2": "arctan2", "max": "maximum", "squar": "square", "ln": "log"}
    for name, operation in meant.items():
        with pytest.raises(AttributeError, match=rf"no operation '{name}'.*'{operation}'\?"):
            getattr(ops, name)
    assert not hasattr(ops, "_missing")


def test_outside_of_its_domain_an_operation_gives_no_warning():
    with np.errstate(all="raise"):
        values = [ops.power(-8.0, 1 / 3), ops.arccosh(0.5), ops.arctanh(2.0), ops.log10(-1.0)]
    assert all(map(math.isnan, values))
    assert ops.arctan2(0.0, 0.0) == 0.0
    assert airmuscle.core.autodiff.derivative(Law("arctan2"), "value", 0.0, -2.0, wrt=0) == -0.5


def test_no_model_jumps_with_the_sign_of_a_speed():
    """A friction that jumps at rest has no slope there, and an integrator chatters."""
    models = sorted((Path(airmuscle.__file__).parent / "physics").rglob("*.py"))
    jumping = {path.name for path in models if "ops.sign(" in path.read_text(encoding="utf-8")}
    assert jumping == set()
