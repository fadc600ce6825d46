from .equilibrium import Equilibrium as Equilibrium
from .equilibrium import complete_inputs as complete_inputs
from .equilibrium import find_equilibria as find_equilibria
from .equilibrium import find_equilibrium as find_equilibrium
from .equilibrium import find_equilibrium_of_each as find_equilibrium_of_each

# isort: split
# For the other rooms, not in __all__
from .equilibrium import nearest_equilibrium as nearest_equilibrium
