"""Checks of columns: codes of missing values, and the contraction with its sign, elongation,
percent and limit.
"""

from collections.abc import Iterator, Sequence

import numpy as np

from ...core import Array, ColumnError, Hint, HintedText, counted
from ...recording.columns import quantity_of
from ...recording.recording import Recording
from ..inspection import estimate_noise
from ..readers import CODES, DropMissing, file_conversion
from .bench_rows import BenchRows, bench_rows, file_list, files_of, limits, recordings_with
from .pressures import REVERSED

MAX_STRETCH = 0.05
"""Maximum elongation by the resting length (chosen)."""
STRETCHED_SHARE = 0.05
"""Minimum share of the rows that pull with a stretched muscle (chosen)."""
FAR_FROM_REST = 0.12
LONG_STROKE = 0.33
"""Least contraction of rows that begin far from the resting length, and contraction beyond which a
braided muscle hardly pulls (chosen: 25 to 30 % of muscles on sale)."""
SMALL_CONTRACTION = 0.01
"""Contraction in percent below which the numbers may be ratios (chosen)."""
NOISE_RANGE = 10.0
"""Range of a held contraction, in standard deviations of its noise (chosen)."""
MAX_DIFFERENCE = 0.02
"""Median difference between the stated contraction and that of the length, up to which they agree
(chosen).
"""
MAX_CONTRACTION = 0.55
"""Greatest contraction at which a pneumatic muscle pulls: pleated muscles without membrane stretch
reach at most 2 (1 - E(1/2)/K(1/2)) = 54.3 %, that of a slender `PleatedTube` at zero force (Daerden
and Lefeber 2001); braided ones at most 1 - 1/(sqrt(3) cos(angle)), 42 % (Chou and Hannaford
1996)."""
PRESSURE_LEVELS = 6
MIN_RISING = 0.8
"""Number of intervals of pressure, and minimum share of those in which the force rises with
contraction (chosen).
"""
MIN_LEVEL_ROWS = 6
MIN_RANGE = 0.02
"""Minimum number of rows and minimum range of the contraction of such an interval (chosen)."""


def check_contraction_signs(recordings: Sequence[Recording]) -> Iterator[str]:
    """A contraction of reversed sign, or that of percent as ratios."""
    measured = recordings_with(recordings, "contraction")
    widest = max((limits(recording["contraction"])[1] for recording in measured), default=0.0)
    for recording in measured:
        low, high = limits(recording["contraction"])
        if low < -MAX_STRETCH and -low > REVERSED * max(high, 0.0):
            yield (
                f"{recording.origin}: the contraction is down to {100 * low:.3g} %, an elongation"
                " that muscles do not bear. The contraction (L0 - L)/L0 of a shortened muscle is"
                " positive: check the resting length, or, if the column is a strain (L - L0)/L0,"
                " multiply it by -1."
            )
            return
        is_held = high - low <= NOISE_RANGE * estimate_noise(recording["contraction"])
        is_small = high - low > 2e-4 and high <= SMALL_CONTRACTION and low > -1e-3
        if (
            recording.units.get("contraction") == "%"
            and is_small
            and not is_held
            and widest <= SMALL_CONTRACTION
        ):
            yield (
                f"{recording.origin}: the contraction changes from {100 * low:.3g} to"
                f" {100 * high:.3g} % only. If these numbers are ratios and not percent, state the"
                " unit '1'."
            )
            return


def check_resting_length(recordings: Sequence[Recording]) -> Iterator[str]:
    """A resting length that the rows that pull contradict: a muscle stretched far beyond it, as
    where the length under pressure was taken for it, or one that begins to shorten far from it and
    pulls beyond its stroke.
    """
    rows = bench_rows(recordings)
    pulling = rows.pulling.contraction
    if pulling.size < MIN_LEVEL_ROWS or not rows.greatest > 0:
        return
    low, high = limits(pulling)
    files = file_list([run.origin for run in recordings_with(recordings, *BenchRows._fields)])
    is_stretched = low < -MAX_STRETCH and np.mean(pulling < -MAX_STRETCH) > STRETCHED_SHARE
    if is_stretched and -low <= REVERSED * max(high, 0.0):
        yield (
            f"{files}: the muscle pulls at contractions down to {100 * low:.3g} %, longer than at"
            " rest. The resting length is that without pressure and load: check it, and that it is"
            " not the length under pressure."
        )
    elif limits(rows.contraction)[0] > FAR_FROM_REST and high > LONG_STROKE:
        yield (
            f"{files}: the muscle pulls at contractions of {100 * low:.3g} to {100 * high:.3g} %,"
            " but was nowhere near its resting length, and a braided muscle hardly pulls beyond"
            f" {100 * LONG_STROKE:.3g} %. Check the resting length."
        )


def check_contraction_limit(recordings: Sequence[Recording]) -> Iterator[str]:
    """A muscle that pulls beyond `MAX_CONTRACTION`. Raises ColumnError where it pulls nowhere
    else.
    """
    measured = recordings_with(recordings, *BenchRows._fields)
    rows = bench_rows(measured)
    pulling = rows.pulling.contraction
    beyond = pulling[pulling > MAX_CONTRACTION]
    if not beyond.size or not rows.greatest > 0:
        return
    low, high = limits(beyond)
    files = file_list(
        [
            recording.origin
            for recording in measured
            if limits(recording["contraction"])[1] > MAX_CONTRACTION
        ]
    )
    text = (
        f"{files}: the muscle pulls at a contraction of {100 * low:.3g} to {100 * high:.3g} %, but"
        f" no pneumatic muscle pulls beyond {100 * MAX_CONTRACTION:.3g} %. Check the units of the"
        " length and of the resting length (a length in cm under a heading in mm?)."
    )
    if limits(pulling)[0] > MAX_CONTRACTION:
        raise ColumnError(text)
    yield text


