"""Spreads of the parameters of a plant, and the truths that are drawn from them."""

import dataclasses
import fnmatch
import math
import re
import zlib
from collections.abc import Sequence

import numpy as np

from ...core import Leaf, ParameterError, ShortRepr, check_known, leaves, quantity, with_parameters
from ...files.library import located_errors
from ...physics import Plant

WIDE = 3.0
"""Ratio of two ends of a range above which the logarithm of the parameter is uniform (chosen)."""
SHARE = re.compile(r"\s*(\d+\.?\d*|\.\d+)\s*%\s*")


@dataclasses.dataclass(frozen=True)
class ParameterSpread(ShortRepr):
    """The range from which a parameter of a plant is drawn.

    path       of the parameter, or a pattern with *: all that it names have the same factor
    low, high  of the factor on the present value, or of the value itself [SI]
    relative   whether they are factors

    Values are uniform, and so are their logarithms where the ends differ by more than 3 times.
    """

    path: str
    low: float
    high: float
    relative: bool

    def __post_init__(self) -> None:
        if not (math.isfinite(self.low) and math.isfinite(self.high) and self.low < self.high):
            raise ParameterError(
                f"spread of '{self.path}': {self.low:g} to {self.high:g}; the minimum must be below"
                " the maximum, both finite."
            )

    def drawn(self, seed: int) -> float:
        """The factor, or the value [SI], that belongs to the seed of a truth; other spreads do not
        change it.
        """
        share = np.random.default_rng([seed, zlib.crc32(self.path.encode())]).random()
        if self.low > 0.0 and self.high > WIDE * self.low:
            return float(self.low * (self.high / self.low) ** share)
        return float(self.low + (self.high - self.low) * share)

    def matching(self, plant: Plant) -> list[Leaf]:
        """The parameters of a plant that are drawn. Raises ParameterError where there is none, or
        several with one range of values.
        """
        known = {leaf.path: leaf for leaf in leaves(plant)}
        if "*" not in self.path:
            check_known("spread: the plant has no parameter", self.path, known)
            return [known[self.path]]
        found = [known[path] for path in fnmatch.filter(known, self.path)]
        if not found:
            raise ParameterError(
                f"spread: no parameter of the plant fits '{self.path}'; there are"
                f" {', '.join(known)}."
            )
        if not self.relative:
            raise ParameterError(
                f"spread of '{self.path}': a pattern needs a share of the present values, such as"
                f" '{self.path}=20 %'."
            )
        return found

    def __str__(self) -> str:
        """The path with its range, in SI units or relative to the present value."""
        if self.relative:
            return f"{self.path} x {self.low:.4g} to {self.high:.4g}"
        return f"{self.path} {self.low:.4g} to {self.high:.4g}"


def read_spread(text: str, plant: Plant) -> ParameterSpread:
    """The spread of a text: `mechanism.mass=20 %` or `mechanism.mass=4 kg:7 kg`.

    Raises ParameterError or UnitError that states what is allowed.
    """
    where = f"spread '{text}'"
    path, sign, written = text.partition("=")
    path = path.strip()
    if not (path and sign and written.strip()):
        raise ParameterError(
            f"{where} must be a parameter and its range: 'mechanism.mass=20 %' or"
            " 'mechanism.mass=4 kg:7 kg'."
        )
    if share := SHARE.fullmatch(written):
        part = float(share[1]) / 100.0
        if not 0.0 < part < 1.0:
            raise ParameterError(f"{where}: {share[1]} %; allowed range: more than 0, below 100 %.")
        spread = ParameterSpread(path, 1.0 - part, 1.0 + part, True)
        spread.matching(plant)
        return spread
    first, colon, last = written.partition(":")
    if not colon:
        raise ParameterError(
            f"{where}: '{written.strip()}' is no range; give a share, '20 %', or two values,"
            " '4 kg:7 kg'."
        )
    (leaf,) = ParameterSpread(path, 0.0, 1.0, False).matching(plant)
    ambient = plant.ambient.pressure
    low, high = (
        quantity(end, leaf.declared.unit, ambient=ambient, where=where) for end in (first, last)
    )
    return ParameterSpread(path, low, high, False)


def drawn_truth(plant: Plant, spreads: Sequence[ParameterSpread], seed: int) -> Plant:
    """The plant with the parameters that belong to the seed of a truth.

    Raises ParameterError where a drawn value is outside the declared range.
    """
    values = {leaf.path: leaf.value for leaf in leaves(plant)}
    for spread in spreads:
        drawn = spread.drawn(seed)
        for leaf in spread.matching(plant):
            values[leaf.path] = values[leaf.path] * drawn if spread.relative else drawn
    with located_errors(f"truth {seed}"):
        return with_parameters(plant, list(values.values()))


def read_seeds(text: str, where: str = "truth seeds") -> tuple[int, ...]:
    """The seeds of a text, `1,2,5` or `101-108`. Raises ParameterError."""
    seeds = list[int]()
    for part in filter(None, (part.strip() for part in text.split(","))):
        matched = re.fullmatch(r"(\d{1,9})(?:\s*-\s*(\d{1,9}))?", part)
        first, last = (
            (int(n) for n in (matched[1], matched[2] or matched[1])) if matched else (1, 0)
        )
        if not first <= last < first + 10_000:
            raise ParameterError(
                f"{where}: '{part}' is no seed and no range of at most 10000 seeds, such as"
                " 101-108; give whole numbers with commas between them."
            )
        seeds.extend(range(first, last + 1))
    return tuple(dict.fromkeys(seeds))
