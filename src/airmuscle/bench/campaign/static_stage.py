"""Static characteristic of a campaign: model selection on rows freed of friction and creep, its
error bands, and the change of the enclosed volume by virtual work."""

import dataclasses
from collections.abc import Callable, Sequence
from concurrent.futures import Executor
from typing import Any

import numpy as np

from ...core import AirmuscleError, Array, PhysicsError, ShortRepr, counted
from ...physics import ChebyshevGeometry, CreepElements, ForceLaw, Friction
from ...recording import Recording
from ..comparison import (
    Comparison,
    compare,
    force_residuals,
    law_of_length,
    ranked_specimen_errors,
    specimen_notes,
)
from ..diagnosis import examine_recordings, support_of
from ..prediction import creep_force, friction_along
from ..statics import FORCE_MARGIN, Fit, FitPoints, refit
from .record import CampaignRecord, RecordKind, slow_rows, static_levels
from .transient import LeftOutStage, is_held, thin, with_force

LEVEL = 0.95
"""Share of further rows within the band."""
LEVEL_TOLERANCE = 0.03
"""Relative difference of two values that belong to one level (chosen)."""
SHARE_OF_ERROR = 0.25
"""Share of the error of leaving a level out that applies halfway between two levels: the error of
interpolation increases with the square of the distance of the levels, and leaving one out doubles
this distance."""
MIN_GROUPS = 3
"""Minimum number of levels or lengths; the lowest and the highest are in every fit."""


@dataclasses.dataclass(frozen=True)
class ErrorBand:
    """Half width [N] of the band that contains 95 % of the measured forces of rows that were left
    out of the fit.

    The groups are the inner levels or lengths, each left out in turn, so that the law is evaluated
    by interpolation. A quarter of the change of a residual by leaving its level out is added to the
    residual of the complete fit, because levels that are measured later lie at half the distance.
    The band contains the noise of the sensors, the error of the law and that of the friction
    (cross-conformal prediction: Vovk, Ann. Math. Artif. Intell. 74:9 (2015)).
    """

    purpose: str
    half_width: float
    rmse: float
    rows: int
    groups: int

    def __str__(self) -> str:
        source = (
            f"{self.rows} rows of {counted(self.groups, 'group')} left out in turn (rms error"
            f" {self.rmse:.3g} N)."
        )
        if not self.groups:
            source = (
                "the residuals of the fit itself, because there are fewer than three levels; it is"
                " too narrow for other levels."
            )
        return f"95 % band of the force for {self.purpose}: ±{self.half_width:.3g} N, from {source}"


def calibrate(
    fit: Fit, points: Sequence[Recording], records: Sequence[CampaignRecord]
) -> tuple[tuple[ErrorBand, ...], ErrorBand | None]:
    """The band for further runs of the measured muscles, and that for other lengths if there are
    three or more; the band for further isometric runs, which are left out at once, where there are
    some and the others determine the law. A ramp of the pressure at a held length has no friction,
    and another history of creep than a sweep of the length, so that its residuals are of one
    sign."""
    bands = list[ErrorBand]()
    lengths = [run.constants.get("resting_length") for run in points]
    isometric = [("kind", 0) if record.kind is RecordKind.ISOMETRIC else None for record in records]
    for purpose, levels in (
        (
            "further pressures and speeds of the measured muscles",
            [record.level for record in records],
        ),
        (
            "other lengths of the same type",
            [None if x is None else ("resting length", float(x)) for x in lengths],
        ),
    ):
        residuals, groups = _left_out_residuals(fit, points, _inner(levels))
        if groups:  # other lengths are further runs, too
            least = max((band.half_width for band in bands), default=0.0)
            bands.append(_band(purpose, residuals, groups, least))
    if not bands:
        bands.append(
            _band("the rows of the fit", force_residuals(fit.model, points, force_limit(points)), 0)
        )
    residuals, groups = _left_out_residuals(
        fit, points, isometric if None in isometric else (), share=1.0
    )
    isometric_band = (
        _band("further isometric runs", residuals, groups, bands[0].half_width) if groups else None
    )
    return tuple(bands), isometric_band


def force_limit(points: Sequence[Recording]) -> float:
    """Limit [N] of the force of laws that give contraction or pressure."""
    return FORCE_MARGIN * max(float(np.nanmax(run["force"])) for run in points)


def _band(purpose: str, residuals: Array, groups: int, least: float = 0.0) -> ErrorBand:
    """The band of these residuals [N], with a half width of at least `least` [N]."""
    size = residuals.size
    share = min(np.ceil((size + 1) * LEVEL) / size, 1.0)
    quantile = float(np.quantile(np.abs(residuals), share))
    rms = float(np.sqrt(np.mean(residuals**2)))
    return ErrorBand(purpose, max(quantile, least), rms, size, groups)


