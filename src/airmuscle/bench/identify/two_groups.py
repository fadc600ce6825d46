"""Two groups of runs, as of two muscles in one file: levels of the force that differ, and agree within each group."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ...core import Hint, HintedText, listed
from .contradictions import MAX_HYSTERESIS, MIN_DIFFERENCE
from .matched_rows import Block, MatchedRuns, Matches

MIN_GROUPED, MIN_GAP = 4, 3.0
"""Minimum number of runs that are divided; gap of the groups in standard deviations of the runs of a group (chosen)."""
MAX_PLACES = 80
"""Characters of the recordings of a group that are named (chosen)."""


class TwoGroups(NamedTuple):
    """Blocks of two levels of force, the lower one first, their relative difference, and the scatter within."""

    sides: tuple[list[Block], list[Block]]
    difference: float
    scatter: float


def two_muscle_notes(matches: Matches) -> list[str]:
    """The remark that the runs fall into two groups, as those of two muscles do; empty if they do not.

    A drift has no gap between two levels. Hysteresis, and friction that grows with the speed, raise the force of one
    direction of the motion and lower that of the other, so that both directions must give the same groups; static
    points must differ by more than hysteresis.
    """
    runs = [each for each in matches.runs if not each.is_unordered]
    moving = [_two_groups([each for each in runs if each.first.direction == way], MIN_DIFFERENCE) for way in (1, -1)]
    found = [each for each in moving if each is not None]
    if not found and all(each.first.direction == 0 for each in runs):
        found = [each for each in (_two_groups(runs, MAX_HYSTERESIS),) if each is not None]
    elif len(found) < 2 or not _agree(*found):
        return []
    if not found:
        return []
    text = (
        f"The runs fall into two groups: their forces differ by {100 * min(g.difference for g in found):.2g} % at "
        f"equal pressure and contraction, and agree to {100 * max(g.scatter for g in found):.2g} % within a group "
        f"({'; '.join(_places([b for g in found for b in g.sides[i]]) for i in (0, 1))}). Are they two muscles, or has "
        "the muscle or a zero changed between them? "
    )
    purpose = "To fit each muscle by itself, write its name in a column, and"
    return [HintedText(text, Hint(purpose, "columns", {"muscle": "specimen"}, "ColumnMapping"))]


def _two_groups(runs: Sequence[MatchedRuns], least: float) -> TwoGroups | None:
    """The two levels of force of runs; None unless a gap wider than `least` and three times the scatter divides them.

    The levels, of mean zero where matched rows connect them, solve the relative differences by least squares.
    """
    blocks = list({id(b): b for each in runs for b in (each.first, each.second)}.values())
    if len(blocks) < MIN_GROUPED:
        return None
    number = {id(block): i for i, block in enumerate(blocks)}
    matrix, ratios = np.zeros((len(runs), len(blocks))), np.zeros(len(runs))
    for i, each in enumerate(runs):
        ratios[i] = 2.0 * np.median(each.differences / sum(each.forces))
        matrix[i, [number[id(each.first)], number[id(each.second)]]] = 1.0, -1.0
    levels = np.linalg.lstsq(matrix, ratios, rcond=1e-10)[0]
    order = np.argsort(levels)
    gaps = np.diff(levels[order])
    low, high = np.split(order, [int(np.argmax(gaps)) + 1])
    means = float(levels[low].mean()), float(levels[high].mean())
    scatter = float(np.sqrt(np.mean(np.r_[levels[low] - means[0], levels[high] - means[1]] ** 2)))
    if min(low.size, high.size) < 2 or gaps.max() < max(least, MIN_GAP * scatter):
        return None
    return TwoGroups(([blocks[i] for i in low], [blocks[i] for i in high]), means[1] - means[0], scatter)


def _agree(first: TwoGroups, second: TwoGroups) -> bool:
    """Whether the higher group is the later one, or the only one, of the same recordings in both directions."""
    orders = []
    for groups in (first, second):
        rows: dict[int, tuple[list[float], list[float]]] = {}
        for higher, side in enumerate(groups.sides):
            for block in side:
                rows.setdefault(id(block.recording), ([-1.0], [-1.0]))[higher].append(float(np.mean(block.rows)))
        orders.append({key: max(high) > max(low) for key, (low, high) in rows.items()})
    common = orders[0].keys() & orders[1].keys()
    return bool(common) and sum(orders[0][key] == orders[1][key] for key in common) >= 0.8 * len(common)


def _places(blocks: Sequence[Block]) -> str:
    """The recordings of blocks, with the range of their rows."""
    rows: dict[str, list[int]] = {}
    for block in blocks:
        rows.setdefault(block.recording.origin, []).extend((int(block.rows[0]) + 1, int(block.rows[-1]) + 1))
    return listed([f"{name} rows {min(ends)} to {max(ends)}" for name, ends in rows.items()], MAX_PLACES)
