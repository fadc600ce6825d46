"""Laws of one product: which of them a sizing uses, and why; what the others give is shown beside
it and never averaged.
"""

import dataclasses
import warnings
from collections.abc import Mapping, Sequence

from ...core import AirmuscleWarning, ShortRepr
from ...core.errors import ParameterError
from ...files.library import Entry, entries_of_product, load_law, own_length, products_of_laws
from ...files.library.entry import GEOMETRIC, MAKERS_TABLE, MEASURED
from ...physics.muscle.geometry import Braid
from .requirement_and_choice import MuscleChoice, SizingConditions
from .static_muscle import StaticMuscle
from .working_range import working_muscle

LEAST_COVERAGE = 0.5
"""Part of the working range of a product that a law must cover to come before laws that rest on
less (chosen)."""
DISAGREEMENT = 1.2
"""Ratio of the lengths by two laws of one product from which they contradict each other
(chosen)."""
BRAID_ANGLE = 0.4363323129985824
"""Braid angle [rad] of a product without a known geometry, 25 degrees (chosen)."""
ESTIMATED = "a braid of the nominal diameter with an angle of 25 degrees (chosen)"
RESOLUTION = 6
"""Decimal places of a coverage that decide between two laws."""

UNSIZED = "measurement, length of the specimen not stated"
UNKNOWN = "not stated"
STRENGTHS = (MAKERS_TABLE, MEASURED, UNSIZED, GEOMETRIC, UNKNOWN)
"""What a law rests on, the strongest first: the table of the maker of the product, a measurement of
a specimen whose size is known, one of a specimen whose size is not, a shape without
measurements."""


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class LawOfProduct(ShortRepr):
    """One law of a product in a sizing: what it rests on, how much of the working range of the
    product it covers, and what it gives.

    entry     the law, at the size at which it was published
    product   its product, or the name of the law
    coverage  part of the permitted range of pressure and contraction, within supply and least
              pressure, for which the law is valid; 0 where it cannot be used
    extent    that part in words, or the reason why the law cannot be used
    choices   the shortest muscles by this law, by the number of muscles in parallel
    reasons   why there is no choice with a number
    """

    entry: Entry
    product: str
    coverage: float
    extent: str
    choices: Mapping[int, MuscleChoice]
    reasons: Mapping[int, str]

    @property
    def name(self) -> str:
        """Name of the law."""
        return self.entry.name

    @property
    def strength(self) -> str:
        """What the law rests on, a word of STRENGTHS."""
        entry = self.entry
        measured = {"fitted", "measured"} & set(map(str.strip, entry.provenance.split(",")))
        stated = entry.evidence or (MEASURED if measured else UNKNOWN)
        return UNSIZED if stated == MEASURED and own_length(entry) is None else stated

    @property
    def order(self) -> tuple[bool, int, float, str]:
        """Its place among the laws of the product, the one to use first.

        A law that covers at least LEAST_COVERAGE of the working range comes before one that covers
        less; of these the one that rests on more, then the one that covers more.
        """
        covers = round(self.coverage, RESOLUTION)
        return covers < LEAST_COVERAGE, STRENGTHS.index(self.strength), -covers, self.name

    def describe(self) -> str:
        """What the law rests on, and how much of the working range it covers, as text."""
        length = own_length(self.entry)
        specimen = ""
        if self.strength == MEASURED and length is not None:
            specimen = f" of a specimen of {1e3 * length:.4g} mm"
        return f"{self.strength}{specimen}, {self.extent}"


def sorted_laws(laws: Sequence[LawOfProduct]) -> tuple[LawOfProduct, ...]:
    """The laws by product, in the order of their first one, each product with the law to use
    first.
    """
    of_product: dict[str, list[LawOfProduct]] = {}
    for law in laws:
        of_product.setdefault(law.product, []).append(law)
    return tuple(
        law for group in of_product.values() for law in sorted(group, key=lambda law: law.order)
    )


def coverage_of(entry: Entry, conditions: SizingConditions) -> tuple[float, str]:
    """Part of the working range of the product that a law covers, and its range in words; 0 and
    the reason where the law cannot be used.
    """
    try:
        muscle = working_muscle(entry, conditions)
    except ParameterError as error:
        return 0.0, str(error)
    pressures = _overlap(muscle.pressure_range, _working_pressures(entry, conditions))
    contractions = _overlap(muscle.contraction_range, _working_contractions(muscle))
    low, high = muscle.pressure_range
    first, last = muscle.contraction_range
    extent = (
        f"valid from {low / 1e5:.3g} to {high / 1e5:.3g} bar and from {100 * first + 0.0:.3g} to"
        f" {100 * last:.3g} %, {100 * pressures * contractions:.0f} % of the working range"
    )
    return pressures * contractions, extent


def _working_pressures(entry: Entry, conditions: SizingConditions) -> tuple[float, float]:
    """Pressures [Pa] at which the product may work with the supply."""
    low = conditions.min_pressure
    high = conditions.supply
    if entry.ratings is not None:
        low = max(low, entry.ratings.min_pressure)
        high = min(high, entry.ratings.max_pressure)
    return low, high


def _working_contractions(muscle: StaticMuscle) -> tuple[float, float]:
    """Contractions [1] at which the product may work: to the permitted one, or that of the law."""
    ratings = muscle.entry.ratings
    if ratings is not None and "max_contraction" in ratings.stated:
        return 0.0, ratings.max_contraction
    return 0.0, muscle.contraction_range[1]


def _overlap(inner: tuple[float, float], outer: tuple[float, float]) -> float:
    """Part of the outer range that the inner one covers."""
    width = min(inner[1], outer[1]) - max(inner[0], outer[0])
    return max(width, 0.0) / (outer[1] - outer[0])


def with_volume(entry: Entry) -> tuple[Entry, str]:
    """The entry with a geometry, from which volume and diameter follow, and where it is from.

    A law without one has that of another law of its product, or else a braid of the nominal
    diameter; without these, the entry is unchanged and the text is empty.
    """
    if entry.geometry is not None:
        return entry, f"geometry of the law {entry.name}"
    product = products_of_laws().get(entry.name)
    for name in entries_of_product(product) if product else ():
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", AirmuscleWarning)
            geometry = load_law(name).geometry
        if isinstance(geometry, Braid):
            lent = dataclasses.replace(entry, geometry=geometry)
            return lent, f"geometry of {name}, another law of this product"
    if entry.ratings is not None and entry.ratings.diameter > 0.0:
        diameter = entry.ratings.diameter
        braid = Braid(0.5 * diameter, BRAID_ANGLE, resting_length=10.0 * diameter)
        return dataclasses.replace(entry, geometry=braid), ESTIMATED
    return entry, ""