def _inner(values: Sequence[tuple[str, float] | None]) -> list[tuple[str, int] | None]:
    """The number of the level of each value, counted by quantity; None for the lowest, the highest
    and no level.
    """
    labels: list[tuple[str, int] | None] = [None] * len(values)
    for name in {value[0] for value in values if value is not None}:
        ordered = sorted(
            (value[1], i)
            for i, value in enumerate(values)
            if value is not None and value[0] == name
        )
        levels, places = zip(*ordered, strict=True)
        gaps = np.diff(levels, prepend=levels[0]) > LEVEL_TOLERANCE * (
            np.max(np.abs(levels)) or 1.0
        )
        numbers = np.cumsum(gaps).tolist()
        if numbers[-1] + 1 >= MIN_GROUPS:
            for i, k in zip(places, numbers, strict=True):
                labels[i] = (name, k) if 0 < k < numbers[-1] else None
    return labels


def _left_out_residuals(
    fit: Fit,
    points: Sequence[Recording],
    labels: Sequence[tuple[str, int] | None],
    share: float = SHARE_OF_ERROR,
) -> tuple[Array, int]:
    """The residuals [N] at the rows of each group, with the share of the error without it; and the
    number of groups.
    """
    residuals = [np.zeros(0)]
    count = 0
    max_force = force_limit(points)
    fixed = tuple(
        leaf.path for i, leaf in enumerate(fit.problem.leaves) if i not in set(fit.problem.free)
    )
    for label in dict.fromkeys(label for label in labels if label is not None):
        training = [run for run, group in zip(points, labels, strict=True) if group != label]
        left_out = [run for run, group in zip(points, labels, strict=True) if group == label]
        try:
            model = refit(fit.model, FitPoints.from_recordings(training), fixed=fixed)
        except AirmuscleError:
            continue  # the others do not determine the law, so that this group cannot judge it
        inside = force_residuals(fit.model, left_out, max_force)
        residuals.append(inside + share * (force_residuals(model, left_out, max_force) - inside))
        count += 1
    return np.concatenate(residuals), count


NAME = "static characteristic"
FIT_ROWS = 1000
MIN_FIT_ROWS = 25
"""Maximum number of rows of all records in the static fits, and minimum number of each (chosen)."""


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class StaticStage(ShortRepr):
    """The model selection, the rows of the fits, and the bands of the errors of the recommended
    law.
    """

    comparison: Comparison
    points: tuple[Recording, ...]
    """The rows of the fit, freed of friction and creep, one recording for each record."""
    bands: tuple[ErrorBand, ...]
    """One for each purpose that the records can judge."""
    data_notes: tuple[str, ...] = ()
    """Contradictions and suspicious values of the records, and the specimen that does not follow
    the others; a misfit of the law is in the reason of the comparison.
    """
    held_band: ErrorBand | None = None
    """For further isometric runs, if the records contain some."""

    @property
    def fit(self) -> Fit:
        """The fit of the recommended law."""
        return self.comparison.recommended.fit

    @property
    def band(self) -> ErrorBand:
        """The band for the muscles and the range of the records."""
        return self.bands[0]

    @property
    def verdict(self) -> str:
        """The recommended law, the bands and the remarks on the data, as sentences."""
        return " ".join(
            [self.comparison.reason, *(str(band) for band in self.all_bands), *self.data_notes]
        )

    @property
    def all_bands(self) -> tuple[ErrorBand, ...]:
        """The bands for each purpose, then that for isometric runs."""
        return self.bands if self.held_band is None else (*self.bands, self.held_band)

    def volume_change(self, length: float) -> "VolumeChange | None":
        """The change of the volume of a muscle of a resting length [m] by virtual work; None where
        the law has none.
        """
        law = law_of_length(self.fit.model, length)
        ranges = self.fit.data_ranges
        if not isinstance(law, ForceLaw):
            return None
        return volume_change(law, length, ranges["pressure"], ranges["contraction"])

    def half_width(self, recording: Recording, measured_length: bool = True) -> float:
        """The half width [N] of the band for a recording, at a resting length of the records or at
        another one.
        """
        band = self.bands[0] if measured_length else self.bands[-1]
        if self.held_band is None or not is_held(recording):
            return band.half_width
        return max(band.half_width, self.held_band.half_width)


