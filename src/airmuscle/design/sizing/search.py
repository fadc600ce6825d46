"""Search of the muscles of a catalogue that meet a requirement, ranked, with the reasons for all others."""

import contextlib
import dataclasses
import functools
import itertools
import warnings
from collections.abc import Callable, Iterable

import numpy as np

from ...core import AirmuscleError, AirmuscleWarning, ParameterError, ShortRepr, SolveError, check_whole
from ...files.library import Entry, list_products, load_law, own_length, products_of_laws
from ...physics.muscle import ElasticSeriesElement
from ...physics.muscle.characteristic import validity_range_of
from . import LiftRequirement, MuscleChoice, Requirement, SizingConditions, StaticMuscle, by_air
from .lengths import JointSearch, LiftSearch
from .requirement_and_choice import SortKey, rank
from .static_muscle import at_length, least_sufficient, length_range

LENGTHS = 49
"""Lengths that are tried for a law that depends on its length, before the shortest is refined (chosen)."""
BISECTIONS = 7
"""Bisections of the fraction of a load or a stroke that can be reached, for a message (chosen)."""
Search = LiftSearch | JointSearch


@dataclasses.dataclass(frozen=True)
class UnsuitableMuscle:
    """A muscle that does not meet a requirement: the number that was tried, 0 for an unusable law, and the reason."""

    name: str
    count: int
    reason: str


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class SizingResult(ShortRepr):
    """Choices of muscles for a requirement, best first, and the muscles that do not meet it, with reasons."""

    requirement: Requirement
    conditions: SizingConditions
    choices: tuple[MuscleChoice, ...]
    unsuitable: tuple[UnsuitableMuscle, ...]
    entries: tuple[Entry, ...]
    """All entries that were tried."""

    @property
    def best(self) -> MuscleChoice:
        """The first choice. Raises SolveError, with what can be reached, if there is none."""
        self.check_reachable()
        return self.choices[0]

    def check_reachable(self) -> None:
        """Raise SolveError if no muscle meets the requirement; the message states what can be reached."""
        if self.choices:
            return
        reasons = "; ".join(f"{item.name}: {item.reason}" for item in self.unsuitable[:3])
        more = f"; and {len(self.unsuitable) - 3} more" if len(self.unsuitable) > 3 else ""
        usable = {item.name for item in self.unsuitable if item.count}
        entries = [entry for entry in self.entries if entry.name in usable]
        parts = [text for what in ("load", "travel") if (text := self._greatest(what, entries))]
        remedy = "Change the requirement or the conditions, or give other muscles."
        raise SolveError(
            f"no muscle meets the requirement of {self.requirement.describe()}: {reasons}{more}. "
            + (f"Reachable: {' or '.join(parts)}." if parts else remedy)
        )

    def _greatest(self, what: str, entries: list[Entry]) -> str:
        """The largest fraction of a load or travel that an entry reaches, by bisection, as text; empty if none."""
        best: MuscleChoice | None = None
        low, high = 0.0, 1.0
        for _ in range(BISECTIONS):
            fraction, choice = 0.5 * (low + high), None
            for entry, count in itertools.product(entries, (self.conditions.max_count, self.conditions.min_count)):
                with contextlib.suppress(AirmuscleError):
                    choice = choose(entry, self.requirement.reduced(**{what: fraction}), self.conditions, count)
                    break
            low, high, best = (low, fraction, best) if choice is None else (fraction, high, choice)
        if best is None:
            return ""
        size = f"{best.total_count} x {best.entry.name} of {1e3 * best.length:.4g} mm"
        return f"{best.requirement.describe()} ({size})"


def catalogue() -> tuple[Entry, ...]:
    """Entries of the library whose maker states permitted values and that have no restriction of use."""
    entries = (load_quietly(name) for name, product in products_of_laws().items() if product)
    return tuple(entry for entry in entries if not entry.warning)


