"""Sizing of the muscles of a catalogue for a requirement, and its result: ranked choices, reasons
for all others.
"""

import contextlib
import dataclasses
import functools
import itertools
import warnings
from collections.abc import Callable, Iterable
from typing import Any

from ...bench.reported import Reported
from ...core import AirmuscleError, AirmuscleWarning, ParameterError, SolveError, cite
from ...engine.distribution import DistributedCalls
from ...engine.processes import Workers, process_pool
from ...files.library import Entry, list_products, load_law, products_of_laws
from ...report.chapter import Chapter, Table, TableColumn
from . import JointRequirement, MuscleChoice, Requirement, SizingConditions, by_air, choose
from .requirement_and_choice import SortKey, rank
from .scenario import MOVING, SizingScenario, scenario_valves
from .tables import air_table, end_point_table, product_of, product_table, sizing_plot, valve_table

BISECTIONS = 7
"""Bisections of the fraction of a load or a stroke that can be reached, for a message (chosen)."""
SHORT_UNSUITABLE = 3
"""Rows of the brief view (chosen)."""
DISAGREEMENT = 2.0
"""Ratio of the lengths by the laws of one product from which they are said to contradict one
another (chosen)."""


@dataclasses.dataclass(frozen=True)
class UnsuitableMuscle:
    """A muscle that does not meet a requirement: the number that was tried, 0 for an unusable law,
    and the reason.
    """

    name: str
    count: int
    reason: str


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class SizingResult(Reported):
    """Choices of muscles for a requirement, best first, and the muscles that do not meet it, with
    reasons.
    """

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
        """Raise SolveError if no muscle meets the requirement; the message states what can be
        reached.
        """
        if not self.choices:
            raise SolveError(self._shortfall())

    def chapter(self, scenario: SizingScenario | None = None) -> Chapter:
        """The description of the result; `scenario` is that which is written with it.

        Of a result without a choice it states what can be reached.
        """
        title = (
            f"Muscles for {self.requirement.describe()}, supply"
            f" {self.conditions.supply / 1e5:.4g} bar"
        )
        unsuitable = self._unsuitable()
        settings = self._settings()
        if not self.choices:
            reason = self._shortfall()
            return Chapter(
                "sizing", title, reason[0].upper() + reason[1:], tables=unsuitable, chosen=settings
            )
        best = self.best
        simulated = None if scenario is None else scenario.choice
        laws = (best.entry.characteristic, best.conditions.ambient, *scenario_valves(simulated))
        tables = product_table(self.choices), end_point_table(self.choices), air_table(self.choices)
        valves = () if simulated is None else (valve_table(simulated),)
        return Chapter(
            "sizing",
            title,
            self._summary(),
            tables=(*tables, *valves, *unsuitable),
            plots=(sizing_plot(best),),
            notes=() if scenario is None or not scenario.note else (scenario.note,),
            references=(*best.entry.references, *cite(laws)),
            chosen=(*settings, *_valve_settings(simulated)),
        )

    def _shortfall(self) -> str:
        """The reasons of a result without a choice, and what can be reached."""
        reasons = "; ".join(f"{item.name}: {item.reason}" for item in self.unsuitable[:3])
        more = f"; and {len(self.unsuitable) - 3} more" if len(self.unsuitable) > 3 else ""
        usable = {item.name for item in self.unsuitable if item.count}
        entries = [entry for entry in self.entries if entry.name in usable]
        parts = [text for what in ("load", "travel") if (text := self._greatest(what, entries))]
        reachable = f"Reachable: {' or '.join(parts)}."
        return (
            f"no muscle meets the requirement of {self.requirement.describe()}: {reasons}{more}. "
            + (
                reachable
                if parts
                else "Change the requirement or the conditions, or give other muscles."
            )
        )

    def _greatest(self, what: str, entries: list[Entry]) -> str:
        """The largest fraction of a load or travel that an entry reaches, by bisection, as text;
        empty if none.
        """
        best: MuscleChoice | None = None
        low = 0.0
        high = 1.0
        for _ in range(BISECTIONS):
            fraction = 0.5 * (low + high)
            choice = None
            for entry, count in itertools.product(
                entries, (self.conditions.max_count, self.conditions.min_count)
            ):
                with contextlib.suppress(AirmuscleError):
                    choice = choose(
                        entry, self.requirement.reduced(**{what: fraction}), self.conditions, count
                    )
                    break
            low, high, best = (low, fraction, best) if choice is None else (fraction, high, choice)
        if best is None:
            return ""
        size = f"{best.total_count} x {best.entry.name} of {1e3 * best.length:.4g} mm"
        return f"{best.requirement.describe()} ({size})"

    def _summary(self) -> str:
        best = self.best
        product = product_of(self.best)
        side = (
            " (half of them on each side)" if isinstance(best.requirement, JointRequirement) else ""
        )
        others = [
            each
            for each in self.choices[1:]
            if product_of(each) == product and each.count == best.count
        ]
        by_law = "" if product == best.entry.name else f" by the law {best.entry.name}"
        spread = _spread(best, others)
        return (
            f"The best choice is {best.total_count} x {product}{side}, nominal length"
            f" {1e3 * best.length:.4g} mm{by_law}: the first of the ranking, at the shortest"
            f" length with which it reaches both end points.{spread}"
        )

    def _unsuitable(self) -> tuple[Table, ...]:
        """The muscles that do not meet the requirement, with the reason."""
        if not self.unsuitable:
            return ()
        columns: dict[str, Any] = {
            "muscle": [item.name for item in self.unsuitable],
            "maximum number tried": TableColumn(
                [item.count or None for item in self.unsuitable], short="number"
            ),
            "reason": [item.reason for item in self.unsuitable],
        }
        return (
            Table(
                "unsuitable",
                "Muscles that do not meet the requirement",
                columns,
                brief=SHORT_UNSUITABLE,
            ),
        )

    def _settings(self) -> tuple[tuple[str, str, str], ...]:
        conditions = self.conditions
        rows = {
            "safety_factor": ("safety factor on the load", f"{conditions.safety_factor:.4g}"),
            "cycle_time": ("cycle time", f"{conditions.cycle_time:.4g} s"),
            "min_pressure": (
                "minimum working pressure",
                f"{conditions.min_pressure / 1e5:.4g} bar",
            ),
            "max_count": ("maximum number in parallel", str(conditions.max_count)),
        }
        sources = {
            name: (
                "chosen"
                if getattr(conditions, name) == getattr(SizingConditions, name)
                else "given"
            )
            for name in rows
        }
        supply = "supply pressure", f"{conditions.supply / 1e5:.4g} bar", "given"
        return (supply, *((*row, sources[name]) for name, row in rows.items()))


