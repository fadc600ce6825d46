"""A static fit says that its residuals follow two branches where hysteresis is plain, and is silent
otherwise.
"""

from __future__ import annotations

import re

import numpy as np
import pytest

from airmuscle.bench import fit
from airmuscle.bench.statics import blank_surface
from airmuscle.physics import Sarosi2012
from airmuscle.recording import Recording

LAW = Sarosi2012(1.2e-4, 420.0, -57.0, -8.7e-3, 2.7e-3, -310.0)


def runs(gap: float, noise: float = 3.0, fall: int = 60) -> list[Recording]:
    """Isometric runs that inflate in 60 rows and deflate in `fall` rows, with forces that are `gap`
    [N] apart.
    """
    rng = np.random.default_rng(3)
    recordings = []
    for contraction in (0.02, 0.06, 0.10, 0.14):
        pressure = np.concatenate([np.linspace(1e5, 6e5, 60), np.linspace(6e5, 1e5, fall)])
        force = LAW.force(pressure, contraction) + noise * rng.standard_normal(pressure.size)
        force += np.where(np.arange(pressure.size) < 60, -gap / 2, gap / 2)
        columns = {
            "pressure": pressure,
            "contraction": np.full(pressure.size, contraction),
            "force": force,
        }
        recordings.append(Recording(columns, f"run at {contraction:g}"))
    return recordings


def branch_notes(recordings: list[Recording], degree: int = 3) -> list[str]:
    return [
        note for note in fit(blank_surface(degree, 1e4), recordings).notes if "two branches" in note
    ]


def test_two_branches_are_named_with_their_distance_and_the_remedy():
    (note,) = branch_notes(runs(78.0))
    distance = re.search(r"two branches, ([\d.]+) N apart on average", note)
    assert distance is not None
    assert float(distance[1]) == pytest.approx(78.0, abs=3.0)
    assert "that of a lag or filter of a sensor grows with the speed" in note
    assert note.endswith("To identify the friction, use bench.fit_hysteresis.")


def test_noise_and_misfit_are_no_branches():
    assert branch_notes(runs(0.0)) == []
    assert branch_notes(runs(0.0, noise=50.0)) == []
    assert branch_notes(runs(0.0, fall=20), degree=1) == []
    assert branch_notes(runs(2.0, noise=20.0)) == []


def test_the_order_of_a_map_is_no_branch():
    pressure, contraction = (
        g.ravel() for g in np.meshgrid(np.linspace(1e5, 6e5, 12), np.linspace(0.0, 0.15, 8))
    )
    columns = {
        "pressure": pressure,
        "contraction": contraction,
        "force": LAW.force(pressure, contraction),
    }
    assert branch_notes([Recording(columns, "map")], degree=1) == []


def test_missing_times_are_no_branches_and_no_delay():
    timed = [
        run.with_columns(time=np.where(np.arange(len(run)) < 9, np.nan, 0.1 * np.arange(len(run))))
        for run in runs(0.0)
    ]
    assert fit(blank_surface(3, 1e4), timed).notes == fit(blank_surface(3, 1e4), runs(0.0)).notes
