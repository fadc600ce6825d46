"""Sizing of the muscles of a catalogue for a requirement, and its result: ranked choices, reasons
for all others.
"""

import contextlib
import dataclasses
import functools
import itertools
import warnings
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

from ...bench.reported import Reported
from ...core import AirmuscleError, AirmuscleWarning, ParameterError, SolveError, cite
from ...engine.distribution import DistributedCalls
from ...engine.processes import Workers, process_pool
from ...files.library import Entry, list_products, load_law, products_of_laws
from ...physics.pneumatics import Valve
from ...report.chapter import Chapter, Table, TableColumn
from . import JointRequirement, MuscleChoice, Requirement, SizingConditions, by_area, choose
from .laws_of_product import DISAGREEMENT, LawOfProduct, coverage_of, sorted_laws
from .requirement_and_choice import CRITERIA, SortKey, rank
from .scenario import MOVING, SizingScenario, scenario_valves
from .static_muscle import product_of
from .tables import (
    air_table,
    end_point_table,
    law_table,
    product_table,
    sizing_plot,
    valve_table,
)

BISECTIONS = 7
"""Bisections of the fraction of a load or a stroke that can be reached, for a message (chosen)."""
SHORT_UNSUITABLE = 3
"""Rows of the brief view (chosen)."""


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

    choices  one for each product and number of muscles, by the law of the product that comes first
    entries  all entries that were tried
    laws     all laws that were tried by product, the one that is used first; what the others give
    sort     the criterion of the ranking
    """

    requirement: Requirement
    conditions: SizingConditions
    choices: tuple[MuscleChoice, ...]
    unsuitable: tuple[UnsuitableMuscle, ...]
    entries: tuple[Entry, ...]
    laws: tuple[LawOfProduct, ...] = ()
    sort: SortKey = by_area

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
        is_simulated = scenario is not None and bool(scenario.text)
        valves = scenario_valves(best) if is_simulated else ()
        tables = [product_table(self.choices), end_point_table(self.choices)]
        tables += [air_table(self.choices), *law_table(self.laws, best)]
        tables += [valve_table(best)] if is_simulated else []
        return Chapter(
            "sizing",
            title,
            self._summary(),
            tables=(*tables, *unsuitable),
            plots=(sizing_plot(best),),
            notes=() if scenario is None or not scenario.note else (scenario.note,),
            references=(
                *best.entry.references,
                *cite((best.entry.characteristic, best.conditions.ambient, *valves)),
            ),
            chosen=(*settings, *_valve_settings(valves), *_geometry_setting(best)),
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

    def _summary(self) -> tuple[str, ...]:
        best = self.best
        is_joint = isinstance(best.requirement, JointRequirement)
        side = " (half of them on each side)" if is_joint else ""
        choice = f"The best choice is {best.size}{side}{best.by_law}. {self.reason()}"
        return choice, self.reasons_for_the_law()

    def reason(self) -> str:
        """The criterion by which the best choice is first, and a warning where the laws of its
        product contradict each other.
        """
        best = self.best
        criterion = CRITERIA.get(self.sort, f"the least value of {_name_of(self.sort)}")
        is_area = self.sort is by_area and best.area is not None
        area = f" ({1e4 * (best.area or 0.0):.3g} cm2)" if is_area else ""
        return (
            f"Of all choices it has {criterion}{area}; its length is the shortest with which it"
            f" reaches both end points.{self._disagreement()}"
        )

    @property
    def _laws_of_the_best(self) -> list[LawOfProduct]:
        """The laws of the product of the best choice, the one that is used first."""
        return [law for law in self.laws if law.product == self.best.product]

    def _disagreement(self) -> str:
        """A warning where the laws of the product of the best choice contradict each other, and
        what the choice lacks by the law that asks for the most.
        """
        count = self.best.count
        lengths = {
            law.name: law.choices[count].length
            for law in self._laws_of_the_best
            if count in law.choices
        }
        if len(lengths) < 2:
            return ""
        most = max(lengths, key=lengths.__getitem__)
        factor = lengths[most] / min(lengths.values())
        if factor <= DISAGREEMENT:
            return ""
        lack = lengths[most] - self.best.length
        short = (
            f"this choice is {1e3 * lack:.4g} mm ({100 * lack / lengths[most]:.0f} %) shorter and"
            " by that law does not reach both end points, whatever its reserve"
            if lack > 0.0
            else "this choice has that length"
        )
        return (
            f" The published laws of this product contradict each other by a factor of {factor:.2g}"
            f" in the length. The most conservative, {most}, asks for {1e3 * lengths[most]:.4g} mm:"
            f" {short}. Measure a muscle at its end points before you order."
        )

    def reasons_for_the_law(self) -> str:
        """Which law of the product of the best choice is used and why, and what the others give;
        empty where there is one law.
        """
        if len(self._laws_of_the_best) < 2:
            return ""
        used, *others = self._laws_of_the_best
        by_others = "; ".join(
            f"{law.name} ({law.describe()}) {_given(law, self.best)}" for law in others
        )
        return f"The law used is {used.name}: {used.describe()}. For the same number, {by_others}."

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


def _given(law: LawOfProduct, choice: MuscleChoice) -> str:
    """What a law gives for the product and number of a choice, in words."""
    other = law.choices.get(choice.count)
    return "gives none" if other is None else f"gives {1e3 * other.length:.4g} mm"


def _name_of(sort: SortKey) -> str:
    return getattr(sort, "__name__", type(sort).__name__)


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
    sort: SortKey = by_area,
    progress: Callable[[float], None] | None = None,
    workers: Workers = 1,
) -> SizingResult:
    """The muscles that meet a requirement, each at its shortest length, and the others with the
    reason.

    `muscles` are library entries; by default those of `catalogue`. Of several laws of one product
    the first of `LawOfProduct.order` is used; the others are in `SizingResult.laws`. Each product
    is tried with `conditions.min_count` to `conditions.max_count` muscles in parallel; a number is
    a choice if fewer muscles are longer or take more air. `sort` is the criterion of the ranking,
    `progress` is called with the fraction done, `workers` the number of processes, as in `compare`.
    Raises ParameterError for other arguments.
    """
    if not isinstance(requirement, Requirement) or not isinstance(conditions, SizingConditions):
        raise ParameterError(
            "size_muscles: give a LiftRequirement, a GripperRequirement or a JointRequirement, and"
            f" SizingConditions; these are {type(requirement).__name__} and"
            f" {type(conditions).__name__}."
        )
    entries = catalogue() if muscles is None else tuple(muscles)
    if not entries or not all(isinstance(entry, Entry) for entry in entries):
        raise ParameterError(
            "size_muscles: muscles must be one or more library entries; load them with"
            " am.load(NAME)."
        )
    report = progress or (lambda fraction: None)
    with process_pool(workers) as executor:
        calls = DistributedCalls(executor, _law_of, (requirement, conditions))
        laws = sorted_laws(calls.results(entries, lambda done: report(done / len(entries))))
    choices: list[MuscleChoice] = []
    unsuitable: list[UnsuitableMuscle] = []
    products: set[str] = set()
    for law in laws:
        is_used = law.product not in products and law.coverage > 0.0
        products.add(law.product)
        choices_by_law = _worthwhile(law.choices) if is_used else []
        choices += choices_by_law
        if law.coverage == 0.0 or (is_used and not choices_by_law):
            unsuitable.append(_unsuitable_muscle(law))
    unsuitable.sort(key=lambda item: item.count == 0)
    known = products_of_laws().values()
    without_law = [name for name in list_products() if name not in known] if muscles is None else []
    unsuitable += [
        UnsuitableMuscle(name, 0, "no law of this product is published") for name in without_law
    ]
    ranked = rank(choices, sort)
    return SizingResult(requirement, conditions, ranked, tuple(unsuitable), entries, laws, sort)


def _law_of(sizing: tuple[Requirement, SizingConditions], entry: Entry) -> LawOfProduct:
    """A law with its choices for each number of muscles, or the reasons why there are none."""
    requirement, conditions = sizing
    coverage, extent = coverage_of(entry, conditions)
    choices: dict[int, MuscleChoice] = {}
    reasons: dict[int, str] = {}
    for count in range(conditions.min_count, conditions.max_count + 1):
        try:
            choices[count] = choose(entry, requirement, conditions, count)
        except AirmuscleError as error:
            reason = str(error).removeprefix(f"{entry.name}: ").rstrip(".")
            reasons[count if isinstance(error, SolveError) else 0] = reason
    return LawOfProduct(entry, product_of(entry), coverage, extent, choices, reasons)


def _worthwhile(choices: Mapping[int, MuscleChoice]) -> list[MuscleChoice]:
    """The choices that are shorter, or take less air, than those with fewer muscles."""
    worthwhile: list[MuscleChoice] = []
    for choice in choices.values():
        shorter = [fewer for fewer in worthwhile if fewer.length <= choice.length * (1.0 + 1e-9)]
        if all(
            choice.air is not None and fewer.air is not None and fewer.air > choice.air
            for fewer in shorter
        ):
            worthwhile.append(choice)
    return worthwhile


def _unsuitable_muscle(law: LawOfProduct) -> UnsuitableMuscle:
    """The greatest number that was tried with a law, and why it does not do."""
    if law.coverage == 0.0:
        return UnsuitableMuscle(law.name, 0, law.extent)
    count = max(law.reasons)
    return UnsuitableMuscle(law.name, count, law.reasons[count])


def _valve_settings(valves: Sequence[Valve]) -> tuple[tuple[str, str, str], ...]:
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
        for name, valve in zip(names, valves, strict=False)
    )


def _geometry_setting(choice: MuscleChoice) -> tuple[tuple[str, str, str], ...]:
    if not choice.geometry_source:
        return ()
    return (("volume and outer diameter", "from a geometry", choice.geometry_source),)
