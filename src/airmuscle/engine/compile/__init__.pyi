from ...core.system import SensitivitySystem as SensitivitySystem
from ...core.system import StateVariable as StateVariable
from ...core.system import System as System
from .function import Function as Function
from .function import derivatives as derivatives
from .functions import Printer as Printer
from .program import Program as Program
from .program import compile_system as compile_system

# isort: split
# For the other packages, not in __all__
from .cache.kernel import Kernel as Kernel
from .function import AugmentedRates as AugmentedRates
from .function import augmented_rates as augmented_rates
from .function import states_and_outputs as states_and_outputs
from .program import CompiledSystem as CompiledSystem
