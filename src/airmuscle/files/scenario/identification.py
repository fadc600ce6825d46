"""Dynamic fit as a TOML file: plant, records as experiments, and unknown parameters;
docs/guides/dynamic-identification.md.
"""

import dataclasses
import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from ...bench.diagnosis import read
from ...bench.dynamics import CrossPrediction, DynamicFit, cross_predict, fit_dynamic
from ...bench.dynamics.experiment import Experiment, InitialValue, make_unknowns, stated_ambient
from ...bench.readers import ColumnMapping, mapping_of_tables, read_mapping
from ...core import ParameterError, ShortRepr, abridged, ambient_pressure
from ...engine.run.problem import check_signal
from ...physics.plant.plant import Plant
from ...recording import Recording
from ..library import build_plant, custom_field, read_toml, scenario_toml
from ..library.files import Location, check_keys, located_errors, read_table, read_text
from . import values
from .initial_state import build_initial_conditions, pressure_names
from .plant_uncertainty import fit_uncertainty
from .values import build_input_signal


def _read_mapping(value: Any, plant: Plant, where: Location) -> ColumnMapping:
    """The mapping of a file, by its name, or of a table."""
    with located_errors(where):
        if isinstance(value, Mapping):
            return mapping_of_tables(value, "mapping")
        if isinstance(value, str):
            return read_mapping(where.folder / value)
    raise ParameterError(
        f"{where} is {abridged(value)}; it must be the name of a mapping file, or a table."
    )


@dataclasses.dataclass(frozen=True)
class RecordTable:
    """One [[record]] of a file."""

    file: str = ""
    start_time: float = custom_field(
        values.Number("s"), "time of the record at which the input begins", default=0.0
    )
    initial_state: Mapping[str, Any] = custom_field(
        read_table, "initial values", default_factory=dict
    )
    first: float = custom_field(
        values.Number("s"), "time of the first row that is used", default=-math.inf
    )
    last: float = custom_field(
        values.Number("s"), "time of the last row that is used", default=math.inf
    )
    mapping: ColumnMapping = custom_field(
        _read_mapping, "what the file does not state", default=ColumnMapping()
    )
    resting_length: float | str | None = None
    ambient: float | str | None = None
    input: Mapping[str, Any] | None = custom_field(read_table, "input of this record", default=None)
    plant: Mapping[str, Any] = custom_field(
        read_table, "parts of the plant that differ", default_factory=dict
    )


Observed = Mapping[str, tuple[float, str]]
"""Standard deviation of the sensor and column of each observed output."""


def build_records(
    tables: Mapping[str, Any],
    shared: Mapping[str, Any],
    plant: Plant,
    observed: Observed,
    location: Location,
    predicted: bool = False,
) -> list[tuple[Experiment, Mapping[str, Any]]]:
    """The experiments of all [[record]] of a file, with their tables [input]."""
    rows = tables.get("record")
    if not isinstance(rows, list) or not rows:
        raise ParameterError(
            f'{location}: no record is given; write [[record]] with file = "fill.csv" for each.'
        )
    return [
        build_experiment(
            row, location.inside(f"record {i}"), shared, plant, observed, predicted=predicted
        )
        for i, row in enumerate(rows, 1)
    ]


def build_experiment(
    table: Any,
    location: Location,
    shared: Mapping[str, Any],
    plant: Plant,
    observed: Observed,
    recording: Recording | None = None,
    predicted: bool = False,
) -> tuple[Experiment, Mapping[str, Any]]:
    """One [[record]] of a file as an experiment, and its table [input].

    shared     tables with the plant and the input of all records
    recording  if it was read before; then the table needs no file
    predicted  whether the record is predicted: its ambient air replaces that of the plant, which
               was found elsewhere
    """
    row: RecordTable = values.table_reader(plant).build(table, location, kind=RecordTable)
    input_table = dict(
        values.optional_table(shared, "input", location) if row.input is None else row.input
    )
    if "file" in input_table:  # absolute, because the table is also written to other folders
        input_table["file"] = str((location.folder / str(input_table["file"])).resolve())
    recording = _read_recording(row, location, observed, plant) if recording is None else recording
    selected = (recording["time"] >= row.first) & (recording["time"] <= row.last)
    if not selected.any():
        raise ParameterError(
            f"{recording.origin}: no row from first, {row.first:g} s, to last, {row.last:g} s."
        )
    recording = recording.rows(selected)
    tables = {**shared["plant"], **row.plant}
    in_plant = location.inside("plant")
    plant = build_plant(tables, in_plant) if row.plant else plant
    stated = {} if predicted else values.optional_table(tables, "ambient", in_plant)
    measured = vars(stated_ambient(recording, plant.ambient))
    ambient = dataclasses.replace(
        plant.ambient, **{n: v for n, v in measured.items() if n not in stated}
    )
    plant = plant if ambient == plant.ambient else dataclasses.replace(plant, ambient=ambient)
    with ambient_pressure(plant.ambient.pressure):
        signal = build_input_signal(input_table, plant.input_variables, location.inside("input"))
        with located_errors(location.inside("input")):
            check_signal(
                plant, signal, 0.0, max(float(recording["time"][-1]) - row.start_time, 1e-9)
            )
        place = location.inside("initial_state")
        conditions = build_initial_conditions(row.initial_state, plant, recording, place)
    return Experiment(recording, signal, conditions, row.start_time, plant), input_table