@functools.cache
def load_quietly(name: str) -> Entry:
    """A law of the library or of a file, without its warning. Raises UnknownNameError or FileError."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", AirmuscleWarning)
        return load_law(name)


def size_muscles(
    requirement: Requirement,
    conditions: SizingConditions,
    muscles: Iterable[Entry] | None = None,
    sort: SortKey = by_air,
    progress: Callable[[float], None] | None = None,
) -> SizingResult:
    """The muscles that meet a requirement, each at its shortest length, and the others with the reason.

    `muscles` are library entries; by default those of `catalogue`. Each is tried with `conditions.min_count` to
    `conditions.max_count` muscles in parallel; a number is a choice if fewer muscles are longer or take more air.
    `sort` is the criterion of the ranking, `progress` is called with the fraction done. Raises ParameterError for other
    arguments.
    """
    if not isinstance(requirement, Requirement) or not isinstance(conditions, SizingConditions):
        raise ParameterError(
            "size_muscles: give a LiftRequirement or a JointRequirement, and SizingConditions; these are "
            f"{type(requirement).__name__} and {type(conditions).__name__}."
        )
    entries = catalogue() if muscles is None else tuple(muscles)
    if not entries or not all(isinstance(entry, Entry) for entry in entries):
        raise ParameterError("size_muscles: muscles must be one or more library entries; load them with am.load(NAME).")
    choices: list[MuscleChoice] = []
    unsuitable: list[UnsuitableMuscle] = []
    for done, entry in enumerate(entries):
        if progress is not None:
            progress(done / len(entries))
        choices_of_entry, failed = _choices_of(entry, requirement, conditions)
        choices += choices_of_entry
        unsuitable += [] if choices_of_entry else [failed]
    unsuitable.sort(key=lambda item: item.count == 0)
    known = products_of_laws().values()
    without_law = [name for name in list_products() if name not in known] if muscles is None else []
    unsuitable += [UnsuitableMuscle(name, 0, "no law of this product is published") for name in without_law]
    return SizingResult(requirement, conditions, rank(choices, sort), tuple(unsuitable), entries)


def _choices_of(
    entry: Entry, requirement: Requirement, conditions: SizingConditions
) -> tuple[list[MuscleChoice], UnsuitableMuscle]:
    """The choices of an entry, each better than those with fewer muscles, and why the greatest number does not do."""
    choices: list[MuscleChoice] = []
    failed = UnsuitableMuscle(entry.name, 0, "")
    for count in range(conditions.min_count, conditions.max_count + 1):
        try:
            choice = choose(entry, requirement, conditions, count)
        except AirmuscleError as error:
            reason = str(error).removeprefix(f"{entry.name}: ").rstrip(".")
            failed = UnsuitableMuscle(entry.name, count if isinstance(error, SolveError) else 0, reason)
        else:
            is_dominated = any(
                other.length <= choice.length * (1.0 + 1e-9)
                and (choice.air is None or other.air is None or other.air <= choice.air)
                for other in choices
            )
            choices += [] if is_dominated else [choice]
    return choices, failed


def choose(entry: Entry, requirement: Requirement, conditions: SizingConditions, count: int = 1) -> MuscleChoice:
    """The shortest muscles of one type, `count` in parallel (with a joint, on each side), that meet a requirement.

    Raises SolveError or ParameterError, with the reason, if there are none.
    """
    check_whole("choose", "count", count, 1)
    kind = LiftSearch if isinstance(requirement, LiftRequirement) else JointSearch
    search: Search = kind(requirement, conditions, count)  # type: ignore[arg-type]
    length = _shortest_length(entry, search, length_range(entry, conditions.max_length))
    muscle = static_muscle(at_length(entry, length), conditions)
    design = search.design(muscle, length)
    if design is None:
        raise SolveError(f"{entry.name}: {search.shortfall(muscle, length)}.")
    choice = MuscleChoice(muscle, length, count, design, requirement, conditions)
    limit, diameter = conditions.max_diameter, choice.diameter
    if limit == SizingConditions.max_diameter:  # no limit was given
        return choice
    if diameter is None:
        raise ParameterError("its diameter is not known, because its law has no geometry")
    if diameter > limit:
        raise ParameterError(
            f"its diameter at the contracted end is {1e3 * diameter:.4g} mm; at most {1e3 * limit:.4g} mm is allowed"
        )
    return choice


def static_muscle(entry: Entry, conditions: SizingConditions) -> StaticMuscle:
    """The static muscle of an entry. Raises ParameterError if it has no working range, with the reason."""
    valid = validity_range_of(entry.characteristic, entry.validity_range)
    if valid is None:
        raise ParameterError("no validity range is stated for its law; add [validity_range] to a muscle file")
    if isinstance(entry.series, ElasticSeriesElement):
        raise ParameterError("it has a series spring, of which the sizing does not know the stretch")
    limits = {row.quantity: row for row in entry.ratings.ranges()} if entry.ratings is not None else {}
    rated_pressure, rated_contraction = limits.get("pressure"), limits.get("contraction")
    if rated_pressure is not None and not conditions.supply <= rated_pressure.high * (1 + 1e-9):
        raise ParameterError(
            f"the supply pressure of {conditions.supply / 1e5:.4g} bar exceeds the permitted "
            f"{rated_pressure.high / 1e5:.4g} bar; reduce it"
        )
    low = max(valid.min_pressure, conditions.min_pressure, rated_pressure.low if rated_pressure else -np.inf)
    high = min(valid.max_pressure, conditions.supply)
    if not low < high:
        raise ParameterError(
            f"its law is valid from {valid.min_pressure / 1e5:.4g} to {valid.max_pressure / 1e5:.4g} bar; the working "
            f"range is {conditions.min_pressure / 1e5:.4g} to {conditions.supply / 1e5:.4g} bar"
        )
    ranges = [valid.contraction, entry.characteristic.contraction_range]
    ranges += [entry.geometry.contraction_range] if entry.geometry is not None else []
    ranges += [(rated_contraction.low, rated_contraction.high)] if rated_contraction is not None else []
    contraction = max(r[0] for r in ranges), min(r[1] for r in ranges)
    if not contraction[0] < contraction[1]:
        raise ParameterError("the ranges of contraction of its law and of its maker do not overlap")
    return StaticMuscle(entry, (low, high), contraction)


def _shortest_length(entry: Entry, search: Search, lengths: tuple[float, float]) -> float:
    """The shortest length of the range that suffices, or the largest of the range."""
    low, high = lengths

    def needed(length: float) -> float:
        return search.required_length(static_muscle(at_length(entry, length), search.conditions))

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
        first, second = (static_muscle(at_length(entry, length), search.conditions) for length in lengths)
    except ParameterError:  # the law is not defined for the least length
        return True
    if not np.allclose(first.contraction_range, second.contraction_range, rtol=1e-12, atol=1e-12):
        return True
    grid = np.linspace(*first.contraction_range, 17)
    short, long = (np.asarray(muscle.force(muscle.pressure_range[1], grid)) for muscle in (first, second))
    return not np.allclose(short, long, rtol=1e-9, atol=1e-9 * float(np.abs(short).max()))
