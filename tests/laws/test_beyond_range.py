"""A law beyond its range: a stretched sleeve below it, slack above it, at most 1.5 times the rated
force, or an error.

It holds for every law of the library, for a law of a user and for a fitted one, in calls with
numbers and in the muscle of a plant, which all outlets trace. Inside the range a law is its
formula, to the last bit. A call outside warns once, with the place and the excess.
"""

from __future__ import annotations

import functools
import warnings
from dataclasses import replace

import numpy as np
import pytest

import airmuscle as am
from airmuscle.core import autodiff, model, ops, parameter
from airmuscle.errors import AirmuscleWarning, GeometryLimitError, PhysicsError, SolveError
from airmuscle.files import library, list_laws
from airmuscle.physics import (
    Braid,
    ClosedChamber,
    ContractileSurface,
    ForceLaw,
    HangingMass,
    Isothermal,
    LinearDamper,
    LinearSpring,
    Muscle,
    Plant,
    Ratings,
    ValidityRange,
    Vessel,
    find_equilibrium,
)
from airmuscle.physics.muscle.characteristic import calls, modes

SIDE = 100
"""Pressures and contractions of the 10 000 points of a law."""
LIMIT = 1.5
ROUNDING = 1e-9


@model
class WavyLaw(ForceLaw):
    """A law of a user that rises, falls and pushes outside its range: F = p a (1 - 4 eps) cos(20
    eps).
    """

    area: float = parameter("m2", "a", "area", bounds=(0.0, 1.0))

    def force(self, pressure, contraction):
        return pressure * self.area * (1.0 - 4.0 * contraction) * ops.cos(20.0 * contraction)


@model
class UntraceableLaw(ForceLaw):
    """A law of a user without closed form, and so without derivatives."""

    area: float = parameter("m2", "a", "area", bounds=(0.0, 1.0))
    traceable = False

    def force(self, pressure, contraction):
        return np.asarray(pressure) * self.area * np.exp(-9.0 * np.asarray(contraction))


RANGE = ValidityRange(0.5e5, 6e5, 0.0, 0.07)
OWN = {
    "a user's law": calls.with_stated_range(WavyLaw(2e-3), RANGE),
    "a user's law without closed form": calls.with_stated_range(
        UntraceableLaw(2e-3), RANGE, 1100.0
    ),
    "a fitted surface": ContractileSurface(
        (300.0, -200.0, 40.0, 250.0, -30.0, 3.0), 0.5e5, 6e5, 0.02, 0.25, 0.0, 1200.0, 2
    ),
}
NAMES = [*list_laws(), *OWN]


@functools.cache
def entry(name):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", AirmuscleWarning)
        return library.load(name)


def law_of(name):
    return OWN[name] if name in OWN else entry(name).characteristic


def stated_of(name):
    if name in OWN:
        law = OWN[name]
        return RANGE if isinstance(law, WavyLaw | UntraceableLaw) else law.validity_range
    return entry(name).validity_range


EXTENDED = [name for name in NAMES if not law_of(name).refuses_beyond]
REFUSING = [name for name in NAMES if law_of(name).refuses_beyond and "printed" not in name]
"""Without the misprinted surface, which gives contractions of minus several hundred per cent."""


def points(name, seed=1):
    """Ascending pressures (SIDE, 1) and contractions (1, SIDE) in and beyond the range."""
    rng = np.random.default_rng(seed)
    stated = stated_of(name)
    pressure = np.sort(rng.uniform(0.0, 2.0 * stated.max_pressure, SIDE))
    contraction = np.sort(rng.uniform(-0.3, 3.0 * stated.max_contraction, SIDE))
    return pressure[:, None], contraction[None, :]


@functools.cache
def forces(name):
    """Forces (SIDE, SIDE) of a law at its points, without warnings."""
    pressure, contraction = points(name)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", AirmuscleWarning)
        p, c = (side.ravel() for side in np.broadcast_arrays(pressure, contraction))
        # a law that is solved for the pressure has no solution where it is slack inside its range
        return np.nan_to_num(modes.values_or_nan(law_of(name).force, p, c)).reshape(SIDE, SIDE)


def one_force(name, pressure, contraction):
    try:
        return float(law_of(name).force(float(pressure), float(contraction)))
    except SolveError:
        return 0.0


