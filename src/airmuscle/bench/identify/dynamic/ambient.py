"""Ambient air of records: that of their constants, and its agreement with the plants that describe them."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

from ....core.errors import ParameterError
from ....engine.compile import System
from ....physics.pneumatics import Ambient
from ....recording import Recording
from .experiment import Experiment

PRESSURE_TOLERANCE = 1e-3
"""Relative difference of two ambient pressures that is neglected (chosen)."""
TEMPERATURE_TOLERANCE = 1.0
"""Difference of two ambient temperatures that is neglected [K] (chosen)."""
CONSTANTS = {"ambient": "pressure", "ambient_temperature": "temperature"}
"""The constants of a recording by the field of `Ambient`."""


def stated_ambient(recording: Recording, default: Ambient | None = None) -> Ambient:
    """The ambient air of a recording: its constants `ambient` [Pa] and `ambient_temperature` [K].

    What it does not state is that of `default`, by default the standard atmosphere at 20 degC.
    """
    stated = {
        field: float(recording.constants[name]) for name, field in CONSTANTS.items() if name in recording.constants
    }
    return dataclasses.replace(default or Ambient(), **stated)


def check_ambient(plant: System, experiment: Experiment) -> None:
    """Raise ParameterError where a record states another ambient air than its plant has."""
    own = getattr(experiment.plant or plant, "ambient", None)
    if not isinstance(own, Ambient):
        return
    stated, origin = stated_ambient(experiment.recording, own), experiment.recording.origin
    difference = ""
    if abs(stated.pressure - own.pressure) > PRESSURE_TOLERANCE * own.pressure:
        pressures = [f"{each.pressure / 1e3:.4g} kPa" for each in (stated, own)]
        difference = f"an ambient pressure of {pressures[0]}, but its plant has {pressures[1]}"
    elif abs(stated.temperature - own.temperature) > TEMPERATURE_TOLERANCE:
        difference = f"an ambient temperature of {stated.temperature:.4g} K, but its plant has {own.temperature:.4g} K"
    if difference:
        raise ParameterError(
            f"{origin} states {difference}. The mass flow and the heat depend on it: give the plant of this record the "
            "ambient air of the record, Plant(..., ambient=Ambient(...)), or correct the record."
        )


def describe_other_ambient(plant: System, experiment: Experiment) -> list[str]:
    """A note where the plant of an experiment has another ambient air than a plant; empty otherwise."""
    own, other = (getattr(each, "ambient", None) for each in (plant, experiment.plant))
    if own is None or other is None or own == other:
        return []
    texts = [f"{each.pressure / 1e3:.4g} kPa and {each.temperature:.4g} K" for each in (other, own)]
    return [f"the ambient air is that of the record, {texts[0]}; the plant was identified at {texts[1]}"]


def describe_ambient(recordings: Sequence[Recording]) -> list[str]:
    """What is supposed of the ambient air of records that state no pressure, as sentences."""
    silent = [recording.origin for recording in recordings if "ambient" not in recording.constants]
    if not silent:
        return []
    standard = f"{Ambient().pressure / 1e3:.4g} kPa"
    which = "No record states" if len(silent) == len(recordings) else _does_not_state(silent)
    return [
        f"{which} the ambient pressure: {standard} are supposed; an error of 5 % of it changes the heat transfer by "
        "about 20 %."
    ]


def _does_not_state(origins: Sequence[str]) -> str:
    return f"{', '.join(origins)} {'does' if len(origins) == 1 else 'do'} not state"
