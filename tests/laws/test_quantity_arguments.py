"""Laws, geometries and muscles are called with numbers, arrays, lists and texts with a unit;
anything else is an error.
"""

from __future__ import annotations

import inspect

import numpy as np
import pytest

import airmuscle as am
from airmuscle.core import evaluation, model, nodes
from airmuscle.errors import AirmuscleWarning, ParameterError, UnitError
from airmuscle.physics import ForceLaw, PressureLaw

BRAID = am.geometry.Braid(0.01, 0.4363, 0.3)
MUSCLE = am.Muscle(am.load("tondu-lopez").characteristic, BRAID, damper=am.LinearDamper(100.0))


@model
class Product(ForceLaw):
    """A user's law, in which a list that is not converted would be repeated: 2 [a, b] is [a, b, a,
    b].
    """

    def force(self, pressure, contraction):
        return 2 * pressure - 1e6 * contraction


@model
class Other(ForceLaw):
    """A user's law whose methods name their arguments in another way."""

    def force(self, p, eps):
        return 2 * p - 1e6 * eps

    def slopes(self, *point):
        return super().slopes(*point)


LAWS = {
    "F(p, eps)": am.load("tondu-lopez").characteristic,
    "eps(p, F)": am.load("borzikova-monotone").characteristic,
    "p(eps, F)": am.load("hunt2017-festo-10").characteristic,
    "user": Product(),
}


@pytest.mark.parametrize("law", LAWS.values(), ids=LAWS)
@pytest.mark.parametrize(
    ("method", "texts", "numbers"),
    [
        ("force", ("3 bar", "20 %"), (3e5, 0.2)),
        ("contraction", ("300 kPa", "100 N"), (3e5, 100.0)),
        ("pressure", ("20 %", "0.1 kN"), (0.2, 100.0)),
        ("slopes", ("3 bar", "200 mm/m"), (3e5, 0.2)),
        ("stiffness", ("0.3 MPa", "20 percent"), (3e5, 0.2)),
    ],
)
def test_texts_lists_and_integers_are_the_numbers_that_they_state(law, method, texts, numbers):
    call = getattr(law, method)
    if isinstance(law, PressureLaw) and method in (
        "force",
        "slopes",
        "stiffness",
    ):  # it does not contract by 20 %
        texts = (texts[0], "5 %")
        numbers = (numbers[0], 0.05)
    if isinstance(law, PressureLaw) and method == "pressure":  # at 20 % it is slack
        texts = ("5 %", texts[1])
        numbers = (0.05, numbers[1])
    expected = call(*numbers)
    assert call(*texts) == expected == call(numbers[0], texts[1])
    names = {"force": ("pressure", "contraction"), "contraction": ("pressure", "force")}.get(method)
    if names:
        assert call(**dict(zip(names, texts, strict=True))) == expected
    for several in ([numbers[0]] * 2, (numbers[0],) * 2, np.full(2, numbers[0], dtype=np.float32)):
        result = call(several, numbers[1])
        assert np.shape(result)[-1:] == (2,)
        assert (
            pytest.approx(np.tile(np.asarray(expected), (2, 1)).squeeze(), rel=1e-6)
            == np.asarray(result).T
        )


def test_integers_are_no_other_numbers_than_floats():
    law = LAWS["F(p, eps)"]
    pressures = np.array([0, 100_000, 300_000])
    assert np.array_equal(law.force(pressures, 0), law.force(pressures.astype(float), 0.0))
    assert law.force(np.int64(300_000), 0) == law.force(3e5, 0.0)
    read_only = np.array([1e5, 2e5])
    read_only.setflags(write=False)
    assert np.array_equal(law.force(read_only, 0.1), law.force([1e5, 2e5], [0.1, 0.1]))


def test_a_muscle_and_its_geometry_take_texts_too():
    assert MUSCLE.tension("3 bar", "5 %") == MUSCLE.tension(3e5, 0.05)
    assert (
        MUSCLE.tension("3 bar", "5 %", "20 mm/s")
        == MUSCLE.tension(3e5, 0.05, 0.02)
        < MUSCLE.tension(3e5, 0.05)
    )
    assert MUSCLE.tension(3e5, 0.05, speed="2 cm/s") == MUSCLE.tension(3e5, 0.05, 0.02)
    assert MUSCLE.static_force("3 bar", "5 %") == MUSCLE.static_force(3e5, 0.05)
    assert MUSCLE.stiffness("3 bar", "5 %") == MUSCLE.stiffness(3e5, 0.05)
    assert BRAID.volume("5 %") == BRAID.volume(0.05)
    assert np.array_equal(BRAID.volume([0, 0.1]), BRAID.volume(np.array([0.0, 0.1])))
    assert BRAID.volume_derivative("5 %") == BRAID.volume_derivative(0.05)


def test_a_law_may_name_its_arguments_in_another_way():
    law = Other()
    assert law.force("3 bar", "5 %") == law.force(3e5, 0.05) == law.force(p=3e5, eps="5 %")
    assert law.slopes("3 bar", "5 %") == law.slopes(3e5, 0.05) == (2.0, -1e6)
    with pytest.raises(ParameterError, match=r"Other.force: p is None; give a number"):
        law.force(None, 0.1)
    with pytest.warns(AirmuscleWarning, match="Is it in per cent"):
        law.force(3e5, 5.0)


@pytest.mark.parametrize(
    "value", [None, True, {"pressure": 3e5}, b"3 bar", 1j, ["3 bar", "4 bar"], [[1.0], [1.0, 2.0]]]
)
def test_what_is_no_quantity_is_refused_by_the_name_of_the_argument(value):
    for law in LAWS.values():
        with pytest.raises(
            ParameterError,
            match=r"\.force: pressure is .*; give a number .* in Pa, or a text .* '3 bar'",
        ):
            law.force(value, 0.1)
    with pytest.raises(
        ParameterError,
        match=r"Muscle.tension: contraction is .*or a text with a unit, such as '10 %'",
    ):
        MUSCLE.tension(3e5, value)
    with pytest.raises(ParameterError, match=r"Braid.volume: contraction is "):
        BRAID.volume(value)


def test_a_text_of_another_quantity_is_refused_by_its_unit():
    with pytest.raises(
        UnitError, match=r"contraction: pressure: unit 'N' cannot be converted to 'Pa'"
    ):
        LAWS["F(p, eps)"].contraction("3 N", 100.0)
    with pytest.raises(UnitError, match=r"force: contraction: "):
        LAWS["F(p, eps)"].force(3e5, "much")


def test_symbols_pass_unchanged():
    pressure = nodes.symbol("p")
    force = evaluation.Recorded([[pressure]], [[LAWS["F(p, eps)"].force(pressure, 0.05)]])
    expected = LAWS["F(p, eps)"].force(3e5, 0.05)
    assert force.at_numbers([3e5]) == [[pytest.approx(expected, rel=1e-14)]]


def test_expressions_of_casadi_pass_unchanged():
    casadi = pytest.importorskip("casadi")
    pressure = casadi.SX.sym("p")
    force = casadi.Function("f", [pressure], [LAWS["F(p, eps)"].force(pressure, 0.05)])
    assert float(force(3e5)) == pytest.approx(LAWS["F(p, eps)"].force(3e5, 0.05), rel=1e-14)


def test_the_signature_and_the_text_of_a_method_remain():
    assert list(inspect.signature(Product.force).parameters) == ["self", "pressure", "contraction"]
    assert "1e6 * contraction" in inspect.getsource(Product.force)
    assert (am.Muscle.tension.__doc__ or "").startswith("Tension [N]")
