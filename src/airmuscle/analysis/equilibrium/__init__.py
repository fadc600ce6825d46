"""Where a plant rests: the static states for given pressures in its muscles, or given masses of air."""

from .equilibrium import Rest, equilibria, equilibrium
from .many import equilibrium_of_each
from .statics import given_inputs

__all__ = [
    "Rest",
    "equilibria",
    "equilibrium",
    "equilibrium_of_each",
    "given_inputs",
]
