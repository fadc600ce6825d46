"""Where a plant rests: the static states for given pressures in its muscles, or given masses of air."""

from .each import equilibrium_of_each as equilibrium_of_each
from .rest import Rest as Rest
from .rest import equilibria as equilibria
from .rest import equilibrium as equilibrium
from .static import given_inputs as given_inputs
