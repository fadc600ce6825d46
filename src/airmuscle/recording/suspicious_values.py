"""Suspicious values: absolute instead of gauge pressure, reversed signs, offsets and units that no muscle explains.

Such numbers are possible, so that they are read; each gives an AirmuscleWarning with the reason and the remedy. The
recordings of one bench are judged together, because a single run may be slack or at one pressure.
"""

from __future__ import annotations

import itertools
import warnings
from collections.abc import Iterator, Sequence

import numpy as np

from ..core.arrays import Array
from ..core.errors import AirmuscleWarning, UnitError
from ..core.hints import Hint, HintedText
from ..core.units import AMBIENT_PRESSURE, conversion
from .recording import Recording

ATMOSPHERE = (95e3, 106e3)
"""Range of the lowest pressure that may be the atmosphere [Pa] (chosen)."""
SET_POINT, SET_POINT_TOLERANCE = 1e5, 20.0
"""A lowest pressure of 1 bar within this tolerance [Pa] is a set point (chosen)."""
MIN_RISE = 50e3
"""Minimum range of the pressure of a run that begins at ambient pressure [Pa] (chosen)."""
SLACK_FORCE = 0.03
"""Maximum force at ambient pressure, as a fraction of the maximum force (chosen)."""
NEAR_REST = 0.02
"""Contraction near the resting length, at which a muscle under pressure pulls (chosen)."""
MAX_OFFSET = 0.05
"""Maximum negative force, as a fraction of the maximum force (chosen): a muscle cannot push."""
REVERSED = 3.0
"""Ratio of negative to positive values from which a sign is taken for reversed (chosen)."""
MAX_STRETCH = 0.05
"""Maximum elongation by the resting length (chosen)."""
MAX_PRESSURE = 1e6
"""Highest pressure of pneumatic muscles [Pa] (chosen: makers permit 0.6 to 0.8 MPa)."""
AREAS = (1e-7, 5e-2)
"""Range of the maximum force divided by the highest pressure [m2] (chosen: 1e-5 to 1e-2 of muscles on sale)."""
SMALL_CONTRACTION = 0.01
"""Contraction in percent below which the numbers may be ratios (chosen)."""


def warn_of_suspicious_values(recordings: Sequence[Recording]) -> None:
    """Issue an AirmuscleWarning for each kind of suspicious value in the recordings of one bench."""
    measured = [recording for recording in recordings if len(recording)]
    for text in itertools.chain(
        _absolute_pressures(measured), _signs_of_force(measured), _signs_of_contraction(measured), _scales(measured)
    ):
        warnings.warn(AirmuscleWarning(text), stacklevel=3)


def _with(recordings: Sequence[Recording], *names: str) -> list[Recording]:
    return [recording for recording in recordings if all(name in recording for name in names)]


def _limits(values: Array) -> tuple[float, float]:
    """The 1 % and the 99 % quantile, so that a glitch is not judged."""
    low, high = np.nanquantile(values, [0.01, 0.99])
    return float(low), float(high)


def _absolute_pressures(recordings: Sequence[Recording]) -> Iterator[HintedText]:
    unstated = [each for each in _with(recordings, "pressure") if _is_unstated(each)]
    if not unstated:
        return
    first = min(unstated, key=lambda each: float(each["pressure"].min()))
    lowest = float(first["pressure"].min())
    greatest = max((_limits(each["force"])[1] for each in _with(recordings, "force")), default=0.0)
    is_set = abs(lowest - SET_POINT) <= SET_POINT_TOLERANCE
    if is_set or not ATMOSPHERE[0] <= lowest <= ATMOSPHERE[1] or not _begins_at_ambient(first, greatest):
        return
    yield HintedText(
        f"{first.origin}: the lowest pressure of all files is {lowest / 1e3:.4g} kPa, as that of the atmosphere "
        f"({AMBIENT_PRESSURE / 1e3:.4g} kPa), and the muscle does not pull there. It is read as gauge pressure, but "
        f"may be absolute: the unit is then '{first.units['pressure']}(a)'.",
        Hint("To state the unit", "units", {"pressure": ...}, "read"),
    )


def _begins_at_ambient(recording: Recording, greatest: float) -> bool:
    """Whether the muscle does not pull at the lowest pressure: at the start of a rise, or near its resting length."""
    low, high = _limits(recording["pressure"])
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


def _signs_of_force(recordings: Sequence[Recording]) -> Iterator[str]:
    forces = {each.origin: _limits(each["force"]) for each in _with(recordings, "force")}
    size = max((abs(value) for pair in forces.values() for value in pair), default=0.0)
    greatest = max((high for _, high in forces.values()), default=0.0)
    for origin, (low, high) in forces.items():
        if low < -MAX_OFFSET * size and -low > REVERSED * max(high, 0.0):
            yield (
                f"{origin}: the force is negative, down to {low:.4g} N. The force of a muscle in tension is positive, "
                "and negative rows count as slack: if the sensor counts tension as negative, multiply the column by -1."
            )
            return
    origin, (low, _) = min(forces.items(), key=lambda item: item[1][0], default=("", (0.0, 0.0)))
    if low < -MAX_OFFSET * greatest:
        yield (
            f"{origin}: the force is down to {low:.4g} N, but a muscle cannot push. The sensor has an offset, or "
            "carries a weight: all forces are then wrong by the same amount. Subtract the reading of the slack muscle."
        )


def _signs_of_contraction(recordings: Sequence[Recording]) -> Iterator[str]:
    for each in _with(recordings, "contraction"):
        low, high = _limits(each["contraction"])
        if low < -MAX_STRETCH and -low > REVERSED * max(high, 0.0):
            yield (
                f"{each.origin}: the contraction is down to {100 * low:.3g} %, an elongation that muscles do not bear. "
                "The contraction (L0 - L)/L0 of a shortened muscle is positive: check the resting length, or, if the "
                "column is a strain (L - L0)/L0, multiply it by -1."
            )
            return
        if each.units.get("contraction") == "%" and high - low > 2e-4 and high <= SMALL_CONTRACTION and low > -1e-3:
            yield (
                f"{each.origin}: the contraction changes from {100 * low:.3g} to {100 * high:.3g} % only. If these "
                "numbers are ratios and not percent, state the unit '1'."
            )
            return


def _scales(recordings: Sequence[Recording]) -> Iterator[str]:
    pressures = [(float(np.nanmax(each["pressure"])), each) for each in _with(recordings, "pressure")]
    highest, where = max(pressures, key=lambda pair: pair[0], default=(0.0, None))
    if where is not None and highest > MAX_PRESSURE:
        yield (
            f"{where.origin}: the pressure is up to {highest / 1e3:.4g} kPa, above {MAX_PRESSURE / 1e3:g} kPa, the "
            "highest of pneumatic muscles. Check its unit, and that the columns of pressure and force are not "
            "exchanged."
        )
    forces = [_limits(each["force"])[1] for each in _with(recordings, "pressure", "force")]
    greatest = max(forces, default=0.0)
    varied = any(float(np.ptp(each["pressure"])) > 0.1 * highest for each in _with(recordings, "pressure", "force"))
    if not forces or greatest <= 0 or highest <= 0 or (highest < 1e3 and not varied):
        return
    area = greatest / highest
    if not AREAS[0] <= area <= AREAS[1]:
        yield (
            f"the maximum force, {greatest:.4g} N, divided by the highest pressure, {highest / 1e3:.4g} kPa, is "
            f"{area:.3g} m2; allowed range: {AREAS[0]:g} to {AREAS[1]:g} m2 for pneumatic muscles. The unit of force "
            "or pressure is probably wrong."
        )
