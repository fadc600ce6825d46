"""A braided tube obeys virtual work with the energy of its wall, and a recipe predicts it with the
spread of its tolerances.
"""

from dataclasses import replace
from math import radians

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import airmuscle as am
from airmuscle.design import MuscleRecipe, modulus_of_hardness, predict_recipe
from airmuscle.errors import ParameterError
from airmuscle.physics import Braid, BraidedTube, ChouHannaford1996, MooneyRivlinTube

NODES, WEIGHTS = np.polynomial.legendre.leggauss(40)
RECIPE = MuscleRecipe(7e-3, 1e-3, 0.2, radians(25.0), hardness=50.0)
ANGLES = st.floats(0.2, 0.8)
BORES = st.floats(1e-3, 0.02)
WALLS = st.floats(0.05, 1.0)
"""Walls, as a part of the bore radius."""


def potential(law: MooneyRivlinTube, pressure: float, contraction: float) -> float:
    """Energy of the wall less that of the air, p V, by quadrature over the thickness."""
    tube = law.geometry
    active = tube.resting_length - tube.inactive_length
    stretch = (tube.resting_length * (1.0 - contraction) - tube.inactive_length) / active
    sine = np.sqrt(1.0 - (stretch * np.cos(tube.braid_angle)) ** 2)
    outer = tube.radius * sine / np.sin(tube.braid_angle) - tube.thread_distance
    free = tube.bore_radius + tube.wall_thickness * (NODES + 1.0) / 2.0
    largest = tube.bore_radius + tube.wall_thickness
    radius = np.sqrt(outer**2 - (largest**2 - free**2) / stretch)
    around = radius / free
    through = 1.0 / (around * stretch)
    first = around**2 + through**2 + stretch**2 - 3.0
    second = around**-2 + through**-2 + stretch**-2 - 3.0
    density = law.c1 * first + law.c2 * second
    energy = 2.0 * np.pi * active * np.sum(WEIGHTS * tube.wall_thickness / 2.0 * free * density)
    inner_squared = outer**2 - (largest**2 - tube.bore_radius**2) / stretch
    return float(energy - pressure * np.pi * inner_squared * stretch * active)


def tension(law: MooneyRivlinTube, pressure: float, contraction: float) -> float:
    """Tension [N] by the central difference of the potential."""
    step = 1e-5
    by_contraction = (
        potential(law, pressure, contraction + step) - potential(law, pressure, contraction - step)
    ) / (2.0 * step)
    return -by_contraction / law.geometry.resting_length


@given(ANGLES, BORES, WALLS, st.floats(0.0, 8e5), st.floats(0.01, 0.9), st.floats(0.0, 1.0))
def test_the_tension_is_the_slope_of_energy_of_the_wall_less_that_of_the_air(
    angle: float, bore: float, wall: float, pressure: float, part: float, second: float
):
    thickness = wall * bore
    tube = BraidedTube(bore, thickness, angle, 0.2, 1e-4, 1e-4, 0.02)
    law = MooneyRivlinTube(tube, 4e5, second * 1e5)
    contraction = part * law.contraction_range[1]
    force = law.unclamped_force(pressure, contraction)
    scale = abs(force) + 8e5 * tube.radius**2
    assert force == pytest.approx(tension(law, pressure, contraction), abs=1e-6 * scale)


def test_without_wall_it_is_the_braid_of_chou_and_hannaford():
    ideal = ChouHannaford1996(Braid(0.01, 0.42, 0.3))
    law = MooneyRivlinTube(BraidedTube(0.0099, 1e-4, 0.42, 0.3), 0.0)
    contractions = np.linspace(0.0, 0.3, 13)
    assert law.unclamped_force(5e5, contractions) == pytest.approx(
        ideal.force(5e5, contractions), rel=1e-12
    )


def test_the_pressure_does_the_work_of_the_enclosed_volume():
    law = RECIPE.law()
    by_volume = law.geometry.volume_derivative(0.1) / law.geometry.resting_length
    by_pressure = (law.unclamped_force(2e5, 0.1) - law.unclamped_force(0.0, 0.1)) / 2e5
    assert by_pressure == pytest.approx(by_volume, rel=1e-12)


def test_a_thicker_wall_and_a_narrower_tube_contract_less():
    walls = [predict_free(RECIPE, wall_thickness=wall) for wall in (0.5e-3, 1e-3, 1.5e-3, 2e-3)]
    bores = [predict_free(RECIPE, bore=bore) for bore in (7e-3, 5e-3, 3e-3)]
    assert walls == sorted(walls, reverse=True)
    assert bores == sorted(bores, reverse=True)
    assert bores[0] > 2.0 * bores[-1]


def predict_free(recipe: MuscleRecipe, **changed: float) -> float:
    return float(replace(recipe, **changed).law().contraction(5e5, 0.0))


def test_a_braid_that_is_wider_than_the_tube_gives_a_dead_zone():
    law = replace(RECIPE, braid_diameter=11e-3).law()
    step = 1e-5
    without = tension(law, 0.0, step)
    by_pressure = tension(law, 1e5, step) - without
    assert law.threshold_pressure == pytest.approx(-1e5 * without / by_pressure, rel=1e-3)
    assert law.force(0.99 * law.threshold_pressure, 0.0) == 0.0
    assert law.force(1.01 * law.threshold_pressure, 0.0) > 0.0
    assert RECIPE.law().threshold_pressure == 0.0


