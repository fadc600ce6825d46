"""FitPoints: the rows of one or several recordings as the points of static fits."""

import dataclasses
import functools
from collections.abc import Collection, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from ...core import Array, IdentificationError, cite
from ...physics.muscle.characteristic.base import Characteristic, ForceLaw
from ...recording import Recording, resting_length_of
from ..diagnosis import (
    Diagnosis,
    DiagnosisRule,
    Findings,
    RepeatedRows,
    Subject,
    apply_rules,
    examine_recordings,
    find_repeated_rows,
    row_directions,
)
from ..estimation import Censoring, Runs, force_limits, sensor_deviations, specimen_name
from ..inspection import (
    ISOBARIC,
    ISOMETRIC,
    POINT_COLUMNS,
    RELATIVE_BAND,
    find_runs,
    find_static_points,
    level_intervals,
    reading_numbers,
    rounding,
    spread,
)
from .fit_problem import (
    RESTING_LENGTH,
    FitProblem,
    default_censoring,
    fitted_quantity_of,
    make_problem,
    with_length,
)
from .lagging_rows import find_lagging_rows

LEVEL_BAND = 0.1
"""Maximum range of a pressure that counts as constant in a run, as a fraction of its maximum
(chosen).
"""
MIN_ROWS_OF_RUN = 12
"""Minimum number of rows of a run whose constant quantity is replaced by its level (chosen)."""
_MAX_ROWS_OF_POINTS = 2000
"""Maximum number of rows of a recording that is examined for single points first (chosen)."""


def _joined(runs: Sequence[Recording]) -> Recording:
    """The rows of all recordings, with their resting lengths as a column where these differ.

    Raises IdentificationError for an infinite value.
    """
    columns = {}
    if runs:
        columns = {name: np.concatenate([run[name] for run in runs]) for name in POINT_COLUMNS}
    origins = list(dict.fromkeys(run.origin for run in runs))
    named = origins if len(origins) <= 3 else [*origins[:2], f"{len(origins) - 2} more"]
    origin = " + ".join(named) or "no recording"
    for name, values in columns.items():
        if np.isinf(values).any():
            row = int(np.argmax(np.isinf(values)))
            raise IdentificationError(
                f"{origin}, row {row + 1}: {name} is {values[row]}. Remove such rows, for"
                f" example with recording.rows(np.isfinite(recording['{name}']))."
            )
    stated = [resting_length_of(run) for run in runs]
    lengths = {length for length in stated if length is not None}
    if len(lengths) > 1 and None not in stated:
        columns[RESTING_LENGTH] = np.repeat(np.array(stated, dtype=float), list(map(len, runs)))
    constants = {RESTING_LENGTH: lengths.pop()} if len(lengths) == 1 else {}
    return Recording(columns, origin, constants, references=tuple(cite(runs)))


