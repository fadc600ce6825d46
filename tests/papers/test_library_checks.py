"""Every check of a library file is reproduced by its model within the stated tolerance."""

from __future__ import annotations

import dataclasses
import warnings

import pytest

from airmuscle.core.errors import AirmuscleWarning
from airmuscle.library import catalogue
from airmuscle.library.verify import verify


def quietly_loaded(name: str) -> catalogue.Entry:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", AirmuscleWarning)
        return catalogue.load(name)


@pytest.mark.parametrize("name", catalogue.list_library())
def test_the_checks_of_an_entry_pass(name: str):
    verdicts = verify(quietly_loaded(name))
    assert verdicts, "the file has no [[check]]"
    assert [str(verdict) for verdict in verdicts if not verdict.holds] == []


@pytest.mark.parametrize("name", catalogue.list_library())
def test_an_entry_states_its_sources(name: str):
    entry = quietly_loaded(name)
    assert entry.references or entry.characteristic.references or getattr(entry.characteristic, "inner", None)
    assert all(check.source for check in entry.checks)


def test_a_check_fails_when_the_model_changes():
    entry = catalogue.load("dmsp-20-300")
    stiffer = dataclasses.replace(entry.characteristic, c0=entry.characteristic.c0 * 1.1)
    assert not all(verdict.holds for verdict in verify(dataclasses.replace(entry, characteristic=stiffer)))
