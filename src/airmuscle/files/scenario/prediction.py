"""Prediction of records by an identified plant or the muscle of an entry; docs/guides/prediction.md
has their file.
"""

import dataclasses
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ...bench.campaign import is_held
from ...bench.comparison import law_of_length
from ...bench.dynamics import Experiment, RecordUnknown
from ...bench.estimation import specimen_name, widening
from ...bench.prediction import RecordPrediction, length_notes, predict_dynamic, predict_static
from ...bench.readers.plausibility import CONTRACTION_RANGE
from ...bench.statics.fit_problem import fitted_quantity_of
from ...core import ColumnError, Hint, ParameterError
from ...engine.run import Integrator
from ...physics.muscle.characteristic.base import ForceLaw
from ...physics.muscle.geometry.base import LENGTH_TOLERANCE
from ...recording import Recording
from ..library import Entry, Location, check_keys, located_errors, read_toml, scale_to_length
from .identification import build_experiment, build_records, with_observed
from .initial_state import first_value, pressure_names, recorded_pressures
from .scenario import Scenario, build_scenario, scenario_tables
from .values import FitTable, optional_table, read_observed, table_reader

UNKNOWN = "not known for a specimen that was not measured"
"""Words in place of a band that no specimens left out of the fit give."""
MAX_NAMES = 6
"""Maximum number of measured specimens in a note (chosen)."""
UNUSED_PARTS = ("damper", "wall", "series", "stop")
"""Elements of a muscle that a static prediction leaves out."""
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
        """Predict a recording of a run with the input of the scenario, which begins at `start_time`
        [s].

        The run begins at the recorded initial pressure, and at the recorded initial values of other
        states that the scenario states. Raises ColumnError for a recording without a predictable
        quantity, ParameterError otherwise.
        """
        plant = self.scenario.plant
        state = dict(self.scenario.initial_state)
        observed = self._observed
        outputs = {**plant.outputs(state, dict.fromkeys(plant.inputs, 0.0)), **state}
        with located_errors(recording.origin):
            present = recording.names()
            recorded = {name: column for name, column in observed.items() if column[1] in present}
            recording = with_observed(recording, recorded, plant)
            known = observed or [
                n for kind in PREDICTABLE for n in outputs if n.rpartition(".")[2] == kind
            ]
            names = [name for name in known if name in recording]
            if not names:
                raise ColumnError(
                    f"no column can be predicted; the plant gives {', '.join(known)}."
                )
            pressures = {name: float(outputs[name]) for name in pressure_names(plant)}
            initial = pressures | recorded_pressures(plant, recording)
            stated = self.tables["run"].get("initial_state", {})
            for name in (
                state_name
                for c in plant.mechanism.coordinates
                for state_name in (c.name, c.speed)
                if state_name in stated
            ):
                initial[name] = (
                    first_value(recording, name) if name in recording else float(outputs[name])
                )
        row = {"start_time": start_time, "initial_state": initial}
        place = Location(recording.origin, "", self.location.folder)
        experiment, _ = build_experiment(
            row, place, self.tables, plant, {}, recording, predicted=True
        )
        return self._predict(
            experiment, {name: observed.get(name, (0.0, name))[0] for name in names}, own
        )

    def predict_file(self, path: Path) -> list[RecordPrediction]:
        """Predict each record of a file of records. Raises FileError, ParameterError, UnitError or
        ColumnError.
        """
        tables = read_toml(path)
        location = Location.of_file(path)
        check_keys(tables, ("title", "input", "observed", "fit", "record"), location)
        plant = self.scenario.plant
        table = optional_table(tables, "fit", location)
        in_fit = location.inside("fit")
        check_keys(table, ("own", "start_time", "initial_state", "integrator"), in_fit)
        fit: FitTable = table_reader(plant).build(table, in_fit, kind=FitTable)
        observed = dict(self._observed)
        if "observed" in tables:
            observed = read_observed(tables["observed"], plant, location.at("observed"))
        if not observed:
            raise ParameterError(
                f"{location}: the scenario states no observed quantities; give them in [observed]."
            )
        shared = {"plant": self.tables["plant"], "input": self.tables.get("input", {}), **tables}
        deviations = {name: deviation for name, (deviation, _) in observed.items()}
        return [
            self._predict(experiment, deviations, fit.unknowns(plant), fit.integrator)
            for experiment, _ in build_records(
                tables, shared, plant, observed, location, predicted=True
            )
        ]

    @property
    def _observed(self) -> Mapping[str, tuple[float, str]]:
        """Deviation, 0 where it is not stated, and column of each quantity that the fit
        observed.
        """
        uncertainty = self.scenario.uncertainty
        stated = () if uncertainty is None else uncertainty.deviations
        return {name: (0.0, name) for name in stated} | dict(self.scenario.observed)

    def _predict(
        self,
        experiment: Experiment,
        observed: Mapping[str, float],
        own: Sequence[RecordUnknown],
        method: Integrator | None = None,
    ) -> RecordPrediction:
        scenario = self.scenario
        method = method or scenario.problem.integrator
        with located_errors(experiment.recording.origin):
            return predict_dynamic(
                scenario.plant,
                experiment,
                observed,
                uncertainty=scenario.uncertainty,
                own=own,
                method=method,
            )