@dataclasses.dataclass(frozen=True, eq=False)
class FitPoints:
    """The points of one or several recordings, for fits of any law; the sensors are estimated once.
    `joined` has all rows of the recordings in order. `missing` is the mask of the rows that are not
    used, because they lack a value, are `repeated` from another recording, or follow a jump of the
    pressure that the force has not yet reached (`find_lagging_rows`)."""

    recordings: tuple[Recording, ...]
    joined: Recording
    missing: npt.NDArray[np.bool_]
    dropped: int
    """Number of rows with a missing value."""
    repeated: tuple[RepeatedRows, ...] = ()
    kept: dict[str, Any] = dataclasses.field(default_factory=dict, init=False, repr=False)
    """What was computed last for one law and all points, which laws with the same population
    share.
    """

    @classmethod
    def from_recordings(cls, recording: Recording | Sequence[Recording]) -> "FitPoints":
        """The points of one or several recordings. Raises IdentificationError for an infinite
        value.
        """
        runs = (recording,) if isinstance(recording, Recording) else tuple(recording)
        joined = _joined(runs)
        missing = np.zeros(len(joined), dtype=bool)
        for name in POINT_COLUMNS if runs else ():
            missing |= np.isnan(joined[name])
        dropped = int(np.count_nonzero(missing))
        repeated = find_repeated_rows(runs, POINT_COLUMNS)
        starts = np.cumsum([0, *map(len, runs)])
        for stretch in repeated:
            start = starts[stretch.recording]
            missing[start + stretch.rows.start : start + stretch.rows.stop] = True
        missing |= find_lagging_rows(runs).joined
        return cls(runs, joined, missing, dropped, repeated)

    @functools.cached_property
    def data(self) -> Recording:
        """The complete rows that are not repeated."""
        return self.joined.rows(~self.missing)

    @functools.cached_property
    def runs(self) -> Runs:
        """The run and the specimen of each complete row."""
        recordings = self.recordings
        is_used = ~self.missing
        lengths = [len(run) for run in recordings]
        names = [specimen_name(run) for run in recordings]
        specimens = np.unique(names, return_inverse=True)[1]
        directions = [row_directions(run) for run in recordings]
        static = all(find_static_points(run) is not None for run in recordings)
        return Runs(
            run=np.repeat(np.arange(len(lengths)), lengths)[is_used],
            specimen=np.repeat(specimens, lengths)[is_used],
            in_time=all("time" in run for run in recordings),
            place=self._places if static else None,
            direction=np.concatenate(directions)[is_used],
        )

    @property
    def _places(self) -> npt.NDArray[np.intp]:
        """The place of each complete row in the order of pressure, contraction and force, in place
        of an order of the rows that has no meaning.
        """
        p, c, f = (reading_numbers(self.data[name]) for name in POINT_COLUMNS)
        places = np.empty(p.size, dtype=np.intp)
        places[np.lexsort((f, c, p))] = np.arange(p.size)
        return places

    @functools.cached_property
    def findings(self) -> Findings:
        """Contradictions, suspicious values and scatter of the recordings. Raises ColumnError for
        those of no muscle.
        """
        return examine_recordings(self.recordings)

    @property
    def diagnoses(self) -> tuple[Diagnosis, ...]:
        """The findings of the rules of recordings and of points."""
        return (*self.findings.diagnoses, *apply_rules(POINT_RULES, self))

    def deviations(self, quantity: str) -> Array | None:
        """The standard deviations of the sensors by recording; None unless they differ."""
        return None if len(self.recordings) < 2 else sensor_deviations(self.recordings, quantity)

    @functools.cached_property
    def at_levels(self) -> Recording:
        """The complete rows of `data`, with every quantity that is constant in a run replaced by
        its level. Its noise and its ripple vary in these rows, and its level in repeated runs, but
        do not show how the muscle depends on it."""
        columns = [_columns_at_levels(run) for run in self.recordings]
        if not any(
            at_level.any() for _, columns_of_run in columns for at_level in columns_of_run.values()
        ):
            return self.data
        levels: dict[str, Array] = {}
        for name in ("pressure", "contraction"):
            values, at_level = (
                np.concatenate([columns_of_run[name] for columns_of_run in part])
                for part in zip(*columns, strict=True)
            )
            distinct, member = np.unique(values[at_level], return_inverse=True)
            merged = distinct.copy()
            band = RELATIVE_BAND * float(np.max(np.abs(distinct), initial=0.0))
            for interval in level_intervals(
                distinct, band
            ):  # those within the band count as the lowest of them
                merged[interval.rows] = distinct[interval.start]
            values[at_level] = merged[member]
            levels[name] = values[~self.missing]
        return self.data.with_columns(**levels)

    def _range_of(self, name: str) -> tuple[float, float]:
        values = self.data[name]
        unit = " Pa" if name == "pressure" else ""
        if float(np.ptp(values)) <= rounding(name, values):
            raise IdentificationError(
                f"{self.data.origin}: {name} is {values[0]:g}{unit} in every row, so a surface"
                f" cannot be fitted. Measure at several levels of {name}.",
                cause=f"{name} does not vary",
            )
        return float(values.min()), float(values.max())

    def problem(
        self,
        characteristic: Characteristic,
        *,
        censoring: Censoring | None = None,
        sigma: npt.ArrayLike | None = None,
        fixed: Collection[str] = (),
    ) -> FitProblem:
        """The problem of fitting a law to these points; arguments as for `fit`. Raises
        IdentificationError.
        """
        law: Any = with_length(characteristic, self.data.constants.get(RESTING_LENGTH))
        if hasattr(law, "with_validity_range") and len(
            self.data
        ):  # a surface is scaled to the range of the data
            law = law.with_validity_range(*map(self._range_of, ("pressure", "contraction")))
        if sigma is None:
            by_recording = self.deviations(fitted_quantity_of(characteristic).name)
            if by_recording is not None:
                sigma = np.repeat(by_recording, [len(run) for run in self.recordings])
        weights = (
            np.ones(len(self.data))
            if sigma is None
            else _row_weights(self.joined, self.missing, sigma)
        )
        if censoring is None:
            censoring = default_censoring(law)
            if isinstance(law, ForceLaw):  # the range that the law and the sensor have in common
                stated = censoring
                sensor = force_limits(self.recordings)
                censoring = Censoring(
                    max(stated.min_force, sensor.min_force), min(stated.max_force, sensor.max_force)
                )
        return make_problem(law, self.data, censoring, weights, fixed)


