"""Identification of a PressureRegulator from records of its command and of the pressure that it
gives.
"""

import contextlib
import dataclasses
import functools
import math
from collections.abc import Callable, Mapping, Sequence

import numpy as np

from ...core import Array, ColumnError, IdentificationError, ParameterError, tree
from ...engine import Schedule
from ...physics import (
    Isometric,
    Isothermal,
    Muscle,
    Plant,
    PressureRegulator,
    Supply,
    Valve,
    Vessel,
)
from ...recording import Recording
from ...report import Chapter, Table, TableColumn
from ..diagnosis import DataUse, command_response, is_exchanged, support_of_transients
from ..estimation import MAX_RELATIVE_ERROR, SolvedProblem
from ..inspection import EDGE, SAME_READING, analyse_sampling, distinct_readings, rounding
from ..reported import Reported
from .experiment import Experiment, PriorValue
from .fit import fit_dynamic
from .initial_conditions import InitialConditions
from .result import DynamicFit

SETTLED_AFTER = 0.8
"""Time [s] after a change of the command from which a held pressure counts as settled (chosen)."""
FIRST_SPREAD = 0.5
SPREAD = 0.2
PATIENCE = 8
GAINED = 0.999
"""A search starts from the initial regulator times exp(N(0, FIRST_SPREAD^2)); its fit is repeated
from the estimates times exp(N(0, SPREAD^2)), until PATIENCE repetitions in turn have not reduced
the sum of squares below GAINED times the lowest one (chosen): reversals of the valve leave many
local minima."""
PRIOR = math.log(3.0)
"""Standard deviation of the logarithm of each parameter about its initial value (chosen: a factor
of three). A parameter without effect stays at its initial value instead of wherever a search stops;
one with a standard error of 5 % is moved by 0.2 % of its logarithm."""
AT_NOISE = 1.1
"""Residuals relative to the noise at which no further search is needed (chosen)."""
MIN_RANGE = 5.0
"""Minimum range of command and pressure in standard deviations of the noise (chosen)."""
GAIN = 10.0
"""Rate of the outlet pressure by the control error from which a search starts [1/s] (chosen)."""
ZERO_STEPS = 20
ZERO_TOLERANCE = 0.1
"""Maximum number of corrections of the zeros, and mean residual [Pa] at which they end
(chosen).
"""
OFTEN = 0.2
"""Share of the rows in which a command changes that is a recorded voltage, and greatest share of
different readings (chosen).
"""
COMMANDS = {
    "fill.conductance": "a step up of at least half the supply pressure",
    "discharge.conductance": "a step down from near the supply pressure to zero",
    "band": "steps of different sizes, 20 kPa to 100 kPa",
    "pilot_time": "a sine of 2 to 4 Hz with an amplitude of 30 to 100 kPa",
    "overlap": "steps that are reversed after 50 to 200 ms",
    "dead_time": "a step, recorded with at least 200 rows a second",
    "integral_rate": "a step held for 2 s with a leak or a small load of air",
    "sensitivity": "steps of 5 to 10 kPa up and down after 1 s of rest",
    "leak": "sines of 20 kPa at 1 to 8 Hz, which hardly cross the overlap",
}
"""The parameters of a regulator that are fitted, and the command that determines each."""
LIMITS = {
    "sensitivity": (200.0, 2e4),
    "overlap": (0.02, 1.0),
    "pilot_time": (0.01, 0.3),
    "dead_time": (2e-3, 0.1),
}
"""Range of the search [SI] where it is narrower than that of the model (chosen)."""


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class RegulatorFit(Reported):
    """A regulator identified from its records; `print` it.

    `fit` is the dynamic fit of a vessel behind the regulator, `zeros` [Pa] settled pressure minus
    command, subtracted from each record, `remarks` what the records excite too little, with the
    command that would excite it.
    """

    fit: DynamicFit
    zeros: tuple[float, ...]
    remarks: tuple[str, ...]

    @property
    def solved(self) -> SolvedProblem:
        """The problem with the estimates: covariance by records, profiles, bootstrap."""
        return self.fit.solved

    @property
    def plant(self) -> Plant:
        """The vessel behind the regulator with the estimated parameters."""
        plant = self.fit.plant()
        assert isinstance(plant, Plant)
        return plant

    @property
    def regulator(self) -> PressureRegulator:
        """The regulator with the estimated parameters."""
        circuit = self.plant.circuits[0]
        assert isinstance(circuit, PressureRegulator)
        return circuit

    def chapter(self) -> Chapter:
        """The description of the fit: that of the dynamic fit, zeros, and what is too little
        excited.
        """
        chapter = self.fit.chapter()
        zeros = TableColumn(self.zeros, "Pa", "kPa", digits=3)
        title = "Settled pressure minus command, taken as the zero of the sensor"
        names = [model.experiment.recording.origin for model in self.fit.problem.record_models]
        table = Table("zeros", title, {"record": names, "zero": zeros}, brief=len(names))
        notes = (*(f"too little excited: {remark}" for remark in self.remarks), *chapter.notes)
        return dataclasses.replace(
            chapter, title="Pressure regulator", tables=(*chapter.tables, table), notes=notes
        )


