"""A misfit is named with the cause that explains the most of the residuals: the law, a run, the
direction, or the steps of a sensor.

Each laboratory differs from a sound one in one respect, and this cause must come first.
"""

from __future__ import annotations

import dataclasses
import warnings

import numpy as np
import pytest
from laboratories import (
    FORCE,
    MUSCLE,
    PRESSURE,
    RESTING_LENGTH,
    changed,
    ramps,
    sweeps,
    write,
)

from airmuscle.bench import ColumnMapping, compare, fit, read
from airmuscle.bench.statics import blank_surface
from airmuscle.errors import AirmuscleWarning

FRICTIONLESS = dataclasses.replace(MUSCLE, friction=0.0)
FIRST = {
    "the form of the law": (lambda: ramps(FRICTIONLESS), 1),
    "two muscles, or gains, in two groups of runs": (
        lambda: (
            ramps(FRICTIONLESS)
            | {
                f"warm_{name}": table
                for name, table in changed(
                    ramps(FRICTIONLESS, seed=80), FORCE, lambda f: 0.95 * f
                ).items()
            }
        ),
        4,
    ),
    "the steps of the pressure readings": (
        lambda: changed(ramps(FRICTIONLESS), PRESSURE, lambda p: 50.0 * np.round(p / 50.0)),
        4,
    ),
}


def remarks(tables, degree: int, folder):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", AirmuscleWarning)
        runs = read(write(tables, folder), ColumnMapping(resting_length=RESTING_LENGTH))
        return fit(blank_surface(degree, 1e5), runs)


@pytest.mark.parametrize("cause", FIRST)
def test_the_cause_of_a_misfit_comes_first(cause: str, tmp_path):
    tables, degree = FIRST[cause]
    text = str(remarks(tables(), degree, tmp_path).misfit)
    explained = text.partition("squared residuals are explained: ")[2]
    share, _, first = explained.partition(" % by ")
    assert first.startswith(cause), text
    assert float(share) > 50.0
    assert "the law does not follow them" in text or "repeated runs differ" in text
    assert ("No law follows such runs" in text) == (
        cause == "two muscles, or gains, in two groups of runs"
    )


def test_a_law_that_follows_the_data_has_no_misfit(tmp_path):
    for tables in (ramps(), sweeps(), ramps(FRICTIONLESS)):
        found = remarks(tables, 4, tmp_path)
        assert found.misfit is None
        assert not any("does not follow" in note for note in found.notes)


def test_a_comparison_names_the_misfit_of_the_law_it_recommends(tmp_path):
    tables, _ = FIRST["the steps of the pressure readings"]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", AirmuscleWarning)
        runs = read(write(tables(), tmp_path), ColumnMapping(resting_length=RESTING_LENGTH))
        found = compare(runs)
    text = str(found.recommended.fit.misfit)
    assert text in found.reason
    assert "but none follows the data" in found.reason
    assert "steps of the pressure" in text
