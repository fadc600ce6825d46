"""Entry of a muscle, a law or a fit that is written to a muscle file."""

from __future__ import annotations

import dataclasses
from pathlib import Path

from ...bench.identify import Fit
from ...core.annotation import one_line
from ...core.errors import ParameterError
from ...physics.muscle import Muscle
from ...physics.muscle.characteristic.base import Characteristic
from ...physics.plant.plant import Plant
from .entry import OPTIONAL_PARTS, Entry
from .fitted_entry import fitted_entry

Savable = Entry | Fit | Muscle | Characteristic
"""What a muscle file may contain."""


def entry_of(thing: Savable) -> Entry:
    """The entry of a muscle, a law or a fit; an entry itself. Raises ParameterError for anything else."""
    if isinstance(thing, Entry):
        return thing
    if isinstance(thing, Fit):
        return fitted_entry(thing, _of_law(thing.model), [Path(thing.recording.origin)])
    if isinstance(thing, Muscle):
        return _of_muscle(thing)
    if isinstance(thing, Characteristic):
        return _of_law(thing)
    remedy = ""
    if isinstance(thing, Plant):
        remedy = " A plant is written with its run: airmuscle.files.scenario.write.save_scenario(scenario, path)."
    raise ParameterError(
        f"save: {one_line(thing)} is not a muscle, a characteristic, a fit or an entry of the library.{remedy}"
    )


def _of_law(law: Characteristic) -> Entry:
    name = type(law).__name__
    return Entry(name, name, "chosen", law, validity_range=getattr(law, "validity_range", None))


def _of_muscle(muscle: Muscle) -> Entry:
    """The entry with the elements that differ from those of a muscle without any."""
    absent = {field.name: field.default for field in dataclasses.fields(Muscle)}
    parts = {name: getattr(muscle, name) for name in OPTIONAL_PARTS if getattr(muscle, name) != absent[name]}
    return Entry(
        muscle.name, f"{muscle.name}: {type(muscle.contractile).__name__}", "chosen", muscle.contractile,
        muscle.geometry, validity_range=muscle.validity_range, ratings=muscle.ratings, **parts,
    )  # fmt: skip
