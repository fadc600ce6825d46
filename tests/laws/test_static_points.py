"""A force map without time is static points: levels of pressure and length, whose order has no
meaning, so that it shows no noise, no saturation and no branches. A sweep without time is none.
"""

from __future__ import annotations

import numpy as np
import pytest

from airmuscle import load_data
from airmuscle.bench import (
    FREE,
    ISOBARIC,
    ISOMETRIC,
    RecordKind,
    StaticStage,
    classify_records,
    find_runs,
    inspect,
)
from airmuscle.bench.campaign import fit_static_stage
from airmuscle.bench.inspection import find_static_points
from airmuscle.physics import CreepElements, NoFriction
from airmuscle.recording import Recording

MAP = load_data("dmsp-20-300")


def grid(pressures, contractions, deviation=0.0, by_pressure=True):
    p, c = (
        each.ravel()
        for each in np.meshgrid(pressures, contractions, indexing="ij" if by_pressure else "xy")
    )
    p = p + np.random.default_rng(0).normal(0.0, deviation, p.size)
    force = np.maximum(2.5e-3 * p * (1.0 - c / 0.3) - 50.0, 0.0)
    return Recording(
        {"pressure": p, "contraction": c, "force": force}, "map", {"resting_length": 0.3}
    )


def test_a_published_force_map_is_recognised_with_its_levels():
    found = inspect(MAP)
    assert found.static_points.description == "126 static points at 21 pressures and 6 lengths"
    assert len(found.runs) == 21
    assert {run.kind for run in found.runs} == {ISOBARIC}
    assert not found.branches
    assert not any(finding.serious for finding in found.findings)
    assert any("66 of them without tension" in finding.text for finding in found.findings)
    for sensor in found.sensors.values():
        assert (sensor.noise, sensor.lower_limit, sensor.upper_limit) == (0.0, -np.inf, np.inf)


@pytest.mark.parametrize("deviation", [0.0, 800.0])
def test_levels_need_not_be_exact(deviation):
    points = find_static_points(grid(np.linspace(1e5, 6e5, 6), np.linspace(0.0, 0.2, 9), deviation))
    assert (points.pressure_level.max() + 1, points.length_level.max() + 1) == (6, 9)


def test_runs_follow_the_order_of_the_rows():
    pressures = np.linspace(1e5, 6e5, 6)
    contractions = np.linspace(0.0, 0.2, 9)
    by_length = grid(pressures, contractions, by_pressure=False)
    assert [run.kind for run in find_runs(by_length)] == [ISOMETRIC] * 9
    shuffled = by_length.rows(np.random.default_rng(1).permutation(54))
    assert [run.kind for run in find_runs(shuffled)] == [FREE]
    assert find_static_points(shuffled) is not None


@pytest.mark.parametrize(
    "columns",
    [
        {"pressure": np.full(60, 3e5), "contraction": np.linspace(0.0, 0.2, 60)},
        {"pressure": np.linspace(0.0, 6e5, 60), "contraction": np.full(60, 0.1)},
        {
            "pressure": np.repeat([2e5, 4e5], 60),
            "contraction": np.tile(np.linspace(0.0, 0.2, 60), 2) + np.repeat([0, 1e-3], 60),
        },
        {"pressure": np.linspace(1e5, 6e5, 60), "contraction": np.linspace(0.0, 0.2, 60)},
        {"pressure": np.array([]), "contraction": np.array([])},
    ],
)
def test_sweeps_and_empty_recordings_are_none(columns):
    assert find_static_points(Recording(columns, "sweep")) is None


def test_a_record_with_time_is_none():
    assert find_static_points(MAP.with_columns(time=np.arange(float(len(MAP))))) is None


def test_a_campaign_uses_a_map_at_its_levels():
    """Each inner pressure is left out in turn for the band of the force."""
    (record,) = classify_records([MAP])
    assert (record.kind, record.reason) == (
        RecordKind.STATIC,
        "126 static points at 21 pressures and 6 lengths",
    )
    few = MAP.rows(np.isin(MAP["pressure"], np.unique(MAP["pressure"])[4::4]))
    stage = fit_static_stage(classify_records([few]), NoFriction(), CreepElements(), lambda _: None)
    assert isinstance(stage, StaticStage)
    assert stage.band.groups >= 2