def _columns_at_levels(
    recording: Recording,
) -> tuple[dict[str, Array], dict[str, npt.NDArray[np.bool_]]]:
    """Pressure and contraction of the rows; that which is constant in a run is replaced by its
    level, in these rows.
    """
    columns = {name: np.array(recording[name], dtype=float) for name in ("pressure", "contraction")}
    at_level = {name: np.zeros(len(recording), dtype=bool) for name in columns}
    if not np.isfinite(recording["pressure"] + recording["contraction"] + recording["force"]).all():
        return columns, at_level
    bands = {
        "pressure": LEVEL_BAND * float(np.max(np.abs(columns["pressure"]), initial=0.0)),
        "contraction": 0.01,
    }
    if not any(_may_be_constant(columns[name], band) for name, band in bands.items()):
        return columns, at_level
    names = {ISOBARIC: "pressure", ISOMETRIC: "contraction"}
    for run in find_runs(recording):
        name = names.get(run.kind)
        rows = run.interval.rows
        if (
            name is not None
            and len(run.interval) >= MIN_ROWS_OF_RUN
            and spread(columns[name][rows]) <= bands[name]
        ):
            columns[name][rows] = np.median(columns[name][rows])
            at_level[name][rows] = True
    return columns, at_level


def _may_be_constant(values: Array, band: float) -> bool:
    """Whether the values, but for one at each end, of some `MIN_ROWS_OF_RUN` consecutive rows fit
    into a band. It is necessary for a run at a level, and quickly answered for single points: up to
    101 rows have at most one value at each end outside the band of 98 %, and longer runs have as
    many rows in succession without any.
    """
    if not MIN_ROWS_OF_RUN <= len(values) <= _MAX_ROWS_OF_POINTS:
        return len(values) > _MAX_ROWS_OF_POINTS
    # Ten rows of twelve are in the band, and so at least four in succession.
    parts = [values[i : len(values) - 3 + i] for i in range(4)]
    near = np.maximum.reduce(parts) - np.minimum.reduce(parts) <= band * (1 + 1e-9)
    if not near.any():
        return False
    ordered = np.sort(np.lib.stride_tricks.sliding_window_view(values, MIN_ROWS_OF_RUN), axis=1)
    return bool((ordered[:, -2] - ordered[:, 1] <= band * (1 + 1e-9)).any())


def _row_weights(data: Recording, dropped: npt.NDArray[np.bool_], sigma: npt.ArrayLike) -> Array:
    """The weights of the rows that are not dropped, with a root mean square of 1."""
    deviations = np.asarray(sigma, dtype=float)
    if deviations.shape not in ((), (1,), (len(data),)):
        raise IdentificationError(
            f"{data.origin}: sigma has the shape {deviations.shape}; give one number, or one for"
            f" each of the {len(data)} rows."
        )
    deviations = np.broadcast_to(deviations, (len(data),))[~dropped]
    if not (np.isfinite(deviations) & (deviations > 0)).all():
        raise IdentificationError(f"{data.origin}: every sigma must be finite and positive.")
    weights = 1.0 / deviations
    return np.asarray(weights / np.sqrt(np.mean(weights**2)))


POINT_RULES = (
    DiagnosisRule(
        "rows that another recording has already",
        Subject.POINTS,
        lambda points: map(str, points.repeated),
        "give each row once",
    ),
    DiagnosisRule(
        "slack rows after a jump of the pressure",
        Subject.POINTS,
        lambda points: find_lagging_rows(points.recordings).notes(),
        "record at a slower change of the pressure",
    ),
)
"""The rules of the points of a fit."""
