"""From equations to machine code: every operation means the same in floats, arrays, symbols and
print; what silently goes wrong in a trace is refused; kernels compile once per machine, and say
so."""

from __future__ import annotations

import math
import os
import subprocess
import sys

import numpy as np
import pytest
from formulas import FORMULAS, Formula
from hypothesis import given
from hypothesis import strategies as st

from airmuscle.core import (
    StateVariable,
    System,
    autodiff,
    evaluation,
    model,
    nodes,
    ops,
    parameter,
    slopes,
)
from airmuscle.engine.compile import compile_system
from airmuscle.errors import ParameterError, TraceError

numbers = st.floats(-3, 3, allow_subnormal=False)


@pytest.mark.parametrize("name", FORMULAS)
@given(x=numbers, y=numbers)
def test_an_operation_means_the_same_everywhere(name, x, y):
    formula = FORMULAS[name]
    with np.errstate(all="ignore"):
        expected = formula(x + 0.25, y)
        array = formula(np.array([x, x]) + 0.25, np.array([y, y]))
    assert isinstance(expected, float)
    np.testing.assert_allclose(array, expected, rtol=1e-13, atol=1e-13)
    printed = compile_system(Formula(name)).rates([x, y], [])
    np.testing.assert_allclose(printed, [expected, expected * expected - y], rtol=1e-12, atol=1e-12)


@pytest.mark.tool
@pytest.mark.parametrize("name", FORMULAS)
def test_jax_arrays_are_accepted(name):
    jax = pytest.importorskip("jax")
    jax.config.update("jax_enable_x64", True)
    x, y = jax.numpy.array([0.3, -1.2]), jax.numpy.array([0.9, 0.4])
    expected = FORMULAS[name](np.array(x), np.array(y))
    np.testing.assert_allclose(jax.jit(FORMULAS[name])(x, y), expected, rtol=1e-12)


def test_the_printed_jacobian_solves_the_shifted_system():
    """factor and solve are (d I - J)^-1, and stage is that of f + g, for a full two by two
    Jacobian.
    """
    ready = compile_system(Formula("angles"))
    x = np.array([0.4, -0.7])
    h = 1e-6
    jacobian = np.column_stack(
        [(ready.rates(x + h * e, []) - ready.rates(x - h * e, [])) / (2 * h) for e in np.eye(2)]
    )
    f = np.empty(2)
    values = np.empty(ready.sizes.jacobian)
    factors = np.empty(ready.sizes.factors)
    g = np.array([1.0, -2.0])
    k = np.empty(2)
    none = np.zeros(1)
    ready.call("jac", x, none, ready.precomputed, f, values)
    np.testing.assert_allclose(values.reshape(2, 2), jacobian, rtol=1e-7)
    ready.call("factor", values, 3.0, factors)
    ready.call("stage", x, none, ready.precomputed, factors, g, k)
    np.testing.assert_allclose((3.0 * np.eye(2) - jacobian) @ k, f + g, rtol=1e-6)


@model
class Silent(System):
    """What a law must not do: math.nan stands for math.sqrt or float() of a symbol, which make it
    silently.
    """

    inputs = ()

    @property
    def states(self):
        return (StateVariable("x", "1", 1.0),)

    def rates(self, state, inputs):
        return {"x": state["x"] * math.nan}

    def outputs(self, state, inputs):
        return {}


@model
class Forgetful(Silent):
    """A system that forgets a state."""

    def rates(self, state, inputs):
        return {}


def test_a_constant_that_is_not_finite_names_the_law():
    with pytest.raises(
        TraceError,
        match=(
            r"Silent: the traced expression contains a constant that is not finite. Use"
            r" airmuscle.core.ops"
        ),
    ):
        compile_system(Silent())
    with pytest.raises(TraceError, match=r"states are \['x'\], but rates are given for \[\]"):
        compile_system(Forgetful())


def test_slopes_are_exact_and_equal_in_every_world():
    x = 0.8
    h = 1e-6

    @model
    class Wave:
        height: float = parameter("1", "a", "height", default=2.0)

        def value(self, x):
            return self.height * ops.sin(x) ** 2

    exact = autodiff.derivative(Wave(), "value", x)
    assert exact == pytest.approx((Wave().value(x + h) - Wave().value(x - h)) / (2 * h), rel=1e-8)
    symbol = nodes.symbol("x")
    inside = evaluation.Recorded([[symbol]], [[autodiff.derivative(Wave(), "value", symbol * 2)]])
    assert inside.at_numbers([x / 2]) == [[pytest.approx(exact, rel=1e-14)]]
    values, by_parameter = autodiff.jacobian(Wave(), "value", np.array([0.1, x]))
    np.testing.assert_allclose(by_parameter[:, 0], values / 2.0)


def test_where_two_numbers_are_equal_one_is_the_larger_and_the_other_the_smaller():
    """Otherwise their slopes vanish together, and with them the Jacobian of a flow at equal
    pressures.
    """
    x, y = nodes.symbols("x", 2)
    larger = ops.maximum(x, y)
    smaller = ops.minimum(x, y)
    by_row = slopes.jacobian([larger + smaller, larger - smaller], [x, y])
    rows = evaluation.Recorded([[x, y]], by_row).at_numbers([2.0, 2.0])
    np.testing.assert_array_equal(rows, [[1.0, 1.0], [1.0, -1.0]])


@pytest.mark.parametrize(
    ("value", "message"),
    [
        (math.nan, "must be finite"),
        ((2.0,), "must be one number"),
        (True, "must be a number"),
        (1e9, "allowed range: "),
    ],
)
def test_a_parameter_is_checked_when_a_model_is_made(value, message):
    @model
    class Bounded:
        size: float = parameter("m", "s", "a size", bounds=(0.0, 10.0))

    with pytest.raises(ParameterError, match=message) as caught:
        Bounded(value)
    assert "Bounded.size (s, a size)" in str(caught.value)


@pytest.mark.slow
def test_kernels_compile_once_per_machine_and_say_so(tmp_path):
    """Three processes in a row leave the cache folder with the same number of files; only the first
    says a word.
    """
    code = (
        "import airmuscle as am; from airmuscle.units import bar\nplant ="
        " am.Plant(am.load('chou-hannaford').muscle, am.FillDischarge(am.Supply(6 * bar),"
        " am.Valve(1e-9, 0.4), am.Valve(1e-9, 0.4)), am.Isometric(0.05))\nam.simulate(plant,"
        " am.Schedule({'fill': ((0.0, 1.0),)}), duration=1.0)"
    )
    environment = {**os.environ, "AIRMUSCLE_CACHE_DIR": str(tmp_path)}
    files = []
    words = []
    for _ in range(3):
        done = subprocess.run(
            [sys.executable, "-c", code], env=environment, capture_output=True, text=True
        )
        assert done.returncode == 0, done.stderr
        files.append(sum(1 for path in tmp_path.rglob("*") if path.is_file()))
        words.append(done.stderr)
    assert files[0] > 0
    assert files == [files[0]] * 3
    assert "compiling rodas4, once on this machine" in words[0]
    assert words[1:] == ["", ""]