Fitted = Callable[[Plant, tuple[float, ...]], RegulatorFit]


def fit_regulator(
    recordings: Sequence[Recording],
    *,
    supply_pressure: float,
    volume: float = 1e-4,
    noise: float = 1e3,
    initial: PressureRegulator | None = None,
    free: Sequence[str] = tuple(COMMANDS),
    starts: int = 8,
    seed: int = 0,
) -> RegulatorFit:
    """Identify a regulator from recordings with the columns `setpoint` and `pressure` [Pa], by
    `fit_dynamic`.

    supply_pressure  gauge pressure of the supply [Pa]
    volume           air volume behind the regulator [m3]; a record determines only conductance over
                     volume, so that an unknown volume may stay at its default (chosen)
    noise            standard deviation of the pressure sensor [Pa]
    initial          regulator from which the search starts, by default from the slopes of the
                     records
    free             the fitted parameters, of `COMMANDS`
    starts, seed     greatest number of searches, and the seed of their initial guesses

    A command holds its value until the next row. What the records do not determine is named with
    the command that would. Raises ColumnError for a missing column, IdentificationError for a
    command or a pressure that does not vary, ParameterError for an unknown parameter.
    """
    unknown = [name for name in free if name not in COMMANDS]
    if unknown or not recordings:
        raise ParameterError(
            "fit_regulator:"
            f" {f'unknown parameter {unknown[0]!r}' if unknown else 'no recording is given'}; give"
            f" recordings with setpoint and pressure, and parameters among {', '.join(COMMANDS)}."
        )
    support_of_transients(recordings, ("pressure",)).check(DataUse.FIT)
    for recording in recordings:
        _check_excitation(recording, noise)
        _check_order(recording)
    zeros = tuple(_settled_difference(recording) for recording in recordings)
    circuit = initial or _initial_regulator(recordings, supply_pressure, volume)
    plant = Plant(Muscle.ideal(Vessel(volume)), circuit, Isometric(0.0), Isothermal())
    paths = tuple(f"circuit.{name}" for name in free)
    prior = {
        leaf.path: PriorValue(leaf.value, PRIOR)
        for leaf in tree.leaves(plant)
        if leaf.path in paths and leaf.value > 0.0
    }
    fitted: Fitted = functools.partial(_fit, recordings, paths, prior, noise)
    fits = []
    for start in range(starts):
        # The guesses of a start do not depend on what the searches before it found.
        rng = np.random.default_rng([seed, start])
        deviations = rng.normal(0.0, FIRST_SPREAD * (start > 0), len(free))
        with contextlib.suppress(IdentificationError):  # a guess that cannot be simulated
            fits.append(
                _refined(fitted(_perturbed(plant, paths, deviations), zeros), paths, fitted, rng)
            )
            if fits[-1].fit.residual_std < AT_NOISE:
                break
    if not fits:
        raise IdentificationError(
            "fit_regulator: no initial guess can be simulated. Give an initial regulator."
        )
    return min(fits, key=lambda candidate: candidate.fit.costs[0])


