"""A commercial muscle has permitted values with sources: they are shown, warned of and refused, and
scale with size.
"""

from __future__ import annotations

import dataclasses
import json

import numpy as np
import pytest
from command_line import airmuscle
from plants import EXAMPLES

from airmuscle import simulate
from airmuscle.engine import Schedule
from airmuscle.errors import ParameterError, UnknownNameError
from airmuscle.files import entries_of_product, list_laws, list_products, load, load_law
from airmuscle.files.library import ParameterUncertainty, StatedBand, scale_entry, without_parts
from airmuscle.physics import CreepElements, LinearSpring, Ratings

DMSP_20 = "dmsp-20-300"


@pytest.mark.parametrize("name", list_products())
def test_every_product_states_its_limits_its_sources_and_what_is_not_known(name: str):
    product = load(name)
    assert {"max_force", "max_pressure", "max_contraction"} <= set(product.ratings.stated)
    assert product.references
    assert "not known" in product.note


def test_the_laws_of_a_product_have_its_ratings_and_sources():
    for name in list_products():
        product = load(name)
        for law in entries_of_product(name):
            entry = load_law(law)
            assert entry.ratings == product.ratings
            assert {r.key for r in product.references} <= {r.key for r in entry.references}
    rated = {law for name in list_products() for law in entries_of_product(name)}
    commercial = {
        n for n in list_laws() if n.startswith(("dmsp", "festo-tool", "sarosi", "borzikova"))
    }
    assert rated == commercial


@pytest.mark.parametrize(
    ("name", "given", "message"),
    [
        (
            DMSP_20,
            ("--pressure=12 bar", "--contraction=10 %"),
            "the pressure 1200 kPa is not permitted; allowed range: 0 to 600 kPa",
        ),
        (
            DMSP_20,
            ("--force=2000 N", "--contraction=1 %"),
            "the force 2000 N is not permitted; allowed range: at most 1500 N",
        ),
        (
            "sarosi-dmsp-10",
            ("--pressure=9 bar", "--contraction=5 %"),
            "the pressure 900 kPa is not permitted; allowed range: 0 to 800 kPa",
        ),
    ],
)
def test_what_is_neither_permitted_nor_measured_is_refused(
    name: str, given: tuple[str, ...], message: str
):
    result = airmuscle("evaluate", name, *given)
    assert result.exit_code == 1
    assert (
        "error: the point exceeds the ratings of the maker and the measured range" in result.stderr
    )
    assert message in result.stderr


def test_a_measured_point_beyond_the_permitted_pressure_gives_a_warning():
    result = airmuscle(
        "evaluate", DMSP_20, "--pressure", "650 kPa", "--contraction", "10 %", "--json"
    )
    assert result.exit_code == 0
    assert (
        "warning: the point exceeds the ratings of the maker: the pressure 650 kPa" in result.stderr
    )
    assert json.loads(result.stdout)["evaluation"]["permitted"] is False
    inside = airmuscle(
        "evaluate", DMSP_20, "--pressure", "3 bar", "--contraction", "10 %", "--json"
    )
    assert inside.stderr == ""
    assert json.loads(inside.stdout)["evaluation"]["permitted"] is True


def test_show_displays_the_ratings_of_a_product_and_of_its_laws():
    product = airmuscle("show", "festo-dmsp-20").output
    assert all(
        text in product
        for text in ("ratings.max_force", "1500", "permitted force", "not known", DMSP_20)
    )
    assert "min_temperature" not in product
    assert "ratings.max_force" in airmuscle("show", DMSP_20).output
    assert (
        "No law of it is published; fit one to measurements."
        in airmuscle("show", "shadow-20-210").output
    )


def test_list_names_each_product_and_each_specimen_once():
    rows = json.loads(airmuscle("list", "--json").output)
    names = [row["name"] for row in rows]
    assert len(names) == len(set(names))
    kinds = {row["name"]: row["kind"] for row in rows}
    assert kinds[DMSP_20] == "muscle, MartensBoblan2017; data set"
    assert {name for name, kind in kinds.items() if kind == "product, Ratings"} == set(
        list_products()
    )


def test_a_product_is_no_law_and_says_which_laws_it_has():
    with pytest.raises(
        UnknownNameError, match=f"is a product.*its laws are {DMSP_20}, festo-tool-dmsp-20"
    ):
        load_law("festo-dmsp-20")
    with pytest.raises(UnknownNameError, match="no law of it is published; fit one"):
        load_law("shadow-20-210")


def _filled(ratings: Ratings | None):
    plant = EXAMPLES["held for good"]
    muscle = dataclasses.replace(plant.muscles[0], ratings=ratings)
    return simulate(
        dataclasses.replace(plant, muscle=muscle), Schedule({"fill": ((0.0, 1.0),)}), duration=0.5
    )


def test_a_run_reports_when_and_how_far_it_exceeds_the_permitted_values():
    rated = _filled(
        Ratings(max_force=100.0, max_pressure=2e5, min_pressure=0.0, max_temperature=290.0)
    )
    texts = [note for note in rated.notes if "permit" in note]
    assert len(texts) == 3
    assert any("the temperature 20 °C is not permitted" in t for t in texts)
    assert any(
        "outside the range that its maker permits in force (at most 100 N)" in t for t in texts
    )
    assert any(
        "outside the range that its maker permits in pressure (0 to 200 kPa)" in t for t in texts
    )
    assert not any(
        "permit" in note
        for ratings in (None, Ratings(max_force=1e5))
        for note in _filled(ratings).notes
    )


# scaling