def _spread(best: MuscleChoice, others: list[MuscleChoice]) -> str:
    """The lengths by the other laws of a product, in words: an uncertainty where they agree
    within DISAGREEMENT, each with its law where they do not.
    """
    if not others:
        return ""
    lengths = [each.length for each in (best, *others)]
    if max(lengths) < DISAGREEMENT * min(lengths):
        among = [1e3 * each.length for each in others]
        ends = " to ".join(dict.fromkeys(f"{end:.4g}" for end in (min(among), max(among))))
        return (
            f" The other published laws of this product give {ends} mm: the spread is the"
            " uncertainty of the models, not a choice between muscles."
        )
    each_law = ", ".join(f"{each.entry.name} {1e3 * each.length:.4g} mm" for each in others)
    return (
        f" The published laws of this product contradict one another: {each_law}. This is no"
        " uncertainty of one model; measure a muscle at its end points before you order."
    )


def catalogue() -> tuple[Entry, ...]:
    """Entries of the library whose maker states permitted values and that have no restriction of
    use.
    """
    entries = (load_quietly(name) for name, product in products_of_laws().items() if product)
    return tuple(entry for entry in entries if not entry.warning)


@functools.cache
def load_quietly(name: str) -> Entry:
    """A law of the library or of a file, without its warning. Raises UnknownNameError or
    FileError.
    """
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", AirmuscleWarning)
        return load_law(name)