def _fit(
    recordings: Sequence[Recording],
    paths: tuple[str, ...],
    prior: Mapping[str, PriorValue],
    noise: float,
    plant: Plant,
    zeros: tuple[float, ...],
) -> RegulatorFit:
    records = [
        _experiment(plant, recording, zero)
        for recording, zero in zip(recordings, zeros, strict=True)
    ]
    limits = {
        path: LIMITS[name] for path in paths if (name := path.removeprefix("circuit.")) in LIMITS
    }
    fit = fit_dynamic(
        plant,
        records,
        free=paths,
        observed={"pressure": noise},
        bounds=limits,
        prior=prior,
    )
    weak = [
        e.name for e in fit.estimates if e.on_bound or not e.stderr <= MAX_RELATIVE_ERROR * e.value
    ]
    commands = {name: COMMANDS[name.removeprefix("circuit.")] for name in weak}
    remarks = tuple(
        f"{name} is not determined; give {command}" for name, command in commands.items()
    )
    return RegulatorFit(fit, zeros, remarks)


def _refined(
    best: RegulatorFit, paths: tuple[str, ...], fitted: Fitted, rng: np.random.Generator
) -> RegulatorFit:
    """The best of repetitions, the first of which only corrects the zeros of the sensors by the
    mean residuals, because a regulator may rest anywhere within its sensitivity."""
    failed = 0
    deviations = np.zeros(len(paths))
    while failed < PATIENCE:
        attempt = best
        failed = failed + 1
        with contextlib.suppress(IdentificationError):
            zeros = tuple(map(float, np.subtract(best.zeros, _mean_residuals(best))))
            attempt = fitted(_perturbed(best.plant, paths, deviations), zeros)
        if attempt.fit.costs[0] < best.fit.costs[0]:
            failed = 0 if attempt.fit.costs[0] < GAINED * best.fit.costs[0] else failed
            best = attempt
        deviations = rng.normal(0.0, SPREAD, len(paths))
    return _with_settled_zeros(best, fitted)


def _mean_residuals(result: RegulatorFit) -> Array:
    """The mean residual of each record [Pa]."""
    records = range(len(result.zeros))
    return np.array([np.nanmean(result.fit.residuals(i)["pressure"]) for i in records])


def _with_settled_zeros(result: RegulatorFit, fitted: Fitted) -> RegulatorFit:
    """The fit with the zeros at which the residuals of each record have no mean."""
    change = _mean_residuals(result)
    zeros = np.array(result.zeros)
    for _ in range(ZERO_STEPS):
        if np.abs(change).max() < ZERO_TOLERANCE:
            break
        zeros = zeros - change
        with contextlib.suppress(IdentificationError):
            result = fitted(result.plant, tuple(zeros.tolist()))
        change = _mean_residuals(result)
    return result


def _perturbed(plant: Plant, paths: Sequence[str], deviations: Array) -> Plant:
    """A plant with the parameters of these paths multiplied by exp(deviation), within their
    bounds.
    """
    factors = dict(zip(paths, np.exp(deviations).tolist(), strict=True))
    values = []
    for leaf in tree.leaves(plant):
        low, high = LIMITS.get(leaf.path.removeprefix("circuit."), leaf.declared.bounds)
        factor = factors.get(leaf.path, 1.0)
        values.append(
            float(leaf.value if factor == 1.0 else np.clip(leaf.value * factor, low, high))
        )
    return tree.with_parameters(plant, values)


def _check_excitation(recording: Recording, noise: float) -> None:
    for name in ("setpoint", "pressure"):
        if name not in recording.columns:
            raise ColumnError(
                f"{recording.origin}: no column '{name}'; a regulator is identified from time,"
                f" setpoint and pressure. It has {', '.join(recording.columns)}. Rename one with a"
                " mapping file."
            )
        known = recording[name][np.isfinite(recording[name])]
        change = float(np.ptp(known)) if known.size else 0.0
        if change < MIN_RANGE * noise:
            raise IdentificationError(
                f"{recording.origin}: {name} varies by {change / 1e3:.3g} kPa only, less than"
                f" {MIN_RANGE:g} standard deviations of the noise ({noise / 1e3:g} kPa). Record"
                " steps up and down over the range of use, some of them reversed after 50 to"
                " 200 ms."
            )


