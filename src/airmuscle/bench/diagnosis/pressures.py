"""Checks of pressure and force: absolute pressure in place of gauge, limits, sign and zero of the
force.
"""

import contextlib
from collections.abc import Iterator, Sequence

import numpy as np

from ...core import AMBIENT_PRESSURE, Hint, HintedText, UnitError, conversion
from ...recording.recording import Recording
from . import bench_rows as of_bench
from .bench_rows import (
    BenchRows,
    PressureLine,
    RestLine,
    bench_rows,
    files_of,
    limits,
    pressure_lines,
    recordings_with,
    rest_line,
)

ATMOSPHERE = (95e3, 106e3)
"""Range of the lowest pressure that may be the atmosphere [Pa] (chosen)."""
SET_POINT = 1e5
SET_POINT_TOLERANCE = 20.0
"""A lowest pressure of 1 bar within this tolerance [Pa] is a set point (chosen)."""
MIN_RISE = 50e3
"""Minimum range of the pressure of a run that begins at ambient pressure [Pa] (chosen)."""
NO_PRESSURE = 10e3
"""Lowest pressure of a ramp that begins at zero gauge pressure [Pa] (chosen)."""
SLACK_FORCE = 0.03
"""Maximum force at ambient pressure, as a fraction of the maximum force (chosen)."""
NEAR_REST = 0.02
"""Contraction near the resting length, at which a muscle under pressure pulls (chosen)."""
MAX_PRESSURE = 1e6
"""Highest pressure of pneumatic muscles [Pa] (chosen: makers permit 0.6 to 0.8 MPa)."""
ZERO_FORCE_PRESSURES = (93e3, 130e3)
SMALL_CONTRACTIONS = 0.4
"""Range of the pressures of zero force of isobars that are absolute [Pa], at contractions below
this fraction of the greatest (chosen): from the atmosphere to what the wall adds. Gauge pressures
of zero force begin near 0 and rise."""
MAX_ZERO = 0.012
MAX_ZERO_ERROR = -30e3
"""Maximum reading of a slack muscle or without pressure, as a fraction of the maximum force or
pressure; gauge pressure [Pa] below which a rig draws a vacuum (chosen: the atmosphere at 3000
m)."""
_STATE = Hint("To state the unit", "units", {"pressure": ...}, "ColumnMapping")


def check_lowest_pressures(recordings: Sequence[Recording]) -> Iterator[HintedText]:
    """A lowest pressure of all files that is that of the atmosphere, where the muscle does not
    pull.
    """
    unstated = [
        recording
        for recording in recordings_with(recordings, "pressure")
        if _states_reference(recording) is False
    ]
    if not unstated:
        return
    first = min(unstated, key=lambda recording: float(recording["pressure"].min()))
    lowest = float(first["pressure"].min())
    if not _is_atmosphere(lowest) or not _begins_at_ambient(first, _greatest_force(recordings)):
        return
    yield HintedText(
        f"{first.origin}: the lowest pressure of all files is {lowest / 1e3:.4g} kPa, as that of"
        f" the atmosphere ({AMBIENT_PRESSURE / 1e3:.4g} kPa), and the muscle does not pull there."
        " It is read as gauge pressure, but may be absolute: the unit is then"
        f" '{first.units['pressure']}(a)'.",
        _STATE,
    )


def check_mixed_pressures(recordings: Sequence[Recording]) -> Iterator[HintedText]:
    """Ramps that begin at the atmosphere beside ramps that begin at zero pressure."""
    unstated = [
        recording
        for recording in recordings_with(recordings, "pressure", "force")
        if not _states_reference(recording)
    ]
    ramps = [recording for recording in unstated if np.ptp(recording["pressure"]) > MIN_RISE]
    greatest = _greatest_force(recordings)
    lowest = {id(recording): float(np.min(recording["pressure"])) for recording in ramps}
    absolute = [
        e for e in ramps if _is_atmosphere(lowest[id(e)]) and _begins_at_ambient(e, greatest)
    ]
    gauge = [recording for recording in ramps if abs(lowest[id(recording)]) <= NO_PRESSURE]
    if absolute and gauge:
        yield HintedText(
            f"{files_of(absolute)}: the pressure begins at"
            f" {lowest[id(absolute[0])] / 1e3:.4g} kPa, that of the atmosphere, and the muscle does"
            f" not pull there, but in {files_of(gauge)} it begins at"
            f" {lowest[id(gauge[0])] / 1e3:.3g} kPa: absolute and gauge pressures are mixed. State"
            " the unit of the absolute ones in their headings, 'kPa(a)'."
        )


