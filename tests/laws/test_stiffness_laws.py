"""Models of one specimen: springs of Reynolds and Serres in N/mm, pressure of Hunt with the
direction of motion.
"""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from airmuscle.errors import ParameterError
from airmuscle.files import library
from airmuscle.physics import Hunt2017, Reynolds2003, Serres2009


def test_a_stiffness_model_requires_the_length_of_its_specimen():
    for law in (Reynolds2003, Serres2009):
        with pytest.raises(TypeError, match="resting_length"):
            law()


@pytest.mark.parametrize("law", [Reynolds2003(0.15), Reynolds2003(0.4)])
def test_the_spring_of_reynolds_is_the_printed_one_for_every_length(law):
    """K = 5.71 + 0.0307 P in N/mm, P in kPa."""
    for kilopascal in (207.0, 620.0):
        stiffness = law.stiffness(kilopascal * 1e3, 0.05) / law.resting_length
        assert stiffness == pytest.approx((5.71 + 0.0307 * kilopascal) * 1e3, rel=1e-12)


def test_the_two_lines_of_serres_intersect_at_the_printed_pressure():
    """32.7 - 0.0321 P up to 314 kPa, 17 + 0.0179 P beyond, in N/mm."""
    law = Serres2009(0.2)
    for kilopascal, expected in (
        (150, 32.7 - 0.0321 * 150),
        (313, 32.7 - 0.0321 * 313),
        (315, 17 + 0.0179 * 315),
    ):
        assert law.stiffness(kilopascal * 1e3, 0.05) / 0.2 == pytest.approx(
            expected * 1e3, rel=1e-12
        )
    assert pytest.approx(314.0) == (32.7 - 17) / (0.0321 + 0.0179)


def test_the_branches_of_hunt_are_31_kilopascal_apart():
    held = Hunt2017(0.17)
    shortening, lengthening = (dataclasses.replace(held, direction=s) for s in (1, -1))
    gap = shortening.pressure(0.1, 50.0) - lengthening.pressure(0.1, 50.0)
    assert gap == pytest.approx(31.2e3)
    assert shortening.force(4e5, 0.1) < held.force(4e5, 0.1) < lengthening.force(4e5, 0.1)
    with pytest.raises(ParameterError, match="direction is 2"):
        Hunt2017(0.17, direction=2)


def test_the_pressure_of_hunt_is_monotone_up_to_its_pole_and_beyond():
    pressure = Hunt2017(0.17).pressure(np.linspace(-0.05, 0.4, 2000), 0.0)
    assert (np.diff(pressure) >= 0).all()
    assert np.isfinite(Hunt2017(0.17).pressure(0.1, np.linspace(0.0, 2000.0, 500))).all()


def test_the_library_marks_secondary_sources_and_chosen_numbers():
    for name in ("hunt2017-festo-10", "reynolds2003", "serres2009"):
        entry = library.load(name)
        assert entry.provenance == "secondary source"
        assert "chosen" in entry.note