def greatest_inside(name):
    stated = stated_of(name)
    pressure = np.linspace(*stated.pressure, 40)[:, None]
    contraction = np.linspace(min(stated.min_contraction, 0.0), stated.max_contraction, 40)
    with modes.formula_alone(), np.errstate(all="ignore"):
        values = [
            one_force(name, p, c) for p in (pressure[-1, 0], pressure[0, 0]) for c in contraction
        ]
    return max(values)


def rated_force(name):
    ratings = None if name in OWN else entry(name).ratings
    if name == "a user's law without closed form":
        return 1100.0
    return ratings.max_force if ratings is not None else greatest_inside(name)


@pytest.mark.parametrize("name", EXTENDED)
def test_beyond_its_range_a_law_is_monotone_bounded_and_does_not_push(name):
    pressure, contraction = points(name)
    force = forces(name)
    stated = stated_of(name)
    outside = ~stated.contains(pressure, contraction)
    assert outside.mean() > 0.4
    rated = rated_force(name)
    assert (force[outside] >= 0.0).all()
    assert force.max() <= max(LIMIT * rated, greatest_inside(name)) * (1.0 + ROUNDING)
    beyond = ~(
        (contraction[0] >= stated.min_contraction) & (contraction[0] <= stated.max_contraction)
    )
    taut = np.maximum(force, 0.0)
    if name == "a user's law":  # inside its range it may do as it likes
        taut = taut[:, beyond]
    assert (np.diff(taut, axis=1) <= ROUNDING * rated).all()
    assert (np.diff(taut, axis=0) >= -ROUNDING * rated).all()
    end = 1.3 * (max(law_of(name).contraction_range[1], stated.max_contraction) + 0.3)
    assert one_force(name, stated.max_pressure, end) == 0.0


@pytest.mark.parametrize("name", EXTENDED)
def test_inside_its_range_a_law_is_its_formula_to_the_last_bit(name):
    rng = np.random.default_rng(2)
    stated = stated_of(name)
    law = law_of(name)
    pressure = rng.uniform(*stated.pressure, 300)
    contraction = rng.uniform(*stated.contraction, 300)
    mixed = np.append(contraction, -0.2), np.append(pressure, 1e5)
    for p, c in zip(pressure[:40], contraction[:40], strict=True):
        with modes.formula_alone():
            try:
                expected = law.force(float(p), float(c))
            except SolveError:
                continue
        assert law.force(float(p), float(c)) == expected
    if isinstance(law, ForceLaw):
        with modes.formula_alone():
            expected = law.force(pressure, contraction)
        np.testing.assert_array_equal(law.force(pressure, contraction), expected)
        found = law.force(mixed[1], mixed[0])[:-1]
        np.testing.assert_allclose(found, expected, rtol=1e-13, atol=1e-12)


@pytest.mark.parametrize("name", EXTENDED)
def test_the_sleeve_begins_with_the_stiffness_of_the_law(name):
    stated = stated_of(name)
    step = 1e-6
    begin = min(stated.min_contraction, 0.0)
    for pressure in (stated.min_pressure, 0.6 * stated.max_pressure):
        at, above = (one_force(name, pressure, begin + k * step) for k in (0, 1))
        below = one_force(name, pressure, begin - step)
        if at > 0.0:  # the sleeve of a slack muscle becomes taut later
            scale = abs(at - above)
            assert below - at == pytest.approx(at - above, abs=2e-3 * scale + 1e-9)


@pytest.mark.parametrize("name", EXTENDED)
def test_contraction_and_pressure_are_inverse_to_the_force(name):
    law = law_of(name)
    stated = stated_of(name)
    rng = np.random.default_rng(3)
    limit = LIMIT * rated_force(name)
    count = 0
    for _ in range(60):
        pressure = rng.uniform(0.3, 1.3) * stated.max_pressure
        contraction = rng.uniform(-0.05, 1.2 * stated.max_contraction)
        force = one_force(name, pressure, contraction)
        if not 1e-3 * limit < force < 0.999 * limit:
            continue
        try:
            found = law.contraction(pressure, force)
        except SolveError:  # beyond the pressures or contractions of a solution
            continue
        assert law.force(pressure, found) == pytest.approx(force, rel=1e-6)
        found = law.pressure(contraction, force)
        assert law.force(found, contraction) == pytest.approx(force, rel=1e-6)
        count += 1
    assert count > 10
    with pytest.raises(SolveError):
        law.contraction(stated.max_pressure, 1.01 * max(limit, greatest_inside(name)))
    with pytest.raises(SolveError):
        law.pressure(0.0, 1.01 * max(limit, greatest_inside(name)))