def check_absolute_isobars(recordings: Sequence[Recording]) -> Iterator[HintedText]:
    """Forces that extrapolate to zero near the atmosphere at every contraction, without a row near
    zero pressure.
    """
    unstated = [
        recording
        for recording in recordings_with(recordings, *BenchRows._fields)
        if not _states_reference(recording)
    ]
    rows = bench_rows(unstated)
    if not rows.force.size or float(np.min(rows.pressure)) < ATMOSPHERE[0]:
        return
    lines = pressure_lines(rows)
    if not lines:
        return
    limit = SMALL_CONTRACTIONS * lines[-1].contraction
    small = [line.zero_force_pressure for line in lines if line.contraction < limit]
    low, high = ZERO_FORCE_PRESSURES
    least = min(line.zero_force_pressure for line in lines)
    at_rest = rest_line(lines)
    if at_rest is not None and low <= at_rest.zero_force_pressure <= high:
        yield HintedText(
            f"{files_of(unstated)}: at zero contraction, where the wall"
            " has no force, the force extrapolates to zero at"
            f" {at_rest.zero_force_pressure / 1e3:.3g} kPa, near the pressure of the atmosphere"
            f" ({AMBIENT_PRESSURE / 1e3:.4g} kPa). The pressures are probably absolute, but read as"
            " gauge.",
            _STATE,
        )
    elif len(small) > 1 and low <= least and max(small) <= high:
        yield HintedText(
            f"{files_of(unstated)}: the force extrapolates to zero at"
            f" {least / 1e3:.3g} kPa or more at every contraction, {max(small) / 1e3:.3g} kPa or"
            " less at small ones, near the pressure of the atmosphere"
            f" ({AMBIENT_PRESSURE / 1e3:.4g} kPa). The pressures are probably absolute, but read as"
            " gauge.",
            _STATE,
        )


def check_pressure_zero(recordings: Sequence[Recording]) -> Iterator[HintedText]:
    """A lowest pressure, but for two glitches, below that of the atmosphere, by less than the
    vacuum of a rig.
    """
    measured = [
        recording for recording in recordings_with(recordings, "pressure") if len(recording) > 2
    ]
    lowest, origin = min(
        ((float(np.sort(recording["pressure"])[2]), recording.origin) for recording in measured),
        default=(0.0, ""),
    )
    if MAX_ZERO_ERROR < lowest < -MAX_ZERO * _highest_pressure(measured)[0]:
        yield HintedText(
            f"{origin}: the gauge pressure is down to {lowest / 1e3:.3g} kPa. Unless the rig draws"
            " a vacuum, the zero of the pressure sensor is wrong, and all pressures by the same"
            " amount, or the ambient pressure of absolute readings.",
            Hint("To state the ambient pressure", "ambient", ..., "ColumnMapping"),
        )


def check_pressure_limit(recordings: Sequence[Recording]) -> Iterator[str]:
    """A pressure above that of pneumatic muscles."""
    highest, origin = _highest_pressure(recordings)
    if highest > MAX_PRESSURE:
        yield (
            f"{origin}: the pressure is up to {highest / 1e3:.4g} kPa, above {MAX_PRESSURE / 1e3:g}"
            " kPa, the highest of pneumatic muscles. Check its unit, and that the columns of"
            " pressure and force are not exchanged."
        )


def _highest_pressure(recordings: Sequence[Recording]) -> tuple[float, str]:
    """The highest pressure [Pa] of all recordings and its file; 0 without any."""
    pressures = [
        (float(np.nanmax(recording["pressure"])), recording.origin)
        for recording in recordings_with(recordings, "pressure")
    ]
    return max(pressures, default=(0.0, ""))


def _greatest_force(recordings: Sequence[Recording]) -> float:
    return max(
        (limits(recording["force"])[1] for recording in recordings_with(recordings, "force")),
        default=0.0,
    )


