"""Static equilibria of a plant for given pressures in its muscles, or given masses of air."""

from .equilibrium import Equilibrium, complete_inputs, find_equilibria, find_equilibrium, find_equilibrium_of_each

__all__ = [
    "Equilibrium",
    "complete_inputs",
    "find_equilibria",
    "find_equilibrium",
    "find_equilibrium_of_each",
]
