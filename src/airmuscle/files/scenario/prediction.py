"""Prediction of further records of an identified plant; a file of records describes runs with an input of their own.

[input]                                     as in a scenario; by default that of the scenario of the plant
fill = [["0.1 s", 1], ["0.8 s", 0]]
[observed]                                  optional: measured outputs, as in a dynamic fit; by default those of the fit
pressure = "500 Pa"
[fit]                                       optional: unknowns that are estimated from each record itself
own = ["circuit.supply.pressure"]
start_time = "50 ms"
initial_state = { pressure = "3 kPa" }
[[record]]                                  as in a dynamic fit
file = "fill3.csv"
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from ...bench.identify.dynamic import Experiment
from ...bench.identify.dynamic.experiment import RecordUnknown
from ...bench.identify.prediction import RecordPrediction, predict_dynamic
from ...core.errors import ColumnError, ParameterError
from ...engine.run import Integrator
from ...recording import Recording
from ...recording.heading import split_unit
from ..library.files import is_path, list_plants, read_toml
from ..library.location import Location, check_keys, located_errors
from ..library.plant_file import plant_tables
from .initial_state import first_value, pressure_names, recorded_pressures
from .record import Record, build_records, with_observed
from .scenario import TABLES, Scenario, build_scenario
from .values import FitTable, optional_table, read_observed, table_reader

PREDICTABLE = ("pressure", "contraction", "length", "position", "angle", "force", "tension")
"""Quantities that are predicted for a plant whose scenario states no observed quantities."""


@dataclasses.dataclass(frozen=True, eq=False)
class PlantModel:
    """An identified plant: its scenario with the tables of its file."""

    scenario: Scenario
    tables: Mapping[str, Any]
    location: Location

    def predict_recording(
        self, recording: Recording, start_time: float = 0.0, own: Sequence[RecordUnknown] = ()
    ) -> RecordPrediction:
        """Predict a recording of a run with the input of the scenario, which begins at `start_time` [s].

        The run begins at the recorded initial pressure, and at the recorded initial values of other states that the
        scenario states. Raises ColumnError for a recording without a predictable quantity, ParameterError otherwise.
        """
        with located_errors(recording.origin):
            recording = self._with_observed(recording)
            names = self.predicted_names(recording)
            row = {"start_time": start_time, "initial_state": self._initial_state(recording)}
        place = Location(recording.origin, "", self.location.folder)
        experiment, _ = Record(row, place, self.tables, self.scenario.plant, recording, True).build_experiment({})
        return self._predict(experiment, {name: self._observed.get(name, (0.0, name))[0] for name in names}, own)

    def predict_file(self, path: Path) -> list[RecordPrediction]:
        """Predict each record of a file of records. Raises FileError, ParameterError, UnitError or ColumnError."""
        tables, location = read_toml(path), Location.of_file(path)
        check_keys(tables, ("title", "input", "observed", "fit", "record"), location)
        plant, table, in_fit = self.scenario.plant, optional_table(tables, "fit", location), location.inside("fit")
        check_keys(table, ("own", "start_time", "initial_state", "integrator"), in_fit)
        fit: FitTable = table_reader(plant).build(table, in_fit, kind=FitTable)
        observed = dict(self._observed)
        if "observed" in tables:
            observed = read_observed(tables["observed"], plant, location.at("observed"))
        if not observed:
            raise ParameterError(
                f"{location}: the scenario of the plant states no observed quantities; give them in [observed]."
            )
        shared = {"plant": self.tables["plant"], "input": self.tables.get("input", {}), **tables}
        deviations = {name: deviation for name, (deviation, _) in observed.items()}
        return [
            self._predict(experiment, deviations, fit.unknowns(plant), fit.integrator)
            for experiment, _ in build_records(tables, shared, plant, observed, location, predicted=True)
        ]

    @property
    def _observed(self) -> Mapping[str, tuple[float, str]]:
        """Deviation, 0 where it is not stated, and column of each quantity that the fit observed."""
        uncertainty = self.scenario.uncertainty
        stated = () if uncertainty is None else uncertainty.deviations
        return {name: (0.0, name) for name in stated} | dict(self.scenario.observed)

    def _with_observed(self, recording: Recording) -> Recording:
        """The recording with those columns of the fit that it has under the names of the outputs."""
        kept = {}
        for name, (deviation, column) in self._observed.items():
            if column in [split_unit(heading)[0] for heading in recording]:
                kept[name] = deviation, column
        return with_observed(recording, kept, self.scenario.plant)

    def predicted_names(self, recording: Recording) -> tuple[str, ...]:
        """The quantities to predict: the recorded ones of the fit, else all of the plant. Raises ColumnError."""
        known = self._observed or [n for kind in PREDICTABLE for n in self._outputs() if n.rpartition(".")[2] == kind]
        names = tuple(name for name in known if name in recording)
        if not names:
            raise ColumnError(f"no column can be predicted; the plant gives {', '.join(known)}.")
        return names

    def _outputs(self) -> Mapping[str, Any]:
        plant = self.scenario.plant
        state = dict(self.scenario.initial_state)
        return {**plant.outputs(state, dict.fromkeys(plant.inputs, 0.0)), **state}

    def _initial_state(self, recording: Recording) -> dict[str, float]:
        """The recorded initial pressures, else those of the scenario, and the other states that it states, at their
        recorded initial values if there are any."""
        plant, outputs, stated = self.scenario.plant, self._outputs(), self.tables["run"].get("initial_state", {})
        pressures = {name: float(outputs[name]) for name in pressure_names(plant)}
        initial = {**pressures, **recorded_pressures(plant, recording)}
        own = [c for coordinate in plant.mechanism.coordinates for c in (coordinate.name, coordinate.speed)]
        for name in own:
            if name in stated:
                initial[name] = first_value(recording, name) if name in recording else float(outputs[name])
        return initial

    def _predict(
        self, experiment: Experiment, observed: Mapping[str, float], own: Sequence[RecordUnknown],
        method: Integrator | None = None,
    ) -> RecordPrediction:  # fmt: skip
        method = method or self.scenario.problem.integrator
        with located_errors(experiment.recording.origin):
            return predict_dynamic(
                self.scenario.plant, experiment, observed, uncertainty=self.scenario.uncertainty, own=own, method=method
            )


def load_plant_model(path: str | Path) -> PlantModel:
    """The identified plant of a scenario file, or of a plant of the library by its name.

    Raises FileError, ParameterError, UnitError or UnknownNameError with the location.
    """
    file = Path(path)
    if str(path) in list_plants() and not is_path(str(path)) and not file.exists():
        tables, location = plant_tables(str(path))
    else:
        tables, location = read_toml(file), Location.of_file(file)
    kept = {key: tables[key] for key in TABLES if key in tables} if "sources" in tables else tables
    scenario = build_scenario(kept, location)
    if "controller" in tables.get("input", {}):
        raise ParameterError(
            f"{location}, [input]: the plant of a prediction has no controller; give the commands that were applied as "
            "[input] of a scenario, as rows or as a file."
        )
    return PlantModel(scenario, tables, location)
