"""Static characteristic of a campaign: model selection on rows freed of friction and creep, and its error bands."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence
from concurrent.futures import Executor

from ....core.errors import AirmuscleError
from ....core.short_repr import ShortRepr
from ....physics.muscle import CreepElements
from ....physics.muscle.friction import Friction
from ....recording import Recording
from ..data_checks import DataChecks
from ..model_selection import Comparison, compare
from ..result import Fit
from ..specimen_errors import odd_specimen_notes, ranked_specimen_errors
from .creep_stage import creep_force
from .error_band import ErrorBand, calibrate, calibrate_held
from .friction_stage import friction_along
from .record import CampaignRecord, slow_rows, static_levels
from .rows import LeftOutStage, is_held, thin, with_force

NAME = "static characteristic"
FIT_ROWS, MIN_FIT_ROWS = 1000, 25
"""Maximum number of rows of all records in the static fits, and minimum number of each (chosen)."""


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class StaticStage(ShortRepr):
    """The model selection, the rows of the fits, and the bands of the errors of the recommended law."""

    comparison: Comparison
    points: tuple[Recording, ...]
    """The rows of the fit, freed of friction and creep, one recording for each record."""
    bands: tuple[ErrorBand, ...]
    """One for each purpose that the records can judge."""
    data_notes: tuple[str, ...] = ()
    """Contradictions and suspicious values of the records, and the specimen that does not follow the others."""
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
        return " ".join([self.comparison.reason, *(str(band) for band in self.all_bands), *self.data_notes])

    @property
    def all_bands(self) -> tuple[ErrorBand, ...]:
        """The bands for each purpose, then that for isometric runs."""
        return self.bands if self.held_band is None else (*self.bands, self.held_band)

    def half_width(self, recording: Recording, measured_length: bool = True) -> float:
        """The half width [N] of the band for a recording, at a resting length of the records or at another one."""
        band = self.bands[0] if measured_length else self.bands[-1]
        if self.held_band is None or not is_held(recording):
            return band.half_width
        return max(band.half_width, self.held_band.half_width)


def fit_static_stage(
    records: Sequence[CampaignRecord], friction: Friction, creep: CreepElements, progress: Callable[[float], None],
    executor: Executor | None = None,
) -> StaticStage | LeftOutStage:  # fmt: skip
    """Select and fit the static characteristic to the quasi-static rows of all records.

    The friction and creep forces along the motion of each record are added to the measured force, so that the law is
    that of the muscle without them.
    """
    used = [record for record in records if record.kind.is_static]
    if not used:
        return LeftOutStage(
            NAME,
            "no record is a slow run with force and length",
            "record the force while the length changes slowly at constant pressure, at three pressures or more",
        )
    cleaned = [freed_rows(record, friction, creep) for record in used]
    used = [record for record, rows in zip(used, cleaned, strict=True) if len(rows)]
    cleaned = [rows for rows in cleaned if len(rows)]
    try:
        points = tuple(thin(r, max(FIT_ROWS // len(cleaned), MIN_FIT_ROWS)) for r in cleaned)
        comparison = compare(points, workers=executor or 1, progress=lambda _, fraction: progress(0.9 * fraction))
        fit, parts = comparison.recommended.fit, _parts_at_levels(used, points, friction, creep)
        bands = calibrate(fit, *parts)
        held = calibrate_held(fit, *parts, bands[0])
    except AirmuscleError as error:
        return LeftOutStage(NAME, str(error.message), "measure at more levels of pressure and contraction")
    progress(1.0)
    odd = odd_specimen_notes(ranked_specimen_errors(comparison.recommended, [comparison], points))
    notes = (*DataChecks.of([record.recording for record in used]).notes, *odd)
    return StaticStage(comparison, points, bands, notes, held)


def _parts_at_levels(
    used: Sequence[CampaignRecord], points: Sequence[Recording], friction: Friction, creep: CreepElements
) -> tuple[list[Recording], list[CampaignRecord]]:
    """The rows of the fit and their records, those of static points one for each pressure with tension."""
    parts = []
    for record, rows in zip(used, points, strict=True):
        levels = static_levels(record)
        own = [rows] if len(levels) == 1 else [freed_rows(level, friction, creep) for level in levels]
        parts += [(part, level) for part, level in zip(own, levels, strict=True) if len(part)]
    return [part for part, _ in parts], [level for _, level in parts]


def freed_rows(record: CampaignRecord, friction: Friction, creep: CreepElements) -> Recording:
    """The quasi-static rows with tension of a record, its force freed of friction and creep."""
    recording = record.recording
    if record.resting_length is not None and record.inspection.static_points is None:
        added = creep_force(creep, recording) + friction_along(friction, recording)
        recording = with_force(recording, added)
    sensors = record.inspection.sensors
    rows = slow_rows(record.recording, record.inspection) & (record.recording["force"] > 0.0)
    if "force" in sensors:
        rows &= sensors["force"].censoring(record.recording["force"]) == 0.0
    return recording.rows(rows)
