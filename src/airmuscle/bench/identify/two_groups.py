"""Two groups of runs, as of two muscles in one file: levels of the force that differ, and agree within each group."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ...core import Array, Hint, HintedText, listed
from .contradictions import MAX_HYSTERESIS, MIN_DIFFERENCE
from .matched_rows import Block, MatchedRuns, Matches

MIN_GROUPED, MIN_GAP, SPEED_RATIO = 4, 3.0, 1.5
"""Minimum number of runs that are divided into two groups; gap between the groups in standard deviations of the runs of
one group; ratio of the speeds above which it may be the cause (chosen)."""
MAX_PLACES = 80
"""Characters of the recordings of a group that are named (chosen)."""


def two_muscle_notes(matches: Matches) -> list[str]:
    """The remark that the runs fall into two groups, as those of two muscles do; empty if they do not."""
    groups = _two_groups(matches)
    if groups is None:
        return []
    text = (
        f"The runs fall into two groups: their forces differ by {100 * groups.difference:.2g} % at equal pressure and "
        f"contraction, and agree to {100 * groups.scatter:.2g} % within a group ({_places(groups.lower)}; "
        f"{_places(groups.higher)}). Are they two muscles, or has the muscle or a zero changed between them? "
    )
    purpose = "To fit each muscle by itself, write its name in a column, and"
    return [HintedText(text, Hint(purpose, "columns", {"muscle": "specimen"}, "ColumnMapping"))]


class TwoGroups(NamedTuple):
    """Blocks of two levels of force, their relative difference, and the relative standard deviation within them."""

    lower: tuple[Block, ...]
    higher: tuple[Block, ...]
    difference: float
    scatter: float

    @property
    def sides(self) -> tuple[tuple[Block, ...], tuple[Block, ...]]:
        return self.lower, self.higher


def _two_groups(matches: Matches) -> TwoGroups | None:
    """The two levels of force of all runs; None where they are not distinct, or follow direction or speed.

    The levels of the runs of one direction are the least squares solution of their relative differences, divided at
    the widest gap. A drift has no such gap. Hysteresis and friction that grows with the speed raise the force of one
    direction and lower that of the other, so that both directions must give the same groups.
    """
    parts = [
        _levels([m for m in matches.runs if m.first.direction == way and not m.is_unordered]) for way in (1, -1, 0)
    ]
    if all(part is None for part in parts):
        return None
    found = [g for part, least in zip(parts, (MIN_DIFFERENCE, MIN_DIFFERENCE, MAX_HYSTERESIS), strict=True)
             if part and (g := _divided(*part, least))]  # fmt: skip
    if len(found) < sum(part is not None for part in parts) or any(map(_differ_in_speed, found)):
        return None
    if len(found) > 1 and not _agree(*found[:2]):
        return None
    lower, higher = (tuple(block for group in found for block in group.sides[i]) for i in (0, 1))
    return TwoGroups(lower, higher, min(g.difference for g in found), max(g.scatter for g in found))


def _levels(runs: Sequence[MatchedRuns]) -> tuple[list[Block], Array] | None:
    """The blocks of matched runs with their relative levels of force, of mean zero where connected; None for few."""
    blocks = list({id(b): b for each in runs for b in (each.first, each.second)}.values())
    if len(blocks) < MIN_GROUPED:
        return None
    number = {id(block): i for i, block in enumerate(blocks)}
    matrix, ratios = np.zeros((len(runs), len(blocks))), np.zeros(len(runs))
    for i, each in enumerate(runs):
        sides = zip((each.first, each.second), each.pairs.T, strict=True)
        force = sum(block.recording["force"][block.rows[k]] for block, k in sides) / 2.0
        ratios[i] = np.median(each.differences / force)
        matrix[i, [number[id(each.first)], number[id(each.second)]]] = 1.0, -1.0
    return blocks, np.asarray(np.linalg.lstsq(matrix, ratios, rcond=1e-10)[0], dtype=float)


def _divided(blocks: list[Block], levels: Array, least: float) -> TwoGroups | None:
    """The groups on both sides of the widest gap, if it is wider than `least` and three times the scatter."""
    order = np.argsort(levels)
    cut = int(np.argmax(np.diff(levels[order]))) + 1
    parts = order[:cut], order[cut:]
    scatter = float(np.sqrt(np.mean(np.concatenate([levels[part] - levels[part].mean() for part in parts]) ** 2)))
    gap = float(levels[order[cut]] - levels[order[cut - 1]])
    if min(map(len, parts)) < 2 or gap < max(least, MIN_GAP * scatter):
        return None
    lower, higher = (tuple(blocks[i] for i in part) for part in parts)
    return TwoGroups(lower, higher, float(levels[parts[1]].mean() - levels[parts[0]].mean()), scatter)


def _differ_in_speed(groups: TwoGroups) -> bool:
    """Whether the runs of one group are all faster than those of the other."""
    one, other = ([_speed(block) for block in side] for side in groups.sides)
    return min(one) > SPEED_RATIO * max(other) or min(other) > SPEED_RATIO * max(one)


def _speed(block: Block) -> float:
    """Mean rate of the pressure, relative to its maximum, and of the contraction [1/s]; 0 without time."""
    run, rows = block.recording, block.rows
    if "time" not in run:
        return 0.0
    rates = [np.mean(np.abs(np.diff(run[n][rows]))) / np.max(np.abs(run[n])) for n in ("pressure", "contraction")]
    return float(sum(rates) / max(np.median(np.diff(run["time"][rows])), 1e-9))


def _agree(first: TwoGroups, second: TwoGroups) -> bool:
    """Whether the groups of two directions follow each other in the same order in most recordings."""
    one, other = _order(first), _order(second)
    common = one.keys() & other.keys()
    return bool(common) and sum(one[key] == other[key] for key in common) >= 0.8 * len(common)


def _order(groups: TwoGroups) -> dict[int, bool]:
    """Whether the higher group is the later one, or the only one, of each recording, by its identity."""
    rows: dict[int, tuple[list[float], list[float]]] = {}
    for higher, side in enumerate(groups.sides):
        for block in side:
            rows.setdefault(id(block.recording), ([-1.0], [-1.0]))[higher].append(float(np.mean(block.rows)))
    return {key: max(high) > max(low) for key, (low, high) in rows.items()}


def _places(blocks: Sequence[Block]) -> str:
    """The recordings of blocks, with the range of their rows."""
    rows: dict[str, list[int]] = {}
    for block in blocks:
        rows.setdefault(block.recording.origin, []).extend((int(block.rows[0]) + 1, int(block.rows[-1]) + 1))
    return listed([f"{name} rows {min(ends)} to {max(ends)}" for name, ends in rows.items()], MAX_PLACES)