def _is_atmosphere(lowest: float) -> bool:
    """Whether a lowest pressure [Pa] may be that of the atmosphere; 1 bar is a set point."""
    return (
        ATMOSPHERE[0] <= lowest <= ATMOSPHERE[1] and abs(lowest - SET_POINT) > SET_POINT_TOLERANCE
    )


def _begins_at_ambient(recording: Recording, greatest: float) -> bool:
    """Whether the muscle does not pull at the lowest pressure: at the start of a rise, or near its
    resting length.
    """
    low, high = limits(recording["pressure"])
    rows = recording["pressure"] <= float(np.nanmin(recording["pressure"])) + 3e3
    if "force" not in recording:
        return high - low > MIN_RISE
    slack = np.abs(recording["force"]) <= SLACK_FORCE * greatest
    if high - low > MIN_RISE:
        return bool(slack[rows].all())
    near_rest = (
        rows & (np.abs(recording["contraction"]) < NEAR_REST)
        if "contraction" in recording
        else rows & False
    )
    return bool(near_rest.any() and slack[near_rest].all())


def _states_reference(recording: Recording) -> bool | None:
    """Whether the file states an absolute or a gauge pressure, which leaves no doubt; None for
    arrays.
    """
    unit = recording.units.get("pressure")
    with contextlib.suppress(UnitError):
        return None if unit is None else not conversion(unit, "Pa").assumed_gauge
    return True


MAX_OFFSET = 0.05
"""Maximum negative force, as a fraction of the maximum force (chosen): a muscle cannot push."""
REVERSED = 3.0
"""Ratio of negative to positive values from which a sign is taken for reversed (chosen)."""
COMPRESSED = 0.3
"""Range of the forces at zero pressure, as a fraction of the lowest force, above which they are no
offset (chosen).
"""
BORES = (5e-3, 80e-3)
"""Range of the inner diameters of pneumatic muscles [m] (chosen: 5 to 40 mm of those on sale)."""
RATED_FORCE = 8.0
"""Force of a muscle near its resting length, over pressure times the area of its bore (chosen: 8.0
of the rated forces of DMSP-20 and -40 at 600 kPa, 13 of DMSP-10)."""
USUAL_BORE = 40e-3
USUAL_PRESSURE = 150e3
"""Largest bore on sale, and highest pressure of an experiment [Pa] below which a larger one is
unlikely (chosen: makers permit 600 to 800 kPa)."""
MIN_REACH = 0.04
"""Ratio of the force of a muscle that was measured only far from its resting length to that near it
(chosen)."""
NEAR_RATED = 0.08
"""Contraction up to which the force is comparable to the rated one (chosen)."""


def check_force_signs(recordings: Sequence[Recording]) -> Iterator[str]:
    """A force that is negative where the muscle pulls, or that states a pushing muscle."""
    forces = {
        recording.origin: limits(recording["force"])
        for recording in recordings_with(recordings, "force")
    }
    size = max((abs(value) for pair in forces.values() for value in pair), default=0.0)
    greatest = max((high for _, high in forces.values()), default=0.0)
    for origin, (low, high) in forces.items():
        if low < -MAX_OFFSET * size and -low > REVERSED * max(high, 0.0):
            yield (
                f"{origin}: the force is negative, down to {low:.4g} N. The force of a muscle in"
                " tension is positive, and negative rows count as slack: if the sensor counts"
                " tension as negative, multiply the column by -1."
            )
            return
    origin, (low, _) = min(forces.items(), key=lambda item: item[1][0], default=("", (0.0, 0.0)))
    slack = bench_rows(recordings).slack.force
    compressed = (
        slack.size and np.ptp(slack) > COMPRESSED * -low
    )  # the forces vary with the length at zero pressure
    if low < -MAX_OFFSET * greatest and not compressed:
        yield (
            f"{origin}: the force is down to {low:.4g} N, but a muscle cannot push. The sensor has"
            " an offset, or carries a weight: all forces are then wrong by the same amount."
            " Subtract the reading of the slack muscle."
        )


