"""Force, contraction and pressure of every library entry describe one surface F = f(p, eps).

A direction in closed form agrees with the root search of the base class; slopes are the derivatives
of the force; an array gives the values of its elements; traced models and JAX give the values of
NumPy.
"""

from __future__ import annotations

import functools
import warnings
from typing import Any, NamedTuple

import numpy as np
import pytest

from airmuscle import files
from airmuscle.core import autodiff
from airmuscle.errors import AirmuscleWarning, ParameterError, SolveError
from airmuscle.files import Entry, library
from airmuscle.physics import Characteristic, ContractionLaw, ForceLaw, PressureLaw, ValidityRange
from airmuscle.physics.muscle.characteristic.solve import find_first_root

ARGUMENTS = {
    "force": ("pressure", "contraction"),
    "contraction": ("pressure", "force"),
    "pressure": ("contraction", "force"),
}
SEARCHES = {ForceLaw: "force", ContractionLaw: "contraction", PressureLaw: "pressure"}
# Away from the ends of a validity range and from round numbers, where tables have their kinks.
PLACES = np.array([0.0871, 0.2913, 0.4931, 0.7127, 0.9083])


class Points(NamedTuple):
    """Points of a surface at which tension increases with pressure and decreases with
    contraction.
    """

    pressure: np.ndarray
    contraction: np.ndarray
    force: np.ndarray

    def given(self, direction: str) -> list[np.ndarray]:
        return [getattr(self, name) for name in ARGUMENTS[direction]]


@functools.cache
def entry(name: str) -> Entry:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", AirmuscleWarning)
        return library.load(name)


def own_direction(law: Characteristic) -> str:
    """The quantity for which the characteristic is solved."""
    return next(
        (direction for base, direction in SEARCHES.items() if isinstance(law, base)), "force"
    )


@functools.cache
def points(name: str) -> Points:
    law = entry(name).characteristic
    validity_range = entry(name).validity_range
    ranges = {
        "pressure": validity_range.pressure if validity_range else law.pressure_range,
        "contraction": validity_range.contraction if validity_range else law.contraction_range,
        "force": (law.force_range[0], min(law.force_range[1], 500.0)),
    }
    own = own_direction(law)
    first, second = (
        side.reshape(-1)
        for side in np.meshgrid(
            *(low + PLACES * (high - low) for low, high in (ranges[n] for n in ARGUMENTS[own]))
        )
    )
    answers = answer(law, own, first, second)
    known = {**dict(zip(ARGUMENTS[own], (first, second), strict=True)), own: answers}
    found = np.array([known["pressure"], known["contraction"], known["force"]])[
        :, np.isfinite(answers)
    ]
    return Points(*found[:, reached_from_rest(law, *found)])


def answer(
    law: Characteristic, direction: str, first: np.ndarray, second: np.ndarray
) -> np.ndarray:
    """The answers at points; nan where there is none."""
    try:
        return getattr(law, direction)(first, second)
    except SolveError:
        if first.size == 1:
            return np.full(1, np.nan)
        return np.concatenate(
            [answer(law, direction, first[i : i + 1], second[i : i + 1]) for i in range(first.size)]
        )


def reached_from_rest(
    law: Characteristic, pressure: np.ndarray, contraction: np.ndarray, force: np.ndarray
) -> np.ndarray:
    """Answered in every direction, and with the first answer where there are branches; rising in
    pressure, falling in contraction."""
    reached = force > 0
    reached[reached] = np.isfinite(answer(law, "pressure", contraction[reached], force[reached]))
    for direction, given, expected in (
        ("contraction", force, contraction),
        ("force", contraction, force),
    ):
        found = answer(law, direction, pressure[reached], given[reached])
        reached[reached] = np.isclose(found, expected[reached], rtol=1e-6, atol=1e-12)
    slopes = law.slopes(pressure[reached], contraction[reached])
    reached[reached] = (slopes.by_pressure > 0) & (slopes.by_contraction < 0)
    return reached


every_entry = pytest.mark.parametrize("name", files.list_laws())


@every_entry
def test_every_validity_range_has_test_points(name: str):
    assert points(name).force.size >= 8


@every_entry
@pytest.mark.parametrize("direction", ARGUMENTS)
def test_each_direction_returns_a_point_of_the_surface(name: str, direction: str):
    law = entry(name).characteristic
    there = points(name)
    answers = there._replace(**{direction: getattr(law, direction)(*there.given(direction))})
    own = own_direction(law)
    np.testing.assert_allclose(
        getattr(law, own)(*answers.given(own)), getattr(answers, own), rtol=1e-9
    )


@every_entry
def test_a_closed_form_equals_the_root_search(name: str):
    law = entry(name).characteristic
    there = points(name)
    base = next((base for base in SEARCHES if isinstance(law, base)), None)
    if base is None:
        pytest.skip("the law has no root search to compare with")
    for direction in set(ARGUMENTS) - {SEARCHES[base]}:
        given = there.given(direction)
        try:
            searched = getattr(base, direction)(law, *given)
        except SolveError:  # a law that refuses a part of the reach cannot be searched through it
            continue
        np.testing.assert_allclose(getattr(law, direction)(*given), searched, rtol=1e-9)