def _read_recording(
    row: RecordTable, location: Location, observed: Observed, plant: Plant
) -> Recording:
    """The recording of the file, with the observed columns under the names of the outputs."""
    if not row.file.strip():
        raise ParameterError(f"{location}: 'file' is missing; it must be a text in quotes.")
    stated = {"resting_length": row.resting_length, "ambient": row.ambient}
    mapping = mapping_of_tables(stated, f"{location}", row.mapping)
    with located_errors(location):
        runs = read(location.folder / row.file, mapping)
        if len(runs) != 1:
            raise ParameterError(
                f"{row.file} contains {len(runs)} runs; give one file for each record."
            )
        return with_observed(runs[0], observed, plant)


def with_observed(recording: Recording, observed: Observed, plant: Plant) -> Recording:
    """The recording with the observed columns under the names of the outputs [SI]. Raises
    ColumnError, UnitError.
    """
    columns = {
        name: (column, values.signal_unit(name, plant)) for name, (_, column) in observed.items()
    }
    return recording.with_columns(
        **{name: recording.in_unit(*column) for name, column in columns.items()}
    )


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class DynamicFitSetup(ShortRepr):
    """Plant, records and unknowns of a dynamic fit; all numbers SI."""

    title: str
    plant: Plant
    experiments: tuple[Experiment, ...]
    input_tables: tuple[Mapping[str, Any], ...]
    """The table [input] of each record as written in its file, for the scenarios of the result."""
    observed: Observed
    search: values.FitTable
    origin: str = ""
    """Name of the file, for messages."""

    def names_of_unknowns(self) -> list[str]:
        """The names of the estimates of the fit, known before the search."""
        search = self.search
        with located_errors(self.origin or self.title):
            unknowns = make_unknowns(
                self.plant,
                self.experiments,
                search.free,
                search.unknowns(self.plant),
                search.bounds,
            )
        return [unknown.name for unknown in unknowns]

    def fit(self) -> DynamicFit:
        """The result of the fit; see `airmuscle.bench.fit_dynamic`."""
        search, deviations = (
            self.search,
            {name: deviation for name, (deviation, _) in self.observed.items()},
        )
        with located_errors(self.origin or self.title):
            return fit_dynamic(
                self.plant,
                self.experiments,
                free=search.free,
                observed=deviations,
                per_record=search.unknowns(self.plant),
                bounds=search.bounds,
                starts=search.starts,
                seed=search.seed,
                method=search.integrator,
            )

    def cross_predictions(self, fit: DynamicFit) -> tuple[CrossPrediction, ...]:
        """Each record predicted by the common parameters of a fit to the others, searched from the
        joint fit.
        """

        def refit(records: Sequence[int]) -> DynamicFit:
            chosen = tuple(
                dataclasses.replace(self.experiments[i], plant=fit.plant(i)) for i in records
            )
            plant = chosen[0].plant
            assert isinstance(plant, Plant)
            search = dataclasses.replace(self.search, starts=1)
            return dataclasses.replace(self, plant=plant, experiments=chosen, search=search).fit()

        return cross_predict(fit, refit)

    def scenario(
        self, fit: DynamicFit, record: int = 0, cross: Sequence[CrossPrediction] = ()
    ) -> str:
        """Text of a scenario with the fitted plant, the input, the initial state and the duration
        of a record, and the uncertainty of the fit, with the predictions of the records by each
        other."""
        plant = fit.plant(record)
        model = fit.problem.record_models[record]
        assert isinstance(plant, Plant)
        origins = [experiment.recording.origin for experiment in self.experiments]
        note = f"{self.title}: parameters estimated from {', '.join(origins)}."
        known = dict(model.experiment.initial_conditions.known)
        for k in model.unknown_indices:
            if isinstance(what := model.unknowns[k].target, InitialValue):
                known[what.name] = float(fit.values[k])
        stated = {
            name
            for c in plant.mechanism.coordinates
            for name in (c.name, c.speed)
            if c.name in known
        }
        start = {
            name: value
            for name, value in known.items()
            if name in stated or name in pressure_names(plant)
        }
        run = {
            "duration": float(model.times[-1]) - model.start_time(fit.values),
            "initial_state": start,
        }
        observed = {
            name: deviation if column == name else {"deviation": deviation, "column": column}
            for name, (deviation, column) in self.observed.items()
        }
        fitted = {
            "observed": observed,
            "uncertainty": fit_uncertainty(fit, [prediction.rms for prediction in cross]),
        }
        return scenario_toml(
            f"{self.title}, {origins[record]}", plant, self.input_tables[record], run, note, fitted
        )


def load_dynamic_fit(path: str | Path) -> DynamicFitSetup:
    """The dynamic fit in a file. Raises FileError, ParameterError, UnitError, UnknownNameError or
    ColumnError.
    """
    file = Path(path)
    tables = read_toml(file)
    location = Location.of_file(file)
    check_keys(tables, ("title", "plant", "input", "observed", "fit", "record"), location)
    plant = build_plant(values.required_table(tables, "plant", location), location.inside("plant"))
    with ambient_pressure(plant.ambient.pressure):  # that of the texts
        stated = values.required_table(tables, "observed", location)
        observed = values.read_observed(stated, plant, location.at("observed"))
        records = build_records(tables, tables, plant, observed, location)
        table = values.required_table(tables, "fit", location)
        return DynamicFitSetup(
            title=read_text(tables, "title", location, needed=False) or file.stem,
            plant=plant,
            experiments=tuple(experiment for experiment, _ in records),
            input_tables=tuple(table for _, table in records),
            observed=observed,
            search=values.table_reader(plant).build(
                table, location.inside("fit"), kind=values.FitTable
            ),
            origin=str(file),
        )
