"""A missing value (NaN) gives a missing value or an error, never a force: max(0, NaN) is NaN, for
numbers as for arrays.
"""

from __future__ import annotations

import math
import warnings

import numpy as np
import pytest

from airmuscle.core import ops
from airmuscle.errors import AirmuscleWarning, PhysicsError
from airmuscle.files import list_laws, load
from airmuscle.physics import Characteristic

NAN = float("nan")


def law_of(name: str) -> Characteristic:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", AirmuscleWarning)
        return load(name).characteristic


@pytest.mark.parametrize("function", [ops.maximum, ops.minimum])
def test_the_larger_and_the_smaller_of_a_value_and_a_missing_one_are_missing(function):
    assert all(math.isnan(function(*pair)) for pair in ((NAN, 0.0), (0.0, NAN), (NAN, NAN)))
    assert np.isnan(function(np.array([NAN]), 0.0)).all()
    assert (function(-0.0, 0.0), function(1.0, 2.0)) == (
        function(np.float64(-0.0), 0.0),
        function(np.float64(1.0), 2.0),
    )


@pytest.mark.parametrize("name", list_laws())
@pytest.mark.parametrize("point", [(NAN, 0.05), (2e5, NAN)])
def test_no_law_gives_a_force_at_a_missing_pressure_or_contraction(
    name: str, point: tuple[float, float]
):
    try:
        force = law_of(name).force(*point)
    except PhysicsError:
        return
    assert math.isnan(force)
