"""The volume at rest of a campaign: s v_i = V(0) + dV(eps_i), with relative volumes v_i of fills at
several lengths.
"""

from __future__ import annotations

import numpy as np
import pytest

from airmuscle.bench.campaign import VolumeChange, relate_volumes

CONTRACTIONS = np.array([0.0, 0.1, 0.2])
CHANGE = VolumeChange((1.5e-4, -1.2e-4), 0.3, 0.2)
SCALE = 2.0
AT_REST = 1e-4
RELATIVE = (AT_REST + CHANGE(CONTRACTIONS)) / SCALE


def test_exact_volumes_give_the_scale_and_the_volume_at_rest():
    found = relate_volumes(RELATIVE, 1e-3 * RELATIVE, CONTRACTIONS, CHANGE)
    assert (found.scale, found.volume_at_rest) == pytest.approx((SCALE, AT_REST), rel=1e-9)
    assert relate_volumes(RELATIVE, 1e-3 * RELATIVE, CONTRACTIONS / 20, CHANGE) is None


@pytest.mark.parametrize(
    "relative_errors", [(2e-3, 2e-3, 2e-3), (2e-3, 2e-3, 1e-2), (2e-3, 1e-2, 2e-3)]
)
def test_the_standard_errors_are_those_of_repeated_campaigns(relative_errors):
    """Also where one fill is less certain than the others."""
    deviations = np.array(relative_errors) * RELATIVE
    random = np.random.default_rng(1)
    found = [
        relate_volumes(
            RELATIVE + deviations * random.standard_normal(3), deviations, CONTRACTIONS, CHANGE
        )
        for _ in range(1500)
    ]
    for value, error in (("scale", "scale_stderr"), ("volume_at_rest", "volume_stderr")):
        stated = np.median([getattr(each, error) for each in found])
        assert stated == pytest.approx(np.std([getattr(each, value) for each in found]), rel=0.15)
