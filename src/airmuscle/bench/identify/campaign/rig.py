"""Check that the records of a campaign are of one rig and one type of muscle."""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import numpy as np

from ....core.errors import IdentificationError
from .record import CampaignRecord, RecordKind

LEVEL_TOLERANCE = 0.03
"""Maximum relative difference of two pressures that are one level (chosen)."""
MAX_RATIO = 1.5
"""Maximum ratio of the forces of two records at the same pressure, contraction and length (chosen)."""
MAX_SCALE = 10.0
"""Maximum ratio of the maximum forces by pressure of two isobaric records of one length (chosen)."""
MIN_FORCE = 0.1
"""Minimum force of the compared rows, as a fraction of the maximum force (chosen)."""
REMEDY = "Give the files of one muscle and one rig in a folder of their own"


def check_one_rig(records: Sequence[CampaignRecord]) -> None:
    """Raise IdentificationError where records of one length are of different specimens, or contradict each other."""
    by_length: dict[float, list[CampaignRecord]] = {}
    for record in records:
        if record.kind is not RecordKind.UNUSED and record.resting_length is not None:
            by_length.setdefault(round(record.resting_length, 6), []).append(record)
    for length, own in by_length.items():
        specimens = {str(r.recording.constants["specimen"]) for r in own if "specimen" in r.recording.constants}
        if len(specimens) > 1:
            raise IdentificationError(
                f"the records of {1e3 * length:.4g} mm are of several specimens: {', '.join(sorted(specimens))}. "
                f"{REMEDY}."
            )
        isobaric = [record for record in own if record.kind is RecordKind.ISOBARIC]
        _check_scale(isobaric)
        for one, other in itertools.combinations(isobaric, 2):
            _check_forces(one, other)


def _check_scale(records: Sequence[CampaignRecord]) -> None:
    """Raise IdentificationError where the force by pressure differs by a factor that only a unit explains."""
    scales = [
        (float(np.max(record.recording["force"])) / record.level[1], record)
        for record in records
        if record.level is not None and record.level[1] > 0
    ]
    positive = sorted((pair for pair in scales if pair[0] > 0), key=lambda pair: pair[0])
    if positive and positive[-1][0] > MAX_SCALE * positive[0][0]:
        (low, first), (high, last) = positive[0], positive[-1]
        raise IdentificationError(
            f"the force by pressure of {last.origin} ({_units(last)}) is {high / low:.3g} times that of {first.origin} "
            f"({_units(first)}), at the same length: a unit is wrong, or the files are of different muscles. "
            f"{REMEDY}, or correct the units."
        )


def _units(record: CampaignRecord) -> str:
    units = record.recording.units
    return ", ".join(f"{name} in {units[name]}" for name in ("pressure", "force") if name in units)


def _check_forces(one: CampaignRecord, other: CampaignRecord) -> None:
    if one.level is None or other.level is None:
        return
    pressures = one.level[1], other.level[1]
    if abs(pressures[0] - pressures[1]) > LEVEL_TOLERANCE * max(map(abs, pressures)):
        return
    forces = _forces_at_common_contractions(one, other)
    if forces is None:
        return
    ratio = forces[0] / forces[1]
    if max(ratio, 1.0 / ratio) > MAX_RATIO:
        raise IdentificationError(
            f"{one.origin} and {other.origin} contradict each other: at {pressures[0] / 1e3:.4g} kPa and the same "
            f"contractions their forces are {forces[0]:.4g} and {forces[1]:.4g} N. They are of different muscles or "
            f"rigs, or a unit is wrong. {REMEDY}, or correct the units."
        )


def _forces_at_common_contractions(one: CampaignRecord, other: CampaignRecord) -> tuple[float, float] | None:
    """The mean forces [N] of two records in the range of contraction that both have; None without a common range."""
    columns = [(r.recording["contraction"], r.recording["force"]) for r in (one, other)]
    low = max(float(np.quantile(c, 0.02)) for c, _ in columns)
    high = min(float(np.quantile(c, 0.98)) for c, _ in columns)
    means = []
    for contraction, force in columns:
        rows = (contraction >= low) & (contraction <= high) & (force > MIN_FORCE * force.max())
        if np.count_nonzero(rows) < 5:
            return None
        order = np.argsort(contraction[rows], kind="stable")
        grid = np.linspace(low, high, 40)
        means.append(float(np.mean(np.interp(grid, contraction[rows][order], force[rows][order]))))
    return means[0], means[1]
