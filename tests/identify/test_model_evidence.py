"""Evidence for a larger model: F test, AICc and the number of independent observations, against
their definitions.
"""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.stats import f as fisher

from airmuscle.bench.estimation import aicc, effective_sample_size, f_test_p_value, format_p_value


@pytest.mark.parametrize(
    ("p", "text"),
    [
        (0.0, "p < 0.001"),
        (0.00099, "p < 0.001"),
        (0.001, "p = 0.001"),
        (0.0234, "p = 0.023"),
        (1.0, "p = 1"),
    ],
)
def test_a_small_p_value_has_no_digits(p: float, text: str):
    assert format_p_value(p) == text


def test_the_p_value_is_the_upper_tail_of_fishers_distribution():
    ratio = ((2.0 - 1.5) / 3) / (1.5 / (40 - 7))
    assert f_test_p_value(2.0, 1.5, 40, 7, 3) == pytest.approx(fisher.sf(ratio, 3, 33))
    assert f_test_p_value(2.0, 2.0, 40, 7, 3) == 1.0
    assert f_test_p_value(2.0, 0.0, 40, 7, 3) == 0.0


def test_aicc_is_infinite_without_degrees_of_freedom():
    assert aicc(2.0, 20, 3) == pytest.approx(20 * math.log(2.0) + 8.0 + 40.0 / 15.0)
    assert aicc(2.0, 5, 3) == math.inf
    assert aicc(2.0, 5.01, 3) < math.inf


@pytest.mark.parametrize("correlation", [0.0, 0.5, 0.9])
def test_observations_of_a_first_order_process_count_as_fewer_independent_ones(correlation: float):
    """N (1 - r)/(1 + r), by which the variance of the mean of the process grows."""
    random = np.random.default_rng(0)
    count = 20000
    values = np.zeros(count)
    for i, noise in enumerate(random.standard_normal(count).tolist()):
        values[i] = correlation * values[i - 1] + noise
    assert effective_sample_size(values) == pytest.approx(
        count * (1 - correlation) / (1 + correlation), rel=0.08
    )