def _check_order(recording: Recording) -> None:
    """Raise IdentificationError where the pressure precedes its command: no parameters explain it,
    and the search for them would take minutes.
    """
    response = command_response(recording["time"], recording["setpoint"], recording["pressure"])
    if response is None or not is_exchanged(response, analyse_sampling(recording)):
        return
    raise IdentificationError(
        f"{recording.origin}: the pressure precedes its command by"
        f" {-1e3 * response.delay:.3g} ms: the columns are exchanged, or the command was logged"
        " late. Exchange setpoint and pressure in the headings or in a mapping file."
    )


def _changes(recording: Recording) -> tuple[Array, Array]:
    """Times [s] from the first row and values [Pa] at which the command changes, the first row
    included.
    """
    time = recording["time"] - recording["time"][0]
    setpoint = recording["setpoint"]
    same = _difference_of_commands(setpoint)
    rows = [0]
    for row, value in enumerate(setpoint.tolist()):
        if abs(value - setpoint[rows[-1]]) > same:
            rows.append(row)
    return time[rows], setpoint[rows]


def _difference_of_commands(setpoint: Array) -> float:
    """The difference [Pa] up to which a command is the same: rounding, and one count of a recorded
    voltage, which changes in many rows between few readings.
    """
    least = rounding("pressure", setpoint)
    readings = distinct_readings(setpoint)
    changes = float(np.mean(np.abs(np.diff(setpoint)) > least)) if setpoint.size > 1 else 0.0
    if changes < OFTEN or not 1 < readings.size <= OFTEN * setpoint.size:
        return least
    return (1.0 + SAME_READING) * float(np.diff(readings).min())


def _settled_difference(recording: Recording) -> float:
    """Median of pressure minus command [Pa] over the rows where the command has been held for long;
    0 without any.
    """
    time = recording["time"] - recording["time"][0]
    at, _ = _changes(recording)
    since = time - at[np.searchsorted(at, time, side="right") - 1]
    difference = recording["pressure"] - recording["setpoint"]
    rows = (
        (since >= SETTLED_AFTER * (1.0 - EDGE))
        & (recording["setpoint"] > 0.0)
        & np.isfinite(difference)
    )
    return float(np.median(difference[rows])) if rows.any() else 0.0


def _initial_regulator(
    recordings: Sequence[Recording], supply_pressure: float, volume: float
) -> PressureRegulator:
    """A regulator whose orifices give about the greatest slopes of the records; the rest is
    chosen.
    """
    slopes = np.concatenate([np.gradient(r["pressure"], r["time"]) for r in recordings])
    rise = float(np.nanpercentile(slopes, 99.5))
    fall = -float(np.nanpercentile(slopes, 0.5))
    top = max(float(np.nanmax(r["pressure"])) for r in recordings) + 1e5
    fill = Valve(max(2.0 * volume * rise / (1e5 * (supply_pressure + 1e5)), 1e-12), 0.2)
    discharge = Valve(max(2.0 * volume * fall / (1e5 * top), 1e-12), 0.2)
    supply = Supply(supply_pressure)
    band = 2.0 * rise / GAIN
    return PressureRegulator(supply, fill, discharge, band, 0.04, 0.2, leak=1e-3, integral_rate=0.1)


def _experiment(plant: Plant, recording: Recording, zero: float) -> Experiment:
    times, values = _changes(recording)
    setpoints = np.maximum(values, 0.0)
    points = tuple(zip(times.tolist(), setpoints.tolist(), strict=True))
    command = Schedule({"setpoint": points})
    columns = {**recording.columns, "pressure": recording["pressure"] - zero}
    shifted = Recording(columns, recording.origin)
    level = max(float(recording["setpoint"][0]), 0.0)
    guess = plant.state_at(pressure=level)
    resting = tuple(name for name in guess if name.endswith("_position"))
    known = {name: value for name, value in guess.items() if name not in (*resting, "air_mass")}
    start = InitialConditions({"pressure": level, **known}, guess, resting)
    return Experiment(shifted, command, start, float(recording["time"][0]))