def check_length_and_contraction(recordings: Sequence[Recording]) -> Iterator[str]:
    """A length and a contraction of one file that contradict each other with the resting length."""
    for recording in recordings:
        rest = recording.constants.get("resting_length")
        if not isinstance(rest, float | int) or not {"length", "contraction"} <= set(
            recording.columns
        ):
            continue
        of_length = (rest - recording["length"]) / rest
        difference = np.abs(of_length - recording["contraction"])
        if float(np.nanmedian(difference)) > MAX_DIFFERENCE:
            row = int(np.nanargmax(difference))
            yield (
                f"{recording.origin}: with the resting length of {1e3 * rest:.4g} mm, the length of"
                f" {1e3 * recording['length'][row]:.4g} mm is a contraction of"
                f" {100 * of_length[row]:.3g} %, but the file states"
                f" {100 * recording['contraction'][row]:.3g} %, which is used. Check the resting"
                " length and the units."
            )


def check_elongation(recordings: Sequence[Recording]) -> Iterator[str]:
    """A force that rises with the contraction at nearly every pressure: the column counts the
    elongation.
    """
    rows = bench_rows(recordings).shortened
    if rows.force.size < MIN_LEVEL_ROWS or not rows.greatest > 0:
        return
    level = np.digitize(
        rows.pressure, np.quantile(rows.pressure, np.linspace(0.0, 1.0, PRESSURE_LEVELS + 1))[1:-1]
    )
    slopes = []  # of the force over the contraction at equal pressure [N], where enough varies
    for part in (rows.at(level == i) for i in range(PRESSURE_LEVELS)):
        if part.force.size >= MIN_LEVEL_ROWS and np.ptp(part.contraction) >= MIN_RANGE:
            scaled = (part.pressure - np.mean(part.pressure)) / max(
                float(np.ptp(part.pressure)), 1.0
            )
            matrix = np.column_stack([np.ones(scaled.size), part.contraction, scaled])
            slopes.append(float(np.linalg.lstsq(matrix, part.force, rcond=None)[0][1]))
    if slopes and np.mean(np.array(slopes) > 0) >= MIN_RISING:
        yield (
            f"{files_of(recordings)}: the force rises with the"
            " contraction at nearly every pressure, but that of a muscle falls. The column"
            " probably counts the elongation, or the displacement from the shortest length: the"
            " contraction (L0 - L)/L0 is 0 at the resting length and grows as the muscle shortens."
        )


MIN_DISTANCE = 0.2
MAX_SHARE = 0.5
"""Minimum distance of a code from other readings, as a fraction of their range; maximum share of
its rows (chosen).
"""


def check_missing_codes(recordings: Sequence[Recording]) -> Iterator[HintedText]:
    """A column whose extreme reading is a code for a missing value, far from all other readings."""
    places_of: dict[tuple[str, float], list[tuple[str, int]]] = {}
    for recording in recordings:
        for name, value, rows in _missing_codes(recording):
            places_of.setdefault((name, value), []).append(
                (recording.origin, int(np.count_nonzero(rows)))
            )
    for (name, value), places in places_of.items():
        number = counted(sum(count for _, count in places), "row")
        yield HintedText(
            f"{file_list([origin for origin, _ in places])}: the {name} is {value:g} in {number},"
            " far from all other readings: this is a code for a missing value, which is read as a"
            " number.",
            Hint("To leave these rows out", "missing", DropMissing((value,)), "ColumnMapping"),
        )


def without_missing_codes(recordings: Sequence[Recording]) -> list[Recording]:
    """The recordings without the rows in which a value is missing."""
    missing = [[rows for _, _, rows in _missing_codes(recording)] for recording in recordings]
    return [
        recording.rows(~np.any(masks, axis=0)) if masks else recording
        for recording, masks in zip(recordings, missing, strict=True)
    ]


def _missing_codes(recording: Recording) -> Iterator[tuple[str, float, Array]]:
    """The known columns with a code for a missing value, the code in the unit of the file, and the
    mask of its rows.
    """
    for name, values in recording.columns.items():
        quantity = quantity_of(name)
        unit = recording.units.get(name)
        known = values[np.isfinite(values)]
        if quantity is None or name.rpartition(".")[2] == "time" or known.size < 3:
            continue
        change = None if unit is None else file_conversion(unit, quantity.unit)
        for extreme in (float(np.min(known)), float(np.max(known))):
            written = (
                extreme if change is None else float((extreme - change.offset) / change.factor)
            )
            readings = known[known != extreme]
            is_code = any(abs(abs(written) - code) <= 1e-6 * code for code in CODES)
            if is_code and readings.size >= (1.0 - MAX_SHARE) * known.size:
                distance = float(np.min(np.abs(readings - extreme)))
                if distance > max(MIN_DISTANCE * float(np.ptp(readings)), 0.0):
                    yield name, written, values == extreme
                    break
