"""Martens and Boblan 2017 claim errors below 2.35 % (DMSP-20-300) and 4.4 % (DMSP-10-250) of the
maximum force.

On the measured maps of the appendix the errors of the model are 2.37 % and 10.4 N rms (DMSP-20),
and 4.26 % and 8.7 N rms (DMSP-10) without the one point in the dead band; with it 7.4 %. They
depend on the sign of the axial wall force and on the unit of the printed angle.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from airmuscle.core import ops
from airmuscle.files import library
from airmuscle.physics import MartensBoblan2017
from airmuscle.units import degree

ROWS = {"dmsp-20-300": 126, "dmsp-10-250": 85}
ANGLE_CORRECTION = {"dmsp-20-300": -0.073, "dmsp-10-250": -0.1}


def law(name: str) -> MartensBoblan2017:
    return library.load(name).characteristic


def errors(name: str, model: MartensBoblan2017) -> np.ndarray:
    measured = library.load_data(name)
    return model.force(measured["pressure"], measured["contraction"]) - measured["force"]


def percent_of_maximum(name: str, misses: np.ndarray) -> float:
    return 100 * np.abs(misses).max() / library.load_data(name)["force"].max()


@pytest.mark.parametrize(
    ("name", "percent", "rms"), [("dmsp-20-300", 2.37, 10.4), ("dmsp-10-250", 7.4, 8.7)]
)
def test_the_errors_on_the_measured_maps(name: str, percent: float, rms: float):
    misses = errors(name, law(name))
    assert misses.size == ROWS[name]
    assert percent_of_maximum(name, misses) == pytest.approx(percent, abs=0.02)
    assert np.sqrt(np.mean(misses**2)) == pytest.approx(rms, abs=0.05)


def test_without_the_one_point_in_the_dead_band_the_claim_on_the_dmsp_10_is_confirmed():
    misses = errors("dmsp-10-250", law("dmsp-10-250"))
    measured = library.load_data("dmsp-10-250")
    worst = int(np.argmax(np.abs(misses)))
    assert (measured["pressure"][worst], measured["force"][worst]) == (5e4, 0.0)
    rest = percent_of_maximum("dmsp-10-250", np.delete(misses, worst))
    assert rest == pytest.approx(4.26, abs=0.005)
    assert rest < 4.4


def test_the_error_of_the_dmsp_20_exceeds_the_claim_by_two_hundredths_of_a_percent():
    assert (
        2.35 < percent_of_maximum("dmsp-20-300", errors("dmsp-20-300", law("dmsp-20-300"))) < 2.375
    )


@pytest.mark.parametrize(("name", "percent"), [("dmsp-20-300", 15.0), ("dmsp-10-250", 10.0)])
def test_the_axial_wall_force_is_subtracted_although_mechanics_requires_addition(
    name: str, percent: float
):
    model = law(name)
    measured = library.load_data(name)
    length = measured["length"]
    rest = model.geometry.resting_length
    diameter = 2 * model.geometry.radius_at(measured["contraction"])
    along = (
        model.modulus(length) * (length - rest) / rest * model.wall_thickness * ops.pi * diameter
    )
    added = np.maximum(
        model.unclamped_force(measured["pressure"], measured["contraction"]) + 2 * along, 0.0
    )
    assert percent_of_maximum(name, added - measured["force"]) == pytest.approx(percent, abs=0.6)


@pytest.mark.parametrize("name", ROWS)
def test_the_printed_angle_correction_is_in_radians(name: str):
    model = law(name)
    assert model.geometry.braid_angle == pytest.approx(
        28.6 * degree + ANGLE_CORRECTION[name], abs=1e-12
    )
    in_degrees = replace(model.geometry, braid_angle=(28.6 + ANGLE_CORRECTION[name]) * degree)
    assert percent_of_maximum(name, errors(name, replace(model, geometry=in_degrees))) > 15.0