def check_force_area(recordings: Sequence[Recording]) -> Iterator[str]:
    """A maximum force that no bore of a muscle explains at the highest pressure, or only a bore
    beyond those on sale at an unusually low pressure.
    """
    measured = recordings_with(recordings, "pressure", "force")
    greatest = _greatest_force(measured)
    highest, _ = _highest_pressure(recordings)
    varied = any(
        np.nanmax(recording["pressure"]) - np.nanmin(recording["pressure"]) > 0.1 * highest
        for recording in measured
    )
    if greatest <= 0 or highest <= 0 or (highest < 1e3 and not varied):
        return
    bore = float(np.sqrt(4.0 / np.pi * greatest / (RATED_FORCE * highest)))
    least, largest = BORES
    if not _reaches_rest(measured):
        least *= float(np.sqrt(MIN_REACH))
    is_unlikely = bore > USUAL_BORE and highest < USUAL_PRESSURE
    if least <= bore <= largest and not is_unlikely:
        return
    range_text = f"allowed range: {1e3 * BORES[0]:g} to {1e3 * BORES[1]:g} mm"
    if is_unlikely and bore <= largest:
        range_text = f"on sale: up to {1e3 * USUAL_BORE:g} mm, for 600 to 800 kPa"
    yield (
        f"the maximum force, {greatest:.4g} N, at the highest pressure, {highest / 1e3:.4g} kPa, is"
        f" that of a muscle with a bore of {1e3 * bore:.2g} mm ({range_text}). The unit of force or"
        " pressure is probably wrong."
    )


def _reaches_rest(recordings: Sequence[Recording]) -> bool:
    """Whether the force was measured near the resting length, or at lengths that are not known."""
    lengths = recordings_with(recordings, "contraction")
    return (
        not lengths
        or min(limits(recording["contraction"])[0] for recording in lengths) < NEAR_RATED
    )


MAX_EXTRAPOLATED = 0.015
"""Maximum force extrapolated to zero pressure, as a fraction of the maximum force (chosen)."""
MIN_ROWS = 3
"""Minimum number of rows without pressure (chosen)."""
_REMEDY = "Subtract the reading of the slack muscle from the column, or measure it."


def check_force_zero(recordings: Sequence[Recording]) -> Iterator[str]:
    """A sensor that reads a force where a muscle is slack, or the same negative force at several
    lengths of it: at zero pressure, measured there or extrapolated to it, and where the force of an
    isobar does not change with the length.

    The force at zero gauge pressure is at most 0 at each contraction: the wall resists contraction
    and does not pull (Chou and Hannaford, IEEE Trans. Robot. Autom. 12 (1996), with elastic wall:
    Tondu and Lopez 2000).
    """
    measured = recordings_with(recordings, *BenchRows._fields)
    rows = bench_rows(measured)
    if not rows.force.size or not rows.greatest > 0:
        return
    places = {"at zero pressure and shortened length": rows.slack}
    places["over a range of contractions at constant pressure"] = of_bench.slack_plateaus(measured)
    for place, slack in places.items():
        reading = float(np.median(slack.force)) if slack.force.size >= MIN_ROWS else 0.0
        low = -MAX_OFFSET * rows.greatest <= reading < -MAX_ZERO * rows.greatest and _is_constant(
            slack
        )
        if reading > MAX_ZERO * rows.greatest or low:
            yield (
                f"{files_of(measured)}: the force is {reading:.3g} N"
                f" {place}, where a muscle is slack: the zero of the force sensor is wrong, and all"
                f" forces by the same amount. {_REMEDY}"
            )
            return
    if rows.slack.force.size >= MIN_ROWS:
        return
    lines: list[PressureLine | RestLine] = [*pressure_lines(rows)]
    at_rest = rest_line(pressure_lines(rows))
    lines += [] if at_rest is None else [at_rest]
    offset = max(
        (line.intercept for line in lines if line.intercept > 3.0 * line.error), default=0.0
    )
    if offset > MAX_EXTRAPOLATED * rows.greatest:
        yield (
            f"{files_of(measured)}: the force extrapolates to {offset:.3g}"
            " N at zero pressure, where a muscle does not pull: the zero of the force sensor, or"
            f" that of the pressure, is probably wrong. {_REMEDY}"
        )


def _is_constant(slack: BenchRows) -> bool:
    """Whether a slack muscle reads the same negative force at several lengths, and not the limit of
    the sensor.
    """
    low, high = limits(slack.force)
    at_limit = float(np.mean(slack.force == np.min(slack.force))) > 0.5
    return (
        not at_limit
        and high - low < COMPRESSED * -low
        and float(np.ptp(slack.contraction)) > of_bench.MIN_RANGE
    )
