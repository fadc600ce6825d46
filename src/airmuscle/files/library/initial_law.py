"""Initial law of a fit: a library entry, a muscle file, or initial values estimated from the data."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import NamedTuple

from ...bench.identify import standard_candidates
from ...core.errors import HintedText, ParameterError, UnknownNameError, suggestion
from ...physics.muscle.characteristic import Characteristic, ContractileSurface
from ...recording import Recording
from .entry import Entry
from .entry_file import load_law
from .files import is_path
from .models import model_class, model_names
from .scaling import scale_to_length


class InitialLaw(NamedTuple):
    """An entry with the law, and the parameters to keep fixed because they only scale other parameters."""

    entry: Entry
    fixed: tuple[str, ...] = ()


def find_initial_law(
    name: str, recordings: Sequence[Recording], degree: int, option: str = "--characteristic"
) -> InitialLaw:
    """The library entry or muscle file of that name, or the named model with initial values estimated from the data.

    Law and geometry of an entry are scaled to the resting length of the data. Raises ParameterError for a model whose
    initial values cannot be estimated, and for an entry that cannot be scaled.
    """
    if name not in model_names():
        return InitialLaw(_at_length_of(_load_law(name), recordings, f"{option} {name}"))
    cls = model_class(name, option)
    if not issubclass(cls, Characteristic):
        raise ParameterError(f"{option}: {name} is not a characteristic; there are {', '.join(_law_names())}.")
    if issubclass(cls, ContractileSurface):
        return InitialLaw(Entry(name, name, "chosen", cls.guess(recordings, degree)))
    for candidate in standard_candidates(recordings):
        if type(candidate.law) is cls:
            return InitialLaw(Entry(name, name, "chosen", candidate.law), candidate.fixed)
    has_length = all("resting_length" in run.constants for run in recordings)
    length = "" if has_length else " Or give the resting length, which allows more models to be initialised from data."
    raise ParameterError(
        f"{option}: {name} needs initial values, which cannot be estimated from these data. Give a library entry of "
        f"this model (see airmuscle list) or a muscle file with initial values.{length}"
    )


def _law_names() -> tuple[str, ...]:
    return model_names(Characteristic)


def _load_law(name: str) -> Entry:
    """A library entry or muscle file; the error for another name also lists the laws."""
    try:
        return load_law(name)
    except UnknownNameError as error:
        if is_path(name):
            raise
        laws = f" Or name a law: {', '.join(_law_names())}.{suggestion(name, _law_names())}"
        raise UnknownNameError(HintedText(error.message, laws)) from None


def resting_lengths(recordings: Sequence[Recording]) -> tuple[float, ...]:
    """The different resting lengths [m] that the recordings state, in ascending order."""
    stated = (recording.constants.get("resting_length") for recording in recordings)
    return tuple(sorted({float(length) for length in stated if length is not None}))


def _at_length_of(entry: Entry, recordings: Sequence[Recording], where: str) -> Entry:
    """The entry with law and geometry at the resting length of the data, if these state exactly one."""
    lengths = resting_lengths(recordings)
    if len(lengths) != 1:
        return entry
    law = scale_to_length(entry.characteristic, lengths[0], where)
    geometry = None if entry.geometry is None else scale_to_length(entry.geometry, lengths[0], where)
    return dataclasses.replace(entry, characteristic=law, geometry=geometry)
