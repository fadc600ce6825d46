"""The growth of friction with the load of a bearing is found from episodes: the other joint swings
the link about.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from arm_episodes import known_arm, made_episodes

from airmuscle.bench.estimation import SearchStage
from airmuscle.bench.joint import descent, episodes
from airmuscle.core import tree
from airmuscle.physics import SpatialLink, StickSlip

BEARING = "mechanism.elements[1].bearing_arms[0]"
DRY = "mechanism.elements[1].coulomb_torque"


def swung_arm():
    """A vertical joint, and 0.3 m from it a joint about x whose bearing has a friction arm of 30
    mm; all chosen.
    """
    arm = known_arm(2)
    links = (
        SpatialLink((0, 0, 1), rotor_inertia=0.01, damping=0.1),
        SpatialLink((1, 0, 0), (0.3, 0.0, 0.0), 0.6, (0.0, 0.0, -0.05), 0.01, 0.06, 0.2),
    )
    first, second = arm.mechanism.elements
    elements = (first, StickSlip(0.3, second.load_arms, 0.0, 1.0, 0.005, (0.03,)))
    inner = replace(arm.mechanism.inner, links=links)
    return replace(arm, mechanism=replace(arm.mechanism, inner=inner, elements=elements))


@pytest.mark.parametrize("dry", [0.1, 1.0])
def test_the_search_finds_the_arm_of_the_bearing_from_zero(dry):
    """From too little and from too much dry friction the search ends in the same place, that of the
    arm.
    """
    truth = swung_arm()
    windows = episodes.cut(made_episodes(40, joints=2, arm=truth), 0, 40)
    started = descent.with_values(truth, [BEARING, DRY], [0.0, dry])
    problem = descent.JointProblem(started, windows, 1, (BEARING, DRY))
    arm = problem.search([SearchStage(40, 60, 60)]).arm
    values = {leaf.path: leaf.value for leaf in tree.leaves(arm)}
    assert [values[BEARING], values[DRY]] == pytest.approx([0.03, 0.3], rel=0.15)
    errors = [np.std(descent.joint_errors(each, 1, windows)) for each in (arm, started)]
    assert errors[0] < 0.5 * errors[1]