def test_a_scaled_muscle_has_the_same_force_at_the_same_contraction_and_a_volume_in_proportion():
    entry = load_law(DMSP_20)
    short = scale_entry(entry, resting_length="200 mm")
    assert short.muscle.geometry.resting_length == pytest.approx(0.2)
    assert float(short.characteristic.force(3e5, 0.1)) == pytest.approx(
        float(entry.characteristic.force(3e5, 0.1))
    )
    volumes = [float(e.geometry.volume(0.1)) for e in (short, entry)]
    assert volumes[0] / volumes[1] == pytest.approx(2 / 3)
    assert short.checks == ()
    assert "not measured at this size" in short.note
    assert "Not scaled" not in short.note


@pytest.mark.parametrize("name", ["reynolds2003", "serres2009"])
def test_a_spring_of_twice_the_length_has_half_the_stiffness(name: str):
    entry = load_law(name)
    long = scale_entry(entry, resting_length="400 mm")
    pressure = np.array([[2e5], [5e5]])
    contraction = np.array([0.0, 0.05, 0.15])
    force = entry.characteristic.force(pressure, contraction)
    assert long.characteristic.force(pressure, contraction) == pytest.approx(force, rel=1e-12)


def test_a_scaled_muscle_keeps_only_the_uncertainty_of_parameters_that_do_not_change():
    law = load_law(DMSP_20)
    for names, kept in (
        (("characteristic.c0", "characteristic.geometry.radius"), True),
        (("characteristic.c1",), False),
    ):
        count = len(names)
        stated = ParameterUncertainty(names, (1.0,) * count, tuple(map(tuple, np.eye(count))))
        entry = scale_entry(dataclasses.replace(law, uncertainty=stated), resting_length="200 mm")
        assert entry.uncertainty == (stated if kept else None)


def uncertainty_of(errors: tuple[float, float], correlation: float) -> ParameterUncertainty:
    """The uncertainty of a damping and a stiffness."""
    return ParameterUncertainty(
        ("damper.damping", "spring.stiffness"), errors, ((1.0, correlation), (correlation, 1.0))
    )


def test_an_uncertainty_has_finite_errors_and_possible_correlations():
    for errors in ((np.inf, 1.0), (np.nan, 1.0), (1.0, -1e-9)):
        with pytest.raises(ParameterError, match="standard errors must be finite and not negative"):
            uncertainty_of(errors, 0.0)
    assert uncertainty_of((0.0, 2.0), -1.0 - 5e-7).covariance[1].tolist() == [0.0, 4.0]
    with pytest.raises(ParameterError, match="allowed range of a correlation: -1 to 1"):
        uncertainty_of((1.0, 2.0), 1.0 + 1e-5)


def test_an_uncertainty_without_a_part_has_the_rows_of_the_others():
    stated = uncertainty_of((1.0, 2.0), 0.5)
    assert without_parts(stated, ["damper"]) == ParameterUncertainty(
        ("spring.stiffness",), (2.0,), ((1.0,),)
    )
    assert without_parts(stated, ["damper", "spring"]) is None
    assert without_parts(stated, ["friction"]) == stated


def test_another_diameter_is_another_product_without_the_ratings_and_the_band_of_the_first():
    band = StatedBand("force", 12.0, "40 rows")
    entry = dataclasses.replace(
        load_law("tondu-lopez"), ratings=Ratings(max_force=100.0), error_band=band
    )
    wide = scale_entry(entry, diameter="30 mm")
    assert (wide.ratings, wide.error_band) == (None, None)
    long = scale_entry(entry, resting_length="400 mm")
    assert (long.ratings, long.error_band) == (entry.ratings, band)


def test_a_scaled_muscle_names_its_parts_of_the_original_size():
    entry = dataclasses.replace(
        load_law(DMSP_20), spring=LinearSpring(1000.0), creep=CreepElements((500.0,), (10.0,))
    )
    short = scale_entry(entry, resting_length="200 mm")
    assert short.note.endswith("Not scaled, but as at the original size: spring, creep.")
    assert short.spring == entry.spring


def test_the_force_of_a_braid_without_wall_grows_with_the_square_of_its_diameter():
    entry = load_law("tondu-lopez")
    wide = scale_entry(entry, diameter="30 mm")
    assert float(wide.characteristic.force(3e5, 0.1)) == pytest.approx(
        2.25 * float(entry.characteristic.force(3e5, 0.1))
    )
    assert wide.muscle.geometry.radius == pytest.approx(0.015)


@pytest.mark.parametrize(
    ("name", "size", "message"),
    [
        (
            DMSP_20,
            {"resting_length": "20 mm"},
            "the length 20 mm is not permitted; allowed range: 40 to 9000 mm",
        ),
        (DMSP_20, {"diameter": "40 mm"}, "MartensBoblan2017 cannot be scaled to another diameter"),
        (
            "festo-tool-dmsp-20",
            {"resting_length": "200 mm"},
            "has no resting length: its force depends on pressure",
        ),
        ("tondu-lopez", {"diameter": "-1 mm"}, "diameter is -1 mm; it must be greater than zero"),
        (
            "tondu-lopez",
            {"resting_length": "0 mm"},
            "resting length is 0 mm; it must be greater than zero",
        ),
    ],
)
def test_a_size_that_cannot_be_is_refused(name: str, size: dict[str, str], message: str):
    with pytest.raises(ParameterError, match=message):
        scale_entry(load_law(name), **size)


def test_solve_scales_and_shows_the_stroke_of_the_length():
    solved = json.loads(
        airmuscle(
            "evaluate",
            DMSP_20,
            "--resting-length",
            "200 mm",
            "--pressure",
            "3 bar",
            "--contraction",
            "10 %",
            "--json",
        ).stdout
    )["evaluation"]
    assert solved["resting_length"] == pytest.approx(0.2)
    assert np.isfinite(solved["force"])