def load_plant_model(path: str | Path) -> PlantModel:
    """The identified plant of a scenario file, or of a plant of the library by name. Raises as
    `load_scenario`.
    """
    tables, location = scenario_tables(path)
    scenario = build_scenario(tables, location)
    if "controller" in tables.get("input", {}):
        raise ParameterError(
            f"{location}, [input]: the plant of a prediction has no controller; give the commands"
            " that were applied as [input] of a scenario, as rows or as a file."
        )
    return PlantModel(scenario, tables, location)


def predict_with_entry(entry: Entry, recording: Recording) -> RecordPrediction:
    """Predict a slow record by the law of an entry, its friction and its creep elements, with its
    stated 95 % band.

    Law and geometry are scaled to the resting length that the record states; without one, that of
    the geometry is used. Raises ParameterError for an entry that cannot be scaled or has a spring,
    and ColumnError for a record without pressure, contraction and force, or whose contractions are
    impossible with the resting length of the geometry.
    """
    if entry.spring is not None:
        raise ParameterError(
            f"{entry.name}: a parallel spring is not part of a static prediction. Give a muscle"
            " whose law contains the force of the spring, or a scenario with the muscle."
        )
    stated = recording.constants.get("resting_length")
    length = None if stated is None else float(stated)
    law = law_of_length(entry.characteristic, length, specimen_name(recording))
    notes = []
    differences = []
    if length is None and entry.geometry is not None:
        recording, remarks = _with_resting_length(recording, float(entry.geometry.resting_length))
        notes += remarks
    elif length is not None:
        law = scale_to_length(law, length, f"{recording.origin}, resting length")
    left_out = [part for part in UNUSED_PARTS if getattr(entry, part) is not None]
    if left_out and isinstance(law, ForceLaw):
        notes.append(f"left out of the static prediction: {', '.join(left_out)}")
    entry_length = None if entry.geometry is None else float(entry.geometry.resting_length)
    if (
        entry_length is not None
        and length is not None
        and abs(entry_length - length) > LENGTH_TOLERANCE
    ):
        differences.append("another resting length")
        notes.append(
            f"the law was scaled from {1e3 * entry_length:.4g} mm to {1e3 * length:.4g} mm"
        )
    half, source, remarks = _band(entry, fitted_quantity_of(law).name, recording)
    limits = entry.error_band
    rates = (
        {}
        if limits is None
        else {"contraction": limits.max_contraction_rate, "pressure": limits.max_pressure_rate}
    )
    if any(note.startswith("specimen ") for note in remarks):
        differences.append("another specimen")
    return predict_static(
        law,
        recording,
        friction=entry.friction,
        creep=entry.creep,
        half_width=half,
        validity_range=entry.validity_range,
        rates=rates,
        band=source,
        notes=(*notes, *remarks),
        differences=differences,
    )


def _with_resting_length(recording: Recording, length: float) -> tuple[Recording, list[str]]:
    """The recording with the resting length of the muscle, and a note if its contraction depends on
    it.
    """
    constants = {**recording.constants, "resting_length": length}
    completed = dataclasses.replace(recording, constants=constants)
    if "contraction" in recording or "length" not in recording:
        return completed, []
    what = f"the record states no resting length; with that of the muscle, {1e3 * length:.4g} mm"
    low, high = (float(f(completed["contraction"])) for f in (np.nanmin, np.nanmax))
    if not CONTRACTION_RANGE[0] < low <= high < CONTRACTION_RANGE[1]:
        raise ColumnError(
            f"{recording.origin}: {what}, its contraction is {100 * low:.4g} to {100 * high:.4g} %,"
            " which is impossible.",
            hint=Hint("To state the length", "resting_length", "400 mm"),
        )
    return completed, [f"{what}, its contraction is {100 * low:.4g} to {100 * high:.4g} %"]


def _band(entry: Entry, quantity: str, recording: Recording) -> tuple[float | None, str, list[str]]:
    """The half width of the band of a record [SI], None if it is not known; its source, or why not;
    and notes.
    """
    band = entry.error_band
    if band is None or band.quantity != quantity:
        return None, "", []
    is_static = (
        band.held_half_width is not None and "contraction" in recording and is_held(recording)
    )
    half_width = (band.held_half_width or band.half_width) if is_static else band.half_width
    name = specimen_name(recording)
    length = recording.constants.get("resting_length")
    if not band.specimens or name in band.specimens:
        return half_width, band.source, []
    notes = length_notes(None if length is None else float(length), band.resting_lengths)
    measured = ", ".join(band.specimens[:MAX_NAMES]) + (
        ", ..." if len(band.specimens) > MAX_NAMES else ""
    )
    which = f"specimen {name} was not measured (measured: {measured})"
    if band.new_specimen_half_width is None:
        return None, UNKNOWN, [f"{which}; the band is {UNKNOWN}", *notes]
    new = band.new_specimen_half_width
    if (
        length is not None
        and band.resting_lengths
        and hasattr(entry.characteristic, "with_resting_length")
    ):
        new *= widening(band.resting_lengths, float(length))
    if band.new_specimen_slack_force is not None:
        notes.append(
            "where specimens left out of the fit were slack, the law gave up to"
            f" {band.new_specimen_slack_force:.3g} N: do not rely on smaller forces, and measure"
            " the pressure at which this muscle starts to pull"
        )
    source = f"for a specimen that was not measured: {band.new_specimen_source}"
    return max(new, half_width), source, [f"{which}; the band is that of other specimens", *notes]
