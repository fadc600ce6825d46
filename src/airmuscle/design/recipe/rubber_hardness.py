"""Young's modulus of rubber from its Shore A hardness, with the spread of the known relations."""

import math
from typing import NamedTuple

from ...core import ParameterError, published

GENT_1958 = published("gent-1958")
QI_2003 = published("qi-2003")
HARDNESSES = (20.0, 80.0)
"""Shore A hardness of the relations (chosen: where both are within a factor of 2)."""
MEGAPASCAL = 1e6


class ModulusRange(NamedTuple):
    """Young's modulus of a rubber [Pa]: least, middle (geometric mean) and greatest value."""

    least: float
    middle: float
    greatest: float


def gent_modulus(hardness: float) -> float:
    """Young's modulus [Pa] from Shore A hardness, E = 0.0981 (56 + 7.62336 S)/(0.137505 (254 - 2.54
    S)) MPa. Reference: Gent (1958).
    """
    force = 0.0981 * (56.0 + 7.62336 * hardness)
    return MEGAPASCAL * force / (0.137505 * (254.0 - 2.54 * hardness))


def ruess_modulus(hardness: float) -> float:
    """Young's modulus [Pa] from Shore A hardness, lg(E/MPa) = 0.0235 S - 0.6403. Reference: Ruess,
    quoted by Qi et al. (2003).
    """
    return float(MEGAPASCAL * 10.0 ** (0.0235 * hardness - 0.6403))


def modulus_of_hardness(hardness: float, tolerance: float = 0.0) -> ModulusRange:
    """Young's modulus [Pa] of rubber of a Shore A hardness, between the relations of Gent and of
    Ruess.

    tolerance  half width of the hardness, as a data sheet states it

    Raises ParameterError outside 20 to 80 Shore A.
    """
    low = hardness - tolerance
    high = hardness + tolerance
    if not (HARDNESSES[0] <= low <= high <= HARDNESSES[1]):
        spread = f" with a tolerance of {tolerance:.3g}" if tolerance else ""
        raise ParameterError(
            f"modulus_of_hardness: hardness is {hardness:.4g} Shore A{spread}; allowed range:"
            f" {HARDNESSES[0]:.3g} to {HARDNESSES[1]:.3g} Shore A. For other rubber give its"
            " Young's modulus."
        )
    least = min(gent_modulus(low), ruess_modulus(low))
    greatest = max(gent_modulus(high), ruess_modulus(high))
    middle = math.sqrt(gent_modulus(hardness) * ruess_modulus(hardness))
    return ModulusRange(least, middle, greatest)
