"""Every number that a library file carries as a check comes out of its model, within the tolerance
it states.
"""

from __future__ import annotations

import dataclasses
import warnings

import pytest

from airmuscle.errors import AirmuscleWarning
from airmuscle.files import Entry, library, verify
from airmuscle.files.library import files


def quietly_loaded(name: str) -> Entry:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", AirmuscleWarning)
        return library.load(name)


@pytest.mark.parametrize("name", files.list_laws())
def test_the_checks_of_an_entry_hold(name: str):
    verdicts = verify(quietly_loaded(name))
    assert verdicts, "the file has no [[check]]"
    assert [str(verdict) for verdict in verdicts if not verdict.passes] == []


@pytest.mark.parametrize("name", files.list_laws())
def test_an_entry_says_where_it_is_from(name: str):
    entry = quietly_loaded(name)
    assert (
        entry.references
        or entry.characteristic.references
        or getattr(entry.characteristic, "inner", None)
    )
    assert all(check.source for check in entry.checks)


def test_a_check_fails_when_the_model_changes():
    entry = library.load("dmsp-20-300")
    stiffer = dataclasses.replace(entry.characteristic, c0=entry.characteristic.c0 * 1.1)
    assert not all(
        verdict.passes for verdict in verify(dataclasses.replace(entry, characteristic=stiffer))
    )
