"""Checks of the pressure: absolute instead of gauge in all files, in some of them or in isobars, and its limit."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from ...core.errors import Hint, HintedText, UnitError
from ...core.units import AMBIENT_PRESSURE, conversion
from ...recording.recording import Recording
from .bench_rows import BenchRows, file_list, limits, pressure_lines, recordings_with

ATMOSPHERE = (95e3, 106e3)
"""Range of the lowest pressure that may be the atmosphere [Pa] (chosen)."""
SET_POINT, SET_POINT_TOLERANCE = 1e5, 20.0
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
MIN_LEVELS, MIN_RANGE = 3, 0.05
"""Minimum number of contractions at which isobars show the zero, and their minimum range (chosen)."""
ZERO_FORCE_PRESSURES, SMALL_CONTRACTIONS = (93e3, 130e3), 0.4
"""Range of the pressures of zero force of isobars that are absolute [Pa], at contractions below this fraction of the
greatest (chosen): from the atmosphere to what the wall adds. Gauge pressures of zero force begin near 0 and rise."""
_STATE = Hint("To state the unit", "units", {"pressure": ...}, "ColumnMapping")


def check_lowest_pressures(recordings: Sequence[Recording]) -> Iterator[HintedText]:
    """A lowest pressure of all files that is that of the atmosphere, where the muscle does not pull."""
    unstated = [each for each in recordings_with(recordings, "pressure") if _is_unstated(each)]
    if not unstated:
        return
    first = min(unstated, key=lambda each: float(each["pressure"].min()))
    lowest = float(first["pressure"].min())
    if not _is_atmosphere(lowest) or not _begins_at_ambient(first, _greatest_force(recordings)):
        return
    yield HintedText(
        f"{first.origin}: the lowest pressure of all files is {lowest / 1e3:.4g} kPa, as that of the atmosphere "
        f"({AMBIENT_PRESSURE / 1e3:.4g} kPa), and the muscle does not pull there. It is read as gauge pressure, but "
        f"may be absolute: the unit is then '{first.units['pressure']}(a)'.",
        _STATE,
    )


def check_mixed_pressures(recordings: Sequence[Recording]) -> Iterator[HintedText]:
    """Ramps that begin at the atmosphere beside ramps that begin at zero pressure."""
    given = [each for each in recordings_with(recordings, "pressure", "force") if not _states_reference(each)]
    ramps = [each for each in given if np.ptp(each["pressure"]) > MIN_RISE]
    greatest = _greatest_force(recordings)
    lowest = {id(each): float(np.min(each["pressure"])) for each in ramps}
    absolute = [e for e in ramps if _is_atmosphere(lowest[id(e)]) and _begins_at_ambient(e, greatest)]
    gauge = [each for each in ramps if abs(lowest[id(each)]) <= NO_PRESSURE]
    if absolute and gauge:
        yield HintedText(
            f"{file_list([each.origin for each in absolute])}: the pressure begins at "
            f"{lowest[id(absolute[0])] / 1e3:.4g} kPa, that of the atmosphere, and the muscle does not pull there, but "
            f"in {file_list([each.origin for each in gauge])} it begins at {lowest[id(gauge[0])] / 1e3:.3g} kPa: "
            "absolute and gauge pressures are mixed. State the unit of the absolute ones in their headings, 'kPa(a)'."
        )


def check_absolute_isobars(recordings: Sequence[Recording]) -> Iterator[HintedText]:
    """Forces that extrapolate to zero near the atmosphere at every contraction, without a row near zero pressure."""
    unstated = [each for each in recordings_with(recordings, *BenchRows._fields) if not _states_reference(each)]
    rows = BenchRows.of(unstated)
    if not rows.force.size or float(np.min(rows.pressure)) < ATMOSPHERE[0]:
        return
    lines = pressure_lines(rows)
    if len(lines) < MIN_LEVELS or lines[-1].contraction - lines[0].contraction < MIN_RANGE:
        return
    limit = SMALL_CONTRACTIONS * lines[-1].contraction
    small = [line.zero_force_pressure for line in lines if line.contraction < limit]
    (low, high), least = ZERO_FORCE_PRESSURES, min(line.zero_force_pressure for line in lines)
    if len(small) > 1 and low <= least and max(small) <= high:
        yield HintedText(
            f"{file_list([each.origin for each in unstated])}: the force extrapolates to zero at {least / 1e3:.3g} kPa "
            f"or more at every contraction, {max(small) / 1e3:.3g} kPa or less at small ones, near the pressure of the "
            f"atmosphere ({AMBIENT_PRESSURE / 1e3:.4g} kPa). The pressures are probably absolute, but read as gauge.",
            _STATE,
        )


def check_pressure_limit(recordings: Sequence[Recording]) -> Iterator[str]:
    """A pressure above that of pneumatic muscles."""
    pressures = [(float(np.nanmax(each["pressure"])), each.origin) for each in recordings_with(recordings, "pressure")]
    highest, origin = max(pressures, default=(0.0, ""))
    if highest > MAX_PRESSURE:
        yield (
            f"{origin}: the pressure is up to {highest / 1e3:.4g} kPa, above {MAX_PRESSURE / 1e3:g} kPa, the "
            "highest of pneumatic muscles. Check its unit, and that the columns of pressure and force are not "
            "exchanged."
        )


def _greatest_force(recordings: Sequence[Recording]) -> float:
    return max((limits(each["force"])[1] for each in recordings_with(recordings, "force")), default=0.0)


def _is_atmosphere(lowest: float) -> bool:
    """Whether a lowest pressure [Pa] may be that of the atmosphere; 1 bar is a set point."""
    return ATMOSPHERE[0] <= lowest <= ATMOSPHERE[1] and abs(lowest - SET_POINT) > SET_POINT_TOLERANCE


def _begins_at_ambient(recording: Recording, greatest: float) -> bool:
    """Whether the muscle does not pull at the lowest pressure: at the start of a rise, or near its resting length."""
    low, high = limits(recording["pressure"])
    rows = recording["pressure"] <= float(recording["pressure"].min()) + 3e3
    if "force" not in recording:
        return high - low > MIN_RISE
    slack = np.abs(recording["force"]) <= SLACK_FORCE * greatest
    if high - low > MIN_RISE:
        return bool(slack[rows].all())
    near_rest = rows & (np.abs(recording["contraction"]) < NEAR_REST) if "contraction" in recording else rows & False
    return bool(near_rest.any() and slack[near_rest].all())


def _is_unstated(recording: Recording) -> bool:
    """Whether the file does not state gauge or absolute pressure."""
    unit = recording.units.get("pressure")
    try:
        return unit is not None and conversion(unit, "Pa").assumed_gauge
    except UnitError:
        return False


def _states_reference(recording: Recording) -> bool:
    """Whether the file states an absolute or a gauge pressure, which leaves no doubt; False for arrays."""
    return recording.units.get("pressure") is not None and not _is_unstated(recording)
