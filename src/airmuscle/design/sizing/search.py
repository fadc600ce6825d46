"""Search of the shortest muscles of one type that meet a requirement."""

import numpy as np

from ...core import AirmuscleError, ParameterError, SolveError, check_whole
from ...files.library import Entry, own_length
from . import MuscleChoice, PullRequirement, Requirement, SizingConditions
from .laws_of_product import with_volume
from .lengths import JointSearch, LiftSearch
from .static_muscle import at_length, least_sufficient, length_range
from .working_range import working_muscle

LENGTHS = 49
"""Lengths that are tried for a law that depends on its length, before the shortest is refined
(chosen).
"""
Search = LiftSearch | JointSearch


def choose(
    entry: Entry, requirement: Requirement, conditions: SizingConditions, count: int = 1
) -> MuscleChoice:
    """The shortest muscles of one type, `count` in parallel (with a joint, on each side), that meet
    a requirement.

    A law without a geometry has that of `with_volume`. Raises SolveError or ParameterError, with
    the reason, if there are none.
    """
    check_whole("choose", "count", count, 1)
    entry, source = with_volume(entry)
    kind = LiftSearch if isinstance(requirement, PullRequirement) else JointSearch
    search: Search = kind(requirement, conditions, count)  # type: ignore[arg-type]
    length = _shortest_length(entry, search, length_range(entry, conditions.max_length))
    muscle = working_muscle(at_length(entry, length), conditions)
    design = search.design(muscle, length)
    if design is None:
        raise SolveError(f"{entry.name}: {search.shortfall(muscle, length)}.")
    choice = MuscleChoice(muscle, length, count, design, requirement, conditions, source)
    limit = conditions.max_diameter
    diameter = choice.diameter
    if limit == SizingConditions.max_diameter:  # no limit was given
        return choice
    if diameter is None:
        raise ParameterError("its diameter is not known, because its law has no geometry")
    if diameter > limit:
        raise ParameterError(
            f"its diameter at the contracted end is {1e3 * diameter:.4g} mm; at most"
            f" {1e3 * limit:.4g} mm is allowed"
        )
    return choice


def _shortest_length(entry: Entry, search: Search, lengths: tuple[float, float]) -> float:
    """The shortest length of the range that suffices, or the largest of the range."""
    low, high = lengths

    def needed(length: float) -> float:
        return search.required_length(working_muscle(at_length(entry, length), search.conditions))

    def suffices(length: float) -> bool:
        try:
            return needed(length) <= length
        except AirmuscleError:
            return False

    if low == high:
        return high
    if not _depends_on_length(entry, search, lengths):
        return float(np.clip(needed(high), low, high))
    previous = low
    for length in np.geomspace(low, high, LENGTHS).tolist():
        if suffices(length):
            return length if length == low else least_sufficient(suffices, previous, length)
        previous = length
    return high


def _depends_on_length(entry: Entry, search: Search, lengths: tuple[float, float]) -> bool:
    """Whether the force at equal pressure and contraction, or its range, depends on the length."""
    if own_length(entry) is None:
        return False
    try:
        first, second = (
            working_muscle(at_length(entry, length), search.conditions) for length in lengths
        )
    except ParameterError:  # the law is not defined for the least length
        return True
    if not np.allclose(first.contraction_range, second.contraction_range, rtol=1e-12, atol=1e-12):
        return True
    grid = np.linspace(*first.contraction_range, 17)
    short, long = (
        np.asarray(muscle.force(muscle.pressure_range[1], grid)) for muscle in (first, second)
    )
    return not np.allclose(short, long, rtol=1e-9, atol=1e-9 * float(np.abs(short).max()))