@pytest.mark.parametrize("name", [name for name in EXTENDED if law_of(name).traceable])
def test_slopes_beyond_the_range_are_those_of_the_force(name):
    law = law_of(name)
    stated = stated_of(name)
    limit = LIMIT * rated_force(name)
    for pressure, contraction in (
        (0.5 * stated.max_pressure, -0.02),
        (0.5 * stated.max_pressure, -0.29),
        (1.2 * stated.max_pressure, 0.03),
        (1.9 * stated.max_pressure, -0.1),
        (0.5 * stated.max_pressure, 2.9 * stated.max_contraction),
    ):
        slopes = law.slopes(pressure, contraction)
        assert all(isinstance(slope, float) for slope in slopes)
        ahead, behind = (one_force(name, pressure, contraction + h) for h in (1e-5, -1e-5))
        expected = (ahead - behind) / 2e-5
        assert slopes.by_contraction == pytest.approx(expected, rel=1e-3, abs=1e-4 * limit)
        more, less = (one_force(name, pressure + h, contraction) for h in (50.0, -50.0))
        expected = (more - less) / 100.0
        assert slopes.by_pressure == pytest.approx(expected, rel=1e-3, abs=1e-10 * limit)


@pytest.mark.parametrize("name", REFUSING)
def test_a_law_that_is_not_extended_refuses_what_lies_beyond_it(name):
    law = law_of(name)
    low, high = law.contraction_range
    pressure = np.mean(np.clip(law.pressure_range, 0.0, 3e5))
    for contraction in (low - 0.3, 0.7, 0.99):
        with pytest.raises(PhysicsError):
            law.force(pressure, contraction)
    if law.begins_at_straight_fibres:
        for at in (0.0, np.array([0.1, 0.0])):
            with pytest.raises(GeometryLimitError, match=r"such as 0\.01 %"):
                law.force(pressure, at)
        assert 0.0 < law.force(2 * law.threshold_pressure, 1e-4) < 1e6
        assert high < 0.7


TRACED = [
    name for name in EXTENDED if isinstance(law_of(name), ForceLaw) and law_of(name).traceable
]


@pytest.mark.parametrize("name", [*TRACED, "saga2007-circle"])
def test_a_traced_muscle_has_the_force_of_the_calls(name):
    law = law_of(name)
    stated = stated_of(name) or ValidityRange(0.0, 2e5, 0.0, 0.3)
    ratings = None if name in OWN else entry(name).ratings
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", AirmuscleWarning)  # the length of the braid
        muscle = Muscle(law, Braid(0.01, 0.4, 0.2), validity_range=stated, ratings=ratings)
    rng = np.random.default_rng(4)
    pressure = rng.uniform(0.0, 2.0 * stated.max_pressure, 2000)
    low = -0.3 if name in TRACED else 1e-6
    contraction = rng.uniform(low, min(3.0 * stated.max_contraction, 0.5), 2000)
    traced = autodiff.value_and_derivative(muscle, "contractile_force", 2)
    values, _ = traced(pressure, contraction)
    numbers = muscle.contractile_force(pressure, contraction)
    scale = LIMIT * np.abs(numbers).max()
    np.testing.assert_allclose(values, numbers, atol=1e-12 * scale)
    if name in TRACED:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", AirmuscleWarning)
            called = muscle.contractile.force(pressure, contraction)
        np.testing.assert_allclose(np.maximum(values, 0), np.maximum(called, 0), atol=1e-12 * scale)
    else:  # at the straight fibres the force is limited
        at_rest, _ = traced(2e5, 0.0)
        assert np.isfinite(at_rest)
        assert (numbers <= at_rest * (1 + 1e-12)).all()


