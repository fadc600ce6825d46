from ...core.system import SensitivitySystem as SensitivitySystem
from ...core.system import StateVariable as StateVariable
from ...core.system import System as System
from .function import Function as Function
from .function import derivatives as derivatives
from .functions import Printer as Printer
from .program import Program as Program
from .program import compile_system as compile_system