def size_muscles(
    requirement: Requirement,
    conditions: SizingConditions,
    muscles: Iterable[Entry] | None = None,
    sort: SortKey = by_air,
    progress: Callable[[float], None] | None = None,
    workers: Workers = 1,
) -> SizingResult:
    """The muscles that meet a requirement, each at its shortest length, and the others with the
    reason.

    `muscles` are library entries; by default those of `catalogue`. Each is tried with
    `conditions.min_count` to `conditions.max_count` muscles in parallel; a number is a choice if
    fewer muscles are longer or take more air. `sort` is the criterion of the ranking, `progress` is
    called with the fraction done, `workers` the number of processes, as in `compare`. Raises
    ParameterError for other arguments.
    """
    if not isinstance(requirement, Requirement) or not isinstance(conditions, SizingConditions):
        raise ParameterError(
            "size_muscles: give a LiftRequirement or a JointRequirement, and SizingConditions;"
            f" these are {type(requirement).__name__} and {type(conditions).__name__}."
        )
    entries = catalogue() if muscles is None else tuple(muscles)
    if not entries or not all(isinstance(entry, Entry) for entry in entries):
        raise ParameterError(
            "size_muscles: muscles must be one or more library entries; load them with"
            " am.load(NAME)."
        )
    choices: list[MuscleChoice] = []
    unsuitable: list[UnsuitableMuscle] = []
    report = progress or (lambda fraction: None)
    with process_pool(workers) as executor:
        calls = DistributedCalls(executor, _choices_of, (requirement, conditions))
        of_entries = calls.results(entries, lambda done: report(done / len(entries)))
    for choices_of_entry, failed in of_entries:
        choices += choices_of_entry
        unsuitable += [] if choices_of_entry else [failed]
    unsuitable.sort(key=lambda item: item.count == 0)
    known = products_of_laws().values()
    without_law = [name for name in list_products() if name not in known] if muscles is None else []
    unsuitable += [
        UnsuitableMuscle(name, 0, "no law of this product is published") for name in without_law
    ]
    return SizingResult(requirement, conditions, rank(choices, sort), tuple(unsuitable), entries)


def _choices_of(
    sizing: tuple[Requirement, SizingConditions], entry: Entry
) -> tuple[list[MuscleChoice], UnsuitableMuscle]:
    """The choices of an entry, each better than those with fewer muscles, and why the greatest
    number does not do.
    """
    requirement, conditions = sizing
    choices: list[MuscleChoice] = []
    failed = UnsuitableMuscle(entry.name, 0, "")
    for count in range(conditions.min_count, conditions.max_count + 1):
        try:
            choice = choose(entry, requirement, conditions, count)
        except AirmuscleError as error:
            reason = str(error).removeprefix(f"{entry.name}: ").rstrip(".")
            failed = UnsuitableMuscle(
                entry.name, count if isinstance(error, SolveError) else 0, reason
            )
        else:
            shorter = [other for other in choices if other.length <= choice.length * (1.0 + 1e-9)]
            if all(
                choice.air is not None and other.air is not None and other.air > choice.air
                for other in shorter
            ):
                choices.append(choice)
    return choices, failed


def _valve_settings(simulated: MuscleChoice | None) -> tuple[tuple[str, str, str], ...]:
    names = ("fill", "discharge")
    source = (
        f"ISO 6358, for {100 * MOVING:.4g} % of the cycle; this part and the critical pressure"
        " ratio are chosen"
    )
    return tuple(
        (
            f"sonic conductance, {name} valve of each muscle",
            f"{1e8 * valve.conductance:.4g} dm3/(s bar)",
            source,
        )
        for name, valve in zip(names, scenario_valves(simulated), strict=False)
    )