def fit_static_stage(
    records: Sequence[CampaignRecord],
    friction: Friction,
    creep: CreepElements,
    progress: Callable[[float], None],
    executor: Executor | None = None,
) -> StaticStage | LeftOutStage:
    """Select and fit the static characteristic to the quasi-static rows of all records. The
    friction and creep forces along the motion of each record are added to the measured force, so
    that the law is that of the muscle without them."""
    slow = [record for record in records if record.kind.is_static]
    support = support_of([record.recording for record in slow])
    if support.cause is not None:
        return LeftOutStage(NAME, support.reason, support.cause.remedy)
    cleaned = {record: rows for record in slow if len(rows := freed_rows(record, friction, creep))}
    if not cleaned:
        remedy = (
            "record the force while the length changes slowly at constant pressure, at three"
            " pressures or more"
        )
        reason = (
            "no slow run has a row with tension"
            if slow
            else "no record is a slow run with force and length"
        )
        return LeftOutStage(NAME, reason, remedy)
    used = list(cleaned)
    parts = dict[CampaignRecord, Recording]()
    try:
        points = tuple(
            thin(rows, max(FIT_ROWS // len(used), MIN_FIT_ROWS)) for rows in cleaned.values()
        )
        comparison = compare(
            points, workers=executor or 1, progress=lambda _, fraction: progress(0.9 * fraction)
        )
        for record, rows in zip(
            used, points, strict=True
        ):  # static points are parts of one pressure each
            levels = static_levels(record)
            level_rows = (
                [rows]
                if len(levels) == 1
                else [freed_rows(level, friction, creep) for level in levels]
            )
            parts |= {
                level: part for level, part in zip(levels, level_rows, strict=True) if len(part)
            }
        bands, isometric_band = calibrate(
            comparison.recommended.fit, list(parts.values()), list(parts)
        )
    except AirmuscleError as error:
        return LeftOutStage(
            NAME, str(error.message), "measure at more levels of pressure and contraction"
        )
    progress(1.0)
    of_specimens = specimen_notes(
        ranked_specimen_errors(comparison.recommended, [comparison], points)
    )
    notes = (*examine_recordings([record.recording for record in used]).notes, *of_specimens)
    return StaticStage(comparison, points, bands, notes, isometric_band)


def freed_rows(record: CampaignRecord, friction: Friction, creep: CreepElements) -> Recording:
    """The quasi-static rows with tension of a record, its force freed of friction and creep."""
    measured = record.recording
    sensors = record.inspection.sensors
    rows = slow_rows(measured, record.inspection) & (measured["force"] > 0.0)
    if "force" in sensors:
        rows &= sensors["force"].censoring(measured["force"]) == 0.0
    if record.resting_length is None or record.inspection.static_points is not None:
        return measured.rows(rows)
    return with_force(
        measured, creep_force(creep, measured) + friction_along(friction, measured)
    ).rows(rows)


GRID = 25
MIN_FORCE = 0.02
"""Number of contractions, and of pressures, at which the slope of the force is evaluated, and
minimum force of a point for the slope, as a fraction of the maximum force (chosen)."""
DEGREE = 4
"""Degree of the polynomial of the volume (chosen)."""


@dataclasses.dataclass(frozen=True, eq=False)
class VolumeChange:
    """Change of the enclosed volume [m3] from zero contraction, as a polynomial of the contraction.

    By virtual work the part of the force that is proportional to the pressure is -dV/dL, so that
    V(eps) = V(0) + L0 Int dF/dp deps (Chou and Hannaford, IEEE Trans. Robot. Autom. 12:90 (1996)).
    """

    coefficients: tuple[float, ...]
    """Of the powers of the contraction from 1 on [m3]."""
    resting_length: float
    max_contraction: float
    min_contraction: float = -0.02

    def __call__(self, contraction: Any) -> Any:
        """The change at a contraction, shape of the contraction [m3]."""
        eps = np.asarray(contraction, dtype=float)
        return sum(c * eps**power for power, c in enumerate(self.coefficients, 1))

    def geometry(self, volume_at_rest: float) -> ChebyshevGeometry:
        """The geometry with this volume at zero contraction [m3]."""
        low = self.min_contraction
        high = self.max_contraction
        degree = len(self.coefficients)
        middle = (low + high) / 2
        half = (high - low) / 2
        values = np.polynomial.chebyshev.chebinterpolate(
            lambda x: volume_at_rest + self(middle + half * x), degree
        )
        return ChebyshevGeometry(tuple(values.tolist()), low, high, self.resting_length)


def volume_change(
    law: ForceLaw,
    resting_length: float,
    pressure: tuple[float, float],
    contraction: tuple[float, float],
) -> VolumeChange | None:
    """The change of volume of a muscle with this law in a range of pressure [Pa] and contraction;
    None if the force does not increase with the pressure there."""
    pressures = np.linspace(*pressure, GRID)
    contractions = []
    slopes = []
    greatest = _force(law, np.array([pressure[1]]), max(contraction[0], 0.0))[0]
    for eps in np.linspace(max(contraction[0], 0.0), contraction[1], GRID).tolist():
        force = _force(law, pressures, eps)
        taut = force > MIN_FORCE * greatest
        if np.count_nonzero(taut) >= GRID // 3:
            contractions.append(eps)
            slopes.append(float(np.polyfit(pressures[taut], force[taut], 1)[0]))
    if len(slopes) < DEGREE or not min(slopes) > 0:
        return None
    slope = np.polynomial.polynomial.polyfit(contractions, slopes, DEGREE - 1)
    coefficients = tuple(float(resting_length * c / (k + 1)) for k, c in enumerate(slope))
    return VolumeChange(coefficients, resting_length, contractions[-1])


def _force(law: ForceLaw, pressures: Array, contraction: float) -> Array:
    try:
        return np.asarray(law.force(pressures, np.full(pressures.size, contraction)), dtype=float)
    except PhysicsError:
        return np.zeros(pressures.size)