def test_the_modulus_lies_between_two_relations_and_grows_with_hardness():
    soft, hard = (modulus_of_hardness(value) for value in (30.0, 60.0))
    assert soft.least < soft.middle < soft.greatest < hard.least
    wide = modulus_of_hardness(50.0, 5.0)
    assert wide.least < modulus_of_hardness(50.0).least
    with pytest.raises(ParameterError, match=r"90 Shore A; allowed range: 20 to 80 Shore A"):
        modulus_of_hardness(90.0)


def test_three_public_recipes_with_one_hardness_and_angle():
    """Tubes of 7, 5 and 3 mm bore and 1 mm wall contract by about 30, 15 and 10 % (public recipes
    of Masuda, which state neither pressure nor hardness nor angle); chosen here: 5 bar, 50 Shore A,
    25 degrees. Two are within 4 points; the widest contracts by 8 points less, and its band ends
    below the stated value.
    """
    stated = {7e-3: 0.30, 5e-3: 0.15, 3e-3: 0.10}
    predicted = {bore: predict_free(RECIPE, bore=bore) for bore in stated}
    errors = {bore: abs(predicted[bore] - value) for bore, value in stated.items()}
    assert errors[5e-3] < 0.04
    assert errors[3e-3] < 0.04
    assert 0.04 < errors[7e-3] < 0.10


def test_the_band_holds_muscles_of_the_tolerances_and_is_the_same_again():
    prediction = predict_recipe(RECIPE, 5e5)
    again = predict_recipe(RECIPE, 5e5)
    assert np.array_equal(prediction.low, again.low)
    assert (prediction.low <= prediction.forces).all()
    assert (prediction.forces <= prediction.high).all()
    generator = np.random.default_rng(7)
    count = len(RECIPE.tolerances)
    free = [RECIPE.drawn(generator.random(count)).contraction(5e5, 0.0) for _ in range(60)]
    low, high = prediction.free[-1].band
    inside = np.mean((np.array(free) >= low) & (np.array(free) <= high))
    assert inside > 0.9
    assert next(iter(prediction.shares)) == "hardness"
    assert sum(prediction.shares.values()) == pytest.approx(1.0)


def test_a_stated_modulus_narrows_the_band():
    known = replace(RECIPE, hardness=0.0, modulus=2.9e6)
    assert "hardness" not in known.tolerances
    narrow = predict_recipe(known, 5e5, samples=64).free[-1]
    wide = predict_recipe(RECIPE, 5e5, samples=64).free[-1]
    assert narrow.high - narrow.low < 0.7 * (wide.high - wide.low)


def test_the_predicted_muscle_is_a_file_that_evaluates(tmp_path):
    path = am.files.save(predict_recipe(RECIPE, 5e5, samples=16).entry("nine"), tmp_path / "m.toml")
    entry = am.files.load_muscle(str(path))
    assert entry.characteristic.contraction(5e5, 0.0) == pytest.approx(predict_free(RECIPE))
    assert entry.evidence == "geometric model"


WRONG = {
    "two elasticities": (
        {"modulus": 2e6},
        r"give the Shore A hardness or Young's modulus of the tube, one of both",
        {"modulus": 2e6, "hardness": 0.0},
    ),
    "no elasticity": ({"hardness": 0.0}, r"one of both", {"hardness": 40.0}),
    "a narrow braid": (
        {"braid_diameter": 8e-3},
        r"outer diameter of 8 mm, and on a tube of 9 mm it has 9 mm or more",
        {"braid_diameter": 9e-3},
    ),
    "odd threads": ({"threads": 47}, r"even number, half of them", {"threads": 48}),
    "too many threads": (
        {"threads": 480, "thread_diameter": 0.25e-3},
        r"480 threads of 0\.25 mm do not fit beside each other",
        {"threads": 48, "thread_diameter": 0.25e-3},
    ),
    "hard rubber": ({"hardness": 95.0}, r"allowed range: 20 to 80", {"hardness": 60.0}),
}


@pytest.mark.parametrize("case", WRONG)
def test_an_impossible_recipe_is_refused_and_its_remedy_works(case: str):
    changed, message, remedy = WRONG[case]
    with pytest.raises(ParameterError, match=message):
        replace(RECIPE, **changed)
    assert replace(RECIPE, **remedy).law().force(5e5, 0.0) > 0.0


def test_ends_without_a_middle_are_refused():
    with pytest.raises(ParameterError, match=r"inactive_length is 190 mm of a muscle of 200 mm"):
        BraidedTube(0.008, 0.001, 0.4, 0.2, 0.0, 0.0, 0.19)


@pytest.mark.parametrize("pressure", [0.0, -1e5, float("nan"), 1e8])
def test_an_impossible_pressure_is_refused(pressure: float):
    with pytest.raises(ParameterError, match=r"allowed range: above 0 to 5e\+06 Pa"):
        predict_recipe(RECIPE, pressure)
