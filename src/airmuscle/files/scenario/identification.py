"""Dynamic fit as a TOML file: plant, records, and unknown parameters.

[plant]                                     as in a scenario, with the initial values of the search
[input]                                     as in a scenario; for each record without an input of its own
fill = [["0.1 s", 1], ["1 s", 0]]
[observed]                                  measured outputs, each with the standard deviation of its sensor
pressure = "500 Pa"
position = { deviation = "50 um", column = "height" }      if the column of the file has another name
                                            (in SI, or with its unit, height [mm])
[fit]
free = ["muscle.damper.damping", ["circuit.fill.conductance", "circuit.discharge.conductance"]]
                                            unknowns shared by all records; a nested list has one common value
own = ["circuit.supply.pressure"]           optional: unknowns that are estimated for each record
start_time = "50 ms"                        optional: the start time of each run is unknown within ±50 ms
initial_state = { pressure = "3 kPa" }      optional: initial values are unknown within these limits
starts = 8                                  optional, with seed: number of starting points of the search
integrator = { model = "Rodas4", rtol = 1e-8 }  optional
[fit.bounds]                                optional, by the first path; otherwise the declared bounds
"gas.exponent" = [1.01, 1.4]
[[record]]
file = "fill1.csv"                          relative to this file
initial_state = { pressure = "0 bar" }      optional: equilibrium at this pressure, of each muscle "left.pressure", or
                                            a state with position = "10 mm"; by default equilibrium at the pressures of
                                            the first rows, or where there is none, at their coordinates
start_time = "0.2 s"                        optional: time of the record at which the input begins
first = "0 s"                               optional, and last: the time interval of the record that is used
mapping = "rig.toml"                        optional, and resting_length, ambient: information that the file lacks
[record.input]                              optional: input of this record
[record.plant.mechanism]                    optional: parts of the plant that differ in this record; its ambient air is
                                            that which the file of the record states, unless [plant.ambient] does
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from ...bench.identify.dynamic import CrossPrediction, DynamicFit, Experiment, InitialValue, cross_predict, fit_dynamic
from ...bench.identify.dynamic.experiment import ParameterPaths, RecordUnknown
from ...core.absolute_pressure import ambient_pressure
from ...core.short_repr import ShortRepr
from ...engine.run import Integrator
from ...physics.plant.plant import Plant
from ..library.files import read_toml
from ..library.location import Location, check_keys, located_errors, read_text
from ..library.plant_file import build_plant
from ..library.write import scenario_toml
from .initial_state import pressure_names
from .plant_uncertainty import fit_uncertainty
from .record import build_records
from .values import FitTable, read_observed, required_table, table_reader


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class DynamicFitSetup(ShortRepr):
    """Plant, records and unknowns of a dynamic fit; all numbers SI."""

    title: str
    plant: Plant
    experiments: tuple[Experiment, ...]
    input_tables: tuple[Mapping[str, Any], ...]
    """The table [input] of each record as written in its file, for the scenarios of the result."""
    observed: Mapping[str, float]
    free: tuple[ParameterPaths, ...]
    own: tuple[RecordUnknown, ...] = ()
    bounds: Mapping[str, tuple[float, float]] = dataclasses.field(default_factory=dict)
    starts: int = 1
    seed: int = 0
    method: Integrator | None = None
    columns: Mapping[str, str] = dataclasses.field(default_factory=dict)
    """Measured column of each observed output that has another name."""
    origin: str = ""
    """Name of the file, for messages."""

    def fit(self) -> DynamicFit:
        """The result of the fit; see `airmuscle.bench.fit_dynamic`."""
        with located_errors(self.origin or self.title):
            return fit_dynamic(
                self.plant, self.experiments, free=self.free, observed=self.observed, per_record=self.own,
                bounds=self.bounds, starts=self.starts, seed=self.seed, method=self.method,
            )  # fmt: skip

    def cross_predictions(self, fit: DynamicFit) -> tuple[CrossPrediction, ...]:
        """Each record predicted by the common parameters of a fit to the others, searched from the joint fit."""

        def refit(records: Sequence[int]) -> DynamicFit:
            chosen = tuple(dataclasses.replace(self.experiments[i], plant=fit.plant(i)) for i in records)
            plant = chosen[0].plant
            assert isinstance(plant, Plant)
            return dataclasses.replace(self, plant=plant, experiments=chosen, starts=1).fit()

        return cross_predict(fit, refit)

    def scenario(self, fit: DynamicFit, record: int = 0, cross: Sequence[CrossPrediction] = ()) -> str:
        """Text of a scenario with the fitted plant, the input, the initial state and the duration of a record, and the
        uncertainty of the fit, with the predictions of the records by each other."""
        plant, origin = fit.plant(record), self.experiments[record].recording.origin
        note = f"{self.title}: parameters estimated from {', '.join(e.recording.origin for e in self.experiments)}."
        assert isinstance(plant, Plant)
        record_model = fit.problem.record_models[record]
        known = dict(record_model.experiment.initial_conditions.known)
        for k in record_model.unknown_indices:
            what = record_model.unknowns[k].target
            if isinstance(what, InitialValue):
                known[what.name] = float(fit.values[k])
        coordinates = plant.mechanism.coordinates
        given = {name for c in coordinates for name in (c.name, c.speed) if c.name in known}
        start = {name: value for name, value in known.items() if name in given or name in pressure_names(plant)}
        duration = float(record_model.times[-1]) - record_model.start_time(fit.values)
        run = {"duration": duration, "initial_state": start}
        named = {name: {"deviation": self.observed[name], "column": column} for name, column in self.columns.items()}
        fitted = {
            "observed": {**self.observed, **named},
            "uncertainty": fit_uncertainty(fit, [each.rms for each in cross]),
        }
        return scenario_toml(f"{self.title}, {origin}", plant, self.input_tables[record], run, note, fitted)


def load_dynamic_fit(path: str | Path) -> DynamicFitSetup:
    """The dynamic fit in a file.

    Raises FileError, ParameterError, UnitError, UnknownNameError or ColumnError with the location.
    """
    file = Path(path)
    tables, location = read_toml(file), Location.of_file(file)
    check_keys(tables, ("title", "plant", "input", "observed", "fit", "record"), location)
    plant = build_plant(required_table(tables, "plant", location), location.inside("plant"))
    with ambient_pressure(plant.ambient.pressure):  # that of the texts
        observed = read_observed(required_table(tables, "observed", location), plant, location.at("observed"))
        records = build_records(tables, tables, plant, observed, location)
        table = required_table(tables, "fit", location)
        fit: FitTable = table_reader(plant).build(table, location.inside("fit"), kind=FitTable)
        return DynamicFitSetup(
            title=read_text(tables, "title", location, needed=False) or file.stem,
            plant=plant,
            experiments=tuple(experiment for experiment, _ in records),
            input_tables=tuple(table for _, table in records),
            observed={name: deviation for name, (deviation, _) in observed.items()},
            columns={name: column for name, (_, column) in observed.items() if column != name},
            free=fit.free,
            own=fit.unknowns(plant),
            bounds=fit.bounds,
            starts=fit.starts,
            seed=fit.seed,
            method=fit.integrator,
            origin=str(file),
        )