@pytest.mark.parametrize("direction", ["force", "contraction", "pressure", "slopes"])
def test_the_first_call_outside_warns_of_the_place_and_the_excess(direction):
    given = {
        "force": (7e5, -0.02),
        "contraction": (7e5, 1.3e3),
        "pressure": (-0.02, 800.0),
        "slopes": (7e5, -0.02),
    }[direction]
    law = replace(entry("tondu-lopez").characteristic)
    law = calls.with_stated_range(law, ValidityRange(0.5e5, 6e5, 0.0, 0.28))
    method = getattr(law, direction)
    with pytest.warns(AirmuscleWarning, match="TonduLopez2000: the ") as issued:
        method(*given)
    text = str(issued[0].message)
    if direction in ("force", "slopes"):
        assert "the contraction -2.00 % is 2.00 % outside the range 0.00 % to 28.00 %" in text
        assert "the pressure 700 kPa is 100 kPa outside the range 50 kPa to 600 kPa" in text
    assert "Later calls of this law outside are not reported" in text
    assert issued[0].filename == __file__
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        method(*given)
        calls.with_stated_range(law, RANGE).force(3e5, 0.05)


def test_ratings_without_a_validity_range_limit_the_force():
    law = calls.with_stated_range(WavyLaw(2e-3), None, 900.0)
    with pytest.warns(AirmuscleWarning):
        assert 0.9 * LIMIT * 900.0 < law.force(1e6, -0.4) <= LIMIT * 900.0
    muscle = Muscle(WavyLaw(2e-3), Braid(0.01, 0.4, 0.2), ratings=Ratings(max_force=900.0))
    assert muscle.contractile_force(2e6, 0.0) == pytest.approx(LIMIT * 900.0)
    unstated = Muscle(WavyLaw(2e-3), Braid(0.01, 0.4, 0.2), ratings=Ratings(max_pressure=6e5))
    assert unstated.contractile_force(2e6, 0.0) == WavyLaw(2e-3).force(2e6, 0.0)


def hanging(mass):
    muscle = replace(entry("dmsp-20-300").muscle, damper=LinearDamper(300.0))
    return Plant(muscle, ClosedChamber(), HangingMass(mass), Isothermal())


def test_an_equilibrium_outside_the_range_is_reported():
    with pytest.warns(AirmuscleWarning, match=r"muscle: the pressure 1100 kPa is 425 kPa outside"):
        find_equilibrium(hanging(40.0), pressure=11e5)
    with pytest.warns(AirmuscleWarning, match=r"the contraction -\d.* is .* % outside the range"):
        state = find_equilibrium(hanging(170.0), pressure=6e5)
    assert state["position"] != 0.0
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        find_equilibrium(hanging(40.0), pressure=5e5)


PRODUCTS = [
    name
    for name in EXTENDED
    if name not in OWN and isinstance(law_of(name), ForceLaw) and stated_of(name).min_pressure > 0.0
]


@pytest.mark.parametrize("name", PRODUCTS)
def test_a_muscle_without_pressure_is_usual_and_one_that_is_overstretched_is_reported(name):
    """Most ranges begin at some pressure; every muscle begins without, stretched by its load."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", AirmuscleWarning)
        muscle = Muscle(
            law_of(name),
            Vessel(2e-4),
            LinearSpring(3e3),  # the sleeve of a law without force at rest
            validity_range=stated_of(name),
            ratings=entry(name).ratings,
        )
    plant = Plant(muscle, ClosedChamber(), HangingMass(1.0), Isothermal())
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        state = find_equilibrium(plant, pressure=0.0)
        assert abs(state["position"]) < 0.02
        assert not muscle.excess_at_rest(-0.02)
    low = 0.5 * stated_of(name).min_pressure
    with pytest.warns(AirmuscleWarning, match="kPa outside the range"):
        find_equilibrium(plant, pressure=low)
    assert "outside the range -" in muscle.excess_at_rest(-0.09)
    assert "outside the range -" in muscle.excess_at_rest(0.5)


def test_a_run_that_stretches_the_muscle_passes_its_end_and_is_noted():
    plant = hanging(100.0)
    start = find_equilibrium(plant, pressure=4e5)
    fast = {**start, "speed": -0.35}
    run = am.simulate(plant, am.Schedule({}), duration=0.4, initial_state=fast)
    assert run["contraction"].min() < -0.002
    assert run["force"].max() <= LIMIT * 1500.0
    assert np.isfinite(run["force"]).all()
    assert any("validity range" in note for note in run.notes)
