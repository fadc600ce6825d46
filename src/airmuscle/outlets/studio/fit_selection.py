"""Selection of rows: what the rules of the page leave of a recording."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

import airmuscle as am

from ...bench.segment.outliers import Outlier, kept_rows, leave_out
from ..requests.declaration import RequestError
from .fit_settings import Rule

Mask = npt.NDArray[np.bool_]


def inside(rule: Rule, recording: am.Recording) -> Mask:
    """The rows of a recording that a rule describes, shape (N,)."""
    mask = np.ones(len(recording), dtype=bool)
    if rule.rows is not None:
        mask[:] = False
        mask[slice(*rule.rows)] = True
        return mask
    for name, (low, high) in rule.ranges.items():
        if name not in recording:
            raise RequestError(
                f"{recording.origin}: no column '{name[:40]}', which a selection of rows names.", "rules"
            )
        mask &= (recording[name] >= low) & (recording[name] <= high)
    return mask


def used_rows(recording: am.Recording, rules: Sequence[Rule], outliers: Sequence[Outlier] = ()) -> Mask:
    """The rows of a recording that the rules leave, without outliers, shape (N,). Raises RequestError for an unknown
    column."""
    used = kept_rows(recording, outliers)
    for rule in rules:
        if rule.recordings and recording.origin not in rule.recordings:
            continue
        rows = inside(rule, recording)
        used &= rows if rule.keep else ~rows
    return used


def selected(
    recordings: Sequence[am.Recording], rules: Sequence[Rule], outliers: Sequence[Sequence[Outlier]]
) -> list[am.Recording]:
    """The recordings reduced to the selected rows, with a note on what was left out; without those that are empty.

    The rows of the rules and of the outliers of each recording are those of the file. Raises RequestError if no row is
    left.
    """
    kept = []
    for complete, found in zip(recordings, outliers, strict=True):
        recording = leave_out(complete, found)
        used = used_rows(complete, rules)[kept_rows(complete, found)]
        count = int(np.count_nonzero(~used))
        note = f"{recording.origin}: {count} of {len(recording)} rows are left out, as specified by the user."
        if used.all():
            kept.append(recording)
        elif used.any():
            kept.append(dataclasses.replace(recording.rows(used), notes=(*recording.notes, note)))
    if recordings and not kept:
        raise RequestError("no row is left; remove a selection.", "rules")
    return kept
