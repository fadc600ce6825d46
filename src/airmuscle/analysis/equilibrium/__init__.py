"""Where a plant rests: the static states for given pressures in its muscles, or given masses of air."""

from .equilibrium import Equilibrium, find_equilibria, find_equilibrium
from .many import find_equilibrium_of_each
from .statics import given_inputs

__all__ = [
    "Equilibrium",
    "find_equilibria",
    "find_equilibrium",
    "find_equilibrium_of_each",
    "given_inputs",
]