@every_entry
def test_an_impossible_force_is_an_error(name: str):
    law = entry(name).characteristic
    there = points(name)
    if own_direction(law) != "force":
        pytest.skip("solved for another quantity, the law answers any force")
    if not law.begins_at_straight_fibres:  # they pull without limit at rest
        with pytest.raises(
            SolveError, match=r"no contraction in the range .* is in equilibrium with 1e\+07 N"
        ):
            law.contraction(there.pressure[0], 1e7)
    with pytest.raises(SolveError, match=r"no gauge pressure in the range .* gives 1e\+07 N"):
        law.pressure(there.contraction, 1e7)


@every_entry
def test_slopes_are_the_derivatives_of_the_force(name: str):
    law = entry(name).characteristic
    there = points(name)
    slopes = law.slopes(there.pressure, there.contraction)
    for step, exact in (((1.0, 0.0), slopes.by_pressure), ((0.0, 1e-6), slopes.by_contraction)):
        after, before = (
            law.force(there.pressure + sign * step[0], there.contraction + sign * step[1])
            for sign in (1, -1)
        )
        np.testing.assert_allclose(exact, (after - before) / (2 * sum(step)), rtol=1e-4)


@every_entry
@pytest.mark.parametrize("direction", ARGUMENTS)
def test_an_array_gives_the_values_of_its_elements(name: str, direction: str):
    law = entry(name).characteristic
    there = points(name)
    given = there.given(direction)
    some = slice(None, None, 4)
    singly = [
        getattr(law, direction)(float(a), float(b))
        for a, b in zip(*(g[some] for g in given), strict=True)
    ]
    assert all(isinstance(value, float) for value in singly)
    np.testing.assert_allclose(getattr(law, direction)(*given)[some], singly, rtol=1e-12)


@every_entry
def test_a_traced_model_gives_the_values_of_numpy(name: str):
    law = entry(name).characteristic
    there = points(name)
    if not law.traceable:
        pytest.skip("the law says that it is not closed-form")
    own = own_direction(law)
    traced, _ = autodiff.jacobian(law, own, *there.given(own))
    np.testing.assert_allclose(traced, getattr(law, own)(*there.given(own)), rtol=1e-12)


@pytest.mark.tool
@every_entry
def test_jax_gives_the_values_of_numpy(name: str):
    jax: Any = pytest.importorskip("jax")
    law = entry(name).characteristic
    there = points(name)
    if not law.traceable:
        pytest.skip("the law says that it is not closed-form")
    own = own_direction(law)
    jax.config.update("jax_enable_x64", True)
    found = jax.jit(getattr(law, own))(*map(jax.numpy.asarray, there.given(own)))
    np.testing.assert_allclose(np.asarray(found), getattr(law, own)(*there.given(own)), rtol=1e-12)


def test_a_validity_range_needs_increasing_limits():
    with pytest.raises(ParameterError, match="min_pressure 2 must be less than max_pressure 1"):
        ValidityRange(2.0, 1.0, 0.0, 0.1)


def first_root(function: Any, a: Any = 0.0, b: Any = 0.0) -> Any:
    """The first root from -1 to 2."""
    return find_first_root(
        function, (-1.0, 2.0), (a, b), lambda *values: "no root: " + ", ".join(map(str, values))
    )


@pytest.mark.parametrize("scale", [1e-9, 1.0, 1e9])
def test_the_first_of_several_roots_is_found_at_any_scale(scale: float):
    at = np.array([[-0.9], [0.31], [1.2]])
    found = first_root(
        lambda x, a, b: scale * (x - a) * (x - b) * (x - 1.9), at, np.array([1.5, 1.6])
    )
    np.testing.assert_allclose(found, np.broadcast_to(at, (3, 2)), rtol=1e-14)


def test_a_plateau_at_zero_begins_at_its_edge_and_a_root_at_the_start_is_the_start():
    edges = np.array([-0.3, 0.1234, 1.7])
    np.testing.assert_allclose(
        first_root(lambda x, a, b: np.minimum(x - a, 0.0), edges), edges, rtol=1e-14
    )
    assert first_root(lambda x, a, b: np.maximum(x + 1.0, 0.0)) == -1.0
    assert first_root(lambda x, a, b: 0.0 * x) == -1.0


def test_without_a_root_the_message_has_the_arguments_and_the_extreme_values():
    with pytest.raises(SolveError, match=r"no root: 3.0, 0.5, -3.5, -0.5$"):
        first_root(lambda x, a, b: x - a + b, np.array([0.0, 3.0]), 0.5)
    with pytest.raises(SolveError, match=r"no root: 1.0, 0.0, nan, nan$"):
        first_root(lambda x, a, b: x * np.nan, 1.0)
    with pytest.raises(SolveError, match=r"no root: 0.0, 0.0, -2.0, 1.0$"):  # it falls through zero
        first_root(lambda x, a, b: -x)


def test_no_load_on_a_limited_law_is_solved_where_the_force_ends():
    law = entry("sarosi-dmsp-10").characteristic
    free = law.contraction(4e5, 0.0)
    assert law.force(4e5, free) == pytest.approx(0.0, abs=1e-9)
    assert law.force(4e5, free - 1e-6) > 0.0
    assert law.contraction(4e5, 1e-6) == pytest.approx(free, abs=1e-8)
