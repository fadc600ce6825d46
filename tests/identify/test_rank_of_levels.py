"""The rank of a fit counts what varies beyond the noise and the ripple of a quantity that the test
rig keeps constant.
"""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import airmuscle as am
from airmuscle.bench import fit
from airmuscle.bench.statics import count_levels, fit_points
from airmuscle.errors import IdentificationError
from airmuscle.files import load
from airmuscle.physics import ContractileSurface
from airmuscle.recording import Recording

ROWS = 600
SWEEP = np.concatenate([np.linspace(0.0, 0.2, ROWS // 2), np.linspace(0.2, 0.0, ROWS // 2)])
WHITE = np.random.default_rng(4).normal(0.0, 0.02, ROWS)
SINE = 0.02 * np.sin(np.linspace(0.0, 60.0, ROWS))


def isobar(ripple: np.ndarray, level: float = 3e5) -> Recording:
    pressure = level * (1.0 + ripple)
    force = load("dmsp-20-300").characteristic.force(pressure, SWEEP) + 1.0
    columns = {
        "time": 0.05 * np.arange(ROWS),
        "pressure": pressure,
        "contraction": SWEEP,
        "force": force,
    }
    return Recording(columns, "isobar.csv")


@pytest.mark.parametrize("ripple", [WHITE, SINE], ids=["noise", "sine"])
def test_the_ripple_of_one_isobar_does_not_determine_a_surface(ripple: np.ndarray):
    with pytest.raises(
        IdentificationError,
        match=r"isobar.csv: .*cannot separate .*1 of pressure, \d+ of contraction",
    ):
        fit(ContractileSurface.blank(5), isobar(ripple))


def test_isobars_at_six_levels_with_ripple_determine_a_surface():
    runs = [isobar(SINE, level) for level in np.linspace(1e5, 6e5, 6)]
    assert fit(ContractileSurface.blank(5), runs).rank == 21


def test_the_rank_of_the_library_data_is_complete():
    entry = load("dmsp-20-300")
    result = fit(entry.characteristic, am.load_data("dmsp-20-300"))
    assert result.rank == len(result.estimates)


def test_noise_has_one_level_and_a_grid_has_its_own():
    assert count_levels(3e5 + np.random.default_rng(0).normal(0, 300.0, 244)) == 1
    assert count_levels(np.repeat([0.0, 1e5, 2e5, 3e5], 7)) == 4


@given(st.integers(12, 400), st.integers(0, 10**6))
def test_no_run_within_a_band_is_taken_for_single_points(rows, seed):
    """Among other rows, in the band of 98 % of its own values exactly, with outliers at each
    end.
    """
    random = np.random.default_rng(seed)
    run = random.standard_t(random.integers(1, 5), rows)
    among = np.concatenate([random.normal(0.0, 50.0, 20), run, random.normal(0.0, 50.0, 20)])
    low, high = np.quantile(run, [0.01, 0.99])
    assert fit_points._may_be_constant(run, high - low)
    assert fit_points._may_be_constant(among, high - low)


def test_single_points_are_not_searched_for_runs(monkeypatch):
    """Their rows stay as they are; so are rows of which a search finds no run at a level."""
    random = np.random.default_rng(2)
    columns = {"pressure": random.uniform(0, 6e5, 200), "contraction": random.uniform(0, 0.25, 200)}
    points = Recording({**columns, "force": np.ones(200)}, "points")
    plain, _ = fit_points._columns_at_levels(points)
    assert all((plain[name] == columns[name]).all() for name in columns)
    monkeypatch.setattr(fit_points, "_may_be_constant", lambda *_: True)
    assert all(
        (fit_points._columns_at_levels(points)[0][name] == columns[name]).all() for name in columns
    )
    monkeypatch.undo()
    monkeypatch.setattr(fit_points, "find_runs", lambda _: pytest.fail("a search for runs"))
    fit_points._columns_at_levels(points)


def test_repeated_isobars_have_no_further_levels():
    """Three runs at each of three pressures, a few hundred pascals apart, determine degree 2 and no
    more.
    """
    runs = [
        dataclasses.replace(isobar(np.zeros(ROWS), level + shift), origin=f"{level:g} {shift:g}")
        for level in (2e5, 3.5e5, 5e5)
        for shift in (-400.0, 0.0, 700.0)
    ]
    with pytest.raises(IdentificationError, match="cannot separate"):
        fit(ContractileSurface.blank(5, max_force=1e5), runs)
    assert fit(ContractileSurface.blank(2, max_force=1e5), runs).rank == 6
